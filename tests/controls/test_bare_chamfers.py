"""Chamfers by C without a comma. Oracle: the closed form of the contour, and a machine that has an axis C."""

import math

import pytest

from chipload.machine.machine import machine_named
from chipload.program.gcode.bare_chamfers import has_bare_chamfers
from chipload.program.gcode.line_segments import line_forms
from chipload.program.motions import lengths
from chipload.program.read import read_program
from chipload.program.setup import Setup, StatedControl
from control_texts import codes, ends, read

CONTOUR = "G1 X50. C2. F100.\nY30. C3.\nX10.\nY5."


@pytest.mark.parametrize("control", ["fanuc", "haas", "mazak", "brother", "mitsubishi"])
def test_a_chamfer_without_a_comma(control):
    commands, findings = read(f"G0 Z0.\n{CONTOUR}", control)
    assert findings == []
    expected = [(48, 0), (50, 2), (50, 27), (47, 30), (10, 30), (10, 5)]
    assert ends(commands)[2:, :2].tolist() == [pytest.approx(p) for p in expected]


def test_a_machine_with_the_axis_takes_c_as_its_angle(tmp_path):
    """The same text: six cuts of a closed length on a mill, angles where C is an axis; nothing is refused."""
    path = tmp_path / "part.nc"
    path.write_text(f"%\nO1\nG21 G90 G17 G94\nT1 M6\nS1000 M3\nG0 X0. Y0. Z0.\n{CONTOUR}\nM30\n%\n")
    setup = Setup(control=StatedControl("fanuc"))
    mill = read_program(path, machine_named("vmc"), setup=setup)
    length = 48 + 2 * math.sqrt(2) + 25 + 3 * math.sqrt(2) + 37 + 25
    assert lengths(mill.program)[1:].sum() == pytest.approx(length)
    notes = [(f.line, f.severity.name) for f in mill.findings if f.code == "nc-bare-chamfer"]
    assert notes == [(7, "NOTE")]
    turned = read_program(path, machine_named("xyzbc-trunnion"), setup=setup)
    assert turned.commands.position[-1, 5] == pytest.approx(math.radians(3.0))
    assert "nc-bare-chamfer" not in codes(turned.findings)


@pytest.mark.parametrize(
    "text",
    [
        "G1 X50. C2.\nG0 C90.",
        "G1 X50. C2.\nC90.",
        "G1 X50. C2. B10.",
        "G1 X50. Z-2. C2.",
        "G1 X50. C-2.",
        "G2 X50. R30. C2.",
        "G65 P9810 X1. C2.",
        "G1 X50. ,C2.",
        "(C2.)",
    ],
)
def test_other_letters_c_are_none(text):
    assert not has_bare_chamfers(text)


def test_a_line_beside_a_chamfer_is_not_divided():
    forms = line_forms(f"G90 {CONTOUR}")
    assert [forms[k].reason for k in (1, 2, 3, 4)] == ["rounded corner"] * 3 + [""]
