"""Division of a line: every division of short lines is tried, and what the controller gains by integration."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.planning.line_division import PRICE, line_ends, segment_feeds
from chipload.program.time import change_time


def cost(s: np.ndarray, v: np.ndarray, length: float, a: float, block: float, ends: tuple[int, ...]) -> float:
    """What a division costs, term by term as it is documented; inf where a segment is too short."""
    places = [0.0, *s[list(ends)], length]
    bounds = [0, *ends, len(v) - 1]
    feeds = [min(v[a0 : b0 + 1]) for a0, b0 in pairwise(bounds)]
    own = np.diff(places)
    total = float((own / feeds).sum())
    for k in range(len(feeds)):
        if ends and own[k] < feeds[k] * block:
            return np.inf
        if k:
            low, high = sorted((feeds[k - 1], feeds[k]))
            faster = own[k - 1] if feeds[k - 1] > feeds[k] else own[k]
            if faster < (high**2 - low**2) / (2.0 * a):
                return np.inf
            total += (high - low) ** 2 / (2.0 * a * high) + PRICE * length * float((1.0 / v).mean())
    return total


@pytest.mark.parametrize("seed", range(12))
def test_no_division_of_a_short_line_is_better(seed: int) -> None:
    """All divisions of nine stations; the programme keeps one way to each end: it may miss the best a little."""
    rng = np.random.default_rng(seed)
    n = 9
    v = rng.choice([5.0, 12.0, 30.0, 60.0], n)
    s, length = np.arange(n) + 0.5, float(n)
    every = [e for k in range(4) for e in combinations(range(n), k)]
    found = tuple(line_ends(s, v, length, 3000.0, 0.01).tolist())
    least = min(cost(s, v, length, 3000.0, 0.01, e) for e in every)
    assert cost(s, v, length, 3000.0, 0.01, found) <= least * 1.005


def test_feeds_of_segments_are_allowed_at_both_ends() -> None:
    s, v = np.arange(40) + 0.5, np.where(np.abs(np.arange(40) - 20) < 4, 10.0, 40.0)
    ends = line_ends(s, v, 40.0, 3000.0, 0.01)
    assert ends.tolist() == [16, 24]
    assert segment_feeds(v, ends).tolist() == [40.0, 10.0, 40.0]


def test_what_a_slow_machine_and_a_slow_control_cannot_follow_is_left_out() -> None:
    """A segment of 2 mm takes 0.05 s at 40 mm/s; from 10 to 40 mm/s a machine with 100 mm/s^2 needs 7.5 mm."""
    s, v = np.arange(8) + 0.5, np.array([10.0] * 5 + [40.0] * 3)
    assert len(line_ends(s, v, 8.0, 3000.0, 0.01)) == 1
    assert len(line_ends(s, v, 8.0, 3000.0, 0.2)) == 0
    assert len(line_ends(s, v, 8.0, 100.0, 0.01)) == 0
    assert len(line_ends(s, v, 8.0, 3000.0, 0.01, jerk=1e3)) == 0
    assert len(line_ends(s, np.full(8, 40.0), 8.0, 3000.0, 0.01)) == 0


def test_a_cut_that_gains_little_is_not_made() -> None:
    s = np.arange(100) + 0.5
    assert len(line_ends(s, np.array([20.0] * 50 + [20.05] * 50), 100.0, 3000.0, 0.01)) == 0
    assert len(line_ends(s, np.array([20.0] * 50 + [21.0] * 50), 100.0, 3000.0, 0.01)) == 1


@pytest.mark.parametrize(("dv", "jerk"), [(30.0, 2e5), (30.0, 2e3), (2.0, 2e4)])
def test_the_time_of_a_change_of_speed(dv: float, jerk: float) -> None:
    """The jerk is integrated: up, held, down."""
    a = 1000.0
    top = min(a, np.sqrt(dv * jerk))
    t1, t2 = top / jerk, (dv - top**2 / jerk) / top
    t = np.linspace(0.0, 2.0 * t1 + t2, 20001)
    rate = np.interp(t, [0.0, t1, t1 + t2, 2.0 * t1 + t2], [0.0, top, top, 0.0])
    assert np.trapezoid(rate, t) == pytest.approx(dv, rel=1e-6)
    assert float(change_time([dv], a, jerk)[0]) == pytest.approx(t[-1], rel=1e-9)


def test_values_out_of_range() -> None:
    with pytest.raises(InputError, match="stations of a line must be"):
        line_ends([1.0, 2.0], [5.0, 0.0], 3.0, 1e3, 0.01)
    with pytest.raises(InputError, match="block_s = -1"):
        line_ends([1.0, 2.0], [5.0, 1.0], 3.0, 1e3, -1.0)
