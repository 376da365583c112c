"""Conversational blocks against what they mean by hand, loops against plain Python."""

import math
import re

import numpy as np
import pytest

from chipload.errors import InputError, Severity
from chipload.program.commands import ARC, DWELL, LINE, RAPID, arc_sweeps
from chipload.program.heidenhain.formula import QParameters
from chipload.program.heidenhain.reader import read_heidenhain


def read(*blocks, unit="MM", **options):
    return read_heidenhain("\n".join([f"BEGIN PGM T {unit}", *blocks, f"END PGM T {unit}"]), **options)


def test_lines_are_modal_and_incremental():
    c, _ = read("1 L X+10 Y-2.5 Z+50 R0 FMAX M3", "2 L Z 5 F300 ; down", "L IX-4 IY + 1", "L X-1")
    assert c.motion.tolist() == [RAPID, LINE, LINE, LINE]
    np.testing.assert_allclose(c.position[:, :3], [[10, -2.5, 50], [10, -2.5, 5], [6, -1.5, 5], [-1, -1.5, 5]])
    assert c.feed.tolist() == [0, 5, 5, 5]
    assert c.line.tolist() == [2, 3, 4, 5]


def test_inch_and_rotary():
    c, _ = read("L X+1 Y+0 Z+2 A+90 FMAX", "L X+2 F10", unit="INCH")
    np.testing.assert_allclose(c.position[1, :4], [50.8, 0, 50.8, math.pi / 2])
    assert c.feed[1] == pytest.approx(25.4 / 60.0)  # F in tenths of an inch


def test_feeds_in_inches_and_of_the_tool_call():
    """F in tenths of an inch, of rotary axes alone in degrees a minute; F AUTO is the feed of TOOL CALL."""
    c, found = read("TOOL CALL 1 Z S1000 F60", "L X+0 F30", "L X+1 FAUTO", "L A+90 F60", unit="INCH")
    assert c.feed[-3:].tolist() == pytest.approx([1.27, 2.54, 1.0])
    assert not [f for f in found if f.code == "heidenhain-feed-auto"]


def test_arcs_about_the_pole():
    """A quarter each way, a whole turn, two turns of a helix."""
    c, _ = read(
        "L X+10 Y+0 Z+0 FMAX", "CC X+0 Y+0", "C X+0 Y+10 DR+ F600", "C X+10 Y+0 DR-", "C DR+", "CP IPA-720 IZ-6 DR-"
    )  # fmt: skip
    assert c.motion.tolist() == [RAPID, ARC, ARC, ARC, ARC]
    np.testing.assert_allclose(np.degrees(arc_sweeps(c)[1:]), [90, -90, 360, -720], atol=1e-9)
    np.testing.assert_allclose(c.centre[1:], 0.0, atol=1e-12)
    np.testing.assert_allclose(c.position[-1, :3], [10, 0, -6], atol=1e-9)


def test_a_rounded_arc_keeps_its_ends():
    """The pole of a text with three decimals is moved so that both ends are as far from the centre."""
    c, _ = read("L X+10 Y+0 Z+0 FMAX", "CC X+0.001 Y+0.001", "C X+0 Y+10 DR+ F600")
    ends = c.position[:, :2] - c.centre[1]
    assert np.hypot(*ends[0]) == pytest.approx(np.hypot(*ends[1]), abs=1e-12)
    assert np.hypot(*c.centre[1]) < 2e-3


def test_pecking_by_hand():
    """Surface at 25 - 25 = 0: plunges of 3 to 10, stops of 0.6 above, dwell at the bottom."""
    c, _ = read(
        "L X+1 Y+2 Z+25 FMAX M3", "CYCL DEF 1.0 PECKING", "CYCL DEF 1.1 DIST25.000", "CYCL DEF 1.2 DEPTH-7",
        "CYCL DEF 1.3 PLNGNG3.0", "CYCL DEF 1.4 DWELL0.5", "CYCL DEF 1.5 F240", "L FMAX M99", "L X+9 FMAX",
    )  # fmt: skip
    assert c.motion.tolist() == [RAPID, LINE, RAPID, RAPID, LINE, RAPID, RAPID, LINE, DWELL, RAPID, RAPID]
    np.testing.assert_allclose(c.position[:, 2], [25, -3, 25, -2.4, -6, 25, -5.4, -7, -7, 25, 25])
    assert c.feed[1] == 4.0
    assert c.feed[8] == 0.5
    assert c.position[-1, 0] == 9


def test_datum_shift_moves_no_axis():
    c, _ = read("L X+10 Y+0 Z+5 FMAX", "CYCL DEF 7.0 DATUM SHIFT", "CYCL DEF 7.1 X+4", "CYCL DEF 7.2 IY-1", "L X+0 F60")
    np.testing.assert_allclose(c.machine()[:, :3], [[10, 0, 5], [4, 0, 5]])
    np.testing.assert_allclose(c.position[1, :3], [0, 1, 5])


