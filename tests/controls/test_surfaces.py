"""Faces, circular slots and studs. Oracle: what each leaves on a grid by brute force; lengths by closed forms."""

import cmath
import math

import numpy as np
import pytest

from chipload.errors import Severity
from chipload.program.commands import ARC, LINE
from chipload.program.control import control_named
from chipload.program.gcode.reader import read_gcode
from chipload.program.heidenhain.reader import read_heidenhain
from control_texts import codes, minutes, places

R, CELL, HALF = 3.0, 0.125, 32.0
TEXT = "BEGIN PGM A MM\nTOOL CALL 1 Z S1000\nM3\nL X+5 Y-3 R0 FMAX\nL Z+10 R0 FMAX\n{}\nCYCL CALL\nM30\nEND PGM A MM\n"
CUT = "Q207=500 Q351=1 Q201=-5 Q202=2.5 Q206=100 Q200=2 Q203=+0 Q204=10 Q385=400"
FACE = "Q386=-5 Q227=+0 Q202=2.5 Q207=500 Q385=400 Q253=750 Q200=2 Q204=10 Q357=2"


def hh(body):
    return read_heidenhain(TEXT.format(body), radii={1: R}, lenient=True)


def ground(commands, middle):
    """Depth on a grid under a tool with a flat end, and its points about a middle."""
    axis = np.arange(-HALF, HALF, CELL) + 0.5 * CELL
    p = axis[:, None] + 1j * axis[None, :] + middle
    out = np.zeros(p.shape)
    n = math.ceil(R / CELL) + 2
    for at, z in places(commands):
        if z >= 0.0:
            continue
        i, j = (round((v + HALF) / CELL) for v in ((at - middle).real, (at - middle).imag))
        box = np.s_[max(0, i - n) : max(0, i + n), max(0, j - n) : max(0, j + n)]
        under = np.abs(p[box] - at) <= R
        out[box][under] = np.minimum(out[box][under], z)
    return out, p - middle


def rectangle(p, a, b, corner):
    """Distance of points from a rectangle with round corners, below 0 inside."""
    x, y = np.abs(p.real) - (a - corner), np.abs(p.imag) - (b - corner)
    return np.hypot(np.maximum(x, 0.0), np.maximum(y, 0.0)) + np.minimum(np.maximum(x, y), 0.0) - corner


def arc_slot(p, radius, first, sweep, width):
    """Distance of points from a slot along an arc, below 0 inside."""
    turned = np.angle(p * cmath.exp(-1j * math.radians(first + 0.5 * sweep)))
    half = 0.5 * abs(math.radians(sweep))
    ends = [cmath.rect(radius, math.radians(first + s * sweep)) for s in (0, 1)]
    beside = np.minimum(*(np.abs(p - end) for end in ends))
    return np.where(np.abs(turned) <= half, np.abs(np.abs(p) - radius), beside) - 0.5 * width


@pytest.mark.parametrize("climb", [1, -1])
@pytest.mark.parametrize(("first", "sweep"), [(20.0, 100.0), (20.0, -100.0)])
def test_a_circular_slot(climb, first, sweep):
    body = f"CYCL DEF 254 Q215=0 Q219=10 Q368=0.3 Q375=40 Q367=0 Q216=1 Q217=2 Q376={first} Q248={sweep} Q378=0 Q377=1"
    commands, findings = hh(f"{body} Q369=0.2 Q338=0 Q366=0 {CUT}".replace("Q351=1", f"Q351={climb}"))
    assert {f.code for f in findings if f.severity > Severity.NOTE} == {"nc-pocket-path"}
    z, p = ground(commands, 1 + 2j)
    off = arc_slot(p, 20.0, first, sweep, 10.0)
    assert (z[off < -0.15] == -5.0).all()
    assert (z[off > 0.15] == 0.0).all()
    area = 10.0 * 20.0 * math.radians(abs(sweep)) + 25.0 * math.pi
    assert -z.sum() * CELL**2 == pytest.approx(5.0 * area, rel=5e-3)


def test_the_loops_of_a_circular_slot_turn_one_way():
    """Climb milling has the wall on the right of a tool that goes counter-clockwise inside it."""
    body = "CYCL DEF 254 Q215=1 Q219=10 Q375=40 Q216=1 Q217=2 Q376=20 Q248=100 Q366=0"
    for climb in (1, -1):
        commands, _ = hh(f"{body} {CUT}".replace("Q351=1", f"Q351={climb}"))
        outer = [
            k
            for k in np.flatnonzero(commands.motion == ARC)
            if abs(abs(complex(*commands.position[k, :2]) - (1 + 2j)) - 22.0) < 1e-6
            and abs(complex(*commands.centre[k]) - (1 + 2j)) < 1e-6
        ]
        assert outer
        assert {int(np.sign(commands.turns[k])) for k in outer} == {climb}


