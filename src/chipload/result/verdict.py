"""The three states of a check, which are also the three verdicts of a result."""

from __future__ import annotations

import enum
from collections.abc import Iterable

from chipload.errors import Finding, Severity


class Verdict(enum.StrEnum):
    """State of a limit, a track or a result.

    ``HOLDS``: checked and within the limit. ``UNPROVEN``: nothing that was found exceeds the limit, but something was
    not stated, not checked or is known too coarsely. ``EXCEEDS``: a value lies above its limit.

    >>> Verdict.worst([Verdict.HOLDS, Verdict.UNPROVEN])
    <Verdict.UNPROVEN: 'unproven'>
    """

    HOLDS = "holds"
    UNPROVEN = "unproven"
    EXCEEDS = "exceeds"

    @property
    def exit_code(self) -> int:
        """Exit code of a command that ends with this verdict: 0 if everything holds, else 3."""
        return 0 if self is Verdict.HOLDS else 3

    @staticmethod
    def worst(states: Iterable[Verdict]) -> Verdict:
        """Return the worst of several states; ``HOLDS`` if there are none."""
        order = list(Verdict)
        return order[max((order.index(s) for s in states), default=0)]

    @staticmethod
    def of_finding(finding: Finding) -> Verdict:
        """Return the verdict that a finding causes."""
        return list(Verdict)[finding.severity.value]


__all__ = ["Severity", "Verdict"]
