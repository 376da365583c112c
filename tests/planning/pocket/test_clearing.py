"""Parts of the front by hand: where it enters, what is left, what it refuses."""

import itertools
import math

import numpy as np
import pytest
import shapely

from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region
from chipload.planning.pocket.clearing import clear_region
from chipload.planning.pocket.clearing_path import CUT, ENTRY, LIFT, LINK, polyline
from chipload.planning.pocket.leftover import PocketRemainder, leftover, swept
from chipload.planning.pocket.reach import centre_region, reach_of, shortest_order, widest_places
from chipload.stock.planar import PlanarStock

SQUARE = Region.of([Contour.polyline([(0, 0), (20, 0), (20, 20), (0, 20)], closed=True)])


def test_centre_region_of_a_square():
    inner = centre_region(SQUARE, 3.0)
    assert inner.area == pytest.approx(14.0**2)
    assert widest_places(inner, 1e-5) == [pytest.approx((10.0, 10.0, 7.0), abs=2e-3)]


def test_parts_in_the_shortest_order():
    """Against all orders: never longer by more than 10 %, and mostly the shortest."""
    rng = np.random.default_rng(3)
    exact = 0
    for _ in range(20):
        points = rng.uniform(0.0, 100.0, (6, 2))

        def length(order, points=points):
            return np.hypot(*np.diff(points[list(order)], axis=0).T).sum()

        found = length(shortest_order(points))
        least = min(length(order) for order in itertools.permutations(range(6)))
        assert found <= 1.1 * least
        exact += found <= least + 1e-9
    assert exact >= 17


def test_reach_is_the_opening():
    """A square opened by a disc lacks (4 - pi) R^2 in its corners."""
    opened = centre_region(centre_region(SQUARE, 3.0), -3.0)
    assert opened.area == pytest.approx(400.0 - (4.0 - math.pi) * 9.0)


@pytest.mark.parametrize("contour", [SQUARE.contours[0], Contour.circle((10.0, 10.0), 7.0)])
def test_cells_of_the_centre_region_against_shapely(contour):
    """Cells that say inside or outside are wholly so."""
    region = Region.of([contour])
    stock = PlanarStock((0.0, 0.0, 20.0, 20.0), 3.0)
    reach = reach_of(region, stock.grid, 1e-4)
    x0, y0, h, nx, ny = stock.grid[:5]
    i, j = np.meshgrid(np.arange(int(nx)), np.arange(int(ny)))
    cells = shapely.box(x0 + i * h, y0 + j * h, x0 + (i + 1) * h, y0 + (j + 1) * h).ravel()
    shape = region.flatten(1e-4)
    assert shapely.covers(shapely.buffer(shape, 1e-3), cells)[reach.flag == 1].all()
    assert not shapely.intersects(shapely.buffer(shape, -1e-3), cells)[reach.flag == 0].any()
    assert set(reach.flag) == {0, 1, 2}


def test_leftover_of_one_straight_cut():
    """A cut of 14 mm by a disc of radius 3 clears 6 x 14 + 9 pi of the reachable area."""
    points = np.array([[3.0, 10.0], [17.0, 10.0]])
    breaks = np.array([True, False])
    assert swept(points, breaks, 3.0).area == pytest.approx(84.0 + 9.0 * math.pi, rel=1e-4)
    reachable = centre_region(centre_region(SQUARE, 3.0), -3.0)
    area, contours, places = leftover(reachable, points, breaks, 3.0)
    assert area == pytest.approx(reachable.area - 84.0 - 9.0 * math.pi, rel=1e-4)
    assert len(contours) == len(places) == 2
    rest = PocketRemainder(reachable, 3.0)
    rest.take(points[:1], breaks[:1])  # part after part as at once
    rest.take(points, breaks)
    assert rest.parts()[0] == pytest.approx(area, abs=1e-9)
    x, y, room = rest.widest(centre_region(SQUARE, 3.0).flatten(1e-4))
    # above or below the cut the centre may be from y = 13 to 17, the middle of which is 2 mm from y = 17
    assert 5.0 <= x <= 15.0
    assert abs(y - 10.0) == pytest.approx(5.0, abs=0.01)
    assert room == pytest.approx(2.0, abs=0.01)


def test_lengths_add_up_and_the_centre_stays_in_its_region():
    """Length by kind; arcs begin where the row before them ends; no place leaves the centre region."""
    path = clear_region(SQUARE, 3.0, math.acos(0.8))
    seg = path.segments
    arc = seg[:, 6] != 0.0
    assert arc.any()
    radius = np.hypot(*(seg[arc, 0:2] - seg[arc, 4:6]).T)
    assert np.hypot(*(seg[arc, 2:4] - seg[arc, 4:6]).T) == pytest.approx(radius, abs=1e-9)
    chord = np.hypot(path.x[1:] - path.x[:-1], path.y[1:] - path.y[:-1])
    legs = np.append(0.0, np.where(arc[1:], 0.0, chord))
    legs[arc] = radius * np.abs(seg[arc, 6])
    for kind, name in ((ENTRY, "entry"), (CUT, "cut"), (LINK, "link"), (LIFT, "lift")):
        assert path.lengths_mm[name] == pytest.approx(legs[path.kind == kind].sum())
    assert path.passes == path.pass_number.max() >= 5
    points, _ = polyline(seg[:, 2:4], seg[:, 4:6], seg[:, 6], path.kind == LIFT, 1e-4)
    assert points.min() >= 3.0 - 4e-4
    assert points.max() <= 17.0 + 4e-4


def test_arcs_take_far_fewer_rows_than_steps():
    """A round pocket is one spiral: less than one row in 0.5 R of path."""
    path = clear_region(Region.of([Contour.circle((0.0, 0.0), 20.0)]), 3.0, math.acos(0.8))
    assert path.lengths_mm["cut"] / (path.kind == CUT).sum() > 0.5 * 3.0
    assert path.cleared_share > 0.9999


def test_two_rooms_are_entered_apart():
    """A neck narrower than the cutter: two entries, and what is between is not reachable."""
    neck = [
        (0, 0),
        (14, 0),
        (14, 5),
        (20, 5),
        (20, 0),
        (34, 0),
        (34, 14),
        (20, 14),
        (20, 9),
        (14, 9),
        (14, 14),
        (0, 14),
    ]
    path = clear_region(Region.of([Contour.polyline(neck, closed=True)]), 2.5, math.acos(0.8))
    assert [e.code for e in path.events].count("pocket-entry") == 2
    assert path.cleared_share >= 0.995


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ((0.0, 0.6), "radius = 0 mm: must be above 0"),
        ((3.0, 3.0), "engagement = 171.9 deg: must be between 2 and 150"),
        ((12.0, 0.6), "radius = 12 mm: the cutter fits nowhere into the region; take a smaller one"),
    ],
)
def test_refused(arguments, text):
    with pytest.raises(InputError, match=f"^{text}$"):
        clear_region(SQUARE, *arguments)
