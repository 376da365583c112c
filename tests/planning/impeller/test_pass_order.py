"""The order of passes against all orders there are."""

import itertools
import math

import numpy as np
import pytest

from chipload.planning.impeller.pass_order import pass_order

TOP, NEAR, FEED, RAPID = 60.0, 8.0, 20.0, 400.0


def seconds(ends, order):
    """Time between the passes of an order: straight where that is near and quicker, else up, round and down."""
    total = 0.0
    for (a, forth), (b, other) in itertools.pairwise(order):
        p, q = ends[a, 1 if forth else 0], ends[b, 0 if other else 1]
        far = float(np.linalg.norm(q - p))
        over = ((TOP - p[2]) + (TOP - q[2]) + far) / RAPID + 0.5
        total += min(over, far / FEED) if far <= NEAR else over
    return total


@pytest.mark.parametrize("seed", range(4))
def test_near_the_best_of_all_orders(seed):
    rng = np.random.default_rng(seed)
    ends = rng.uniform(0.0, 20.0, (5, 2, 3))
    axes = np.tile([0.0, 0.0, 1.0], (5, 2, 1))
    found = pass_order(ends, axes, TOP, NEAR, FEED, RAPID)
    assert sorted(k for k, _ in found) == list(range(5))
    best = min(
        seconds(ends, list(zip(order, sides, strict=True)))
        for order in itertools.permutations(range(5))
        for sides in itertools.product((True, False), repeat=5)
    )
    assert seconds(ends, found) <= 1.1 * best
    assert seconds(ends, found) <= seconds(ends, [(k, True) for k in range(5)]) + 1e-9


def test_begins_where_the_last_stage_ends():
    ends = np.array([[[0.0, k, 0.0], [30.0, k, 0.0]] for k in (0.0, 40.0, 20.0)])
    axes = np.tile([0.0, 0.0, 1.0], (3, 2, 1))
    start = (np.array([30.0, 41.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    assert pass_order(ends, axes, TOP, math.inf, 1e4, RAPID, start)[0] == (1, False)
