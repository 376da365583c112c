"""Tooth engagement of a ball, bull nose or barrel in plane stock of given depth, beside the row that was cut before.

Notation: the surface that the row leaves is the plane z = 0 with its normal N = +z; d [mm] depth of the stock above it;
x the direction of the feed, f_z [mm] feed per tooth; the row before lies at y = -b, b the step-over with its sign
(None: full slot, nothing cut beside). Axis A = (sin(lead), sin(tilt) cos(lead), cos(tilt) cos(lead)): a positive lead
leans the spindle forward, a positive tilt to the left of the feed; beta the angle of A with N. r corner radius, e
radius of its centre's circle, C the middle of that circle (of a barrel cutter those of its flank arc, with e below 0);
kappa, rho, s, phi, u, nu, T, n as in :mod:`chipload.engagement.tooth_engagement`. The cutter touches z = 0 at the
origin.

A convex cutter that moves straight on along x meets uncut material wherever its surface faces forward (h > 0), so that
a point of it cuts where h > 0, z < d and z < g(y + b): g is the lower outline of the cutter seen along x, which the row
before has left. The first two are sinusoids of phi; the roots of the third are bracketed and bisected.

As functions of kappa the ends of the engagement meet like square roots, where a circle just touches z = d. The nodes
are those of Gauss in t, kappa = m - w cos(t), in which the ends are smooth; the weight of a node is its length along
the profile. Accuracy: docs/design/thinwall.md. The stock is plane: accurate where d is small against the surface's
radii of curvature.

Reference: [Engin2001] for kappa and s. Differs from source: depth and step-over normal to the surface.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import edge_lag
from chipload.engagement.tooth_engagement import ToothEngagement, tool_frame
from chipload.errors import InputError
from chipload.planning.thinwall.depth_range import depths_in_range

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

#: places of phi at which the row before is searched, before bisection
LOOKS = 90
#: halvings of a bracket of phi: 4 deg / 2^36
HALVINGS = 36
#: points of the lower outline of a bull nose
OUTLINE = 4001
#: shortest range of engagement that is kept [rad]
SHORT = 1e-9


@dataclass(frozen=True)
class CutterPose:
    """Position of a cutter on the surface, and the row before.

    Parameters
    ----------
    cutter : ball or bull nose: corner radius above 0, no taper, flat bottom; or a barrel that leans so that its flank
        arc touches
    feed_per_tooth : f_z > 0 [mm]
    step : b [mm]; the row before lies on the right of the feed (b > 0) or on its left; None: full slot
    lead, tilt : [rad], each below 90 deg in size
    clockwise : sense of the spindle (M3)

    Raises
    ------
    InputError
        A number is out of range, or the cutter is neither ball nor bull nose.
    """

    cutter: Cutter
    feed_per_tooth: float
    step: float | None
    lead: float = 0.0
    tilt: float = 0.0
    clockwise: bool = True

    def __post_init__(self) -> None:
        cutter = self.cutter
        if not cutter.corner_radius > 0.0:
            raise InputError(
                f"cutter.corner_radius_mm = {cutter.corner_radius:g}: must be above 0: choose a ball or bull nose"
            )
        angles = (("taper", cutter.taper), ("bottom", cutter.bottom))
        for key, value in () if cutter.flank_arc is not None else angles:
            if value != 0.0:
                raise InputError(f"cutter.{key}_deg = {math.degrees(value):g}: must be 0: choose a ball or bull nose")
        if not 0.0 < self.feed_per_tooth < math.inf:
            raise InputError(f"feed_per_tooth_mm = {self.feed_per_tooth:g}: must be above 0")
        if self.step is not None and not 0.0 < abs(self.step) <= cutter.diameter:
            raise InputError(
                f"step_over_mm = {self.step:g}: must be from above 0 to cutter.diameter_mm = {cutter.diameter:g}, "
                "or None for a full slot"
            )
        for key, value in (("lead", self.lead), ("tilt", self.tilt)):
            if not abs(value) < math.radians(89.0):
                raise InputError(f"{key}_deg = {math.degrees(value):g}: must be below 89 in size")
        low, high = self._arc
        if not low < self.beta < high:
            raise InputError(
                f"lean_deg, lead_deg: the axis leans by {math.degrees(self.beta):.4g} deg: must be between "
                f"{math.degrees(low):.4g} and {math.degrees(high):.4g}, where the flank arc of the barrel touches"
            )

    @property
    def axis(self) -> Floats:
        """A, (3,) float, in the frame of feed, left and normal."""
        c = math.cos(self.lead)
        return np.array([math.sin(self.lead), math.sin(self.tilt) * c, math.cos(self.tilt) * c])

    @property
    def beta(self) -> float:
        """Angle of the axis with the normal [rad]."""
        return math.acos(min(float(self.axis[2]), 1.0))

    @property
    def frame(self) -> Floats:
        """Rows T, n, A, (3, 3) float."""
        return tool_frame(self.axis, [1.0, 0.0, 0.0], self.clockwise)

    @property
    def deepest(self) -> float:
        """Depth r (1 - sin(beta)) [mm]: at greater depths the flank cuts too; of a barrel the corner or the flank line.

        >>> ball = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0)
        >>> round(CutterPose(ball, 0.05, None, lead=math.radians(30.0)).deepest, 9)
        2.5
        """
        if self.cutter.flank_arc is None:
            return self.cutter.corner_radius * (1.0 - math.sin(self.beta))
        low, high = self._arc
        return self.arc[0] * (1.0 - math.cos(min(self.beta - low, high - self.beta)))

    @property
    def arc(self) -> tuple[float, float]:
        """(r, e) [mm] of the arc that touches the surface: radius, and the circle of its centres."""
        return self.cutter.finishing_arc[:2]

    @property
    def _arc(self) -> tuple[float, float]:
        """Range of kappa [rad] of the arc."""
        arc = self.cutter.flank_arc
        if arc is None:
            return -1.0, math.pi
        return arc.kappa_from, arc.kappa_at(min(self.cutter.flute_length, arc.z_to))

    @property
    def below(self) -> float:
        """Upper bound [mm] of the reach of the cutter along the surface below the contact, towards the tip."""
        cutter, b = self.cutter, self.beta
        if cutter.flank_arc is None:
            return cutter.corner_radius
        rho, z = cutter.profile(1e-3).T
        r, e, f = cutter.finishing_arc
        up, out = f - r * math.cos(b), e + r * math.sin(b)
        return float(((up - z) * math.sin(b) + (out + rho) * math.cos(b)).max())

    @property
    def deepest_is(self) -> str:
        """Text for messages: the meaning of ``deepest``."""
        return "where the flank begins to cut" if self.cutter.flank_arc is None else "where the barrel's arc ends"

    @property
    def meets(self) -> float:
        """Radius [mm] of the circle with which the cutter meets the stock, in the plane of feed and normal."""
        r, e = self.arc
        return r if e >= 0.0 else r + e / math.sin(self.beta)

    def engagement(self, depths: ArrayLike, nodes: int = 8) -> ToothEngagement:
        """Tooth engagement on stock of given depths: :func:`engagement_of_depths`."""
        return engagement_of_depths(self, depths, nodes)

    @property
    def centre(self) -> Floats:
        """C, (3,) float [mm], from the point where the cutter touches z = 0."""
        r, e = self.arc
        s = math.sin(self.beta)
        up = np.array([0.0, 0.0, 1.0])
        return r * up if s < 1e-12 else r * up - e * (math.cos(self.beta) * self.axis - up) / s

    def outline(self, y: Floats) -> Floats:
        """Height g of the cutter's lower outline, seen along the feed, at y [mm]; infinite beside it."""
        r, e = self.arc
        C = self.centre
        if e == 0.0:
            inside = np.abs(y - C[1]) <= r
            return np.where(inside, C[2] - np.sqrt(np.where(inside, r * r - (y - C[1]) ** 2, 0.0)), np.inf)
        low, high = self._arc
        a = np.linspace(-0.5 * math.pi, 0.5 * math.pi, OUTLINE * (1 if e > 0.0 else 16))
        if e < 0.0:
            kappa = np.arccos(np.clip(np.cos(a) * self.axis[2] - np.sin(a) * self.axis[1], -1.0, 1.0))
            a = a[(kappa > low) & (kappa < high)]
        w = np.stack([0.0 * a, np.sin(a), -np.cos(a)], axis=1)
        across = w - (w @ self.axis)[:, None] * self.axis
        size = np.linalg.norm(across, axis=1)
        p = C + r * w + e * across / np.where(size > 1e-12, size, 1.0)[:, None]
        return np.asarray(np.interp(y, p[:, 1], p[:, 2], left=np.inf, right=np.inf))


