"""Distance from its path, on either side, over which a pass of corner and flank stays below a scallop height.

Notation: S contact point, N normal, T cutter axis, n = N.T, V unit across T towards N; d along the path, e = N x d
across it; r corner radius, rho = R - r; K curvature tensor of the surface; h height of the scallop.

Seen along d the cutter is the hull of its corner, a circle of radius rho drawn out by r, and of all above it along T.
In the plane of e and N its lower outline is, at the distance x, y(x) = the largest over phi of
(x sin phi - H(phi)) / cos phi, H the support of the hull in the direction u = -N cos phi + e sin phi,
H = u.(r N + rho V) + r + rho sqrt(1 - (u.T)^2), for all u.T <= 0. Near the path y is the circle of the corner
(``step_over.py``: q its curvature beyond the surface's), beyond the end of the corner it is the straight flank. Two
neighbouring passes meet at h where the one reaches it on its right side and the other on its left. Of a tapered or
barrel cutter H is the support of its profile (``profile.py``), as far up as its flank line has one.
"""

from __future__ import annotations

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.lazy import LateModule
from chipload.planning.impeller.profile import support
from chipload.planning.impeller.scene import Floats
from chipload.planning.impeller.step_over import contact_of, trace_curvature

_scallop_width = LateModule("chipload.planning.impeller._scallop_width")

_PHI = np.radians(np.concatenate([-np.geomspace(80.0, 0.2, 60), [0.0], np.geomspace(0.2, 80.0, 60)]))


def reaches(
    normal: Floats, axis: Floats, along: Floats, curvature: Floats, rho: float, corner: float, scallop: float,
    profiled: CatalogueCutter | None = None,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Distances (c,), (c,) float [mm] from the path, towards e and against it, where the pass is ``scallop`` high.

    At most R; 0 where the cutter does not fit the curvature of the surface. ``profiled``: the cutter where it is
    tapered or a barrel; rho and corner are then of the arc of its contact.
    """
    N, T = normal, axis
    q = trace_curvature(contact_of(N, T, along, curvature), rho, corner)
    d = along - (along * N).sum(axis=1)[:, None] * N
    d /= np.linalg.norm(d, axis=1)[:, None]
    e = np.cross(N, d)
    n = (N * T).sum(axis=1)
    s = np.sqrt(np.clip(1.0 - n * n, 1e-300, None))
    V = (N - n[:, None] * T) / s[:, None]
    k = np.einsum("ci,cij,cj->c", e, curvature, e)
    c1, c2 = (e * (T - n[:, None] * N)).sum(axis=1) / s, (e * np.cross(N, T)).sum(axis=1) / s
    flat = corner * c1**2 + (corner + rho / s) * c2**2 if corner > 0.0 else rho / s * c2**2
    R = rho + corner
    x = np.concatenate([[0.0], np.geomspace(1e-3 * R, R, 80)])
    eT = (e * T).sum(axis=1)
    # beside the fixed slopes that of the flank, u.T = -sin(taper)
    taper = 0.0 if profiled is None else profiled.taper
    steep = np.arctan2(n, np.abs(eT)) - np.arcsin(np.clip(np.sin(taper) / np.hypot(n, eT), 0.0, 1.0))
    flank = np.clip(steep, 0.0, _PHI[-1]) * np.where(eT < 0.0, -1.0, 1.0)
    phi = np.column_stack([np.tile(_PHI, (len(N), 1)), flank])
    cos, sin = np.cos(phi), np.sin(phi)
    uT = -n[:, None] * cos + eT[:, None] * sin
    uV = -s[:, None] * cos + (e * V).sum(axis=1)[:, None] * sin
    H = corner * (1.0 - cos) + rho * (uV + np.sqrt(np.clip(1.0 - uT**2, 0.0, None)))
    H = np.where(uT <= 1e-9, H, np.inf) if profiled is None else support(profiled, -cos, uV, uT)
    # coupled with the curvature along the path: as the circle of the corner is
    with np.errstate(divide="ignore", invalid="ignore"):
        bare = np.where(flat > 0.0, 1.0 / np.where(flat > 0.0, flat, 1.0), np.inf) - k
        scale = np.where((bare > 0.0) & np.isfinite(bare) & np.isfinite(q), q / bare, 1.0)
    ahead, behind = np.empty(len(N)), np.empty(len(N))
    outline = sin, cos, H, 0.5 * k, scale, q, scallop, R
    for sign, out in ((1.0, ahead), (-1.0, behind)):
        _scallop_width.reach_on_side(sign * x, x**2, *outline, out)
    return ahead, behind
