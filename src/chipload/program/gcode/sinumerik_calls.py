"""Subprograms of a Sinumerik: L100 P3, NAME P2, NAME(1, 2) and CALL "NAME", in the same text or in a file beside it.

Notation: a text may hold several programs, each below a line ``%_N_NAME_SPF`` (or MPF), as archives have them, or below
``PROC NAME(REAL A, INT B)``. A file beside the text is NAME.SPF or NAME.MPF, in capitals or not. M17, RET and M30 end a
subprogram. Arguments become values of the names that PROC states.

Reference: Siemens, SINUMERIK 840D sl Programming Manual Job Planning, "Subroutine technique".
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from chipload.errors import InputError
from chipload.program.gcode.dialect import NotReadError
from chipload.program.gcode.source import Source

if TYPE_CHECKING:
    from chipload.program.gcode.flow import Flow

#: greatest number of repeats of a call
MOST_CALLS = 9999
#: endings of files beside the text
FILES = (".SPF", ".spf", ".MPF", ".mpf")
_SECTION = re.compile(r"\s*%_N_([A-Z0-9_]+?)_(?:SPF|MPF)\b", re.IGNORECASE)
_PROC = re.compile(r"\s*(?:N[0-9]+\s*)?PROC\s+([A-Z_][A-Z0-9_]*)\s*(?:\(([^)]*)\))?", re.IGNORECASE)


def call_program(flow: Flow, name: str, times: int, arguments: list[float | None]) -> None:
    """Go on in a subprogram.

    Raises
    ------
    NotReadError
        There is none of this name.
    """
    if not 0 <= times <= MOST_CALLS:
        raise InputError(f"{name} P{times}: must be from 0 to {MOST_CALLS}")
    for source in (flow.source, flow.main, flow.subprogram_source(name, FILES)):
        line = None if source is None else _begin(source, name)
        if source is not None and line is not None:
            if times > 0:
                flow.enter_program(source, line, name, times)
                _take(flow, source, line, arguments)
            return
    raise NotReadError(f"{name}: calls a program that is neither in this text nor beside it")


def _begin(source: Source, name: str) -> int | None:
    """The line before the first block of a program; None: the text does not hold it."""
    first = None
    for k, raw in enumerate(source.lines):
        found = _SECTION.match(raw) or _PROC.match(raw)
        if found is not None and found[1].upper() == name:
            return k
        if first is None and raw.strip():
            first = k
    stem = source.name.rsplit(".", 1)[0].upper()
    return -1 if stem == name and first is not None else None


def _take(flow: Flow, source: Source, line: int, arguments: list[float | None]) -> None:
    """Give the names of PROC their values; what is not given is 0."""
    for k in range(max(line, 0), min(line + 6, len(source.lines))):
        found = _PROC.match(source.lines[k])
        if found is None:
            continue
        listed = [part.split("=")[0].split()[-1] for part in (found[2] or "").split(",") if part.strip()]
        for i, one in enumerate(listed):
            value = arguments[i] if i < len(arguments) else None
            flow.c.parameters.assign(f"_{one.lower()}", value or 0.0)
        return
    if any(value is not None for value in arguments):
        raise NotReadError("a call with arguments of a program without PROC: they are left out")
