"""What can go wrong: one root error, refused input, and findings of a reader."""

from __future__ import annotations

from dataclasses import dataclass


class ChiploadError(Exception):
    """Root of every error that chipload raises on purpose."""


class InputError(ChiploadError):
    """Refused input; the message names the thing, its value, the limit and the remedy."""


class Cancelled(ChiploadError):
    """A long call was stopped by its ``progress`` callback."""


@dataclass(frozen=True)
class Finding:
    """What a reader or a planner noticed and did not hide.

    ``code`` is short and stable (``dxf-joined``), ``line`` the line in the source (0: none), ``text`` says what
    and where in a sentence.
    """

    code: str
    line: int
    text: str

    def __str__(self) -> str:
        """The text with its line and its code.

        >>> str(Finding("dxf-joined", 12, "a gap of 0.002 mm was closed"))
        'line 12: a gap of 0.002 mm was closed (dxf-joined)'
        """
        return f"line {self.line}: {self.text} ({self.code})" if self.line else f"{self.text} ({self.code})"
