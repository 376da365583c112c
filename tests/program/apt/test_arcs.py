"""Arcs, cycles and motions of CL data as several CAM systems write them; arcs against closed forms."""

import math

import numpy as np
import pytest

from chipload.errors import Severity
from chipload.program.apt.reader import read_apt
from chipload.program.motions import lengths, sweeps
from chipload.program.program import ARC_CCW, ARC_CW, LINE

HEAD = "UNITS/MM\nSPINDL/600,RPM,CLW\nRAPID\nGOTO/10,0,5\nFEDRAT/60,MMPM\n"


def read(body, head=HEAD, **options):
    return read_apt(head + body + "\nFINI\n", **options)


def quarter(angle: float) -> str:
    """Two numbers on the circle of radius 10 about the origin, at height 5."""
    return f"{10 * math.cos(angle):.6f},{10 * math.sin(angle):.6f},5"


CATIA = (
    "AUTOPS\nINDIRV/ 0.00000, {sense}.00000, 0.00000\nTLON,GOFWD/ (CIRCLE/    0.00000,    0.00000,    5.00000,$\n"
    "   10.00000),ON,{more}(LINE/    0.00000,    0.00000,    5.00000,$\n   {end})\n"
)


@pytest.mark.parametrize(("sense", "motion"), [(1, ARC_CCW), (-1, ARC_CW)])
@pytest.mark.parametrize("degrees", [30.0, 90.0, 170.0, 200.0, 300.0])
def test_a_tlon_goes_along_its_circle_in_the_direction_of_indirv(sense, motion, degrees):
    angle = math.radians(sense * degrees)
    more = "2,INTOF,$\n" if degrees > 180.0 else ""
    program, findings = read(CATIA.format(sense=sense, more=more, end=quarter(angle)) + "GOTO/0,0,5")
    assert program.motion[1:].tolist() == [motion, LINE]
    assert program.p_work[1] == pytest.approx([10 * math.cos(angle), 10 * math.sin(angle), 5.0], abs=1e-5)
    assert lengths(program)[1] == pytest.approx(10.0 * math.radians(degrees), rel=1e-6)
    assert max((f.severity for f in findings), default=Severity.NOTE) is Severity.NOTE


def test_a_tlon_on_a_turned_table_and_in_inches():
    """The same arc in axes that stand still, the table turned by 90 deg about X: in the work it lies in XZ."""
    text = "ROTABL/90,AAXIS,TABLE,CCLW\nTLAXIS/0,-1,0\nGOTO/1,0,0\nINDIRV/0,1,0\n"
    text += "TLON,GOFWD/(CIRCLE/0,0,0,1),ON,(LINE/0,0,0,0,1,0)"
    program, _ = read(text, head="UNITS/INCHES\nRAPID\nGOTO/0,0,5\nFEDRAT/10,IPM\n")
    assert program.motion[-1] in (ARC_CW, ARC_CCW)
    assert np.linalg.norm(program.p_work[-1]) == pytest.approx(25.4)
    assert lengths(program)[-1] == pytest.approx(25.4 * math.pi / 2.0)


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (CATIA.format(sense=1, more="", end="0,0,5"), "must have a length"),
        (CATIA.format(sense=1, more="", end="1,0"), "must have four numbers of its circle and six of its line"),
        ("TLON,GOFWD/(CIRCLE/0,0,5,10),ON,(LINE/0,0,5,0,1,5)", "needs a point and INDIRV before it"),
        ("INDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0,0,5,9),ON,(LINE/0,0,5,0,1,5)", "must be on its circle of radius 9"),
        ("TLLFT,GOLFT/C1", "moves the tool and is not read: left out"),
        ("GOHOME", "moves the tool and is not read: left out"),
        ("ORIGIN/10,0,0", "points are taken unchanged"),
        ("CIRCLE/0,0,10", "no centre and axis of six numbers: the tool moves to the next point in a straight line"),
        ("MOVARC/0,0,5,0,0,1,10,ANGLE", "ANGLE without a number of degrees"),
        ("MOVARC/0,0,5,0,0,1,10,ANGLE,45\nGOTO/0,10,5", "the GOTO after it gives a sweep of 90 deg, which is cut"),
        ("CYCLE/MILL,5\nGOTO/5,5,0\nCYCLE/OFF", "CYCLE/MILL,5 is not read: its hole at GOTO/5,5,0 is left out"),
        ("CYCLE/DRILL,DEPTH,5,CLEAR,2,CAM,3\nGOTO/5,5,0", "CAM,3 is not read in a cycle"),
    ],
)
def test_what_is_not_read_leaves_the_program_unproven(body, said):
    program, findings = read(body + "\nGOTO/10,10,5")
    gaps = [f for f in findings if f.severity is Severity.UNPROVEN]
    assert len(gaps) == 1
    assert said in gaps[0].text
    assert gaps[0].line >= 6
    assert program.p_work[-1].tolist()[:2] == [10.0, 10.0]


def test_a_movarc_turns_counter_clockwise_about_its_axis():
    program, findings = read("MOVARC/0,0,5,0,0,-1,10,ANGLE,90\nGOTO/0,-10,5\nORIGIN/0,0,0")
    assert program.motion[-1] == ARC_CW
    assert abs(sweeps(program)[-1]) == pytest.approx(math.pi / 2.0)
    assert [f.severity for f in findings] == [Severity.NOTE]


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (
            "DEEP, 20, INCR, 6, MMPM, 100, 2, RAPTO, 1, DWELL, 0.5",
            "DEEP,FEDTO,20,STEP,6,MMPM,100,CLEAR,2,RAPTO,1,DWELL,.5",
        ),
        ("DEEPHL, 20., INCR, 6., 100., MMPM, 2.", "DEEP,FEDTO,20,STEP,6,MMPM,100,CLEAR,2"),
        ("BRKCHP, FEDTO, 9, INCR, 4, MMPM, 50, CLEAR, 3, RETURN, 5", "BRKCHP,DEPTH,9,STEP,4,MMPM,50,RAPTO,3,RTRCTO,5"),
        ("DRILL, 5, MMPM, 80, 2", "DRILL,DEPTH,5,MMPM,80,CLEAR,2"),
        ("TAP, 8, MMPR, 1.25, 4", "TAP,DEPTH,8,MMPR,1.25,CLEAR,4"),
    ],
)
def test_a_cycle_of_numbers_in_places_is_that_of_named_numbers(one, other):
    holes = "\nGOTO/1,2,0\nGOTO/5,6,-1\nCYCLE/OFF"
    (a, _), (b, _) = read(f"CYCLE/{one}{holes}"), read(f"CYCLE/{other}{holes}")
    np.testing.assert_allclose(a.p_work, b.p_work)
    np.testing.assert_allclose(a.feed, b.feed)
    assert a.motion.tolist() == b.motion.tolist()
    assert len(a) > 6
