"""Arcs, splines, cycles, offsets and tools against hand-computed positions."""

import math
from itertools import pairwise

import numpy as np
import pytest

from chipload.errors import InputError, Severity
from chipload.program.commands import ARC, DWELL, LINE, PROBE, RAPID, YZ, ZX
from chipload.program.gcode import nurbs
from chipload.program.gcode.reader import read_gcode
from chipload.program.gcode.tools import read_tool_table


def read(text, **options):
    return read_gcode(text + "\nM2\n", **options)[0]


def test_arcs_of_all_planes_and_forms():
    commands = read(
        "F60\nG3 X1 Y1 R-1\nG2 X1 Y1 I2 P3 Z4\nG18 G3 X3 Z4 I1\nG19 G2 Y3 Z4 J1\n"
        "G17 G90.1 G3 X5 Y3 I4 J3\nG91.1 G91 G2 X2 I1"
    )
    assert (commands.motion == ARC).all()
    assert commands.plane.tolist() == [0, 0, ZX, YZ, 0, 0]
    assert commands.turns.tolist() == [1, -3, 1, -1, 1, -1]
    # of G18 the centre is Z, X; of G19 it is Y, Z
    assert commands.centre == pytest.approx(np.array([[1, 0], [3, 1], [4, 2], [2, 4], [4, 3], [6, 3]]), abs=1e-12)
    assert commands.position[:, :3] == pytest.approx(
        np.array([[1, 1, 0], [1, 1, 4], [3, 1, 4], [3, 3, 4], [5, 3, 4], [7, 3, 4]]), abs=1e-12
    )


@pytest.mark.parametrize("inch", [False, True])
def test_the_tolerance_of_a_centre(inch):
    limit = 0.002 * math.sqrt(2.0) if inch else 0.02 * math.sqrt(2.0)
    units = "G20" if inch else "G21"
    assert len(read(f"{units} F9\nG2 X{2.0 + 0.999 * limit:.9f} I1")) == 1
    with pytest.raises(InputError, match="arc that starts"):
        read(f"{units} F9\nG2 X{2.0 + 1.001 * limit:.9f} I1")
    # of a large arc a thousandth of its radius
    size = 20.0 if inch else 200.0
    assert len(read(f"{units} F9\nG2 X{2.0 * size + 0.00099 * size:.9f} I{size}")) == 1
    with pytest.raises(InputError, match="arc that starts"):
        read(f"{units} F9\nG2 X{2.0 * size + 0.00102 * size:.9f} I{size}")


def test_a_whole_turn_by_radius_is_refused_and_by_centre_is_one():
    assert read("F9\nG2 X0 Y0 I5").turns.tolist() == [-1]
    with pytest.raises(InputError, match="ends where it starts"):
        read("F9\nG2 X0 Y0 R5")


def _bezier(points, t):
    points = [np.asarray(p, dtype=float) for p in points]
    while len(points) > 1:
        points = [(1.0 - t) * a + t * b for a, b in pairwise(points)]
    return points[0]


@pytest.mark.parametrize(
    ("block", "points"),
    [
        ("G5 X10 Y0 I0 J8 P-3 Q-8", [(0, 0), (0, 8), (7, -8), (10, 0)]),
        ("G5.1 X10 Y0 I5 J5", [(0, 0), (5, 5), (10, 0)]),
        ("G5.2 X0 Y8 L4 P1\nX7 Y-8 P1\nX10 Y0 P1\nG5.3", [(0, 0), (0, 8), (7, -8), (10, 0)]),
    ],
)
def test_splines_lie_on_their_bezier_curve(block, points):
    """Each chord's end is on the curve, and the curve leaves the chords by at most the tolerance (brute force)."""
    commands = read(f"F60\nG1 X0 Y0\n{block}")
    got = commands.position[:, :2]
    assert (commands.motion == LINE).all()
    curve = np.array([_bezier(points, t) for t in np.linspace(0.0, 1.0, 20_001)])
    assert got[-1].tolist() == list(map(float, points[-1]))
    # the ends are on the curve as finely as it was sampled
    fine = np.abs(np.diff(curve, axis=0)).max()
    assert all(np.hypot(*(curve - p).T).min() <= fine for p in got[1:])
    a, d = got[:-1], np.diff(got, axis=0)
    t = np.clip(((curve[:, None] - a) * d).sum(2) / (d * d).sum(1), 0.0, 1.0)
    away = np.hypot(*np.moveaxis(curve[:, None] - a - t[..., None] * d, 2, 0)).min(axis=1)
    assert away.max() <= nurbs.CHORD_TOLERANCE
    assert len(got) < 200


