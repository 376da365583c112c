"""Tooth engagement: what is refused, the thickest chip, and runout against the definition of what the teeth before
left over."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chipload.cutter.cutter import Cutter
from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs, tooth_radii, with_runout
from chipload.errors import InputError

MILL = Cutter(10.0, 4, 0.5, 25.0, 35.0, 6e5)


def one_bite(low, width, along, offset, across, kappa):
    """An engagement range of every tooth, cut down to where h > 0 by bisection of the range; None where there is no
    such part.
    """
    edge = [[0.0, 5.0, 0.0, math.sin(kappa), math.cos(kappa), 0.0, 0.1]]
    return ToothEngagement([0, 1], [[low, low + width, 0.0, 2.0, along, offset, across]], [-1], [0], edge)


def thickness(engagement, phi, tooth):
    """h of one tooth at the immersions phi (turns apart count as one), 0 where no engagement range holds; and how
    many hold.
    """
    h, number = np.zeros(len(phi)), np.zeros(len(phi), dtype=int)
    for row, owner in zip(engagement.rows, engagement.tooth, strict=True):
        if owner in (-1, tooth):
            inside = (phi - row[0]) % math.tau < row[1] - row[0]
            h += np.where(inside, row[4] * np.sin(phi) + row[6] * np.cos(phi) + row[5], 0.0)
            number += inside
    return h, number


@settings(max_examples=150, deadline=None)
@given(
    st.integers(1, 6),
    st.floats(0.001, 0.03),
    st.floats(0.0, 6.28),
    st.floats(0.0, 6.28),
    st.floats(0.01, 6.28),
    st.floats(0.0, 0.05),
    st.floats(0.0, 6.28),
    st.floats(0.0, 0.05),
    st.floats(0.0, 1.57),
)
def test_runout_leaves_what_the_teeth_before_did_not_take(teeth, e, at, low, width, swing, crest, lift, kappa):
    """h_j = min over m of m h + (r_j - r_(j-m)) sin(kappa), where positive, at 500 immersions; and sum h_j = N h."""
    cutter = replace(MILL, flutes=teeth, runout=(e, at))
    whole = one_bite(low, width, swing * math.sin(crest), swing + lift, swing * math.cos(crest), kappa)
    each = with_runout(whole, cutter)
    phi = low + (np.arange(500) + 0.37) / 500 * width
    h = thickness(whole, phi, 0)[0]
    radii = tooth_radii(cutter) * math.sin(kappa)
    total = np.zeros(500)
    for j in range(teeth):
        lines = [m * h + radii[j] - radii[(j - m) % teeth] for m in range(1, teeth + 1)]
        expected = np.clip(np.min(lines, axis=0), 0.0, None)
        ours, number = thickness(each, phi, j)
        edge = np.abs(expected) < 1e-9
        assert number.max(initial=0) <= 1
        np.testing.assert_allclose(ours[~edge], expected[~edge], rtol=1e-9, atol=1e-12)
        assert (ours[edge] < 1e-8).all()
        total += ours
    np.testing.assert_allclose(total, teeth * h, rtol=1e-7, atol=1e-8)


def test_runout_of_an_arc_by_hand():
    """Two teeth, r = +-e, f sin(phi) = 2 e at 30 and 150 deg: up to there the longer one cuts alone, 2 f sin(phi)."""
    e, f = 0.01, 0.04
    rows = engagement_of_arcs([0.0], [math.pi], f, replace(MILL, flutes=2, runout=(e, 0.0)), 3.0)
    first = math.pi / 6
    longer = rows.rows[rows.tooth == 0]
    np.testing.assert_allclose(
        longer[np.argsort(longer[:, 0])],
        [
            [0.0, first, 0.0, 3.0, 2.0 * f, 0.0, 0.0],
            [first, math.pi - first, 0.0, 3.0, f, 2.0 * e, 0.0],
            [math.pi - first, math.pi, 0.0, 3.0, 2.0 * f, 0.0, 0.0],
        ],
        atol=1e-15,
    )
    shorter = rows.rows[rows.tooth == 1]
    np.testing.assert_allclose(shorter, [[first, math.pi - first, 0.0, 3.0, f, -2.0 * e, 0.0]], atol=1e-15)


def test_a_flat_bottom_does_not_feel_runout():
    bottom = one_bite(0.0, math.tau, 0.0, 0.03, 0.0, 0.0)
    each = with_runout(bottom, replace(MILL, runout=(0.01, 0.3)))
    for j in range(4):
        np.testing.assert_allclose(thickness(each, np.linspace(0.0, 6.28, 50), j)[0], 0.03, rtol=1e-12)


def test_bites_of_one_tooth_stay_and_no_runout_is_nothing():
    whole = one_bite(0.0, 1.0, 0.05, 0.0, 0.0, 1.0)
    assert with_runout(whole, MILL) is whole
    mine = ToothEngagement(whole.start, whole.rows, [2], whole.slice, whole.slices)
    kept = with_runout(mine, replace(MILL, runout=(0.01, 0.0)))
    np.testing.assert_array_equal(kept.rows, mine.rows)
    assert kept.tooth.tolist() == [2]


@settings(max_examples=100, deadline=None)
@given(st.floats(0.0, 6.28), st.floats(0.0, 6.28), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(0.0, 0.1))
def test_the_thickest_chip(low, width, along, across, offset):
    engagement = one_bite(low, width, along, offset, across, 1.0)
    phi = low + np.linspace(0.0, width, 2001)
    h = along * np.sin(phi) + across * np.cos(phi) + offset
    assert engagement.chip_max()[0] >= max(h.max(), 0.0) - 1e-15
    assert engagement.chip_max()[0] == pytest.approx(max(h.max(), 0.0), abs=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rows": np.zeros((1, 6))}, "tooth engagement: rows of shape (1, 6): need (b, 7) finite numbers"),
        ({"slices": np.zeros((1, 6))}, "tooth engagement: slices of shape (1, 6): need (k, 7) finite numbers"),
        ({"start": [0, 2]}, "tooth engagement: 1 rows, 1 teeth, start up to 2: must agree"),
        ({"slice": [1]}, "tooth engagement: slice of shape (1,): need (1,) from 0 to 0"),
        (
            {"rows": [[6.5, 7.0, 0.0, 1.0, 0.1, 0.0, 0.0]]},
            "tooth engagement: row 0: 6.5 to 7 rad: must begin within 0 to 2 pi and rise by at most 2 pi",
        ),
        (
            {"rows": [[1.0, 8.0, 0.0, 1.0, 0.1, 0.0, 0.0]]},
            "tooth engagement: row 0: 1 to 8 rad: must begin within 0 to 2 pi and rise by at most 2 pi",
        ),
        ({"rows": [[1.0, 2.0, 2.0, 1.0, 0.1, 0.0, 0.0]]}, "tooth engagement: row 0: s from 2 to 1 mm: must rise"),
        ({"frame": np.eye(3)}, "tooth engagement: frame of shape (3, 3): need (1, 3, 3) finite numbers"),
        (
            {"slices": [[0.0, 5.0, 0.0, 1.0, 0.0, -0.1, 0.1]]},
            "tooth engagement: slice 0: rho = 5, lag = -0.1, rate = 0.1: must be at least 0",
        ),
    ],
)
def test_refused(change, message):
    good = {
        "start": [0, 1],
        "rows": [[1.0, 2.0, 0.0, 1.0, 0.1, 0.0, 0.0]],
        "tooth": [-1],
        "slice": [0],
        "slices": [[0.0, 5.0, 0.0, 1.0, 0.0, 0.0, 0.1]],
    }
    with pytest.raises(InputError) as err:
        ToothEngagement(**{**good, **change})
    assert str(err.value) == message
