"""CL data records, each against numbers worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError, Severity
from chipload.program.apt.cutters import read_cutters
from chipload.program.apt.reader import read_apt, read_apt_file
from chipload.program.apt.writer import write_apt
from chipload.program.motions import lengths, sweeps
from chipload.program.program import ARC_CCW, ARC_CW, DWELL, LINE, RAPID
from chipload.program.release import NOT_SIMULATED
from program.apt.cl_points import read_cl_points

HEAD = "UNITS/MM\nSPINDL/600,RPM,CLW\nRAPID\nGOTO/0,0,10\nFEDRAT/60,MMPM\n"


def read(body, head=HEAD, **options):
    return read_apt(head + body + "\nFINI\n", **options)


def ends(program, first=1):
    return program.p_work[first:].round(9).tolist()


def test_modes_of_a_feed():
    """One mm/s, two inches a minute, 0.1 mm in a turn at 10 turns a second, and the unit that was last said."""
    text = (
        "GOTO/1,0,0\nFEDRAT/IPM,2\nGOTO/2,0,0\nFEDRAT/.1,MMPR\nGOTO/3,0,0\nFEDRAT/.2\nGOTO/4,0,0\nFEDRAT/120,MMPM\n"
        "GOTO/5,0,0"
    )
    program, findings = read(text)
    np.testing.assert_allclose(program.feed[1:], [1.0, 50.8 / 60.0, 1.0, 2.0, 2.0])
    assert findings == ()


def test_inches():
    program, _ = read_apt(
        "UNITS/INCHES\nRAPID\nGOTO/1,2,3\nFEDRAT/60\nGODLTA/1,0,0\nCIRCLE/2,3,3,0,0,1\nGOTO/3,3,3\nFINI"
    )
    np.testing.assert_allclose(program.p_work, [[25.4, 50.8, 76.2], [50.8, 50.8, 76.2], [76.2, 76.2, 76.2]])
    np.testing.assert_allclose(program.feed, [0.0, 25.4, 25.4])
    np.testing.assert_allclose(program.centre[2], [50.8, 76.2, 76.2])


def test_no_units_is_said_and_can_be_given():
    program, findings = read_apt("RAPID\nGOTO/1,0,0\nFINI", units="inch")
    assert program.p_work[0, 0] == 25.4
    assert findings == ()
    program, findings = read_apt("RAPID\nGOTO/1,0,0\nFINI")
    assert program.p_work[0, 0] == 1.0
    assert [(f.code, f.line, f.severity) for f in findings] == [("apt-units", 2, Severity.UNPROVEN)]


def test_rapid_holds_for_one_motion():
    program, _ = read("RAPID\nGOTO/1,0,0\nGOTO/2,0,0\nRAPID/\nGODLTA/0,0,1\nGODLTA/-2")
    assert program.motion.tolist() == [RAPID, RAPID, LINE, RAPID, LINE]
    assert ends(program, 3) == [[2, 0, 1], [2, 0, -1]]


def test_axis_is_kept_scaled_and_reset():
    program, findings = read("MULTAX/ON\nGOTO/1,0,0,0,6,8\nGOTO/2,0,0\nGODLTA/5\nMULTAX/OFF\nGOTO/3,0,0")
    assert program.axis[1:].tolist() == [[0, 0.6, 0.8]] * 3 + [[0, 0, 1]]
    assert ends(program, 3)[0] == [2, 3, 4]
    assert [(f.code, f.line) for f in findings] == [("apt-axis", 7)]


def test_arcs_turn_about_their_normal():
    """Quarter turns from (0, 0, 10): about +Z, -Z, and in the plane of X and Z about +Y through (5, y, 10)."""
    text = "CIRCLE/0,5,10,0,0,1\nGOTO/5,5,10\nCIRCLE/5,0,10,0,0,-1,5\nGOTO/10,0,10\nCIRCLE/5,9,10,0,2,0\nGOTO/5,0,15"
    program, findings = read(text)
    assert findings == ()
    assert program.motion[1:].tolist() == [ARC_CCW, ARC_CW, ARC_CCW]
    assert program.normal[1:].tolist() == [[0, 0, 1], [0, 0, 1], [0, 1, 0]]
    np.testing.assert_allclose(sweeps(program)[1:], [0.5 * math.pi, -0.5 * math.pi, 1.5 * math.pi])


def test_a_helical_arc_rises_along_its_normal():
    program, findings = read("CIRCLE/0,5,-3,0,0,1\nGOTO/5,5,20")
    assert findings == ()
    assert lengths(program)[1] == pytest.approx(math.hypot(2.5 * math.pi, 10.0))


def test_cutters():
    text = (
        "CUTTER/10,1,4,1,0,0,22\nLOADTL/3\nGOTO/1,0,0\nLOADTL/4\nUNITS/INCHES\nCUTTER/1,.1\nGOTO/2,0,0\n"
        "LOADTL/3\nCUTTER/2\nGOTO/3,0,0\nCUTTER/3\nGOTO/4,0,0"
    )
    shapes, findings = read_cutters(HEAD + text)
    assert shapes[3] == (10, 1, 4, 1, 0, 0, 22)
    np.testing.assert_allclose(shapes[4], [25.4, 2.54, 10.16, 2.54, 0, 0, 0])
    assert [f.line for f in findings] == [14, 16]
    _, findings = read(text)
    assert [(f.code, f.line) for f in findings] == [("apt-cutter", 16)]


def test_cutters_that_are_written():
    mill = Cutter(16.0, 4, 0.5, 22.0, 35.0, 6e5, corner_radius=1.0, bottom=math.radians(10.0), taper=math.radians(5.0))
    start = read("GOTO/0,0,0")[0]
    text = write_apt(start, {0: mill}, title="x", release=NOT_SIMULATED)
    np.testing.assert_allclose(read_cutters(text)[0][0], mill.apt, atol=1e-6)


def test_an_arc_with_ends_that_differ_is_centred_or_refused():
    program, findings = read("CIRCLE/5,0,10,0,0,1,9\nGOTO/10.01,0,10")
    assert program.centre[1].round(9).tolist() == [5.005, 0, 10]
    assert [f.code for f in findings] == ["apt-arc", "apt-arc"]
    with pytest.raises(InputError, match=r"^line 7: an arc starts 5 mm from its centre and ends 6 mm"):
        read("CIRCLE/5,0,10,0,0,1\nGOTO/11,0,10")


def test_a_row_that_only_turns_counts_degrees():
    program, findings = read("GOTO/0,0,0\nFEDRAT/90,DPM\nGOTO/0,0,0,0,1,0")
    assert program.feed[2] == pytest.approx(math.radians(1.5))
    assert findings == ()
    program, findings = read("GOTO/0,0,0\nGOTO/0,0,0,0,1,0")
    assert program.feed[2] == pytest.approx(math.radians(1.0))
    assert [f.code for f in findings] == ["apt-turn"]
    with pytest.raises(InputError, match="line 7: a feed in degrees a minute, but the tip moves"):
        read("FEDRAT/90,DPM\nGOTO/0,0,0")


def test_spindle_tool_dwell_and_labels():
    text = (
        "LOADTL/4\nPPRINT  wall, left\nGOTO/1,0,0\nSPINDL/CCLW\nDELAY/2\nDELAY/5,REV\nSPINDL/OFF\nTOOLNO/7,1\n"
        "GOTO/2,0,0\nSPINDL/ON\nLOAD/TOOL,9\nGOTO/3,0,0"
    )
    program, findings = read(text, name="part")
    turn = 20.0 * math.pi
    assert program.motion.tolist() == [RAPID, LINE, DWELL, DWELL, LINE, LINE]
    np.testing.assert_allclose(program.spindle, [turn, turn, -turn, -turn, 0.0, -turn])
    np.testing.assert_allclose(program.feed[2:4], [2.0, 0.5])
    assert program.tool.tolist() == [0, 4, 4, 4, 7, 9]
    assert [program.labels[k] for k in program.label[:2]] == ["part", "wall, left"]
    assert findings == ()


def test_layout_of_the_text():
    """Small letters, blanks, comments, a record over three lines, text that holds a dollar and a slash."""
    text = (
        "$$-> CSYS / 2, 0, $\n 0, 3\n$$ nothing $\nPPRINT 5$ a/b $$ kept\n"
        "goto / 1, $ note\n 2.5E0,$\n$$ between\n-.5D1 $$ end"
    )
    program, findings = read(text)
    assert ends(program) == [[1, 2.5, -5]]
    assert program.labels[1] == "5$ a/b $$ kept"
    assert [(f.code, f.line) for f in findings] == [("apt-comment", 6)]


def test_what_is_not_held_is_named():
    _, findings = read("COOLNT/FLOOD\nINSERT/M7\nWHAT/1,2\nCUTCOM/LEFT\nCUTCOM/OFF\nSTOP\nGOTO/0,0,0")
    assert [(f.code, f.line) for f in findings] == [
        ("apt-unused", 6),
        ("apt-unused", 7),
        ("apt-unknown", 8),
        ("apt-cutcom", 9),
        ("apt-unused", 10),
        ("apt-unused", 11),
    ]
    assert findings[2].text == "WHAT/1,2"
    _, findings = read_apt(HEAD + "GOTO/0,0,0\nEND\nGOTO/1,1,1\nGOTO/2,2,2")
    assert [(f.code, f.line) for f in findings] == [("apt-after-end", 8)]
    _, findings = read_apt(HEAD + "W/1\n" * 1500)
    assert len(findings) == 1001
    assert findings[-1].text == "501 more findings are not listed"


CSYS = "CSYS/0,-1,0,3,1,0,0,4,0,0,1,5\n"


def test_csys():
    """A takes X to Y, and p = A' p_work + t: work (1, 2, 3) is A' (1, 2, 3) + t = (2, -1, 3) + (3, 4, 5)."""
    local, said = read("TRNTYP/LOCAL\n" + CSYS + "GOTO/5,3,8,1,0,0")
    np.testing.assert_allclose(local.p_work[1], [1, 2, 3], atol=1e-12)
    np.testing.assert_allclose(local.axis[1], [0, 1, 0], atol=1e-12)
    world, _ = read("TRNTYP/WORLD,0,0,0\n" + CSYS + "GOTO/5,3,8,1,0,0")
    assert world.p_work[1].tolist() == [5, 3, 8]
    assert world.axis[1].tolist() == [1, 0, 0]
    assert [f.code for f in said] == ["apt-coordinates"]
    with pytest.raises(InputError, match="line 6: CSYS without TRNTYP"):
        read(CSYS + "GOTO/5,3,8")
    assert read(CSYS + "GOTO/5,3,8", csys="work")[0].p_work[1].tolist() == [5, 3, 8]


def test_a_tilted_csys_tilts_tool_and_arcs():
    """Z of the CSYS along work -Y: under WORLD its third axis is the tool's; under LOCAL arcs about Z turn about -Y."""
    tilt = "CSYS/1,0,0,0,0,0,-1,0,0,1,0,0\n"
    program, _ = read("TRNTYP/WORLD\n" + tilt + "GOTO/1,2,3")
    assert program.axis[1].tolist() == [0, -1, 0]
    program, _ = read("TRNTYP/LOCAL\n" + tilt + "RAPID\nGOTO/0,0,0\nCIRCLE/5,0,0,0,0,1\nGOTO/5,-5,0")
    np.testing.assert_allclose(program.p_work[2], [5, 0, -5], atol=1e-12)
    np.testing.assert_allclose(sweeps(program)[2] * program.normal[2], [0, -0.5 * math.pi, 0], atol=1e-12)


