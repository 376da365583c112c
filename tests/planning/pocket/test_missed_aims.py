"""What a plan of a pocket missed: the limit of the job decides on the engagement, and what stays has a remedy."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from chipload.planning.pocket.plan import misses

WANTED_DEG = 45.0
HISTORY = {
    "engagement_max_deg": np.array([180.0, 45.0, 46.5, 44.0]),
    "x_mm": np.array([0.0, 1.0, 2.0, 3.0]),
    "y_mm": np.array([0.0, 0.0, 5.0, 0.0]),
}
ON_FRONT = np.array([False, True, True, True])  # the entry is a full slot


def stages(left_mm2: float = 0.0):
    path = SimpleNamespace(leftover_mm2=left_mm2, leftover=(), x=np.array([0.0, 7.0]), y=np.array([0.0, 8.0]))
    task = SimpleNamespace(engagement=math.radians(WANTED_DEG))
    return [SimpleNamespace(task=task, name="clearing", section=0, makes_wall=True, path=path)]


@pytest.mark.parametrize(("limit_deg", "failure"), [(0.0, True), (46.0, True), (46.6, False), (50.0, False)])
def test_an_engagement_within_the_limit_of_the_job_is_told_and_is_no_failure(limit_deg, failure):
    (found,) = misses("pocket", stages(), HISTORY, ON_FRONT, [1000.0], limit_deg)
    assert (found.code, found.x, found.y, found.failure) == ("pocket-engagement", 2.0, 5.0, failure)
    assert found.text == "engagement 46.5000 deg: must be at most 45.0000 deg"


@pytest.mark.parametrize(
    ("strategy", "remedy"),
    [
        ("pocket", 'state strategies = ["pocket", "trochoidal"], or a smaller cutter'),
        ("trochoidal", "state a smaller cutter"),
    ],
)
def test_what_is_not_cleared_has_a_remedy(strategy, remedy):
    (found,) = misses(strategy, stages(10.0), HISTORY, ~ON_FRONT & False, [1000.0], 0.0)
    assert (found.code, found.x, found.y, found.failure) == ("pocket-uncleared", 7.0, 8.0, True)
    assert found.text == f"only 99.00% of what the cutter can reach is cleared, 10 mm2 left: {remedy}"
    assert misses(strategy, stages(4.0), HISTORY, ~ON_FRONT & False, [1000.0], 0.0) == []
