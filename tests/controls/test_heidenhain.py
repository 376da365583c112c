"""Poles of a Heidenhain in the planes YZ and ZX, and blocks that cannot be read. Oracle: points by hand."""

import numpy as np
import pytest

from chipload.errors import Severity
from chipload.program.commands import ARC, LINE, YZ, ZX
from chipload.program.heidenhain.reader import read_heidenhain


def read(*blocks, lenient=False):
    text = "\n".join(["BEGIN PGM A MM", "TOOL CALL 1 Z S1000", "M3", *blocks, "END PGM A MM"])
    return read_heidenhain(text, lenient=lenient)


@pytest.mark.parametrize(
    ("blocks", "plane", "end"),
    [
        (("CC Y+10 Z+0", "CP IPA+90 DR+ F500"), YZ, (0, 10, -10)),
        (("CC Y+10 Z+0", "CP IPA-90 DR- F500"), YZ, (0, 10, 10)),
        (("CC Z+10 X+0", "CP IPA+90 DR+ F500"), ZX, (-10, 0, 10)),
        (("CC Y+10 Z+0", "C Y+20 Z+0 DR- F500"), YZ, (0, 20, 0)),
    ],
)
def test_an_arc_along_the_tool(blocks, plane, end):
    """From the origin about a pole 10 mm away."""
    commands, _ = read("L X+0 Y+0 Z+0 FMAX", *blocks)
    arc = commands.motion == ARC
    assert commands.plane[arc].tolist() == [plane]
    np.testing.assert_allclose(commands.position[-1, :3], end, atol=1e-9)


def test_the_pole_in_xy_comes_back():
    commands, _ = read("L X+0 Y+0 Z+0 FMAX", "CC Y+10 Z+0", "CC X+5 Y+0", "CP IPA+180 DR+ F500")
    np.testing.assert_allclose(commands.position[-1, :3], (10, 0, 0), atol=1e-9)


def test_a_block_that_cannot_be_read_is_a_finding():
    commands, findings = read("L X+0 Y+0 Z+0 FMAX", "CR X+50 Y+0 R+1 DR+ F100", "L X+9 Y+0 F100", lenient=True)
    left_out = [f for f in findings if f.severity is Severity.UNPROVEN]
    assert [(f.code, f.line) for f in left_out] == [("heidenhain-left-out", 5)]
    assert commands.position[-1, 0] == 9.0


def test_a_line_with_the_normal_of_its_surface_ends_where_it_says():
    """NX NY NZ are no coordinates; with a tool direction its block is left out."""
    commands, findings = read("L X+1 Y+2 Z+3 F500", "LN X+4 Y+5 Z+6 NX+0.6 NY+0 NZ+0.8 F500", "LN X+7 NX+0 NY+0 NZ+1")
    assert [f.code for f in findings if f.severity > Severity.NOTE] == []
    assert commands.position[:, :3].tolist() == [[1, 2, 3], [4, 5, 6], [7, 5, 6]]
    _, findings = read("L X+1 Y+2 Z+3 F500", "LN X+4 NX+0 NY+0 NZ+1 TX+0 TY+0 TZ+1", lenient=True)
    assert [f.line for f in findings if f.severity > Severity.NOTE] == [5]


def test_trans_datum_is_cycle_7():
    """A shift by TRANS DATUM AXIS, in place of the one before it, and back by RESET."""
    head = "BEGIN PGM A MM\nTOOL CALL 1 Z S1000\nM3\nL X+0 Y+0 Z+10 R0 FMAX\n"
    shifted = "TRANS DATUM AXIS X+10 Y+5\nL X+1 Y+1 F100\nTRANS DATUM AXIS X+20\nL X+1\nTRANS DATUM RESET\nL X+1 Y+1\n"
    commands, findings = read_heidenhain(f"{head}{shifted}M30\nEND PGM A MM\n")
    assert not [f for f in findings if f.severity > f.severity.NOTE]
    machine = [
        (commands.position[k, :2] + commands.frames[commands.frame[k]].shift[:2]).tolist()
        for k in range(len(commands.motion))
    ]
    assert machine[-3:] == [[11, 6], [21, 6], [1, 1]]


def test_single_lip_drilling():
    """At 750 to 2 mm above the start of 5 mm, at 150 in plunges of 8, 7 and the rest, out at 1000."""
    head = "BEGIN PGM A MM\nTOOL CALL 1 Z S1000\nM3\nL X+0 Y+0 Z+10 R0 FMAX\n"
    cycle = (
        "CYCL DEF 241 SINGLE-LIP D.H.DRLNG Q200=2 Q201=-24 Q206=150 Q211=0 Q203=+0 Q204=10 Q379=5 Q253=750 Q208=1000 "
        "Q426=3 Q427=500 Q202=8 Q212=1 Q205=3\nCYCL CALL\n"
    )
    commands, findings = read_heidenhain(f"{head}{cycle}M30\nEND PGM A MM\n")
    assert not [f for f in findings if f.severity > f.severity.NOTE]
    cuts = commands.motion == LINE
    assert commands.position[cuts, 2].tolist() == [-3, -13, -20, -24, 2]
    assert (commands.feed[cuts] * 60).tolist() == pytest.approx([750, 150, 150, 150, 1000])
