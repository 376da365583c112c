"""The greatest feed within the limits, against a scan of many feeds."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.planning.feeds import greatest_factor, line_feeds

SAMPLES = np.array([0.2, 0.5, 1.0, 2.0])


def random_loads(rng, n):
    """Loads that rise with the feed, some flat."""
    rise = rng.uniform(0.0, 3.0, (n, len(SAMPLES))) * rng.integers(0, 2, (n, len(SAMPLES)))
    return np.cumsum(rise, axis=1)


def scanned(loads, limit):
    """Greatest factor of a fine scan, nan: none."""
    scan = np.linspace(SAMPLES[0], SAMPLES[-1], 18_001)
    out = []
    for row in loads:
        good = scan[np.interp(scan, SAMPLES, row) <= limit]
        out.append(good[-1] if len(good) else np.nan)
    return np.array(out)


def test_one_limit_against_a_scan():
    rng = np.random.default_rng(5)
    loads = random_loads(rng, 300)
    for limit in (0.5, 2.0, 6.0):
        np.testing.assert_allclose(greatest_factor(SAMPLES, loads, limit), scanned(loads, limit), atol=1.1e-4)


def test_lines_against_a_scan():
    """The least over steps and limits; a step that cuts nothing asks for nothing."""
    rng = np.random.default_rng(6)
    n = 400
    line, cuts = rng.integers(3, 60, n), rng.random(n) < 0.8
    loads = {"force_n": random_loads(rng, n), "torque_nm": random_loads(rng, n)}
    limits = {"force_n": 3.0, "torque_nm": 2.0}
    fastest = rng.uniform(0.5, 2.0, n)
    found = line_feeds(line, cuts, SAMPLES, loads, limits, fastest)
    assert found.line.tolist() == sorted(set(line.tolist()))
    by_scan = {name: scanned(loads[name], limits[name]) for name in limits}
    for k, number in enumerate(found.line):
        own = line == number
        each = np.concatenate([*(by_scan[name][own & cuts] for name in limits), fastest[own]])
        if np.isnan(each).any():
            assert (found.by[k], found.factor[k]) == ("slowest", SAMPLES[0])
        else:
            assert found.factor[k] == pytest.approx(max(each.min(), SAMPLES[0]), abs=1.1e-4)
    assert found.beyond.tolist() == [n for n, b in zip(found.line.tolist(), found.by, strict=True) if b == "slowest"]
    assert 0 < len(found.beyond) < len(found.line)


def test_samples_that_are_none():
    with pytest.raises(InputError, match="samples must be at least two rising factors"):
        greatest_factor([1.0, 0.5], [[1.0, 2.0]], 1.0)
