"""NC programs (RS-274, Fanuc, Sinumerik): reader, writer, changed feeds and speeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.program.gcode.blocks import decimal
    from chipload.program.gcode.feed_words import with_feeds
    from chipload.program.gcode.reader import gcode_text, read_gcode
    from chipload.program.gcode.speed_words import with_speeds
    from chipload.program.gcode.tools import ToolTable, read_tool_table
    from chipload.program.gcode.writer import Repeat, write_commands, write_gcode

__all__ = [
    "Repeat",
    "ToolTable",
    "decimal",
    "gcode_text",
    "read_gcode",
    "read_tool_table",
    "with_feeds",
    "with_speeds",
    "write_commands",
    "write_gcode",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "blocks": "decimal",
        "feed_words": "with_feeds",
        "reader": "gcode_text read_gcode",
        "speed_words": "with_speeds",
        "tools": "ToolTable read_tool_table",
        "writer": "Repeat write_commands write_gcode",
    },
)