def _nodes(low: Floats, high: Floats, number: int) -> tuple[Floats, Floats]:
    """Nodes and weights (n, number) between bounds (n,), for integrands with square roots at both ends."""
    t, w = np.polynomial.legendre.leggauss(number)
    t, w = 0.5 * math.pi * (t + 1.0), 0.5 * math.pi * w
    middle, half = 0.5 * (low + high)[:, None], 0.5 * (high - low)[:, None]
    return middle - half * np.cos(t), half * np.sin(t) * w


def _breaks(posture: CutterPose, d: Floats) -> Floats:
    """Values of kappa on the corner between which the ends of the engagement are smooth, (n, m) increasing [rad].

    Where the circle of z = d is touched, and where two of the three borders (z = d, h = 0, the row before) meet; of a
    ball also where the border of the row before is touched. With C as origin h = 0 is x = 0 on a ball.
    """
    r, e = posture.arc
    A, b, step = posture.axis, posture.beta, posture.step
    psi = np.arccos(np.clip(1.0 - d / r, -1.0, 1.0))
    low, high = np.maximum(b - psi, 0.0), b + psi
    ring = 2.0 * e * math.sin(b)
    whole = np.where(d > ring, np.arccos(np.clip(1.0 - (d - ring) / r, -1.0, 1.0)) - b, 0.0)
    found = [low, high, whole, np.abs(psi - b), np.full(len(d), abs(posture.lead))]

    def kappa(*nu: Floats) -> Floats:
        return np.asarray(np.arccos(np.clip(-(nu[0] * A[0] + nu[1] * A[1] + nu[2] * A[2]), -1.0, 1.0)))

    found += [kappa(0.0 * d, side * np.sin(psi), -np.cos(psi)) for side in (-1.0, 1.0)]
    if step is not None:
        slope = np.zeros(len(d))
        if e == 0.0:
            slope = np.full(len(d), math.asin(0.5 * abs(step) / r))
            q = r * np.sin(psi)
            y = np.maximum(q - abs(step), -0.5 * abs(step))
            share = np.linspace(0.0, 1.0, 65)
            on = -0.5 * abs(step) + share * (y + 0.5 * abs(step))[:, None]
            x = np.sqrt(np.maximum(2.0 * abs(step) * on + step**2, 0.0))
            z = -np.sqrt(np.maximum(r * r - (on + abs(step)) ** 2, 0.0))
            along = kappa(x / r, math.copysign(1.0, step) * on / r, z / r)
            found += [along[:, -1], along.min(axis=1), along.max(axis=1)]
        found.append(kappa(0.0 * d, -math.copysign(1.0, step) * np.sin(slope), -np.cos(slope)))
    return np.sort(np.clip(np.stack(found, axis=1), low[:, None], high[:, None]), axis=1)


