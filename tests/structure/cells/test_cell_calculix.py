"""CalculiX on a rib on a floor, with quadratic bricks, in three states of removal.

The face opposite to the load is compared: on the loaded line itself an elastic body gives way without bound. Bricks are
1 mm wide and high: those of 2 mm are 2 to 6 % too stiff. The grid is the one that a job takes by itself, of order 3
and, as a job has it, of order 2, with the error that a job states.
"""

from __future__ import annotations

import shutil
import subprocess

import numpy as np
import pytest
import shapely

from chipload.checking.workpiece_compliance import COARSER, CORNER, FLOOR
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.clamp import Clamp
from chipload.structure.cells.moments import StockRegion
from chipload.structure.cells.thickness import cells_over
from chipload.structure.cells.workpiece import Elastic, cell_workpiece, displacements

pytestmark = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")

E, NU = 7e4, 0.33
#: bricks of 2 mm: floor 32 x 20 x 4 mm, rib 18 mm high from y = 8 to 12
SIZE, COUNTS = 2.0, (16, 10, 11)
#: fine bricks [mm]
FINE = (2.0, 1.0, 1.0)
#: corners of a brick, then the middles of its edges, in halves of a brick
CORNERS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
EDGES = [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2), (0, 0, 1), (2, 0, 1),
         (2, 2, 1), (0, 2, 1)]  # fmt: skip
#: boxes [mm] that each state takes from the one before
CUTS = [(0.0, 8.0, 6.0, 0.0, 8.0, 6.0), (0.0, 10.0, 10.0, 32.0, 12.0, 22.0), (12.0, 0.0, 16.0, 20.0, 20.0, 22.0)]
#: y [mm] of the face opposite to the loaded one, y = 8
BACK = (12, 10, 10)
#: x [mm] and lower end of the contact lines, 4 mm high, on the rib
LINES = [(2.0, 12.0), (6.0, 18.0), (10.0, 10.0), (16.0, 8.0), (22.0, 14.0), (26.0, 18.0), (32.0, 18.0)]
#: of these two are loaded in each state: every load is solved anew by CalculiX
LOADED = ((0, 3), (1, 5), (2, 4))


def bricks(state, size=(SIZE, SIZE, SIZE)):
    counts = np.rint(SIZE * np.array(COUNTS) / size).astype(int)
    at = np.indices(counts).reshape(3, -1).T
    x, y, z = (np.array(size) * (at + 0.5)).T
    solid = (z < 4.0) | ((y > 8.0) & (y < 12.0))
    for x0, y0, z0, x1, y1, z1 in CUTS[: state + 1]:
        solid &= ~((x > x0) & (x < x1) & (y > y0) & (y < y1) & (z > z0) & (z < z1))
    return at[solid]


def stock_of(state):
    stock = LayeredStock.block((0, 0, 0), [SIZE * c for c in COUNTS], SIZE, 100.0)
    for layer in range(stock.layers):
        z = float(stock.heights[layer])
        if z > 4.0:
            stock.remove(layer, shapely.box(-1, -1, 33, 8).union(shapely.box(-1, 12, 33, 21)))
        for x0, y0, z0, x1, y1, z1 in CUTS[: state + 1]:
            if z0 < z < z1:
                stock.remove(layer, shapely.box(x0, y0, x1, y1))
    return stock


def theirs(state, lines, loaded, folder):
    """Displacement across the rib [mm/N] opposite to the middle of each line, of CalculiX, (loads, lines)."""
    at = 2 * bricks(state, FINE)[:, None] + np.array(CORNERS + EDGES)
    nodes, number = np.unique(at.reshape(-1, 3), axis=0, return_inverse=True)
    number = number.reshape(len(at), -1) + 1
    place = nodes * FINE / 2.0
    name = {tuple(p): n + 1 for n, p in enumerate(place.tolist())}
    text = ["*NODE, NSET=ALL", *(f"{n + 1}, {x:g}, {y:g}, {z:g}" for n, (x, y, z) in enumerate(place))]
    text.append("*ELEMENT, TYPE=C3D20, ELSET=PART")
    for n, e in enumerate(number):
        text += [f"{n + 1}, " + ", ".join(map(str, e[:10])) + ",", ", ".join(map(str, e[10:]))]
    text += ["*MATERIAL, NAME=M", "*ELASTIC", f"{E}, {NU}", "*SOLID SECTION, ELSET=PART, MATERIAL=M", "*BOUNDARY"]
    text += [f"{n + 1}, 1, 3" for n in np.flatnonzero(nodes[:, 2] == 0)]
    behind = [name[x, BACK[state], z + 2.0] for x, z in lines]
    text += ["*NSET, NSET=BEHIND", *map(str, behind)]
    for x, z in loaded:
        column = [name[x, 8.0, z + 0.5 * k] for k in range(9)]
        # four quadratic edges under an even load
        text += ["*STEP", "*STATIC", "*CLOAD, OP=NEW"]
        text += [f"{n}, 2, {w / 24.0:.12e}" for n, w in zip(column, (1, 4, 2, 4, 2, 4, 2, 4, 1), strict=True)]
        text += ["*NODE PRINT, NSET=BEHIND", "U", "*END STEP"]
    (folder / "part.inp").write_text("\n".join([*text, ""]))
    subprocess.run(["ccx", "part"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    rows = [line.split() for line in (folder / "part.dat").read_text().splitlines()]
    u = [(int(r[0]), float(r[2])) for r in rows if len(r) == 4 and r[0].isdigit()]
    steps = [dict(u[k : k + len(behind)]) for k in range(0, len(u), len(behind))]
    return np.array([[step[n] for n in behind] for step in steps])


@pytest.mark.parametrize("state", [0, 1, 2])
def test_a_rib_on_a_floor_gives_way_as_in_calculix(tmp_path, state):
    lines = [(x, z) for x, z in LINES if state < 2 or z + 4.0 <= 16.0 or not 12.0 <= x <= 20.0]
    stock = stock_of(state)
    clamp = Clamp("clamp", StockRegion(shapely.box(-1, -1, 33, 21), 0.0, 0.001), np.ones(3, dtype=np.bool_))
    elastic, loaded = Elastic(E, NU), [lines[k] for k in LOADED[state]]
    places = [(x, BACK[state], z + 2.0) for x, z in lines]

    def ours(grid):
        work = cell_workpiece(stock, grid, elastic, [clamp])
        return np.array([displacements(work, [(x, 8.0, z), (x, 8.0, z + 4.0)], places)[:, 1, 1] for x, z in loaded])

    expected = theirs(state, lines, loaded, tmp_path)
    direct = (range(len(loaded)), LOADED[state])
    fine = ours(cells_over(stock_of(0), stock_of(2), None, 3)[0])
    np.testing.assert_allclose(fine[direct], expected[direct], rtol=0.02)
    assert (np.abs(fine - expected) <= 0.02 * expected.max(axis=1, keepdims=True)).all()
    grid = cells_over(stock_of(0), stock_of(2), None)[0]
    plain, wide = ours(grid)[direct], ours(grid.wider(COARSER))[direct]
    stated = CORNER * np.abs(wide / plain - 1.0) + FLOOR
    assert (np.abs(plain / expected[direct] - 1.0) < stated).all()
    assert (stated < 0.05).all()
