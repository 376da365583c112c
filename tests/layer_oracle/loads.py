"""Tooth engagement in the layers at the middle of a step, and its loads rotation by rotation: the oracle of the moves.

Notation: t in 0..1 within a step; T, n, A the frame of the cutter, nu the outward normal of its surface, phi immersion
as in :mod:`chipload.engagement.tooth_engagement`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import Slices
from chipload.cutting.force import in_work, mean_forces
from chipload.cutting.material import Material
from chipload.engagement.chips import _section
from chipload.engagement.chips.move import Move
from chipload.engagement.tooth_engagement import ToothEngagement, tool_frame
from chipload.errors import InputError
from chipload.simulation.loads import GRAZES, ONE_SIDE, OverTurn, engaged_work
from chipload.simulation.steps import Steps
from layer_oracle.immersion import Section, engagement_rows

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: the front is at least so many tolerances ahead of the one that the step before left
AHEAD = 20.0


@dataclass(frozen=True, eq=False)
class StepEngagement:
    """Tooth engagement of one step."""

    step: int
    frame: Floats
    rows: Floats
    owner: NDArray[np.int64]


def engagement_of_step(
    steps: Steps, k: int, move: Move, cutter: Cutter, profile: Slices, section: Section, tolerance: float
) -> StepEngagement:
    """Return the tooth engagement at the middle of a step.

    The front that the step before it left is half a step behind, and its edges are known to ``tolerance`` [mm] only.
    Where half a step is less than :data:`AHEAD` of those, contact is judged for the cutter moved on along its feed by
    what lacks: along walls that run with the feed that changes nothing, and the front is found whatever the step.
    """
    if steps.spindle[k] == 0.0:
        raise InputError(f"line {steps.line[k]}: cuts with the spindle at rest: start it (M3 S) before the cut")
    S = np.empty(27)
    _section.state(move.tip, move.axis, 0.5, S)
    tip, axis, speed, swing = S[:3], S[3:6], S[6:9], S[9:12]
    tooth = math.tau / (cutter.flutes * abs(float(steps.spindle[k]))) / float(steps.seconds[k])
    (a, b, c), (x, y, z) = axis.tolist(), swing.tolist()
    turn = np.array([b * z - c * y, c * x - a * z, a * y - b * x])
    middle = speed + 0.5 * cutter.flute_length * swing
    frame = tool_frame(axis, speed if speed.any() else middle, bool(steps.spindle[k] > 0.0))
    travel = float(np.linalg.norm(speed))
    ahead = max(AHEAD * tolerance / travel - 0.5, 0.0) if travel > 0.0 else 0.0
    rows, owner = engagement_rows(tip + ahead * speed, frame, speed * tooth, turn * tooth, profile, section)
    return StepEngagement(k, frame, rows, owner)


def engagement_of_steps(cuts: list[StepEngagement], profile: Slices) -> ToothEngagement:
    """Return the tooth engagement of some steps of one cutter, without its runout."""
    start = np.cumsum([0, *(len(c.rows) for c in cuts)])
    rows, owner = np.concatenate([c.rows for c in cuts]), np.concatenate([c.owner for c in cuts])
    frame = np.array([c.frame for c in cuts])
    owner, table = _with_parts(rows, owner, profile)
    return ToothEngagement(start, rows, np.full(len(rows), -1), owner, table, frame)


def _with_parts(rows: Floats, owner: Ints, profile: Slices) -> tuple[Ints, Floats]:
    """Return slices of the engaged edge, and the columns of the profile followed by those of parts of its arcs.

    An engagement range that ends within a slice of an arc has the radius and the normal of its own middle, not those of
    the slice: in a shallow cut by a ball nose the uppermost slice has much of the torque.
    """
    s, part = rows[:, 2:4], profile.radius[owner] > 0.0
    part &= (s[:, 0] != profile.s_from[owner]) | (s[:, 1] != profile.s_to[owner])
    if not part.any():
        return owner, profile.columns
    keys, which = np.unique(np.column_stack([owner[part], s[part]]), axis=0, return_inverse=True)
    of = keys[:, 0].astype(np.int64)
    middle, r = 0.5 * (profile.s_from[of] + profile.s_to[of]), profile.radius[of]
    kappa = np.arctan2(profile.sin_kappa[of], profile.cos_kappa[of])
    own = kappa + (0.5 * (keys[:, 1] + keys[:, 2]) - middle) / r
    z = profile.z_middle[of] + r * (profile.cos_kappa[of] - np.cos(kappa + (keys[:, 1] - middle) / r))
    rho = profile.rho[of] + r * (np.sin(own) - profile.sin_kappa[of])
    lead = profile.rate[of] / profile.sin_kappa[of]
    z = np.maximum(z, 0.0)
    parts = np.column_stack([keys[:, 1], rho, z, np.sin(own), np.cos(own), lead * z, lead * np.sin(own)])
    out = owner.copy()
    out[part] = len(profile) + which.ravel()
    return out, np.vstack([profile.columns, parts])


def loads_of_steps(
    front: ToothEngagement,
    engagement: ToothEngagement,
    cuts: list[StepEngagement],
    cutter: Cutter,
    material: Material,
    turn: OverTurn,
    spindle: Floats,
    seconds: Floats,
) -> Floats:
    """Return loads (c, len(LOADS)) of steps that take ``seconds`` (c,), from :func:`over_turn`; ``engagement`` has the
    chips of ``front``.
    """
    force, torque, _ = turn
    mean, torque_mean = mean_forces(engagement, cutter, material)
    turned = in_work(force, engagement.frames)
    left = _normals_left(engagement, cuts)
    volume, work = engaged_work(front, cutter, material, np.abs(spindle) * seconds)
    return np.column_stack(
        [
            in_work(mean, engagement.frames),
            turned.max(axis=1),
            turned.min(axis=1),
            np.linalg.norm(force, axis=2).max(axis=1),
            torque_mean / 1000.0,
            torque.max(axis=1) / 1000.0,
            torque_mean * np.abs(spindle) / 1000.0,
            engagement.chip_max(),
            -np.einsum("nmi,ni->nm", turned, left).min(axis=1).clip(None, 0.0),
            volume,
            work / 1000.0,
        ]
    )


def _normals_left(engagement: ToothEngagement, cuts: list[StepEngagement]) -> Floats:
    """(c, 3) outward normal of the cutter, in the work frame, where it leaves a surface behind: nu averaged over the
    ends of engagement at which h = 0, by their length along the profile; 0 where no surface or two that face each
    other are left.
    """
    rows, owner = np.concatenate([c.rows for c in cuts]), np.concatenate([c.owner for c in cuts])
    of = np.repeat(np.arange(len(cuts)), [len(c.rows) for c in cuts])
    p, q, a, b, along, offset, across = rows.T
    sk, ck = engagement.slices[owner, 3], engagement.slices[owner, 4]
    total, whole = np.zeros((len(cuts), 3)), np.zeros(len(cuts))
    for phi in (p, q):
        h = along * np.sin(phi) + across * np.cos(phi) + offset
        made = np.where(np.abs(h) <= GRAZES * (np.hypot(along, across) + np.abs(offset)), b - a, 0.0)
        for i, nu in enumerate((sk * np.sin(phi), sk * np.cos(phi), -ck)):
            total[:, i] += np.bincount(of, made * nu, len(cuts))
        whole += np.bincount(of, made, len(cuts))
    size = np.linalg.norm(total, axis=1)
    one = (size > ONE_SIDE * whole) & (whole > 0.0)
    turned = np.einsum("ni,nij->nj", total, np.array([c.frame for c in cuts]))
    return np.asarray(np.where(one[:, None], turned / np.where(one, size, 1.0)[:, None], 0.0))
