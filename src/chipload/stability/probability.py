"""How sure it is that a cut is stable, where modes and coefficients are known to some per cent.

Notation: every frequency, damping ratio and stiffness, and the tangential and the radial coefficient, is its value
times 1 + s n with s its relative standard deviation and n normal; those of different modes are independent. The
probability is the share of quasi-random samples (Sobol, always the same ones) in which |mu| < 1: on the flank of a
lobe an expansion about the mean is too sure.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import norm, qmc

from chipload.errors import InputError
from chipload.stability.cuts import DynamicCuts
from chipload.stability.margin import PER_WAVE, largest_multipliers

Floats = NDArray[np.float64]

#: samples, a power of 2
SAMPLES = 128
#: a sampled value is at least this share of the mean
LEAST = 0.1
#: and a damping ratio at most
MOST_DAMPED = 0.5
#: dimensions of the Krylov space beside two a mode, and how still |mu| is then
SPARE, STILL = 12, 1e-3


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
    """Probability that each cut is stable, (n,) float, in steps of one over ``samples``.

    Parameters
    ----------
    coefficients : (2, 2) float, relative covariance of the tangential and the radial coefficient
    samples : a power of 2
    """
    if samples < 2 or samples & (samples - 1):
        raise InputError(f"stable probability: samples = {samples}: must be a power of 2, 2 at least")
    count = len(cuts.damping)
    values, vectors = np.linalg.eigh(np.asarray(coefficients, dtype=np.float64))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    points = qmc.Sobol(3 * count + 2, scramble=True, rng=0).random(samples)
    normal = norm.ppf(np.clip(points, 1e-9, 1.0 - 1e-9))
    stable = np.zeros(len(cuts))
    for n in normal:
        f, z, k = (
            np.maximum(1.0 + s * n[i * count : (i + 1) * count], LEAST)
            for i, s in enumerate((spread.frequency, spread.damping, spread.stiffness))
        )
        tangential, radial = np.maximum(1.0 + root @ n[3 * count :], LEAST)
        rows = cuts.rows.copy()
        rows[:, 5] *= tangential
        rows[:, 6:8] *= radial
        U = np.ascontiguousarray(cuts.U * (f / np.sqrt(k)))
        some = replace(cuts, rows=rows, damping=np.minimum(cuts.damping * z, MOST_DAMPED), omega=cuts.omega * f, U=U)
        found = largest_multipliers(some, per_wave=PER_WAVE, most=2 * count + SPARE, still=STILL)
        stable += np.abs(found) < 1.0
    return stable / samples
