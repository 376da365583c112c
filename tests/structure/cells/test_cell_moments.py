"""Moments of a layered stock: against polygons clipped by shapely, and the volume."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely
from numpy.polynomial.legendre import legval

from chipload.stock.layers import LayeredStock
from chipload.structure.cells.assembly import mass, modes_of, shares, stiffness
from chipload.structure.cells.clamp import rigid_motions
from chipload.structure.cells.grid import CellGrid, grid_between, grid_over, mode_values
from chipload.structure.cells.moments import StockRegion, section_moments, stock_moments


def ring(count, radius, middle, phase=0.1):
    a = phase + np.arange(count) * 2.0 * np.pi / count
    return shapely.Polygon(np.column_stack([middle[0] + radius * np.cos(a), middle[1] + radius * np.sin(a)]))


def by_triangles(shape, low, size, n):
    """Moments of a polygon in a cell: clipped, cut into triangles, with Gauss points in each (Duffy)."""
    out = np.zeros((n, n))
    clipped = shapely.intersection(shape, shapely.box(*low, *(low + size)))
    x, w = np.polynomial.legendre.leggauss(10)
    u, v = (g.ravel() for g in np.meshgrid((x + 1) / 2, (x + 1) / 2, indexing="ij"))
    weight = np.outer(w, w).ravel() / 4.0 * u
    for part in shapely.get_parts(clipped):
        if part.geom_type != "Polygon" or part.is_empty:
            continue
        rings = [(part.exterior, 1.0), *((hole, -1.0) for hole in part.interiors)]
        for line, sign in rings:
            p = 2.0 * (np.asarray(line.coords) - low) / size - 1.0
            a = p[0]
            fan = 0.0
            for b, c in pairwise(p):
                fan += 0.5 * np.linalg.det([b - a, c - a])
            turn = sign * np.sign(fan)
            for b, c in pairwise(p):
                area = np.linalg.det([b - a, c - a])
                at = a + u[:, None] * (b - a) + (u * v)[:, None] * (c - b)
                for k in range(n):
                    for m in range(n):
                        f = legval(at[:, 0], np.eye(n)[k]) * legval(at[:, 1], np.eye(n)[m])
                        out[k, m] += turn * area * float(f @ weight)
    return out


#: planes of x and y at unequal distances
UNEVEN = (np.array([0.0, 0.4, 3.1, 3.3, 7.0, 10.0]), np.array([0.0, 2.9, 3.0, 6.5, 8.0]), np.array([0.0, 2.0]))


@pytest.mark.parametrize("uneven", [False, True])
@pytest.mark.parametrize("order", [1, 2])
def test_moments_of_a_section_are_those_of_clipped_polygons(order, uneven):
    shape = ring(17, 3.9, (5.0, 4.0)).difference(ring(9, 1.7, (5.6, 3.8))).union(shapely.box(8.5, 0.2, 9.9, 7.9))
    grid = CellGrid(UNEVEN, order) if uneven else grid_over((0, 0, 0), (10, 8, 2), 2.7, order)
    found = section_moments(np.array([shape], dtype=object), grid)
    for i in range(grid.counts[0]):
        for j in range(grid.counts[1]):
            low, high = (np.array([grid.planes[0][i + k], grid.planes[1][j + k]]) for k in (0, 1))
            expected = by_triangles(shape, low, high - low, 2 * order + 1)
            np.testing.assert_allclose(found[i, j], expected, rtol=0.0, atol=1e-12)


def test_orientation_and_tiles_do_not_matter():
    shape = ring(40, 3.0, (4.0, 4.0))
    grid = grid_over((0, 0, 0), (8, 8, 1), 1.3)
    whole = section_moments(np.array([shape], dtype=object), grid)
    tiles = np.array(
        [shape.intersection(shapely.box(x, y, x + 4, y + 4)) for x in (0, 4) for y in (0, 4)], dtype=object
    )
    np.testing.assert_allclose(section_moments(tiles, grid), whole, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(section_moments(np.array([shape.reverse()], dtype=object), grid), whole, atol=1e-13)


#: ends of the stock, and planes between them
FACES = (np.array([1.0, 12.3, 31.0]), np.array([-2.0, 5.1, 6.0, 18.0]), np.array([-9.0, -3.3, 0.0]))


def cut_stock():
    stock = LayeredStock.block((1.0, -2.0, -9.0), (31.0, 18.0, 0.0), 0.7, 11.0)
    for k in range(4, stock.layers):
        stock.remove(k, ring(23, 5.0 + 0.1 * k, (14.0, 7.0)))
    return stock


def test_volume_and_mass_are_those_of_the_stock():
    stock = cut_stock()
    grid = grid_between(FACES, 3.1)
    moments = stock_moments(stock, grid)
    assert (shares(moments) * grid.volumes).sum() == pytest.approx(stock.volume(), rel=1e-12)
    modes = modes_of(grid, shares(moments))
    R = rigid_motions(grid, modes, np.zeros(3))
    M = R[:, :3].T @ (mass(grid, modes, moments, 2.7e-9) @ R[:, :3])
    np.testing.assert_allclose(M, 2.7e-9 * stock.volume() * np.eye(3), rtol=0.0, atol=1e-12 * M[0, 0])


def test_a_region_takes_a_part_of_the_stock():
    stock = LayeredStock.block((0, 0, 0), (10, 10, 4), 0.5, 5.0)
    grid = grid_over((0, 0, 0), (10, 10, 4), 3.0)
    found = shares(stock_moments(stock, grid, StockRegion(shapely.box(-1, 2, 4, 20), 1.25, 9.0)))
    assert (found * grid.volumes).sum() == pytest.approx(4.0 * 8.0 * 2.75, rel=1e-12)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_rigid_motions_cost_no_energy_but_that_of_the_empty_part(order):
    stock = cut_stock()
    grid = grid_between(FACES, 6.0, order)
    moments = stock_moments(stock, grid)
    modes = modes_of(grid, shares(moments))
    K = stiffness(grid, modes, moments, 7e4, 0.33)
    R = rigid_motions(grid, modes, np.array([3.0, 4.0, 5.0]))
    assert np.abs(K @ R).max() < 1e-9 * K.diagonal().max()
    assert abs(K - K.T).max() < 1e-12 * K.diagonal().max()


def test_a_full_cell_has_the_stiffness_of_gauss_points():
    """Of a cell of 2 x 3 x 1 mm, one of several sizes: bilinear forms of products of Gauss points."""
    planes = (np.array([0.0, 0.7, 2.7]), np.array([-1.0, 2.0]), np.array([0.0, 1.0, 5.0]))
    grid = CellGrid(planes)
    x, w = np.polynomial.legendre.leggauss(4)
    f, g = mode_values(2, x)
    one, slope = np.einsum("q,qa,qb->ab", w, f, f), np.einsum("q,qa,qb->ab", w, g, g)
    share = np.zeros(grid.counts)
    share[1, 0, 0] = 1.0
    moments = np.zeros((*grid.counts, 5, 5, 5))
    moments[..., 0, 0, 0] = 8.0 * share
    modes = modes_of(grid, share)
    # no Poisson's ratio: E times half the strains' products; of x alone: E for x, E / 2 for y and z
    K = stiffness(grid, modes, moments, 1.0, 0.0).toarray()
    jacobian, h = 2.0 * 3.0 * 1.0 / 8.0, np.array([2.0, 3.0, 1.0])
    parts = [[slope if e == d else one for e in range(3)] for d in range(3)]
    squares = [np.einsum("ad,be,cf->abcdef", *parts[d]).reshape(27, 27) * jacobian * 4.0 / h[d] ** 2 for d in range(3)]
    np.testing.assert_allclose(K[0::3, 0::3], squares[0] + 0.5 * (squares[1] + squares[2]), atol=1e-9)
    M = mass(grid, modes, moments, 1.0).toarray()
    expected = np.einsum("ad,be,cf->abcdef", one, one, one).reshape(27, 27) * jacobian
    np.testing.assert_allclose(M[1::3, 1::3], expected, atol=1e-12)