def test_several_slots_of_one_cycle():
    body = f"CYCL DEF 254 Q215=1 Q219=6 Q375=40 Q216=1 Q217=2 Q376=10 Q248=30 Q378=120 Q377=3 {CUT}"
    z, p = ground(hh(body)[0], 1 + 2j)
    off = np.min([arc_slot(p, 20.0, 10.0 + 120.0 * k, 30.0, 6.0) for k in range(3)], axis=0)
    assert (z[off < -0.15] == -5.0).all()
    assert (z[off > 0.15] == 0.0).all()


STUDS = {
    "rectangle": (f"CYCL DEF 256 Q218=30 Q424=40 Q219=20 Q425=28 Q220=4 Q368=0.3 Q224=30 Q367=0 {CUT}", 30.0),
    "circle": (f"CYCL DEF 257 Q223=24 Q222=36 Q368=0 {CUT}", 0.0),
}


@pytest.mark.parametrize("climb", [1, -1])
@pytest.mark.parametrize("stud", STUDS)
def test_a_stud(stud, climb):
    """The blank is at its depth outside the stud, which is not touched."""
    body, degrees = STUDS[stud]
    commands, _ = hh(f"{body} Q369=0 Q370=1".replace("Q351=1", f"Q351={climb}"))
    z, p = ground(commands, 5 - 3j)
    q = p * cmath.exp(-1j * math.radians(degrees))
    if stud == "rectangle":
        off, blank = rectangle(q, 15.0, 10.0, 4.0), rectangle(q, 20.0, 14.0, 0.0)
    else:
        off, blank = np.abs(q) - 12.0, np.abs(q) - 18.0
    assert (z[off < -0.15] == 0.0).all()
    assert (z[(off > 0.15) & (blank < -0.15)] == -5.0).all()
    wall = commands.motion == ARC
    assert {int(np.sign(t)) for t in commands.turns[wall]} == {-climb}


def test_the_time_of_a_circular_stud():
    """One ring of 12 + 3 + 3 and one of 12 + 3 mm at 500 mm/min, twice; 23 mm is 2 mm beside the blank."""
    commands, _ = hh(f"CYCL DEF 257 Q223=24 Q222=36 Q368=0 Q370=1 {CUT}")
    way = 2 * (5 + math.tau * 18 + 3 + math.tau * 15 + 8)
    assert minutes(commands) == pytest.approx((2 + 2.5 + 2.5) / 100 + way / 500)


@pytest.mark.parametrize("strategy", [0, 1, 2])
@pytest.mark.parametrize(
    ("body", "low", "high"),
    [
        ("CYCL DEF 232 Q225=-10 Q226=4 Q218=30 Q219=14", -10 + 4j, 20 + 18j),
        ("CYCL DEF 232 Q225=20 Q226=18 Q218=-30 Q219=-14", -10 + 4j, 20 + 18j),
        ("CYCL DEF 233 Q215=0 Q350=1 Q218=30 Q219=14 Q367=0", -10 - 10j, 20 + 4j),
        ("CYCL DEF 233 Q215=0 Q350=2 Q218=30 Q219=14 Q367=3", -25 - 17j, 5 - 3j),
    ],
)
def test_a_face(body, low, high, strategy):
    """All of the face is at its depth, and the passes go along it, twice with an odd number of them."""
    commands, findings = hh(f"{body} Q389={strategy} Q369=0.5 Q370=1.5 {FACE}")
    assert {f.code for f in findings if f.severity > Severity.NOTE} == {"nc-pocket-path"}
    z, p = ground(commands, 0.5 * (low + high))
    x, y = 0.5 * (high - low).real, 0.5 * (high - low).imag
    inside = (np.abs(p.real) < x) & (np.abs(p.imag) < y)
    assert (z[inside] == -5.0).all()
    # beside the face nothing is cut but by what the cutter is wider than its step, and its ways beyond
    out = 2.0 + 2.0 * R + 0.2
    assert (z[(np.abs(p.real) > x + out) | (np.abs(p.imag) > y + out)] == 0.0).all()
    assert set(np.unique(commands.position[commands.motion == LINE, 2]).tolist()) >= {-5.0, -4.5, -2.5}


