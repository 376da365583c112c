"""Pockets by the job file: levels, open sides, parts that stand in the stock, holes to enter by, rest machining, and
the engagement that the limits allow. Every plan is checked by the simulation, which knows no planner.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from chipload.errors import InputError
from chipload.jobs import load_job
from chipload.jobs.contour.run import _resolve_operation, read_inputs
from chipload.jobs.contour.scene import blanks_of
from pocket_job import SMALL, SQUARE, checked, done, operation, swept, written

#: the limits are used up by the nominal loads
NOMINAL = "\n[checks]\nconfidence = 0.5\n"


def test_levels_at_an_engagement_that_is_stated(tmp_path):
    """7 mm in levels of at most 4: two of 3.5 mm, each the same path, and twice the cutting time."""
    (one,), _ = done(written(tmp_path, {"part": [SMALL]}, operation("engagement_deg = 40.0")))
    assert one.summary["engagement_deg"]["wanted"] == pytest.approx(40.0)
    (two,), outcome = done(written(tmp_path, {"part": [SMALL]}, operation("engagement_deg = 40.0\ndepth_mm = 7.0")))
    assert two.summary["levels"] == 2
    floors = two.program.p_work[:, 2]
    for z in (-3.5, -7.0):
        assert np.isclose(floors, z, atol=1e-9).any()
        assert swept(two.program, 4.0, z).area == pytest.approx(swept(one.program, 4.0, -4.0).area, rel=1e-6), z
    assert two.summary["cutting_s"] == pytest.approx(2.0 * one.summary["cutting_s"], rel=1e-3)
    assert two.summary["passes"] == 2 * one.summary["passes"]
    assert two.summary["lifts"] == 2 * (one.summary["lifts"] + 1) - 1
    assert outcome.operations[0].depth == 7.0
    assert (np.diff(two.history["t_s"]) >= -1e-9).all()
    # it is drawn in a block that has a floor below the pocket
    (blank,) = blanks_of(outcome).values()
    assert blank.mesh.bounds[:, 2].tolist() == pytest.approx([-7.0 - 3.5, 0.0])


def test_a_part_that_stands_in_the_stock(tmp_path):
    """A boss of 6 mm in a block of 40 x 30: all around it is cut from the open sides, no bore, and the boss stays."""
    (boss,), _ = done(
        written(
            tmp_path,
            {"STOCK": [[(0, 0), (40, 0), (40, 30), (0, 30)]], "part": [(20, 15, 6)]},
            operation('radial_depth_mm = 1.2\nside = "outside"'),
            part='stock_layers = ["STOCK"]',
        )
    )
    assert not [e for e in boss.events if e.code == "pocket-entry"]
    cut = swept(boss.program, 4.0, -4.0)
    stock, kept = shapely.box(0, 0, 40, 30), shapely.buffer(shapely.points(20, 15), 6.0, quad_segs=256)
    assert shapely.intersection(cut, kept).area < 2e-2
    assert shapely.difference(shapely.difference(stock, kept), cut).area < 0.003 * stock.area
    # outside of the stock nothing is cut: down there the engagement is 0
    h = boss.history
    away = (h["x_mm"] < -4.0) | (h["x_mm"] > 44.0) | (h["y_mm"] < -4.0) | (h["y_mm"] > 34.0)
    assert h["engagement_deg"][away].max(initial=0.0) == 0.0


def test_a_pocket_open_to_one_side(tmp_path):
    """A pocket drawn beyond the edge of the stock is entered from there."""
    (pocket,), _ = done(
        written(
            tmp_path,
            {"STOCK": [[(0, 0), (40, 0), (40, 30), (0, 30)]], "part": [[(-10, 6), (22, 6), (22, 24), (-10, 24)]]},
            operation("radial_depth_mm = 1.2"),
            part='stock_layers = ["STOCK"]',
        )
    )
    assert not [e for e in pocket.events if e.code == "pocket-entry"]
    wanted = shapely.intersection(shapely.box(0, 0, 40, 30), shapely.box(-10, 6, 22, 24))
    missing = shapely.difference(wanted, swept(pocket.program, 4.0, -4.0)).area
    corners = 2.0 * (1.0 - math.pi / 4.0) * 16.0
    assert missing == pytest.approx(corners + pocket.summary["leftover_mm2"], abs=0.05)
    assert pocket.summary["leftover_mm2"] < 0.003 * wanted.area


def test_a_hole_to_enter_by(tmp_path):
    """No bore, and the first cut is made from the hole."""
    (pocket,), _ = done(
        written(tmp_path, {"part": [SMALL]}, operation("radial_depth_mm = 1.2\nholes_mm = [[11.0, 9.0, 10.0]]"))
    )
    assert not [e for e in pocket.events if e.code == "pocket-entry"]
    assert pocket.summary["entry_s"] < 1.0
    first = np.flatnonzero(pocket.history["pass"] == "pocket")[0]
    x, y = pocket.history["x_mm"][first], pocket.history["y_mm"][first]
    assert math.hypot(x - 11.0, y - 9.0) < 2.5


def test_what_a_larger_cutter_left(tmp_path):
    """The corners of a square: (1 - pi/4) (R^2 - r^2) each, and nothing else is cut."""
    (large, small), _ = done(
        written(
            tmp_path,
            {"part": [SQUARE]},
            operation("radial_depth_mm = 1.2"),
            operation("radial_depth_mm = 0.6\nrest_of = 0", cutter=2),
        )
    )
    corners = 4.0 * (1.0 - math.pi / 4.0) * (16.0 - 6.25)  # and what the larger one left beside them, with its margin
    assert corners < small.summary["reachable_mm2"] < corners + 4.0 * large.summary["leftover_mm2"]
    assert small.summary["cutting_s"] < 0.2 * large.summary["cutting_s"]
    both = shapely.union(swept(large.program, 4.0, -4.0), swept(small.program, 2.5, -4.0))
    left = shapely.difference(shapely.box(0, 0, 30, 24), both).area - 4.0 * (1.0 - math.pi / 4.0) * 6.25
    assert 0.0 < left <= large.summary["leftover_mm2"] + small.summary["leftover_mm2"] + 0.05
    assert small.summary["leftover_mm2"] < 0.005 * 30 * 24


def test_a_finish_pass_of_the_walls(tmp_path):
    """The same cutter takes the 0.2 mm that it left, at no more than the engagement asked for, in the corners too."""
    (rough, finish), _ = done(
        written(
            tmp_path,
            {"part": [SQUARE, (15, 12, 2)]},
            operation("radial_depth_mm = 1.2\nallowance_mm = 0.2"),
            operation("radial_depth_mm = 1.2\nrest_of = 0"),
        )
    )
    more = finish.summary["reachable_mm2"] - _ring(0.2)  # what clearing left beside the allowance, with its margin
    assert 0.0 < more < 4.0 * rough.summary["leftover_mm2"]
    assert finish.summary["engagement_deg"]["max"] <= math.degrees(math.acos(1.0 - 1.2 / 4.0))
    assert finish.summary["cutting_s"] < 0.35 * rough.summary["cutting_s"]
    cut = shapely.union(swept(rough.program, 4.0, -4.0), swept(finish.program, 4.0, -4.0))
    assert shapely.intersection(cut, shapely.buffer(shapely.points(15, 12), 2.0, quad_segs=256)).area < 5e-3


def _ring(allowance: float) -> float:
    """What a disc of 4 mm reaches of the square with its island, less what it reaches so far off their walls."""

    def area(off: float) -> float:
        free = shapely.difference(shapely.box(0, 0, 30, 24), shapely.buffer(shapely.points(15, 12), 2.0, quad_segs=256))
        return float(shapely.buffer(shapely.buffer(free, -4.0 - off, quad_segs=256), 4.0, quad_segs=256).area)

    return area(0.0) - area(allowance)


@pytest.mark.parametrize(
    ("limits", "by", "drawn"),
    [
        ("force_xy_n = 260.0", "force_xy_n", SMALL),
        ("torque_nm = 0.9\nengagement_deg = 90.0", "torque_nm", SQUARE),
    ],
)
def test_the_engagement_that_the_limits_allow(tmp_path, limits, by, drawn):
    """The limit is used, and nowhere exceeded."""
    (pocket,), outcome = done(
        written(tmp_path, {"part": [drawn]}, operation('engagement_deg = "limit"'), limits=limits + NOMINAL)
    )
    (text,) = outcome.operations[0].result.findings
    assert f"by {by}" in text
    limit = float(limits.split("\n")[0].split("=")[1])
    cut = pocket.history["pass"] == "pocket"
    assert 0.6 * limit < pocket.history[by][cut].max() <= limit
    job = load_job(
        written(
            tmp_path, {"part": [drawn]}, operation('engagement_deg = "limit"'),
            limits=limits.replace(str(limit), str(0.9 * limit)) + NOMINAL,
        )
    ).job  # fmt: skip
    tighter, _ = _resolve_operation(job, read_inputs(job), job.operations[0])
    wanted = math.degrees(math.acos(1.0 - tighter.radial_depth_mm / 4.0))
    assert wanted < pocket.summary["engagement_deg"]["wanted"]


@pytest.mark.parametrize(
    ("more", "drawn", "part", "text"),
    [
        ("", {"part": [SQUARE]}, "", "operation.0.radial_depth_mm and operation.0.engagement_deg: missing: state one"),
        (
            "radial_depth_mm = 1.0\nengagement_deg = 30.0", {"part": [SQUARE]}, "",
            "operation.0.radial_depth_mm and operation.0.engagement_deg: stated twice: state one",
        ),
        ("radial_depth_mm = 1.0\nrest_of = 0", {"part": [SQUARE]}, "", "operation.0.rest_of = 0: must be the number"),
        (
            'radial_depth_mm = 1.0\nside = "outside"', {"part": [SQUARE]}, "",
            "operation.side = 'outside': needs part.stock_layers",
        ),
        (
            "radial_depth_mm = 1.0\nholes_mm = [[15.0, 12.0, 8.0]]", {"part": [SQUARE]}, "",
            "operation.holes_mm: a hole of diameter 8 mm: must be above the cutter's diameter_mm = 8",
        ),
        (
            "radial_depth_mm = 1.0", {"part": [SQUARE]}, 'stock_layers = ["raw"]',
            "part.stock_layers: no contour on layer 'raw'",
        ),
        (
            'radial_depth_mm = 1.0\nside = "outside"',
            {"raw": [[(0, 0), (40, 0), (40, 20), (20, 20), (20, 40), (0, 40)]], "part": [(10, 10, 3)]},
            'stock_layers = ["raw"]', "the outline of the stock has inner corners that the cutter of radius 4 mm",
        ),
        ("radial_depth_mm = 1.0\ndepth_mm = 25.0", {"part": [SQUARE]}, "", "operation.0.depth_mm = 25: must be at"),
    ],
)  # fmt: skip
def test_refused(tmp_path, more, drawn, part, text):
    path = written(tmp_path, drawn, operation(more), part=part)
    with pytest.raises(InputError) as err:
        checked(path)
    assert text in str(err.value)


def test_no_engagement_holds(tmp_path):
    path = written(tmp_path, {"part": [SQUARE]}, operation('engagement_deg = "limit"'), limits="force_xy_n = 5.0")
    with pytest.raises(InputError, match=r"no engagement from 2 deg keeps the limits: force_xy_n 16.3 of 5: lower"):
        checked(path)
