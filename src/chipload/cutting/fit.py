"""Identification of force coefficients from measured forces by the average method, and prediction of other cuts.

Notation: x = (Ktc, Krc, Kac, Kte, Kre, Kae) [MPa, N/mm] as in :mod:`chipload.cutting.material`; force on the cutter
along T, n and the axis as in :mod:`chipload.cutting.force`; theta [rad] rotation of tooth 0; e, lambda runout; Omega
[rad/s] spindle speed; k harmonic of the spindle, c_k amplitudes as in :mod:`chipload.cutting.turns`; B_k those of the
six forces that belong to unit coefficients; w0 [rad/s], zeta resonance of the dynamometer.

Force is linear in x. The mean force over whole turns is B_0 x: a linear regression over the cuts, whose B_0 is the
closed form of the force model for any arc. :mod:`chipload.cutting.fit_turns` fits every sample over the turn.

The dynamometer shows D(w) = 1 / (1 - (w / w0)^2 + 2 i zeta w / w0) times the force, 1 where it is taken as rigid.

Intervals are 95 %, Student's t; here from the scatter about the line. With two feeds no scatter is left; the scatter
from turn to turn is then used. A coefficient that no channel determines is NaN.

Reference: [Altintas2012] ch. 2, mean forces; [Kline1983], runout.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.turns import MeasuredCut, Turns, turns_of
from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs
from chipload.engagement.tooth_surfaces import STEADY, chips_of_teeth
from chipload.errors import InputError
from chipload.lazy import LateModule, scipy

_unit_loads = LateModule("chipload.cutting._unit_loads")

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

NAMES = ("Ktc", "Krc", "Kac", "Kte", "Kre", "Kae")
#: which of x act in the plane, and along the axis
PLANE, AXIS = (0, 1, 3, 4), (2, 5)
#: rotations at which the forces of a turn are taken
TURN = 512
#: singular value, in parts of the greatest, below which a direction is undetermined
LOOSE = 1e-6
#: singular value over the greatest below which the error of the chip, 0.3 %, would determine a coefficient, not the
#: measurement: four teeth in a slot with a free zero have 0.002, three teeth 0.014
WEAK = 4e-3


@dataclass(frozen=True, eq=False)
class FittedCoefficients:
    """Identified coefficients x with their covariance and intervals.

    Parameters
    ----------
    values : (6,) float, x; NaN where not identified
    covariance : (6, 6) float; NaN where not identified
    interval : (6, 2) float, 95 %
    linear : (6,) float, x with some value where it is not identified
    """

    values: Floats
    covariance: Floats
    interval: Floats
    linear: Floats


@dataclass(frozen=True, eq=False)
class FittedChannels:
    """Results of a fit for each of the three channels of the dynamometer.

    Parameters
    ----------
    phase : (f,) float [rad], theta_0 of each cut; NaN by the average method
    zero : (f, 3) float [N] of each cut; 0 where it is not sought
    resonance : (3, 2) float, w0 [rad/s] and zeta of each channel; NaN: rigid
    residual : (3,) float [N] standard deviation of what the model leaves, in the band; NaN: not measured
    r2 : (3,) float, share of the variance that the model explains
    """

    phase: Floats
    zero: Floats
    resonance: Floats
    residual: Floats
    r2: Floats


@dataclass(frozen=True, eq=False)
class FitSearch:
    """Parameters, covariance and convergence of the search of a fit.

    Parameters
    ----------
    parameters, spread : (p,) and (p, p) float, runout and x as fitted and their covariance, for the bands
    freedom : of the covariance: observations less parameters, or less where it is known from few blocks of turns
    harmonics : how many count
    converged : whether the search ended by itself
    """

    parameters: Floats
    spread: Floats
    freedom: int
    harmonics: int
    converged: bool


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of the identification of force coefficients.

    Parameters
    ----------
    method : ``average`` or ``instantaneous``
    cutter : with the runout that was found, or was given
    cuts, turns : that were fitted
    notes : what the reader must know
    """

    method: str
    cutter: Cutter
    cuts: tuple[MeasuredCut, ...]
    turns: tuple[Turns, ...]
    coefficients: FittedCoefficients
    channels: FittedChannels
    search: FitSearch
    notes: tuple[str, ...]

    @property
    def identified(self) -> NDArray[np.bool_]:
        """Mask (6,) of the coefficients that the measurement determines."""
        return np.asarray(np.isfinite(self.coefficients.values))

    @property
    def known(self) -> NDArray[np.bool_]:
        """Mask (3,) of the channels whose force follows from the identified coefficients."""
        plane, axis = self.identified[list(PLANE)].all(), self.identified[list(AXIS)].all()
        return np.array([plane, plane, axis])