def _profile(posture: CutterPose, d: Floats, number: int) -> tuple[Floats, Floats, Floats]:
    """Nodes of the part of the profile below z = d: kappa, rho and weight [mm], (n, k) each; weight 0: none."""
    r, e = posture.arc
    b, s = posture.beta, math.sin(posture.beta)
    edges = _breaks(posture, d)
    parts = [_nodes(edges[:, i], edges[:, i + 1], number) for i in range(edges.shape[1] - 1)]
    kappa, weight = np.hstack([k for k, _ in parts]), r * np.hstack([w for _, w in parts])
    rho = e + r * np.sin(kappa)
    if e <= 0.0 or s < 1e-12:
        return kappa, rho, weight
    rise = d - r * (1.0 - math.cos(b))
    inner = np.clip(e - rise / s, 0.0, e)
    full = np.clip(rise / s - e, inner, e)
    p1, v1 = _nodes(inner, full, number)
    p2, v2 = _nodes(full, np.full(len(d), e), number)
    flat = np.hstack([p1, p2])
    return (
        np.hstack([np.zeros_like(flat), kappa]),
        np.hstack([flat, rho]),
        np.hstack([v1, v2, weight]),
    )


def engagement_of_depths(posture: CutterPose, depths: ArrayLike, nodes: int = 8) -> ToothEngagement:
    """Tooth engagement in stock of given depths, one step for each depth.

    Parameters
    ----------
    posture : cutter, feed, step-over, lead and tilt
    depths : (n,) float [mm], above 0, at most ``posture.deepest``
    nodes : of the profile, between each two kappa where the engagement changes its form

    Returns
    -------
    ToothEngagement
        Every tooth alike; runout: :func:`chipload.engagement.tooth_surfaces.chips_of_teeth`.

    Raises
    ------
    InputError
        A depth is out of its range.

    Examples
    --------
    A ball that stands upright in a slot is engaged from 0 to pi.

    >>> ball = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0)
    >>> rows = engagement_of_depths(CutterPose(ball, 0.05, None), [0.5]).rows
    >>> rows[0, :2].round(6).tolist(), round(float((rows[:, 3] - rows[:, 2]).sum()), 6)
    ([0.0, 3.141593], 2.255134)
    >>> round(5.0 * math.acos(0.9), 6)
    2.255134
    """
    on_corner = posture.cutter.flank_arc is None
    d = depths_in_range(
        posture,
        depths,
        "lean the cutter less or take a greater corner radius"
        if on_corner
        else "lean the cutter so that it touches the middle of the arc",
    )
    circles = _circles(posture, d, nodes)
    starts, lengths = _ranges(circles, d)
    cuts = _edge_cuts(circles, d, starts, lengths)
    step, node, part = np.nonzero(cuts)
    low = starts[step, node, part] % math.tau
    count = np.bincount(step, minlength=len(d))
    sine, cosine, weight = circles.sine, circles.cosine, circles.weight
    s_to = np.cumsum(weight, axis=1)
    s_from = s_to - weight
    height = posture.cutter.finishing_arc[2] - posture.arc[0] * cosine
    rate = edge_lag(posture.cutter) * sine
    lag = np.maximum(edge_lag(posture.cutter) * height - 0.5 * rate * weight, 0.0)
    table = np.stack([s_from, circles.rho, height, sine, cosine, lag, rate], axis=-1).reshape(-1, 7)
    rows = np.column_stack(
        [
            low,
            low + lengths[step, node, part],
            s_from[step, node],
            s_to[step, node],
            circles.along[step, node],
            circles.offset[step, node],
            0.0 * low,
        ]
    )
    owner = step * sine.shape[1] + node
    start = np.concatenate([[0], np.cumsum(count)])
    return ToothEngagement(start, rows, np.full(len(rows), -1), owner, table)


