"""A floor of a part, named by a level face of its model: its box, its outline and the walls around it.

Notation: x, y [mm] along the sides of the smallest box around the floor, from its corner, z over it; u, v = x, y over
the size of the box; D [mm] stock that is left. The normal is +z, that of the part's frame.

Places of the box that lie outside the floor stand for the nearest place on it. The walls around it are what the part
has above the floor, by its sections at several heights: the centre of the cutter keeps its radius at that height from
each. At edges without a wall rows run on beyond the edge.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely import MultiLineString, MultiPolygon, Polygon

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.geometry.mesh import sections
from chipload.geometry.step_faces import Face
from chipload.lazy import scipy, trimesh
from chipload.planning.thinwall.floor_rows import FloorArea
from chipload.stock.solid import prisms

Floats = NDArray[np.float64]

#: facets within this height [mm] of the floor and looking up are the floor
FLAT = 1e-4
#: the area of the facets may differ from that of the face by this share, for chords of its edges
AREA = 0.02
#: the lowest section of the walls is so far over the floor [mm], others are so far apart
LOWEST, APART = 1e-3, 1.0
#: sections through the height of a corner radius
CORNER = 6
#: rows run beyond an edge without a wall by the radius and so many [mm]
BEYOND = 1.0
#: how far stock reaches into the metal [mm], and its pieces along and across
INSIDE, PIECES = 0.05, (24, 24)
#: how far stock reaches into the walls, and to which the area of centres is rounded [mm]
OVERLAP, ROUNDED = 1e-6, 1e-6
#: segments of a quarter of a circle around a corner of a wall: within 0.4 µm for a radius of 5 mm
QUARTER = 64
#: points about the axis at which the force of the teeth may act
ROUND = 8


@dataclass(frozen=True, eq=False)
class PartFloor:
    """A floor that is cut.

    Attributes
    ----------
    name : of its face
    wall : its number among the walls of the job
    allowance : [mm]
    origin, along, across : (3,) corner of its box [mm], unit vectors of x and y
    box : size along x and y [mm]
    face : its outline in x and y
    walls : (height over the floor [mm], section of the part in x and y), rising
    """

    name: str
    wall: int
    allowance: float
    origin: Floats
    along: Floats
    across: Floats
    box: tuple[float, float]
    face: Polygon
    walls: tuple[tuple[float, MultiPolygon], ...]

    def size(self) -> tuple[float, float]:
        """Length of its box along x and along y [mm]."""
        return self.box

    def at(self, u: Floats, v: Floats) -> Floats:
        """Points (n, 3) [mm] of the plane."""
        return np.asarray(self.origin + np.outer(u * self.box[0], self.along) + np.outer(v * self.box[1], self.across))

    def normal(self, u: Floats, v: Floats) -> Floats:
        """Normals (n, 3): up."""
        return np.tile([0.0, 0.0, 1.0], (len(u), 1))

    def parameters(self, points: Floats) -> Floats:
        """Parameters (n, 2) of points (n, 3) [mm], of what lies below or above them."""
        off = points - self.origin
        return np.column_stack([off @ self.along / self.box[0], off @ self.across / self.box[1]])

    def on(self, xy: Floats, margin: float = 0.0) -> Floats:
        """The nearest places (n, 2) [mm] on the floor, ``margin`` within its outline."""
        return _nearest_points(self.face.buffer(-margin) if margin else self.face, xy)

    def on_part(self, reach: shapely.Geometry, xy: Floats) -> Floats:
        """The nearest places (n, 2) [mm] on what a cutter reaches of the floor."""
        return _nearest_points(self.face.intersection(reach), xy)

    def reached(self, u: ArrayLike, v: ArrayLike, area: FloorArea, radius: float) -> Floats:
        """Parameters (k, n, 2) of places on the floor at which a cutter may press that stands over places (n,).

        Its centre is the nearest one of its area; the force of its teeth acts on a circle about that.
        """
        xy = _nearest_points(area.centres, np.column_stack([np.asarray(u) * self.box[0], np.asarray(v) * self.box[1]]))
        angle = np.arange(ROUND) * (math.tau / ROUND)
        ring = radius * np.column_stack([np.cos(angle), np.sin(angle)])
        around = xy + np.concatenate([np.zeros((1, 2)), ring])[:, None]
        return np.asarray(self.on(around.reshape(-1, 2)).reshape(around.shape) / self.box)

    def area(self, cutter: Cutter, spacing: float, ramp: float) -> FloorArea:
        """Where a cutter may go; ``spacing`` [mm] of its points, ``ramp`` [rad] of its entries."""
        cover = self.face.buffer(cutter.radius + BEYOND)
        kept = [_grown_area(s, _radius(cutter, h)) for h, s in self.walls if not s.is_empty]
        centres = cover.difference(shapely.union_all(kept)) if kept else cover
        # sections alike but for rounding leave edges of no length
        centres = shapely.make_valid(shapely.set_precision(centres, ROUNDED))
        centres = MultiPolygon([p for p in shapely.get_parts(centres) if p.geom_type == "Polygon" and p.area > 0.0])
        # a separate room next to the floor does not belong to it
        centres = MultiPolygon([p for p in centres.geoms if p.intersects(self.face)])
        if centres.intersection(self.face).is_empty:
            raise InputError(
                f"cutter {cutter.number}: diameter_mm = {cutter.diameter:g}: fits nowhere between the walls of face "
                f"{self.name}: choose a smaller one"
            )
        walls = _walls(centres, self.face)
        return FloorArea(self.origin, self.along, self.across, self.box, self.face, centres, walls, spacing, ramp)

    def stock(self, places: tuple[Floats, Floats], left: Floats) -> trimesh.Trimesh:
        """Its stock as closed prisms over the pieces of a grid, as high as D in the middle of each.

        Parameters
        ----------
        places : (n,) u, (m,) v
        left : (n, m) D [mm]
        """
        z0 = float(self.origin[2])
        if float(np.ptp(left)) == 0.0:
            return self._prisms([self._within], np.full(1, float(left.flat[0])), z0)
        pieces = [p for p, _ in self._grid_prisms]
        middle = np.array([c for _, c in self._grid_prisms])
        return self._prisms(pieces, np.asarray(scipy.interpolate.RegularGridInterpolator(places, left)(middle)), z0)

    @cached_property
    def _within(self) -> Polygon:
        """Outline of the stock, which is one with the walls."""
        return self.face.buffer(OVERLAP, join_style="mitre")

    @cached_property
    def _grid_prisms(self) -> list[tuple[Polygon, tuple[float, float]]]:
        """Pieces of the outline on a grid over the box, and the parameters of their middles."""
        x, y = (np.linspace(-OVERLAP, size + OVERLAP, k + 1) for size, k in zip(self.box, PIECES, strict=True))
        out = []
        for a, b in pairwise(x):
            for c, d in pairwise(y):
                parts = shapely.get_parts(self._within.intersection(shapely.box(a, c, b, d)))
                at = (float(0.5 * (a + b) / self.box[0]), float(0.5 * (c + d) / self.box[1]))
                out += [(p, at) for p in parts.tolist() if p.geom_type == "Polygon" and p.area > 0.0]
        return out

    def _prisms(self, pieces: Sequence[Polygon], heights: Floats, z0: float) -> trimesh.Trimesh:
        """Prisms over pieces [mm], in the frame of the part."""
        made = []
        for piece, height in zip(pieces, heights.tolist(), strict=True):
            made.append(prisms([[self._in_part(piece)]], np.array([z0 - INSIDE, z0 + height])))
        whole = trimesh.util.concatenate(made)
        return trimesh.Trimesh(whole.vertices, whole.faces, process=False)

    def _in_part(self, shape: Polygon) -> Polygon:
        """A polygon of x, y in the frame of the part."""
        axes = np.stack([self.along[:2], self.across[:2]])
        return shapely.transform(shape, lambda xy: xy @ axes + self.origin[:2])


def floor_of(face: Face, key: str, part: trimesh.Trimesh, wall: int, allowance: float) -> PartFloor:
    """A level face of a part as a floor.

    Raises
    ------
    InputError
        The face is not level, or looks down.
    """
    level = float(face.high[2])
    if face.kind != "plane" or level - float(face.low[2]) > FLAT:
        raise InputError(
            f"{key}: face {face.number} is not a level face ({face.kind}, z from {face.low[2]:.6g} to {level:.6g} mm): "
            "contact = end cuts floors: state a level face, z up, or contact = corner for the side of a wall"
        )
    outline = _outline(face, key, part, level)
    along, across, origin = _box(outline)
    axes = np.stack([along[:2], across[:2]])
    low = np.array([*origin, level])

    def in_plane(shape: MultiPolygon | Polygon) -> MultiPolygon | Polygon:
        return shapely.transform(shape, lambda xy: (xy - origin) @ axes.T)

    mine = in_plane(outline)
    x0, y0, x1, y1 = mine.bounds
    top = float(part.bounds[1][2]) - level
    heights = _heights(top)
    cut = sections(part, level + heights) if len(heights) else []
    walls = tuple((float(h), in_plane(s)) for h, s in zip(heights, cut, strict=True))
    return PartFloor(f"{face.number}", wall, allowance, low, along, across, (x1 - x0, y1 - y0), mine, walls)


def _heights(top: float) -> Floats:
    """Heights over the floor at which walls are cut, below ``top``: dense near the floor, where corners are round."""
    fine = LOWEST + (APART - LOWEST) * np.linspace(0.0, 1.0, CORNER) ** 2
    all_heights = np.concatenate([fine, np.arange(2.0 * APART, top, APART), [top - LOWEST]])
    return np.unique(all_heights[(all_heights > 0.0) & (all_heights < top)])


def _radius(cutter: Cutter, height: float) -> float:
    """Greatest radius [mm] of the turning cutter, shank and holder apart, up to a height of the part's section."""
    return float(cutter.radius_at([min(height, cutter.flute_length)])[0])


