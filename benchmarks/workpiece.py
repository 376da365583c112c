"""Processor time and memory of a workpiece in cells: a part of 100 x 60 x 30 mm with walls and a rib of 2 mm.

    python benchmarks/workpiece.py [CELL_MM ORDER]     2.5 and 2, if none are stated

Measured: moments of the stock, building (moments, assembly, clamps, factors), the same after a piece of a wall was
cut (a new state), 1,000 contact lines, and the factors by minimum degree instead of nested dissection.
"""

from __future__ import annotations

import sys
from time import process_time

import numpy as np
import shapely
from scipy.sparse import csc_array

from chipload.stock.layers import LayeredStock
from chipload.structure.cells.clamp import Clamp
from chipload.structure.cells.grid import grid_over
from chipload.structure.cells.moments import Region, stock_moments
from chipload.structure.cells.workpiece import Elastic, cell_workpiece, line_compliances
from chipload.structure.factors import factor


def pocketed() -> LayeredStock:
    """The part: two pockets, floor of 3 mm."""
    stock = LayeredStock.block((0, 0, 0), (100, 60, 30), 1.0, 40.0)
    for k in range(3, stock.layers):
        for a, b in ((2, 49), (51, 98)):
            stock.remove(k, shapely.box(a, 2, b, 58))
    return stock


def main() -> None:
    """Print a row for each quantity."""
    cell, order = (float(sys.argv[1]), int(sys.argv[2])) if len(sys.argv) > 2 else (2.5, 2)
    stock, grid = pocketed(), grid_over((0, 0, 0), (100, 60, 30), cell, order)
    clamp = Clamp("clamp", Region(shapely.box(-1, -1, 101, 61), 0.0, 0.001), np.ones(3, dtype=np.bool_))
    elastic = Elastic(70e3, 0.33)
    stock_moments(stock, grid)  # compiles
    rows: list[tuple[str, float, str]] = []
    t = process_time()
    stock_moments(stock, grid)
    rows.append(("moments", process_time() - t, "s"))
    t = process_time()
    work = cell_workpiece(stock, grid, elastic, [clamp])
    rows.append(("build", process_time() - t, "s"))
    rows.append(("unknowns", 3.0 * len(work.modes), ""))
    rows.append(("factors", 2.0 * 12.0 * work.factors.lu.nnz / 2.0 / 1e6, "MB"))
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
    other = factor(csc_array(work.stiffness), 0.0)
    rows.append(("factors by minimum degree", process_time() - t, "s"))
    rows.append(("their size", 12.0 * other.lu.nnz / 1e6, "MB"))
    for name, value, unit in rows:
        print(f"{name:28s} {value:10.4g} {unit}")


if __name__ == "__main__":
    main()
