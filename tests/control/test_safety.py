"""Wrong work offsets, dead and scaled sensors, bad machine data: the machine is stopped, for a stated reason.

The machine is simulated here with its own axes, and its torque is that of the true path at its true place behind one
lag, so the controller is not asked about itself.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload.cli import app
from chipload.control import hal
from chipload.control.fuzzy import standard
from chipload.control.hal import HalJob, control, table_of
from chipload.control.hal_file import write_hal
from chipload.control.linuxcnc import hal_client
from chipload.control.linuxcnc.hal_client import PinValues
from chipload.control.linuxcnc.path import tool_path, write_path
from chipload.control.override import STATUS, STOPS, Override, Reading, Status, begin, step, stop_state
from chipload.control.plant import Fault, Loop, TorqueProfile, comparison, run
from chipload.control.spindle_model import Spindle
from chipload.errors import InputError

SPINDLE = Spindle(628.0, 5.0, 300.0, (2.0, 0.004), 0.5, 5.0, 60.0, 0.01, 0.02, 0.05)
RULES = Override(
    kind="mamdani", torque_ref=1860.0, overload=5000.0, torque_most=18e3, light=80.0, floor=0.05, cap=1.0, start=0.3,
    air_override=0.4, lost_override=0.2, lost_s=1.0,
)  # fmt: skip
FEED, ACCELERATION, PERIOD = 20.0, 500.0, 0.01
#: the five controllers that a job compares
CONTROLLERS = {**comparison(0.4, RULES), "constant_torque": (replace(RULES, kind="fixed"), True)}


def winding_path(surprise=1.3):
    """300 mm: air, a light, a heavy and two middling cuts, air; the truth is heavier from 60 to 110 mm."""
    s = np.arange(0.0, 300.25, 0.25)
    points = np.column_stack([s, 5.0 * np.sin(s / 20.0), np.zeros(len(s))])
    levels = [0, 0, 1900, 1900, 3900, 3900, 1400, 1400, 2600, 2600, 0, 0]
    depth = np.interp(s, [0, 10, 15, 60, 62, 110, 112, 200, 202, 280, 285, 300], levels)
    heavier = 1.0 + (surprise - 1.0) * np.clip(np.minimum(s - 60.0, 110.0 - s) / 10.0, 0.0, 1.0)
    model = np.column_stack([0.15 * depth, 0.85 * depth])
    return tool_path(points, np.full(len(s), FEED), model, model * heavier[:, None])


PATH = winding_path()
JOB = HalJob(PATH, RULES, standard(), "pin", SPINDLE, ACCELERATION, PERIOD, 0.0, True, 5.0, 0.5)


class Cutting:
    """Axes with a limited acceleration that follow the override along the path; the pins as a fault leaves them."""

    def __init__(self, path=PATH, offset=0.0, sensor=lambda torque: torque, change=lambda pins, k: pins, steps=6000):
        self.path, self.offset, self.sensor, self.change, self.left = path, offset, sensor, change, steps
        self.t = self.s = self.v = self.lagged = 0.0
        self.k, self.sent, self.true = 0, [], []

    def exchange(self, feed, beat, torque, status, s, limit):
        self.left -= 1
        if self.left < 0:
            return None
        most = ACCELERATION * PERIOD
        self.v += min(max(feed * FEED - self.v, -most), most)
        self.s = min(self.s + self.v * PERIOD, float(self.path.truth.s[-1]))
        if self.s == self.path.truth.s[-1]:
            self.v = 0.0
        self.t += PERIOD
        self.k += 1
        edge, cut = (
            float(np.interp(self.s, self.path.truth.s, x)) for x in (self.path.truth.edge, self.path.truth.cut)
        )
        now = edge + cut * self.v / FEED if self.v > 0.0 else 0.0
        self.lagged += (now - self.lagged) * PERIOD / 0.03
        self.true.append(now)
        self.sent.append(feed)
        at = [float(np.interp(self.s, self.path.truth.s, x)) for x in self.path.points.T]
        reading = self.sensor(1e-3 * (self.lagged + 0.01 * (self.k % 7)))
        return self.change(PinValues(self.t, at[0], at[1], at[2] + self.offset, self.v, reading, feed), self.k)


def go(job=JOB, **more):
    machine, told = Cutting(**more), []
    record = control(
        job, machine, clock=lambda: machine.t, sleep=lambda _: None, notice=lambda why, s: told.append((why, s))
    )
    return record, machine, told


def controlled(name):
    override, modelled = CONTROLLERS[name]
    return replace(JOB, override=override, modelled=modelled)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_sound_machine_is_not_stopped(name):
    record, _, told = go(controlled(name))
    assert record.ended == "path"
    assert told == []
    assert not set(record.column("status").astype(int)) & {STATUS.index(x) for x in STOPS}


@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ({"offset": 50.0}, "off-path"),
        ({"sensor": lambda torque: 0.0}, "low-reading"),
        ({"sensor": lambda torque: 0.1 * torque}, "low-reading"),
        ({"sensor": lambda torque: math.nan}, "no-reading"),
    ],
    ids=["work offset", "zero", "a tenth", "nan"],
)
def test_a_fault_stops_the_machine(name, fault, reason):
    """Each controller: standing, for good, with the reason, before the torque comes near what is held."""
    record, machine, told = go(controlled(name), steps=1000, **fault)
    assert record.ended == reason
    assert [str(why) for why, _ in told] == [reason]
    assert machine.v == 0.0
    after = int(np.flatnonzero(np.array(machine.sent) == 0.0)[1])
    assert set(machine.sent[after:]) == {0.0}
    assert max(machine.true) < 0.7 * RULES.torque_ref
    assert machine.s < 40.0


def test_off_the_path_nothing_rises():
    """In the air beside the path too: at most the override of the start, with which a cut is met."""
    path = winding_path()
    air = tool_path(path.points, np.full(len(path.points), FEED), np.zeros((len(path.points), 2)))
    record, machine, _ = go(replace(JOB, path=air), path=air, offset=50.0, steps=500)
    assert record.ended == "gone"
    assert max(machine.sent) == RULES.start


def test_off_the_path_it_falls_to_the_start():
    """From the programmed feed in the air, at slew_down: (1 - 0.3) / 5 s."""
    state, sent = begin(RULES, modelled=True), 0.0
    for k in range(200):
        sent, _, state = step(RULES, standard(), state, Reading(k % 2, 0.01, predicted=0.0, model=1.0))
    assert sent == 1.0
    for k in range(15):
        sent, _, state = step(RULES, standard(), state, Reading(k % 2, 0.01, predicted=0.0, model=1.0, off_path=True))
    assert sent == pytest.approx(RULES.start)


def test_a_fault_in_the_middle_of_a_cut():
    """A sensor that dies at its heaviest cut: the torque falls from there on, the stop comes within low_steps."""
    died = []

    def sensor(torque):
        died.extend([machine.k] if not died and machine.s > 80.0 else [])
        return 0.0 if died else torque

    machine = Cutting(sensor=sensor)
    record = control(JOB, machine, clock=lambda: machine.t, sleep=lambda _: None)
    assert record.ended == "low-reading"
    stop = int(np.flatnonzero(record.column("status") == STATUS.index(Status.LOW_READING))[0])
    assert stop - died[0] <= RULES.low_steps + 10
    assert max(machine.true[died[0] :]) <= max(machine.true[: died[0]])


@pytest.mark.parametrize("column", ["time", "x", "velocity"])
@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_machine_data_that_is_no_number(column, bad):
    """Its own reason; the record has the rows up to the end, as CSV too."""
    record, machine, told = go(
        change=lambda pins, k: pins._replace(**{column: bad}) if k == 200 else pins, steps=300
    )  # fmt: skip
    assert record.ended == "machine-data"
    assert told[0][0] == Status.MACHINE_DATA
    assert len(record.rows) == 300
    assert set(machine.sent[201:]) == {0.0}
    assert len(table_of(record).splitlines()) == 301


def test_time_that_runs_backwards():
    record, _, _ = go(change=lambda pins, k: pins._replace(time=pins.time - 5.0) if k == 200 else pins, steps=300)
    assert record.ended == "machine-data"


def test_a_jump_in_time_is_a_start(monkeypatch):
    """10^6 s: the simulated spindle begins anew instead of being summed over it; the override starts again."""
    summed = []
    real = hal.advance
    monkeypatch.setattr(hal, "advance", lambda *x: summed.append(x[4]) or real(*x))
    record, _, _ = go(change=lambda pins, k: pins._replace(time=pins.time + 1e6 * (k >= 200)))
    assert record.ended == "path"
    assert max(summed) <= RULES.timeout_s
    jumped = record.rows[199]
    assert STATUS[int(jumped[7])] == "settling"
    assert jumped[3] <= RULES.start


def test_the_command_ends_with_the_reason(tmp_path, monkeypatch):
    """Exit code 3, the reason at once and at the end, and the CSV of all steps."""
    (tmp_path / "path.csv").write_text(write_path(PATH))
    (tmp_path / "hal.toml").write_text(write_hal(JOB, "path.csv"))

    class Pins(Cutting):
        def __init__(self, name, python, sources):
            super().__init__(change=lambda pins, k: pins._replace(velocity=math.nan) if k > 20 else pins, steps=40)

        def __enter__(self):
            return self

        def __exit__(self, *_):
            return None

    monkeypatch.setattr(hal_client, "HalPins", Pins)
    out = tmp_path / "out.csv"
    done = CliRunner().invoke(app, ["hal", str(tmp_path / "hal.toml"), "--out", str(out)])
    assert done.exit_code == 3, done.output
    assert "machine stopped: machine-data at" in done.stderr
    assert "40 steps, ended: machine-data" in done.stdout
    assert len(out.read_text().splitlines()) == 41


@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.parametrize(("kind", "value"), [("value", 0.0), ("scaled", 0.1)])
def test_sensor_faults_in_the_simulated_loop(name, kind, value):
    """In the plant, from the start and from the middle of a cut: stopped, and never above the sound run's torque."""
    override, modelled = CONTROLLERS[name]
    truth, model = PATH.truth, PATH.model
    loop = Loop(ACCELERATION)
    sound = run(truth, model if modelled else None, override, standard(), SPINDLE, loop, 2e3, monitor=model)
    assert sound.ended == "path"
    for begun in (0.0, 3.0):
        found = run(
            truth, model if modelled else None, override, standard(), SPINDLE, loop, 2e3,
            Fault(kind, begun, 1e9, value), monitor=model,
        )  # fmt: skip
        assert found.ended == "low-reading"
        assert found.feed[-1] == 0.0
        assert found.torque_max <= max(sound.torque_max, RULES.torque_ref)