def test_rotabl():
    program, _ = read("TLAXIS/0,-1,0\nROTABL/90,AAXIS,TABLE,CCLW\nGOTO/1,2,3")
    np.testing.assert_allclose(program.p_work[1], [1, -3, 2], atol=1e-12)
    np.testing.assert_allclose(program.axis[1], [0, -1, 0], atol=1e-12)
    for text in (
        "ROTABL/90,AAXIS\n",
        "TLAXIS/0,1,0\nROTABL/90,AAXIS\n",
        "TLAXIS/0,1,0\nROTABL/AAXIS,9\nROTABL/BAXIS,9\n",
    ):
        with pytest.raises(InputError, match="ROTABL"):
            read(text + "GOTO/1,2,3")


def test_drill():
    """Up to 25 over the point first, over it, down to 3, to the depth, dwell, out."""
    program, findings = read(
        "CYCLE/DRILL,FEDTO,5,MMPM,120,RAPTO,3,RTRCTO,25,DWELL,.5\nGOTO/7,8,0\nGOTO/9,8,-1\nCYCLE/OFF\nGOTO/9,8,30"
    )
    assert findings == ()
    rows = [[0, 0, 25], [7, 8, 25], [7, 8, 3], [7, 8, -5], [7, 8, -5], [7, 8, 25]]
    rows += [[9, 8, 25], [9, 8, 2], [9, 8, -6], [9, 8, -6], [9, 8, 24], [9, 8, 30]]
    assert ends(program) == rows
    assert program.motion[1:].tolist() == [0, 0, 0, 1, 4, 0, 0, 0, 1, 4, 0, 1]
    assert program.feed[[4, 5, 12]].tolist() == [2.0, 0.5, 1.0]


