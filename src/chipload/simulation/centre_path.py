"""Engagement of the rim with uncut stock from the path of the cutter's centre, without a boundary of the stock.

Notation: R cutter radius, O centre, T unit feed direction, n = Rot(+90 deg) T; a moment is a motion and the share
(0..1) of it that has been travelled; immersion phi [rad] counts from n clockwise, 0..pi the front half of the rim.

A point has been cut before a moment if it lay outside the initial stock or if a centre before that moment came
nearer to it than R. The present boundary of the stock is not used: the rim is examined point by point.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.geometry.contour import Region
from chipload.lazy import LateModule
from chipload.program.program import ARC_CCW, ARC_CW, Program
from chipload.simulation.material import strips

_centre_path = LateModule("chipload.simulation._centre_path")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

#: a point counts as cut when a centre came nearer than R minus this [mm]: the wall a cutter has just made lies at R
TOUCH_MM = 1e-9
#: what a rim is asked for is displaced by at most so much [mm]
DISPLACED_MM = 1e-5
#: length of path [mm] behind the cutter that moves with it: a displacement by d of what was cut a length s before moves
#: the end of the engagement by d / s [rad], 0.06 deg for 1 nm and 1 um; a cutter may come back to a place sooner than
#: after 0.01 mm
OWN_MM = 0.001
#: engaged pieces of the rim that are kept with their ends; ``angle`` always counts all of them
PIECES = 4
#: transitions on the rim are halved down to this [rad]
PRECISION = 1e-8
#: cells of the grid at most; the cell is R / 32 where that needs fewer
CELLS = 4_000_000


@dataclass(frozen=True, eq=False)
class CentrePath:
    """The centre path in the plane, motion after motion, and the initial stock.

    Parameters
    ----------
    segments : (n, 7) float [mm, rad]
        Motions as rows of :class:`chipload.geometry.contour.Contour`; they need not meet, and may have no length.
    radius : R > 0 [mm]
    stock : the initial stock; None: solid everywhere
    active : (n,) bool
        Whether the motion cuts; others keep their place in the numbering only. None: all of them.

    Raises
    ------
    InputError
        A shape is wrong, a value is not finite, the radius is not above 0, or no motion cuts.

    Examples
    --------
    A second pass 0.1 mm beside the first, R = 5: cos a = 1 - s/R.

    >>> two = [[-50, 0.1, 50, 0.1, 0, 0, 0], [-50, 0, 50, 0, 0, 0, 0]]
    >>> a = rim_engagement(CentrePath(two, 5.0), [1], [0.5]).angle
    >>> float(round(np.degrees(a[0]), 3))
    11.478
    """

    segments: Floats
    radius: float
    stock: Region | None = None
    active: Bools | None = None

    def __post_init__(self) -> None:
        seg = np.array(self.segments, dtype=np.float64)
        if seg.ndim != 2 or seg.shape[1] != 7 or not np.isfinite(seg).all():
            raise InputError(f"centre path: segments of shape {seg.shape}: need (n, 7) finite numbers")
        if not (self.radius > 0.0 and math.isfinite(self.radius)):
            raise InputError(f"centre path: radius = {self.radius:g} mm: must be above 0")
        active = np.ones(len(seg), dtype=np.bool_) if self.active is None else np.array(self.active, dtype=np.bool_)
        if active.shape != (len(seg),) or not active.any():
            raise InputError(f"centre path: {int(active.sum())} of {len(seg)} motions cut: need at least one")
        for a in (seg, active):
            a.setflags(write=False)
        object.__setattr__(self, "segments", seg)
        object.__setattr__(self, "active", active)

    @staticmethod
    def of_program(program: Program, radius: float, stock: Region | None, level_mm: float) -> CentrePath:
        """The centre path at the height ``level_mm`` [mm]: motions with both ends at or below it cut, of one that comes
        from above or leaves upwards the end at or below it is a point of the centre path.

        Motion k of the path is row k of the program.
        """
        seg = flat_motions(program)
        z1 = program.p_work[:, 2]
        z0 = np.concatenate([z1[:1], z1[:-1]])
        limit = level_mm + LEVEL_MM
        down, up = (z0 > limit) & (z1 <= limit), (z0 <= limit) & (z1 > limit)
        seg[down, 0:2] = seg[down, 2:4]
        seg[up, 2:4] = seg[up, 0:2]
        seg[down | up, 4:7] = 0.0
        return CentrePath(seg, radius, stock, (z0 <= limit) | (z1 <= limit))

    @cached_property
    def motions(self) -> Floats:
        """Motions (n, 9) as rows of :mod:`chipload.simulation._centre_path`."""
        return motion_rows(self.segments)

    @cached_property
    def lengths(self) -> Floats:
        """Length (n,) of each motion [mm]."""
        seg, rho = self.segments, self.motions[:, 7]
        return np.where(seg[:, 6] == 0.0, np.hypot(*(seg[:, 2:4] - seg[:, 0:2]).T), rho * np.abs(seg[:, 6]))

    @cached_property
    def grid(self) -> tuple[float, float, float, int, int, Ints, Ints, NDArray[np.int32]]:
        """Cells with the motions that can reach them, see :mod:`chipload.simulation._centre_path`."""
        mot, active = self.motions, np.asarray(self.active)
        seg = self.segments[active]
        bulge = 2.0 * np.where(seg[:, 6] == 0.0, 0.0, mot[active, 7])[:, None]
        edge = 1.01 * self.radius
        low = (np.minimum(seg[:, 0:2], seg[:, 2:4]) - bulge).min(axis=0) - edge
        high = (np.maximum(seg[:, 0:2], seg[:, 2:4]) + bulge).max(axis=0) + edge
        size = high - low
        h = max(self.radius / 32.0, math.sqrt(size[0] * size[1] / CELLS), size.max() / CELLS)
        nx, ny = (math.ceil(x / h) for x in size)
        cover = np.full(nx * ny, len(mot), dtype=np.int32)
        count = np.zeros(nx * ny, dtype=np.int64)
        start = np.zeros(nx * ny + 1, dtype=np.int64)
        box = (float(low[0]), float(low[1]), h, nx, ny)
        none = np.zeros(0, dtype=np.int64)
        _centre_path.fill_grid(mot, active, self.radius, DISPLACED_MM, *box, cover, count, start, none, False)
        start[1:] = np.cumsum(count)
        items = np.empty(start[-1], dtype=np.int64)
        count[:] = 0
        _centre_path.fill_grid(mot, active, self.radius, DISPLACED_MM, *box, cover, count, start, items, True)
        return (*box, start, items, cover)

    @cached_property
    def rows(self) -> tuple[float, float, int, Ints, Ints, Floats]:
        """The stock's boundary by strips of y, see :mod:`chipload.simulation._centre_path`."""
        _, gy, h, _, ny = self.grid[:5]
        return strips(self.stock, gy, gy + ny * h)

    def places(self, motion: ArrayLike, share: ArrayLike) -> tuple[Floats, Floats]:
        """Return centres (m, 2) [mm] and unit headings (m, 2) at moments; heading 0, 0 if a motion has no length."""
        k, w = self._moments(motion, share)
        centre, heading = np.empty((len(k), 2)), np.empty((len(k), 2))
        _centre_path.places(self.motions, k, w, centre, heading)
        return centre, heading

    def uncut(self, points: ArrayLike, motion: ArrayLike, share: ArrayLike) -> Bools:
        """Return a mask (m,) of the ``points`` (m, 2) [mm] that are still stock at their moments.

        A point at R of the path, within ``TOUCH_MM``, is uncut.
        """
        p = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 2)
        k, w = self._moments(motion, share)
        k, w = np.broadcast_to(k, len(p)).copy(), np.broadcast_to(w, len(p)).copy()
        out = np.empty(len(p), dtype=np.bool_)
        _centre_path.uncut_many(p, k, w, self.radius - TOUCH_MM, self.motions, self.grid, self.rows, out)
        return out

    def distance(self, points: ArrayLike) -> Floats:
        """(m,) distance [mm] from ``points`` (m, 2) to the whole path where it is above R; where it is not, some
        value not above R + ``TOUCH_MM``.
        """
        p = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 2)
        out = np.empty(len(p))
        _centre_path.centre_path_distance(p, self.radius, TOUCH_MM, self.motions, self.active, self.grid, out)
        return out

    def _moments(self, motion: ArrayLike, share: ArrayLike) -> tuple[Ints, Floats]:
        k = np.ascontiguousarray(np.atleast_1d(np.asarray(motion, dtype=np.int64)))
        w = np.ascontiguousarray(np.atleast_1d(np.asarray(share, dtype=np.float64)))
        if len(k) != len(w):
            raise InputError(f"centre path: {len(k)} motions but {len(w)} shares: need one each")
        if len(k) and (k.min() < 0 or k.max() >= len(self.segments) or not ((w >= 0.0) & (w <= 1.0)).all()):
            raise InputError(f"centre path: moments must be motions 0..{len(self.segments) - 1} and shares 0..1")
        return k, w


