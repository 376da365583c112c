"""Five-axis rows of a wall's passes, on the surface that a pass leaves.

Notation: p finish surface, N its normal, D [mm] stock that the pass leaves; q = p + D N; n = N - grad D (normed) the
normal of q, here of the sampled surface itself, so that curvature counts too; t direction of the feed along i, l = n x
t to its left. The cutter touches q at a point of a row. Its axis leans by lead and tilt in (t, l, n) as in
:mod:`chipload.planning.thinwall.plane_stock`; this determines its tip.

Rows run along i, from the free edge towards the clamp, so that the wall below still carries stock. All rows have the
same direction, with the row before on the side that the pose states. A row is cut where the pass finds stock; between
its parts the cutter lifts by a clearance along n and moves at the rapid rate.

Reference: [Yan2018] for the offset of the finish path by the depths.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.planning.thinwall.blank import FinishSurface
from chipload.planning.thinwall.contact import part_across
from chipload.planning.thinwall.flank_stock import Pose
from chipload.planning.thinwall.passes import NOTHING, WallPass
from chipload.program.program import LINE, RAPID, Program

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PassMotion:
    """Cutter pose, feed and clearance of the rows.

    Parameters
    ----------
    posture : cutter, step-over, lead and tilt; the step-over is not None
    feed : [mm/s]
    rapid : [mm/s], for the time
    spindle : [rad/s]
    clearance : [mm] along the normal, of links between the parts of a row
    """

    posture: Pose
    feed: float
    rapid: float
    spindle: float
    clearance: float

    def __post_init__(self) -> None:
        for name in ("feed", "rapid", "spindle", "clearance"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise InputError(f"paths.{name} = {getattr(self, name):g}: must be above 0")
        if self.posture.step is None:
            raise InputError("step_over_mm is missing: rows need one")


@dataclass(frozen=True, eq=False)
class Rows:
    """Contact points of rows with their normals and directions of feed.

    Attributes
    ----------
    contact, normal, feed : (r, s, 3) float: q [mm], n, t; rows from the free edge on, points in the order of travel
    cut : (r, s) bool, where stock is found
    axis : (r, s, 3) float, of the cutter; None: that of the posture
    count : (r,) int, points of each row, the last of which is repeated; None: s
    """

    contact: Floats
    normal: Floats
    feed: Floats
    cut: NDArray[np.bool_]
    axis: Floats | None = None
    count: NDArray[np.int64] | None = None


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def offset_normals(points: Floats, normals: Floats) -> Floats:
    """Unit normals (n, m, 3) of a sampled surface, on the side of ``normals``."""
    n = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    side = np.sign((n * normals).sum(axis=2, keepdims=True))
    return _unit(n * side)


def rows_of(surface: FinishSurface, low: Floats, high: Floats, posture: Pose) -> Rows:
    """Rows over the surface that is left at ``low``, with the stock before at ``high`` (n, m) [mm].

    Between the places of the surface points and normals are interpolated straight.

    Raises
    ------
    InputError
        No step-over.
    """
    if posture.step is None:
        raise InputError("step_over_mm is missing: rows need one")
    q = surface.points + low[..., None] * surface.normals
    n = offset_normals(q, surface.normals)
    span = np.linalg.norm(np.diff(q, axis=1), axis=2).sum(axis=1).max()
    number = math.ceil(span / abs(posture.step)) + 1
    at = np.linspace(q.shape[1] - 1.0, 0.0, number)
    j = np.minimum(at.astype(np.int64), q.shape[1] - 2)
    share = at - j

    def along(values: Floats) -> Floats:
        w = share.reshape(-1, *[1] * (values.ndim - 1))
        v = np.moveaxis(values, 1, 0)
        return np.asarray((1.0 - w) * v[j] + w * v[j + 1])

    contact, normal = along(q), _unit(along(n))
    cut = along(high - low) > NOTHING
    t = _unit(np.gradient(contact, axis=1))
    inwards = np.gradient(contact, axis=0)  # away from the rows before
    left = (np.cross(normal, t) * inwards).sum() > 0.0
    # the row before lies on the right of the feed where the step is above 0: the next one on its left
    if left != (posture.step > 0.0):
        contact, normal, cut, t = contact[:, ::-1], normal[:, ::-1], cut[:, ::-1], -t[:, ::-1]
    return Rows(contact, normal, _unit(t - (t * normal).sum(axis=2, keepdims=True) * normal), cut)


def place_rows(rows: Rows, posture: Pose) -> tuple[Floats, Floats, Floats]:
    """Tip [mm], axis and middle C of the circle of the corner's centres [mm] at the contact points, (r, s, 3) float
    each.
    """
    if rows.axis is not None:
        r, e, height = posture.cutter.finishing_arc
        C = rows.contact + r * rows.normal + e * part_across(rows.normal, rows.axis)
        return C - height * rows.axis, rows.axis, C
    frame = np.stack([rows.feed, np.cross(rows.normal, rows.feed), rows.normal], axis=2)
    axis = np.einsum("k,rskc->rsc", posture.axis, frame)
    C = rows.contact + np.einsum("k,rskc->rsc", posture.centre, frame)
    return C - posture.cutter.finishing_arc[2] * axis, _unit(axis), C


def program_of(rows: Rows, pass_motion: PassMotion, label: str) -> Program:
    """Program of the rows; its first motion is a rapid.

    Raises
    ------
    InputError
        Nothing is cut.
    """
    tip, axis, _ = place_rows(rows, pass_motion.posture)
    points: list[Floats] = []
    axes: list[Floats] = []
    motion: list[int] = []
    for r in range(len(tip)):
        on = np.concatenate([[0], rows.cut[r].astype(np.int64), [0]])
        for a, b in zip(np.flatnonzero(np.diff(on) == 1), np.flatnonzero(np.diff(on) == -1), strict=True):
            first, last = max(int(a) - 1, 0), min(int(b), tip.shape[1] - 1)
            above = [tip[r, k] + pass_motion.clearance * rows.normal[r, k] for k in (first, last)]
            points += [above[0], *tip[r, first : last + 1], above[1]]
            axes += [axis[r, first], *axis[r, first : last + 1], axis[r, last]]
            motion += [RAPID, *[LINE] * (last + 1 - first), RAPID]
    if not points:
        raise InputError("paths: the pass finds no stock")
    count, tool = len(points), pass_motion.posture.cutter.number
    kind = np.array(motion)
    zero, up = np.zeros((count, 3)), np.tile([0.0, 0.0, 1.0], (count, 1))
    none = np.zeros(count, dtype=np.int64)
    return Program(
        motion=kind,
        p_work=np.array(points),
        axis=np.array(axes),
        centre=zero,
        normal=up,
        turns=none,
        feed=np.where(kind == LINE, pass_motion.feed, 0.0),
        spindle=np.full(count, pass_motion.spindle if pass_motion.posture.clockwise else -pass_motion.spindle),
        tool=np.full(count, tool),
        line=none,
        label=none,
        labels=(label,),
    )


def seconds(program: Program, rapid: float) -> float:
    """Time [s] from length and feed, or the rapid rate [mm/s]; acceleration and rotary axes are not considered."""
    length = np.linalg.norm(np.diff(program.p_work, axis=0), axis=1)
    cuts = program.motion[1:] == LINE
    return float((length[cuts] / program.feed[1:][cuts]).sum() + length[~cuts].sum() / rapid)


def pass_programs(
    passes: Sequence[WallPass], surfaces: Sequence[FinishSurface], pass_motion: PassMotion
) -> tuple[Program, ...]:
    """Programs of the passes, one for each pass, in order."""
    return tuple(
        program_of(
            rows_of(surfaces[p.side], p.low, p.high, pass_motion.posture),
            pass_motion,
            f"pass {k + 1} side {p.side + 1}",
        )
        for k, p in enumerate(passes)
    )


def gouges(rows: Rows, surface: FinishSurface, low: Floats, posture: Pose, tolerance: float) -> NDArray[np.int64]:
    """Contact points (g, 2), row and number, where the cutter's corner is too large for a concave surface.

    A point of the surface that lies nearer to the disk of the corner circle's centres than r - ``tolerance`` [mm].
    """
    q = (surface.points + low[..., None] * surface.normals).reshape(-1, 3)
    _, axis, C = place_rows(rows, posture)
    r, e = posture.cutter.finishing_arc[:2]
    # a barrel's arc lies beside the middle of its centres' circle, along the axis
    reach = e + r if e >= 0.0 else posture.cutter.flute_length + posture.cutter.diameter
    near = scipy.spatial.cKDTree(q).query_ball_point(C.reshape(-1, 3), reach)
    bad = []
    for k, (c, A, some) in enumerate(zip(C.reshape(-1, 3), axis.reshape(-1, 3), near, strict=True)):
        v = q[some] - c
        height = v @ A
        out = np.maximum(np.linalg.norm(v - height[:, None] * A, axis=1) - e, 0.0)
        if len(v) and float(np.hypot(height, out).min()) < r - tolerance:
            bad.append(divmod(k, C.shape[1]))
    return np.array(bad, dtype=np.int64).reshape(-1, 2)
