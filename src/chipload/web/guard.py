"""Access to the page: only browsers of this computer that have its address, and only requests of the page.

A page of another site may make a browser send requests to 127.0.0.1, also under a host name of its own that resolves to
this computer. So every request must name this host and this port, a websocket must come from this page, nothing but GET
and HEAD is accepted besides the websocket, and what is shown may not contact any other host.

Another user of this computer can connect to the port. So the address that is printed carries a random token; the first
visit turns it into a cookie, and a request without this cookie is refused.
"""

from __future__ import annotations

import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qsl, urlencode

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

NAMES = ("127.0.0.1", "localhost")
#: what the page may load and request; the page's own scripts are part of it and are compiled there
POLICY = (
    "default-src 'self' data: blob:; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; "
    "style-src 'self' 'unsafe-inline'; connect-src 'self' data: blob:; object-src 'none'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'"
)
#: a report is a foreign file: its scripts may draw, but not read or request anything
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
    """Accepts or refuses each request before the application sees it.

    Parameters
    ----------
    port : that the application listens on
    token : that the address of the page carries
    """

    def __init__(self, app: App, port: int, token: str) -> None:
        self.app, self.port, self.token = app, port, token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = scope["headers"]
        refused = refusal(scope["type"], scope.get("method", "GET"), headers, self.port)
        if refused is None and scope["type"] == "http" and scope["path"] == "/":
            query = parse_qsl(scope.get("query_string", b"").decode("latin-1"))
            if any(key == "token" and _equal(value, self.token) for key, value in query):
                await self._admit(query, send)
                return
        if refused is None and not _has_cookie(headers, self.port, self.token):
            refused = 403, "refused: open the address that `chipload view` printed, with its token\n"
        if refused is None:
            await self.app(scope, receive, _with_headers(send))
        elif scope["type"] == "http":
            status, text = refused
            head = [(b"content-type", b"text/plain; charset=utf-8"), *HEADERS]
            await send({"type": "http.response.start", "status": status, "headers": head})
            await send({"type": "http.response.body", "body": text.encode()})
        else:
            await receive()
            await send({"type": "websocket.close", "code": 1008})

    async def _admit(self, query: list[tuple[str, str]], send: Send) -> None:
        """Set the cookie and lead to the same address without the token, so that no history keeps it."""
        rest = urlencode([(key, value) for key, value in query if key != "token"])
        cookie = f"{cookie_name(self.port)}={self.token}; Path=/; HttpOnly; SameSite=Lax"
        head = [
            (b"location", f"/{'?' if rest else ''}{rest}".encode("ascii")),
            (b"set-cookie", cookie.encode("ascii")),
            (b"cache-control", b"no-store"),
            *HEADERS,
        ]
        await send({"type": "http.response.start", "status": 303, "headers": head})
        await send({"type": "http.response.body", "body": b""})


def cookie_name(port: int) -> str:
    """Name of the cookie: browsers keep cookies by host, and two pages may be open on two ports.

    >>> cookie_name(8170)
    'chipload-8170'
    """
    return f"chipload-{port}"


def _has_cookie(headers: list[tuple[bytes, bytes]], port: int, token: str) -> bool:
    """Whether a request carries the token in its cookie."""
    for key, value in headers:
        if key.lower() == b"cookie":
            try:
                found = SimpleCookie(value.decode("latin-1")).get(cookie_name(port))
            except CookieError:
                continue
            if found is not None and _equal(found.value, token):
                return True
    return False


def _equal(value: str, token: str) -> bool:
    return secrets.compare_digest(value.encode(), token.encode())


def refusal(kind: str, method: str, headers: list[tuple[bytes, bytes]], port: int) -> tuple[int, str] | None:
    """Status and reason of a request that is refused for its host, origin or method; None: it is not.

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
        return 403, "refused: request from another page\n"
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
