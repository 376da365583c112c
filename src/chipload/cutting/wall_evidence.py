"""Force coefficients and stiffness of a tool learned from the measured form error of walls.

Notation: x (6,) coefficients over the prior ones, e_w(z; x) [um] predicted form error of wall w at the height z as in
:mod:`chipload.cutting.wall_error`. A measured value is

    y = o_w + (1 + u) e_w(z; x) + noise,

o_w an error of the place of the whole wall (radius and offset of the tool, zero of the measurement), u an error of the
compliance of tool and holder, common to all walls. All have Gaussian priors, that of x is the material's. Without
runout e is linear in x. The greatest posterior is found by repeated linear updates, the covariance is that of the last:

    K = P H' (H P H' + R)^-1,    P' = P - K H P.

The error of a wall is a product of force and compliance: it tells (1 + u) x, and parts it by the priors.

Reference: [Altintas2012] ch. 2 for the form error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.learned import LearnedRecord, LogEvidence
from chipload.cutting.material import Material
from chipload.errors import Finding, InputError, Severity
from chipload.lazy import scipy
from chipload.number_text import number_text

Floats = NDArray[np.float64]

#: step of a coefficient for the derivative, relative; updates about the last estimate
STEP, UPDATES = 0.02, 3
#: coefficients further from the prior than so many deviations are another material's; walls whose misfit is less
#: likely than this contradict the model
BELIEVED, LIKELY = 3.0, 1e-3
#: least coefficient over that of the prior
LEAST = 0.05
#: keys of the coefficients of a material, in its order
NAMES = ("Ktc", "Krc", "Kac", "Kte", "Kre", "Kae")


@dataclass(frozen=True, eq=False)
class MeasuredWall:
    """Measured form error of a wall.

    Parameters
    ----------
    name : as messages call it
    height_mm : (p,) float, above the tip
    error_um : (p,) float, positive where material is left
    predict : a material -> (p,) float [um], form error at the heights
    noise_um : standard deviation of a value
    place_um : standard deviation of the place of the whole wall

    Raises
    ------
    InputError
        Heights and errors are not of one length, or not finite; a deviation is out of range.
    """

    name: str
    height_mm: Floats
    error_um: Floats
    predict: Callable[[Material], Floats]
    noise_um: float
    place_um: float

    def __post_init__(self) -> None:
        """Refuse columns of unlike length, and deviations out of range."""
        if self.height_mm.shape != self.error_um.shape or self.error_um.ndim != 1 or not len(self.error_um):
            count = f"height_mm has {self.height_mm.size} values, error_um {self.error_um.size}"
            raise InputError(f"{self.name}: {count}: must be lists of one length, of one value or more")
        if not np.isfinite(self.error_um).all():
            raise InputError(f"{self.name}: error_um: must be finite numbers")
        if not 0.0 < self.noise_um < math.inf:
            raise InputError(f"{self.name}: noise_um = {self.noise_um:g}: must be above 0")
        if not 0.0 <= self.place_um < math.inf:
            raise InputError(f"{self.name}: place_um = {self.place_um:g}: must be at least 0")


@dataclass(frozen=True, eq=False)
class WallKnowledge:
    """A material after the form error of walls.

    Parameters
    ----------
    material, prior : after and before
    compliance : of tool and holder over the stated one, and its standard deviation
    place_um : wall -> place of the whole wall, and its standard deviation
    misfit : chi-square of the values, and the values that it has to spare
    findings : what contradicts the model
    """

    material: Material
    prior: Material
    compliance: tuple[float, float]
    place_um: dict[str, tuple[float, float]]
    misfit: tuple[float, int]
    findings: tuple[Finding, ...]

    @property
    def deviations(self) -> tuple[Floats, Floats]:
        """Relative standard deviations of the six coefficients, (6,) before and after; 0 of a coefficient of 0."""
        return tuple(_relative(m) for m in (self.prior, self.material))  # type: ignore[return-value]


def learn_from_walls(
    walls: Sequence[MeasuredWall],
    prior: Material,
    compliance_error: float,
    name: str = "",
    evidence: tuple[str, str] = ("", ""),
) -> WallKnowledge:
    """Return the material after the form error of walls that were cut with one tool.

    Parameters
    ----------
    prior : with a spread or a covariance
    compliance_error : relative standard deviation of the stated compliance, from 0 to below 1
    name : of the new material; empty: that of the prior with ``-learned``
    evidence : name and SHA-256 of the file that states the measurements

    Raises
    ------
    InputError
        No wall is given, the prior states no spread, was learned from this file, the unit of the errors is wrong, or
        no material explains them.
    """
    if not walls:
        raise InputError("wall: none is stated")
    if not 0.0 <= compliance_error < 1.0:
        raise InputError(f"compliance_error = {compliance_error:g}: must be from 0 to below 1")
    if prior.learned is not None and evidence[1] and evidence[1] in {log.sha256 for log in prior.learned.logs}:
        raise InputError(f"{evidence[0]}: {prior.name} was learned from it: a measurement counts once")
    _check_unit(walls, prior)
    values = np.array(prior.coefficients)
    gain = prior.learned.gain if prior.learned is not None else None
    mean, covariance = _before(prior, compliance_error, [wall.place_um for wall in walls])
    measurement = np.concatenate([wall.error_um for wall in walls])
    noise = np.concatenate([np.full(len(wall.error_um), wall.noise_um**2) for wall in walls])
    at = mean
    for _ in range(UPDATES):
        error, slope = _prediction(walls, prior, at)
        spread = slope @ covariance @ slope.T + np.diag(noise)
        share = np.linalg.solve(spread, slope @ covariance).T
        off = measurement - error - slope @ (mean - at)
        at = mean + share @ off
        low = [key for key, r in zip(NAMES, at[:6], strict=True) if r < LEAST]
        if low:
            raise InputError(
                f"{evidence[0] or 'walls'}: no material explains the measured values: {', '.join(low)} would be below "
                f"{100.0 * LEAST:g} % of that of {prior.name}: check the cuts, and that the walls do not bend"
            )
    after = covariance - share @ slope @ covariance
    misfit, freedom = float(off @ np.linalg.solve(spread, off)), len(measurement)
    findings = _findings(prior, at, misfit, freedom)
    ratio, shares = at[:6], after[:6, :6] * np.outer(values, values)
    record = LogEvidence(evidence[0], evidence[1], (1, len(measurement)), len(measurement), 0)
    history = prior.learned or LearnedRecord(
        prior.name, (prior.Ktc, float(_relative(prior)[0])), (prior.Kte, float(_relative(prior)[3])), ()
    )
    if gain is not None:
        across = [float(after[7, k] / at[k]) if at[k] else 0.0 for k in (0, 3)]
        gain = replace(
            gain, ratio=float(at[7]), deviation=math.sqrt(after[7, 7]), with_ktc=across[0], with_kte=across[1]
        )
    numbers: dict[str, Any] = {key: float(v * r) for key, v, r in zip(NAMES, values, ratio, strict=True)}
    matrix: Any = tuple(map(tuple, (0.5 * (shares + shares.T)).tolist()))
    material = replace(
        prior, name=name or f"{prior.name}-learned", spread=None, spread_directions=None, covariance=matrix,
        source=f"{prior.source}; learned from the form error of walls, {evidence[0] or 'measured'}",
        learned=replace(history, logs=(*history.logs, record), worth=(), gain=gain), **numbers,
    )  # fmt: skip
    return WallKnowledge(
        material, prior, (1.0 + float(at[6]), math.sqrt(after[6, 6])),
        {wall.name: (float(at[8 + k]), math.sqrt(after[8 + k, 8 + k])) for k, wall in enumerate(walls)},
        (misfit, freedom), findings,
    )  # fmt: skip


def _relative(material: Material) -> Floats:
    """Return the relative standard deviation of each coefficient; 0 of one that is 0."""
    values = np.abs(np.array(material.coefficients))
    relative: Floats = np.divide(np.sqrt(np.diagonal(material.variances)), values, out=np.zeros(6), where=values > 0.0)
    return relative


def _before(prior: Material, compliance_error: float, places: Sequence[float]) -> tuple[Floats, Floats]:
    """Return mean and covariance of x, u, the gain of logs over the stated one, and the places."""
    values = np.array(prior.coefficients)
    size = np.outer(values, values)
    n = 8 + len(places)
    mean, covariance = np.concatenate([np.ones(6), np.zeros(n - 6)]), np.zeros((n, n))
    covariance[:6, :6] = np.divide(prior.variances, size, out=np.zeros((6, 6)), where=size != 0.0)
    covariance[6, 6] = compliance_error**2
    covariance[range(8, n), range(8, n)] = np.square(places)
    gain = prior.learned.gain if prior.learned is not None else None
    mean[7] = gain.ratio if gain is not None else 1.0
    if gain is not None:
        # the other coefficients know of the gain by their correlation with Ktc and Kte
        tangential = [0, 3]
        own = np.linalg.pinv(covariance[np.ix_(tangential, tangential)], hermitian=True)
        across = covariance[:6, tangential] @ own @ np.array([gain.with_ktc, gain.with_kte])
        covariance[7, 7], covariance[7, :6], covariance[:6, 7] = gain.deviation**2, across, across
    return mean, covariance


def _prediction(walls: Sequence[MeasuredWall], prior: Material, at: Floats) -> tuple[Floats, Floats]:
    """Return the predicted values of all walls, and their derivatives by all unknowns."""
    values = np.array(prior.coefficients)

    def errors(ratio: Floats) -> list[Floats]:
        numbers: dict[str, Any] = {key: float(v * r) for key, v, r in zip(NAMES, values, ratio, strict=True)}
        return [wall.predict(replace(prior, **numbers)) for wall in walls]

    middle = errors(at[:6])
    slope = np.zeros((sum(map(len, middle)), len(at)))
    for k in np.flatnonzero(values):
        step = STEP * np.eye(6)[k]
        low, high = np.concatenate(errors(at[:6] - step)), np.concatenate(errors(at[:6] + step))
        slope[:, k] = (1.0 + at[6]) * (high - low) / (2.0 * STEP)
    slope[:, 6] = np.concatenate(middle)
    first = 0
    for number, own in enumerate(middle):
        slope[first : first + len(own), 8 + number] = 1.0
        first += len(own)
    return (1.0 + at[6]) * np.concatenate(middle) + slope[:, 8:] @ at[8:], slope


def _check_unit(walls: Sequence[MeasuredWall], prior: Material) -> None:
    """Refuse errors that are 10 or 1000 times what is predicted, or that hardly vary over the height: the unit."""
    for wall in walls:
        predicted, measured = wall.predict(prior), wall.error_um
        places = 3.0 * (wall.place_um + wall.noise_um)
        size, prediction, what = float(np.abs(measured).max()), float(np.abs(predicted).max()), "is up to"
        # the place moves a whole wall, it does not flatten it
        flat = len(measured) > 2 and np.ptp(measured) < 0.01 * np.ptp(predicted)
        if flat:
            size, prediction, what = float(np.ptp(measured)), float(np.ptp(predicted)), "varies over the height by"
        ratio = size / max(prediction, 1e-12)
        unit = f" (a factor of {number_text(10.0 ** round(math.log10(ratio)))})" if ratio > 0.0 else ""
        if size > 10.0 * prediction + places or (size + places < 0.1 * prediction) or flat:
            raise InputError(
                f"{wall.name}: error_um {what} {number_text(size, 3)}, {number_text(ratio, 2)} times what is "
                f"predicted, {number_text(prediction, 3)}: check its unit{unit}, the cutter and the cut"
            )


def _findings(prior: Material, at: Floats, misfit: float, freedom: int) -> tuple[Finding, ...]:
    out = []
    chance = float(scipy.stats.chi2.sf(misfit, freedom))
    if chance < LIKELY:
        text = (
            f"the measured values are further from the prediction than its errors allow (chi-square {misfit:.1f} of "
            f"{freedom} values): another cut, a wall that bends, a noise or compliance_error that is too small"
        )
        out.append(Finding("wall-misfit", 0, text, Severity.UNPROVEN))
    for key, ratio, sd in zip(NAMES, at[:6], _relative(prior), strict=True):
        if sd > 0.0 and abs(ratio - 1.0) > BELIEVED * sd:
            text = (
                f"{key} is {number_text(float(ratio), 3)} times that of {prior.name}, {abs(ratio - 1.0) / sd:.1f} of "
                "its standard deviations away: another material or tool, or a wrong compliance"
            )
            out.append(Finding("wall-material", 0, text, Severity.UNPROVEN))
    return tuple(out)
