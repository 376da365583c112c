"""Fanuc's and Sinumerik's dialects where they differ from LinuxCNC's."""

import math

import numpy as np
import pytest

from chipload.errors import InputError, Severity
from chipload.program.commands import DWELL, LINE
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
    assert codes(findings) == ["nc-tool-unknown", "nc-coolant", "nc-length-unknown"]


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
    """It may be 100 mm or 0.1 mm; 0 is 0."""
    _, findings = fanuc("G0 X1.\n(X1)\nG0 X0\nG0 Y100\nM30")
    assert [(x.code, x.line, x.severity) for x in findings] == [("nc-no-point", 4, Severity.UNPROVEN)]


def test_an_unknown_code_is_kept_and_its_block_does_not_move():
    """Nor does a block that goes on with it; a code of motion ends it."""
    commands, findings = fanuc("G0 X1.\nG123 X5.\nM777\nX2.\nG1 X3. F60.\nX4.\nM30")
    assert commands.position[:, 0].tolist() == [1.0, 3.0, 4.0]
    assert codes(findings) == ["nc-unknown-word"] * 3
    assert [(f.line, f.severity.name) for f in findings] == [(2, "UNPROVEN"), (3, "NOTE"), (4, "UNPROVEN")]


@pytest.mark.parametrize(
    ("block", "message"),
    [
        ("IF[#1EQ0]GOTO10", "GOTO 10: there is no block N10"),
        ("GOTO 10", "GOTO 10: there is no block N10"),
        ("IF[1EQ1]X5.", "'x5.': IF[...] is followed by GOTO or THEN"),
        ("WHILE[1EQ0]DO1", "DO1: END1 is missing"),
        ("END2", "END2: DO2 is missing before it"),
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
    assert commands.tcp.tolist() == [True, True] + [False] * 5
    assert commands.position[:, :2].tolist() == [
        [10, 5],
        [20, 5],
        [20, 10],
        [10, 10],
        [20, 10],
        [20, 10],
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
        ("CYCLE83(1,2,3)", "CYCLE83: RTP, RFP and DP or DPR must be given"),
        ("IF R1>0", "IF: ENDIF is missing"),
        ("ENDWHILE", "ENDWHILE has no WHILE before it"),
        ("AB: G1 X1 F1\nGOTOB AB", "more than 402 blocks: a loop does not end, or most_blocks must be raised"),
        ("G33 Z10 K1", "G33: the spindle does not turn: start it by M3 or M4"),
    ],
)
def test_sinumerik_refuses(block, message, monkeypatch):
    monkeypatch.setattr("chipload.program.gcode.reader.MOST_REPEATED", 400)
    with pytest.raises(InputError) as caught:
        sinumerik(f"{block}\nM30")
    assert str(caught.value) == f"program: line 1: {message}"


def test_sinumerik_keeps_unknown_words():
    commands, findings = sinumerik("G0 X1\nFOO=5 X2\nBAR\nCYCLE800()\nM30")
    assert commands.position[:, 0].tolist() == [1.0, 2.0]
    assert codes(findings) == ["nc-unknown-word", "nc-call", "nc-ignored"]


def heights(commands):
    """Z without repeats."""
    z = commands.position[:, 2].round(9).tolist()
    return [a for a, b in zip(z, [None, *z], strict=False) if a != b]


def test_sinumerik_drilling_cycles():
    """By hand: RFP 0, SDIS 2, RTP 10, bottom -9."""
    head = "G0 X0 Y0 Z20\nF60 S600 M3\n"
    commands, findings = sinumerik(head + "CYCLE81(10,0,2,-9)\nG0 X5\nM30")
    assert heights(commands) == [20, 2, -9, 2, 10]
    assert commands.position[commands.motion == LINE].tolist() == [[0, 0, -9, *[0] * 6]]
    assert Severity.UNPROVEN not in [f.severity for f in findings]
    commands, _ = sinumerik(head + "MCALL CYCLE82(10,0,2,,9,0.5)\nX5\nX7\nMCALL\nX9\nM30")
    assert heights(commands) == [20, 2, -9, 2, 10, 2, -9, 2, 10]
    assert commands.feed[commands.motion == DWELL].tolist() == [0.5, 0.5]
    commands, _ = sinumerik(head + "CYCLE83(10,0,2,-9,,-5,,0,0,0,1,1)\nM30")
    assert heights(commands) == [20, 2, -5, 2, -4.4, -9, 2, 10]


@pytest.mark.parametrize(
    ("arguments", "expected", "pauses"),
    [
        # strokes of 5, 5 - 2, then 2 while more than 4 are left; chips broken by 1 mm at the feed
        ("10,0,2,-13,,-5,,2,0.5,0,1,0", [-5, -4, -8, -7, -10, -9, -11.5, -10.5, -13], [0.5] * 5),
        # no degression: strokes as deep as the first, from RFP, not from RFP + SDIS
        ("10,0,2,-12,,,5,0,0,0,1,0,,,0.2", [-5, -4.8, -10, -9.8, -12], []),
        # each half of the one before it, 1 mm at least; back to RFP + SDIS, waiting there
        ("10,0,2,-9,,-4,,-0.5,0,0.3,1,1,,1", [-4, 2, -3.4, -6, 2, -5.4, -7, 2, -6.4, -8, 2, -7.4, -9], [0.3] * 4),
    ],
)
def test_plunges_of_a_sinumerik(arguments, expected, pauses):
    commands, findings = sinumerik(f"G0 X0 Y0 Z20\nF60 S600 M3\nCYCLE83({arguments})\nM30")
    assert heights(commands) == pytest.approx([20, 2, *expected, 2, 10])
    assert commands.feed[commands.motion == DWELL].tolist() == pauses
    assert Severity.UNPROVEN not in [f.severity for f in findings]


def test_sinumerik_tapping():
    head = "G0 X0 Y0 Z2\n"
    for text in (
        "S600\nG331 Z-9 K1.25\nG332 Z2 K1.25",
        "CYCLE84(2,0,2,-9,,0,5,,1.25,0,600,600)",
        "CYCLE84(2,0,2,-9,,0,5,8,,0,600,600)",
    ):
        commands, _ = sinumerik(head + text + "\nM30")
        fed = commands.motion == LINE
        assert commands.position[fed, 2].tolist() == [-9.0, 2.0]
        # ten turns a second of 1.25 mm
        assert commands.feed[fed].tolist() == pytest.approx([12.5, 12.5])
        assert commands.spindle[fed].tolist() == pytest.approx([20 * math.pi, -20 * math.pi])


def test_what_sinumerik_programs_ask_for_and_is_not_read_is_left_out():
    commands, findings = sinumerik("G0 X1\nASPLINE X5 Y5\nX6\nPOCKET4(1,2)\nG1 X7 F60\nM30")
    assert commands.position[:, 0].tolist() == [1.0, 7.0]
    assert [f.line for f in findings if f.severity is Severity.UNPROVEN] == [2, 3, 4]


def test_fanuc_rigid_tapping_starts_its_spindle():
    for text in ("S600 M29\nG98 G84 Z-9. R2. F750.", "S600\nG84.2 Z-9. R2. F750."):
        commands, _ = fanuc(f"G0 X0. Y0. Z10.\n{text}\nX5.\nG80\nM30")
        fed = commands.motion == LINE
        assert commands.position[fed, 2].tolist() == [-9.0, 2.0, -9.0, 2.0]
        assert commands.feed[fed].tolist() == pytest.approx([12.5] * 4)
        assert np.sign(commands.spindle[fed]).tolist() == [1.0, -1.0, 1.0, -1.0]


def test_fanuc_fine_boring_and_what_is_left_out():
    commands, findings = fanuc("G0 X0. Y0. Z10.\nS600 M3 F60.\nG99 G76 Z-9. R2. Q0.3 P500\nX5. Q0.3\nG80\nM30")
    fed = commands.motion == LINE
    assert commands.position[fed, 2].tolist() == [-9.0, -9.0]
    assert commands.feed[commands.motion == DWELL].tolist() == [0.5, 0.5]
    assert codes(findings) == ["nc-fine-boring"]
    commands, findings = fanuc("G0 X1.\nG6.1 X4. K1.\nX5.\nG0 X2.\nM30")
    assert commands.position[:, 0].tolist() == [1.0, 2.0]
    assert [f.line for f in findings if f.severity is Severity.UNPROVEN] == [2, 3]
