"""The corner of [Uddin2007]: R 5, s 0.1, inside corner of 8 mm.

Angles, ratios and places; the cutting conditions are lost, so no newtons.
"""

import math
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.geometry.contour import Contour
from chipload.geometry.offset import offset
from chipload.machine.machine import machine_named, read_machine
from chipload.planning.contour.backward import concave_kinks, leading_curve
from chipload.planning.contour.blend import clothoid_length, ease_arcs
from chipload.planning.contour.forward import forward_pass
from chipload.planning.contour.plan import Finishing, plan_contour
from chipload.planning.contour.schedule import within_machine

R, S = 5.0, 0.1
A = math.acos(1.0 - S / R)
QUARTER = math.tan(math.pi / 8)


def without_edges():
    return replace(material_named("al7075-t6"), Kte=0.0, Kre=0.0, Kae=0.0)


MATERIALS = {True: material_named("al7075-t6"), False: without_edges()}
CORNER = Contour.from_bulges([(0, 0), (20, 0), (28, 8), (28, 28)], [0, QUARTER, 0, 0])
SETTING = Finishing(
    side="inside",
    milling="down",
    strategies=("plain", "backward", "feed"),
    use="backward",
    joint="sharp",
    radial_depth=S,
    axial_depth=5.0,
    semifinish_depth=0.5,
    passes=1,
    feed=10.0,
    spindle_speed=314.0,
    tolerance=0.05,
    step=0.05,
    lead=5.0,
    top=0.0,
    clearance=5.0,
)


def plan(contours=(CORNER,), material=None, machine=None, **changes):
    cutter = Cutter(10.0, 4, math.radians(30), 22.0, 35.0, 580e3)
    material = material or material_named("al7075-t6")
    return plan_contour(
        list(contours), replace(SETTING, **changes), cutter, material, machine or machine_named("vmc"), {}
    ).strategies


@pytest.fixture(scope="module")
def sharp():
    return plan()


def finish(result, column):
    return result.history[column][result.history["pass"] == "finish"]


def test_wanted_angle_and_allowance():
    assert math.degrees(A) == pytest.approx(11.478, abs=1e-3)
    lead = leading_curve(Contour.circle((0, 0), 3.0), R, A)
    assert 8.0 - lead.radii[0] == pytest.approx(0.0375883, abs=5e-8)
    before = offset([lead], R)[0]
    assert before.radii[0] == pytest.approx(2.962412, abs=5e-7)


def test_kink_of_the_leading_curve(sharp):
    """delta = 7.17848 deg where the line runs into the corner.

    The fillet of 5 mm between the line and the arc of 7.9624 mm, not the 9.83 um of two straight sides: its centre is
    5.1 mm above the wall and 2.9624 mm from the corner's centre.
    """
    points, turn = concave_kinks(leading_curve(offset([CORNER], R)[0], R, A))
    assert math.degrees(turn[0]) == pytest.approx(7.17848, abs=1e-5)
    assert points[0] == pytest.approx((20.0 + R * math.sin(A), 0.1), abs=1e-9)
    inner = math.hypot(3.0 + R * math.cos(A), R * math.sin(A)) - R
    centre = 20.0 + math.sqrt(inner**2 - 2.9**2)
    gap = math.hypot(points[0, 0] - centre, 5.0) - 5.0
    (event,) = [e for e in sharp["backward"].events if e.code == "joint-overshoot"]
    assert float(event.text.split("leaves ")[1].split(" µm")[0]) == pytest.approx(1e3 * gap, abs=0.006)


def test_plain_rises_in_the_corner(sharp):
    a = finish(sharp["plain"], "engagement_deg")
    assert a.min() == pytest.approx(11.478, abs=1e-3)
    assert a.max() == pytest.approx(18.737, abs=1e-3)


def test_plain_rises_before_the_tangent_point(sharp):
    """The rise starts R sin(a_line) = 0.995 mm before the tangent point, because P runs ahead of O."""
    h = sharp["plain"].history
    run = (h["pass"] == "finish") & (h["x_mm"] <= 20.0) & (np.abs(h["y_mm"] - 5.0) < 1e-9)
    x, a = h["x_mm"][run], h["engagement_deg"][run]
    for d, wanted in ((0.9, 11.5133), (0.7, 11.8641), (0.5, 12.7340), (0.25, 14.9054), (0.0, 18.7375)):
        assert np.interp(20.0 - d, x, a) == pytest.approx(wanted, abs=1e-3)
    assert x[a > math.degrees(A) + 1e-6].min() == pytest.approx(20.0 - R * math.sin(A), abs=0.051)


