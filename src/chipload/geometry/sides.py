"""Two patches that are the sides of a blade of an impeller or of a wall: turned so that u and v run as they should.

Notation: z axis of rotation, flow against it; u in 0..1 from the leading edge, v from hub to shroud; `plus` faces a
growing angle theta, `minus` a falling one. Of a wall v runs from the clamp to the free edge, and u so that the front
looks towards +y when v is z and u is x.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import Blade, facing

Floats = NDArray[np.float64]

_FEW = np.linspace(0.0, 1.0, 17)


def blade_of(plus: BSplinePatch, minus: BSplinePatch, hub: Revolved, shroud: Revolved, pitch: float) -> Blade:
    """The blade that two patches are the sides of.

    Parameters
    ----------
    plus, minus : either of one blade, or of the two that bound a channel; u and v in any sense
    pitch : angle between two blades [rad]

    Raises
    ------
    InputError
        They are the wrong way round: between them lies more than half of the pitch.
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
    return Blade(facing(plus, 1.0), facing(minus, -1.0))


def wall_of(front: BSplinePatch, back: BSplinePatch, clamp: Callable[[Floats], float]) -> Blade:
    """The sides of a wall, front as `plus`, with v from what is clamped and points of equal u, v opposite each other.

    Parameters
    ----------
    front, back : u and v in any sense
    clamp : distance [mm] of points (n, 3) from what is clamped
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
    """Greatest distance [mm] of a side's foot from the hub in the meridional plane."""
    foot = patch.at(np.linspace(0.0, 1.0, 101), 0.0)
    return float(_distance(foot, hub).max())


def radius_of(blade: Blade) -> float:
    """Greatest radius [mm] of a blade's sides, to about 1e-4 of it."""
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.0, 1.0, 201), _FEW, indexing="ij"))
    return max(float(np.hypot(p.at(u, v)[:, 0], p.at(u, v)[:, 1]).max()) for p in (blade.plus, blade.minus))


def _distance(points: Floats, surface: Revolved) -> Floats:
    """Distance (n,) [mm] of points to a meridian: to the tangent at its nearest point, beyond an end to that end."""
    r, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    s = surface.nearest(r, z)
    away, tangent = np.stack([r, z], axis=-1) - surface.curve(s), surface.curve(s, 1)
    along = (away * tangent).sum(axis=1) / np.linalg.norm(tangent, axis=1)
    beyond = ((s == 0.0) & (along < 0.0)) | ((s == 1.0) & (along > 0.0))
    far = np.linalg.norm(away, axis=1)
    out: Floats = np.where(beyond, far, np.sqrt(np.maximum(far**2 - along**2, 0.0)))
    return out


def _along_the_flow(patch: BSplinePatch, hub: Revolved, shroud: Revolved) -> BSplinePatch:
    """V from hub to shroud, u from the end of greater z."""
    orientations = _orientations(patch)
    off = [
        float(_distance(p.at(_FEW, 0.0), hub).mean() + _distance(p.at(_FEW, 1.0), shroud).mean()) for p in orientations
    ]
    best = orientations[int(np.argmin(off))]
    ahead = best.at(0.0, _FEW)[:, 2].mean() >= best.at(1.0, _FEW)[:, 2].mean()
    return best if ahead else best.reversed(True, False)


def _orientations(patch: BSplinePatch) -> list[BSplinePatch]:
    """The patch with each of its four sides as v = 0."""
    return [p.reversed(False, back) for p in (patch, patch.swapped()) for back in (False, True)]
