"""The controller under LinuxCNC: milltask runs a round pass on a tube, the override goes through HAL.

The oracle of time and torque is our own closed loop, in which axes and time are simulated; here they are LinuxCNC's.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from chipload.control.linuxcnc.hal_client import HalPins

TUBE = Path(__file__).parents[2] / "src" / "chipload" / "examples" / "tube"

pytestmark = [
    pytest.mark.skipif(
        shutil.which("linuxcnc") is None or shutil.which("script") is None,
        reason="linuxcnc is not installed: apt-get install linuxcnc-uspace",
    ),
    pytest.mark.skipif(
        os.environ.get("CHIPLOAD_LINUXCNC") != "1",
        reason="a controller in real time wants a machine to itself: set CHIPLOAD_LINUXCNC=1",
    ),
]


def hal_in_use():
    return "0x48414c32" in subprocess.run(["ipcs", "-m"], capture_output=True, text=True, check=True).stdout


@pytest.fixture(autouse=True)
def _free():
    if hal_in_use():
        pytest.skip("a HAL is loaded on this machine, and there is room for one")
    yield
    if hal_in_use():
        subprocess.run(["halrun", "-U"], capture_output=True, timeout=20, check=False)


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """What the job of the example gives; every limit of it holds."""
    out = tmp_path_factory.mktemp("tube") / "result"
    command = [sys.executable, "-c", "from chipload.cli import main; main()", "run", TUBE / "job.toml", "--out", out]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stdout + done.stderr
    return out


def played(folder, result, *options):
    """The summary of one run; whatever happens, nothing of it is left."""
    command = [sys.executable, TUBE / "linuxcnc" / "run.py", folder, "--result", result, *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=150)
    log = folder / "linuxcnc.log"
    assert done.returncode == 0, done.stderr + (log.read_text() if log.exists() else "")
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["processes_left"] == 0
    assert not summary["hal_left"]
    assert not hal_in_use()
    assert summary["override_max"] <= 1.0
    # never faster than programmed, but for the joint of helix and circle, where its planner blends both
    assert summary["feed_over_programmed_max"] < 1.02
    return summary


def test_the_torque_is_held(tmp_path, result):
    """Time and greatest torque within 5 % of our own loop; the feed is override times programmed feed."""
    found = played(tmp_path, result)
    real, simulated = found["linuxcnc"], found["simulated"]
    assert real["time_s"] == pytest.approx(simulated["time_s"], rel=0.05)
    assert real["torque_nm_max"] == pytest.approx(simulated["torque_nm_max"], rel=0.05)
    assert real["torque_nm_max"] <= 1.05 * found["torque_limit_nm"]
    # 40 mm/s, and the three pins are not read at once where the machine is busy
    assert real["away_mm_max"] < 0.3
    follows = found["follows"]
    assert follows["steady_steps"] > 300
    assert follows["steady_within_1_percent"] > 0.95
    # the same from places alone, over half a second each
    assert follows["place_error_mean"] < 0.02


def test_a_controller_that_hangs_leaves_it_stopped(tmp_path, result):
    killed = played(tmp_path, result, "--lost", "stop", "--kill-at", "260", "--hang")["killed"]
    assert 0.2 < killed["override_before"] < 0.95
    assert killed["feed_after_mm_s"] == [0.0, 0.0]
    assert killed["override_after"] == [0.0, 0.0]
    assert killed["moved_after_mm"] == 0.0
    assert killed["feed_over_programmed_max"] < 0.97


def test_a_killed_controller_leaves_it_at_the_programmed_feed(tmp_path, result):
    found = played(tmp_path, result, "--lost", "programmed", "--kill-at", "260")
    killed = found["killed"]
    assert 0.2 < killed["override_before"] < 0.95
    assert killed["override_after"] == [1.0, 1.0]
    # at the joints of the helix its planner slows by a little
    slowest, fastest = killed["feed_after_mm_s"]
    assert fastest == pytest.approx(found["programmed_mm_s"], rel=0.002)
    assert slowest > 0.9 * found["programmed_mm_s"]
    assert killed["moved_after_mm"] > 5.0


def test_a_stop_outlives_its_controller(tmp_path, result):
    """The controller has stopped the machine for an overload: its death does not release it, whatever is configured."""
    killed = played(tmp_path, result, "--lost", "programmed", "--overload-nm", "0.197", "--kill-stopped")["killed"]
    assert killed["override_before"] == 0.0
    assert killed["override_after"] == [0.0, 0.0]
    assert killed["moved_after_mm"] == 0.0


@pytest.mark.parametrize(("fault", "reason"), [("lost", "no-reading"), ("nan", "no-reading"), ("stuck", "no-reading")])
def test_a_sensor_that_fails_stops_it(tmp_path, result, fault, reason):
    """Current and speed on pins of a simulated spindle; it fails in the cut: the machine stops, nothing is exceeded."""
    found = played(tmp_path, result, "--fault", fault, "--seconds", "30")["fault"]
    assert found["status_after"] == reason
    assert found["stopped_after_s"] < 4.0
    assert found["torque_over_limit_max_after"] < 1.05


@pytest.mark.parametrize(("fault", "most"), [("drift-up", 1.0), ("drift-down", 1.25)])
def test_a_sensor_that_drifts_is_not_seen(tmp_path, result, fault, most):
    """0.1 A are 16 % of the limit: upwards it is slower, downwards the torque is as much too great."""
    found = played(tmp_path, result, "--fault", fault, "--seconds", "60")["fault"]
    assert found["stopped_after_s"] is None
    assert found["torque_over_limit_max_after"] < most


def test_numbers_through_the_pins():
    """What is sent is on the pins and signals, what is on the signals comes back; a value that is none is refused."""
    with HalPins("probe") as pins:
        for name, value in (("x", 1.5), ("y", -2.25), ("z", 1e-9), ("velocity", 24.0), ("torque-in", 0.7)):
            subprocess.run(["halcmd", "sets", f"probe-{name}", repr(value)], check=True, capture_output=True)
        seen = pins.exchange(0.625, True, 0.5, 3, 12.5, 1.0)
        assert seen is not None
        assert seen[1:6] == (1.5, -2.25, 1e-9, 24.0, 0.7)

        def said(kind, name):
            done = subprocess.run(["halcmd", kind, name], check=True, capture_output=True, text=True)
            return done.stdout.strip()

        assert said("gets", "probe-feed") == "0.625"
        assert said("gets", "probe-beat") == "TRUE"
        assert said("getp", "probe.status") == "3"
        assert said("getp", "probe.s") == "12.5"
        assert pins.exchange(math.nan, False, 0.5, 3, 12.5, 1.0) is None
        # the beat that came with it has not arrived
        assert said("gets", "probe-beat") == "TRUE"
        assert said("gets", "probe-feed") == "0.625"
