"""The web server of the page on 127.0.0.1; it runs until Ctrl-C and ends its jobs with it."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import secrets
import socket
import tempfile
import webbrowser
from collections.abc import Callable, Iterator
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chipload.errors import InputError
from chipload.lazy import require_extra
from chipload.web.folder_access import OpenedFolder, open_path, resolve_name

if TYPE_CHECKING:
    from chipload.web.guard import App, Receive, Scope, Send

#: the only address that the server listens on, and the port that it tries first by default
HOST, PORT = "127.0.0.1", 8170
#: time that a connection may take to send its first request [s]
SILENT_S = 20.0


def serve(path: str | Path, port: int | None, show: bool, show_line: Callable[[str], None]) -> None:
    """Serve until Ctrl-C.

    Parameters
    ----------
    port : None: :data:`PORT`, or a free one where that is taken
    show : whether the browser is opened
    show_line : takes lines for the terminal; one has the address with its token

    Raises
    ------
    InputError
        The page is not installed, nothing can be shown of the path, or the requested port is in use.
    """
    require_extra("web")
    opened = open_path(path)
    listener, in_use = listen(port)
    own = int(listener.getsockname()[1])
    if in_use:
        show_line(f"port {PORT} is taken: using {own}")
    token = secrets.token_urlsafe(24)
    address = f"http://{HOST}:{own}/?token={token}"
    # the library would read a file of settings in the working directory
    os.environ["NICEGUI_STORAGE_PATH"] = str(Path(tempfile.gettempdir()) / "chipload-keeps-nothing")
    import uvicorn

    application = _application(opened, own, token, lambda: server.should_exit)
    config = uvicorn.Config(
        application,
        http=silent_closing_protocol(),
        log_level="error",
        access_log=False,
        timeout_graceful_shutdown=1,
        ws_max_size=4_000_000,
    )
    server = uvicorn.Server(config)

    async def work() -> None:
        started = asyncio.create_task(
            _when_started(server, lambda: show_line(f"{opened.root}: {address} (Ctrl-C ends it)"))
        )
        if show:
            loop = asyncio.get_running_loop()
            started.add_done_callback(lambda _: loop.run_in_executor(None, webbrowser.open, first.as_uri()))
        try:
            await server.serve(sockets=[listener])
        finally:
            started.cancel()

    with _redirect(address) as first, contextlib.suppress(KeyboardInterrupt, asyncio.CancelledError):
        asyncio.run(work())


def silent_closing_protocol(wait_s: float = SILENT_S) -> type:
    """Return uvicorn's protocol of HTTP, which also closes a connection without a whole request after a time [s].

    Uvicorn waits for the first request without limit; each such connection holds a file handle of this process.
    """
    from uvicorn.protocols.http.auto import AutoHTTPProtocol

    class SilentClosingProtocol(AutoHTTPProtocol):  # type: ignore[misc,valid-type]
        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            self.loop.call_later(wait_s, self._close_silent)

        def _close_silent(self) -> None:
            # a websocket has taken the connection over, and left the set
            if self.cycle is None and self in self.connections:
                self.transport.close()

    return SilentClosingProtocol


def listen(port: int | None) -> tuple[socket.socket, bool]:
    """A socket on 127.0.0.1, and whether :data:`PORT` was taken and another had to do.

    Raises
    ------
    InputError
        The requested port is in use or not allowed.
    """
    for number in (port,) if port is not None else (PORT, 0):
        own = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        own.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            own.bind((HOST, number))
            own.listen(64)
            return own, port is None and number == 0
        except OSError as err:
            own.close()
            if port is not None:
                raise InputError(
                    f"--port {port}: cannot be used: {err.strerror}: name another, or leave it out"
                ) from None
    raise InputError("no port is free on 127.0.0.1")


@contextlib.contextmanager
def _redirect(address: str) -> Iterator[Path]:
    """A file that leads a browser to an address: the words of a command, unlike the file, are open to every user."""
    with tempfile.TemporaryDirectory(prefix="chipload-") as folder:
        path = Path(folder) / "chipload.html"
        text = f'<!doctype html><meta http-equiv="refresh" content="0; url={escape(address)}">\n'
        path.write_text(text, "utf-8", newline="")
        yield path


async def _when_started(server: Any, act: Callable[[], None]) -> None:
    while not server.started:
        await asyncio.sleep(0.02)
    act()


def _application(opened: OpenedFolder, port: int, token: str, is_ending: Callable[[], bool]) -> Any:
    """The application behind its guard; its runs end with it. ``is_ending`` tells whether the server was stopped."""
    from fastapi import FastAPI
    from nicegui import app, ui
    from starlette.responses import FileResponse, PlainTextResponse, Response

    from chipload.report.view import viewer_script
    from chipload.web.asset_cache import AssetCache
    from chipload.web.guard import SANDBOX, Guard
    from chipload.web.page import Page
    from chipload.web.result import REPORT
    from chipload.web.runs import Runs
    from chipload.web.thumbnail import thumbnail

    # what is on its way to a window that was closed is no news for the terminal
    logging.getLogger("nicegui").setLevel(logging.ERROR)
    runs, assets, drawing = Runs(), AssetCache(), asyncio.Lock()

    @app.get("/shape/{key}.bin")
    def shape(key: str) -> Response:
        data = assets.get(key)
        if data is None:
            return PlainTextResponse("not here\n", status_code=404)
        return Response(data, media_type="application/octet-stream", headers={"cache-control": "no-store"})

    @app.get("/viewer.js")
    def viewer() -> Response:
        return Response(viewer_script(), media_type="text/javascript", headers={"cache-control": "no-cache"})

    @app.get("/thumbnail")
    async def small_picture(name: str) -> Response:
        async def draw_next() -> bytes:
            async with drawing:  # one at a time: a list asks for many at once
                return await asyncio.to_thread(thumbnail, opened.root, name)

        task = asyncio.ensure_future(draw_next())
        while not task.done():
            if is_ending():
                task.cancel()
                return PlainTextResponse("the page ends\n", status_code=503)
            await asyncio.wait({task}, timeout=0.05)
        try:
            data = task.result()
        except InputError as err:
            return PlainTextResponse(f"{err}\n", status_code=404)
        return Response(data, media_type="image/png", headers={"cache-control": "private, max-age=31536000, immutable"})

    @app.get("/report")
    def report(name: str) -> Response:
        try:
            path = resolve_name(opened.root, f"{name}/{REPORT}")
        except InputError as err:
            return PlainTextResponse(f"{err}\n", status_code=404)
        headers = {"content-security-policy": SANDBOX, "cache-control": "no-store"}
        return FileResponse(path, media_type="text/html", headers=headers)

    @ui.page("/", title="chipload", response_timeout=30.0)
    async def index(show: str | None = None) -> None:
        page, window = Page(opened, runs, assets), ui.context.client
        with contextlib.suppress(TimeoutError):
            await window.connected()
            if window.has_socket_connection:
                await page.begin(show)

    app.on_shutdown(runs.stop)
    app.config.socket_io_js_transports = ["websocket"]
    outer = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    ui.run_with(outer, title="chipload", tailwind=False, show_welcome_message=False, reconnect_timeout=30.0)
    return Guard(_uncompressed(outer), port, token)


def _uncompressed(application: App) -> App:
    """An application that compresses no answer: they stay on this computer, and a picture of a long history would take
    longer to compress than to make.
    """

    async def plain(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            scope = {**scope, "headers": [(k, v) for k, v in scope["headers"] if k.lower() != b"accept-encoding"]}
        await application(scope, receive, send)

    return plain
