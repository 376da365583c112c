"""Tiles of a layered stock as rings of numbers while steps are removed, without an object for each tile.

Notation: as in :mod:`chipload.stock._tiles`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon

from chipload.lazy import LateModule
from chipload.stock.areas import PlaneAreas, areas_of, polygon_of
from chipload.stock.layers import ROOM, LayeredStock
from chipload.stock.simpler import simplify_tiles
from chipload.stock.tile_grid import areas_alone, polygons, span

kernels = LateModule("chipload.stock._tiles")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
T = TypeVar("T", bound=np.generic)

#: initial room: points and rings of tiles, tiles, points and rings of chips, crossings, operations
POINTS, RINGS, SLOTS, CHIP, CHIP_RINGS, CROSSINGS, OPERATIONS = 1 << 16, 1 << 13, 1 << 12, 1 << 13, 1 << 10, 512, 256


@dataclass(frozen=True, eq=False)
class Taken:
    """Areas that the entries of a step removed.

    Parameters
    ----------
    area : (e,) float [mm^2]
    parts : (e,) int, number of pieces, joined over the tiles, that are not films
    least, whole : (e,) float [mm^2], the smallest of these pieces, and their sum
    """

    area: Floats
    parts: Ints
    least: Floats
    whole: Floats


class TileRings:
    """The tiles of a stock as rings; :meth:`finish` writes those that changed back to it.

    A tile is read when it is first needed. Before :meth:`finish` the stock itself does not change, except for the
    volume that it gains by the simplification of edges (``stock.tidied``).

    Parameters
    ----------
    stock : layers from which steps are removed

    Notes
    -----
    A tile that compiled loops cannot cut, because a ring crosses itself by rounding, is cut by GEOS and counted in
    ``stock.by_geos``.
    """

    def __init__(self, stock: LayeredStock) -> None:
        self.stock = stock
        self._x, self._y = stock.xs.tolist(), stock.ys.tolist()
        self.slot_of = np.full(stock.tiles.shape, kernels.NONE, dtype=np.int64)
        self.read_slot = self.slot_of.copy()
        self.points, self.rings = np.empty((POINTS, 2)), np.empty((RINGS, 2), dtype=np.int64)
        self.slots, self.boxes = np.zeros((SLOTS, 3), dtype=np.int64), np.zeros((SLOTS, 4))
        # numbers of points, rings and slots, reason for which a removal stopped; slot 0 is empty
        self.used = np.array([0, 0, 1, 0], dtype=np.int64)
        self.chip, self.chip_rings = np.empty((CHIP, 2)), np.empty((CHIP_RINGS, 2), dtype=np.int64)
        self.chip_used = np.zeros(2, dtype=np.int64)
        self.ops = np.zeros((OPERATIONS, 9), dtype=np.int64)
        self.x, self.cross = np.empty((CROSSINGS, 4)), np.empty((CROSSINGS, 11), dtype=np.int64)
        self.edge = np.empty((1024, 4))
        self.count = 0
        self._slot_of_tile: dict[int, int] = {}

    def read(self, layers: range, j: range, i: range) -> None:
        """Read the tiles of some layers, rows and columns that were not read yet."""
        at = (slice(layers.start, layers.stop), slice(j.start, j.stop), slice(i.start, i.stop))
        some = self.slot_of[at] == kernels.NONE
        tiles = self.stock.tiles[at][some].tolist()
        fresh = list({id(tile): tile for tile in tiles if id(tile) not in self._slot_of_tile}.values())
        if fresh:
            for tile, slot in zip(fresh, self._add(fresh), strict=True):
                self._slot_of_tile[id(tile)] = slot
        slots = np.array([self._slot_of_tile[id(tile)] for tile in tiles], dtype=np.int64)
        self.slot_of[at][some] = slots
        self.read_slot[at][some] = slots

    def _add(self, shapes: list[shapely.Geometry]) -> list[int]:
        """Add polygons; return their slots."""
        areas = areas_of(shapes)
        n, r, s = self.used[:3].tolist()
        self._grow(len(areas.points), len(areas.rings), len(areas))
        self.points[n : n + len(areas.points)] = areas.points
        self.rings[r : r + len(areas.rings)] = areas.rings + np.array([n, 0])
        some = np.flatnonzero(areas.first[:, 1] > areas.first[:, 0])
        first, last = areas.first[some].T
        ends = areas.rings[last - 1].sum(axis=1) if len(some) else np.zeros(0, dtype=np.int64)
        begins = areas.rings[first, 0] if len(some) else ends
        self.slots[s : s + len(some)] = np.column_stack([first + r, last - first, ends - begins])
        self.boxes[s : s + len(some)] = areas.boxes[some]
        self.used[:3] += [len(areas.points), len(areas.rings), len(some)]
        out = np.zeros(len(areas), dtype=np.int64)
        out[some] = s + np.arange(len(some))
        return out.tolist()

    def _grow(self, points: int, rings: int, slots: int) -> None:
        n, r, s = self.used[:3].tolist()
        self.points = _larger(self.points, n, n + points)
        self.rings = _larger(self.rings, r, r + rings)
        self.slots, self.boxes = _larger(self.slots, s, s + slots), _larger(self.boxes, s, s + slots)

    def edges(self, layers: range, low: Floats, high: Floats) -> tuple[Floats, Ints, Floats]:
        """Return the edges in the tiles of neighbouring layers under a rectangle, as :meth:`LayeredStock.edges`."""
        (x0, y0), (x1, y1) = low.tolist(), high.tolist()
        i, j = span(self._x, x0, x1), span(self._y, y0, y1)
        start = np.zeros(len(layers) + 1, dtype=np.int64)
        bounds = self.stock.bounds[layers.start : layers.stop + 1]
        while True:
            n = kernels.edges_under(
                layers.start, layers.stop, j.start, j.stop, i.start, i.stop, x0, y0, y1,
                self.points, self.rings, self.slots, self.slot_of, self.edge, start,
            )  # fmt: skip
            if n >= 0:
                return bounds, start, self.edge[:n].copy()
            if n == kernels.MISSING:
                self.read(layers, j, i)
            else:
                self.edge = np.empty((2 * len(self.edge), 4))

    def remove(self, layers: Ints, shape: Ints, areas: PlaneAreas, film: float, tidy: float = 0.0) -> Taken:
        """Remove area ``shape[e]`` of ``areas`` from layer ``layers[e]``, for all e.

        Parameters
        ----------
        film : approximate greatest width of a piece that counts as a film [mm]
        tidy : as of :meth:`LayeredStock.remove_many`
        """
        while True:
            n = kernels.list_operations(
                layers, shape, areas.boxes, self.stock.xs, self.stock.ys, self.slot_of, self.boxes, self.ops
            )
            if n >= 0:
                break
            if n == kernels.MISSING:
                self._read_under(layers, areas.boxes[shape])
            else:
                self.ops = np.zeros((2 * len(self.ops), 9), dtype=np.int64)
        self.count = n
        self.chip_used[:] = 0
        at = 0
        while True:
            at = kernels.cut_tiles(
                at, n, layers, shape, areas.points, areas.rings, areas.first, areas.boxes, self.points, self.rings,
                self.slots, self.boxes, self.slot_of, self.used, self.chip, self.chip_rings, self.chip_used, self.ops,
                self.x, self.cross,
            )  # fmt: skip
            if at == n:
                break
            if self.used[3] == kernels.FULL:
                self._enlarge()
            else:
                self._cut_by_geos(at, areas.polygon(int(shape[self.ops[at, kernels.ENTRY]])))
                at += 1
        out = np.empty((len(layers), 4))
        kernels.removed_areas(
            len(layers), n, self.ops, self.stock.xs, self.stock.ys, self.chip, self.chip_rings, film, out
        )
        self._mark_changed(tidy)
        return Taken(out[:, 0], out[:, 1].astype(np.int64), out[:, 2], out[:, 3])

    def _read_under(self, layers: Ints, boxes: Floats) -> None:
        """Read the tiles that boxes reach into, from the lowest to the highest layer."""
        some = (boxes[:, 2] > boxes[:, 0]) & (boxes[:, 3] > boxes[:, 1])
        (x0, y0), (x1, y1) = boxes[some, :2].min(axis=0).tolist(), boxes[some, 2:].max(axis=0).tolist()
        self.read(range(int(layers.min()), int(layers.max()) + 1), span(self._y, y0, y1), span(self._x, x0, x1))

    def _enlarge(self) -> None:
        """Enlarge the arrays that may be full."""
        self._grow(len(self.points), len(self.rings), len(self.slots))
        n, r = self.chip_used.tolist()
        self.chip = _larger(self.chip, n, 2 * len(self.chip))
        self.chip_rings = _larger(self.chip_rings, r, 2 * len(self.chip_rings))
        self.x = np.empty((2 * len(self.x), 4))
        self.cross = np.empty((2 * len(self.cross), 11), dtype=np.int64)

    def _cut_by_geos(self, k: int, shape: Polygon | MultiPolygon) -> None:
        """Carry out operation k with GEOS."""
        self.stock.by_geos += 1
        op = self.ops[k]
        old = self.polygon(int(op[kernels.OLD]))
        pieces, left = MultiPolygon(polygons(old.intersection(shape))), old.difference(shape)
        found = areas_of([pieces])
        n, r = self.chip_used.tolist()
        self.chip = _larger(self.chip, n, n + len(found.points))
        self.chip_rings = _larger(self.chip_rings, r, r + len(found.rings))
        self.chip[n : n + len(found.points)] = found.points
        self.chip_rings[r : r + len(found.rings)] = found.rings + np.array([n, 0])
        self.chip_used += [len(found.points), len(found.rings)]
        op[kernels.NEW] = self._add(list(areas_alone(np.array([left], dtype=object))))[0]
        op[kernels.CHIP_0], op[kernels.CHIP_1], op[kernels.AS] = r, r + len(found.rings), k
        self.slot_of[op[kernels.LAYER], op[kernels.J], op[kernels.I]] = op[kernels.NEW]

    def _mark_changed(self, tidy: float) -> None:
        """Mark the layers from which material was removed, and simplify the tiles that have too many points."""
        ops = self.ops[: self.count]
        ops = ops[ops[:, kernels.NEW] != ops[:, kernels.OLD]]
        if not len(ops):
            return
        layer, j, i, slot = ops[:, [kernels.LAYER, kernels.J, kernels.I, kernels.NEW]].T
        self.stock.cut[layer] = True
        self.stock.earlier = None
        if tidy <= 0.0:
            return
        # GEOS counts the first point of a ring twice
        many = np.flatnonzero(self.slots[slot, 2] + self.slots[slot, 1] > self.stock.room[layer, j, i])
        if not len(many):
            return
        layer, j, i, slot = layer[many], j[many], i[many], slot[many]
        which, at, of = np.unique(slot, return_index=True, return_inverse=True)
        old = np.array([self.polygon(s) for s in which.tolist()], dtype=object)
        new = simplify_tiles(old, self.stock.borders(j[at], i[at]), tidy)
        self.slot_of[layer, j, i] = np.array(self._add(new.tolist()), dtype=np.int64)[of]
        self.stock.room[layer, j, i] = np.maximum(2 * shapely.get_num_coordinates(new)[of], ROOM)
        gained = (shapely.area(new) - shapely.area(old))[of] * self.stock.thickness[layer]
        self.stock.tidied += float(gained.sum())

    def polygon(self, slot: int) -> Polygon | MultiPolygon:
        """Return the polygon of a slot."""
        first, count, _ = self.slots[slot].tolist()
        rings = self.rings[first : first + count].tolist()
        return polygon_of([self.points[a : a + n] for a, n in rings]) if rings else Polygon()

    def parts_of(self, entry: int) -> list[Polygon]:
        """Return the pieces that an entry of the last removal removed, joined over the tiles."""
        flat = list[Polygon]()
        ops = self.ops[: self.count]
        for op in ops[ops[:, kernels.ENTRY] == entry]:
            rings = self.chip_rings[op[kernels.CHIP_0] : op[kernels.CHIP_1]].tolist()
            if rings:
                flat += polygons(polygon_of([self.chip[a : a + n] for a, n in rings]))
        return polygons(shapely.union_all(flat))

    def section(self, layer: int, low: Floats, high: Floats) -> MultiPolygon:
        """Return the remaining section of a layer in the tiles under a rectangle."""
        (x0, y0), (x1, y1) = low.tolist(), high.tolist()
        i, j = span(self._x, x0, x1), span(self._y, y0, y1)
        self.read(range(layer, layer + 1), j, i)
        slots = self.slot_of[layer, j.start : j.stop, i.start : i.stop].ravel().tolist()
        return MultiPolygon(polygons(shapely.union_all([self.polygon(s) for s in slots])))

    def holds(self, points: Floats) -> bool:
        """Return whether one of some points (n, 3) [mm] lies in the stock."""
        layer, j, i = (
            np.searchsorted(b, points[:, k], "right") - 1
            for k, b in ((2, self.stock.bounds), (1, self.stock.ys), (0, self.stock.xs))
        )
        layers, rows, columns = self.stock.tiles.shape
        known = (layer >= 0) & (layer < layers) & (i >= 0) & (i < columns) & (j >= 0) & (j < rows)
        for m, k, n, (x, y, _) in zip(
            layer[known].tolist(), j[known].tolist(), i[known].tolist(), points[known].tolist(), strict=True
        ):
            if self.slot_of[m, k, n] == kernels.NONE:
                self.read(range(m, m + 1), range(k, k + 1), range(n, n + 1))
            first, count, _ = self.slots[self.slot_of[m, k, n]].tolist()
            if kernels.contains(self.points, self.rings, first, first + count, x, y):
                return True
        return False

    def finish(self) -> None:
        """Write the tiles that changed back to the stock as polygons."""
        layer, j, i = np.nonzero(self.slot_of != self.read_slot)
        if not len(layer):
            return
        which, of = np.unique(self.slot_of[layer, j, i], return_inverse=True)
        made = np.empty(len(which), dtype=object)
        one = (self.slots[which, 1] == 1) & (which > 0)
        if one.any():
            rings = self.rings[self.slots[which[one], 0]]
            number = np.repeat(np.arange(len(rings)), rings[:, 1])
            at = np.arange(len(number)) + np.repeat(rings[:, 0] - np.cumsum(rings[:, 1]) + rings[:, 1], rings[:, 1])
            made[one] = shapely.polygons(shapely.linearrings(self.points[at], indices=number))
            one[one] = shapely.is_valid(made[one])
        for k in np.flatnonzero(~one).tolist():
            made[k] = self.polygon(int(which[k]))
        self.stock.tiles[layer, j, i] = made[of]
        self.read_slot[layer, j, i] = self.slot_of[layer, j, i]


def _larger(array: NDArray[T], used: int, needed: int) -> NDArray[T]:
    """Return an array with room for ``needed`` rows, the first ``used`` as they are."""
    if needed <= len(array):
        return array
    out = np.empty((max(needed, 2 * len(array)), *array.shape[1:]), dtype=array.dtype)
    out[:used] = array[:used]
    return out
