"""Processor time and memory of a workpiece in cells: a part of 100 x 60 x 30 mm with walls and a rib of 2 mm.

    python benchmarks/workpiece.py [CELL_MM ORDER]     as a job chooses them and 2, if none are stated

The planes of the cells lie on the faces of the part, as in a job; beside them the long wall in equal cells of their
longest side.

Measured: moments of the stock, building (moments, assembly, clamps, factors), the same after a piece of a wall was
cut (a new state), 1,000 contact lines, its lowest modes, and the factors by minimum degree instead of nested
dissection.
Where CalculiX (ccx) is installed, beside it: a state with one load, in quadratic bricks of 2 x 2 x 1.5 mm, one through
the walls.
"""

from __future__ import annotations

import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from time import process_time

import numpy as np
import shapely
from scipy.sparse import csc_array

from chipload.stock.layers import LayeredStock
from chipload.structure.cells.clamp import Clamp
from chipload.structure.cells.grid import grid_over
from chipload.structure.cells.moments import StockRegion, stock_moments
from chipload.structure.cells.thickness import cells_over
from chipload.structure.cells.vibration import vibration_modes
from chipload.structure.cells.workpiece import CellWorkpiece, Elastic, cell_workpiece, displacements, line_compliances
from chipload.structure.factors import factor


def pocketed() -> LayeredStock:
    """The part: two pockets, floor of 3 mm."""
    stock = LayeredStock.block((0, 0, 0), (100, 60, 30), 1.0, 40.0)
    for k in range(3, stock.layers):
        for a, b in ((2, 49), (51, 98)):
            stock.remove(k, shapely.box(a, 2, b, 58))
    return stock


#: corners of a brick, then the middles of its edges, in halves of a brick
NODES = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2), (1, 0, 0), (2, 1, 0),
         (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2), (0, 0, 1), (2, 0, 1), (2, 2, 1),
         (0, 2, 1)]  # fmt: skip


#: runs CalculiX from a process of little memory, which its own would otherwise count
CCX = """import resource, subprocess
subprocess.run(["ccx", "part"], check=True, stdout=subprocess.DEVNULL)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime, used.ru_maxrss)
"""


def calculix() -> tuple[float, float, float]:
    """Processor time [s], memory [MB] and compliance [um/N] of a long wall, opposite to its contact line, by CalculiX.

    The walls are 2 mm: the rib, from 49 to 51 mm in the part above, is from 48 to 50 mm here.
    """
    i, j, k = np.indices((50, 30, 20)).reshape(3, -1)
    solid = (k < 2) | (i == 0) | (i == 49) | (i == 24) | (j == 0) | (j == 29)
    at = 2 * np.column_stack([i, j, k])[solid][:, None] + np.array(NODES)
    nodes, number = np.unique(at.reshape(-1, 3), axis=0, return_inverse=True)
    number = number.reshape(len(at), -1) + 1
    place = nodes * (1.0, 1.0, 0.75)
    text = ["*NODE, NSET=ALL", *(f"{n + 1}, {x:g}, {y:g}, {z:g}" for n, (x, y, z) in enumerate(place))]
    text.append("*ELEMENT, TYPE=C3D20, ELSET=PART")
    for n, e in enumerate(number):
        text += [f"{n + 1}, " + ", ".join(map(str, e[:10])) + ",", ", ".join(map(str, e[10:]))]
    text += ["*MATERIAL, NAME=M", "*ELASTIC", "7e4, 0.33", "*SOLID SECTION, ELSET=PART, MATERIAL=M", "*BOUNDARY"]
    text += [f"{n + 1}, 1, 3" for n in np.flatnonzero(nodes[:, 2] == 0)]
    line = [int(np.flatnonzero((nodes == (36, 0, z)).all(axis=1))[0]) + 1 for z in range(32, 37)]
    back = int(np.flatnonzero((nodes == (36, 2, 34)).all(axis=1))[0]) + 1
    text += ["*NSET, NSET=BACK", f"{back}", "*STEP", "*STATIC", "*CLOAD"]
    text += [f"{n}, 2, {w / 12.0:.12e}" for n, w in zip(line, (1, 4, 2, 4, 1), strict=True)]
    text += ["*NODE PRINT, NSET=BACK", "U", "*END STEP", ""]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "part.inp").write_text("\n".join(text))
        done = subprocess.run([sys.executable, "-c", CCX], cwd=folder, check=True, capture_output=True, text=True)
        busy, memory = map(float, done.stdout.split())
        rows = [r.split() for r in (Path(folder) / "part.dat").read_text().splitlines()]
    moved = next(float(r[2]) for r in rows if len(r) == 4 and r[0].isdigit())
    return busy, memory / 1024.0, 1e3 * moved


