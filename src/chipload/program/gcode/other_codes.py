"""Codes that mean something else on a control than on a Fanuc, as its profile has them.

Notation: codes of G are in tenths. The profile maps a code to the one that it is read as, or to what it does:

| word | what it does |
|---|---|
| ``idle``, ``unread`` | nothing here; a block that is left out |
| ``change`` | G100 of a Brother: changes the tool, then goes at rapid over X, Y and the rotary axes, then along Z |
| ``tap``, ``tap left`` | G77, G78 of a Brother: tapping by a pitch I [units of the text] or J threads an inch |
| ``offset`` | G15 H of an Okuma: a work offset by its number |
| ``offset 10`` | G110 of a Haas: the work offset of that number |
| ``home`` | G30 P of an Okuma: a retraction to a home position of the machine |
| ``level`` | G71 Z of an Okuma: the level to which a cycle with M53 goes back; with M54 it goes back to R |

References: posts for Brother and Okuma OSP; Okuma OSP7000M, 700M, code tables.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

from chipload.program.gcode.dialect import NotReadError
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.modal import code_text
from chipload.program.gcode.offsets import choose
from chipload.program.gcode.words import Block
from chipload.units import MM_PER

if TYPE_CHECKING:
    from chipload.program.gcode.controller import Controller

TAPS = {"tap": 840, "tap left": 740}
#: words of the approach across the tool, and the code of rapid
ACROSS, QUICKLY, LENGTH = "xyabc", 0, 430
#: M codes by which a cycle goes back to the level of G71, and to R
TO_LEVEL, TO_R = 53, 54
#: what is no cycle: units, in the order inch, mm
UNITS = {700: 200, 710: 210}
_NEXT_TOOL = re.compile(r"(?<![a-z])(t[0-9]{1,8})(t[0-9]{1,8})(?=.*m0?6(?![0-9]))")


def without_next_tool(text: str, c: Controller) -> str:
    """A block with a change to its first T, without the second one, which only makes the next tool ready.

    Parameters
    ----------
    text : in lower case, without blanks
    """
    found = _NEXT_TOOL.search(text)
    if found is None:
        return text
    c.once("nc-next-tool", f"{found[0].upper()}: the first tool is changed to, the second one made ready")
    return text[: found.start(2)] + text[found.end(2) :]


def replace_codes(block: Block, codes: Mapping[int, str], c: Controller) -> None:
    """Put codes of the control into those of a Fanuc."""
    for code in [code for code in block.g if code in codes]:
        meaning = codes[code]
        if meaning == "unread":
            raise NotReadError(f"{code_text(code)}: is not read")
        if meaning.isdigit():
            block.g[block.g.index(code)] = int(meaning)
            continue
        block.g.remove(code)
        if meaning == "change":
            _change_tool(block)
        elif meaning in TAPS:
            _tap(block, code, TAPS[meaning], c)
        elif meaning == "offset":
            _work_offset(block, code, c)
        elif meaning.startswith("offset "):
            choose(c, code_text(code), int(meaning.removeprefix("offset ")))
        elif meaning == "home":
            block.words.pop("p", None)
            c.retracted = c.state.at
            c.note("nc-machine-retraction", f"{code_text(code)}: a retraction to a position of the machine is left out")
        elif meaning == "level":
            if "z" not in block.words:
                raise NotReadError(f"{code_text(code)}: Z is missing: the level")
            c.return_level = block.words.pop("z")
    if "level" in codes.values():
        for m in (TO_LEVEL, TO_R):
            if m in block.m:
                block.m.remove(m)
                c.returns_to_level = m == TO_LEVEL
                block.g.append(980 if m == TO_LEVEL else 990)
    for code in [code for code in block.g if code in UNITS]:
        if block.words.keys().isdisjoint("xyzijklpqr"):
            block.g[block.g.index(code)] = UNITS[code]
            c.once("nc-units", f"{code_text(code)}: taken as {code_text(UNITS[code])}")


def _change_tool(block: Block) -> None:
    """The tool, then X and Y, then Z with the length, each in a block of its own."""
    if "t" in block.words:
        block.m.insert(0, 6)
    lengths = [code for code in block.g if code in (LENGTH, 440, 490)]
    others = [code for code in block.g if code not in lengths]
    across = {x: block.words.pop(x) for x in ACROSS if x in block.words}
    along = {x: block.words.pop(x) for x in "zh" if x in block.words}
    turning = [m for m in block.m if m in (3, 4, 5)]
    block.m = [m for m in block.m if m not in turning]
    block.g = []
    block.after.append(Block(words=across, g=[*others, QUICKLY], m=turning))
    if along:
        block.after.append(Block(words=along, g=[*lengths, QUICKLY]))


def _tap(block: Block, code: int, tapping: int, c: Controller) -> None:
    words = block.words
    pitch = words.pop("i", 0.0)
    threads = words.pop("j", 0.0)
    if threads > 0.0:
        pitch = MM_PER["inch"] / threads / c.state.scale
    speed = words.get("s", c.state.speed)
    words.pop("l", None)
    if not (pitch > 0.0 and speed > 0.0):
        raise NotReadError(f"{code_text(code)}: I (pitch) or J (threads an inch) and a spindle speed are missing")
    if c.feed_of_cuts is None:
        c.feed_of_cuts = c.state.feed, c.state.feed_turning
    words["f"] = pitch * speed
    block.g.append(tapping)


def _work_offset(block: Block, code: int, c: Controller) -> None:
    number = integer_of(block.words.pop("h", 1.0), f"{code_text(code)}: H")
    if not 1 <= number <= 200:
        raise NotReadError(f"{code_text(code)} H{number}: must be from 1 to 200")
    choose(c, f"{code_text(code)} H{number}", number)
