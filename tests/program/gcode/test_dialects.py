"""Fanuc's and Sinumerik's dialects where they differ from LinuxCNC's."""

import pytest

from chipload.errors import InputError
from chipload.program.commands import DWELL
from chipload.program.gcode.reader import read_gcode


def fanuc(text):
    return read_gcode(text, dialect="fanuc")


def sinumerik(text):
    return read_gcode(text, dialect="sinumerik")


def codes(findings):
    return [x.code for x in findings]


def test_a_fanuc_program():
    text = (
        "%\nO1234 (PART)\nG21 G17 G90 G94 G40 G49 G80\nT1 M6\nG54 G0 X0. Y0. S1000 M3\n"
        "G43 H1 Z5. M8\nG98 G81 X1. Y1. Z-3. R2. F60.\n"
    )
    text += "X2.\nG80\nG04 X2.\nG04 P500\nM98 P20007\nG49\nM30\nO0007\nG91 G0 X1.\nG90\nM99\n%"
    commands, findings = fanuc(text)
    assert commands.feed[commands.motion == DWELL].tolist() == [2.0, 0.5]
    # two calls of O7, each a step of 1 along X from 2
    assert commands.position[-2:, 0].tolist() == [3.0, 4.0]
    assert commands.position[3:7, 2].tolist() == [2.0, -3.0, 5.0, 5.0]
    assert codes(findings) == ["nc-tool-unknown", "nc-coolant"]


def test_fanuc_repeats_by_k_and_pauses_in_ms():
    commands, _ = fanuc("G91 G0 Z5.\nG82 X1. Z-2. R-1. P250 K2 F60.\nM30")
    assert commands.feed[commands.motion == DWELL].tolist() == [0.25, 0.25]


def test_fanuc_work_offsets_beyond_six():
    commands, findings = fanuc("G54.1 P12\nG0 X1.\nM30")
    assert commands.frames[commands.frame[0]].number == 21
    assert codes(findings) == ["nc-offset-unset"]


def test_fanuc_tip_control_and_look_ahead():
    commands, findings = fanuc("G5.1 Q1\nG43.4 H1\nG0 X1. A90.\nG49\nX2.\nG5.1 Q0\nM30")
    assert commands.tcp.tolist() == [True, False]
    assert "nc-ignored" in codes(findings)


def test_a_number_without_a_point_is_noted():
    _, findings = fanuc("G0 X1.\n(X1)\nG0 Y100\nM30")
    assert [(x.code, x.line) for x in findings] == [("nc-no-point", 3)]


def test_an_unknown_code_is_kept_and_its_block_does_not_move():
    commands, findings = fanuc("G0 X1.\nG123 X5.\nM777\nX2.\nM30")
    assert commands.position[:, 0].tolist() == [1.0, 2.0]
    assert codes(findings) == ["nc-unknown-word", "nc-unknown-word"]


@pytest.mark.parametrize(
    ("block", "message"),
    [
        ("G65 P9010 A1.", "G65: a macro: not read; write the moves out"),
        ("G68 X0. Y0. R30.", "G68: turned coordinates: not read; write the moves out"),
        ("G68.2 X0 Y0 Z0 I0 J0 K0", "G68.2: a tilted plane: not read; write the moves out"),
        ("G51 P2.", "G51: scaling: not read; write the moves out"),
        ("G43.5 H1", "G43.5: tip control by vectors: not read; write the moves out"),
        ("IF[#1EQ0]GOTO10", "IF[: macro statements are not read: write out what they do"),
        ("GOTO 10", "GOTO: macro statements are not read: write out what they do"),
        ("M98 P9", "M98 P9: there is no block O9 in this text"),
    ],
)
def test_fanuc_refuses(block, message):
    with pytest.raises(InputError) as caught:
        fanuc(f"{block}\nM30")
    assert str(caught.value) == f"program: line 1: {message}"


def test_a_sinumerik_program():
    text = '%_N_PART_MPF\n;$PATH=/_N_MPF_DIR\nN10 G71 G17 G90 G54 ; plane\nN20 T="MILL" M6\nN30 TRAORI\nMSG("first")\n'
    text += "S600 M3\n"
    text += (
        "R1=40\nG0 X=10 Y=IC(5) A30\nG1 X20 F=R1+20\nTRAFOOF\nR2=5*(1+1)\nG1 Y=R2\n"
        "G2 X10 Y10 CR=5\nG3 X=20 Y=10 I=AC(15) J=AC(10)\n"
    )
    text += "G4 F2\nG91 G1 X=AC(0)\nSUPA G90 G0 Z0\nFFWON\nM30"
    commands, findings = sinumerik(text)
    assert commands.tcp.tolist() == [True, True] + [False] * 6
    assert commands.position[:, :2].tolist() == [
        [10, 5],
        [20, 5],
        [20, 10],
        [10, 10],
        [20, 10],
        [20, 10],
        [0, 10],
        [0, 10],
    ]
    assert commands.centre[3:5].tolist() == [[15.0, 10.0], [15.0, 10.0]]
    assert commands.feed[5] == 2.0
    said = codes(findings)
    assert "nc-message" in said
    assert "nc-tool-unknown" in said
    assert "nc-unknown-word" not in said


@pytest.mark.parametrize(
    ("block", "message"),
    [
        (
            "CYCLE800(1,2)",
            "CYCLE800: turned or shifted frames are not read: post in the coordinates of the work offset",
        ),
        ("TRANS X10", "TRANS: turned or shifted frames are not read: post in the coordinates of the work offset"),
        ("ATRANS X10", "ATRANS: turned or shifted frames are not read: post in the coordinates of the work offset"),
        ("CYCLE83(1,2,3)", "CYCLE83(...): cycles and calls are not read: write the moves out"),
        (
            "G1 X1 A3=0 B3=0 C3=1",
            "A3: tool directions as vectors or angles to the surface are not read: post with axes",
        ),
        ("IF R1>0 GOTOF END", "IF: jumps, loops and calls are not read: write out what they do"),
        ("L100", "L100: calls a subroutine: not read; write its blocks out"),
        ("G33 Z10 K1", "G33: is not read: write the moves out"),
    ],
)
def test_sinumerik_refuses(block, message):
    with pytest.raises(InputError) as caught:
        sinumerik(f"{block}\nM30")
    assert str(caught.value) == f"program: line 1: {message}"


def test_sinumerik_keeps_unknown_words():
    commands, findings = sinumerik("G0 X1\nFOO=5 X2\nBAR\nCYCLE800()\nM30")
    assert commands.position[:, 0].tolist() == [1.0, 2.0]
    assert codes(findings) == ["nc-unknown-word", "nc-unknown-word", "nc-ignored"]