@dataclass(frozen=True, eq=False)
class Prediction:
    """Predicted forces of a cut, (3,) float [N] along T, n and the axis; NaN where coefficients are missing.

    ``mean``; ``high`` and ``low`` greatest and least over the turn as the dynamometer shows them; ``band_high`` and
    ``band_low`` of the harmonics that were fitted alone; ``half`` (5, 3) the half widths of their 95 % bands, in this
    order; ``resultant`` greatest in-plane force, ``band_resultant`` of those harmonics alone.
    """

    mean: Floats
    high: Floats
    low: Floats
    band_high: Floats
    band_low: Floats
    half: Floats
    resultant: float
    band_resultant: float


# -- the model --------------------------------------------------------------------------------------------------
def _chips(cut: MeasuredCut, cutter: Cutter) -> ToothEngagement:
    front = engagement_of_arcs([cut.arc[0]], [cut.arc[1]], cut.feed_per_tooth(cutter.flutes), cutter, cut.depth)
    return chips_of_teeth(front, cutter, STEADY)


def unit_forces(cut: MeasuredCut, cutter: Cutter, theta: Floats) -> Floats:
    """Return the forces on the cutter for unit coefficients, (m, 3, 6) float: force = unit_forces @ x."""
    chips, m = _chips(cut, cutter), len(theta)
    out = np.zeros((m, 4, 6))
    # the same rows for each rotation
    rows, tooth, piece = np.tile(chips.rows, (m, 1)), np.tile(chips.tooth, m), np.tile(chips.slice, m)
    start = len(chips.rows) * np.arange(m + 1)
    angles = np.ascontiguousarray(theta, dtype=np.float64)
    _unit_loads.bases_at(start, rows, tooth, piece, chips.slices, angles, cutter.flutes, out)
    return out[:, :3]


def unit_means(cut: MeasuredCut, cutter: Cutter) -> Floats:
    """Return :func:`unit_forces` averaged over the turn in closed form, (3, 6) float."""
    chips, out = _chips(cut, cutter), np.zeros((1, 4, 6))
    _unit_loads.mean_bases(chips.start, chips.rows, chips.tooth, chips.slice, chips.slices, cutter.flutes, out)
    return out[0, :3]


def unit_harmonics(cut: MeasuredCut, cutter: Cutter, harmonics: int) -> Complexes:
    """Return the harmonics B_k, (H + 1, 3, 6) complex; B_0 is the closed form."""
    theta = np.linspace(0.0, math.tau, TURN, endpoint=False)
    out = np.fft.rfft(unit_forces(cut, cutter, theta), axis=0)[: harmonics + 1] / TURN
    out[0] = unit_means(cut, cutter)
    return np.asarray(out)


def dynamometer(resonance: Floats, w: Floats) -> Complexes:
    """Return the transfer function D of each channel at the frequencies w (m,) [rad/s], (m, 3) complex."""
    out = np.ones((len(w), 3), dtype=np.complex128)
    for c in np.flatnonzero(np.isfinite(resonance[:, 0])):
        r = w / resonance[c, 0]
        out[:, c] = 1.0 / (1.0 - r * r + 2j * resonance[c, 1] * r)
    return out


def as_real(amplitude: Complexes) -> Floats:
    """Return amplitudes as real numbers (2 H + 1, ...) whose squares sum to the mean square of the signal."""
    root = math.sqrt(2.0)
    return np.concatenate([amplitude[:1].real, root * amplitude[1:].real, root * amplitude[1:].imag])


