"""Cutters and table angles of strips against every way there is, one by one."""

import math
from itertools import combinations, pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chipload.errors import InputError
from chipload.planning.impeller import assignment
from chipload.planning.impeller.assignment import Changes, assign_cutters, bound_of_cells, bound_of_strips


def random_sides(seed, shape, sides, closed):
    """Times of cells; a share ``closed`` of cutters and table angles does not go."""
    rng = np.random.default_rng(seed)
    out = []
    for _ in range(sides):
        u = rng.uniform(1.0, 9.0, shape)
        u[rng.random(shape) < closed] = math.inf
        v = np.where(np.isfinite(u), rng.uniform(1.0, 9.0, shape), math.inf)
        out.append((u, v.swapaxes(0, 1).copy()))
    return out


def price(run, changes):
    """Time of a sequence of ((cutter, table), time of that strip or cell)."""
    total = sum(cost for _, cost in run)
    for (a, _), (b, _) in pairwise(run):
        total += changes.cutter * (a[0] != b[0]) + changes.table * (a[1] != b[1])
    return total


def runs_of(side, states):
    """Every run through a side: order, direction, a state for each strip, or for each cell where no state mills it."""
    for cost in side:
        for strips in (range(len(cost)), range(len(cost))[::-1]):
            choices = []
            for k in strips:
                whole = {s: cost[k, :, s[0], s[1]].sum() for s in states}
                if min(whole.values()) < math.inf:
                    choices.append([[(s, whole[s])] for s in states])
                    continue
                ways = []
                for cells in (range(cost.shape[1]), range(cost.shape[1])[::-1]):
                    ways += [
                        [(s, cost[k, j, s[0], s[1]]) for j, s in zip(cells, each, strict=True)]
                        for each in product(states, repeat=cost.shape[1])
                    ]
                choices.append(ways)
            for pick in product(*choices):
                run = [x for part in pick for x in part]
                if all(cost_ < math.inf for _, cost_ in run):
                    yield run


def brute(sides, changes, most):
    K, T = sides[0][0].shape[2:]
    sets = [range(K)] if most is None else [s for n in range(1, most + 1) for s in combinations(range(K), n)]
    best = math.inf
    for chosen in sets:
        states = list(product(chosen, range(T)))
        every = [list(runs_of(side, states)) for side in sides]
        for pick in product(*every):
            best = min(best, price([x for run in pick for x in run], changes))
    return best


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6), cutter=st.floats(0.0, 6.0), table=st.floats(0.0, 6.0),
    most=st.sampled_from([1, 2, None]), closed=st.sampled_from([0.0, 0.3, 0.5]),
)  # fmt: skip
def test_one_side_is_the_best_of_all_ways(seed, cutter, table, most, closed):
    sides, changes = random_sides(seed, (3, 2, 3, 2), 1, closed), Changes(cutter, table)
    found, expected = assign_cutters(sides, changes, most), brute(sides, changes, most)
    if found is None:
        assert expected == math.inf
    else:
        assert found.total == pytest.approx(expected, rel=1e-12)
        check(found, sides, changes, most)


@pytest.mark.parametrize("most", [1, 2, None])
@pytest.mark.parametrize("seed", range(4))
def test_two_sides_share_their_cutters(seed, most):
    sides, changes = random_sides(seed, (2, 2, 2, 2), 2, 0.2), Changes(3.0, 1.0)
    found, expected = assign_cutters(sides, changes, most), brute(sides, changes, most)
    assert (found.total if found else math.inf) == pytest.approx(expected, rel=1e-12)
    if found:
        check(found, sides, changes, most)


def check(found, sides, changes, most):
    """The steps are what was priced: every cell once, each side in one order; not below the bound."""
    run = []
    for number, side in enumerate(sides):
        steps = [s for s in found.steps if s.side == number]
        (order,) = {s.order for s in steps}
        cost = side[order]
        seen = np.zeros(cost.shape[:2], dtype=int)
        for s in steps:
            cells = slice(None) if s.cell < 0 else slice(s.cell, s.cell + 1)
            seen[s.strip, cells] += 1
            run.append(((s.cutter, s.table), cost[s.strip, cells, s.cutter, s.table].sum()))
        assert (seen == 1).all()
    assert [s.side for s in found.steps] == sorted(s.side for s in found.steps)
    assert price(run, changes) == pytest.approx(found.total, rel=1e-12)
    if most is not None:
        assert len({s.cutter for s in found.steps}) <= most
    bounds = bound_of_cells(sides, changes, most), bound_of_strips(sides, changes, most), found.total + 1e-9
    # sums of the same costs in another order differ by rounding
    assert (np.diff(bounds) >= -1e-12 * np.abs(bounds[1:])).all()


def test_more_cutters_are_not_slower():
    sides = random_sides(5, (5, 4, 6, 3), 2, 0.05)
    times = [assign_cutters(sides, Changes(4.0, 1.0), m).total for m in (1, 2, 3, 4, 5, 6)]
    assert times == sorted(times, reverse=True)
    assert times[-1] == pytest.approx(assign_cutters(sides, Changes(4.0, 1.0), None).total)


def test_no_cutter_mills_all():
    cost = np.full((2, 2, 2, 1), 1.0)
    cost[0, 0, 0], cost[1, 1, 1] = math.inf, math.inf
    side = (cost, cost.swapaxes(0, 1))
    assert assign_cutters([side], Changes(1.0, 1.0), 1) is None
    assert assign_cutters([side], Changes(1.0, 1.0), 2).total == pytest.approx(5.0)


def test_refused(monkeypatch):
    side = random_sides(0, (1, 1, 4, 1), 1, 0.0)
    with pytest.raises(InputError, match="cutter_change_s = -1: must be at least 0"):
        Changes(-1.0, 0.0)
    with pytest.raises(InputError, match="most = 0: must be at least 1 cutter"):
        assign_cutters(side, Changes(1.0, 1.0), 0)
    monkeypatch.setattr(assignment, "SETS", 5)
    with pytest.raises(InputError, match="10 sets of 2 of 4 cutters: must be at most 5"):
        assign_cutters(side, Changes(1.0, 1.0), 2)
