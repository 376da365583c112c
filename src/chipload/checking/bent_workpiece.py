"""The workpiece in the step with the greatest deflection, and the support that would reduce it most.

The force is the greatest of that step at the programmed feed, along the mean of its revolution. Supports are tried one
at a time on upright surfaces, :data:`JACK` stiff along the normal, no nearer to the contact than the cutter's diameter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.stock.layers import LayeredStock
from chipload.stock.solid import prisms
from chipload.stock.tile_grid import polygons
from chipload.structure.cells.nearest import StockSections
from chipload.structure.cells.support import support_line
from chipload.structure.cells.workpiece import CellWorkpiece, displacements

Floats = NDArray[np.float64]

#: stiffness of a support [N/mm]
JACK = 1e4
#: supports that are tried, heights of their places over the height of the stock
PLACES, HEIGHTS = 60, (0.25, 0.5, 0.75, 0.97)
#: longest side of a drawn triangle over the longest side of the stock
SIDE = 0.04


@dataclass(frozen=True, eq=False)
class BentWorkpiece:
    """The deformed workpiece in the step with its greatest deflection, and the best place for a support.

    Attributes
    ----------
    step : row of the history
    line : (2, 3) float [mm], where the cutter touches it
    force : (3,) float [N] on the workpiece
    points, faces : of the surface
    moved : (n, 3) float [mm], displacement of the points
    place, normal : (3,) float, where a support helps most [mm], and its direction
    before, after : [mm] deflection at the contact without and with it
    """

    step: int
    line: Floats
    force: Floats
    points: Floats
    faces: NDArray[np.int64]
    moved: Floats
    place: Floats
    normal: Floats
    before: float
    after: float


def bent_workpiece(
    work: CellWorkpiece, stock: LayeredStock, step: int, line: Floats, force: Floats, diameter: float
) -> BentWorkpiece:
    """Return the deformation of a state of the workpiece under a force on a contact line, and the best support."""
    sections = StockSections(stock)
    parts = [polygons(shape) for shape in sections.shapes]
    bodies = [prisms([part], np.array(ends)) for part, *ends in zip(parts, sections.low, sections.high, strict=True)]
    size = SIDE * float((work.grid.high - work.grid.low).max())
    whole = [body.subdivide_to_size(size, max_iter=12) for body in bodies]
    points = np.concatenate([np.asarray(body.vertices) for body in whole])
    first = np.cumsum([0, *(len(body.vertices) for body in whole)])[:-1]
    faces = np.concatenate([np.asarray(body.faces) + k for body, k in zip(whole, first.tolist(), strict=True)])
    points, back = np.unique(points.round(6), axis=0, return_inverse=True)
    faces = back.ravel()[faces].astype(np.int64)
    moved = np.einsum("nij,j->ni", displacements(work, line, points), force)
    places, normals = _candidates(sections, stock, line.mean(axis=0), diameter)
    if len(places):
        found = support_line(work, line, force, places, normals, JACK)
        place, normal, before, after = places[found.best], normals[found.best], found.before, found.after[found.best]
    else:
        before = float(np.linalg.norm(np.einsum("ij,j->i", displacements(work, line, line[:1])[0], force)))
        place, normal, after = line[0], np.zeros(3), before
    return BentWorkpiece(step, line, force, points, faces, moved, place, normal, before, float(after))


def _candidates(sections: StockSections, stock: LayeredStock, contact: Floats, away: float) -> tuple[Floats, Floats]:
    """Return places (n, 3) on upright surfaces and their normals, evenly along the outlines at some heights."""
    low, high = float(stock.bounds[0]), float(stock.bounds[-1])
    places, normals = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for share in HEIGHTS:
        z = low + share * (high - low)
        level = [k for k, (a, b) in enumerate(zip(sections.low, sections.high, strict=True)) if a <= z <= b]
        if not level:
            continue
        for ring in shapely.get_rings(shapely.get_parts(sections.shapes[level[0]])):
            at = np.arange(0.5, PLACES) / PLACES * ring.length
            p, q = (shapely.get_coordinates(shapely.line_interpolate_point(ring, at + d)) for d in (0.0, 1e-4))
            along = (q - p) / np.linalg.norm(q - p, axis=1)[:, None].clip(1e-9)
            places.append(np.column_stack([p, np.full(len(p), z)]))
            normals.append(np.column_stack([along[:, 1], -along[:, 0], np.zeros(len(p))]))
    s, n = np.concatenate(places), np.concatenate(normals)
    free = np.linalg.norm(s - contact, axis=1) > away
    s, n = s[free], n[free]
    if not len(s):
        return s, n
    some = np.unique(np.linspace(0, len(s) - 1, min(len(s), PLACES)).astype(np.int64))
    return s[some], n[some]
