"""The stability margin of cuts: the greatest multiplier, and the factor on the force at which it is 1.

Notation: mu the greatest multiplier of the map of one tooth period; |mu| < 1: a disturbance dies out. The margin is the
factor on all cutting coefficients, and for straight teeth on the axial depth, at which |mu| = 1: below 1 the cut
chatters. It is calculated up to :data:`MOST_MARGIN`, which is its value if the cut is stable at every factor tried.
At the margin the eigenvector of mu determines the mode that chatters, and the angle of mu its frequency.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import LateModule
from chipload.processes import cores
from chipload.stability.cuts import DynamicCuts
from chipload.stability.delays import several_multipliers

_tooth_period = LateModule("chipload.stability._tooth_period")

Floats = NDArray[np.float64]

#: greatest margin that is distinguished from a greater one
MOST_MARGIN = 3.0
#: cells of the map in a wave of the fastest mode, and where values are printed
PER_WAVE, PER_WAVE_EXACT = 9.0, 40.0
#: cells in a wave where the first did not do
FINER = (15.0, 25.0)
#: dimensions of the Krylov space besides two for each mode, and how still |mu| is then
SPARE, STILL = 24, 1e-4
#: the same where values are printed
SPARE_EXACT, STILL_EXACT = 60, 1e-10
#: how far the margin of several delays or three directions is closed in
CLOSED = 2e-3
#: cuts that one thread takes at once, and most threads
CHUNK, MOST_THREADS = 32, 8


@dataclass(frozen=True, eq=False)
class StabilityMargins:
    """Stability margins of n cuts, with the modes and frequencies of chatter.

    Parameters
    ----------
    margin : (n,) float, 0 < margin <= :data:`MOST_MARGIN`
    frequency : (n,) float [Hz], of chatter at the margin; 0: the margin is the greatest
    mode : (n,) int, number of the mode that chatters, from 0; -1: none does
    growth : (n,) float, log |mu| of the cut as it is; above 0 it chatters
    """

    margin: Floats
    frequency: Floats
    mode: NDArray[np.int64]
    growth: Floats

    def __len__(self) -> int:
        return len(self.margin)


def largest_multipliers(
    cuts: DynamicCuts,
    gain: ArrayLike = 1.0,
    *,
    per_wave: float = PER_WAVE_EXACT,
    most: int | None = None,
    still: float = STILL_EXACT,
) -> NDArray[np.complex128]:
    """Multiplier of greatest modulus of each cut, of a pair the one above the real axis, (n,) complex; of a tooth
    period, or of a revolution where teeth are not alike.

    Parameters
    ----------
    gain : () or (n,) float, factor on the cutting force
    per_wave : cells of the map in a wave of the fastest mode; the error falls with its fourth power
    most : dimensions of the Krylov space; None: enough to print the value
    still : how little |mu| moves over two dimensions when it ends

    Raises
    ------
    InputError
        An eigenvalue was not found.
    """
    factor = np.array(np.broadcast_to(np.asarray(gain, dtype=np.float64), (len(cuts),)))
    dimension = 2 * len(cuts.damping) + SPARE_EXACT if most is None else most
    if cuts.several:
        found = several_multipliers(cuts, factor, per_wave, dimension, still, share_chunks)
        return np.asarray(found[:, 0] * np.exp(1j * found[:, 1]))
    out = np.zeros((len(cuts), 3))
    pitch = np.full(len(cuts), cuts.pitch)

    def part(first: int, last: int) -> None:
        _tooth_period.multipliers(
            first, last, cuts.start, cuts.rows, cuts.damped, cuts.exponents, cuts.period, pitch, cuts.omega,
            np.array(cuts.damping), cuts.U, factor, per_wave, dimension, still, out,
        )  # fmt: skip

    share_chunks(part, len(cuts))
    if (out[:, 0] < 0.0).any():
        raise InputError("stability: a multiplier was not found: check frequency and damping of the modes")
    return np.asarray(out[:, 0] * np.exp(1j * out[:, 1]))


def stability_margins(cuts: DynamicCuts) -> StabilityMargins:
    """Return the stability margins of cuts; each takes five to ten evaluations of the map.

    Where a cell of the map has no solution or eigenvalues are not found, the cut is evaluated again in finer cells.

    Raises
    ------
    InputError
        An eigenvalue was not found in the finest cells either.
    """
    if cuts.several:
        return _several_margins(cuts)
    out = np.full((len(cuts), 5), -1.0)
    for per_wave in (PER_WAVE, *FINER):
        failed = np.flatnonzero(~(out[:, 0] >= 0.0))
        if not len(failed):
            break
        out[failed] = _margins(cuts if len(failed) == len(cuts) else cuts.chosen(failed), per_wave)
    if not (out[:, 0] >= 0.0).all():
        raise InputError("stability: a multiplier was not found: check frequency and damping of the modes")
    return StabilityMargins(out[:, 0], out[:, 1], out[:, 2].astype(np.int64), out[:, 3])


def _several_margins(cuts: DynamicCuts) -> StabilityMargins:
    """Of several delays or three directions: all cuts together from gain to gain, then bisection and regula falsi."""
    n, teeth = len(cuts), round(math.tau / cuts.pitch) if cuts.uneven else 1
    most = 2 * len(cuts.damping) + SPARE
    last = np.zeros((n, 4))

    def growth(which: NDArray[np.int64], gain: Floats) -> Floats:
        last[which] = several_multipliers(cuts.chosen(which), gain, PER_WAVE, most, STILL, share_chunks)
        return np.asarray(np.log(np.maximum(last[which, 0], _tooth_period.TINY)) / teeth)

    every = np.arange(n)
    at_one = growth(every, np.ones(n))
    low, high = np.ones(n), np.ones(n)
    g_low, g_high = at_one.copy(), at_one.copy()
    stable, count = at_one < 0.0, 0
    for factor in (*_tooth_period.ABOVE.tolist(),):
        which = np.flatnonzero(stable & (g_high < 0.0))
        if len(which):
            low[which], g_low[which] = high[which], g_high[which]
            high[which] = factor
            g_high[which] = growth(which, high[which])
    while count < _tooth_period.DOWN and (g_low >= 0.0).any():
        which = np.flatnonzero(g_low >= 0.0)
        high[which], g_high[which] = low[which], g_low[which]
        low[which] *= _tooth_period.BELOW
        g_low[which] = growth(which, low[which])
        count += 1
    open_ = (g_low < 0.0) & (g_high >= 0.0)
    for k in range(_tooth_period.CLOSING):
        which = np.flatnonzero(open_ & (high - low > CLOSED * high))
        if not len(which):
            break
        a, b, fa, fb = low[which], high[which], g_low[which], g_high[which]
        middle = 0.5 * (a + b) if k % 3 == 2 else (a * fb - b * fa) / (fb - fa)
        middle = np.clip(middle, a + 0.05 * (b - a), b - 0.05 * (b - a))
        value = growth(which, middle)
        up = value >= 0.0
        high[which], g_high[which] = np.where(up, middle, b), np.where(up, value, fb)
        low[which], g_low[which] = np.where(up, a, middle), np.where(up, fa, value)
    margin = np.where(g_high < 0.0, MOST_MARGIN, low)
    found = np.flatnonzero(g_high >= 0.0)
    frequency, mode = np.zeros(n), np.full(n, -1)
    if len(found):
        growth(found, margin[found])
        mode[found] = last[found, 3].astype(np.int64)
        for k in found.tolist():
            omega = float(cuts.omega[k, mode[k]])
            frequency[k] = _tooth_period.chatter_hz(last[k, 1], teeth * float(cuts.period[k]), omega)
    return StabilityMargins(margin, frequency, mode, at_one)


def _margins(cuts: DynamicCuts, per_wave: float) -> Floats:
    """Return the results (n, 5) of the kernel."""
    out = np.zeros((len(cuts), 5))
    pitch = np.full(len(cuts), cuts.pitch)

    def part(first: int, last: int) -> None:
        _tooth_period.margins(
            first, last, cuts.start, cuts.rows, cuts.damped, cuts.exponents, cuts.period, pitch, cuts.omega,
            np.array(cuts.damping), cuts.U, per_wave, 2 * len(cuts.damping) + SPARE, STILL, out,
        )  # fmt: skip

    share_chunks(part, len(cuts))
    return out


def share_chunks(part: Callable[[int, int], None], count: int) -> None:
    """Call ``part(first, last)`` on chunks of ``count`` things in threads."""
    ends = [(k, min(k + CHUNK, count)) for k in range(0, count, CHUNK)]
    threads = min(cores(), MOST_THREADS, len(ends))
    if threads < 2:
        for first, last in ends:
            part(first, last)
        return
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(lambda ab: part(*ab), ends))
