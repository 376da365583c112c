"""Shortcuts of the engine for leaning axes, each against the full search that it replaces."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutter.record import cutter_record
from chipload.engagement.bricks._circle import crossing_direction, swept_at
from chipload.engagement.bricks._index import what_is
from chipload.engagement.bricks._line_chain import continues_move
from chipload.engagement.bricks._sweep import WAIT, estimated_least, least, swept
from chipload.engagement.bricks.stock import BrickStock, move_rows
from chipload.engagement.moves._border import BESIDE
from chipload.engagement.moves._sweep import MATERIAL
from engagement.bricks.programs import take, turned, unit, volumes
from engagement.bricks.test_turning_volumes import HIGH, LOW, five_axes
from engagement.moves.field import BULL, CUTTERS, FLAT

Floats = NDArray[np.float64]
#: what a move goes and by how much its axis leans on the way
MOVES = {
    "fixed": ((2.0, -1.0, 0.5), (0.0, 0.0, 0.0)),
    "turns": ((1.5, 1.0, -0.3), (0.04, -0.02, 0.01)),
    "turns in place": ((0.0, 0.0, 0.0), (0.05, 0.0, 0.0)),
    "long": ((9.0, 4.0, -0.5), (0.02, 0.03, 0.0)),
}


def move(way: str) -> Floats:
    u, lean = MOVES[way]
    a0 = unit([[0.3, 0.2, 1.0]])
    return np.asarray(move_rows(np.array([[1.0, 2.0, -3.0]]), np.array([[1.0, 2.0, -3.0]]) + u, a0, unit(a0 + lean))[0])


def near_surface(m: Floats, cutter: Cutter, n: int) -> Floats:
    """Points about the surface of the cutter at some time of the move, most of them within 0.02 mm of it."""
    random = np.random.default_rng(11)
    out = np.empty((n, 3))
    for k, t in enumerate(random.uniform(0.0, 1.0, n).tolist()):
        axis = m[6:9] * math.cos(t * m[12]) + m[9:12] * math.sin(t * m[12])
        across = unit(np.cross(axis, random.normal(size=3)))
        w = random.uniform(0.0, 8.0)
        out[k] = m[:3] + t * m[3:6] + w * axis + float(cutter.radius_at([w])[0]) * across
        out[k] += random.normal(size=3) * (0.01 if k % 3 else 1.0)
    return out


@pytest.mark.parametrize("kind", CUTTERS)
@pytest.mark.parametrize("way", MOVES)
def test_what_settles_a_point_agrees_with_the_search_of_the_least_distance(kind: str, way: str) -> None:
    """Chord, Newton's step beside the flank, and the value of which a border is the zero."""
    c, m, wait = cutter_record(CUTTERS[kind])[0], move(way), np.empty((WAIT, 6))
    inside = outside = 0
    for p in near_surface(m, CUTTERS[kind], 300):
        low, high = least(m, c, *p, math.inf, -math.inf, 1e-10, wait)
        if abs(high - 1e-8) < 1e-9:
            continue
        found = bool(swept(m, c, *p, wait))
        assert found == (high < 1e-8)
        inside, outside = inside + found, outside + (not found)
        assert estimated_least(m, c, *p) >= low - 1e-10
    assert inside > 20
    assert outside > 20


def steps_of(p0: Floats, p1: Floats, a0: Floats, a1: Floats, count: int) -> tuple[Floats, Floats]:
    """Points and axes of a line cut into steps."""
    t = np.linspace(0.0, 1.0, count + 1)
    return p0 + t[:, None] * (p1 - p0), np.array([turned(a0, a1, x) for x in t.tolist()])


@pytest.mark.parametrize("lean", [(0.0, 0.0, 0.0), (0.004, -0.008, 0.0)])
def test_steps_of_a_line_are_the_move_of_the_whole_line(lean: tuple[float, float, float]) -> None:
    a0 = unit([0.3, 0.2, 1.0])
    p, a = steps_of(np.array([1.0, 2.0, -3.0]), np.array([4.0, 3.0, -3.5]), a0, unit(a0 + lean), 6)
    rows = move_rows(p[:-1], p[1:], a[:-1], a[1:])
    known = move_rows(p[:1], p[-1:], a[:1], a[-1:])[0]
    c, m = cutter_record(FLAT)[0], rows[0].copy()
    assert all(continues_move(m, s, c) for s in rows[1:])
    np.testing.assert_allclose(m[:9], known[:9], atol=1e-12)
    np.testing.assert_allclose(m[12:14], known[12:14], atol=1e-12)
    if any(lean):
        np.testing.assert_allclose(m, known, atol=1e-11)
    # back again, aside, at another rate, and another turn do not go on
    back = move_rows(p[-1:], p[-2:-1], a[-1:], a[-2:-1])[0]
    aside = move_rows(p[-1:], p[-1:] + np.array([0.5, 0.1, 0.0]), a[-1:], a[-1:])[0]
    turns = move_rows(p[-1:], p[-1:] + (p[1] - p[0]), a[-1:], unit(a[-1:] + np.array([0.01, 0.0, 0.0])))[0]
    for s in (back, aside, turns):
        kept = m.copy()
        assert not continues_move(m, s, c)
        np.testing.assert_array_equal(m, kept)


