"""Areas, winding, places along a contour, parts and bounds, against shapely and by hand."""

import numpy as np
import pytest
import shapely

from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region, winding_number

# a stadium of 10 by 4 with one end bulging inwards: 10 x 4 + half disc - half disc of radius 2
BULGED = Contour.from_bulges([[0, 0], [10, 0], [10, 4], [0, 4]], [0.0, 1.0, 0.0, -1.0], closed=True)


def test_area_of_lines_and_arcs_by_hand():
    assert BULGED.area == pytest.approx(40.0, abs=1e-12)
    assert BULGED.reversed().area == pytest.approx(-40.0, abs=1e-12)
    assert Contour.circle((3.0, -2.0), 1.5, -1).area == pytest.approx(-np.pi * 2.25, abs=1e-12)


def test_length_by_hand():
    assert BULGED.length == pytest.approx(20.0 + 4.0 * np.pi, abs=1e-12)


def test_bounds_include_the_bulge_of_an_arc():
    assert BULGED.bounds == pytest.approx((0.0, 0.0, 12.0, 4.0), abs=1e-12)
    assert Contour.circle((1.0, 2.0), 3.0).bounds == pytest.approx((-2.0, -1.0, 4.0, 5.0), abs=1e-12)


def test_at_gives_point_tangent_and_curvature_by_hand():
    p, t, kappa = BULGED.at([5.0, 10.0 + np.pi, 20.0 + 2.0 * np.pi + np.pi])
    assert np.allclose(p, [[5.0, 0.0], [12.0, 2.0], [2.0, 2.0]], atol=1e-12)
    assert np.allclose(t, [[1.0, 0.0], [0.0, 1.0], [0.0, -1.0]], atol=1e-12)
    assert np.allclose(kappa, [0.0, 0.5, -0.5], atol=1e-12)


def test_tangent_is_the_derivative_of_the_place():
    s = np.linspace(0.3, BULGED.length - 0.3, 41)
    s = s[np.abs(s[:, None] - BULGED.knots).min(axis=1) > 1e-2]
    h = 1e-5
    slope = (BULGED.at(s + h)[0] - BULGED.at(s - h)[0]) / (2 * h)
    assert np.allclose(slope, BULGED.at(s)[1], atol=1e-8)


def test_winding_agrees_with_shapely_away_from_the_boundary():
    rng = np.random.default_rng(7)
    theta = np.sort(rng.uniform(0, 2 * np.pi, 17))
    r = rng.uniform(3, 10, 17)
    c = Contour.from_bulges(np.column_stack([r * np.cos(theta), r * np.sin(theta)]), rng.uniform(-0.3, 0.3, 17), True)
    p = rng.uniform(-12, 12, (3000, 2))
    polygon = shapely.Polygon(c.flatten(1e-7))
    clear = shapely.distance(polygon.exterior, shapely.points(p)) > 1e-5
    inside = shapely.contains_xy(polygon, p[:, 0], p[:, 1])
    assert clear.sum() > 2900
    assert np.array_equal(winding_number(c, p)[clear] != 0, inside[clear])


def test_winding_on_the_level_of_vertices_and_of_the_poles_of_a_circle():
    square = Contour.polyline([[0, 0], [2, 0], [2, 2], [0, 2]], closed=True)
    assert winding_number(square, np.array([[1.0, 0.0 + 1e-12], [-1.0, 0.0], [-1.0, 2.0], [1.0, 1.0]])).tolist() == [
        1,
        0,
        0,
        1,
    ]
    circle = Contour.circle((0.0, 0.0), 1.0, -1)
    assert winding_number(circle, np.array([[-2.0, 1.0], [-2.0, -1.0], [-2.0, 0.0], [0.0, 0.0]])).tolist() == [
        0,
        0,
        0,
        -1,
    ]


def test_parts_join_to_the_whole():
    a, b = BULGED.part(0.0, 13.3), BULGED.part(13.3, BULGED.length)
    whole = Contour.join([a, b])
    assert whole.length == pytest.approx(BULGED.length, abs=1e-12)
    assert whole.area == pytest.approx(BULGED.area, abs=1e-12)
    assert np.allclose(a.end, BULGED.at(13.3)[0][0], atol=1e-12)


def test_started_at_keeps_area_and_moves_the_start():
    turned = BULGED.started_at(12.0)
    assert turned.closed
    assert turned.area == pytest.approx(40.0, abs=1e-12)
    assert np.allclose(turned.start, BULGED.at(12.0)[0][0], atol=1e-12)


def test_moved_scales_area_by_the_square():
    assert BULGED.moved(3.0, -4.0, turn=0.7, scale=2.0).area == pytest.approx(160.0, abs=1e-11)


def test_region_turns_islands_and_subtracts_them():
    region = Region.of([Contour.circle((5.0, 2.0), 0.5), BULGED.reversed()])
    assert region.area == pytest.approx(40.0 - 0.25 * np.pi, abs=1e-12)
    assert region.contains([[5.0, 2.0], [5.0, 3.0], [20.0, 2.0]]).tolist() == [False, True, False]


def test_flatten_keeps_an_island_in_a_hole():
    """Squares of 20, 10 and 4 mm one in the other, and one of 3 mm beside them: 400 - 100 + 16 + 9."""
    squares = [
        Contour.polyline([(x, x), (x + a, x), (x + a, x + a), (x, x + a)], closed=True)
        for x, a in ((0.0, 20.0), (5.0, 10.0), (8.0, 4.0), (30.0, 3.0))
    ]
    assert Region.of(squares).flatten(1e-3).area == pytest.approx(325.0)


def test_flatten_leaves_arcs_by_no_more_than_the_chord_error():
    p = Contour.circle((0.0, 0.0), 10.0).flatten(1e-3)
    sag = 10.0 - np.hypot(*(0.5 * (p[1:] + p[:-1])).T)
    assert 0.0 < sag.max() <= 1e-3


def test_a_gap_is_refused_with_its_place():
    rows = [[0, 0, 1, 0, 0, 0, 0], [1, 0.5, 2, 0, 0, 0, 0]]
    with pytest.raises(InputError, match=r"^contour: gap of 0\.5 mm at \(1, 0\): neighbours must meet$"):
        Contour(np.array(rows, dtype=float))


def test_an_open_chain_has_no_area():
    with pytest.raises(InputError, match=r"^contour: an open chain has no area; close it first$"):
        _ = Contour.polyline([[0, 0], [1, 0]]).area


def test_short_segments_are_dropped_and_their_neighbours_meet():
    near = 0.9e-7
    points = [(0, 0), (10, 0), (10 + near, 0), (10 + near, near), (10, 10), (0, 10), (0, near)]
    for closed in (True, False):
        c = Contour.from_bulges(points, np.zeros(len(points)), closed)
        assert (c.segments[1:, 0:2] == c.segments[:-1, 2:4]).all()
