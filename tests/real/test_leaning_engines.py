"""Programs of others whose axis leans and turns: by moves against layers, which find stock and contact otherwise."""

from __future__ import annotations

import math
import os
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.machine.machine import machine_named
from chipload.program.apt.reader import read_apt_file
from chipload.program.program import LINE, RAPID, Program
from chipload.program.read import read_program
from chipload.simulation.chips import remove
from chipload.simulation.removal import Removal, Resolution
from chipload.stock.layers import LayeredStock
from layer_oracle.removal import remove_by_layers

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2].parent / "shared" / "data")) / "nc"
BOAT = DATA / "linuxcnc_5axis" / "boat-xyzac.ngc"
POINTS = DATA / "five_axis_cl_hust" / "pathdata2.txt"
pytestmark = pytest.mark.skipif(not BOAT.is_file() or not POINTS.is_file(), reason=f"no {DATA}")

MILL = Cutter(10.0, 3, math.radians(30.0), 30.0, 45.0, 580e3)
BULL = Cutter(8.0, 3, math.radians(30.0), 30.0, 45.0, 580e3, corner_radius=2.0)
ALLOY = material_named("al7075-t6")


def rows(program: Program, first: int, count: int) -> Program:
    """Some rows; the first is only where they begin."""
    some = {f.name: getattr(program, f.name)[first : first + count] for f in fields(Program) if f.name != "labels"}
    some["motion"] = np.concatenate([[RAPID], some["motion"][1:]])
    some["feed"] = np.where(some["motion"] == RAPID, 0.0, some["feed"])
    some["spindle"] = np.full(len(some["motion"]), 1000.0)
    some["tool"] = np.ones(len(some["motion"]), dtype=np.int64)
    return Program(**some, labels=program.labels)


def by_both(
    program: Program, cutter: Cutter, low: tuple[float, ...], high: tuple[float, ...]
) -> tuple[Removal, Removal]:
    """By moves, and by layers of 0.1 mm."""
    fine = Resolution(2.0, 0.002, 24, 0.1 * cutter.radius, bottom_slices=12)
    moves, layers = (LayeredStock.block(low, high, layer, 4.0 * cutter.radius) for layer in (0.5, 0.1))
    one = remove(program, moves, {1: cutter}, ALLOY, fine, accuracy=False)
    return one, remove_by_layers(program, layers, {1: cutter}, ALLOY, replace(fine, corner_slices=48))


def held(moves: Removal, layers: Removal, volume: float, force: float, first: int = 0) -> NDArray[np.bool_]:
    """Sums of the run within ``volume``, median of the steps that cut within ``force``, greatest loads from step
    ``first`` on within 5 %: layers look at the middle of a step only, and miss the end of a plunge.
    """
    assert "handed-over" not in {f.code for f in moves.findings}
    a, b = moves.columns, layers.columns
    assert a["chip_volume_mm3"].sum() == pytest.approx(b["chip_volume_mm3"].sum(), rel=volume)
    assert a["chip_volume_mm3"].sum() == pytest.approx(moves.volume_before - moves.volume_after, rel=0.02)
    both = (a["force_n"] > 0.2 * np.median(a["force_n"][a["force_n"] > 0.0])) & (b["force_n"] > 0.0)
    for name in ("force_n", "torque_nm"):
        assert np.median(np.abs(a[name][both] / b[name][both] - 1.0)) < force, name
        assert a[name][first:].max() == pytest.approx(b[name][first:].max(), rel=0.05)
    return np.asarray(both)


def test_the_boat_of_linuxcnc() -> None:
    program = read_program(BOAT, machine_named("xyzac-trunnion"), tolerance=0.01).program
    first = int(np.argmax(np.abs(program.axis - (0.0, 0.0, 1.0)).max(axis=1) > 1e-9))
    some = rows(program, first - 1, 30)
    both = held(*by_both(some, MILL, (-50.0, -27.0, -13.25), (47.0, 23.0, 0.5)), volume=0.01, force=0.15)
    assert both.sum() > 50


def test_cutter_locations_of_a_five_axis_path() -> None:
    """A bull nose 1 mm deep along points whose axis leans by 35 degrees and turns all along; it comes down its axis."""
    read = read_apt_file(POINTS, feed=10.0)[0]
    program = rows(read, 0, 60)
    begin = rows(read, 0, 1)
    begin = replace(begin, p_work=begin.p_work + 12.0 * begin.axis)
    program = Program.join([begin, replace(program, motion=np.full(60, LINE), feed=np.full(60, 10.0))])
    program = replace(program, p_work=program.p_work - program.p_work[1:].mean(axis=0))
    low, high = program.p_work[1:].min(axis=0), program.p_work[1:].max(axis=0)
    some = by_both(program, BULL, (*(low[:2] - 10.0).tolist(), -6.0), (*(high[:2] + 10.0).tolist(), 1.0))
    both = held(*some, volume=0.01, force=0.02, first=6)
    assert both.sum() > 30