def _grown_area(shape: MultiPolygon | Polygon, radius: float) -> shapely.Geometry:
    """What lies within a radius [mm] of an area: the area and what lies within the radius of each of its edges.

    The offset of whole rings would lose or move corners where a ring has a vertex on a straight edge near a corner.
    """
    lines = [shapely.get_coordinates(ring) for part in shapely.get_parts(shape) for ring in shapely.get_rings(part)]
    edges = shapely.linestrings(np.concatenate([np.stack([c[:-1], c[1:]], axis=1) for c in lines]))
    return shapely.union_all([shape, *shapely.buffer(edges, radius, quad_segs=QUARTER)])


def _outline(face: Face, key: str, part: trimesh.Trimesh, level: float) -> Polygon:
    """Outline of a level face by the facets of the part."""
    corners = np.asarray(part.vertices)[np.asarray(part.faces)]
    flat = (np.abs(corners[:, :, 2] - level) <= FLAT).all(axis=1) & (np.asarray(part.face_normals)[:, 2] > 0.5)
    flat &= (corners[:, :, :2] >= face.low[:2] - FLAT).all(axis=(1, 2))
    flat &= (corners[:, :, :2] <= face.high[:2] + FLAT).all(axis=(1, 2))
    pieces = shapely.get_parts(shapely.union_all([Polygon(t) for t in corners[flat][:, :, :2]], grid_size=1e-7))
    boxes = np.array([p.bounds for p in pieces.tolist()]).reshape(-1, 4)
    wanted = np.concatenate([face.low[:2], face.high[:2]])
    fits = [p for p, b in zip(pieces.tolist(), boxes, strict=True) if np.abs(b - wanted).max() < 0.05]
    if len(fits) != 1 or abs(fits[0].area / face.area - 1.0) > AREA:
        raise InputError(
            f"{key}: face {face.number} looks down, or its facets do not make one outline: state a level face that "
            "looks up"
        )
    found: Polygon = fits[0]
    return found