class _Circles(NamedTuple):
    """Circles about the axis, one a node of the profile; arrays of (n, k).

    Parameters
    ----------
    posture : of the cutter
    rho, weight : radius, and length along the profile [mm]; weight 0: none
    sine, cosine : of kappa
    along, offset : of the chip thickness [mm]
    y0, z0 : of the centre [mm]
    """

    posture: CutterPose
    rho: Floats
    weight: Floats
    sine: Floats
    cosine: Floats
    along: Floats
    offset: Floats
    y0: Floats
    z0: Floats

    def height(self, phi: Floats) -> Floats:
        """Z at angles (n, k, m)."""
        T, n, _ = self.posture.frame
        return np.asarray(self.z0[..., None] + self.rho[..., None] * (np.cos(phi) * n[2] + np.sin(phi) * T[2]))

    def over_row_before(self, step: float, phi: Floats) -> Floats:
        """Height [mm] over the stock that the row before, at a distance of ``step``, has left; above 0: no stock."""
        T, n, _ = self.posture.frame
        y = self.y0[..., None] + self.rho[..., None] * (np.cos(phi) * n[1] + np.sin(phi) * T[1])
        return np.asarray(self.height(phi) - np.minimum(self.posture.outline(y + step), 1e6))


def _circles(posture: CutterPose, d: Floats, nodes: int) -> _Circles:
    T, _, A = posture.frame
    kappa, rho, weight = _profile(posture, d, nodes)
    sine, cosine = np.sin(kappa), np.cos(kappa)
    above = -posture.arc[0] * cosine  # of the circle over C, along the axis
    speed = posture.feed_per_tooth * np.array([1.0, 0.0, 0.0])
    along, offset = sine * float(speed @ T), -cosine * float(speed @ A)
    y0, z0 = (posture.centre[i] + above * A[i] for i in (1, 2))
    return _Circles(posture, rho, weight, sine, cosine, along, offset, y0, z0)


