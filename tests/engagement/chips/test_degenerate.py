"""Moves at which a step of the construction has nothing to hold on to, each with its answer."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.covered import covered
from chipload.engagement.chips.move import LEAST_AXIS_Z, Move
from chipload.errors import InputError
from chipload.machine.machine import machine_named
from engagement.chips.brute import CUTTERS, sections

FLAT, BALL, BULL = CUTTERS["flat"], CUTTERS["ball"], CUTTERS["bull"]
UP = [0.0, 0.0, 1.0]
TOLERANCE = 1e-5


def test_no_motion_covers_the_section():
    axis = [0.3, 0.2, 1.0]
    c = covered(Move.lerp([1, 2, 0], axis, [1, 2, 0], axis), FLAT, 6.0, TOLERANCE)
    assert c.area == pytest.approx(math.pi * 25.0 * math.sqrt(1.13), rel=1e-9)
    assert c.simple


def test_turning_about_its_own_axis_covers_the_section():
    q0, q1 = np.zeros(9), np.zeros(9)
    q1[5] = 1.3  # the table turns under a cutter that stands on the table's axis
    move = Move.machine_linear(machine_named("cradle-ac"), q0, q1)
    tip = move.at([0.0, 0.5, 1.0])[0]
    assert np.ptp(tip, axis=0).max() < 1e-9
    c = covered(move, FLAT, float(tip[0, 2]) + 2.0, TOLERANCE)
    assert c.area == pytest.approx(math.pi * 25.0, rel=1e-9)


def test_plunge_of_a_flat_cutter_covers_its_disc():
    c = covered(Move.lerp([0, 0, 3], UP, [0, 0, -3], UP), FLAT, 0.0, TOLERANCE)
    assert c.area == pytest.approx(math.pi * 25.0, rel=1e-9)


def test_plunge_of_a_ball_covers_its_last_and_widest_circle():
    c = covered(Move.lerp([0, 0, 3], UP, [0, 0, -2], UP), BALL, 0.0, TOLERANCE)
    assert c.area == pytest.approx(math.pi * (25.0 - 9.0), rel=1e-9)


def test_lifting_a_ball_covers_its_first_circle():
    c = covered(Move.lerp([0, 0, -2], UP, [0, 0, 3], UP), BALL, 0.0, TOLERANCE)
    assert c.area == pytest.approx(math.pi * (25.0 - 9.0), rel=1e-9)


def test_dip_of_a_ball_between_two_ends_above_the_layer():
    """Down and up again by a parabola: the deepest circle, 0.02 mm below the layer, at t = 0.5."""
    move = Move.of(lambda t: (np.column_stack([0 * t, 0 * t, 4 * (t - 0.5) ** 2 - 0.02]), np.tile(UP, (len(t), 1))))
    c = covered(move, BALL, 0.0, TOLERANCE)
    assert c.area == pytest.approx(math.pi * (25.0 - 4.98**2), rel=1e-7)


def test_ramp_of_a_vertical_flat_cutter_starts_where_it_meets_the_layer():
    c = covered(Move.lerp([0, 0, 1], UP, [20, 0, -1], UP), FLAT, 0.0, TOLERANCE)
    assert c.area == pytest.approx(math.pi * 25.0 + 10.0 * 10.0, rel=1e-8)


def test_forward_and_back_covers_what_forward_does():
    move = Move.of(lambda t: (np.column_stack([16 * t * (1 - t), 0 * t, 0 * t]), np.tile(UP, (len(t), 1))))
    c = covered(move, FLAT, 1.0, TOLERANCE)
    assert c.area == pytest.approx(math.pi * 25.0 + 10.0 * 4.0, abs=TOLERANCE)  # it turns back within tolerance / 20


def test_full_circle_leaves_a_hole():
    def at(t):
        phi = 2.0 * np.pi * t
        return np.column_stack([12 * np.cos(phi), 12 * np.sin(phi), 0 * t]), np.tile(UP, (len(t), 1))

    c = covered(Move.of(at), FLAT, 1.0, TOLERANCE)
    assert len(c.rings) == 2
    assert c.area == pytest.approx(math.pi * (17.0**2 - 7.0**2), rel=1e-8)
    assert c.polygon.area == pytest.approx(c.area, rel=1e-5)
    assert c.polygon.is_valid


@pytest.mark.parametrize("height", [-0.5, 14.5])
def test_entirely_above_or_below_the_layer(height):
    assert covered(Move.lerp([0, 0, 0], UP, [9, 0, 0], UP), FLAT, height, TOLERANCE) is None


def test_layer_through_the_bottom_face_is_not_cut():
    assert covered(Move.lerp([0, 0, 0], UP, [9, 0, 0], UP), FLAT, 0.0, TOLERANCE) is None


def test_layer_tangent_to_the_tip_of_a_ball():
    move = Move.lerp([0, 0, 0], UP, [0, 0, 0], UP)
    assert covered(move, BALL, 0.0, 1e-9) is None
    for above in (1e-6, 1e-3):
        exact = math.pi * (10.0 * above - above**2)
        assert covered(move, BALL, above, 1e-9).area == pytest.approx(exact, rel=1e-6)


def test_layer_tangent_to_the_corner_of_a_bull_nose():
    tilt = 0.4
    axis = [math.sin(tilt), 0.0, math.cos(tilt)]
    lowest = 2.0 * math.cos(tilt) - 3.0 * math.sin(tilt) - 2.0  # f A_z - e s - r
    move = Move.lerp([0, 0, 0], axis, [0, 0, 0], axis)
    assert covered(move, BULL, lowest - 1e-9, 1e-7) is None
    above = 1e-4
    # a small ellipse: principal radii r and e / sin(tilt) + r at the lowest point
    exact = 2.0 * math.pi * above * math.sqrt(2.0 * (3.0 / math.sin(tilt) + 2.0))
    assert covered(move, BULL, lowest + above, 1e-7).area == pytest.approx(exact, rel=1e-3)


def test_axis_nearly_parallel_to_the_layer():
    def move(z: float) -> Move:
        axis = [math.sqrt(1.0 - z * z), 0.0, z]
        return Move.lerp([0, 0, 0], axis, [0, 4, 0], axis)

    with pytest.raises(InputError, match=r"A_z = 0.0099 somewhere: must be at least 0.01"):
        move(0.99 * LEAST_AXIS_Z)
    c = covered(move(1.01 * LEAST_AXIS_Z), FLAT, 0.0, 1e-4)
    # a strip of the cylinder from its bottom to its top of 2 sqrt(R^2 - (w A_z)^2) or so, moved across by 4
    assert c.area == pytest.approx(14.0 * (10.0 + 4.0), rel=2e-3)


def test_chord_appears_in_the_middle_of_the_move():
    """The tip rises through the layer under a tilted axis: whole ellipse first, cut by the bottom face later."""
    axis = [math.sin(0.5), 0.0, math.cos(0.5)]
    move = Move.lerp([0, 0, -4], axis, [0, 6, 1], axis)
    c = covered(move, FLAT, 0.0, 1e-4)
    dense = shapely.unary_union(sections(FLAT, move, 0.0, np.linspace(0, 1, 400), 400))
    assert dense.difference(c.polygon.buffer(2e-4)).area < 1e-9
    assert c.area == pytest.approx(dense.area, rel=2e-3)
    assert c.area > dense.area


def test_flute_end_crosses_the_layer():
    """Down a slope until the flutes end below the layer."""
    axis = [math.sin(0.3), 0.0, math.cos(0.3)]
    move = Move.lerp([0, 0, -8], axis, [5, 2, -18], axis)
    c = covered(move, FLAT, 0.0, 1e-4)
    dense = shapely.unary_union(sections(FLAT, move, 0.0, np.linspace(0, 1, 400), 400))
    assert dense.difference(c.polygon.buffer(2e-4)).area < 1e-9
    assert c.area == pytest.approx(dense.area, rel=2e-3)


@pytest.mark.parametrize("cutter", ["flat", "ball", "bull"])
@pytest.mark.parametrize("way", [-6.0, 6.0])
@pytest.mark.parametrize("height", [-2.0, 8.0, 21.0])
def test_along_its_own_leaning_axis(cutter, way, height):
    """The flank slides along itself; tip, flank and flute end are met; against the union of sections."""
    axis = np.array([-math.sin(1.0), 0.0, math.cos(1.0)])
    start = np.array([-1.2485300350335815, -1.8326183344303573, -3.0])
    move = Move.slerp(start, axis, start + way * axis + 1e-12, axis)
    c = covered(move, CUTTERS[cutter], height, 1e-3)
    met = sections(CUTTERS[cutter], move, height, np.linspace(0, 1, 150), 300)
    if not met:
        assert c is None
        return
    dense = shapely.unary_union(met)
    assert dense.difference(c.polygon.buffer(2e-3)).area < 1e-9
    assert c.area == pytest.approx(dense.area, rel=3e-3)


def test_a_rapid_along_a_leaning_axis_ends():
    """A bull nose that leans by 69 degrees: its boundary had 100,000 edges, and more with each halving of the time."""
    axis = np.array([math.sin(1.2) * math.cos(math.pi), math.sin(1.2) * math.sin(math.pi), math.cos(1.2)])
    low = np.array([-1.2485300350335815, -1.8326183344303573, -11.913370352777413])
    move = Move.slerp(low + 18.0 * axis, axis, low + 17.5 * axis, axis)
    c = covered(move, Cutter(10.0, 2, 0.5, 26.0, 40.0, 6e5, corner_radius=2.0), -0.5, 0.005)
    assert c.area == pytest.approx(math.pi * 25.0 / math.cos(1.2), rel=0.2)
    assert len(c.rings[0].points) < 1000


@pytest.mark.parametrize("tolerance", [0.0, -1.0, math.nan, math.inf])
def test_refused_tolerance(tolerance):
    with pytest.raises(InputError, match="must be above 0"):
        covered(Move.lerp([0, 0, 0], UP, [9, 0, 0], UP), FLAT, 1.0, tolerance)


def test_refused_height():
    with pytest.raises(InputError, match="height = nan mm: must be finite"):
        covered(Move.lerp([0, 0, 0], UP, [9, 0, 0], UP), FLAT, math.nan, 1e-3)


def test_cutter_of_another_kind_is_the_same_shape():
    """A ball by its corner radius, and by a bull nose whose e is zero to rounding."""
    move = Move.slerp([0, 0, 0], [0.3, 0, 1], [3, 1, -1], [0, 0.3, 1])
    near = Cutter(10.0, 4, 0.5, 14.0, 40.0, 6e5, corner_radius=5.0 - 1e-9)
    assert covered(move, near, 1.0, 1e-4).area == pytest.approx(covered(move, BALL, 1.0, 1e-4).area, rel=1e-6)


def test_a_ball_that_pierces_the_layer_by_a_rounding_error_covers_nothing():
    ball = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0)
    move = Move.slerp([15, 0, 0], [0, 0, 1], [15, 0, -0.5], [0, 0, 1])
    assert covered(move, ball, -0.4999999999999991, 5e-4) is None
    assert covered(move, ball, 4.4e-16, 5e-4).area == pytest.approx(np.pi * (25.0 - 4.5**2), rel=1e-6)
    assert covered(move, ball, -0.49, 5e-4).area == pytest.approx(np.pi * (25.0 - 4.99**2), rel=1e-6)
