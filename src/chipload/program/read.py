"""Program files of all dialects: the reader, the motions on a machine, the violations of its limits.

Notation: a **source** is a text of axes (RS-274, conversational: Commands) or of the tip (APT: Program). With a machine
each leads to the other, so that a :class:`ProgramReading` always has both.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, InputError, Severity
from chipload.files import decode_text, read_regular
from chipload.machine.limits import limit_findings
from chipload.machine.machine import Machine
from chipload.program.apt.cutters import read_cutters
from chipload.program.apt.reader import apt_text, read_apt
from chipload.program.block_delete import WITH, same_motions, with_block_delete, without_deleted_blocks
from chipload.program.check import check_program
from chipload.program.commands import PROBE, Commands
from chipload.program.control import CONTROLS, control_named, is_cl_data
from chipload.program.gcode.reader import gcode_text
from chipload.program.gcode.tools import ToolTable, read_tool_table
from chipload.program.heidenhain.reader import heidenhain_text, read_heidenhain, tool_definitions
from chipload.program.missing_axes import hold_missing_axes
from chipload.program.nc_text import NcText, read_nc
from chipload.program.program import Program
from chipload.program.recognise import Recognition, recognise
from chipload.program.reconcile import agree, unit_mm
from chipload.program.setup import Setup
from chipload.program.swivel import Swivel
from chipload.program.tapping import tapping_findings, thread_comments
from chipload.program.time import row_times, slow_machine
from chipload.program.to_axes import LIMITS, to_axes
from chipload.program.to_work import TOLERANCE_MM, axes_of, to_work, work_frame
from chipload.program.tool_comments import stated_tools
from chipload.program.tool_kinds import compare_kinds
from chipload.program.travel import offset_stated, travel_findings
from chipload.progress import Progress, silent
from chipload.units import mm_min_from_mm_s

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Dialect = Literal["linuxcnc", "fanuc", "sinumerik", "heidenhain", "apt"]

#: endings of NC texts whose control is told from what they hold
OF_TEXT = (
    ".ngc", ".nc", ".gcode", ".gc", ".g", ".gco", ".gcd", ".tap", ".cnc", ".txt", ".iso", ".eia", ".ptp", ".din", ".i",
    ".min", ".ssb", ".anc", ".ncc", ".ncf", ".prg", ".pgm", ".pim", ".dnc", ".mcd", ".sub",
)  # fmt: skip
#: dialect by the ending of a file; None: that of the machine
ENDINGS: dict[str, Dialect | None] = {
    **dict.fromkeys(OF_TEXT, None),
    **dict.fromkeys((".fnc", ".fan"), "fanuc"),
    **dict.fromkeys((".mpf", ".spf"), "sinumerik"),
    **dict.fromkeys((".h", ".hnc"), "heidenhain"),
    **dict.fromkeys((".apt", ".cls", ".cl", ".clt", ".cldata", ".aptsource", ".ncl"), "apt"),
}
#: findings that leave a result unproven where the place of the tip or of the axes depends on the tool's length
OF_LENGTHS = ("nc-length-unknown", "heidenhain-tool-unknown")
#: findings on retractions to positions of the machine that are not known, and so have no row
OF_RETRACTIONS = ("nc-machine-retraction", "heidenhain-m91")
#: largest tool table [bytes]
LARGEST_TABLE = 10_000_000


@dataclass(frozen=True, eq=False)
class ProgramReading:
    """A program on a machine.

    Parameters
    ----------
    commands : motions of the machine's axes
    program : motions of the tip in the work frame; rows on which a rotary axis moves may be several here
    machine : on which it was read
    placed : number of the work offset whose coordinates are those of the workpiece; None: the first that is used
    findings : by the reader
    violations : violations of the machine's limits
    of_text : whether it comes from a text, which begins from an unknown place and ends behind its last row
    skipped : the program with block delete on, where it moves otherwise then; ``violations`` and ``findings`` are of
        both
    recognition : the control that the text was read for; None: of no NC text
    unit : of lengths before the text states one
    """

    commands: Commands
    program: Program
    machine: Machine
    placed: int | None
    findings: tuple[Finding, ...]
    violations: tuple[Finding, ...]
    of_text: bool = False
    skipped: ProgramReading | None = None
    recognition: Recognition | None = None
    unit: str = "mm"

    @property
    def axes(self) -> Floats:
        """(n, 9) float [mm, rad], the machine's own axes at the end of each row of ``commands``; made at each call."""
        return axes_of(self.commands, self.machine, self.placed)

    @cached_property
    def seconds(self) -> Floats:
        """(n,) time of each row of the tip on this machine [s]."""
        rotary = self.machine.chain.rotary
        out = row_times(self.program, self.machine, self.commands, self.axes if rotary else None)
        out.setflags(write=False)
        return out

    @cached_property
    def seconds_high(self) -> float | None:
        """Time [s] of the program at the least jerk that the machine may have; None: its time is known."""
        slow = slow_machine(self.machine)
        return None if slow is None else float(line_times(self, slow)[1].sum())

    @property
    def unchecked(self) -> tuple[str, ...]:
        """What is not compared with the travel of the machine."""
        out = []
        if not offset_stated(self.commands):
            out.append(
                "travel: work offset not stated (program.work_offsets): only what each axis spans is compared with its "
                "travel"
            )
        elif not self.machine.chain.rotary and any(f.code in OF_LENGTHS for f in self.findings):
            out.append("travel of Z: tool lengths not stated (program.tools): only what it spans is compared")
        return tuple(out)

    @property
    def stops(self) -> tuple[int, ...]:
        """Lines at which the program stops for its operator."""
        return tuple(f.line for f in self.findings if f.code == "nc-stop")

    @property
    def retractions(self) -> tuple[int, ...]:
        """Lines that retract the tool to a position of the machine that is not known, and so have no row."""
        return tuple(f.line for f in self.findings if f.code in OF_RETRACTIONS)


