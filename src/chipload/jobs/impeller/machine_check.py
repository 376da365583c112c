"""Check of a written impeller program on the whole machine: read back, compared, with what is around the part.

Notation: L [mm] length of a tool from the nose of the spindle to its tip. The texts are positions of the tip, so that
an axis along the tool stands by L further out; the part stands where the machine's file puts its zero.

What no tool may touch is still in the frame of the part. A program is of one channel: for the others it is turned about
the axis of the part, with the motion from the end of one to the beginning of the next.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.workpiece import Surroundings
from chipload.cutter.catalogue import CatalogueCutter
from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, InputError, Severity
from chipload.jobs.impeller.channels import turn_channel
from chipload.jobs.impeller.program_removal import ProgramRemoval
from chipload.machine.limits import limit_findings
from chipload.machine.machine import Machine
from chipload.planning.impeller.impeller import Impeller
from chipload.program.gcode.writer import Repeat
from chipload.program.path_mode import PathControl
from chipload.program.program import RAPID, Program
from chipload.program.read import ProgramReading
from chipload.program.read_back import UNITS, commands_back, no_end, read_back, reading_findings, unread
from chipload.program.to_axes import LIMITS
from chipload.program.to_work import axes_of, home
from chipload.result import Verdict
from chipload.simulation.clearance.body import above_cutting, cutting_part
from chipload.simulation.program_findings import TOUCHES, speed_findings
from chipload.simulation.steps import TURN, StepBlocks
from chipload.simulation.surface import Collision, collisions

Floats = NDArray[np.float64]

#: a contact that is less deep is none [mm]; longest step of a program [mm], along which the tool stands often enough
CONTACT, STEP = 0.05, 10.0
#: height of what the catalogue states no end of, at most [mm]
LONGEST = 1400.0


@dataclass(frozen=True, eq=False)
class AroundPart:
    """What no tool may touch besides the part.

    Parameters
    ----------
    points : of fixtures and of the machine table by name, (p, 3) [mm] each
    below : whether one of them lies below the part
    bottom : lowest height of the part [mm]
    clearance : least distance of neck, shank and holder [mm]
    blades : how many channels the part has
    """

    points: Mapping[str, Floats]
    below: bool
    bottom: float
    clearance: float
    blades: int


@dataclass(frozen=True)
class MachineCheck:
    """What a program does on the machine, and what its text shows there.

    Parameters
    ----------
    findings : notes are left out
    lengths : of the tool from its reach on, least and greatest [mm], with which the axes along it stay within their
        travel; None: its length is stated, or the axes do not depend on it
    """

    findings: tuple[Finding, ...] = ()
    lengths: tuple[float, float] | None = None

    @property
    def fails(self) -> tuple[str, ...]:
        """What breaks the part, the tool or the machine."""
        return tuple(f.text for f in self.findings if f.severity is Severity.EXCEEDS)

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is not proven."""
        return tuple(f.text for f in self.findings if f.severity is Severity.UNPROVEN)

    def joined(self, other: MachineCheck) -> MachineCheck:
        """Both."""
        return MachineCheck((*self.findings, *other.findings), self.lengths or other.lengths)


def verdict_of(fails: tuple[str, ...], doubts: tuple[str, ...]) -> Verdict:
    """Return the verdict of a partition from what fails and what is not proven."""
    return Verdict.EXCEEDS if fails else Verdict.UNPROVEN if doubts else Verdict.HOLDS


def program_verdict(fails: tuple[str, ...], doubts: tuple[str, ...], removal: ProgramRemoval | None) -> Verdict:
    """Return the verdict of a program; one whose removal is not simulated is unproven at best."""
    of_removal = Verdict.UNPROVEN if removal is None else removal.verdict
    return Verdict.worst([verdict_of(fails, doubts), of_removal])


def check_cell(verdict: Verdict) -> str:
    """Return the verdict as a cell of a table of the report."""
    if verdict is Verdict.HOLDS:
        return '<span class="ok">holds</span>'
    return f'<span class="no">{"does not hold" if verdict is Verdict.EXCEEDS else "unproven"}</span>'


def axes_check(*findings: Finding) -> MachineCheck:
    """Return the check of motions of the axes whose findings break the machine; positions are compared as written."""
    return MachineCheck(_as_exceeding(tuple(f for f in findings if f.code not in LIMITS)))


def around_part(surroundings: Surroundings, machine: Machine, impeller: Impeller, clearance: float) -> AroundPart:
    """Return what is around a part on a machine.

    Raises
    ------
    InputError
        A fixture or the table has too many points.
    """
    meshes = surroundings.fixture_meshes(machine)
    bottom = float(impeller.hub.meridian[:, 1].min())
    below = any(float(mesh.bounds[0][2]) < bottom for mesh in meshes.values())
    return AroundPart(surroundings.fixture_points(machine), below, bottom, clearance, impeller.blades)


