"""Simplification of the polygons of tiles, whose edges on the border of a tile remain.

Neighbouring tiles are simplified one by one. A corner that is left out on the border between them would open a slit:
the section of the layer, their union, would be cut into along the border, as deep as the neighbouring corner is away.
"""

from __future__ import annotations

import itertools

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from chipload.stock.tile_grid import POLYGON, areas_alone

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Shapes = NDArray[np.object_]

#: distance below which a point lies on a border [mm]
ON_BORDER = 1e-9


def simplify_tiles(tiles: Shapes, borders: Floats, tolerance: float) -> Shapes:
    """Return tiles with fewer corners.

    Parameters
    ----------
    tiles : (n,) polygons, multipolygons or empty geometries
    borders : (n, 4) float [mm], least x and y, greatest x and y of each tile; what lies on them remains
    tolerance : greatest displacement of the other edges [mm]

    Examples
    --------
    The corner (4, 0) lies within 0.01 mm of the edge from (4, 0.001) to (0, 0), but on the border y = 0.

    >>> tile = shapely.Polygon([(4, 0.001), (3, 4), (0, 4), (0, 0), (4, 0)])
    >>> len(tile.simplify(0.01).exterior.coords) - 1
    4
    >>> [new] = simplify_tiles(np.array([tile]), np.array([[0.0, 0.0, 8.0, 8.0]]), 0.01)
    >>> (4.0, 0.0) in new.exterior.coords
    True
    """
    new = areas_alone(shapely.simplify(tiles, tolerance, preserve_topology=True))
    lost = np.abs(_border_lengths(new, borders) - _border_lengths(tiles, borders)) > ON_BORDER
    for k in np.flatnonzero(lost).tolist():
        new[k] = _kept_on_borders(tiles[k], borders[k], tolerance)
    return new


def _border_lengths(tiles: Shapes, borders: Floats) -> Floats:
    """(n,) length [mm] of the edges of tiles that lie on their borders."""
    rings, of = _rings(tiles)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    tile = of[ring]
    on = np.abs(points[:, [0, 1, 0, 1]] - borders[tile]) <= ON_BORDER
    along = (ring[1:] == ring[:-1]) & (on[1:] & on[:-1]).any(axis=1)
    length = np.where(along, np.linalg.norm(np.diff(points, axis=0), axis=1), 0.0)
    return np.asarray(np.bincount(tile[1:], length, minlength=len(tiles)), dtype=np.float64)


def _rings(tiles: Shapes) -> tuple[Shapes, Ints]:
    """Rings of tiles, and the number of the tile of each."""
    parts, tile = shapely.get_parts(tiles, return_index=True)
    rings, part = shapely.get_rings(parts, return_index=True)
    return rings, tile[part]


def _kept_on_borders(tile: shapely.Geometry, border: Floats, tolerance: float) -> shapely.Geometry:
    """Return a tile whose rings are simplified between their points on the border; itself where that is not valid."""
    made = []
    for part in shapely.get_parts(tile).tolist():
        shell, *holes = [_kept_ring(np.asarray(ring.coords), border, tolerance) for ring in shapely.get_rings(part)]
        made.append(Polygon(shell, holes))
    whole = made[0] if shapely.get_type_id(tile) == POLYGON else shapely.MultiPolygon(made)
    return whole if shapely.is_valid(whole) and not shapely.is_empty(whole) else tile


def _kept_ring(points: Floats, border: Floats, tolerance: float) -> Floats:
    """Return a closed ring (n, 2), simplified between its points on the border."""
    on = np.flatnonzero((np.abs(points[:-1, [0, 1, 0, 1]] - border) <= ON_BORDER).any(axis=1))
    if not len(on):
        return np.asarray(shapely.simplify(Polygon(points), tolerance).exterior.coords)
    ring = np.roll(points[:-1], -on[0], axis=0)
    ends = [*(on - on[0]).tolist(), len(ring)]
    ring = np.vstack([ring, ring[:1]])
    points = np.vstack([ring[a : b + 1] for a, b in itertools.pairwise(ends)])
    chains = shapely.linestrings(points, indices=np.repeat(np.arange(len(on)), np.diff(ends) + 1))
    kept = [np.asarray(c.coords)[:-1] for c in shapely.simplify(chains, tolerance, preserve_topology=False)]
    return np.vstack([*kept, ring[:1]])
