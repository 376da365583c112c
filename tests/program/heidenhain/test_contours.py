"""Contours of conversational programs: radius compensation, arcs by radius and by tangent, polar words; by hand."""

import math

import numpy as np
import pytest

from chipload.errors import InputError, Severity
from chipload.program.commands import ARC, LINE, RAPID, arc_sweeps
from chipload.program.heidenhain.reader import read_heidenhain

TOOL = ("TOOL DEF 1 L+0 R+4", "TOOL CALL 1 Z S1000", "L X-20 Y-20 Z-5 FMAX M3")


def read(*blocks, **options):
    return read_heidenhain("\n".join(["BEGIN PGM T MM", *blocks, "END PGM T MM"]), **options)


def xy(commands):
    return commands.position[:, :2]


def test_left_of_a_square():
    """Clockwise about a square of 30 mm, tool outside: square to its first edge, round the corners, back off."""
    c, findings = read(
        *TOOL, "L X+0 Y+0 RL F300", "L X+0 Y+30", "L X+30 Y+30", "L X+30 Y+0", "L X+0 Y+0", "L X-20 Y-20 R0 FMAX"
    )  # fmt: skip
    ends = [[-20, -20], [-4, 0], [-4, 30], [0, 34], [30, 34], [34, 30], [34, 0], [30, -4], [0, -4], [-20, -20]]
    np.testing.assert_allclose(xy(c), ends, atol=1e-12)
    assert c.motion.tolist() == [RAPID, LINE, LINE, ARC, LINE, ARC, LINE, ARC, LINE, RAPID]
    np.testing.assert_allclose(np.degrees(arc_sweeps(c)[c.motion == ARC]), -90.0)
    np.testing.assert_allclose(c.centre[c.motion == ARC], [[0, 30], [30, 30], [30, 0]], atol=1e-12)
    assert [f.code for f in findings] == []


def test_right_inside_a_square():
    """Inside corners: both offsets end where they cross; the tool leaves from the offset of the last point."""
    c, _ = read(
        "TOOL DEF 1 L+0 R+4", "TOOL CALL 1 Z S1000", "L X+15 Y+15 Z-5 FMAX M3",
        "L X+0 Y+15 RR F300", "L X+0 Y+30", "L X+30", "L Y+0", "L X+0", "L Y+15", "L X+15 R0",
    )  # fmt: skip
    ends = [[15, 15], [4, 15], [4, 26], [26, 26], [26, 4], [4, 4], [4, 15], [15, 15]]
    np.testing.assert_allclose(xy(c), ends, atol=1e-12)


def test_an_arc_beside_and_a_feed_along_z():
    """A circle of 20 mm milled inside, counter-clockwise, tool left: its centre goes on 16 mm."""
    c, _ = read(
        *TOOL[:2], "L X+0 Y+0 Z+5 FMAX", "L Z-3 F100", "CC X+0 Y+0", "L X+20 Y+0 RL F300", "C X+20 Y+0 DR+",
        "L X+0 Y+0 R0", "L Z+5 FMAX",
    )  # fmt: skip
    np.testing.assert_allclose(xy(c)[2:], [[16, 0], [16, 0], [0, 0], [0, 0]], atol=1e-12)
    assert np.degrees(arc_sweeps(c)[3]) == pytest.approx(360.0)
    np.testing.assert_allclose(c.position[:, 2], [5, -3, -3, -3, -3, 5])


def test_the_tool_stays_where_compensation_ends_until_x_or_y_is_given():
    c, _ = read(*TOOL, "L X+0 Y+0 RL F300", "L X+0 Y+30", "L Z+50 R0 FMAX", "L Z+60 FMAX", "L X+9 FMAX")
    np.testing.assert_allclose(xy(c)[2:], [[-4, 30], [-4, 30], [-4, 30], [9, 30]], atol=1e-12)