def text_check(
    text: str, name: str, machine: Machine, cutter: CatalogueCutter, planned: Program, around: AroundPart
) -> MachineCheck:
    """Read the text of a program of one channel, compare it with the planned one, and check it on the machine.

    Parameters
    ----------
    name : of the file
    planned : of one tool, as it was simulated
    """
    tool = tool_of(cutter, planned, around)
    try:
        reading = read_back(text, name, machine, tool)
    except InputError as err:
        return MachineCheck((unread(err),))
    lengths, beyond = _travel(reading, cutter)
    program = _rows_after_placing(reading.program)
    found = [
        *_text_findings(reading, tool, planned), *no_end(text), *beyond, *speed_findings(program, tool),
        *_deepest_contacts(program, tool, around), *_deepest_below_part(program, tool, around),
    ]  # fmt: skip
    return MachineCheck(tuple(found), lengths)


def every_channel_findings(
    one: str, every: str, name: str, machine: Machine, cutter: CatalogueCutter, repeat: Repeat
) -> tuple[Finding, ...]:
    """Return where the text ``every`` of all channels does something else than that of ``one``, turned by a channel.

    Parameters
    ----------
    name : of the files
    repeat : how the text goes through all channels
    """
    first = int(one.partition(" M6")[0].rpartition("T")[2])
    tool = {first: cutter.assembled(first, LONGEST)}
    try:
        a, b = (commands_back(text, name, machine, tool) for text in (one, every))
    except InputError as err:
        return (unread(err),)
    n, m = len(a), len(b)
    if m != repeat.count * n:
        text = f"the text of all {repeat.count} channels has {m} motions: must have {repeat.count * n}"
        return (Finding("text-differs", 0, text, Severity.EXCEEDS),)
    on = np.zeros((repeat.count, 1, 9))
    axis = machine.chain.axis(repeat.letter)
    on[:, 0, axis.column] = np.arange(repeat.count) * math.radians(repeat.turn_deg) / repeat.count
    away = np.abs(axes_of(b, machine).reshape(repeat.count, n, 9) - axes_of(a, machine) - on)
    away[:, np.asarray(a.path_mode)[:, 0] == PathControl.UNPLACED] = 0.0
    wrong = (away > UNITS * 10.0**-machine.decimals).any(axis=2)
    for column in ("motion", "feed", "spindle", "tool", "turns"):
        x, y = (np.asarray(getattr(of, column), dtype=np.float64) for of in (a, b))
        wrong |= ~np.isclose(y.reshape(repeat.count, n), x, rtol=1e-6, atol=1e-9)
    if not wrong.any():
        return ()
    k = int(np.argmax(wrong.ravel()))
    text = f"the text of all channels differs from that of one in channel {k // n}"
    return (Finding("text-differs", int(b.line[k]), text, Severity.EXCEEDS),)


def every_channel(program: Program, blades: int) -> Program:
    """Return the rows of a program in each channel, one after the other, with the turns from one to the next."""
    around = np.unwrap(np.arctan2(program.axis[:, 1], program.axis[:, 0]))
    pitch = math.tau / blades
    on = pitch + float(around[0] - around[-1])
    count = math.ceil(abs(on) / TURN)
    share = np.arange(1, count)[:, None] / count
    ends = _rows(program, np.full(count - 1, len(program) - 1)), _rows(program, np.zeros(count - 1, dtype=np.int64))
    back = _turned_rows(ends[1].p_work, np.full(count - 1, -on + pitch))
    tip = _turned_rows((1.0 - share) * ends[0].p_work + share * back, on * share[:, 0])
    axis = _turned_rows(ends[0].axis, on * share[:, 0])
    between = replace(ends[0], motion=np.full(count - 1, RAPID), p_work=tip, axis=axis, feed=np.zeros(count - 1))
    one = Program.join([program, between]) if len(between) else program
    return Program.join([turn_channel(one, pitch * k) for k in range(blades)])