@pytest.mark.parametrize("kind", ["pi", "mamdani"])
def test_an_unconnected_pin_where_nothing_is_predicted(kind):
    """Exactly 0 while the machine moves is a value that is stuck."""
    found = run(
        PATH.truth, None, replace(RULES, kind=kind), standard(), SPINDLE, Loop(ACCELERATION), 2e3,
        Fault("value", 0.0, 1e9, 0.0),
    )  # fmt: skip
    assert found.ended == "no-reading"


def test_air_is_not_a_dead_sensor():
    """Readings about 0 where nothing is predicted to be cut, for a minute; and 0 exactly."""
    for reading in (0.0, 5.0):
        state = begin(RULES, modelled=True)
        for k in range(6000):
            torque = reading * math.sin(k)
            _, status, state = step(RULES, standard(), state, Reading(torque, 0.01, predicted=0.0, model=0.9))
        assert status == "air"


def test_a_dead_sensor_in_short_cuts_is_seen():
    """Cuts of 0.2 s with as much air between them: the air does not take the count back."""
    state, status = begin(RULES, modelled=True), Status.RUN
    for k in range(400):
        predicted = 900.0 if k // 20 % 2 else 0.0
        _, status, state = step(RULES, standard(), state, Reading(0.0, 0.01, predicted=predicted, model=0.9))
    assert status == Status.LOW_READING