def test_backward_sharp_stays_in_the_papers_band(sharp):
    a = finish(sharp["backward"], "engagement_deg")
    assert a.min() >= 11.47
    assert 12.85 <= a.max() <= 12.92


@pytest.mark.parametrize("column", ["force_xy_n", "torque_nm", "form_error_um"])
def test_range_less_by_75_to_84_percent(sharp, column):
    before, after = (np.ptp(finish(sharp[name], column)) for name in ("plain", "backward"))
    assert 0.75 <= 1.0 - after / before <= 0.84


def test_greatest_error_at_the_corners_entry(sharp):
    """The paper saw its greatest error at the entry; so far as the path is reshaped that is where the joint is."""
    h = sharp["backward"].history
    rows = h["pass"] == "finish"
    k = np.flatnonzero(rows)[np.argmax(h["form_error_um"][rows])]
    assert (h["x_mm"][k], h["y_mm"][k]) == pytest.approx((20.0, 5.0), abs=0.1)


def test_clothoid_makes_it_constant():
    eased_plan = plan(joint="clothoid")
    a = finish(eased_plan["backward"], "engagement_deg")
    assert np.abs(a - math.degrees(A)).max() < 0.01
    assert 0.0 < eased_plan["backward"].summary["deviation_mm"] <= SETTING.tolerance


def test_clothoid_length():
    assert clothoid_length(R, A, 3.0, 1.0) == pytest.approx(1.02 * 1.66, abs=5e-3)


def test_tight_tolerance_shortens_the_clothoid_and_says_so():
    path = offset([CORNER], R)[0]
    e = ease_arcs(path, R, A, 0.005)
    assert [x.code for x in e.events] == ["joint-short"]
    assert 0.0 < e.deviation_mm <= 0.005


def test_deviation_is_the_distance_of_the_walls():
    """The eased path against the drawn one, by a polygon of fine chords."""
    import shapely

    path = offset([CORNER], R)[0]
    e = ease_arcs(path, R, A, 0.05)
    drawn = shapely.linestrings(path.flatten(1e-6))
    points = shapely.points(e.path.at(np.linspace(0.0, e.path.length, 2000))[0])
    assert shapely.distance(drawn, points).max() == pytest.approx(e.deviation_mm, abs=1e-4)


def test_up_milling_is_the_mirror():
    """A corner symmetric about its bisector: the same angles, entered from the other end."""
    up = plan(milling="up", strategies=("plain",))["plain"]
    a = finish(up, "engagement_deg")
    assert (a.min(), a.max()) == pytest.approx((11.478341, 18.737542), abs=1e-5)
    assert finish(up, "x_mm")[0] == pytest.approx(23.0, abs=1e-9)


def slow_machine(folder):
    """The vmc with axes of 20 mm/s^2 and a jerk of 40 mm/s^3: without a fast servo."""
    text = (resources.files("chipload") / "data" / "machines" / "vmc.toml").read_text()
    text = text.replace("acceleration_mm_s2 = 3000.0", "acceleration_mm_s2 = 20.0")
    path = folder / "slow.toml"
    path.write_text(text.replace("jerk_low_mm_s3 = 20000.0", "jerk_mm_s3 = 40.0"))
    return read_machine(path)


@pytest.fixture(scope="module")
def slow(tmp_path_factory):
    machine = slow_machine(tmp_path_factory.mktemp("machine"))
    return {edges: plan(material=material, machine=machine) for edges, material in MATERIALS.items()}


@pytest.fixture(scope="module")
def no_edge_force():
    return plan(material=without_edges())


