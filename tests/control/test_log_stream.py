"""Samples of a file that grows, is cut off and is replaced, and of an agent that loses its connection."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from urllib.parse import parse_qs, urlparse

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import chipload.api.mechanics.learning as learning
import chipload.cli.learn as learn
from chipload.control.learning import SignalKind
from chipload.control.log_stream import follow_file
from chipload.errors import InputError
from chipload.machine import mtconnect_stream
from chipload.machine.mtconnect import samples
from command import call
from synthetic_cell import PRIOR
from synthetic_stream import stream, with_fault

HEAD = "time_s,power_w,line,override_percent\n"


def test_a_file_that_grows_is_cut_off_and_replaced(tmp_path: Path) -> None:
    """Each step writes what a controller might: half a row, its end, a row without a number, a new file, a cut file."""
    file = tmp_path / "cut.csv"
    file.write_text(HEAD + "0,100,1,100\n0.1,20")
    steps = iter([
        lambda: file.write_text(file.read_text() + "0,1,50\n0.2,,1,100\n0.3,300,2,100\n"),
        lambda: (tmp_path / "new").write_text(HEAD + "5,500,3,100\n") and (tmp_path / "new").replace(file),
        lambda: file.write_text("time_s,line,power_w\n9,4,900\n"),
    ])  # fmt: skip

    def wait(_: float) -> None:
        step = next(steps, None)
        if step is None:
            raise KeyboardInterrupt
        step()

    found: list[tuple[float, float, int, float]] = []

    def follow() -> None:
        for one in follow_file(file, SignalKind.POWER, wait=wait):
            found.extend([(one.time, one.value, one.line, one.override)] if one is not None else [])

    with pytest.raises(KeyboardInterrupt):
        follow()
    assert found == [
        (0.0, 1e5, 1, 1.0), (0.1, 2e5, 1, 0.5), (0.3, 3e5, 2, 1.0), (5.0, 5e5, 3, 1.0), (9.0, 9e5, 4, 1.0)
    ]  # fmt: skip


def test_a_parquet_file_that_is_complete(tmp_path: Path) -> None:
    """Its rows as they were written; it does not grow."""
    file = tmp_path / "cut.parquet"
    pq.write_table(pa.table({"time_s": [0.0, 0.5], "power_w": [100.0, 200.0], "line": [3, 4]}), file)
    found = [(s.time, s.value, s.line, s.override) for s in follow_file(file, SignalKind.POWER, once=True) if s]
    assert found == [(0.0, 1e5, 3, 1.0), (0.5, 2e5, 4, 1.0)]
    with pytest.raises(InputError, match="a Parquet file does not grow: state --once, or write CSV"):
        next(follow_file(file, SignalKind.POWER))
    with pytest.raises(InputError, match="no column of torque, which is needed"):
        next(follow_file(file, SignalKind.TORQUE, once=True))


def test_what_a_file_lacks(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        next(follow_file(tmp_path / "none.csv", SignalKind.POWER))
    (tmp_path / "a.csv").write_text("time_s,power_w\n1,2\n")
    with pytest.raises(InputError, match="no column of line, which is needed"):
        next(follow_file(tmp_path / "a.csv", SignalKind.POWER))
    # of halsampler: no head, columns by their numbers, a time for each row
    (tmp_path / "b.csv").write_text("100 1\n200 1\n")
    columns = {"head": False, "sample_s": 0.5, "power": {"column": 1, "unit": "W"}, "line": {"column": 2}}
    found = list(follow_file(tmp_path / "b.csv", SignalKind.POWER, columns, once=True))
    assert [(s.time, s.value, s.line) for s in found if s is not None] == [(0.0, 1e5, 1), (0.5, 2e5, 1)]


#: samples of an answer, and requests at which the agent does not answer, or was started again
BATCH, SILENT, AGAIN = 150, (3, 4), 6


def streams(rows: list[tuple[float, float, int]], first: int, last: int, instance: int = 7) -> str:
    """The document of the samples from ``first`` to ``last``, from 1."""
    power, lines = [], []
    for k, (t, p, line) in enumerate(rows[first - 1 : last], start=first):
        at = f'timestamp="2026-03-01T10:{int(t // 60):02d}:{t % 60:06.3f}Z" sequence="{k}"'
        lines.append(f"<LineNumber {at}>{line}</LineNumber>")
        power.append(f"<RotaryVelocity {at}>8000</RotaryVelocity><Wattage {at}>{p:.3f}</Wattage>")
    return (
        f'<MTConnectStreams><Header instanceId="{instance}" nextSequence="{last + 1}"/><Streams>'
        '<DeviceStream name="mill"><ComponentStream component="Rotary" name="S">'
        f'<Samples>{"".join(power)}</Samples></ComponentStream><ComponentStream component="Path" name="p">'
        f"<Events>{''.join(lines)}</Events></ComponentStream></DeviceStream></Streams></MTConnectStreams>"
    )


class Agent(BaseHTTPRequestHandler):
    """Power and line of a stream, BATCH samples more at each request."""

    rows: list[tuple[float, float, int]]
    asked = 0

    def do_GET(self) -> None:
        asked = urlparse(self.path)
        if asked.path == "/sample":
            type(self).asked += 1
        if self.asked in SILENT:
            self.send_error(503)
            return
        seen = min(BATCH * (self.asked + 1), len(self.rows))
        first = int(parse_qs(asked.query).get("from", [str(seen)])[0])
        instance = 7 if self.asked < AGAIN else 8
        text = streams(self.rows, first, seen, instance)
        self.send_response(200)
        self.end_headers()
        self.wfile.write(text.encode())

    def log_message(self, *_: object) -> None:
        """Print nothing."""


@pytest.fixture
def agent(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[str, int]]:
    """A program whose stock is missing in a line, streamed by an agent; the job is that program in closed form."""
    one = stream(103)
    power, own = with_fault(one, "watch-air") or pytest.fail("no line")
    Agent.rows = list(zip(one.time.tolist(), (1e-3 * power).tolist(), one.line.tolist(), strict=True))
    # the program has ended
    Agent.rows.append((float(one.time[-1]) + 0.1, 1e-3 * one.idle, 0))
    Agent.asked = 0
    monkeypatch.setattr(learn, "program_job", lambda *_: ("", PRIOR))
    monkeypatch.setattr(learn, "run_job_now", lambda *_: type("Done", (), {"result": None}))
    monkeypatch.setattr(learning, "torque_of_result", lambda *_: one.program)
    monkeypatch.setattr(mtconnect_stream, "POLL_S", 0.002)
    server = HTTPServer(("127.0.0.1", 0), Agent)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}", int(one.line[own][0])
    server.shutdown()
    thread.join()
    server.server_close()


def test_an_agent_that_is_silent_and_started_again(agent: tuple[str, int]) -> None:
    """The alarm is the one of the fault; the command ends with the program and says what it lost."""
    address, line = agent
    code, out, err = call("watch", address, "--job", "job.toml", "--efficiency", "0.85", "--duration-s", "30")
    assert (code, err) == (3, "")
    said = out.splitlines()
    assert "it is asked again until it answers" in said[1]
    assert said[2] == "the agent answers again"
    assert said[3] == "samples are lost: the agent was started again"
    assert [text.startswith(f"line {line}: ") for text in said[4:-2]] == [True]
    assert "missing stock" in said[4]
    assert said[-2].startswith("jumps and gaps of the clock: 1, the first of 15 s at ")
    assert said[-1].endswith("; 1 alarm")
    assert call("watch", "http://127.0.0.1:9", "--job", "job.toml")[0] == 2


def test_a_log_of_an_agent_has_lines(tmp_path: Path) -> None:
    """What `learn` reads: the line stands beside the power of its sample; the first row has no speed yet."""
    rows = [(0.1 * k, 100.0 + k, 10 + k // 3) for k in range(20)]
    (tmp_path / "streams.xml").write_text(streams(rows, 1, len(rows)))
    text, _ = samples(str(tmp_path / "streams.xml"))
    head, *own = text.splitlines()
    assert head == "time_s,speed_rpm,power_w,line"
    found = [tuple(map(float, row.split(","))) for row in own]
    np.testing.assert_allclose(found, [(t, 8000.0, p, line) for t, p, line in rows[1:]])
