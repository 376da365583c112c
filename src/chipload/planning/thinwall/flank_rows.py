"""Rows over a wall that the flank of the cutter cuts: one axial depth apart, with the cutter's axis along the wall.

Notation: p finish surface, N its normal; D [mm] stock that a pass leaves, (n, m) at the places; b axial depth;
q = p + D N the lower end of the contact line of a row, which reaches b up the wall; t direction of the feed, A the
axis, n the normal of q across both.

Row k leaves D(v_k) from v_k to v_(k+1), so a pass leaves steps. The flank reaches up over the rows before, so D does
not grow with v. D is constant along a row: where it decreased to 0, the deflection would exceed the depth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.lazy import scipy
from chipload.planning.thinwall.blank import FinishSurface
from chipload.planning.thinwall.flank_stock import Pose
from chipload.planning.thinwall.passes import NOTHING, WallPass
from chipload.planning.thinwall.paths import Rows

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FlankSide:
    """One side, with places one axial depth apart up the wall.

    Attributes
    ----------
    surface : (n, m) points; the last ones up it lie on the free edge, where no row is
    u, v : (n,), (m,) float, its parameters
    """

    surface: FinishSurface
    u: Floats
    v: Floats

    def laid(self, p: WallPass, places: tuple[Floats, Floats], posture: Pose) -> tuple[Rows, Floats, Floats]:
        """Rows of a pass, and the parameters (r, s, 2) and the planned depth (r, s) [mm] of their contact lines' lower
        ends.
        """
        low, high = (self._steps(d, places[1]) for d in (p.low, p.high))
        points, normals = self.surface.points, self.surface.normals
        q = points + low[..., None] * normals
        up = _unit(np.gradient(points, axis=1))
        t = np.gradient(q, axis=0)
        t = _unit(t - (t * up).sum(axis=2, keepdims=True) * up)
        n = np.cross(t, up)
        n *= np.sign((n * normals).sum(axis=2, keepdims=True))
        depth = high - low
        # rows from the free edge down, without the edge itself
        q, n, t, up, depth = (np.swapaxes(x[:, -2::-1], 0, 1) for x in (q, n, t, up, depth))
        u = np.broadcast_to(self.u, depth.shape)
        if bool((np.cross(n, t) * up).sum() * float(posture.axis[1]) < 0.0):
            q, n, t, up, depth, u = q[:, ::-1], n[:, ::-1], -t[:, ::-1], up[:, ::-1], depth[:, ::-1], u[:, ::-1]
        place = np.stack([u, np.broadcast_to(self.v[-2::-1, None], u.shape)], axis=-1)
        return Rows(q, n, t, depth > NOTHING, np.ascontiguousarray(up)), place, np.ascontiguousarray(depth)

    def _steps(self, stock: Floats, v: Floats) -> Floats:
        """Stock (n, m) at the places of this side, of that at places v, which is one along each row."""
        return np.tile(scipy.interpolate.PchipInterpolator(v, stock[0])(self.v), (len(self.u), 1))


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))
