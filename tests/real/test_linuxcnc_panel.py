"""The panel as LinuxCNC's own PyVCP draws it, on a screen in memory: what the controller says changes its pixels."""

from __future__ import annotations

import fcntl
import os
import shutil
import struct
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest

from chipload.control.linuxcnc.hal_client import HalPins
from chipload.control.linuxcnc.panel import panel_hal, panel_xml
from chipload.control.override import STATUS
from simulated_machine import JOB

WIDTH, HEIGHT = 400, 560
#: colours of the lamps and of the bar: X11's green, orange and red
GREEN, ORANGE, RED = (0, 128, 0), (255, 165, 0), (255, 0, 0)
pytestmark = pytest.mark.skipif(
    any(shutil.which(name) is None for name in ("pyvcp", "halcmd", "Xvfb", "ipcs")),
    reason="LinuxCNC or a screen in memory is missing: apt-get install linuxcnc-uspace xvfb",
)


def wait(done, seconds=20.0):
    end = time.monotonic() + seconds
    while not done():
        assert time.monotonic() < end
        time.sleep(0.05)


def pixels(file):
    """(h, w, 3) what an X server in memory shows: its file in the format of xwd, header words big-endian."""
    data = file.read_bytes()
    head = struct.unpack(">25I", data[:100])
    size, width, height, line, colours = head[0], head[4], head[5], head[12], head[19]
    rows = np.frombuffer(data, np.uint8, count=line * height, offset=size + 12 * colours).reshape(height, line)
    return rows[:, : 4 * width].reshape(height, width, 4)[..., 2::-1].astype(int)


def settled(file):
    """The screen when it no longer changes."""
    before = pixels(file)
    for _ in range(40):
        time.sleep(0.3)
        now = pixels(file)
        if (now == before).all() and now.any():
            return now
        before = now
    raise AssertionError("the panel does not come to rest")


def count(image, colour):
    return int((image == colour).all(axis=2).sum())


@pytest.fixture
def screen(tmp_path):
    """The panel on its screen: the file of its pixels."""
    with (Path(tempfile.gettempdir()) / "chipload-linuxcnc.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if "0x48414c32" in subprocess.run(["ipcs", "-m"], capture_output=True, text=True, check=True).stdout:
            pytest.skip("a HAL is loaded on this machine, and there is room for one")
        (tmp_path / "panel.xml").write_text(panel_xml(JOB))
        (tmp_path / "panel.hal").write_text(panel_hal())
        read, write = os.pipe()
        arguments = ["-displayfd", str(write), "-screen", "0", f"{WIDTH}x{HEIGHT}x24", "-nolisten", "tcp"]
        server = subprocess.Popen(
            ["Xvfb", *arguments, "-fbdir", str(tmp_path)], pass_fds=(write,), stderr=subprocess.DEVNULL
        )
        panel = None
        try:
            display = os.read(read, 20).decode().strip()
            environment = {"PATH": "/usr/bin:/bin", "HOME": str(tmp_path), "DISPLAY": f":{display}"}
            place = f"{WIDTH}x{HEIGHT}+0+0"
            panel = subprocess.Popen(
                ["pyvcp", "-g", place, "-c", "pyvcp", "panel.xml"], cwd=tmp_path, env=environment,
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            )  # fmt: skip
            shown = ["halcmd", "-s", "show", "comp", "pyvcp"]
            wait(lambda: "ready" in subprocess.run(shown, capture_output=True, text=True, check=False).stdout)
            subprocess.run(["halcmd", "-f", "panel.hal"], cwd=tmp_path, check=True, capture_output=True, timeout=20)
            yield tmp_path / "Xvfb_screen0"
        finally:
            for process in (panel, server):
                if process is not None:
                    process.terminate()
                    process.wait(10)
            os.close(read)
            os.close(write)
            subprocess.run(["halrun", "-U"], capture_output=True, timeout=20, check=False)


def test_the_panel_shows_what_the_controller_says(screen):
    """Half the limit: a green lamp, half a green bar; twice the limit: orange; an overload: a red lamp and bar."""
    with HalPins("chipload") as pins:
        assert pins.exchange(0.5, True, 0.5, STATUS.index("run"), 1.0, 1.0) is not None
        half = settled(screen)
        assert pins.exchange(0.5, False, 0.25, STATUS.index("run"), 1.0, 1.0) is not None
        quarter = settled(screen)
        pins.exchange(0.5, True, 2.0, STATUS.index("run"), 1.0, 1.0)
        heavy = settled(screen)
        pins.exchange(0.0, False, 3.0, STATUS.index("overload"), 1.0, 1.0)
        stopped = settled(screen)
        pins.exchange(0.0, True, 0.0, STATUS.index("no-reading"), 1.0, 1.0)
        lost = settled(screen)
    lamp = count(stopped, GREEN)
    assert lamp == 0
    lamp = count(heavy, GREEN)
    # of the bar, twice the load is twice as long: the lamp taken away
    assert (count(half, GREEN) - lamp) / (count(quarter, GREEN) - lamp) == pytest.approx(2.0, abs=0.15)
    assert lamp > 100
    assert count(heavy, RED) == 0
    assert count(heavy, ORANGE) > 10 * lamp
    assert count(stopped, ORANGE) == 0
    assert count(stopped, RED) > 10 * lamp
    # another lamp, elsewhere, as large
    assert count(lost, RED) == lamp
    where = [np.flatnonzero((image == RED).all(axis=2)[200:].any(axis=1)).min() for image in (stopped, lost)]
    assert where[1] - where[0] == pytest.approx(22, abs=6)
