"""A grid of cells with planes on the flat faces of a part that are square to the axes.

A cell that contains the corner between a wall and its floor is too stiff, so the position of the planes matters more
than the size of the cells (docs/design/workpiece.md: 13 % too stiff in equal cells of 2.5 times the thickness of the
wall). The largest flat faces are taken first, as long as they do not add many cells.

Faces along x and y are straight edges of the sections of a layered stock, with the height of their layers; faces along
z the difference of area from section to section.
"""

from __future__ import annotations

import numpy as np
import shapely

from chipload.stock.layers import LayeredStock
from chipload.structure.cells.grid import Array, CellGrid, cells_between, grid_between
from chipload.structure.cells.moments import alike

#: greatest deviation from an axis, as a share of its length, of an edge that lies on a face
SQUARE = 1e-4
#: distance below which two planes of faces are one [mm]
ONE = 0.01
#: least area of a face that counts, as a share of the area of the box around the stock
LEAST_AREA = 0.02
#: least distance of planes over the longest side of a cell
NEAREST = 0.1
#: greatest number of cells along an axis: factor on the number without faces, and addition to it
MORE, FEW = 1.25, 2


#: of x, y and z
Faces = tuple[tuple[Array, Array], ...]


def flat_faces(stock: LayeredStock) -> Faces:
    """Places [mm] along x, y and z of flat faces square to the axis, and their areas [mm^2], largest first.

    >>> [(x.tolist(), a.tolist()) for x, a in flat_faces(LayeredStock.block((0, 0, 0), (9, 5, 2), 2.0, 20.0))]
    [([0.0, 9.0], [10.0, 10.0]), ([0.0, 5.0], [18.0, 18.0]), ([0.0, 2.0], [45.0, 45.0])]
    """
    upright: tuple[list[Array], list[Array]] = ([], [])
    levels, steps = [float(stock.bounds[0])], list[float]()
    before, low = 0.0, 0
    while low < stock.layers:
        high = low + 1
        while high < stock.layers and alike(stock, high):
            high += 1
        section, height = stock.section(low), float(stock.bounds[high] - stock.bounds[low])
        for axis in (0, 1):
            upright[axis].append(_edges(section, axis) * (1.0, height))
        steps.append(abs(section.area - before))
        levels.append(float(stock.bounds[high]))
        before, low = section.area, high
    steps.append(before)
    rows = [*(np.concatenate(part) for part in upright), np.column_stack([levels, steps])]
    return tuple(_join_places(r) for r in rows)


def _edges(section: shapely.MultiPolygon, axis: int) -> Array:
    """(m, 2) place and length of the edges of a section that are square to an axis."""
    rings = shapely.get_rings(shapely.get_parts(section))
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    d, same = np.abs(np.diff(xy, axis=0)), np.diff(ring) == 0
    some = same & (d[:, axis] <= SQUARE * d[:, 1 - axis]) & (d[:, 1 - axis] > 0.0)
    return np.column_stack([0.5 * (xy[:-1] + xy[1:])[some, axis], d[some, 1 - axis]])


def _join_places(rows: Array) -> tuple[Array, Array]:
    """Places that lie together as one, with the sum of their areas, largest first."""
    rows = rows[rows[:, 1] > 0.0]
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    group = np.cumsum(np.diff(rows[:, 0], prepend=rows[:1, 0]) > ONE)
    area = np.asarray(np.bincount(group, rows[:, 1]), dtype=np.float64)
    place = np.bincount(group, rows[:, 0] * rows[:, 1]) / area
    order = np.argsort(-area, kind="stable")
    return place[order], area[order]


def grid_on_faces(stock: LayeredStock, faces: Faces, cell_mm: float, order: int = 2) -> CellGrid:
    """The grid over a stock, with planes on the largest of the flat faces that it will have after the program.

    Parameters
    ----------
    faces : see :func:`flat_faces`
    cell_mm : longest side of a cell

    Raises
    ------
    InputError
        The cells are too many.
    """
    ends = [np.array([v[0], v[-1]], dtype=np.float64) for v in (stock.xs, stock.ys, stock.bounds)]
    size = np.array([v[1] - v[0] for v in ends])
    x, y, z = (
        _choose_planes(v, place[area >= LEAST_AREA * np.prod(size) / side], cell_mm)
        for v, side, (place, area) in zip(ends, size.tolist(), faces, strict=True)
    )
    return grid_between((x, y, z), cell_mm, order)


def _choose_planes(ends: Array, places: Array, cell_mm: float) -> Array:
    """Planes between two ends at those of the places, taken in turn, that make few more cells."""
    planes = ends
    most = MORE * int(cells_between(ends, cell_mm).sum()) + FEW
    for x in places.tolist():
        # a face is known to the tolerance of the outlines only
        if not ends[0] < x < ends[1] or np.abs(planes - x).min() < NEAREST * cell_mm - ONE:
            continue
        more = np.sort(np.append(planes, x))
        if int(cells_between(more, cell_mm).sum()) <= most:
            planes = more
    return planes
