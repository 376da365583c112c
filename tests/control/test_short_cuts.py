"""Cuts that are shorter than the blocks of the watch: windows that begin and end in the air, and their alarms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chipload.control.load_watch import LoadWatch
from chipload.control.log_alignment import PredictedTorque
from chipload.control.short_cuts import short_cuts
from synthetic_cell import PRIOR, SIGNAL, draw_truth
from synthetic_stream import alarms_of, stream, without_cuts


def program(*steps: tuple[float, float], lines: tuple[int, ...] | None = None) -> PredictedTorque:
    """Return a program of (seconds, load) a step, each in a line of its own."""
    seconds, load = np.array(steps).T
    n = len(steps)
    line = np.arange(1, n + 1) if lines is None else np.array(lines)
    return PredictedTorque(np.cumsum(seconds), np.full(n, 800.0), load, 0.5 * load, line, np.ones(n, dtype=np.int64))


def test_a_window_is_the_cut_and_what_its_place_leaves_open() -> None:
    """Air to 2 s, a cut of 1 s that is the second half of its line, air: 0.2 s and a tenth of the time in the line."""
    one = short_cuts(program((1.0, 0.0), (1.0, 0.0), (1.0, 9.0), (5.0, 0.0), lines=(1, 2, 2, 3)), 0.5, 0.2, 0.1)
    np.testing.assert_allclose([*one.begin, *one.cut, *one.end, *one.late], [2.0 - 0.3, 2.0, 3.0 + 0.4, 0.4])
    assert not one.divided.any()


def test_a_window_is_no_shorter_than_a_block() -> None:
    one = short_cuts(program((2.0, 0.0), (0.04, 9.0), (5.0, 0.0)), 0.5, 0.1, 0.1)
    assert one.end - one.begin == pytest.approx(0.5)


def test_cuts_that_are_near_have_one_window_and_long_ones_none() -> None:
    near = program((2.0, 0.0), (0.5, 9.0), (0.2, 0.0), (0.5, 9.0), (5.0, 0.0))
    assert len(short_cuts(near, 0.5, 0.2, 0.1).begin) == 1
    apart = program((2.0, 0.0), (0.5, 9.0), (2.0, 0.0), (0.5, 9.0), (5.0, 0.0))
    assert len(short_cuts(apart, 0.5, 0.2, 0.1).begin) == 2
    # the speed is a quotient of power and torque
    rounded = replace(apart, speed=apart.speed * (1.0 + 1e-12 * np.arange(5)))
    assert len(short_cuts(rounded, 0.5, 0.2, 0.1).begin) == 2
    long = program((2.0, 0.0), (3.0, 9.0), (0.2, 0.0), (0.5, 9.0), (5.0, 0.0))
    assert len(short_cuts(long, 0.5, 0.2, 0.1).begin) == 0
    pecks = program((2.0, 0.0), *[(0.5, 9.0), (0.1, 0.0)] * 40, (5.0, 0.0))
    divided = short_cuts(pecks, 0.5, 0.2, 0.1)
    assert len(divided.begin) == 3
    assert divided.divided.all()
    np.testing.assert_allclose(divided.end[:-1], divided.begin[1:])
    # a spindle that changes its speed in the margin is not compared with one idle load
    changed = replace(apart, speed=np.array([0.0, 800.0, 800.0, 800.0, 800.0]))
    assert len(short_cuts(changed, 0.5, 0.2, 0.1).begin) == 1
    assert len(short_cuts(program((2.0, 0.0), (5.0, 0.0)), 0.5, 0.2, 0.1).begin) == 0


def test_short_cuts_are_judged() -> None:
    """Ten cells with cuts of 0.3 to 1.5 s and lines that are stated up to 0.2 s late: no alarm, most of it judged; a
    tool that breaks is found within 6 s, three cuts and the air between them. benchmarks/load_watch.py does hundreds.
    """
    for seed in range(300, 310):
        one = stream(seed, short=True)
        found, watch = alarms_of(one)
        assert found == []
        assert watch.judged_seconds > 0.6 * watch.cut_seconds
        power, begin = without_cuts(one, None)
        broken = alarms_of(one, power)[0]
        assert {f.code for f in broken} == {"watch-air"}
        assert begin < float(broken[0].text.split()[0]) < begin + 6.0


def test_a_short_cut_that_is_long_enough_is_missed_alone() -> None:
    """A cut of 1.4 s between air, whose scale is known from twenty before: that one cut of no load raises an alarm."""
    one = program((4.0, 0.0), *[(1.4, 900.0), (2.0, 0.0)] * 24)
    watch, found = LoadWatch(one, SIGNAL, PRIOR), []
    rng, factor = np.random.default_rng(0), SIGNAL.gain * 800.0
    for t in np.arange(0.0, one.time[-1], 0.05):
        row = int(np.searchsorted(one.time, t))
        torque = one.cutting[row] + one.edge[row] if row != 41 else 0.0
        found += watch.add(float(t), 2e5 + factor * torque + 2e4 * rng.standard_normal(), int(one.line[row]))
    assert [(f.code, f.line) for f in found] == [("watch-air", 42)]


def test_a_feed_that_is_held_in_a_short_cut_is_no_fault() -> None:
    """The machine stands for a minute in a cut, and in the air."""
    truth = draw_truth(np.random.default_rng(301))
    one = stream(301, truth, short=True)
    watch, found, now = LoadWatch(one.program, SIGNAL, PRIOR), [], 0.0
    stops = set(np.flatnonzero(one.cuts)[[200, 300, 400]]) | set(np.flatnonzero(~one.cuts)[[250, 350]])
    for k, (p, line) in enumerate(zip(one.power, one.line, strict=True)):
        now += 0.1
        found += watch.add(now, float(p), int(line))
        if k in stops:
            for _ in range(600):
                now += 0.1
                found += watch.add(now, one.idle, int(line), 0.0)
    assert found == []
