"""Point milling on five axes: closed forms on a plane, dense poses against points of curved surfaces, all channels."""

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.catalogue import CatalogueCutter
from chipload.geometry.bspline import patch_through
from chipload.jobs.impeller.five_axis import all_channels
from chipload.machine.machine import machine_named
from chipload.planning.impeller.axis_field import AxisField, AxisLimits, axis_field, clear_field, directions
from chipload.planning.impeller.five_axis_program import (
    LinkedPath,
    five_axis_program,
    lift_from_end,
    outline_of,
    rotary_share,
)
from chipload.planning.impeller.links import Link
from chipload.planning.impeller.point_milling import point_path
from chipload.planning.impeller.scene import Scene
from chipload.program.gcode.writer import write_gcode
from chipload.program.program import LINE, RAPID
from chipload.program.read import read_program
from chipload.program.release import NOT_SIMULATED

MACHINE = machine_named("cradle-ac")
LIMITS = AxisLimits(math.radians(10.0), 0.01, 0.0, 0.1)
REACHABLE = directions(MACHINE)
WHOLE = ((0.0, 1.0), (0.0, 1.0))
LINK = Link(lift=2.0, margin=0.2, touch=0.05, near=5.0, feed=20.0, above=5.0)


def scene_of(*patches):
    """Check points of patches, the first is milled."""
    a, b = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 80), np.linspace(0, 1, 60), indexing="ij"))
    at = np.concatenate([p.at(a, b) for p in patches])
    of = np.repeat(np.arange(len(patches)), len(a))
    return Scene(at[:1], np.eye(3)[:1], np.zeros((1, 3, 3)), np.zeros(1), at, of, 1.0)


def plane():
    """30 x 20 mm, normal up."""
    return patch_through([[[40, 0, 0], [40, 20, 0]], [[70, 0, 0], [70, 20, 0]]], [0, 1], [0, 1])


def hollow(radius=30.0, half=0.5):
    """A trough along x, 25 mm long, of a radius, open upwards: its normal towards its axis."""
    a, x = np.linspace(-half, half, 41), np.linspace(0.0, 25.0, 5)
    rim = np.stack([0.0 * a, radius * np.sin(a), radius - radius * np.cos(a)], axis=-1)
    grid = rim[None] + x[:, None, None] * np.array([1.0, 0.0, 0.0]) + [40.0, 0.0, 0.0]
    return patch_through(grid, x / 25.0, (a + half) / (2.0 * half))


def fence(high):
    """A wall 7 mm behind the end of the trough."""
    return patch_through([[[72, -20, 0], [72, -20, high]], [[72, 20, 0], [72, 20, high]]], [0, 1], [0, 1])


def away(points, tips, axes, cutter, parts=4):
    """Distance of points from the cutting part in all poses and those between, as that of a torus and a cylinder."""
    share = np.linspace(0.0, 1.0, parts + 1)[:-1, None, None]
    p, A = (((1.0 - share) * x[:-1] + share * x[1:]).reshape(-1, 3) for x in (tips, axes))
    A = A / np.linalg.norm(A, axis=1)[:, None]
    R, r = 0.5 * cutter.diameter, cutter.corner_radius
    out = np.full(len(points), np.inf)
    for tip, axis in zip(p, A, strict=True):
        y = points - tip
        h = y @ axis
        d = np.sqrt(np.maximum((y * y).sum(axis=1) - h * h, 0.0))
        low = np.where(d > R - r, np.hypot(d - R + r, h - r), r - h) - r
        out = np.minimum(out, np.where(h >= r, d - R, low))
    return out


def upright(surface, lean):
    """A field of one axis, leaned along x from z."""
    T = np.array([math.sin(lean), 0.0, math.cos(lean)])
    nodes = np.tile(T, (2, 2, 1))
    return AxisField(np.array([0.0, 1.0]), np.array([0.0, 1.0]), nodes, np.ones((2, 2, 2)))


