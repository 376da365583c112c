"""The workpiece as a stack of horizontal layers, each a set of polygons from which covered areas are removed.

Notation: layer i is the prism between ``bounds[i]`` and ``bounds[i + 1]`` [mm]; its section S_i is that at its middle,
``heights[i]``. The plane is cut into rectangular **tiles** (columns x rows); a layer stores one geometry for each
tile, so that the removal of an area C reads only the tiles under C, at a cost that does not grow with the number of
earlier moves. Volume = sum of area(S_i) times thickness; for a smooth body cut at the middles its error is O(dz^2).

Reference: [Chips2017] (the pile of layers).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely import MultiPolygon, Polygon

from chipload.errors import InputError
from chipload.files import write_whole
from chipload.geometry.mesh import require_closed
from chipload.lazy import trimesh
from chipload.stock.earlier_moves import SAVED_MOVES, EarlierMoves, no_moves
from chipload.stock.shapes import read_shapes, shape_bytes
from chipload.stock.solid import prisms, stepped_body
from chipload.stock.tile_grid import (
    LAYER_LIMIT,
    MULTIPOLYGON,
    POLYGON,
    areas_alone,
    borders_of,
    bounds_of,
    boxes_of,
    cut_up,
    polygons,
    span,
    turns_of,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Shapes = NDArray[np.object_]

#: kind of a saved stock
KIND = "chipload layered stock 3"
#: arrays of a saved stock and their numbers of dimensions
SAVED = {"bounds": 1, "xs": 1, "ys": 1, "cut": 1, "vertices": 2, "faces": 2} | SAVED_MOVES
#: shortest side of a block [mm]
LEAST_MM = 1e-3


class LayeredStock:
    """A stock of solid layers from which polygons are removed.

    :meth:`remove`, :meth:`remove_many`, :meth:`refine`, :meth:`refine_at` and :meth:`restore` change the stock; the
    other methods only read it. Splitting layers shifts the numbers of those above. Polygons are never changed.

    Parameters
    ----------
    bounds : (n + 1,) float [mm], ascending
    xs, ys : (columns + 1,), (rows + 1,) float [mm], ascending: borders of the tiles
    tiles : (n, rows, columns) polygons, multipolygons or empty geometries, each within its tile
    part : closed mesh, sectioned again where layers are split from which nothing was removed

    Notes
    -----
    ``sections`` of the
    part by height [mm] are shared by copies and parts of a stock, which are split at the same heights again and again.
    ``earlier`` are the moves that cut the stock: its body is the part, or the box of its layers, less what they swept.
    None where nothing was removed, or where its layers are all that is known.

    Examples
    --------
    >>> stock = LayeredStock.block((0.0, 0.0, 0.0), (20.0, 10.0, 4.0), 2.0, 5.0)
    >>> [chip.area for chip in stock.remove(1, shapely.box(4.0, 4.0, 6.0, 30.0))]
    [12.0]
    >>> stock.volumes().tolist()
    [400.0, 376.0]
    """

    def __init__(
        self, bounds: Floats, xs: Floats, ys: Floats, tiles: Shapes, part: trimesh.Trimesh | None = None
    ) -> None:
        self.bounds = bounds
        self.xs, self.ys = xs, ys
        self.tiles = tiles
        self.part = part
        self.cut: NDArray[np.bool_] = np.zeros(len(tiles), dtype=np.bool_)
        self.earlier: EarlierMoves | None = None
        self.sections: dict[float, MultiPolygon] = {}

    @classmethod
    def block(cls, low: ArrayLike, high: ArrayLike, bounds_or_layer_mm: ArrayLike, tile_mm: float) -> LayeredStock:
        """Return a cuboid between the corners ``low`` and ``high`` (3,) [mm].

        Parameters
        ----------
        bounds_or_layer_mm : thickest layer [mm] (layers are equal), or (n + 1,) bounds from ``low`` to ``high``
        tile_mm : longest side of a tile [mm]; two to four cutter diameters

        Raises
        ------
        InputError
            A side is shorter than :data:`LEAST_MM`, or bounds do not ascend from the bottom to the top.
        """
        a, b = (np.asarray(corner, dtype=np.float64) for corner in (low, high))
        if a.shape != (3,) or b.shape != (3,) or not np.isfinite([a, b]).all() or not (b > a).all():
            raise InputError(f"stock: from {a.tolist()} to {b.tolist()} mm: each side must be above 0 and finite")
        if float((b - a).min()) < LEAST_MM:
            raise InputError(
                f"stock: {float((b - a).min()):g} mm from {a.tolist()} to {b.tolist()}: each side must be at least "
                f"{LEAST_MM:g} mm"
            )
        bounds = bounds_of(bounds_or_layer_mm, float(a[2]), float(b[2]))
        if bounds[0] != a[2] or bounds[-1] != b[2]:
            raise InputError(
                f"stock.bounds from {bounds[0]:g} to {bounds[-1]:g} mm: must be the block's, {a[2]:g} and {b[2]:g}"
            )
        xs, ys = borders_of(a[0], b[0], tile_mm), borders_of(a[1], b[1], tile_mm)
        boxes = boxes_of(xs, ys, len(bounds) - 1)
        tiles = np.empty((len(bounds) - 1, *boxes.shape), dtype=object)
        tiles[:] = boxes
        return cls(bounds, xs, ys, tiles)

    @classmethod
    def of_mesh(cls, mesh: trimesh.Trimesh, bounds_or_layer_mm: ArrayLike, tile_mm: float) -> LayeredStock:
        """Return the layers of a closed mesh, cut at their middles; the mesh is stored for :meth:`refine`.

        Parameters
        ----------
        bounds_or_layer_mm : thickest layer [mm] (layers are equal), or (n + 1,) bounds that hold the mesh
        tile_mm : longest side of a tile [mm]; two to four cutter diameters

        Raises
        ------
        InputError
            The mesh is not closed (with the number of open edges), or the bounds do not hold it.
        """
        if len(mesh.faces) == 0:
            raise InputError("stock: the mesh has no triangles")
        require_closed(mesh, "stock")
        part = trimesh.Trimesh(np.array(mesh.vertices), np.array(mesh.faces), process=False)
        (x0, y0, z0), (x1, y1, z1) = part.bounds
        bounds = bounds_of(bounds_or_layer_mm, float(z0), float(z1))
        # bounds of a mesh that was turned differ from its own by rounding
        rounding = 1e-9 * (z1 - z0)
        if bounds[0] > z0 + rounding or bounds[-1] < z1 - rounding:
            raise InputError(
                f"stock.bounds from {bounds[0]:g} to {bounds[-1]:g} mm: must hold the mesh, {z0:g} to {z1:g} mm"
            )
        xs, ys = borders_of(x0, x1, tile_mm), borders_of(y0, y1, tile_mm)
        boxes = boxes_of(xs, ys, len(bounds) - 1)
        return cls(bounds, xs, ys, cut_up(part, 0.5 * (bounds[:-1] + bounds[1:]), boxes, {}), part)

    @property
    def layers(self) -> int:
        """Number of layers n."""
        return len(self.tiles)

    @property
    def thickness(self) -> Floats:
        """(n,) float [mm]."""
        return np.diff(self.bounds)

    @property
    def heights(self) -> Floats:
        """(n,) float [mm]: the middle of each layer, at which its section lies."""
        return 0.5 * (self.bounds[:-1] + self.bounds[1:])

    def layers_between(self, z0: float, z1: float) -> range:
        """Return the layers that reach into the open interval z0 < z < z1 [mm]."""
        first = int(np.searchsorted(self.bounds, z0, "right")) - 1
        last = int(np.searchsorted(self.bounds, z1, "left"))
        return range(max(first, 0), max(min(last, self.layers), first, 0))

    def section(self, layer: int, low: ArrayLike | None = None, high: ArrayLike | None = None) -> MultiPolygon:
        """Return the remaining section of a layer; with ``low`` and ``high`` (2,) [mm] only under a rectangle."""
        tiles = self.tiles[self._layer(layer)]
        if low is not None and high is not None:
            (x0, y0), (x1, y1) = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
            i, j = span(self.xs.tolist(), x0, x1), span(self.ys.tolist(), y0, y1)
            tiles = tiles[j.start : j.stop, i.start : i.stop]
        return MultiPolygon(polygons(shapely.union_all(tiles.ravel())))

    def area(self, layer: int) -> float:
        """Return the remaining area of a layer [mm^2]."""
        return math.fsum(shapely.area(self.tiles[self._layer(layer)]).ravel())

    def volumes(self) -> Floats:
        """Return the remaining volume (n,) [mm^3] of each layer."""
        areas = shapely.area(self.tiles).reshape(self.layers, -1)
        return np.array([math.fsum(row) for row in areas]) * self.thickness

    def volume(self) -> float:
        """Return the remaining volume [mm^3]."""
        return math.fsum(self.volumes())

    def remove(self, layer: int, polygon: Polygon | MultiPolygon) -> list[Polygon]:
        """Remove a polygon from a layer and return the part that was removed, see :meth:`remove_many`."""
        return self.remove_many([layer], [polygon])[0]

    def remove_many(
        self, layers: Sequence[int] | Ints, shapes: Sequence[Polygon | MultiPolygon] | Shapes
    ) -> list[list[Polygon]]:
        """Remove polygon k from layer ``layers[k]``, for all k; in order if a layer occurs more than once.

        Returns
        -------
        For each k the removed pieces, joined over the tiles; an empty list if there are none. The removed and the
        remaining area add up to the previous area except for rounding. Pieces as thin as rounding are returned too.

        Raises
        ------
        InputError
            A layer does not exist, or a shape crosses itself or is not a polygon; nothing is removed.
        """
        rows = np.asarray(layers, dtype=np.int64)
        geometries = np.empty(len(shapes), dtype=object)
        geometries[:] = list(shapes)
        if rows.shape != geometries.shape:
            raise InputError(f"stock: {len(rows)} layers for {len(geometries)} polygons: one layer a polygon")
        for i in rows.tolist():
            self._layer(i)
        kind = shapely.get_type_id(geometries)
        if not (((kind == POLYGON) | (kind == MULTIPOLYGON)) & shapely.is_valid(geometries)).all():
            raise InputError("stock: a shape to remove is no polygon or crosses itself: repair it first")
        chips: list[list[Polygon]] = [[] for _ in rows]
        self.earlier = None
        for turn in turns_of(rows):
            self._remove_turn(turn, rows, geometries, chips)
        return chips

    def refine(self, z0: float, z1: float, layer_mm: float) -> None:
        """Split the layers that reach into z0 < z < z1 [mm] into equal ones until none is thicker than ``layer_mm``.

        A layer from which nothing was removed is cut from the mesh again at the new middles; where there is no mesh, or
        something was removed, the new layers get the polygons of the old one, and the volume does not change.
        """
        if not layer_mm > 0.0:
            raise InputError(f"stock.layer_mm = {layer_mm:g}: must be above 0")
        levels: list[float] = []
        split = self.layers_between(z0, z1)
        count = float(self.thickness[split.start : split.stop].sum()) / layer_mm
        if count > LAYER_LIMIT:
            raise InputError(
                f"stock.layer_mm = {layer_mm:g}: {count:.4g} layers: must be at most {LAYER_LIMIT}: state "
                "thicker layers"
            )
        for i in split:
            parts = math.ceil(self.thickness[i] / layer_mm * (1.0 - 1e-12))
            levels += np.linspace(self.bounds[i], self.bounds[i + 1], parts + 1)[1:-1].tolist()
        self._split(np.array(levels))

    def refine_at(self, levels: ArrayLike, within: float = 1e-9) -> None:
        """Make heights [mm] bounds of layers, as :meth:`refine` does; those ``within`` [mm] of a bound are left out."""
        fresh: list[float] = []
        for z in np.sort(np.asarray(levels, dtype=np.float64).ravel()).tolist():
            if self.bounds[0] < z < self.bounds[-1] and np.abs(np.array([*self.bounds, *fresh]) - z).min() > within:
                fresh.append(z)
        self._split(np.array(fresh))

    def _split(self, levels: Floats) -> None:
        """Add bounds."""
        if not len(levels):
            return
        bounds = np.sort(np.concatenate([self.bounds, levels]))
        heights = 0.5 * (bounds[:-1] + bounds[1:])
        parents = np.searchsorted(self.bounds, heights, "right") - 1
        boxes = boxes_of(self.xs, self.ys, len(heights))
        again = ~self.cut[parents] & (np.bincount(parents)[parents] > 1)
        self.bounds, self.cut = bounds, self.cut[parents]
        self.tiles = self.tiles[parents]
        if self.part is not None:
            self.tiles[again] = cut_up(self.part, heights[again], boxes, self.sections)

    def copied(self) -> LayeredStock:
        """Return a copy of the present stock; polygons are shared."""
        out = LayeredStock(self.bounds, self.xs, self.ys, self.tiles.copy(), self.part)
        out.cut = self.cut.copy()
        out.earlier, out.sections = self.earlier, self.sections
        return out

    def cropped(self, low: ArrayLike, high: ArrayLike) -> LayeredStock | None:
        """Return the part under a rectangle between ``low`` and ``high`` (2,) [mm] as a stock of its own; None: the
        rectangle does not overlap the tiles.
        """
        (x0, y0), (x1, y1) = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
        x0, y0 = max(x0, float(self.xs[0])), max(y0, float(self.ys[0]))
        x1, y1 = min(x1, float(self.xs[-1])), min(y1, float(self.ys[-1]))
        if not (x1 > x0 and y1 > y0):
            return None
        i, j = span(self.xs.tolist(), x0, x1), span(self.ys.tolist(), y0, y1)
        some = self.tiles[:, j.start : j.stop, i.start : i.stop]
        flat = shapely.union_all(shapely.intersection(some.reshape(len(some), -1), shapely.box(x0, y0, x1, y1)), axis=1)
        tiles = np.empty((len(some), 1, 1), dtype=object)
        tiles[:, 0, 0] = [MultiPolygon(polygons(shape)) for shape in flat.tolist()]
        out = LayeredStock(self.bounds, np.array([x0, x1]), np.array([y0, y1]), tiles, self.part)
        out.cut = self.cut.copy()
        out.sections = self.sections
        return out

    def body(self) -> trimesh.Trimesh:
        """Return the stock as one closed mesh [mm]: the mesh or block itself if nothing was removed yet."""
        if self.part is not None and not self.cut.any():
            return self.part
        low, high = ([float(axis[k]) for axis in (self.xs, self.ys, self.bounds)] for k in (0, -1))
        whole = math.prod(b - a for a, b in zip(low, high, strict=True))
        return self.mesh() if self.volume() < whole * (1.0 - 1e-12) else trimesh.creation.box(bounds=[low, high])

    def exposed_body(self) -> trimesh.Trimesh:
        """Return the remaining stock as a mesh [mm] without the faces that two layers share."""
        return stepped_body([self.section(i) for i in range(self.layers)], self.bounds)

    def mesh(self) -> trimesh.Trimesh:
        """Return the remaining stock as one closed mesh [mm] of a prism for each layer, z up."""
        return prisms([polygons(self.section(i)) for i in range(self.layers)], self.bounds)

    def state(self) -> tuple[Floats, Shapes, NDArray[np.bool_], EarlierMoves | None]:
        """Return the state with which :meth:`restore` undoes all later changes."""
        return self.bounds, self.tiles.copy(), self.cut.copy(), self.earlier

    def restore(self, state: tuple[Floats, Shapes, NDArray[np.bool_], EarlierMoves | None]) -> None:
        """Restore the stock to a state."""
        self.bounds, self.tiles, self.cut = state[0], state[1].copy(), state[2].copy()
        self.earlier = state[3]

    def save(self, path: str | Path) -> None:
        """Write the stock to one ``.npz`` file, completely or not at all."""
        write_whole(path, self.to_bytes())

    def to_bytes(self) -> bytes:
        """Return the stock as the bytes of a ``.npz`` file."""
        part = self.part
        vertices = np.zeros((0, 3)) if part is None else np.asarray(part.vertices, dtype=np.float64)
        faces = np.zeros((0, 3), dtype=np.int64) if part is None else np.asarray(part.faces, dtype=np.int64)
        arrays = {"bounds": self.bounds, "xs": self.xs, "ys": self.ys, "cut": self.cut}
        arrays |= no_moves() if self.earlier is None else self.earlier.arrays()
        return shape_bytes(KIND, arrays | {"vertices": vertices, "faces": faces}, areas_alone(self.tiles.ravel()))

    @classmethod
    def load(cls, path: str | Path) -> LayeredStock:
        """Read a file of :meth:`save`; the stock is equal to the saved one, bit for bit.

        Raises
        ------
        InputError
            The file is missing, damaged, or holds something else.
        """
        a, tiles = read_shapes(path, KIND, SAVED)
        axes = (a["bounds"], a["xs"], a["ys"])
        shape = (len(a["bounds"]) - 1, len(a["ys"]) - 1, len(a["xs"]) - 1)
        vertices, faces = a["vertices"], a["faces"]
        if (
            min(shape) < 1
            or not all(np.isfinite(v).all() and (np.diff(v) > 0.0).all() for v in axes)
            or len(tiles) != math.prod(shape)
            or a["cut"].shape != shape[:1]
            or vertices.shape[1] != 3
            or faces.shape[1] != 3
            or (len(faces) > 0 and not (faces.min() >= 0 and faces.max() < len(vertices)))
        ):
            raise InputError(f"stock.file = {Path(path).name}: damaged: its parts do not fit each other")
        damaged = InputError(f"stock.file = {Path(path).name}: damaged: its moves do not fit each other")
        try:
            earlier = EarlierMoves.from_arrays(a)
        except ValueError:
            raise damaged from None
        part = trimesh.Trimesh(vertices, faces.astype(np.int64), process=False) if len(faces) else None
        stock = cls(axes[0], axes[1], axes[2], tiles.reshape(shape), part)
        stock.cut = a["cut"].astype(np.bool_)
        stock.earlier = earlier
        return stock

    def _remove_turn(self, turn: Ints, rows: Ints, geometries: Shapes, chips: list[list[Polygon]]) -> None:
        """Remove the shapes numbered ``turn``, each from a different layer."""
        k, row, j, i = self._tiles_under(turn, rows, geometries)
        which = list(zip(k.tolist(), row.tolist(), j.tolist(), i.tolist(), strict=True))
        # layers with the same removals so far share their tiles; equal pairs of tile and shape are cut once
        seen: dict[tuple[int, int], int] = {}
        before, shape, same = [], [], []
        for tile, cutting in zip(self.tiles[row, j, i].tolist(), geometries[k].tolist(), strict=True):
            key = (id(tile), id(cutting))
            if key not in seen:
                seen[key] = len(seen)
                before.append(tile)
                shape.append(cutting)
            same.append(seen[key])
        if not before:
            return
        old, new = np.array(before, dtype=object), np.array(shape, dtype=object)
        parts, pair = shapely.get_parts(shapely.intersection(old, new), return_index=True)
        solid = (shapely.get_type_id(parts) == POLYGON) & (shapely.area(parts) > 0.0)
        pieces: list[list[Polygon]] = [[] for _ in before]
        for n, part in zip(pair[solid].tolist(), parts[solid].tolist(), strict=True):
            pieces[n].append(part)
        hit = [n for n, found in enumerate(pieces) if found]
        left = dict(zip(hit, areas_alone(shapely.difference(old[hit], new[hit])).tolist(), strict=True))
        cut = [(at, n) for at, n in zip(which, same, strict=True) if n in left]
        if cut:
            row, j, i = np.array([at[1:] for at, _ in cut], dtype=np.int64).T
            self.tiles[row, j, i] = [left[n] for _, n in cut]
            self.cut[row] = True
        groups: dict[int, list[int]] = {}
        for (at, *_), n in cut:
            groups.setdefault(at, []).append(n)
        joined: dict[tuple[int, ...], list[Polygon]] = {}
        for at, several in groups.items():
            alike = tuple(several)
            if alike not in joined:
                flat = [p for n in several for p in pieces[n]]
                joined[alike] = flat if len(several) == 1 else polygons(shapely.union_all(flat))
            chips[at] = list(joined[alike])

    def _tiles_under(self, turn: Ints, rows: Ints, geometries: Shapes) -> tuple[Ints, Ints, Ints, Ints]:
        """Shape, layer, row and column of each tile whose bounding box overlaps that of a shape numbered ``turn``.

        An empty tile has no bounding box.
        """
        x0, y0, x1, y1 = shapely.bounds(geometries[turn]).reshape(-1, 4).T
        i0, j0 = (np.maximum(np.searchsorted(b, low, "right") - 1, 0) for b, low in ((self.xs, x0), (self.ys, y0)))
        i1, j1 = (
            np.minimum(np.searchsorted(b, high, "left"), len(b) - 1) for b, high in ((self.xs, x1), (self.ys, y1))
        )
        some = (x1 > x0) & (y1 > y0)
        wide, tall = (np.where(some, np.maximum(b - a, 0), 0) for a, b in ((i0, i1), (j0, j1)))
        count = wide * tall
        of = np.repeat(np.arange(len(turn)), count)
        at = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
        layer, j, i = rows[turn][of], j0[of] + at // wide[of], i0[of] + at % wide[of]
        a0, b0, a1, b1 = shapely.bounds(self.tiles[layer, j, i]).reshape(-1, 4).T
        near = (a0 < x1[of]) & (a1 > x0[of]) & (b0 < y1[of]) & (b1 > y0[of])
        return turn[of][near], layer[near], j[near], i[near]

    def _layer(self, layer: int) -> int:
        if not 0 <= layer < self.layers:
            raise InputError(f"stock: layer {layer}: must be from 0 to {self.layers - 1}")
        return layer
