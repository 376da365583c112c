"""Serve the page of one folder on 127.0.0.1 until Ctrl-C, and end its runs with it."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import socket
import tempfile
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import Any

from chipload.errors import InputError
from chipload.web.inside import Opened, inside, open_path

#: the only address that is listened on, and the port that is tried first where none is asked for
HOST, PORT = "127.0.0.1", 8170


def serve(path: str | Path, port: int | None, show: bool, say: Callable[[str], None]) -> None:
    """Serve until Ctrl-C.

    Parameters
    ----------
    port : None: :data:`PORT`, or a free one where that is taken
    show : whether the browser is opened
    say : takes lines for the person at the terminal

    Raises
    ------
    InputError
        Nothing can be shown of the path, or the port that was asked for is taken.
    """
    opened = open_path(path)
    listener, taken = listen(port)
    own = int(listener.getsockname()[1])
    if taken:
        say(f"port {PORT} is taken: using {own}")
    address = f"http://{HOST}:{own}/"
    # the library would read a file of settings in the working directory
    os.environ["NICEGUI_STORAGE_PATH"] = str(Path(tempfile.gettempdir()) / "chipload-keeps-nothing")
    import uvicorn

    application = _application(opened, own)
    config = uvicorn.Config(
        application, log_level="error", access_log=False, timeout_graceful_shutdown=1, ws_max_size=4_000_000
    )
    server = uvicorn.Server(config)

    async def work() -> None:
        started = asyncio.create_task(_told(server, lambda: say(f"{opened.root}: {address} (Ctrl-C ends it)")))
        if show:
            loop = asyncio.get_running_loop()
            started.add_done_callback(lambda _: loop.run_in_executor(None, webbrowser.open, address))
        try:
            await server.serve(sockets=[listener])
        finally:
            started.cancel()

    with contextlib.suppress(KeyboardInterrupt, asyncio.CancelledError):
        asyncio.run(work())


def listen(port: int | None) -> tuple[socket.socket, bool]:
    """A socket on 127.0.0.1, and whether :data:`PORT` was taken and another had to do.

    Raises
    ------
    InputError
        The port that was asked for is taken or not allowed.
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


async def _told(server: Any, tell: Callable[[], None]) -> None:
    while not server.started:
        await asyncio.sleep(0.02)
    tell()


def _application(opened: Opened, port: int) -> Any:
    """The application behind its guard; its runs end with it."""
    from fastapi import FastAPI
    from nicegui import app, ui
    from starlette.responses import FileResponse, PlainTextResponse, Response

    from chipload.web.guard import SANDBOX, Guard
    from chipload.web.page import Page, Runs
    from chipload.web.result import REPORT
    from chipload.web.shelf import Shelf

    # what is on its way to a window that was closed is no news for the terminal
    logging.getLogger("nicegui").setLevel(logging.ERROR)
    runs, shelf = Runs(), Shelf()

    @app.get("/shape/{key}.glb")
    def shape(key: str) -> Response:
        data = shelf.get(key)
        if data is None:
            return PlainTextResponse("not here\n", status_code=404)
        return Response(data, media_type="model/gltf-binary", headers={"cache-control": "no-store"})

    @app.get("/report")
    def report(name: str) -> Response:
        try:
            path = inside(opened.root, f"{name}/{REPORT}")
        except InputError as err:
            return PlainTextResponse(f"{err}\n", status_code=404)
        headers = {"content-security-policy": SANDBOX, "cache-control": "no-store"}
        return FileResponse(path, media_type="text/html", headers=headers)

    @ui.page("/", title="chipload", response_timeout=30.0)
    async def index(show: str | None = None) -> None:
        page, window = Page(opened, runs, shelf), ui.context.client
        with contextlib.suppress(TimeoutError):
            await window.connected()
            if window.has_socket_connection:
                await page.begin(show)

    app.on_shutdown(runs.stop)
    app.config.socket_io_js_transports = ["websocket"]
    outer = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    ui.run_with(outer, title="chipload", tailwind=False, show_welcome_message=False, reconnect_timeout=30.0)
    return Guard(outer, port)