def opposite(work: CellWorkpiece) -> float:
    """Compliance [um/N] of the long wall of the part, opposite to a contact line."""
    moved = displacements(work, [(36.0, 0.0, 24.0), (36.0, 0.0, 27.0)], [(36.0, 2.0, 25.5)])
    return 1e3 * float(moved[0, 1, 1])


def main() -> None:
    """Print a row for each quantity."""
    cell, order = (float(sys.argv[1]), int(sys.argv[2])) if len(sys.argv) > 2 else (None, 2)
    stock, whole = pocketed(), LayeredStock.block((0, 0, 0), (100, 60, 30), 1.0, 40.0)
    grid, _ = cells_over(whole, stock, cell, order)
    clamp = Clamp("clamp", StockRegion(shapely.box(-1, -1, 101, 61), 0.0, 0.001), np.ones(3, dtype=np.bool_))
    elastic = Elastic(70e3, 0.33, 2.7e-9)
    stock_moments(stock, grid)  # compiles
    rows: list[tuple[str, float, str]] = [("longest side", grid.widest, "mm")]
    t = process_time()
    stock_moments(stock, grid)
    rows.append(("moments", process_time() - t, "s"))
    t = process_time()
    work = cell_workpiece(stock, grid, elastic, [clamp])
    rows.append(("build", process_time() - t, "s"))
    rows.append(("long wall, opposite", opposite(work), "um/N"))
    rows.append(("unknowns", 3.0 * len(work.modes), ""))
    rows.append(("factors", 8.0 * work.factors.entries / 1e6, "MB"))
    equal = grid_over((0, 0, 0), (100, 60, 30), grid.widest, order)
    rows.append(("the same, equal cells", opposite(cell_workpiece(stock, equal, elastic, [clamp])), "um/N"))
    stock.remove(29, shapely.box(0, 0, 20, 2))
    t = process_time()
    work = cell_workpiece(stock, grid, elastic, [clamp])
    rows.append(("new state", process_time() - t, "s"))
    x = np.linspace(1.0, 99.0, 1000)
    lines = np.stack([np.column_stack([x, 0 * x, 0 * x + z]) for z in (22.0, 27.0)], axis=1)
    line_compliances(work, lines[:30])
    t = process_time()
    found = line_compliances(work, lines)
    rows.append(("1,000 contact lines", process_time() - t, "s"))
    rows.append(("greatest compliance", 1e3 * float(found[:, 1, 1, 1].max()), "um/N"))
    t = process_time()
    rows.append(("first frequency", float(vibration_modes(work, 4).frequency[0]), "Hz"))
    rows.append(("four modes", process_time() - t, "s"))
    rows.append(("memory", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0, "MB"))
    if shutil.which("ccx") is not None:
        for (name, unit), value in zip(
            (("CalculiX, one state", "s"), ("its memory", "MB"), ("long wall, opposite", "um/N")),
            calculix(),
            strict=True,
        ):
            rows.append((name, value, unit))
    t = process_time()
    other = factor(csc_array(work.stiffness), 0.0)
    rows.append(("factors by minimum degree", process_time() - t, "s"))
    rows.append(("their size", 12.0 * other.lu.nnz / 1e6, "MB"))
    for name, value, unit in rows:
        print(f"{name:28s} {value:10.4g} {unit}")


if __name__ == "__main__":
    main()
