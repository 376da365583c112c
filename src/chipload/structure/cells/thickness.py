"""The thinnest wall and the thinnest floor of a layered stock, and the cell size that resolves them.

A wall is thinner than t where the section of a layer, made narrower by t / 2 all round and wider again, has lost more
than :data:`PATCH` t^2: a corner loses less. A floor, or a roof, is thinner than t where the upright runs of material
above a grid of points are shorter over more than that area.

Cells of order 2 with sides of :data:`GOOD` times the thickness are within about 3 %, of :data:`MOST` times within about
15 % (docs/design/workpiece.md); wider ones are refused.
"""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.assembly import LEAST_SHARE, MOST_MODES, modes_of, shares
from chipload.structure.cells.faces import flat_faces, grid_on_faces
from chipload.structure.cells.grid import CellGrid
from chipload.structure.cells.moments import alike, stock_moments

#: least area over t^2 of a wall of thickness t
PATCH = 2.0
#: sides of cells over the thinnest wall: wanted, and at most
GOOD, MOST = 1.25, 2.5
#: number of sections that are searched, and of points across the longest side
SECTIONS, POINTS = 16, 48
#: ratio of successive thicknesses that are tested, and number of halvings afterwards
GROWTH, HALVINGS = 1.4, 5
#: least number of cells along the longest side
LEAST_CELLS = 12
#: number of modes, three directions each, up to which cells have the wanted size
WANTED_MODES = 8_000


def thinnest(stock: LayeredStock, least: float, most: float) -> float:
    """Thickness [mm] of the thinnest wall or floor, between ``least`` and ``most``; ``most``: none is thinner."""
    wall = thinnest_wall(stock, least, most)
    return min(wall, thinnest_floor(stock, most))


def thinnest_wall(stock: LayeredStock, least: float, most: float) -> float:
    """The least thickness [mm] at which a choice of sections loses a wall."""
    firsts = [i for i in range(stock.layers) if not alike(stock, i)]
    at = np.linspace(0, len(firsts) - 1, min(SECTIONS, len(firsts))).astype(np.int64)
    sections = [stock.section(firsts[k]).simplify(0.02 * least) for k in np.unique(at).tolist()]

    def thin(t: float) -> bool:
        for s in sections:
            opened = s.buffer(-0.5 * t, join_style="mitre").buffer(0.5 * t * (1.0 + 1e-9), join_style="mitre")
            lost = shapely.get_parts(s.difference(opened))
            if len(lost) and float(shapely.area(lost).max()) > PATCH * t * t:
                return True
        return False

    high = least
    while not thin(high):
        if high >= most:
            return most
        high = min(GROWTH * high, most)
    low = max(high / GROWTH, least)
    for _ in range(HALVINGS):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if thin(middle) else (middle, high)
    return math.sqrt(low * high)


def thinnest_floor(stock: LayeredStock, most: float) -> float:
    """Least height [mm] of material above a grid of points over more than a patch."""
    low, high = (np.array([stock.xs[i], stock.ys[i]]) for i in (0, -1))
    pitch = float((high - low).max()) / POINTS
    x, y = (np.arange(a + 0.5 * pitch, b, pitch) for a, b in zip(low, high, strict=True))
    at = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    run, runs, inside = np.zeros(len(at)), list[NDArray[np.float64]](), np.zeros(len(at), dtype=np.bool_)
    for i in range(stock.layers):
        if not alike(stock, i):
            inside = shapely.contains_xy(stock.section(i), at[:, 0], at[:, 1])
        ended = ~inside & (run > 0.0)
        runs.append(run[ended])
        run = np.where(inside, run + float(stock.thickness[i]), 0.0)
    runs.append(run[run > 0.0])
    heights = np.sort(np.concatenate(runs))
    area = pitch * pitch * np.arange(1, len(heights) + 1)
    enough = heights[area > PATCH * heights**2]
    return min(float(enough[0]), most) if len(enough) else most


def cells_over(
    first: LayeredStock, last: LayeredStock, cell_mm: float | None, order: int = 2, known_mm: float = 0.0
) -> tuple[CellGrid, float]:
    """Cells for a stock that is cut, and the thickness [mm] of the thinnest wall that is left.

    Parameters
    ----------
    first, last : before and after the program
    cell_mm : longest side of a cell [mm]; None: by the thinnest wall
    known_mm : tolerance of the outlines of ``last``, by which a wall may be thicker than its outlines

    Raises
    ------
    InputError
        The cells do not resolve the thinnest wall, or would be too many.
    """
    side = max(float(v[-1] - v[0]) for v in (first.xs, first.ys, first.bounds))
    wall, faces = thinnest(last, side / 1000.0, side / LEAST_CELLS), flat_faces(last)
    if cell_mm is not None:
        if cell_mm > MOST * (wall * GROWTH ** (0.5**HALVINGS) + known_mm):
            raise InputError(
                f"workpiece.cell_mm = {cell_mm:g}: the thinnest wall left is {wall:.3g} mm: at most {MOST:g} times "
                f"that, {MOST * wall:.3g}"
            )
        return grid_on_faces(first, faces, cell_mm, order), wall
    size = GOOD * wall
    while True:
        grid = grid_on_faces(first, faces, min(size, side / LEAST_CELLS), order)
        count = max(count_modes(stock, grid) for stock in (first, last))
        if count <= WANTED_MODES or (size >= MOST * wall and count <= MOST_MODES):
            return grid, wall
        if size >= MOST * wall:
            raise InputError(
                f"workpiece: the thinnest wall left is {wall:.3g} mm: {3 * count} unknowns in cells of {size:.3g} mm, "
                f"at most {3 * MOST_MODES}: the part is too large for walls as thin as that"
            )
        size = min(1.15 * size, MOST * wall)


def count_modes(stock: LayeredStock, grid: CellGrid) -> int:
    """Modes of a stock in cells, three directions each; at most twice :data:`MOST_MODES`."""
    share = shares(stock_moments(stock, CellGrid(grid.planes, 1)))
    if int((share > LEAST_SHARE).sum()) > 2 * MOST_MODES:
        return 2 * MOST_MODES
    return len(modes_of(grid, share, limited=False))
