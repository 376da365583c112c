"""Program of the passes of a plan on the machine, with links and the time of each row."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, Severity
from chipload.jobs.thinwall.inputs import WallInputs
from chipload.machine.limits import limit_findings
from chipload.machine.machine import Machine
from chipload.planning.thinwall.linking import OperationMotion, link_passes
from chipload.planning.thinwall.pass_program import Margins, PassProgram
from chipload.planning.thinwall.passes import Plan
from chipload.program.check import check_program
from chipload.program.commands import Commands
from chipload.program.program import Program
from chipload.program.read import commands_and_times
from chipload.program.to_work import axes_of

Floats = NDArray[np.float64]

#: safe height of the tip over the wall, in radii of the cutter
SAFE = 1.5
#: links sag by this share of their distance to the stock
SAG = 0.3
#: rows run on beyond the edges of the wall by so many [mm], over the reach of the corner in its stock
BEYOND = 1.0


@dataclass(frozen=True, eq=False)
class OnMachine:
    """A program on the machine: axis positions, the time of each row of the tip [s], and findings where it exceeds the
    machine.
    """

    commands: Commands
    times: Floats
    exceeding: tuple[Finding, ...]


def on_machine(inputs: WallInputs, program: Program) -> OnMachine:
    """Axis positions of a program."""
    machine: Machine = inputs.cut.machine
    lengths = {o.cut.cutter.number: o.cut.cutter.overhang for o in inputs.operations}
    commands, times = commands_and_times(program, machine, lengths)
    axes = axes_of(commands, machine)
    violations = [*check_program(program, machine), *limit_findings(machine, axes, commands.line, placed=False)]
    exceeding = tuple(replace(f, severity=Severity.EXCEEDS) for f in violations if f.code != "machine-offset")
    return OnMachine(commands, times, exceeding)


def link_pass_programs(
    inputs: WallInputs, plan: Plan, places: tuple[Floats, Floats] | None = None
) -> tuple[PassProgram, ...]:
    """Linked passes of a plan at these places, u and v; None: those of the elements."""
    motions = [_motion(inputs, k) for k in range(len(inputs.operations))]
    return link_passes(plan.passes, motions, places or inputs.body.places)


def _motion(inputs: WallInputs, number: int) -> OperationMotion:
    """How an operation goes over the sides."""
    cut = inputs.operations[number].cut
    allowance = max(inputs.body.allowance)
    reach = math.sqrt(2.0 * cut.posture.meets * allowance)
    margins = Margins(
        BEYOND + reach, inputs.top + SAFE * cut.cutter.radius, SAG * (cut.pass_motion.clearance - allowance)
    )
    return OperationMotion(inputs.sides_of(number), cut.pass_motion, margins)