#: heights nearer than this [mm] are one level
LEVEL_MM = 1e-6


@dataclass(frozen=True, eq=False)
class Rim:
    """Engagement of the rim, a row for each moment.

    ``angle`` (m,) [rad] sum of the engaged pieces of the front half; ``count`` (m,) their number; ``phi``
    (m, PIECES, 2) [rad] their ends in immersion, 0 where there is none.
    """

    angle: Floats
    count: Ints
    phi: Floats


def samples(step: float) -> Floats:
    """Return the immersions [rad] at which the rim is examined: every ``step`` from 0 to pi, and denser at both ends.

    There, where thin engagement lies, the spacing decreases to a 128th of ``step``.
    """
    n = max(2, math.ceil(math.pi / step))
    inner = np.linspace(0.0, math.pi, n + 1)
    fine = inner[1] * 0.5 ** np.arange(7, 0, -1)
    return np.concatenate([inner[:1], fine, inner[1:-1], math.pi - fine[::-1], inner[-1:]])


def rim_engagement(
    centres: CentrePath,
    motion: ArrayLike,
    share: ArrayLike,
    *,
    step_deg: float = 1.0,
    precision: float = PRECISION,
    workers: int = 1,
    displacement_mm: float = 0.0,
) -> Rim:
    """Return the engaged arcs of the rim at moments of the path.

    Parameters
    ----------
    centres : the path and its stock
    motion, share : (m,) the moments; the heading is that of the motion
    step_deg : spacing of the samples on the rim [deg]. A piece of stock, or a gap in it, narrower than this can be
        missed, except at both ends of the front half, where pieces of a 128th of it are found
    precision : transitions are halved down to this [rad]
    workers : threads; the answer does not depend on it
    displacement_mm : how far the path is displaced against the initial stock and what it cut before its last
        ``OWN_MM``, or before its last motion that does not cut, at most ``DISPLACED_MM``: above 0 gives the least
        engagement that such a displacement makes, below 0 the greatest

    Notes
    -----
    The ends of the front half lie exactly on the wall just made: there the rim counts as uncut within ``TOUCH_MM``.
    So a rim that runs along a wall already finished shows a piece of acos(1 - TOUCH_MM / R), 0.001 deg at R = 5.
    """
    k, w = centres._moments(motion, share)
    m = len(k)
    centre, heading = centres.places(k, w)
    angle, count, phi = np.zeros(m), np.zeros(m, dtype=np.int64), np.zeros((m, PIECES, 2))
    immersions = samples(math.radians(step_deg))
    mot, grid, rows, radius = centres.motions, centres.grid, centres.rows, centres.radius
    cut = np.linspace(0, m, max(workers, 1) + 1).astype(int)
    begins = np.concatenate([[0.0], np.cumsum(centres.lengths)])
    behind = begins[k] + w * centres.lengths[k] - OWN_MM
    away = np.maximum.accumulate(np.where(np.asarray(centres.active), 0, np.arange(len(centres.segments))))
    own = np.maximum(np.searchsorted(begins, behind, side="right") - 1, away[k])

    def run(i: int) -> Any:
        _centre_path.rim(
            k, w, centre, heading, radius, radius - TOUCH_MM, own, displacement_mm, immersions, precision, mot, grid,
            rows, cut[i], cut[i + 1], angle, count, phi,
        )  # fmt: skip

    with ThreadPoolExecutor(max(workers, 1)) as pool:
        list(pool.map(run, range(len(cut) - 1)))
    still = (heading == 0.0).all(axis=1)
    angle[still], count[still], phi[still] = 0.0, 0, 0.0
    return Rim(angle, count, phi)


