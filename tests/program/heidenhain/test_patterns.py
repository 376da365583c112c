"""Places of PATTERN DEF and the cycle at them. Oracle: places and heights by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.errors import InputError, Severity
from chipload.program.heidenhain.patterns import pattern_places
from chipload.program.heidenhain.reader import read_heidenhain

DRILL = "CYCL DEF 200 Q200=2 Q201=-8 Q206=250 Q202=20 Q210=0 Q203=+1 Q204=30 Q211=0"


def places(body):
    found = pattern_places(f"PATTERN DEF {body}", lambda sign, value: float(sign + value))
    return np.array(found)[:, :2]


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("POS1 (X+1 Y-2 Z+0) POS2 (X+5 Y+6 Z+0)", [(1, -2), (5, 6)]),
        ("ROW1 (X+10 Y+20 D+5 NUM3 ROT+90 Z+0)", [(10, 20), (10, 25), (10, 30)]),
        ("PAT1 (X+0 Y+0 DX+2 DY+3 NUMX2 NUMY2 ROT+0 ROTX+0 ROTY+0 Z+0)", [(0, 0), (2, 0), (2, 3), (0, 3)]),
        ("PAT1 (X+0 Y+0 DX+2 DY+3 NUMX2 NUMY2 ROT+90 ROTX+0 ROTY+0 Z+0)", [(0, 0), (0, 2), (-3, 2), (-3, 0)]),
        (
            "FRAME1 (X+0 Y+0 DX+1 DY+1 NUMX3 NUMY3 ROT+0 ROTX+0 ROTY+0 Z+0)",
            [(0, 0), (1, 0), (2, 0), (2, 1), (0, 1), (0, 2), (1, 2), (2, 2)],
        ),
        ("CIRC1 (X+1 Y+1 D10 START+0 NUM4 Z+0)", [(6, 1), (1, 6), (-4, 1), (1, -4)]),
        (
            "PITCHCIRC1 (X+0 Y+0 D20 START+0 STEP+30 NUM2 Z+0)",
            [(10, 0), (10 * math.cos(math.radians(30)), 5)],
        ),
    ],
)
def test_places(body, expected):
    np.testing.assert_allclose(places(body), expected, atol=1e-8)


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("ROW1 (X+0 Y+0 D+5 Z+0)", "PATTERN DEF ROW: NUM is missing"),
        ("PAT1 (X+0 Y+0 DX+1 DY+1 NUMX1000 NUMY1000)", "must be at most 10000"),
        ("STAR1 (X+0 Y+0)", "no pattern that is read"),
    ],
)
def test_a_pattern_that_cannot_be_read(body, message):
    with pytest.raises(InputError, match=message):
        places(body)


def test_a_cycle_at_each_place():
    """Surface 1 and 4: bottoms at -7 and -4; between the holes at the second clearance 31, or at the height before."""
    text = "\n".join(
        [
            "BEGIN PGM A MM", "TOOL CALL 1 Z S1000", "M3", "L X+0 Y+0 Z+50 FMAX", DRILL,
            "PATTERN DEF POS1 (X+5 Y+5 Z+0) POS2 (X+9 Y+5 Z+3)", "CYCL CALL PAT FMAX", "END PGM A MM",
        ]
    )  # fmt: skip
    commands, findings = read_heidenhain(text)
    assert [f for f in findings if f.severity > Severity.NOTE] == []
    at = commands.position[:, :3]
    assert at[commands.feed > 0.0].tolist() == [[5, 5, -7], [9, 5, -4]]
    across = np.flatnonzero(np.diff(at[:, 0]) != 0.0) + 1
    assert at[across].tolist() == [[5, 5, 50], [9, 5, 50]]
    assert at[-1].tolist() == [9, 5, 50]


def test_a_pattern_without_a_definition():
    text = f"BEGIN PGM A MM\nTOOL CALL 1 Z S1000\nM3\nL X+0 Y+0 Z+50 FMAX\n{DRILL}\nCYCL CALL PAT FMAX\nEND PGM A MM"
    commands, findings = read_heidenhain(text)
    assert [f.code for f in findings if f.severity is Severity.UNPROVEN] == ["heidenhain-left-out"]
    assert len(commands) == 1
