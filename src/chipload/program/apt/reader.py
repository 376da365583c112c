"""The reader of CL data, which returns a Program.

Notation: a record is WORD/arg,arg,... GOTO/x,y,z[,i,j,k] moves the tip straight, after CIRCLE/x,y,z,i,j,k[,r] on an arc
counter-clockwise about (i, j, k) through (x, y, z); ends over one another are a full turn. RAPID holds for one motion,
FEDRAT, SPINDL and the axis of the tool until stated again; a FEDRAT without a unit counts as the one before, the first
as lengths of the text in a minute. SPINDL without CLW or CCLW turns as before, first CLW. A GOTO of three numbers
keeps the axis; MULTAX/OFF, CSYS and TLAXIS set it as :mod:`~chipload.program.apt.frames` says, which tells in what
coordinates points are. :mod:`~chipload.program.apt.cycles` tells how holes are cut. PPRINT, INSERT and OPFEATSTART name
what the rows after them belong to. Cutters are for :mod:`~chipload.program.apt.cutters`.

CUTCOM changes nothing: points are of the tool's own tip. What a Program cannot hold is a finding with its line:
``apt-unused`` (coolant, stops, inserted text), ``apt-unknown`` (a record that is not known), ``apt-comment`` (data of a
CAM system in a comment). A record that would move
the tool or change what coordinates mean, and is not read, is refused.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

from chipload.errors import Finding, InputError
from chipload.files import decode_text, read_regular
from chipload.program.apt.frames import Coordinates
from chipload.program.apt.interpreter import AptInterpreter
from chipload.program.apt.records import LONGEST_TEXT, records
from chipload.program.apt.track import AptRows
from chipload.program.program import Program
from chipload.units import MM_PER


def read_apt(
    text: str,
    *,
    name: str = "program",
    units: Literal["mm", "inch"] | None = None,
    feed: float | None = None,
    spindle: float = 0.0,
    tool: int = 0,
    csys: Literal["work", "csys"] | None = None,
) -> tuple[Program, tuple[Finding, ...]]:
    r"""The motions of CL data in the work frame, and the findings.

    Parameters
    ----------
    text : of the CL data
    name : for messages, and of the rows before any PPRINT
    units : of lengths before the first UNITS; None: not stated, so that a text without UNITS is read in mm and unproven
    feed : [mm/s] of cuts before the first FEDRAT; None: such a cut is refused
    spindle, tool : [rad/s] and number before the first SPINDL and LOAD
    csys : coordinates of points under a CSYS before the first TRNTYP; None: such a point is refused

    Raises
    ------
    InputError
        A record is malformed, moves the tool in a way that is not read, or leaves a feed, a unit or coordinates open;
        the message gives the line.

    >>> text = "UNITS/MM\nRAPID\nGOTO/0,0,5\nFEDRAT/600,MMPM\nGOTO/0,0,0\nCIRCLE/5,0,0,0,0,-1\nGOTO/10,0,0\nFINI"
    >>> program, findings = read_apt(text)
    >>> program.motion.tolist(), program.p_work[-1].tolist(), float(program.feed[-1]), findings
    ([0, 1, 2], [10.0, 0.0, 0.0], 10.0, ())
    """
    if units not in (None, "mm", "inch"):
        raise InputError(f"units = {units!r}: must be mm or inch")
    if csys not in (None, "work", "csys"):
        raise InputError(f"csys = {csys!r}: must be work or csys")
    if feed is not None and not 0.0 < feed < math.inf:
        raise InputError(f"feed = {feed:g} mm/s: must be above 0")
    rows = AptRows(name, feed, spindle, tool, name)
    reader = AptInterpreter(rows, MM_PER[units or "mm"], Coordinates(points_in=csys), units_stated=units is not None)
    for record in records(text):
        if reader.ended:
            reader.track.note(
                "apt-after-end",
                record.line,
                f"{record} follows {reader.ended}: it and all records after it are left out",
            )
            break
        reader.read(record)
    return reader.done()


def read_apt_file(path: Path, **options: object) -> tuple[Program, tuple[Finding, ...]]:
    """As :func:`read_apt`, of a file; its name is that of the program."""
    return read_apt(apt_text(path), **{"name": path.stem, **options})  # type: ignore[arg-type]


def apt_text(path: Path) -> str:
    """The text of a file of CL data.

    Raises
    ------
    InputError
        It cannot be read or is too large.
    """
    return decode_text(read_regular(path, path.name, LONGEST_TEXT))
