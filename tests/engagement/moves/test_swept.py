"""Containment in swept volumes against the least height over many times of a move."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutter.record import cutter_record
from chipload.engagement.moves._border import crossing_direction
from chipload.engagement.moves._sweep import from_ball, off_ball, swept
from chipload.engagement.moves.stock import MoveStock
from engagement.moves.field import BALL, CUTTERS, FLAT, least_height

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
    m, row = np.array([*a, *u]), cutter_record(cutter)[0]
    n = 1500
    wide = row["wide"] + 1.0
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
    row = cutter_record(cutter)[0]
    m = np.array([100.0, 2.0, -3.0, 7.0, 0.0, 0.0])
    rho = np.linspace(0.0, 0.99 * row["rho_to"][row["count"] - 2], 50)
    z = least_height(cutter, m[:3], m[:3], 100.0 + 0.0 * rho, 2.0 + rho, 1)
    assert all(swept(m, row, 103.0, 2.0 + r, h) for r, h in zip(rho, z, strict=True))
    assert not any(swept(m, row, 103.0, 2.0 + r, h - 1e-6) for r, h in zip(rho, z, strict=True))


@pytest.mark.parametrize("way", MOVES)
def test_a_ball_of_the_index_is_that_of_a_row(way: str) -> None:
    """Without a division, and with the reciprocals that the index keeps."""
    row, u, random = cutter_record(BALL)[0], np.array(MOVES[way]), np.random.default_rng(4)
    square = [(u[:2] ** 2).sum(), (u**2).sum()]
    moves = np.array([[1.0, 2.0, -3.0, *u, *(1.0 / s if s > 0.0 else 0.0 for s in square)]])
    for x, y, z in random.uniform(-9.0, 9.0, (500, 3)).tolist():
        known = from_ball(moves[0, :6].copy(), row["radius"][0], x, y, z)
        assert off_ball(moves, 0, row["radius"][0], x, y, z) == pytest.approx(known, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("way", ["level", "ramp down", "ramp up", "short", "long ramp"])
@pytest.mark.parametrize("cutter", [BALL, FLAT], ids=["ball", "flat"])
def test_the_border_of_a_move_on_a_circle(cutter: Cutter, way: str) -> None:
    """Against the containment of directions beside it, which halving finds."""
    stock = MoveStock(np.array([-80.0, -80.0, -30.0]), np.array([80.0, 80.0, 30.0]), {1: cutter})
    a = np.array([1.0, 2.0, -3.0])
    stock.skip(a[None], a[None] + MOVES[way], np.array([1]))
    m, row, index, random = (
        np.array([*a, *MOVES[way]]),
        cutter_record(cutter)[0],
        stock._index(),
        np.random.default_rng(6),
    )
    T, found = np.array([0.6, 0.8]), 0
    for _ in range(4000):
        px, py = a[:2] + random.uniform(-5.0, 5.0, 2) + random.uniform(0.0, 1.0) * np.array(MOVES[way][:2])
        z, rho = a[2] + random.uniform(-1.0, 4.0), random.uniform(0.3, 4.0)
        one = random.uniform(-math.pi, math.pi)
        other = one + random.uniform(-0.35, 0.35)

        def inside(psi: float, px: float = px, py: float = py, z: float = z, rho: float = rho) -> bool:
            c, s = math.cos(psi), math.sin(psi)
            return bool(swept(m, row, px + rho * (c * T[0] - s * T[1]), py + rho * (c * T[1] + s * T[0]), z))

        if inside(one) or not inside(other):
            continue
        low, high = one, other
        for _ in range(40):
            mid = 0.5 * (low + high)
            low, high = (low, mid) if inside(mid) else (mid, high)
        u, s = (math.cos(one), math.sin(one)), (math.cos(other), math.sin(other))
        dc, ds, bc, bs = crossing_direction(px, py, z, rho, T, *u, *s, 0, index)
        off = math.remainder(math.atan2(ds, dc) - low, math.tau)
        assert abs(off) < 1e-6, (off, one, other)
        assert not inside(math.atan2(bs, bc))
        found += 1
    assert found > 50
