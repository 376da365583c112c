"""Identification of force coefficients, runout and spindle phase from every force sample over the turn.

Notation: as in :mod:`chipload.cutting.fit`; theta_0 [rad] rotation of tooth 0 at the first sample; f cuts, H harmonics.

Over whole turns the harmonics are orthogonal, so that least squares on the samples is least squares on their
amplitudes:

    c_k = D(k Omega) B_k(e, lambda) x exp(i k theta_0) + zero (k = 0).

x and the zeros are linear: an inner least-squares problem solves them (variable projection). An outer search finds
theta_0 of each cut and the runout. Omega is found first, as the speed whose harmonics contain most of the power.
Harmonics up to a stated band are used, and each channel of each cut is weighted by its own size. Where the dynamometer
rings, w0 and zeta are found from all harmonics, alternating with the rest; intervals take them as known.

Intervals: the covariance has two parts. A strong tooth is strong in all harmonics and channels of a turn, so that their
errors are not independent: with P = (J'J)^-1 J', B blocks of whole turns in each cut and y_b the amplitudes of a block,

    C_turns = sum over cuts of sum_b g_b g_b' / (B (B - 1)),   g_b = P (y_b - mean y).

What the model does not fit is in the residuals r, with leverages l, beside the errors of the turns, whose variance v
the blocks state: C_fit = P diag(s r^2 / (1 - l)) P', which is also valid where some harmonics are fitted worse than
others. s is the share that is not of the turns, 1 - sum v / sum r^2 / (1 - l) of a channel of a cut, at least 0. The
covariance is C = C_turns + C_fit. With B - 1 degrees of freedom of each cut and those of the residuals, each element of
its diagonal has those of Welch and Satterthwaite, its square over the sum of the squares of its parts over their own;
the harmonic mean over the coefficients is stated.

Reference: [Kline1983], runout.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.fit import (
    LOOSE,
    WEAK,
    Fit,
    FitSearch,
    FittedChannels,
    as_real,
    conclude_fit,
    dynamometer,
    pad_covariance,
    runout_of,
    solve_scaled,
    unit_harmonics,
)
from chipload.cutting.turns import MeasuredCut, Turns, turns_of
from chipload.errors import InputError
from chipload.lazy import scipy

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

#: rotations and directions of the runout that a search starts from
PHASES, DIRECTIONS = 72, 6
#: how often coefficients and dynamometer are found in turn
ROUNDS = 4
#: sizes of the runout that a search starts from, in parts of the least feed per tooth
SIZES = (0.2, 0.45, 0.7)


@dataclass(frozen=True, eq=False)
class _Problem:
    """Amplitudes, weights and unknowns of the search. q = theta_0 of each cut, then the runout (u, v), u or nothing."""

    cuts: tuple[MeasuredCut, ...]
    turns: tuple[Turns, ...]
    cutter: Cutter
    harmonics: int
    seek_runout: bool
    seek_zero: bool
    resonance: Floats
    kept: dict[tuple[float, ...], list[Complexes]]

    @property
    def unknowns(self) -> int:
        """Number of unknowns of the runout: with two teeth only its size has an effect, with one tooth it has none."""
        return min(self.cutter.flutes - 1, 2) if self.seek_runout else 0

    def cutter_at(self, runout: Floats) -> Cutter:
        """Return the cutter with the runout of the unknowns."""
        if not len(runout):
            return self.cutter
        u, v = float(runout[0]), float(runout[1]) if len(runout) > 1 else 0.0
        return replace(self.cutter, runout=(math.hypot(u, v), math.atan2(v, u)))

    def units(self, runout: Floats) -> list[Complexes]:
        """Return B_k of each cut."""
        key = tuple(runout.tolist())
        if key not in self.kept:
            if len(self.kept) > 16:
                self.kept.clear()
            self.kept[key] = [unit_harmonics(cut, self.cutter_at(runout), self.harmonics) for cut in self.cuts]
        return self.kept[key]

    def rows(self, q: Floats, only: int | None = None) -> tuple[Floats, Floats]:
        """Return the weighted design matrix (m, 6 + zeros) and observations (m,) of every cut or of one."""
        f = len(self.cuts)
        k = np.arange(self.harmonics + 1, dtype=np.float64)
        design, seen = [], []
        for i, (unit, turns) in enumerate(zip(self.units(q[f:]), self.turns, strict=True)):
            if only is not None and i != only:
                continue
            shown = dynamometer(self.resonance, k * turns.speed) * np.exp(1j * k * q[i])[:, None]
            for c in np.flatnonzero(self.cuts[i].measured):
                amplitude = turns.amplitude[: self.harmonics + 1, c]
                weight = 1.0 / math.sqrt(float(np.sum(as_real(amplitude)[1:] ** 2)))
                block = np.zeros((2 * self.harmonics + 1, 6 + (3 * f if self.seek_zero else 0)))
                block[:, :6] = as_real(unit[:, c] * shown[:, c, None])
                if self.seek_zero:
                    block[0, 6 + 3 * i + c] = 1.0
                design.append(weight * block)
                seen.append(weight * as_real(amplitude))
        return np.concatenate(design), np.concatenate(seen)

    def left(self, q: Floats) -> Floats:
        """Return the residuals at the best linear coefficients."""
        a, y = self.rows(q)
        return np.asarray(y - a @ solve_scaled(a, y)[0])

    def start(self, runout: Floats) -> Floats:
        """Return theta_0 of each cut by search at one runout; the linear coefficients are free in each cut.

        Turning the phase turns all columns alike: the normal matrix stays, and only its right side changes.
        """
        tried = np.linspace(0.0, math.tau, PHASES, endpoint=False)
        found = np.zeros(len(self.cuts))
        k = np.arange(self.harmonics + 1, dtype=np.float64)
        share = np.where(k == 0.0, 0.0 if self.seek_zero else 1.0, 2.0)
        for i, (unit, turns) in enumerate(zip(self.units(runout), self.turns, strict=True)):
            some = np.flatnonzero(self.cuts[i].measured)
            seen = turns.amplitude[: len(k), some]
            shown = unit[:, some] * dynamometer(self.resonance, k * turns.speed)[:, some, None]
            weight = share[:, None] / np.sum(share[1:, None] * np.abs(seen[1:]) ** 2, axis=0)
            normal = np.einsum("kc,kcp,kcq->pq", weight, np.conj(shown), shown).real
            right = np.exp(-1j * np.outer(tried, k)) @ np.einsum("kc,kcp,kc->kp", weight, np.conj(shown), seen)
            x = right.real @ np.linalg.pinv(normal, rcond=LOOSE, hermitian=True)
            won = np.einsum("tp,tp->t", x, right.real)
            # half a turn away coefficients of the other sign do as well: such a cut is none
            found[i] = tried[int(np.argmax(np.where(x[:, 0] >= 0.0, won, -math.inf)))]
        return np.concatenate([found, runout])


def fit_instantaneous(
    cuts: Sequence[MeasuredCut],
    cutter: Cutter,
    *,
    band: float,
    runout: bool = True,
    zero: bool = False,
    ringing: Sequence[float | None] = (None, None, None),
) -> Fit:
    """Identify force coefficients from every force sample over the turn.

    Parameters
    ----------
    cuts : one or more
    cutter : its runout stands where none is sought
    band : highest frequency that counts [rad/s]; best below the first resonance of the dynamometer
    runout : seek the runout; with two teeth its size alone, with one nothing
    zero : seek the zero of each channel of each cut: drift of a charge amplifier
    ringing : of T, n and the axis, about where the dynamometer rings [rad/s]; None: rigid

    Raises
    ------
    InputError
        There is no cut, the band holds no harmonic, or the cutter has no straight flank.
    """
    if not cuts:
        raise InputError("fit: no cut to fit: name at least one measurement with use = fit")
    harmonics, turns = turns_in_band(cuts, band)
    resonance = np.full((3, 2), np.nan)
    for c, w in enumerate(ringing):
        if w is not None:
            resonance[c] = w, 0.05
    problem = _Problem(tuple(cuts), turns, cutter, harmonics, runout, zero, resonance, {})
    q, converged = _search_starts(problem)
    if any(w is not None for w in ringing):
        for _ in range(ROUNDS):
            problem = replace(problem, resonance=_channel_modes(problem, q), kept={})
            q, converged = _refine_unknowns(problem, q)
    return _final_fit(problem, q, converged)


def turns_in_band(cuts: Sequence[MeasuredCut], band: float) -> tuple[int, tuple[Turns, ...]]:
    """Return the number of harmonics in the band [rad/s] at the fastest spindle, and the turns of all cuts.

    Raises
    ------
    InputError
        There is none in it, or a cut is sampled too slowly or is too short.
    """
    slowest = max(cut.speed for cut in cuts)
    harmonics = math.floor(band / slowest * (1.0 + 1e-9))
    if harmonics < 1:
        raise InputError(
            f"band_hz = {band / math.tau:g}: must be at least the spindle's {slowest / math.tau:g} Hz, better twice "
            "the tooth-passing frequency"
        )
    full = [max(harmonics, math.floor(0.8 * math.pi * cut.rate / cut.speed)) for cut in cuts]
    return harmonics, tuple(turns_of(cut, h) for cut, h in zip(cuts, full, strict=True))


def _search_starts(problem: _Problem) -> tuple[Floats, bool]:
    """Return the best result of several starts."""
    f, m = len(problem.cuts), problem.unknowns
    flutes = problem.cutter.flutes
    starts = [np.zeros(0)]
    if m:
        least = min(cut.feed_per_tooth(flutes) for cut in problem.cuts)
        turn = np.arange(DIRECTIONS) * (math.tau / (flutes * DIRECTIONS)) if m == 2 else np.zeros(1)
        starts = [s * least * np.array([math.cos(a), math.sin(a)])[:m] for s in SIZES for a in turn]
    ranked: list[tuple[float, int, Floats]] = []
    for start in starts:
        q = problem.start(start)
        # which tooth is which is known up to one turn of names: cut by cut, try the other teeth
        for i in range(1, f):
            turned = [q + np.where(np.arange(len(q)) == i, math.tau * j / flutes, 0.0) for j in range(flutes)]
            q = min(turned, key=lambda x: float(np.sum(problem.left(x) ** 2)))
        ranked.append((float(np.sum(problem.left(q) ** 2)), len(ranked), q))
    ranked.sort()
    found = [_refine_unknowns(problem, q) for _, _, q in ranked[:3]]
    return min(found, key=lambda x: float(np.sum(problem.left(x[0]) ** 2)))


def _refine_unknowns(problem: _Problem, q: Floats) -> tuple[Floats, bool]:
    """Refine the unknowns by least squares from one start."""
    least = min(cut.feed_per_tooth(problem.cutter.flutes) for cut in problem.cuts)
    scale = np.concatenate([np.full(len(problem.cuts), 0.1), np.full(problem.unknowns, 0.2 * least)])
    done = scipy.optimize.least_squares(problem.left, q, x_scale=scale, xtol=1e-10, ftol=1e-12, max_nfev=200)
    return np.asarray(done.x), bool(done.status > 0)


def _channel_modes(problem: _Problem, q: Floats) -> Floats:
    """Return w0 and zeta of each channel that rings, from all harmonics, with the other unknowns fixed."""
    f = len(problem.cuts)
    a, y = problem.rows(q)
    x = solve_scaled(a, y)[0][:6]
    out = problem.resonance.copy()
    cutter = problem.cutter_at(q[f:])
    for c in np.flatnonzero(np.isfinite(out[:, 0])):
        parts = []
        for i, (cut, turns) in enumerate(zip(problem.cuts, problem.turns, strict=True)):
            if cut.measured[c]:
                k = np.arange(len(turns.amplitude), dtype=np.float64)
                forced = (unit_harmonics(cut, cutter, len(k) - 1)[:, c] @ x) * np.exp(1j * k * q[i])
                parts.append((k[1:] * turns.speed, forced[1:], turns.amplitude[1:, c]))
        left = partial(_ringing_left, parts=parts)
        low, high = np.log([0.7 * out[c, 0], 0.003]), np.log([1.4 * out[c, 0], 0.5])
        first = [np.log([g * out[c, 0], 0.05]) for g in (0.9, 1.0, 1.1)]
        found = [scipy.optimize.least_squares(left, s, bounds=(low, high)) for s in first]
        out[c] = np.exp(min(found, key=lambda d: float(d.cost)).x)
    return out


def _ringing_left(p: Floats, parts: list[tuple[Floats, Complexes, Complexes]]) -> Floats:
    """Return the residuals of one channel at p = (ln w0, ln zeta), each cut weighted by its own size."""
    one = np.full((3, 2), np.nan)
    one[0] = np.exp(p)
    e = [(dynamometer(one, w)[:, 0] * forced - seen) / np.linalg.norm(seen) for w, forced, seen in parts]
    return np.concatenate([part for z in e for part in (z.real, z.imag)])


def _final_fit(problem: _Problem, q: Floats, converged: bool) -> Fit:
    """Return values, covariance and quality at the end of the search."""
    f, m = len(problem.cuts), problem.unknowns
    a, y = problem.rows(q)
    x, there, determined = solve_scaled(a, y)
    left = y - a @ x
    # model rows against every unknown: those outside by differences, x and the zeros exactly
    steps = np.concatenate([np.full(f, 1e-5), np.full(m, 1e-7)])
    outer = [
        ((problem.rows(q + d)[0] - problem.rows(q - d)[0]) @ x) / (2.0 * h)
        for h, d in zip(steps, np.diag(steps), strict=True)
    ]
    jacobian = np.column_stack([*outer, a])
    size = np.linalg.norm(jacobian, axis=0)
    scale = np.where(size > 0.0, size, 1.0)
    u, s, vt = np.linalg.svd(jacobian / scale, full_matrices=False)
    sure = s > WEAK * s[0]
    leverage = np.minimum(np.sum(u[:, sure] ** 2, axis=1), 1.0 - 1e-6)
    inverse = (vt[sure].T / s[sure]) @ u[:, sure].T / scale[:, None]
    more = len(y) - int(sure.sum())
    covariance, freedom = _covariance(problem, inverse, left / np.sqrt(1.0 - leverage), more)
    free = np.sum(vt[sure] ** 2, axis=0) > 1.0 - WEAK
    linear = x[:6]
    identified = (there & determined)[:6] & free[f + m : f + m + 6]
    residual, r2 = _quality(problem, q, x)
    runout = problem.cutter_at(q[f:])
    keep = [*range(f, f + m), *range(f + m, f + m + 6)]
    spread = covariance[np.ix_(keep, keep)]
    notes = []
    if problem.seek_runout and m == 1:
        notes.append("two teeth: the size of the runout acts along their line alone; its direction is not identified")
    if m == 1:
        spread = np.insert(np.insert(spread, 1, 0.0, axis=0), 1, 0.0, axis=1)
    elif m == 0:
        spread = pad_covariance(spread, 2)
    zero = x[6:].reshape(f, 3) if problem.seek_zero else np.zeros((f, 3))
    channels = FittedChannels(np.mod(q[:f], math.tau), zero, problem.resonance, residual, r2)
    found = np.concatenate([runout_of(runout), linear])
    search = FitSearch(found, spread, freedom, problem.harmonics, converged)
    return conclude_fit(
        "instantaneous", problem.cuts, problem.turns, runout, linear, identified, channels, search, notes
    )


def _covariance(problem: _Problem, inverse: Floats, left: Floats, more: int) -> tuple[Floats, int]:
    """Return the covariance of all unknowns, and its degrees of freedom: see the module.

    Parameters
    ----------
    inverse : (unknowns, m) P
    left : (m,) residuals over the root of 1 - leverage
    more : residuals less unknowns
    """
    turns, at = np.zeros((len(inverse), len(inverse))), 0
    size = 2 * problem.harmonics + 1
    model, squares = left**2, np.zeros(len(inverse))
    for cut, one in zip(problem.cuts, problem.turns, strict=True):
        some, many = np.flatnonzero(cut.measured), len(one.blocks)
        differ = np.zeros((many, len(some) * size))
        rows = slice(at, at + len(some) * size)
        for j, c in enumerate(some):
            weight = 1.0 / math.sqrt(float(np.sum(as_real(one.amplitude[: problem.harmonics + 1, c])[1:] ** 2)))
            differ[:, j * size : (j + 1) * size] = weight * np.array(
                [as_real(block[: problem.harmonics + 1, c]) for block in one.blocks]
            )
        at += len(some) * size
        if many < 2:  # a turn: how turns differ is not known
            continue
        differ -= differ.mean(axis=0)
        g = differ @ inverse[:, rows].T
        own = g.T @ g / (many * (many - 1))
        turns += own
        squares += np.diagonal(own) ** 2 / (many - 1)
        of_turns = np.sum(differ**2, axis=0).reshape(len(some), size).sum(axis=1) / (many * (many - 1))
        whole = model[rows].reshape(len(some), size).sum(axis=1)
        share = np.maximum(1.0 - of_turns / np.where(whole > 0.0, whole, 1.0), 0.0)
        model[rows] *= np.repeat(share, size)
    fit = (inverse * model) @ inverse.T
    if more < 1:
        return np.asarray(turns + fit), more
    squares += np.diagonal(fit) ** 2 / more
    variance = np.diagonal(turns + fit)
    first = len(problem.cuts) + problem.unknowns
    some = first + np.flatnonzero(variance[first : first + 6] > 0.0)
    freedom = 1.0 / np.mean(squares[some] / variance[some] ** 2) if len(some) else more
    return np.asarray(turns + fit), max(int(freedom), 1)


def _quality(problem: _Problem, q: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Return the standard deviation of the residuals in the band [N], and R^2, of each channel."""
    left, total = np.full((2, 3), np.nan)
    for c in range(3):
        mine = [i for i, cut in enumerate(problem.cuts) if cut.measured[c]]
        if not mine:
            continue
        sums = np.zeros(2)
        for i in mine:
            k = np.arange(problem.harmonics + 1, dtype=np.float64)
            turns = problem.turns[i]
            shown = dynamometer(problem.resonance, k * turns.speed)[:, c] * np.exp(1j * k * q[i])
            model = (problem.units(q[len(problem.cuts) :])[i][:, c] @ x[:6]) * shown
            if problem.seek_zero:
                model[0] += x[6 + 3 * i + c]
            seen = turns.amplitude[: problem.harmonics + 1, c]
            sums += np.sum(as_real(seen - model) ** 2), np.sum(as_real(seen)[1:] ** 2)
        left[c], total[c] = sums / len(mine)
    return np.sqrt(left), 1.0 - left / total