def read_program(
    path: str | Path,
    machine: Machine,
    *,
    dialect: str | None = None,
    tools: ToolTable | None = None,
    feed: float | None = None,
    speed: float | None = None,
    tolerance: float = TOLERANCE_MM,
    text: str | None = None,
    setup: Setup | None = None,
    comments: bool = True,
    strict: bool = False,
    progress: Progress = silent,
) -> ProgramReading:
    """Read a program for a machine.

    What a controller would refuse and what is not read is a finding of the severity UNPROVEN as far as the rest can be
    read, unless ``strict``.

    Parameters
    ----------
    text : that stands for that of the file; None: the file is read
    dialect : name of a control, or apt; None: by the ending of the file, for NC texts by what the text shows
    tools : diameters and lengths; without it they count as 0
    feed : [mm/s] of cuts before the text states a feed
    speed : [rad/s] of the spindle, clockwise, before the text starts it, or in all of a text that never does
    setup : what the controller knows before the program, and the cutters of the job
    comments : the comments of NC text are held against the cutters of the job
    strict : NC text that LinuxCNC would refuse is refused
    tolerance : of rows on which a rotary axis moves [mm]

    Raises
    ------
    InputError
        The file cannot be read, what it asks for can't be carried out, or what is stated about a cutter contradicts
        the job's.
    """
    path, setup = Path(path), setup or Setup()
    recognition, text = control_of(path, machine, dialect, setup.control.name, text)
    kind = "apt" if recognition is None else cast("Dialect", recognition.control.language)
    values, origins, placed = setup.values(kind), setup.origins(kind), setup.placed(kind)
    swivel = Swivel(machine, placed)
    said: tuple[Finding, ...] = ()
    unit = "mm"
    if recognition is None:
        lengths = tools.lengths() if tools is not None else {}
        text = apt_text(path) if text is None else text
        units = cast("Literal['mm', 'inch'] | None", setup.control.unit)
        shapes = read_cutters(text, units=units or "mm")[0] if setup.cutters else {}
        agreed = agree(path.name, setup.cutters, tools=tools, shapes=shapes)
        program, findings = read_apt(text, name=path.stem, units=units, feed=feed)
        commands, found = to_axes(program, machine, tool_lengths=lengths, tolerance=tolerance)
        more = tuple(f for f in found if f.code not in LIMITS)
    else:
        if recognition.control.lines.form == "conversational":
            text = heidenhain_text(path) if text is None else text
            stated = tool_definitions(text) if setup.cutters and comments else {}
            agreed = agree(path.name, setup.cutters, tools=tools, comments=stated)
            known = setup.diameters()
            if tools is not None:
                known |= {n: abs(t.diameter) for n, t in tools.tools.items() if t.diameter != 0.0 and n not in known}
            commands, findings = read_heidenhain(
                text, name=path.name, folder=path.parent, parameters={int(k): v for k, v in values.items()},
                radii={n: 0.5 * diameter for n, diameter in known.items()}, feed=feed,
                swivel=swivel, lenient=not strict,
            )  # fmt: skip
        else:
            text = gcode_text(path) if text is None else text
            nc = NcText(path, text, recognition, setup, tools, comments, origins, values)
            unit = nc.unit
            agreed = agree(path.name, setup.cutters, tools=nc.table, comments=nc.stated)
            rate = None if feed is None else mm_min_from_mm_s(feed)
            commands, findings, said = read_nc(nc, rate, strict, swivel, progress)
        if setup.cutters and comments:
            agreed += compare_kinds(setup.cutters, stated_tools(text, unit_mm(text, unit)))
        if len(commands) == 0:
            left_out = next((f": {f}" for f in findings if f.severity >= Severity.UNPROVEN), "")
            raise InputError(f"{path.name}: no motion: nothing to check{left_out}")
        commands, held = hold_missing_axes(commands, machine)
        findings += held
        program, more = to_work(commands, machine, tolerance=tolerance, placed=placed)
        if _needs_lengths(commands, machine, placed):
            findings = tuple(replace(f, severity=Severity.UNPROVEN) if f.code in OF_LENGTHS else f for f in findings)
    if speed is not None:
        commands = replace(commands, spindle=_turning_speeds(commands.spindle, speed))
        program = replace(program, spindle=_turning_speeds(program.spindle, speed))
    taps = tapping_findings(program, setup.cutters, {} if is_cl_data(kind) else thread_comments(text))
    breaks = tuple(f for f in taps if f.severity is Severity.EXCEEDS)
    findings += tuple(f for f in taps if f.severity is not Severity.EXCEEDS)
    reading = _check_program(commands, program, machine, (*said, *agreed, *findings), more, placed)
    violations = (*reading.violations, *breaks)
    reading = replace(reading, violations=violations, of_text=True, recognition=recognition, unit=unit)
    other = text if is_cl_data(kind) else without_deleted_blocks(text)
    if other == text:
        return reading
    try:
        skipped = read_program(
            path, machine, dialect=dialect, tools=tools, feed=feed, speed=speed, tolerance=tolerance, text=other,
            setup=setup, comments=comments, strict=strict,
        )  # fmt: skip
    except InputError as refusal:
        unread = Finding("block-delete", 0, f"{WITH}, the program cannot be read: {refusal}", Severity.UNPROVEN)
        return replace(reading, findings=(*reading.findings, unread))
    if same_motions(program, skipped.program):
        return reading
    return replace(
        reading,
        skipped=skipped,
        findings=(*reading.findings, *_others(skipped.findings, reading.findings)),
        violations=(*reading.violations, *_others(skipped.violations, reading.violations)),
    )


