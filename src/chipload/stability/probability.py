"""The probability that a cut is stable, from the deviations of modes and coefficients.

Notation: every frequency, damping ratio and stiffness, and the tangential and the radial coefficient, is its value
times 1 + s n with s its relative standard deviation and n normal; those of different modes are independent. The
probability is the share of quasi-random samples (Sobol, always the same ones) in which |mu| < 1. On the flank of a lobe
an expansion about the mean would underestimate the uncertainty.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.stability.cuts import DynamicCuts
from chipload.stability.margin import PER_WAVE, largest_multipliers

Floats = NDArray[np.float64]

#: samples, a power of 2
SAMPLES = 128
#: a sampled value is at least this share of the mean
LEAST = 0.1
#: and a damping ratio at most
MOST_DAMPED = 0.5
#: dimensions of the Krylov space besides two for each mode, and how still |mu| is then
SPARE, STILL = 12, 1e-3
#: multiplier below which its logarithm does not matter
TINY = 1e-9
#: step of first differences in standard deviations, and cells in a wave for them
FIRST, PER_WAVE_FIRST = 0.1, 20.0


@dataclass(frozen=True)
class ModeSpread:
    """Relative standard deviations of the modes, from 0 to below 1.

    Raises
    ------
    InputError
        One is not.
    """

    frequency: float
    damping: float
    stiffness: float

    def __post_init__(self) -> None:
        for name in ("frequency", "damping", "stiffness"):
            value = getattr(self, name)
            if not 0.0 <= value < 1.0:
                raise InputError(f"dynamics.{name}_percent = {100.0 * value:g}: must be from 0 to below 100")


def stable_probability(
    cuts: DynamicCuts, spread: ModeSpread, coefficients: ArrayLike, samples: int = SAMPLES
) -> Floats:
    """Return the probability (n,) that each cut is stable, in steps of one over ``samples``.

    Parameters
    ----------
    coefficients : (2, 2) float, relative covariance of the tangential and the radial coefficient
    samples : a power of 2
    """
    from scipy.stats import qmc

    if samples < 2 or samples & (samples - 1):
        raise InputError(f"stable probability: samples = {samples}: must be a power of 2, 2 at least")
    count, root = len(cuts.damping), _root(coefficients)
    points = qmc.Sobol(3 * count + 2, scramble=True, rng=0).random(samples)
    stable = np.zeros(len(cuts))
    for n in scipy.special.ndtri(np.clip(points, 1e-9, 1.0 - 1e-9)):
        some = _sample(cuts, spread, root, n)
        found = largest_multipliers(some, per_wave=PER_WAVE, most=2 * count + SPARE, still=STILL)
        stable += np.abs(found) < 1.0
    return stable / samples


def variance_shares(cut: DynamicCuts, spread: ModeSpread, coefficients: ArrayLike) -> tuple[Floats, float]:
    """Return the variance shares of log|mu| of one cut by cause; improve the measurement with the greatest share first.

    Each value's part of the variance to first order, at the values as they are stated: (d log|mu| / d n)^2 over the
    sum of all. On the flank of a lobe that is a guide, not a probability.

    Parameters
    ----------
    cut, spread, coefficients : as of :func:`stable_probability`, of one cut

    Returns
    -------
    shares : (M, 3) float, of frequency, damping ratio and stiffness of each mode
    cutting : that of the cutting coefficients; all are 0 where nothing has a spread

    Raises
    ------
    InputError
        There are more cuts than one.
    """
    if len(cut) != 1:
        raise InputError(f"variance shares: {len(cut)} cuts: must be one")
    count = len(cut.damping)
    root = _root(coefficients)

    def growth(n: Floats) -> float:
        found = largest_multipliers(_sample(cut, spread, root, n), per_wave=PER_WAVE_FIRST)
        return math.log(max(abs(found[0]), TINY))

    each = FIRST * np.eye(3 * count + 2)
    slope = np.array([growth(n) - growth(-n) for n in each])
    shares = slope**2 / (slope @ slope) if slope.any() else slope
    return shares[: 3 * count].reshape(3, count).T, float(shares[3 * count :].sum())


def _root(coefficients: ArrayLike) -> Floats:
    """Return a square root (2, 2) of a covariance."""
    values, vectors = np.linalg.eigh(np.asarray(coefficients, dtype=np.float64))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _sample(cuts: DynamicCuts, spread: ModeSpread, root: Floats, n: Floats) -> DynamicCuts:
    """Return the cuts at normal values (3 M + 2,) of frequencies, damping ratios, stiffnesses and coefficients."""
    count = len(cuts.damping)
    f, z, k = (
        np.maximum(1.0 + s * n[i * count : (i + 1) * count], LEAST)
        for i, s in enumerate((spread.frequency, spread.damping, spread.stiffness))
    )
    tangential, radial = np.maximum(1.0 + root @ n[3 * count :], LEAST)
    rows = cuts.rows.copy()
    rows[:, 5] *= tangential
    rows[:, 6:8] *= radial
    U = np.ascontiguousarray(cuts.U * (f / np.sqrt(k)))
    return replace(cuts, rows=rows, damping=np.minimum(cuts.damping * z, MOST_DAMPED), omega=cuts.omega * f, U=U)
