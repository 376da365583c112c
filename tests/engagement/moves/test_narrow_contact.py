"""A mill that comes upon the corner of a block: the contact is narrower than the samples of a circle lie apart."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.engagement.moves.stock import MoveStock

MILL = Cutter(10.0, 3, math.radians(30.0), 22.0, 30.0, 6e5)


def cut_area(x: float, ae: float) -> float:
    """Area of the block x < 0, y > 0 that the mill has cut when its axis has come from +X to x, ``ae`` beyond y = 0."""
    y = (np.arange(200_000) + 0.5) * (ae / 200_000)
    reach = np.sqrt(MILL.radius**2 - (y + MILL.radius - ae) ** 2) - x
    return float(reach.clip(min=0.0).mean() * ae)


@pytest.mark.parametrize("ae", [0.05, 0.2, 0.5])
def test_each_step_into_a_corner_removes_its_volume(ae):
    x = np.arange(2.5, -2.5, -0.5)
    p = np.column_stack([x, np.full(len(x), ae - MILL.radius), np.full(len(x), -10.0)])
    stock = MoveStock(np.array([-60.0, 0.0, -20.0]), np.array([0.0, 13.5, 0.0]), {1: MILL})
    found = stock.take(p[:-1], p[1:], np.ones(len(x) - 1, dtype=np.int64), corner_slices=24, flank_mm={1: 2.5})
    volume = np.bincount(found.step, found.volume / found.instants, len(x) - 1)
    closed = 10.0 * np.diff([cut_area(a, ae) for a in x.tolist()])
    # a step whose middle is in air is in air
    touched = np.array([cut_area(0.5 * (a + b), ae) > 0.0 for a, b in pairwise(x.tolist())])
    first = int(np.argmax(touched))
    assert closed[first] > 0.02 * closed.max()
    assert np.abs(volume - closed)[first:].max() < 0.05 * closed[first]
    assert not volume[:first].any()
