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
from chipload.program.commands import Commands
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.dialect import Dialect
from chipload.program.gcode.fanuc import Fanuc
from chipload.program.gcode.flow import Flow
from chipload.program.gcode.interpreter import Interpreter
from chipload.program.gcode.sinumerik import Sinumerik
from chipload.program.gcode.source import read_source
from chipload.program.gcode.state import nine
from chipload.program.gcode.tools import ToolTable
from chipload.progress import Progress, silent

#: largest program [bytes]
LARGEST_FILE = 500_000_000
#: motions of one program
MOST_ROWS = 20_000_000


def read_gcode(
    text: str,
    *,
    name: str = "program",
    folder: Path | None = None,
    tools: ToolTable | None = None,
    dialect: Literal["linuxcnc", "fanuc", "sinumerik"] = "linuxcnc",
    units: Literal["mm", "inch"] = "mm",
    machine_units: Literal["mm", "inch"] | None = None,
    start: Sequence[float] = (0.0,) * 9,
    parameters: Mapping[int, float] | None = None,
    most_blocks: int = 5_000_000,
    lenient: bool = False,
    progress: Progress = silent,
) -> tuple[Commands, tuple[Finding, ...]]:
    r"""The motions that a text asks for, and what was noticed.

    Parameters
    ----------
    text : of the program
    name : for messages
    folder : the one folder in which called files ``<label>.ngc`` are sought; None: no files
    tools : what T, H and D name; None: no table, lengths and diameters count as 0
    dialect : of the text
    units : of lengths before the text says G20 or G21
    machine_units : of numbered parameters of coordinates; None: as ``units``
    start : (9,) float [mm, rad], machine's axes before the first block
    parameters : numbered parameters before the first block, such as work offsets (5221 on)
    most_blocks : blocks that may be carried out, repeated ones each time
    lenient : in the dialect of LinuxCNC, unknown codes and a missing end are findings
    progress : called with the part that is done

    Raises
    ------
    InputError
        The controller would refuse the text, or a bound is passed; the message gives the line.

    >>> commands, findings = read_gcode("G21 G90\nG0 X1 Y2\nG1 Z-3 F60\nM2")
    >>> commands.position[-1, :3].tolist(), float(commands.feed[-1])
    ([1.0, 2.0, -3.0], 1.0)
    """
    rules = {"linuxcnc": Dialect, "fanuc": Fanuc, "sinumerik": Sinumerik}
    if dialect not in rules:
        raise InputError(f"dialect = {dialect!r}: must be linuxcnc, fanuc or sinumerik")
    for what, unit in (("units", units), ("machine_units", machine_units or units)):
        if unit not in ("mm", "inch"):
            raise InputError(f"{what} = {unit!r}: must be mm or inch")
    at = [float(x) for x in start]
    if len(at) != 9 or not all(math.isfinite(x) for x in at):
        raise InputError("start: must be nine finite numbers, X Y Z A B C U V W")
    at[3:6] = [math.degrees(x) for x in at[3:6]]
    if most_blocks < 1:
        raise InputError(f"most_blocks = {most_blocks}: must be 1 or more")
    rule = Dialect(strict=not lenient) if dialect == "linuxcnc" else rules[dialect](strict=False)
    controller = Controller(
        tools=tools,
        parameters=parameters,
        units=units,
        machine_units=machine_units or units,
        start=nine(at),
        most_rows=min(2 * most_blocks + 100_000, MOST_ROWS),
        strict=dialect == "linuxcnc" and not lenient,
    )
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    rule.begin(controller, text)
    source = read_source(text, name)
    Flow(Interpreter(controller), source, rule, folder, most_blocks, progress).run()
    return controller.track.commands(), controller.findings.all()


def read_gcode_file(path: Path, **options: object) -> tuple[Commands, tuple[Finding, ...]]:
    """A program from a file; the files that it calls lie beside it. ``options`` are those of :func:`read_gcode`."""
    path = Path(path)
    try:
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise InputError(f"{path.name}: {size} bytes: must be at most {LARGEST_FILE}")
        text = path.read_bytes().decode("utf-8", "replace")
    except OSError as error:
        raise InputError(f"{path.name}: cannot be read: {error.strerror}") from None
    given = {"name": path.name, "folder": path.parent, **options}
    return read_gcode(text, **given)  # type: ignore[arg-type]
