"""Rings as stock: volumes and thicknesses in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapely import LineString, Point, Polygon

from chipload.errors import InputError
from chipload.stock.rings import Boss, ring_stock, surface_off

BOUNDS = np.linspace(-4.0, 0.0, 5)
#: tolerance of the edges [mm]
WITHIN = 0.002


def flat(radius):
    return lambda z: np.full(len(z), radius)


def cone(radius, slope):
    return lambda z: radius - slope * z


def thickness(stock, layer, degrees):
    """Of the ring along a ray."""
    a = math.radians(degrees)
    ray = LineString([(0.0, 0.0), (50.0 * math.cos(a), 50.0 * math.sin(a))])
    return stock.section(layer).intersection(ray).length


def test_volume_of_a_tube_and_a_cone():
    tube = ring_stock(BOUNDS, flat(18.0), flat(22.0))
    assert tube.volume() == pytest.approx(4.0 * math.pi * (22.0**2 - 18.0**2), rel=1e-4)
    made = ring_stock(BOUNDS, cone(18.0, 0.1), cone(22.0, 0.1))
    heights = np.array([-3.5, -2.5, -1.5, -0.5])
    areas = math.pi * ((22.0 - 0.1 * heights) ** 2 - (18.0 - 0.1 * heights) ** 2)
    assert made.volume() == pytest.approx(areas.sum(), rel=1e-4)


def test_thicker_on_one_side():
    """0.45 mm off centre towards -45 deg: 30 % of 1.5 mm more there, as much less opposite."""
    off = 0.45 * math.sqrt(0.5)
    stock = ring_stock(BOUNDS, flat(20.0), flat(21.5), (off, -off))
    assert thickness(stock, 0, -45.0) == pytest.approx(1.95, abs=1e-3)
    assert thickness(stock, 0, 135.0) == pytest.approx(1.05, abs=1e-3)
    assert thickness(stock, 3, 45.0) == pytest.approx(1.5, abs=0.01)


def test_a_boss():
    stock = ring_stock(BOUNDS, flat(20.0), flat(21.5), bosses=[Boss(math.radians(150.0), math.radians(200.0), 1.2)])
    assert thickness(stock, 1, 175.0) == pytest.approx(2.7, abs=1e-3)
    assert thickness(stock, 1, 149.0) == pytest.approx(1.5, abs=1e-3)
    sector = 0.5 * math.radians(50.0) * (22.7**2 - 21.5**2)
    assert stock.area(1) == pytest.approx(math.pi * (21.5**2 - 20.0**2) + sector, rel=1e-4)


def test_distance_from_the_surface():
    """An engagement range of 0.3 mm into a wall at 20 mm, and 1.5 mm left elsewhere."""
    stock = ring_stock(BOUNDS, flat(18.0), flat(21.5))
    stock.remove(2, Point(24.7, 0.0).buffer(5.0, 256))
    low, high = surface_off(stock, flat(20.0), -4.0, 0.0, WITHIN)
    assert low == pytest.approx(-0.3, abs=1e-3)
    assert high == pytest.approx(1.5, abs=1e-3)
    assert surface_off(stock, flat(20.0), 5.0, 6.0, WITHIN) is None


def test_a_slit_between_tiles_is_no_cut():
    """As wide as twice the tolerance of the edges at most, along the border y = 0, half through the wall."""
    for width in (0.0, 1e-9, 8.9e-6, 1.9 * WITHIN):
        stock = ring_stock(BOUNDS, flat(18.0), flat(21.5))
        rows, columns = stock.tiles.shape[1:]
        assert (rows, columns) == (2, 2)
        slit = Polygon([(-19.5, 0.0), (-22.0, width), (-22.0, 0.0)])
        stock.tiles[1, 1, 0] = stock.tiles[1, 1, 0].difference(slit)
        low, high = surface_off(stock, flat(20.0), -4.0, 0.0, WITHIN)
        # 1.5 mm are left everywhere; a chord of 512 is 0.4 um inside the circle
        assert low == pytest.approx(1.5, abs=1e-3), width
        assert high == pytest.approx(1.5, abs=1e-3)


def test_a_groove_of_the_smallest_cutter_is_a_cut():
    """A cutter of 0.1 mm, 0.7 mm deep in the stock: a slit that is wider than its tolerance."""
    stock = ring_stock(BOUNDS, flat(18.0), flat(21.5))
    stock.remove(2, LineString([(-30.0, 0.0), (-20.85, 0.0)]).buffer(0.05, 32))
    low, high = surface_off(stock, flat(20.0), -4.0, 0.0, WITHIN)
    assert low == pytest.approx(0.8, abs=1e-3)
    assert high == pytest.approx(1.5, abs=1e-3)


def test_no_ring():
    with pytest.raises(InputError, match="must have a width all round"):
        ring_stock(BOUNDS, flat(20.0), flat(20.5), (0.6, 0.0))


def test_a_boss_beyond_half_a_turn():
    """From 200 to 250 deg: a sector of 50 deg, on that side alone."""
    stock = ring_stock(BOUNDS, flat(20.0), flat(21.5), bosses=[Boss(math.radians(200.0), math.radians(250.0), 1.2)])
    for degrees in (202.0, 225.0, 248.0):
        assert thickness(stock, 1, degrees) == pytest.approx(2.7, abs=1e-3)
    assert thickness(stock, 1, 45.0) == pytest.approx(1.5, abs=1e-3)


def test_a_boss_all_round_is_a_thicker_ring():
    stock = ring_stock(BOUNDS, flat(20.0), flat(21.5), bosses=[Boss(0.0, math.tau, 1.0)])
    assert stock.area(0) == pytest.approx(math.pi * (22.5**2 - 20.0**2), rel=1e-4)


def test_distance_from_the_surface_in_one_layer():
    """The lowest layer alone, then the highest: a layer counts where both of its bounds are within the heights."""
    stock = ring_stock(BOUNDS, flat(18.0), cone(21.0, 0.5))
    for low, middle in ((-4.0, -3.5), (-1.0, -0.5)):
        found = surface_off(stock, flat(20.0), low, low + 1.0, WITHIN)
        assert found == pytest.approx((1.0 - 0.5 * middle, 1.0 - 0.5 * middle), abs=2e-3)


def test_the_narrowest_ring_is_named():
    with pytest.raises(InputError, match=r"at z = -0\.5 mm a ring from 20\.8 to 20\.5 mm"):
        ring_stock(BOUNDS, cone(20.9, -0.2), flat(20.5))
