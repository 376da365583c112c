"""APT cutter location data: reader and writer."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.program.apt.cutters import read_cutters
    from chipload.program.apt.reader import apt_text, read_apt, read_apt_file
    from chipload.program.apt.writer import write_apt

__all__ = ["apt_text", "read_apt", "read_apt_file", "read_cutters", "write_apt"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "cutters": "read_cutters",
        "reader": "apt_text read_apt read_apt_file",
        "writer": "write_apt",
    },
)
