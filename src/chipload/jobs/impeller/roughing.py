"""Roughing programs of an impeller: planned channel by channel, then checked on the surfaces and on the blank."""

from __future__ import annotations

import copy
import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.jobs.impeller.channels import between_channels, channel_repeat
from chipload.jobs.impeller.machine_check import axes_check
from chipload.jobs.impeller.read_program import read_program_of
from chipload.jobs.impeller.roughing_check import CheckedRough
from chipload.jobs.impeller.tables import ImpellerOperationTable, PathsTable, RoughTable
from chipload.lazy import trimesh
from chipload.machine.machine import Machine
from chipload.planning.impeller.floor import meridian
from chipload.planning.impeller.impeller import Impeller
from chipload.planning.impeller.kept import Keep, anew
from chipload.planning.impeller.lines import LineMotion
from chipload.planning.impeller.links import Link
from chipload.planning.impeller.programs import pallet_rate, too_fast
from chipload.planning.impeller.rough_settings import RoughingSetting, rough_channels
from chipload.planning.impeller.roughing import RoughingSettings, uncut
from chipload.planning.impeller.surfaces import hub_range
from chipload.planning.impeller.tables import IndexTable
from chipload.program.to_axes import to_axes
from chipload.progress import Progress
from chipload.simulation.channel.channel import SurfacePoints, left_on
from chipload.simulation.channel.gouges import Gouge, deepest_gouge
from chipload.simulation.channel.stock import ChannelRemoval, sector, taken_from
from chipload.stock.dexel import TriDexel
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm

#: of the gouge that is allowed, how near its depth is found
_RESOLUTION = 0.2
#: instants of a row [mm], how far the rays go above and below a surface [mm]
_STEP, _HEIGHT, _DEPTH = 1.0, 3.0, 0.5
#: points of the blank's meridian; how far it extends under the hub [mm]; how far beside the channel, in pitches
_MERIDIAN, _UNDER, _BESIDE = 61, 1.0, 0.8
#: how often rows are left out before a program counts as not verified
_ROUNDS = 8
#: share of the blank that a further table angle must take
_LEAST = 1e-3


def checked_roughing(
    impeller: Impeller, machine: Machine, table: IndexTable, catalogue: Catalogue, stated: CatalogueCutter | None,
    op: ImpellerOperationTable, paths: PathsTable, rough: RoughTable, walls: Sequence[SurfacePoints],
    ahead: float, workers: int, progress: Progress, keep: Keep = anew,
) -> tuple[CheckedRough, ...]:  # fmt: skip
    """A roughing program for each channel and table angle, with the results of its checks.

    Parameters
    ----------
    stated : the cutter; None: the largest that fits
    walls : points of the finished surfaces
    """
    how = roughing_settings(machine, op, paths, rough)
    link = Link(
        paths.lift_mm, paths.margin_mm, paths.touch_mm, 0.0, mm_s_from_mm_min(paths.link_feed_mm_min), paths.above_mm,
        paths.lift_mm,
    )  # fmt: skip
    plans = rough_channels(
        impeller, catalogue, stated, how, link, rad_s_from_rpm(rough.speed_rpm), table, rough.share, ahead, workers,
        lambda done, what: progress(0.6 * done, what), keep,
    )  # fmt: skip
    out: list[CheckedRough] = []
    stock: dict[int, TriDexel] = {}
    blanks: dict[int, trimesh.Trimesh] = {}
    for k, plan in enumerate(plans):
        if plan.index not in stock:
            blanks[plan.index] = blank_of(impeller, [plan.index], how, ahead)
            stock[plan.index] = TriDexel.of_mesh(blanks[plan.index], rough.grid_mm)
        safe, removal, left = without_touch(plan, stock[plan.index], rough.grid_mm, rough.touch_mm3, machine)
        first = not any(r.rough.index == plan.index for r in out)
        # a further table angle that takes nothing that is left is no program
        if first or removal.before - removal.after > _LEAST * removal.before:
            stock[plan.index] = left
            numbered = safe.numbered(len(out) + 1)
            out.append(
                _check_plan(
                    machine, numbered, removal, rough.touch_mm3, paths, walls, workers, table, impeller.blades,
                    blanks[plan.index], keep,
                )
            )  # fmt: skip
        progress(0.6 + 0.4 * (k + 1) / len(plans), f"check of {k + 1} roughing programs")
    return tuple(out)


