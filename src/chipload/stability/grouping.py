"""Grouping of steps with the same cut, so that a program needs only a few hundred stability calculations.

Steps have the same cut if speed, feed direction and engagement are equal after rounding: immersion outward to 0.1 deg,
positions on the edge to 0.01 mm, the direction to 1 deg, chip thickness to 1 % if the coefficients have exponents
(otherwise it has no effect). Consecutive rows along the edge with one immersion are joined.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.engagement.tooth_engagement import ToothEngagement

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: what is rounded: immersion [rad], place on the edge [mm], direction [rad], chip thickness (relative)
IMMERSION, PLACE, DIRECTION, THICKNESS = math.radians(0.1), 0.01, math.radians(1.0), 0.01
#: rounding errors that are none, in units of what is rounded to
SLACK = 1e-4


@dataclass(frozen=True, eq=False)
class CutGroups:
    """Steps grouped by their cuts.

    Parameters
    ----------
    engagement : rounded, one row for each step, without frames
    T, n : (c, 2) float, rounded feed direction and its normal in x and y
    key : (c,) bytes, the same for steps that are alike
    """

    engagement: ToothEngagement
    T: Floats
    n: Floats
    key: tuple[bytes, ...]

    def __len__(self) -> int:
        return len(self.key)


def group_steps(engagement: ToothEngagement, speed: Floats, powers: bool) -> CutGroups:
    """Return the steps with rounded cuts, and the keys of these cuts.

    Parameters
    ----------
    engagement : with frames, without runout
    speed : (c,) float [rad/s]
    powers : whether the chip thickness counts (coefficients with exponents)
    """
    step = np.repeat(np.arange(len(engagement)), np.diff(engagement.start))
    rows, own = engagement.rows, engagement.slices[engagement.slice]
    low = np.floor(rows[:, 0] / IMMERSION + SLACK)
    high = np.ceil(rows[:, 1] / IMMERSION - SLACK)
    places = np.round(rows[:, 2:4] / PLACE)
    thickness = np.zeros((len(rows), 3))
    if powers:
        size = np.hypot(rows[:, 4], rows[:, 6]) + np.abs(rows[:, 5])
        unit = 10.0 ** np.floor(np.log10(np.maximum(size, 1e-9))) * THICKNESS
        thickness = np.round(rows[:, 4:] / unit[:, None]) * unit[:, None]
    # rows one above the other on the same straight piece of the edge are joined
    foot = own[:, 5] - own[:, 6] * own[:, 0]
    order = np.lexsort((places[:, 0], high, low, step))
    same = np.ones(max(len(rows) - 1, 0), dtype=np.bool_)
    for values in (step, low, high, own[:, 1], own[:, 3], own[:, 4], own[:, 6], *thickness.T):
        same &= values[order][1:] == values[order][:-1]
    same &= np.abs(np.diff(foot[order])) < 1e-9
    same &= places[order, 1][:-1] == places[order, 0][1:]
    first = np.flatnonzero(np.concatenate([[True], ~same])) if len(rows) else np.zeros(0, dtype=np.int64)
    last = np.append(first[1:], len(rows))[: len(first)] - 1
    at, upper = order[first], order[last]
    merged = np.column_stack([low[at], high[at], places[at, 0], places[upper, 1]])
    kept = rows[at].copy()
    kept[:, 0] = np.clip(merged[:, 0] * IMMERSION, 0.0, math.tau)
    kept[:, 1] = np.clip(merged[:, 1] * IMMERSION, kept[:, 0], kept[:, 0] + math.tau)
    kept[:, 2], kept[:, 3] = merged[:, 2] * PLACE, np.maximum(merged[:, 3], merged[:, 2]) * PLACE
    if powers:
        kept[:, 4:] = thickness[at]
    start = np.concatenate([[0], np.cumsum(np.bincount(step[at], minlength=len(engagement)))])
    slices = engagement.slice[at]
    out = ToothEngagement(start, kept, np.full(len(kept), -1), slices, engagement.slices)
    T = engagement.frames[:, 0, :2]
    angle = np.round(np.arctan2(T[:, 1], T[:, 0]) / DIRECTION) % round(math.tau / DIRECTION)
    side = np.sign(np.cross(np.pad(T, ((0, 0), (0, 1))), engagement.frames[:, 1])[:, 2])
    heading = np.column_stack([np.cos(angle * DIRECTION), np.sin(angle * DIRECTION)])
    normal = side[:, None] * np.column_stack([-heading[:, 1], heading[:, 0]])
    range_key = np.column_stack([merged, own[at][:, [1, 3, 4, 6]].round(6), foot[at].round(6), thickness[at]])
    step_key = np.column_stack([np.round(speed, 6), angle, side])
    keys = tuple(step_key[i].tobytes() + range_key[start[i] : start[i + 1]].tobytes() for i in range(len(engagement)))
    return CutGroups(out, heading, normal, keys)
