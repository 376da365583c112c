"""Forward method of Stori and Wright: a pass that keeps the engagement angle constant by bending into the material.

Notation: P(i) points of the old surface, material on the RIGHT of travel; Q(i) points of the new surface, T(i) unit
feed, O(i) = Q(i) + R Rot(+90 deg) T(i) the cutter's centre, L = |P(i) - Q(i)| = 2 R sin(a*/2).

1. d = P(i+1) - Q(i), q = d . T(i), lambda = q - sqrt(q^2 - |d|^2 + L^2), Q(i+1) = Q(i) + lambda T(i)
2. T(i+1) = Rot(-a*/2) (P(i+1) - Q(i+1)) / L

First order in the step. It is sure for convex stock (material that bulges towards the cutter); elsewhere it can fail
and then states where: the centre stops or turns back, no Q(i+1) at distance L exists, or the corner is sharper than
90 deg - a*/2.

Reference: [Stori2000], as given (repaired) in [Uddin2007].
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.geometry.contour import Contour
from chipload.planning.result import Event

Floats = NDArray[np.float64]

#: ends of a pass round a closed contour nearer than this [mm] are made one
SEAM_MM = 1e-3


@dataclass(frozen=True, eq=False)
class ForwardPass:
    """Rows along the pass: ``centre`` (n, 2) [mm], ``heading`` (n, 2), ``made`` (n, 2) the new surface Q [mm]; ``old``
    the old surface as run; ``event`` states why it stopped before the end of the old surface; None: it did not.
    """

    centre: Floats
    heading: Floats
    made: Floats
    old: Contour
    event: Event | None

    def path(self) -> Contour:
        """The centre path as arcs that turn from one heading to the next, closed where the pass came round."""
        return self._smooth(self.centre)

    def surface(self) -> Contour:
        """The new surface, likewise."""
        return self._smooth(self.made)

    def _smooth(self, points: Floats) -> Contour:
        t = self.heading
        turn = np.arctan2(t[:-1, 0] * t[1:, 1] - t[:-1, 1] * t[1:, 0], (t[:-1] * t[1:]).sum(axis=1))
        points = points.copy()
        if self.event is None and self.old.closed and np.hypot(*(points[-1] - points[0])) < SEAM_MM:
            points[-1] = points[0]
        return Contour.from_bulges(points, np.append(np.tan(0.25 * turn), 0.0))


def steady_start(old: Contour, radius: float, a: float) -> tuple[Floats, Floats]:
    """Q(0) and T(0) at the start of the old surface, as they stay on a line or arc like its first segment."""
    p, t, kappa = (x[0] for x in old.at([0.0]))
    normal = np.array([-t[1], t[0]])
    turn = 0.0
    if kappa != 0.0:
        sign = math.copysign(1.0, kappa)
        under = kappa**-2 - (radius * math.sin(a)) ** 2
        rho = math.sqrt(max(under, 0.0)) - sign * radius * math.cos(a)
        curvature = sign / rho if rho > 0.0 else math.inf
        turn = math.atan2(radius * curvature * math.sin(a), 1.0 + radius * curvature * math.cos(a))
    c, s = math.cos(turn), math.sin(turn)
    heading = np.array([c * t[0] + s * t[1], c * t[1] - s * t[0]])
    normal = np.array([-heading[1], heading[0]])
    centre = p - radius * (math.sin(a) * heading - math.cos(a) * normal)
    return centre - radius * normal, heading


def forward_pass(old: Contour, radius: float, a: float, step: float) -> ForwardPass:
    """March the recursion along ``old``, once round if it is closed. O(length / step).

    Parameters
    ----------
    old : surface left by what was cut before, material on the right; the pass starts steady on its first segment
    radius, a : R [mm] and a* [rad]
    step : distance of the points P(i) [mm]; the error is first order in it

    Examples
    --------
    Old surface a concave arc of 7.9 mm, R = 5: the new one settles at 7.9370913 mm.

    >>> run = forward_pass(Contour.circle((0, 0), 7.9), 5.0, math.radians(11.478341), 0.002)
    >>> float(round(np.hypot(*run.made[-1]), 3))
    7.937
    """
    n = max(math.ceil(old.length / step), 3)
    surface = old.at(np.linspace(0.0, old.length, n + 1))[0]
    q, t = steady_start(old, radius, a)
    reach = 2.0 * radius * math.sin(0.5 * a)
    c, sn = math.cos(0.5 * a), math.sin(0.5 * a)
    centres: list[Floats] = []
    headings: list[Floats] = []
    made: list[Floats] = []
    event: Event | None = None
    for i in range(n + 1):
        o = q + radius * np.array([-t[1], t[0]])
        if centres and float((o - centres[-1]) @ t) <= 0.0:
            event = _stop("forward-stops", o, "the centre stops or turns back: no pass of this cutter continues")
            break
        centres.append(o)
        headings.append(t)
        made.append(q)
        if i == n:
            break
        d = surface[i + 1] - q
        along = float(d @ t)
        disc = along * along - float(d @ d) + reach * reach
        if disc < 0.0:
            event = _stop("forward-no-point", o, f"the old surface lies {math.sqrt(-disc):.4g} mm out of reach")
            break
        move = along - math.sqrt(disc)
        if move < 0.0:
            limit = 90.0 - math.degrees(a) / 2.0
            event = _stop(
                "forward-corner", o, f"convex corner sharper than {limit:.4g} deg: the new surface turns back"
            )
            break
        q = q + move * t
        w = (surface[i + 1] - q) / reach
        t = np.array([c * w[0] + sn * w[1], c * w[1] - sn * w[0]])
        t = t / math.hypot(t[0], t[1])
    return ForwardPass(np.array(centres), np.array(headings), np.array(made), old, event)


def _stop(code: str, o: Floats, text: str) -> Event:
    return Event(code, float(o[0]), float(o[1]), f"{text}; the pass stops here", failure=True)
