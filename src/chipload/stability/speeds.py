"""Quiet speeds: the least margin of several cuts over spindle speed, its windows, and the best speed.

Notation: margin as in :mod:`chipload.stability.margin`; at each speed the least over all cuts is used. A window is a
range of the calculated speeds in which it is at least the required margin. The advised speed has the greatest least
margin. If many speeds have it (the greatest margin that is calculated), it is the one farthest from where the margin
falls, then the nearest to the present speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.stability.cuts import DynamicCuts
from chipload.stability.margin import stability_margins

Floats = NDArray[np.float64]

#: margins that differ by less than this are the same
ALIKE = 0.02


@dataclass(frozen=True)
class SpeedWindow:
    """Speeds from ``low`` to ``high`` [rad/s], both calculated; the greatest least margin is ``margin`` at ``best``."""

    low: float
    high: float
    best: float
    margin: float


@dataclass(frozen=True, eq=False)
class QuietSpeeds:
    """Least margins of cuts over spindle speeds.

    Parameters
    ----------
    speed : (s,) float [rad/s]
    margin : (s,) float, least of all cuts
    wanted : required margin
    cut : (s,) int, number of the cut that has it, over all cuts
    """

    speed: Floats
    margin: Floats
    wanted: float
    cut: NDArray[np.int64] | None = None

    @property
    def windows(self) -> tuple[SpeedWindow, ...]:
        """Windows with the required margin, by speed."""
        return speed_windows(self.speed, self.margin, self.wanted)

    def advised(self, present: float) -> tuple[float, float]:
        """Return the advised speed [rad/s] and its least margin.

        >>> found = QuietSpeeds(np.arange(1.0, 8.0), np.array([0.5, 3.0, 3.0, 3.0, 0.9, 3.0, 0.4]), 1.0)
        >>> found.advised(6.0)
        (3.0, 3.0)
        """
        good = self.margin >= self.margin.max() * (1.0 - ALIKE)
        # what lies beyond the searched speeds is not known: it counts as falling
        other = np.concatenate([[-1], np.flatnonzero(~good), [len(good)]])
        far = np.abs(np.arange(len(good))[:, None] - other[None, :]).min(axis=1)
        order = np.lexsort((np.abs(self.speed - present), -far, ~good))
        k = int(order[0])
        return float(self.speed[k]), float(self.margin[k])


def speed_windows(speed: Floats, value: Floats, wanted: float) -> tuple[SpeedWindow, ...]:
    """Return the windows of speeds (s,) in which values (s,) are at least the wanted one, by speed.

    >>> [(w.low, w.high) for w in speed_windows(np.arange(1.0, 6.0), np.array([1.0, 2.0, 2.0, 0.0, 2.0]), 1.5)]
    [(2.0, 3.0), (5.0, 5.0)]
    """
    good = np.concatenate([[False], value >= wanted, [False]])
    edges = np.flatnonzero(np.diff(good.astype(np.int8))).reshape(-1, 2)
    out = []
    for a, b in edges.tolist():
        k = a + int(np.argmax(value[a:b]))
        low, high, best = (float(speed[i]) for i in (a, b - 1, k))
        out.append(SpeedWindow(low, high, best, float(value[k])))
    return tuple(out)


def quiet_speeds(parts: Sequence[DynamicCuts], speed: ArrayLike, wanted: float) -> QuietSpeeds:
    """Return the least margins of cuts at speeds.

    Parameters
    ----------
    parts : cuts; their own speeds do not count
    speed : (s,) float [rad/s], rising, above 0
    wanted : margin above which a speed is quiet

    Raises
    ------
    InputError
        There is no cut, or speeds do not rise from above 0.
    """
    speeds = np.asarray(speed, dtype=np.float64)
    if not sum(map(len, parts)):
        raise InputError("quiet speeds: no cut: no speed to choose")
    if speeds.ndim != 1 or not len(speeds) or not (speeds[0] > 0.0 and (np.diff(speeds) > 0.0).all()):
        raise InputError("quiet speeds: speeds must rise from above 0 rad/s")
    least, own, before = np.full(len(speeds), np.inf), np.zeros(len(speeds), dtype=np.int64), 0
    for cuts in parts:
        if not len(cuts):
            continue
        some = cuts.chosen(np.repeat(np.arange(len(cuts)), len(speeds)))
        some = some.at_speeds(np.tile(cuts.pitch / speeds, len(cuts)))
        found = stability_margins(some).margin.reshape(len(cuts), len(speeds))
        own = np.where(found.min(axis=0) < least, before + found.argmin(axis=0), own)
        least = np.minimum(least, found.min(axis=0))
        before += len(cuts)
    return QuietSpeeds(speeds, least, wanted, own)
