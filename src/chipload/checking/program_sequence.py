"""Several program texts that one setup runs one after the other: what each leaves of the stock, the next begins with.

Notation: a row is one of all programs together; ``line`` of the joined program is the number of the row, from 1, so
that each step and each finding belongs to one row of one program.

Where the tool comes from at the beginning of a program is not known: its first row is a rapid from an unknown place,
which has no step (:class:`~chipload.program.path_mode.PathControl`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.program.path_mode import PathControl
from chipload.program.program import Program
from chipload.simulation.steps import moving_rows

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ProgramSequence:
    """Programs as they were read, one after the other.

    Parameters
    ----------
    program : all rows; ``line`` is the number of each, from 1
    times : (n,) float [s], of its rows on the machine
    first : (k + 1,) int, first row of each program, from 0, and the number of rows
    uncounted : first rows of all that only make room for the others: what they remove is not calculated
    """

    program: Program
    times: Floats
    first: Ints
    stops: tuple[int, ...] = ()
    retractions: tuple[int, ...] = ()
    of_text: bool = False
    skipped: None = None
    uncounted: int = 0

    @staticmethod
    def of(parts: Sequence[tuple[Program, Floats]], earlier: int = 0) -> ProgramSequence:
        """Join programs, each with the times of its rows [s]; a program has a row at least.

        Parameters
        ----------
        earlier : number of first programs that only make room for the others
        """
        programs, times = [], []
        for program, seconds in parts:
            mode = np.array(program.path_mode)
            mode[0, 0] = PathControl.UNPLACED
            placed = replace(program, path_mode=mode)
            programs.append(placed)
            times.append(_from_first_motion(placed, seconds))
        first = np.cumsum([0, *(len(p) for p in programs)])
        joined = Program.join(programs)
        return ProgramSequence(
            replace(joined, line=np.arange(1, len(joined) + 1)), np.concatenate(times), first.astype(np.int64),
            uncounted=int(first[earlier]),
        )  # fmt: skip

    def program_at(self, line: int) -> tuple[int, int]:
        """Return the number of the program that a line of the joined program belongs to, and its row there."""
        k = int(np.searchsorted(self.first, line - 1, "right")) - 1
        return k, line - 1 - int(self.first[k])


def _from_first_motion(program: Program, seconds: Floats) -> Floats:
    """Times whose rows before the first motion count with it: they are of this program, not of the one before."""
    out = np.array(seconds, dtype=np.float64)
    moving = moving_rows(program)
    if moving.any():
        k = int(np.argmax(moving))
        out[k] += out[:k].sum()
        out[:k] = 0.0
    return out
