"""Parallel curves: by hand, by brute-force distance, by shapely's fine buffers, by the CAD kernel."""

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region
from chipload.geometry.distance import distance
from chipload.geometry.offset import offset, offset_region


def brute(segments, points, n=4000):
    """Distance to densely sampled segments: an upper bound, too large by (step / 2)^2 / (2 distance)."""
    dense = []
    for row in segments:
        c = Contour(row[None])
        dense.append(c.at(np.linspace(0.0, c.length, n))[0])
    dense = shapely.MultiPoint(np.vstack(dense))
    return shapely.distance(dense, shapely.points(points))


def along(contours, n=200):
    return np.vstack([c.at(np.linspace(0.0, c.length, n))[0] for c in contours])


def buffered(region, d):
    """Areas of the inset by shapely at several finenesses: its buffer of thousands of chords at times loses a part."""
    settings = ((1e-4, 60), (3e-5, 200), (1e-3, 40))
    return np.array([region.flatten(f).buffer(-d, quad_segs=q).area for f, q in settings])


@st.composite
def regions(draw):
    """A star-shaped contour of lines and arcs about the origin, at times with a hole, at times on a grid."""
    n = draw(st.integers(3, 11))
    steps = np.array(draw(st.lists(st.floats(0.2, 1.0), min_size=n, max_size=n)))
    theta = 2 * np.pi * np.cumsum(steps) / steps.sum()
    r = np.array(draw(st.lists(st.floats(4, 20), min_size=n, max_size=n)))
    p = np.column_stack([r * np.cos(theta), r * np.sin(theta)])
    if draw(st.booleans()):
        p = 2.0 * np.round(p / 2.0)
    bulges = draw(st.lists(st.sampled_from([0, 0, 0.2, -0.2, 2**0.5 - 1, 1 - 2**0.5, 1, -0.6]), min_size=n, max_size=n))
    assume(np.hypot(*(np.roll(p, -1, axis=0) - p).T).min() > 0.1)
    outer = Contour.from_bulges(p, bulges, closed=True)
    polygon = shapely.Polygon(outer.flatten(1e-6))
    assume(polygon.is_valid and polygon.area > 1.0)
    contours = [outer]
    if draw(st.booleans()):
        hole = Contour.circle((draw(st.sampled_from([0.0, 1.0, 2.5])), 0.0), draw(st.sampled_from([0.5, 1.0, 2.0])))
        assume(not shapely.Polygon(hole.flatten(1e-4)).exterior.intersects(polygon.exterior))
        contours.append(hole)
    return Region.of(contours)


DISTANCES = st.sampled_from([0.5, 1.0, 2.0, 3.0, 0.7316, -1.0, -2.0, -3.3])


@settings(max_examples=60, deadline=None, derandomize=True)
@given(regions(), DISTANCES)
def test_every_point_lies_at_the_distance_and_the_area_is_that_of_shapely(region, d):
    made = offset_region(region, d)
    length = sum(c.length for c in made.contours)
    assert np.abs(buffered(region, d) - made.area).min() <= 1e-3 * (length + 10.0)
    if made.contours:
        p = along(made.contours)
        assert np.abs(distance(region.segments, p) - abs(d)).max() < 2e-9
        exact = brute(region.segments, p[::7])
        assert (exact - abs(d)).min() > -1e-9
        # the error of the samples, on the arc that bends most away from the point
        step = max(Contour(row[None]).length for row in region.segments) / 3999.0
        radii = np.concatenate([c.radii for c in region.contours])
        bend = 1.0 / abs(d) + 1.0 / min(radii[radii > 0.0], default=np.inf)
        assert (exact - abs(d)).max() < 1.01 * (0.5 * step) ** 2 / 2.0 * bend + 1e-9


@settings(max_examples=40, deadline=None, derandomize=True)
@given(regions(), st.sampled_from([0.5, 1.0, 2.0, 3.0]))
def test_opening_is_idempotent_and_inside(region, r):
    inset = offset_region(region, r)
    opened = offset_region(inset, -r)
    again = offset_region(offset_region(opened, r), -r)
    assert again.area == pytest.approx(opened.area, rel=1e-9, abs=1e-9)
    assert opened.area <= region.area + 1e-9
    assert len(again.segments) == len(opened.segments)
    if opened.contours:
        p = along(opened.contours)
        assert (region.contains(p) | (distance(region.segments, p) < 1e-8)).all()


def test_sharp_corners_become_arcs_where_the_parallel_opens():
    square = Region.of([Contour.polyline([[0, 0], [4, 0], [4, 4], [0, 4]], closed=True)])
    grown = offset_region(square, -1.0)
    assert grown.area == pytest.approx(16.0 + 16.0 + np.pi, abs=1e-12)
    assert np.allclose(np.sort(grown.contours[0].radii), [0, 0, 0, 0, 1, 1, 1, 1], atol=1e-12)
    assert offset_region(square, 1.0).area == pytest.approx(4.0, abs=1e-12)
    assert offset_region(square, 2.0).contours == ()


