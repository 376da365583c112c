"""Numbers without a decimal point and dwells: pairs of the controls' manuals, as data.

Oracle: Fanuc parameter 3401 (least increment 0.001 mm, 0.0001 in, 0.001 deg), Haas pages on decimal points (F10 is
.0100 mm/min or .0010 in/min), G04 in each manual.
"""

import pytest

from control_texts import HEAD, codes, dwells, ends, minutes, read

INCH = HEAD.replace("G21", "G20")


@pytest.mark.parametrize(
    ("control", "block", "seconds"),
    [
        ("fanuc", "G4 P500", 0.5),
        ("fanuc", "G4 X2.", 2.0),
        ("fanuc", "G4 U1.5", 1.5),
        ("mazak", "G4 P500", 0.5),
        ("haas", "G4 P10.", 10.0),
        ("haas", "G4 P10", 0.01),
        ("haas", "G4 P2.", 2.0),
        ("brother", "G4 P2.", 2.0),
        ("okuma", "G4 F2.", 2.0),
        ("linuxcnc", "G4 P2", 2.0),
        ("grbl", "G4 P0.5", 0.5),
    ],
)
def test_a_dwell(control, block, seconds):
    # G54 is a tool length on an Okuma
    commands, findings = read(block, control, head=HEAD.replace(" G54", ""))
    assert (dwells(commands), findings) == ([pytest.approx(seconds)], [])


@pytest.mark.parametrize(
    ("control", "word", "seconds"), [("fanuc", "P500", 0.5), ("haas", "P0.3", 0.3), ("haas", "P300", 0.3)]
)
def test_a_dwell_in_a_cycle(control, word, seconds):
    commands, findings = read(f"G82 X10. Z-2. R2. {word} F100.\nX20.\nG80", control)
    assert (dwells(commands), findings) == ([seconds, seconds], [])


def test_a_dwell_of_milliseconds_with_a_point_is_asked_for():
    _, findings = read("G4 P0.5")
    assert codes(findings) == ["nc-dwell-point"]
    commands, findings = read("G4 P0.5", settings={"dwell_s": 1.0})
    assert (dwells(commands), findings) == ([0.5], [])


@pytest.mark.parametrize(
    ("control", "head", "block", "axis", "value"),
    [
        ("fanuc", HEAD, "X1000", 0, 1.0),
        ("fanuc", INCH, "X10000", 0, 25.4),
        ("haas", HEAD, "Z-2500", 2, -2.5),
        ("mitsubishi", HEAD, "Y1000", 1, 1.0),
        ("linuxcnc", HEAD, "X10", 0, 10.0),
    ],
)
def test_a_coordinate_without_a_point(control, head, block, axis, value):
    commands, findings = read(block, control, head=head)
    assert ends(commands)[-1, axis] == pytest.approx(value)
    assert codes(findings) == ([] if control == "linuxcnc" else ["nc-no-point"])


def test_a_stated_point_rule_is_no_finding():
    for point, value in (("increment", 0.01), ("whole", 10.0)):
        commands, findings = read("X10", settings={"point": point})
        assert (ends(commands)[-1, 0], findings) == (value, [])


def test_a_text_that_never_writes_a_point_counts_whole_units():
    commands, findings = read("X10\nY2.5", head="G21 G90 G0 X0 Y0 Z10\n")
    assert ends(commands)[-1].tolist() == [10, 2.5, 10]
    assert codes(findings) == ["nc-no-point"]


def test_pecks_without_a_point():
    """27 mm in pecks of 5 mm: six."""
    commands, findings = read("G83 X10. Z-25. R2. Q5000 F100.\nX20.\nG80")
    feeds = commands.position[commands.feed > 0.0, 2]
    assert feeds[:6].tolist() == pytest.approx([-3, -8, -13, -18, -23, -25])
    assert len(feeds) == 12
    assert set(codes(findings)) == {"nc-no-point"}


def test_counts_have_no_point():
    commands, findings = read(
        "G81 X10. Z-2. R2. K0 F100.\nG91 X5. K2\nG90 G80\nM98 P20007\nM30\nO7\nG91 G0 X1.\nG90\nM99"
    )
    assert findings == []
    assert ends(commands)[-1, 0] == 12.0


def test_the_feed_of_a_haas():
    """Setting 77 as delivered: F10 is 0.01 mm/min."""
    commands, findings = read("G1 X1. F10", "haas")
    assert minutes(commands) == pytest.approx(100.0)
    assert codes(findings) == ["nc-no-point"]
    commands, findings = read("G1 X1. F10", "haas", settings={"feed_point": "whole"})
    assert (minutes(commands), findings) == (pytest.approx(0.1), [])
    commands, findings = read("G1 X1. F10.", "haas")
    assert (minutes(commands), findings) == (pytest.approx(0.1), [])
