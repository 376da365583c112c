"""Programs of macro statements and calls, and cycles that follow one another. Oracle: points and times by hand."""

import math

import pytest

from chipload.program.commands import DWELL, LINE
from control_texts import HEAD, codes, ends, minutes, read


def test_a_vacant_value_clears_a_variable():
    commands, findings = read("#1=5\n#1=#0\nIF[#1EQ#0]GOTO5\nX99.\nN5 G1 X[#0+3.] F100.")
    assert findings == []
    assert ends(commands)[-1].tolist() == [3, 0, 10]


def test_another_cycle_takes_r_and_the_bottom():
    """R, Z and P last until G80; Q of pecks is for pecks alone."""
    commands, findings = read("G83 X10. Z-5. R2. Q3. F100.\nG81 X20.\nG89 X30. P500\nG86 X40.\nG80")
    assert findings == []
    cuts = commands.motion == LINE
    assert [commands.position[cuts & (commands.line == line), 2].round(9).tolist() for line in (5, 6, 7, 8)] == [
        [-1.0, -4.0, -5.0],
        [-5.0],
        [-5.0, 2.0],
        [-5.0],
    ]
    assert commands.feed[(commands.motion == DWELL) & (commands.line >= 7)].tolist() == [0.5, 0.5]


def test_linuxcnc_asks_for_r_of_each_cycle():
    _, findings = read("G98 G81 X10 Z-5 R2 F100\nG85 X20\nG80", "linuxcnc", head="G21 G90 G0 X0 Y0 Z10\n")
    assert [("R is missing" in f.text) for f in findings] == [True]


@pytest.mark.parametrize("control", ["fanuc", "haas"])
def test_a_subprogram_returns_to_a_block(control):
    body = "M98 P100\nN5 G1 X5. F100.\nN9 G1 X9. F100.\nM30\nO100\nM99 P9"
    commands, findings = read(body, control)
    assert findings == []
    assert ends(commands)[1:].tolist() == [[9, 0, 10]]


def test_a_jump_of_the_main_program():
    commands, findings = read("G1 X1. F100.\nM99 P9\nX99.\nN9 G1 X9.")
    assert findings == []
    assert ends(commands)[1:, 0].tolist() == [1, 9]


def test_taps_go_in_by_pecks():
    """5 to -10 by 4: three pecks of 4, back by 0.254 mm each, and the rest of 3."""
    commands, findings = read("M29 S500\nG84 X10. Z-10. R5. Q4. F625.\nG80")
    assert findings == []
    cuts = commands.motion == LINE
    assert commands.position[cuts, 2].round(9).tolist() == [1, 1.254, -3, -2.746, -7, -6.746, -10, 5]
    assert minutes(commands) == pytest.approx((15 + 15 + 6 * 0.254) / 625)
    assert commands.spindle[cuts].tolist() == pytest.approx([52.359878 * s for s in (1, -1, 1, -1, 1, -1, 1, -1)])


def test_a_haas_turns_the_spindle_for_its_tap():
    commands, findings = read("G74 X10. Z-10. R2. J2 F1250.\nG80", "haas")
    assert findings == []
    cuts = commands.motion == LINE
    assert commands.spindle[cuts].tolist() == pytest.approx([-104.719755, 104.719755])


@pytest.mark.parametrize(("control", "words"), [("haas", "Q2. K6."), ("okuma", "I2. J6.")], ids=["haas", "okuma"])
def test_pecks_that_lift_the_drill_after_a_depth(control, words):
    """From R = 2 by 2: at -4, 6 below R, the drill goes out to R, before and behind it only back."""
    commands, findings = read(f"G73 X10. Z-10. R2. {words} F100.\nG80", control, head=HEAD.replace("G54", ""))
    assert findings == []
    rows = commands.line == 5
    z = commands.position[rows & (commands.motion != LINE), 2].round(9).tolist()
    assert z[2:-1] == [0.254, -1.746, 2, -3.746, -5.746, -7.746]


