"""How a dialect reads a line: to a block, and whether what LinuxCNC refuses is refused.

Notation: ``strict`` refuses what LinuxCNC refuses; without it an unknown word is a finding and the motion of its block
is not carried out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from chipload.errors import InputError, Severity
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.modal import COVET, GROUP_OF, M_GROUP_OF, USER_M, code_text, has_axes
from chipload.program.gcode.words import Block, bare, read_block

if TYPE_CHECKING:
    from chipload.program.gcode.flow import Flow

#: calls of a subroutine by one M98
MOST_CALLS = 1_000_000_000
#: codes of LinuxCNC that are not carried out: threading cycles of a lathe
UNREAD = frozenset({760})
#: letters of a block that is left out and whose values stay
KEPT_WORDS = "fst"
#: stands for a motion that is not read and that the dialect made a finding of
NOTED = 9999
#: motions that last behind their block
LASTING = (0, 10, 20, 30)
#: end of scaling and of a normal direction, which nothing here begins
ENDS_NOTHING = frozenset({500, 401})


class NotReadError(InputError):
    """A block asks for what is not carried out here: a lenient reader leaves it out."""


@dataclass(frozen=True)
class Dialect:
    """LinuxCNC's own; the others derive from it.

    Parameters
    ----------
    strict : see above
    plain : blocks of motion and numbers alone may be read fast
    """

    strict: bool = True
    plain: bool = True

    def begin(self, c: Controller, text: str) -> None:
        """What stands before the first block."""

    def prepare(self, text: str, c: Controller) -> str:
        """The text as the others write it."""
        return text

    def begins_at(self, lines: list[str]) -> int:
        """Index of the line before which nothing is read."""
        return 0

    def blocks_of(self, raw: str, c: Controller) -> list[str]:
        """The blocks of a line."""
        return [raw]

    def read(self, raw: str, c: Controller) -> Block | None:
        """The block of a line; None where there is nothing to carry out."""
        text, comments = bare(raw)
        if not self.strict and text.startswith("$"):
            message = f"{text[:20].upper()}: a command to the controller, not a block: left out"
            # homing and jogging of GRBL move the machine, which matters behind the first motion
            moves = bool(c.placed) and text.startswith(("$h", "$j"))
            c.once("nc-ignored", message, Severity.UNPROVEN if moves else Severity.NOTE)
            return None
        block = read_block(text, comments, c.parameters)
        if self.strict:
            return block
        for code in block.g:
            unread = c.control.text.unread.get(code)
            if unread is not None:
                raise NotReadError(f"{code_text(code)}: {unread}")
        _changed_coordinates(block, c)
        _other_controllers(block, c)
        return lenient(block, c)

    def jump(self, flow: Flow, raw: str) -> bool:
        """Carry out a line that says which block comes next; whether it does."""
        return False

    def call(self, words: dict[str, float], c: Controller) -> tuple[str, int]:
        """Label and repeats of M98."""
        if "p" not in words:
            raise InputError("M98: P is missing: the number of the subroutine")
        times = integer_of(words.get("l", 1.0), "L")
        if not 0 <= times <= MOST_CALLS:
            raise InputError(f"M98: L{times}: must be from 0 to {MOST_CALLS}")
        return str(integer_of(words["p"], "P")), times


def _changed_coordinates(block: Block, c: Controller) -> None:
    """Leave motions out in coordinates that the control knows and that are not read, until they end."""
    until = c.control.text.unread_until
    for code in block.g:
        if c.left_out and any(code == until[begin] and c.left_out == _changes(begin) for begin in until):
            go_on(c)
    for code in [code for code in block.g if code in until]:
        leave_out(c, _changes(code))
    ours = until.keys() | set(until.values())
    if not ours.isdisjoint(block.g):
        block.g = [code for code in block.g if code not in ours]
        block.words = {x: value for x, value in block.words.items() if x in KEPT_WORDS}


def _changes(code: int) -> str:
    return f"{code_text(code)}: changed coordinates"


def _other_controllers(block: Block, c: Controller) -> None:
    """Words of Mach3, GRBL and their posts that LinuxCNC refuses: G70 and G71 as units, G50 and G40.1 that end what is
    not on, K0 of an arc in XY.
    """
    units = {700: 200, 710: 210}
    if not has_axes(block):
        for code in [code for code in block.g if code in units]:
            c.once("nc-units", f"{code_text(code)}: taken as {code_text(units[code])}")
            block.g[block.g.index(code)] = units[code]
        block.g = [code for code in block.g if code not in ENDS_NOTHING]
    arc = next((code for code in block.g if code in (20, 30)), c.state.motion)
    if arc in (20, 30) and c.state.plane == 170 and block.words.get("k") == 0.0:
        c.once("nc-unused-word", "K0: is not a coordinate of the arc's plane: left out")
        del block.words["k"]


def leave_out(c: Controller, reason: str) -> None:
    """Leave motions out from here on, until :func:`go_on`."""
    c.left_out = reason
    c.leave_out("nc-left-out", f"{reason}: motions are left out until it ends")


def go_on(c: Controller) -> None:
    """Carry motions out again."""
    c.left_out = ""


def _without_motion(block: Block, c: Controller) -> None:
    """Take the motion out of a block; its code lasts all the same."""
    lasting = [code for code in block.g if code in LASTING]
    if lasting:
        c.state.motion = lasting[-1]
    if lasting or has_axes(block):
        block.g = [code for code in block.g if GROUP_OF[code] not in ("motion", "once")]
        block.words = {x: value for x, value in block.words.items() if x in KEPT_WORDS}


def lenient(block: Block, c: Controller, unread: frozenset[int] = UNREAD) -> Block:
    """Codes that are not read become findings, and the result unproven; a block with such a G does not move.

    Nor do the blocks after it that give axes and no code of motion: they go on with the motion that is not read.

    Parameters
    ----------
    unread : known codes that are not carried out
    """
    bad = [code for code in block.g if code not in GROUP_OF or code in unread]
    if bad:
        names = ", ".join(code_text(code) for code in bad if code != NOTED) or "a motion"
        if bad != [NOTED]:
            c.leave_out("nc-unknown-word", f"{names}: is not read: the motion of its block is left out")
        c.unread = names if has_axes(block) else c.unread
        block.g = [code for code in block.g if code not in bad and GROUP_OF[code] not in ("motion", "once")]
        block.words = {x: value for x, value in block.words.items() if x in KEPT_WORDS}
    elif any(GROUP_OF[code] in ("motion", "none") for code in block.g):
        c.unread = ""
    elif c.unread and has_axes(block) and COVET.isdisjoint(block.g):
        c.leave_out(
            "nc-unknown-word", f"{c.unread}, which is not read, is still active: the motion of this block is left out"
        )
        block.words = {x: value for x, value in block.words.items() if x in KEPT_WORDS}
    if c.left_out:
        _without_motion(block, c)
    for m in [m for m in block.m if m not in M_GROUP_OF and m not in USER_M]:
        c.refused("nc-unknown-word", f"M{m}: is not known; it is ignored")
        block.m.remove(m)
        if not block.g and not has_axes(block):
            # its own words, as in M298 L5
            block.words = {x: value for x, value in block.words.items() if x not in "lpqre"}
    return block
