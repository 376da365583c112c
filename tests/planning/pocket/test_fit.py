"""Engagement along what a pass writes, against a dense search."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.planning.pocket._fit import engagement_along
from chipload.planning.pocket._pass_steps import angle_at
from chipload.stock._planar import RIM
from chipload.stock.planar import TOUCH, PlanarStock

#: thickness [mm] of a wall that two slots leave
WALL = 0.1


@pytest.mark.parametrize("start", np.linspace(-1.2, -1.0, 9))
def test_a_thin_wall_between_two_places_is_not_missed(start: float) -> None:
    """The rim is on it along twice acos(1 - WALL) where its front has just come through, at x = -1 + WALL / 2."""
    stock = PlanarStock((-4.0, -4.0, 4.0, 4.0), 1.0)
    far = 1.0 + 0.5 * WALL
    stock.remove([[-far, -4.0, -far, 4.0], [far, -4.0, far, 4.0]])
    held = (1.0 - TOUCH, 1.0, stock.grid, stock.head, stock.link, stock.axis, np.empty((RIM, 2)))
    dense = max(angle_at(x, 0.0, 1.0, 0.0, *held) for x in np.linspace(start, start + 0.8, 4001))
    assert dense == pytest.approx(2.0 * math.acos(1.0 - WALL), abs=0.01)
    along = np.array([start, 0.0, start + 0.8, 0.0, 0.0, 0.0, 0.0])
    assert 0.7 * dense <= engagement_along(along, 0.4, math.pi, *held) <= dense + 1e-9