# -- the average method -----------------------------------------------------------------------------------------
def fit_average(cuts: Sequence[MeasuredCut], cutter: Cutter) -> Fit:
    """Identify force coefficients from mean forces over whole turns by linear regression.

    Parameters
    ----------
    cuts : two feeds or more
    cutter : with its runout, where it is known: it decides which teeth touch

    Raises
    ------
    InputError
        There is no cut, or the cutter has no straight flank.
    """
    turns = _turns(cuts, 1)
    a = np.stack([unit_means(cut, cutter) for cut in cuts])
    y = np.stack([t.mean.mean(axis=0) for t in turns])
    noise = np.stack([t.mean.var(axis=0, ddof=1) / len(t.mean) if len(t.mean) > 1 else np.nan * y[0] for t in turns])
    feeds = len({round(cut.feed_per_tooth(cutter.flutes), 9) for cut in cuts})
    notes: list[str] = []
    if feeds == 2:
        notes.append("two feeds do not show whether the force is linear in the feed; intervals count turns only")
    linear, identified, spread = np.zeros(6), np.zeros(6, dtype=bool), np.zeros((6, 6))
    residual, r2, freedom = np.full(3, np.nan), np.full(3, np.nan), 10**9
    for channels, which in (((0, 1), PLANE), ((2,), AXIS)):
        rows = [(i, c) for i in range(len(cuts)) for c in channels if cuts[i].measured[c]]
        if not rows:
            continue
        i, c = np.array(rows).T
        block, seen = a[i, c][:, which], y[i, c]
        x, there, free = solve_scaled(block, seen)
        left = seen - block @ x
        inverse = np.linalg.pinv(block, rcond=1e-9)
        count = len(rows) - int(np.linalg.matrix_rank(block, rtol=1e-9))
        if feeds > 2 and count > 0:
            covariance = inverse @ inverse.T * float(left @ left) / count
        else:
            count = min(len(t.mean) for t in turns) - 1
            covariance = (inverse * noise[i, c]) @ inverse.T
        freedom = min(freedom, count)
        linear[list(which)], identified[list(which)] = x, there & free
        spread[np.ix_(which, which)] = covariance
        for channel in set(c.tolist()):
            mine = c == channel
            residual[channel] = math.sqrt(float(np.mean(left[mine] ** 2)))
            total = float(np.sum((seen[mine] - seen[mine].mean()) ** 2))
            r2[channel] = 1.0 - float(np.sum(left[mine] ** 2)) / total if total > 0.0 else math.nan
    seen_by = FittedChannels(
        np.full(len(cuts), np.nan), np.zeros((len(cuts), 3)), np.full((3, 2), np.nan), residual, r2
    )
    found = np.concatenate([runout_of(cutter), linear])
    search = FitSearch(found, pad_covariance(spread, 2), max(freedom, 0), 0, True)
    return conclude_fit("average", cuts, turns, cutter, linear, identified, seen_by, search, notes)


def solve_scaled(a: Floats, y: Floats) -> tuple[Floats, NDArray[np.bool_], NDArray[np.bool_]]:
    """Solve least squares with scaled columns; return also which columns are not zero and which are determined."""
    size = np.linalg.norm(a, axis=0)
    there = size > 0.0
    scale = np.where(there, size, 1.0)
    u, s, vt = np.linalg.svd(a / scale, full_matrices=False)
    sure = s > WEAK * s[0] if len(s) and s[0] > 0.0 else np.zeros(len(s), dtype=bool)
    x = vt[sure].T @ ((u.T[sure] @ y) / s[sure]) / scale
    determined = np.sum(vt[sure] ** 2, axis=0) > 1.0 - WEAK
    return x, there, determined


# -- what comes out ---------------------------------------------------------------------------------------------
def _turns(cuts: Sequence[MeasuredCut], harmonics: int) -> tuple[Turns, ...]:
    if not cuts:
        raise InputError("fit: no cut to fit: name at least one measurement with use = fit")
    return tuple(turns_of(cut, harmonics) for cut in cuts)


def runout_of(cutter: Cutter) -> Floats:
    """Return the runout as (e cos(lambda), e sin(lambda)) [mm]."""
    size, direction = cutter.runout
    return size * np.array([math.cos(direction), math.sin(direction)])


def pad_covariance(spread: Floats, more: int) -> Floats:
    """Return a covariance preceded by ``more`` exact numbers, whose rows and columns are 0."""
    out = np.zeros((len(spread) + more, len(spread) + more))
    out[more:, more:] = spread
    return out


def conclude_fit(
    method: str,
    cuts: Sequence[MeasuredCut],
    turns: tuple[Turns, ...],
    cutter: Cutter,
    linear: Floats,
    identified: NDArray[np.bool_],
    channels: FittedChannels,
    search: FitSearch,
    notes: list[str],
) -> Fit:
    """Return a fit with its intervals; coefficients that are not identified are NaN."""
    if search.freedom < 1:
        notes.append("as many coefficients as observations: no interval can be stated")
    values = np.where(identified, linear, np.nan)
    covariance = np.where(np.outer(identified, identified), search.spread[2:, 2:], np.nan)
    half = _student(search.freedom) * np.sqrt(np.diagonal(covariance))
    unidentified = [name for name, ok in zip(NAMES, identified, strict=True) if not ok]
    if unidentified:
        notes.append(f"not identified by these measurements: {', '.join(unidentified)}")
    interval = np.column_stack([values - half, values + half])
    coefficients = FittedCoefficients(values, covariance, interval, linear)
    return Fit(method, cutter, tuple(cuts), turns, coefficients, channels, search, tuple(notes))


def _student(freedom: int) -> float:
    """Return the half width of a two-sided 95 % interval in standard deviations."""
    return float(scipy.special.stdtrit(freedom, 0.975)) if freedom > 0 else math.nan


def predict_forces(fit: Fit, cut: MeasuredCut, theta: Floats, resonance: Floats | None = None) -> Floats:
    """Forces that the coefficients give over a turn of a cut, as the dynamometer shows them: (m, 3) float [N] on the
    cutter at the rotations theta (m,); ``resonance`` None: that of the fit.
    """
    return _predict_turn(
        fit, cut, fit.search.parameters, theta, None, fit.channels.resonance if resonance is None else resonance
    )


