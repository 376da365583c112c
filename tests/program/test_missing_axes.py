"""A program that moves an axis which its machine does not have: the axis is held, all other motions are read."""

from pathlib import Path

import numpy as np
import pytest

from chipload.errors import Severity
from chipload.machine.machine import machine_named
from chipload.program.read import read_program

VMC = machine_named("vmc")


@pytest.mark.parametrize(("letter", "first", "motions"), [("A", 5, 2), ("U", 5, 2), ("W", 5, 2)])
def test_the_rest_is_read_and_the_axis_is_named(tmp_path: Path, letter, first, motions):
    path = tmp_path / "part.ngc"
    path.write_text(f"G21 G90 S600 M3 F300\nG0 X0 Y0 Z5\nG1 Z-1\nX10\n{letter}30\nX20\nG1 X30 {letter}0\nG0 Z5\nM2\n")
    reading = read_program(path, VMC)
    gaps = [f for f in reading.findings if f.severity is Severity.UNPROVEN]
    assert [(f.code, f.line) for f in gaps] == [("machine-axis-missing", first)]
    assert f"{letter} is held at 0 ({motions} motions, the first in line {first})" in gaps[0].text
    ends = reading.program.p_work[reading.program.line != first]
    np.testing.assert_allclose(ends[:, 0], [0.0, 0.0, 10.0, 20.0, 30.0, 30.0])
    np.testing.assert_allclose(ends[:, 2], [5.0, -1.0, -1.0, -1.0, -1.0, 5.0])
    assert np.isfinite(reading.seconds).all()


def test_an_axis_that_stands_off_zero_from_the_first_motion_on(tmp_path: Path):
    path = tmp_path / "part.ngc"
    path.write_text("G21 G90 S600 M3 F300\nG0 X0 Y0 Z5 A90\nG1 X10\nM2\n")
    (gap,) = (f for f in read_program(path, VMC).findings if f.severity is Severity.UNPROVEN)
    assert (gap.code, gap.line) == ("machine-axis-missing", 2)


def test_an_axis_that_stays_at_zero_is_no_gap(tmp_path: Path):
    path = tmp_path / "part.ngc"
    path.write_text("G21 G90 S600 M3 F300\nG0 X0 Y0 Z5 A0\nG1 X10 A0\nM2\n")
    assert all(f.severity is Severity.NOTE for f in read_program(path, VMC).findings)