@pytest.mark.parametrize("kind", ["flat", "bull", "ball"])
def test_joined_steps_remove_what_steps_of_their_own_do(kind: str) -> None:
    """Rows side by side, each a line in steps whose axis turns; each step entered as a move of its own beside it."""
    cutter, tilt = CUTTERS[kind], unit([0.2, 0.1, 1.0])
    parts = []
    for row in range(4):
        ends = np.array([[-6.0, 4.0 + 3.0 * row, -2.0], [24.0, 4.0 + 3.0 * row, -2.5]])
        parts.append(steps_of(*ends, tilt, unit(tilt + np.array([0.03, 0.02 * row, 0.0])), 24))
    points, axes = (np.concatenate(some) for some in zip(*parts, strict=True))
    some, other = BrickStock(LOW, HIGH, {1: cutter}), BrickStock(LOW, HIGH, {1: cutter})
    found = volumes(take(some, points, axes), len(points) - 1)
    known = np.zeros(len(points) - 1)
    for k in range(len(known)):
        other.used[2] = -1
        known[k] = volumes(take(other, points[k : k + 2], axes[k : k + 2]), 1)[0]
    # a step by itself is looked at as the last of a path
    assert found.sum() == pytest.approx(known.sum(), rel=2e-3)
    x = np.random.default_rng(3).uniform(LOW, HIGH, (4000, 3))
    assert [at(some, p) == MATERIAL for p in x] == [at(other, p) == MATERIAL for p in x]
    assert listed(some) < 0.8 * listed(other)


def at(stock: BrickStock, p: Floats) -> int:
    return int(what_is(*p, stock._index(), -1, np.empty((WAIT, 6))))


def listed(stock: BrickStock) -> int:
    """Moves in the lists of all bricks."""
    lengths = stock.bricks[: 512 * int(stock.used[1]), 1]
    return int(lengths[lengths > 0].sum())


def test_a_border_found_by_secants_is_one() -> None:
    """On circles about the cutter: swept just after it, not just before, and as near as halving would find it."""
    points, axes = five_axes(9, 40)
    stock = BrickStock(LOW, HIGH, {1: BULL})
    take(stock, points, axes)
    index, wait = stock._index(), np.empty((WAIT, 6))
    random = np.random.default_rng(5)
    count = 0
    for _ in range(400):
        e = int(random.integers(0, 40))
        axis = axes[e]
        first = unit(np.cross(axis, random.normal(size=3)))
        centre = points[e] + random.uniform(0.1, 6.0) * axis + random.normal(size=3)
        ring = np.concatenate([centre, 4.0 * first, 4.0 * np.cross(axis, first)])
        psi = random.uniform(-math.pi, math.pi)
        ends = [(math.cos(p), math.sin(p)) for p in (psi, psi + 0.35)]
        side = [bool(swept_at(ring, *end, e, index, wait)) for end in ends]
        if side[0] == side[1]:
            continue
        u, s = ends if side[1] else ends[::-1]
        c, d, before_c, before_d = crossing_direction(ring, *u, *s, e, index, wait)
        assert not swept_at(ring, before_c, before_d, e, index, wait)
        assert math.hypot(c - before_c, d - before_d) < BESIDE
        to = np.array([c, d]) + BESIDE * unit(np.array(s) - np.array(u))
        assert swept_at(ring, *unit(to), e, index, wait)
        count += 1
    assert count > 30


def test_borders_asked_for_where_they_were_are_found_where_they_are() -> None:
    """Steps in one run, in which each begins with the borders of the one before, and each in a run of its own."""
    points, axes = five_axes(9, 40)
    some, other = BrickStock(LOW, HIGH, {1: BULL}), BrickStock(LOW, HIGH, {1: BULL})
    some.more = other.more = (1, 1)
    found = volumes(take(some, points, axes), 40)
    known = [volumes(take(other, points[k : k + 2], axes[k : k + 2]), 1)[0] for k in range(40)]
    np.testing.assert_allclose(found, known, atol=2e-3 * max(known))