def _predict_turn(
    fit: Fit, cut: MeasuredCut, p: Floats, theta: Floats, harmonics: int | None, resonance: Floats
) -> Floats:
    """Return :func:`predict_forces` for any runout and coefficients p, from the first harmonics or from all."""
    cutter = replace(fit.cutter, runout=(math.hypot(p[0], p[1]), math.atan2(p[1], p[0])))
    rings = np.isfinite(resonance[:, 0])
    force = np.full((len(theta), 3), np.nan)
    if harmonics is None and not rings.all():
        force[:] = unit_forces(cut, cutter, theta) @ p[2:]
    if harmonics is not None or rings.any():
        k = np.arange(TURN // 2 if harmonics is None else harmonics + 1, dtype=np.float64)
        amplitude = (unit_harmonics(cut, cutter, len(k) - 1) @ p[2:]) * dynamometer(resonance, k * cut.speed)
        wave = np.exp(1j * np.outer(theta, k[1:]))
        summed = amplitude[0].real + 2.0 * (wave @ amplitude[1:]).real
        force = np.where(rings | (harmonics is not None), summed, force)
    return np.asarray(np.where(fit.known, force, np.nan))


def predicted_mean(fit: Fit, cut: MeasuredCut) -> tuple[Floats, Floats]:
    """Return the mean force over the turn and the half width of its band, (3,) [N] each, as :func:`predict`."""
    return _band_of_numbers(fit, lambda p: _mean(fit, cut, p))


def _mean(fit: Fit, cut: MeasuredCut, p: Floats) -> Floats:
    cutter = replace(fit.cutter, runout=(math.hypot(p[0], p[1]), math.atan2(p[1], p[0])))
    return np.asarray(np.where(fit.known, unit_means(cut, cutter) @ p[2:], np.nan))


def _band_of_numbers(fit: Fit, numbers: Callable[[Floats], Floats]) -> tuple[Floats, Floats]:
    """Return ``numbers`` at the fitted parameters, and the half width of its 95 % band by differences."""
    p = fit.search.parameters
    values = numbers(p)
    slopes = np.zeros((*values.shape, len(p)))
    for j, sd in enumerate(np.sqrt(np.diagonal(fit.search.spread))):
        if sd > 0.0:
            d = np.where(np.arange(len(p)) == j, 0.1 * sd, 0.0)
            slopes[..., j] = (numbers(p + d) - numbers(p - d)) / (0.2 * sd)
    return values, _student(fit.search.freedom) * np.sqrt(
        np.einsum("...j,jk,...k->...", slopes, fit.search.spread, slopes)
    )


def predict(fit: Fit, cut: MeasuredCut) -> Prediction:
    """Predict mean and extremes of a cut that was not fitted, with bands from the covariance of runout and x."""
    theta = np.linspace(0.0, math.tau, TURN, endpoint=False)

    def numbers(p: Floats) -> Floats:
        whole = _predict_turn(fit, cut, p, theta, None, fit.channels.resonance)
        band = _predict_turn(fit, cut, p, theta, max(fit.search.harmonics, 1), fit.channels.resonance)
        return np.stack([_mean(fit, cut, p), whole.max(axis=0), whole.min(axis=0), band.max(axis=0), band.min(axis=0)])

    values, half = _band_of_numbers(fit, numbers)
    few = _predict_turn(fit, cut, fit.search.parameters, theta, max(fit.search.harmonics, 1), fit.channels.resonance)
    both = (float(np.hypot(force[:, 0], force[:, 1]).max()) for force in (predict_forces(fit, cut, theta), few))
    return Prediction(values[0], values[1], values[2], values[3], values[4], half, *both)


def align_turn(fit: Fit, cut: MeasuredCut, turns: Turns, parts: int = 720) -> float:
    """Return theta_0 [rad] of a cut at which its harmonics are nearest to the predicted ones, of ``parts`` tried."""
    k = np.arange(len(turns.amplitude), dtype=np.float64)
    model = (unit_harmonics(cut, fit.cutter, len(k) - 1) @ fit.coefficients.linear) * dynamometer(
        fit.channels.resonance, k * cut.speed
    )
    some = cut.measured & fit.known
    if not some.any():
        return 0.0
    size = np.sqrt(np.sum(np.abs(turns.amplitude[1:, some]) ** 2, axis=0))
    # the phase changes only how amplitudes lie to each other, not their size
    overlap = np.sum(np.conj(model[1:, some]) * turns.amplitude[1:, some] / size**2, axis=1)
    tried = np.linspace(0.0, math.tau, parts, endpoint=False)
    return float(tried[int(np.argmax((np.exp(-1j * np.outer(tried, k[1:])) @ overlap).real))])
