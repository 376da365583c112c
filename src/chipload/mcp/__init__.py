"""A server of the Model Context Protocol over stdin and stdout, for programs that work with chipload as people do.

It reads and writes only in the folders that are named when it starts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.mcp.folders import NamedFolders
    from chipload.mcp.server import server_of
    from chipload.mcp.tools import ClientTools

__all__ = [
    "ClientTools",
    "NamedFolders",
    "server_of",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "folders": "NamedFolders",
        "server": "server_of",
        "tools": "ClientTools",
    },
)
