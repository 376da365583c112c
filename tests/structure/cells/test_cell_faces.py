"""Grids whose planes lie on the flat faces of a part: which faces, how many cells, and what they are worth."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from chipload.stock.layers import LayeredStock
from chipload.structure.cells.clamp import Clamp
from chipload.structure.cells.faces import flat_faces, grid_on_faces
from chipload.structure.cells.grid import CellGrid
from chipload.structure.cells.moments import StockRegion
from chipload.structure.cells.thickness import cells_over
from chipload.structure.cells.workpiece import Elastic, cell_workpiece, displacements, line_compliances


def stepped():
    """A floor of 40 x 30 x 4.3 mm with a rib from y = 11.7 to 14.1, 20 mm high."""
    stock = LayeredStock.block((0, 0, 0), (40, 30, 20), np.array([0.0, 2.0, 4.3, 9.0, 14.0, 20.0]), 15.0)
    for k in (2, 3, 4):
        stock.remove(k, shapely.box(-1, -1, 41, 11.7))
        stock.remove(k, shapely.box(-1, 14.1, 41, 31))
    return stock


def test_flat_faces_and_their_areas():
    (x, a), (y, b), (z, c) = flat_faces(stepped())
    # both ends: floor and rib
    assert dict(zip(x.tolist(), a.tolist(), strict=True)) == pytest.approx(dict.fromkeys((0.0, 40.0), 129.0 + 37.68))
    assert y.tolist() == pytest.approx([11.7, 14.1, 0.0, 30.0])
    assert b.tolist() == pytest.approx([40.0 * 15.7] * 2 + [40.0 * 4.3] * 2)
    assert dict(zip(z.round(9).tolist(), c.tolist(), strict=True)) == pytest.approx(
        {0.0: 1200.0, 4.3: 1200.0 - 96.0, 20.0: 96.0}
    )


def test_what_leans_or_is_round_has_no_flat_face():
    stock = LayeredStock.block((0, 0, 0), (40, 40, 10), 5.0, 100.0)
    stock.remove(1, shapely.Point(20, 20).buffer(8.0))
    stock.remove(1, shapely.Polygon([(-1, -1), (41, -1), (41, 2), (-1, 1.9)]))
    grid = grid_on_faces(stock, flat_faces(stock), 6.0)
    assert [len(v) for v in grid.faces or ()] == [2, 2, 3]


def test_planes_lie_on_faces_and_cells_stay_few():
    stock = stepped()
    grid = grid_on_faces(stock, flat_faces(stock), 3.0)
    for d, own in enumerate(([0.0, 40.0], [0.0, 11.7, 14.1, 30.0], [0.0, 4.3, 20.0])):
        assert np.abs(grid.planes[d][:, None] - own).min(axis=0).max() < 1e-9
    assert grid.widest <= 3.0
    assert grid.counts == (14, 4 + 1 + 6, 2 + 6)
    # a wider grid keeps them
    wide = grid.wider(1.5)
    assert wide.counts == (10, 3 + 1 + 4, 1 + 4)
    assert np.abs(wide.planes[1][:, None] - [11.7, 14.1]).min(axis=0).max() < 1e-9
    # a comb of forty slots: no more cells than a quarter more, and two
    comb = LayeredStock.block((0, 0, 0), (80, 20, 10), 5.0, 200.0)
    for k in range(40):
        comb.remove(1, shapely.box(2 * k + 0.4, -1, 2 * k + 1.1, 21))
    assert grid_on_faces(comb, flat_faces(comb), 4.0).counts[0] <= 27


def test_uneven_cells_find_their_points():
    grid = CellGrid((np.array([0.0, 1.0, 4.0]), np.array([0.0, 2.0]), np.array([-1.0, 0.0])))
    cell, local = grid.cell_of(np.array([[0.5, 1.0, -0.5], [3.25, 2.0, -1.0], [5.5, 0.0, 0.0]]))
    assert cell.tolist() == [[0, 0, 0], [1, 0, 0], [1, 0, 0]]
    np.testing.assert_allclose(local, [[0.0, 0.0, 0.0], [0.5, 1.0, -1.0], [2.0, -1.0, 1.0]])
    np.testing.assert_allclose(grid.points(cell, local), [[0.5, 1.0, -0.5], [3.25, 2.0, -1.0], [5.5, 0.0, 0.0]])
    assert grid.in_cells(np.array([[2.5, 1.0, -1.0]])).tolist() == [[1.5, 0.5, 0.0]]
    assert grid.volumes.ravel().tolist() == [2.0, 6.0]


def test_uneven_cells_stretch_a_bar_as_hooke_says():
    """Linear displacement is within any grid: F L / (E A)."""
    stock = LayeredStock.block((0, 0, 0), (30, 4, 5), 5.0, 100.0)
    grid = CellGrid(
        (np.array([0.0, 1.0, 11.0, 13.5, 29.0, 30.0]), np.array([0.0, 0.7, 4.0]), np.array([0.0, 3.1, 5.0]))
    )
    held = Clamp("clamp", StockRegion(shapely.box(-1, -1, 0.001, 5), -1.0, 9.0), np.ones(3, dtype=np.bool_))
    work = cell_workpiece(stock, grid, Elastic(7e4, 0.0), [held])
    pulled = np.array([[30.0, 2.0, 0.0], [30.0, 2.0, 5.0]])
    mean = np.mean([displacements(work, pulled, [[20.0, y, z]])[0, 0, 0] for y in (0.0, 4.0) for z in (0.0, 5.0)])
    assert mean == pytest.approx(20.0 / (7e4 * 20.0), rel=0.02)


def test_a_force_on_a_face_acts_on_the_cell_behind_it():
    """Both faces of a rib give way alike, though the cell before one of them is empty and the one below that is not."""
    stock = LayeredStock.block((0, 0, 0), (12, 20, 16), np.array([0.0, 4.0, 8.0, 16.0]), 40.0)
    for k, (low, high) in ((1, (7.8, 11.2)), (2, (8.0, 11.0))):
        stock.remove(k, shapely.box(-1, -1, 13, low))
        stock.remove(k, shapely.box(-1, high, 13, 21))
    z = np.array([0.0, 4.0, 8.0, 16.0])
    grid = CellGrid((np.linspace(0.0, 12.0, 7), np.array([0.0, 4.0, 8.0, 11.0, 15.0, 20.0]), z))
    clamp = Clamp("clamp", StockRegion(shapely.box(-1, -1, 13, 21), -1.0, 0.001), np.ones(3, dtype=np.bool_))
    work = cell_workpiece(stock, grid, Elastic(7e4, 0.33), [clamp])
    lines = np.array([[(x, y, 13.0), (x, y, 15.0)] for y in (8.0, 11.0) for x in range(1, 12, 2)])
    one, other = line_compliances(work, lines)[:, 1, 1, 1].reshape(2, -1)
    assert one == pytest.approx(other, rel=0.02)


def test_a_job_takes_a_grid_on_its_faces():
    full = LayeredStock.block((0, 0, 0), (40, 30, 20), 5.0, 100.0)
    grid, wall = cells_over(full, stepped(), None)
    assert wall == pytest.approx(2.4, rel=0.03)
    assert np.abs(grid.planes[1][:, None] - [11.7, 14.1]).min(axis=0).max() < 1e-9