def test_the_radius_is_that_of_the_program_else_of_the_job():
    blocks = ("L X-20 Y-20 Z-5 FMAX M3", "L X+0 Y+0 RL F300", "L X+0 Y+30", "L X-20 R0")
    for more, options, radius in (
        (("TOOL DEF 1 L+0 R+3", "TOOL CALL 1 Z S1 DR+0.5"), {"radii": {1: 9.0}}, 3.5),
        (("TOOL DEF 1 L+0 R+0", "TOOL CALL 1 Z S1"), {"radii": {1: 9.0}}, 9.0),
        (("TOOL CALL 1 Z S1 DR-0.1",), {"radii": {1: 2.0}}, 1.9),
    ):
        c, findings = read(*more, *blocks, **options)
        assert c.position[1, 0] == pytest.approx(-radius)
        assert not any(f.severity > Severity.NOTE for f in findings)
    c, findings = read("TOOL CALL 1 Z S1", *blocks)
    assert c.position[1, 0] == pytest.approx(0.0)
    assert [f.code for f in findings if f.severity == Severity.UNPROVEN] == ["nc-diameter-unknown"]


def test_what_the_tool_does_not_fit_into_is_refused():
    with pytest.raises(InputError, match="an arc of radius 3 mm would cause gouging with a tool of radius 4 mm"):
        read(*TOOL, "L X-3 Y+0 RR F300", "CC X+0 Y+0", "C X+3 Y+0 DR-")


def test_arcs_by_radius():
    """The four arcs of radius 10 between two points 10 apart: centres 8.66 mm off the chord."""
    out = math.sqrt(75.0)
    for radius, turn, side, degrees in (
        ("R+10", "DR+", 1, 60), ("R+10", "DR-", -1, -60), ("R-10", "DR+", -1, 300), ("R-10", "DR-", 1, -300)
    ):  # fmt: skip
        c, _ = read("L X+0 Y+0 Z+0 FMAX", f"CR X+10 Y+0 {radius} {turn} R0 F600")
        np.testing.assert_allclose(c.centre[1], [5.0, side * out], atol=1e-9)
        assert np.degrees(arc_sweeps(c)[1]) == pytest.approx(degrees)
    c, _ = read("L X+0 Y+0 Z+0 FMAX", "CR X+10 Y+0 R+5 DR+ F600")
    np.testing.assert_allclose(c.centre[1], [5.0, 0.0], atol=1e-6)
    with pytest.raises(InputError, match="CR: R = 4 mm: start and end are 10 mm apart: must be at least half of that"):
        read("L X+0 Y+0 Z+0 FMAX", "CR X+10 Y+0 R+4 DR+ F600")


def test_tangent_arcs():
    """Along X, then a quarter up about (0, 10), then a half circle back in the direction that it has."""
    c, _ = read("L X-5 Y+0 Z+0 FMAX", "L X+0 F600", "CT X+10 Y+10", "CT X-10 Y+10")
    np.testing.assert_allclose(c.centre[2:], [[0, 10], [0, 10]], atol=1e-9)
    np.testing.assert_allclose(np.degrees(arc_sweeps(c)[2:]), [90, 180])
    c, _ = read("L X-5 Y+0 Z+0 FMAX", "L X+0 F600", "CT X+10 Y+0")
    assert c.motion.tolist() == [RAPID, LINE, LINE]


def test_polar_coordinates():
    c, _ = read("CC X+10 Y+20", "LP PR+5 PA+90 Z+0 FMAX", "LP IPA+90 F600", "LP PR+8", "CP PA+270 DR+", "CP PA+180 DR-")
    np.testing.assert_allclose(xy(c), [[10, 25], [5, 20], [2, 20], [10, 12], [2, 20]], atol=1e-9)
    np.testing.assert_allclose(np.degrees(arc_sweeps(c)[3:]), [90, -90], atol=1e-9)


def test_straight_approaches_and_departures():
    """LT along the contour, LN square to it and the radius of 4 mm farther; the tool stays left of X0."""
    c, findings = read(*TOOL, "APPR LT X+0 Y+0 LEN10 RL F300", "L X+0 Y+30", "DEP LT LEN6", "L X-20 Y-20 R0 FMAX")
    np.testing.assert_allclose(xy(c), [[-20, -20], [-4, -10], [-4, 0], [-4, 30], [-4, 36], [-20, -20]], atol=1e-12)
    assert not findings
    # to the point between with the feed before, at rapid after FMAX
    assert c.motion.tolist() == [RAPID, RAPID, LINE, LINE, LINE, RAPID]
    c, findings = read(*TOOL, "APPR LN X+0 Y+0 LEN10 RL F300", "L X+0 Y+30", "DEP LN LEN6 F900")
    np.testing.assert_allclose(xy(c), [[-20, -20], [-14, 0], [-4, 0], [-4, 30], [-10, 30]], atol=1e-12)
    np.testing.assert_allclose(c.feed[-3:] * 60.0, [300, 300, 900])
    assert not findings


