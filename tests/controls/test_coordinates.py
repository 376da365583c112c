"""Polar, scaled and mirrored coordinates. Oracle: closed forms of each point."""

import math

import numpy as np
import pytest

from chipload.program.commands import ARC
from control_texts import ends, read


def test_polar_coordinates():
    commands, findings = read("G16\nG81 X50. Y30. Z-5. R2. F100.\nY150.\nY270.\nG15 G80\nG0 X1. Y2.")
    assert findings == []
    bottoms = ends(commands)[ends(commands)[:, 2] == -5.0][:, :2]
    angles = np.radians([30.0, 150.0, 270.0])
    np.testing.assert_allclose(bottoms, 50.0 * np.column_stack([np.cos(angles), np.sin(angles)]), atol=1e-9)
    assert ends(commands)[-1, :2].tolist() == [1, 2]


def test_scaling_about_a_point():
    commands, findings = read("G51 X10. Y0. P2000\nG1 X20. Y5. F100.\nG3 X20. Y15. R5.\nG50\nG1 X0. Y0.")
    assert findings == []
    assert ends(commands)[1:, :2].tolist() == [[30, 10], [30, 30], [0, 0]]
    assert commands.centre[commands.motion == ARC][0].tolist() == pytest.approx([30, 20])


@pytest.mark.parametrize(
    ("on", "off", "control"), [("G51.1 X10.", "G50.1 X0.", "fanuc"), ("G101 X0.", "G100 X0.", "haas")]
)
def test_a_mirror_turns_the_sense_of_arcs(on, off, control):
    commands, findings = read(f"{on}\nG1 X20. Y5. F100.\nG3 X30. Y15. I0. J10.\n{off}\nG1 X20. Y5.", control)
    assert findings == []
    edge = 20.0 if control == "fanuc" else 0.0
    assert ends(commands)[1:, :2].tolist() == [[edge - 20, 5], [edge - 30, 15], [20, 5]]
    arc = commands.motion == ARC
    assert commands.turns[arc].tolist() == [-1]
    assert commands.centre[arc][0].tolist() == [edge - 20, 15]


def test_a_mirror_turns_the_side_of_compensation():
    """Left of a path along +Y, mirrored in X: right of it."""
    body = "G51.1 X0.\nG41 D1 G1 X10. Y20. F100.\nY40.\nG40 X0.\nG50.1"
    commands, findings = read(f"#13001=4.\n{body}")
    assert findings == []
    assert ends(commands)[1:3, 0].tolist() == [-6, -6]


@pytest.mark.parametrize("rest", ["G91 Y120.\nY120.", "G91 Y120. K2", "G91 Y120.\nG90 Y270."])
def test_angles_in_g91_turn_on_about_the_pole(rest):
    """Three holes on a circle of 50 mm, 120 deg apart from 30 deg; R and Z keep their places in G91."""
    commands, findings = read(f"G16\nG81 X50. Y30. Z-5. R2. F100.\n{rest}\nG90 G15 G80\nG0 X1. Y2.")
    assert findings == []
    deep = ends(commands)[ends(commands)[:, 2] == -5.0]
    angles = np.radians([30.0, 150.0, 270.0])
    np.testing.assert_allclose(deep[:, :2], 50.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1), atol=1e-9)


@pytest.mark.parametrize(("body", "bottoms"), [
    ("G81 X10. Z-5. R2. F100.\nG91 X10. K3\nG90 X60.", 5),
    ("G91 G81 X10. Z-7. R-3. F100. K2\nG90 X60.\nX70.", 4),
])  # fmt: skip
def test_a_row_of_holes_in_g91(body, bottoms):
    """Stated in G90 or G91, R is at 2 and the bottom at -5 in each hole; the holes of K are 10 mm apart."""
    commands, findings = read(f"G0 Z5.\n{body}\nG80")
    assert findings == []
    holes = ends(commands)[ends(commands)[:, 2] == -5.0]
    assert len(holes) == bottoms
    assert ends(commands)[:, 2].min() == -5.0
    row = holes[holes[:, 0] < 55.0, 0]
    np.testing.assert_allclose(np.diff(row), 10.0)


def test_polar_coordinates_about_the_present_point_are_left_out():
    commands, findings = read("G91\nG16\nX5. Y30.\nG15\nG90\nX7.")
    assert ends(commands)[-1, 0] == 7.0
    assert [f.code for f in findings] == ["nc-left-out"]


def test_a_rotation_is_not_a_scale():
    commands, findings = read("G68 X0. Y0. R90.\nG1 X10. F100.\nG69")
    assert findings == []
    frame = commands.frames[commands.frame[-1]]
    assert math.degrees(frame.rotation) == pytest.approx(90.0)
