"""What the teeth cut in the middle of a step, and the loads that this costs over a revolution.

Notation: t in 0..1 within a step; T, n, A the frame of the cutter, nu the outward normal of its surface, phi immersion
as in :mod:`chipload.engagement.bites`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import Slices
from chipload.cutting.force import forces_over_turn, in_work, mean_forces
from chipload.cutting.material import Material
from chipload.engagement.bites import Bites, with_runout
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
    """

    tool: int
    cutter: Cutter
    step: NDArray[np.int64]
    way: Floats
    bites: Bites

    def __len__(self) -> int:
        return len(self.step)


def joined(cuts: list[Cuts]) -> Cuts:
    """Cuts of one cutter that follow one another as one."""
    bites = [c.bites for c in cuts]
    start = np.concatenate([[0], np.cumsum(np.concatenate([np.diff(b.start) for b in bites]))])
    rows, tooth, piece = (np.concatenate([getattr(b, name) for b in bites]) for name in ("rows", "tooth", "slice"))
    frame = np.concatenate([b.frame for b in bites if b.frame is not None])
    whole = Bites(start, rows, tooth, piece, bites[0].slices, frame)
    step, way = np.concatenate([c.step for c in cuts]), np.concatenate([c.way for c in cuts])
    return Cuts(cuts[0].tool, cuts[0].cutter, step, way, whole)


def bite_of_step(steps: Steps, k: int, move: Move, cutter: Cutter, profile: Slices, section: Section) -> StepBite:
    """What the teeth cut at the middle of a step."""
    if steps.spindle[k] == 0.0:
        raise InputError(f"line {steps.line[k]}: cuts with the spindle at rest: start it (M3 S) before the cut")
    (tip, axis), (speed, swing) = ((v[0] for v in pair) for pair in (move.at([0.5]), move.rates([0.5])))
    tooth = math.tau / (cutter.flutes * abs(float(steps.spindle[k]))) / float(steps.seconds[k])
    turn = np.cross(axis, swing)
    middle = speed + 0.5 * cutter.flute_length * swing
    frame = tool_frame(axis, speed if np.linalg.norm(speed) > 0.0 else middle, bool(steps.spindle[k] > 0.0))
    rows, owner = immersed(tip, frame, speed * tooth, turn * tooth, profile, section)
    return StepBite(k, frame, rows, owner)


def bites_of_steps(cuts: list[StepBite], cutter: Cutter, profile: Slices) -> Bites:
    """The bites of some steps of one cutter, with its runout."""
    start = np.cumsum([0, *(len(c.rows) for c in cuts)])
    rows, owner = np.concatenate([c.rows for c in cuts]), np.concatenate([c.owner for c in cuts])
    frame = np.array([c.frame for c in cuts])
    return with_runout(Bites(start, rows, np.full(len(rows), -1), owner, profile.columns, frame), cutter)


def loads_of_steps(
    bites: Bites, cuts: list[StepBite], cutter: Cutter, material: Material, rotation: float, spindle: Floats
) -> Floats:
    """(c, len(LOADS)) loads of steps."""
    assert bites.frame is not None
    pitch = math.tau if cutter.runout[0] > 0.0 else math.tau / cutter.flutes
    count = max(math.ceil(pitch / rotation), 8)
    force, torque = forces_over_turn(bites, cutter, material, np.arange(count) * (pitch / count))
    mean, torque_mean = mean_forces(bites, cutter, material)
    turned = in_work(force, bites.frame)
    left = np.array([_left(c, bites.slices) for c in cuts])
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


def _left(cut: StepBite, slices: Floats) -> Floats:
    """Outward normal of the cutter, in the work frame, where it leaves a surface behind: nu averaged over the ends of
    bites at which h = 0, by their length along the profile; (3,), 0 where no surface or two that face each other are
    left.
    """
    p, q, a, b, along, offset, across = cut.rows.T
    sk, ck = slices[cut.owner, 3], slices[cut.owner, 4]
    total, whole = np.zeros(3), 0.0
    for phi in (p, q):
        h = along * np.sin(phi) + across * np.cos(phi) + offset
        made = np.where(np.abs(h) <= GRAZES * (np.hypot(along, across) + np.abs(offset)), b - a, 0.0)
        nu = np.column_stack([sk * np.sin(phi), sk * np.cos(phi), -ck]) @ cut.frame
        total += made @ nu
        whole += float(made.sum())
    size = float(np.linalg.norm(total))
    return total / size if size > ONE_SIDE * whole > 0.0 else np.zeros(3)