def test_tools_and_spindle():
    c, f = read(
        "TOOL DEF 5 L+30 R+2", "TOOL CALL 5 Z S3000", "L X+0 Y+0 Z+1 FMAX M13", "TOOL CALL S1500", "L Z+0 F60 M5",
        "TOOL CALL 6 Z S100", "L Z+9 FMAX",
    )  # fmt: skip
    assert c.tool.tolist() == [5, 5, 6]
    np.testing.assert_allclose(c.spindle * 60 / math.tau, [3000, 1500, 0])
    assert c.frames[c.frame[0]].tool[2] == 30
    assert {x.code for x in f} == {"nc-coolant", "heidenhain-tool-unknown"}


def test_loops_jumps_and_calls_against_python():
    c, _ = read(
        "FN0: Q1 = +0", "Q2 = 3 * ( 2 + SQRT 16 )", "L X+0 Y+0 Z+0 FMAX", "LBL 1", "Q1 = Q1 + 1", "L X+Q1 Y-Q2 F100",
        "CALL LBL 2", "FN12: IF +Q1 LT +3 GOTO LBL 1", "LBL 3", "L IX+1", "CALL LBL 3 REP 2/2",
        "FN9: IF 1 EQU 1 GOTO LBL 9",
        "LBL 2", "L IZ-0.5", "LBL 0", "LBL 9",
    )  # fmt: skip
    want, x, z = [(0.0, 0.0, 0.0)], 0.0, 0.0
    for k in (1, 2, 3):
        x = float(k)
        want += [(x, -18.0, z), (x, -18.0, z - 0.5)]
        z -= 0.5
    for _ in range(3):
        x += 1
        want.append((x, -18.0, z))
    np.testing.assert_allclose(c.position[:, :3], want)


def test_formulas_against_python():
    q = QParameters({1: 2.5, 7: -4.0})
    for text, value in {
        "Q1 * ( Q7 - 1 ) / 3 ^ 2": 2.5 * (-5) / 9,
        "2 - Q7 ^ 2": 2.0 - 16.0,
        "SIN 30 + COS ( Q1 * 24 )": 0.5 + 0.5,
        "ABS Q7 + FRAC 2.25 + SGN Q7": 4 + 0.25 - 1,
        "2 ^ 3 ^ 2": 2.0**9,
    }.items():
        assert q.formula(text) == pytest.approx(value), text


def test_what_the_controller_knows_may_be_given():
    blocks = ["FN18: SYSREAD Q3 = ID270 NR1 IDX3", "L X+0 Y+0 Z+Q3 FMAX"]
    commands, findings = read(*blocks, "L X+1 FMAX")
    assert commands.position[:, 0].tolist() == [1.0]
    assert [(f.code, f.line, f.severity) for f in findings[1:]] == [("heidenhain-left-out", 3, Severity.UNPROVEN)]
    assert "Q3 comes from the controller and is not known here: state it in program.parameters" in findings[1].text
    _, findings = read(blocks[0], "FN9: IF +Q3 EQU +0 GOTO LBL 1", "LBL 1")
    assert [(f.code, f.line, f.severity) for f in findings[1:]] == [("heidenhain-jump", 3, Severity.UNPROVEN)]
    assert read(*blocks, parameters={3: 7.5})[0].position[0, 2] == 7.5


@pytest.mark.parametrize(
    ("block", "text"),
    [
        ("L X+1 QQ2 FMAX", "'QQ2': is not read in a motion"),
        ("L X+1", "a cut has no feed: give F"),
        ("L X+1 F AUTO", "F AUTO: the feed of a tool table is not known: give a number"),
        ("L X+1 F0", "F0: must be above 0 and below 1e+06"),
        ("CALL LBL 4", "LBL 4 is missing"),
        ("Q1 = Q2", "Q2 is read before it is set: set it"),
        ("Q1 = 1 / 0", "formula: division by 0"),
        ("Q1 = ( 1", "formula: a bracket is not closed"),
        ("C X+1 Y+1 F10", "C: DR+ or DR- is missing"),
        ("CR X+1 Y+1 DR+ F10", "CR: R is missing: the radius"),
        ("QL2000 = 1", "QL2000: must be from QL0 to QL1999"),
        ("FN8: Q1 = 3", "'FN8: Q1 = 3': must be a value, LEN and a value"),
        ("CYCL DEF 221 Q200=2 Q203=0 Q225=0 Q226=0 Q242=0 Q243=1", "Q242 = 0: must be from 1 to 10000"),
    ],
)
def test_refused(block, text):
    with pytest.raises(InputError) as err:
        read(block)
    assert str(err.value) == f"program: line 2: {text}"


