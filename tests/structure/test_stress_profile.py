"""Profiles of residual stress: equilibrium, balance and refusal, against integrals of the shapes in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.structure.stress_profile import StressProfile, m_shape, odd_shape, profile_of_points, require_balance

H = 30.0


def resultants(profile):
    """Force and moment by a fine sum."""
    z = np.linspace(0.0, profile.thickness, 200_001)
    return [(np.trapezoid(v, z), np.trapezoid(v * (z - 0.5 * profile.thickness), z)) for v in profile.at(z)]


@pytest.mark.parametrize("shape", [m_shape, odd_shape])
def test_shapes_are_in_equilibrium(shape):
    for force, moment in resultants(shape(H, 20.0, 0.6)):
        assert abs(force) < 1e-6
        assert abs(moment) < 1e-4
    assert shape(H, 20.0, 0.6).greatest == pytest.approx(20.0, rel=1e-4)


def test_a_constant_and_a_linear_term_are_taken_away():
    good = m_shape(H, 20.0, 0.6)
    off = StressProfile(good.height, good.along_x + 1.0 + 0.1 * (good.height - 15.0), good.along_y)
    balanced, share = require_balance(off)
    assert np.allclose(balanced.along_x, good.along_x, atol=1e-9)
    z = np.linspace(0.0, H, 200_001)
    size = np.trapezoid(np.abs(off.at(z)[0]), z)
    moment = 0.1 * H**3 / 12.0
    assert share == pytest.approx(max(1.0 * H / size, 2.0 * moment / (H * size)), rel=1e-4)


def test_half_of_a_plate_is_refused():
    half = profile_of_points([(0.0, -20.0, -10.0), (10.0, -5.0, -2.0), (15.0, 4.0, 3.0)])
    with pytest.raises(InputError, match=r"its resultant is 9[0-9]% of the stress: at most 25% is balanced"):
        require_balance(half)


def test_turned_over_and_about():
    profile = odd_shape(H, 20.0, 0.6)
    z = np.array([2.0, 11.0, 29.0])
    assert np.allclose(profile.upside_down().at(z), profile.at(H - z))
    assert np.allclose(profile.turned().at(z), profile.at(z)[::-1])
    assert np.array_equal(profile.at(np.array([-0.1, 30.1])), np.zeros((2, 2)))


@pytest.mark.parametrize("z", [(0.0, 5.0, 5.0), (1.0, 2.0, 3.0), (0.0, 2.0, np.nan)])
def test_heights_that_make_no_profile(z):
    with pytest.raises(InputError, match="heights must rise from 0"):
        StressProfile(np.array(z), np.zeros(3), np.zeros(3))
