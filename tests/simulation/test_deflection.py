"""Form error against closed forms: a bar, a rigid wall on springs, the wall that an end mill makes, sums by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_over_turn, in_work
from chipload.cutting.material import Material, material_named
from chipload.cutting.wall_error import wall_profile
from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.errors import InputError
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.chips import remove
from chipload.simulation.deflection import contacts, form_error, step_deflections
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock
from chipload.structure.grid import from_map
from chipload.structure.places import locate, normals_of
from chipload.structure.solid import SolidWorkpiece, compliance, factorise, full_compliance
from chipload.structure.spindle import Bar, Joint, cutter_bars
from simulation.test_steps import five_axis

AL = material_named("al7075-t6")
MILL = Cutter(10.0, 4, 0.0, 20.0, 30.0, 6e5)
BALL = Cutter(8.0, 2, math.radians(30.0), 20.0, 40.0, 6e5, corner_radius=4.0)
FINE = Resolution(step_mm=1.0, tolerance=1e-4, corner_slices=60, flank_mm=0.5)
#: where h = 0 the edge alone pushes along the normal: a known force, whatever is cut
EDGE = Material("edge", 1000.0, 0.0, 0.0, 0.0, 20.0, 0.0, source="made up for this test")


def along_a_wall(cutter: Cutter, material: Material, depth: float = 4.0, width: float = 1.5, tolerance: float = 1e-4):
    """A wall at y = 0 whose material lies below it; the cutter goes along x, climb (+x at M3 has it on the right)."""
    stock = LayeredStock.block((0.0, -10.0, -depth), (30.0, width, 0.0), 0.5, 15.0)
    y = cutter.radius
    program = Program.join(
        [rapid([-10.0, y, -depth], 300.0, 1, "link"), plunge([40.0, y, -depth], 20.0, 300.0, 1, "cut")]
    )
    return remove(
        program,
        stock,
        {1: cutter},
        material,
        replace(FINE, tolerance=tolerance),
        keep=True,
    )


def wall_points(z: np.ndarray, x: float = 15.2):
    return np.column_stack([np.full(len(z), x), np.zeros(len(z)), z]), np.tile([0.0, 1.0, 0.0], (len(z), 1))


def test_without_helix_a_bar_bends_under_the_force_of_its_edge() -> None:
    """phi = pi, h = 0: a uniform load Kre a mm over the depth b on a bar that is clamped at l: e(z) in closed form."""
    depth, z = 4.0, np.array([0.5, 2.0, 3.5])
    removal = along_a_wall(MILL, EDGE, depth)
    found = form_error(removal, EDGE, *wall_points(z - depth), work=None, bars={1: cutter_bars(MILL)}, near=0.1)
    L, EI = MILL.overhang, 6e5 * math.pi * 8.0**4 / 64.0
    EIs = 6e5 * math.pi * 10.0**4 / 64.0
    expected = []
    for x in z:
        # integral over the load at a of C(a, x), C = integral over h from max(a, x) of (h - a)(h - x) / E I
        a = (np.arange(1000) + 0.5) * depth / 1000
        h = (np.arange(3000) + 0.5) * L / 3000
        moment = np.where(h[:, None] > a, h[:, None] - a, 0.0).sum(axis=1) * depth / 1000
        arm = np.where(h > x, h - x, 0.0)
        expected.append(20.0 * (moment * arm / np.where(h < 20.0, EI, EIs)).sum() * L / 3000)
    assert found.cutter == pytest.approx(expected, rel=1e-5)
    assert (found.cutter > 0.0).all()
    assert found.force == pytest.approx(20.0 * depth, rel=1e-9)
    assert found.at_edge.all()
    assert abs(found.rigid).max() < 1e-9


@pytest.mark.parametrize("milling", ["down", "up"])
@pytest.mark.parametrize("helix", [0.0, 30.0])
def test_it_is_the_wall_of_the_closed_form(milling: str, helix: float) -> None:
    mill = replace(MILL, helix=math.radians(helix))
    depth, width = 6.0, 1.5
    stock = LayeredStock.block((0.0, -10.0, -depth), (30.0, width, 0.0), 0.5, 15.0)
    ends = (-10.0, 40.0) if milling == "down" else (40.0, -10.0)
    program = Program.join(
        [
            rapid([ends[0], 5.0, -depth], 300.0, 1, "link"),
            plunge([ends[1], 5.0, -depth], 20.0, 300.0, 1, "cut"),
        ]
    )
    removal = remove(
        program,
        stock,
        {1: mill},
        AL,
        FINE,
        keep=True,
    )
    z = np.linspace(0.3, depth - 0.3, 7)
    p, n = wall_points(z - depth)
    work = 3e-6
    found = form_error(removal, AL, p, n, work=np.full(len(p), work), bars={1: cutter_bars(mill)}, near=0.1)
    a = math.acos(1.0 - width / 5.0)
    arc = (math.pi - a, math.pi) if milling == "down" else (0.0, a)
    front = engagement_of_arcs([arc[0]], [arc[1]], math.tau * 20.0 / (4 * 300.0), mill, depth)
    engagement = chips_of_teeth(front, mill)
    closed = wall_profile(engagement, mill, AL, z, milling=milling, work_compliance=work)[0]
    assert abs(closed).max() > 1e-4
    np.testing.assert_allclose(found.error, closed, rtol=0.0, atol=1e-5 * abs(closed).max())


def ball_rows(material: Material = AL, cutter: Cutter = BALL, x: float = 0.0, keep: bool = True):
    """Two rows of a ball 0.6 mm apart over a plane that leans: surface z = 0.2 y, y the way across, feed along x."""
    stock = LayeredStock.block((-6.0, -4.0, -3.0), (6.0, 4.0, 0.5), 0.1, 15.0)
    n = np.array([0.0, -0.2, 1.0]) / math.hypot(0.2, 1.0)
    r = cutter.corner_radius
    parts = []
    for y in (-0.3, 0.3):
        centre = np.array([0.0, y, 0.2 * y - 1.0]) + r * n
        tip = centre - [0.0, 0.0, r]
        parts += [rapid([-3.0, tip[1], 9.0], 400.0, 1, "link"), rapid([-3.0, tip[1], tip[2]], 400.0, 1, "link")]
        parts += [plunge([3.0, tip[1], tip[2]], 10.0, 400.0, 1, "cut"), rapid([3.0, tip[1], 9.0], 400.0, 1, "link")]
    return remove(
        Program.join(parts),
        stock,
        {1: cutter},
        material,
        FINE_BALL,
        keep=keep,
    ), n


FINE_BALL = Resolution(step_mm=0.5, tolerance=5e-4, corner_slices=40, flank_mm=1.0)


def leaning_points():
    y = np.array([-0.5, -0.3, -0.1, 0.1, 0.3, 0.5])
    return np.column_stack([np.full(6, 0.1), y, 0.2 * y - 1.0])


def test_cusps_of_a_ball_are_the_gap_and_each_point_belongs_to_the_nearer_row() -> None:
    removal, n = ball_rows()
    found = form_error(removal, AL, leaning_points(), np.tile(n, (6, 1)), work=None, bars=None, near=0.2)
    slope = math.hypot(1.0, 0.2)
    away = slope * np.array([0.2, 0.0, 0.2, 0.2, 0.0, 0.2])
    assert found.rigid == pytest.approx(np.hypot(4.0, away) - 4.0, abs=1e-6)
    assert not found.error.any()
    y = removal.columns["y_mm"][found.step]
    assert (np.sign(y - y.mean()) == [-1, -1, -1, 1, 1, 1]).all()
    assert abs(removal.columns["x_mm"][found.step] - 0.25).max() <= 0.25 + 1e-9


def test_compliances_add_and_the_whole_one_equals_the_normal_one_along_the_normal() -> None:
    """Superposition: of one and the same load work and cutter give way, each as if the other were rigid."""
    removal, n = ball_rows()
    p, N = leaning_points()[[1, 4]], np.tile(n, (2, 1))
    bars = {1: cutter_bars(BALL, Joint(1e-5, 1e-9))}
    only = {"near": 0.2}
    both = form_error(removal, AL, p, N, work=[2e-4, 1e-4], bars=bars, **only)
    work = form_error(removal, AL, p, N, work=[2e-4, 1e-4], bars=None, **only)
    cutter = form_error(removal, AL, p, N, work=None, bars=bars, **only)
    # the step that leaves least makes a point, which may be another one with a cutter that gives way
    same = (both.step == work.step) & (both.step == cutter.step)
    assert same.any()
    assert both.error[same] == pytest.approx((work.work + cutter.cutter)[same], rel=1e-12)
    assert work.work == pytest.approx(np.array([2e-4, 1e-4]) * work.force, rel=1e-12)
    assert (work.force > 1.0).all()
    # C = 1e-4 along x alone does not move the surface, whose normal has no x
    sideways = np.tile(np.diag([1e-4, 0.0, 0.0]), (2, 1, 1))
    assert abs(form_error(removal, AL, p, N, work=sideways, bars=None, **only).work).max() < 1e-12
    isotropic = np.tile(np.diag([2e-4] * 3), (2, 1, 1))
    assert form_error(removal, AL, p, N, work=isotropic, bars=None, **only).work == pytest.approx(
        2e-4 * work.force, rel=1e-12
    )


def test_a_rigid_bar_on_a_joint_moves_as_the_lever_says() -> None:
    """The joint gives way by c_ff to a force and c_mm to a moment at 40 mm; edge force Kre over 4 mm of depth."""
    bar = (Bar(30.0, 0.0, Joint(1e-5, 1e-8)),)
    removal = along_a_wall(MILL, EDGE, 4.0)
    found = form_error(removal, EDGE, *wall_points(np.array([-3.0])), work=None, bars={1: bar}, near=0.1)
    force, arm = 80.0, 30.0 - 2.0
    assert found.cutter == pytest.approx([1e-5 * force + 1e-8 * force * arm * 29.0], rel=1e-9)


def test_the_surface_is_made_at_its_moment_not_under_the_greatest_force() -> None:
    """Climb milling without helix: at the wall h = f^2 / (2 R), the paths of two teeth, so that there is hardly more
    than the edge force, whatever the chip was before.
    """
    removal = along_a_wall(MILL, AL, 4.0, width=4.0)
    p, n = wall_points(np.array([-2.0]))
    found = form_error(removal, AL, p, n, work=[1e-4], bars=None, near=0.1)
    feed = math.tau * 20.0 / (4 * 300.0)
    assert found.force == pytest.approx([4.0 * (AL.Kre + AL.Krc * feed**2 / (2.0 * MILL.radius))], rel=1e-4)
    greatest = removal.columns["force_normal_n"][found.step[0]]
    assert greatest > 3.0 * found.force[0]
    place = contacts(removal)
    step = step_deflections(removal, AL, place, work=np.full(len(place.step), 1e-4), bars=None, rotation=0.01)
    assert step["work_mm"][found.step[0]] == pytest.approx(1e-4 * greatest, rel=0.01)
    assert step["deflection_mm"] == pytest.approx(step["work_mm"])
    at = int(np.flatnonzero(place.step == found.step[0])[0])
    assert place.normal[at] == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    assert place.point[at, 1:] == pytest.approx([0.0, -2.0], abs=1e-6)


@pytest.mark.parametrize("helix", [0.0, 30.0])
@pytest.mark.parametrize("width", [0.3, 4.0])
def test_the_greatest_deflection_of_a_flank(helix, width) -> None:
    """Its engagement begins or ends abruptly: beside forces 0.02 deg apart it is at most 0.5 % too small."""
    mill = replace(MILL, helix=math.radians(helix))
    removal = along_a_wall(mill, AL, 4.0, width=width)
    place = contacts(removal)
    found = step_deflections(removal, AL, place, work=np.full(len(place.step), 1e-4), bars=None)
    (cuts,) = removal.cuts
    theta = np.arange(0.0, math.tau / mill.flutes, math.radians(0.02))
    force = in_work(forces_over_turn(cuts.engagement, mill, AL, theta)[0], cuts.engagement.frames)
    n = place.normal[np.searchsorted(place.step, cuts.step)]
    greatest = np.einsum("cmi,ci->cm", force, n).max(axis=1).clip(0.0)
    assert greatest.max() > 50.0
    ratio = found["force_normal_n"][cuts.step][greatest > 1.0] / greatest[greatest > 1.0]
    assert ratio.min() > 0.995
    # the chip rises within less than 0.02 deg before the edge leaves
    assert ratio.max() < 1.0 + 2e-4
    assert found["work_mm"] == pytest.approx(1e-4 * found["force_normal_n"], rel=1e-12)


def test_with_runout_the_longer_tooth_makes_the_wall_and_takes_more() -> None:
    """Two teeth, their radii 0.01 mm apart and 0.01 mm a tooth: the longer one alone, and it is 5 um longer."""
    mill = replace(MILL, flutes=2, runout=(0.005, 0.0))
    stock = LayeredStock.block((0.0, -10.0, -2.0), (20.0, 1.0, 0.0), 0.5, 15.0)
    feed = 0.01 * 2 * 300.0 / math.tau
    path = [rapid([-10.0, 5.0, -2.0], 300.0, 1, "link"), plunge([25.0, 5.0, -2.0], feed, 300.0, 1, "cut")]
    removal = remove(
        Program.join(path),
        stock,
        {1: mill},
        EDGE,
        FINE,
        keep=True,
    )
    p, n = wall_points(np.array([-1.0]), x=10.2)
    found = form_error(removal, EDGE, p, n, work=[1e-4], bars=None, near=0.1)
    assert found.rigid == pytest.approx([-0.005], abs=1e-6)
    assert found.work == pytest.approx([1e-4 * 20.0 * 2.0], rel=1e-9)
    assert found.left == pytest.approx([-0.001], abs=1e-6)


def test_a_point_that_no_step_reaches_is_said_to_be_unmade() -> None:
    removal, n = ball_rows()
    far = form_error(removal, AL, [[0.0, 3.5, -0.3], [0.1, 0.3, -0.94]], [n, n], work=None, bars=None, near=0.2)
    assert far.made.tolist() == [False, True]
    assert far.left[0] == 0.0


def test_what_is_wrong_is_said() -> None:
    removal, n = ball_rows()
    p, N = leaning_points(), np.tile(n, (6, 1))
    short = {1: (Bar(10.0, 1e-9),)}
    for message, change in (
        (r"tool 1 has no bars: give them, or None for rigid cutters", {"bars": {2: cutter_bars(BALL)}}),
        (r"the bars of tool 1 are 10 mm long: must be at least its flute_length_mm = 20", {"bars": short}),
        (r"form_error: near_mm = 0: must be above 0", {"near": 0.0}),
        (r"form_error: work\[1\] = -1 mm/N: a compliance must be at least 0", {"work": [0, -1, 0, 0, 0, 0]}),
        (r"form_error: work of shape \(5,\): must be \(6,\) or \(6, 3, 3\)", {"work": np.zeros(5)}),
    ):
        with pytest.raises(InputError, match=message):
            form_error(removal, AL, p, N, **({"work": None, "bars": None, "near": 0.2} | change))
    with pytest.raises(InputError, match="normals must be unit vectors"):
        form_error(removal, AL, p, 2.0 * N, work=None, bars=None, near=0.2)
    forgot, _ = ball_rows(keep=False)
    with pytest.raises(InputError, match=r"did not keep the tooth engagement: remove\(..., keep=True\)"):
        contacts(forgot)
    films = replace(forgot, columns={**forgot.columns, "chip_areas": np.zeros_like(forgot.columns["chip_areas"])})
    assert len(contacts(films).step) == 0  # films have no loads


@pytest.mark.parametrize("turn", [400.0, -400.0])
def test_the_moment_of_a_leaning_ball_is_that_when_its_edge_is_nearest(turn: float) -> None:
    """Trough of a ball that leans both ways: the edge in space, over all rotations, says when it makes a point."""
    stock = LayeredStock.block((-3.0, -5.0, -2.0), (4.0, 5.0, 0.0), 0.1, 15.0)
    axis = np.array([0.25, 0.2, 1.0]) / math.sqrt(1.0 + 0.25**2 + 0.2**2)
    centre = np.array([0.0, 0.0, 2.8])
    ends = [centre + np.array([x, 0.0, 0.0]) - 4.0 * axis for x in (-4.0, 4.0)]
    program = five_axis([e.tolist() for e in ends], [axis.tolist()] * 2, feed=10.0)
    program = replace(program, spindle=np.full(len(program), turn))
    removal = remove(
        program,
        stock,
        {1: BALL},
        AL,
        FINE_BALL,
        keep=True,
    )
    b = np.array([-0.4, -0.1, 0.2, 0.45])
    down = np.column_stack([np.zeros(4), np.sin(b), -np.cos(b)])
    ball = centre + np.array([0.7, 0.0, 0.0])
    points = ball + 4.0 * down
    found = form_error(removal, AL, points, -down, work=None, bars=None, near=0.1)
    assert abs(found.rigid).max() < 1e-6
    assert found.at_edge.all()
    (cuts,) = removal.cuts
    kappa, theta = np.linspace(0.01, 0.75, 371), np.linspace(0.0, math.pi, 1201)
    z = 4.0 - 4.0 * np.cos(kappa)
    for i in range(4):
        k = int(np.flatnonzero(cuts.step == found.step[i])[0])
        T, n, A = cuts.engagement.frame[k]
        tip = ball - 4.0 * axis
        best = (math.inf, 0.0)
        for j in range(2):
            phi = theta[:, None] - z * math.tan(BALL.helix) / 4.0 - math.pi * j
            u = np.cos(phi)[..., None] * n + np.sin(phi)[..., None] * T
            edge = tip + z[:, None] * A + 4.0 * np.sin(kappa)[:, None] * u
            d = np.linalg.norm(edge - points[i], axis=2)
            best = min(best, (float(d.min()), float(theta[np.unravel_index(d.argmin(), d.shape)[0]])))
        assert best[0] < 0.02
        force = in_work(forces_over_turn(cuts.engagement, BALL, AL, [best[1]])[0], cuts.engagement.frame)[k, 0]
        assert found.force[i] == pytest.approx(float(force @ -down[i]), rel=0.02, abs=0.3)
    assert np.ptp(found.force) > 2.0


def test_a_cantilever_wall_yields_by_the_beam_formula_under_the_force_of_the_edge() -> None:
    """Finite elements, chips and force joined: Kre b on a wall 30 mm high, F a^3 / (3 E I) and shear."""
    length, high, thick, modulus = 8.0, 30.0, 2.0, 7e4
    u, v = np.linspace(0.0, length, 5).tolist(), np.linspace(-high, 0.0, 16).tolist()
    grid = from_map(u, v, [0.0, thick], lambda p: p[:, [0, 2, 1]] * [1.0, -1.0, 1.0])
    part = factorise(SolidWorkpiece(grid, modulus, 0.0, 2.7e-9, grid.side("j-")))
    point, normal = np.array([[4.0, 0.0, -1.0]]), np.array([[0.0, 1.0, 0.0]])
    at = locate(grid, "k-", point, 1e-6)
    np.testing.assert_allclose(normals_of(grid, at, "k-"), normal, atol=1e-12)
    stock = LayeredStock.block((0.0, -2.0, -2.0), (length, 0.5, 0.0), 0.5, 15.0)
    path = [rapid([-10.0, 5.0, -2.0], 300.0, 1, "link"), plunge([15.0, 5.0, -2.0], 20.0, 300.0, 1, "cut")]
    removal = remove(
        Program.join(path),
        stock,
        {1: MILL},
        EDGE,
        FINE,
        keep=True,
    )
    found = form_error(removal, EDGE, point, normal, work=full_compliance(part, at), bars=None, near=0.1)
    EI, a = modulus * length * thick**3 / 12.0, high - 1.0
    shear = 1.2 * a / (0.5 * modulus * length * thick)
    assert found.force == pytest.approx([40.0], rel=1e-9)
    assert found.work == pytest.approx([40.0 * (a**3 / (3.0 * EI) + shear)], rel=0.005)
    along = form_error(removal, EDGE, point, normal, work=compliance(part, at, normal), bars=None, near=0.1)
    assert along.work == pytest.approx(found.work, rel=0.01)


def test_steps_kept_in_blocks_are_the_same_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, _ = ball_rows()
    monkeypatch.setattr("chipload.simulation.chips.BLOCK", 7)
    parts, _ = ball_rows()
    (a,), (b,) = whole.cuts, parts.cuts
    assert len(a) > 14
    assert a.step.tolist() == b.step.tolist()
    for name in ("start", "rows", "tooth", "frame"):
        np.testing.assert_allclose(getattr(a.engagement, name), getattr(b.engagement, name), atol=1e-9, err_msg=name)
    # each block numbers its own slices
    slices = (c.engagement.slices[c.engagement.slice] for c in (a, b))
    np.testing.assert_allclose(*slices, atol=1e-9)
    assert np.array_equal(a.ends, b.ends)
    assert (np.linalg.norm(a.ends[:, 3:6] - a.ends[:, :3], axis=1) <= 0.5 + 1e-9).all()
