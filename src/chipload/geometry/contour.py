"""Contours: chains of lines and circular arcs in the plane, and regions bounded by them.

Notation: a **segment** is a row ``[x0, y0, x1, y1, xc, yc, sweep]``: start, end, centre [mm] and the signed angle
[rad] that the arc turns through, positive counter-clockwise; ``sweep == 0`` is a line (its centre is 0, 0).
T is the unit tangent in the direction of travel, n = Rot(+90 deg) T the left normal, kappa [1/mm] the curvature,
positive where the contour turns left. s [mm] is the arc length from the start.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError

Floats = NDArray[np.float64]

#: ends nearer to each other than this [mm] are one point
JOIN_MM = 1e-7
#: an arc whose height above its chord is less than this [mm] is a line
FLAT_MM = 1e-10


@dataclass(frozen=True, eq=False)
class Contour:
    """A chain of lines and arcs; each segment starts where the previous one ends.

    Parameters
    ----------
    segments : (n, 7) float [mm, rad]
        Rows ``[x0, y0, x1, y1, xc, yc, sweep]``, n >= 1, none of zero length, ``|sweep| <= 2 pi``.

    Raises
    ------
    InputError
        A value is not finite, a segment has no length, or two neighbours do not meet within ``JOIN_MM``.

    Examples
    --------
    >>> Contour.circle((0.0, 0.0), 2.0).area / np.pi
    4.0
    """

    segments: Floats

    def __post_init__(self) -> None:
        seg = np.array(self.segments, dtype=np.float64)
        if seg.ndim != 2 or seg.shape[1] != 7 or len(seg) == 0:
            raise InputError(f"contour: segments have shape {seg.shape}: need (n, 7) with n >= 1")
        if not np.isfinite(seg).all():
            raise InputError("contour: a coordinate is not a finite number")
        seg.setflags(write=False)
        object.__setattr__(self, "segments", seg)
        gap = np.hypot(*(seg[1:, 0:2] - seg[:-1, 2:4]).T)
        if len(gap) and gap.max() > JOIN_MM:
            k = int(gap.argmax())
            raise InputError(
                f"contour: gap of {gap[k]:.6g} mm at ({seg[k, 2]:.6g}, {seg[k, 3]:.6g}): neighbours must meet"
            )
        if self.lengths.min() <= 0.0:
            k = int(self.lengths.argmin())
            raise InputError(f"contour: segment {k} at ({seg[k, 0]:.6g}, {seg[k, 1]:.6g}) has no length")

    # -- construction ---------------------------------------------------------------------------------------------
    @staticmethod
    def polyline(points: ArrayLike, closed: bool = False) -> Contour:
        """Straight lines through ``points`` (m, 2) [mm]; ``closed`` adds a line from the last point to the first."""
        p = np.asarray(points, dtype=np.float64)
        return Contour.from_bulges(p, np.zeros(len(p)), closed)

    @staticmethod
    def from_bulges(points: ArrayLike, bulges: ArrayLike, closed: bool = False) -> Contour:
        """Vertices (m, 2) [mm] and bulges (m,) as in a DXF polyline: bulge = tan(sweep / 4) of the segment that
        starts at the vertex. Neighbouring vertices nearer than ``JOIN_MM`` are merged. An arc that rises less than
        ``FLAT_MM`` above its chord becomes a line, because its distant centre could not be computed accurately.
        """
        p = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        b = np.asarray(bulges, dtype=np.float64)
        q = np.roll(p, -1, axis=0)
        if not closed:
            p, q, b = p[:-1], q[:-1], b[: len(p) - 1]
        keep = np.hypot(*(q - p).T) > JOIN_MM
        p, q, b = p[keep], q[keep], b[keep]
        q[:-1] = p[1:]  # the neighbours of a dropped short segment meet
        if closed and len(q):
            q[-1] = p[0]
        sweep = 4.0 * np.arctan(b)
        arc = 0.5 * np.abs(b) * np.hypot(*(q - p).T) > FLAT_MM
        bb = np.where(arc, b, 1.0)
        chord = q - p
        normal = np.column_stack([-chord[:, 1], chord[:, 0]])
        centre = 0.5 * (p + q) + normal * ((1.0 - bb**2) / (4.0 * bb))[:, None]
        centre[~arc] = 0.0
        return Contour(np.column_stack([p, q, centre, np.where(arc, sweep, 0.0)]))

    @staticmethod
    def circle(centre: tuple[float, float], radius: float, sense: int = 1) -> Contour:
        """A full circle [mm] from its rightmost point; ``sense`` +1 is counter-clockwise, -1 clockwise."""
        x, y = centre
        return Contour(np.array([[x + radius, y, x + radius, y, x, y, sense * 2.0 * np.pi]]))

    @staticmethod
    def join(parts: Iterable[Contour]) -> Contour:
        """One contour from parts that follow one another."""
        return Contour(np.vstack([part.segments for part in parts]))

    # -- properties -----------------------------------------------------------------------------------------
    @cached_property
    def radii(self) -> Floats:
        """(n,) radius of each segment [mm], 0 for a line."""
        seg = self.segments
        r: Floats = np.hypot(seg[:, 0] - seg[:, 4], seg[:, 1] - seg[:, 5])
        return np.where(seg[:, 6] == 0.0, 0.0, r)

    @cached_property
    def lengths(self) -> Floats:
        """(n,) length of each segment [mm]."""
        seg = self.segments
        chord: Floats = np.hypot(seg[:, 2] - seg[:, 0], seg[:, 3] - seg[:, 1])
        return np.where(seg[:, 6] == 0.0, chord, self.radii * np.abs(seg[:, 6]))

    @cached_property
    def knots(self) -> Floats:
        """(n + 1,) arc length at the ends of the segments [mm]."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @property
    def length(self) -> float:
        """Total length [mm]."""
        return float(self.knots[-1])

    @property
    def start(self) -> Floats:
        """(2,) first point [mm]."""
        return self.segments[0, 0:2]

    @property
    def end(self) -> Floats:
        """(2,) last point [mm]."""
        return self.segments[-1, 2:4]

    @cached_property
    def closed(self) -> bool:
        """Whether the end meets the start within ``JOIN_MM``."""
        return bool(np.hypot(*(self.end - self.start)) <= JOIN_MM)

    @cached_property
    def area(self) -> float:
        """Signed area [mm^2] by Green's theorem, positive counter-clockwise; closed contours only."""
        if not self.closed:
            raise InputError("contour: an open chain has no area; close it first")
        x0, y0, x1, y1, _, _, sweep = self.segments.T
        return float(0.5 * np.sum(x0 * y1 - x1 * y0) + 0.5 * np.sum(self.radii**2 * (sweep - np.sin(sweep))))

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """(xmin, ymin, xmax, ymax) [mm], arcs included."""
        pts = [self.segments[:, 0:2], self.segments[:, 2:4]]
        for (x0, y0, _, _, xc, yc, sweep), r in zip(self.segments, self.radii, strict=True):
            if sweep != 0.0:
                a0 = np.arctan2(y0 - yc, x0 - xc)
                quarter = np.arange(4) * (np.pi / 2)
                along = (quarter - a0) % (2 * np.pi) if sweep > 0 else (a0 - quarter) % (2 * np.pi)
                hit = quarter[along <= abs(sweep)]
                pts.append(np.column_stack([xc + r * np.cos(hit), yc + r * np.sin(hit)]))
        p = np.vstack(pts)
        return float(p[:, 0].min()), float(p[:, 1].min()), float(p[:, 0].max()), float(p[:, 1].max())

    # -- points and parts -------------------------------------------------------------------------------------------
    def at(self, s: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Points, unit tangents and curvatures at the arc lengths ``s``.

        Parameters
        ----------
        s : (m,) float [mm], 0 <= s <= length; at a joint the segment that starts there counts

        Returns
        -------
        p : (m, 2) [mm], T : (m, 2), kappa : (m,) [1/mm]
        """
        s = np.atleast_1d(np.asarray(s, dtype=np.float64))
        k = np.clip(np.searchsorted(self.knots, s, side="right") - 1, 0, len(self.segments) - 1)
        u = ((s - self.knots[k]) / self.lengths[k])[:, None]
        seg = self.segments[k]
        p0, p1, centre, sweep = seg[:, 0:2], seg[:, 2:4], seg[:, 4:6], seg[:, 6]
        r = self.radii[k]
        arc = sweep != 0.0
        chord = p1 - p0
        length = self.lengths[k]
        turn = sweep * u[:, 0]
        v = p0 - centre
        cos, sin = np.cos(turn), np.sin(turn)
        w = np.column_stack([cos * v[:, 0] - sin * v[:, 1], sin * v[:, 0] + cos * v[:, 1]])
        p = np.where(arc[:, None], centre + w, p0 + u * chord)
        unit = np.where(arc, np.sign(sweep) / np.where(arc, r, 1.0), 0.0)
        tangent = np.where(arc[:, None], np.column_stack([-w[:, 1], w[:, 0]]) * unit[:, None], chord / length[:, None])
        return p, tangent, unit

    def reversed(self) -> Contour:
        """The same contour in the opposite sense."""
        seg = self.segments[::-1]
        return Contour(np.column_stack([seg[:, 2:4], seg[:, 0:2], seg[:, 4:6], -seg[:, 6]]))

    def started_at(self, s: float) -> Contour:
        """The same closed contour, started at the arc length ``s`` [mm]."""
        s = s % self.length
        if s <= JOIN_MM or self.length - s <= JOIN_MM:
            return self
        return Contour.join([self.part(s, self.length), self.part(0.0, s)])

    def part(self, s0: float, s1: float) -> Contour:
        """The part between the arc lengths s0 < s1 [mm]."""
        if not 0.0 <= s0 < s1 <= self.length + JOIN_MM:
            raise InputError(f"contour: part {s0:.6g}..{s1:.6g} mm: need 0 <= s0 < s1 <= {self.length:.6g}")
        inner = self.knots[(self.knots > s0 + JOIN_MM) & (self.knots < s1 - JOIN_MM)]
        cut = np.concatenate([[s0], inner, [min(s1, self.length)]])
        k = np.clip(np.searchsorted(self.knots, 0.5 * (cut[:-1] + cut[1:]), side="right") - 1, 0, None)
        p = self.at(cut)[0]
        # a cut at a joint gets the exact point of the joint
        for i, s in enumerate(cut):
            j = int(np.abs(self.knots - s).argmin())
            if abs(self.knots[j] - s) <= JOIN_MM:
                p[i] = self.segments[j, 0:2] if j < len(self.segments) else self.segments[-1, 2:4]
        sweep = self.segments[k, 6] * (cut[1:] - cut[:-1]) / self.lengths[k]
        return Contour(np.column_stack([p[:-1], p[1:], self.segments[k, 4:6], sweep]))

    def moved(self, dx: float, dy: float, turn: float = 0.0, scale: float = 1.0) -> Contour:
        """The contour scaled and rotated by ``turn`` [rad] about the origin, then translated by (dx, dy) [mm]."""
        c, s = np.cos(turn) * scale, np.sin(turn) * scale
        R = np.array([[c, s], [-s, c]])
        seg = self.segments.copy()
        for k in (0, 2, 4):
            seg[:, k : k + 2] = seg[:, k : k + 2] @ R + (dx, dy)
        seg[seg[:, 6] == 0.0, 4:6] = 0.0
        return Contour(seg)

    def flatten(self, chord_mm: float) -> Floats:
        """(m, 2) points [mm] on the contour whose polyline deviates from it by at most ``chord_mm``."""
        out = [self.segments[:1, 0:2]]
        for (x0, y0, x1, y1, xc, yc, sweep), r in zip(self.segments, self.radii, strict=True):
            if sweep != 0.0:
                step = 2.0 * np.arccos(1.0 - min(chord_mm / r, 1.0))
                n = max(1, int(np.ceil(abs(sweep) / step)))
                a = np.arctan2(y0 - yc, x0 - xc) + sweep * np.arange(1, n) / n
                out.append(np.column_stack([xc + r * np.cos(a), yc + r * np.sin(a)]))
            out.append(np.array([[x1, y1]]))
        return np.vstack(out)


@dataclass(frozen=True, eq=False)
class Region:
    """A bounded set of the plane: outer contours counter-clockwise, islands clockwise, inside on the left.

    Raises
    ------
    InputError
        A contour is open.
    """

    contours: tuple[Contour, ...]

    def __post_init__(self) -> None:
        for c in self.contours:
            if not c.closed:
                x, y = c.end
                gap = np.hypot(*(c.end - c.start))
                raise InputError(
                    f"contour open at ({x:.6g}, {y:.6g}), gap {gap:.6g} mm: a closed contour is needed; "
                    'close the drawing, raise part.join_mm, or leave it out (part.open_chains = "dropped")'
                )

    @staticmethod
    def of(contours: Sequence[Contour]) -> Region:
        """The region between contours by even-odd nesting; each is oriented so that the inside lies on its left.

        The contours must not cross one another. O(n^2) in the number of contours.
        """
        out = []
        for i, c in enumerate(contours):
            p = c.at(np.array([0.381966 * c.length]))[0]
            depth = sum(bool(winding_number(o, p)[0]) for j, o in enumerate(contours) if j != i)
            out.append(c if (c.area > 0.0) == (depth % 2 == 0) else c.reversed())
        return Region(tuple(out))

    @cached_property
    def area(self) -> float:
        """Area [mm^2]."""
        return float(sum(c.area for c in self.contours))

    @cached_property
    def segments(self) -> Floats:
        """(n, 7) all segments, contour after contour."""
        return np.vstack([c.segments for c in self.contours]) if self.contours else np.zeros((0, 7))

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """(xmin, ymin, xmax, ymax) [mm]."""
        b = np.array([c.bounds for c in self.contours])
        return float(b[:, 0].min()), float(b[:, 1].min()), float(b[:, 2].max()), float(b[:, 3].max())

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """(m,) whether each of ``points`` (m, 2) [mm] lies inside; points on the boundary may count as either."""
        p = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        total = np.zeros(len(p), dtype=np.int64)
        for c in self.contours:
            total += winding_number(c, p)
        return total > 0

    def flatten(self, chord_mm: float) -> Any:
        """The region as a shapely polygon whose chords deviate from the arcs by at most ``chord_mm``.

        The contours are applied from the largest to the smallest, so that an island in a hole is retained.
        """
        import shapely

        ordered = sorted(self.contours, key=lambda c: -abs(c.area))
        out = shapely.Polygon()
        for filled, group in groupby(ordered, key=lambda c: c.area > 0.0):
            rings = shapely.union_all([shapely.polygons(c.flatten(chord_mm)) for c in group])
            out = shapely.union(out, rings) if filled else shapely.difference(out, rings)
        return out


def winding_number(contour: Contour, points: Floats) -> NDArray[np.int64]:
    """(m,) winding number of a closed contour about ``points`` (m, 2), exact for arcs: crossings of the ray to +x.

    O(n m), vectorised over the points.
    """
    x, y = points[:, 0], points[:, 1]
    total = np.zeros(len(points), dtype=np.int64)
    for (x0, y0, x1, y1, xc, yc, sweep), r in zip(contour.segments, contour.radii, strict=True):
        if sweep == 0.0:
            up = (y0 <= y) & (y1 > y)
            down = (y0 > y) & (y1 <= y)
            side = (x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)
            total += (up & (side > 0.0)).astype(np.int64) - (down & (side < 0.0)).astype(np.int64)
            continue
        # an arc is monotone in y between its top and bottom: split it there and test each piece on its half circle
        a0 = np.arctan2(y0 - yc, x0 - xc)
        a1 = a0 + sweep
        lo, hi = min(a0, a1), max(a0, a1)
        inner = np.arange(np.ceil((lo - np.pi / 2) / np.pi), np.floor((hi - np.pi / 2) / np.pi) + 1) * np.pi + np.pi / 2
        cut = np.concatenate([[lo], inner[(inner > lo) & (inner < hi)], [hi]])
        ycut = yc + r * np.sin(cut)
        ycut[0], ycut[-1] = (y0, y1) if sweep > 0 else (y1, y0)
        for k in range(len(cut) - 1):
            half = 1.0 if np.cos(0.5 * (cut[k] + cut[k + 1])) > 0.0 else -1.0
            ya, yb = ycut[k], ycut[k + 1]
            rises = (ya <= y) & (yb > y)
            falls = (ya > y) & (yb <= y)
            cross = rises | falls
            xhit = xc + half * np.sqrt(np.where(cross, np.maximum(r * r - (y - yc) ** 2, 0.0), 0.0))
            step = (rises & (xhit > x)).astype(np.int64) - (falls & (xhit > x)).astype(np.int64)
            total += step if sweep > 0 else -step
    return total
