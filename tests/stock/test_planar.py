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


def arc_chain(seed, n):
    """(n, 7) lines and arcs of any radius and sense, up to a full turn."""
    rng = np.random.default_rng(seed)
    rows = []
    for _ in range(n):
        p, a = rng.uniform(7.0, 23.0, 2), rng.uniform(-math.pi, math.pi)
        rho, sweep = 10.0 ** rng.uniform(-0.8, 1.5), rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-2.0, 0.7)
        sweep = math.copysign(min(abs(sweep), 6.0 / rho), sweep)
        x, y = p[0] + rho * math.cos(a), p[1] + rho * math.sin(a)
        b = math.atan2(p[1] - y, p[0] - x) + sweep
        q = (x + rho * math.cos(b), y + rho * math.sin(b))
        rows.append([*p, *q, x, y, sweep] if rng.random() < 0.8 else [*p, *q, 0.0, 0.0, 0.0])
    return np.array(rows)


def distance_from_segments(segments, points):
    """Least distance of points from lines and arcs: the foot where the segment has one, else an end."""
    out = np.full(len(points), np.inf)
    for x0, y0, x1, y1, xc, yc, sweep in segments:
        a, b, c = np.array([x0, y0]), np.array([x1, y1]), np.array([xc, yc])
        ends = np.minimum(np.hypot(*(points - a).T), np.hypot(*(points - b).T))
        if sweep == 0.0:
            t = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
            foot = np.hypot(*(points - a - t[:, None] * (b - a)).T)
        else:
            turn = np.arctan2(*(points - c).T[::-1]) - math.atan2(y0 - yc, x0 - xc)
            on = (turn * math.copysign(1.0, sweep)) % math.tau <= abs(sweep)
            foot = np.where(on, np.abs(np.hypot(*(points - c).T) - math.hypot(*(a - c))), np.inf)
        out = np.minimum(out, np.minimum(ends, foot))
    return out


@pytest.mark.parametrize(("seed", "n"), [(1, 1), (2, 1), (3, 3), (4, 12), (5, 400)])
def test_rim_against_every_arc(seed, n):
    """As above, with arcs: one alone, few that leave most uncut, and many."""
    for again in range(40 if n < 100 else 1):
        segments = arc_chain(1000 * seed + again, n)
        stock = PlanarStock((0.0, 0.0, 30.0, 30.0), R)
        stock.remove_segments(segments)
        rng = np.random.default_rng(seed + again)
        rim = (np.arange(720) + 0.5) * (2.0 * math.pi / 720) - 0.5 * math.pi
        for _ in range(12):
            near = segments[rng.integers(n), 0:2] + rng.uniform(-2.2 * R, 2.2 * R, 2)
            centre, a = np.clip(near, 3.0, 27.0), rng.uniform(-math.pi, math.pi)
            arcs = stock.arcs(centre, (math.cos(a), math.sin(a)), whole=True)
            told = ((rim[:, None] >= arcs[:, 0]) & (rim[:, None] <= arcs[:, 1])).any(axis=1)
            far = distance_from_segments(
                segments, centre + R * (1.0 - TOUCH) * np.column_stack([np.cos(a + rim), np.sin(a + rim)])
            )
            sure = np.abs(far - R) > 1e-8
            assert (told == (far > R))[sure].all(), (seed, again, centre, a)


def test_engagement_of_a_slot_and_of_a_step_over():
    """A full slot is pi; beside a straight cut by s it is acos(1 - s / R)."""
    stock = PlanarStock((-20.0, -20.0, 20.0, 20.0), R)
    assert stock.engagement((0.0, 0.0), (1.0, 0.0)) == pytest.approx(math.pi)
    stock.remove([[-15.0, 0.0, 15.0, 0.0]])
    for s in (0.2, 1.0, 3.0, 5.5):
        got = stock.engagement((0.0, -s), (1.0, 0.0))
        assert got == pytest.approx(math.acos(1.0 - s / R), abs=1e-3)  # the rim is smaller than the cut by TOUCH
    # along the path that has cut, nothing is left
    assert stock.engagement((0.0, 0.0), (1.0, 0.0)) == 0.0


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


@pytest.mark.parametrize("radius", [0.4, 3.0, 12.0])
def test_memory_is_reserved_for_every_cell_that_a_capsule_touches(radius):
    """Random segments: what one takes is at most what was reserved for it, and the stock has room for it."""
    rng = np.random.default_rng(4)
    stock = PlanarStock((0.0, 0.0, 40.0, 30.0), radius)
    for _ in range(60):
        before, capsules = stock.used, stock.capsules
        stock.remove([rng.uniform([0.0, 0.0] * 2, [40.0, 30.0] * 2)])
        assert stock.used - before <= (2 * (stock.capsules - capsules) + 2) * int(stock.grid[7])
        assert stock.used <= len(stock.link)
        assert stock.capsules <= len(stock.axis)


@pytest.mark.parametrize("radius", [0.4, 3.0, 12.0])
def test_half_a_radius_lies_around_the_stock(radius):
    """The cells reach half a radius beyond every side, so that a cutter beside the stock is seen."""
    x, y, h, nx, ny, *_ = PlanarStock((1.0, 2.0, 41.0, 32.0), radius).grid
    assert (x, y) == pytest.approx((1.0 - 0.5 * radius, 2.0 - 0.5 * radius))
    assert 41.0 + 0.5 * radius <= x + nx * h < 41.0 + 0.5 * radius + h
    assert 32.0 + 0.5 * radius <= y + ny * h < 32.0 + 0.5 * radius + h