def test_pecks():
    program, _ = read("CYCLE/DEEP2,FEDTO,9,1STPECK,5,SUBPECK,3,RAPTO,1\nGOTO/0,0,0")
    heights = [1, -5, 1, -4.746, -8, 1, -7.746, -9, 1]
    assert ends(program) == [[0, 0, 10], *([0, 0, h] for h in heights)]
    program, _ = read("CYCLE/BRKCHP,DEPTH,4,STEP,3,CLEAR,2\nGOTO/0,0,0")
    assert program.p_work[2:, 2].round(9).tolist() == [2, -3, -2.746, -4, 2]
    program, _ = read("CYCLE/ DRILL,G98,9.,PECKING,5.,3.,MMPM,60.,1.,20. 20. DWELL,0.\nGOTO/0,0,0")
    assert program.p_work[1:, 2].round(9).tolist() == [20, 20, *heights[:-1], 20]


def test_a_hole_along_a_tilted_axis_and_feed_out():
    program, _ = read("RAPID\nGOTO/50,0,0,1,0,0\nCYCLE/REAM,DEPTH,5,CLEAR,10\nGOTO/0,0,0")
    assert ends(program, 2) == [[50, 0, 0], [10, 0, 0], [-5, 0, 0], [10, 0, 0]]
    assert program.motion[2:].tolist() == [RAPID, RAPID, LINE, LINE]