def _needs_lengths(commands: Commands, machine: Machine, placed: int | None) -> bool:
    """Whether the path depends on the lengths of the tools: a rotary axis carries the tool, or, with an origin that is
    stated, the axes themselves are compared with their travel.

    In a table the rotary axes turn the workpiece alone: the control adds the length to Z, and the tip goes as written.
    """
    rotary, origin = machine.chain.rotary, work_frame(commands, placed)
    return any(axis.head for axis in rotary) or (bool(rotary) and (origin.stated or bool(origin.offset.any())))


def _others(findings: tuple[Finding, ...], known: tuple[Finding, ...]) -> Iterator[Finding]:
    """Findings with block delete on that are not made without it."""
    without = {(f.code, f.line, f.text) for f in known}
    return (with_block_delete(f) for f in findings if (f.code, f.line, f.text) not in without)


def _turning_speeds(spindle: Floats, speed: float) -> Floats:
    """Speeds of the spindle [rad/s], with one for the rows before it first turns."""
    first = int(np.argmax(spindle != 0.0)) if spindle.any() else len(spindle)
    return np.concatenate([np.full(first, speed), spindle[first:]])


def reading_of(
    program: Program,
    machine: Machine,
    *,
    tool_lengths: Mapping[int, float] | None = None,
    tolerance: float = TOLERANCE_MM,
) -> ProgramReading:
    """What the axes of a machine do for a program that comes from no file, and what is wrong with it there.

    Parameters
    ----------
    tool_lengths : [mm] of each tool; one that is not named has 0
    tolerance : of rows on which a rotary axis moves [mm]

    Raises
    ------
    InputError
        It does not move, or the machine has not the axes that it moves.
    """
    if len(program) == 0:
        raise InputError("program: no motion: nothing to check")
    commands, found = to_axes(program, machine, tool_lengths=tool_lengths, tolerance=tolerance)
    return _check_program(commands, program, machine, (), tuple(f for f in found if f.code not in LIMITS))


