"""Points, patterns and subprograms of a Sinumerik. Oracle: positions and lengths by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.program.commands import ARC
from chipload.program.gcode.reader import read_gcode
from control_texts import dwells, ends, read

HEAD = "G71 G17 G90 G94 G54\nT1 M6\nS1000 M3\nG0 X20 Y0 Z10 F100\n"


def si(body):
    return read(body, "sinumerik", head=HEAD)


def arc_angles(commands):
    """Angle [deg] of each arc from its start, end and centre."""
    at, rows = ends(commands), np.flatnonzero(commands.motion == ARC)
    out = []
    for k in rows:
        start, end = (complex(*at[i][:2]) - complex(*commands.centre[k][:2]) for i in (k - 1, k))
        assert abs(start) == pytest.approx(abs(end), abs=1e-6)
        out.append(math.degrees(np.angle(end / start)) % 360.0)
    return out


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        # about the zero, about the point 5 beside the tool, about 10 above the last pole
        ("G111 X0 Y0\nG1 RP=10 AP=90\nAP=180\nRP=5", [[0, 10], [-10, 0], [-5, 0]]),
        ("G110 X5 Y0\nG1 RP=5 AP=90\nG112 X0 Y10\nG1 AP=IC(-90)", [[25, 5], [30, 10]]),
        ("G91 G1 X1\nG90 RP=2 AP=0", [[21, 0], [2, 0]]),
        ("G1 X30 ANG=45\nY0 ANG=-90", [[30, 10], [30, 0]]),
    ],
)
def test_points_by_a_pole_or_an_angle(body, expected):
    commands, findings = si(body)
    assert findings == []
    assert ends(commands)[1:, :2].tolist() == pytest.approx(np.array(expected))


@pytest.mark.parametrize(
    ("body", "angles", "end"),
    [
        ("G3 AP=90 RP=20\nAP=IC(45)", [90, 45], (-14.142136, 14.142136)),
        ("G3 I=AC(0) J=AC(0) AR=90\nG2 X20 Y0 AR=90", [90, 270], (20, 0)),
        ("G3 I-20 J0 AR=270", [270], (0, -20)),
        ("G2 X30 Y0 AR=300", [60], (30, 0)),
        ("CIP X30 Y0 I1=25 J1=5\nX40 Y0 I1=AC(35) J1=-5\nG1 X0", [180, 180], (0, 0)),
    ],
)
def test_arcs_by_an_angle_or_three_points(body, angles, end):
    commands, findings = si(body)
    assert findings == []
    assert arc_angles(commands) == pytest.approx(angles)
    assert ends(commands)[-1][:2] == pytest.approx(end)


@pytest.mark.parametrize(
    ("pattern", "holes"),
    [
        ("HOLES1(1,2,90,5,10,3)", [[1, 7], [1, 17], [1, 27]]),
        ("HOLES2(0,0,20,0,90,3)", [[20, 0], [0, 20], [-20, 0]]),
        ("CYCLE801(0,0,0,10,15,2,2)", [[0, 0], [10, 0], [10, 15], [0, 15]]),
    ],
)
def test_patterns_of_holes_behind_mcall(pattern, holes):
    commands, findings = si(f"MCALL CYCLE82(10,0,2,-8,,0.5)\n{pattern}\nMCALL\nX50")
    assert findings == []
    at = ends(commands)
    assert at[np.isclose(at[:, 2], -8.0), :2].tolist() == pytest.approx(np.array(holes))
    assert [x for x in dwells(commands) if x] == [0.5] * len(holes)
    assert at[-1].tolist() == pytest.approx([50, holes[-1][1], 10])


@pytest.mark.parametrize(
    ("call", "program", "end"),
    [
        ("L20 P3", "%_N_L20_SPF\nG91 G1 X5\nG90\nM17", (35, 0)),
        ("SLOTS P=2", "PROC SLOTS\nG1 X=IC(5) Y1\nRET", (30, 1)),
        ("HOLE(12.5, 3)", "%_N_HOLE_SPF\nPROC HOLE(REAL XX, REAL YY)\nG1 X=XX Y=YY\nRET", (12.5, 3)),
        ('CALL "L20"', "%_N_L20_SPF\nG1 Y7\nM17", (20, 7)),
    ],
)
def test_subprograms_in_the_text(call, program, end):
    text = f"{HEAD}{call}\nM30\n{program}\n"
    commands, findings = read_gcode(text, name="x.mpf", dialect="sinumerik", lenient=True)
    assert [f for f in findings if f.severity.name != "NOTE"] == []
    assert tuple(ends(commands)[-1][:2]) == end


def test_a_subprogram_in_a_file_beside_the_text(tmp_path):
    (tmp_path / "L30.SPF").write_text("G91 G1 X-5\nG90\nM17\n")
    commands, findings = read_gcode(
        f"{HEAD}L30 P2\nL31\nM30\n", name="x.mpf", dialect="sinumerik", lenient=True, folder=tmp_path
    )
    assert ends(commands)[-1][:2].tolist() == [10, 0]
    assert [f.line for f in findings if f.code == "nc-call"] == [6]


def test_tangent_arcs_go_on_in_the_direction_before_them():
    """CT: a quarter about (20, 10), a half about it; then straight on, modal to an arc about (-5, 0)."""
    commands, findings = si("G1 X20 Y0\nX20.5\nX20\nG1 X10\nX20\nCT X30 Y10\nX10\nY-5\nG1 X0\nCT X-5 Y-5\nX-10 Y0")
    assert findings == []
    arcs = np.flatnonzero(commands.motion == ARC)
    assert commands.centre[arcs, :2].round(9).tolist() == [[20, 10], [20, 10], [-5, 0]]
    assert ends(commands)[-1].tolist() == [-10, 0, 10]
    assert arc_angles(commands)[:2] == pytest.approx([90, 180])
