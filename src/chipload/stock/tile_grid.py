"""Tiles and layers of a stock: their borders, those that an interval meets, and their content from a mesh.

Notation: as in :mod:`chipload.stock.layers`.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely import MultiPolygon, Polygon

from chipload.errors import InputError
from chipload.geometry.mesh import sections
from chipload.lazy import trimesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Shapes = NDArray[np.object_]

#: most layers
LAYER_LIMIT = 200_000
#: most tiles times layers
TILE_LIMIT = 20_000_000
#: greatest number of points of the sections of a mesh that are stored for later use
KEPT = 200_000
#: type numbers of GEOS
POLYGON, MULTIPOLYGON = 3, 6


def polygons(shape: Any) -> list[Polygon]:
    """The polygons of a geometry that have an area; its lines and points are left out."""
    parts = shapely.get_parts(shape)
    return list(parts[(shapely.get_type_id(parts) == POLYGON) & (shapely.area(parts) > 0.0)])


def areas_alone(shapes: Shapes) -> Shapes:
    """(n,) the same geometries, those that also have lines or points, as rounding leaves them, without these.

    >>> shapely.get_type_id(areas_alone(shapely.from_wkt(["GEOMETRYCOLLECTION (POINT (0 0))"]))).tolist()
    [6]
    """
    out: Shapes = np.array(shapes, dtype=object)
    kind = shapely.get_type_id(out)
    for at in np.flatnonzero((kind != POLYGON) & (kind != MULTIPOLYGON)).tolist():
        out[at] = MultiPolygon(polygons(out[at]))
    return out


def cut_up(part: trimesh.Trimesh, heights: Floats, boxes: Shapes, known: dict[float, MultiPolygon]) -> Shapes:
    """(n, rows, columns) tiles of the sections of a mesh; new sections are added to ``known``, by height [mm]."""
    found = {h: known.get(h) for h in heights.tolist()}
    fresh = [h for h, section in found.items() if section is None]
    made = dict(zip(fresh, sections(part, fresh), strict=True))
    points = [int(shapely.get_num_coordinates(list(of.values())).sum()) for of in (known, made)]
    if sum(points) > KEPT:
        known.clear()
    if points[1] <= KEPT:
        known.update(made)
    whole = np.empty((len(heights), 1, 1), dtype=object)
    whole[:, 0, 0] = [made[h] if h in made else found[h] for h in heights.tolist()]
    tiles = shapely.intersection(boxes, whole)
    return areas_alone(np.asarray(tiles).ravel()).reshape(tiles.shape)


def turns_of(rows: Ints) -> list[Ints]:
    """Numbers 0 .. len(rows) - 1 in groups, none of which has a layer twice."""
    if len(set(rows.tolist())) == len(rows):
        return [np.arange(len(rows))] if len(rows) else []
    order = np.argsort(rows, kind="stable")
    ranks = np.empty(len(rows), dtype=np.int64)
    first = np.flatnonzero(np.diff(rows[order], prepend=-1))
    ranks[order] = np.arange(len(rows)) - np.repeat(first, np.diff([*first, len(rows)]))
    return [np.flatnonzero(ranks == turn) for turn in range(int(ranks.max(initial=-1)) + 1)]


def span(borders: Sequence[float], low: float, high: float) -> range:
    """Tiles that overlap the open interval low < x < high; none if a bound is not a number."""
    if not high > low:
        return range(0)
    return range(max(bisect_right(borders, low) - 1, 0), min(bisect_left(borders, high), len(borders) - 1))


def bounds_of(bounds_or_layer_mm: ArrayLike, low: float, high: float) -> Floats:
    """(n + 1,) bounds [mm] of the layers: as given, or equal ones no thicker than the number given."""
    given = np.asarray(bounds_or_layer_mm, dtype=np.float64)
    if given.ndim == 0:
        thickest = float(given)
        if not 0.0 < thickest < math.inf:
            raise InputError(f"stock.layer_mm = {thickest:g}: must be above 0")
        given = np.linspace(low, high, _parts(low, high, thickest, "stock.layer_mm", LAYER_LIMIT) + 1)
    if given.ndim != 1 or len(given) < 2 or not np.isfinite(given).all() or not (np.diff(given) > 0.0).all():
        raise InputError("stock.bounds: must be two or more ascending heights [mm]")
    return given


def borders_of(low: float, high: float, tile_mm: float) -> Floats:
    """Borders [mm] of equal tiles no longer than ``tile_mm``."""
    if not 0.0 < tile_mm < math.inf:
        raise InputError(f"stock.tile_mm = {tile_mm:g}: must be above 0; two to four cutter diameters")
    return np.linspace(low, high, _parts(low, high, tile_mm, "stock.tile_mm", TILE_LIMIT) + 1)


def _parts(low: float, high: float, longest: float, key: str, most: int) -> int:
    """Number of equal pieces no longer than ``longest``."""
    count = (high - low) / longest * (1.0 - 1e-12)
    if not count <= most:
        raise InputError(
            f"{key} = {longest:g}: {high - low:g} mm in {count:.4g} pieces: must be at most {most}: state a larger one"
        )
    return max(1, math.ceil(count))


def boxes_of(xs: Floats, ys: Floats, layers: int) -> Shapes:
    """(rows, columns) rectangles of the tiles."""
    if layers * len(xs) * len(ys) > TILE_LIMIT:
        raise InputError(
            f"stock: {layers} layers of {len(xs) - 1} x {len(ys) - 1} tiles: at most {TILE_LIMIT} in all: "
            "take larger tiles or thicker layers"
        )
    boxes: Shapes = shapely.box(xs[None, :-1], ys[:-1, None], xs[None, 1:], ys[1:, None])
    return boxes
