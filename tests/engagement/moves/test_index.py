"""The lists of the index: packed where they are, they hold what they held; the index is dropped after the last step."""

from __future__ import annotations

import numpy as np

from chipload.cutter.cutter import Cutter
from chipload.engagement.moves import _sweep
from chipload.engagement.moves.stock import MoveStock

GRID = np.array([0.0, 0.0, 1.0, 1.0, -10.0, 100.0])


def test_packed_lists_hold_the_moves_below_the_ceiling_in_their_order() -> None:
    random = np.random.default_rng(7)
    room, count = random.integers(0, 9, 60), 60
    used = np.minimum(random.integers(0, 9, count), room)
    at = np.empty(count, dtype=np.int64)
    end = 0
    for cell in random.permutation(count).tolist():  # lists lie in any order, with holes between them
        at[cell] = end
        end += int(room[cell]) + int(random.integers(0, 4))
    lists = np.column_stack([at, used, room, used])
    kept = random.integers(0, 1000, end).astype(np.int32)
    reach = random.integers(0, 1000, end).astype(np.uint16)
    level = np.column_stack([np.zeros(count), random.uniform(-10.0, 0.0, count), np.zeros(count)])
    wanted = []
    for cell in range(count):
        own = slice(at[cell], at[cell] + used[cell])
        # a reach of r steps is a height of -10 + r / 100 mm
        low = -10.0 + reach[own] / 100.0 < level[cell, 1] + 1e-4
        wanted.append(list(zip(kept[own][low].tolist(), reach[own][low].tolist(), strict=True)))
    order = np.argsort(lists[:, 0], kind="stable")
    total = _sweep.pack_lists(order, GRID, lists, kept, reach, level)
    assert total == sum(map(len, wanted))
    for cell, pairs in enumerate(wanted):
        own = slice(lists[cell, 0], lists[cell, 0] + lists[cell, 1])
        assert list(zip(kept[own].tolist(), reach[own].tolist(), strict=True)) == pairs


def test_a_reach_in_two_bytes_is_never_above_the_height() -> None:
    random = np.random.default_rng(8)
    z = random.uniform(-10.0, 0.0, 500)
    for least in random.uniform(-12.0, 0.0, 500):
        steps = min(max(int(np.floor((least - GRID[4]) * GRID[5])), 0), _sweep.HEIGHTS)
        over = z[z > least - 1e-8]
        assert all(steps < _sweep.grid_height_above(h, GRID) for h in over)


def test_lists_grow_where_they_are_and_the_index_is_dropped() -> None:
    mill = Cutter(6.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=3.0)
    stock = MoveStock(np.array([0.0, 0.0, -9.0]), np.array([40.0, 40.0, 0.0]), {1: mill})
    x = np.linspace(3.0, 37.0, 60)
    tips = np.array([[a, b, -2.0 - 0.5 * np.sin(a)] for b in np.linspace(3.0, 37.0, 120) for a in x])
    stock.skip(tips[:-1], tips[1:], np.ones(len(tips) - 1, dtype=np.int64))
    assert len(stock.kept) > 1 << 16
    assert stock.used[0] <= len(stock.kept) == len(stock.reach)
    stock.forget()
    assert len(stock.kept) == len(stock.reach) == len(stock.moves) == len(stock.of) == 0
    assert stock.cropped(np.zeros(3), np.full(3, 9.0)) is not None
