"""The pallet angle along a line: within its ranges, without jumps, split where it must be."""

import itertools
import math

import numpy as np
import pytest

from chipload.planning.impeller import _pallet
from chipload.planning.impeller.pallet import pallet_angles


def test_follows_a_moving_range_and_keeps_from_its_ends():
    n = 60
    low = 0.8 * np.sin(np.linspace(0.0, 3.0, n))
    ranges = tuple(np.array([[a, a + 0.3]]) for a in low)
    (only,) = pallet_angles(ranges, np.ones(n - 1), np.full(n - 1, 0.2), math.radians(4.0))
    assert (only.first, only.last) == (0, n)
    depth = np.minimum(only.pallet - low, low + 0.3 - only.pallet)
    assert depth.min() >= 0.5 * math.radians(4.0) - 1e-12
    # the range moves by at most 0.041 a step; a state lies within one step of 2 degrees of it
    assert np.abs(np.diff(only.pallet)).max() < 0.08


def test_chooses_the_branch_that_goes_on():
    # two ranges; the nearer to the preferred angle ends half-way
    ranges = tuple(np.array([[0.0, 0.5], [2.0, 2.5]]) if k < 10 else np.array([[2.0, 2.5]]) for k in range(20))
    (only,) = pallet_angles(ranges, np.ones(19), np.full(19, 0.1), 0.05, np.full(20, 0.25))
    assert only.last == 20
    assert only.pallet.min() >= 2.0
    assert only.pallet.max() <= 2.5


def test_range_over_the_full_turn_is_one():
    ranges = tuple(np.array([[0.0, 0.1 + 0.01 * k], [2.0 * math.pi - 0.2 + 0.01 * k, 2.0 * math.pi]]) for k in range(8))
    (only,) = pallet_angles(ranges, np.ones(7), np.full(7, 0.5), 0.05)
    assert np.abs(np.diff(only.pallet)).max() < 0.1
    inside = [any(a <= b % math.tau <= c for a, c in r) for b, r in zip(only.pallet, ranges, strict=True)]
    assert all(inside)


def test_split_where_nothing_is_valid_and_where_the_pallet_is_too_slow():
    gap = tuple(np.array([[0.0, 1.0]]) if k != 4 else np.zeros((0, 2)) for k in range(9))
    assert [(t.first, t.last) for t in pallet_angles(gap, np.ones(8), np.ones(8))] == [(0, 4), (5, 9)]
    # the range moves by 0.3 a step and is 0.4 wide: at one angle two points at most are milled
    drift = tuple(np.array([[0.3 * k, 0.3 * k + 0.4]]) for k in range(8))
    fast, slow = (pallet_angles(drift, np.ones(7), np.full(7, most)) for most in (0.5, 1e-4))
    assert [(t.first, t.last) for t in fast] == [(0, 8)]
    assert [t.last - t.first for t in slow] == [2, 2, 2, 2]
    for piece in slow:
        assert np.abs(np.diff(piece.pallet)).max() <= 1e-4


def test_led_to_a_wide_step_over_where_the_ranges_allow_it():
    ranges = tuple(np.array([[0.0, 2.0]]) for _ in range(20))
    free = np.full(20, np.nan)
    (only,) = pallet_angles(
        ranges, np.ones(19), np.full(19, 0.5), 0.05, free, lambda _, B: 1.0 + 9.0 * np.exp(-((B - 1.4) ** 2))
    )
    assert only.pallet == pytest.approx(np.full(20, 1.4), abs=0.1)
    # where the wide angles end the pallet goes on at others
    short = tuple(np.array([[0.0, 2.0 if k < 10 else 0.9]]) for k in range(20))
    (only,) = pallet_angles(
        short, np.ones(19), np.full(19, 0.5), 0.05, free, lambda _, B: 1.0 + 9.0 * np.exp(-((B - 1.4) ** 2))
    )
    assert only.last == 20
    assert only.pallet[0] > 1.2
    assert only.pallet[-1] <= 0.9


@pytest.mark.parametrize("seed", range(6))
def test_the_row_of_states_is_the_cheapest_of_all(seed):
    """Five points of one or two ranges with two or three states each: every row of states is tried."""
    rng = np.random.default_rng(seed)
    counts, turn = rng.integers(1, 3, 5), 4000.0
    starts = np.concatenate([[0], np.cumsum(counts)])
    # some ranges lie a whole turn away
    low = rng.uniform(-0.3, 0.3, starts[-1]) + math.tau * rng.integers(-1, 2, starts[-1])
    ranges = np.column_stack([low, low + rng.uniform(0.2, 0.6, starts[-1])])
    states = [
        [(B, rng.uniform(0.0, 1.0), k) for k in range(count) for B in np.linspace(*ranges[first + k], 5)[1:4]]
        for first, count in zip(starts, counts, strict=False)
    ]
    length, most = rng.uniform(0.2, 2.0, 4), rng.uniform(0.2, 0.5, 4)

    def cost_of(row):
        total = row[0][1]
        for i, (a, b) in enumerate(itertools.pairwise(row)):
            step = math.remainder(b[0] - a[0], math.tau)
            one, two = ranges[starts[i] + a[2]], ranges[starts[i + 1] + b[2]]
            two = two + math.tau * round((one.mean() - two.mean()) / math.tau)
            if abs(step) > most[i] or min(one[1], two[1]) <= max(one[0], two[0]):
                return math.inf
            total += 1e-3 * turn * step**2 / length[i] + b[1] * length[i]
        return total

    # as far as a row goes
    best, last = min((cost_of(row), 5) for row in itertools.product(*states)), 5
    while not math.isfinite(best[0]):
        last -= 1
        best = min((cost_of(row), last) for row in itertools.product(*states[:last]))
    flat = [one for point in states for one in point]
    first = np.concatenate([[0], np.cumsum([len(point) for point in states])])
    chosen = np.zeros(5, dtype=np.int64)
    angle, cost, of = (np.array(x) for x in zip(*flat, strict=True))
    got = _pallet.cheapest_row(ranges, starts, angle, cost, of, first, length, most, turn, 0, chosen)
    assert got == last
    assert cost_of([flat[k] for k in chosen[:last]]) == pytest.approx(best[0], rel=1e-12)


def test_a_window_of_whole_steps_has_the_same_states_however_its_ends_are_rounded():
    half = math.radians(12.0)
    angles = np.linspace(0.1, 6.2, 400)
    ranges = np.column_stack([angles - half, angles + half])
    counts = set()
    for row in ranges:
        room = [np.empty(60), np.empty(60), np.empty(60, dtype=np.int64), np.zeros(2, dtype=np.int64)]
        counts.add(
            _pallet.states_of(
                row[None], np.array([0, 1]), np.array([math.nan]), 0.05, math.radians(2.0), 5, 60, 0.3, *room
            )
        )
    # 24 degrees in steps of 2
    assert counts == {12}