def test_a_stop_is_final():
    state = stop_state(begin(RULES), Status.OFF_PATH)
    for _ in range(10):
        sent, status, state = step(RULES, standard(), state, Reading(500.0, 0.01))
        assert (sent, status) == (0.0, "off-path")
    with pytest.raises(
        InputError, match="reason = run: must be one of low-reading, machine-data, no-reading, off-path"
    ):
        stop_state(state, Status.RUN)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("low_share", 0.7, "override.low_share = 0.7: must be at least 0 and at most 0.666667"),
        ("low_steps", 10, "override.low_steps = 10: must be above 10"),
        ("off_path_steps", 0, "override.off_path_steps = 0: must be at least 1"),
        ("timeout_s", 60.0, "override.timeout_s = 60: must be above 0 and at most 10"),
    ],
)
def test_rules_out_of_range(name, value, message):
    with pytest.raises(InputError, match=message):
        replace(RULES, **{name: value})


def test_the_model_must_cover_the_path():
    short = TorqueProfile(PATH.model.s[:10], PATH.model.feed[:10], PATH.model.edge[:10], PATH.model.cut[:10])
    with pytest.raises(InputError, match=r"plant.model: from s = 0 to 2.31896 mm: must cover the path, 0 to 304.482"):
        run(PATH.truth, None, RULES, standard(), SPINDLE, Loop(ACCELERATION), 2e3, monitor=short)
