"""Covered areas that are known in closed form; errors of fourth order, so 1e-9 relative at a fine tolerance."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.chips import chips
from chipload.engagement.chips.covered import covered, covered_areas
from chipload.engagement.chips.move import Move
from chipload.engagement.chips.ring import Origin
from engagement.chips.brute import CUTTERS, random_move

R, TILT, TURN, TOLERANCE = 5.0, 0.5, 0.9, 1e-5
MILL = Cutter(2.0 * R, 4, 0.5, 60.0, 80.0, 6e5)
UP = [0.0, 0.0, 1.0]


def turning(height: float, start: float = 0.0, turn: float = TURN) -> Move:
    """The axis turns about z through the layer's point (0, 0, height) at fixed tilt."""

    def at(t):
        phi = start + turn * t
        a = np.column_stack(
            [math.sin(TILT) * np.cos(phi), math.sin(TILT) * np.sin(phi), np.full(len(t), math.cos(TILT))]
        )
        return np.array([0.0, 0.0, height]) - a * height / a[:, 2:], a

    return Move.of(at)


@pytest.mark.parametrize("d", [0.01, 3.0, 20.0])
@pytest.mark.parametrize("direction", [0.0, 0.7, 2.5])
def test_straight_at_a_vertical_axis(d, direction):
    end = [d * math.cos(direction), d * math.sin(direction), 0.0]
    c = covered(Move.lerp([0, 0, 0], UP, end, UP), MILL, 1.0, TOLERANCE)
    assert c.simple
    assert c.area == pytest.approx(math.pi * R**2 + 2.0 * R * d, rel=1e-9)


def test_polygon_stays_within_its_tolerance():
    for tolerance in (1e-1, 1e-2, 1e-3):
        c = covered(Move.lerp([0, 0, 0], UP, [20, 0, 0], UP), MILL, 1.0, tolerance)
        exact = shapely.LineString([(0, 0), (20, 0)])
        far = [abs(exact.distance(shapely.Point(p)) - R) for p in c.rings[0].points]
        middle = 0.5 * (c.rings[0].points + np.roll(c.rings[0].points, -1, axis=0))
        sag = [R - exact.distance(shapely.Point(p)) for p in middle]
        assert max(far) < 1e-12
        assert 0.3 * tolerance < max(sag) <= tolerance


def test_axis_that_turns_at_fixed_tilt():
    p = R / math.cos(TILT)
    exact = TURN * p * p + 2.0 * p * R * math.atan(p / R * math.tan((math.pi - TURN) / 2.0))
    assert exact == pytest.approx(95.866335, abs=5e-7)
    c = covered(turning(20.0), MILL, 20.0, TOLERANCE)
    assert c.area == pytest.approx(exact, rel=1e-9)


def test_what_is_new_of_the_turn_is_two_congruent_pieces():
    p = R / math.cos(TILT)
    exact = TURN * p * p + 2.0 * p * R * math.atan(p / R * math.tan((math.pi - TURN) / 2.0)) - math.pi * R * p
    tolerance = 1e-6
    now, first = (covered(turning(20.0, 0.0, turn), MILL, 20.0, tolerance) for turn in (TURN, 0.0))
    found = chips(now, shapely.box(-30, -30, 30, 30), before=first)
    assert len(found) == 2
    assert [chip.area for chip in found] == pytest.approx([exact / 2.0, exact / 2.0], rel=1e-7)
    turned = shapely.affinity.rotate(found[0].polygon, 180.0, origin=(0, 0))
    assert turned.symmetric_difference(found[1].polygon).area < 20.0 * tolerance
    for chip in found:
        assert {Origin.STOCK, Origin.LAST, Origin.GRAZING} <= set(chip.rings[0].origin.tolist())


def test_tilting_in_its_own_plane_gives_nested_ellipses():
    def at(t):
        tilt = 0.1 + 0.5 * t
        a = np.column_stack([np.sin(tilt), np.zeros(len(t)), np.cos(tilt)])
        return np.array([0.0, 0.0, 20.0]) - a * 20.0 / a[:, 2:], a

    c = covered(Move.of(at), MILL, 20.0, TOLERANCE)
    assert c.area == pytest.approx(math.pi * R**2 / math.cos(0.6), rel=1e-9)


