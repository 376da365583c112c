"""Findings on what is missing in a reading: from their lines on, tool and stock may stand elsewhere.

A block that cannot be read may cut. What is found behind it (a rapid through stock that it would have taken away, a
force) rests on that block, as does everything where unit or control of the text are a guess.
"""

from __future__ import annotations

from collections.abc import Iterable

from chipload.errors import Finding, Severity
from chipload.program.missing_axes import MISSING_AXIS

#: findings on blocks that may cut and are not in the program
LEFT_OUT = frozenset(
    {"nc-not-read", "nc-call", "nc-unknown-word", "nc-left-out", "heidenhain-cycle", "heidenhain-left-out"}
)
#: findings on what changes the path from their lines on
UNCERTAIN = LEFT_OUT | {
    MISSING_AXIS,
    "apt-left-out",
    "heidenhain-call",
    "heidenhain-datum",
    "heidenhain-function",
    "heidenhain-jump",
    "heidenhain-plane",
    "heidenhain-unread",
    "nc-compensation-unstated",
    "nc-compensation-wear",
    "nc-control",
    "nc-distance",
    "nc-input",
    "nc-jump",
    "nc-long-line",
    "nc-no-point",
    "nc-offset-left-out",
    "nc-start-unknown",
    "nc-tools-unit",
    "nc-unit",
}


def first_left_out(findings: Iterable[Finding]) -> Finding | None:
    """The first finding, by line, on what is missing; None: nothing is. One without a line concerns all lines.

    >>> read = Finding("nc-not-read", 8, "G150: the block is left out", Severity.UNPROVEN)
    >>> first_left_out([read, Finding("nc-control", 0, "read as a program for Fanuc")]).line
    8
    """
    missing = [f for f in findings if f.code in UNCERTAIN and f.severity is Severity.UNPROVEN]
    return min(missing, key=lambda f: f.line, default=None)