def test_a_ball_on_a_plane_has_the_step_of_the_closed_form():
    ball, h = CatalogueCutter(10.0, 5.0), 0.05
    path = point_path(plane(), "u", WHOLE, upright(plane(), 0.4), ball, h, 0.005)
    y = np.array([path.at[path.line == k, 1].mean() * 20.0 for k in range(path.lines)])
    step, most = np.diff(y), 2.0 * math.sqrt(2.0 * h * 5.0 - h * h)
    assert step.max() <= most
    # as many steps as are needed, and of one size
    assert len(step) == math.ceil((y[-1] - y[0]) / (most * math.sqrt(0.95)))
    assert np.ptp(step) < 0.01 * most
    # the outermost lines lie inside the border by less than half of a step
    assert 0.5 * 0.8 * most < y[0] <= 0.5 * most
    assert 20.0 - 0.5 * most <= y[-1] < 20.0 - 0.5 * 0.8 * most
    assert np.degrees(path.turn) < 1e-4


@pytest.mark.parametrize(
    ("cutter", "along"), [(CatalogueCutter(12.0, 6.0), "u"), (CatalogueCutter(12.0, 2.0), "v")], ids=["ball", "bull"]
)
def test_nothing_is_left_above_the_scallop_and_nothing_gouges(cutter, along):
    surface, h = hollow(), 0.1
    scene = scene_of(surface, fence(25.0))
    field = clear_field(surface, WHOLE, scene, cutter, REACHABLE, LIMITS)
    assert isinstance(field, AxisField)
    path = point_path(surface, along, WHOLE, field, cutter, h, 0.005)
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.04, 0.96, 41), np.linspace(0.01, 0.99, 121), indexing="ij"))
    own = away(surface.at(u, v), path.tip, path.axis, cutter)
    assert own.min() > -0.01
    assert own.max() <= h
    wall = fence(25.0).at(*(x.ravel() for x in np.meshgrid(np.linspace(0, 1, 60), np.linspace(0, 1, 60))))
    assert away(wall, path.tip, path.axis, cutter).min() > -0.01
    # the axis keeps its lean, and turns little from row to row
    n = (path.normal * path.axis).sum(axis=1)
    assert n.max() <= math.cos(0.5 * LIMITS.lean)
    assert np.degrees(path.turn) < 8.0


def test_lines_end_where_the_surface_becomes_too_narrow_for_them():
    """A wedge, 20 mm wide at one end and 6 at the other: with lines from end to end its narrow end is crowded."""
    corners = [[[40, 0, 0], [40, 20, 0]], [[100, 7, 0], [100, 13, 0]]]
    wedge, ball, h = patch_through(corners, [0, 1], [0, 1]), CatalogueCutter(6.0, 3.0), 0.05
    path = point_path(wedge, "u", WHOLE, upright(wedge, 0.4), ball, h, 0.005)
    most = 2.0 * math.sqrt(2.0 * h * 3.0 - h * h)
    ends = np.array([[at[:, 0].min(), at[:, 0].max()] for at, _ in path.each_line])
    assert (ends[:, 0] < 0.01).all()
    # as many lines end on the way as the width of the wedge loses steps
    assert (ends[:, 1] < 0.97).sum() == pytest.approx(14.0 / most, abs=2.0)
    # no path is shorter than the area over the step; one step for the last line, and the ways from line to line
    assert 13.0 * 60.0 / most < path.length < 1.15 * 13.0 * 60.0 / most + 60.0
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.02, 0.98, 31), np.linspace(0.02, 0.98, 91), indexing="ij"))
    # poses 0.13 mm apart leave 0.0007 mm of their own
    assert away(wedge.at(u, v), path.tip, path.axis, ball, 16).max() <= h


def test_what_a_cutter_does_not_reach_is_said():
    surface = hollow(8.0, 1.0)
    found = axis_field(surface, WHOLE, (5, 5), scene_of(surface), CatalogueCutter(20.0, 10.0), REACHABLE, LIMITS)
    assert found == 0.0
    text = clear_field(surface, WHOLE, scene_of(surface), CatalogueCutter(20.0, 10.0), REACHABLE, LIMITS)
    assert text == "it reaches 0 % of the surface"


