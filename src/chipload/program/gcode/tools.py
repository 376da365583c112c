"""LinuxCNC's tool table: what T, H and D words name.

A line of the file is ``T1 P1 D6.0 X0 Y0 Z50.2 I0 J0 Q0 ; comment``: number, pocket, diameter, offsets of the nine axes,
front and back angle, orientation of a turning tool. Lengths are in units of the machine, angles in degrees; here they
are mm and rad.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from chipload.errors import Finding, InputError
from chipload.program.commands import LETTERS
from chipload.units import MM_PER

#: most tools in one table
MOST_TOOLS = 10_000
#: largest number of a tool
LARGEST_TOOL = 99_999_999
_WORD = re.compile(r"([A-Z])\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:E[-+]?[0-9]+)?)\s*")


@dataclass(frozen=True)
class Tool:
    """One entry of the table.

    Parameters
    ----------
    number, pocket : T and P
    diameter : [mm]
    offset : of X Y Z A B C U V W [mm, rad]
    front, back : angles of a turning tool [rad]
    orientation : of a turning tool, 0 to 9
    comment : what stands after ``;``
    """

    number: int
    pocket: int = 0
    diameter: float = 0.0
    offset: tuple[float, ...] = (0.0,) * 9
    front: float = 0.0
    back: float = 0.0
    orientation: int = 0
    comment: str = ""


@dataclass(frozen=True, eq=False)
class ToolTable:
    """Tools by number."""

    tools: Mapping[int, Tool] = field(default_factory=dict)

    def scaled(self, factor: float) -> ToolTable:
        """The table with all lengths times a factor, as one whose unit was taken as another."""
        return ToolTable({n: _scale_tool(tool, factor) for n, tool in self.tools.items()})

    def lengths(self) -> dict[int, float]:
        """Length [mm] of each tool: its offset along Z."""
        return {number: tool.offset[2] for number, tool in self.tools.items()}


def _scale_tool(tool: Tool, factor: float) -> Tool:
    offset = tuple(x if k in range(3, 6) else factor * x for k, x in enumerate(tool.offset))
    return replace(tool, diameter=factor * tool.diameter, offset=offset)


def read_tool_table(text: str, *, name: str = "tool table", units: str = "mm") -> tuple[ToolTable, tuple[Finding, ...]]:
    """A table from the text of a ``.tbl`` file.

    Parameters
    ----------
    text : of the file
    name : of the file, for messages
    units : of its lengths, ``mm`` or ``inch``

    Raises
    ------
    InputError
        A word cannot be read, appears twice or is out of its range, or a number appears twice.

    >>> table, _ = read_tool_table("T3 P1 D6.0 Z50.5 ; end mill")
    >>> table.tools[3].offset[2], table.tools[3].comment
    (50.5, 'end mill')
    """
    scale = MM_PER[units]
    tools: dict[int, Tool] = {}
    findings: list[Finding] = []
    for line, raw in enumerate(text.splitlines(), 1):
        body, _, comment = raw.partition(";")
        body = body.strip().upper()
        if not body:
            continue
        try:
            tool = _entry(body, comment.strip(), scale)
        except InputError as error:
            raise InputError(f"{name}: line {line}: {error}") from None
        if tool.number in tools:
            raise InputError(f"{name}: line {line}: tool {tool.number} appears twice")
        if len(tools) >= MOST_TOOLS:
            raise InputError(f"{name}: line {line}: more than {MOST_TOOLS} tools")
        if tool.diameter < 0.0:
            text = f"tool {tool.number} has a negative diameter: compensation goes to the other side"
            findings.append(Finding("tool-negative-diameter", line, text))
        tools[tool.number] = tool
    return ToolTable(tools), tuple(findings)


def _entry(body: str, comment: str, scale: float) -> Tool:
    words: dict[str, float] = {}
    at = 0
    while at < len(body):
        found = _WORD.match(body, at)
        if found is None:
            raise InputError(f"{body[at : at + 12]!r}: a letter with its number is expected")
        if found[1] in words:
            raise InputError(f"{found[1]} appears twice")
        words[found[1]] = float(found[2])
        at = found.end()
    for letter, value in words.items():
        if letter not in "TPDIJQ" + LETTERS:
            raise InputError(f"word {letter}: must be one of T P D I J Q X Y Z A B C U V W")
        if not abs(value) <= 1e9:
            raise InputError(f"{letter}{value:g}: must be within 1e9")
        if letter in "TPQ" and value != int(value):
            raise InputError(f"{letter}{value:g}: must be a whole number")
    if "T" not in words:
        raise InputError("T is missing: the number of the tool")
    if not 0 <= words["T"] <= LARGEST_TOOL:
        raise InputError(f"T{words['T']:g}: must be from 0 to {LARGEST_TOOL}")
    if not 0 <= words.get("Q", 0.0) <= 9:
        raise InputError(f"Q{words['Q']:g}: must be from 0 to 9")
    return Tool(
        number=int(words["T"]),
        pocket=int(words.get("P", 0.0)),
        diameter=scale * words.get("D", 0.0),
        offset=tuple(math.radians(words.get(x, 0.0)) if x in "ABC" else scale * words.get(x, 0.0) for x in LETTERS),
        front=math.radians(words.get("I", 0.0)),
        back=math.radians(words.get("J", 0.0)),
        orientation=int(words.get("Q", 0.0)),
        comment=comment,
    )
