"""Channels of a pocket: parts of the centre region that are hardly wider than the cutter, which circles clear.

Notation: R [mm] cutter radius; the **room** of a place is the distance that the cutter's centre can move from it in
any direction, its clearance less R and the allowance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.geometry.contour import Contour, Region
from chipload.planning.pocket.reach import inner_polygons
from chipload.planning.pocket.skeleton import Skeleton, skeleton_of

Floats = NDArray[np.float64]

#: room / R below which a place is in a channel
WIDTH = 0.27
#: length / R of a part as narrow as that, from which on it is a channel: a shorter one is a corner
LENGTH = 1.0
#: share of the room by which the wide part is grown, so that roundings of its polygons are no channels
GROWN = 2e-3
#: room / R up to which the middle lines of the channels run on into the wide part
INTO = 2.0


@dataclass(frozen=True, eq=False)
class Channels:
    """The channels of a centre region.

    Parameters
    ----------
    wide : centre region without its channels, where passes clear; None where all of it is a channel
    lines : middle lines of each channel
    """

    wide: Region | None
    lines: tuple[Skeleton, ...]


def channels_of(region: Region, centres: Region, radius: float, allowance: float, chord: float) -> Channels | None:
    """The channels of a ``region`` whose centre region is ``centres``; None where it has none.

    Parameters
    ----------
    radius, allowance, chord : [mm]
    """
    whole, room = inner_polygons(centres, chord), WIDTH * radius
    opened = shapely.buffer(shapely.buffer(whole, -room, quad_segs=16), (1.0 + GROWN) * room, quad_segs=16)
    narrow = [part for part in shapely.get_parts(shapely.difference(whole, opened)) if extent(part) > LENGTH * radius]
    if not narrow:
        return None
    cut = shapely.union_all(narrow)
    rest = [p for p in shapely.get_parts(shapely.difference(whole, cut)) if p.area > room**2]
    rings = [ring for p in rest for ring in (p.exterior, *p.interiors)]
    contours = [Contour.polyline(np.asarray(ring.coords)[:-1], closed=True) for ring in rings]
    lines = skeleton_of(region, radius + allowance + 0.005 * radius, 0.03 * radius)
    near = shapely.buffer(cut, INTO * radius)
    mask = shapely.contains_xy(near, *lines.points.T)
    return Channels(Region.of(contours) if contours else None, lines.parts(mask))


def extent(part: shapely.Geometry) -> float:
    """Length [mm] of the diagonal of the smallest box, turned as it may be, about a polygon."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(part))
    return float(np.hypot(*(corners[2] - corners[0]))) if len(corners) > 2 else 0.0
