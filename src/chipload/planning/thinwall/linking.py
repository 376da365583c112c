"""Programs of all passes of a wall: every pass row by row, the links between rows and between sides.

Notation: rows, q, n and t as in :mod:`chipload.planning.thinwall.paths`; C [mm] the middle of the circle of the
corner's centres; c [mm] clearance along n; A the cutter's axis. A row extends beyond both edges of the wall by o [mm],
so that the cutter reaches its depth in the air. Between two rows the cutter lifts by c along n and returns along the
next row at that distance. Between two passes it retracts along A, a little away from the wall, until its tip is at the
safe height above the wall, and approaches along the next axis.

The feed is that of C, which determines the chip thickness, and not that of the tip, which is nearer to the surface.

Every row of the program has its own line number, its place on the side (u along it, v up it) and the planned depth
there, so a check can name the contact point of what it finds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.planning.thinwall.blank import FinishSurface
from chipload.planning.thinwall.finish_rows import FinishSide
from chipload.planning.thinwall.flank_rows import FlankSide
from chipload.planning.thinwall.flank_stock import Pose
from chipload.planning.thinwall.floor_rows import FloorSide, floor_pass
from chipload.planning.thinwall.pass_program import Margins, PassPath, PassProgram
from chipload.planning.thinwall.passes import WallPass
from chipload.planning.thinwall.paths import PassMotion, Rows, place_rows, rows_of

Floats = NDArray[np.float64]


#: the retract leans by this share of n from the axis: away from the wall
ASIDE = 0.2


@dataclass(frozen=True, eq=False)
class FineSide:
    """One side, sampled finely.

    Attributes
    ----------
    surface : (n, m) points, m rows of the cutter apart
    u, v : (n,), (m,) float, its parameters
    """

    surface: FinishSurface
    u: Floats
    v: Floats

    def laid(self, p: WallPass, places: tuple[Floats, Floats], posture: Pose) -> tuple[Rows, Floats, Floats]:
        """Rows of a pass, with the parameters (r, s, 2) and the planned depth (r, s) [mm] of their contact points."""
        low, high = (refine_depths(d, places, (self.u, self.v)) for d in (p.low, p.high))
        rows = rows_of(self.surface, low, high, posture)
        return (rows, *_known_depths(rows, self, high - low))


@dataclass(frozen=True, eq=False)
class OperationMotion:
    """Path data of an operation: sides, pass motion and margins.

    Attributes
    ----------
    sides : each finely, rows of its cutter apart, or with rows of its own
    pass_motion : cutter, feed and clearance
    margins : of its links
    """

    sides: Sequence[FineSide | FinishSide | FlankSide | FloorSide]
    pass_motion: PassMotion
    margins: Margins


def refine_depths(values: Floats, at: tuple[Floats, Floats], to: tuple[Floats, Floats]) -> Floats:
    """Depths (n, m) interpolated from parameters ``at`` to parameters ``to``; no value lies beyond its neighbours.

    Monotone cubics along u, then along v.
    """
    first = scipy.interpolate.PchipInterpolator(at[0], values, axis=0)(to[0])
    return np.asarray(scipy.interpolate.PchipInterpolator(at[1], first, axis=1)(to[1]))


def beyond_edges(rows: Rows, distance: float) -> Rows:
    """Rows with one more point at both ends, ``distance`` [mm] on along the feed, where nothing is cut."""
    length = rows.contact.shape[1]
    count = np.full(len(rows.contact), length) if rows.count is None else rows.count
    at = np.clip(np.arange(length + 2) - 1, 0, count[:, None] - 1)

    def ends(values: Floats) -> Floats:
        return np.take_along_axis(values, at[..., None], axis=1)

    contact, feed = ends(rows.contact), ends(rows.feed)
    contact[:, 0] -= distance * feed[:, 0]
    after = np.arange(length + 2) > count[:, None]
    contact[after] += distance * feed[after]
    return Rows(
        contact,
        ends(rows.normal),
        feed,
        np.pad(rows.cut, ((0, 0), (1, 1))),
        None if rows.axis is None else ends(rows.axis),
        None if rows.count is None else rows.count + 2,
    )


def link_passes(
    passes: Sequence[WallPass], operations: Sequence[OperationMotion], places: tuple[Floats, Floats]
) -> tuple[PassProgram, ...]:
    """Programs of the passes with their links, one for each pass, in order.

    Parameters
    ----------
    operations : in the order of their numbers
    places : (n,), (m,) parameters u and v of the places that the passes have their depths at

    Raises
    ------
    InputError
        A pass finds no stock, or the axis does not stand above the horizontal.
    """
    out: list[PassProgram] = []
    line = 1
    for number, p in enumerate(passes):
        own = operations[p.operation]
        label = f"pass {number + 1} side {p.side + 1}"
        side = own.sides[p.side]
        if isinstance(side, FloorSide):
            pass_program = floor_pass(p, side, places, own.pass_motion, own.margins, label)
        else:
            pass_program = _pass_program(p, side, places, own.pass_motion, own.margins, label)
        count = len(pass_program.program)
        program = replace(pass_program.program, line=np.arange(line, line + count))
        out.append(replace(pass_program, program=program, operation=p.operation))
        line += count
    return tuple(out)


def _pass_program(
    p: WallPass,
    side: FineSide | FinishSide | FlankSide,
    places: tuple[Floats, Floats],
    pass_motion: PassMotion,
    margins: Margins,
    label: str,
) -> PassProgram:
    bare, place, depth = side.laid(p, places, pass_motion.posture)
    if not bare.cut.any():
        raise InputError(f"{label}: the pass finds no stock")
    rows = beyond_edges(bare, margins.beyond)
    place = np.concatenate([place[:, :1], place, place[:, -1:]], axis=1)
    depth = np.pad(depth, ((0, 0), (1, 1)))
    if p.threshold.speed is not None:  # the feed per tooth stays
        own = p.threshold.speed
        pass_motion = replace(pass_motion, spindle=own, feed=pass_motion.feed * own / pass_motion.spindle)
    tip, axis, centre = place_rows(rows, pass_motion.posture)
    low_axis = float(axis[..., 2].min())
    if min(low_axis, float((axis + ASIDE * rows.normal)[..., 2].min())) < 0.02:
        raise InputError(
            f"{label}: the cutter's axis stands {math.degrees(math.asin(low_axis)):.3g} deg above the horizontal: lean "
            "it more towards the free edge (operation.lean_deg)"
        )
    path = PassPath()
    lifted = tip + pass_motion.clearance * rows.normal
    away = axis + ASIDE * rows.normal
    outside = lifted + ((margins.safe - lifted[..., 2]) / away[..., 2]).clip(0.0)[..., None] * away
    before: tuple[int, int] | None = None
    for r in range(len(tip)):
        on = np.concatenate([[0], rows.cut[r].astype(np.int64), [0]])
        for a, b in zip(np.flatnonzero(np.diff(on) == 1), np.flatnonzero(np.diff(on) == -1), strict=True):
            first, last = max(int(a) - 1, 0), min(int(b), tip.shape[1] - 1)
            if before is None:
                path.rapid(outside[r, first], axis[r, first])
                path.rapid(lifted[r, first], axis[r, first])
            else:
                back = _return_points(rows, lifted[before], lifted[r], before[1], first)
                for k in back[_corners(lifted[r, back], margins.sag)]:
                    path.rapid(lifted[r, k], axis[r, k])
            path.line(tip[r, first], axis[r, first], centre[r, first], lifted[r, first] - tip[r, first])
            for k in range(first, last + 1):
                path.known(rows.contact[r, k], rows.normal[r, k], place[r, k], depth[r, k])
                if k < last:
                    path.line(tip[r, k + 1], axis[r, k + 1], centre[r, k + 1], centre[r, k])
            path.rapid(lifted[r, last], axis[r, last])
            before = (r, last)
    if before is not None:
        path.rapid(outside[before], axis[before])
    return path.pass_program(p.side, pass_motion, label)


def _return_points(rows: Rows, end: Floats, lifted: Floats, number: int, first: int) -> NDArray[np.int64]:
    """Numbers of the points of a row that a link passes: from where the row before ended to the first one.

    The rows of a user's program may run to and fro and have different points: the link begins at the nearest one.
    """
    if rows.axis is not None:
        number = int(np.linalg.norm(lifted - end, axis=1).argmin())
    step = 1 if first >= number else -1
    return np.arange(number, first + step, step)


def _corners(points: Floats, sag: float) -> NDArray[np.int64]:
    """Numbers of the points (n, 3) whose chords stay within ``sag`` of all, first and last among them."""
    keep, todo = {0, len(points) - 1}, [(0, len(points) - 1)]
    while todo:
        a, b = todo.pop()
        if b - a < 2:
            continue
        chord = points[b] - points[a]
        v = points[a + 1 : b] - points[a]
        size = float(chord @ chord)
        t = np.clip(v @ chord / size, 0.0, 1.0) if size > 0.0 else np.zeros(len(v))
        off = np.linalg.norm(v - t[:, None] * chord, axis=1)
        k = int(off.argmax())
        if off[k] > sag:
            keep.add(a + 1 + k)
            todo += [(a, a + 1 + k), (a + 1 + k, b)]
    return np.array(sorted(keep))


def _known_depths(rows: Rows, side: FineSide, depth: Floats) -> tuple[Floats, Floats]:
    """Parameters (r, s, 2) and planned depth (r, s) of the contact points, in their order."""
    count = len(rows.contact)
    v = np.linspace(1.0, 0.0, count)
    at = np.linspace(0.0, 1.0, len(side.v))
    up = np.interp(v, at, side.v)
    along = side.u
    values = np.stack([np.interp(v, at, column) for column in depth], axis=1)
    straight = np.linalg.norm(rows.contact[0, 0] - side.surface.points[0, -1])
    if straight > np.linalg.norm(rows.contact[0, 0] - side.surface.points[-1, -1]):
        along, values = along[::-1], values[:, ::-1]
    place = np.stack(np.broadcast_arrays(along[None, :], up[:, None]), axis=-1)
    return place, values
