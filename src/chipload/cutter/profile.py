"""The profile of a cutter: lines and arcs from the tip up to the end of its teeth.

Notation: rho [mm] distance from the axis, z [mm] height above the tip, kappa [rad] angle of the outward normal with the
downward axis: 0 on a flat bottom, pi/2 on an upright flank, above that where the cutter is undercut. Every cutter is
convex: kappa rises along its profile. A shape is one function that states its segments; what simulates a cutter reads
the segments alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.barrel import FlankArc
from chipload.errors import InputError

#: greatest kappa of an upright flank [rad]: rounding above pi/2
UPRIGHT = 0.5 * math.pi + 1e-9


@dataclass(frozen=True)
class ProfileSegment:
    """A line or an arc of a profile, each value at its lower and at its upper end.

    Parameters
    ----------
    rho, z : [mm]
    kappa : [rad], equal ones of a line
    radius : of an arc [mm]; 0: a line, or a sharp corner, over which kappa rises
    centre : (rho, z) of an arc [mm]
    """

    rho: tuple[float, float]
    z: tuple[float, float]
    kappa: tuple[float, float]
    radius: float = 0.0
    centre: tuple[float, float] = (0.0, 0.0)

    @property
    def straight(self) -> bool:
        """Whether it is a line."""
        return self.kappa[0] == self.kappa[1]

    @property
    def widest(self) -> float:
        """Greatest rho [mm]: of an arc over kappa = pi/2 it is between its ends."""
        belly = self.kappa[0] < 0.5 * math.pi < self.kappa[1]
        return self.centre[0] + self.radius if belly else max(self.rho)

    @property
    def length(self) -> float:
        """Of the line or arc [mm].

        >>> round(arc((0.0, 5.0), 5.0, 0.0, 0.5 * math.pi).length, 3), line((0.0, 0.0), (3.0, 4.0)).length
        (7.854, 5.0)
        """
        if self.straight:
            return math.hypot(self.rho[1] - self.rho[0], self.z[1] - self.z[0])
        return self.radius * (self.kappa[1] - self.kappa[0])


def line(begin: tuple[float, float], end: tuple[float, float], kappa: float | None = None) -> ProfileSegment:
    """Return the line between two points (rho, z); ``kappa`` if it is known better than from them.

    >>> round(math.degrees(line((5.0, 0.0), (5.0, 9.0)).kappa[0]), 9)
    90.0
    """
    angle = math.atan2(end[1] - begin[1], end[0] - begin[0]) if kappa is None else kappa
    return ProfileSegment((begin[0], end[0]), (begin[1], end[1]), (angle, angle))


def arc(centre: tuple[float, float], radius: float, first: float, last: float) -> ProfileSegment:
    """Return the arc of a radius about a centre (rho, z) from one kappa to another.

    >>> [round(x, 9) for x in arc((0.0, 5.0), 5.0, 0.0, 0.5 * math.pi).rho]
    [0.0, 5.0]
    """
    e, f = centre
    rho = (e + radius * math.sin(first), e + radius * math.sin(last))
    z = (f - radius * math.cos(first), f - radius * math.cos(last))
    return ProfileSegment(rho, z, (first, last), radius, (e, f))


def radius_of(segments: Sequence[ProfileSegment], z: ArrayLike) -> NDArray[np.float64]:
    """Return the radius rho at heights z above the tip [mm]; above the profile that of its end.

    >>> radius_of(apt_segments((10.0, 5.0, 0.0, 5.0, 0.0, 0.0, 20.0)), [0.0, 2.0, 5.0, 9.0]).tolist()
    [0.0, 4.0, 5.0, 5.0]
    """
    height = np.asarray(z, dtype=np.float64)
    out = np.full(height.shape, segments[-1].rho[1])
    for segment in reversed(segments):
        (low, high), (first, last) = segment.z, segment.rho
        if not high > low:
            continue
        if segment.straight:
            at = first + (height - low) * (last - first) / (high - low)
        else:
            at = segment.centre[0] + np.sqrt(np.clip(segment.radius**2 - (segment.centre[1] - height) ** 2, 0.0, None))
        out = np.where(height < high, at, out)
    # a flat bottom has its radius at the height of the tip
    flat = [segment.rho[1] for segment in segments if segment.z[1] <= 0.0]
    return np.where(height <= 0.0, max(flat, default=0.0), out)


def chords_of(segments: Sequence[ProfileSegment], chord_mm: float) -> NDArray[np.float64]:
    """Return points (m, 2) of a profile from the axis up as (rho, z) [mm], arcs by chords within ``chord_mm``.

    >>> chords_of(apt_segments((10.0, 0.0, 5.0, 0.0, 0.0, 0.0, 20.0)), 0.01).tolist()
    [[0.0, 0.0], [5.0, 0.0], [5.0, 20.0]]
    """
    points = [(0.0, 0.0)]
    for segment in segments:
        n = 1
        if segment.radius > 0.0:
            turn = segment.kappa[1] - segment.kappa[0]
            n = max(1, math.ceil(turn / (2.0 * math.acos(1.0 - min(chord_mm / segment.radius, 1.0)))))
            angles = [segment.kappa[0] + turn * i / n for i in range(1, n)]
            e, f = segment.centre
            points += [(e + segment.radius * math.sin(a), f - segment.radius * math.cos(a)) for a in angles]
        points.append((segment.rho[1], segment.z[1]))
    p = np.array(points)
    keep = np.hypot(*np.diff(p, axis=0).T) > 1e-9
    return np.vstack([p[:1], p[1:][keep]])


def join_segments(segments: Sequence[ProfileSegment], tolerance: float) -> tuple[ProfileSegment, ...]:
    """Return the segments that have a length, with a sharp corner between two that are not tangent.

    Raises
    ------
    InputError
        Two segments do not touch within ``tolerance`` [mm], or the profile is not convex.
    """
    out: list[ProfileSegment] = []
    for segment in segments:
        if segment.length <= tolerance:
            continue
        if out:
            last = out[-1]
            apart = math.hypot(segment.rho[0] - last.rho[1], segment.z[0] - last.z[1])
            if apart > 1e3 * tolerance:
                raise InputError(f"cutter: the segments of its profile are {apart:.3g} mm apart: must touch")
            fall = last.kappa[1] - segment.kappa[0]
            if fall > 1e-6:
                raise InputError(
                    f"cutter: its profile turns inwards by {math.degrees(fall):.3g} deg, {segment.rho[0]:.6g} mm from "
                    "the axis: must be convex"
                )
            if fall < -1e-12:
                end, height = (last.rho[1], last.rho[1]), (last.z[1], last.z[1])
                out.append(ProfileSegment(end, height, (last.kappa[1], segment.kappa[0]), 0.0, (end[0], height[0])))
        out.append(segment)
    return tuple(out)


def apt_segments(
    apt: tuple[float, float, float, float, float, float, float], flank: FlankArc | None = None
) -> tuple[ProfileSegment, ...]:
    """Return the profile of seven numbers of APT: bottom, corner, the flank arc of a barrel, flank.

    >>> bull = apt_segments((10.0, 1.0, 4.0, 1.0, 0.0, 0.0, 20.0))
    >>> [(segment.rho, segment.z) for segment in bull]
    [((0.0, 4.0), (0.0, 0.0)), ((4.0, 5.0), (0.0, 1.0)), ((5.0, 5.0), (1.0, 20.0))]
    """
    d, r, e, f, alpha, beta, height = apt
    last = 0.5 * math.pi - beta
    end = (e + r * math.sin(alpha), f - r * math.cos(alpha))
    segments = [line((0.0, 0.0), end, alpha)]
    foot = (0.5 * d if beta == 0.0 and flank is None else e + r * math.cos(beta), f - r * math.sin(beta))
    if r > 0.0:
        stop = last if flank is None else flank.kappa_from
        if flank is None and height < foot[1]:
            stop = math.acos(min(max((f - height) / r, -1.0), 1.0))
        corner = arc((e, f), r, alpha, stop)
        if flank is None and stop == last:
            corner = ProfileSegment((end[0], foot[0]), (end[1], foot[1]), corner.kappa, r, (e, f))
        segments.append(corner)
    if flank is not None:
        bow = arc((flank.e, flank.f), flank.radius, flank.kappa_from, flank.kappa_at(min(height, flank.z_to)))
        segments.append(bow)
        foot = (bow.rho[1], bow.z[1])
    if height > foot[1]:
        segments.append(line(foot, (foot[0] + (height - foot[1]) * math.tan(beta), height), last))
    return join_segments(segments, 1e-9 * d)