def test_a_rational_spline_is_a_circle():
    """Weights 1, 1/sqrt 2, 1 over a right angle: the quarter of a circle."""
    weight = math.sqrt(0.5)
    commands = read(f"F60\nG1 X10 Y0\nG5.2 X10 Y10 P{weight:.12f} L3\nX0 Y10 P1\nG5.3")
    radii = np.hypot(*commands.position[:, :2].T)
    assert np.abs(radii - 10.0).max() <= 1e-9
    middle = 0.5 * (commands.position[1:, :2] + commands.position[:-1, :2])
    assert np.hypot(*middle.T).min() >= 10.0 - nurbs.CHORD_TOLERANCE


def test_the_next_cubic_goes_on_along_the_last():
    a = read("F60\nG5 X10 Y0 I0 J3 P0 Q-3\nG5 X20 Y0 P0 Q3")
    b = read("F60\nG5 X10 Y0 I0 J3 P0 Q-3\nG5 X20 Y0 I0 J3 P0 Q3")
    assert np.array_equal(a.position, b.position)


def test_inverse_time_of_a_spline_takes_its_time():
    commands = read("G93\nG5 X10 Y0 I0 J8 P-3 Q-8 F4")
    before = np.vstack([np.zeros((1, 9)), commands.position[:-1]])
    seconds = np.linalg.norm(commands.position - before, axis=1) / commands.feed
    assert seconds.sum() == pytest.approx(15.0)


def steps(commands):
    names = {RAPID: "R", LINE: "L", DWELL: "D"}
    return [
        f"{names[m]}{x:g},{y:g},{z:g}"
        for m, (x, y, z) in zip(commands.motion.tolist(), commands.position[:, :3], strict=True)
    ]


def test_drilling_returns_to_r_or_to_the_level_of_the_series():
    hole = "F60\nG0 Z5\nG81 X1 Y1 Z-3 R2\nX2\nG80"
    r = ["R0,0,5", "R1,1,5", "R1,1,2", "L1,1,-3", "R1,1,2", "R2,1,2", "L2,1,-3", "R2,1,2"]
    assert steps(read(f"G99 {hole}")) == r
    level = ["R0,0,5", "R1,1,5", "R1,1,2", "L1,1,-3", "R1,1,5", "R2,1,5", "R2,1,2", "L2,1,-3", "R2,1,5"]
    assert steps(read(f"G98 {hole}")) == level


def test_pecks_and_chip_breaks():
    commands = read("F60\nG0 Z5\nG83 X1 Z-3 R1 Q2")
    assert steps(commands)[3:] == ["L1,0,-1", "R1,0,1", "R1,0,-0.746", "L1,0,-3", "R1,0,1"]
    commands = read("F60\nG0 Z5\nG73 X1 Z-3 R1 Q2")
    assert steps(commands)[3:] == ["L1,0,-1", "R1,0,-0.746", "L1,0,-3", "R1,0,1"]


def test_repeats_go_on_by_increments():
    commands = read("F60\nG0 Z5\nG91 G82 X1 Y1 Z-2 R-1 P0.5 L2")
    assert steps(commands)[1:6] == ["R1,1,5", "R1,1,4", "L1,1,2", "D1,1,2", "R1,1,4"]
    assert steps(commands)[6:] == ["R2,2,4", "L2,2,2", "D2,2,2", "R2,2,4"]
    assert commands.feed[commands.motion == DWELL].tolist() == [0.5, 0.5]


def test_tapping_turns_the_spindle():
    commands = read("F60 S60 M3\nG0 Z5\nG84 X1 Z-3 R1")
    assert np.sign(commands.spindle).tolist() == [1.0, 1.0, 1.0, 1.0, -1.0, -1.0]
    assert read("F60 S60 M3\nG0 Z5\nG84 X1 Z-3 R1\nG0 X5").spindle[-1] > 0.0


