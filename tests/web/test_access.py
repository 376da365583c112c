"""Who is let in, what is served, on which port, and that Ctrl-C ends all."""

import http.client
import socket
import subprocess
import sys
import urllib.parse
from concurrent.futures import ThreadPoolExecutor

import pytest

from chipload.web.serve import _redirect
from square import make_result
from web_served import Served


def ask(served, path, method="GET", cookie=True, **headers):
    """Status, headers and body of one answer; ``cookie``: that of the page, another text, or none."""
    link = http.client.HTTPConnection("127.0.0.1", served.port, timeout=30)
    link.putrequest(method, path, skip_host="Host" in headers or "host" in headers)
    for key, value in headers.items():
        link.putheader(key.replace("_", "-"), value)
    if cookie:
        link.putheader("Cookie", served.cookie if cookie is True else cookie)
    link.endheaders()
    answer = link.getresponse()
    body = answer.read()
    link.close()
    return answer.status, {k.lower(): v for k, v in answer.getheaders()}, body


def handshake(served, origin, host=None, cookie=True):
    """First line of what a websocket of a page gets."""
    lines = [
        "GET /_nicegui_ws/socket.io/?EIO=4&transport=websocket HTTP/1.1",
        f"Host: {host or f'127.0.0.1:{served.port}'}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
        "Sec-WebSocket-Version: 13",
        *([f"Origin: {origin}"] if origin else []),
        *([f"Cookie: {served.cookie if cookie is True else cookie}"] if cookie else []),
    ]
    with socket.create_connection(("127.0.0.1", served.port), timeout=30) as link:
        link.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        return link.recv(200).decode("latin-1").split("\r\n")[0]


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "127.0.0.1:{port}", "LOCALHOST:{port}"])
def test_this_computer_is_heard(served, host) -> None:
    status, headers, body = ask(served, "/", Host=host.format(port=served.port))
    assert status == 200
    assert "default-src 'self'" in headers["content-security-policy"]
    assert "http://" not in headers["content-security-policy"]
    assert headers["x-content-type-options"] == "nosniff"
    assert b"chipload" in body


@pytest.mark.parametrize(
    "host",
    ["evil.example", "evil.example:{port}", "127.0.0.1:1", "127.0.0.1.evil.example", "0.0.0.0:{port}", "", "[::1]"],
)
def test_another_host_is_refused(served, host) -> None:
    status, _, body = ask(served, "/", Host=host.format(port=served.port))
    assert status == 403
    assert body == f"refused: this page is http://127.0.0.1:{served.port}\n".encode()


def test_other_origins_and_methods_are_refused(served) -> None:
    own = f"http://127.0.0.1:{served.port}"
    assert ask(served, "/", Origin=own)[0] == 200
    for origin in ("http://evil.example", "null", "http://127.0.0.1:1", f"https://127.0.0.1:{served.port}"):
        assert ask(served, "/", Origin=origin)[0] == 403
    for method in ("POST", "PUT", "DELETE", "OPTIONS"):
        assert ask(served, "/", method)[0] == 405
        assert ask(served, "/_nicegui_ws/socket.io/?EIO=4&transport=polling", method)[0] == 405


def test_a_websocket_must_come_from_this_page(served) -> None:
    own = f"http://127.0.0.1:{served.port}"
    assert handshake(served, own).endswith("101 Switching Protocols")
    for origin, host in (("http://evil.example", None), (None, None), ("null", None), (own, "evil.example")):
        assert " 403 " in handshake(served, origin, host)


def test_the_address_with_the_token_gives_a_cookie_and_leads_to_one_without(served) -> None:
    status, headers, body = ask(served, f"/?token={served.token}&show=a%2Fb", cookie=None)
    assert (status, body) == (303, b"")
    assert headers["location"] == "/?show=a%2Fb"
    assert headers["set-cookie"] == f"{served.cookie}; Path=/; HttpOnly; SameSite=Lax"
    assert headers["cache-control"] == "no-store"
    assert ask(served, f"/?token={served.token}", cookie=None)[1]["location"] == "/"
    # a host and an origin of another site are refused with the token too
    assert ask(served, f"/?token={served.token}", cookie=None, Host="evil.example")[0] == 403
    assert ask(served, f"/?token={served.token}", cookie=None, Origin="http://evil.example")[0] == 403


@pytest.mark.parametrize(
    "cookie",
    [
        None,
        "chipload-{port}=",
        "chipload-{port}={token}x",
        "chipload-1={token}",
        "chipload-{port}=\u00e9",
        "a=b; {token}",
    ],
)
def test_another_user_of_this_computer_is_refused(served, cookie) -> None:
    given = cookie and cookie.format(port=served.port, token=served.token)
    paths = ["/", "/?token=", "/?token=x", f"/?show={served.token}", "/report?name=square", "/shape/00.bin"]
    paths += [f"/report?name=square&token={served.token}", "/_nicegui/3/static/nicegui.js"]
    for path in paths:
        status, headers, body = ask(served, path, cookie=given)
        assert status == 403, path
        assert body == b"refused: open the address that `chipload view` printed, with its token\n"
        assert "set-cookie" not in headers
    assert " 403 " in handshake(served, f"http://127.0.0.1:{served.port}", cookie=given)


