"""The stability chart over speed and axial depth, and the critical depth of a cut.

Notation: growth = log |mu|; above 0 the cut chatters. The chart is evaluated on every fourth speed and depth; cells
whose corners differ in sign, or whose least |growth| is small against the spread of the corners, are halved; the rest
is interpolated.

The axial depth changes by the upper end of the edge that cuts. A cut whose engagement differs along the edge has no
single depth; the force is then scaled instead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.stability.cuts import DynamicCuts
from chipload.stability.margin import PER_WAVE, largest_multipliers

Floats = NDArray[np.float64]

#: every so many speeds and depths are evaluated first, a power of 2
COARSE = 4
#: a cell is certain where its least |growth| is so many spreads of its corners
CERTAIN = 1.5
#: dimensions of the Krylov space besides two for each mode, and how still |mu| is then
SPARE, STILL = 10, 1e-3
#: least growth that counts
TINY = 1e-9
#: depths at which the critical one is searched first, and evaluations that close in on it
LOOKS, CLOSING = 48, 40


@dataclass(frozen=True, eq=False)
class StabilityChart:
    """Stability chart: growth over spindle speed and axial depth.

    Parameters
    ----------
    speed : (s,) float [rad/s]
    depth : (d,) float [mm], or factors on the force where the engagement differs along the edge
    growth : (s, d) float, log |mu|; above 0 the cut chatters
    evaluated : (s, d) bool; the rest is interpolated
    is_depth : whether ``depth`` is a length
    """

    speed: Floats
    depth: Floats
    growth: Floats
    evaluated: NDArray[np.bool_]
    is_depth: bool

    @property
    def limit(self) -> Floats:
        """Least depth (s,) at which the cut chatters; the greatest depth of the chart where none does.

        Between two depths of the chart it is interpolated.
        """
        out = np.full(len(self.speed), self.depth[-1])
        for i, row in enumerate(self.growth):
            over = np.flatnonzero(row >= 0.0)
            if len(over):
                k = int(over[0])
                out[i] = self.depth[k]
                if k > 0:
                    t = row[k - 1] / (row[k - 1] - row[k])
                    out[i] = self.depth[k - 1] + t * (self.depth[k] - self.depth[k - 1])
        return out


def stability_chart(cut: DynamicCuts, speed: ArrayLike, depth: ArrayLike) -> StabilityChart:
    """Return the stability chart of one cut.

    Parameters
    ----------
    cut : one; its own speed and depth do not count
    speed : (s,) float [rad/s], rising, above 0
    depth : (d,) float, rising, above 0: [mm], or factors on the force, see the module

    Raises
    ------
    InputError
        There are more cuts than one, or a grid is not rising from above 0.
    """
    if len(cut) != 1:
        raise InputError(f"stability chart: {len(cut)} cuts: must be one")
    speeds, depths = (np.asarray(x, dtype=np.float64) for x in (speed, depth))
    for name, grid in (("speeds", speeds), ("depths", depths)):
        if grid.ndim != 1 or len(grid) < 2 or not (grid[0] > 0.0 and (np.diff(grid) > 0.0).all()):
            raise InputError(f"stability chart: {name}: must be two or more numbers that rise from above 0")
    values = np.full((len(speeds), len(depths)), np.nan)
    done = np.zeros(values.shape, dtype=np.bool_)
    step = COARSE
    i, j = _every(len(speeds), step), _every(len(depths), step)
    wanted = np.zeros(values.shape, dtype=np.bool_)
    wanted[np.ix_(i, j)] = True
    while True:
        a, b = np.nonzero(wanted & ~done)
        values[a, b] = _growth(cut, speeds[a], depths[b])
        done |= wanted
        if step == 1:
            break
        step //= 2
        finer_i, finer_j = _every(len(speeds), step), _every(len(depths), step)
        corners = values[np.ix_(i, j)]
        wanted = _unsure(corners, i, j, finer_i, finer_j, values.shape)
        filled = _interpolate_corners(corners, i, j, finer_i, finer_j)
        own = values[np.ix_(finer_i, finer_j)]
        values[np.ix_(finer_i, finer_j)] = np.where(np.isnan(own), filled, own)
        i, j = finer_i, finer_j
    return StabilityChart(speeds, depths, values, done, _has_depth(cut))


def critical_depth(cut: DynamicCuts, deepest: float) -> float:
    """Return the critical depth [mm] of one cut at its speed; ``deepest`` if it is stable up to that depth.

    Stable islands above it are not found. A lobe narrower than a 48th of ``deepest`` may be missed.

    Raises
    ------
    InputError
        The engagement differs along the edge, so that there is no one depth, or ``deepest`` is not above 0.
    """
    if len(cut) != 1 or not _has_depth(cut):
        raise InputError("critical depth: needs one cut whose engagement is the same along the edge")
    if not 0.0 < deepest < math.inf:
        raise InputError(f"critical depth: deepest_mm = {deepest:g}: must be above 0")
    speed = cut.pitch / cut.period

    def growth(depths: Floats) -> Floats:
        found = largest_multipliers(_at_depths(cut, np.repeat(speed, len(depths)), depths))
        return np.log(np.maximum(np.abs(found), TINY))

    depths = np.linspace(0.0, deepest, LOOKS + 1)[1:]
    values = growth(depths)
    over = np.flatnonzero(values >= 0.0)
    if not len(over):
        return deepest
    k = int(over[0])
    high, low = float(depths[k]), float(depths[k - 1]) if k else 0.0
    for _ in range(CLOSING):
        middle = 0.5 * (low + high)
        if growth(np.array([middle]))[0] >= 0.0:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


def _every(count: int, step: int) -> NDArray[np.int64]:
    return np.unique(np.append(np.arange(0, count, step), count - 1))


def _has_depth(cut: DynamicCuts) -> bool:
    return len(cut.rows) == 1


def _at_depths(cut: DynamicCuts, speed: Floats, depth: Floats) -> DynamicCuts:
    """Return the cut at speeds [rad/s] and depths (n,) [mm]."""
    some = cut.chosen(np.zeros(len(depth), dtype=np.int64))
    rows = some.rows.copy()
    rate = (rows[:, 3] - rows[:, 2]) / rows[:, 4]
    rows[:, 3] = rows[:, 2] + rate * depth
    rows[:, 4] = depth
    damped = some.damped.copy()
    if len(damped):
        damped[:, 3:5] = rows[:, 3:5]
    return replace(some, rows=rows, period=cut.pitch / speed, damped=damped)


def _growth(cut: DynamicCuts, speed: Floats, depth: Floats) -> Floats:
    if not len(speed):
        return np.zeros(0)
    if _has_depth(cut):
        some, gain = _at_depths(cut, speed, depth), np.ones(len(depth))
    else:
        some, gain = cut.chosen(np.zeros(len(depth), dtype=np.int64)).at_speeds(cut.pitch / speed), depth
        if len(some.damped):
            damped = some.damped.copy()
            damped[:, 5:8] *= np.repeat(depth, np.diff(some.start))[:, None]
            some = replace(some, damped=damped)
    most = 2 * len(cut.damping) + SPARE
    found = largest_multipliers(some, gain, per_wave=PER_WAVE, most=most, still=STILL)
    return np.log(np.maximum(np.abs(found), TINY))


def _unsure(
    corners: Floats,
    i: NDArray[np.int64],
    j: NDArray[np.int64],
    finer_i: NDArray[np.int64],
    finer_j: NDArray[np.int64],
    shape: tuple[int, ...],
) -> NDArray[np.bool_]:
    """Return the points of the finer grid in cells through which the limit may pass."""
    each = np.stack([corners[:-1, :-1], corners[1:, :-1], corners[:-1, 1:], corners[1:, 1:]])
    low, high = each.min(axis=0), each.max(axis=0)
    unsure = (low * high <= 0.0) | (np.minimum(np.abs(low), np.abs(high)) < CERTAIN * (high - low))
    wanted = np.zeros(shape, dtype=np.bool_)
    for a, b in np.argwhere(unsure).tolist():
        rows = finer_i[(finer_i >= i[a]) & (finer_i <= i[a + 1])]
        columns = finer_j[(finer_j >= j[b]) & (finer_j <= j[b + 1])]
        wanted[np.ix_(rows, columns)] = True
    return wanted


def _interpolate_corners(
    corners: Floats, i: NDArray[np.int64], j: NDArray[np.int64], finer_i: NDArray[np.int64], finer_j: NDArray[np.int64]
) -> Floats:
    """Return bilinear values on the finer grid."""
    along = np.array([np.interp(finer_i, i, column) for column in corners.T])
    return np.array([np.interp(finer_j, j, row) for row in along.T])
