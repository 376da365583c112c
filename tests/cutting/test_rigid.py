"""The share of the rigid model against a tooth-by-tooth march of a cutter on a spring, and engagement by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.rigid import OF_DEPTH, OF_FEED, deflection_share
from chipload.engagement.extent import contact_height, radial_depth, tooth_feed
from chipload.engagement.tooth_engagement import engagement_of_arcs

MILL = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)


def march(mu: float, teeth: int) -> list[float]:
    """Chip over the feed of each tooth of a cutter on a spring; force balance solved by bisection, tooth by tooth."""
    out, before = [], 0.0
    for _ in range(teeth):
        low, high = 0.0, 1.0 + before
        for _ in range(200):
            x = 0.5 * (low + high)
            low, high = (x, high) if mu * (1.0 - x + before) > x else (low, x)
        out.append(1.0 - x + before)
        before = x
    return out


def test_a_soft_cutter_settles_as_the_docstring_says() -> None:
    chips = march(OF_FEED, 4)
    assert chips[0] == pytest.approx(1.0 / (1.0 + OF_FEED))
    # what is still missing shrinks by mu / (1 + mu) a tooth
    assert [1.0 - h for h in chips] == pytest.approx([(2.0 / 3.0) ** (k + 1) for k in range(4)])
    assert 1.0 - chips[3] < 0.2


@pytest.mark.parametrize(
    ("phi", "depth"), [((math.pi / 2, math.pi), 5.0), ((0.0, math.acos(0.6)), 2.0), ((0.0, math.pi), 10.0)]
)
def test_engagement_by_hand(phi: tuple[float, float], depth: float) -> None:
    engagement = engagement_of_arcs([phi[0]], [phi[1]], 0.07, MILL, 3.0)
    assert radial_depth(engagement) == pytest.approx([depth])
    assert tooth_feed(engagement) == pytest.approx([0.07])
    assert contact_height(engagement) == pytest.approx([3.0])


def test_share_is_by_the_feed_or_by_the_depth() -> None:
    wide = engagement_of_arcs([0.0], [math.pi], 0.07, MILL, 3.0)
    assert deflection_share(wide, [140.0]) == pytest.approx([1.0])
    thin = engagement_of_arcs([0.0], [math.acos(1.0 - 0.1 / 5.0)], 0.07, MILL, 3.0)
    assert deflection_share(thin, [1000.0 * OF_DEPTH * 0.1]) == pytest.approx([1.0])
    assert deflection_share(wide, [140.0], of_feed=4.0) == pytest.approx([0.5])
    assert np.isfinite(deflection_share(thin, [0.0])).all()
