"""Tabs: strips of material above the floor of a pocket that hold the piece that is cut out.

A tab leads from the wall at a stated place straight across the pocket to the wall opposite. Above its top the pocket is
cleared as if there were none; below, the strip is no part of the region.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region

Floats = NDArray[np.float64]

#: spacing of places on a wall among which the nearest is searched [mm]
SPACING_MM = 0.01
#: chords of the region about the tabs leave its arcs by at most so much [mm], away from the part
CHORD_MM = 1e-4


@dataclass(frozen=True)
class Tabs:
    """Places (x, y) [mm] near the walls that they begin at, width, and height over the floor [mm]."""

    places: tuple[tuple[float, float], ...]
    width: float
    height: float


def without_tabs(region: Region, tabs: Tabs) -> Region:
    """The region less the strips of the tabs.

    Raises
    ------
    InputError
        A place is farther from every wall than the tab is wide.

    Examples
    --------
    A ring of 6 mm about a part of 20 mm: a tab of 4 mm at its right takes 24 mm2.

    >>> ring = Region.of([Contour.polyline([[x, x], [-x, x], [-x, -x], [x, -x]], closed=True) for x in (10.0, 16.0)])
    >>> round(ring.area - without_tabs(ring, Tabs(((10.0, 0.0),), 4.0, 1.0)).area, 6)
    24.0
    """
    whole = region.flatten(CHORD_MM)
    strips = [_strip(region, whole, place, tabs.width) for place in tabs.places]
    rest = shapely.difference(whole, shapely.union_all(strips))
    rings = [ring for part in shapely.get_parts(rest) for ring in (part.exterior, *part.interiors)]
    return Region.of([Contour.polyline(np.asarray(ring.coords)[:-1], closed=True) for ring in rings])


def _strip(region: Region, whole: shapely.Geometry, place: tuple[float, float], width: float) -> shapely.Geometry:
    """The strip from the wall nearest to a place to the one opposite, and half its width into both."""
    p, across = _nearest(region, place)
    far = math.hypot(*np.asarray(place) - p)
    if far > width:
        raise InputError(
            f"operation.tabs.at_mm: ({place[0]:g}, {place[1]:g}) is {far:.4g} mm from the nearest wall: must be within "
            f"width_mm = {width:g}: state a place on the wall of the piece that is held"
        )
    xmin, ymin, xmax, ymax = region.bounds
    ray = shapely.linestrings([p + SPACING_MM * across, p + math.hypot(xmax - xmin, ymax - ymin) * across])
    crossed = shapely.get_parts(shapely.intersection(ray, whole))
    reached = min(crossed, key=lambda part: float(shapely.distance(part, shapely.points(p))))
    length = SPACING_MM + float(shapely.length(reached))
    along, back = 0.5 * width * np.array([-across[1], across[0]]), 0.5 * width * across
    q = p + length * across
    return shapely.polygons([p - back - along, q + back - along, q + back + along, p - back + along])


def _nearest(region: Region, place: tuple[float, float]) -> tuple[Floats, Floats]:
    """The point of the walls nearest to a place, and the unit normal into the region there."""
    best = (math.inf, np.zeros(2), np.zeros(2))
    for contour in region.contours:
        s = np.linspace(0.0, contour.length, max(16, math.ceil(contour.length / SPACING_MM)))
        # the nearest place of many, then between its neighbours twice: to 1e-6 mm
        for _ in range(3):
            points, tangents, _ = contour.at(s)
            far = np.hypot(*(points - np.asarray(place)).T)
            k = int(far.argmin())
            s = np.linspace(s[max(k - 1, 0)], s[min(k + 1, len(s) - 1)], 201)
        if far[k] < best[0]:
            best = (float(far[k]), points[k], np.array([-tangents[k, 1], tangents[k, 0]]))
    return best[1], best[2]