def test_arcs_stay_concentric_vanish_and_flip():
    rounded = Contour.from_bulges(
        [[2, 0], [8, 0], [10, 2], [10, 8], [8, 10], [2, 10], [0, 8], [0, 2]], [0, np.tan(np.pi / 8)] * 4, closed=True
    )
    (half,) = offset([rounded], 0.5)
    assert np.allclose(half.radii, [0, 1.5] * 4, atol=1e-12)
    assert np.allclose(half.segments[1, 4:6], [8.0, 2.0], atol=1e-12)
    (exact,) = offset([rounded], 2.0)  # the arcs' own radius
    assert len(exact.segments) == 4
    assert exact.area == pytest.approx(36.0, abs=1e-12)
    (beyond,) = offset([rounded], 3.0)
    assert len(beyond.segments) == 4
    assert beyond.area == pytest.approx(16.0, abs=1e-12)


def test_a_full_circle_stays_one_segment_in_either_sense():
    for sense in (1, -1):
        (c,) = offset([Contour.circle((1.0, 2.0), 5.0, sense)], 2.0)
        assert c.segments.shape == (1, 7)
        assert c.radii[0] == pytest.approx(5.0 - 2.0 * sense, abs=1e-12)
        assert c.segments[0, 6] == pytest.approx(sense * 2.0 * np.pi, abs=1e-12)
    assert offset([Contour.circle((0.0, 0.0), 2.0)], 2.0) == ()
    assert offset([Contour.circle((0.0, 0.0), 2.0)], 3.0) == ()


def dumbbell(width):
    """Two squares of 10 joined by a neck of the given width and 10 long."""
    h = width / 2.0
    points = [
        [0, -5],
        [10, -5],
        [10, -h],
        [20, -h],
        [20, -5],
        [30, -5],
        [30, 5],
        [20, 5],
        [20, h],
        [10, h],
        [10, 5],
        [0, 5],
    ]
    return Region.of([Contour.polyline(points, closed=True)])


@pytest.mark.parametrize(("width", "count"), [(2.2, 1), (2.0, 2), (1.8, 2)])
def test_a_neck_divides_the_region_when_it_is_as_wide_as_the_cutter(width, count):
    inset = offset_region(dumbbell(width), 1.0)
    assert len(inset.contours) == count
    want = 2 * 64.0 if count == 2 else None
    if want and width == 2.0:
        # mouths of the neck round off: each takes the corner of the unit square from its square, arcs about 2 corners
        assert inset.area == pytest.approx(2 * (64.0 + 2 * (1.0 - np.pi / 4)), abs=1e-9)
    assert np.abs(buffered(dumbbell(width), 1.0) - inset.area).min() < 1e-3


def test_a_slot_as_wide_as_the_cutter_is_not_entered():
    slot = Contour.from_bulges([[0, 0], [20, 0], [20, 4], [0, 4]], [0.0, 1.0, 0.0, 1.0], closed=True)
    assert offset([slot], 2.0) == ()
    assert len(offset([slot], 2.0 - 1e-6)) == 1


def test_open_chains_end_square_and_open_at_the_kink():
    chain = Contour.polyline([[0, 0], [10, 0], [10, 10]])
    (left,) = offset([chain], 1.0)
    assert np.allclose(left.segments[:, :4], [[0, 1, 9, 1], [9, 1, 9, 10]], atol=1e-12)
    (right,) = offset([chain], -1.0)
    assert np.allclose(right.radii, [0, 1, 0], atol=1e-12)
    assert np.allclose([right.start, right.end], [[0, -1], [11, 10]], atol=1e-12)
    assert not right.closed


def test_open_chains_are_trimmed_by_the_ends_of_others():
    # the parallel of the long line passes within 1 of both ends of the short one, half a millimetre above
    pieces = offset([Contour.polyline([[0, 0], [10, 0]]), Contour.polyline([[3, 0.5], [5, 0.5]])], 1.0)
    w = np.sqrt(0.75)
    assert np.allclose([[*c.start, *c.end] for c in pieces], [[0, 1, 3 - w, 1], [5 + w, 1, 10, 1], [3, 1.5, 5, 1.5]])


def test_contours_trim_one_another():
    made = offset([Contour.circle((0.0, 0.0), 5.0, -1), Contour.circle((11.0, 0.0), 5.0, -1)], 1.0)
    assert len(made) == 1
    assert made[0].area < 0.0
    p = along(made)
    assert np.minimum(np.hypot(p[:, 0], p[:, 1]), np.hypot(p[:, 0] - 11.0, p[:, 1])) == pytest.approx(6.0, abs=1e-9)


def test_circles_whose_parallels_touch_stay_two():
    made = offset([Contour.circle((0.0, 0.0), 5.0, -1), Contour.circle((12.0, 0.0), 5.0, -1)], 1.0)
    assert sum(c.area for c in made) == pytest.approx(-2 * 36.0 * np.pi, abs=1e-9)