@pytest.mark.parametrize("side", ["RL", "RR"])
def test_round_approaches_and_departures(side):
    """A quarter of R10 that touches X0 at its start and end: the path of the centre has R10 - 4 about (-+10, 0)."""
    s = 1 if side == "RL" else -1
    c, findings = read(*TOOL, f"APPR CT X+0 Y+0 CCA90 R10 {side} F300", "L X+0 Y+30", "DEP CT CCA90 R10")
    assert not findings
    expected = [[-20, -20], [-10 * s, -6], [-4 * s, 0], [-4 * s, 30], [-10 * s, 36]]
    np.testing.assert_allclose(xy(c), expected, atol=1e-9)
    np.testing.assert_allclose(np.degrees(arc_sweeps(c)[[2, 4]]), [90 * s, 90 * s])


@pytest.mark.parametrize("side", ["RL", "RR"])
def test_a_negative_radius_turns_to_the_other_side(side):
    """The manual's table: RL with a negative R turns clockwise. The path of the centre has R10 + 4 about (+-10, 0)."""
    s = 1 if side == "RL" else -1
    c, findings = read(*TOOL, f"APPR CT X+0 Y+0 CCA90 R-10 {side} F300", "L X+0 Y+30", "DEP CT CCA90 R-10")
    assert not findings
    expected = [[-20, -20], [10 * s, -14], [-4 * s, 0], [-4 * s, 30], [10 * s, 44]]
    np.testing.assert_allclose(xy(c), expected, atol=1e-9)
    np.testing.assert_allclose(np.degrees(arc_sweeps(c)[[2, 4]]), [-90 * s, -90 * s])


def test_lines_touch_the_arcs_of_lct():
    """The lines to and from the arcs are square to their radii, and go on in the sense of the arcs."""
    c, findings = read(*TOOL, "APPR LCT X+0 Y+0 R10 RL F300", "L X+0 Y+30", "DEP LCT X-40 Y+20 R7", "L Z+9 FMAX")
    assert not findings
    z = c.position[:, 0] + 1j * c.position[:, 1]
    for line, arc, start, centre, radius in ((1, 2, 0, -10.0, 6.0), (5, 4, 4, -7.0 + 30.0j, 3.0)):
        touch = z[line] if line < arc else z[arc]
        along = z[line] - z[start]
        assert abs(touch - centre) == pytest.approx(radius)
        assert (along / (1j * (touch - centre))).real > 0.0
        assert (along / (touch - centre)).real == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(xy(c)[[2, 3, 5]], [[-4, 0], [-4, 30], [-40, 20]], atol=1e-9)


def test_an_approach_goes_down_above_the_point_between():
    c, _ = read(*TOOL, "APPR LT X+0 Y+0 Z-9 LEN10 RL F300", "L X+0 Y+30")
    np.testing.assert_allclose(c.position[1:4, :3], [[-4, -10, -5], [-4, -10, -9], [-4, 0, -9]], atol=1e-12)


def test_approaches_that_cannot_be_carried_out():
    _, findings = read(*TOOL, "APPR LCT X+0 Y+0 R3 RL F300", "L X+0 Y+30", lenient=True)
    assert "LCT: an arc of the radius -1 mm cannot be reached" in findings[0].text
    _, findings = read(*TOOL, "APPR LT X+0 Y+0 LEN10 RL F300", "L Z-5 FMAX", lenient=True)
    assert [f.code for f in findings] == ["heidenhain-approach"]
    assert "no motion follows it" in findings[0].text
    assert findings[0].severity == Severity.UNPROVEN
    _, findings = read(*TOOL, "DEP LT LEN10", lenient=True)
    assert "no compensated contour is before it" in findings[0].text