def test_the_time_of_a_face():
    """232 with the allowance 0, one level: 4 passes of 30 mm and twice 5 mm, 3 steps of 3.5 mm, 2 + 3 mm down."""
    face = FACE.replace("-5", "-3").replace("Q202=2.5", "Q202=5")
    commands, _ = hh(f"CYCL DEF 232 Q225=-10 Q226=4 Q218=30 Q219=14 Q389=0 Q369=0 Q370=1.2 {face}")
    assert minutes(commands) == pytest.approx(4 * 40.0 / 500 + (3 * 3.5 + 5.0) / 750)


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (f"CYCL DEF 254 Q219=5 Q375=40 Q216=0 Q217=0 Q376=0 Q248=90 {CUT}", "does not fit"),
        (f"CYCL DEF 254 Q219=8 Q375=40 Q216=0 Q217=0 Q376=0 Q248=90 Q367=1 {CUT}", "Q367 other than 0"),
        (f"CYCL DEF 257 Q223=24 Q222=20 {CUT}", "must be at least the stud"),
        (f"CYCL DEF 232 Q225=0 Q226=0 Q218=30 Q219=14 Q370=1 {FACE}".replace("-5", "+5"), "must be below Q227"),
        (f"CYCL DEF 232 Q225=0 Q226=0 Q218=30 Q219=14 Q370=2.5 {FACE}", "at most the diameter"),
        (f"CYCL DEF 233 Q350=1 Q347=1 Q218=30 Q219=14 Q370=1 {FACE}", "Q347 to Q349"),
    ],
)
def test_what_is_left_out(body, why):
    commands, findings = hh(body)
    assert any(why in f.text and f.severity > Severity.NOTE for f in findings)
    assert (commands.position[:, 2] >= 0.0).all()


SI = "G71 G17 G90 G94 G54\nT1 M6\nS1000 M3\nG0 X0 Y0 Z20\n{}\nM30\n"


def si(body):
    commands, findings = read_gcode(
        SI.format(body), control=control_named("sinumerik"), lenient=True, diameters={1: 2 * R}
    )
    return commands, [f for f in findings if f.severity > Severity.NOTE]


def straight_slots(p, count, first, between, radius, length, width):
    """Distance of points from slots with round ends that begin on a circle, below 0 inside."""
    out = []
    for k in range(count):
        q = p * cmath.exp(-1j * math.radians(first + k * between)) - (radius + 0.5 * length)
        out.append(rectangle(q, 0.5 * length, 0.5 * width, 0.5 * width))
    return np.min(out, axis=0)


@pytest.mark.parametrize(
    ("body", "slots"),
    [
        ("LONGHOLE(10,0,2,-5,,3,14,1,2,8,10,0,100,500,2.5)", (3, 10.0, 120.0, 8.0, 14.0, 6.0)),
        ("LONGHOLE(10,0,2,,5,2,14,1,2,8,10,90,100,500,2.5)", (2, 10.0, 90.0, 8.0, 14.0, 6.0)),
        ("SLOT1(10,0,2,-5,,2,20,9,1,2,8,30,0,100,500,2.5,0,0.3,0,5,400,,0.2)", (2, 30.0, 180.0, 8.0, 20.0, 9.0)),
        ("SLOT1(10,0,2,-5,,4,20,9,1,2,8,30,90,100,500,2.5,1)", (4, 30.0, 90.0, 8.0, 20.0, 9.0)),
    ],
)
def test_straight_slots_on_a_circle(body, slots):
    commands, findings = si(body)
    assert codes(findings) == ["nc-pocket-path"]
    z, p = ground(commands, 1 + 2j)
    off = straight_slots(p, *slots)
    assert (z[off < -0.15] == -5.0).all()
    assert (z[off > 0.15] == 0.0).all()
    assert commands.position[-1, 2] == 10.0


@pytest.mark.parametrize("finishing", ["", ",0.3,0,5,400"])
def test_slots_along_a_circle(finishing):
    z, p = ground(si(f"SLOT2(10,0,2,-5,,3,70,9,1,2,20,30,0,100,500,2.5,0{finishing})")[0], 1 + 2j)
    off = np.min([arc_slot(p, 20.0, 30.0 + 120.0 * k, 70.0, 9.0) for k in range(3)], axis=0)
    assert (z[off < -0.15] == -5.0).all()
    assert (z[off > 0.15] == 0.0).all()


