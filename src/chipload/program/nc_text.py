"""An NC text read for its control: with the units, the tool table and the compensation that are stated or guessed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from chipload.errors import Finding, InputError, Severity
from chipload.program.commands import Commands
from chipload.program.control import Control
from chipload.program.control_findings import (
    control_findings,
    distance_findings,
    table_in_its_unit,
    time_findings,
    unit_of,
)
from chipload.program.gcode.reader import read_gcode
from chipload.program.gcode.tools import ToolTable
from chipload.program.recognise import Recognition
from chipload.program.reconcile import StatedDiameter
from chipload.program.setup import Setup
from chipload.program.swivel import Swivel
from chipload.program.tool_comments import stated_diameters
from chipload.progress import Progress, silent

#: texts longer than this are read for one control only [characters]
LONG = 3_000_000
#: findings on a contour beside which the cutter does not fit, and on an offset that may hold wear alone
NO_ROOM, UNSTATED = "nc-compensation", "nc-compensation-unstated"

_Read = Callable[..., tuple[Commands, tuple[Finding, ...]]]


@dataclass(frozen=True, eq=False)
class NcText:
    """A text and what is known about it.

    Parameters
    ----------
    path : of its file
    text : of the program
    found : its control
    setup : what the controller knows before it
    tools : tool table in mm; None: none
    comments : its comments are held against the cutters of the job
    origins, values : work offsets and parameters by number
    """

    path: Path
    text: str
    found: Recognition
    setup: Setup
    tools: ToolTable | None
    comments: bool
    origins: Mapping[int, tuple[tuple[float, ...], float]]
    values: Mapping[int | str, float]
    table: ToolTable | None = field(init=False)
    stated: Mapping[int, StatedDiameter] = field(init=False)
    unit: str = field(init=False)
    noted: tuple[Finding, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Take the tool table in its own unit."""
        control = self.found.control.with_settings(self.setup.control.settings)
        unit, _ = unit_of(self.text, control, self.setup.control)
        diameters = stated_diameters(self.text, unit)
        table = self.tools
        said: tuple[Finding, ...] = ()
        if table is not None:
            table, said = table_in_its_unit(
                table, self.text, self.setup.control, self.setup.diameters(), diameters if self.comments else {}
            )
        object.__setattr__(self, "unit", unit)
        object.__setattr__(self, "table", table)
        object.__setattr__(self, "noted", said)
        object.__setattr__(self, "stated", diameters if self.setup.cutters and self.comments else {})


def read_nc(
    nc: NcText, feed: float | None, strict: bool, swivel: Swivel | None, progress: Progress = silent
) -> tuple[Commands, tuple[Finding, ...], tuple[Finding, ...]]:
    """The commands of a text, the findings of the reader, and those on what nobody stated.

    Parameters
    ----------
    feed : [mm/min] of cuts before the text states one; None: such a cut is a finding
    strict : what the controller would refuse is refused

    Raises
    ------
    InputError
        A bound of the reader is passed or, where ``strict``, the controller would refuse the text.
    """
    stated, found = nc.setup.control, nc.found
    control = found.control.with_settings(stated.settings)
    unit, of_unit = unit_of(nc.text, control, stated)
    read: _Read = partial(
        read_gcode, nc.text, name=nc.path.name, folder=nc.path.parent, tools=nc.table, parameters=nc.values,
        origins=nc.origins, diameters=nc.setup.diameters(), feed=feed, lenient=not strict, swivel=swivel,
    )  # fmt: skip
    kind = stated.compensation
    commands, findings = read(control=control, units=unit, compensation=kind, progress=progress)
    codes = {f.code for f in findings}
    of_wear: tuple[Finding, ...] = ()
    if {NO_ROOM, UNSTATED} <= codes:
        line = next(f.line for f in findings if f.code == NO_ROOM)
        kind = "wear"
        commands, findings = read(control=control, units=unit, compensation=kind)
        message = (
            "the cutter does not fit beside the contour of G41 or G42: its offset is taken as wear alone (0), so that "
            'the path is that of the cutter\'s centre: state program.compensation = "wear" or "control"'
        )
        of_wear = (Finding("nc-compensation-wear", line, message, Severity.UNPROVEN),)
    other = _read_otherwise(nc, read, found.other, unit, kind) if found.other is not None else None
    said = (
        *control_findings(found, nc.text, commands, other),
        *of_unit,
        *distance_findings(nc.text, control),
        *nc.noted,
        *of_wear,
        *time_findings(commands, control, found.stated),
    )
    return commands, findings, said


def _read_otherwise(nc: NcText, read: _Read, other: Control, unit: str, compensation: str | None) -> Commands | None:
    """The commands as another control reads the text; None where it does not."""
    if other.lines.form != "blocks" or len(nc.text) > LONG:
        return None
    try:
        return read(control=other, units=unit, compensation=compensation)[0]
    except InputError:
        return None
