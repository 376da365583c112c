"""Borders of the contact that run askew over a slice: greatest loads against those of slices eight times as many."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.program.build import plunge, rapid
from chipload.program.program import LINE, RAPID, Program
from chipload.simulation.chips import remove
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock

BALL = Cutter(8.0, 2, math.radians(30.0), 20.0, 35.0, 6e5, corner_radius=4.0)
#: moves of a row, and from point to point and row to row [mm]
ROW, APART = 60, 0.4


def wave(rows: int) -> Program:
    """Rows there and back over a surface that rises and falls."""
    k = np.arange(ROW * rows + 1)
    row, at = k // ROW, k % ROW
    x, y = APART * np.where(row % 2 == 0, at, ROW - 1 - at), APART * row
    z = -1.5 + 0.6 * np.sin(x / 9.0 + 1.0) * np.cos(y / 8.0)
    n = len(k)
    motion = np.where(k == 0, RAPID, LINE)
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    return Program(
        motion=motion, p_work=np.column_stack([x, y, z]), axis=up, centre=np.zeros((n, 3)), normal=up,
        turns=np.zeros(n, dtype=int), feed=np.where(motion == RAPID, 0.0, 20.0), spindle=np.full(n, 1000.0),
        tool=np.ones(n, dtype=int), line=k + 1, label=np.zeros(n, dtype=int), labels=("finish",),
    )  # fmt: skip


def loads(slices: int) -> dict[str, NDArray[np.float64]]:
    stock = LayeredStock.block((-6.0, -6.0, -8.0), (APART * ROW + 6.0, 12.0, 0.0), 2.0, 32.0)
    fine = Resolution(step_mm=3.0, tolerance=0.05, corner_slices=slices, flank_mm=48.0 / slices)
    removal = remove(wave(8), stock, {1: BALL}, material_named("al7075-t6"), fine, accuracy=False, workers=1)
    return {name: np.asarray(removal.columns[name]) for name in ("force_n", "torque_mean_nm")}


def test_the_greatest_force_is_that_of_many_slices() -> None:
    """Where slices leave the material whole, one step of a hundred of this program is off by 3 %."""
    some, known = loads(24), loads(192)
    cuts = known["force_n"] > 0.2 * float(np.median(known["force_n"]))
    assert cuts.sum() > 400
    error = np.abs(some["force_n"][cuts] / known["force_n"][cuts] - 1.0)
    assert np.percentile(error, 99) < 0.02
    assert some["torque_mean_nm"].sum() == pytest.approx(known["torque_mean_nm"].sum(), rel=2e-3)


def test_a_corner_beside_a_cone() -> None:
    """Slices of the cone after the corner have one normal: the borders of the corner go on over its own arc only."""
    taper = Cutter(
        6.0, 6, math.radians(28.0), 20.0, 35.0, 6e5, corner_radius=0.6, taper=math.radians(3.4), number=1
    )  # fmt: skip
    way = [(-8.0, 0.0, -0.87), (20.0, 0.0, -0.87)]
    program = Program.join([rapid(way[:1], 300.0, 1, "link"), plunge(way[1:], 17.0, 300.0, 1, "cut")])
    forces = []
    for slices in (12, 96):
        stock = LayeredStock.block((0.0, -2.985, -5.0), (30.0, 30.0, 0.0), 2.0, 32.0)
        fine = Resolution(step_mm=2.0, tolerance=0.05, corner_slices=slices, flank_mm=48.0 / slices)
        removal = remove(program, stock, {1: taper}, material_named("al7075-t6"), fine, accuracy=False, workers=1)
        forces.append(float(np.max(removal.columns["force_n"])))
    assert forces[0] == pytest.approx(forces[1], rel=0.02)
