"""Free space: regions without material before the cutter begins. They are the outside of the stock, pre-drilled holes,
the region that a larger cutter cleared, and places without material in the stock of an earlier result.

Notation: R [mm] cutter radius. The cutter sweeps a free region along its parallels at R, 2 R, 3 R ... from its
boundary, which together reach every place of it that a disc of radius R can. A place that no disc reaches (an inner
corner of the stock's outline) would remain material for the planner, but not for the machine: it is refused.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region
from chipload.geometry.offset import offset_region
from chipload.number_text import number_text
from chipload.stock.planar import PlanarStock

Floats = NDArray[np.float64]

#: how far outside of the stock the plane is swept, in R
BAND = 4.0
#: part of the area of a free region that a disc of radius R need not reach
CORNERS = 1e-6
#: how far free space keeps off what an earlier cutter left, over R; chords of its edge [mm]
KEPT, CHORD_MM = 1e-2, 1e-4
#: material of an earlier result that is nowhere thicker than this [mm] is the rounding of its outlines; free space
#: keeps this part of R off what is thicker, less than passes look for beside their path
FILM_MM, KEPT_OFF_STOCK = 0.005, 2e-3


def parallels(region: Region, radius: float) -> list[tuple[Contour, ...]]:
    """Contours at R, 2 R, 3 R ... inside a region, until nothing is left of it."""
    out, inner = [], region
    for k in range(1, 10_000):
        inner = offset_region(region, k * radius)
        if not inner.contours:
            break
        out.append(inner.contours)
    return out


def take_free(stock: PlanarStock, regions: Sequence[Region], radius: float) -> None:
    """Remove the free regions from the stock."""
    for region in regions:
        for contours in parallels(region, radius):
            for contour in contours:
                stock.remove_segments(contour.segments)


def edge_places(region: Region, radius: float, step: float) -> list[tuple[Floats, Floats]]:
    """Points (n, 2) and headings (n,) of a cutter that goes along the boundary of a free region, a pair a contour."""
    return [places_along(contour, step) for contour in offset_region(region, radius).contours]


def places_along(contour: Contour, step: float) -> tuple[Floats, Floats]:
    """Points (n, 2) and headings (n,) along a contour, at most ``step`` [mm] apart."""
    s = np.linspace(0.0, contour.length, max(8, math.ceil(contour.length / step)))
    points, tangents, _ = contour.at(s)
    return points, np.arctan2(tangents[:, 1], tangents[:, 0])


def outside_of(stock: Region, radius: float) -> Region:
    """Band, ``BAND`` R wide, around the outline of the stock."""
    outer = offset_region(stock, -BAND * radius)
    return _require_reach(
        Region.of([*outer.contours, *stock.contours]), radius, "part.stock_layers: the outline of the stock"
    )


def hole(x: float, y: float, diameter: float, radius: float) -> Region:
    """Region of a pre-drilled hole.

    Raises
    ------
    InputError
        It is no wider than the cutter.
    """
    if not diameter > 2.0 * radius:
        raise InputError(
            f"operation.holes_mm: a hole of diameter {diameter:g} mm: must be above the cutter's diameter_mm = "
            f"{2.0 * radius:g}: drill a larger one or leave it out"
        )
    return Region.of([Contour.circle((x, y), 0.5 * diameter)])


def cleared_by(region: Region, radius: float, allowance: float) -> Region:
    """Region that a cutter of ``radius`` can clear: its opening, ``allowance`` off the walls [mm]."""
    return offset_region(offset_region(region, radius + allowance), -radius)


def without_stock(region: Region, standing: Sequence[Contour], radius: float, allowance: float) -> Region:
    """Part of a region, ``allowance`` off its walls [mm], without earlier material, where a disc of R reaches it.

    ``standing`` are closed contours of the material. The region is exact at the walls, where only films stand.
    """
    reach = cleared_by(region, radius, allowance)
    if not standing or not reach.contours:
        return reach
    material = shapely.intersection(Region.of(standing).flatten(CHORD_MM), reach.flatten(CHORD_MM))
    thick = shapely.buffer(shapely.buffer(material, -0.5 * FILM_MM), 0.5 * FILM_MM)
    parts = [part for part in shapely.get_parts(thick) if isinstance(part, shapely.Polygon) and not part.is_empty]
    rings = [ring for part in parts for ring in (part.exterior, *part.interiors)]
    left = [Contour.polyline(np.asarray(ring.coords)[:-1], closed=True) for ring in rings]
    return without_leftover(reach, left, radius, KEPT_OFF_STOCK)


def without_leftover(region: Region, left: Sequence[Contour], radius: float, kept: float = KEPT) -> Region:
    """Part of a free region in which a disc of R does not meet the material ``left`` in it (closed contours).

    The places of the disc's centre are a polygon, ``kept`` R clear of what was left; grown by R they make the region,
    so that the disc reaches all of it.
    """
    if not left:
        return region
    centres = offset_region(region, radius).flatten(CHORD_MM)
    around = shapely.buffer(Region.of(left).flatten(CHORD_MM), (1.0 + kept) * radius, quad_segs=64)
    rest = shapely.simplify(shapely.difference(centres, around), 0.1 * CHORD_MM)
    parts = [part for part in shapely.get_parts(rest) if part.area > (kept * radius) ** 2]
    rings = [ring for part in parts for ring in (part.exterior, *part.interiors)]
    if not rings:
        return Region(())
    return offset_region(Region.of([Contour.polyline(np.asarray(r.coords)[:-1], closed=True) for r in rings]), -radius)


def _require_reach(region: Region, radius: float, what: str) -> Region:
    """The region, if a disc of radius R reaches all of it beside the stock."""
    opened = offset_region(offset_region(region, radius), -radius)
    missed = region.area - opened.area
    if missed > CORNERS * region.area:
        raise InputError(
            f"{what} has inner corners that the cutter of radius {radius:g} mm does not reach "
            f"({number_text(missed)} mm2): "
            "round them off by that radius"
        )
    return region