def test_a_cycle_along_y():
    assert steps(read("F60\nG18 G0 Y5\nG81 X1 Z2 Y-3 R1"))[1:] == ["R1,5,2", "R1,1,2", "L1,-3,2", "R1,1,2"]


def test_offsets_and_where_the_machine_is():
    commands = read("G10 L2 P1 X5 Y1 R90\nG0 X2 Y0\nG92 X10\nX11\nG92.2\nG52 Y3\nG0 X0 Y0\nG53 G0 X1 Y1\nG54")
    machine = commands.machine()[:, :2]
    # rotated by 90 deg: X of the text is Y of the machine
    assert machine == pytest.approx(np.array([[5, 3], [5, 4], [2, 1], [1, 1]]), abs=1e-12)


def test_setting_an_offset_from_where_the_machine_is():
    commands = read("G0 X7 Y8\nG10 L20 P2 X1 Y1\nG55 G0 X0 Y0 Z3")
    assert commands.machine()[-1, :3].tolist() == [6.0, 7.0, 3.0]
    assert commands.frames[commands.frame[-1]].number == 2


def test_tool_lengths():
    tools, _ = read_tool_table("T1 P1 Z10\nT2 P2 Z20 X1")
    commands = read("T1 M6\nG43\nG0 Z0\nG43.2 H2\nG0 Z0 X0\nG43.1 Z3\nG0 Z0\nG49\nG0 Z0", tools=tools)
    assert commands.machine()[:, 2].tolist() == [10.0, 30.0, 3.0, 0.0]
    assert commands.machine()[:, 0].tolist() == [0.0, 1.0, 1.0, 1.0]
    commands = read("G0 Z50\nG10 L10 P1 Z5\nG43 H1\nG0 Z0", tools=tools)
    assert commands.machine()[-1, 2] == 45.0
    assert tools.tools[1].offset[2] == 10.0


def test_stored_points():
    commands = read("#5161=10 #5163=30\nG0 X1\nG28 Z5\nG28\nG30.1\nG0 X0\nG91 G30 X0")
    assert commands.position[:, [0, 2]].tolist() == [
        [1, 0], [1, 5], [1, 30], [1, 30], [10, 30], [0, 30], [0, 30], [10, 30]
    ]  # fmt: skip


def test_probing_is_a_motion_and_a_finding():
    commands, findings = read_gcode("F60\nG38.2 Z-5\n(debug, #5063 #5070)\nM2")
    assert commands.motion.tolist() == [PROBE]
    assert [x.code for x in findings] == ["nc-probe", "nc-message"]
    # where the touch ends it is not known
    assert findings[0].severity is Severity.UNPROVEN
    assert "program.work_offsets" in findings[0].text


def test_polar_coordinates():
    commands = read("G0 @2 ^90\nG91 @3 ^-90\nG90 ^45")
    assert commands.position[:, :2] == pytest.approx(np.array([[0, 2], [5, 0], [5 * math.sqrt(0.5)] * 2]), abs=1e-12)


def test_compensation_keeps_what_stands_between_its_motions():
    commands = read("F60\nG41.1 D2\nG1 X5\nG4 P1\nS60 M3\nX10 F120\nX20 Y0\nG40\nG1 X0 Y0")
    # left of +X by the radius 1
    assert commands.position[:, :2].tolist() == [[5, 1], [5, 1], [10, 1], [20, 1], [0, 0]]
    assert commands.motion.tolist() == [LINE, DWELL, LINE, LINE, LINE]
    assert commands.feed.tolist() == [1.0, 1.0, 2.0, 2.0, 2.0]
    assert (commands.spindle > 0.0).tolist() == [False, False, True, True, True]
    assert commands.line.tolist() == [3, 4, 6, 7, 9]


def test_tool_table_in_inches():
    table, findings = read_tool_table("; nothing\nT2 P4 D0.5 Z-1 A90 I30 J60 Q3 ; lathe\nT3 D-1", units="inch")
    tool = table.tools[2]
    assert (tool.number, tool.pocket, tool.orientation, tool.comment) == (2, 4, 3, "lathe")
    assert tool.diameter == pytest.approx(12.7)
    assert tool.offset[2] == pytest.approx(-25.4)
    assert (tool.offset[3], tool.front, tool.back) == pytest.approx((0.5 * math.pi, math.pi / 6, math.pi / 3))
    assert [x.code for x in findings] == ["tool-negative-diameter"]
