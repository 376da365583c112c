"""``chipload chatter``: samples on stdin, answers on stdout, and an exit code that tells whether it stopped."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload.cli import app

RATE, SPEED = 2000.0, 50.0


def samples(seconds: float, chatter: float) -> str:
    """Lines of halsampler: the torque of a cut at 50 rev/s with three teeth, and of chatter at 333 Hz beside it."""
    t = np.arange(round(seconds * RATE)) / RATE
    torque = np.sin(math.tau * 3.0 * SPEED * t) + chatter * np.sin(math.tau * 333.0 * t)
    return "".join(f"{k} {x:.6g} {SPEED}\n" for k, x in enumerate(torque))


def heard(folder: Path, text: str, windows: list[dict[str, float]], *words: str) -> tuple[int, list[str]]:
    """Exit code and lines of the command."""
    stability = {"speed_rpm": 60.0 * SPEED, "windows": windows}
    (folder / "summary.json").write_text(json.dumps({"operations": [{"stability": stability}]}))
    command = ["chatter", str(folder / "summary.json"), "--rate-hz", f"{RATE:g}", "--floor", "0.05", *words]
    done = CliRunner().invoke(app, command, input=text)
    return done.exit_code, done.stdout.splitlines()


def test_a_quiet_cut_is_left_alone(tmp_path: Path) -> None:
    assert heard(tmp_path, samples(2.0, 0.0), []) == (0, [])


@pytest.mark.parametrize("halui", [False, True])
def test_chatter_without_a_quiet_speed_stops_the_program(tmp_path: Path, halui: bool) -> None:
    code, lines = heard(tmp_path, samples(2.0, 0.6), [], *(["--halui"] if halui else []))
    assert code == 3
    assert lines[-1] == "setp halui.program.pause 1" if halui else ": stopped, " in lines[-1]


@pytest.mark.parametrize("halui", [False, True])
def test_chatter_with_a_quiet_speed_changes_the_speed(tmp_path: Path, halui: bool) -> None:
    """54 to 55 rev/s is 1.08 to 1.1 of the programmed speed. The samples end before the spindle could follow."""
    quiet = [{"low_rpm": 3240.0, "high_rpm": 3300.0}]
    code, lines = heard(tmp_path, samples(0.4, 0.6), quiet, *(["--halui"] if halui else []))
    assert code == 0
    if halui:
        name, _, counts = lines[-1].rpartition(" ")
        assert name == "setp halui.spindle.0.override.counts"
        assert 1080 <= int(counts) <= 1100
    else:
        assert len(lines) == 1
        assert "stopped" not in lines[0]


def test_a_summary_without_stability(tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text('{"operations": []}')
    done = CliRunner().invoke(app, ["chatter", str(tmp_path / "summary.json"), "--rate-hz", "2000", "--floor", "0.05"])
    assert done.exit_code == 2
    assert "summary.json: has no stability.windows: simulate the program with [dynamics] first" in done.stderr