def roughing_settings(
    machine: Machine, op: ImpellerOperationTable, paths: PathsTable, rough: RoughTable
) -> RoughingSettings:
    """Settings of the roughing of a job."""
    motion = LineMotion(
        paths.chord_mm * rough.coarser, mm_s_from_mm_min(rough.feed_mm_min), pallet_rate(machine), op.clearance_mm
    )
    return RoughingSettings(
        rough.depth_mm, rough.step_mm, rough.blades_mm, rough.hub_mm, motion, rough.check_mm, op.around, rough.over_mm
    )


def without_touch(
    plan: RoughingSetting, stock: TriDexel, grid: float, touch: float, machine: Machine
) -> tuple[RoughingSetting, ChannelRemoval, TriDexel]:
    """The plan without the rows on which a part above the cutting part removes some of the blank; what is removed, and
    what is left.

    A row that is left out leaves more material for those after it, so the simulation repeats until nothing is removed
    above the cutting part.
    """
    for turn in itertools.count():
        left = copy.deepcopy(stock)
        read = read_program_of(plan.program, machine, plan.cutter)
        removal = taken_from(left, read.program, plan.cutter, grid)
        bad = np.unique(plan.linked.track[read.source[removal.above > touch]])
        if not len(bad) or bad[0] < 0 or turn == _ROUNDS:
            break
        plan = plan.without(bad.tolist())
    return plan, removal, left


def _check_plan(
    machine: Machine, plan: RoughingSetting, removal: ChannelRemoval, touch: float, paths: PathsTable, walls:
    Sequence[SurfacePoints],
    workers: int, table: IndexTable, blades: int, blank: trimesh.Trimesh, keep: Keep,
) -> CheckedRough:  # fmt: skip
    read = read_program_of(plan.program, machine, plan.cutter)
    program, allowed = read.program, paths.gouge_mm

    def checked() -> tuple[Gouge, list[float]]:
        found = left_on(walls, program, plan.cutter, _HEIGHT, _DEPTH, step=_STEP, workers=workers)
        deep = deepest_gouge(
            walls, program, plan.cutter, _DEPTH, _RESOLUTION * allowed, allowed, step=_STEP, workers=workers
        )
        return deep, [float(x.rest.min()) for x in found]

    gouge, rest = keep(("rough check", plan.cutter, program.motion, program.p_work, program.axis), checked)
    stands: list[float | None] = []
    for hub in (False, True):
        least = min(r for w, r in zip(walls, rest, strict=True) if w.name.startswith("floor") == hub)
        stands.append(least if least < _HEIGHT else None)
    _, findings = to_axes(plan.program, machine)
    on_machine = axes_check(*findings, *too_fast(plan.program, machine))
    return CheckedRough(
        plan, gouge, allowed, (stands[0], stands[1]), removal, touch,
        on_machine, read, between_channels(plan.program, machine, blades),
        channel_repeat(plan.program, machine, table, blades), blank,
    )  # fmt: skip


def blank_of(impeller: Impeller, channels: Sequence[int], how: RoughingSettings, ahead: float) -> trimesh.Trimesh:
    """The blank of channels that lie side by side, with a part of their neighbours: from under the hub to above the
    shroud.
    """
    where = hub_range(impeller, ahead)
    s = np.linspace(*where, _MERIDIAN)
    n = impeller.hub.normal(s, np.zeros(len(s)))[:, [0, 2]]
    inner = impeller.hub.curve(s) - _UNDER * n
    low, high = (meridian(impeller, s, w, how.hub, where) for w in (0.0, 1.0))
    outer = high + how.over * (high - low) / np.linalg.norm(high - low, axis=1)[:, None]
    tops = [uncut(impeller, index, how, ahead, whole=True) for index in channels]
    angle = np.concatenate([np.arctan2(top[:, 1], top[:, 0]) for top in tops])
    first, last = _close_span(angle)
    edge = (1.0 - _BESIDE) * impeller.pitch
    return sector(inner, outer, first + edge, last - edge)


def _close_span(theta: NDArray[np.float64]) -> tuple[float, float]:
    """First and last of angles that stand close together [rad]: all but their widest gap."""
    around = np.sort(theta % math.tau)
    gap = np.diff(around, append=around[0] + math.tau)
    k = int(gap.argmax())
    first = float(around[(k + 1) % len(around)])
    return first, first + math.tau - float(gap[k])
