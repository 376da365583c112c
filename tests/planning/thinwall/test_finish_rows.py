"""Rows of a finishing program over walls by formula: where it touches, edge to edge, offset by depths, refusals."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.errors import InputError
from chipload.geometry.thin_wall import blade, plate
from chipload.planning.thinwall.blank import FinishSurface
from chipload.planning.thinwall.contact import ContactFinder
from chipload.planning.thinwall.depth import DepthRange
from chipload.planning.thinwall.finish_rows import depth_at, row_frames
from chipload.planning.thinwall.force_table import greatest_law, law_on_stock
from chipload.planning.thinwall.linking import FineSide, OperationMotion, beyond_edges, link_passes, refine_depths
from chipload.planning.thinwall.pass_program import Margins
from chipload.planning.thinwall.passes import WallPass
from chipload.planning.thinwall.paths import PassMotion, Rows, place_rows
from chipload.planning.thinwall.plane_stock import CutterPose
from chipload.planning.thinwall.read_rows import sides_of_program
from chipload.planning.thinwall.threshold import modelled
from chipload.program.build import rapid
from chipload.program.program import LINE, RAPID, Program

BALL = Cutter(8.0, 2, 0.5, 8.0, 30.0, 6e5, corner_radius=4.0)
BULL = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5, corner_radius=1.5)
WALL = plate(20.0, 18.0, 2.0)
BLADE = blade((20.0, 16.0), 18.0, (2.4, 1.6), 0.5, math.radians(40.0), (0.2, 0.5))
FOOT, STEP = 0.25, 0.75
HEIGHTS = np.arange(18.0, 4.4, -STEP)  # down to the foot at 4.5 mm
PLACES = (np.linspace(0.0, 1.0, 5), np.linspace(FOOT, 1.0, 4))


def side_of(wall, number):
    return lambda u, v: (wall.sides(u, v)[number], wall.normals(u, v)[number])


def path(points, axis, feeds, tool=1) -> Program:
    """Motions to points (n, 3), a rapid where the feed is 0."""
    first = rapid(points[0], 0.0, tool, "x")
    n = len(points)
    feed = np.asarray(feeds, dtype=float)
    return Program.join(
        [
            first,
            Program(
                motion=np.where(feed > 0.0, LINE, RAPID), p_work=np.asarray(points), axis=np.broadcast_to(axis, (n, 3)),
                centre=np.zeros((n, 3)), normal=np.tile([0.0, 0.0, 1.0], (n, 1)), turns=np.zeros(n, int), feed=feed,
                spindle=np.full(n, 300.0), tool=np.full(n, tool), line=np.arange(1, n + 1), label=np.zeros(n, int),
                labels=("x",),
            ),
        ]
    )  # fmt: skip


def zigzag(heights=HEIGHTS, *, cutter=BALL, lean=45.0, off=0.0, beyond=6.0, end=None, outwards=1.0) -> Program:
    """To and fro over a side of the plate, two points a row, the axis fixed: leans from the normal to the free edge."""
    a = math.radians(lean)
    n = np.array([0.0, outwards, 0.0])
    axis = math.cos(a) * n + math.sin(a) * np.array([0.0, 0.0, 1.0])
    r, e, height = cutter.apt[1:4]
    across = (n - math.cos(a) * axis) / math.sin(a)
    points, feeds = [], []
    for k, z in enumerate(heights):
        row = np.array([[-10.0 - beyond, outwards, z], [10.0 + beyond if end is None else end, outwards, z]])
        if k % 2:
            row = row[::-1]
        tip = row + (r + off) * n + e * across - height * axis
        points += [tip[0] + 2.0 * n, *tip, tip[1] + 2.0 * n]
        feeds += [0.0, 5.0, 10.0, 0.0]
    return path(points, axis, feeds)


def read(program, cutter=BALL, step=2.5, tool=None):
    return sides_of_program(program, cutter, [side_of(WALL, 0)], FOOT, step, "operation.0.rows = a.apt", tool)


@pytest.mark.parametrize("cutter", [BALL, BULL])
def test_a_cutter_touches_a_blade_where_it_was_put(cutter):
    """At points of both sides, with axes of any lean: the place, and a gap in front of it."""
    rng = np.random.default_rng(1)
    for number in (0, 1):
        side = side_of(BLADE, number)
        u, v, gap = rng.uniform(0.0, 1.0, 40), rng.uniform(0.0, 1.0, 40), rng.uniform(-0.05, 0.2, 40)
        point, normal = side(u, v)
        axis = normal + rng.choice([-1.0, 1.0], (40, 3)) * rng.uniform(0.3, 0.8, (40, 3))
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        r, e, height = cutter.apt[1:4]
        across = normal - (normal * axis).sum(axis=1, keepdims=True) * axis
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        tip = point + (r + gap)[:, None] * normal + e * across - height * axis
        found = ContactFinder(side, cutter).contacts(tip, axis, 1.0)
        assert_allclose(found.clearance, gap, atol=1e-7)
        assert_allclose(side(found.u, found.v)[0], point, atol=2e-5)


def test_beyond_an_edge_nothing_is_touched():
    """A ball in front of the plate, half a millimetre within its edge and beyond it."""
    look = ContactFinder(side_of(WALL, 0), BALL)
    n = np.array([[0.0, 1.0, 0.0]] * 2)
    found = look.contacts(np.array([[9.5, 1.0, 9.0], [10.5, 1.0, 9.0]]), n, 1.0)
    assert found.clearance[0] == pytest.approx(0.0, abs=1e-9)
    assert found.clearance[1] == np.inf


@pytest.mark.parametrize("cutter", [BALL, BULL])
@pytest.mark.parametrize("lean", [30.0, 45.0])
def test_rows_of_a_foreign_zigzag(cutter, lean):
    (side,), step_over = read(zigzag(cutter=cutter, lean=lean), cutter)
    assert step_over == pytest.approx(STEP)
    assert len(side.rows) == len(HEIGHTS)
    for k, row in enumerate(side.rows):
        ends = (0.0, 1.0) if k % 2 == 0 else (1.0, 0.0)
        assert_allclose(row.u[[0, -1]], ends, atol=1e-5)
        assert_allclose(row.v * 18.0, HEIGHTS[k], atol=1e-8)
        assert np.abs(np.diff(row.u)).max() * 20.0 <= 2.5 + 1e-6
    # down milling one way, up the other: the row before, above, lies on the left of the feed, then on its right
    frames = {one.sign: one for one in row_frames(side)}
    assert set(frames) == {-1, 1}
    for sign, one in frames.items():
        assert_allclose(one.lead, 0.0, atol=1e-9)
        assert_allclose(one.tilt, -sign * math.radians(lean), atol=1e-9)


def fine(wall, number, n=9):
    u, v = np.linspace(0.0, 1.0, n), np.linspace(FOOT, 1.0, len(HEIGHTS))
    a, b = np.meshgrid(u, v, indexing="ij")
    return FineSide(FinishSurface(wall.sides(a, b)[number], wall.normals(a, b)[number], 0.5), u, v)


def a_pass(low, high=0.5) -> WallPass:
    low = np.broadcast_to(low, (5, 4)).astype(float)
    threshold, ones = modelled(np.full(20, 1e-3), 0.05), np.ones((5, 4))
    return WallPass(0, low, high * ones, threshold, 0.0 * ones, ones > 2.0, ones)


def linked(side, p, cutter=BALL, step=-STEP):
    motion = PassMotion(CutterPose(cutter, 0.05, step, 0.0, math.radians(45.0)), 10.0, 100.0, 300.0, 1.5)
    return link_passes([p], [OperationMotion([side], motion, Margins(3.0, 26.0, 0.3))], PLACES)[0]


@pytest.mark.parametrize("wall", [WALL, BLADE])
def test_own_rows_are_read_back(wall):
    """The finish pass of planned rows as a program: the same contact points, axes and order; the same path again."""
    leg = linked(fine(wall, 0, 41), a_pass(0.0))
    (side,), step_over = sides_of_program(leg.program, BALL, [side_of(wall, 0)], FOOT, 2.5, "own")
    known = leg.contact & (leg.depth > 0.0)
    found = np.concatenate([side_of(wall, 0)(row.u, row.v)[0] for row in side.rows])
    # of a blade normals of planned rows are those of a sampled surface
    exact = 1e-6 if wall is WALL else 0.1
    assert_allclose(found, leg.points[known], atol=exact)
    assert step_over == pytest.approx(STEP, rel=1e-6 if wall is WALL else 0.2)
    again = linked(side, a_pass(0.0))
    if wall is WALL:
        assert_allclose(again.program.p_work, leg.program.p_work, atol=1e-6)
        assert_allclose(again.program.axis, leg.program.axis, atol=1e-9)
        assert_allclose(again.program.feed, leg.program.feed, rtol=1e-5)
        assert_allclose(again.place, leg.place, atol=1e-6)


@pytest.mark.parametrize("cutter", [BALL, BULL])
def test_the_cutter_touches_what_a_pass_leaves(cutter):
    """0.1 mm + 0.2 u are left: a plane, which the nearest point of the corner touches; the axis stays."""
    (side,), _ = read(zigzag(cutter=cutter), cutter)
    left = np.broadcast_to(0.1 + 0.2 * PLACES[0][:, None], (5, 4))
    rows, place, depth = side.laid(a_pass(left), PLACES, CutterPose(cutter, 0.05, STEP, 0.0, 0.5))
    assert_allclose(depth, 0.5 - 0.1 - 0.2 * place[..., 0], atol=1e-9)
    tip, axis, _ = place_rows(rows, CutterPose(cutter, 0.05, STEP, 0.0, 0.5))
    assert_allclose(axis, np.broadcast_to([0.0, math.sqrt(0.5), math.sqrt(0.5)], axis.shape), atol=1e-12)
    n = np.array([-0.2 / 20.0, 1.0, 0.0])
    n /= np.linalg.norm(n)
    r, e, height = cutter.apt[1:4]
    # distance of the corner's circle of centres from the plane: that of its middle, less what the circle reaches
    middle = ((tip + height * axis - [-10.0, 1.1, 0.0]) * n).sum(axis=-1)
    reach = e * np.sqrt(1.0 - (axis * n).sum(axis=-1) ** 2)
    assert_allclose(middle - reach, r, atol=1e-9)


def test_a_zigzag_is_linked_at_its_ends():
    """To and fro: the way to the next row begins where the row before ended, and never goes back along it."""
    (side,), _ = read(zigzag())
    p = linked(side, a_pass(0.0)).program
    jump = np.linalg.norm(np.diff(p.p_work, axis=0), axis=1)
    between = (p.motion[1:] == RAPID) & (p.motion[:-1] == RAPID)
    assert jump[between][1:-1].max() < 2.0 * STEP
    # a pass that finds stock at one end only: each second row is gone to from its other end, at the clearance
    half = linked(side, a_pass(np.where(PLACES[0][:, None] > 0.6, 0.0, 0.5))).program
    ball = half.p_work + 4.0 * half.axis
    assert ball[half.motion == RAPID][:, 1].min() > 1.0 + 4.0 + 1.5 - 0.31


def test_depths_between_places():
    rng = np.random.default_rng(2)
    values, u, v = rng.uniform(0.0, 1.0, (5, 4)), np.linspace(0.0, 1.0, 13), np.linspace(FOOT, 1.0, 9)
    a, b = np.meshgrid(u, v, indexing="ij")
    assert_allclose(
        depth_at(values, PLACES, a.ravel(), b.ravel()).reshape(13, 9), refine_depths(values, PLACES, (u, v))
    )


def on_the_side() -> Program:
    """A zigzag that never lifts: it goes down at the edges, within the side, a tenth of a millimetre inwards."""
    whole = zigzag(beyond=-0.2)
    keep = np.isin(np.arange(len(whole)) % 4, (2, 3))
    keep[1] = True
    points = np.array(whole.p_work[keep])
    points[1::2, 0] -= 0.1 * np.sign(points[1::2, 0])
    return path(points, whole.axis[2], np.r_[0.0, np.full(keep.sum() - 1, 10.0)])


def test_a_path_that_goes_down_within_the_side():
    (side,), step_over = read(on_the_side())
    assert step_over == pytest.approx(STEP)
    assert len(side.rows) == len(HEIGHTS)
    for row, height in zip(side.rows, HEIGHTS, strict=True):
        assert_allclose(row.v * 18.0, height, atol=1e-8)


def test_rows_of_different_lengths_run_on_beyond_their_own_ends():
    """Two rows along x, of 2 and of 4 points: each begins and ends 3 mm beyond its own points; nothing is cut there."""
    x = np.array([[0.0, 10.0, 10.0, 10.0], [0.0, 4.0, 7.0, 9.0]])
    contact = np.stack([x, 0.0 * x, np.broadcast_to([[1.0], [0.0]], x.shape)], axis=-1)
    along, up = (np.broadcast_to(np.array(a), contact.shape) for a in ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
    cut = np.array([[True, True, False, False], [True] * 4])
    made = beyond_edges(Rows(contact, up, along, cut, up, np.array([2, 4])), 3.0)
    assert made.contact[0, :4, 0].tolist() == [-3.0, 0.0, 10.0, 13.0]
    assert made.contact[1, :, 0].tolist() == [-3.0, 0.0, 4.0, 7.0, 9.0, 12.0]
    assert made.cut.tolist() == [[False, True, True, False, False, False], [False, True, True, True, True, False]]
    assert made.count.tolist() == [4, 6]


@pytest.mark.parametrize(
    ("program", "text"),
    [
        (
            zigzag(off=0.1),
            r"side 1: 0 rows touch the finished surface within 0.02 mm; it comes within 0.1 mm of it: must",
        ),
        (zigzag(outwards=-1.0), r"side 1: 0 rows touch the finished surface within 0.02 mm.*: must be at least 2"),
        (zigzag(np.delete(HEIGHTS, 6)), r"side 1: rows 1.5 mm apart at v = \S+, most 0.75 mm: a row is missing"),
        (
            Program.join([zigzag(), zigzag(HEIGHTS[:3])]),
            r"side 1: rows lie 0 mm apart at v = \S+, others 0.75 mm: must not lie on one another",
        ),
        (
            zigzag(end=5.0),
            r"side 1: the row of line \d+ ends 5 mm off the side's edge: must be at most .*, 0.75 mm: rows",
        ),
        (zigzag(HEIGHTS[:-3]), r"side 1: the last row lies 2.25 mm off the foot: must be at most"),
        (zigzag(HEIGHTS[3:]), r"side 1: the last row lies 2.25 mm off the free edge: must be at most"),
    ],
)
def test_rows_that_cannot_be_used(program, text):
    with pytest.raises(InputError, match="operation.0.rows = a.apt: " + text):
        read(program)


def test_other_tools_do_not_count():
    other = zigzag(HEIGHTS[::2])
    other = path(other.p_work, other.axis[2], other.feed, tool=7)
    (side,), _ = read(Program.join([other, zigzag()]), tool=1)
    assert len(side.rows) == len(HEIGHTS)


def test_the_law_of_several_poses_is_the_greatest():
    """Down and up milling, another lean: at each depth the force of the pose that has most there."""
    material, limits = material_named("al7075-t6"), DepthRange(0.05, 0.1)
    poses = [CutterPose(BALL, 0.05, s * STEP, 0.0, -s * math.radians(lean)) for s, lean in ((1, 60), (-1, 45), (1, 45))]
    each = [law_on_stock(p, material, limits, slope=0.05, scallop=0.01, measure="greatest").forces for p in poses]
    made, worst = greatest_law(poses, material, limits, slope=0.05, scallop=0.01, measure="greatest")
    assert_allclose(made.forces, np.max(each, axis=0), rtol=1e-12)
    assert worst == int(np.argmax([forces[-1] for forces in each]))
    assert max(float(forces[-1]) for forces in each) > 1.01 * min(float(forces[-1]) for forces in each)
