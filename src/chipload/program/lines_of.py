"""A part of a reading: the rows of some lines of its text, as one of several setups runs them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np

from chipload.errors import Finding, InputError
from chipload.program import commands as axes
from chipload.program import program as tips
from chipload.program.commands import Commands
from chipload.program.program import Program
from chipload.program.read import ProgramReading

Rows = TypeVar("Rows", Program, Commands)
#: finding on a work offset whose place beside the others is not known
UNSET = "nc-offset-unset"

Lines = tuple[int, int]


def reading_of_lines(reading: ProgramReading, lines: Lines, others: Sequence[Lines] = ()) -> ProgramReading:
    """The rows of a reading that come from the given lines, with those of the subprograms that they call.

    It begins where its first rapid ends, as a program does; if it begins with a cut, where the row before ended.
    Findings on lines of the ``others`` are theirs. Where all its rows are in one work offset, the place of that beside
    the others does not matter.

    Raises
    ------
    InputError
        No row comes from these lines.
    """
    program = _rows(reading.program, lines, others, tips.RAPID)
    commands = _rows(reading.commands, lines, others, axes.RAPID)
    one = len({commands.frames[k].number for k in np.unique(commands.frame).tolist()}) == 1

    def own(findings: Sequence[Finding]) -> tuple[Finding, ...]:
        return tuple(
            f
            for f in findings
            if not any(a <= f.line <= b for a, b in others) and not (one and f.code == UNSET)
        )  # fmt: skip

    skipped = None if reading.skipped is None else reading_of_lines(reading.skipped, lines, others)
    return replace(
        reading, program=program, commands=commands, findings=own(reading.findings),
        violations=own(reading.violations), skipped=skipped,
    )  # fmt: skip


def _rows(whole: Rows, lines: Lines, others: Sequence[Lines], rapid: int) -> Rows:
    """The rows of some lines; the first is a rapid. A row of no setup's lines belongs to the one before it."""
    owner = np.zeros(len(whole), dtype=np.int64)
    for own, (a, b) in ((1, lines), *((2, other) for other in others)):
        owner[(whole.line >= a) & (whole.line <= b)] = own
    before = np.maximum.accumulate(np.where(owner > 0, np.arange(len(owner)), 0))
    at = np.flatnonzero(owner[before] == 1)
    if not len(at):
        raise InputError(f"setup.lines = {list(lines)}: no motion comes from them: state those of the setup")
    first, last = int(at[0]), int(at[-1])
    if whole.motion[first] != rapid and first > 0:
        first -= 1
    columns = [f.name for f in fields(whole) if f.name not in ("labels", "frames")]
    some: dict[str, Any] = {name: np.array(getattr(whole, name)[first : last + 1]) for name in columns}
    some["motion"][0] = rapid
    some["feed"][0] = 0.0
    some["turns"][0] = 0
    some["centre"][0] = 0.0
    if isinstance(whole, Program):
        some["normal"][0] = (0.0, 0.0, 1.0)
    return replace(whole, **some)
