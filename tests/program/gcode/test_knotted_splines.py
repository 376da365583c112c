"""G6.2 against closed forms: a quarter circle by a rational parabola, a cubic by its polynomial; what is refused."""

import re
from pathlib import Path

import numpy as np
import pytest

from chipload.errors import InputError, Severity
from chipload.machine.machine import machine_named
from chipload.program.read import read_program

HALF = 0.7071067811865476


def read(folder: Path, body: str, name: str = "part.ngc", **options):
    text = f"G21 G90 S600 M3\nG0 X10 Y0 Z5\nG1 Z0 F300\n{body}\nG1 X0 Y10 Z0\nM30\n"
    # without a point X10 is 10 um on a Fanuc
    (folder / name).write_text(re.sub(r"([XYZRK]-?[0-9]+)(?![0-9.])", r"\1.", text))
    return read_program(folder / name, machine_named("vmc"), **options)


def gaps(reading):
    return [(f.code, f.line) for f in reading.findings if f.severity is Severity.UNPROVEN]


QUARTER = f"G6.2 P3 K0 X10 Y0 R1\nK0 X10 Y10 R{HALF}\nK0 X0 Y10 R1\nK1\nK1\nK1"


@pytest.mark.parametrize("control", ["linuxcnc", "fanuc"])
def test_a_quarter_circle(tmp_path: Path, control):
    reading = read(tmp_path, QUARTER, dialect=control)
    ends = reading.program.p_work[1:-1]
    np.testing.assert_allclose(np.hypot(ends[:, 0], ends[:, 1]), 10.0, atol=1e-9)
    assert ends[-1, :2].tolist() == [0.0, 10.0]
    length = np.linalg.norm(np.diff(ends[:, :2], axis=0), axis=1).sum()
    assert length == pytest.approx(5.0 * np.pi, abs=2e-3)
    assert gaps(reading) == []


def test_a_cubic_in_space(tmp_path: Path):
    """Bezier: (1-t)^3 p0 + 3 (1-t)^2 t p1 + 3 (1-t) t^2 p2 + t^3 p3; Z of a point that states none is that before."""
    p = np.array([[10, 0, 0], [10, 6, -3], [4, 10, -3], [0, 10, 0]], dtype=float)
    body = "G6.2 X10 Y0 Z0 K0\nX10 Y6 Z-3 K0\nX4 Y10 K0\nX0 Y10 Z0 K0\nG6.2 K1\nG6.2 K1\nG6.2 K1\nG6.2 K1"
    ends = read(tmp_path, body).program.p_work[1:-1]
    t = np.linspace(0.0, 1.0, 20001)[:, None]
    curve = (1 - t) ** 3 * p[0] + 3 * (1 - t) ** 2 * t * p[1] + 3 * (1 - t) * t**2 * p[2] + t**3 * p[3]
    away = [np.linalg.norm(curve - end, axis=1).min() for end in ends]
    assert len(ends) > 8
    assert max(away) < 1e-3


@pytest.mark.parametrize(
    ("body", "lines"),
    [
        (QUARTER.removesuffix("\nK1\nK1"), [8]),
        (QUARTER.replace("K0 X10 Y10", "X10 Y10"), [5]),
        (QUARTER.replace("X10 Y0 R1", "X10 Y3 R1"), [9]),
    ],
    ids=["a knot is missing", "a point without a knot", "it begins elsewhere"],
)
def test_a_curve_that_cannot_be_read_is_left_out(tmp_path: Path, body, lines):
    reading = read(tmp_path, body)
    assert [line for _, line in gaps(reading)][: len(lines)] == lines
    assert reading.program.p_work[-1].tolist() == [0.0, 10.0, 0.0]


def test_linuxcnc_2_9_does_not_have_it(tmp_path: Path):
    with pytest.raises(InputError, match=r"G6\.2: is not a code of LinuxCNC 2\.9"):
        read(tmp_path, QUARTER, strict=True)