def _ranges(circles: _Circles, d: Floats) -> tuple[Floats, Floats]:
    """Beginnings and lengths (n, k, m) [rad] of the ranges of phi within which no border is crossed."""
    posture = circles.posture
    T, n, _ = posture.frame
    breaks = [
        _roots(0.0 * circles.along, circles.along, circles.offset),
        _roots(circles.rho * n[2], circles.rho * T[2], circles.z0 - d[:, None]),
    ]
    if posture.step is not None:
        breaks.append(_crossings(partial(circles.over_row_before, posture.step), circles.rho.shape))
    ends = np.sort(np.concatenate(breaks, axis=-1), axis=-1)
    first = np.where(np.isfinite(ends[..., :1]), ends[..., :1], 0.0)
    ends = np.where(np.isfinite(ends), ends, first + math.tau)
    stops = np.concatenate([ends[..., 1:], first + math.tau], axis=-1)
    starts = np.where(np.isfinite(ends), ends, first)
    lengths = stops - starts
    whole = np.isclose(starts[..., 0], first[..., 0] + math.tau)  # no break at all: the whole circle
    starts[..., 0] = np.where(whole, 0.0, starts[..., 0])
    lengths[..., 0] = np.where(whole, math.tau, lengths[..., 0])
    return starts, lengths


def _edge_cuts(circles: _Circles, d: Floats, starts: Floats, lengths: Floats) -> Bools:
    """Whether the edge is in stock in each range, (n, k, m) bool."""
    posture, middle = circles.posture, starts + 0.5 * lengths
    cuts = circles.along[..., None] * np.sin(middle) + circles.offset[..., None] > 1e-9 * posture.feed_per_tooth
    cuts &= (circles.height(middle) < d[:, None, None]) & (lengths > SHORT) & (circles.weight > 0.0)[..., None]
    if posture.step is not None:
        cuts &= circles.over_row_before(posture.step, middle) < 0.0
    return np.asarray(cuts)


def _roots(a: Floats, b: Floats, c: Floats) -> Floats:
    """Zeros of a cos(phi) + b sin(phi) + c in 0 .. 2 pi, (..., 2); infinite where there are none."""
    size = np.hypot(a, b)
    some = size > np.abs(c)
    half = np.arccos(np.where(some, -c / np.where(some, size, 1.0), 0.0))
    middle = np.arctan2(b, a)
    out = np.stack([middle + half, middle - half], axis=-1) % math.tau
    return np.where(some[..., None], out, np.inf)


def _crossings(function: Callable[[Floats], Floats], shape: tuple[int, ...]) -> Floats:
    """Zeros (..., 6) [rad] of a function of phi (..., m) -> (..., m), at most six; the others are infinite."""
    phi = np.linspace(0.0, math.tau, LOOKS + 1)
    sign = function(np.broadcast_to(phi, (*shape, LOOKS + 1))) > 0.0
    change = sign[..., 1:] != sign[..., :-1]
    order = np.argsort(~change, axis=-1, kind="stable")[..., :6]
    there = np.take_along_axis(change, order, axis=-1)
    low, high = phi[order], phi[order + 1]
    before = np.take_along_axis(sign, order, axis=-1)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        same = (function(middle) > 0.0) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.where(there, 0.5 * (low + high), np.inf)