def test_a_loop_without_end_is_stopped(monkeypatch):
    monkeypatch.setattr("chipload.program.heidenhain.reader.MOST_BLOCKS", 5000)
    with pytest.raises(InputError, match="more than 5000 blocks are carried out"):
        read("LBL 1", "FN9: IF 1 EQU 1 GOTO LBL 1")
    with pytest.raises(InputError, match="calls are nested deeper than 20"):
        read("LBL 1", "CALL LBL 1")


HOLE = (
    "CYCL DEF 200 DRILLING ~\nQ200=2 ;SET-UP CLEARANCE ~\nQ201=-9 ;DEPTH ~\nQ206=60 ~\nQ202=5 ~\nQ210=0.5 ~\nQ203=+1 ~"
    "\nQ204=20 ~\nQ211=0.25"
)


def test_drilling_with_q_parameters():
    """By hand: surface 1, clearance 2 above it, plunges to -4 and -8, second clearance 20 above."""
    commands, findings = read("L X+0 Y+0 Z+50 FMAX", *HOLE.split("\n"), "L X+5 FMAX M99", "L X+7 FMAX")
    assert commands.position[1:, 2].tolist() == [50, 3, -4, 3, 3, -2, -8, -8, 21, 21]
    assert commands.motion[2:].tolist() == [RAPID, LINE, RAPID, DWELL, RAPID, LINE, DWELL, RAPID, RAPID]
    assert commands.feed[commands.motion == LINE].tolist() == [1.0, 1.0]
    assert commands.feed[commands.motion == DWELL].tolist() == [0.5, 0.25]
    assert findings == ()
    one = " ".join(re.sub(";.*|~", "", line) for line in HOLE.split("\n"))
    again, _ = read("L X+0 Y+0 Z+50 FMAX", one, "L X+5 FMAX M99", "L X+7 FMAX")
    np.testing.assert_array_equal(again.position, commands.position)


def test_rigid_tapping_and_reaming_with_q_parameters():
    tap = "CYCL DEF 207 RIGID TAPPING Q200=2 Q201=-9 Q239=+1.25 Q203=+0 Q204=2"
    commands, _ = read(
        "TOOL DEF 1 L+0 R+4", "TOOL CALL 1 Z S600", "L X+0 Y+0 Z+2 FMAX M3", tap, "CYCL CALL", "L X+1 FMAX"
    )
    fed = commands.motion == LINE
    assert commands.position[fed, 2].tolist() == [-9.0, 2.0]
    # ten turns a second of 1.25 mm
    assert commands.feed[fed].tolist() == pytest.approx([12.5, 12.5])
    assert np.sign(commands.spindle[fed]).tolist() == [1.0, -1.0]
    assert commands.spindle[-1] > 0.0
    ream = "CYCL DEF 201 REAMING Q200=2 Q201=-9 Q206=120 Q211=0 Q208=240 Q203=+0 Q204=0"
    commands, _ = read("L X+0 Y+0 Z+2 FMAX", ream, "CYCL CALL")
    assert commands.feed[commands.motion == LINE].tolist() == [2.0, 4.0]


def test_a_cycle_that_is_not_read_is_left_out_where_it_is_called():
    commands, findings = read("L X+0 Y+0 Z+2 FMAX", "CYCL DEF 255 SLOT Q218=60", "L X+5 FMAX M99", "L X+9 FMAX")
    assert commands.position[:, 0].tolist() == [0.0, 5.0, 9.0]
    assert [(f.code, f.line, f.severity) for f in findings] == [("heidenhain-cycle", 4, Severity.UNPROVEN)]
    with pytest.raises(InputError, match="Q206 is read before it is set"):
        read("L X+0 Y+0 Z+2 FMAX", "CYCL DEF 201 REAMING Q200=2 Q201=-9 Q203=+0", "CYCL CALL")


@pytest.mark.parametrize(
    ("block", "code"),
    [
        ("L IX+1 F10", "heidenhain-left-out"),
        ("C X+1 Y+1 DR+ F10", "heidenhain-left-out"),
        ("L M99", "heidenhain-left-out"),
        ("CALL PGM X", "heidenhain-call"),
        ("TCH PROBE 400", "heidenhain-unread"),
        ("PATTERN DEF STAR1 ( X+1 Y+2 Z+0 )", "heidenhain-left-out"),
        ("CYCL CALL PAT FMAX", "heidenhain-left-out"),
        ("RND R2", "heidenhain-corner"),
        ("FN26: TABOPEN TNC:/DIR1/TAB1.TAB", "heidenhain-function"),
    ],
)
def test_what_is_not_read_is_left_out_and_the_rest_is_carried_out(block, code):
    commands, findings = read(*(["CC X+0 Y+0"] if block.startswith("C X") else []), block, "L X+4 FMAX")
    assert commands.position[:, 0].tolist() == [4.0]
    assert [(f.code, f.severity) for f in findings] == [(code, Severity.UNPROVEN)]


