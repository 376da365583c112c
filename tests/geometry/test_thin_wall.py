"""Thin walls by formula: volumes, normals, thickness, and a blade through made-up sections."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chipload.errors import InputError
from chipload.geometry.sections import check_sections, loft
from chipload.geometry.thin_wall import blade, plate, through_sections

U, V = np.meshgrid(np.linspace(0.0, 1.0, 7), np.linspace(0.0, 1.0, 5), indexing="ij")


def test_plate_under_stock():
    """Length x height x (thickness + stock), closed, outside outwards."""
    wall = plate(40.0, 30.0, 3.0)
    mesh = wall.mesh((8, 6), (0.5, 0.7))
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(40.0 * 30.0 * 4.2, rel=1e-12)
    above = wall.mesh((8, 6), (0.0, 0.0), low=0.2)
    assert above.volume == pytest.approx(40.0 * 24.0 * 3.0, rel=1e-12)
    minus, plus = wall.normals(U, V)
    assert_allclose(minus, np.broadcast_to([0.0, 1.0, 0.0], minus.shape), atol=1e-9)
    assert_allclose(plus, np.broadcast_to([0.0, -1.0, 0.0], plus.shape), atol=1e-9)
    assert wall.size() == pytest.approx((40.0, 30.0, 3.0))


def test_blade_without_twist_is_a_ring():
    """Camber 60 deg over a chord of 20 mm: an arc of radius 20, of even thickness 2: both sides are circles about the
    middle of the arc, its area 2 x 20 x pi / 3."""
    wall = blade((20.0, 20.0), 12.0, (2.0, 2.0), 1.0, math.radians(60.0), (0.3, 0.3))
    minus, plus = wall.sides(U, V)
    middle = 20.0 * math.cos(math.radians(30.0)) * np.array([math.sin(0.3), -math.cos(0.3)])
    for points, radius in ((minus, 21.0), (plus, 19.0)):
        assert_allclose(np.linalg.norm(points[..., :2] - middle, axis=-1), radius, rtol=1e-12)
    assert wall.mesh((400, 4), (0.0, 0.0)).volume == pytest.approx(2.0 * 20.0 * math.pi / 3.0 * 12.0, rel=1e-4)
    n_minus, n_plus = wall.normals(U, V)
    outwards = np.dstack([minus[..., :2] - middle, np.zeros(U.shape)]) / 21.0
    assert_allclose(n_minus, outwards, atol=1e-5)
    outwards = np.dstack([plus[..., :2] - middle, np.zeros(U.shape)]) / 19.0
    assert_allclose(n_plus, -outwards, atol=1e-5)


def test_twisted_blade_by_differences():
    """Normals of a twisted, tapered blade are at right angles to both ways along it; the thickness tapers."""
    wall = blade((24.0, 20.0), 25.0, (3.6, 2.4), 0.6, 0.5, (-0.1, 0.3))
    u, v, h = np.full(3, 0.37), np.array([0.1, 0.5, 0.9]), 1e-6
    for k in (0, 1):
        n = wall.normals(u, v)[k]
        along = wall.sides(u + h, v)[k] - wall.sides(u - h, v)[k]
        up = wall.sides(u, v + h)[k] - wall.sides(u, v - h)[k]
        for way in (along, up):
            way /= np.linalg.norm(way, axis=1, keepdims=True)
            assert np.abs((way * n).sum(axis=1)).max() < 1e-6
        assert ((wall.sides(u, v)[k] - wall.sides(u, v)[1 - k]) * n).sum(axis=1).min() > 0.0
    assert_allclose(wall.thickness(0.5, [0.0, 1.0]), [3.6, 2.4], rtol=1e-12)


def test_through_sections_stands_upright():
    """Ellipses of 30 x 3 mm around an axis far away, stacked along y: upright, along x, as thick as the ellipse."""
    t = np.linspace(0.0, math.tau, 81)
    sections = tuple(np.stack([1.5 * np.sin(t), 0.0 * t + 100.0 + 8.0 * k, 15.0 * np.cos(t)], axis=1) for k in range(4))
    wall = through_sections(loft(check_sections(sections)), 0.2, (0.0, 1.0))
    minus, plus = wall.sides(U, V)
    assert minus[..., 2].min() == pytest.approx(0.0, abs=1e-6)
    assert minus[..., 2].max() == pytest.approx(24.0, abs=1e-6)
    assert (plus[..., 1] < minus[..., 1]).all()
    x = 0.5 * (minus + plus)[..., 0]
    assert_allclose(wall.thickness(U, V), 3.0 * np.sqrt(1.0 - (x / 15.0) ** 2), rtol=2e-3)
    assert wall.mesh((20, 10), (0.1, 0.1)).is_watertight


def test_refused():
    with pytest.raises(InputError, match=r"wall\.thickness_mm = 0: must be above 0"):
        plate(10.0, 10.0, 0.0)
    with pytest.raises(InputError, match=r"wall\.edge_share = 1\.5: must be above 0 and at most 1"):
        blade((20.0, 20.0), 10.0, (2.0, 2.0), 1.5, 0.1, (0.0, 0.0))
    with pytest.raises(InputError, match=r"wall\.camber_deg = 95: must be between -90 and 90"):
        blade((20.0, 20.0), 10.0, (2.0, 2.0), 0.5, math.radians(95.0), (0.0, 0.0))
