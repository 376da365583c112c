"""Contours that meet become contours of their even-odd area; the oracle is shapely on fine chords."""

import numpy as np
import pytest
import shapely

from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region
from chipload.geometry.even_odd import even_odd

#: chords of the oracle [mm]
FINE = 1e-6


def square(x, y, w, h):
    return Contour.polyline([[x, y], [x + w, y], [x + w, y + h], [x, y + h]], closed=True)


def oracle(contours):
    area = shapely.Polygon()
    for c in contours:
        area = area.symmetric_difference(shapely.make_valid(shapely.Polygon(c.flatten(FINE))))
    return area


def held(contours, made):
    """The same area, the inside on the left, and an odd number of windings exactly where shapely has it."""
    want = oracle(contours)
    assert sum(c.area for c in made) == pytest.approx(want.area, abs=1e-3)
    assert Region.of(made).area == pytest.approx(want.area, abs=1e-3)
    low, high = np.array(want.bounds).reshape(2, 2)
    p = np.random.default_rng(5).uniform(low - 1.0, high + 1.0, (400, 2))
    clear = shapely.distance(want.boundary, shapely.points(p)) > 1e-3
    assert (Region(made).contains(p) == shapely.contains(want, shapely.points(p)))[clear].all()


def test_contours_that_meet_nowhere_are_returned_as_they_are():
    given = (square(0, 0, 9, 9), square(2, 2, 3, 3).reversed(), Contour.circle((20.0, 0.0), 4.0))
    made, places = even_odd(given)
    assert made == given
    assert places.shape == (0, 2)


def test_two_circles_that_cross():
    given = [Contour.circle((0.0, 0.0), 30.0), Contour.circle((30.0, 0.0), 30.0)]
    made, places = even_odd(given)
    # each without the lens of both: 2 (pi r2 - (2 pi / 3 - sqrt(3) / 2) r2)
    lens = (2.0 * np.pi / 3.0 - np.sqrt(3.0) / 2.0) * 900.0
    assert sum(c.area for c in made) == pytest.approx(2.0 * (np.pi * 900.0 - lens), rel=1e-9)
    assert places == pytest.approx(np.array([[15.0, -25.980762], [15.0, 25.980762]]))
    # arcs stay arcs
    assert all(r == pytest.approx(30.0) for c in made for r in c.radii)


def test_a_contour_that_crosses_itself():
    given = [Contour.polyline([[0, 0], [60, 40], [60, 0], [0, 40]], closed=True)]
    made, places = even_odd(given)
    assert places.tolist() == [[30.0, 20.0]]
    assert len(made) == 2
    held(given, made)


def test_an_edge_that_two_contours_share_is_none():
    made, _ = even_odd([square(0, 0, 60, 40), square(60, 0, 40, 40)])
    (one,) = made
    assert one.bounds == (0.0, 0.0, 100.0, 40.0)
    held([square(0, 0, 60, 40), square(60, 10, 40, 20)], even_odd([square(0, 0, 60, 40), square(60, 10, 40, 20)])[0])


@pytest.mark.parametrize("seed", range(12))
def test_circles_and_squares_at_random(seed):
    rng = np.random.default_rng(seed)
    given = [
        Contour.circle(rng.uniform(0, 40, 2), rng.uniform(3, 15)) if rng.random() < 0.5
        else square(*rng.uniform(0, 40, 2), *rng.uniform(3, 25, 2))
        for _ in range(7)
    ]  # fmt: skip
    made, _ = even_odd(given)
    held(given, made)
    again, _ = even_odd(made)
    assert sum(c.area for c in again) == pytest.approx(sum(c.area for c in made), rel=1e-9)


def test_what_encloses_nothing_is_refused():
    with pytest.raises(InputError, match=r"^part: contours cross at \(9, 0\) and enclose no definite area"):
        even_odd([Contour.polyline([[0, 0], [9, 0], [9, 5], [9, 0]], closed=True)])
    with pytest.raises(InputError, match="contour open at"):
        even_odd([Contour.polyline([[0, 0], [9, 0], [9, 5]], closed=False)])
