"""Motions that stand behind the end of a program and that nothing calls: another program, a set-up, a rest.

Notation: a **section** is the text from one beginning of a program (an O number, %, PROC, a Sinumerik's %_N_ line) to
the next. One of which a line is carried out is a subprogram in use. One that ends with the return of a subprogram and
that nothing calls is a note; any other leaves the result unproven, as the machine may hold it for a second program.
"""

from __future__ import annotations

import re
from itertools import pairwise

from chipload.program.gcode.controller import Controller

_BEGINS = re.compile(r"\s*(?:[O:]\s*(?:[0-9]|<)|%|PROC\b)", re.IGNORECASE)
_COMMENTS = re.compile(r"\([^()\n]*\)|;.*")
_MOVES = re.compile(r"(?<![A-Za-z_$])[XYZABC]\s*=?\s*(?:[-+]?\s*[0-9.#\[(]|[AI]C)", re.IGNORECASE)
_RETURNS = re.compile(r"(?<![A-Z])M0?(?:99|17)(?![0-9])|\bRET\b|\bRTS\b|\bENDSUB\b", re.IGNORECASE)


def note_unreached(c: Controller, lines: list[str], reached: bytearray, end: int | None) -> None:
    """Report the sections behind the last block of the main program that move and that are not carried out.

    Parameters
    ----------
    lines : of the main text
    reached : whether each of them has been carried out
    end : index of the line that would follow; None: the program ended in another text
    """
    begin = reached.rfind(1) + 1 if end is None else end
    places = [k for k in range(begin + 1, len(lines)) if _BEGINS.match(lines[k])]
    for first, last in pairwise([begin, *places, len(lines)]):
        if not any(reached[first:last]):
            _report(c, lines, first, last)


def _report(c: Controller, lines: list[str], begin: int, end: int) -> None:
    plain = [_COMMENTS.sub("", line) for line in lines[begin:end]]
    moves = [begin + k for k, line in enumerate(plain) if _MOVES.search(line)]
    if not moves:
        return
    name = next((line.strip()[:40] for line in plain if line.strip().strip("%")), "")
    place = f"lines {moves[0] + 1} to {moves[-1] + 1} ({name})" if len(moves) > 1 else f"line {moves[0] + 1} ({name})"
    c.line = moves[0] + 1
    if any(_RETURNS.search(line) for line in plain):
        c.note("nc-not-called", f"{place}: a subprogram that nothing calls: it is not carried out")
    else:
        c.leave_out(
            "nc-behind-end",
            f"{place}: what stands behind the end of the program is not carried out: give another program a file of "
            "its own",
        )
