"""Flank passes (swarf milling) of a blade's side, one pass with the flank of the cutter on five simultaneous axes.

Notation: S(u, v) the side with its outward normal N, u along it, v up it from v0 to v1; R radius of the
cutter. At a place u the cutter's axis goes through a0 = S(u, v0) + (R + x0) N and a1 = S(u, v1) + (R + x1) N + x2 D,
with D the direction along the side at v1. d(v) [mm] the least distance of S(u', v) from the axis over the u' near u,
less R: the excess that the cutter leaves at the height v, below 0 a gouge. Deviation: the greatest abs(d) over v.

The three numbers x of each place minimise the deviation. A change of x moves the axis by delta(v) and d by N.delta(v),
to first order, so the best change within a step is a linear program. Programs are solved one after another until the
deviation no longer decreases. The value of the last one is a lower bound for any small change. A developable surface
has the deviation 0; a twisted one does not, and its deviation is less with a thinner cutter.

Between two places tip and axis are interpolated linearly; places are added until the deviation half-way is within the
chord of that at the places.

Reference: [Liu1995] for the two offset points. Differs from source: they are only the initial guess.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.lazy import scipy
from chipload.planning.impeller.scene import Floats

#: number of heights of d, number of places u' on either side of u, and their range in radii of the cutter
_HEIGHTS, _EITHER_SIDE, _RANGE = 17, 40, 0.6
#: greatest number of linear programs of a place, and the step of the first [mm]
_ROUNDS, _STEP = 12, 0.5
#: a linear program that reduces the deviation by no more than this [mm] is the last
_CONVERGED = 2e-5
#: distance between the first places [mm], greatest number of refinements
_SPACING, _REFINEMENTS = 3.0, 4


@dataclass(frozen=True, eq=False)
class FlankPass:
    """A flank pass along a side.

    Parameters
    ----------
    u : (n,) places
    tip, axis : (n, 3) [mm], unit
    normal : (n, 3) of the side at half its height
    left, gouge : (n,) greatest and least d at each place [mm]
    least : (n,) [mm] lower bound of the deviation for small changes of the axis
    touches : (n, 2) least and greatest u' of the points at which the cutter is nearest to the side, over the heights
    """

    u: Floats
    tip: Floats
    axis: Floats
    normal: Floats
    left: Floats
    gouge: Floats
    least: Floats
    touches: Floats

    @property
    def deviation(self) -> float:
        """Greatest deviation of all places [mm]."""
        return float(np.maximum(self.left, -self.gouge).max())

    @property
    def unimproved(self) -> float:
        """Upper bound of the deviation of a place above that of the best axis nearby [mm]."""
        return float((np.maximum(self.left, -self.gouge) - self.least).max())

    @property
    def length(self) -> float:
        """Length of the tip's path [mm]."""
        return float(np.linalg.norm(np.diff(self.tip, axis=0), axis=1).sum())

    def back(self) -> FlankPass:
        """The same pass from its end to its beginning."""
        return FlankPass(**{f.name: getattr(self, f.name)[::-1] for f in fields(self)})


