"""Values, fields, jumps and calls of a Sinumerik. Oracle: values and points by hand."""

import pytest

from chipload.program.commands import LINE
from control_texts import codes, ends, read

HEAD = "G71 G17 G90 G94 G54\nT1 M6\nS1000 M3\nG0 X0 Y0 Z10\n"


def si(body):
    return read(body, "sinumerik", head=HEAD)


def x_of(body):
    commands, findings = si(body)
    assert findings == []
    return ends(commands)[1:, 0].tolist()


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("R1 = R2 + 5", 7.0),
        ("R1=7 DIV 2", 3.0),
        ("R1=7 MOD 4 + 4", 7.0),
        ("R1=TRUNC(3.7) * POT(R2 + 1)", 27.0),
        ("R1=ROUND(2.5)", 3.0),
        ("R1=ATAN2(1, 1)", 45.0),
        ("R1=BOUND(1, 5, 9) - MINVAL(R2, 3)", 3.0),
        ("R1=MAXVAL(SIN(30), R[2])", 2.0),
    ],
)
def test_values(text, value):
    assert x_of(f"R2=2\n{text}\nG1 X=R1 F100") == pytest.approx([value])


def test_fields():
    """Elements count from 0; R[ ] is the parameter of a calculated number."""
    body = "DEF REAL DEPTH[3]=SET(1, 2, 3), STEP=0.5\nDEF INT I1\nFOR I1=0 TO 2\nG1 X=DEPTH[I1] + STEP F100\nENDFOR"
    assert x_of(body) == [1.5, 2.5, 3.5]
    assert x_of("DEF REAL WAY[2]\nWAY[1]=4\nR[1 + 2]=WAY[1]*2\nG1 X=R3 F100\nX=WAY[0]") == [8, 0]


def test_an_element_that_nothing_defines():
    _, findings = si("R1=PLACE[2]")
    assert codes(findings) == ["nc-not-read"]


@pytest.mark.parametrize(("number", "expected"), [(1, [1, 9]), (2, [2, 9]), (5, [3, 9])])
def test_case(number, expected):
    body = (
        f"R1={number}\nCASE R1 OF 1 GOTOF ONE 2 GOTOF TWO DEFAULT GOTOF OTHER\nONE: G1 X1 F100\nGOTOF OUT\n"
        "TWO: G1 X2 F100\nGOTOF OUT\nOTHER: G1 X3 F100\nOUT: G1 X9 F100"
    )
    assert x_of(body) == expected


def test_a_subprogram_behind_each_block():
    """MCALL with a subprogram: it is not run where MCALL stands, and no more behind MCALL alone."""
    body = "MCALL L100\nX10 Y10\nX20\nMCALL\nX30\nM30\n%_N_L100_SPF\nG91 G1 Z-12 F100\nG0 Z12\nG90\nM17"
    commands, findings = si(body)
    assert findings == []
    cuts = commands.motion == LINE
    assert commands.position[cuts, 0].tolist() == [10, 20]
    assert commands.position[cuts, 2].tolist() == [-2, -2]
    assert ends(commands)[-1].tolist() == [30, 10, 10]


def test_a_text_behind_a_name():
    assert x_of("DEFINE FAST AS G1 F200\nFAST X7") == [7]


def test_spindle_one_is_the_one_that_cuts():
    commands, findings = si("M1=4 S1=500\nG1 X5 F100\nS2=900 M2=3")
    assert findings == []
    assert commands.spindle[commands.motion == LINE][0] == pytest.approx(-52.359878)


def test_shifts_by_g_codes():
    """G58 shifts, G59 shifts on."""
    commands, findings = si("G58 X10\nG59 X5\nG1 X1 F100")
    assert findings == []
    assert commands.frames[commands.frame[-1]].offset[0] == 15


def test_what_does_not_move():
    """The reference point is a retraction; alarms and messages do nothing."""
    assert x_of(
        'EXTERN POC(REAL, INT)\nG74 Z1=0\nG75 X1=0\nSETAL(65000)\nWRTPR("A")\nDEF BOOL FLAG=TRUE\nIF FLAG\nG0 X5\nENDIF'
    ) == [5]
