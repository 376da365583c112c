"""The tools as those of a server of the Model Context Protocol, with the official SDK."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Callable
from importlib.metadata import version
from threading import Lock
from typing import Any

import anyio.from_thread
from mcp.server.mcpserver import Context, MCPServer
from mcp.server.mcpserver.exceptions import ToolError
from mcp.types import CallToolResult, ContentBlock, ImageContent, TextContent

from chipload.errors import InputError, OutputError
from chipload.mcp.tools import ClientTools
from chipload.progress import Progress

#: what a client is told first
INSTRUCTIONS = """chipload simulates, checks and plans CNC milling. A job (TOML) names a program, stock, cutters,
material, machine and limits. The usual order: list_files; draft_job for a program without a job; check_job;
simulate_job with a result folder; read_result, explain_limit and result_picture; set_feeds for the fastest feeds that
the limits allow. A verdict is holds, unproven (something is not stated or not checked; the reason says what) or
exceeds. Unproven is not holds. Values that a draft guesses must be confirmed by a person who knows the machine. Only
the folders of list_files are read and written."""


def server_of(tools: ClientTools) -> MCPServer[Any]:
    """Return the server of some tools. Calls that simulate are made one after the other."""
    server: MCPServer[Any] = MCPServer(
        "chipload", instructions=INSTRUCTIONS, version=version("chipload"), log_level="WARNING"
    )
    one_at_a_time = Lock()

    def answer_call(call: Callable[[], Any]) -> Any:
        """Return what a call gives; what it refuses is the message of the tool's error."""
        try:
            with one_at_a_time:
                return call()
        except (InputError, OutputError) as err:
            raise ToolError("\n".join(map(str, err.args))) from None
        except PermissionError as err:
            raise ToolError(str(err)) from None

    @server.tool()
    def list_files() -> dict[str, Any]:
        """List the folders that this server may touch, with their jobs, results and other files."""
        return dict(answer_call(tools.list_files))

    @server.tool()
    def list_materials() -> dict[str, Any]:
        """List the materials that come with chipload: force coefficients, range, spread and source."""
        return dict(answer_call(lambda: tools.listing("materials")))

    @server.tool()
    def list_machines() -> dict[str, Any]:
        """List the machines that come with chipload: axes, travel, feed, spindle and source of the numbers."""
        return dict(answer_call(lambda: tools.listing("machines")))

    @server.tool()
    def draft_job(file: str, folder: str, machine: str | None = None, tool_table: str | None = None) -> dict[str, Any]:
        """Write a job into a new folder for a program, drawing or model. The guesses must be confirmed by a person.

        machine: a shipped name or a file; tool_table: a LinuxCNC tool table or a tool library of Fusion.
        """
        return dict(answer_call(lambda: tools.draft(file, folder, machine, tool_table)))

    @server.tool()
    def check_job(job: str, overrides: list[str] | None = None) -> dict[str, Any]:
        """Check a job without simulating it: what it names, what is missing, steps and time of a run.

        overrides: texts KEY.PATH=VALUE, such as limits.force_n=500.
        """
        return dict(answer_call(lambda: tools.check(job, overrides or ())))

    @server.tool()
    def simulate_job(
        job: str,
        result: str,
        ctx: Context[Any, Any],
        overrides: list[str] | None = None,
        coarse: bool = False,
    ) -> CallToolResult:
        """Run a job and write its result folder with report.html; returns verdict, reason, limits, findings, a picture.

        result: a new folder, or that of an older result, which is replaced. coarse: larger steps, a first result that
        is never better than unproven. Guesses of a draft leave it unproven until
        overrides state their values, or a person deletes `confirm = true`.
        """
        return _with_picture(
            *answer_call(
                lambda: tools.simulate(job, result, overrides or (), coarse=coarse, progress=_report_progress(ctx))
            )
        )

    @server.tool()
    def set_feeds(
        job: str,
        result: str,
        ctx: Context[Any, Any],
        slowest_percent: float = 30.0,
        fastest_percent: float = 200.0,
        overrides: list[str] | None = None,
    ) -> CallToolResult:
        """Give each line of the program the fastest feed that the limits allow, simulate it again, write both.

        slowest_percent, fastest_percent: range of the new feeds, in percent of the programmed ones. The path does not
        change. At least one limit of the job must limit a load.
        """
        return _with_picture(
            *answer_call(
                lambda: tools.feeds(
                    job, result, slowest_percent, fastest_percent, overrides or (),
                    progress=_report_progress(ctx),
                )
            )
        )  # fmt: skip

    @server.tool()
    def read_result(result: str) -> dict[str, Any]:
        """Read a result folder: verdict and reason, limits with worst values and places, findings, programs, report."""
        return dict(answer_call(lambda: tools.read_result(result)))

    @server.tool()
    def explain_limit(name: str, result: str | None = None) -> dict[str, Any]:
        """Explain a limit: meaning, unit, where its error comes from; with a result also worst value, place, reason."""
        return dict(answer_call(lambda: tools.explain_limit(name, result)))

    @server.tool()
    def result_picture(result: str, columns: list[str] | None = None, track: str = "") -> CallToolResult:
        """Draw columns of a result over time with their limits, as PNG; by default the limited ones, then loads."""
        return CallToolResult(content=[_png(answer_call(lambda: tools.picture(result, columns or (), track)))])

    return server


def _report_progress(ctx: Context[Any, Any]) -> Progress:
    """Return a progress that is reported to the client; the calculation runs in a thread of its own."""

    def progress(part: float, what: str) -> None:
        anyio.from_thread.run(ctx.report_progress, part, 1.0, what)

    return progress


def _png(data: bytes) -> ImageContent:
    return ImageContent(type="image", data=b64encode(data).decode("ascii"), mime_type="image/png")


def _with_picture(answer: dict[str, Any], picture: bytes | None) -> CallToolResult:
    """Return an answer as text and as values, and a picture where there is one."""
    content: list[ContentBlock] = [TextContent(type="text", text=json.dumps(answer, ensure_ascii=False, indent=1))]
    if picture is not None:
        content.append(_png(picture))
    return CallToolResult(content=content, structured_content=answer)
