"""Meshes: counts, maps, middles of edges, places on sides."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.structure.grid import from_half_grid, from_map, from_points, plate
from chipload.structure.hexa import NODES, mass
from chipload.structure.places import MeshPlaces, locate, normals_of, on_cut, on_side, points_of, weights


def ring(p):
    """A quarter of a tube, radii 10 to 12, length 8."""
    r, a = 12.0 - 2.0 * p[:, 2], 0.5 * np.pi * p[:, 0]
    return np.stack([r * np.sin(a), 8.0 * p[:, 1], r * np.cos(a)], axis=1)


def tube(n):
    t = np.linspace(0.0, 1.0, n + 1)
    return from_map(t, [0.0, 1.0], [0.0, 1.0], lambda p: ring(p * [1.0, 1.0, -1.0] + [0.0, 0.0, 1.0]))


def volume(grid):
    return mass(grid.nodes[grid.elements], 1.0).sum()


def test_nodes_and_elements():
    grid = plate(8.0, 6.0, 2.0, (4, 3, 2))
    assert grid.counts == (4, 3, 2)
    assert len(grid.nodes) == 5 * 4 * 3 + 4 * 4 * 3 + 5 * 3 * 3 + 5 * 4 * 2
    middle = grid.nodes[grid.elements[grid.element(2, 1, 1)]]
    np.testing.assert_allclose(middle, np.array([5.0, 3.0, 1.5]) + NODES * [1.0, 1.0, 0.5])
    np.testing.assert_array_equal(np.unique(grid.elements), np.arange(len(grid.nodes)))
    np.testing.assert_array_equal(grid.nodes[grid.side("i+")][:, 0], 8.0)
    assert len(grid.side("k-")) == 5 * 4 + 4 * 4 + 5 * 3


def test_curved_map():
    """Volume of the tube: middles on the circle give fourth order."""
    exact = 0.25 * np.pi * (144.0 - 100.0) * 8.0
    errors = [abs(volume(tube(n)) / exact - 1.0) for n in (2, 4, 8)]
    assert errors[2] < 1e-5
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (orders > 3.8).all()


def test_middles_from_corners():
    """Cubic lines are met exactly by four points or more, parabolas by three, straight ones by two."""

    def curve(t, degree):
        return np.stack([t, t**degree - t, 0.3 * t**degree], axis=-1)

    for n, degree in ((7, 3), (4, 3), (3, 2), (2, 1)):
        t = np.linspace(-1.0, 2.0, n)
        lines = np.zeros((n, 2, 2, 3))
        lines += curve(t, degree)[:, None, None]
        lines[:, 1] += [0.0, 0.0, 1.0]
        lines[:, :, 1] += [0.0, -1.0, 0.0]
        grid = from_points(lines)
        fine = grid.nodes[grid.lattice[:, 0, 0]]
        np.testing.assert_allclose(fine, curve(np.linspace(-1.0, 2.0, 2 * n - 1), degree), atol=1e-13)


def test_places_on_a_curved_side():
    grid = tube(6)
    u, v = np.array([0.0, 0.21, 0.5, 1.0]), np.array([0.0, 0.3, 1.0, 0.5])
    places = on_side(grid, "k+", u, v)
    points = points_of(grid, places)
    np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 2]), 12.0, atol=1e-3)
    np.testing.assert_allclose(points[:, 1], 8.0 * v, atol=1e-12)
    outward = points * [1.0, 0.0, 1.0] / 12.0
    np.testing.assert_allclose(normals_of(grid, places, "k+"), outward, atol=0.02)
    inner = on_side(grid, "k-", u, v)
    np.testing.assert_allclose(normals_of(grid, inner, "k-"), -outward, atol=0.02)
    assert weights(grid, places).sum(axis=1) == pytest.approx(1.0)
    np.testing.assert_allclose(weights(grid, places) @ grid.nodes, points, atol=1e-12)


def test_a_point_beyond_the_edge_is_located_on_it():
    """0.02 mm beyond both edges of a plate of 10 x 8 mm: the corner itself."""
    grid = plate(10.0, 8.0, 2.0, (4, 3, 1))
    corner = points_of(grid, on_side(grid, "k+", [1.0], [1.0]))
    places = locate(grid, "k+", corner + np.array([0.02, 0.02, 0.0]), 0.05)
    np.testing.assert_allclose(points_of(grid, places), corner, atol=1e-12)


@pytest.mark.parametrize("side", ["i-", "i+", "j-", "j+", "k-", "k+"])
def test_located_where_they_were_put(side):
    grid = tube(5)
    u, v = np.random.default_rng(2).uniform(0.0, 1.0, (2, 40))
    points = points_of(grid, on_side(grid, side, u, v))
    found = locate(grid, side, points, 1e-9)
    np.testing.assert_allclose(points_of(grid, found), points, atol=1e-9)
    n = normals_of(grid, found, side)
    off = locate(grid, side, points + 0.05 * n, 0.06)
    assert (np.linalg.norm(points_of(grid, off) - points, axis=1) < 0.02).all()
    with pytest.raises(InputError, match=rf"lies 0.05\d* mm from side {side[0]}\{side[1]}: must be within 0.01 mm"):
        locate(grid, side, points[:3] + 0.05 * n[:3], 0.01)


def test_places_on_a_cut():
    grid = plate(4.0, 2.0, 2.0, (2, 1, 1))
    kept = np.array([[0.0, 0.25], [0.5, 1.0]])
    places = on_side(grid, "k+", [0.2, 0.9], [0.5, 0.5])
    np.testing.assert_allclose(points_of(grid, on_cut(places, kept, "k+"))[:, 2], [0.5, 2.0])
    np.testing.assert_allclose(points_of(grid, on_cut(places, kept, "k-"))[:, 2], [0.0, 1.0])
    with pytest.raises(InputError, match="on_cut: element 1 is gone"):
        on_cut(places, kept * [[1.0], [0.0]], "k+")
    with pytest.raises(InputError, match="must be k- or k"):
        on_cut(places, kept, "i+")


def test_refused():
    with pytest.raises(InputError, match=r"breaks v: must be at least two numbers that increase"):
        from_map([0.0, 1.0], [0.0, 0.0], [0.0, 1.0], lambda p: p)
    with pytest.raises(InputError, match=r"points of shape \(2, 3, 3, 3\): must be"):
        from_half_grid(np.zeros((2, 3, 3, 3)))
    with pytest.raises(InputError, match=r"points of shape \(1, 3, 3, 3\): must be"):
        from_points(np.zeros((1, 3, 3, 3)))
    bad = np.zeros((3, 3, 3, 3))
    bad[0, 0, 0, 0] = np.nan
    with pytest.raises(InputError, match="a point is not finite"):
        from_half_grid(bad)
    with pytest.raises(InputError, match="must be above 0"):
        plate(1.0, 1.0, 0.0, (1, 1, 1))
    grid = plate(1.0, 1.0, 1.0, (1, 1, 1))
    with pytest.raises(InputError, match="side = 'top': must be one of i-, i"):
        grid.side("top")
    with pytest.raises(InputError, match=r"side k\+: a place along j is outside 0 .. 1"):
        on_side(grid, "k+", 0.5, 1.1)
    assert len(MeshPlaces(np.zeros(2, dtype=np.int64), np.zeros((2, 3)))) == 2
