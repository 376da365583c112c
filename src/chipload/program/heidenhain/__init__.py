"""Heidenhain conversational programs, in part: reader."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.program.heidenhain.reader import heidenhain_text, read_heidenhain, tool_definitions

__all__ = ["heidenhain_text", "read_heidenhain", "tool_definitions"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "reader": "heidenhain_text read_heidenhain tool_definitions",
    },
)
