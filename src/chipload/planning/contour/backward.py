"""Backward method: it reshapes the semi-finish pass so that the finish pass has a constant engagement angle.

Notation: O centre path of the finish pass (material on the RIGHT of travel), T tangent, n = Rot(+90 deg) T, kappa its
curvature (positive away from the material), R cutter radius, a* wanted engagement.
P* = O + R (sin a* T - cos a* n) is where the surface left by the pass before must be; O* its parallel at R away from
the material is the centre path of that pass.

Reference: [Uddin2007].
Differs from source: where P* turns away from the material by delta (a line that runs into a concave corner) a cutter of
radius R cannot reach the kink; O* is trimmed there and leaves a fillet, so the engagement overshoots. The source calls
it computational error; it is geometry, is reported, and vanishes with eased joints (:mod:`.blend`).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.contour import Contour
from chipload.geometry.offset import offset

Floats = NDArray[np.float64]

#: a change of direction smaller than this [rad] is no kink
KINK_RAD = 1e-9


def leading_curve(path: Contour, radius: float, engagement: float) -> Contour:
    """P*, the curve of the leading points of a centre path: lines give lines, arcs concentric arcs, O(n).

    Where the path turns on the spot (a kink) the leading point runs round the centre on an arc of radius R.

    Parameters
    ----------
    path : centre path, material on the right
    radius : R [mm]
    engagement : a* [rad]

    Examples
    --------
    Inside a corner of 8 mm with R = 5 and 11.478 deg the centre runs on 3 mm and P* on 8 - 0.0375883 mm:

    >>> p = leading_curve(Contour.circle((0, 0), 3.0), 5.0, math.acos(1 - 0.1 / 5.0))
    >>> float(round(8.0 - p.radii[0], 7))
    0.0375883
    """
    seg = path.segments
    _, t0, _ = path.at(path.knots[:-1])
    turn = seg[:, 6]
    c, s = np.cos(turn), np.sin(turn)
    t1 = np.column_stack([c * t0[:, 0] - s * t0[:, 1], s * t0[:, 0] + c * t0[:, 1]])
    p0 = _lead(seg[:, 0:2], t0, radius, engagement)
    p1 = _lead(seg[:, 2:4], t1, radius, engagement)
    rows = []
    n = len(seg)
    for k in range(n):
        rows.append([*p0[k], *p1[k], *seg[k, 4:6], turn[k]])
        after = (k + 1) % n
        if after == 0 and not path.closed:
            continue
        kink = math.atan2(t1[k, 0] * t0[after, 1] - t1[k, 1] * t0[after, 0], float(t1[k] @ t0[after]))
        if abs(kink) > KINK_RAD:
            rows.append([*p1[k], *p0[after], *seg[k, 2:4], kink])
        else:  # the two leading points differ by rounding only: one joint
            p0[after] = p1[k]
            if after == 0:
                rows[0][0:2] = list(p1[k])
    return Contour(np.array(rows))


def _lead(o: Floats, t: Floats, radius: float, a: float) -> Floats:
    n = np.column_stack([-t[:, 1], t[:, 0]])
    return np.asarray(o + radius * (math.sin(a) * t - math.cos(a) * n))


def pass_before(path: Contour, radius: float, engagement: float) -> tuple[Contour, ...]:
    """O*, the centre path of the pass before, trimmed so that it stays R clear of all of P*.

    Raises
    ------
    InputError
        Nothing is left of it: the wanted engagement is out of reach on this path.
    """
    before = offset([leading_curve(path, radius, engagement)], radius)
    if not before:
        raise InputError(
            f"backward: no semi-finish pass of radius {radius:g} mm keeps the engagement at "
            f"{math.degrees(engagement):.4g} deg here: lower radial_depth_mm or take a smaller cutter"
        )
    return before


def concave_kinks(lead: Contour) -> tuple[Floats, Floats]:
    """Points (k, 2) [mm] where P* turns away from the material at once, and by how much (k,) [rad].

    A cutter of radius R does not reach them: between straight sides it leaves R (1/cos(delta/2) - 1), beside a concave
    arc more.
    """
    after = lead.at(lead.knots[:-1])[1]
    before = -lead.reversed().at(lead.reversed().knots[:-1])[1][::-1]
    before = np.roll(before, 1, axis=0)
    turn = np.arctan2(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0], (before * after).sum(axis=1))
    if not lead.closed:
        turn[0] = 0.0
    kink = turn > KINK_RAD
    return lead.segments[kink, 0:2], turn[kink]