def test_tap_turns_back():
    program, _ = read("CYCLE/TAP,DEPTH,5,CLEAR,2,MMPR,1.5\nGOTO/0,0,0\nCYCLE/OFF\nGOTO/1,0,2")
    turn = 20.0 * math.pi
    np.testing.assert_allclose(program.spindle[-4:], [turn, turn, -turn, turn])
    np.testing.assert_allclose(program.feed[-3:], [15.0, 15.0, 1.0])


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("CYCLE/DRILL,FEDTO,5\nGOTO/0,0,0", "line 6: CYCLE/DRILL,FEDTO,5: must state the depth"),
        ("CYCLE/DEEP,FEDTO,5,RAPTO,1,STEP,0", "pecks must be above 0"),
        ("CYCLE/DEEP,FEDTO,5,RAPTO,1,STEP,1E-6", "makes more than 10000 pecks"),
        ("GOTO/1,2", "line 6: GOTO/1,2: has 2 numbers: must have 3 or 6"),
        ("GOTO/1,2,1E10", "'1E10' must be a number of at most 1e\\+09"),
        ("GOTO/1,2,3,0,0,0", "must have a length above 0"),
        ("TRACUT/M1", "line 6: TRACUT/M1: changes the coordinates or the order of the records and is not read"),
        ("FEDRAT/INVERS,3", "line 6: FEDRAT/INVERS,3: must have one number"),
        ("SPINDL/300,SFM,CLW", "must have one number and RPM"),
        ("LOADTL/1.5", "must be a whole number"),
        ("UNITS/FEET", "must be MM, CM or INCHES"),
        ("CSYS/1,0,0,0,0,2,0,0,0,0,1,0", "unit vectors at right angles"),
        ("FEDRAT/0\nGOTO/1,1,1", "line 7: a cutting motion at feed 0"),
        ("SPINDL/OFF\nFEDRAT/.1,MMPR\nGOTO/1,1,1", "line 8: a feed per turn with the spindle at rest"),
    ],
)
def test_refused(body, message):
    with pytest.raises(InputError, match=message):
        read(body)


