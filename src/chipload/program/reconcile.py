"""One cutter for each tool: what the job, the tool table, CL data and comments state about it agrees, or is refused.

Notation: a statement is a diameter [mm] with the place that makes it. The job's ``[[cutter]]`` is what is simulated;
the tool table is what the controller compensates for; CUTTER of CL data and the comments of NC text are what the path
was made for. Tools without a ``[[cutter]]`` are not compared: the table may hold tools that a text uses as allowances.

Comments are read by :mod:`~chipload.program.tool_comments`. A number without a unit is in the unit that the text
selects first, a fraction in inches. ``D1`` beside ``H1``, or with the number of the tool, is an offset.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import NamedTuple

from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, InputError
from chipload.program.apt.cutters import Shape
from chipload.program.gcode.tools import ToolTable
from chipload.units import MM_PER

#: diameters and radii that differ by at most this are one [mm]: wear and regrinding, which is a finding
WEAR_MM = 0.05
#: diameters that differ by less are the same number [mm]
SAME_MM = 1e-3
#: angles that differ by at most this are one [rad]
SAME_ANGLE = math.radians(0.5)

#: a comment of NC text, and the number of a tool in it
COMMENT = re.compile(r"\(([^()\n]*)\)|;([^\n]*)")
TOOL = r"\bT(?:OOL)?\s*(?:NO\.?|NUMBER)?\s*[-:#=]?\s*T?(?P<tool>[0-9]{1,8})\b"
#: D and the number of an offset: no point, no sign between them, no unit
_OFFSET = re.compile(r"\bD([0-9]{1,8})\b(?![./]|\s*(?:MM|INCH|IN\b|\"))")
_LENGTH_OFFSET = re.compile(r"\bH\s*[0-9]+\b")
_INCH_PROGRAM = re.compile(r"BEGIN PGM[^\n]*\bINCH\b|^%[ \t]*[\w-]+[ \t]+G70\b", re.IGNORECASE)
#: unit words, also without blanks between words; G70 and G71 with other words are cycles and levels
UNITS = re.compile(r"(?<![A-Z])G\s*0*(20|21|700|710|7[01](?!\s*[IJKLPQZ]))(?![0-9.])", re.IGNORECASE)


class StatedDiameter(NamedTuple):
    """A diameter [mm] of a tool, and where it stands."""

    diameter: float
    where: str
    line: int


def unit_mm(text: str, unit: str = "mm") -> float:
    """The unit [mm] that an NC text selects first, or that of a Heidenhain program; ``unit`` where it selects none.

    >>> unit_mm("(G20) G21 G0 X1"), unit_mm("N10G0G20X1"), unit_mm("X1", "inch")
    (1.0, 25.4, 25.4)
    """
    if _INCH_PROGRAM.search(text[:1000]) is not None:
        return MM_PER["inch"]
    found = UNITS.search(COMMENT.sub(" ", text))
    if found is None:
        return MM_PER[unit]
    return MM_PER["inch" if found[1] in ("20", "70", "700") else "mm"]


def without_offsets(comment: str) -> str:
    """A comment without the numbers of offsets, which are no diameters."""
    tool = re.search(TOOL, comment)
    both = _LENGTH_OFFSET.search(comment) is not None
    return _OFFSET.sub(lambda hit: "" if both or (tool and tool["tool"] == hit[1]) else hit[0], comment)


def length_of(value: str, unit: str | None, own: float) -> float:
    """A length [mm] of a comment; without a unit in that of the text, a fraction in inches; 0: of no meaning.

    >>> length_of("1/4", None, 1.0), length_of("6.", "mm", 25.4), length_of(".5", None, 25.4)
    (6.35, 6.0, 12.7)
    """
    over, _, below = value.partition("/")
    mm = own if unit is None else MM_PER["mm" if unit.upper() == "MM" else "inch"]
    if not below:
        return float(over) * mm
    return float(over) / float(below) * (MM_PER["inch"] if unit is None else mm) if float(below) > 0.0 else 0.0


def agree(
    name: str,
    cutters: Mapping[int, Cutter],
    *,
    tools: ToolTable | None = None,
    comments: Mapping[int, StatedDiameter] | None = None,
    shapes: Mapping[int, Shape] | None = None,
) -> tuple[Finding, ...]:
    """Compare what is stated about each cutter with the simulated cutter; differences by wear are findings.

    Parameters
    ----------
    name : of the program, for messages
    cutters : of the job, by tool
    tools : the tool table; entries without a diameter state none
    comments : of the NC text, by tool
    shapes : of CL data, by tool

    Raises
    ------
    InputError
        A statement differs from the cutter by more than wear: the message gives both numbers.
    """
    found: list[Finding] = []
    for number, cutter in sorted(cutters.items()):
        if cutter.body and cutter.thread_pitch is not None:
            # a tap is simulated as its core, a comment states its thread
            continue
        table = tools.tools.get(number) if tools is not None else None
        if table is not None and table.diameter != 0.0:
            stated = StatedDiameter(abs(table.diameter), "the tool table", 0)
            found += _same(name, number, cutter, stated, f"correct D of T{number} in the tool table or")
        if comments and number in comments:
            remedy = "correct whichever is wrong, or set program.tool_comments = false:"
            found += _same(name, number, cutter, comments[number], remedy)
        if shapes and number in shapes:
            _same_shape(name, number, cutter, shapes[number])
    return tuple(found)


def _same(name: str, number: int, cutter: Cutter, stated: StatedDiameter, remedy: str) -> list[Finding]:
    """A finding where a diameter differs a little."""
    apart = abs(stated.diameter - cutter.diameter)
    if apart <= SAME_MM:
        return []
    numbers = (
        f"{stated.where} states {stated.diameter:g} mm for tool {number}, the [[cutter]] has {cutter.diameter:g} mm"
    )
    if apart > WEAR_MM:
        where = f"{name}: line {stated.line}" if stated.line else name
        raise InputError(
            f"{where}: {numbers}: must agree within {WEAR_MM:g} mm: {remedy} diameter_mm of the [[cutter]] with "
            f"number = {number}"
        )
    return [Finding("tool-diameter", stated.line, f"{numbers}: taken as wear, the [[cutter]] is simulated")]


def _same_shape(name: str, number: int, cutter: Cutter, shape: Shape) -> None:
    """Refuse a CUTTER of CL data that is not the cutter of the job."""
    if cutter.shape:
        raise InputError(
            f"{name}: CUTTER states seven numbers for tool {number}, the [[cutter]] has a shape of its own: state the "
            "cutter of the program, or leave the CUTTER out"
        )
    d, r, _, _, alpha, beta, _ = shape
    arc = ("corner radius", r, cutter.corner_radius, "corner_radius_mm")
    if cutter.barrel_radius is not None:
        arc = ("radius of the flank arc", r, cutter.barrel_radius, "barrel_radius_mm")
    pairs = (
        ("diameter", d, cutter.diameter, "diameter_mm", WEAR_MM, 1.0, "mm"),
        (*arc, WEAR_MM, 1.0, "mm"),
        ("bottom angle", alpha, cutter.bottom, "bottom_deg", SAME_ANGLE, 180.0 / math.pi, "deg"),
        ("taper", beta, cutter.taper, "taper_deg", SAME_ANGLE, 180.0 / math.pi, "deg"),
    )
    for what, stated, own, key, slack, shown, unit in pairs:
        if abs(stated - own) > slack:
            raise InputError(
                f"{name}: CUTTER states the {what} {stated * shown:g} {unit} for tool {number}, the [[cutter]] has "
                f"{own * shown:g} {unit}: must agree within {slack * shown:g} {unit}: correct the CUTTER or {key} of "
                f"the [[cutter]] with number = {number}"
            )