@pytest.fixture(scope="module")
def milled():
    """A program over the trough, in one of five channels; the axis turns along the lines."""
    surface, cutter = hollow(), CatalogueCutter(12.0, 6.0)
    scene = scene_of(surface)
    outline = outline_of(scene, 5)
    nodes = np.array([[[lean, 0.3, 1.0]] * 2 for lean in (-0.4, 0.0, 0.4)])
    nodes /= np.linalg.norm(nodes, axis=2)[..., None]
    field = AxisField(np.linspace(0, 1, 3), np.array([0.0, 1.0]), nodes, np.ones((2, 3, 2)))
    path = point_path(surface, "u", WHOLE, field, cutter, 0.3, 0.01)
    begin, end = (lift_from_end(path, k, scene, outline, cutter, LINK, 0.0) for k in (0, -1))
    linked = LinkedPath(path, begin, end)

    def at(feed, machine=MACHINE):
        return five_axis_program([linked], outline, LINK, feed, 100.0, 1, machine, math.tau / 5)

    return scene, at


def test_rotary_axes_keep_their_rates_and_rapids_stay_above_all_channels(milled):
    scene, at = milled
    slow, fast = at(2.0), at(2000.0)
    assert rotary_share(slow, MACHINE).max() < 1.0
    assert rotary_share(fast, MACHINE).max() == pytest.approx(1.0)
    assert (fast.feed[fast.motion == LINE] < 1999.0).any()
    turns = [math.tau * k / 5 for k in range(5)]
    R = [np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]]) for a in turns]
    part = np.concatenate([scene.check @ x.T for x in R])
    for k in np.flatnonzero(slow.motion == RAPID)[1:]:
        for w in np.linspace(0.0, 1.0, 5):
            tip = (1.0 - w) * slow.p_work[k - 1] + w * slow.p_work[k]
            axis = (1.0 - w) * slow.axis[k - 1] + w * slow.axis[k]
            assert tip @ axis / np.linalg.norm(axis) > (part @ axis).max() / np.linalg.norm(axis)
    # it ends where it begins, in the next channel
    assert slow.p_work[-1] == pytest.approx(R[1] @ slow.p_work[0], abs=1e-9)
    assert slow.axis[-1] == pytest.approx(R[1] @ slow.axis[0], abs=1e-9)


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc"])
def test_all_channels_are_read_back_as_the_first_one_turned(milled, tmp_path, dialect):
    _, at = milled
    machine = replace(MACHINE, dialect=dialect)
    program = at(5.0, machine)
    every = all_channels(program, machine, 5)
    assert every.repeat is not None
    assert (every.repeat.letter, every.repeat.count) == ("C", 5)
    one, loop = tmp_path / "one.nc", tmp_path / "all.nc"
    one.write_text(write_gcode(program, machine, title="points", release=NOT_SIMULATED))
    loop.write_text(write_gcode(program, machine, title="points", release=NOT_SIMULATED, repeat=every.repeat))
    first, q = (read_program(x, machine, dialect=dialect).axes for x in (one, loop))
    each = q.reshape(5, len(first), 9)
    # but the first row, before which Z is nowhere; the table itself turns against theta
    assert np.delete(each[:, 1:] - first[1:], 5, axis=2) == pytest.approx(0.0, abs=1e-9)
    turn = np.degrees(each - first)[:, 1:, 5]
    assert turn == pytest.approx(np.tile(-72.0 * np.arange(5)[:, None], len(first) - 1), abs=1e-6)
    # each channel begins where the one before it ends: no other way than those of its rows
    assert each[1:, 1] == pytest.approx(each[:-1, -1], abs=1e-6)


def test_a_machine_that_does_not_turn_the_part_gets_every_row(milled):
    _, at = milled
    bridge = machine_named("xyzbcw-bridge")
    every = all_channels(at(5.0, bridge), bridge, 5)
    assert every.repeat is None
    n = len(at(5.0, bridge))
    tips = every.program.p_work.reshape(5, n, 3)
    radius = np.hypot(tips[..., 0], tips[..., 1])
    assert radius == pytest.approx(np.tile(radius[0], (5, 1)))
    theta = np.unwrap(np.arctan2(tips[:, 0, 1], tips[:, 0, 0]))
    assert np.degrees(np.diff(theta)) == pytest.approx(72.0)
