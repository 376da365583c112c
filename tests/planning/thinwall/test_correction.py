"""Corrections of forces: which contact points a place takes, and what a plan does with them, by formula."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chipload.errors import InputError
from chipload.planning.thinwall.blank import FinishSurface
from chipload.planning.thinwall.correction import greatest_ratios
from chipload.planning.thinwall.depth import DepthRange
from chipload.planning.thinwall.force_table import ForceTable
from chipload.planning.thinwall.passes import constant, least_first_depth, variable
from chipload.planning.thinwall.threshold import modelled

#: F = 100 N/mm d from 0.01 to 1 mm
STRAIGHT = ForceTable(DepthRange(0.01, 1.0), np.array([0.01, 1.0]), np.array([1.0, 100.0]))
X, Y = np.meshgrid(np.linspace(0.0, 4.0, 9), np.linspace(0.0, 2.0, 5), indexing="ij")
POINTS = np.stack([X, Y, 0.0 * X], axis=-1)
SURFACE = FinishSurface(POINTS, np.broadcast_to([0.0, 0.0, 1.0], POINTS.shape), 0.6)


def bears(left, side):
    """30 N everywhere."""
    return modelled(np.full(X.size, 0.05 / 30.0), 0.05)


def test_every_point_reaches_all_places_whose_depth_it_has_a_part_in():
    """Points on rows: of a point between two places along u both take it, of its row alone."""
    rng = np.random.default_rng(3)
    u, v = np.array([0.0, 0.2, 0.5, 1.0]), np.array([0.1, 0.4, 0.6, 1.0])
    row, at, ratio = rng.integers(0, 3, 60), rng.uniform(0.0, 1.0, 60), rng.uniform(0.5, 1.5, 60)
    expected = np.full((4, 4), -np.inf)
    for j, x, r in zip(row, at, ratio, strict=True):
        for i in range(4):
            hat = np.interp(x, u, np.eye(4)[i])  # the share of place i in the depth at x
            expected[i, j] = max(expected[i, j], r) if hat > 0.0 else expected[i, j]
    got = greatest_ratios((u, v), at, v[row], ratio)
    assert np.isnan(got[:, 3]).all()
    assert_allclose(got[:, :3], expected[:, :3])


def test_depths_are_those_of_the_corrected_force():
    """c = 1.5 at one edge, 0.75 at the other: 100 c d <= 30 N, the whole wall in passes of 0.2 and of 0.4 mm."""
    c = np.broadcast_to(np.linspace(1.5, 0.75, 9)[:, None], X.shape)
    plan = variable([SURFACE], bears, STRAIGHT, 10.0, corrections=[c])
    last = plan.passes[-1]
    assert_allclose(last.depth, 0.3 / c, rtol=1e-9)
    assert_allclose(last.force, 30.0, rtol=1e-9)
    assert plan.holds
    assert len(plan.passes) == 3
    assert plan.deflection_max == pytest.approx(0.05)
    assert_allclose(last.correction, c)
    assert least_first_depth([SURFACE], bears, STRAIGHT, [c]) == pytest.approx(0.2)
    even = constant([SURFACE], bears, STRAIGHT, 0.3, corrections=[c])
    assert not even.holds
    assert even.force_max == pytest.approx(45.0)


def test_refused():
    with pytest.raises(InputError, match="must be above 0 at all places"):
        constant([SURFACE], bears, STRAIGHT, 0.3, corrections=[np.zeros(X.shape)])
