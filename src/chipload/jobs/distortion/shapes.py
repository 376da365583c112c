"""What is left of the blank after each setup, in layers.

Notation: a setup mills one side, z+ or z-, and leaves a stock a on the part. Then all is left that the part, grown by
a, covers as seen from that side, and nothing else. The part grows by a in the plane and along z.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.mesh import sections
from chipload.geometry.pocketed_part import distinct_levels, level_faces
from chipload.lazy import trimesh
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]

#: layers over the longest side of the part where its section changes with the height
LAYERS = 60
#: share of a section that may differ between the ends of one layer
ALIKE = 1e-4
#: distance of two levels that are one [mm]
ONE = 1e-4
#: distance [mm] off a face at which is asked whether it is cut free
OFF = 0.02


@dataclass(frozen=True)
class SideCut:
    """What a setup mills.

    Parameters
    ----------
    side : "z+" or "z-"
    stock : left on the part [mm]
    """

    side: str
    stock: float


@dataclass(frozen=True, eq=False)
class PartLayers:
    """Sections of the part in the layers of its blank.

    Attributes
    ----------
    low, high : (3,) float [mm] corners of the blank
    bounds : (n + 1,) float [mm]
    shapes : (n,) sections of the part; empty above and below it
    """

    low: Floats
    high: Floats
    bounds: Floats
    shapes: tuple[shapely.Geometry, ...]

    def blank(self) -> list[shapely.Geometry]:
        """Sections of the blank."""
        return [shapely.box(*self.low[:2], *self.high[:2])] * len(self.shapes)

    def after(self, before: Sequence[shapely.Geometry], cut: SideCut) -> list[shapely.Geometry]:
        """Sections of what a setup leaves of those before it."""
        n, out = len(self.shapes), list(before)
        order = range(n - 1, -1, -1) if cut.side == "z+" else range(n)
        cover: shapely.Geometry = shapely.Polygon()
        grown: shapely.Geometry = cover
        j = order[0]
        for i in order:
            changed = False
            # all that stands above (below) the far end of this layer, moved by the stock
            while 0 <= j < n and self._covers(i, j, cut):
                if not self.shapes[j].is_empty and not cover.covers(self.shapes[j]):
                    cover, changed = cover.union(self.shapes[j]), True
                j += -1 if cut.side == "z+" else 1
            if changed:
                grown = cover.buffer(cut.stock, join_style="mitre") if cut.stock > 0.0 else cover
            out[i] = before[i].intersection(grown)
        return out

    def _covers(self, i: int, j: int, cut: SideCut) -> bool:
        if cut.side == "z+":
            return bool(self.bounds[j + 1] > self.bounds[i] - cut.stock + ONE)
        return bool(self.bounds[j] < self.bounds[i + 1] + cut.stock - ONE)

    def stock(self, shapes: Sequence[shapely.Geometry]) -> LayeredStock:
        """Layers of sections, from the lowest to the highest that holds material; equal ones share one geometry."""
        tiles = np.empty((len(shapes), 1, 1), dtype=object)
        last: shapely.Geometry | None = None
        for i, shape in enumerate(shapes):
            made = _solid(shape)
            if last is None or not _same(last, made):
                last = made
            tiles[i, 0, 0] = last
        xs, ys = (np.array([self.low[d], self.high[d]]) for d in (0, 1))
        full = np.flatnonzero([not shape.is_empty for shape in tiles[:, 0, 0]])
        first, last_layer = (int(full[0]), int(full[-1])) if len(full) else (0, len(tiles) - 1)
        bounds = self.bounds[first : last_layer + 2].copy()
        return LayeredStock(bounds, xs, ys, tiles[first : last_layer + 1])


def _solid(shape: shapely.Geometry) -> shapely.Geometry:
    """The areas of a geometry, without the slivers and edges that intersections leave."""
    parts = [p for p in shapely.get_parts(shape) if p.geom_type == "Polygon" and p.area > ONE]
    return shapely.MultiPolygon(parts) if len(parts) != 1 else parts[0]


def _same(one: shapely.Geometry, other: shapely.Geometry) -> bool:
    return bool(shapely.equals_exact(one, other, 1e-9)) or one.symmetric_difference(other).area <= 1e-9 * one.area


def part_layers(mesh: trimesh.Trimesh, low: Floats, high: Floats, stocks: Sequence[float]) -> PartLayers:
    """Layers of the blank between the corners ``low`` and ``high`` of a part.

    Parameters
    ----------
    stocks : [mm] that setups leave, at whose heights above and below level faces layers end

    Raises
    ------
    InputError
        The part stands out of the blank.
    """
    for axis, a, b, x, y in zip("xyz", low, high, *mesh.bounds, strict=True):
        if x < a - ONE or y > b + ONE:
            raise InputError(
                f"part: from {axis} = {x:.6g} to {y:.6g} mm, stands out of the stock, {a:.6g} to {b:.6g} mm: move it, "
                "or state a larger stock"
            )
    levels = level_faces(mesh)
    cuts = [low[2], high[2], *(z + s for z in levels for a in (0.0, *stocks) for s in (a, -a))]
    bounds = distinct_levels(np.clip(np.array(cuts, dtype=np.float64), low[2], high[2]))
    thickest = float(np.ptp(mesh.bounds, axis=0).max()) / LAYERS
    out = [bounds[0]]
    for a, b in pairwise(bounds.tolist()):
        ends = sections(mesh, [a + 0.02 * (b - a), b - 0.02 * (b - a)])
        differs = ends[0].symmetric_difference(ends[1]).area > ALIKE * max(ends[0].area, ends[1].area)
        count = math.ceil((b - a) / thickest) if differs else 1
        out += np.linspace(a, b, count + 1)[1:].tolist()
    edges = np.array(out)
    shapes = tuple(s.simplify(ONE) for s in sections(mesh, 0.5 * (edges[1:] + edges[:-1])))
    return PartLayers(np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64), edges, shapes)
