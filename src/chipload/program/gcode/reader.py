"""RS-274 text to Commands.

Notation: positions are X Y Z A B C U V W in mm and rad. The dialect is that of LinuxCNC 2.9, of a Fanuc or of a
Sinumerik; a text is refused where its controller would refuse it, and what is left out is a finding.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

from chipload.errors import Finding, InputError
from chipload.files import decode_text, read_regular
from chipload.program.commands import Commands
from chipload.program.control import Control, control_named
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.dialect import Dialect
from chipload.program.gcode.fanuc import Fanuc
from chipload.program.gcode.flow import Flow
from chipload.program.gcode.interpreter import BlockInterpreter
from chipload.program.gcode.offsets import note_missing_lengths, note_unset_offsets, with_stated_offsets
from chipload.program.gcode.sinumerik import Sinumerik
from chipload.program.gcode.source import Source, lines_of, read_source
from chipload.program.gcode.state import nine
from chipload.program.gcode.tools import ToolTable
from chipload.program.gcode.user_tasks import user_tasks
from chipload.program.swivel import Swivel
from chipload.progress import Progress, silent

#: largest program [bytes]
LARGEST_FILE = 500_000_000
#: motions of one program
MOST_ROWS = 20_000_000
#: blocks that loops and calls may carry out again: about ten seconds
MOST_REPEATED = 400_000


def read_gcode(
    text: str,
    *,
    name: str = "program",
    folder: Path | None = None,
    tools: ToolTable | None = None,
    dialect: str = "linuxcnc",
    control: Control | None = None,
    compensation: str | None = None,
    units: Literal["mm", "inch"] = "mm",
    machine_units: Literal["mm", "inch"] | None = None,
    start: Sequence[float] = (0.0,) * 9,
    parameters: Mapping[int | str, float] | None = None,
    origins: Mapping[int, tuple[Sequence[float], float]] | None = None,
    diameters: Mapping[int, float] | None = None,
    feed: float | None = None,
    most_blocks: int | None = None,
    lenient: bool = False,
    swivel: Swivel | None = None,
    progress: Progress = silent,
) -> tuple[Commands, tuple[Finding, ...]]:
    r"""The motions that a text asks for, and what was noticed.

    Parameters
    ----------
    text : of the program
    name : for messages
    folder : the one folder in which called files ``<label>.ngc`` are sought; None: no files
    tools : what T, H and D name; None: no table, lengths and diameters count as 0
    dialect : name of the control whose profile is used where ``control`` is None
    control : profile
    compensation : what an offset for G41 holds: ``control`` (the cutter's radius), ``wear``, ``off``; None: not stated
    units : of lengths before the text says G20 or G21
    machine_units : of numbered parameters of coordinates; None: as ``units``
    start : (9,) float [mm, rad], machine's axes before the first block
    parameters : parameters before the first block by number, such as work offsets (5221 on), or by name
    origins : (9,) [mm, deg] and rotation [deg] of work offsets by number, 1 for G54
    diameters : [mm] of the cutters by tool, for compensation (G41, G42) where ``tools`` states none
    feed : [mm/min] of cuts before the text states one; None: such a cut is refused
    most_blocks : blocks that may be carried out, repeated ones each time; None: ``MOST_REPEATED`` more than the text
        has lines
    lenient : what is not read or refused is a finding as far as the rest can be read
    swivel : the machine, for tilted working planes; None: they are not read
    progress : called with the part that is done

    Raises
    ------
    InputError
        The controller would refuse the text, or a bound is passed; the message gives the line.

    >>> commands, findings = read_gcode("G21 G90\nG0 X1 Y2\nG1 Z-3 F60\nM2")
    >>> commands.position[-1, :3].tolist(), float(commands.feed[-1])
    ([1.0, 2.0, -3.0], 1.0)
    """
    control = control_named(dialect) if control is None else control
    readers = {"linuxcnc": Dialect, "fanuc": Fanuc, "sinumerik": Sinumerik}
    if control.language not in readers:
        raise InputError(f"control = {control.name}: its texts are not RS-274: must be one of {', '.join(readers)}")
    for what, unit in (("units", units), ("machine_units", machine_units or units)):
        if unit not in ("mm", "inch"):
            raise InputError(f"{what} = {unit!r}: must be mm or inch")
    at = [float(x) for x in start]
    if len(at) != 9 or not all(math.isfinite(x) for x in at):
        raise InputError("start: must be nine finite numbers, X Y Z A B C U V W")
    at[3:6] = [math.degrees(x) for x in at[3:6]]
    if most_blocks is None:
        most_blocks = text.count("\n") + text.count("\r") + MOST_REPEATED
    if most_blocks < 1:
        raise InputError(f"most_blocks = {most_blocks}: must be 1 or more")
    strict = control.text.refuses_unknown and not lenient
    rule = readers[control.language](strict=strict)
    controller = Controller(
        tools=tools,
        parameters=parameters,
        units=units,
        machine_units=machine_units or units,
        start=nine(at),
        most_rows=min(2 * most_blocks + 100_000, MOST_ROWS),
        strict=strict,
        control=control,
        compensation=compensation,
        origins={number: (nine(list(map(float, at))), turn) for number, (at, turn) in (origins or {}).items()},
        diameters=diameters,
        feed=feed,
        swivel=swivel,
    )
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    text = rule.prepare(user_tasks(text) if control.text.user_tasks else text, controller)
    rule.begin(controller, text)
    # a Sinumerik has no O-words: ORIWKS and the label OUT: are none
    source = read_source(text, name) if control.text.o_words else Source(name, lines_of(text, name))
    Flow(BlockInterpreter(controller), source, rule, folder, most_blocks, progress, lenient).run()
    note_unset_offsets(controller)
    commands = with_stated_offsets(controller, controller.track.commands())
    note_missing_lengths(controller, commands)
    return commands, controller.findings.all()


def read_gcode_file(path: Path, **options: object) -> tuple[Commands, tuple[Finding, ...]]:
    """A program from a file; the files that it calls lie beside it. ``options`` are those of :func:`read_gcode`."""
    path = Path(path)
    given = {"name": path.name, "folder": path.parent, **options}
    return read_gcode(gcode_text(path), **given)  # type: ignore[arg-type]


def gcode_text(path: Path) -> str:
    """The text of a program's file.

    Raises
    ------
    InputError
        It cannot be read or is too large.
    """
    return decode_text(read_regular(path, path.name, LARGEST_FILE))
