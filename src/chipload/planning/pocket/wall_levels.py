"""Levels of a pocket, as few as the form error of its walls allows.

Notation: candidates h_0 > ... > h_m are heights at which a level may end. The level from h_i down to h_j is cut while
all below h_j stands, so that its walls bend by what is left: e(i, j) is its greatest form error, inf where it exceeds
the limit. The first levels end at a free edge and are shallow, those below are held by the walls above them.

The plan has the fewest levels; among plans of as many levels, it has the least of the greatest errors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.cutting.wall_error import Milling, wall_error_along

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class WallLevels:
    """Levels of a pocket from above.

    Parameters
    ----------
    depths : (n,) float [mm], of each level
    errors : (n,) float [mm], greatest planned form error of the walls of each
    constant : [mm], greatest depth of which all levels but the last keep the limit too; 0: none of the candidates
    constant_levels : their number
    """

    depths: Floats
    errors: Floats
    constant: float
    constant_levels: int


@dataclass(frozen=True)
class LevelCut:
    """The pass that makes the walls of a level.

    Parameters
    ----------
    cutter, material : as for the force
    feed_per_tooth, radial_depth : [mm]
    milling : down or up
    engagement : [rad], greatest that the pass keeps, in corners
    holder : [mm/N] compliance of what holds the cutter
    """

    cutter: Cutter
    material: Material
    feed_per_tooth: float
    radial_depth: float
    milling: Milling
    engagement: float
    holder: float

    def engagement_on_arc(self, radius: float) -> float:
        """Engagement [rad] along an inside arc of the wall; inf: along a straight wall.

        The cutter's centre runs on a circle of r - R, the stock ends at r - d from its middle.

        Examples
        --------
        >>> mill = Cutter(8.0, 3, 0.5, 16.0, 24.0, 6e5)
        >>> metal = Material("metal", 800.0, 200.0, 0.0, 0.0, 0.0, 0.0, source="made up for this example")
        >>> finish = LevelCut(mill, metal, 0.04, 0.3, "down", 1.0, 0.0)
        >>> [round(math.degrees(finish.engagement_on_arc(r)), 1) for r in (math.inf, 1e6, 5.0, 4.1)]
        [22.3, 22.3, 50.5, 57.3]
        """
        R, d = self.cutter.radius, self.radial_depth
        if math.isinf(radius):
            return min(math.acos(1.0 - d / R), self.engagement)
        centre = radius - R
        if centre <= 0.0:
            return self.engagement
        cosine = ((radius - d) ** 2 - centre**2 - R**2) / (2.0 * centre * R)
        return min(math.acos(min(max(cosine, -1.0), 1.0)), self.engagement)

    def window(self, depth: float) -> float:
        """Length [mm] of the edge that cuts at once along a straight wall, at most ``depth``."""
        slope = math.tan(self.cutter.helix)
        return depth if slope <= 0.0 else min(depth, self.cutter.radius * self.engagement_on_arc(math.inf) / slope)

    def errors(self, depth: float, engagement: ArrayLike, compliance: ArrayLike) -> Floats:
        """Greatest form error (p,) [mm] of a level at places of its walls.

        The error is convex in the compliance of the work: that between none and the greatest is taken from the chord,
        which is not below it.

        Parameters
        ----------
        depth : of the level [mm]
        engagement : (p,) [rad]
        compliance : (p,) [mm/N] of the work, normal to the wall
        """
        kinds, own = np.unique(np.asarray(engagement, dtype=np.float64), return_inverse=True)
        c = np.asarray(compliance, dtype=np.float64)
        most = float(c.max(initial=0.0))
        wall = np.zeros(len(kinds))
        ends = (math.pi - kinds, wall + math.pi) if self.milling == "down" else (wall, kinds)
        rigid, soft = (
            1e-3
            * wall_error_along(
                *ends,
                np.full(len(kinds), self.feed_per_tooth),
                self.cutter,
                self.material,
                depth,
                milling=self.milling,
                work_compliance=self.holder + work,
            )["form_error_um"][own]
            for work in (0.0, most)
        )
        return np.asarray(rigid + (soft - rigid) * c / most if most > 0.0 else rigid)


def fewest_levels(heights: Sequence[float], error: Floats) -> WallLevels | None:
    """The levels of a pocket; None: no choice of candidates keeps the limit.

    Parameters
    ----------
    heights : (m + 1,) [mm] candidates, from the top of the stock down to the floor, evenly spaced
    error : (m + 1, m + 1) float [mm], e(i, j) for i < j; inf where it exceeds the limit

    Examples
    --------
    A level from the top may be 1 mm deep, one that begins at 1 mm 2, one at 2 mm 1, one at 3 mm 3.

    >>> ok = {(0, 1): 5.0, (1, 2): 3.0, (1, 3): 6.0, (2, 3): 2.0, (3, 4): 1.0, (3, 5): 2.0, (3, 6): 4.0}
    >>> error = np.full((7, 7), np.inf)
    >>> for (i, j), e in ok.items():
    ...     error[i, j] = e
    >>> found = fewest_levels([0.0, -1.0, -2.0, -3.0, -4.0, -5.0, -6.0], error)
    >>> found.depths.tolist(), found.errors.tolist(), found.constant
    ([1.0, 2.0, 3.0], [5.0, 6.0, 4.0], 0.0)
    """
    m = len(heights) - 1
    best: list[tuple[int, float, int]] = [(0, 0.0, -1)]
    for j in range(1, m + 1):
        ends = [(best[i][0] + 1, max(best[i][1], float(error[i, j])), i) for i in range(j)]
        best.append(min(ends, key=lambda end: (math.isinf(end[1]), *end)))
    if math.isinf(best[m][1]):
        return None
    edges = [m]
    while edges[0] > 0:
        edges.insert(0, best[edges[0]][2])
    z = np.asarray(heights, dtype=np.float64)
    constant = 0
    for k in range(1, m + 1):
        steps = [*range(0, m, k), m]
        if np.isfinite(error[steps[:-1], steps[1:]]).all():
            constant = k
    return WallLevels(
        -np.diff(z[edges]),
        np.asarray(error[edges[:-1], edges[1:]]),
        constant * float(z[0] - z[1]),
        math.ceil(m / constant) if constant else 0,
    )
