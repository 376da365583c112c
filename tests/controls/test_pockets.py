"""Pockets of a Sinumerik and a Heidenhain. Oracle: the area of the pocket by brute force, lengths of circles."""

import cmath
import math

import numpy as np
import pytest

from chipload.program.commands import ARC, RAPID
from chipload.program.control import control_named
from chipload.program.gcode.reader import read_gcode
from chipload.program.heidenhain.reader import read_heidenhain
from chipload.program.pocket_cycles import levels
from control_texts import codes, minutes, places

RADIUS = 3.0
SI = "G71 G17 G90 G94 G54\nT1 M6\nS1000 M3\nG0 X0 Y0 Z10\n{}\nM30\n"
HH = "BEGIN PGM A MM\nTOOL CALL 1 Z S1000\nM3\nL X+15 Y+10 R0 FMAX\nL Z+10 R0 FMAX\n{}\nCYCL CALL\nM30\nEND PGM A MM\n"
COMMON = "Q207=500 Q351=1 Q201=-5 Q202=2.5 Q206=100 Q200=2 Q203=+0 Q204=10 Q385=400"
#: pocket: texts, and its half sizes, corner, angle [deg]
POCKETS = {
    "rectangle": (
        "POCKET3(10,0,2,-5,30,20,5,15,10,30,2.5,0,0,500,100,0,11,4)",
        f"CYCL DEF 251 POCKET Q215=0 Q218=30 Q219=20 Q220=5 Q224=30 Q366=0 Q370=1.3333333 {COMMON}",
        (15.0, 10.0, 5.0, 30.0),
    ),
    "circle": (
        "POCKET4(10,0,2,-5,12,15,10,2.5,0,0,500,100,0,11,4)",
        f"CYCL DEF 252 POCKET Q215=0 Q223=24 Q366=0 Q370=1.3333333 {COMMON}",
        (12.0, 12.0, 12.0, 0.0),
    ),
}


def si(body):
    commands, findings = read_gcode(
        SI.format(body), control=control_named("sinumerik"), lenient=True, diameters={1: 6.0}
    )
    return commands, [f for f in findings if f.code == "nc-pocket-path" or f.severity > f.severity.NOTE]


def hh(body):
    return read_heidenhain(HH.format(body), radii={1: RADIUS})[0]


def ground(commands):
    """Depth on a grid of 0.125 mm under a tool with a flat end, and its points relative to (15, 10)."""
    axis = np.arange(-20.0, 20.0, 0.125) + 0.0625
    p = (axis[:, None] + 1j * axis[None, :]) + complex(15.0, 10.0)
    out = np.zeros(p.shape)
    for at, z in places(commands):
        if z < 0.0:
            i0, j0 = (round((c + 20.0) / 0.125) for c in ((at - complex(15, 10)).real, (at - complex(15, 10)).imag))
            box = np.s_[max(0, i0 - 26) : i0 + 27, max(0, j0 - 26) : j0 + 27]
            under = np.abs(p[box] - at) <= RADIUS
            out[box][under] = np.minimum(out[box][under], z)
    return out, p - complex(15.0, 10.0)


@pytest.mark.parametrize("pocket", POCKETS)
@pytest.mark.parametrize("control", ["sinumerik", "heidenhain"])
def test_the_pocket_is_cut_and_nothing_else(pocket, control):
    """Inside the wall the floor is at its depth, outside nothing is cut; 0.13 mm of the grid are left out."""
    text = POCKETS[pocket]
    commands = si(text[0])[0] if control == "sinumerik" else hh(text[1])
    a, b, corner, degrees = text[2]
    z, p = ground(commands)
    q = p * cmath.exp(-1j * math.radians(degrees))
    x, y = np.abs(q.real) - (a - corner), np.abs(q.imag) - (b - corner)
    outside = np.hypot(np.maximum(x, 0.0), np.maximum(y, 0.0)) + np.minimum(np.maximum(x, y), 0.0) - corner
    assert (z[outside < -0.13] == -5.0).all()
    assert (z[outside > 0.13] == 0.0).all()
    area = 4 * a * b - (4 - math.pi) * corner**2
    assert -z.sum() * 0.125**2 == pytest.approx(5.0 * area, rel=5e-3)


def test_time_of_a_circle():
    """Two passes: down at 100, three circles of 3, 6 and 9 mm, out and back, at 500 mm/min."""
    commands, findings = si(POCKETS["circle"][0])
    assert codes(findings) == ["nc-pocket-path"]
    way = 2 * (math.tau * (3 + 6 + 9) + 9 + 9)
    assert minutes(commands) == pytest.approx((2 + 5) / 100 + way / 500)
    assert (commands.turns[commands.motion == ARC] > 0).all()
    assert commands.motion[-1] == RAPID
    assert commands.position[-1, :3].tolist() == [15, 10, 10]


def test_allowances_and_finishing():
    """Roughing leaves 0.5 mm at the wall and 0.2 mm on the floor; finishing goes along the wall to the depth."""
    commands, _ = si("POCKET4(10,0,2,-5,12,15,10,2.5,0.5,0.2,500,100,1,11,4)")
    cuts = commands.motion == ARC
    assert np.hypot(*(commands.position[cuts, :2] - (15, 10)).T).max() == pytest.approx(12 - 3 - 0.5)
    assert commands.position[:, 2].min() == pytest.approx(-4.8)
    assert (commands.turns[cuts] < 0).all()
    commands, _ = si("POCKET4(10,0,2,-5,12,15,10,2.5,0.5,0.2,500,100,0,12,4)")
    cuts = commands.motion == ARC
    assert np.hypot(*(commands.position[cuts, :2] - (15, 10)).T) == pytest.approx(9.0)
    assert commands.position[:, 2].min() == -5.0


def test_a_helix_goes_down_in_the_middle():
    """2 mm above to -2.5 at 1 mm a turn: five turns of 2 mm of radius, then one at the depth."""
    commands, _ = si("POCKET4(10,0,2,-2.5,12,15,10,2.5,0,0,500,100,0,21,4,,,2,1)")
    arcs = np.flatnonzero(commands.motion == ARC)
    assert commands.turns[arcs[:2]].tolist() == [5, 1]
    assert commands.position[arcs[:2], 2].tolist() == [-2.5, -2.5]
    assert np.hypot(*(commands.position[arcs[0], :2] - (15, 10))) == pytest.approx(2.0)


def test_what_a_pocket_needs():
    _, findings = si("POCKET4(10,0,2,-5,2,15,10,2.5,0,0,500,100)")
    assert ["does not fit" in f.text for f in findings if f.code != "nc-pocket-path"] == [True]
    _, findings = si("POCKET3(10,0,2,-5,30)")
    assert [f.text.split(":")[1] for f in findings] == [" PA, PO, MID, WID must be given"]
    text = SI.format("POCKET4(10,0,2,-5,12,15,10,2.5)")
    _, findings = read_gcode(text, control=control_named("sinumerik"), lenient=True)
    assert any("the diameter of tool 1 is not known" in f.text for f in findings)


def test_passes():
    assert levels(0.0, -5.0, 2.0, even=True) == pytest.approx([-5 / 3, -10 / 3, -5.0])
