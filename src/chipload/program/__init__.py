"""Programs: construction, checks, times, readers and writers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.program.apt.writer import write_apt
    from chipload.program.build import helix, plunge, rapid, rows
    from chipload.program.check import check_program
    from chipload.program.commands import Commands
    from chipload.program.convert import convert_program
    from chipload.program.gcode.reader import read_gcode
    from chipload.program.gcode.writer import write_gcode
    from chipload.program.program import Program
    from chipload.program.read import ProgramReading, read_program, read_tools, reading_of
    from chipload.program.setup import Setup

__all__ = [
    "Commands",
    "Program",
    "ProgramReading",
    "Setup",
    "check_program",
    "convert_program",
    "helix",
    "plunge",
    "rapid",
    "read_gcode",
    "read_program",
    "read_tools",
    "reading_of",
    "rows",
    "write_apt",
    "write_gcode",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "program": "Program",
        "read": "ProgramReading read_program read_tools reading_of",
        "setup": "Setup",
        "commands": "Commands",
        "build": "rapid plunge rows helix",
        "gcode.reader": "read_gcode",
        "gcode.writer": "write_gcode",
        "apt.writer": "write_apt",
        "check": "check_program",
        "convert": "convert_program",
    },
)
