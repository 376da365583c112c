"""Layers that a step may take from, against points of the stock that are within the cutter at some time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.simulation.reach import reached_layers
from chipload.simulation.steps import Steps
from chipload.stock.layers import LayeredStock

BALL = Cutter(8.0, 4, math.radians(30.0), 10.0, 32.0, 5.8e5, corner_radius=4.0)
BULL = Cutter(8.0, 4, math.radians(30.0), 10.0, 32.0, 5.8e5, corner_radius=1.0)
TAPER = Cutter(6.0, 4, math.radians(30.0), 10.0, 32.0, 5.8e5, corner_radius=1.5, taper=math.radians(5.0))


def step(p0, a0, p1, a1) -> Steps:
    a0, a1 = (np.asarray(a) / np.linalg.norm(a) for a in (a0, a1))
    zero, one = np.zeros(1, dtype=np.int64), np.ones(1)
    return Steps(np.array([p0]), np.array([p1]), a0[None], a1[None], one, one < 0.0, one, zero, zero, zero)


def wall() -> LayeredStock:
    return LayeredStock.block((0.0, 0.0, 0.0), (20.0, 3.0, 16.0), 0.8, 7.0)


def within(steps: Steps, cutter: Cutter, points: np.ndarray) -> np.ndarray:
    """Points (n, 3) that the cutter's envelope covers at one of 17 times."""
    out = np.zeros(len(points), dtype=np.bool_)
    for t in np.linspace(0.0, 1.0, 17):
        a = (1.0 - t) * steps.a0[0] + t * steps.a1[0]
        a /= np.linalg.norm(a)
        v = points - ((1.0 - t) * steps.p0[0] + t * steps.p1[0])
        s = v @ a
        away = np.linalg.norm(v - s[:, None] * a, axis=1)
        on = (s >= 0.0) & (s <= cutter.flute_length)
        out |= on & (away <= cutter.radius_at(np.where(on, s, 0.0)))
    return out


@pytest.mark.parametrize("cutter", [BALL, BULL, TAPER])
def test_no_layer_that_loses_anything_is_left_out(cutter) -> None:
    rng = np.random.default_rng(7)
    stock = wall()
    x, y = np.meshgrid(np.linspace(0.0, 20.0, 41), np.linspace(0.0, 3.0, 4))
    cut = 0
    for _ in range(30):
        p0 = rng.uniform([-6.0, -9.0, -4.0], [26.0, 12.0, 18.0])
        p1 = p0 + rng.normal(size=3) * 1.5
        a0 = rng.normal(size=3) * 0.6 + [0.0, 0.0, 1.0]
        a0[2] = abs(a0[2]) + 0.2
        made = step(p0, a0, p1, a0 / np.linalg.norm(a0) + rng.normal(size=3) * 0.03)
        found = set(reached_layers(made, [0], [np.arange(stock.layers)], cutter, stock)[0].tolist())
        for i, h in enumerate(stock.heights):
            if within(made, cutter, np.column_stack([x.ravel(), y.ravel(), np.full(x.size, h)])).any():
                cut += 1
                assert i in found
    assert cut > 50


def test_a_link_beside_the_wall_reaches_nothing_and_a_row_only_its_own_layers() -> None:
    """A ball that leans by 45 degrees, its middle 4 mm + c beside the wall: c > 0 reaches no layer, c < 0 only layers
    within sqrt(4^2 - (4 + c)^2) of the middle."""
    stock, lean = wall(), np.array([0.0, 1.0, 1.0]) / math.sqrt(2.0)
    for clearance in (0.001, -0.02, -0.2):
        tip = np.array([10.0, 3.0 + 4.0 + clearance, 9.0]) - 4.0 * lean
        made = step(tip, lean, [tip[0] + 2.0, *tip[1:]], lean)
        layers = reached_layers(made, [0], [np.arange(stock.layers)], BALL, stock)[0]
        near = np.flatnonzero(np.abs(stock.heights - 9.0) <= math.sqrt(max(16.0 - (4.0 + clearance) ** 2, 0.0)))
        assert bool(len(near)) == (clearance < 0.0)
        assert set(near) <= set(layers.tolist())
        assert len(layers) <= len(near) + (2 if len(near) else 0)


def test_what_is_gone_is_not_reached() -> None:
    stock, made = wall(), step([10.0, 1.5, 8.0], [0.2, 0.1, 1.0], [12.0, 1.5, 8.0], [0.2, 0.1, 1.0])
    before = reached_layers(made, [0], [np.arange(stock.layers)], BALL, stock)[0]
    assert len(before) > 3
    gone = int(before[2])
    stock.remove(gone, stock.section(gone))
    after = reached_layers(made, [0], [np.arange(stock.layers)], BALL, stock)[0]
    assert sorted(set(before.tolist()) - set(after.tolist())) == [gone]