def test_a_clothoid_of_many_arcs_stays_smooth():
    n, rate, ds = 200, 0.02, 0.05
    rows, p, heading = [], np.zeros(2), 0.0
    for k in range(n):
        kappa = rate * (k + 0.5) * ds
        centre = p + np.array([-np.sin(heading), np.cos(heading)]) / kappa
        turn = kappa * ds
        q = centre + np.array([np.sin(heading + turn), -np.cos(heading + turn)]) / kappa
        rows.append([*p, *q, *centre, turn])
        p, heading = q, heading + turn
    curve = Contour(np.array(rows))
    for d in (2.0, -2.0):
        (made,) = offset([curve], d)
        assert len(made.segments) == n
        assert made.length == pytest.approx(curve.length - d * heading, abs=1e-9)
        assert np.abs(distance(curve.segments, along([made])) - 2.0).max() < 1e-9
    # beyond the last radius of 5 mm the end of the curve is out of reach
    (short,) = offset([curve], 6.0)
    assert len(short.segments) < n
    assert np.abs(distance(curve.segments, along([short])) - 6.0).max() < 1e-9


def test_thousands_of_segments():
    n = 3000
    theta = np.linspace(0, 2 * np.pi, n, endpoint=False)
    r = 50 + 5 * np.sin(9 * theta)
    wave = Contour.from_bulges(
        np.column_stack([r * np.cos(theta), r * np.sin(theta)]), 0.02 * (-1.0) ** np.arange(n), True
    )
    (made,) = offset([wave], 2.0)
    assert np.abs(distance(wave.segments, along([made], 2000)) - 2.0).max() < 2e-9


def test_the_result_starts_where_the_input_starts_and_runs_its_way():
    square = Contour.polyline([[0, 0], [4, 0], [4, 4], [0, 4]], closed=True)
    (ccw,) = offset([square], 1.0)
    assert np.allclose(ccw.start, [1, 1])
    (cw,) = offset([square.reversed()], -1.0)
    assert cw.area == pytest.approx(-4.0, abs=1e-12)


def test_the_cad_kernel_agrees_on_a_smooth_outline():
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
    from OCP.BRepGProp import BRepGProp
    from OCP.BRepOffsetAPI import BRepOffsetAPI_MakeOffset
    from OCP.GeomAbs import GeomAbs_Arc
    from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Pnt
    from OCP.GProp import GProp_GProps
    from OCP.TopAbs import TopAbs_WIRE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    outline = Contour.from_bulges(
        [[0, 0], [30, 0], [30, 20], [18, 20], [18, 12], [0, 12]], [0, 0.3, 0, -0.5, 0, 0], True
    )
    wire = BRepBuilderAPI_MakeWire()
    for x0, y0, x1, y1, xc, yc, sweep in outline.segments:
        p, q = gp_Pnt(x0, y0, 0.0), gp_Pnt(x1, y1, 0.0)
        if sweep == 0.0:
            wire.Add(BRepBuilderAPI_MakeEdge(p, q).Edge())
        else:
            frame = gp_Ax2(gp_Pnt(xc, yc, 0.0), gp_Dir(0.0, 0.0, float(np.sign(sweep))))
            circle = gp_Circ(frame, float(np.hypot(x0 - xc, y0 - yc)))
            wire.Add(BRepBuilderAPI_MakeEdge(circle, p, q).Edge())
    for d in (1.0, 2.5, -1.0, -4.0):
        tool = BRepOffsetAPI_MakeOffset(wire.Wire(), GeomAbs_Arc)
        tool.Perform(-d)
        props = GProp_GProps()
        found = TopExp_Explorer(tool.Shape(), TopAbs_WIRE)
        BRepGProp.SurfaceProperties_s(BRepBuilderAPI_MakeFace(TopoDS.Wire(found.Current()), True).Face(), props)
        assert sum(c.area for c in offset([outline], d)) == pytest.approx(abs(props.Mass()), rel=1e-6)


def test_distance_by_hand():
    half = Contour.from_bulges([[5, 0], [-5, 0]], [1.0, 0.0]).segments  # upper half circle of radius 5
    p = [[0, 0], [0, 3], [0, 9], [0, -12], [6, -0.0], [5, -2]]
    assert distance(half, p) == pytest.approx([5.0, 2.0, 4.0, 13.0, 1.0, 2.0], abs=1e-12)
    large = Contour.from_bulges([[0, 5], [5, 0]], [np.tan(3 * np.pi / 8), 0]).segments  # three quarters, a gap up right
    assert distance(large, [[3, 3], [-3, -4]]) == pytest.approx([np.hypot(3, 2), 0.0], abs=1e-12)
    assert distance(np.zeros((0, 7)), [[0, 0]])[0] == np.inf


def test_a_contour_that_crosses_itself_is_trimmed_at_its_crossing():
    eight = Contour.polyline([[0, 0], [10, 10], [10, 0], [0, 10]], closed=True)
    made = offset([eight], 1.0)
    assert len(made) > 0
    assert np.abs(distance(eight.segments, along(made)) - 1.0).max() < 1e-9


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_distance_that_is_no_number_is_refused(bad):
    with pytest.raises(InputError, match=rf"^offset: distance_mm = {bad}: must be a finite number$"):
        offset([Contour.circle((0.0, 0.0), 2.0)], bad)
