"""Chamfers that a text states by C without a comma: `G1 X50. C2.` on a machine without an axis C.

A Fanuc whose setting says so takes C of a straight motion in the plane as the chamfer behind it. It is one where the
machine has no axis C and every C of the text stands in such a motion with a length above 0; one C of another kind, or
another rotary axis, makes all of them positions.

Reference: Fanuc B-63525EN, parameter 3405, bit 4 (CCR).
"""

from __future__ import annotations

import re

from chipload.program.gcode.controller import Controller

_COMMENT = re.compile(r"(\([^()\n]*\)|;[^\n]*)")
_CODE = re.compile(r"[Gg]\s*0*([0-9]+(?:\.[0-9])?)")
_CHAMFER = re.compile(
    r"(?<![,A-Za-z#\[])(?P<before>\s*)(?P<word>[Cc]\s*(?P<length>[0-9]+\.?[0-9]*|\.[0-9]+))(?![0-9.])"
)
_LETTER_C = re.compile(r"(?<![,A-Za-z#])[Cc](?![A-Za-z])")
_IN_PLANE, _OFF_PLANE = re.compile(r"[XxYy]\s*[-+.0-9#\[]"), re.compile(r"[ZzAaBbIiJjKk]\s*[-+.0-9#\[]")
_ROTARY = re.compile(r"(?<![A-Za-z#])[AaBb]\s*[-+]?[0-9.]")
#: codes of macro calls, whose letters are arguments
_CALLS = frozenset({"65", "66", "66.1"})
_MOTION = frozenset({"0", "1", "2", "3"})
#: codes that may stand in the block of a chamfer
_MODES = frozenset({"1", "17", "40", "41", "42", "61", "64", "90", "91", "94"})


def has_bare_chamfers(text: str) -> bool:
    r"""Whether every C of a text is the chamfer behind a straight motion in the plane, and there is one.

    >>> has_bare_chamfers("G1 X50. C2. F100."), has_bare_chamfers("G0 C90.\nG1 X50. C2. F100.")
    (True, False)
    """
    motion, found = "", False
    for raw in _COMMENT.sub(" ", text).splitlines():
        codes = _CODE.findall(raw)
        if not _CALLS.isdisjoint(codes):
            continue
        if _ROTARY.search(raw):
            return False
        motion = next((code for code in reversed(codes) if code in _MOTION), motion)
        if _LETTER_C.search(raw) is None:
            continue
        chamfer = _CHAMFER.search(raw)
        straight = motion == "1" and not set(codes) - _MODES and _IN_PLANE.search(raw) and not _OFF_PLANE.search(raw)
        if chamfer is None or not straight or float(chamfer["length"]) == 0.0:
            return False
        found = True
    return found


def with_commas(text: str, c: Controller) -> str:
    """A text with a comma before its chamfers, as the reader takes them; the same where there are none."""
    machine = None if c.swivel is None else c.swivel.machine
    if not c.control.text.bare_chamfers or (machine is not None and "C" in machine.chain.letters):
        return text
    if not has_bare_chamfers(text):
        return text
    out = [_with_comma(raw) for raw in text.split("\n")]
    line = next(k for k, (old, new) in enumerate(zip(text.split("\n"), out, strict=True), 1) if old != new)
    c.findings.add("nc-bare-chamfer", line, "C without a comma is a chamfer, as the machine has no axis C")
    return "\n".join(out)


def _with_comma(raw: str) -> str:
    """A line with a comma before its chamfer; comments and calls of macros as they are."""
    parts = _COMMENT.split(raw)
    if not _CALLS.isdisjoint(_CODE.findall("".join(parts[::2]))):
        return raw
    parts[::2] = [_CHAMFER.sub(r"\g<before>,\g<word>", part) for part in parts[::2]]
    return "".join(parts)
