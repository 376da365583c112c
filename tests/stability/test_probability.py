"""The probability of stability: independent samples, certainty without spread, what is refused."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np
import pytest

from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.stability.margin import largest_multipliers
from chipload.stability.modes import Modes
from chipload.stability.probability import ModeSpread, stable_probability, variance_shares
from stability.stability_oracles import HALF, TWO, cut_of

SPREAD, COEFFICIENTS = ModeSpread(0.02, 0.15, 0.05), np.diag([0.1**2, 0.15**2])


def test_on_the_flank_and_in_the_pocket():
    """1500 samples by another program: 0.969 +- 0.004 at 6000 rpm and 2 mm, 1 at 11000 rpm and 1.2 mm."""
    flank = stable_probability(cut_of(TWO, 6000, 2.0, HALF), SPREAD, COEFFICIENTS, samples=512)[0]
    assert flank == pytest.approx(0.969, abs=0.012)
    assert stable_probability(cut_of(TWO, 11000, 1.2, HALF), SPREAD, COEFFICIENTS)[0] == 1.0


def test_random_samples_of_whole_cuts_have_the_same_share():
    rng, stable, count = np.random.default_rng(5), 0, 400
    for _ in range(count):
        f, z, k = (np.maximum(1.0 + s * rng.standard_normal(2), 0.1) for s in (0.02, 0.15, 0.05))
        modes = Modes(TWO.frequency * f, TWO.damping * z, TWO.stiffness * k, TWO.direction)
        t, r = 1.0 + 0.1 * rng.standard_normal(), 1.0 + 0.15 * rng.standard_normal()
        metal = Material("m", 700.0 * t, 210.0 * r, 0.0, 0.0, 0.0, 0.0, source="made up for tests")
        cut = cut_of(modes, 8000, 1.9, HALF, metal=metal)
        stable += abs(largest_multipliers(cut, per_wave=9.0, most=16, still=1e-3)[0]) < 1.0
    share = stable / count
    assert 0.1 < share < 0.9
    found = stable_probability(cut_of(TWO, 8000, 1.9, HALF), SPREAD, COEFFICIENTS, samples=256)[0]
    assert found == pytest.approx(share, abs=3.0 * math.sqrt(share * (1.0 - share) / count))


@pytest.mark.parametrize("which", [0, 1])
def test_each_coefficient_counts_by_itself(which):
    """One coefficient alone is unsure: the share of its quantiles at which the cut is stable."""
    none, covariance = ModeSpread(0.0, 0.0, 0.0), np.zeros((2, 2))
    covariance[which, which] = 0.6**2
    stable, count = 0, 200
    for q in (np.arange(count) + 0.5) / count:
        factor = [1.0, 1.0]
        factor[which] = max(1.0 + 0.6 * NormalDist().inv_cdf(q), 0.1)
        metal = Material("m", 700.0 * factor[0], 210.0 * factor[1], 0.0, 0.0, 0.0, 0.0, source="made up for tests")
        cut = cut_of(TWO, 8000, 1.8, HALF, metal=metal)
        stable += abs(largest_multipliers(cut, per_wave=9.0, most=16, still=1e-3)[0]) < 1.0
    found = stable_probability(cut_of(TWO, 8000, 1.8, HALF), none, covariance, samples=256)[0]
    assert 0.05 < stable / count < 0.98
    assert found == pytest.approx(stable / count, abs=0.02)


def test_the_frequency_of_the_first_mode_is_to_be_measured_first():
    """By another program: 61 % of the variance are of the frequency along x, 19 % of its damping ratio."""
    shares, cutting = variance_shares(cut_of(TWO, 6000, 2.0, HALF), SPREAD, COEFFICIENTS)
    assert shares[0, :2].tolist() == pytest.approx([0.61, 0.19], abs=0.01)
    assert shares.sum() + cutting == pytest.approx(1.0)
    alone, rest = variance_shares(cut_of(TWO, 6000, 2.0, HALF), ModeSpread(0.0, 0.15, 0.0), np.zeros((2, 2)))
    assert alone[:, 1].sum() == pytest.approx(1.0)
    assert rest == 0.0


def test_without_spread_it_is_certain():
    none = ModeSpread(0.0, 0.0, 0.0)
    both = [stable_probability(cut_of(TWO, 8000, d, HALF), none, np.zeros((2, 2)), samples=4)[0] for d in (0.3, 4.0)]
    sizes = [abs(largest_multipliers(cut_of(TWO, 8000, d, HALF))[0]) for d in (0.3, 4.0)]
    assert both == [1.0, 0.0]
    assert sizes[0] < 1.0 < sizes[1]


def test_what_cannot_be_is_refused():
    with pytest.raises(InputError, match=r"dynamics.damping_percent = 150"):
        ModeSpread(0.02, 1.5, 0.05)
    with pytest.raises(InputError, match="must be a power of 2"):
        stable_probability(cut_of(TWO, 8000, 1.0, HALF), SPREAD, COEFFICIENTS, samples=100)
    with pytest.raises(InputError, match="variance shares: 2 cuts: must be one"):
        variance_shares(cut_of(TWO, 8000, 1.0, HALF).chosen([0, 0]), SPREAD, COEFFICIENTS)
