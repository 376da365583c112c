"""Slices of the profile against the definition of the seven numbers and against the envelope's radius."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import Slices, slices
from chipload.errors import InputError

FORMS = [
    {},
    {"corner_radius": 5.0},
    {"corner_radius": 1.5},
    {"taper": 0.2},
    {"bottom": 0.3},
    {"corner_radius": 1.0, "bottom": 0.2, "taper": 0.15},
]


def mill(**form):
    return Cutter(10.0, 4, math.radians(35.0), 20.0, 30.0, 6e5, **form)


def test_of_a_flat_mill_by_hand():
    """Bottom from -5 to 0 without lag, flank from 0 to 20 on which s is z."""
    edge = slices(mill(), bottom_slices=1)
    np.testing.assert_array_equal(edge.s_from, [-5.0, 0.0])
    np.testing.assert_array_equal(edge.s_to, [0.0, 20.0])
    lead = math.tan(math.radians(35.0)) / 5.0
    np.testing.assert_array_equal(
        edge.columns, [[-5.0, 2.5, 0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 5.0, 0.0, 1.0, 0.0, 0.0, lead]]
    )


@pytest.mark.parametrize("form", FORMS)
def test_the_middles_lie_on_the_envelope(form):
    """The middle of a slice, reached along its tangent, lies on the profile; its normal is square to the profile."""
    cutter = mill(**form)
    edge = slices(cutter, corner_slices=200, flank_mm=0.5)
    half = 0.5 * (edge.s_to - edge.s_from)
    np.testing.assert_allclose(np.hypot(edge.sin_kappa, edge.cos_kappa), 1.0, rtol=1e-15)
    z = edge.z + half * edge.sin_kappa
    steep = (edge.sin_kappa > 1e-9) & (z > 0.05)
    np.testing.assert_allclose(cutter.radius_at(z[steep]), edge.rho[steep], atol=4e-4)
    slope = (cutter.radius_at(z[steep] + 1e-5) - cutter.radius_at(z[steep] - 1e-5)) / 2e-5
    inside = np.abs(slope - (cutter.radius_at(z[steep]) - cutter.radius_at(z[steep] - 2e-5)) / 2e-5) < 1e-3
    np.testing.assert_allclose(slope[inside], (edge.cos_kappa[steep] / edge.sin_kappa[steep])[inside], atol=5e-3)
    assert inside.mean() > 0.9


@pytest.mark.parametrize("form", FORMS)
def test_they_follow_one_another_from_the_axis_to_the_flute_end(form):
    cutter = mill(**form)
    edge = slices(cutter, bottom_slices=3, corner_slices=64, flank_mm=1.7)
    np.testing.assert_allclose(edge.s_from[1:], edge.s_to[:-1], atol=1e-12)
    length = edge.s_to - edge.s_from
    assert (length > 0.0).all()
    assert edge.rho[0] - 0.5 * length[0] * edge.cos_kappa[0] == pytest.approx(0.0, abs=1e-3)
    assert edge.z[0] == pytest.approx(0.0, abs=1e-12)
    assert edge.z[-1] + length[-1] * edge.sin_kappa[-1] == pytest.approx(20.0, rel=1e-12)
    assert np.sum(length * edge.sin_kappa) == pytest.approx(20.0, rel=1e-4)
    assert np.sum(length * edge.cos_kappa) == pytest.approx(float(cutter.radius_at(20.0)), rel=1e-4)
    profile = cutter.profile(1e-6)
    assert np.sum(length) == pytest.approx(np.hypot(*np.diff(profile, axis=0).T).sum(), rel=1e-6)
    on_flank = length[edge.s_from > edge.s_to[-1] - 5.0]
    assert (on_flank <= 1.7 + 1e-12).all()


@pytest.mark.parametrize("form", FORMS)
def test_constant_lead(form):
    """The lag at the lower end of every slice is that of its height, and goes on to that of the next."""
    cutter = mill(**form)
    edge = slices(cutter, corner_slices=400)
    lead = math.tan(cutter.helix) / 5.0
    np.testing.assert_allclose(edge.lag, lead * edge.z, rtol=1e-13)
    np.testing.assert_allclose((edge.lag + edge.rate * (edge.s_to - edge.s_from))[:-1], edge.lag[1:], atol=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bottom_slices": 0}, "slices: bottom_slices = 0: must be at least 1"),
        ({"corner_slices": 0}, "slices: corner_slices = 0: must be at least 1"),
        ({"grading": 0.5}, "slices: grading = 0.5: must be from 1 (evenly) to 3"),
        ({"flank_mm": 0.0}, "slices: flank_mm = 0: must be above 0, or None for one slice"),
    ],
)
def test_refused(change, message):
    with pytest.raises(InputError) as err:
        slices(mill(), **change)
    assert str(err.value) == message


def test_refuses_columns_that_do_not_agree():
    with pytest.raises(InputError) as err:
        Slices(*(np.zeros(2),) * 7, np.zeros(3), np.zeros(2))
    assert str(err.value) == "slices.rate of shape (3,): need (2,) finite numbers"
