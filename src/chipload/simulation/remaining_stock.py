"""Which points are in the stock after some steps of a program, and whether a cutter would cut if it went on.

Notation: p tip, A axis, d unit direction of the motion that a cutter makes last. It stands **in the cut** where it
would remove material if it went on by ``AHEAD`` along d: where a point of its envelope, moved on by as much, is in
the initial stock and in no volume that the steps before swept. Points of the envelope are ``INSET`` within it, so that
a wall along which it moved does not count.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.simulation.steps import StepBlocks, Steps

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Inside = Callable[[Floats], Bools]

#: how far a cutter goes on, and how far its points are within its envelope [mm]
AHEAD, INSET = 0.05, 0.002
#: points around the axis, and heights of points above the tip [mm], up to the flutes
AROUND, HEIGHTS = 72, np.array([0.0, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0])
#: places within a step at which its cutter is looked at, and steps that are compared with a place at once
PLACES, STEPS = np.linspace(0.0, 1.0, 5), 2000


@dataclass(frozen=True, eq=False)
class Standstill:
    """A place where a cutter stands.

    Parameters
    ----------
    count : steps of the program before it
    tip, axis : (3,) float [mm], unit axis
    cutter : in the spindle
    direction : (3,) float, unit direction of its last motion; zero: none
    """

    count: int
    tip: Floats
    axis: Floats
    cutter: Cutter
    direction: Floats


def envelope_points(cutter: Cutter, tip: Floats, axis: Floats) -> Floats:
    """Return points (m, 3) [mm] of the envelope of the flutes, ``INSET`` within it, and of the bottom to the axis."""
    heights = HEIGHTS[cutter.flute_length > HEIGHTS]
    radius = np.asarray(cutter.radius_at(heights))
    rings = [(h + INSET, r - INSET) for h, r in zip(heights.tolist(), radius.tolist(), strict=True)]
    # of the bottom: rings from the axis to its edge
    top = float(cutter.radius_at(0.0)) if cutter.bottom == 0.0 else 0.0
    rings += [(INSET, share * (top - INSET)) for share in (0.0, 0.25, 0.5, 0.75)]
    turn = np.arange(AROUND) * (2.0 * np.pi / AROUND)
    across = np.cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.9 else (0.0, 1.0, 0.0))
    across /= np.linalg.norm(across)
    circle = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(axis, across)
    return np.vstack([tip + h * axis + max(r, 0.0) * circle for h, r in rings])


def stands_in(inside: Inside, cutter: Cutter, tip: Floats, axis: Floats) -> bool:
    """Whether a cutter at a place reaches into a stock that nothing was removed from."""
    return bool(inside(envelope_points(cutter, tip, axis)).any())


def in_cut(
    places: Sequence[Standstill], steps: StepBlocks, cutters: Mapping[int, Cutter], inside: Inside
) -> tuple[bool, ...]:
    """Return whether each cutter stands in the cut; O(n) for n steps, and more for those that come near.

    Parameters
    ----------
    steps : of the program
    cutters : by tool
    inside : which points (m, 3) are in the initial stock
    """
    left = []
    for place in places:
        points = envelope_points(place.cutter, place.tip, place.axis) + AHEAD * place.direction
        left.append(points[inside(points)] if place.direction.any() else np.zeros((0, 3)))
    first, most = 0, max((place.count for place in places), default=0)
    for block in steps:
        if first >= most or not any(map(len, left)):
            break
        for k, place in enumerate(places):
            if len(left[k]):
                count = min(max(place.count - first, 0), len(block))
                left[k] = left[k][~_swept(left[k], block, count, cutters)]
        first += len(block)
    return tuple(len(points) > 0 for points in left)


def _swept(points: Floats, steps: Steps, count: int, cutters: Mapping[int, Cutter]) -> Bools:
    """Which points (m, 3) are in the volume that the first ``count`` of some steps swept."""
    out = np.zeros(len(points), dtype=np.bool_)
    low, high = points.min(axis=0), points.max(axis=0)
    for number in np.unique(steps.tool[:count]).tolist():
        cutter = cutters.get(number)
        if cutter is None or cutter.body:
            continue
        reach = cutter.flute_length + float(np.max(cutter.radius_at(np.array([cutter.flute_length])), initial=0.0))
        reach = max(reach, cutter.radius)
        p0, p1 = steps.p0[:count], steps.p1[:count]
        near = (np.minimum(p0, p1) - reach <= high).all(axis=1) & (np.maximum(p0, p1) + reach >= low).all(axis=1)
        rows = np.flatnonzero(near & (steps.tool[:count] == number))
        for at in range(0, len(rows), STEPS):
            some = rows[at : at + STEPS]
            for u in PLACES:
                tip = p0[some] + u * (p1[some] - p0[some])
                axis = steps.a0[some] + u * (steps.a1[some] - steps.a0[some])
                axis /= np.linalg.norm(axis, axis=1)[:, None]
                arm = points[None, :, :] - tip[:, None, :]
                height = np.einsum("nmi,ni->nm", arm, axis)
                across = np.sqrt(np.maximum((arm**2).sum(axis=2) - height**2, 0.0))
                within = (height >= 0.0) & (height <= cutter.flute_length)
                out |= (
                    within & (across < cutter.radius_at(np.maximum(height, 0.0).ravel()).reshape(height.shape))
                ).any(axis=0)
    return out