def _turned_rows(points: Floats, angle: Floats) -> Floats:
    """Points (n, 3), each turned about z by its angle (n,) [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1], points[:, 2]])


def _rows(program: Program, rows: NDArray[Any]) -> Program:
    """Some rows of a program, by number or mask."""
    kept = {f.name: getattr(program, f.name)[rows] for f in fields(program) if f.name != "labels"}
    return replace(program, **kept)


def tool_of(cutter: CatalogueCutter, program: Program, around: AroundPart) -> dict[int, Cutter]:
    """Return the tool of a program by its number; what has no end reaches over all that is around."""
    places = np.concatenate([program.p_work, *around.points.values()])
    number = int(program.tool[0])
    return {number: cutter.assembled(number, min(float(np.linalg.norm(np.ptp(places, axis=0))) + 1.0, LONGEST))}


def _text_findings(reading: ProgramReading, tool: Mapping[int, Cutter], planned: Program) -> Iterator[Finding]:
    """What keeps a text from being released, but for the travel of the axes."""
    return (f for f in reading_findings(reading, tool, planned) if f.code not in LIMITS)


def _rows_after_placing(program: Program) -> Program:
    """The rows from the first on before which each of X, Y and Z was sent somewhere."""
    known = np.asarray(program.path_mode)[:, 0] != PathControl.UNPLACED
    return _rows(program, known)


def _travel(reading: ProgramReading, cutter: CatalogueCutter) -> tuple[tuple[float, float] | None, tuple[Finding, ...]]:
    """Lengths of a tool with which the axes along it stay within their travel, and positions beyond a limit.

    Of a tool whose length is not stated an axis exceeds where no length, or none of the ``reach``, keeps it within.
    """
    machine, q = reading.machine, reading.axes
    known = np.asarray(reading.commands.path_mode)[:, 0] != PathControl.UNPLACED
    q, line = q[known], reading.commands.line[known]
    unit = home(machine, 1.0) - home(machine, 0.0)
    if any(axis.head for axis in machine.chain.rotary) or not len(q):
        unit = np.zeros(9)
    if cutter.length is not None:
        return None, _as_exceeding(limit_findings(machine, q + cutter.length * unit, line))
    least, most = 0.0, math.inf
    for axis in machine.chain.axes:
        u = unit[axis.column]
        if abs(u) > 1e-9:
            ends = (axis.low - q[:, axis.column].min()) / u, (axis.high - q[:, axis.column].max()) / u
            if u < 0.0:
                ends = (axis.high - q[:, axis.column].max()) / u, (axis.low - q[:, axis.column].min()) / u
            least, most = max(least, ends[0]), min(most, ends[1])
    shortest = max(least, cutter.reach or cutter.cutting_length or 0.0)
    lengths = (shortest, most) if unit.any() and shortest <= most else None
    return lengths, _as_exceeding(limit_findings(machine, q + shortest * unit, line))


def _as_exceeding(findings: tuple[Finding, ...]) -> tuple[Finding, ...]:
    return tuple(replace(f, severity=Severity.EXCEEDS) for f in findings)


def _deepest_contacts(program: Program, tool: Mapping[int, Cutter], around: AroundPart) -> Iterator[Finding]:
    """The deepest contact of each part of the tool with each body around the part, in any channel."""
    if not around.points or not len(program):
        return
    steps = StepBlocks(every_channel(program, around.blades), STEP, CONTACT)
    deepest: dict[tuple[str, str], Collision] = {}
    for c in collisions(steps, tool, around.points, CONTACT, clearance=around.clearance):
        if (c.what, c.into) not in deepest or c.depth_mm > deepest[c.what, c.into].depth_mm:
            deepest[c.what, c.into] = c
    for c in deepest.values():
        text = f"{c.what} goes {c.depth_mm:.3g} mm into {c.into}"
        if c.depth_mm <= 0.0:
            text = f"{c.what} comes within {-c.depth_mm:.3g} mm of {c.into}: clearance_mm = {around.clearance:g}"
        yield Finding("collision", c.line, text, Severity.EXCEEDS, c.at)


def _deepest_below_part(program: Program, tool: Mapping[int, Cutter], around: AroundPart) -> tuple[Finding, ...]:
    """The place where a tool goes deepest below the part, if nothing that lies there is stated."""
    if around.below or not len(program):
        return ()
    ((number, cutter),) = tool.items()
    low = np.minimum(*(part(cutter).box(program.axis)[0][:, 2] for part in (cutting_part, above_cutting)))
    depth = around.bottom - program.p_work[:, 2] - low
    k = int(np.argmax(depth))
    if depth[k] <= TOUCHES:
        return ()
    x, y, z = (float(v) for v in program.p_work[k])
    text = (
        f"tool {number} goes {depth[k]:.4g} mm below the lower end of the hub: what lies there is not stated: state "
        "the pallet or table ([machine_table]), or what is below ([[fixture]])"
    )
    return (Finding("below-stock", int(program.line[k]), text, Severity.UNPROVEN, (x, y, z)),)