def motion_rows(segments: Floats) -> Floats:
    """Return segments (n, 9) with their radius and start angle for the kernels."""
    seg = np.asarray(segments, dtype=np.float64)
    v = seg[:, 0:2] - seg[:, 4:6]
    arc = seg[:, 6] != 0.0
    rho = np.where(arc, np.hypot(v[:, 0], v[:, 1]), 0.0)
    return np.column_stack([seg, rho, np.where(arc, np.arctan2(v[:, 1], v[:, 0]), 0.0)])


def flat_motions(program: Program) -> Floats:
    """Return the motions (n, 7) of a program in the plane; row 0 and dwells have no length.

    Raises
    ------
    InputError
        An arc lies in another plane than XY.
    """
    p = program.p_work[:, 0:2]
    before = np.concatenate([p[:1], p[:-1]])
    arc = (program.motion == ARC_CW) | (program.motion == ARC_CCW)
    upright = np.abs(program.normal[:, 2]) > 1.0 - 1e-12
    if (arc & ~upright).any():
        k = int(np.flatnonzero(arc & ~upright)[0])
        raise InputError(f"centre path: the arc of row {k} is not in the XY plane: write it as chords first")
    centre = program.centre[:, 0:2]
    v0, v1 = before - centre, p - centre
    a0, a1 = np.arctan2(v0[:, 1], v0[:, 0]), np.arctan2(v1[:, 1], v1[:, 0])
    turn = np.where(program.motion == ARC_CCW, 1.0, -1.0) * np.where(program.normal[:, 2] < 0.0, -1.0, 1.0)
    sweep = (turn * (a1 - a0)) % (2.0 * np.pi)
    full = np.hypot(*(p - before).T) <= 1e-7
    sweep = (np.where(full, 2.0 * np.pi, sweep) + 2.0 * np.pi * program.turns) * turn
    return np.column_stack([before, p, np.where(arc[:, None], centre, 0.0), np.where(arc, sweep, 0.0)])
