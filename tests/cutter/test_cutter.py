from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chipload.cutter.cutter import Cutter

Z = np.linspace(0.0, 20.0, 2001)


def mill(**more):
    return Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5, **more)


def test_flat():
    assert mill().apt == (10.0, 0.0, 5.0, 0.0, 0.0, 0.0, 20.0)
    assert (mill().radius_at(Z) == 5.0).all()


def test_bull():
    rho = mill(corner_radius=2.0).radius_at(Z)
    want = np.where(Z < 2, 3 + np.sqrt(np.clip(4 - (2 - Z) ** 2, 0, None)), 5)
    np.testing.assert_allclose(rho, want, atol=1e-12)
    assert rho[0] == 3.0


def test_ball():
    ball = mill(corner_radius=5.0)
    assert ball.apt[2:4] == (0.0, 5.0)
    np.testing.assert_allclose(
        ball.radius_at(Z), np.where(Z < 5, np.sqrt(np.clip(10 * Z - Z**2, 0, None)), 5), atol=1e-7
    )


def test_taper():
    """A tapered ball of radius 2 whose cone's half angle is 5 deg: d / 2 is the cone's radius at the tip's height."""
    beta = math.radians(5.0)
    d = 4.0 * (1 / math.cos(beta) - math.tan(beta))
    cone = Cutter(d, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=2.0, taper=beta)
    assert cone.apt[2] == pytest.approx(0.0, abs=1e-12)
    touch = 2.0 - 2.0 * math.sin(beta)
    want = np.where(touch > Z, np.sqrt(np.clip(4 - (2 - Z) ** 2, 0, None)), d / 2 + Z * math.tan(beta))
    np.testing.assert_allclose(cone.radius_at(Z), want, atol=1e-7)


def test_drill_point_and_cone():
    drill = mill(bottom=math.radians(31.0))
    np.testing.assert_allclose(drill.radius_at(Z), np.minimum(Z / math.tan(math.radians(31.0)), 5.0), atol=1e-12)
    cone = mill(taper=math.radians(10.0))
    np.testing.assert_allclose(cone.radius_at(Z), 5 + Z * math.tan(math.radians(10.0)), atol=1e-12)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.floats(0, 40), st.floats(0, 40), st.floats(0, 1))
def test_seven_numbers(alpha, beta, share):
    """The corner touches both lines: its centre is r from each; the profile lies on the envelope and never narrows."""
    alpha, beta = math.radians(alpha), math.radians(beta)
    largest = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5, bottom=alpha, taper=beta)._largest_corner
    c = mill(bottom=alpha, taper=beta, corner_radius=share * largest)
    _, r, e, f, *_ = c.apt
    assert e >= 0.0
    from_bottom = (f - e * math.tan(alpha)) * math.cos(alpha)
    corner = 5.0 * math.tan(alpha)
    from_flank = (5.0 + (f - corner) * math.tan(beta) - e) * math.cos(beta)
    assert from_bottom == pytest.approx(r, abs=1e-9)
    assert from_flank == pytest.approx(r, abs=1e-9)
    p = c.profile(1e-3)
    assert (np.diff(p, axis=0) >= -1e-12).all()
    inside = p[p[:, 1] > 1e-9]
    np.testing.assert_allclose(c.radius_at(inside[:, 1]), inside[:, 0], atol=1e-5)
    fine = c.radius_at(np.linspace(0, 20, 4001))
    assert (np.diff(fine) >= -1e-12).all()