def force_by_hand(material, a, feed_per_tooth):
    """Greatest force in the plane over a revolution, the cutter in slices; down milling, engaged from pi - a to pi."""
    k = np.arange(2000)
    z = 5.0 * (k + 0.5) / len(k)
    most = 0.0
    for turn in np.linspace(0.0, math.pi / 2, 721):
        phi = (turn - z * math.tan(math.radians(30)) / R + np.arange(4)[:, None] * math.pi / 2) % math.tau
        cuts = (phi >= math.pi - a) & (phi <= math.pi)
        h = feed_per_tooth * np.sin(phi)
        ft, fr = material.Ktc * h + material.Kte, material.Krc * h + material.Kre
        x = np.where(cuts, ft * np.cos(phi) + fr * np.sin(phi), 0.0).sum()
        y = np.where(cuts, ft * np.sin(phi) - fr * np.cos(phi), 0.0).sum()
        most = max(most, math.hypot(x, y) * 5.0 / len(k))
    return most


def test_feed_schedule_holds_the_force(no_edge_force):
    """Without edge forces there is a feed for every engagement: in the corner the force is that of the straight wall,
    by a force model of its own, within the 1 % that feeds are written in.
    """
    feed = no_edge_force["feed"]
    a, f = finish(feed, "engagement_deg"), finish(feed, "feed_mm_min")
    k = int(a.argmax())
    wanted = force_by_hand(without_edges(), A, 10.0 * math.tau / (4 * 314.0))
    per_tooth = f[k] / 60.0 * math.tau / (4 * 314.0)
    assert force_by_hand(without_edges(), math.radians(a[k]), per_tooth) == pytest.approx(wanted, rel=0.03)
    force = finish(feed, "force_xy_n")
    assert force.max() <= 1.005 * feed.summary["force_straight_n"]
    assert np.ptp(force) <= 0.2 * np.ptp(finish(no_edge_force["plain"], "force_xy_n"))


def test_edge_force_leaves_no_feed_for_the_corner(sharp):
    """With edge forces the corner is beyond any feed: the schedule says so with the place."""
    (event,) = [e for e in sharp["feed"].events if e.code == "feed-least"]
    assert event.x > 19.0
    edge = force_by_hand(material_named("al7075-t6"), math.radians(18.7375), 0.0)
    assert edge > sharp["feed"].summary["force_straight_n"]
    assert sharp["plain"].summary["at_equal_force"] is None


def test_schedule_keeps_acceleration_and_jerk():
    """A machine of 20 mm/s^2 and 40 mm/s^3: by differences of the feeds along the path."""
    s = np.linspace(0.0, 60.0, 3001)
    wanted = np.where((s > 20.0) & (s < 30.0), 4.0, 10.0)
    v = within_machine(s, wanted, 20.0, 40.0)
    assert (v <= wanted + 1e-12).all()
    t = np.concatenate([[0.0], np.cumsum(np.diff(s) * 2.0 / (v[1:] + v[:-1]))])
    even = np.linspace(0.0, t[-1], 1500)
    speed = np.interp(even, t, v)
    rate = np.diff(speed) / even[1]
    assert np.abs(rate).max() <= 20.0 * 1.02
    smooth = np.convolve(rate, np.ones(15) / 15.0, "valid")
    assert np.abs(np.diff(smooth)).max() / even[1] <= 40.0 * 1.1
    only = within_machine(s, wanted, 20.0, None)
    assert v.max() == pytest.approx(10.0)
    assert (v <= only + 1e-9).all()


def test_backward_wins_with_edge_force_and_on_a_slow_machine(sharp, no_edge_force, slow):
    """At equal time backward has the least force, but for one: a schedule without edge force on an agile machine."""
    for edges, plans in ((True, sharp), (False, no_edge_force), (True, slow[True]), (False, slow[False])):
        backward = plans["backward"].summary["at_equal_time"]
        for name in ("plain", "feed"):
            found = plans[name].summary["at_equal_time"]
            assert found["finish_time_s"] == pytest.approx(backward["finish_time_s"], rel=3e-3)
            agile = name == "feed" and not edges and plans is no_edge_force
            assert (found["force_xy_n"] > backward["force_xy_n"]) != agile
            held = plans[name].summary["at_equal_force"]
            assert (held is None) == edges
            assert held is None or held["force_xy_n"] <= backward["force_xy_n"] * (1.0 + 1e-6)


