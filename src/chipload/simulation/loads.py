"""What the teeth cut in the middle of a step, and the loads that this costs over a revolution.

Notation: t in 0..1 within a step; T, n, A the frame of the cutter, nu the outward normal of its surface, phi immersion
as in :mod:`chipload.engagement.bites`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import Slices
from chipload.cutting.force import forces_over_turn, in_work, mean_forces
from chipload.cutting.material import Material
from chipload.engagement.bites import Bites, with_runout
from chipload.engagement.chips._kernels import state
from chipload.engagement.chips.move import Move
from chipload.engagement.immersion.immersion import Section, immersed, tool_frame
from chipload.errors import InputError
from chipload.simulation.steps import Steps

Floats = NDArray[np.float64]

#: columns of loads, in their order
LOADS = (
    *(f"force_{x}_mean_n" for x in "xyz"),
    *(f"force_{x}_max_n" for x in "xyz"),
    *(f"force_{x}_min_n" for x in "xyz"),
    "force_n",
    "torque_mean_nm",
    "torque_nm",
    "power_w",
    "chip_max_mm",
    "force_normal_n",
)
#: a bite ends where h = 0 if h is at most this share of its greatest
GRAZES = 1e-6
#: a mean normal shorter than this stands for surfaces that face each other
ONE_SIDE = 0.5


@dataclass(frozen=True, eq=False)
class StepBite:
    """Rows of one step."""

    step: int
    frame: Floats
    rows: Floats
    owner: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Cuts:
    """What the teeth of one cutter cut, step by step.

    Parameters
    ----------
    tool : its number in the program
    cutter : its numbers
    step : (c,) int, the steps that cut, rows of ``Removal.columns``
    way : (c, 12) float, tip at the start and the end [mm], axis at the start and the end
    bites : of those steps, in the middle of each, with frames
    plain : the same without runout
    spindle : (c,) float [rad/s], signed
    """

    tool: int
    cutter: Cutter
    step: NDArray[np.int64]
    way: Floats
    bites: Bites
    plain: Bites
    spindle: Floats

    def __len__(self) -> int:
        return len(self.step)


def joined(cuts: list[Cuts]) -> Cuts:
    """Cuts of one cutter that follow one another as one."""
    columns = (np.concatenate([getattr(c, name) for c in cuts]) for name in ("step", "way", "spindle"))
    step, way, spindle = columns
    bites = _joined([c.bites for c in cuts])
    plain = bites if all(c.plain is c.bites for c in cuts) else _joined([c.plain for c in cuts])
    return Cuts(cuts[0].tool, cuts[0].cutter, step, way, bites, plain, spindle)


def _joined(bites: list[Bites]) -> Bites:
    start = np.concatenate([[0], np.cumsum(np.concatenate([np.diff(b.start) for b in bites]))])
    rows, tooth, piece = (np.concatenate([getattr(b, name) for b in bites]) for name in ("rows", "tooth", "slice"))
    frame = np.concatenate([b.frame for b in bites if b.frame is not None])
    return Bites(start, rows, tooth, piece, bites[0].slices, frame)


def at_feeds(cuts: Cuts, factor: Floats) -> Cuts:
    """What the teeth cut at other feeds: where they cut does not depend on the feed, how thick is proportional to it;
    what runout adds is not.

    Parameters
    ----------
    factor : (c,) float, above 0, the feed of each step over the one that it has
    """
    old = cuts.plain
    rows = old.rows.copy()
    rows[:, 4:] *= np.repeat(factor, np.diff(old.start))[:, None]
    plain = Bites(old.start, rows, old.tooth, old.slice, old.slices, old.frame)
    return replace(cuts, bites=with_runout(plain, cuts.cutter), plain=plain)


def bite_of_step(steps: Steps, k: int, move: Move, cutter: Cutter, profile: Slices, section: Section) -> StepBite:
    """What the teeth cut at the middle of a step."""
    if steps.spindle[k] == 0.0:
        raise InputError(f"line {steps.line[k]}: cuts with the spindle at rest: start it (M3 S) before the cut")
    S = np.empty(27)
    state(move.tip, move.axis, 0.5, S)
    tip, axis, speed, swing = S[:3], S[3:6], S[6:9], S[9:12]
    tooth = math.tau / (cutter.flutes * abs(float(steps.spindle[k]))) / float(steps.seconds[k])
    (a, b, c), (x, y, z) = axis.tolist(), swing.tolist()
    turn = np.array([b * z - c * y, c * x - a * z, a * y - b * x])
    middle = speed + 0.5 * cutter.flute_length * swing
    frame = tool_frame(axis, speed if speed.any() else middle, bool(steps.spindle[k] > 0.0))
    rows, owner = immersed(tip, frame, speed * tooth, turn * tooth, profile, section)
    return StepBite(k, frame, rows, owner)


def bites_of_steps(cuts: list[StepBite], profile: Slices) -> Bites:
    """The bites of some steps of one cutter, without its runout."""
    start = np.cumsum([0, *(len(c.rows) for c in cuts)])
    rows, owner = np.concatenate([c.rows for c in cuts]), np.concatenate([c.owner for c in cuts])
    frame = np.array([c.frame for c in cuts])
    return Bites(start, rows, np.full(len(rows), -1), owner, profile.columns, frame)


def greatest_loads(cuts: Cuts, material: Material, rotation: float) -> dict[str, Floats]:
    """Columns (c,) of :data:`LOADS` that limits hold: greatest force [N], greatest and mean torque [N m], mean power
    [W], thickest chip [mm].
    """
    force, torque = _over_turn(cuts.bites, cuts.cutter, material, rotation)
    _, mean = mean_forces(cuts.bites, cuts.cutter, material)
    return {
        "force_n": np.linalg.norm(force, axis=2).max(axis=1),
        "torque_nm": torque.max(axis=1) / 1000.0,
        "torque_mean_nm": mean / 1000.0,
        "power_w": mean * np.abs(cuts.spindle) / 1000.0,
        "chip_max_mm": cuts.bites.chip_max(),
    }


def _over_turn(bites: Bites, cutter: Cutter, material: Material, rotation: float) -> tuple[Floats, Floats]:
    """Force and torque at rotations at most ``rotation`` apart."""
    pitch = math.tau if cutter.runout[0] > 0.0 else math.tau / cutter.flutes
    count = max(math.ceil(pitch / rotation), 8)
    return forces_over_turn(bites, cutter, material, np.arange(count) * (pitch / count))


def loads_of_steps(
    bites: Bites, cuts: list[StepBite], cutter: Cutter, material: Material, rotation: float, spindle: Floats
) -> Floats:
    """(c, len(LOADS)) loads of steps."""
    assert bites.frame is not None
    force, torque = _over_turn(bites, cutter, material, rotation)
    mean, torque_mean = mean_forces(bites, cutter, material)
    turned = in_work(force, bites.frame)
    left = _left(bites, cuts)
    return np.column_stack(
        [
            in_work(mean, bites.frame),
            turned.max(axis=1),
            turned.min(axis=1),
            np.linalg.norm(force, axis=2).max(axis=1),
            torque_mean / 1000.0,
            torque.max(axis=1) / 1000.0,
            torque_mean * np.abs(spindle) / 1000.0,
            bites.chip_max(),
            -np.einsum("nmi,ni->nm", turned, left).min(axis=1).clip(None, 0.0),
        ]
    )


def _left(bites: Bites, cuts: list[StepBite]) -> Floats:
    """(c, 3) outward normal of the cutter, in the work frame, where it leaves a surface behind: nu averaged over the
    ends of bites at which h = 0, by their length along the profile; 0 where no surface or two that face each other are
    left.
    """
    rows, owner = np.concatenate([c.rows for c in cuts]), np.concatenate([c.owner for c in cuts])
    of = np.repeat(np.arange(len(cuts)), [len(c.rows) for c in cuts])
    p, q, a, b, along, offset, across = rows.T
    sk, ck = bites.slices[owner, 3], bites.slices[owner, 4]
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
