"""Effect of a support on the deflection of a place: the best of some candidates.

Notation: q the loaded place with the force F, s a candidate with the normal n, k stiffness of the support, C_sq
displacement at s per force at q. A support is a spring along n, a change of rank one, so that by Sherman and Morrison

    u_q' = u_q - C_qs n (n . u_s) / (1 / k + n . C_ss n),  with u_s = C_sq F, C_qs = C_sq^T,

with no new factors. The support is assumed to hold in both directions, as a jack that is pressed on.

Reference: [Hager1989].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from chipload.errors import InputError
from chipload.structure.cells.grid import Array
from chipload.structure.cells.workpiece import STATIONS, CellWorkpiece, displacements, line_compliances


@dataclass(frozen=True, eq=False)
class Support:
    """Deflection with each candidate support, one at a time.

    Attributes
    ----------
    before : [mm] deflection of the loaded place without one
    after : (n,) float [mm], with each candidate
    """

    before: float
    after: Array

    @property
    def best(self) -> int:
        """The candidate that lowers the deflection most."""
        return int(np.argmin(self.after))


def support_line(
    work: CellWorkpiece, line: ArrayLike, force: ArrayLike, points: ArrayLike, normals: ArrayLike, stiffness: float
) -> Support:
    """Deflection in the middle of a contact line with a support at each of some points.

    Parameters
    ----------
    line : (2, 3) float [mm]
    force : (3,) float [N]
    points, normals : (n, 3) float [mm], unit
    stiffness : [N/mm] of the support

    Raises
    ------
    InputError
        The stiffness is not above 0, or there is no point.
    """
    if not 0.0 < stiffness < np.inf:
        raise InputError(f"support: stiffness {stiffness:g} N/mm: must be above 0 and finite")
    s, n = (np.asarray(v, dtype=np.float64).reshape(-1, 3) for v in (points, normals))
    if not len(s):
        raise InputError("support: no point to support")
    F, middle = np.asarray(force, dtype=np.float64), np.asarray(line, dtype=np.float64).mean(axis=0)
    spot = np.stack([middle, middle])
    own = line_compliances(work, spot[None])[0, len(STATIONS) // 2]
    across = displacements(work, spot, s)
    at = np.einsum("ni,nij,nj->n", n, line_compliances(work, np.stack([s, s], axis=1))[:, len(STATIONS) // 2], n)
    u = own @ F
    push = np.einsum("ni,nij,j->n", n, across, F) / (1.0 / stiffness + at)
    after = u - np.einsum("nij,ni->nj", across, n) * push[:, None]
    return Support(float(np.linalg.norm(u)), np.linalg.norm(after, axis=1))
