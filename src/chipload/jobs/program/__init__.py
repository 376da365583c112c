"""Jobs that read and simulate a program, and can change its spindle speeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.jobs.program.outcome import SpeedsProgram
    from chipload.jobs.program.tap import modes_text

__all__ = ["SpeedsProgram", "modes_text"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "outcome": "SpeedsProgram",
        "tap": "modes_text",
    },
)
