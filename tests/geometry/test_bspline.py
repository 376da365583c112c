"""Interpolating B-spline surfaces, against scipy and closed forms."""

import numpy as np
import pytest
from scipy.interpolate import NdBSpline

from chipload.errors import InputError
from chipload.geometry.bspline import patch_through

U, V = np.sort(np.r_[0.0, np.random.default_rng(1).uniform(size=11), 1.0]), np.linspace(0.0, 1.0, 9) ** 1.3


def wavy():
    u, v = np.meshgrid(U, V, indexing="ij")
    return np.stack([30 * u + np.sin(3 * v), 20 * v + u * u, 4 * np.sin(4 * u) * np.cos(3 * v)], axis=-1)


@pytest.mark.parametrize("degrees", [(3, 3), (5, 2), (1, 3)])
def test_against_scipy(degrees):
    patch = patch_through(wavy(), U, V, degrees)
    other = NdBSpline((patch.knots_u, patch.knots_v), patch.control, patch.degrees)
    rng = np.random.default_rng(2)
    u, v = np.r_[0, 1, 0, 1, rng.uniform(size=200)], np.r_[0, 0, 1, 1, rng.uniform(size=200)]
    xi = np.stack([u, v], axis=-1)
    for du, dv in ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)):
        expected = other(xi, nu=(du, dv))
        np.testing.assert_allclose(patch.at(u, v, du, dv), expected, rtol=1e-9, atol=1e-9)


def test_goes_through_its_points():
    u, v = np.meshgrid(U, V, indexing="ij")
    at = patch_through(wavy(), U, V).at(u.ravel(), v.ravel())
    np.testing.assert_allclose(at, wavy().reshape(-1, 3), atol=1e-11)


def torus(a, b):
    """R 20, r 5: normal outwards, curvatures -1/5 and -cos(b) / (20 + 5 cos b)."""
    ring = 20.0 + 5.0 * np.cos(b)
    return np.stack([ring * np.cos(a), ring * np.sin(a), 5.0 * np.sin(b)], axis=-1)


def test_normal_and_curvature_of_a_torus():
    x = np.linspace(0.0, 1.0, 60)
    a, b = np.meshgrid(1.0 * x, 1.0 * x, indexing="ij")
    patch = patch_through(torus(a, b), x, x, (5, 5))
    u, v = (c.ravel() for c in np.meshgrid(np.linspace(0.1, 0.9, 7), np.linspace(0.1, 0.9, 7)))
    ring = np.stack([np.cos(u), np.sin(u), np.zeros_like(u)], axis=-1)
    normal = ring * np.cos(v)[:, None] + np.array([0, 0, 1.0]) * np.sin(v)[:, None]
    np.testing.assert_allclose(patch.normal(u, v), normal, atol=1e-8)
    expected = np.stack([np.full(len(u), -0.2), -np.cos(v) / (20 + 5 * np.cos(v))], axis=-1)
    np.testing.assert_allclose(patch.principal(u, v), np.sort(expected, axis=1), atol=1e-6)
    around = np.stack([-np.sin(u), np.cos(u), np.zeros_like(u)], axis=-1)
    K = patch.curvature(u, v)
    np.testing.assert_allclose(np.einsum("ki,kij,kj->k", around, K, around), expected[:, 1], atol=1e-6)
    np.testing.assert_allclose(K @ normal[:, :, None], 0.0, atol=1e-7)


def test_facing_is_point_and_normal_of_a_sphere():
    """R 20: the normal is the point over R; to the last bit as by themselves, with u or v the same in a row."""
    a, b = np.meshgrid(np.linspace(-1.0, 1.0, 21), np.linspace(-0.6, 0.6, 17), indexing="ij")
    grid = 20.0 * np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], axis=-1)
    patch = patch_through(grid, np.linspace(0.0, 1.0, 21), np.linspace(0.0, 1.0, 17), (5, 5))
    u, v = np.repeat(np.linspace(0.05, 0.95, 7), 5), np.tile(np.linspace(0.1, 0.9, 5), 7)
    for at in ((u, v), (v, u)):
        points, normals = patch.facing(*at)
        np.testing.assert_allclose(normals, points / 20.0, atol=1e-6)
        np.testing.assert_array_equal(points, patch.at(*at))
        cross = np.cross(patch.at(*at, 1, 0), patch.at(*at, 0, 1))
        np.testing.assert_allclose(normals, cross / np.linalg.norm(cross, axis=1)[:, None], atol=1e-14)


@pytest.mark.parametrize("side", [1, -1])
def test_shape_against_the_fundamental_forms(side):
    """Points and tangents to the last bit as by themselves, N and K = J I^-1 II I^-1 J^T by scipy's derivatives."""
    patch = patch_through(wavy(), U, V, (3, 2), side)
    other = NdBSpline((patch.knots_u, patch.knots_v), patch.control, patch.degrees)
    rng = np.random.default_rng(3)
    u, v = rng.uniform(size=(2, 100))
    points, normals, curvatures, tangents = patch.shape(u, v)
    np.testing.assert_array_equal(points, patch.at(u, v))
    np.testing.assert_array_equal(tangents, [patch.at(u, v, 1, 0), patch.at(u, v, 0, 1)])
    a, b, aa, ab, bb = (other(np.stack([u, v], axis=-1), nu=nu) for nu in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2)))
    cross = side * np.cross(a, b)
    N = cross / np.linalg.norm(cross, axis=1)[:, None]
    np.testing.assert_allclose(normals, N, atol=1e-12)
    J = np.stack([a, b], axis=-1)
    second = np.moveaxis(np.array([[(aa * N).sum(1), (ab * N).sum(1)], [(ab * N).sum(1), (bb * N).sum(1)]]), 2, 0)
    first = np.linalg.inv(np.swapaxes(J, 1, 2) @ J)
    expected = J @ first @ second @ first @ np.swapaxes(J, 1, 2)
    np.testing.assert_allclose(curvatures, expected, rtol=1e-9, atol=1e-12)


def test_turned():
    patch = patch_through(wavy(), U, V)
    p, q = patch.at(0.3, 0.6)[0], patch.turned(0.7).at(0.3, 0.6)[0]
    assert np.hypot(*p[:2]) == pytest.approx(np.hypot(*q[:2]))
    assert np.arctan2(q[1], q[0]) - np.arctan2(p[1], p[0]) == pytest.approx(0.7)


def test_refused():
    with pytest.raises(InputError, match=r"patch.u: must ascend from 0 to 1, one for each of 13 points"):
        patch_through(wavy(), U * 2, V)
    with pytest.raises(InputError, match=r"patch: parameter out of 0\.\.1"):
        patch_through(wavy(), U, V).at(1.1, 0.0)
    flat = np.zeros((4, 4, 3))
    with pytest.raises(InputError, match="no normal where S_u and S_v are parallel"):
        patch_through(flat, np.linspace(0, 1, 4), np.linspace(0, 1, 4)).normal(0.5, 0.5)
    with pytest.raises(InputError, match="no normal where S_u and S_v are parallel"):
        patch_through(flat, np.linspace(0, 1, 4), np.linspace(0, 1, 4)).facing(0.5, 0.5)
    with pytest.raises(InputError, match="no normal where S_u and S_v are parallel"):
        patch_through(flat, np.linspace(0, 1, 4), np.linspace(0, 1, 4)).shape(0.5, 0.5)