def _check_program(
    commands: Commands,
    program: Program,
    machine: Machine,
    findings: tuple[Finding, ...],
    more: tuple[Finding, ...],
    placed: int | None = None,
) -> ProgramReading:
    """A program held against the limits of a machine."""
    probes = np.unique(commands.line[commands.motion == PROBE])
    # where the first motion of a text begins is not known, be it a rapid or a cut: the simulation looks at its end
    checked = check_program(program, machine, travel=False, probes=probes.tolist())
    violations = [f for f in checked if f.code != "program-start"]
    if not machine.chain.rotary:
        violations += travel_findings(commands, machine, not any(f.code in OF_LENGTHS for f in findings))
    if machine.chain.rotary:
        axes = axes_of(commands, machine, placed)
        base = work_frame(commands, placed)
        found = limit_findings(machine, axes, commands.line, placed=base.stated or bool(base.offset.any()))
        violations += [f for f in found if f.code != "machine-offset"]
        more += tuple(f for f in found if f.code == "machine-offset")
    problems = ("machine-reach", "machine-linear")
    violations += [f for f in more if f.code in problems]
    findings += tuple(f for f in more if f.code not in problems)
    return ProgramReading(commands, program, machine, placed, findings, tuple(violations))


def times_of(reading: ProgramReading, machine: Machine) -> Floats:
    """(n,) time of each row of the tip [s], see :mod:`chipload.program.time`."""
    if machine is reading.machine:
        return reading.seconds
    return row_times(reading.program, machine, reading.commands, reading.axes if machine.chain.rotary else None)


def command_times(commands: Commands, machine: Machine) -> Floats:
    """(m,) time of each command [s], written as a block of its own."""
    blocks = replace(commands, line=np.arange(len(commands)))
    tips, _ = to_work(blocks, machine)
    seconds = row_times(tips, machine, blocks, axes_of(blocks, machine))
    return _sum_by_row(tips.line, seconds, len(commands))


