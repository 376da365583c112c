"""Exact engagement against the closed forms of the paper and a rim sampled point by point."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chipload.engagement.contact import PIECES, StockBoundary, engagement
from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region

R = 5.0
LINE = math.degrees(math.acos(1 - 0.1 / R))


def circle(radius, sense):
    return StockBoundary(Contour.circle((0.0, 0.0), radius, sense).segments)


def degrees(stock, o, t, radius=R):
    return np.degrees(engagement(stock, o, t, radius).angle)


@pytest.mark.parametrize("s", [1e-4, 0.1, 2.5, 5.0, 7.5, 9.99])
def test_parallel_to_a_line(s):
    wall = StockBoundary([[100.0, s, -100.0, s, 0.0, 0.0, 0.0]])
    assert degrees(wall, [[0.0, R]], [[1.0, 0.0]])[0] == pytest.approx(math.degrees(math.acos(1 - s / R)), abs=1e-9)


@pytest.mark.parametrize(("r_c", "s"), [(8.0, 0.1), (5.5, 0.3), (30.0, 2.0)])
def test_inside_a_concave_wall(r_c, s):
    a = math.degrees(math.acos(1 - s * (2 * r_c - s) / (2 * R * (r_c - R))))
    assert degrees(circle(r_c - s, -1), [[r_c - R, 0.0]], [[0.0, 1.0]])[0] == pytest.approx(a, abs=1e-9)


@pytest.mark.parametrize(("r_c", "s"), [(8.0, 0.1), (1.0, 0.3), (30.0, 2.0)])
def test_round_a_convex_wall(r_c, s):
    a = math.degrees(math.acos(1 - s * (2 * r_c + s) / (2 * R * (r_c + R))))
    assert degrees(circle(r_c + s, 1), [[r_c + R, 0.0]], [[0.0, -1.0]])[0] == pytest.approx(a, abs=1e-9)


@pytest.mark.parametrize(
    ("d", "wanted"), [(0.9, 11.5133), (0.7, 11.8641), (0.5, 12.7340), (0.25, 14.9054), (0.0, 18.7375)]
)
def test_transition_of_the_paper(d, wanted):
    """From a line into a corner of 8 mm, the centre d before the tangent point (figures of CONTOUR.md)."""
    stock = Contour.from_bulges([(-60.0, 0.1), (0.0, 0.1), (7.9, 8.0), (7.9, 60.0)], [0, math.tan(math.pi / 8), 0, 0])
    assert degrees(StockBoundary(stock.reversed().segments), [[-d, R]], [[1.0, 0.0]])[0] == pytest.approx(
        wanted, abs=6e-5
    )


def test_up_milling_enters_at_zero_and_down_leaves_at_pi():
    wall = StockBoundary([[100.0, 0.1, -100.0, 0.1, 0.0, 0.0, 0.0]])
    phi = engagement(wall, [[0.0, R], [0.0, R]], [[1.0, 0.0], [-1.0, 0.0]], R).phi[:, 0]
    a = math.acos(1 - 0.1 / R)
    np.testing.assert_allclose(phi, [[math.pi - a, math.pi], [0.0, a]], atol=1e-12)


def test_air_slot_and_a_thin_wall():
    block = Region.of([Contour.polyline([(-50, -50), (50, -50), (50, 50), (-50, 50)], closed=True)])
    assert degrees(StockBoundary(block.segments), [[0, 0], [0, 90]], [[1, 0], [1, 0]]).tolist() == [180.0, 0.0]
    rib = StockBoundary(Contour.polyline([(-50, -0.5), (50, -0.5), (50, 0.5), (-50, 0.5)], closed=True).segments)
    across = engagement(rib, [[0.0, 0.0]], [[0.0, 1.0]], R)
    assert across.count[0] == 2
    assert np.degrees(across.angle[0]) == pytest.approx(2 * math.degrees(math.asin(0.5 / R)), abs=1e-9)


def test_rim_through_a_joint_is_seen_once():
    stock = StockBoundary(Contour.polyline([(0, 0), (3, 4), (-4, 3), (-3, -4), (4, -3)], closed=True).segments)
    assert (engagement(stock, [[0.0, 0.0]], [[1.0, 0.0]], R).count >= 0).all()


def test_threads_give_the_same():
    rng = np.random.default_rng(5)
    o = rng.uniform(-12, 12, (1000, 2))
    t = o / np.hypot(*o.T)[:, None]
    one, two = (engagement(circle(8.0, -1), o, t, R, workers=w) for w in (1, 2))
    assert (one.angle == two.angle).all()
    assert (one.phi == two.phi).all()


def sampled_rim(region, o, t, radius, n=7201):
    """Engaged share of the front half by asking point after point."""
    phi = (np.arange(n) + 0.5) * math.pi / n
    normal = np.array([-t[1], t[0]])
    rim = o + radius * (np.sin(phi)[:, None] * t + np.cos(phi)[:, None] * normal)
    return 180.0 * region.contains(rim).mean()


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.floats(4, 20), st.floats(-0.9, 0.9)), min_size=3, max_size=9),
    st.floats(-15, 15),
    st.floats(-15, 15),
    st.floats(0, 6.28),
    st.floats(0.7, 8),
)
def test_star_of_lines_and_arcs(corners, x, y, heading, radius):
    """Any star of lines and arcs against a sampled rim (0.025 deg a sample)."""
    n = len(corners)
    points = [(r * math.cos(math.tau * k / n), r * math.sin(math.tau * k / n)) for k, (r, _) in enumerate(corners)]
    star = Contour.from_bulges(points, [b if abs(b) > 0.05 else 0.0 for _, b in corners], closed=True)
    region = Region((star,))
    t = np.array([math.cos(heading), math.sin(heading)])
    met = engagement(StockBoundary(star.segments), [[x, y]], [t], radius)
    crossed = _crosses_itself(star)
    if not crossed and met.count[0] <= PIECES:
        assert np.degrees(met.angle[0]) == pytest.approx(sampled_rim(region, (x, y), t, radius), abs=0.06)


def _crosses_itself(contour):
    import shapely

    return not shapely.polygons(contour.flatten(1e-7)).is_valid


def test_bad_input():
    wall = StockBoundary([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
    with pytest.raises(InputError, match="radius = 0 mm: must be above 0"):
        engagement(wall, [[0, 0]], [[1, 0]], 0.0)
    with pytest.raises(InputError, match="1 centres but 2 headings"):
        engagement(wall, [[0, 0]], [[1, 0], [1, 0]], 1.0)
    with pytest.raises(InputError, match="need \\(n, 7\\) finite numbers"):
        StockBoundary([[1.0, 2.0]])
