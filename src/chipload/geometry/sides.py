"""Orientation of two patches as the sides of a blade of an impeller, or of a wall.

Notation: z is the axis of rotation, the flow enters along -z; u in 0..1 runs from the leading edge, v from hub to
shroud; `plus` faces increasing theta, `minus` decreasing theta. On a wall v runs from the clamp to the free edge, and u
such that the front faces +y if u is along x and v along z.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import Blade, face_patch

Floats = NDArray[np.float64]

_FEW = np.linspace(0.0, 1.0, 17)


def blade_of(plus: BSplinePatch, minus: BSplinePatch, hub: Revolved, shroud: Revolved, pitch: float) -> Blade:
    """The blade with two patches as its sides.

    Parameters
    ----------
    plus, minus : sides of one blade, or of the two blades that bound a channel; u and v in any order and sense
    hub, shroud : surfaces between which the blade stands
    pitch : angle between two blades [rad]

    Raises
    ------
    InputError
        The sides are exchanged: the metal between them fills more than half of the pitch.
    """
    plus, minus = (_along_the_flow(p, hub, shroud) for p in (plus, minus))
    u, v = (x.ravel() for x in np.meshgrid(_FEW, _FEW, indexing="ij"))
    theta = [np.arctan2(p.at(u, v)[:, 1], p.at(u, v)[:, 0]) for p in (plus, minus)]
    apart = np.angle(np.exp(1j * (theta[0] - theta[1])))
    middle = float(np.angle(np.exp(1j * apart).mean()))
    between = middle % pitch
    if between > 0.5 * pitch:
        raise InputError(
            f"metal fills {math.degrees(between):.4g} deg of the pitch of {math.degrees(pitch):.4g} deg from minus to "
            "plus: must be less than half: exchange the sides: plus faces a growing angle about the axis"
        )
    minus = minus.turned(middle - between)
    return Blade(face_patch(plus, 1.0), face_patch(minus, -1.0))


def wall_of(front: BSplinePatch, back: BSplinePatch, clamp: Callable[[Floats], float]) -> Blade:
    """The sides of a wall: front as `plus`, v from the clamp, points of equal u, v opposite each other.

    Parameters
    ----------
    front, back : patches with u and v in any order and sense
    clamp : function that returns the distance [mm] of points (n, 3) from the clamped geometry
    """
    front = min(_orientations(front), key=lambda p: clamp(p.at(_FEW, 0.0)))
    u, v = (x.ravel() for x in np.meshgrid(_FEW, _FEW, indexing="ij"))
    p = front.at(u, v)
    orientations = [q for one in _orientations(back) for q in (one, one.reversed(True, False))]
    back = min(orientations, key=lambda q: float(np.linalg.norm(q.at(u, v) - p, axis=1).mean()))
    along, up = (front.at(*b) - front.at(*a) for a, b in (((0.0, 0.5), (1.0, 0.5)), ((0.5, 0.0), (0.5, 1.0))))
    towards = (p - back.at(u, v)).mean(axis=0)
    if towards @ np.cross(up[0], along[0]) > 0.0:
        return Blade(front, back)
    return Blade(front.reversed(True, False), back.reversed(True, False))


def foot_off(patch: BSplinePatch, hub: Revolved) -> float:
    """Greatest distance [mm] of the foot of a side (v = 0) from the hub in the meridional plane."""
    foot = patch.at(np.linspace(0.0, 1.0, 101), 0.0)
    return float(_distance(foot, hub).max())


def radius_of(blade: Blade) -> float:
    """Greatest radius [mm] of the sides of a blade, with a relative error of about 1e-4."""
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.0, 1.0, 201), _FEW, indexing="ij"))
    return max(float(np.hypot(p.at(u, v)[:, 0], p.at(u, v)[:, 1]).max()) for p in (blade.plus, blade.minus))


def _distance(points: Floats, surface: Revolved) -> Floats:
    """Distance (n,) [mm] of points from the tangent of a meridian at the nearest point, beyond an end from that end."""
    r, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    s = surface.nearest(r, z)
    away, tangent = np.stack([r, z], axis=-1) - surface.curve(s), surface.curve(s, 1)
    along = (away * tangent).sum(axis=1) / np.linalg.norm(tangent, axis=1)
    beyond = ((s == 0.0) & (along < 0.0)) | ((s == 1.0) & (along > 0.0))
    size = np.linalg.norm(away, axis=1)
    out: Floats = np.where(beyond, size, np.sqrt(np.maximum(size**2 - along**2, 0.0)))
    return out


def _along_the_flow(patch: BSplinePatch, hub: Revolved, shroud: Revolved) -> BSplinePatch:
    """The patch with v from hub to shroud and u from the end of greater z."""
    orientations = _orientations(patch)
    off = [
        float(_distance(p.at(_FEW, 0.0), hub).mean() + _distance(p.at(_FEW, 1.0), shroud).mean()) for p in orientations
    ]
    best = orientations[int(np.argmin(off))]
    ahead = best.at(0.0, _FEW)[:, 2].mean() >= best.at(1.0, _FEW)[:, 2].mean()
    return best if ahead else best.reversed(True, False)


def _orientations(patch: BSplinePatch) -> list[BSplinePatch]:
    """The patch in four orientations, with each of its edges as v = 0."""
    return [p.reversed(False, back) for p in (patch, patch.swapped()) for back in (False, True)]
