"""Machines and logs from an MTConnect agent that answers on the loopback."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from urllib.parse import parse_qs, urlparse

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload.cli import app
from chipload.control.logs import read_log
from chipload.errors import InputError
from chipload.machine import read_machine
from chipload.machine.mtconnect import describe_device, document, samples

PROBE = """<?xml version="1.0" encoding="UTF-8"?>
<MTConnectDevices xmlns="urn:mtconnect.org:MTConnectDevices:1.4"><Header/><Devices>
<Device id="d" name="mill 7" uuid="u"><Components>
 <Axes id="a"><Components>
  <Linear id="x" name="X"><DataItems>
   <DataItem category="SAMPLE" id="xp" type="POSITION" units="MILLIMETER"><Constraints><Minimum>-305.5</Minimum>
    <Maximum>305.5</Maximum></Constraints></DataItem></DataItems></Linear>
  <Linear id="y" name="Y1" nativeName="Y"><Configuration><Specifications>
   <Specification type="POSITION" units="MILLIMETER"><Maximum>200</Maximum><Minimum>-203</Minimum></Specification>
  </Specifications></Configuration></Linear>
  <Linear id="z" name="Z"><DataItems><DataItem category="SAMPLE" id="zp" type="POSITION"/></DataItems></Linear>
  <Rotary id="b" name="B"><DataItems><DataItem category="SAMPLE" id="bp" type="ANGLE"/></DataItems></Rotary>
  <Rotary id="s" name="S"><DataItems>
   <DataItem category="SAMPLE" id="sv" type="ROTARY_VELOCITY" units="REVOLUTION/MINUTE"><Constraints>
    <Minimum>50</Minimum><Maximum>12000</Maximum></Constraints></DataItem></DataItems></Rotary>
 </Components></Axes>
 <Controller id="c"><Components><Path id="p"><DataItems>
  <DataItem category="SAMPLE" id="pf" type="PATH_FEEDRATE" units="MILLIMETER/SECOND"><Constraints>
   <Maximum>250</Maximum></Constraints></DataItem></DataItems></Path></Components></Controller>
