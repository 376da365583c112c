"""The fuzzy table against sampling, symmetry, scikit-fuzzy and clip(e + d); what its file may hold."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from chipload.control.fuzzy import (
    FuzzyTable,
    additive,
    mamdani,
    product_sum,
    read_fuzzy,
    standard,
    surface,
)
from chipload.errors import InputError

TABLE = standard()
GRID = np.arange(-48, 49) * 0.025


def _memberships(centres, x: float):
    return np.array([np.interp(x, centres, row) for row in np.eye(len(centres))])


def sample_output(table: FuzzyTable, error: float, change: float, points: int) -> float:
    """Return the Mamdani output by sampling at ``points`` places: the formula as written, slow, as a reference."""
    a, b = _memberships(table.error, error), _memberships(table.change, change)
    first, last = table.output[0], table.output[-1]
    low = first - (table.output[1] - first) if table.whole_ends else first
    high = last + (last - table.output[-2]) if table.whole_ends else last
    y = np.linspace(low, high, points)
    knots = np.concatenate([[2 * first - table.output[1]], table.output, [2 * last - table.output[-2]]])
    cut = np.zeros(points)
    for i in range(len(a)):
        for j in range(len(b)):
            k = int(table.rules[i, j])
            triangle = np.interp(y, knots[k : k + 3], [0.0, 1.0, 0.0], left=0.0, right=0.0)
            cut = np.maximum(cut, np.minimum(min(a[i], b[j]), triangle))
    return float(np.trapezoid(cut * y, y) / np.trapezoid(cut, y))


def test_the_rules_are_clip_of_i_plus_j():
    index = np.arange(-3, 4)
    np.testing.assert_array_equal(TABLE.rules - 3, np.clip(index[:, None] + index, -3, 3))
    np.testing.assert_array_equal(TABLE.error, np.arange(-3, 4) / 3.0)


@pytest.mark.parametrize("table", [TABLE, replace(TABLE, whole_ends=True)], ids=["half", "whole"])
def test_zero_and_odd(table):
    assert float(mamdani(table, 0.0, 0.0)) == 0.0
    f = mamdani(table, GRID[:, None], GRID)
    assert np.abs(f + f[::-1, ::-1]).max() <= 4e-16
    assert float(mamdani(table, 1.0, 1.0)) == pytest.approx(1.0 if table.whole_ends else 8.0 / 9.0, abs=1e-15)


@pytest.mark.parametrize("whole", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_against_sampling(whole, seed):
    """Random tables of uneven sets, the centroid by sampling 200,001 places."""
    rng = np.random.default_rng(seed)
    p, q, r = rng.integers(2, 8, 3)
    e, d, o = (np.sort(rng.uniform(-1, 1, n)) for n in (p, q, r))
    rules = np.sort(np.sort(rng.integers(0, r, (p, q)), axis=0), axis=1)
    table = FuzzyTable(e, d, o, rules, whole)
    for x, y in rng.uniform(-1.1, 1.1, (12, 2)):
        assert float(mamdani(table, x, y)) == pytest.approx(sample_output(table, x, y, 200_001), abs=1e-8)


def test_by_hand():
    """e on a centre, d = 0: one set, cut nowhere, its centre; e half way between sets 3 and 4: half way."""
    assert float(mamdani(TABLE, 1.0 / 3.0, 0.0)) == pytest.approx(1.0 / 3.0, abs=1e-15)
    assert float(mamdani(TABLE, 1.0 / 6.0, 0.0)) == pytest.approx(1.0 / 6.0, abs=1e-15)


def test_monotone():
    """A greater error never lowers the answer of product and sum; Mamdani's ripples a little."""
    f = product_sum(TABLE, GRID[:, None], GRID)
    assert np.diff(f, axis=0).min() >= -1e-15
    assert np.diff(f, axis=1).min() >= -1e-15
    g = mamdani(TABLE, GRID[:, None], GRID)
    assert np.diff(g, axis=0).min() > -1.0 / 30.0


