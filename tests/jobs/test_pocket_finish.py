"""The finish passes of a pocket's floor and walls: heights, feeds, engagement, and where the finished wall stands."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.errors import InputError
from chipload.geometry.contour import Contour
from chipload.machine.machine import machine_named
from chipload.planning.pocket.plan import plan_pocket
from chipload.planning.pocket.request import Clearing, FloorFinish, WallFinish
from pocket_job import SMALL, checked, done, operation, swept, written

FINISH = """radial_depth_mm = 1.2
depth_mm = 6.0
allowance_mm = 0.3
floor_allowance_mm = 0.5
floor_finish = { feed_mm_min = 600.0, speed_rpm = 9000.0 }
wall_finish = { feed_mm_min = 500.0, speed_rpm = 9500.0, axial_depth_mm = 4.0 }
"""
#: what a disc of 4 mm reaches of the square
REACHED = 22.0 * 18.0 - (4.0 - math.pi) * 16.0


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    (pocket,), outcome = done(written(tmp_path_factory.mktemp("finish"), {"part": [SMALL]}, operation(FINISH)))
    return pocket, outcome


def rows_of(pocket, name):
    return np.array(pocket.program.labels, dtype=object)[pocket.program.label] == name


def test_heights_feeds_and_speeds(finished):
    """5.5 mm cleared in two levels, 0.5 mm of floor, 6 mm of wall in two levels, in this order."""
    pocket, _ = finished
    p = pocket.program
    rpm = 2.0 * math.pi / 60.0
    for name, heights, feed, speed in (
        ("pocket", [-5.5, -2.75], 955.0, 7960.0),
        ("floor", [-6.0], 600.0, 9000.0),
        ("wall", [-6.0, -3.0], 500.0, 9500.0),
    ):
        rows = rows_of(pocket, name)
        assert np.unique(p.p_work[rows, 2].round(9)).tolist() == heights
        assert p.feed[rows] == pytest.approx(feed / 60.0)
        assert p.spindle[rows] == pytest.approx(speed * rpm)
    order = [np.flatnonzero(rows_of(pocket, name)) for name in ("pocket", "floor", "wall")]
    assert order[0][-1] < order[1][0]
    assert order[1][-1] < order[2][0]
    finish = pocket.summary["finish"]
    assert (finish["floor"]["axial_depth_mm"], finish["wall"]["axial_depth_mm"]) == pytest.approx((0.5, 3.0))
    assert (finish["floor"]["levels"], finish["wall"]["levels"], pocket.summary["levels"]) == (1, 2, 5)


def test_the_engagement_is_kept_and_the_wall_is_thin(finished):
    """On straight walls acos(1 - 0.3 / 4), in the corners no more than was asked for."""
    pocket, outcome = finished
    h = pocket.history
    walls = h["engagement_deg"][h["pass"] == "wall"]
    assert walls.max() <= math.degrees(math.acos(1.0 - 1.2 / 4.0)) + 0.01
    straight = math.degrees(math.acos(1.0 - 0.3 / 4.0))
    assert np.isclose(h["engagement_deg"][h["pass"] == "wall"], straight, atol=0.02).mean() > 0.25
    (check,) = outcome.operations[0].verifications.values()
    assert check.numbers["engagement_difference_deg"] <= 0.05


def test_the_finished_wall_stands_where_it_is_drawn(finished):
    """Distance of the edge of what is swept from that of the opening of the square; areas in closed form.

    In a corner as narrow as the cutter an engagement below 90 deg leaves a thin crescent.
    """
    pocket, _ = finished
    assert pocket.summary["reachable_mm2"] == pytest.approx(REACHED, rel=1e-4)
    assert pocket.summary["leftover_mm2"] < 4.0 * 0.3
    opening = shapely.buffer(shapely.box(4, 4, 18, 14), 4.0, quad_segs=256)
    for z in (-3.0, -6.0):
        cut = shapely.union_all([swept(pocket.program, 4.0, low) for low in (z, -6.0)])
        edge = shapely.get_coordinates(shapely.segmentize(opening.exterior, 0.2))
        off = shapely.distance(shapely.points(edge), cut.exterior)
        corner = np.hypot(np.minimum(edge[:, 0], 22.0 - edge[:, 0]), np.minimum(edge[:, 1], 18.0 - edge[:, 1])) < 4.5
        assert off[~corner].max() < 2e-3
        assert off.max() < 0.08
        assert cut.area == pytest.approx(REACHED - pocket.summary["leftover_mm2"], rel=1e-4)
    rough = swept(pocket.program, 4.0, -2.75)
    assert rough.area == pytest.approx(REACHED - 2.0 * 0.3 * (22.0 + 18.0) + 4.0 * 0.09, abs=1.4)


def test_the_form_error_is_that_of_the_finished_wall(finished):
    h = finished[0].history
    assert h["form_error_um"][h["pass"] == "wall"].max() > 0.0
    assert h["form_error_um"][h["pass"] != "wall"].max() == 0.0


def test_an_allowance_of_the_floor_stays_without_its_finish(tmp_path):
    (pocket,), _ = done(
        written(tmp_path, {"part": [SMALL]}, operation("radial_depth_mm = 2.0\nfloor_allowance_mm = 0.5"))
    )
    assert pocket.program.p_work[:, 2].min() == pytest.approx(-3.5)
    assert "finish" not in pocket.summary


@pytest.mark.parametrize(
    ("more", "text"),
    [
        (
            "floor_finish = { feed_mm_min = 600.0, speed_rpm = 9000.0 }",
            "operation.floor_allowance_mm = 0: must be at least 0.001 with operation.floor_finish",
        ),
        ("floor_allowance_mm = 4.0", "operation.floor_allowance_mm = 4: must be below the depth of the pocket, 4"),
        (
            "wall_finish = { feed_mm_min = 600.0, speed_rpm = 9000.0 }",
            "operation.wall_finish.allowance_mm = 0: must be below operation.allowance_mm = 0",
        ),
        (
            "allowance_mm = 0.2\nwall_finish = { feed_mm_min = 600.0, speed_rpm = 90000.0 }",
            "operation.0.wall_finish.speed_rpm = 90000: machine vmc turns from",
        ),
        ('strategies = ["plain"]', "operation.0.strategies = ['plain']: must name at least one of pocket, trochoidal"),
    ],
)
def test_refused(tmp_path, more, text):
    with pytest.raises(InputError) as err:
        checked(written(tmp_path, {"part": [SMALL]}, operation(f"radial_depth_mm = 1.2\n{more}")))
    assert text in str(err.value)


def test_walls_by_level():
    """By level: clear, walls, clear, floor, walls, as deep as the walls may be at once; the clock runs on."""
    square = [Contour.polyline([(0, 0), (12, 0), (12, 10), (0, 10)], closed=True)]
    setting = Clearing(
        "down", 1.2, 4.0, 16.0, 830.0, 0.0, 5.0, 0.4, allowance=0.3, depth=6.0, floor_allowance=0.5,
        floor_finish=FloorFinish(10.0, 900.0), wall_finish=WallFinish(8.0, 900.0, 2.0, by_level=True),
    )  # fmt: skip
    cutter = Cutter(diameter=4.0, flutes=3, helix=0.5, flute_length=12.0, overhang=20.0, modulus=580e3)
    planned = plan_pocket(square, setting, cutter, material_named("al7075-t6"), machine_named("vmc"), {})
    pocket = planned.strategies["pocket"]
    p = pocket.program
    named = np.array(p.labels, dtype=object)[p.label]
    at = [(str(name), round(float(z), 6)) for name, z in zip(named, p.p_work[:, 2], strict=True)]
    at = [one for one in at if one[0] in ("pocket", "floor", "wall")]
    assert list(dict.fromkeys(at)) == [
        ("pocket", -2.75), ("wall", -1.375), ("wall", -2.75), ("pocket", -5.5), ("floor", -6.0),
        ("wall", -4.375), ("wall", -6.0),
    ]  # fmt: skip
    assert all(one == at[k] or one not in at[: k + 1] for k, one in enumerate(at[1:]))
    assert pocket.summary["finish"]["wall"]["levels"] == 4
    assert (np.diff(pocket.history["t_s"]) >= 0.0).all()
