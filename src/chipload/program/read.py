"""Any program file: who reads it, what it does on a machine, what is wrong with it there.

Notation: a **source** is a text of axes (RS-274, conversational: Commands) or of the tip (APT: Program). With a machine
each leads to the other, so that a :class:`Reading` always has both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, InputError
from chipload.machine.feed import row_time_limited
from chipload.machine.limits import limit_findings
from chipload.machine.machine import Machine
from chipload.program.apt.reader import read_apt_file
from chipload.program.check import check_program
from chipload.program.commands import Commands
from chipload.program.gcode.reader import read_gcode, read_gcode_file
from chipload.program.gcode.tools import ToolTable, read_tool_table
from chipload.program.heidenhain.reader import read_heidenhain_file
from chipload.program.program import Program
from chipload.program.time import program_time
from chipload.program.to_axes import LIMITS, to_axes
from chipload.program.to_work import TOLERANCE_MM, axes_of, to_work, work_frame
from chipload.progress import Progress, silent

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Dialect = Literal["linuxcnc", "fanuc", "sinumerik", "heidenhain", "apt"]

#: dialect by the ending of a file; None: that of the machine
ENDINGS: dict[str, Dialect | None] = {
    **dict.fromkeys((".ngc", ".nc", ".gcode", ".tap", ".cnc", ".txt", ".iso", ".eia", ".ptp"), None),
    **dict.fromkeys((".mpf", ".spf"), "sinumerik"),
    **dict.fromkeys((".h", ".hnc"), "heidenhain"),
    **dict.fromkeys((".apt", ".cls", ".cl", ".clt", ".cldata"), "apt"),
}
#: largest tool table [bytes]
LARGEST_TABLE = 10_000_000


@dataclass(frozen=True, eq=False)
class Reading:
    """A program on a machine.

    Parameters
    ----------
    commands : motions of the machine's axes
    program : motions of the tip in the work frame; rows on which a rotary axis moves may be several here
    axes : (n, 9) float [mm, rad], the machine's own axes at the end of each row of ``commands``
    noticed : by the reader
    broken : what the program asks of the machine that it does not give
    """

    commands: Commands
    program: Program
    axes: Floats
    noticed: tuple[Finding, ...]
    broken: tuple[Finding, ...]


def read_program(
    path: str | Path,
    machine: Machine,
    *,
    dialect: str | None = None,
    tools: ToolTable | None = None,
    feed: float | None = None,
    tolerance: float = TOLERANCE_MM,
    text: str | None = None,
    progress: Progress = silent,
) -> Reading:
    """Read a program for a machine.

    Parameters
    ----------
    text : an NC text that stands for that of the file; None: the file is read
    dialect : None: by the ending of the file, for NC texts that of the machine
    tools : diameters and lengths; without it they count as 0
    feed : [mm/s] of CL data that state none
    tolerance : of rows on which a rotary axis moves [mm]

    Raises
    ------
    InputError
        The file cannot be read, its controller would refuse it, the machine has not the axes that it moves.
    """
    path = Path(path)
    kind = dialect_of(path, machine, dialect)
    if kind == "apt":
        lengths = tools.lengths() if tools is not None else {}
        program, noticed = read_apt_file(path, feed=feed)
        commands, found = to_axes(program, machine, tool_lengths=lengths, tolerance=tolerance)
        more = tuple(f for f in found if f.code not in LIMITS)
    else:
        if kind == "heidenhain":
            commands, noticed = read_heidenhain_file(path)
        elif text is None:
            commands, noticed = read_gcode_file(path, dialect=kind, tools=tools, progress=progress)
        else:
            commands, noticed = read_gcode(
                text, name=path.name, folder=path.parent, dialect=kind, tools=tools, progress=progress
            )
        if len(commands) == 0:
            raise InputError(f"{path.name}: no motion: nothing to check")
        program, more = to_work(commands, machine, tolerance=tolerance)
    return _held(commands, program, machine, noticed, more)


def reading_of(
    program: Program,
    machine: Machine,
    *,
    tool_lengths: Mapping[int, float] | None = None,
    tolerance: float = TOLERANCE_MM,
) -> Reading:
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
    return _held(commands, program, machine, (), tuple(f for f in found if f.code not in LIMITS))


def _held(
    commands: Commands,
    program: Program,
    machine: Machine,
    noticed: tuple[Finding, ...],
    more: tuple[Finding, ...],
) -> Reading:
    """A program held against the limits of a machine."""
    axes = axes_of(commands, machine)
    broken = [*check_program(program, machine)]
    if machine.chain.rotary:
        found = limit_findings(machine, axes, commands.line, placed=bool(work_frame(commands).offset.any()))
        broken += [f for f in found if f.code != "machine-offset"]
        more += tuple(f for f in found if f.code == "machine-offset")
    problems = ("machine-reach", "machine-linear")
    broken += [f for f in more if f.code in problems]
    noticed += tuple(f for f in more if f.code not in problems)
    return Reading(commands, program, axes, noticed, tuple(broken))


def line_times(reading: Reading, machine: Machine) -> tuple[Ints, Floats]:
    """Lines of the source that move, (m,) rising, and their times (m,) [s].

    The time of the path (feeds, rapid rate, accelerations, see :mod:`chipload.program.time`), and where a rotary axis
    moves at least what the rates of all axes need.
    """
    program, commands = reading.program, reading.commands
    lines = np.unique(np.concatenate([program.line, commands.line]))
    seconds = np.zeros(len(lines))
    np.add.at(seconds, np.searchsorted(lines, program.line), program_time(program, machine))
    if machine.chain.rotary:
        least = np.concatenate([[0.0], row_time_limited(machine, reading.axes)])[: len(commands)]
        by_axes = np.zeros(len(lines))
        np.add.at(by_axes, np.searchsorted(lines, commands.line), least)
        seconds = np.maximum(seconds, by_axes)
    return lines, seconds


def read_tools(path: str | Path) -> ToolTable:
    """LinuxCNC's tool table from a file; lengths in mm.

    Raises
    ------
    InputError
        The file cannot be read or an entry is wrong.
    """
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST_TABLE:
            raise InputError(f"{path.name}: must be at most {LARGEST_TABLE} bytes")
        text = path.read_bytes().decode("utf-8", "replace")
    except OSError as err:
        raise InputError(f"{path.name}: cannot be read: {err.strerror}") from None
    return read_tool_table(text, name=path.name)[0]


def dialect_of(path: Path, machine: Machine, said: str | None = None) -> Dialect:
    """The dialect of a file: as it is said, else by its ending, for NC texts that of the machine.

    Raises
    ------
    InputError
        The dialect or the ending is not known.
    """
    if said is not None:
        if said not in get_args(Dialect):
            raise InputError(f"dialect = {said!r}: must be one of {', '.join(get_args(Dialect))}")
        return cast("Dialect", said)
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        known = " ".join(ENDINGS)
        shown = ending or "none"
        raise InputError(f"{path.name}: the ending {shown} is not known: must be one of {known}, or name a dialect")
    return ENDINGS[ending] or cast("Dialect", machine.dialect)