def times_on(program: Program, machine: Machine, tool_lengths: Mapping[int, float] | None = None) -> Floats:
    """(n,) time of each row of a program that comes from no file [s], as its text takes it.

    Parameters
    ----------
    tool_lengths : [mm] of each tool; one that is not named has 0
    """
    return commands_and_times(program, machine, tool_lengths)[1]


def commands_and_times(
    program: Program, machine: Machine, tool_lengths: Mapping[int, float] | None = None
) -> tuple[Commands, Floats]:
    """Return the motions of the axes for a program, and :func:`times_on` of it."""
    rows = replace(program, line=np.arange(len(program)))
    try:
        commands, _ = to_axes(rows, machine, tool_lengths=tool_lengths)
    except InputError:  # a message names the lines of the program
        to_axes(program, machine, tool_lengths=tool_lengths)
        raise
    times = _sum_by_row(commands.line, command_times(commands, machine), len(program))
    return replace(commands, line=program.line[commands.line]), times


def _sum_by_row(row: Ints, seconds: Floats, n: int) -> Floats:
    """(n,) sums of times by row."""
    out = np.zeros(n)
    np.add.at(out, row, seconds)
    return out


def line_times(reading: ProgramReading, machine: Machine) -> tuple[Ints, Floats]:
    """Lines of the source that move, (m,) rising, and their times (m,) [s]: sums of :func:`times_of`."""
    own = reading.program.line
    count = max(int(own.max(initial=0)), int(reading.commands.line.max(initial=0))) + 1
    named = np.zeros(count, dtype=np.bool_)
    named[own] = named[reading.commands.line] = True
    lines = np.flatnonzero(named).astype(np.int64)
    return lines, np.asarray(np.bincount(own, times_of(reading, machine), count)[lines], dtype=np.float64)


def read_tools(path: str | Path) -> ToolTable:
    """LinuxCNC's tool table from a file; lengths in mm.

    Raises
    ------
    InputError
        The file cannot be read or an entry is wrong.
    """
    path = Path(path)
    text = decode_text(read_regular(path, path.name, LARGEST_TABLE, "not a tool table"))
    return read_tool_table(text, name=path.name)[0]


def control_of(
    path: Path, machine: Machine, dialect: str | None, control: str | None, text: str | None
) -> tuple[Recognition | None, str | None]:
    """The control of a file, None for CL data, and its text where it had to be read to tell.

    Raises
    ------
    InputError
        A control or the ending is not known, or two statements differ.
    """
    if control is not None:
        profile = control_named(control)
        if dialect is not None and dialect_of(path, machine, dialect) != profile.language:
            raise InputError(
                f"program.control = {control!r} and dialect = {dialect!r}: {control} is {profile.language}: state one"
            )
        return Recognition(profile, True), text
    kind = dialect_of(path, machine, dialect)
    if kind not in CONTROLS:
        return None, text
    ending = path.suffix.lower()
    if dialect is not None or ENDINGS.get(ending) is not None:
        return Recognition(control_named(dialect or kind), True), text
    text = gcode_text(path) if text is None else text
    return recognise(text, machine.control or machine.dialect, ending), text


def dialect_of(path: Path, machine: Machine, stated: str | None = None) -> Dialect:
    """The dialect of a file: as it is said, else by its ending, for NC texts that of the machine.

    Raises
    ------
    InputError
        The dialect or the ending is not known.
    """
    if stated is not None:
        if stated in CONTROLS:
            return cast("Dialect", control_named(stated).language)
        if stated not in get_args(Dialect):
            raise InputError(f"dialect = {stated!r}: must be one of {', '.join(get_args(Dialect))}")
        return cast("Dialect", stated)
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        known = " ".join(ENDINGS)
        shown = ending or "none"
        raise InputError(f"{path.name}: the ending {shown} is not known: must be one of {known}, or name a dialect")
    return ENDINGS[ending] or cast("Dialect", machine.dialect)
