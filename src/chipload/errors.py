"""Errors and findings: one root error, refused input, output that cannot be written, and findings of a reader."""

from __future__ import annotations

import enum
import math
from collections.abc import Iterable
from dataclasses import dataclass


class ChiploadError(Exception):
    """Root of every error that chipload raises on purpose."""


class InputError(ChiploadError):
    """Refused input; the message names the thing, its value, the limit and the remedy."""


class InputErrors(InputError):
    """Several errors of one input, one line for each.

    >>> str(InputErrors("a: missing", "b = 3: must be below 2")).splitlines()
    ['a: missing', 'b = 3: must be below 2']
    """

    def __str__(self) -> str:
        return "\n".join(map(str, self.args))


class OutputError(ChiploadError):
    """The input is valid, but the result cannot be written; checkpoints remain."""


class Cancelled(ChiploadError):
    """A long call was stopped by its ``progress`` callback."""


class Severity(enum.IntEnum):
    """What a finding does to a verdict, mildest first.

    ``NOTE`` leaves it as it is; ``UNPROVEN``: the result does not show what the job asks, since something is missing,
    assumed or left out; ``EXCEEDS``: a limit is exceeded. The severity of several findings is the ``max`` of theirs.
    """

    NOTE = 0
    UNPROVEN = 1
    EXCEEDS = 2


@dataclass(frozen=True)
class Finding:
    """Observation of a reader, a planner or a check.

    Parameters
    ----------
    code
        Short and stable (``dxf-joined``).
    line
        Line in the source (0: none).
    text
        What and where, in a sentence.
    severity
        What the finding does to the verdict.
    place
        x, y and z [mm] in the workpiece, if the finding has a place.
    row
        Row of the program or of the history, if the finding has one.
    """

    code: str
    line: int
    text: str
    severity: Severity = Severity.NOTE
    place: tuple[float, float, float] | None = None
    row: int | None = None

    def __post_init__(self) -> None:
        """Refuse a place that is not three finite numbers and a row below zero."""
        if self.place is not None and (len(self.place) != 3 or not all(map(math.isfinite, self.place))):
            raise InputError(f"Finding {self.code}: place = {self.place}: must be three finite numbers x, y, z")
        if self.row is not None and self.row < 0:
            raise InputError(f"Finding {self.code}: row = {self.row}: must be at least 0; None if there is no row")

    def __str__(self) -> str:
        """The text with its line and its code.

        >>> str(Finding("dxf-joined", 12, "a gap of 0.002 mm was closed"))
        'line 12: a gap of 0.002 mm was closed (dxf-joined)'
        """
        return f"line {self.line}: {self.text} ({self.code})" if self.line else f"{self.text} ({self.code})"


#: lines of a file that are named where the same finding is made in many
LINES_NAMED = 3


def group_findings(findings: Iterable[Finding]) -> list[tuple[Finding, str]]:
    """Findings with the same code, text and severity as one: the first of them, and the text with the lines of all.

    >>> [text for _, text in group_findings([Finding("a", n, "one") for n in (2, 5, 7, 8)] + [Finding("b", 4, "two")])]
    ['lines 2, 5, 7 and 1 more: one (a)', 'line 4: two (b)']
    """
    groups: dict[tuple[str, str, Severity], list[Finding]] = {}
    for finding in findings:
        groups.setdefault((finding.code, finding.text, finding.severity), []).append(finding)
    out = []
    for (code, text, _), each in groups.items():
        lines = list(dict.fromkeys(f.line for f in each))
        if len(lines) == 1:
            out.append((each[0], str(each[0])))
            continue
        named, more = ", ".join(map(str, lines[:LINES_NAMED])), len(lines) - LINES_NAMED
        out.append((each[0], f"lines {named}{f' and {more} more' if more > 0 else ''}: {text} ({code})"))
    return out


def worst_severity(findings: Iterable[Finding]) -> Severity:
    """Greatest severity of the findings; ``NOTE`` without any.

    >>> worst_severity([Finding("a", 1, "one"), Finding("b", 2, "two", Severity.UNPROVEN)]).name
    'UNPROVEN'
    """
    return max((finding.severity for finding in findings), default=Severity.NOTE)
