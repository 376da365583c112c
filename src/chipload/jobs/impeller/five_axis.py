"""Common parts of flank passes and point milling on five axes: the machine, the check of a program, all channels.

Notation: q position of the axis that turns the part about the impeller's z, theta = sense q; pitch = 2 pi / blades.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.jobs.impeller.channels import turn_channel
from chipload.jobs.impeller.five_axis_outcome import AllChannels
from chipload.jobs.impeller.machine_check import MachineCheck, axes_check
from chipload.jobs.impeller.paths import EDGE, gouge_by, left_by, walls_of
from chipload.jobs.impeller.ray_depth import ray_depth
from chipload.jobs.impeller.read_program import ReadProgram, read_program_of
from chipload.jobs.impeller.tables import PathsTable, SurfaceTable
from chipload.machine.kinematics import forward
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.planning.impeller.kept import Keep, anew
from chipload.planning.impeller.settings import FinishSettings
from chipload.planning.impeller.surfaces import BODIES
from chipload.program.check import check_program
from chipload.program.gcode.writer import Repeat
from chipload.program.program import Program
from chipload.program.to_axes import to_axes
from chipload.simulation.channel.channel import Remainder, SurfacePoints, wall
from chipload.simulation.channel.gouges import Gouge

Floats = NDArray[np.float64]

#: distance of the points of a surface on which the excess is measured [mm]
_SPACING = 0.6
#: by which axis positions may differ at the end of a channel and at the beginning of the next [mm, rad]
_SAME = 1e-6
#: of a program, a row each
_COLUMNS = (
    "motion", "p_work", "axis", "centre", "normal", "turns", "feed", "spindle", "tool", "line", "label", "path_mode",
)  # fmt: skip


def five_axis_machine(source: str | Path | None, key: str) -> Machine:
    """A machine by its shipped name or file, with two rotary axes that move in the cut.

    Raises
    ------
    InputError
        It cannot be read, or has not two such axes.
    """
    if source is None:
        raise InputError(f"{key}.machine: missing: state one with two rotary axes that move in the cut")
    machine = machine_named(source) if isinstance(source, str) else read_machine(source)
    free = sum(not axis.indexed for axis in machine.chain.rotary)
    if free < 2:
        raise InputError(f"{key}.machine: {machine.name} has {free} rotary axes that move in the cut: must have two")
    return machine


@dataclass(frozen=True, eq=False)
class ProgramCheck:
    """Result of the check of a program as its text was read: gouge, excess, what it does on the machine."""

    gouge: Gouge
    left: Remainder
    machine_check: MachineCheck
    read: ReadProgram


def program_check(
    how: FinishSettings, side: SurfaceTable, machine: Machine, cutter: CatalogueCutter, program: Program,
    paths: PathsTable, points: SurfacePoints | None = None, keep: Keep = anew,
) -> ProgramCheck:  # fmt: skip
    """Check of a program of a surface; ``points`` of the surface, None: evenly over it."""
    at = surface_points(how, side) if points is None else points
    depth = ray_depth(how.impeller, EDGE, paths.gouge_mm)
    read = read_program_of(program, machine, cutter)
    left = left_by(how, [at], read.program, cutter, depth, keep)[0]
    gouge = gouge_by(how, walls_of(how.impeller, how.ahead), read.program, cutter, depth, paths.gouge_mm, keep)
    _, beyond = to_axes(program, machine)
    return ProgramCheck(gouge, left, axes_check(*beyond), read)


def surface_points(how: FinishSettings, side: SurfaceTable, apart: float = _SPACING) -> SurfacePoints:
    """Points of the part of a surface that a job names, at most ``apart`` [mm] from one another."""
    surface = how.surface(BODIES.index(side.body), side.side)
    grid = []
    for (low, high), other, first in ((side.along, side.up, True), (side.up, side.along, False)):
        t, q = np.linspace(low, high, 41), np.linspace(*other, 5)
        lines = [surface.at(t, x) if first else surface.at(np.full(41, x), t) for x in q]
        size = max(float(np.linalg.norm(np.diff(x, axis=0), axis=1).sum()) for x in lines)
        grid.append(np.linspace(low, high, max(math.ceil(size / apart), 2) + 1))
    return wall(f"{side.body} {side.side}", surface, *grid)


def part_axis(machine: Machine) -> tuple[str, int] | None:
    """Letter and sense of the axis that turns the part about the work's z, whatever the others do; None: there is none.

    >>> part_axis(machine_named("cradle-ac")), part_axis(machine_named("xyzbcw-bridge"))
    (('C', -1), None)
    """
    for axis in machine.chain.rotary:
        if axis.indexed or axis.head:
            continue
        q = np.zeros((2, 9))
        for k, other in enumerate(machine.chain.axes):
            q[:, other.column] = 0.3 + 0.2 * k if other.rotary else 10.0 + 7.0 * k
        q[:, axis.column] = 0.0, 1.0
        p, T = forward(machine, q)
        for sense in (1, -1):
            c, s = math.cos(sense), math.sin(sense)
            R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
            if max(np.abs(R @ p[0] - p[1]).max(), np.abs(R @ T[0] - T[1]).max()) < _SAME:
                return axis.letter, sense
    return None


def all_channels(program: Program, machine: Machine, blades: int) -> AllChannels | str:
    """Program of all channels from that of one: as a loop, else row by row; a text where neither is possible.

    The program ends above the beginning of the next channel, so it has no other motions than those of its rows.
    """
    commands, _ = to_axes(program, machine)
    q, about = commands.position, part_axis(machine)
    if about is not None:
        axis = machine.chain.axis(about[0])
        on = np.zeros(q.shape[1])
        on[axis.column] = about[1] * math.tau / blades
        last = (blades - 1) * on[axis.column]
        own = q[:, axis.column]
        inside = own.min() + min(last, 0.0) >= axis.low and own.max() + max(last, 0.0) <= axis.high
        if inside and np.abs(q[-1] - q[0] - on).max() < _SAME:
            return AllChannels(Repeat(about[0], blades, 360.0 * about[1]), program)
    every = [turn_channel(program, math.tau * k / blades) for k in range(blades)]
    columns: dict[str, Any] = {name: np.concatenate([getattr(one, name) for one in every]) for name in _COLUMNS}
    whole = replace(program, **columns)
    _, beyond = to_axes(whole, machine)
    texts = [f.text for f in (*beyond, *check_program(whole, machine))]
    return f"no program of all channels: {texts[0]}" if texts else AllChannels(None, whole)
