"""Levels of a pocket by the form error of its walls: the choice against all choices, the errors against their parts."""

from __future__ import annotations

import math
from itertools import combinations, pairwise

import numpy as np
import pytest
import shapely

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.cutting.wall_error import wall_error_along
from chipload.planning.pocket.wall_levels import LevelCut, fewest_levels

MILL = Cutter(8.0, 3, math.radians(30.0), 16.0, 24.0, 5.8e5)
METAL = Material("metal", 767.0, 168.8, 0.0, 27.7, 26.6, 0.0, source="of this test")
FINISH = LevelCut(MILL, METAL, 0.04, 0.3, "down", math.radians(61.0), 4e-5)


@pytest.mark.parametrize("seed", range(20))
def test_no_other_choice_is_better(seed):
    """All 2^(m - 1) choices of the ends of levels, of random errors, some above the limit."""
    random = np.random.default_rng(seed)
    m = int(random.integers(2, 8))
    error = random.random((m + 1, m + 1))
    error[random.random(error.shape) < 0.4] = np.inf
    costs = []
    for count in range(m):
        for between in combinations(range(1, m), count):
            levels = list(pairwise([0, *between, m]))
            costs.append((len(levels), max(error[i, j] for i, j in levels)))
    best = min((c for c in costs if math.isfinite(c[1])), default=None)
    found = fewest_levels([-2.0 * k for k in range(m + 1)], error)
    if best is None:
        assert found is None
        return
    assert found is not None
    assert (len(found.depths), found.errors.max()) == best
    assert found.depths.sum() == pytest.approx(2.0 * m)
    ends = np.r_[0, np.cumsum(found.depths / 2.0).round().astype(int)]
    assert found.errors.tolist() == [error[i, j] for i, j in pairwise(ends)]


def test_the_greatest_constant_depth():
    """Errors that grow with the depth of a level and fall with the height where it begins."""
    heights = [-float(k) for k in range(9)]
    error = np.array([[(j - i) * (10.0 - i) if j > i else np.inf for j in range(9)] for i in range(9)])
    found = fewest_levels(heights, np.where(error <= 25.0, error, np.inf))
    assert found is not None
    assert (found.constant, found.constant_levels) == (2.0, 4)
    # 2, 3 (from -2: 24), 3 (from -5: 15)
    assert (len(found.depths), found.errors.max()) == (3, 24.0)


def test_the_engagement_on_an_inside_arc():
    """Angle of the part of a circle of R that lies ahead in a ring between r - d and r."""
    R, d, r = 4.0, 0.3, 5.0
    stock = shapely.Point(0, 0).buffer(r, 2048).difference(shapely.Point(0, 0).buffer(r - d, 2048))
    angle = np.linspace(0.0, math.pi, 20001)
    rim = shapely.points(r - R + (R - 1e-4) * np.cos(angle), (R - 1e-4) * np.sin(angle))
    engaged = float(shapely.contains(stock, rim).mean()) * math.pi
    assert FINISH.engagement_on_arc(r) == pytest.approx(engaged, abs=2e-3)
    assert FINISH.engagement_on_arc(3.0) == FINISH.engagement


def test_errors_lie_above_those_of_each_compliance():
    """Of each place alone; at the least and the greatest compliance they are the same."""
    engagement = np.array([FINISH.engagement_on_arc(r) for r in (math.inf, 5.0, math.inf, 5.0)])
    compliance = np.array([0.0, 1e-4, 2e-4, 2e-4])
    found = FINISH.errors(5.0, engagement, compliance)
    alone = [
        1e-3 * wall_error_along(
            [math.pi - e], [math.pi], [0.04], MILL, METAL, 5.0, milling="down", work_compliance=4e-5 + c
        )["form_error_um"][0]
        for e, c in zip(engagement, compliance, strict=True)
    ]  # fmt: skip
    assert (found >= np.array(alone) - 1e-12).all()
    assert found[[0, 2, 3]] == pytest.approx(np.array(alone)[[0, 2, 3]], rel=1e-9)
    assert found[1] <= 1.1 * alone[1]
