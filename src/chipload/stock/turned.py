"""The stock of layers as it lies in the next setup: turned with the part, seen from another zero.

Notation: a point p of the old coordinates has the new ones R p - z; the rows of R are the new axes. Where the new Z is
the old one or its opposite, each section is turned in its plane. Where it is the old X or Y, a new layer is a cut
across the old ones: of each the intervals that the cut meets, as high as the layer. Layers then end at the corners of
the old sections, so that a stock of upright walls and level floors stays exact, and are no thicker than stated.
"""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon

from chipload.errors import InputError
from chipload.stock.layers import LayeredStock
from chipload.stock.tile_grid import areas_alone, borders_of, boxes_of, polygons

Floats = NDArray[np.float64]

#: what counts as a right angle, and two borders of layers that are one [mm]
SQUARE, SAME_MM = 1e-9, 1e-6
#: most layers of a stock that is cut across
MOST = 4000


def turn_matrix(axis: str, degrees: float) -> Floats:
    """(3, 3) turn of the part about an axis of its coordinates, counter-clockwise seen from its positive side.

    Raises
    ------
    InputError
        The part would lean: about X and Y only right angles are possible.

    >>> turn_matrix("x", 180.0).round(9).tolist()
    [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]
    """
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    if axis != "z" and degrees % 90.0:
        raise InputError(
            f"flip.angle_deg = {degrees:g}: about {axis.upper()} it must be a multiple of 90: what leans is one "
            "setup on a machine with rotary axes"
        )
    c, s = (float(round(v)) if abs(v - round(v)) < SQUARE else v for v in (c, s))
    first, second = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    out = np.eye(3)
    out[first, first] = out[second, second] = c
    out[first, second], out[second, first] = 0.0 - s, s
    return out


def stock_bounds(stock: LayeredStock, R: Floats) -> tuple[Floats, Floats]:
    """Corners (3,) [mm] of the box around what is left of a stock, turned by R.

    Raises
    ------
    InputError
        Nothing is left.
    """
    points = []
    for i in range(stock.layers):
        xy = shapely.get_coordinates(stock.section(i))
        if len(xy):
            (x0, y0), (x1, y1) = xy.min(axis=0).tolist(), xy.max(axis=0).tolist()
            flat = xy if abs(R[2, 2]) > 0.5 else np.array([[x0, y0], [x1, y0], [x0, y1], [x1, y1]])
            points += [np.column_stack([flat, np.full(len(flat), z)]) for z in stock.bounds[i : i + 2]]
    if not points:
        raise InputError("stock: nothing is left of it for the next setup")
    turned = np.vstack(points) @ R.T
    return turned.min(axis=0), turned.max(axis=0)


def turned_stock(stock: LayeredStock, R: Floats, zero: Floats, layer_mm: float) -> LayeredStock:
    """The stock in the coordinates R p - zero.

    Parameters
    ----------
    R : (3, 3) of :func:`turn_matrix`
    zero : (3,) float [mm], the new zero in turned coordinates
    layer_mm : thickest layer of a stock that is cut across

    Raises
    ------
    InputError
        Nothing is left of it, or the layers would be too many.
    """
    if abs(R[2, 2]) > 0.5:
        up = float(np.sign(R[2, 2]))
        plane = (R[0, 0], R[0, 1], R[1, 0], R[1, 1], -zero[0], -zero[1])
        made = [shapely.affinity.affine_transform(stock.section(i), plane) for i in range(stock.layers)]
        bounds = up * np.asarray(stock.bounds) - zero[2]
        if up < 0.0:
            made, bounds = made[::-1], bounds[::-1].copy()
    else:
        made, bounds = _cut_across(stock, R, zero, layer_mm)
    full = [k for k, shape in enumerate(made) if not shape.is_empty]
    if not full:
        raise InputError("stock: nothing is left of it for the next setup")
    made, bounds = made[full[0] : full[-1] + 1], bounds[full[0] : full[-1] + 2]
    tile = max(float(np.diff(stock.xs).max()), float(np.diff(stock.ys).max()))
    corners = np.array([shape.bounds for shape in made if not shape.is_empty])
    xs = borders_of(float(corners[:, 0].min()), float(corners[:, 2].max()), tile)
    ys = borders_of(float(corners[:, 1].min()), float(corners[:, 3].max()), tile)
    boxes = boxes_of(xs, ys, len(made))
    whole = np.empty((len(made), 1, 1), dtype=object)
    whole[:, 0, 0] = made
    tiles = np.asarray(shapely.intersection(boxes, whole))
    out = LayeredStock(bounds, xs, ys, areas_alone(tiles.ravel()).reshape(tiles.shape))
    # what is a block again may be cut as one
    box = float(np.ptp(xs[[0, -1]]) * np.ptp(ys[[0, -1]]) * np.ptp(bounds[[0, -1]]))
    out.cut[:] = abs(out.volume() - box) > 1e-9 * box
    return out


def _cut_across(stock: LayeredStock, R: Floats, zero: Floats, layer_mm: float) -> tuple[list[MultiPolygon], Floats]:
    """Sections square to the old X or Y, and their bounds in the new Z."""
    along = int(np.argmax(np.abs(R[2])))
    across, up = 1 - along, float(np.sign(R[2, along]))
    sections = [stock.section(i) for i in range(stock.layers)]
    levels = np.unique(np.concatenate([shapely.get_coordinates(shape)[:, along] for shape in sections]))
    if len(levels) < 2:
        raise InputError("stock: nothing is left of it for the next setup")
    levels = levels[np.concatenate([[True], np.diff(levels) > SAME_MM])]
    pieces = np.maximum(np.ceil(np.diff(levels) / layer_mm * (1.0 - 1e-12)), 1.0).astype(np.int64)
    if pieces.sum() > MOST:
        raise InputError(
            f"stock: {int(pieces.sum())} layers of the turned stock: at most {MOST}: state a greater stock.layer_mm"
        )
    parts = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(levels[:-1], levels[1:], pieces, strict=True)]
    bounds = np.append(np.concatenate(parts), levels[-1])
    low, high = (float(shapely.total_bounds(sections)[across + k]) - 1.0 for k in (0, 2))
    high += 2.0
    made = []
    for level in 0.5 * (bounds[:-1] + bounds[1:]):
        ends = np.array([[low, level], [high, level]]) if along == 1 else np.array([[level, low], [level, high]])
        lines = shapely.intersection(shapely.LineString(ends), sections)
        boxes = []
        for i, line in enumerate(lines):
            for piece in shapely.get_parts(line):
                own = shapely.get_coordinates(piece)
                if len(own) < 2:
                    continue
                corners = np.zeros((2, 3))
                corners[:, along] = level
                corners[:, across] = own[:, across].min(), own[:, across].max()
                corners[:, 2] = stock.bounds[i : i + 2]
                turned = corners @ R.T - zero
                a, b = turned.min(axis=0), turned.max(axis=0)
                boxes.append(shapely.box(a[0], a[1], b[0], b[1]))
        made.append(MultiPolygon(polygons(shapely.union_all(boxes))))
    heights = up * bounds - zero[2]
    return (made, heights) if up > 0.0 else (made[::-1], heights[::-1].copy())