def test_product_sum_is_the_clipped_sum():
    both = np.clip(GRID, -1, 1)
    wanted = np.clip(both[:, None] + both, -1.0, 1.0)
    full = np.clip(product_sum(additive(), GRID[:, None], GRID), -1.0, 1.0)
    np.testing.assert_allclose(full, wanted, atol=1e-15)
    cut = product_sum(TABLE, GRID[:, None], GRID)
    assert np.abs(cut).max() <= 1.0
    assert np.abs(cut - wanted).max() == pytest.approx(1.0 / 12.0, abs=1e-3)
    inside = np.abs(both[:, None] + both) <= 1.0 / 3.0
    np.testing.assert_allclose(cut[inside], wanted[inside], atol=1e-15)
    assert np.all(np.abs(cut) <= np.abs(wanted) + 1e-15)


@pytest.mark.skipif(importlib.util.find_spec("skfuzzy") is None, reason="scikit-fuzzy is not installed")
def test_scikit_fuzzy():
    import skfuzzy as fuzz

    places = np.linspace(-1.0, 1.0, 60_001)
    knots = np.concatenate([[-1.0], np.arange(-3, 4) / 3.0, [1.0]])
    sets = [fuzz.trimf(places, knots[k : k + 3]) for k in range(7)]
    for e in np.linspace(-1.0, 1.0, 15):
        for d in np.linspace(-1.0, 1.0, 15):
            total = np.zeros_like(places)
            for i in range(7):
                for j in range(7):
                    w = min(fuzz.interp_membership(places, sets[i], e), fuzz.interp_membership(places, sets[j], d))
                    total = np.fmax(total, np.fmin(w, sets[int(np.clip(i + j - 3, 0, 6))]))
            assert float(mamdani(TABLE, e, d)) == pytest.approx(fuzz.defuzz(places, total, "centroid"), abs=1e-6)


def test_surface():
    e, d, f = surface(TABLE, 31)
    assert f.shape == (31, 31)
    assert f[30, 15] == float(mamdani(TABLE, e[30], d[15]))
    assert all(a < b for a, b in pairwise(e))


GOOD = 'name = "x"\nerror = [-1, 0, 1]\nchange = ["-1", "0", "1"]\noutput = [-1, 0, 1]\nends = "half"\n'
RULES = "rules = [[0, 0, 1], [0, 1, 2], [1, 2, 2]]\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GOOD + "rules = [[0, 0, 1], [0, 1, 2]]\n", "fuzzy x: rules: must be 3 rows (error) of 3 values (change)"),
        (
            GOOD + "rules = [[0, 0, 1], [0, 1, 3], [1, 2, 2]]\n",
            "fuzzy x: rules[1][2] = 3: must be from 0 to 2, an output set",
        ),
        (
            GOOD + "rules = [[0, 1, 1], [0, 0, 2], [1, 2, 2]]\n",
            "fuzzy x: rules[1][1] = 0: must be at least 1 before it: a greater error must not lower the feed",
        ),
        (GOOD.replace("[-1, 0, 1]", "[-1, 0, 0]", 1) + RULES, "fuzzy x: error[2] = 0: must be above 0 before it"),
        (GOOD.replace('"1"', '"1/0"') + RULES, "fuzzy {}: change: '1/0': must be a number or a fraction"),
        (GOOD.replace('"half"', '"soft"') + RULES, "fuzzy {}: ends = 'soft': must be one of half, whole"),
        (GOOD + RULES + "rule = 1\n", "fuzzy {}: unknown key rule: the nearest known one is rules"),
        (GOOD, "fuzzy {}: rules is missing: must be given"),
        (GOOD + "rules = [[0.5]]\n", "fuzzy {}: rules: 0.5: must be a whole number, an output set counted from 0"),
    ],
)
def test_refused(tmp_path, text, message):
    path = tmp_path / "table.toml"
    path.write_text(text)
    with pytest.raises(InputError) as err:
        read_fuzzy(path)
    assert str(err.value) == message.format(path)


def test_read(tmp_path):
    path = tmp_path / "table.toml"
    path.write_text(GOOD + RULES)
    assert float(mamdani(read_fuzzy(path), 0.0, 1.0)) == pytest.approx(1.0 - 1.0 / 3.0)


def test_nan_is_refused():
    with pytest.raises(InputError) as err:
        mamdani(TABLE, np.nan, 0.0)
    assert str(err.value) == "fuzzy: error = nan: must be a number; a lost sensor is not an error of 0"
