"""How a dialect reads a line: to a block, and whether what LinuxCNC refuses is refused.

Notation: ``strict`` refuses what LinuxCNC refuses; without it an unknown word is a finding and the motion of its block
is not carried out.
"""

from __future__ import annotations

from dataclasses import dataclass

from chipload.errors import InputError
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.modal import COVET, GROUP_OF, M_GROUP_OF, USER_M, axes_given, shown
from chipload.program.gcode.words import Block, bare, read_block

#: calls of a subroutine by one M98
MOST_CALLS = 1_000_000_000
#: codes of LinuxCNC that are not carried out: threading cycles of a lathe
UNREAD = frozenset({760})
#: stands for a motion that is not read and that the dialect made a finding of
NOTED = 9999


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

    def read(self, raw: str, c: Controller) -> Block | None:
        """The block of a line; None where there is nothing to carry out."""
        text, comments = bare(raw)
        block = read_block(text, comments, c.parameters)
        return block if self.strict else lenient(block, c)

    def call(self, words: dict[str, float]) -> tuple[str, int]:
        """Label and repeats of M98."""
        if "p" not in words:
            raise InputError("M98: P is missing: the number of the subroutine")
        times = integer_of(words.get("l", 1.0), "L")
        if not 0 <= times <= MOST_CALLS:
            raise InputError(f"M98: L{times}: must be from 0 to {MOST_CALLS}")
        return str(integer_of(words["p"], "P")), times


def lenient(block: Block, c: Controller, unread: frozenset[int] = UNREAD) -> Block:
    """Codes that are not read become findings, and the result unproven; a block with such a G does not move.

    Nor do the blocks after it that give axes and no code of motion: they go on with the motion that is not read.

    Parameters
    ----------
    unread : known codes that are not carried out
    """
    bad = [code for code in block.g if code not in GROUP_OF or code in unread]
    if bad:
        names = ", ".join(shown(code) for code in bad if code != NOTED) or "a motion"
        if bad != [NOTED]:
            c.gap("nc-unknown-word", f"{names}: is not read: its block does not move")
        c.unread = names if axes_given(block) else c.unread
        block.g = [code for code in block.g if code not in bad and GROUP_OF[code] not in ("motion", "once")]
        block.words = {x: value for x, value in block.words.items() if x in "fst"}
    elif any(GROUP_OF[code] in ("motion", "none") for code in block.g):
        c.unread = ""
    elif c.unread and axes_given(block) and COVET.isdisjoint(block.g):
        c.gap("nc-unknown-word", f"{c.unread}, which is not read, goes on here: the block does not move")
        block.words = {x: value for x, value in block.words.items() if x in "fst"}
    for m in [m for m in block.m if m not in M_GROUP_OF and m not in USER_M]:
        c.refused("nc-unknown-word", f"M{m}: is not known and does nothing here")
        block.m.remove(m)
    return block
