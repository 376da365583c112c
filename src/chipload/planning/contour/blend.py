"""Eased joints: the line-arc joints of a centre path replaced by clothoids, so that the backward method becomes exact.

Notation: kappa [1/mm] curvature of the centre path, positive away from the material; L [mm] length of the clothoid
between the line and the arc; rho [mm] radius of the drawn arc of the centre path, rho' that of the eased one; theta
[rad] the angle between the two lines. The clothoid is laid as arcs of stepwise curvature that keep the tangent.

P* has no kink, and a cutter of radius R makes it, where its curvature stays below 1/R:
(kappa + kappa' R sin a / g^2) / g <= 1/R with g = sqrt(1 + 2 R kappa cos a + R^2 kappa^2); from kappa = 0 that is
kappa' <= 1 / (R^2 sin a), and L >= R^2 sin a / rho'.

Reference: derived; checked against [Uddin2007]'s corner, where L = 1.66 mm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.geometry.contour import Contour
from chipload.geometry.distance import distance
from chipload.planning.result import Event

Floats = NDArray[np.float64]

#: arcs that stand for one clothoid
ARCS = 48
#: longer than the limit by this factor: the arcs step about the clothoid
MARGIN = 1.02


@dataclass(frozen=True, eq=False)
class Blend:
    """A path with eased joints, its greatest distance from the drawn one [mm], and what could not be eased."""

    path: Contour
    deviation_mm: float
    events: tuple[Event, ...]


def clothoid_length(radius: float, engagement: float, rho: float, sign: float) -> float:
    """Shortest clothoid [mm] from a line to curvature ``sign / rho`` that keeps P* within the reach of the cutter.

    The limit kappa' <= (g/R - kappa) g^2 / (R sin a) is taken at its least over 0..sign/rho (200 values).
    """
    kappa = sign * np.linspace(0.0, 1.0 / rho, 200)
    g = np.sqrt(1.0 + 2.0 * radius * kappa * math.cos(engagement) + (radius * kappa) ** 2)
    rate = (g / radius - kappa) * g**2 / (radius * math.sin(engagement))
    return math.inf if rate.min() <= 0.0 else float(MARGIN / (rho * rate.min()))


def corner(theta: float, rho: float, length: float) -> Floats:
    """Curvature [1/mm] and length [mm] of the 2 ARCS + 1 arcs of an eased corner: clothoid in, arc, clothoid out.

    They turn by ``theta`` in all, positive to the left.
    """
    sign = math.copysign(1.0, theta)
    step = length / ARCS
    ramp = (np.arange(ARCS) + 0.5) / ARCS / rho
    middle = abs(theta) - length / rho
    kappa = sign * np.concatenate([ramp, [1.0 / rho], ramp[::-1]])
    lengths = np.concatenate([np.full(ARCS, step), [middle * rho], np.full(ARCS, step)])
    return np.column_stack([kappa, lengths])


def _chained_segments(table: Floats, start: Floats, heading: float) -> Floats:
    """Segments of arcs (kappa, length) laid one after the other from ``start`` along ``heading`` [rad]."""
    rows = []
    p = np.array(start)
    for kappa, length in table:
        if length <= 0.0:
            continue
        normal = np.array([-math.sin(heading), math.cos(heading)])
        centre = p + normal / kappa
        heading += kappa * length
        q = centre - np.array([-math.sin(heading), math.cos(heading)]) / kappa
        rows.append([*p, *q, *centre, kappa * length])
        p = q
    return np.array(rows)


def ease_arcs(path: Contour, radius: float, engagement: float, tolerance_mm: float) -> Blend:
    """``path`` with clothoids at both ends of every arc that stands between two lines it is tangent to.

    The arc's radius is chosen so that the path leaves the drawn one least; where that is still more than
    ``tolerance_mm`` the clothoids are shortened until it is not, and an event states that the engagement overshoots.
    Other joints with a step of curvature stay as they are, and are reported. O(arcs x samples).
    """
    seg = path.segments.copy()
    n = len(seg)
    events: list[Event] = []
    pieces: dict[int, Floats] = {}
    worst = 0.0
    trimmed = np.zeros((n, 2))  # taken off the start and the end of a line
    for k in range(n):
        if seg[k, 6] == 0.0:
            continue
        before, after = (k - 1) % n, (k + 1) % n
        inner = path.closed or 0 < k < n - 1
        x, y = path.at(0.5 * (path.knots[k] + path.knots[k + 1]))[0][0].tolist()
        if not inner or seg[before, 6] != 0.0 or seg[after, 6] != 0.0 or n < 3:
            events.append(Event("joint-kept", x, y, "arc not between two lines: its joints stay sharp"))
            continue
        theta, rho = float(seg[k, 6]), float(path.radii[k])
        wanted = clothoid_length(radius, engagement, rho, math.copysign(1.0, theta))
        room = min(path.lengths[before] - trimmed[before].sum(), path.lengths[after] - trimmed[after].sum())
        best = _fit(theta, rho, radius, engagement, wanted, room, tolerance_mm)
        if best is None:
            events.append(
                Event(
                    "joint-kept",
                    x,
                    y,
                    f"no easing of the {rho:.4g} mm arc stays within tolerance_mm = {tolerance_mm:g}: joint kept sharp",
                )
            )
            continue
        table, set_back, deviation, share = best
        if share < 1.0:
            events.append(
                Event(
                    "joint-short",
                    x,
                    y,
                    f"clothoid shortened to {share:.0%} of what constant engagement needs, to stay within "
                    f"tolerance_mm = {tolerance_mm:g}",
                )
            )
        u = (seg[before, 2:4] - seg[before, 0:2]) / path.lengths[before]
        pieces[k] = _chained_segments(table, seg[k, 0:2] - set_back * u, math.atan2(u[1], u[0]))
        trimmed[before, 1] += set_back
        trimmed[after, 0] += set_back
        worst = max(worst, deviation)
    rows = []
    for k in range(n):
        if k in pieces:
            rows.append(pieces[k])
            continue
        row = seg[k].copy()
        for neighbour, at in (((k - 1) % n, 0), ((k + 1) % n, 2)):
            if neighbour in pieces and row[6] == 0.0:
                row[at : at + 2] = pieces[neighbour][-1, 2:4] if at == 0 else pieces[neighbour][0, 0:2]
        if math.hypot(row[2] - row[0], row[3] - row[1]) > 0.0 or row[6] != 0.0:
            rows.append(row[None])
    return Blend(Contour(np.vstack(rows)), worst, tuple(events))


def _fit(
    theta: float, rho: float, radius: float, engagement: float, wanted: float, room: float, tolerance: float
) -> tuple[Floats, float, float, float] | None:
    """The eased corner that leaves the drawn arc least: arcs, set-back along the lines, deviation, share of L."""
    sign = math.copysign(1.0, theta)
    half = 0.5 * abs(theta)
    if half >= 0.5 * math.pi - 1e-9 or not math.isfinite(wanted):
        return None
    share = 1.0
    while share > 0.02:
        length = wanted * share
        low, high = 0.3 * rho, rho
        tried = [
            (_deviation(theta, r, clothoid_length(radius, engagement, r, sign) * share, rho), r)
            for r in np.linspace(low, high, 15)
        ]
        _, at = min(tried)
        span = (high - low) / 14.0
        for _ in range(4):
            grid = np.linspace(max(at - span, low), min(at + span, high), 9)
            tried = [(_deviation(theta, r, clothoid_length(radius, engagement, r, sign) * share, rho), r) for r in grid]
            _, at = min(tried)
            span /= 4.0
        deviation = min(tried)[0]
        length = clothoid_length(radius, engagement, at, sign) * share
        if deviation <= tolerance:
            set_back = _set_back(theta, at, length) - rho * math.tan(half)
            if set_back <= room - 1e-6:
                return corner(theta, at, length), set_back, deviation, share
        share *= 0.9
    return None


def _chain(theta: float, rho: float, length: float) -> Floats:
    return _chained_segments(corner(theta, rho, length), np.zeros(2), 0.0)


def _set_back(theta: float, rho: float, length: float) -> float:
    """Distance from the crossing of the lines to the start of the eased corner [mm]."""
    end = _chain(theta, rho, length)[-1, 2:4]
    return float(np.linalg.norm(end)) / (2.0 * math.cos(0.5 * theta))


def _deviation(theta: float, rho: float, length: float, drawn: float) -> float:
    """Greatest distance of the eased corner (rho, L) from the drawn one (arc of radius ``drawn``) [mm]."""
    if not math.isfinite(length) or length / rho > abs(theta):
        return math.inf
    chain = _chain(theta, rho, length)
    back = _set_back(theta, rho, length)
    tangent = drawn * math.tan(0.5 * abs(theta))
    u = np.array([math.cos(theta), math.sin(theta)])
    vertex = np.array([back, 0.0])
    far = back + tangent
    a, b = vertex - [tangent, 0.0], vertex + tangent * u
    centre = a + np.array([0.0, math.copysign(drawn, theta)])
    there = np.array(
        [
            [*(vertex - [far, 0.0]), *a, 0.0, 0.0, 0.0],
            [*a, *b, *centre, theta],
            [*b, *(vertex + far * u), 0.0, 0.0, 0.0],
        ]
    )
    return float(distance(there, np.vstack([chain[:, 0:2], Contour(chain[ARCS : ARCS + 1]).flatten(1e-3)])).max())
