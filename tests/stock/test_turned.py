"""The stock of the next setup: closed forms of a block with a pocket and a slot, and turns that come back."""

import numpy as np
import pytest
import shapely

from chipload.errors import InputError
from chipload.stock.layers import LayeredStock
from chipload.stock.turned import stock_bounds, turn_matrix, turned_stock

ZERO = np.zeros(3)


@pytest.fixture
def stock():
    """A block 40 x 30 x 20 with a step 10 x 30 x 5 at its upper X- edge and a pocket 10 x 8 x 4 in its top."""
    made = LayeredStock.block((0.0, 0.0, 0.0), (40.0, 30.0, 20.0), np.array([0.0, 15.0, 16.0, 20.0]), 12.0)
    for layer in (1, 2):
        made.remove(layer, shapely.box(-1.0, -1.0, 10.0, 31.0))
    made.remove(2, shapely.box(20.0, 12.0, 30.0, 20.0))
    return made


VOLUME = 40.0 * 30.0 * 20.0 - 10.0 * 30.0 * 5.0 - 10.0 * 8.0 * 4.0


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("degrees", [90.0, 180.0, 270.0, -90.0])
def test_volume_and_size_stay(stock, axis, degrees):
    R = turn_matrix(axis, degrees)
    low, high = stock_bounds(stock, R)
    turned = turned_stock(stock, R, low, 5.0)
    assert turned.volume() == pytest.approx(VOLUME, rel=1e-12)
    got = [float(np.ptp(of[[0, -1]])) for of in (turned.xs, turned.ys, turned.bounds)]
    np.testing.assert_allclose(got, np.abs(R @ (40.0, 30.0, 20.0)), atol=1e-9)
    assert (turned.xs[0], turned.ys[0], turned.bounds[0]) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    np.testing.assert_allclose(np.abs(R @ (40.0, 30.0, 20.0)), high - low, atol=1e-9)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_four_quarter_turns_bring_it_back(stock, axis):
    now = stock
    for _ in range(4):
        now = turned_stock(now, turn_matrix(axis, 90.0), ZERO, 7.0)
    assert now.volume() == pytest.approx(VOLUME, rel=1e-9)
    for z in (7.0, 15.5, 18.0):
        at = int(np.searchsorted(now.bounds, z)) - 1
        own = int(np.searchsorted(stock.bounds, z)) - 1
        assert shapely.symmetric_difference(now.section(at), stock.section(own)).area < 1e-6


@pytest.mark.parametrize(
    ("axis", "degrees", "point", "inside"),
    [
        # the pocket opens downward after a turn about X, its floor 4 mm above the new bottom
        ("x", 180.0, (25.0, -16.0, -18.0), False),
        ("x", 180.0, (25.0, -16.0, -15.5), True),
        # the step at X- is on the right of a part that is turned about Y
        ("y", 180.0, (-5.0, 10.0, -17.0), False),
        ("y", 180.0, (-15.0, 10.0, -17.0), True),
        # X- is up after a quarter turn about Y: (z, y, -x)
        ("y", 90.0, (17.0, 10.0, -5.0), False),
        ("y", 90.0, (14.0, 10.0, -5.0), True),
        # Y- is up after a quarter turn about X: (x, -z, y)
        ("x", 90.0, (25.0, -18.0, 16.0), False),
        ("x", 90.0, (25.0, -18.0, 22.0), True),
    ],
)
def test_places(stock, axis, degrees, point, inside):
    turned = turned_stock(stock, turn_matrix(axis, degrees), ZERO, 3.0)
    section = turned.section(int(np.searchsorted(turned.bounds, point[2])) - 1)
    assert bool(shapely.contains_xy(section, *point[:2])) is inside


def test_a_block_is_a_block_again():
    """A faced block is cut as a block, by the exact engine."""
    made = LayeredStock.block((0.0, 0.0, -20.0), (40.0, 30.0, 0.0), np.array([-20.0, -1.0, 0.0]), 12.0)
    made.remove(1, shapely.box(-5.0, -5.0, 45.0, 35.0))
    turned = turned_stock(made, turn_matrix("x", 180.0), ZERO, 2.0)
    assert not turned.cut.any()
    assert turned.bounds.tolist() == [1.0, 20.0]


def test_what_is_refused(stock):
    with pytest.raises(InputError, match=r"flip.angle_deg = 45: about X it must be a multiple of 90"):
        turn_matrix("x", 45.0)
    for layer in range(3):
        stock.remove(layer, shapely.box(-1.0, -1.0, 50.0, 50.0))
    with pytest.raises(InputError, match="nothing is left"):
        stock_bounds(stock, np.eye(3))
