"""The watch of a running program: false alarms of many streams without a fault, and streams with a known fault."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from chipload.control.load_watch import LoadWatch
from chipload.control.log_alignment import PredictedTorque
from chipload.control.sequential_test import SequentialTest, WatchSettings
from chipload.errors import InputError
from synthetic_cell import EFFICIENCY, PRIOR, SIGNAL, Truth, draw_truth
from synthetic_stream import FAULTS, alarms_of, stream, with_fault


def test_the_run_length_of_a_test_is_at_least_the_exponential_of_its_threshold() -> None:
    """Blocks whose mean is a itself, the worst that is allowed: 30 runs without a fault to a threshold of 5."""
    rng, lengths = np.random.default_rng(0), []
    for _ in range(30):
        test, n = SequentialTest(5.0), 0
        for n, y in enumerate(rng.standard_normal(20_000), start=1):
            if test.add((y**2 - (y - 1.0) ** 2) / 2.0, n):
                break
        lengths.append(n)
    assert np.mean(lengths) > math.exp(5.0)
    # and of a fault few blocks are needed: t / (1 / 2) and what the clipping costs
    test = SequentialTest(5.0)
    assert 6 <= next(n for n in range(100) if test.add((1.0 - 0.0) / 2.0, n)) <= 12


def test_no_false_alarm_in_50_minutes_of_cutting() -> None:
    """Streams of 25 cells: coefficients, efficiency, noise and clock drawn; 0.1 false alarms an hour are stated."""
    found, cut = [], 0.0
    for seed in range(25):
        some, watch = alarms_of(stream(seed))
        found += some
        cut += watch.cut_seconds
        assert watch.judged_seconds > 0.3 * watch.cut_seconds
    assert cut > 3000.0
    assert found == []


def test_three_means_of_air_that_are_alike_by_chance() -> None:
    """Their noise is a third of what their samples say: the first blocks of the tool would be believed too much, and a
    later cut called more load.
    """
    assert alarms_of(stream(10_544))[0] == []


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_found_where_they_are(fault: str) -> None:
    """Ten cells each: the alarm is of that kind, after the fault and within 8 s where it has a place, and alone there.
    benchmarks/load_watch.py does hundreds.
    """
    hits = 0
    for seed in range(100, 110):
        one = stream(seed, replace(draw_truth(np.random.default_rng(seed)), gain=1.0))
        made = with_fault(one, fault)
        if made is None:
            continue
        power, own = made
        found, _ = alarms_of(one, power)
        times = [float(f.text.split()[0]) for f in found if f.code == fault]
        assert times, (seed, found)
        if own is not None:
            begin = float(one.time[own][0])
            assert begin < times[0] < begin + 8.0
            if fault == "watch-air":
                assert "missing stock, or it broke before" in found[0].text
            # nothing else is said of another place
            assert {f.line for f in found} == {int(one.line[own][0])}
        hits += 1
    assert hits >= 7


def test_a_tool_that_breaks_in_a_cut() -> None:
    """One long line of a steady cut, in whose middle the load ends."""
    n = 600
    program = PredictedTorque(
        0.1 * np.arange(1.0, n + 1), np.full(n, 800.0), np.where(np.arange(n) < 50, 0.0, 800.0),
        np.where(np.arange(n) < 50, 0.0, 400.0), np.where(np.arange(n) < 50, 1, 2), np.ones(n, dtype=np.int64),
    )  # fmt: skip
    rng = np.random.default_rng(0)
    watch, found = LoadWatch(program, SIGNAL, PRIOR), []
    for k in range(n):
        load = 0.0 if k < 50 or k > 400 else 1200.0 * 800.0 / EFFICIENCY
        found += watch.add(0.1 * k, 2e5 + load + 1e4 * rng.standard_normal(), int(program.line[k]))
    assert [f.code for f in found] == ["watch-air"]
    assert "tool 1 stopped to cut in the cut: it is broken, or out of its holder" in found[0].text
    assert 40.0 < float(found[0].text.split()[0]) < 44.0


def test_a_feed_that_is_held_is_no_fault() -> None:
    """The override goes to 0 in a cut: nothing is cut, and nothing is said; at half of the feed less is expected."""
    one = stream(3, Truth(1.0, 1.0, 1.0, 0.0))
    watch, found = LoadWatch(one.program, SIGNAL, PRIOR), []
    for k, (t, p, line) in enumerate(zip(one.time, one.power, one.line, strict=True)):
        found += watch.add(float(t), float(p), int(line))
        if k == len(one.time) // 2:
            for i in range(300):
                found += watch.add(float(t) + 1e-3 * (i + 1) / 4.0, one.idle, int(line), 0.0)
    assert found == []


@pytest.mark.parametrize("jump", [-40.0, 1e9, 30.0])
def test_a_clock_that_jumps_is_followed(jump: float) -> None:
    """A clock that is set, or begins again with a new file, hides no fault after it, and is none; one sample of before
    is left out.
    """
    one = stream(104, Truth(1.0, 1.0, 1.0, 0.0))
    power, own = with_fault(one, "watch-air")
    middle = int(np.flatnonzero(own)[0]) // 2
    time = one.time + np.where(np.arange(len(one.time)) > middle, jump, 0.0)
    time[middle // 2] -= 5.0
    for values, codes in ((one.power, []), (power, ["watch-air"])):
        watch, found = LoadWatch(one.program, SIGNAL, PRIOR), []
        for t, p, line in zip(time, values, one.line, strict=True):
            found += watch.add(float(t), float(p), int(line))
        assert [f.code for f in found] == codes
        assert watch.clock.jumps == 1
        assert watch.clock.first_jump == pytest.approx((jump + 0.1, 0.1 * middle), abs=0.5)
        assert watch.clock.now == pytest.approx(one.time[-1], abs=1.0)


def test_after_a_gap_the_rest_of_the_line_is_not_judged() -> None:
    """Samples of 10 s are lost in a line that cuts for 20 s and then goes through air for 20 s: it is not a broken
    tool that the load ends 10 s before the place without the gap.
    """
    rows = np.arange(1, 451)
    load = np.where((rows > 50) & (rows <= 250), 900.0, 0.0)
    program = PredictedTorque(
        0.1 * rows, 800.0 + 0.0 * load, load, 0.5 * load, np.where(rows <= 50, 1, 2), np.ones(450, dtype=np.int64)
    )
    watch, found = LoadWatch(program, SIGNAL, PRIOR), []
    for k in (k for k in range(450) if not 100 < k < 200):
        found += watch.add(0.1 * k, 2e5 + 1.5 * load[k] * 800.0 / EFFICIENCY, int(program.line[k]))
    assert found == []
    assert watch.clock.jumps == 1


def test_settings_out_of_range() -> None:
    with pytest.raises(InputError, match="false_alarms = 0: must be above 0 and at most 100 an hour"):
        WatchSettings(false_alarms=0.0)
    with pytest.raises(InputError, match=r"wear = 1: must be above 1\.1"):
        WatchSettings(wear=1.0)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda t, p, line: (t, p, line + 1000), r"100 % of the samples are of a line that the program does not have"),
        (lambda t, p, line: (1e3 * t, p, line), r"are 100 s apart, at most 0\.25 s is.* unit of the time"),
        (lambda t, p, line: (t, 1e3 * p, line), "idle load is .* times .*: check the unit of the signal"),
        (lambda t, p, line: (t[:0], p, line), "no sample was read"),
        (lambda t, p, line: (t, 2e5 + 1e7 * (-1.0) ** np.arange(len(p)), line), "no cut is well above the noise"),
    ],
)  # fmt: skip
def test_why_nothing_could_be_judged(change, text: str) -> None:
    """A log of another program, of a clock or a power in other units, an empty one, and one of noise."""
    one = stream(3)
    watch = LoadWatch(one.program, SIGNAL, PRIOR)
    for t, p, line in zip(*change(one.time, one.power, one.line), strict=False):
        watch.add(float(t), float(p), int(line))
    assert watch.judged_seconds == 0.0
    assert re.search(text, watch.why_not_judged)


def test_idle_load_that_is_not_known() -> None:
    """The program cuts from its begin."""
    rows = np.arange(1.0, 100.0)
    program = PredictedTorque(
        0.1 * rows, 800.0 + 0.0 * rows, 900.0 + 0.0 * rows, 300.0 + 0.0 * rows, np.ones(99, int), np.ones(99, int)
    )
    watch = LoadWatch(program, SIGNAL, PRIOR)
    for t in np.arange(0.0, 9.0, 0.1):
        watch.add(float(t), 1e6, 1)
    assert watch.why_not_judged == (
        "the idle load is not known: 1.5 s of air at the speed of the cut are needed before it"
    )
