"""A text that is not that of the simulated program is found, by place and line."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.errors import Severity
from chipload.machine.machine import machine_named
from chipload.program.build import helix, plunge, rapid, retract
from chipload.program.gcode.writer import write_gcode
from chipload.program.program import Program
from chipload.program.read_back import text_findings
from chipload.program.release import NOT_SIMULATED

LEFT = Cutter(8.0, 3, math.radians(30.0), 20.0, 28.0, 5.8e5, number=3, left_hand=True)
MACHINES = ("vmc", "vmc-fanuc")


def planned() -> Program:
    return Program.join(
        [
            rapid([[3.0, 0.0, 5.0], [3.0, 0.0, 1.0]], -400.0, 3, "link"),
            helix((3.0, 0.0), (0.0, 0.0), (1.0, -2.0), 0.5, 10.0, -400.0, 3, "entry"),
            plunge([[20.0, 1.23456789, -2.0], [20.0, 9.0, -2.0]], 12.0, -400.0, 3, "finish"),
            retract([20.0, 9.0, 5.0], -400.0, 3, "link"),
        ]
    )


def written(name: str) -> str:
    return write_gcode(planned(), machine_named(name), title="part", release=NOT_SIMULATED)


def found(name: str, text: str):
    return text_findings(text, "part.ngc", machine_named(name), {3: LEFT}, planned())


@pytest.mark.parametrize("name", MACHINES)
def test_the_text_of_a_program_is_that_program(name: str) -> None:
    assert " M4" in written(name)
    assert found(name, written(name)) == ()


CHANGES = {
    "spindle": (" M4", " M3", "spindle-reversed"),
    "place": ("Y9", "Y9.02", "text-differs"),
    "rapid": ("G1 X20", "G0 X20", "text-differs"),
    "tool": ("T3 M6", "T4 M6", None),
    "speed": ("S3819.719", "S1900", "text-differs"),
    "centre": ("I-3 J0", "I-3.5 J0", None),
    "end": ("\nM5\n", "\nG1 X40 Y40 F100\nM5\n", "text-differs"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_text_is_found(change: str) -> None:
    old, new, code = CHANGES[change]
    text = written("vmc")
    assert old in text
    codes = {f.code: f for f in found("vmc", text.replace(old, new, 1))}
    assert codes, "nothing is found"
    if code is not None:
        assert codes[code].severity is Severity.EXCEEDS


def test_the_line_and_place_of_a_difference() -> None:
    text = written("vmc").replace("Y9", "Y9.02", 1)
    (only,) = found("vmc", text)
    line = text.splitlines()[only.line - 1]
    assert "Y9.02" in line
    assert only.place is not None
    np.testing.assert_allclose(only.place, (20.0, 9.0, -2.0))
