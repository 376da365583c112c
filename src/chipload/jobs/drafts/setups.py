"""Setups that a program shows: a stop behind which it uses another work offset."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from chipload.jobs.drafts.draft import DraftTable, Entry
from chipload.program.lines_of import Lines, reading_of_lines
from chipload.program.read import ProgramReading
from chipload.program.setup import offset_name

Box = tuple[tuple[float, float, float], tuple[float, float, float]]

#: comments that say that the part is turned over
_OVER = re.compile(
    r"\b(?:FLIP|TURN(?:ED)?\s+(?:PART\s+|THE\s+PART\s+|WORKPIECE\s+)?OVER|SECOND\s+SIDE|SIDE\s*2)\b", re.I
)
_END = re.compile(r"\bM0*(?:2|30)\b", re.I)
_COMMENTS = re.compile(r"\([^)\n]*\)|;[^\n]*")
#: lines behind a stop in which its comment stands
NEAR = 4


def lines_of_setups(reading: ProgramReading, text: str) -> tuple[Lines, ...]:
    """Lines of each setup; empty: the program shows one.

    A new one begins at a stop behind which the work offset is one that was not used before.
    """
    commands = reading.commands
    numbers = np.array([frame.number for frame in commands.frames])[commands.frame]
    starts = []
    used: set[int] = set()
    for a, b in zip((0, *reading.stops), (*reading.stops, 10**9), strict=True):
        own = set(numbers[(commands.line >= a) & (commands.line < b)].tolist()) - {0}
        if used and own and not own & used:
            starts.append(a)
        used |= own
    if not starts:
        return ()
    lines = text.splitlines()
    last = next(
        (k for k, line in enumerate(lines, 1) if k > starts[-1] and _END.search(_COMMENTS.sub(" ", line))), len(lines)
    )
    return tuple(zip((1, *starts), (*(s - 1 for s in starts), last), strict=True))


def setup_tables(reading: ProgramReading, text: str, lines: Sequence[Lines], block: Box) -> list[DraftTable]:
    """The tables of the setups; how the part lies in the later ones is a guess.

    Parameters
    ----------
    block : corners of the stock [mm]
    """
    out = []
    rows = text.splitlines()
    language = "fanuc" if reading.recognition is None else reading.recognition.control.name
    for k, own in enumerate(lines):
        commands = reading_of_lines(reading, own, [other for other in lines if other != own]).commands
        number = commands.frames[int(commands.frame[0])].number
        entries = [Entry("lines", list(own)), Entry("work_offset", offset_name(number, language))]
        if k > 0:
            said = next((row for row in rows[max(own[0] - 2, 0) : own[0] + NEAR] if _OVER.search(row)), None)
            if said is not None:
                note = f"line {own[0]}: {' '.join(said.split())[:40]}"
                entries += [Entry("flip", {"axis": "x", "angle_deg": 180.0}, note, True)]
                entries += [Entry("zero", list(_zero(block)), "as on the stock of the first setup", True)]
            else:
                entries += [Entry("flip", note="turn of the part from the setup before", example='{ axis = "x" }')]
                note = f"line {own[0]}: a stop, then {offset_name(number, language)}: how the part lies is not stated"
                entries += [Entry("zero", list(_zero(block)), note, True)]
        note = "the part in its setups: each begins with what the one before leaves" if k == 0 else ""
        out.append(DraftTable("setup", tuple(entries), repeated=True, note=note))
    return out


def _zero(block: Box) -> tuple[str, ...]:
    """The side of the block that is nearest to the zero, along each axis."""
    out = []
    for axis, low, high in zip("xyz", *block, strict=True):
        sides = {"-": low, "0": 0.5 * (low + high), "+": high}
        out.append(axis + min(sides, key=lambda side: abs(sides[side])))
    return tuple(out)
