"""Finishing programs of an impeller: planned patch by patch, then checked by the simulation of the channel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.jobs.impeller.channels import between_channels, channel_repeat
from chipload.jobs.impeller.machine_check import axes_check
from chipload.jobs.impeller.outcome import Checked, Covered, Scallop
from chipload.jobs.impeller.ray_depth import ray_depth
from chipload.jobs.impeller.read_program import read_program_of
from chipload.jobs.impeller.tables import ImpellerOperationTable, PathsTable
from chipload.machine.machine import Machine
from chipload.planning.impeller.coverage import between_lines
from chipload.planning.impeller.covering.covering import Covering
from chipload.planning.impeller.feeds import ForceTerms
from chipload.planning.impeller.floor import patch_of
from chipload.planning.impeller.impeller import Impeller
from chipload.planning.impeller.kept import Keep, PlanTask, anew
from chipload.planning.impeller.lines import LineMotion
from chipload.planning.impeller.links import Link
from chipload.planning.impeller.paths import PatchFinish
from chipload.planning.impeller.planned_settings import PlannedSettings, loads_at_feeds
from chipload.planning.impeller.programs import pallet_rate, too_fast
from chipload.planning.impeller.settings import FinishSettings, Milling, channel_scene
from chipload.planning.impeller.surfaces import BODIES, ContactSampling
from chipload.planning.impeller.tables import IndexTable
from chipload.program.program import Program
from chipload.program.to_axes import to_axes
from chipload.simulation.channel.channel import Remainder, SurfacePoints, left_on, scallop_numbers, wall
from chipload.simulation.channel.gouges import Gouge, deepest_gouge
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm

#: of a lift at the feed of the cut where the job does not state it [mm]
_LEAD = 1.0
#: of the gouge that is allowed, how near its depth is found
_RESOLUTION = 0.2
#: points of the walls by which their cells are laid out, and where roughing is checked, along and up
_COARSE = (61, 25)
#: not at the very edges of a blade: there a ray into the metal leaves it again
EDGE = 0.01
#: how far the rays go above a surface [mm]
_HEIGHT = 1.0
#: distance of points of a whole surface on which the excess is measured [mm]
_SPACING = 0.6
#: grid lines across the passes of a patch on which the scallop is measured, points between two passes
_FEW, _BETWEEN = 7, 14


def finish_settings(
    impeller: Impeller, machine: Machine, table: IndexTable, catalogue: Catalogue, op: ImpellerOperationTable,
    paths: PathsTable, ahead: float, tools: int, workers: int, covering: Covering | None = None,
    forces: ForceTerms | None = None,
) -> FinishSettings:  # fmt: skip
    """Parameters with which the finishing programs of a job are planned.

    ``tools`` : how many tool numbers are taken; ``covering`` : of the walls between check points; ``forces`` : by which
    passes are fed, None: all alike.
    """
    feed = mm_s_from_mm_min(op.feed_mm_min)
    motion = LineMotion(paths.chord_mm, feed, pallet_rate(machine), op.clearance_mm, scallop=op.scallop_mm)
    stands = max(op.rough.blades_mm, op.rough.hub_mm) if op.rough is not None else 0.0
    lead = paths.lead_mm if paths.lead_mm is not None else min(max(_LEAD, stands), paths.lift_mm)
    link = Link(
        paths.lift_mm, paths.margin_mm, paths.touch_mm, paths.near_mm, mm_s_from_mm_min(paths.link_feed_mm_min),
        paths.above_mm, lead, stands, machine.rapid,
    )  # fmt: skip
    scene = channel_scene(
        impeller, ContactSampling((0.0, 1.0), (0.0, 1.0), (2, 2), paths.check_mm, op.near_mm, op.around, ahead)
    )
    scene = replace(scene, covering=covering, known=scene.tree)
    return FinishSettings(
        impeller, catalogue, scene, PatchFinish(op.scallop_mm, motion, paths.overrun_mm), link,
        rad_s_from_rpm(op.speed_rpm), table, ahead, workers, tools, forces,
    )  # fmt: skip


def checked_programs(
    job: FinishSettings, machine: Machine, plan: PlannedSettings, paths: PathsTable, keep: Keep = anew
) -> tuple[tuple[Checked, ...], tuple[Covered, ...]]:
    """A program for each setting with the check of what its text says; the excess of all of them on each surface."""
    impeller, scallop, settings = job.impeller, job.how.scallop, plan.settings
    millings = [m for s in settings for m in s.millings]
    faces = list(dict.fromkeys((m.patch.body, m.patch.side) for m in millings))
    dense = [_dense(impeller, m, job.ahead) for m in millings]
    whole = [_whole(job, body, side, millings) for body, side in faces]
    coarse = walls_of(impeller, job.ahead)
    walls = [*dense, *whole]
    depth = ray_depth(impeller, EDGE, paths.gouge_mm)
    # the longest program first, so that no process waits for it at the end
    reads = [read_program_of(s.program, machine, s.cutter) for s in settings]
    settings = loads_at_feeds(job, settings, [r.as_planned(s.program) for s, r in zip(settings, reads, strict=True)])
    both = [(r.program, s.cutter) for s, r in zip(settings, reads, strict=True)]
    long_first = sorted(both, key=lambda one: -len(one[0]))
    gouges = [_gouge_task(coarse, program, cutter, depth, paths.gouge_mm) for program, cutter in long_first]
    keep.ahead([*gouges, *(_left_task(walls, program, cutter, depth) for program, cutter in long_first)])
    found = [left_by(job, walls, program, cutter, depth, keep) for program, cutter in both]
    # what is left is what no program takes
    rest = [replace(same[0], rest=np.min([x.rest for x in same], axis=0)) for same in zip(*found, strict=True)]
    own = [k for k, setting in enumerate(settings) for _ in setting.millings]
    others = ((left, found[k][i].rest_row) for i, (k, left) in enumerate(zip(own, rest, strict=False)))
    out = []
    for setting, read in zip(settings, reads, strict=True):
        program = setting.program
        scallops = tuple(_scallop(m, *next(others), scallop) for m in setting.millings)
        _, findings = to_axes(program, machine)
        on_machine = axes_check(*findings, *too_fast(program, machine))
        gouge = gouge_by(job, coarse, read.program, setting.cutter, depth, paths.gouge_mm, keep)
        between = between_channels(program, machine, impeller.blades)
        repeat = channel_repeat(program, machine, job.table, impeller.blades)
        out.append(Checked(setting, gouge, paths.gouge_mm, scallops, on_machine, read, between, repeat))
    covered = tuple(
        Covered(face[0], face[1], left, scallop, _SPACING, plan.unreached[face])
        for face, left in zip(faces, rest[len(dense) :], strict=True)
    )
    return tuple(out), covered


def _moves_key(program: Program, cutter: CatalogueCutter) -> tuple[object, ...]:
    """What the checks of a program depend on beside the walls."""
    return (cutter, program.motion, program.p_work, program.axis)


def left_by(
    job: FinishSettings, walls: Sequence[SurfacePoints], program: Program, cutter: CatalogueCutter, depth: float,
    keep: Keep = anew,
) -> tuple[Remainder, ...]:  # fmt: skip
    """Excess that a program leaves on each wall."""
    got = _left_task(walls, program, cutter, depth).of(job, keep)
    return tuple(
        Remainder(w, rest, rest_row, gouge, row, part, _HEIGHT, depth)
        for w, (rest, rest_row, gouge, row, part) in zip(walls, got, strict=True)
    )


def _left_task(walls: Sequence[SurfacePoints], program: Program, cutter: CatalogueCutter, depth: float) -> PlanTask:
    key = ("left with rows", *_moves_key(program, cutter), [w.points for w in walls])
    return PlanTask(key, _left_columns, (walls, program, cutter, depth))


def _left_columns(
    job: FinishSettings, walls: Sequence[SurfacePoints], program: Program, cutter: CatalogueCutter, depth: float
) -> list[list[NDArray[Any]]]:
    found = left_on(walls, program, cutter, _HEIGHT, depth, workers=job.workers)
    return [[x.rest, x.rest_row, x.gouge, x.row, x.part] for x in found]


def gouge_by(
    job: FinishSettings, walls: Sequence[SurfacePoints], program: Program, cutter: CatalogueCutter, depth: float,
    allowed: float, keep: Keep = anew,
) -> Gouge:  # fmt: skip
    """Deepest gouge of a program."""
    found: Gouge = _gouge_task(walls, program, cutter, depth, allowed).of(job, keep)
    return found


def _gouge_task(
    walls: Sequence[SurfacePoints], program: Program, cutter: CatalogueCutter, depth: float, allowed: float
) -> PlanTask:
    return PlanTask(("gouge", *_moves_key(program, cutter)), _deepest, (walls, program, cutter, depth, allowed))


def _deepest(
    job: FinishSettings, walls: Sequence[SurfacePoints], program: Program, cutter: CatalogueCutter, depth: float,
    allowed: float,
) -> Gouge:  # fmt: skip
    return deepest_gouge(walls, program, cutter, depth, _RESOLUTION * allowed, allowed, workers=job.workers)


def _whole(job: FinishSettings, body: int, side: str, millings: Sequence[Milling]) -> SurfacePoints:
    """Points of a surface within its patches."""
    surface = job.surface(body, side)
    boxes = np.array([m.box for m in millings if (m.patch.body, m.patch.side) == (body, side)])
    low, high = boxes[:, :, 0].min(axis=0), boxes[:, :, 1].max(axis=0)
    grid = []
    for k in (0, 1):
        t = np.linspace(low[k], high[k], 41)
        other = np.linspace(low[1 - k], high[1 - k], 5)
        lines = [surface.at(t, q) if k == 0 else surface.at(q, t) for q in other]
        size = max(float(np.linalg.norm(np.diff(x, axis=0), axis=1).sum()) for x in lines)
        grid.append(np.linspace(low[k], high[k], max(3, math.ceil(size / _SPACING) + 1)))
    return wall(f"{BODIES[body]} {side}", surface, grid[0], grid[1])


def _scallop(milling: Milling, left: Remainder, own_row: NDArray[np.int64], limit: float) -> Scallop:
    """The scallop of a patch where passes lie on both sides; ``own_row`` (n,) of its program that passes lowest."""
    within = between_lines(milling.tracks.tracks, milling.along, np.column_stack([left.wall.u, left.wall.v]))
    numbers = scallop_numbers(left.scallops("v" if milling.along == "u" else "u", within), limit)
    k = int(np.where(within, left.rest, -1.0).argmax())
    most = float(left.rest[k]) if within.any() else 0.0
    covered = float(left.wall.area[left.rest <= limit].sum() / left.wall.area.sum())
    x, y, z = left.wall.points[k].tolist()
    place = (x, y, z) if within.any() else None
    return Scallop(limit, most, numbers["mean_mm"], int(numbers["count"]), covered, place, int(own_row[k]))


def _dense(impeller: Impeller, milling: Milling, ahead: float) -> SurfacePoints:
    """Points of a patch, fine across its passes."""
    surface = patch_of(impeller, BODIES[milling.patch.body], milling.patch.side, ahead)
    fine = np.linspace(0.0, 1.0, min(max(milling.tracks.lines, 2) * _BETWEEN, 1200) + 1)
    few = np.linspace(0.06, 0.94, _FEW)
    share = (few, fine) if milling.along == "u" else (fine, few)
    u, v = (low + x * (high - low) for x, (low, high) in zip(share, milling.box, strict=True))
    return wall(f"{BODIES[milling.patch.body]} {milling.patch.side}", surface, u, v)


def walls_of(impeller: Impeller, ahead: float) -> list[SurfacePoints]:
    """Both sides of the bodies round the channels, and their floors."""
    u, v = np.linspace(EDGE, 1.0 - EDGE, _COARSE[0]), np.linspace(0.0, 1.0 - EDGE, _COARSE[1])
    last = 1 + len(impeller.bodies)
    out = []
    for k in range(-1, last):
        body = impeller.body(k)
        out += [wall(f"body {k} plus", body.plus, u, v), wall(f"body {k} minus", body.minus, u, v)]
        if impeller.fillets:
            inner = np.linspace(0.05, 0.95, _COARSE[1])
            out += [wall(f"fillet {k} {n}", impeller.foot(k, w), u, inner) for n, w in (("plus", 1), ("minus", -1))]
    for index in range(len(impeller.bodies)):
        floor = patch_of(impeller, BODIES[index], "floor", ahead)
        turn = impeller.pitch
        out += [wall(f"floor {index}", floor, u, v), wall(f"floor {index} behind", floor.turned(-turn), u, v)]
    return out
