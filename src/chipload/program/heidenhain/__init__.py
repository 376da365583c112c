"""Heidenhain conversational programs, in part: reader, changed feeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.program.heidenhain.feed_words import kept_feeds, with_feeds
    from chipload.program.heidenhain.reader import heidenhain_text, read_heidenhain, tool_definitions

__all__ = ["heidenhain_text", "kept_feeds", "read_heidenhain", "tool_definitions", "with_feeds"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "feed_words": "kept_feeds with_feeds",
        "reader": "heidenhain_text read_heidenhain tool_definitions",
    },
)
