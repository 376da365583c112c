"""LinuxCNC tool tables (`.tbl`): one line for each tool, `T1 P1 Z+0.511 D10.0 ;10 mm end mill`.

Lengths are in the machine's unit, which the file does not state: the caller states it.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from chipload.errors import InputError
from chipload.files import read_regular
from chipload.units import MM_PER

_WORD = re.compile(r"([A-Za-z])\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?=\s|[A-Za-z]|$)")
_LARGEST_FILE = 1_000_000
_LARGEST_NUMBER = 1e9


def read_tool_table(path: str | Path, tool: int, unit: str) -> dict[str, Any]:
    """Read number, diameter and name of one tool as keys of a job's ``[[cutter]]``; missing values are left out.

    Parameters
    ----------
    tool : its T word
    unit : `mm` or `inch`, of the lengths in the file

    Raises
    ------
    InputError
        The file cannot be read, a line is not a tool, or the tool is missing or appears twice.
    """
    path = Path(path)
    label = f"cutter.file {path}"
    text = read_regular(path, label, _LARGEST_FILE, "not a tool table").decode("utf-8", "replace")
    found: dict[int, tuple[int, dict[str, float], str]] = {}
    known: list[int] = []
    for k, line in enumerate(text.splitlines(), 1):
        body, _, comment = line.partition(";")
        if not body.strip():
            continue
        words = {letter.upper(): float(number) for letter, number in _WORD.findall(body)}
        if "T" not in words or _WORD.sub("", body).strip():
            raise InputError(f"{label} line {k}: not a tool: must be words such as T1 P1 D10")
        if not all(abs(number) < _LARGEST_NUMBER for number in words.values()):
            raise InputError(f"{label} line {k}: a number is too large: must be below {_LARGEST_NUMBER:g}")
        number = int(words["T"])
        if number == tool and tool in found:
            raise InputError(f"{label}: tool {tool} appears twice, in lines {found[tool][0]} and {k}: keep one")
        found[number] = (k, words, comment.strip())
        known.append(number)
    if tool not in found:
        listed = ", ".join(str(n) for n in sorted(set(known))) or "none"
        raise InputError(f"{label}: tool {tool} is not there: must be one of {listed}")
    _, words, comment = found[tool]
    out: dict[str, Any] = {"number": tool}
    if comment:
        out["name"] = comment
    if "D" in words:
        out["diameter_mm"] = words["D"] * MM_PER[unit]
    return out
