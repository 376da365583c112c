"""The watch of a machine by its pins: an alarm that asks for it holds the feed, and the machine stands."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.control.learning import SignalKind
from chipload.control.linuxcnc.hal_client import PinValues
from chipload.control.load_watch import LoadWatch
from chipload.control.log_alignment import PredictedTorque
from chipload.control.machine_watch import ENDED_S, FeedHold, machine_samples
from chipload.errors import InputError
from synthetic_cell import EFFICIENCY, PRIOR, SIGNAL

PERIOD, IDLE_W, SPEED, TORQUE = 0.02, 200.0, 800.0, 1200.0
#: line -> (begin, end) [s] at the programmed feed; 1 and 3 are air, 2 and 4 cut
LINES = {1: (0.0, 3.0), 2: (3.0, 9.0), 3: (9.0, 11.0), 4: (11.0, 16.0)}


class Machine:
    """Moves at the feed that was sent one period before; its cut is the program's but where a line lacks stock."""

    def __init__(self, missing: int = 0, signal_ends: float = math.inf) -> None:
        self.missing, self.signal_ends, self.t, self.place, self.rng = (
            missing,
            signal_ends,
            0.0,
            0.0,
            np.random.default_rng(0),
        )
        self.sent: list[float] = []
        self.beats: list[bool] = []
        self.status: list[int] = []

    def exchange(self, feed: float, beat: bool, torque: float, status: int, s: float, limit: float) -> PinValues | None:
        self.sent.append(feed)
        self.beats.append(beat)
        self.status.append(status)
        self.t += PERIOD
        if self.t > 40.0:
            return None
        moves = feed if self.place < 16.0 else 0.0
        self.place = min(self.place + PERIOD * moves, 16.0)
        line = next(k for k, (_, end) in LINES.items() if self.place <= end)
        cuts = line in (2, 4) and line != self.missing and moves > 0.0
        power = IDLE_W + 1e-3 * cuts * TORQUE * SPEED / EFFICIENCY + self.rng.normal(0.0, 8.0)
        power = math.nan if self.t > self.signal_ends else power
        return PinValues(self.t, self.place, 0.0, 0.0, 20.0 * moves, 0.0, feed, current=power, line=line)


def watched(machine: Machine, *kinds: str) -> tuple[list[str], FeedHold]:
    """Return the codes of the alarms of a run, and the hold."""
    time = np.arange(0.1, 16.05, 0.1)
    line = np.array([next(k for k, (_, end) in LINES.items() if t <= end + 1e-9) for t in time])
    cut = np.isin(line, (2, 4)).astype(float)
    program = PredictedTorque(
        time, np.full(len(time), SPEED), 800.0 * cut, 400.0 * cut, line, np.ones(len(time), dtype=np.int64)
    )
    watch, hold, codes = LoadWatch(program, SIGNAL, PRIOR), FeedHold(kinds), []

    def tell(alarm):
        codes.append(alarm.code)
        hold.take(alarm)

    pins = machine_samples(machine, SignalKind.POWER, hold, notice=tell, clock=lambda: machine.t, sleep=lambda _: None)
    for sample in pins:
        if sample is not None:
            for alarm in watch.add(sample.time, sample.value, sample.line, sample.override):
                tell(alarm)
        hold.is_finished = watch.finished
    return codes, hold


def test_a_run_without_a_fault_keeps_its_feed() -> None:
    """The feed is 1 and the beat changes in every exchange; it ends when the machine has stood at the end for 1 s."""
    machine = Machine()
    codes, hold = watched(machine, "all")
    assert codes == []
    assert not hold.is_stopped
    assert set(machine.sent) == {1.0}
    assert all(a != b for a, b in zip(machine.beats, machine.beats[1:], strict=False))
    assert machine.t == pytest.approx(16.0 + ENDED_S, abs=3.0 * PERIOD)


@pytest.mark.parametrize("kinds", [("air",), ("all",), ("metal", "more"), ()])
def test_missing_stock_holds_the_feed_where_it_is_asked_for(kinds: tuple[str, ...]) -> None:
    """Line 4 cuts air: the machine stands within 4 s of its begin, and the feed stays 0 until HAL is gone."""
    machine = Machine(missing=4)
    codes, hold = watched(machine, *kinds)
    assert codes == ["watch-air"]
    if "air" not in kinds and "all" not in kinds:
        assert set(machine.sent) == {1.0}
        return
    assert hold.is_stopped
    assert 11.0 < machine.place < 15.0
    assert machine.t > 40.0
    held = machine.sent.index(0.0)
    assert set(machine.sent[held:]) == {0.0}
    # and still beats: HAL does not take it for a lost one
    assert machine.beats[-1] != machine.beats[-2]


def test_a_lost_signal_is_an_alarm_that_may_hold() -> None:
    machine = Machine(signal_ends=5.0)
    assert watched(machine, "signal")[0] == ["watch-signal"]
    assert machine.place == pytest.approx(5.0 + 2.0, abs=0.1)
    with pytest.raises(InputError, match="--hold = aer: must be one of all, air, metal, more, tool, signal"):
        FeedHold(["aer"])
