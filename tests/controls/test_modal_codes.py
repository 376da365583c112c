"""G80, codes that act once, repeated codes: modal groups of the ISO family (Fanuc, Haas) and of LinuxCNC.

Oracle: the group lists of the controls' manuals (G80 in group 09, G28 in group 00), positions by hand.
"""

import pytest

from chipload.errors import InputError
from chipload.program.commands import LINE, RAPID
from chipload.program.gcode.reader import read_gcode
from control_texts import HEAD, codes, ends, read

ISO = ("fanuc", "haas", "mazak", "mitsubishi", "brother")


@pytest.mark.parametrize("control", ISO)
def test_g80_leaves_the_code_of_group_01(control):
    commands, findings = read("G0 X5.\nG98 G81 X10. Z-5. R2. F100.\nX20.\nG80\nZ15.\nG1 X0. F50.\nG80\nX3.", control)
    assert findings == []
    assert commands.motion[-3:].tolist() == [RAPID, LINE, LINE]
    assert ends(commands)[-3:].tolist() == [[20, 0, 15], [0, 0, 15], [3, 0, 15]]


def test_g80_with_axes_moves_by_group_01():
    commands, findings = read("G81 X10. Z-5. R2. F100.\nG80 Z20.")
    assert findings == []
    assert (commands.motion[-1], ends(commands)[-1].tolist()) == (RAPID, [10, 0, 20])


def test_a_code_of_group_01_ends_a_cycle():
    commands, findings = read("G81 X10. Z-5. R2. F100.\nG0 X30.\nX40.")
    assert findings == []
    assert ends(commands)[-2:].tolist() == [[30, 0, 10], [40, 0, 10]]


def test_linuxcnc_needs_a_code_of_motion_behind_g80():
    with pytest.raises(InputError, match="no code that moves them is active"):
        read_gcode("G21 G90 G0 X0 Y0 Z5\nG81 X1 Z-1 R1 F60\nG80\nZ5\nM2")


@pytest.mark.parametrize("block", ["G0 G91 G28 Z0.", "G91 G0 G28 Z0.", "G91 G28 G0 Z0."])
def test_a_code_that_acts_once_beside_g0(block):
    """G28 acts in its block, G91 and G0 stay."""
    origins = {1: ((0.0,) * 9, 0.0)}
    commands, findings = read(f"G1 X5. F100.\n{block}\nX2.", origins=origins)
    assert findings == []
    # to the machine's origin along Z, then by G0 and G91
    assert ends(commands)[-2:].tolist() == [[5, 0, 0], [7, 0, 0]]
    assert commands.motion[-1] == RAPID


def test_the_last_code_of_a_group_counts():
    commands, findings = read("G0 G1 X5. F100.")
    assert (findings, commands.motion[-1]) == ([], LINE)


@pytest.mark.parametrize("control", ISO)
def test_a_bore_and_a_counterbore_need_no_dwell(control):
    for code in ("G86", "G82", "G89"):
        commands, findings = read(f"{code} X30. Z-20. R2. F50.\nG80", control)
        # G89 goes out at its feed to R, then at rapid
        assert (findings, ends(commands)[-3 if code == "G89" else -2].tolist()) == ([], [30, 0, -20])


def test_a_block_that_cannot_be_read_is_a_finding_and_the_rest_is_read():
    commands, findings = read("X1.\nG2 X5. I0. J0.\nX2.\nG1 X(3\nG0 X4.")
    assert ends(commands)[1:, 0].tolist() == [1, 2, 4]
    assert [(f.code, f.line) for f in findings] == [("nc-not-read", 6), ("nc-not-read", 8)]


def test_numbers_of_variables_have_no_end():
    """#13001 of a Fanuc is the radius of offset 1; a number that nothing holds is a finding."""
    commands, findings = read("#13001=4.\nG41 D1 G1 X10. Y20. F100.\nY40.\nG40 X0.")
    assert findings == []
    assert ends(commands)[1:3].tolist() == [[6, 20, 10], [6, 40, 10]]
    _, findings = read("G0 X#17000")
    assert codes(findings) == ["nc-parameter-unset"]


@pytest.mark.parametrize(
    ("control", "start", "sense"), [("fanuc", "G84", 1), ("haas", "G84", 1), ("haas", "G74", -1), ("brother", "G84", 1)]
)
def test_tapping_starts_its_spindle(control, start, sense):
    head = HEAD.replace(" M3", "")
    for more in ("", "M29 S1000\n"):
        commands, findings = read(f"{more}{start} X25. Z-16. R4. F800.\nG80\nG0 X0.", control, head=head)
        down = commands.motion == LINE
        assert findings == []
        assert (commands.spindle[down][0] > 0.0) == (sense > 0)
        assert commands.spindle[-1] == 0.0


def test_only_a_haas_starts_the_spindle_to_drill():
    head = HEAD.replace(" M3", "")
    for control, turns in (("haas", True), ("fanuc", False)):
        commands, _ = read("G81 X25. Z-16. R4. F800.\nG80", control, head=head)
        assert (commands.spindle[commands.motion == LINE][0] > 0.0) == turns