def flank_pass(
    surface: BSplinePatch, along: tuple[float, float], up: tuple[float, float], cutter: CatalogueCutter, chord: float
) -> FlankPass:
    """Flank pass of a cutter along a side with the least deviation at each place.

    Parameters
    ----------
    along, up : range of u, of v, ascending within 0 to 1
    chord : greatest difference [mm] between the deviation between two places and that at the places

    Raises
    ------
    InputError
        A range or the chord is out of its bounds, or the cutting part is shorter than the side is high.

    Examples
    --------
    A plane wall 30 mm long and 10 mm high: the deviation is 0.

    >>> from chipload.geometry.bspline import patch_through
    >>> wall = patch_through([[[0, 0, 0], [0, 0, 10]], [[30, 0, 0], [30, 0, 10]]], [0, 1], [0, 1])
    >>> found = flank_pass(wall, (0.1, 0.9), (0.0, 1.0), CatalogueCutter(10.0, 1.0), 0.01)
    >>> round(abs(found.deviation), 6), found.tip[0].round(6).tolist()
    (0.0, [3.0, -5.0, -1.0])
    """
    for name, (low, high) in (("along", along), ("up", up)):
        if not 0.0 <= low < high <= 1.0:
            raise InputError(f"{name} = [{low:g}, {high:g}]: must ascend within 0 to 1")
    if not chord > 0.0:
        raise InputError(f"chord = {chord:g} mm: must be above 0")
    job = _Side(surface, np.linspace(*up, _HEIGHTS), 0.5 * cutter.diameter)
    edge = surface.at(np.linspace(*along, 65), up[1])
    length = float(np.linalg.norm(np.diff(edge, axis=0), axis=1).sum())
    u = np.linspace(*along, max(math.ceil(length / _SPACING), 4) + 1)
    ends, least = _fit_axes(job, u)
    for _ in range(_REFINEMENTS):
        middle = 0.5 * (u[1:] + u[:-1])
        half = np.array([job.deviations(m, 0.5 * (ends[k] + ends[k + 1])) for k, m in enumerate(middle)])
        own = np.array([np.abs(job.deviations(x, e)).max() for x, e in zip(u, ends, strict=True)])
        coarse = np.flatnonzero(np.abs(half).max(axis=1) > np.maximum(own[1:], own[:-1]) + chord)
        if not len(coarse):
            break
        more, bound = _fit_axes(job, middle[coarse])
        u, ends = np.insert(u, coarse + 1, middle[coarse]), np.insert(ends, coarse + 1, more, axis=0)
        least = np.insert(least, coarse + 1, bound)
    found = [job.nearest(x, e) for x, e in zip(u.tolist(), ends, strict=True)]
    d = np.array([x[0] for x in found]) - job.radius
    touches = np.array([[x[3].min(), x[3].max()] for x in found])
    axis = ends[:, 1] - ends[:, 0]
    high = np.linalg.norm(axis, axis=1)
    axis /= high[:, None]
    if cutter.cutting_length is not None and cutter.cutting_length < high.max() + cutter.corner_radius:
        raise InputError(
            f"cutter D {cutter.diameter:g} r {cutter.corner_radius:g}: cutting_length_mm = {cutter.cutting_length:g}: "
            f"must be at least the height of the side and the corner radius, {high.max() + cutter.corner_radius:.4g}"
        )
    tip = ends[:, 0] - cutter.corner_radius * axis
    normal = surface.normal(u, np.full(len(u), 0.5 * (up[0] + up[1])))
    return FlankPass(u, tip, axis, normal, d.max(axis=1), d.min(axis=1), least, touches)


def offset_pass(
    surface: BSplinePatch, along: tuple[float, float], up: tuple[float, float], cutter: CatalogueCutter
) -> tuple[Floats, Floats, float]:
    """Tips and axes (9, 3) of a cutter whose axis goes through the two offset points, and its deviation [mm]."""
    job = _Side(surface, np.linspace(*up, _HEIGHTS), 0.5 * cutter.diameter)
    ends = np.array([job.ends(u, np.zeros(3)) for u in np.linspace(*along, 9).tolist()])
    axis = ends[:, 1] - ends[:, 0]
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    places = np.linspace(*along, 9)[2:-2:2].tolist()
    worst = max(float(np.abs(job.deviations(u, ends[k])).max()) for u, k in zip(places, (2, 4, 6), strict=True))
    return ends[:, 0] - cutter.corner_radius * axis, axis, worst


