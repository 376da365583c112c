"""A program that begins as another one did has the columns of its own simulation, to the byte."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chipload.program.program import LINE, RAPID, Program
from chipload.simulation import chips, continued
from chipload.simulation.chips import remove
from chipload.simulation.continued import remove_from
from simulation.test_chunks import BALL, MATERIAL, ROUGH, block

FINE = replace(ROUGH, step_mm=60.0)
LEANS = np.array([0.0, 0.6, 0.8])


def passes(*depths: float) -> Program:
    """A row each, from beside the block and back above it, one pass after the other."""
    points, motion = [[-6.0, 4.0, 8.0]], [RAPID]
    for depth in depths:
        at = [[-6.0, 9.0, 8.0], [-6.0, 9.0, -depth], [-1.0, 9.0, -depth], [1.0, 9.0, -depth - 0.2], [1.0, 9.0, 8.0]]
        points += at
        motion += [RAPID, RAPID, LINE, LINE, RAPID]
    n = len(points)
    kind = np.array(motion)
    return Program(
        motion=kind, p_work=np.array(points), axis=np.tile(LEANS, (n, 1)), centre=np.zeros((n, 3)),
        normal=np.tile([0.0, 0.0, 1.0], (n, 1)), turns=np.zeros(n, int), feed=np.where(kind == LINE, 10.0, 0.0),
        spindle=np.full(n, 300.0), tool=np.full(n, 2), line=np.arange(1, n + 1), label=np.zeros(n, int), labels=("x",),
    )  # fmt: skip


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    for module in (chips, continued):
        monkeypatch.setattr(module, "block_of", lambda setting: 4)


@pytest.mark.parametrize(("other", "alike"), [((1.0, 2.0, 3.5), 10), ((1.0, 2.0, 3.0), 14), ((0.5, 2.0, 3.0), 0)])
def test_the_columns_are_those_of_its_own_simulation(other, alike):
    first, program = passes(1.0, 2.0, 3.0), passes(*other)
    times = np.linspace(0.0, 1.0, len(program))
    known = remove_from(None, first, block(), {2: BALL}, MATERIAL, FINE, times)
    # up to the row that goes down to another depth
    assert known.steps_alike(program, times, FINE) == alike
    stock, own = block(), block()
    found = remove_from(known, program, stock, {2: BALL}, MATERIAL, FINE, times).removal
    whole = remove(program, own, {2: BALL}, MATERIAL, FINE, keep=True, accuracy=False, times=times)
    assert list(found.columns) == list(whole.columns)
    for name, values in whole.columns.items():
        assert found.columns[name].tobytes() == values.tobytes(), name
    assert found.findings == whole.findings
    for a, b in zip(found.cuts, whole.cuts, strict=True):
        assert a.step.tobytes() == b.step.tobytes()
        assert a.engagement.rows.tobytes() == b.engagement.rows.tobytes()
        assert a.plain.slices[a.plain.slice].tobytes() == b.plain.slices[b.plain.slice].tobytes()
    assert whole.columns["chip_areas"].any()


def test_what_differs_is_simulated():
    """A time, a feed or the resolution of the slices: nothing is taken from the other program."""
    program = passes(1.0, 2.0)
    times = np.ones(len(program))
    known = remove_from(None, program, block(), {2: BALL}, MATERIAL, FINE, times)
    assert known.steps_alike(program, times, FINE) == 9
    assert known.steps_alike(program, times, replace(FINE, step_mm=50.0)) == 9
    assert known.steps_alike(program, 2.0 * times, FINE) == 0
    assert known.steps_alike(replace(program, feed=2.0 * program.feed), times, FINE) < 4
    assert known.steps_alike(program, times, replace(FINE, corner_slices=5)) == 0
    # rows that the shorter longest step divides
    assert known.steps_alike(program, times, replace(FINE, step_mm=6.0)) < 4