def _box(outline: Polygon) -> tuple[Floats, Floats, Floats]:
    """Unit vectors along and across the smallest box around an outline, and its corner (2,) [mm].

    The longer side is x; boxes along the axes of the part stay as they are.
    """
    x0, y0, x1, y1 = outline.bounds
    turned = shapely.minimum_rotated_rectangle(outline)
    if turned.area > (1.0 - 1e-6) * (x1 - x0) * (y1 - y0):
        corner, e = np.array([x0, y0]), np.array([1.0, 0.0])
        sizes = (x1 - x0, y1 - y0)
    else:
        c = shapely.get_coordinates(turned)[:3]
        if not shapely.is_ccw(shapely.get_exterior_ring(turned)):
            c = c[::-1]
        corner, e = c[0], (c[1] - c[0]) / np.linalg.norm(c[1] - c[0])
        sizes = (float(np.linalg.norm(c[1] - c[0])), float(np.linalg.norm(c[2] - c[1])))
    left = np.array([-e[1], e[0]])
    if sizes[1] > sizes[0]:  # turned by a quarter: the other corner of the short side
        corner, e, left = corner + sizes[0] * e, left, -e
    return np.array([*e, 0.0]), np.array([*left, 0.0]), corner


def _nearest_points(shape: Polygon | MultiPolygon, xy: Floats) -> Floats:
    """The nearest points (n, 2) of a shape."""
    points = shapely.points(xy)
    off = ~shapely.intersects(shape, points)
    out = np.array(xy, dtype=np.float64)
    if off.any():
        lines = shapely.shortest_line(shape, points[off])
        out[off] = shapely.get_coordinates(lines)[::2]
    return out


def _walls(centres: MultiPolygon, face: Polygon) -> MultiLineString:
    """Boundary of the centres' area within the floor, with the area on the left of each line."""
    out = []
    for p in centres.geoms:
        for ring in (p.exterior, *p.interiors):
            lines = shapely.get_parts(shapely.LineString(ring.coords).intersection(face)).tolist()
            out += [line if _on_left(line, p) else line.reverse() for line in lines if line.length > FLAT]
    return MultiLineString(out)


def _on_left(line: shapely.LineString, p: Polygon) -> bool:
    """Whether an area lies on the left of a piece of its boundary."""
    a, b = shapely.get_coordinates(line)[:2]
    left = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a)
    return bool(p.contains(shapely.Point(0.5 * (a + b) + 10.0 * FLAT * left)))