@pytest.mark.parametrize(
    ("on", "off"),
    [
        ("PLANE SPATIAL SPA+0 SPB+30 SPC+0 STAY", "PLANE RESET STAY"),
        ("CYCL DEF 19.1 A+10 B+0 C+0", "CYCL DEF 19.1 A+0 B+0 C+0"),
    ],
)
def test_motions_in_changed_coordinates_are_left_out_until_they_end(on, off):
    commands, findings = read("L X+0 Y+0 Z+5 FMAX", on, "L X+1 FMAX", off, "L X+2 FMAX")
    assert commands.position[:, 0].tolist() == [0.0, 2.0]
    assert [(f.code, f.line, f.severity) for f in findings] == [("heidenhain-plane", 3, Severity.UNPROVEN)]


def test_a_plane_that_is_not_tilted_changes_nothing():
    for block in ("PLANE SPATIAL SPA+0 SPB+0 SPC+0 STAY", "PLANE RESET STAY", "CYCL DEF 19.1 A+0 B+0"):
        commands, findings = read("L X+0 Y+0 Z+5 FMAX", block, "L X+1 FMAX")
        assert len(commands) == 2
        assert findings == ()


def test_programs_that_are_called_lie_beside(tmp_path):
    (tmp_path / "step.h").write_text("BEGIN PGM STEP INCH\nL IX+1 F10\nEND PGM STEP INCH\n")
    commands, findings = read("L X+0 Y+0 Z+5 FMAX", "CALL PGM STEP", "L IX+1", folder=tmp_path)
    np.testing.assert_allclose(commands.position[:, 0], [0.0, 25.4, 26.4])
    assert findings == ()
    # a motion of a called program has the line that calls it
    assert commands.line.tolist() == [2, 3, 4]


def test_labels_by_name_and_by_parameter():
    commands, _ = read(
        "L X+0 Y+0 Z+0 FMAX", "Q5 = 7", 'CALL LBL "SLOT"', "CALL LBL Q5", "FN9: IF +1 EQU +1 GOTO LBL 9",
        'LBL "SLOT"', "L X+1 F60", "LBL 0", "LBL 7", "L X+2", "LBL 0", "LBL 9",
    )  # fmt: skip
    assert commands.position[:, 0].tolist() == [0.0, 1.0, 2.0]


def test_parameters_of_a_program_and_sides_of_a_triangle():
    commands, _ = read(
        "QL1 = 3", "QR1 = 4", "FN8: Q1 = +QL1 LEN +QR1", "FN13: Q2 = +QR1 ANG +QL1", "FN6: Q3 = SIN +Q2",
        "L X+Q1 Y+Q3 Z+QL1 FMAX",
    )  # fmt: skip
    np.testing.assert_allclose(commands.position[0, :3], [5.0, 0.8, 3.0])


def test_structure_blocks_label_the_motions():
    commands, _ = read("10 * - Pocket 1", "L X+1 FMAX", "* - Drill", "L X+2 FMAX")
    assert [commands.labels[k] for k in commands.label] == ["POCKET 1", "DRILL"]


def test_feed_for_each_turn():
    """600 rpm are ten turns a second; M136 makes F one too."""
    commands, _ = read(
        "TOOL CALL 1 Z S600", "L X+0 Y+0 Z+0 FMAX", "L X+1 FU0.2", "M136", "L X+2 F0.3", "M137", "L X+3 F60"
    )
    assert commands.feed.tolist() == pytest.approx([0.0, 2.0, 3.0, 1.0])


def test_a_feed_from_outside_and_retraction_along_the_tool():
    commands, findings = read("L X+0 Y+0 Z+0 FMAX", "L X+1", "M140 MB5", "L Z+9 M140 MB MAX", feed=3.0)
    assert commands.feed.tolist() == [0.0, 3.0, 0.0, 3.0]
    assert commands.position[:, 2].tolist() == [0.0, 0.0, 5.0, 9.0]
    assert [f.code for f in findings] == ["heidenhain-m91"]


def test_tools_by_name_and_with_changes():
    commands, findings = read('TOOL CALL "D10" Z S100 DL+0.5', "L X+0 FMAX", "Q1 = 4", "TOOL CALL Q1 Z", "L X+1 FMAX")
    assert commands.tool.tolist() == [9001, 4]
    assert commands.frames[commands.frame[0]].tool[2] == 0.5
    assert {f.code for f in findings} == {"nc-tool-unknown", "heidenhain-tool-unknown"}
