"""How a dialect reads a line: to a block, and whether what LinuxCNC refuses is refused.

Notation: ``strict`` refuses what LinuxCNC refuses; without it an unknown word is a finding and the motion of its block
is not carried out.
"""

from __future__ import annotations

from dataclasses import dataclass

from chipload.errors import InputError
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.modal import GROUP_OF, M_GROUP_OF, USER_M, shown
from chipload.program.gcode.words import Block, bare, read_block

#: calls of a subroutine by one M98
MOST_CALLS = 1_000_000_000


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


def lenient(block: Block, c: Controller) -> Block:
    """Unknown codes become findings; a block with an unknown G does not move."""
    bad = [code for code in block.g if code not in GROUP_OF]
    for code in bad:
        c.note("nc-unknown-word", f"{shown(code)}: is not known: its block does not move")
    if bad:
        block.g = [code for code in block.g if code in GROUP_OF and GROUP_OF[code] not in ("motion", "once")]
        block.words = {x: value for x, value in block.words.items() if x in "fst"}
    for m in [m for m in block.m if m not in M_GROUP_OF and m not in USER_M]:
        c.note("nc-unknown-word", f"M{m}: is not known and does nothing here")
        block.m.remove(m)
    return block