def test_origins_are_variables():
    """An assignment moves the work offset that is active: the machine goes to the origin plus X."""
    commands, findings = read("#5221=5.\nG1 X10. F100.\n#14001=3.\nG54.1 P1\nG1 X10.\n#1=#7001\nY#1")
    assert findings == []
    origins = [commands.frames[k].offset[0] for k in commands.frame]
    assert [x + o for x, o in zip(commands.position[1:, 0], origins[1:], strict=True)] == [15, 13, 13]
    assert commands.position[-1, 1] == 3


def test_g10_in_g91_moves_an_origin():
    commands, findings = read(
        "G10 L2 P1 X5.\nG91 G10 L2 P1 X2.\nG90 G1 X0. F100.\nG10 L20 P1 X4.\nG91 G10 L20 P1 X3.\nG90 G54.1 P1 X0."
    )
    assert findings == []
    assert [commands.frames[k].offset[0] for k in commands.frame[1:]] == [7, 7]


def test_further_work_offsets_of_a_haas():
    commands, findings = read("G10 L20 P2 X7.\nG111 G1 X0. F100.\nG154 P2 X1.", "haas")
    assert findings == []
    assert [commands.frames[k].offset[0] for k in commands.frame[1:]] == [7, 7]


def test_programs_of_a_probe():
    """A guarded way moves, a measurement leaves what it stores open, a switch does nothing."""
    commands, findings = read("G65 P9832\nG65 P9810 X5. Z5. F3000.\nG65 P9833\nG0 X1.", "haas")
    assert findings == []
    assert ends(commands)[1:].tolist() == [[5, 0, 5], [1, 0, 5]]
    _, findings = read("G65 P9811 X10. S2", "fanuc")
    assert codes(findings) == ["nc-probe"]


def test_a_home_position_of_an_okuma_is_a_retraction():
    _, findings = read("G30 P1\nG0 X5.", "okuma", head=HEAD.replace("G54", ""))
    assert findings == []


def test_accuracy_of_a_mazak_is_no_corner():
    commands, findings = read("G61.1 ,R1\nG1 X10. ,R2. F100.\nY10.", "mazak")
    assert findings == []
    assert ends(commands)[-2:].tolist() == [[10, 2, 10], [10, 10, 10]]
    _, findings = read("G61.1 ,K1\nG1 X10. F100.", "fanuc")
    assert codes(findings) == ["nc-not-read"]


@pytest.mark.parametrize("loop", ["WHILE[#1LT3]DO1", "DO1"])
def test_a_loop_that_does_not_end_is_a_finding(loop):
    commands, findings = read(f"#1=0\n{loop}\nG1 X5. F100.\n#1=#1+1\nG0 X7.")
    assert [(f.line, f.text.startswith("DO1: END1 is missing")) for f in findings] == [(6, True)]
    assert ends(commands)[-1].tolist() == [7, 0, 10]


def test_a_block_of_its_own_text_that_a_mitsubishi_calls():
    body = "M98 H100 L3\nG90 G1 X20. F500\nM30\nN100 G91 G1 X1. F500\nM99"
    commands, findings = read(body, "mitsubishi")
    assert findings == []
    assert ends(commands)[1:, 0].tolist() == [1, 2, 3, 20]
    assert minutes(commands) == pytest.approx(20.0 / 500.0)
    assert codes(read("M98 P200 H100\nM30\nO200\nN100 X1.\nM99", "mitsubishi")[1]) == ["nc-not-read"]


def test_a_named_subprogram_of_an_okuma_is_called_once():
    body = "CALL OCIRC DEP=4. PX=50.\nM2\nOCIRC\nG0 X=PX\nG1 Z=-DEP F200\nG3 I-10. F400\nRTS"
    commands, findings = read(body, "okuma", head=HEAD.replace("G54", "G15 H1"))
    assert findings == []
    assert ends(commands)[1:].tolist() == [[50, 0, 10], [50, 0, -4], [50, 0, -4]]
    assert minutes(commands) == pytest.approx(14.0 / 200.0 + math.tau * 10.0 / 400.0)
