"""Hole patterns and circular pockets of a Haas. Oracle: closed forms of the holes and of the circles."""

import math

import numpy as np
import pytest

from chipload.program.commands import ARC
from control_texts import codes, dwells, ends, minutes, read


def holes(body):
    commands, findings = read(body, "haas")
    assert findings == []
    at = ends(commands)
    return at[at[:, 2] == -5.0][:, :2]


def ring(radius, degrees):
    angles = np.radians(degrees)
    return radius * np.column_stack([np.cos(angles), np.sin(angles)]) + (10.0, 20.0)


@pytest.mark.parametrize(
    ("pattern", "expected"),
    [
        ("G70 I25. J15. L4", ring(25.0, [15, 105, 195, 285])),
        ("G71 I25. J15. K30. L3", ring(25.0, [15, 45, 75])),
        ("G72 I8. J90. L3", np.array([[10, 20], [10, 28], [10, 36]])),
    ],
)
def test_a_pattern_of_holes(pattern, expected):
    found = holes(f"G0 X10. Y20.\nG81 Z-5. R2. F100. L0\n{pattern}\nG80")
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_pattern_needs_a_cycle():
    _, findings = read("G70 I25. J15. L4", "haas")
    assert [(f.code, "active cycle" in f.text) for f in findings] == [("nc-not-read", True)]


@pytest.mark.parametrize(("code", "sense"), [("G12", -1), ("G13", 1)])
def test_a_circular_pocket(code, sense):
    """Circles of 6, 8 and 10 mm less the radius of 4 mm; half circles of half the least and the greatest."""
    commands, findings = read(f"#2401=8.\nG0 X30. Y5.\nG1 Z0. F100.\n{code} Z-3. I6. K10. Q2. D1 F200.", "haas")
    assert findings == []
    arcs = commands.motion == ARC
    assert (np.sign(commands.turns[arcs]) == sense).all()
    x = commands.position[arcs, 0] - 30.0
    assert x.tolist() == pytest.approx([2, 2, 4, 6, 0])
    length = math.pi * 1 + 2 * math.pi * (2 + 4 + 6) + 2 + 2 + math.pi * 3
    cuts = commands.line >= 8
    assert minutes(commands) == pytest.approx((10.0 / 100.0) + (3.0 + length) / 200.0)
    assert cuts.sum() == 8
    assert ends(commands)[-1].tolist() == [30, 5, -3]


def test_a_circle_smaller_than_the_cutter_is_not_read():
    _, findings = read("#2401=20.\nG13 Z-3. I6. D1 F200.", "haas")
    assert [(f.code, "must be above the cutter's radius 10 mm" in f.text) for f in findings] == [("nc-not-read", True)]


def test_pocket_milling_and_engraving_are_findings():
    commands, findings = read("G150 P100 Z-3. D1 I3. Q1. K0.2 F100.\nG47 P0 X5. Y5. I0. J5. R1. Z-1. F50.\nX7.", "haas")
    assert codes(findings) == ["nc-not-read", "nc-not-read"]
    assert ends(commands)[-1].tolist() == [7, 0, 10]


@pytest.mark.parametrize(
    ("control", "text", "time"), [("haas", "P0.5", 0.5), ("fanuc", "P500", 0.5), ("haas", "", None)]
)
def test_a_pause_at_the_bottom_of_a_pecked_hole(control, text, time):
    commands, findings = read(f"G83 X5. Y0. Z-4. R2. Q3. {text} F100.\nX9.\nG80", control)
    assert findings == []
    assert dwells(commands) == ([] if time is None else [time, time])


@pytest.mark.parametrize("text", ["G13 I5. D0 F200.", "G12 I5. K9. Q2. D0 F200."])
@pytest.mark.parametrize("control", ["fanuc", "okuma"])
def test_a_fanuc_has_no_circular_pockets(control, text):
    head = "G21 G17 G90 G94\nT1 M6\nS1000 M3\nG0 X0. Y0. Z10.\n"
    commands, findings = read(f"{text}\nG1 X7. F100.", control, head=head)
    assert [f.line for f in findings] == [5]
    assert ends(commands)[-2:].tolist() == [[0, 0, 10], [7, 0, 10]]


@pytest.mark.parametrize("control", ["mitsubishi", "brother", "mazak"])
def test_other_controls_with_circular_cutting(control):
    """From the centre on a half circle of 2.5 mm radius, round, and back."""
    commands, findings = read("G13 I5. D0 F200.", control)
    assert findings == []
    assert minutes(commands) == pytest.approx(math.pi * (2.5 + 10.0 + 2.5) / 200.0)


def test_a_tap_in_step_with_the_feed_makes_no_corner():
    commands, findings = read("G84 X5. Y0. Z-8. R2. F1250. ,R1\nX9.\nG80", "mitsubishi")
    assert findings == []
    assert ends(commands)[ends(commands)[:, 2] == -8.0].tolist() == [[5, 0, -8], [9, 0, -8]]
