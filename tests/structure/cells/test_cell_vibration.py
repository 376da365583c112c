"""Modes of a workpiece in cells: against a swept plate, a thinned plate of another program, CalculiX."""

from __future__ import annotations

import shutil
import subprocess

import numpy as np
import pytest
import shapely

from chipload.errors import InputError
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.clamp import Clamp
from chipload.structure.cells.followed import ModesOfStates
from chipload.structure.cells.grid import grid_over
from chipload.structure.cells.moments import StockRegion
from chipload.structure.cells.states import RemovalState, StepLines
from chipload.structure.cells.vibration import overlap, shapes_along, vibration_modes
from chipload.structure.cells.workpiece import Elastic, cell_workpiece
from chipload.structure.grid import plate
from chipload.structure.modes import modes
from chipload.structure.solid import SolidWorkpiece, factorise
from structure.cells.test_cell_calculix import BACK, CORNERS, COUNTS, EDGES, SIZE, bricks, stock_of

ALUMINIUM = Elastic(70e3, 0.33, 2.7e-9)
#: first frequency [Hz] of a plate of 80 x 50 x 5 mm, clamped below, made 3 mm thin from its free edge down by rows of
#: 5 mm, after so many of ten rows: 16 x 10 x 1 quadratic bricks, of another program
THINNED = {0.0: 1733.0, 1.25: 1894.0, 2.5: 2026.0, 3.75: 2089.0, 5.0: 2019.0, 8.75: 1258.0, 10.0: 1046.0}


def below(x, y):
    return Clamp("clamp", StockRegion(shapely.box(-1, -1, x + 1, y + 1), 0.0, 0.001), np.ones(3, dtype=np.bool_))


def thinned(rows, layer=1.25):
    stock = LayeredStock.block((0, 0, 0), (80, 5, 50), layer, 100.0)
    for i in range(stock.layers):
        if stock.heights[i] > 50.0 - 5.0 * rows:
            stock.remove(i, shapely.box(-1, 3, 81, 6))
    return stock


def built(stock, cell=5.0):
    return cell_workpiece(stock, grid_over((0, 0, 0), (80, 5, 50), cell), ALUMINIUM, [below(80, 5)])


def test_a_plate_that_is_thinned_sounds_higher_then_lower():
    found = {rows: vibration_modes(built(thinned(rows)), 1).frequency[0] for rows in THINNED}
    ours, theirs = (np.array(list(f.values())) for f in (found, THINNED))
    np.testing.assert_allclose(ours, theirs, rtol=0.012)
    assert max(found, key=found.__getitem__) == 3.75


def test_modes_are_those_of_a_swept_plate():
    work = built(thinned(0.0))
    ours = vibration_modes(work, 6)
    grid = plate(80.0, 50.0, 5.0, (16, 10, 2))
    held = np.zeros((len(grid.nodes), 3), dtype=bool)
    held[grid.side("j-")] = True
    theirs, shapes = modes(factorise(SolidWorkpiece(grid, 70e3, 0.33, 2.7e-9, held)), 6)
    np.testing.assert_allclose(ours.frequency, theirs, rtol=0.01)
    # the free corner: what a unit of modal mass moves there, on the side of the load
    corner = np.argmin(np.abs(grid.nodes - grid.nodes.max(axis=0)).sum(axis=1))
    across = np.argmax(np.abs(shapes[0, corner]))
    at = shapes_along(work, ours, np.array([[(80.0, 2.5, 50.0)] * 2]))[0, 1]
    np.testing.assert_allclose(np.abs(at[:3]), np.abs(shapes[:3, corner, across]), rtol=0.02)


def test_shapes_have_unit_modal_mass_and_the_mass_is_that_of_the_stock():
    work = built(thinned(2.5))
    found = vibration_modes(work, 4)
    np.testing.assert_allclose(overlap(found, found), np.eye(4), atol=1e-6)
    # a unit motion along x: N_a = 1 at every corner of the cells
    rigid = np.zeros((len(work.modes), 3))
    rigid[(work.modes.lattice % 2 == 0).all(axis=1), 0] = 1.0
    weight = rigid.ravel() @ (work.mass @ rigid.ravel())
    assert weight == pytest.approx(2.7e-9 * (80 * 5 * 50 - 80 * 2 * 12.5), rel=1e-12)


