"""User tasks of an Okuma OSP as macro statements of a Fanuc: variables, calls, jumps to named blocks.

| Okuma | taken as |
|---|---|
| ``VC1``, a local name such as ``DIA`` | ``#501``, ``#90001`` and so on by its place in the text |
| ``X=VC1*2`` | ``X[#501*2]`` |
| ``IF [VC1 GT 5] NEND``, ``GOTO NEND``, ``NEND X1.`` | the same with a number for the name |
| ``CALL O200 Q3 DIA=5``, ``RTS`` | ``M98 P200 L3 #90001=[5]``, ``M99`` |
| ``MODIN O200``, ``MODOUT`` | ``G66 P200``, ``G67`` |

Lines stay where they are. A variable of the system, such as ``VZOFX[1]``, is not known here: its block is left out.

Reference: ICAM, CeRun, "Okuma Pre-Processor Syntax".
"""

from __future__ import annotations

import re
from collections.abc import Callable

#: first variable of VC1 on and of local names, first number of named blocks and programs
COMMON, FAR_COMMON, LOCAL, NAMED = 500, 80_000, 90_000, 90_000_000
#: common variables that have a number of a Fanuc's common ones
NEAR = 499
#: words of the language, which are no variables
_WORDS = frozenset({"IF", "GOTO", "CALL", "RTS", "MODIN", "MODOUT", "NOEX"})
_COMMENT = re.compile(r"\([^()\n]*\)")
_COMMON = re.compile(r"\bVC(\d{1,4})(?!\d)")
_LOCAL = re.compile(r"(?<![A-Z0-9$])(?!VC\d)([A-UW-Z][A-Z][A-Z0-9]{0,6})[ \t]*=(?!=)")
_VALUE = re.compile(r"(?<![A-Z])([A-Z])[ \t]*=[ \t]*")
_LABEL = re.compile(r"\bN([A-Z][A-Z0-9]{0,4})\b")
_TARGET = re.compile(r"\]\s*(?:GOTO\s*)?N(?=\d)")
_JUMP = re.compile(r"\bGOTO\s*N(?=\d)")
_PROGRAM = re.compile(r"\bO([A-Z][A-Z0-9]{0,3})\b")
_CALL = re.compile(r"\b(CALL|MODIN)\s*O(\d+)((?:\s+.*)?)$")
_REPEAT = re.compile(r"(?<![A-Z0-9])Q(\d+)")
_SET = re.compile(r"(#\d+)[ \t]*=[ \t]*(\S+)")


def user_tasks(text: str) -> str:
    r"""Return a text with the statements of a Fanuc in place of those of an Okuma, line by line.

    >>> print(user_tasks("VC1=12.5\nIF [VC1 GT 5] NEND\nX=VC1*2 Z1.\nNEND CALL O20 Q3\nRTS"))
    #501=12.5
    IF [#501 GT 5] GOTO 90000001
    X[#501*2] Z1.
    N90000001 M98 P20 L3
    M99
    """
    plain = _COMMENT.sub(" ", text).upper()
    local = dict.fromkeys(hit[1] for hit in _LOCAL.finditer(plain) if hit[1] not in _WORDS)
    places = {name: f"#{LOCAL + k}" for k, name in enumerate(local, start=1)}
    names = re.compile(rf"(?<![A-Z0-9])(?:{'|'.join(sorted(places, key=len, reverse=True))})(?![A-Z0-9])")
    labels, programs = _number_names(_LABEL, plain), _number_names(_PROGRAM, plain)

    def carry_line(line: str) -> str:
        line = _COMMON.sub(lambda hit: f"#{_number_of_common(int(hit[1]))}", line)
        if places:
            line = names.sub(lambda hit: places[hit[0]], line)
        line = _LABEL.sub(lambda hit: f"N{labels[hit[1]]}" if hit[1] in labels else hit[0], line)
        line = _PROGRAM.sub(lambda hit: f"O{programs[hit[1]]}" if hit[1] in programs else hit[0], line)
        line = _JUMP.sub("GOTO ", _TARGET.sub("] GOTO ", line))
        line = re.sub(r"\bRTS\b", "M99", re.sub(r"\bMODOUT\b", "G67", line))
        return _put_brackets(_replace_calls(line))

    return "\n".join(_change_outside_comments(line, carry_line) for line in text.split("\n"))


def _number_of_common(number: int) -> int:
    return (COMMON if number <= NEAR else FAR_COMMON) + number


def _number_names(pattern: re.Pattern[str], plain: str) -> dict[str, int]:
    """Numbers of names, by their place in the text."""
    found = dict.fromkeys(hit[1] for hit in pattern.finditer(plain))
    return {name: NAMED + k for k, name in enumerate(found, start=1)}


def _change_outside_comments(line: str, carry: Callable[[str], str]) -> str:
    """A line with what is outside of its comments changed; comments follow it."""
    comments = "".join(_COMMENT.findall(line))
    plain = _COMMENT.sub(" ", line)
    if not re.search(r"[A-Za-z]{2}|=", plain):
        return line
    changed = carry(plain.upper().rstrip())
    return f"{changed} {comments}".rstrip() if comments else changed


def _replace_calls(line: str) -> str:
    """CALL and MODIN as M98 and G66; what follows sets variables, and Q repeats."""
    found = _CALL.search(line)
    if found is None:
        return line
    rest = found[3]
    repeat = _REPEAT.search(rest)
    sets = " ".join(f"{name}=[{value}]" for name, value in _SET.findall(rest))
    if found[1] == "MODIN":
        return " ".join(x for x in (line[: found.start()].strip(), f"G66 P{found[2]}", sets) if x)
    times = "" if repeat is None else f" L{repeat[1]}"
    return " ".join(x for x in (line[: found.start()].strip(), f"M98 P{found[2]}{times}", sets) if x)


def _put_brackets(line: str) -> str:
    """Values behind = in brackets: a value ends before a blank outside of brackets."""
    out, at = [], 0
    for hit in _VALUE.finditer(line):
        if hit.start() < at:
            continue
        depth, end = 0, hit.end()
        while end < len(line) and (depth > 0 or not line[end].isspace()):
            if depth == 0 and end > hit.end() and _VALUE.match(line, end):
                break
            depth += {"[": 1, "]": -1}.get(line[end], 0)
            end += 1
        out += [line[at : hit.start()], f"{hit[1]}[{line[hit.end() : end]}]"]
        at = end
    return "".join(out) + line[at:]
