"""Longer flutes that stand for the cutter's own: against points of the stock, and against the removal without them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.engagement.chips.section import cutter_numbers
from chipload.program.program import LINE, RAPID, Program
from chipload.simulation import swept_area
from chipload.simulation.chips import remove
from chipload.simulation.flute_end import in_air
from chipload.simulation.removal import Resolution
from chipload.simulation.steps import Steps
from chipload.stock.layers import LayeredStock

BALL = Cutter(8.0, 4, math.radians(30.0), 6.0, 32.0, 5.8e5, corner_radius=4.0)
FLAT = Cutter(8.0, 4, math.radians(30.0), 5.0, 32.0, 5.8e5)
TAPER = Cutter(6.0, 4, math.radians(30.0), 7.0, 32.0, 5.8e5, corner_radius=1.5, taper=math.radians(5.0))


def step(p0, a0, p1, a1) -> Steps:
    a0, a1 = (np.asarray(a) / np.linalg.norm(a) for a in (a0, a1))
    zero, one = np.zeros(1, dtype=np.int64), np.ones(1)
    return Steps(np.array([p0]), np.array([p1]), a0[None], a1[None], one, one < 0.0, one, zero, zero, zero)


def in_further_length(steps: Steps, cutter: Cutter, points: np.ndarray, top: float) -> bool:
    """Whether one of the points (n, 3) is beyond the end of the flutes and within the flank that goes on."""
    foot, slope = cutter.radius_at([cutter.flute_length])[0], math.tan(cutter.taper)
    for t in np.linspace(0.0, 1.0, 17):
        a = (1.0 - t) * steps.a0[0] + t * steps.a1[0]
        a /= np.linalg.norm(a)
        v = points - ((1.0 - t) * steps.p0[0] + t * steps.p1[0])
        w = v @ a
        away = np.linalg.norm(v - w[:, None] * a, axis=1)
        if ((w > cutter.flute_length) & (w < top) & (away <= foot + slope * (w - cutter.flute_length))).any():
            return True
    return False


@pytest.mark.parametrize("cutter", [BALL, FLAT, TAPER])
def test_no_material_is_in_the_way_of_the_further_length(cutter) -> None:
    rng = np.random.default_rng(11)
    stock = LayeredStock.block((0.0, 0.0, 0.0), (20.0, 3.0, 16.0), 0.8, 7.0)
    x, y, z = np.meshgrid(np.linspace(0.0, 20.0, 41), np.linspace(0.0, 3.0, 7), stock.heights, indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    taken = refused = 0
    for _ in range(200):
        p0 = rng.uniform([-6.0, -9.0, 0.0], [26.0, 12.0, 14.0])
        a0 = rng.normal(size=3) * 0.6 + [0.0, 0.0, 1.0]
        a0[2] = abs(a0[2]) + 0.2
        made = step(p0, a0, p0 + rng.normal(size=3) * 1.5, a0 / np.linalg.norm(a0) + rng.normal(size=3) * 0.03)
        K = cutter_numbers(cutter)
        longer, those = in_air(made, {0: range(stock.layers)}, K, stock, stock.tiles, 0.01)
        if those:
            taken += 1
            assert longer[10] > K[10]
            assert not in_further_length(made, cutter, points, float(longer[10]))
        elif longer is not K:
            refused += 1
    assert taken > 20
    assert refused > 20


def leaning_passes() -> Program:
    """Rows with a turning axis along the side of a wall, then one deep in its middle."""
    x = np.linspace(-5.0, 25.0, 11)
    rows = [(x, -1.0 - 0.4 * k, 12.5 - 2.0 * k) for k in range(4)] + [(x, 1.5, 3.0)]
    p = np.concatenate([np.column_stack([x, np.full(11, y), np.full(11, z)]) for x, y, z in rows])
    lean = np.radians(np.tile(np.linspace(40.0, 50.0, 11), 5))
    axis = np.column_stack([np.full(55, 0.02), -np.sin(lean), np.cos(lean)])
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    motion = np.where(np.arange(55) % 11 == 0, RAPID, LINE)
    up = np.tile([0.0, 0.0, 1.0], (55, 1))
    return Program(
        motion=motion, p_work=p, axis=axis, centre=np.zeros((55, 3)), normal=up, turns=np.zeros(55, dtype=int),
        feed=np.where(motion == RAPID, 0.0, 10.0), spindle=np.full(55, 300.0), tool=np.ones(55, dtype=int),
        line=np.arange(55) + 1, label=np.zeros(55, dtype=int), labels=("wall",),
    )  # fmt: skip


def test_what_is_removed_is_that_of_the_cutter_itself(monkeypatch) -> None:
    program, fine = leaning_passes(), Resolution(3.0, 0.002, 24, 2.0)
    found = []
    for own in (False, True):
        if own:
            monkeypatch.setattr(swept_area, "in_air", lambda steps, layers, K, *rest: (K, set()))
        stock = LayeredStock.block((0.0, 0.0, 0.0), (20.0, 3.0, 16.0), 0.5, 8.0)
        found.append(
            remove(
                program, stock, {1: BALL}, material_named("al7075-t6"), fine, accuracy=False, engine="layers"
            ).columns
        )
    some, known = found
    assert known["chip_volume_mm3"].sum() > 50.0
    assert known["axial_overrun_mm"].max() > 0.0  # the last row is deeper than the flutes
    for name in ("chip_volume_mm3", "force_n", "torque_nm"):
        assert np.abs(some[name] - known[name]).max() < 2e-3 * known[name].max(), name