def test_modes_need_a_density():
    plain = cell_workpiece(
        thinned(0.0, 50.0), grid_over((0, 0, 0), (80, 5, 50), 20.0), Elastic(70e3, 0.33), [below(80, 5)]
    )
    with pytest.raises(InputError, match=r"workpiece.density_kg_m3: missing"):
        vibration_modes(plain, 2)
    with pytest.raises(InputError, match="density 0 t/mm3: must be above 0"):
        Elastic(70e3, 0.33, 0.0)


def test_modes_are_followed_through_the_removal():
    # four rows of 10 mm, each in four pieces along the plate
    stock = LayeredStock.block((0, 0, 0), (80, 5, 50), 10.0, 100.0)
    stocks, lines, step = [stock.copied()], [], 0
    for row in range(4):
        z = 40.0 - 10.0 * row
        for x in (0.0, 20.0, 40.0, 60.0):
            lines.append([(x + 10.0, 3.0, z), (x + 10.0, 3.0, z + 10.0)])
            stock.remove(4 - row, shapely.box(x, 3, x + 20, 6))
            stocks.append(stock.copied())
            step += 1
    removed = 400.0 * np.arange(17)
    states = [RemovalState(k, removed[k], lambda k=k: built(stocks[k], 10.0)) for k in range(17)]
    steps = StepLines(np.arange(16), np.array(lines), np.ones(16), removed[:16])
    watch = ModesOfStates(steps, 3, 1.0)
    found = watch.followed(states, tolerance=0.06, most=9, error=0.0)
    assert 4 <= len(found.states) <= 9
    exact = [vibration_modes(states[k].build(), 3) for k in range(16)]
    true = np.array([f.frequency for f in exact])
    off = np.abs(found.frequency / true - 1.0)
    assert off.max() <= 1.5 * found.error
    assert found.error < 0.03
    shapes = np.array([shapes_along(states[k].build(), exact[k], steps.lines[k : k + 1])[0] for k in range(0, 16, 5)])
    most = np.abs(shapes).max(axis=(0, 1))
    np.testing.assert_allclose(np.abs(found.shapes[::5]) / most, np.abs(shapes) / most, atol=0.06)
    first, _ = found.at_first(np.array([3, 15]))
    np.testing.assert_allclose(first, true[[0, 0]])
    assert found.alike > 0.9


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
@pytest.mark.parametrize("state", [0, 1, 2])
def test_a_rib_on_a_floor_vibrates_as_in_calculix(tmp_path, state):
    at = 2 * bricks(state)[:, None] + np.array(CORNERS + EDGES)
    nodes, number = np.unique(at.reshape(-1, 3), axis=0, return_inverse=True)
    number = number.reshape(len(at), -1) + 1
    text = ["*NODE, NSET=ALL", *(f"{n + 1}, {x:g}, {y:g}, {z:g}" for n, (x, y, z) in enumerate(nodes * SIZE / 2.0))]
    text.append("*ELEMENT, TYPE=C3D20, ELSET=PART")
    for n, e in enumerate(number):
        text += [f"{n + 1}, " + ", ".join(map(str, e[:10])) + ",", ", ".join(map(str, e[10:]))]
    text += ["*MATERIAL, NAME=M", "*ELASTIC", "7e4, 0.33", "*DENSITY", "2.7e-9"]
    text += ["*SOLID SECTION, ELSET=PART, MATERIAL=M", "*BOUNDARY"]
    text += [f"{n + 1}, 1, 3" for n in np.flatnonzero(nodes[:, 2] == 0)]
    text += ["*STEP", "*FREQUENCY", "5", "*NODE FILE", "U", "*END STEP", ""]
    (tmp_path / "part.inp").write_text("\n".join(text))
    subprocess.run(["ccx", "part"], cwd=tmp_path, check=True, stdout=subprocess.DEVNULL)
    rows = [line.split() for line in (tmp_path / "part.dat").read_text().splitlines()]
    theirs = [float(r[3]) for r in rows if len(r) == 5 and r[0].isdigit()][:5]
    high = [SIZE * c for c in COUNTS]
    assert BACK[state] <= high[1]
    grid = grid_over((0, 0, 0), high, SIZE, 2)
    ours = vibration_modes(cell_workpiece(stock_of(state), grid, ALUMINIUM, [below(32, 20)]), 5)
    np.testing.assert_allclose(ours.frequency, theirs, rtol=0.02)
