"""Step-over: two passes of a toroid against the height of the ridge between them, point by point."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from chipload.errors import InputError
from chipload.planning.impeller.step_over import contact_of, step_over, trace_curvature

FLAT = np.zeros((3, 3))


def away(p, centre, T, rho, r):
    """Distance of points (k, 3) to a toroid without its flank: a ball of radius r moved over a disc."""
    a = p - centre
    h = a @ T
    flat = np.linalg.norm(a - h[:, None] * T, axis=1)
    return np.hypot(np.clip(flat - rho, 0.0, None), h) - r


def lean(n, phi):
    s = math.sqrt(1.0 - n * n)
    return np.array([s * math.cos(phi), s * math.sin(phi), n])


def ridge(k, n, phi, rho, r, w):
    """Height of the ridge between two passes along y, w apart on a surface z = k x^2 / 2 as a circle."""
    T, N = lean(n, phi), np.array([0.0, 0.0, 1.0])
    centre = r * N + rho * (N - n * T) / math.sqrt(1.0 - n * n)
    y = np.linspace(-1.2 * (rho + r), 1.2 * (rho + r), 2401)

    def gap(z):
        # the middle turned back to where a pass touches the surface at x = 0
        turn = 0.5 * w * k
        x = math.sin(turn) * (1.0 / k - z) if k else 0.5 * w
        up = (1.0 - math.cos(turn)) / k + z * math.cos(turn) if k else z
        p = np.stack([np.full_like(y, x), y, np.full_like(y, up)], axis=-1)
        q = p * np.array([-1.0, 1.0, 1.0])
        return min(away(p, centre, T, rho, r).min(), away(q, centre, T, rho, r).min())

    return brentq(gap, 0.0, 0.9 * r)


@pytest.mark.parametrize("k", [0.0, -0.02, 0.02])
@pytest.mark.parametrize(("n", "phi"), [(0.02, 0.5), (0.3, 0.0), (0.3, 0.5), (0.3, 1.0), (0.8, 0.5 * math.pi)])
def test_two_passes_leave_the_height(k, n, phi):
    h = 2e-3
    K = np.diag([k, 0.0, 0.0])
    w = step_over([[0, 0, 1]], [lean(n, phi)], [[0, 1, 0]], K, 8.0, 2.0, h)[0]
    assert ridge(k, n, phi, 8.0, 2.0, w) == pytest.approx(h, rel=0.01)


@pytest.mark.parametrize("k", [0.0, -0.02, 0.02])
def test_ball_exactly(k):
    # a ball sweeps a circle: no second order is left
    K = np.diag([k, 0.0, 0.0])
    for h in (0.01, 0.3, 1.0):
        w = step_over([[0, 0, 1]], [lean(0.6, 0.4)], [[0, 1, 0]], K, 0.0, 3.0, h)[0]
        assert ridge(k, 0.6, 0.4, 0.0, 3.0, w) == pytest.approx(h, abs=1e-5)


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.3, 2.5])
@pytest.mark.parametrize("K", [(0.01, 0.0, -0.02), (-0.03, 0.02, 0.01), (0.02, -0.015, 0.03)])
def test_what_is_swept_over_a_twisted_surface(angle, K):
    # the surface z = x.K x / 2, its contact line y' = 0 in the direction of the angle; the gap beside it is q e^2 / 2
    tensor = np.zeros((3, 3))
    tensor[0, 0], tensor[0, 1], tensor[1, 0], tensor[1, 1] = K[0], K[1], K[1], K[2]
    rho, r, T = 6.0, 2.0, lean(0.35, 0.7)
    d = np.array([math.cos(angle), math.sin(angle), 0.0])
    e = np.array([-d[1], d[0], 0.0])
    off = 0.005

    def swept(z):
        def at(t):
            g = tensor @ (t * d)
            N = np.array([-g[0], -g[1], 1.0])
            N /= np.linalg.norm(N)
            S = t * d + np.array([0.0, 0.0, 0.5 * t * t * (d @ tensor @ d)])
            n = N @ T
            centre = S + r * N + rho * (N - n * T) / math.sqrt(1.0 - n * n)
            p = off * e + np.array([0.0, 0.0, 0.5 * off * off * (e @ tensor @ e) + z])
            return away(p[None], centre, T, rho, r)[0]

        return minimize_scalar(at, bounds=(-0.5, 0.5), method="bounded", options={"xatol": 1e-9}).fun

    q = trace_curvature(contact_of([[0, 0, 1]], [T], [d], tensor), rho, r)[0]
    gap = brentq(swept, -1e-5, 1e-4, xtol=1e-15)
    assert gap == pytest.approx(0.5 * q * off * off, rel=0.002)


def test_the_radii_are_mixed():
    for phi in (0.0, 0.3, 1.2):
        q = trace_curvature(contact_of([[0, 0, 1]], [lean(0.5, phi)], [[0, 2, 0]], FLAT), 8.0, 2.0)[0]
        wide = 2.0 + 8.0 / math.sqrt(0.75)
        assert 1.0 / q == pytest.approx(2.0 * math.cos(phi) ** 2 + wide * math.sin(phi) ** 2, rel=1e-12)


def test_an_edge_and_a_cutter_too_large():
    # a sharp corner: the step towards the axis leaves ridges however small it is
    assert step_over([[0, 0, 1]], [lean(0.5, 0.0)], [[0, 1, 0]], FLAT, 8.0, 0.0, 0.01)[0] == 0.0
    assert step_over([[0, 0, 1]], [lean(0.5, 0.5 * math.pi)], [[0, 1, 0]], FLAT, 8.0, 0.0, 0.01)[0] > 0.5
    hollow = np.diag([0.2, 0.2, 0.0])
    assert step_over([[0, 0, 1]], [lean(0.0, 0.0)], [[0, 1, 0]], hollow, 8.0, 2.0, 0.01)[0] == 0.0
    # the ridge cannot be higher than the passes are round: at most a diameter
    assert step_over([[0, 0, 1]], [lean(0.5, 0.0)], [[0, 1, 0]], FLAT, 0.0, 3.0, 50.0)[0] == pytest.approx(6.0)


def test_refused():
    with pytest.raises(InputError, match="axis of contact point 0: must not stand along the normal"):
        step_over([[0, 0, 1]], [[0, 0, 1]], [[0, 1, 0]], FLAT, 8.0, 2.0, 0.01)
    with pytest.raises(InputError, match="along of contact point 0: must have a direction across the normal"):
        step_over([[0, 0, 1]], [[1, 0, 0]], [[0, 0, 1]], FLAT, 8.0, 2.0, 0.01)
    with pytest.raises(InputError, match="scallop_mm = 0: must be above 0"):
        step_over([[0, 0, 1]], [[1, 0, 0]], [[0, 1, 0]], FLAT, 8.0, 2.0, 0.0)
    with pytest.raises(InputError, match="rho 0, corner radius 0 mm"):
        step_over([[0, 0, 1]], [[1, 0, 0]], [[0, 1, 0]], FLAT, 0.0, 0.0, 0.1)