</Components></Device></Devices></MTConnectDevices>
"""
ROWS = 25


def streams(first: int, count: int, extra: str = "") -> str:
    """Samples ``first`` and on: four a row, of which one was commanded; the last speed is unavailable."""
    spindle, path = [], []
    for n in range(first, min(first + count, 4 * ROWS)):
        k, which = divmod(n, 4)
        at = f'timestamp="2026-03-01T10:00:{k:02d}.250000Z" sequence="{n + 1}" dataItemId="i{which}"'
        value = "UNAVAILABLE" if k == ROWS - 1 else str(3000 + k)
        spindle.append(
            [f'<RotaryVelocity {at} subType="ACTUAL">{value}</RotaryVelocity>',
             f'<RotaryVelocity {at} subType="PROGRAMMED">9999</RotaryVelocity>', "",
             f"<Amperage {at}>{2.0 + 0.5 * k}</Amperage>"][which]
        )  # fmt: skip
        path.append(f"<PathFeedrate {at}>{10 + k}</PathFeedrate>" if which == 2 else "")
    after = min(first + count, 4 * ROWS) + 1
    return (
        '<MTConnectStreams xmlns="urn:mtconnect.org:MTConnectStreams:1.4">'
        f'<Header nextSequence="{after}" lastSequence="{4 * ROWS}"/><Streams><DeviceStream name="mill 7">'
        f'<ComponentStream component="Rotary" name="S" componentId="s"><Samples>{"".join(spindle)}</Samples>'
        f'</ComponentStream><ComponentStream component="Path" name="p" componentId="p"><Samples>{"".join(path)}'
        f"</Samples></ComponentStream>{extra}</DeviceStream></Streams></MTConnectStreams>"
    )


class Agent(BaseHTTPRequestHandler):
    """Gives at most 30 samples an answer."""

    def do_GET(self) -> None:
        """/probe and /sample."""
        asked = urlparse(self.path)
        first = int(parse_qs(asked.query).get("from", ["1"])[0]) - 1
        text = {"/probe": PROBE, "/sample": streams(first, 30)}.get(
            asked.path, "<MTConnectError><Errors><Error>no such path</Error></Errors></MTConnectError>"
        )
        self.send_response(200)
        self.end_headers()
        self.wfile.write(text.encode())

    def log_message(self, *_: object) -> None:
        """Print nothing."""


@pytest.fixture
def agent() -> Iterator[str]:
    server = HTTPServer(("127.0.0.1", 0), Agent)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    thread.join()
    server.server_close()


def test_a_log_of_all_that_the_agent_holds(agent: str, tmp_path: Path) -> None:
    """Four answers make one log; the speed that was commanded and the row without a speed are left out."""
    done = CliRunner().invoke(app, ["mtconnect", agent, "--out", str(tmp_path / "cut.csv")])
    assert done.exit_code == 0, done.output
    assert "1 samples are left out" in done.stdout
    log, findings = read_log(tmp_path / "cut.csv")
    k = np.arange(ROWS - 1)
    assert findings == []
    np.testing.assert_allclose(log.time, k, atol=1e-9)
    assert log.speed is not None
    assert log.current is not None
    assert log.feed is not None
    np.testing.assert_allclose(log.speed * 60.0 / (2.0 * np.pi), 3000 + k)
    np.testing.assert_allclose(log.current, 2.0 + 0.5 * k)
    np.testing.assert_allclose(log.feed, 10 + k)


def test_a_machine_is_refused_until_its_comments_are_filled_in(agent: str, tmp_path: Path) -> None:
    out = tmp_path / "mill.toml"
    done = CliRunner().invoke(app, ["mtconnect", agent, "--out", str(out)])
    assert done.exit_code == 0, done.output
    with pytest.raises(InputError, match="dialect is missing"):
        read_machine(out)
    text = out.read_text()
    assert "without their mounting: B" in text
    fill = {
        "dialect": '"fanuc"', "rapid_mm_min": "20000.0", "corner_tolerance_mm": "0.01", "acceleration_mm_s2": "3000.0",
        "min_mm": "-100.0", "max_mm": "100.0",
    }  # fmt: skip
    lines = []
    for line in text.splitlines():
        key = line.removeprefix("# ").split(" =")[0]
        lines.append(f"{key} = {fill[key]}" if line.startswith("# ") and key in fill else line)
    out.write_text("\n".join(lines))
    machine = read_machine(out)
    assert machine.name == "mill 7"
    axes = {letter: machine.chain.axis(letter) for letter in "XYZ"}
    assert [(a.low, a.high) for a in axes.values()] == [(-305.5, 305.5), (-203.0, 200.0), (-100.0, 100.0)]
    assert machine.feed_max == pytest.approx(250.0)
    assert machine.spindle_max == pytest.approx(12000.0 * 2.0 * np.pi / 60.0)


def test_what_is_asked_for_must_be_there(agent: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no device lathe: there are mill 7"):
        describe_device(document(agent, "probe"), "lathe")
    with pytest.raises(InputError, match="the agent reports: no such path"):
        document(agent, "assets")
    with pytest.raises(InputError, match="no answer"):
        document("http://127.0.0.1:9", "probe")
    other = '<RotaryVelocity timestamp="2026-03-01T10:00:00Z" sequence="900">1</RotaryVelocity>'
    two = streams(0, 100, f'<ComponentStream component="Rotary" name="S2"><Samples>{other}</Samples></ComponentStream>')
    (tmp_path / "two.xml").write_text(two)
    with pytest.raises(InputError, match="spindles S, S2: state --component"):
        samples(str(tmp_path / "two.xml"))
    assert samples(str(tmp_path / "two.xml"), component="S")[0].startswith("time_s,speed_rpm,current_a,feed_mm_min\n")
    for name, text, message in (
        ("a", streams(0, 100).replace("Amperage", "Load"), "no sample of the spindle's current"),
        ("b", streams(0, 100).replace("2026-03", "spring"), "must be a date and time of ISO 8601"),
        ("c", '<!DOCTYPE x [<!ENTITY a "b">]><x/>', "a DOCTYPE or ENTITY declaration, which MTConnect does not use"),
        ("d", "<html/>", "MTConnectDevices or MTConnectStreams is read"),
        ("e", "<MTConnectStreams>", "not XML"),
    ):
        (tmp_path / f"{name}.xml").write_text(text)
        with pytest.raises(InputError, match=message):
            samples(str(tmp_path / f"{name}.xml"))
    done = CliRunner().invoke(app, ["mtconnect", agent, "--out", str(tmp_path / "x.json")])
    assert (done.exit_code, "must end with .toml" in done.stderr) == (2, True)


def test_numbers_and_depth_that_no_agent_sends_are_refused(tmp_path: Path) -> None:
    for name, text, message in (
        ("a", streams(0, 8).replace('sequence="1"', 'sequence="1e15"'), "sequence = '1e15': must be a whole number"),
        ("b", streams(0, 8).replace('sequence="1"', f'sequence="{"9" * 5000}"'), "must be a whole number"),
    ):
        (tmp_path / f"{name}.xml").write_text(text)
        with pytest.raises(InputError, match=message):
            samples(str(tmp_path / f"{name}.xml"))
    deep = PROBE.replace('<Linear id="x"', "<Group>" * 20_000 + '<Linear id="x"', 1)
    deep = deep.replace("</Axes>", "</Axes>", 1).replace("</Linear>", "</Linear>" + "</Group>" * 20_000, 1)
    (tmp_path / "deep.xml").write_text(deep)
    found = describe_device(document(str(tmp_path / "deep.xml")))
    assert found.speed == (50.0, 12000.0)


def test_an_agent_that_sends_a_byte_at_a_time_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """The time counts from the request, not from the last byte."""
    monkeypatch.setattr("chipload.machine.mtconnect.WAIT_S", 0.3)
    stop = threading.Event()

    class Slow(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.end_headers()
            while not stop.wait(0.05):
                try:
                    self.wfile.write(b" ")
                except OSError:
                    return

        def log_message(self, *words: object) -> None:
            """Nothing."""

    server = HTTPServer(("127.0.0.1", 0), Slow)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        with pytest.raises(InputError, match=r"no answer: the answer is not complete after 0\.3 s"):
            document(f"http://127.0.0.1:{server.server_port}", "probe")
    finally:
        stop.set()
        server.shutdown()
        server.server_close()