def table(agile, slow):
    """Strategies on the vmc, then on the slow machine."""
    out = [
        "| strategy | machine | engagement [deg] | force in the plane [N] | range of it | form error [µm] "
        "| of it over the straight wall | finish pass [s] | at equal force [s] | force at equal time [N] |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    before = np.ptp(finish(agile["plain"], "force_xy_n"))
    rows = [("vmc", agile, name) for name in ("plain", "backward", "feed")]
    rows += [("slow", slow, name) for name in ("backward", "feed")]
    for machine, plans, name in rows:
        r = plans[name]
        away = np.hypot(finish(r, "x_mm") - [[0.0], [23.0]], finish(r, "y_mm") - [[5.0], [28.0]]).min(axis=0) > 5.0
        a, f, e = (finish(r, c)[away] for c in ("engagement_deg", "force_xy_n", "form_error_um"))
        force, time = r.summary["at_equal_force"], r.summary["at_equal_time"]
        held = "no feed" if force is None else f"{force['finish_time_s']:.2f}"
        out.append(
            f"| {name} | {machine} | {a.min():.2f} to {a.max():.2f} | {f.min():.1f} to {f.max():.1f} "
            f"| {100.0 * (np.ptp(f) / before - 1.0):+.0f} % | {e.min():.2f} to {e.max():.2f} | {np.ptp(e):.2f} "
            f"| {r.summary['finish_time_s']:.2f} | {held} | {time['force_xy_n']:.1f} |"
        )
    return "\n".join(out)


def test_the_tables_of_the_documentation(sharp, no_edge_force, slow):
    """docs/papers.md holds what the plans of the source's corner give now."""
    text = (Path(__file__).parents[2] / "docs" / "papers.md").read_text()
    for agile, edges in ((sharp, True), (no_edge_force, False)):
        wanted = table(agile, slow[edges])
        assert wanted in text, wanted


def test_boss_asks_for_more_stock():
    """Outside a convex corner the allowance grows to r_P - r_c: thin roughing is reported with what is missing."""
    boss = Contour.from_bulges(
        [(3, 0), (37, 0), (40, 3), (40, 27), (37, 30), (3, 30), (0, 27), (0, 3)], [0, QUARTER] * 4, closed=True
    )
    wanted = math.hypot(8.0 - R * math.cos(A), R * math.sin(A)) - 3.0
    (event,) = [
        e
        for e in plan([boss], side="outside", strategies=("backward",), semifinish_depth=0.01)["backward"].events
        if e.failure
    ]
    assert event.code == "stock-thin"
    assert f"needs {wanted:.4g} mm" in event.text


def test_stori_wright():
    """Old surface 7.9 mm: r_Q 7.9370913, kappa_O 0.3404729; first order in the step."""
    errors = []
    for step in (0.02, 0.01, 0.005):
        run = forward_pass(Contour.circle((0, 0), 7.9), R, A, step)
        assert run.event is None
        errors.append(np.hypot(*run.made[-1]) - 7.9370913)
        kappa = 1.0 / np.hypot(*run.centre[len(run.centre) // 2])
        assert kappa == pytest.approx(0.3404729, abs=0.01 * step)
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.02)
    assert errors[1] / errors[2] == pytest.approx(2.0, abs=0.02)


@pytest.mark.parametrize(
    ("old", "step", "code"),
    [
        (Contour.circle((0, 0), 4.9), 0.02, "forward-stops"),
        (Contour.polyline([(0, 0), (10, 0), (10.5, -20)]), 0.02, "forward-corner"),
        (Contour.polyline([(0, 0), (10, 0), (10, 20)]), 2.0, "forward-no-point"),
    ],
)
def test_stori_wright_fails_with_the_place(old, step, code):
    run = forward_pass(old, R, A, step)
    assert run.event is not None
    assert run.event.code == code
    assert run.event.failure
    assert np.hypot(run.event.x - run.centre[-1, 0], run.event.y - run.centre[-1, 1]) < 5.0 * step


def test_forward_laps_keep_the_angle():
    boss = Contour.from_bulges(
        [(8, 0), (40, 0), (48, 8), (48, 30), (40, 38), (8, 38), (0, 30), (0, 8)], [0, QUARTER] * 4, closed=True
    )
    run = plan([boss], side="outside", strategies=("forward",), use="forward", passes=2, step=0.02)["forward"]
    a = run.history["engagement_deg"][run.history["pass"] == "forward"]
    assert np.abs(a - math.degrees(A)).max() < 0.1
