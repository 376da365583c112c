"""Pockets of a part that is milled from above: their floors, depths, corners and open sides.

Notation: the part is cut into slabs at its level faces. What is free above a slab is the silhouette of the part less
all material in the slab and above it. A floor is what is free above a slab, but not above the one below. Its
corner radius is that of the largest circle that reaches all of the free area around it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.geometry.mesh import sections
from chipload.lazy import trimesh

Floats = NDArray[np.float64]

#: greatest slope of a face that counts as level, and distance of two levels that are one [mm]
LEVEL, ONE = 1e-6, 1e-4
#: least share of the silhouette that a floor covers
LEAST_FLOOR = 0.005
#: [mm^2] piece of a corner that counts as not reached, share to which its radius is found, radius of sharp corners [mm]
PIECE, FINE, SHARP = 0.02, 2e-3, 0.35
#: [mm] distance of a free area from the silhouette's edge at which it is open to that side
OPEN = 0.01


@dataclass(frozen=True)
class Pocket:
    """A pocket: height of its floor, depth, area of its floor, radius of its corners, whether a side is open, thickness
    of its floor (0: it goes through), and outline of its floor.
    """

    floor_mm: float
    depth_mm: float
    area_mm2: float
    corner_mm: float
    open: bool
    floor_thickness_mm: float = 0.0
    outline: shapely.Polygon = field(default_factory=shapely.Polygon, compare=False, repr=False)


@dataclass(frozen=True, eq=False)
class Slabs:
    """A part between its level faces.

    Attributes
    ----------
    levels : (n + 1,) float [mm], heights of its level faces, rising
    material : section of the part in each slab
    free : what is free above each slab, and in it, within the silhouette
    whole : silhouette
    """

    levels: Floats
    material: tuple[shapely.Geometry, ...]
    free: tuple[shapely.Geometry, ...]
    whole: shapely.Geometry


def level_faces(mesh: trimesh.Trimesh) -> Floats:
    """Heights [mm] of the level faces of a mesh, rising."""
    level = np.abs(mesh.face_normals[:, 2]) > 1.0 - LEVEL
    return distinct_levels(np.asarray(mesh.triangles[level][:, 0, 2], dtype=np.float64))


def distinct_levels(values: Floats) -> Floats:
    """Values in their order, those nearer than :data:`ONE` once."""
    v = np.sort(values)
    return v[np.concatenate([[True], np.diff(v) > ONE])] if len(v) else v


def slabs_of(mesh: trimesh.Trimesh) -> Slabs | None:
    """A part between its level faces; None: it has fewer than three heights of them."""
    levels = level_faces(mesh)
    if len(levels) < 3:
        return None
    material = [shapely.union_all([s]) for s in sections(mesh, 0.5 * (levels[1:] + levels[:-1]))]
    whole = shapely.union_all(material)
    free: list[shapely.Geometry] = []
    above: shapely.Geometry = shapely.Polygon()
    for slab in reversed(material):
        above = above.union(slab)
        free.append(whole.difference(above))
    return Slabs(levels, tuple(material), tuple(reversed(free)), whole)


def find_pockets(mesh: trimesh.Trimesh) -> tuple[Pocket, ...]:
    """Pockets of a part, the deepest first, then the largest.

    Examples
    --------
    >>> block = trimesh.creation.box(bounds=[(0, 0, 0), (40, 20, 10)])
    >>> find_pockets(block)
    ()
    """
    slabs = slabs_of(mesh)
    if slabs is None:
        return ()
    levels, free, whole = slabs.levels, slabs.free, slabs.whole
    top, out = float(mesh.bounds[1, 2]), list[Pocket]()
    for k in range(1, len(free)):
        for floor in _areas(free[k].difference(free[k - 1]), LEAST_FLOOR * whole.area):
            point = floor.representative_point()
            around = next((a for a in _areas(free[k], 0.0) if a.intersects(point)), floor)
            open_side = around.distance(whole.boundary) < OPEN
            z = float(levels[k])
            under = z - next(
                (float(levels[j + 1]) for j in range(k - 1, -1, -1) if not slabs.material[j].covers(point)),
                float(levels[0]),
            )
            corner = _corner_radius(around, whole)
            out.append(Pocket(z, top - z, float(floor.area), corner, bool(open_side), under, floor))
    return tuple(sorted(out, key=lambda p: (p.floor_mm, -p.area_mm2)))


def _areas(shape: shapely.Geometry, least: float) -> list[shapely.Polygon]:
    """Polygons of a shape with more than an area, without the slivers of facets."""
    parts = shapely.get_parts(shape.buffer(-OPEN, join_style="mitre").buffer(OPEN, join_style="mitre"))
    return [p for p in parts if p.geom_type == "Polygon" and p.area > least]


def _corner_radius(area: shapely.Polygon, whole: shapely.Geometry) -> float:
    """Radius [mm] of the largest circle that reaches all of an area, running out over its open sides; 0: sharp corners.

    A corner of radius R that a circle of radius r does not reach is a piece of 0.215 (r^2 - R^2) at a right angle;
    facets leave pieces that are far smaller than :data:`PIECE`.
    """
    size = float(np.ptp(np.reshape(whole.bounds, (2, 2)), axis=0).max())
    beyond = shapely.box(*whole.bounds).buffer(size, join_style="mitre").difference(whole)
    room = area.union(beyond) if area.distance(whole.boundary) < OPEN else area
    low, high = 0.0, 0.5 * float(np.ptp(np.reshape(area.bounds, (2, 2)), axis=0).min())
    while high - low > FINE * high and high > SHARP:
        r = 0.5 * (low + high)
        lost = shapely.get_parts(area.difference(room.buffer(-r, quad_segs=64).buffer(r, quad_segs=64)))
        reached = max(shapely.area(lost), default=0.0) <= PIECE
        low, high = (r, high) if reached else (low, r)
    return low if low > SHARP else 0.0
