"""Jobs that read and simulate a program, and can change its spindle speeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.jobs.program.api import simulate
    from chipload.jobs.program.history import History
    from chipload.jobs.program.outcome import SpeedsProgram
    from chipload.jobs.program.tap import modes_text

__all__ = ["History", "SpeedsProgram", "modes_text", "simulate"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "api": "simulate",
        "history": "History",
        "outcome": "SpeedsProgram",
        "tap": "modes_text",
    },
)
