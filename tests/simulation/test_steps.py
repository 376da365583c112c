"""Steps of a program against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.program.build import dwell, plunge, rapid, rows
from chipload.program.program import ARC_CCW, DWELL, LINE, Program
from chipload.simulation.steps import number_of_steps, steps_in_blocks, steps_of


def five_axis(p: list[list[float]], a: list[list[float]], feed: float = 10.0, motion: int = LINE) -> Program:
    """Lines from place to place with the axis turning."""
    n = len(p)
    axis = np.array(a, dtype=float)
    return Program(
        motion=np.array([0] + [motion] * (n - 1)),
        p_work=np.array(p, dtype=float),
        axis=axis / np.linalg.norm(axis, axis=1)[:, None],
        centre=np.zeros((n, 3)),
        normal=np.tile([0.0, 0.0, 1.0], (n, 1)),
        turns=np.zeros(n, dtype=int),
        feed=np.array([0.0] + [feed] * (n - 1)),
        spindle=np.full(n, 100.0),
        tool=np.ones(n, dtype=int),
        line=np.arange(n),
        label=np.zeros(n, dtype=int),
        labels=("cut",),
    )


def test_the_axis_turns_evenly_along_a_great_circle() -> None:
    steps = steps_of(five_axis([[0, 0, 0], [8, 0, 0]], [[0, 0, 1], [1, 0, 1]]), 2.0, 0.01, math.radians(60))
    angle = np.arctan2(steps.a1[:, 0], steps.a1[:, 2])
    assert np.degrees(angle) == pytest.approx([11.25, 22.5, 33.75, 45.0])
    assert steps.p0[:, 0].tolist() == [0.0, 2.0, 4.0, 6.0]
    assert steps.seconds == pytest.approx([0.2] * 4)


def test_a_turn_about_the_standing_tip_is_cut_by_its_angle_and_timed_by_it() -> None:
    steps = steps_of(five_axis([[0, 0, 0], [0, 0, 0]], [[0, 0, 1], [1, 0, 1]], feed=0.5), 2.0, 0.01, math.radians(9))
    assert len(steps) == 5
    assert steps.seconds.sum() == pytest.approx(0.25 * math.pi / 0.5)


def test_an_arc_keeps_its_length_within_the_chord_and_its_time() -> None:
    arc = rows([ARC_CCW], [[-5.0, 0.0, 0.0]], (0.0, 0.0), 5.0, 0.0, 1, "cut")
    steps = steps_of(Program.join([rapid([5.0, 0.0, 0.0], 0.0, 1, "link"), arc]), 0.5, 1e-3)
    half = np.hypot(*(steps.p0 + steps.p1)[:, :2].T) / 2.0
    assert (5.0 - half).max() <= 1e-3
    assert np.hypot(steps.p1[:, 0], steps.p1[:, 1]) == pytest.approx(5.0, abs=1e-12)
    assert steps.seconds.sum() == pytest.approx(math.pi * 5.0 / 5.0, rel=1e-3)


def test_a_dwell_and_a_rapid() -> None:
    dwell = five_axis([[9, 0, 0], [9, 0, 0]], [[0, 0, 1], [0, 0, 1]], feed=2.0, motion=DWELL)
    program = Program.join([rapid([0, 0, 0], 0, 1, "a"), rapid([9, 0, 0], 800.0, 1, "a"), dwell])
    steps = steps_of(program, 5.0, 0.01)
    assert steps.rapid.tolist() == [True, True]
    assert steps.seconds.tolist() == [0.0, 0.0]


def test_a_step_of_no_length_is_refused() -> None:
    with pytest.raises(InputError, match="step_mm = 0: must be above 0"):
        steps_of(Program.join([rapid([0, 0, 0], 0, 1, "a"), plunge([9, 0, 0], 3.0, 80.0, 1, "b")]), 0.0, 0.01)


def test_times_of_rows_are_shared_by_their_steps():
    """Shares by length; what takes time without a motion goes to the step before it, the start to the first row."""
    cuts = plunge([14, 0, 0], 2.0, 80.0, 1, "b")
    parts = [rapid([[0, 0, 0], [10, 0, 0]], 0.0, 1, "a"), dwell([10, 0, 0], 0.5, 0.0, 1, "a"), cuts]
    program = Program.join(parts)
    times = np.array([0.25, 1.0, 0.5, 3.0])
    steps = steps_of(program, 5.0, 0.01, times=times)
    assert steps.duration.tolist() == pytest.approx([0.5, 0.5 + 0.25 + 0.5, 3.0])
    assert steps.seconds.tolist() == pytest.approx([0.0, 0.0, 2.0])
    some = list(steps_in_blocks(program, 5.0, 0.01, size=2, times=times))
    assert np.concatenate([s.duration for s in some]).tolist() == steps.duration.tolist()
    with pytest.raises(InputError, match=r"steps: times \(3,\): must be \(4,\)"):
        steps_of(program, 5.0, 0.01, times=times[1:])


@pytest.mark.parametrize("size", [7, 4096])
def test_the_number_of_steps_is_that_of_the_steps_that_are_made(size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines, arcs, a dwell, a rapid and turns of the axis, in blocks of rows that end anywhere."""
    monkeypatch.setattr("chipload.simulation.steps.ROWS", size)
    random = np.random.default_rng(4)
    arc = rows([ARC_CCW], [[-5.0, 0.0, 0.0]], (0.0, 0.0), 5.0, 0.0, 1, "cut")
    program = Program.join(
        [
            rapid([5.0, 0.0, 0.0], 0.0, 1, "link"),
            arc,
            dwell([-5.0, 0.0, 0.0], 2.0, 0.0, 1, "wait"),
            five_axis(random.uniform(-9.0, 9.0, (40, 3)).tolist(), random.uniform(0.2, 1.0, (40, 3)).tolist()),
        ]
    )
    for step in (0.05, 0.7, 30.0):
        assert number_of_steps(program, step, 0.01) == len(steps_of(program, step, 0.01)) > 40
