"""The boundary construction diagram: theta around the section, time t, and all candidate boundaries of the area.

Notation: V(theta, t) speed of the section's edge outward. Candidates are the curves V = 0, the row t = 0 where
V < 0 and the row t = 1 where V > 0; those that bound the covered area are a part of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.covered import CoveredArea, candidates, covered
from chipload.engagement.chips.move import Move
from chipload.engagement.chips.section import cutter_numbers
from chipload.lazy import LateModule

_section = LateModule("chipload.engagement.chips._section")

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Diagram:
    """Data of the diagram for its figure.

    Parameters
    ----------
    edges : (n, 12) all candidates, as in :mod:`chipload.engagement.chips.ring`
    covered : the boundary that is kept; None where the layer isn't cut
    theta : (k,) float [rad], t : (m,) float
        Grid of ``V``.
    V : (m, k) float [mm per unit of t], NaN where the layer isn't cut
    corners : (j, 2) theta [rad] and t of the corners of the section on the grid's times
    """

    edges: Floats
    covered: CoveredArea | None
    theta: Floats
    t: Floats
    V: Floats
    corners: Floats


def diagram(
    move: Move, cutter: Cutter, height: float, tolerance: float, times: int = 121, angles: int = 181
) -> Diagram:
    """Return the diagram of a move on the layer z = height; O(times angles)."""
    K, S, C, row = cutter_numbers(cutter), np.empty(27), np.empty((8, 5)), np.empty(7)
    t, theta = np.linspace(0.0, 1.0, times), np.linspace(0.0, 2.0 * np.pi, angles)
    V = np.full((times, angles), np.nan)
    corners = []
    for i, at in enumerate(t):
        if _section.instant(move.tip, move.axis, K, float(height), at, S, C):
            V[i] = [_section.point(S, K, angle, row) for angle in theta]
            corners += [(float(angle), float(at)) for angle in C[: int(S[20]), 0]]
    edges = candidates(move, cutter, height, tolerance)
    made = np.array(corners, dtype=np.float64).reshape(-1, 2)
    return Diagram(edges, covered(move, cutter, height, tolerance), theta, t, V, made)
