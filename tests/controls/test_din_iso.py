"""Heidenhain programs in DIN/ISO. Oracle: the same part as a conversational program, and points by hand."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.errors import InputError, Severity
from chipload.program.heidenhain import with_feeds
from chipload.program.heidenhain.reader import read_heidenhain, tool_definitions
from chipload.program.recognise import recognise
from chipload.program.reconcile import unit_mm

ISO = "%A G71 *\nN10 T5 G17 S3000 *\n{}\nN99999999 %A G71 *"
OWN = "BEGIN PGM A MM\nTOOL CALL 5 Z S3000\n{}\nEND PGM A MM"
HEAD = "N20 G00 G40 G90 X+0 Y+0 M3 *\nN30 Z+2 *", "L X+0 Y+0 R0 FMAX M3\nL Z+2 FMAX"
#: DIN/ISO and conversational blocks of one part
PARTS = {
    "lines": ("G01 Z-3 F200\nG91 X+10 F600\nG90 Y+20\nG01 G91 X+5 G90 Y+30*",
              "L Z-3 F200\nL IX+10 F600\nL Y+20\nL IX+5 Y+30"),
    "arcs": ("G01 X+10 F300*\nI+10 J+10*\nG03 X+20 Y+10*\nG02 X+30 Y+20 R+10*\n"
             "G06 X+50 Y+20*\nG03 I+50 J+30 X+60 Y+30*",
             "L X+10 F300\nCC X+10 Y+10\nC X+20 Y+10 DR+\nCR X+30 Y+20 R+10 DR-\nCT X+50 Y+20\nCC X+50 Y+30\n"
             "C X+60 Y+30 DR+"),
    "polar": ("I+0 J+0*\nG11 R+20 H+0 F500*\nG13 G91 H+360 Z-2*\nG90 G10 R+20 H+90*",
              "CC X+0 Y+0\nLP PR+20 PA+0 F500\nCP IPA+360 IZ-2 DR+\nLP PR+20 PA+90 FMAX"),
    "corners": ("G01 Z-1 F100*\nX+30*\nG25 R5*\nY+20*\nG24 R4*\nX+0*",
                "L Z-1 F100\nL X+30\nRND R5\nL Y+20\nCHF 4\nL X+0"),
    "cycles": ("G200 Q200=2 Q201=-10 Q206=150 Q202=5 Q210=0 Q203=+0 Q204=20 Q211=0 *\nG00 X+20 Y+20 M99 *\nG04 F2*\n"
               "G83 P01 +2 P02 -9 P03 +3 P04 0 P05 80*\nG00 X+40*\nG79 M3*",
               "CYCL DEF 200 Q200=2 Q201=-10 Q206=150 Q202=5 Q210=0 Q203=+0 Q204=20 Q211=0\nL X+20 Y+20 FMAX M99\n"
               "CYCL DEF 9.0 DWELL\nCYCL DEF 9.1 DWELL 2\nCYCL DEF 1.0 PECKING\nCYCL DEF 1.1 DIST +2\n"
               "CYCL DEF 1.2 DEPTH -9\nCYCL DEF 1.3 PLNGNG +3\nCYCL DEF 1.4 DWELL 0\nCYCL DEF 1.5 F 80\n"
               "L X+40 FMAX\nCYCL CALL M3"),
    "coordinates": ("G54 X+10 Y+5*\nG73 G90 H+30*\nG01 X+20 Y+0 F200*\nG73 G90 H+0*\n"
                    "G54 X+0 Y+0*\nG28 X*\nG01 X+20*\nG28*",
                    "CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+10\nCYCL DEF 7.2 Y+5\nCYCL DEF 10.0 ROTATION\n"
                    "CYCL DEF 10.1 ROT+30\nL X+20 Y+0 F200\nCYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+0\n"
                    "CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+0\nCYCL DEF 7.2 Y+0\nCYCL DEF 8.0 MIRROR IMAGE\n"
                    "CYCL DEF 8.1 X\nL X+20\nCYCL DEF 8.0 MIRROR IMAGE\nCYCL DEF 8.1"),
    "labels": ("D00 Q1 P01 +0*\nG98 L1*\nG01 G91 X+5 F100*\nD01 Q1 P01 +Q1 P02 +1*\nD12 P01 +Q1 P02 +4 P03 1*\n"
               "G90 Y+Q1*\n"
               "G98 L2*\nG91 Y+1*\nL2,2*",
               "FN 0: Q1 = +0\nLBL 1\nL IX+5 F100\nFN 1: Q1 = +Q1 + +1\nFN 12: IF +Q1 LT +4 GOTO LBL 1\nL Y+Q1\n"
               "LBL 2\nL IY+1\nCALL LBL 2 REP 2"),
}  # fmt: skip


@pytest.mark.parametrize("part", PARTS)
def test_both_forms_move_alike(part):
    (iso, expected), findings = zip(
        *(
            read_heidenhain(head.format(f"{start}\n{body}"))
            for head, start, body in zip((ISO, OWN), HEAD, PARTS[part], strict=True)
        ),
        strict=True,
    )
    assert [f for of_one in findings for f in of_one if f.severity >= Severity.UNPROVEN] == []
    assert len(expected) > 3
    np.testing.assert_allclose(iso.position, expected.position, atol=1e-12)
    for column in ("motion", "feed", "spindle", "tool"):
        np.testing.assert_array_equal(getattr(iso, column), getattr(expected, column))


def test_what_stands_in_the_head():
    """Unit, blank, tool and control; lines of the findings are those of the text."""
    text = "%TEIL G70 *\nN10 G30 G17 X+0 Y+0 Z-20*\nN20 G31 G90 X+9 Y+6 Z+0*\nN30 G99 T3 L+0 R+4*\nN40 T3 G17 S900*\n"
    assert unit_mm(text) == 25.4
    assert tool_definitions(text)[3].diameter == pytest.approx(8.0 * 25.4)
    assert recognise(text, "linuxcnc").control.name == "heidenhain"
    commands, findings = read_heidenhain(f"{text}N50 G00 G90 X+1*\nN60 G26 R3*\nN99999999 %TEIL G70*", lenient=True)
    assert commands.position[-1, 0] == pytest.approx(25.4)
    assert [(f.line, f.code) for f in findings if f.severity >= Severity.UNPROVEN] == [(7, "heidenhain-unread")]
    with pytest.raises(InputError, match="a DIN/ISO program: feeds are changed in conversational programs only"):
        with_feeds(text, {})
