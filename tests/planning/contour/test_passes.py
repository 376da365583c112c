"""Several semi-finish passes: each takes the radial depth it should, and the simulation agrees with all of them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.geometry.contour import Contour, Region
from chipload.machine.machine import machine_named
from chipload.planning.contour.plan import plan_contour
from chipload.simulation.verify import verify_contour
from finishing import CORNER, FINISHING, POCKET, QUARTER

#: turns left, then right
BEND = Contour.from_bulges([(0, 0), (20, 0), (28, 8), (28, 16), (37, 25), (60, 25)], [0, QUARTER, 0, -QUARTER, 0, 0])
MILL = Cutter(10.0, 4, math.radians(30), 22.0, 35.0, 580e3)
#: 1 - cos a = s / R on a straight wall
WANTED_DEG = math.degrees(math.acos(1.0 - 0.1 / 5.0))
BASE = replace(FINISHING, step=0.4)
#: contour, side, and the depth that roughing must leave for four passes by the backward method
PLACES = {
    "corner, inside": (CORNER, "inside", 0.8),
    "corner, outside": (CORNER, "outside", 1.0),
    "bend, left": (BEND, "left", 1.0),
    "bend, right": (BEND, "right", 1.0),
    "pocket": (POCKET, "inside", 0.8),
    "boss": (POCKET, "outside", 1.0),
}


def plan(contour, **changes):
    setting = replace(BASE, **changes)
    return plan_contour([contour], setting, MILL, material_named("al7075-t6"), machine_named("vmc"), {}).strategies


def proof(result, slack):
    return verify_contour(
        result.program,
        MILL.radius,
        result.history,
        stock=Region(tuple(result.drawn["stock before"])),
        stock_top_mm=0.0,
        wall=result.drawn["wall"],
        material="right",
        engagement_tolerance_deg=0.01,
        gouge_tolerance_mm=slack,
        excess_tolerance_mm=slack,
    )


def runs(history, name="semifinish"):
    """Rows of each pass, in the order of the program."""
    k = np.flatnonzero(history["pass"] == name)
    return np.split(k, np.flatnonzero(np.diff(k) > 1) + 1)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize(
    ("milling", "joint", "passes"),
    [("down", "sharp", 2), ("down", "sharp", 3), ("up", "clothoid", 1), ("up", "clothoid", 4)],
)
def test_the_simulation_agrees(place, passes, milling, joint):
    contour, side, depth = PLACES[place]
    results = plan(contour, side=side, passes=passes, milling=milling, joint=joint, semifinish_depth=depth)
    for name, result in results.items():
        told = proof(result, BASE.tolerance if joint == "clothoid" else 1e-4)
        assert told.verdict == "proved", (name, told.reasons)
        assert told.compared == len(result.history["s_mm"])
        assert not [e for e in result.events if e.failure]


@pytest.mark.parametrize("place", PLACES)
def test_every_pass_takes_its_depth_from_straight_walls(place):
    """1 - cos a = s / R on lines, in each pass but the first, which takes what roughing left: s1 / R."""
    contour, side, depth = PLACES[place]
    first = math.degrees(math.acos(1.0 - depth / MILL.radius))
    for name, result in plan(contour, side=side, passes=3, semifinish_depth=depth).items():
        h = result.history
        found = runs(h)
        assert len(found) == 3
        for k, rows in enumerate([*found, *runs(h, "finish")]):
            typical = float(np.median(h["engagement_deg"][rows[:10]]))
            assert typical == pytest.approx(first if k == 0 else WANTED_DEG, abs=1e-3), (name, k)


def test_the_finish_pass_does_not_depend_on_the_number_of_passes():
    one = plan(CORNER)["backward"].history
    for passes in (2, 3, 4):
        more = plan(CORNER, passes=passes, semifinish_depth=0.8)["backward"].history
        for column in ("x_mm", "y_mm", "engagement_deg", "force_xy_n"):
            rows = [h[column][h["pass"] == "finish"] for h in (one, more)]
            np.testing.assert_allclose(rows[1], rows[0], rtol=0, atol=1e-6)


def test_semifinish_passes_say_where_they_overshoot():
    """The kink of P* in front of the corner grows with every pass back; the greatest engagement is reported."""
    result = plan(CORNER, passes=3, semifinish_depth=0.8)["backward"]
    events = [e for e in result.events if e.code == "semifinish-overshoot"]
    assert len(events) == 2
    for rows, event in zip(runs(result.history)[1:], events, strict=True):
        most = result.history["engagement_deg"][rows].max()
        assert f"rises to {most:.4g} deg" in event.text
        assert most > WANTED_DEG
    assert not [e for e in plan(CORNER)["backward"].events if e.code == "semifinish-overshoot"]


@pytest.mark.parametrize("place", ["corner, inside", "boss"])
def test_thin_stock_is_a_failure_and_its_remedy_is_right(place):
    """Four passes ask for more stock in places than 0.5 mm of the first pass leave; the depth named is enough."""
    contour, side, _ = PLACES[place]
    (thin,) = [e for e in plan(contour, side=side, passes=4)["backward"].events if e.failure]
    assert thin.code == "stock-thin"
    missing = float(thin.text.rsplit(" ", 1)[1])
    enough = plan(contour, side=side, passes=4, semifinish_depth=0.5 + 1.001 * missing)["backward"]
    assert proof(enough, 1e-4).verdict == "proved"
    assert not [e for e in enough.events if e.failure]
    less = plan(contour, side=side, passes=4, semifinish_depth=0.5 + 0.9 * missing)["backward"]
    assert proof(less, 1e-4).verdict == "failed"


@pytest.mark.parametrize("place", ["corner, inside", "corner, outside"])
def test_forward_passes_do_not_meet_the_ends_of_the_one_before(place):
    contour, side, _ = PLACES[place]
    result = plan(contour, side=side, passes=3, strategies=("forward",), use="forward", step=0.1)["forward"]
    told = verify_contour(
        result.program,
        MILL.radius,
        result.history,
        stock=Region(tuple(result.drawn["stock before"])),
        stock_top_mm=0.0,
        wall=result.drawn.get("wall", ()),
        material="right",
        engagement_tolerance_deg=0.05,
        gouge_tolerance_mm=1e-4,
        excess_tolerance_mm=1e-4,
    )
    assert told.verdict == "proved", told.reasons