@pytest.mark.parametrize(("cdir", "sense"), [(0, -1), (1, 1), (2, -1), (3, 1)])
@pytest.mark.parametrize(
    ("body", "round_one"),
    [
        ("CYCLE76(10,0,2,-5,,30,20,4,1,2,30,2.5,0,0,500,100,{},1,40,28)", False),
        ("CYCLE77(10,0,2,,5,24,1,2,2.5,0,0,500,100,{},1,36)", True),
    ],
)
def test_a_spigot_of_a_sinumerik(body, round_one, cdir, sense):
    """As a stud of a Heidenhain; the blank of 40 x 28, or of the diameter 36, is at its depth, the spigot stands."""
    commands, findings = si(body.format(cdir))
    assert codes(findings) == ["nc-pocket-path"]
    z, p = ground(commands, 1 + 2j)
    q = p * cmath.exp(-1j * math.radians(0.0 if round_one else 30.0))
    off = np.abs(q) - 12.0 if round_one else rectangle(q, 15.0, 10.0, 4.0)
    blank = np.abs(q) - 18.0 if round_one else rectangle(q, 20.0, 14.0, 0.0)
    assert (z[off < -0.15] == 0.0).all()
    assert (z[(off > 0.15) & (blank < -0.15)] == -5.0).all()
    assert {int(np.sign(t)) for t in commands.turns[commands.motion == ARC]} == {sense}
    assert commands.position[-1, 2] == 10.0


def test_allowances_of_a_spigot():
    """Roughing leaves 0.5 mm on the wall and 1 mm on the floor, finishing takes both: 12 + 3 mm is its ring."""
    rough_z, p = ground(si("CYCLE77(10,0,2,-5,,24,1,2,2.5,0.5,1,500,100,0,1,36)")[0], 1 + 2j)
    off = np.abs(p) - 12.0
    assert (rough_z[off < 0.35] == 0.0).all()
    assert rough_z.min() == -4.0
    commands, _ = si("CYCLE77(10,0,2,-5,,24,1,2,5,0.5,1,500,100,0,2,36)")
    fine_z, _ = ground(commands, 1 + 2j)
    assert (fine_z[(off > 0.15) & (off < 0.5)] == -5.0).all()
    arcs = commands.position[commands.motion == ARC][:, :2] - (1.0, 2.0)
    np.testing.assert_allclose(np.hypot(*arcs.T), 15.0)


@pytest.mark.parametrize("vari", [11, 21, 31, 41])
@pytest.mark.parametrize(("length", "width"), [(30.0, 14.0), (-30.0, -14.0)])
def test_a_face_of_a_sinumerik(vari, length, width):
    commands, findings = si(f"CYCLE71(10,0,2,-5,1,2,{length},{width},30,2.5,4,3,0,500,{vari},0)")
    assert codes(findings) == ["nc-pocket-path"]
    z, p = ground(commands, 1 + 2j)
    q = p * cmath.exp(-1j * math.radians(30.0)) / math.copysign(1.0, length)
    # the places along a pass are 0.1 mm apart
    inside = (q.real > 0.05) & (q.real < 29.95) & (q.imag > 0.05) & (q.imag < 13.95)
    assert (z[inside] == -5.0).all()
    beyond = 3.0 + 2.0 * R + 0.2
    far = (q.real < -beyond) | (q.real > 30.0 + beyond) | (q.imag < -beyond) | (q.imag > 14.0 + beyond)
    assert (z[far] == 0.0).all()


@pytest.mark.parametrize(
    ("body", "why"),
    [
        ("LONGHOLE(10,0,2,-5,,3,5,1,2,8,10,0,100,500,2.5)", "LENG = 5 mm"),
        ("LONGHOLE(10,0,2,,,3,14,1,2,8,10)", "DP or DPR must be given"),
        ("SLOT1(10,0,2,-5,,2,20,5,1,2,8,30,0,100,500)", "does not fit"),
        ("SLOT2(10,0,2,-5,,3,70)", "WID, CPA, CPO, RAD, STA1 must be given"),
        ("CYCLE71(10,0,2,-5,1,2,30,14,30,2.5,4,3,0,500,51)", "must be 11 to 42"),
    ],
)
def test_slots_and_faces_that_are_not_read(body, why):
    commands, findings = si(body)
    assert any(why in f.text for f in findings)
    assert (commands.position[:, 2] >= 2.0).all()
