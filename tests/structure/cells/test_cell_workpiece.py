"""Compliance of parts in cells: the wall and the pocketed part of the design note, beams, clamps, removal."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
import shapely

from chipload.errors import InputError
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.assembly import modes_of
from chipload.structure.cells.clamp import Clamp
from chipload.structure.cells.grid import CellGrid, grid_over
from chipload.structure.cells.moments import StockRegion
from chipload.structure.cells.nearest import StockSections
from chipload.structure.cells.states import RemovalState, StepLines, size_of, states_between_passes, step_compliances
from chipload.structure.cells.thickness import cells_over, thinnest
from chipload.structure.cells.workpiece import Elastic, cell_workpiece, line_compliances

ALUMINIUM = Elastic(70e3, 0.33)
ALL = np.ones(3, dtype=np.bool_)


def below(stock, slab=0.001, directions=ALL, stiffness=np.inf):
    """A clamp on the lower face."""
    z, box = float(stock.bounds[0]), (stock.xs[0] - 1, stock.ys[0] - 1, stock.xs[-1] + 1, stock.ys[-1] + 1)
    return Clamp("clamp", StockRegion(shapely.box(*box), z, z + slab), directions, stiffness)


def shaped(outline, low, high, layer=1.0):
    """A prism of a polygon as a stock."""
    x0, y0, x1, y1 = outline.bounds
    stock = LayeredStock.block((x0, y0, low), (x1, y1, high), layer, 50.0)
    for k in range(stock.layers):
        stock.remove(k, shapely.box(x0 - 1, y0 - 1, x1 + 1, y1 + 1).difference(outline))
    return stock


def across(work, points, normal):
    """Compliance [um/N] at points along a direction."""
    ends = np.repeat(np.asarray(points, dtype=np.float64)[:, None], 2, axis=1)
    return 1e3 * np.einsum("cij,i,j->c", line_compliances(work, ends)[:, 1], normal, normal)


#: wall 60 x 40 high, clamped below, across at the free corner, the middle of the free edge and at half its height
#: [um/N]; computed by a prototype of its own with Lagrange modes and products of one-dimensional integrals
@pytest.mark.parametrize(
    ("order", "cell", "thickness", "shift", "expected"),
    [
        (2, 5.0, 2.0, 0.3, (13.562, 7.907, 1.0620)),
        (2, 2.5, 2.0, 0.3, (13.752, 7.998, 1.0894)),
        (3, 5.0, 2.0, 0.3, (13.793, 8.007, 1.0913)),
    ],
)
def test_a_wall_beside_the_grid(order, cell, thickness, shift, expected):
    stock = LayeredStock.block((0, shift, 0), (60, shift + thickness, 40), 10.0, 60.0)
    grid = grid_over((0, 0, 0), (60, np.ceil((shift + thickness) / cell) * cell, 40), cell, order)
    work = cell_workpiece(stock, grid, ALUMINIUM, [below(stock)])
    found = across(work, [(60, shift, 40), (30, shift, 40), (30, shift, 20)], (0.0, 1.0, 0.0))
    np.testing.assert_allclose(found, expected, rtol=3e-3)


def test_a_turned_wall_gives_the_same():
    turn = np.deg2rad(30.0)
    along, normal = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    foot = np.array([3.3, 1.1])
    corners = [foot, foot + 60 * along, foot + 60 * along + 2 * normal, foot + 2 * normal]
    stock = shaped(shapely.Polygon(corners), 0.0, 40.0, 10.0)
    grid = CellGrid((5.0 * np.arange(13), 5.0 * np.arange(8), 5.0 * np.arange(9)))
    work = cell_workpiece(stock, grid, ALUMINIUM, [below(stock)])
    points = [(*(foot + s * along), z) for s, z in ((60.0, 40.0), (30.0, 40.0), (30.0, 20.0))]
    found = across(work, points, (*normal, 0.0))
    np.testing.assert_allclose(found, (13.654, 7.899, 1.0576), rtol=1.5e-2)


def pocketed():
    stock = LayeredStock.block((0, 0, 0), (100, 60, 30), 3.0, 100.0)
    for k in range(1, 10):
        for a, b in ((2, 49), (51, 98)):
            stock.remove(k, shapely.box(a, 2, b, 58))
    return stock


def test_a_pocketed_part():
    stock = pocketed()
    work = cell_workpiece(stock, grid_over((0, 0, 0), (100, 60, 30), 5.0), ALUMINIUM, [below(stock)])
    points = [(25, 0, 30), (0, 30, 30), (49, 30, 30)]
    C = line_compliances(work, np.repeat(np.array(points, dtype=np.float64)[:, None], 2, axis=1))[:, 1]
    np.testing.assert_allclose(1e3 * C[[0, 1, 2], [1, 0, 0], [1, 0, 0]], (1.280, 1.602, 1.496), rtol=1e-3)
    np.testing.assert_allclose(C, C.swapaxes(1, 2), rtol=0.0, atol=1e-6 * C.max())
    assert work.volume == pytest.approx(stock.volume(), rel=1e-9)


def test_a_beam_bends_as_the_closed_form_says():
    # 100 x 8 x 8 in cells of its own size; a force spread over the height of its free end
    length, side = 100.0, 8.0
    stock = LayeredStock.block((0, 0, 0), (length, side, side), 8.0, 200.0)
    held = Clamp("clamp", StockRegion(shapely.box(-1, -1, 0.001, 9), -1.0, 9.0), ALL)
    work = cell_workpiece(stock, grid_over((0, 0, 0), (length, side, side), 8.0), Elastic(7e4, 0.0), [held])
    found = line_compliances(work, [[(length, 4.0, 0.0), (length, 4.0, side)]])[0, 1, 1, 1]
    area, inertia = side * side, side**4 / 12.0
    bending, shear = length**3 / (3.0 * 7e4 * inertia), 1.2 * length / (3.5e4 * area)
    assert found == pytest.approx(bending + shear, rel=5e-3)


def test_thick_material_keeps_corner_modes_only_and_gives_the_same(monkeypatch):
    stock = LayeredStock.block((0, 0, 0), (40, 40, 60), 20.0, 50.0)
    stock.remove(2, shapely.box(4, -1, 41, 41))
    grid = grid_over((0, 0, 0), (40, 40, 60), 4.0)
    work = cell_workpiece(stock, grid, ALUMINIUM, [below(stock)])
    monkeypatch.setattr("chipload.structure.cells.workpiece.modes_of", partial(modes_of, bulk=0))
    whole = cell_workpiece(stock, grid, ALUMINIUM, [below(stock)])
    assert len(work.modes) < 0.5 * len(whole.modes)
    for point in [(0.0, 20.0, 60.0), (0.0, 0.0, 60.0)]:
        np.testing.assert_allclose(across(work, [point], (1, 0, 0)), across(whole, [point], (1, 0, 0)), rtol=0.015)


def test_springs_of_a_clamp_carry_the_whole_part():
    # so soft that the part is rigid: k in every direction
    stock = LayeredStock.block((0, 0, 0), (20, 20, 5), 5.0, 50.0)
    work = cell_workpiece(stock, grid_over((0, 0, 0), (20, 20, 5), 5.0), ALUMINIUM, [below(stock, stiffness=50.0)])
    C = line_compliances(work, [[(10.0, 10.0, 0.0), (10.0, 10.0, 0.0)]])[0, 1]
    np.testing.assert_allclose(np.diag(C), 1.0 / 50.0, rtol=1e-3)


def test_ever_stiffer_clamps_change_nothing(monkeypatch):
    stock = LayeredStock.block((0, 0, 0), (30, 2, 20), 20.0, 50.0)
    grid = grid_over((0, 0, 0), (30, 2, 20), 5.0)
    found = []
    for stiff in (1e4, 1e5):
        monkeypatch.setattr("chipload.structure.cells.clamp.STIFF", stiff)
        work = cell_workpiece(stock, grid, ALUMINIUM, [below(stock)])
        found.append(float(across(work, [(15, 0, 20)], (0, 1, 0))[0]))
    assert found[0] == pytest.approx(found[1], rel=2e-3)


@pytest.mark.parametrize(
    ("clamps", "message"),
    [
        ([("z", 0.01)], "motion along x, motion along y, rotation about z are free"),
        ([("xyz", -1.0)], "holds nothing"),
    ],
)
def test_what_is_not_held_is_refused(clamps, message):
    stock = LayeredStock.block((0, 0, 0), (20, 20, 5), 5.0, 50.0)
    made = [
        Clamp(
            "workpiece.clamp.0",
            StockRegion(shapely.box(0, 0, 20, 20), min(top, 0.0) - 1.0, top),
            np.isin(list("xyz"), list(d)),
        )
        for d, top in clamps
    ]
    with pytest.raises(InputError, match=message):
        cell_workpiece(stock, grid_over((0, 0, 0), (20, 20, 5), 5.0), ALUMINIUM, made)


def test_material_that_hangs_on_nothing_is_left_out():
    stock = LayeredStock.block((0, 0, 0), (60, 10, 10), 10.0, 100.0)
    stock.remove(0, shapely.box(20, -1, 45, 11))
    held = Clamp("clamp", StockRegion(shapely.box(-1, -1, 0.5, 11), -1.0, 11.0), ALL)
    work = cell_workpiece(stock, grid_over((0, 0, 0), (60, 10, 10), 5.0), ALUMINIUM, [held])
    assert work.loose == pytest.approx(1500.0)
    assert work.volume == pytest.approx(2000.0)


def test_a_state_that_was_cut_equals_one_built_at_once():
    whole = LayeredStock.block((0, 0, 0), (40, 20, 10), 2.0, 100.0)
    for k in (2, 3, 4):
        for x in (4.0, 12.0, 20.0):
            whole.remove(k, shapely.box(x, 3, x + 10, 17))
    once = LayeredStock.block((0, 0, 0), (40, 20, 10), 2.0, 100.0)
    for k in (2, 3, 4):
        once.remove(k, shapely.box(4, 3, 30, 17))
    grid = grid_over((0, 0, 0), (40, 20, 10), 4.0)
    C = [
        line_compliances(cell_workpiece(s, grid, ALUMINIUM, [below(s)]), [[(4, 10, 4), (4, 10, 10)]])
        for s in (whole, once)
    ]
    np.testing.assert_allclose(C[0], C[1], rtol=0.0, atol=1e-9 * np.abs(C[1]).max())


def test_the_thinnest_wall_and_floor():
    stock = pocketed()
    assert thinnest(stock, 0.1, 20.0) == pytest.approx(2.0, rel=0.03)
    thick = LayeredStock.block((0, 0, 0), (50, 40, 20), 1.0, 100.0)
    for k in range(1, 20):
        thick.remove(k, shapely.box(8, 8, 42, 32))
    assert thinnest(thick, 0.1, 20.0) == pytest.approx(1.0, rel=1e-9)
    with pytest.raises(
        InputError, match=r"cell_mm = 6: the thinnest wall left is 1.99 mm: at most 2.5 times that, 4.98"
    ):
        cells_over(stock, stock, 6.0)


def test_a_force_acts_on_the_nearest_material():
    stock = pocketed()
    near = StockSections(stock).nearest(np.array([[25.0, 2.3, 20.0], [25.0, 30.0, 5.0], [50.0, 30.0, 12.0]]))
    np.testing.assert_allclose(near, [[25.0, 2.0, 20.0], [25.0, 30.0, 3.0], [50.0, 30.0, 12.0]], atol=0.02)


def test_compliance_follows_the_removal():
    # a wall of 6 mm is made 3 mm thin, from one end to the other, in twelve steps
    stock = LayeredStock.block((0, 0, 0), (60, 6, 30), 30.0, 100.0)
    stocks, lines = [(0, 0.0, stock.copied())], []
    for k in range(12):
        x = 5.0 * k
        lines.append([(x + 2.5, 3.0, 5.0), (x + 2.5, 3.0, 30.0)])
        stock.remove(0, shapely.box(x, -1, x + 5, 3))
        stocks.append((k + 1, 450.0 * (k + 1), stock.copied()))
    grid = grid_over((0, 0, 0), (60, 6, 30), 6.0)

    def build(s):
        return lambda: cell_workpiece(s, grid, ALUMINIUM, [below(s)])

    states = [RemovalState(k, v, build(s)) for k, v, s in stocks]
    steps = StepLines(np.arange(12), np.array(lines), np.full(12, 100.0), 450.0 * np.arange(12))
    rough = step_compliances(steps, states, tolerance=0.02, most=5, spacing=1.0)
    exact = step_compliances(steps, states, tolerance=0.0, most=13, spacing=1.0)
    assert 5 <= len(rough.states) < 13
    assert exact.states == tuple(range(13))
    alone = [size_of(line_compliances(states[k].build(), steps.lines[k : k + 1]))[0] for k in range(12)]
    np.testing.assert_allclose(size_of(exact.compliance), alone, rtol=1e-9)
    off = np.abs(size_of(rough.compliance) / alone - 1.0)
    assert (off <= rough.uncertainty + 1e-9).all()
    assert rough.uncertainty.max() > 0.02
    top = int(np.argmax(size_of(rough.compliance) * (1.0 + rough.uncertainty)))
    assert top in rough.worst.tolist()
    assert size_of(rough.compliance)[top] == pytest.approx(alone[top], rel=1e-9)


def passes_along(*places, count=10):
    """Steps of passes along x over 40 mm at (y, low, high), one after another, and a state before each step."""
    x = np.linspace(0.0, 40.0, count)
    lines = [[(at, y, low), (at, y, high)] for y, low, high in places for at in x]
    n = len(lines)
    states = [RemovalState(k, float(k), lambda: None) for k in range(n + 1)]
    return StepLines(np.arange(n), np.array(lines), np.ones(n), np.arange(float(n))), states


def test_a_state_stands_between_two_passes_over_a_place():
    steps, states = passes_along((0.0, -5.0, 0.0), (-1.0, -5.0, 0.0), (-2.0, -5.0, 0.0))
    rows = np.arange(0, 30, 3)
    chosen = states_between_passes(steps, rows, states, 4.0)
    for row in rows[rows < 20].tolist():
        again = row + 10  # the step of the next pass beside it
        assert any(row < states[k].step <= again for k in chosen)
    # a pass begins where the one before it began: one state between two passes
    assert len(chosen) == 2
    # below it, beside it and once alone: no pass comes again
    for places in (((0.0, -5.0, 0.0), (0.0, -10.0, -5.0)), ((0.0, -5.0, 0.0), (30.0, -5.0, 0.0)), ((0.0, -5.0, 0.0),)):
        steps, states = passes_along(*places)
        assert states_between_passes(steps, np.arange(len(steps.step)), states, 4.0) == []


def test_steps_before_a_later_pass_are_not_taken_for_what_it_leaves():
    # a wall of 9 mm is made 6 and then 3 mm thin, each time along its whole length
    stock = LayeredStock.block((0, 0, 0), (60, 9, 30), 30.0, 100.0)
    stocks, lines, removed = [(0, 0.0, stock.copied())], [], 0.0
    for y in (6.0, 3.0):
        for k in range(6):
            x = 10.0 * k
            lines.append([(x + 5.0, y, 5.0), (x + 5.0, y, 30.0)])
            stock.remove(0, shapely.box(x, y, x + 10, 10))
            removed += 900.0
            stocks.append((len(lines), removed, stock.copied()))
    grid = grid_over((0, 0, 0), (60, 9, 30), 9.0)

    def build(s):
        return lambda: cell_workpiece(s, grid, ALUMINIUM, [below(s)])

    states = [RemovalState(k, v, build(s)) for k, v, s in stocks]
    steps = StepLines(np.arange(12), np.array(lines), np.full(12, 100.0), np.arange(12) * 900.0)
    found = step_compliances(steps, states, tolerance=10.0, most=5, spacing=5.0)
    assert {0, 6, 12} <= set(found.states)
    # before all, after a third and two thirds of the volume, between the passes, after all
    assert found.wanted == 5
    few = step_compliances(steps, states, tolerance=10.0, most=4, spacing=5.0)
    assert (few.wanted, 6 in few.states) == (5, False)
    alone = np.array([size_of(line_compliances(states[k].build(), steps.lines[k : k + 1]))[0] for k in range(12)])
    after = np.array([size_of(line_compliances(states[k + 1].build(), steps.lines[k : k + 1]))[0] for k in range(12)])
    size = size_of(found.compliance)
    assert (np.abs(size / alone - 1.0) <= found.uncertainty + 1e-9).all()
    # what is stated for the first pass is within what that pass alone changes
    first = slice(0, 6)
    assert (size * (1.0 + found.uncertainty))[first].max() < 1.2 * after[first].max()
