"""Short rows joined to longer ones: what they leave out, by the distance of every old end from the new path."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from chipload.program.build import rows
from chipload.program.joined_rows import join_rows


def straight_moves(points):
    """Cuts along points, and a rapid to the first."""
    n = len(points)
    return rows([0] + [1] * (n - 1), points, (0.0, 0.0), [0.0] + [10.0] * (n - 1), 500.0, 1, "cut")


def wavy(n: int = 400):
    """Short cuts along a sine with noise, and a rapid to their start."""
    x = np.linspace(0.0, 60.0, n)
    noise = np.random.default_rng(7).uniform(-0.04, 0.04, n)
    return straight_moves(np.column_stack([x, 3.0 * np.sin(0.2 * x), -2.0 + noise]))


def distance(points, a, b):
    """(n,) distance of points from the segment a b."""
    share = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return np.linalg.norm(points - a - share[:, None] * (b - a), axis=1)


@pytest.mark.parametrize("deviation", [0.02, 0.1, 0.3])
def test_old_ends_lie_within_the_deviation(deviation):
    """Every old end beside the row that stands for it; times and ends are kept, no row is longer than asked."""
    program = wavy()
    times = np.arange(len(program), dtype=float)
    joined, seconds, off = join_rows(program, times, deviation, 5.0)
    assert len(joined) < len(program) * (0.9 if deviation < 0.1 else 0.5)
    assert seconds.sum() == pytest.approx(times.sum(), rel=1e-12)
    kept = np.searchsorted(program.p_work[:, 0], joined.p_work[:, 0])
    assert (program.p_work[kept] == joined.p_work).all()
    found = 0.0
    for first, last in pairwise(kept):
        assert np.linalg.norm(program.p_work[last] - program.p_work[first]) <= 5.0 or last == first + 1
        between = program.p_work[first + 1 : last]
        if len(between):
            found = max(found, distance(between, program.p_work[first], program.p_work[last]).max())
    assert 0.0 < found <= off <= deviation


@pytest.mark.parametrize("column", ["feed", "spindle", "tool", "motion", "label"])
def test_rows_that_differ_are_not_joined(column):
    """A straight line whose middle row has another feed, speed or tool, is a rapid or of another kind."""
    program = straight_moves(np.column_stack([np.arange(8.0), np.zeros(8), np.zeros(8)]))
    changed = np.array(getattr(program, column))
    changed[4] = {"feed": 5.0, "spindle": 1.0, "tool": 9, "motion": 0, "label": 1}[column]
    feed = np.where(np.arange(8) == 4, 0.0, program.feed) if column == "motion" else program.feed
    other = replace(program, **{"feed": feed, "labels": ("cut", "other"), column: changed})
    joined = join_rows(other, np.ones(8), 0.5, 100.0)[0]
    assert joined.p_work[:, 0].tolist() == [0.0, 3.0, 4.0, 7.0]
    assert join_rows(program, np.ones(8), 0.5, 100.0)[0].p_work[:, 0].tolist() == [0.0, 7.0]
    assert len(join_rows(program, np.ones(8), 0.0, 100.0)[0]) == 8


def test_a_path_that_turns_back_keeps_its_end():
    program = straight_moves([[0, 0, 0], [4, 0, 0], [4.05, 0, 0], [1, 0, 0]])
    joined = join_rows(program, np.ones(4), 0.1, 100.0)[0]
    assert joined.p_work[:, 0].tolist() == [0.0, 4.05, 1.0]
