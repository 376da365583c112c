"""The greatest feed within the limits, lines, and feeds that do not flicker, against scans and brute force."""

from __future__ import annotations

import re

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.planning.feeds import KEPT, SLOWEST, StepContact, greatest_factor, line_feeds, steady_feeds


def rising(rng, n):
    """Ratios that never fall with the feed: powers, a kink, a jump, some flat."""
    flat, slope, power = rng.random(n), 3.0 * rng.random(n) * rng.integers(0, 2, n), rng.uniform(0.4, 2.0, n)
    kink, jump, height = rng.uniform(0.2, 3.0, n), rng.uniform(0.2, 3.0, n), rng.integers(0, 2, n) * rng.random(n)

    def ratio(k):
        k = np.asarray(k)
        return flat + slope * k**power + np.maximum(k - kink, 0.0) + height * (k > jump)

    return ratio


@pytest.mark.parametrize("seed", range(4))
def test_a_step_goes_as_fast_as_a_scan_says(seed):
    n = 400
    ratio = rising(np.random.default_rng(seed), n)
    looks = []
    found = greatest_factor(lambda k: looks.append(1) or ratio(k), np.full(n, 0.2), np.full(n, 3.0))
    scan = np.linspace(0.2, 3.0, 20_001)
    fits = np.array([ratio(np.full(n, k)) <= 1.0 for k in scan])
    best = np.where(fits.any(axis=0), scan[np.maximum(fits.sum(axis=0) - 1, 0)], np.nan)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(best))
    some = ~np.isnan(found)
    # within its limits where it was looked at, and what the scan allows gives no more than the unused ten-thousandth
    assert (ratio(np.where(some, found, 0.2))[some] <= 1.0).all()
    high = ratio(np.where(some, np.maximum(found, best), 0.2)) - ratio(np.where(some, found, 0.2))
    assert (high[some] <= 1.5e-4).all()
    assert 20 < some.sum() < n
    assert len(looks) <= 45


def test_a_straight_ratio_is_solved_in_one_look():
    looks = []
    slope = np.array([0.5, 2.0, 4.0])
    found = greatest_factor(lambda k: looks.append(1) or slope * k, np.full(3, 0.1), np.full(3, 9.0))
    np.testing.assert_allclose(found, 1.0 / slope, rtol=1.1e-4)
    assert len(looks) == 3


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: greatest_factor(lambda k: k, [0.0], [1.0]), "slowest and fastest must be (n,) with 0 < slowest"),
        (lambda: greatest_factor(lambda k: k, [2.0], [1.0]), "slowest and fastest must be (n,) with 0 < slowest"),
        (lambda: greatest_factor(lambda k: k, [1.0], [1.0], 1.0), "close = 1: must be between 0 and 1"),
        (lambda: steady_feeds([1.0], [1.0], [1.0], [1.0], 1.0), "share = 1: must be at least 0 and below 1"),
    ],
)
def test_what_is_refused(call, said):
    with pytest.raises(InputError, match=re.escape(said)):
        call()


def test_a_line_is_as_fast_as_its_worst_step():
    rng = np.random.default_rng(6)
    n = 500
    line, touch = rng.integers(3, 90, n), rng.choice([0, 0, 0, 1, 2], n)
    least, most, by = rng.uniform(0.1, 0.3, n), rng.uniform(0.4, 3.0, n), rng.integers(0, 6, n)
    most[rng.random(n) < 0.1] = np.nan
    found = line_feeds(line, touch, least, most, by)
    assert found.line.tolist() == sorted(set(line.tolist()))
    kinds = set()
    for k, number in enumerate(found.line.tolist()):
        own = np.flatnonzero(line == number)
        does = max(touch[own].tolist())
        assert found.touch[k] == does
        if does == StepContact.FILM:
            expected = (1.0, KEPT)
        elif np.isnan(most[own]).any():
            expected = (least[own].max(), SLOWEST)
        else:
            worst = own[np.argmin(most[own])]
            expected = (most[worst], by[worst])
        assert (found.allowed[k], found.by[k]) == expected
        kinds.add(int(np.sign(found.by[k])) if found.by[k] != KEPT else KEPT)
    assert kinds == {KEPT, -1, 0, 1}


def test_feeds_do_not_flicker_and_lose_no_more_than_they_may():
    rng = np.random.default_rng(7)
    n, share = 3000, 0.1
    allowed = np.exp(np.cumsum(rng.normal(0.0, 0.03, n)))
    useful = allowed * rng.choice([1.0, 1.0, 0.8], n)
    least = np.full(n, 0.05)
    old = np.full(n, 1.0)
    found = steady_feeds(allowed, useful, least, old, share)
    assert (found <= allowed).all()
    assert (found >= (1.0 - share) * useful).all()
    changes = np.flatnonzero(np.diff(found) != 0.0)
    # what changes had to: neither the feed before nor the programmed one would have been kept
    for k in changes.tolist():
        before = found[k]
        assert before > allowed[k + 1] or before < (1.0 - share) * useful[k + 1]
    assert 20 < len(changes) < n // 2
    assert (np.diff(steady_feeds(allowed, allowed, least, old, 0.0)) != 0.0).mean() > 0.9


def test_a_feed_that_calms_is_not_below_the_least():
    assert steady_feeds([1.0, 1.04], [1.0, 1.04], [0.5, 1.02], [3.0, 3.0], 0.1).tolist() == [1.0, 1.04]
    assert steady_feeds([1.0], [0.3], [0.5], [3.0], 0.1).tolist() == [0.5]
