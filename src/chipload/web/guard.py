"""Who may talk to the page: browsers of this computer that show this page.

A page of another site may make a browser send requests to 127.0.0.1, also under a name of its own that leads here. So
every request must name this host and this port, a websocket must come from this very page, nothing but GET and HEAD is
heard beside the websocket, and what is shown may ask no other host for anything.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

NAMES = ("127.0.0.1", "localhost")
#: what the page may load and ask; the page's own scripts stand in it and are compiled there
POLICY = (
    "default-src 'self' data: blob:; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; "
    "style-src 'self' 'unsafe-inline'; connect-src 'self' data: blob:; object-src 'none'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'"
)
#: a report is a file of somebody: its scripts may draw, and see and ask nothing
SANDBOX = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:"
)
#: headers of every answer
HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"cross-origin-opener-policy", b"same-origin"),
)


class Guard:
    """The door before the application; ``port`` is the one that it listens on."""

    def __init__(self, app: App, port: int) -> None:
        self.app, self.port = app, port

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request through, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        why = refusal(scope["type"], scope.get("method", "GET"), scope["headers"], self.port)
        if why is None:
            await self.app(scope, receive, _with_headers(send))
        elif scope["type"] == "http":
            status, text = why
            head = [(b"content-type", b"text/plain; charset=utf-8"), *HEADERS]
            await send({"type": "http.response.start", "status": status, "headers": head})
            await send({"type": "http.response.body", "body": text.encode()})
        else:
            await receive()
            await send({"type": "websocket.close", "code": 1008})


def refusal(kind: str, method: str, headers: list[tuple[bytes, bytes]], port: int) -> tuple[int, str] | None:
    """Status and reason of a request that is not heard; None: it is.

    >>> refusal("http", "GET", [(b"host", b"localhost:8170")], 8170)
    >>> refusal("http", "GET", [(b"host", b"evil.example:8170")], 8170)[0]
    403
    """
    hosts = [v.decode("latin-1").lower() for k, v in headers if k.lower() == b"host"]
    origins = [v.decode("latin-1").lower() for k, v in headers if k.lower() == b"origin"]
    known = {name for n in NAMES for name in (n, f"{n}:{port}")}
    if len(hosts) != 1 or hosts[0] not in known:
        return 403, f"refused: this page is http://127.0.0.1:{port}\n"
    sources = {f"http://{n}:{port}" for n in NAMES} | ({f"http://{n}" for n in NAMES} if port == 80 else set())
    if any(o not in sources for o in origins) or (kind == "websocket" and len(origins) != 1):
        return 403, "refused: another page asks\n"
    if kind == "http" and method not in ("GET", "HEAD"):
        return 405, "refused: only GET\n"
    return None


def _with_headers(send: Send) -> Send:
    async def more(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            have = {k.lower() for k, _ in message["headers"]}
            own = [(b"content-security-policy", POLICY.encode()), *HEADERS]
            message["headers"] = [*message["headers"], *((k, v) for k, v in own if k not in have)]
        await send(message)

    return more
