"""Tables of cutter locations: a point and the tool's axis on a line, no words.

Notation: x y z [mm] the tip, i j k the tool's axis towards the spindle, in columns set apart by blanks, tabs or commas;
lines that begin with ``#`` or ``%`` are comments.
"""

from __future__ import annotations

import math
from typing import Literal

from chipload.errors import Finding, InputError
from chipload.program.apt.interpreter import UNIT_AXIS
from chipload.program.apt.records import LONGEST_TEXT, number
from chipload.program.apt.track import AptRows, Point
from chipload.program.program import Program
from chipload.units import MM_PER


def read_cl_points(
    text: str,
    *,
    feed: float,
    spindle: float,
    tool: int,
    name: str = "program",
    units: Literal["mm", "inch"] = "mm",
) -> tuple[Program, tuple[Finding, ...]]:
    r"""Straight cuts from point to point, the first a rapid.

    Parameters
    ----------
    text : lines of six numbers, or of three: then the axis is +Z
    feed : of the cuts [mm/s], [rad/s] of the tool's axis where the tip stands
    spindle : [rad/s], negative for counter-clockwise
    tool : number
    name : for messages, and of the rows
    units : of the points

    Raises
    ------
    InputError
        A line does not have as many numbers as the first, three or six; an axis has no length; there is no point.

    >>> program, findings = read_cl_points("0 0 5 0 0 2\n1\t2\t3\t0\t0.6\t0.8", feed=10.0, spindle=0.0, tool=1)
    >>> program.motion.tolist(), program.axis.tolist(), [f.code for f in findings]
    ([0, 1], [[0.0, 0.0, 1.0], [0.0, 0.6, 0.8]], ['apt-axis'])
    """
    if not 0.0 < feed < math.inf:
        raise InputError(f"feed = {feed:g} mm/s: must be above 0")
    if units not in ("mm", "inch"):
        raise InputError(f"units = {units!r}: must be mm or inch")
    if len(text) > LONGEST_TEXT:
        raise InputError(f"{name}: {len(text)} characters: must be at most {LONGEST_TEXT}: split it")
    track, columns, mm = AptRows(name, feed, spindle, tool, name), 0, MM_PER[units]
    for line, said in enumerate(text.splitlines(), start=1):
        words = said.replace(",", " ").split()
        if not words or words[0][0] in "#%":
            continue
        values = [number(word) for word in words[:7]]
        v = [value for value in values if value is not None]
        columns = columns or len(values)
        if len(v) != len(values) or len(v) != columns or columns not in (3, 6):
            raise InputError(
                f"line {line}: {said[:60]!r}: must be {columns if columns in (3, 6) else '3 or 6'} numbers"
            )
        p, axis = (v[0] * mm, v[1] * mm, v[2] * mm), _axis(v[3:], line, track)
        if track.at is None:
            track.rapid(p, axis, line)
        else:
            track.straight(p, axis, line)
    return track.program()


def _axis(v: list[float], line: int, track: AptRows) -> Point:
    if not v:
        return (0.0, 0.0, 1.0)
    length = math.hypot(*v)
    if length < 1e-6:
        raise InputError(f"line {line}: axis {v}: must have a length above 0")
    if abs(length - 1.0) > UNIT_AXIS:
        track.note("apt-axis", line, f"the axis has the length {length:.6g}: must be 1; it is scaled")
    return (v[0] / length, v[1] / length, v[2] / length)
