"""Containment in swept volumes against the least height over many times of a move."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.engagement.moves._kernels import swept
from chipload.engagement.moves.stock import cutter_row
from engagement.moves.field import CUTTERS, least_height

MOVES = {
    "level": (3.0, -2.0, 0.0),
    "ramp down": (3.0, 1.0, -1.5),
    "ramp up": (-2.0, 2.0, 3.0),
    "steep": (0.3, 0.1, -4.0),
    "plunge": (0.0, 0.0, -3.0),
    "retract": (0.0, 0.0, 5.0),
    "short": (0.01, -0.02, 0.005),
    "long ramp": (60.0, 20.0, -10.0),
}


@pytest.mark.parametrize("kind", CUTTERS)
@pytest.mark.parametrize("way", MOVES)
def test_swept_is_what_lies_above_the_least_height(kind: str, way: str) -> None:
    cutter, u = CUTTERS[kind], np.array(MOVES[way])
    random = np.random.default_rng(3)
    a = np.array([1.0, 2.0, -3.0])
    b = a + u
    m, row = np.array([*a, *u]), cutter_row(cutter)
    n = 1500
    wide = row[10] + 1.0
    xy = a[:2] + random.uniform(0.0, 1.0, (n, 1)) * u[:2] + random.uniform(-wide, wide, (n, 2))
    height = least_height(cutter, a, b, xy[:, 0], xy[:, 1], 4000)
    z = np.where(np.isfinite(height), height, -3.0) + random.choice([-1.0, -0.1, -0.02, 0.02, 0.1, 1.0], n)
    found = np.array([swept(m, row, x, y, h) for x, y, h in zip(*xy.T, z, strict=True)])
    known = z > height
    # where the border of the plan lies between two times a point may be swept that no time shows
    missed = found & ~known
    assert not (known & ~found).any()
    assert missed.mean() < 0.005
    assert known.any()
    assert (~known).any()


@pytest.mark.parametrize("kind", CUTTERS)
def test_the_border_itself_is_swept(kind: str) -> None:
    """So a second pass along the first finds nothing."""
    cutter = CUTTERS[kind]
    row = cutter_row(cutter)
    m = np.array([100.0, 2.0, -3.0, 7.0, 0.0, 0.0])
    rho = np.linspace(0.0, 0.99 * row[8], 50)
    z = least_height(cutter, m[:3], m[:3], 100.0 + 0.0 * rho, 2.0 + rho, 1)
    assert all(swept(m, row, 103.0, 2.0 + r, h) for r, h in zip(rho, z, strict=True))
    assert not any(swept(m, row, 103.0, 2.0 + r, h - 1e-6) for r, h in zip(rho, z, strict=True))
