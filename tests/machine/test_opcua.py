"""Logs of a spindle from an OPC UA server on the loopback."""

from __future__ import annotations

import asyncio
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from chipload.control.logs import read_log
from chipload.errors import InputError
from chipload.machine.opcua import OpcUaSource, record_spindle
from command import call

asyncua = pytest.importorskip("asyncua")


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    """A server whose spindle goes from 0 W up by 100 W each 0.05 s, at 3000 rpm and one more each time."""
    address, stop, ready = f"opc.tcp://127.0.0.1:{free_port()}", threading.Event(), threading.Event()

    async def serve() -> None:
        one = asyncua.Server()
        await one.init()
        one.set_endpoint(address)
        one.set_security_policy([asyncua.ua.SecurityPolicyType.NoSecurity])
        space = await one.register_namespace("urn:mill")
        spindle = await one.nodes.objects.add_object(space, "Spindle")
        power = await spindle.add_variable(asyncua.ua.NodeId("power", space), "power", 0.0)
        speed = await spindle.add_variable(asyncua.ua.NodeId("speed", space), "speed", 3000.0)
        await spindle.add_variable(asyncua.ua.NodeId("name", space), "name", "S1")
        async with one:
            ready.set()
            k = 0
            while not stop.is_set():
                k += 1
                await speed.write_value(3000.0 + k)
                await power.write_value(100.0 * k)
                await asyncio.sleep(0.05)

    thread = threading.Thread(target=lambda: asyncio.run(serve()), daemon=True)
    thread.start()
    assert ready.wait(20.0)
    yield address
    stop.set()
    thread.join(10.0)


def test_a_log_has_what_the_server_wrote(server, tmp_path) -> None:
    """Each power stands beside the speed that was written with it: power / 100 = speed - 3000."""
    out = tmp_path / "spindle.csv"
    code, said, errors = call(
        "opcua", server, "--node", "power_w=ns=2;s=power", "--node", "speed_rpm=ns=2;s=speed", "--out", out,
        "--duration-s", "1", "--interval-s", "0.01",
    )  # fmt: skip
    assert (code, errors) == (0, "")
    assert said.splitlines()[-1].endswith("rows: time_s,speed_rpm,power_w")
    log, _ = read_log(out)
    assert log.power is not None
    assert log.speed is not None
    assert len(log.time) >= 5
    steps = log.power / 1e3 / 100.0
    speeds = log.speed * 60.0 / (2.0 * np.pi) - 3000.0
    assert np.abs(steps - np.round(steps)).max() < 1e-9
    # both are written one after the other: a sample may fall between them
    assert set(np.round(speeds - steps).astype(int)) <= {0, 1}
    assert (np.diff(steps) >= 1.0 - 1e-9).all()
    # the source's own clock: 0.05 s a step and some
    assert (np.diff(log.time) > 0.04 * np.diff(steps)).all()


def test_a_notebook_records_too(server) -> None:
    """Where an event loop runs already, as in Jupyter."""

    async def cell() -> str:
        return record_spindle(OpcUaSource(server, {"power_w": "ns=2;s=power"}, interval_s=0.01), 0.5)[0]

    with ThreadPoolExecutor(1) as pool:
        log = pool.submit(asyncio.run, cell()).result()
    assert len(log.splitlines()) >= 4


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_keeps_what_was_recorded(server, tmp_path) -> None:
    out = tmp_path / "spindle.csv"
    words = [sys.executable, "-m", "chipload", "opcua", server, "--node", "power_w=ns=2;s=power", "--out", str(out)]
    recording = subprocess.Popen([*words, "--interval-s", "0.01"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    time.sleep(4.0)
    recording.send_signal(signal.SIGINT)
    said, errors = recording.communicate(timeout=20.0)
    assert (recording.returncode, errors) == (0, b"")
    assert said.decode().strip().endswith("rows: time_s,power_w")
    assert len(read_log(out)[0].time) >= 5


@pytest.mark.parametrize(
    ("nodes", "message"),
    [
        ({"power_w": "ns=2;s=none"}, "BadNodeIdUnknown"),
        ({"power_w": "ns=2;s=name"}, "--node power_w=ns=2;s=name: its value is 'S1': must be a number"),
        ({"power_w": "no node"}, "check the address, the nodes and the user"),
    ],
)
def test_a_node_that_is_none_is_named(server, nodes, message) -> None:
    with pytest.raises(InputError, match=message.replace("(", r"\(")):
        record_spindle(OpcUaSource(server, nodes), 0.1)


def test_a_server_that_does_not_answer_is_named() -> None:
    address, begin = f"opc.tcp://127.0.0.1:{free_port()}", time.monotonic()
    with pytest.raises(InputError, match=f"OPC UA {address}: .*check the address"):
        record_spindle(OpcUaSource(address, {"power_w": "ns=2;s=power"}), 0.1)
    assert time.monotonic() - begin < 60.0


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"address": "http://a:1"}, r"http://a:1: must have the form opc\.tcp://HOST:PORT"),
        ({"nodes": {"speed_rpm": "i=1"}}, "--node: none is a load"),
        ({"nodes": {"watt": "i=1"}}, "--node watt: not a column: must be one of speed_rpm"),
        ({"interval_s": 0.0}, "--interval-s = 0: must be above 0"),
        ({"user": "me"}, "--user me: set the environment variable CHIPLOAD_OPCUA_PASSWORD"),
    ],
)
def test_wrong_settings_are_named(keys, message, monkeypatch) -> None:
    monkeypatch.delenv("CHIPLOAD_OPCUA_PASSWORD", raising=False)
    with pytest.raises(InputError, match=message):
        OpcUaSource(**{"address": "opc.tcp://a:1", "nodes": {"power_w": "i=1"}, **keys})
