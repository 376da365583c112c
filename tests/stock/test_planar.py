"""The planar stock against a plain union of capsules, point by point."""

import math

import numpy as np
import pytest
import shapely

from chipload.errors import InputError
from chipload.stock.planar import TOUCH, PlanarStock

R = 3.0


def walk(seed, n):
    """Capsule axes of a walk that crosses itself often, so that cells are pruned."""
    rng = np.random.default_rng(seed)
    p = np.cumsum(rng.normal(scale=0.5, size=(n + 1, 2)), axis=0)
    p = 15.0 + 9.0 * np.tanh((p - p.mean(axis=0)) / 9.0)
    return np.hstack([p[:-1], p[1:]])


def distance(axes, points):
    """Least distance of points from the axes, one axis after the other."""
    lines = shapely.linestrings(axes.reshape(-1, 2, 2))
    tree = shapely.STRtree(lines)
    return tree.query_nearest(shapely.points(points), return_distance=True, all_matches=False)[1]


@pytest.mark.parametrize(("seed", "n"), [(1, 5), (2, 60), (3, 2500)])
def test_rim_against_every_capsule(seed, n):
    """2000 points of each rim: uncut where no capsule holds them."""
    axes = walk(seed, n)
    stock = PlanarStock((0.0, 0.0, 30.0, 30.0), R)
    stock.remove(axes)
    rng = np.random.default_rng(seed + 100)
    rim = (np.arange(2000) + 0.5) * (2.0 * math.pi / 2000) - 0.5 * math.pi
    seen = set()
    for _ in range(60):
        centre, a = rng.uniform(4, 26, 2), rng.uniform(-math.pi, math.pi)
        arcs = stock.arcs(centre, (math.cos(a), math.sin(a)), whole=True)
        told = ((rim[:, None] >= arcs[:, 0]) & (rim[:, None] <= arcs[:, 1])).any(axis=1)
        points = centre + R * (1.0 - TOUCH) * np.column_stack([np.cos(a + rim), np.sin(a + rim)])
        far = distance(axes, points)
        sure = np.abs(far - R) > 1e-9
        assert (told == (far > R))[sure].all()
        seen.add((bool(told.any()), bool(told.all())))
    assert (True, False) in seen


def test_engagement_of_a_slot_and_of_a_step_over():
    """A full slot is pi; beside a straight cut by s it is acos(1 - s / R)."""
    stock = PlanarStock((-20.0, -20.0, 20.0, 20.0), R)
    assert stock.engagement((0.0, 0.0), (1.0, 0.0)) == pytest.approx(math.pi)
    stock.remove([[-15.0, 0.0, 15.0, 0.0]])
    for s in (0.2, 1.0, 3.0, 5.5):
        got = stock.engagement((0.0, -s), (1.0, 0.0))
        assert got == pytest.approx(math.acos(1.0 - s / R), abs=1e-3)  # the rim is smaller than the cut by TOUCH


def test_order_does_not_matter():
    axes = walk(7, 400)
    stocks = []
    for order in (axes, axes[::-1]):
        stock = PlanarStock((0.0, 0.0, 30.0, 30.0), R)
        stock.remove(order)
        stocks.append(stock)
    rng = np.random.default_rng(0)
    for _ in range(200):
        centre, a = rng.uniform(3, 27, 2), rng.uniform(-math.pi, math.pi)
        one, two = (s.engagement(centre, (math.cos(a), math.sin(a))) for s in stocks)
        assert one == pytest.approx(two, abs=1e-9)


@pytest.mark.parametrize(("box", "radius"), [((0, 0, 0, 5), 3.0), ((0, 0, 5, 5), 0.0), ((0, 0, math.inf, 5), 1.0)])
def test_nothing_to_cut_is_refused(box, radius):
    with pytest.raises(InputError):
        PlanarStock(box, radius)
