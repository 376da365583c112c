"""Words of a Sinumerik that change the path and are not read leave the program unproven; those that do not, do not.

The lists follow Siemens's Programming Manual Fundamentals: which of its addresses move axes, or move the contour.
"""

from __future__ import annotations

import pytest

from chipload.errors import Severity
from chipload.program.control import control_named
from chipload.program.gcode.reader import read_gcode

HEAD = "G17 G90 G71 G94 G40\nT1 D1\nM6\nS5000 M3\nG54\nG0 X0 Y0 Z10\nG1 Z-1 F500\n"
TAIL = "\nG1 X50 Y10\nG1 X50 Y60\nG0 Z20\nM30\n"
#: rows of head and tail
ROWS = 5


def read(block: str) -> tuple[int, list[str]]:
    commands, findings = read_gcode(HEAD + block + TAIL, name="x.mpf", dialect="sinumerik", lenient=True)
    return len(commands) - ROWS, [f.text for f in findings if f.severity is Severity.UNPROVEN]


@pytest.mark.parametrize(
    ("block", "rows"),
    [
        ("G1 X50 FB=200", 1),
        ("G1 X50 TOFFL=1", 1),
        ("G1 X50 MEAS=1", 1),
        ("G1 X50 OVR=50", 1),
        ("OFFN=2", 0),
        ("$P_UIFR[1]=CTRANS(X,10,Y,10)", 0),
        ("$P_PFRAME=CTRANS(X,10)", 0),
        ("$TC_DP6[1,1]=5", 0),
        # the end of these is not known: they do not move
        ("G2 AR=180", 0),
        ("G1 ANG=30", 0),
        ("G0 POS[Z]=50", 0),
        ("G0 Z1=50", 0),
        ("G1 X50 FOO", 1),
        ("PCALL SUB", 0),
        # coordinates along the tool's axis: the rest of the program is left out too
        ("TOROT", -3),
    ],
)
def test_what_moves_the_path_is_unproven(block: str, rows: int) -> None:
    count, unproven = read(block)
    assert count == rows
    assert unproven


@pytest.mark.parametrize("block", ["G1 X50 OVR=100", "G1 X50 CTOL=0.01", "CUT2DF", "DYNFINISH", "_CAMTOLERANCE=0.01"])
def test_what_does_not_is_not(block: str) -> None:
    assert read(block)[1] == []


def test_the_end_of_coordinates_along_the_tool_is_read() -> None:
    assert read("TOROT\nTOROTOF")[0] == 0
    # it ends no tilted coordinates
    assert read("ROT X30\nTOROTOF")[0] == -3


@pytest.mark.parametrize("block", ["SPOS=90", "SPOSA=0", "SPOS[1]=DC(0)", "M5 SPOS=90", "SPOS=0 M5", "M19"])
def test_a_positioned_spindle_stands_still(block: str) -> None:
    text = f"S1000 M3\nG1 X1 F100\n{block}\nG1 X2\nM30\n"
    commands, findings = read_gcode(text, control=control_named("sinumerik"), lenient=True)
    assert (commands.spindle > 0.0).tolist() == [True, False]
    assert findings == ()


@pytest.mark.parametrize("block", ["SPOS[2]=0", "SPOSA[3]=DC(90)"])
def test_a_second_spindle_leaves_the_first_turning(block: str) -> None:
    text = f"S1000 M3\nG1 X1 F100\n{block}\nG1 X2\nM30\n"
    commands, findings = read_gcode(text, control=control_named("sinumerik"), lenient=True)
    assert (commands.spindle > 0.0).all()
    assert [(f.code, f.line, f.severity) for f in findings] == [("nc-other-spindle", 3, Severity.NOTE)]


def test_a_spindle_that_is_not_named_by_a_number_is_unproven() -> None:
    text = "R1=2\nS1000 M3\nG1 X1 F100\nSPOS[R1]=0\nG1 X2\nM30\n"
    _, findings = read_gcode(text, control=control_named("sinumerik"), lenient=True)
    assert [(f.code, f.severity) for f in findings] == [("nc-other-spindle", Severity.UNPROVEN)]
