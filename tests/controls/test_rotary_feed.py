"""Time of a cut on which a rotary axis moves, by control. Oracle: closed forms."""

import math
from pathlib import Path

import pytest

from chipload.machine.machine import machine_named
from chipload.program.read import line_times, read_program
from control_texts import codes, minutes, read


@pytest.mark.parametrize(
    ("control", "settings", "block", "time"),
    [
        ("fanuc", {}, "G1 X50. A720. F500.", math.hypot(50, 720) / 500),
        ("fanuc", {}, "G1 A360. F360.", 1.0),
        ("mazak", {}, "G1 X30. Y40. A120. F130.", 1.0),
        ("linuxcnc", {}, "G1 X50. A720. F500.", 0.1),
        ("linuxcnc", {}, "G1 A360. F360.", 1.0),
        ("grbl", {}, "G1 X50. A720. F500.", math.hypot(50, 720) / 500),
        ("haas", {"rotary_diameter_mm": 100.0}, "G1 X50. A720. F500.", math.hypot(50, 200 * math.pi) / 500),
        ("haas", {"rotary_diameter_mm": 50.0}, "G1 A360. F500.", 50 * math.pi / 500),
    ],
)
def test_the_time_of_a_turn(control, settings, block, time):
    commands, findings = read(block, control, settings=settings)
    assert minutes(commands) == pytest.approx(time)
    assert findings == []


def test_inches_and_degrees():
    commands, _ = read("G20\nG1 X3. A4. F5.")
    assert minutes(commands) == pytest.approx(1.0)


def test_the_diameter_of_a_haas_is_asked_for():
    assert codes(read("G1 X50. A720. F500.", "haas")[1]) == ["nc-rotary-diameter"]


@pytest.mark.parametrize("position", ["X10. Y5. Z40.", "X0. Y0. Z0.", "X0. Y0. Z80."])
@pytest.mark.parametrize(
    ("machine", "letter"),
    [("horizontal-b", "B"), ("xyzac-trunnion", "C"), ("xyzbc-trunnion", "C"), ("xyzac-trunnion", "A")],
)
def test_a_turn_takes_its_time_wherever_the_tool_stands(tmp_path: Path, machine, letter, position):
    """90 deg at 90 deg/min and, about an axis without limits, a full turn: 1 min each."""
    path, on = tmp_path / "part.nc", machine_named(machine)
    for angle in (30.0, 360.0) if letter != "A" else (30.0,):
        path.write_text(f"G21 G90 G17 G94 G54\nS3000 M3\nG0 {position} {letter}0.\nG1 {letter}{angle} F{angle}\nM30\n")
        for control in ("linuxcnc", "fanuc"):
            _, seconds = line_times(read_program(path, on, dialect=control), on)
            # and what it takes to gather speed
            assert seconds.sum() / 60.0 == pytest.approx(1.0, abs=2e-3)


def test_a_block_without_an_end_is_a_finding(tmp_path: Path):
    (tmp_path / "part.nc").write_text("G21 G90 G17 G94 G54\nS3000 M3\nG0 X0. Y0. Z5.\nG1 X200. F0.001\nM30\n")
    reading = read_program(tmp_path / "part.nc", machine_named("vmc"), dialect="fanuc")
    assert [f.line for f in reading.findings if f.code == "nc-block-time"] == [4]