@pytest.mark.parametrize(("height", "what"), [(0.0, Origin.FIRST_CHORD), (60.0 * math.cos(TILT), Origin.LAST_CHORD)])
def test_half_ellipse_of_bottom_face_and_flute_end(height, what):
    """The layer through the centre of the end face: half an ellipse, its chord along y; moved along x by d."""
    axis, d = [math.sin(TILT), 0.0, math.cos(TILT)], 3.0
    half = 0.5 * math.pi * R**2 / math.cos(TILT)
    along = covered(Move.lerp([0, 0, 0], axis, [d, 0, 0], axis), MILL, height, TOLERANCE)
    across = covered(Move.lerp([0, 0, 0], axis, [0, d, 0], axis), MILL, height, TOLERANCE)
    assert along.area == pytest.approx(half + 2.0 * R * d, rel=1e-9)
    assert across.area == pytest.approx(half + d * R / math.cos(TILT), rel=1e-9)
    assert what in along.rings[0].origin


@pytest.mark.parametrize("height", [0.5, 2.0, 4.999, 5.0, 9.0])
def test_ball_straight(height):
    c = covered(Move.lerp([0, 0, 0], UP, [4, 3, 0], UP), CUTTERS["ball"], height, TOLERANCE)
    w = min(height, 5.0)
    rho = math.sqrt(25.0 - (5.0 - w) ** 2)
    assert c.area == pytest.approx(math.pi * rho**2 + 2.0 * rho * 5.0, rel=1e-9)


@pytest.mark.parametrize("name", ["bull", "taper", "drill"])
@pytest.mark.parametrize("height", [0.3, 1.3, 5.0])
def test_any_cutter_straight_at_a_vertical_axis(name, height):
    c = covered(Move.lerp([1, 2, 0], UP, [4, 6, 0], UP), CUTTERS[name], height, TOLERANCE)
    rho = float(CUTTERS[name].radius_at(height))
    assert c.area == pytest.approx(math.pi * rho**2 + 2.0 * rho * 5.0, rel=1e-9)


def test_ball_is_the_same_at_any_tilt_below_its_centre():
    move = Move.slerp([0, 0, 0], [0.3, 0.0, 1.0], [4, 0, 0], [0.1, -0.4, 1.0])
    centre = move.at(np.linspace(0, 1, 20001))
    ball = (centre[0] + 5.0 * centre[1])[:, :2]
    height = 1.5
    low = (centre[0] + 5.0 * centre[1])[:, 2]
    rho = np.sqrt(25.0 - (height - low) ** 2)
    discs = [shapely.Point(b).buffer(r, quad_segs=256) for b, r in zip(ball[::100], rho[::100], strict=True)]
    c = covered(move, CUTTERS["ball"], height, 1e-4)
    assert c.area == pytest.approx(shapely.unary_union(discs).area, rel=3e-5)  # 200 discs of 1024 sides


@pytest.mark.parametrize("name", list(CUTTERS))
@pytest.mark.parametrize("seed", range(4))
def test_invariance_under_rigid_motion_and_scale(name, seed):
    rng = np.random.default_rng(100 + seed)
    cutter, move, height, tolerance = CUTTERS[name], random_move(rng, "lerp"), 0.5, 1e-4
    area = getattr(covered(move, cutter, height, tolerance), "area", 0.0)
    angle, shift, scale = rng.uniform(0, 6.0), rng.uniform(-50, 50, 3), 3.7
    turn = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    moved = Move(move.tip @ turn.T + np.eye(1, len(move.tip)).T * shift, move.axis @ turn.T)
    again = covered(moved, cutter, height + shift[2], tolerance)
    assert getattr(again, "area", 0.0) == pytest.approx(area, rel=1e-6)
    d, r, *_ = cutter.apt
    large = Cutter(
        scale * d, 4, 0.5, scale * 14.0, scale * 40.0, 6e5, scale * r, bottom=cutter.bottom, taper=cutter.taper
    )
    grown = covered(Move(scale * move.tip, move.axis), large, scale * height, scale * tolerance)
    assert getattr(grown, "area", 0.0) == pytest.approx(scale**2 * area, rel=1e-6)


def test_many_layers_are_the_layers_one_by_one():
    move = random_move(np.random.default_rng(5), "slerp")
    heights = [-50.0, 1.0, 4.0, 90.0]
    many = covered_areas(move, MILL, heights, 1e-3)
    assert many[0] is None
    assert many[3] is None
    assert [c.area for c in many[1:3]] == [covered(move, MILL, h, 1e-3).area for h in heights[1:3]]
    assert [c.height for c in many[1:3]] == heights[1:3]
