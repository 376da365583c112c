"""Meridians of the cutting part of a tool and of the shank and holder above it.

Notation: rho [mm] distance from the axis, z [mm] height above the tip; an arc is ``[e, f, r, a0, a1]``, its angle
counted from the direction -z towards +rho.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.lazy import LateModule

_body_distance = LateModule("chipload.simulation.clearance._body_distance")

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Body:
    """A body of revolution.

    Parameters
    ----------
    lines : (m, 4) float [mm], ``[rho0, z0, rho1, z1]``, z0 <= z1
    arcs : (k, 5) float [mm, rad]
    top : [mm] height at which it ends
    """

    lines: Floats
    arcs: Floats
    top: float

    @property
    def widest(self) -> float:
        """Greatest rho [mm]."""
        corner = (self.arcs[:, 0] + self.arcs[:, 2]).max(initial=0.0)
        return float(max(self.lines[:, [0, 2]].max(initial=0.0), corner))

    def box(self, axis: ArrayLike) -> tuple[Floats, Floats]:
        """Return the low and high corner (n, 3) [mm], from the tip, of the boxes round it for unit axes (n, 3).

        >>> shank = Body(np.array([[10.0, 25.0, 10.0, 75.0]]), np.zeros((0, 5)), 75.0)
        >>> shank.box([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])[0].tolist()
        [[25.0, -10.0, -10.0], [-10.0, -10.0, 25.0]]
        """
        up = np.asarray(axis, dtype=np.float64)
        aside = np.sqrt(np.clip(1.0 - up**2, 0.0, None))
        low, high = np.full(up.shape, np.inf), np.full(up.shape, -np.inf)
        rings = [(rho, z, 0.0) for rho, z in self.lines.reshape(-1, 2).tolist()]
        for rho, z, r in [*rings, *((e, f, r) for e, f, r, *_ in self.arcs.tolist())]:
            low = np.minimum(low, z * up - rho * aside - r)
            high = np.maximum(high, z * up + rho * aside + r)
        return low, high

    def distance(self, rho: float, z: float) -> float:
        """Signed distance [mm] of a point from the surface, below 0 inside."""
        return float(_body_distance.meridian(rho, z, self.lines, self.arcs, self.top))


def cutting_part(cutter: Cutter) -> Body:
    """Return the body from the tip to the end of the flutes.

    >>> ball = cutting_part(Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0))
    >>> [abs(ball.distance(*p)) for p in ((0.0, -1.0), (3.0, 1.0), (4.0, 10.0), (7.0, 10.0))]
    [1.0, 0.0, 1.0, 2.0]
    """
    if cutter.body:
        p = cutter.profile(0.0)
        return Body(np.hstack([p[:-1], p[1:]]), np.zeros((0, 5)), cutter.flute_length)
    arcs = [(*segment.centre, segment.radius, *segment.kappa) for segment in cutter.segments if segment.radius > 0.0]
    lines = [
        (segment.rho[0], segment.z[0], segment.rho[1], segment.z[1]) for segment in cutter.segments if segment.straight
    ]
    end = cutter.segments[-1]
    if cutter.undercut:
        lines.append((0.5 * (cutter.shank_diameter or 0.0), end.z[1], end.rho[1], end.z[1]))
    return Body(np.array(lines).reshape(-1, 4), np.array(arcs, dtype=np.float64).reshape(-1, 5), end.z[1])


def above_cutting(cutter: Cutter) -> Body:
    """Return the body of shank and holder, which must not touch anything.

    >>> cutter = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, shank_diameter=8.0, holder=((15.0, 40.0), (30.0, 50.0)))
    >>> body = above_cutting(cutter)
    >>> body.distance(5.0, 25.0), body.distance(19.0, 35.0), body.distance(15.0, 24.0), body.top
    (1.0, -1.0, 6.0, 75.0)
    """
    z, radius = cutter.flute_length, 0.5 * (cutter.shank_diameter or cutter.diameter)
    own = float(cutter.radius_at(z))
    lines = [[own, z, radius, z]] if radius > own else []
    if cutter.overhang > z:
        lines.append([radius, z, radius, cutter.overhang])
    z = cutter.overhang
    for length, diameter in cutter.holder:
        lines += [[radius, z, 0.5 * diameter, z], [0.5 * diameter, z, 0.5 * diameter, z + length]]
        z, radius = z + length, 0.5 * diameter
    return Body(np.array(lines, dtype=np.float64).reshape(-1, 4), np.zeros((0, 5)), z)
