"""The path of a cleared pocket: rows of lines and arcs with their kinds, and the mirror image of a path.

Notation: R [mm] cutter radius; a row goes from the place of the row before it to its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chipload.geometry.contour import Contour, Region
from chipload.planning.result import Event

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: values of ``ClearingPath.kind``: into the material, cutting, through cleared space, up, across and down again
ENTRY, CUT, LINK, LIFT = 0, 1, 2, 3


@dataclass(frozen=True, eq=False)
class ClearingPath:
    """Path of the cutter's centre, and the material that it left. Row k goes along a line or an arc from row k - 1 to
    row k.

    Parameters
    ----------
    x, y : (n,) float [mm]
    centre : (n, 2) float [mm], of the arc; 0, 0 of a line
    sweep : (n,) float [rad], counter-clockwise > 0; 0: a line
    kind : (n,) int, ENTRY, CUT, LINK or LIFT; row 0 is a LIFT: the cutter comes from above
    engagement_max : (n,) float [rad], greatest along the row; pi in an ENTRY, 0 in LINK and LIFT
    pass_number : (n,) int, from 1; 0 where it belongs to none
    events : in the order of the path
    reachable_mm2, cleared_mm2, leftover_mm2 : areas [mm^2] of the opening of the region, and its parts
    leftover : contours of what is left and could be reached, the greatest first
    lengths_mm : path length by kind: `entry`, `cut`, `link`, `lift`
    """

    x: Floats
    y: Floats
    centre: Floats
    sweep: Floats
    kind: Ints
    engagement_max: Floats
    pass_number: Ints
    events: tuple[Event, ...]
    reachable_mm2: float
    cleared_mm2: float
    leftover_mm2: float
    leftover: tuple[Contour, ...]
    lengths_mm: Mapping[str, float]

    @property
    def cleared_share(self) -> float:
        """Cleared part of what can be reached."""
        return self.cleared_mm2 / self.reachable_mm2

    @cached_property
    def segments(self) -> Floats:
        """Rows as segments of a contour, (n, 7); row 0 has no length."""
        p = np.column_stack([self.x, self.y])
        return np.column_stack([np.vstack([p[:1], p[:-1]]), p, self.centre, self.sweep])

    @cached_property
    def lengths(self) -> Floats:
        """Length of each row [mm], (n,)."""
        return segment_lengths(self.segments)

    @property
    def passes(self) -> int:
        """Number of passes."""
        return int(self.pass_number.max(initial=0))


@dataclass(frozen=True, eq=False)
class EarlierPath:
    """Earlier cuts of the same cutter in the same plane: segments (n, 7) [mm, rad], and the region of its centre."""

    segments: Floats
    centres: Region

    @staticmethod
    def of(path: ClearingPath, centres: Region) -> EarlierPath:
        """The rows of a path on the floor."""
        return EarlierPath(path.segments[path.kind != LIFT], centres)


def segment_lengths(segments: Floats) -> Floats:
    """Lengths (n,) [mm] of lines and arcs (n, 7); 0 is allowed."""
    seg = segments
    chord = np.hypot(seg[:, 2] - seg[:, 0], seg[:, 3] - seg[:, 1])
    rho = np.hypot(seg[:, 0] - seg[:, 4], seg[:, 1] - seg[:, 5])
    return np.asarray(np.where(seg[:, 6] == 0.0, chord, rho * np.abs(seg[:, 6])))


def polyline(
    points: Floats, centre: Floats, sweep: Floats, raised: NDArray[np.bool_], chord: float
) -> tuple[Floats, NDArray[np.bool_]]:
    """Points (m, 2) of a path whose chords leave its arcs by at most ``chord`` [mm], and ``raised`` for each."""
    before = np.vstack([points[:1], points[:-1]])
    v = before - centre
    rho = np.hypot(v[:, 0], v[:, 1])
    parts = np.ones(len(points), dtype=np.int64)
    arc = sweep != 0.0
    parts[arc] = np.ceil(np.abs(sweep[arc]) / (2.0 * np.arccos(1.0 - np.minimum(chord / rho[arc], 0.5))))
    k = np.repeat(np.arange(len(points)), parts)
    share = (np.arange(len(k)) - np.repeat(np.cumsum(parts) - parts, parts) + 1) / parts[k]
    a = sweep[k] * share
    out = centre[k] + np.column_stack(
        [np.cos(a) * v[k, 0] - np.sin(a) * v[k, 1], np.sin(a) * v[k, 0] + np.cos(a) * v[k, 1]]
    )
    whole = share >= 1.0
    out[whole] = points[k[whole]]
    return out, raised[k]


def points_of_arcs(segments: Floats, step: float) -> tuple[Floats, Floats]:
    """Points (m, 2) and headings (m,) along arcs (n, 7), at most ``step`` [mm] apart."""
    k = np.repeat(np.arange(len(segments)), np.ceil(segment_lengths(segments) / step).astype(np.int64) + 1)
    first = np.searchsorted(k, np.arange(len(segments)))
    share = (np.arange(len(k)) - first[k]) / np.maximum(1, np.bincount(k)[k] - 1)
    seg = segments[k]
    a = np.arctan2(seg[:, 1] - seg[:, 5], seg[:, 0] - seg[:, 4]) + share * seg[:, 6]
    rho = np.hypot(seg[:, 0] - seg[:, 4], seg[:, 1] - seg[:, 5])
    points = seg[:, 4:6] + rho[:, None] * np.column_stack([np.cos(a), np.sin(a)])
    return points, a + np.copysign(0.5 * np.pi, seg[:, 6])


def separate_polylines(segments: Floats, chord: float) -> tuple[Floats, NDArray[np.bool_]]:
    """Points (m, 2) of segments (n, 7) as of :func:`polyline`, each segment begun anew where it does not go on."""
    starts = segments[:, 0:2]
    apart = np.append(True, np.hypot(*(starts[1:] - segments[:-1, 2:4]).T) > 1e-9)
    k = np.repeat(np.arange(len(segments)), np.where(apart, 2, 1))
    begins = np.append(True, k[1:] != k[:-1]) & apart[k]
    points = np.where(begins[:, None], starts[k], segments[k, 2:4])
    sweep = np.where(begins, 0.0, segments[k, 6])
    return polyline(points, segments[k, 4:6], sweep, begins, chord)


def mirrored_region(region: Region) -> Region:
    """The mirror image in the y axis, inside on the left again."""
    flip = np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    return Region(tuple(_image(c, flip) for c in region.contours))


def _image(contour: Contour, flip: Floats) -> Contour:
    seg = contour.segments * flip
    seg[seg[:, 6] == 0.0, 4:6] = 0.0
    return Contour(seg).reversed()


def mirrored_earlier(earlier: EarlierPath) -> EarlierPath:
    """Mirror image of earlier cuts in the y axis."""
    flip = np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    return EarlierPath(earlier.segments * flip, mirrored_region(earlier.centres))


def mirrored_path(path: ClearingPath) -> ClearingPath:
    """The mirror image of a path in the y axis."""
    flip = np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    return replace(
        path,
        x=-path.x,
        centre=path.centre * (-1.0, 1.0),
        sweep=-path.sweep,
        events=tuple(replace(e, x=-e.x) for e in path.events),
        leftover=tuple(_image(c, flip) for c in path.leftover),
    )