@dataclass(frozen=True, eq=False)
class _Side:
    """A side, the heights (m,) of d, the radius of the cutter."""

    surface: BSplinePatch
    heights: Floats
    radius: float

    def frame(self, u: float) -> tuple[Floats, Floats, Floats]:
        """S (2, 3), N (2, 3) at both ends of the axis, D at the upper one."""
        v = self.heights[[0, -1]]
        at = np.full(2, u)
        D = self.surface.at(at, v, 1, 0)[1]
        return self.surface.at(at, v), self.surface.normal(at, v), D / np.linalg.norm(D)

    def ends(self, u: float, x: Floats) -> Floats:
        """a0 and a1 (2, 3)."""
        S, N, D = self.frame(u)
        out = S + (self.radius + x[:2])[:, None] * N
        out[1] += x[2] * D
        return out

    def nearest(self, u: float, ends: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Distance (m,) of the side from the axis at every height, its direction, the place along the axis, u'."""
        speed = float(np.linalg.norm(self.surface.at(u, float(self.heights.mean()), 1, 0)))
        wide = _RANGE * self.radius / speed
        place, share = np.full(len(self.heights), u), np.linspace(-1.0, 1.0, 2 * _EITHER_SIDE + 1)
        for _ in range(2):
            U = np.clip(place[:, None] + wide * share, 0.0, 1.0)
            V = np.broadcast_to(self.heights[:, None], U.shape)
            P = self.surface.at(U.ravel(), V.ravel()).reshape(*U.shape, 3)
            vectors, _ = _from_line(P, ends)
            distance = np.linalg.norm(vectors, axis=-1)
            k = distance.argmin(axis=1)
            rows = np.arange(len(k))
            place, wide = U[rows, k], 2.0 * wide / _EITHER_SIDE
        vector, at = _from_line(P[rows, k], ends)
        return distance[rows, k], vector / distance[rows, k][:, None], at, place

    def deviations(self, u: float, ends: Floats) -> Floats:
        """(m,) d of an axis through ``ends`` (2, 3)."""
        return self.nearest(u, ends)[0] - self.radius

    def fitted(self, u: float, x: Floats) -> tuple[Floats, float]:
        """The x (3,) of least deviation near initial ones, and the bound of the last linear program."""
        step, least = _STEP, 0.0
        distance, direction, at, _ = self.nearest(u, self.ends(u, x))
        now = float(np.abs(distance - self.radius).max())
        _, N, D = self.frame(u)
        for _ in range(_ROUNDS):
            J = np.column_stack([-(1.0 - at) * (direction @ N[0]), -at * (direction @ N[1]), -at * (direction @ D)])
            d, one = distance - self.radius, np.ones((len(distance), 1))
            found = scipy.optimize.linprog(
                [0.0, 0.0, 0.0, 1.0], np.vstack([np.hstack([J, -one]), np.hstack([-J, -one])]), np.concatenate([-d, d]),
                bounds=[(-step, step)] * 3 + [(0.0, None)], method="highs",
            )  # fmt: skip
            least = float(found.fun)
            if now - least <= _CONVERGED:
                break
            new = x + found.x[:3]
            got = self.nearest(u, self.ends(u, new))
            there = float(np.abs(got[0] - self.radius).max())
            if there < now:
                x, now, (distance, direction, at, _) = new, there, got
            else:
                step *= 0.25
        return x, least


def _from_line(points: Floats, ends: Floats) -> tuple[Floats, Floats]:
    """Vectors (..., 3) from the line through ``ends`` to points, and their places along it, 0 to 1 between the ends."""
    A = ends[1] - ends[0]
    y = points - ends[0]
    at = (y @ A) / float(A @ A)
    return y - at[..., None] * A, at


def _fit_axes(job: _Side, u: Floats) -> tuple[Floats, Floats]:
    """Ends (n, 2, 3) of the axes at places (n,), and the bounds (n,); each begins with the x of the one before."""
    x: Floats = np.zeros(3)
    ends, least = [], []
    for place in u.tolist():
        x, bound = job.fitted(place, x)
        ends.append(job.ends(place, x))
        least.append(bound)
    return np.array(ends), np.array(least)