def test_no_answer_is_compressed(served) -> None:
    """It stays on this computer; the time to compress a picture of a long history is longer than to make it."""
    status, headers, body = ask(served, "/viewer.js", Accept_Encoding="gzip")
    assert (status, "content-encoding" in headers) == (200, False)
    assert len(body) == int(headers["content-length"]) > 100_000


def test_each_page_has_a_token_of_its_own(served, tmp_path) -> None:
    make_result(tmp_path / "r")
    other = Served(tmp_path / "r")
    assert len(served.token) >= 32
    assert other.token != served.token
    assert ask(other, "/", cookie=f"chipload-{other.port}={served.token}")[0] == 403
    assert ask(other, "/", cookie=f"{served.cookie}; {other.cookie}")[0] == 200
    assert other.end() == 0


def test_the_address_is_not_among_the_words_of_the_browser() -> None:
    """Every user sees the words of a command; the browser gets a file that only its owner reads."""
    with _redirect("http://127.0.0.1:1/?token=abc") as path:
        assert "token=abc" in path.read_text()
        assert path.parent.stat().st_mode & 0o077 == 0
    assert not path.parent.exists()


def test_only_this_computer_can_reach_it(served) -> None:
    with pytest.raises(OSError, match=r"refused|timed out|unreachable"):
        socket.create_connection(("127.0.0.2", served.port), timeout=5)


def test_reports_of_the_folder_are_served_and_can_ask_nothing(served) -> None:
    status, headers, body = ask(served, "/report?name=square")
    assert (status, body) == (200, b"<p>the report</p>")
    assert headers["content-security-policy"].startswith("sandbox allow-scripts; default-src 'none';")


@pytest.mark.parametrize(
    "name",
    [
        "../outside0/result", "square/../../outside0/result", "leaves/result", "link", "/etc", "//etc", "..", "nowhere",
        "square/../bare", "square\0", "..\\outside0", "~",
    ],
)  # fmt: skip
def test_nothing_outside_the_folder_is_served(served, name) -> None:
    # a name with .. is refused even where it would end inside
    assert list(served.folder.parent.glob("outside0/result/report.html"))
    status, _, body = ask(served, "/report?name=" + urllib.parse.quote(name, safe=""))
    assert status == 404
    assert b"the report" not in body


def test_no_other_file_has_an_address(served) -> None:
    for path in ("/square/summary.json", "/../square/report.html", "/shape/../../square/report.html", "/shape/00.bin",
                 "/_nicegui/3/static/../../../etc/passwd", "/%2e%2e/outside0/secret.txt"):  # fmt: skip
        status, _, body = ask(served, path)
        assert status in (403, 404, 405), path
        assert b"secret" not in body
        assert b"root:" not in body


def call(*words):
    line = [sys.executable, "-c", "from chipload.cli import main; main()", "view", *words]
    done = subprocess.run(line, capture_output=True, text=True, timeout=120, check=False)
    return done.returncode, done.stdout, done.stderr


def test_a_port_that_is_taken(served, tmp_path) -> None:
    code, out, err = call(str(served.folder), "--no-open", "--port", str(served.port))
    assert (code, out) == (2, "")
    assert err == (
        f"chipload: --port {served.port}: cannot be used: Address already in use: name another, or leave it out\n"
    )
    make_result(tmp_path / "r")
    with socket.socket() as taken:
        taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            taken.bind(("127.0.0.1", 8170))
            taken.listen()
        except OSError:
            pass  # somebody else has it: as good
        other = Served(tmp_path / "r")
        assert other.said[0].startswith("port 8170 is taken: using ")
        assert other.port != 8170
        assert ask(other, "/")[0] == 200
    assert other.end() == 0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda f: f / "none", "cannot be opened: No such file or directory"),
        (lambda f: f / "notes.md", "notes.md: no motion: nothing to check"),
    ],
)
def test_what_cannot_be_opened_is_said_in_one_line(folder, make, message) -> None:
    (folder / "notes.md").write_text("these are notes\n")
    code, out, err = call(str(make(folder)), "--no-open")
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


def test_a_connection_without_a_request_is_closed():
    """After its time; one that has asked stays, for the next request."""
    import asyncio

    import uvicorn

    from chipload.web.serve import silent_closing_protocol

    async def answer(scope, receive, send):
        await send({"type": "http.response.start", "status": 204, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    async def closed_after():
        config = uvicorn.Config(
            answer, http=silent_closing_protocol(0.3), port=0, log_level="error", lifespan="off", timeout_keep_alive=30
        )
        server = uvicorn.Server(config)
        task = asyncio.create_task(server.serve())
        while not server.started:
            await asyncio.sleep(0.01)
        port = server.servers[0].sockets[0].getsockname()[1]
        links = [await asyncio.open_connection("127.0.0.1", port) for _ in range(3)]
        links[1][1].write(b"GET / HTTP/1.1\r\n")
        links[2][1].write(b"GET / HTTP/1.1\r\nHost: a\r\n\r\n")
        ends = [await asyncio.wait_for(reader.read(), 10.0) for reader, _ in links[:2]]
        await asyncio.sleep(0.2)
        asked = links[2][0]
        open_still = not asked.at_eof() and (await asked.read(12)).startswith(b"HTTP/1.1 204")
        for _, writer in links:
            writer.close()
        server.should_exit = True
        await task
        return ends, open_still

    # a browser of the same process has a running loop in this thread
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(asyncio.run, closed_after()).result() == ([b"", b""], True)