def test_a_missing_feed_is_not_guessed():
    text = "UNITS/MM\nGOTO/0,0,0\nGOTO/1,0,0\nFINI"
    with pytest.raises(InputError) as err:
        read_apt(text)
    assert str(err.value) == "line 3: a cutting motion without a feed: no FEDRAT before it: give a feed"
    program, findings = read_apt(text, feed=12.0)
    assert program.feed.tolist() == [0.0, 12.0]
    assert [f.code for f in findings] == ["apt-start"]


def test_no_point_and_no_file(tmp_path):
    with pytest.raises(InputError, match="x: no point: CL data must have at least one GOTO"):
        read_apt("PARTNO/1\nFINI", name="x")
    with pytest.raises(InputError, match=r"none\.apt: cannot be read: No such file or directory"):
        read_apt_file(tmp_path / "none.apt")
    (tmp_path / "one.apt").write_bytes((HEAD + "FINI").encode())
    assert read_apt_file(tmp_path / "one.apt")[0].labels == ("one",)


def test_tables():
    program, _ = read_cl_points("# x y z\n1 2 3\n\n4,5,6\n", feed=2.0, spindle=-3.0, tool=8)
    assert program.p_work.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert (program.feed[1], program.spindle[1], program.tool[1], program.line[1]) == (2.0, -3.0, 8, 4)
    for text, message in (
        ("1 2 3\n1 2 3 0 0 1", "line 2"),
        ("1 2 x", "line 1"),
        ("1 2", "3 or 6 numbers"),
        ("", "no point"),
    ):
        with pytest.raises(InputError, match=message):
            read_cl_points(text, feed=2.0, spindle=0.0, tool=1)


def test_pecks_of_a_cycle_without_pecks_are_left_out_and_said():
    """CYCLE/DRILL with INCR: the hole is drilled in one go, and a finding on its line says so."""
    head = "UNITS/MM\nLOADTL/1\nSPINDL/1000,RPM,CLW\nFEDRAT/100,MMPM\nGOTO/0,0,5\n"
    plain, _ = read_apt(f"{head}CYCLE/DRILL,DEPTH,5,CLEAR,2\nGOTO/0,0,0\nCYCLE/OFF\nFINI\n")
    pecks, findings = read_apt(f"{head}CYCLE/DRILL,DEPTH,5,INCR,1,CLEAR,2\nGOTO/0,0,0\nCYCLE/OFF\nFINI\n")
    assert pecks.p_work.tolist() == plain.p_work.tolist()
    (found,) = [f for f in findings if f.severity >= Severity.UNPROVEN]
    assert found.line == 6
    assert "pecks" in found.text
