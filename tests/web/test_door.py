"""Who is let in, what is served, on which port, and that Ctrl-C ends all."""

import http.client
import socket
import subprocess
import sys
import urllib.parse

import pytest

from square import make_result
from web_served import Served


def ask(port, path, method="GET", **headers):
    """Status, headers and body of one answer."""
    link = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    link.putrequest(method, path, skip_host="Host" in headers or "host" in headers)
    for key, value in headers.items():
        link.putheader(key.replace("_", "-"), value)
    link.endheaders()
    answer = link.getresponse()
    body = answer.read()
    link.close()
    return answer.status, {k.lower(): v for k, v in answer.getheaders()}, body


def handshake(port, origin, host=None):
    """First line of what a websocket of a page gets."""
    lines = [
        "GET /_nicegui_ws/socket.io/?EIO=4&transport=websocket HTTP/1.1",
        f"Host: {host or f'127.0.0.1:{port}'}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
        "Sec-WebSocket-Version: 13",
        *([f"Origin: {origin}"] if origin else []),
    ]
    with socket.create_connection(("127.0.0.1", port), timeout=30) as link:
        link.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        return link.recv(200).decode("latin-1").split("\r\n")[0]


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "127.0.0.1:{port}", "LOCALHOST:{port}"])
def test_this_computer_is_heard(served, host) -> None:
    status, headers, body = ask(served.port, "/", Host=host.format(port=served.port))
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
    status, _, body = ask(served.port, "/", Host=host.format(port=served.port))
    assert status == 403
    assert body == f"refused: this page is http://127.0.0.1:{served.port}\n".encode()


def test_other_origins_and_methods_are_refused(served) -> None:
    own = f"http://127.0.0.1:{served.port}"
    assert ask(served.port, "/", Origin=own)[0] == 200
    for origin in ("http://evil.example", "null", "http://127.0.0.1:1", f"https://127.0.0.1:{served.port}"):
        assert ask(served.port, "/", Origin=origin)[0] == 403
    for method in ("POST", "PUT", "DELETE", "OPTIONS"):
        assert ask(served.port, "/", method)[0] == 405
        assert ask(served.port, "/_nicegui_ws/socket.io/?EIO=4&transport=polling", method)[0] == 405


def test_a_websocket_must_come_from_this_page(served) -> None:
    own = f"http://127.0.0.1:{served.port}"
    assert handshake(served.port, own).endswith("101 Switching Protocols")
    for origin, host in (("http://evil.example", None), (None, None), ("null", None), (own, "evil.example")):
        assert " 403 " in handshake(served.port, origin, host)


def test_only_this_computer_can_reach_it(served) -> None:
    with pytest.raises(OSError, match=r"refused|timed out|unreachable"):
        socket.create_connection(("127.0.0.2", served.port), timeout=5)


def test_reports_of_the_folder_are_served_and_can_ask_nothing(served) -> None:
    status, headers, body = ask(served.port, "/report?name=square")
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
    status, _, body = ask(served.port, "/report?name=" + urllib.parse.quote(name, safe=""))
    assert status == 404
    assert b"the report" not in body


def test_no_other_file_has_an_address(served) -> None:
    for path in ("/square/summary.json", "/../square/report.html", "/shape/../../square/report.html", "/shape/00.glb",
                 "/_nicegui/3/static/../../../etc/passwd", "/%2e%2e/outside0/secret.txt"):  # fmt: skip
        status, _, body = ask(served.port, path)
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
        assert ask(other.port, "/")[0] == 200
    assert other.end() == 0


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda f: f / "none", "cannot be opened: No such file or directory"),
        (lambda f: f / "square.ngc", "is no job: name a job file (TOML), a result folder or a folder that holds them"),
    ],
)
def test_what_cannot_be_opened_is_said_in_one_line(folder, make, said) -> None:
    code, out, err = call(str(make(folder)), "--no-open")
    assert (code, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1
