"""The command ``chipload mcp``, a server of the Model Context Protocol."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.app import Debug, app
from chipload.terminal import run_guarded


@app.command()
def mcp(
    folders: Annotated[
        list[Path], typer.Argument(metavar="FOLDER...", help="folders that may be read and written; nothing else is")
    ],
    debug: Debug = False,
) -> None:
    """Serve chipload to a program (an assistant, another system) by the Model Context Protocol, over stdin and stdout.

    Tools: list files, materials and machines, draft, check and simulate a job, set feeds, read a result, explain a
    limit, draw a picture. Needs chipload[mcp].
    """

    def work() -> int:
        from chipload.lazy import require_extra

        require_extra("mcp")
        from chipload.mcp.folders import NamedFolders

        known = NamedFolders.of(folders)
        from chipload.mcp.opening import close_other_folders
        from chipload.mcp.server import server_of
        from chipload.mcp.tools import ClientTools

        server = server_of(ClientTools(known))
        close_other_folders(known)
        server.run("stdio")
        return 0

    run_guarded(work, debug)
