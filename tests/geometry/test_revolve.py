"""Surfaces of revolution, against a sphere and a cone."""

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.geometry.revolve import Revolved

A = np.linspace(0.2, 1.4, 80)


def test_sphere():
    ball = Revolved(30.0 * np.stack([np.cos(A), np.sin(A)], axis=-1), 1)
    s, theta = np.linspace(0.05, 0.95, 9), np.linspace(-3, 3, 9)
    p = ball.at(s, theta)
    np.testing.assert_allclose(np.linalg.norm(p, axis=1), 30.0, atol=1e-6)
    # the curve goes up and inwards: left of it is the inside
    N = ball.normal(s, theta)
    np.testing.assert_allclose(N, -p / 30.0, atol=1e-5)
    K = ball.curvature(s, theta)
    expected = (np.eye(3) - N[:, :, None] * N[:, None, :]) / 30.0
    np.testing.assert_allclose(K, expected, atol=1e-5)


def test_cone_bends_only_around():
    cone = Revolved(np.array([[10.0, 0.0], [20.0, 10.0], [30.0, 20.0]]), -1)
    K = cone.curvature([0.5], [0.0])[0]
    # outside of a cone of 45 deg at r = 20: -cos(45 deg) / r around, nothing along
    assert K[1, 1] == pytest.approx(-np.sqrt(0.5) / 20.0)
    assert abs(K[[0, 0, 2], [0, 2, 2]]).max() < 1e-12
    np.testing.assert_allclose(cone.normal([0.5], [0.0])[0], [np.sqrt(0.5), 0.0, -np.sqrt(0.5)])


def test_nearest():
    cone = Revolved(np.array([[10.0, 0.0], [30.0, 20.0]]), 1)
    assert cone.nearest([21.0], [9.0])[0] == pytest.approx(0.5, abs=1e-3)


def test_refused():
    with pytest.raises(InputError, match="meridian: radius -1 mm: must be at least 0"):
        Revolved(np.array([[-1.0, 0.0], [2.0, 3.0]]), 1)
    with pytest.raises(InputError, match="meridian: point 2 appears twice"):
        Revolved(np.array([[1.0, 0.0], [2.0, 3.0], [2.0, 3.0]]), 1)
    with pytest.raises(InputError, match="on the axis"):
        Revolved(np.array([[0.0, 0.0], [5.0, 0.0]]), 1).curvature([0.0], [0.0])


def test_nearest_is_the_nearest_of_all_points_of_the_curve():
    ball = Revolved(30.0 * np.stack([np.cos(A), np.sin(A)], axis=-1), 1)
    r, z = np.random.default_rng(4).uniform(0.0, 40.0, (2, 50))
    s = np.linspace(0.0, 1.0, 101)
    away = np.hypot(r[:, None] - ball.curve(s)[:, 0], z[:, None] - ball.curve(s)[:, 1])
    np.testing.assert_array_equal(ball.nearest(r, z, 101), s[away.argmin(axis=1)])
