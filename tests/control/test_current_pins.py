"""The torque from pins of current and speed: the loop round a spindle of another maker, lost pins, the command."""

from __future__ import annotations

import io
import json
import math
import sys
import types
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload.cli import app
from chipload.control.fuzzy import standard
from chipload.control.hal import control
from chipload.control.hal_file import load_hal, write_hal
from chipload.control.linuxcnc import hal_client, pins
from chipload.control.linuxcnc.path import write_path
from chipload.control.override import STATUS
from chipload.control.plant import Loop, run
from chipload.control.spindle_model import AS_STATED, SpindleDeviation
from chipload.errors import InputError
from simulated_machine import ACCELERATION, FEED, JOB, PATH, PERIOD, RULES, SPINDLE, Simulated, round_path


class WithSpindle(Simulated):
    """The machine with a spindle of its own, summed in steps of 0.2 ms, that is told nothing of the estimator.

    Parameters
    ----------
    constant : real torque constant over the believed one
    change : what the pins of current and speed are made of by a fault
    """

    def __init__(self, path, constant=1.0, change=lambda current, speed, t: (current, speed), **more):
        super().__init__(path, **more)
        self.w, self.sensed, self.constant, self.change = SPINDLE.speed, 4.512, constant, change
        self.summed, self.noise, self.greatest = 4.512, np.random.default_rng(0), 0.0

    def exchange(self, feed, beat, torque, status, s, limit):
        before = self.s
        seen = super().exchange(feed, beat, torque, status, s, limit)
        if seen is None:
            return None
        kt = SPINDLE.torque_constant * self.constant
        for k in range(50):
            at = before + (self.s - before) * k / 50
            edge, cut = (np.interp(at, self.path.truth.s, x) for x in (self.path.truth.edge, self.path.truth.cut))
            load = float(edge + cut * self.v / FEED * SPINDLE.speed / self.w) if self.v > 0.0 else 0.0
            wrong = SPINDLE.speed - self.w
            drawn = 0.5 * wrong + self.summed
            self.summed += 5.0 * wrong * PERIOD / 50
            self.w += (kt * (drawn - 2.0 - 0.004 * self.w) - load) / SPINDLE.inertia * PERIOD / 50
            self.sensed += (drawn - self.sensed) * PERIOD / 50 / SPINDLE.sensor_lag
            self.greatest = max(self.greatest, load)
        current, speed = self.change(self.sensed + self.noise.normal(0.0, 0.05), self.w / math.tau, self.t)
        return seen._replace(current=current, speed=speed)


CURRENT = replace(JOB, source="current")


def go(job=CURRENT, **more):
    machine = WithSpindle(job.path, **more)
    return control(job, machine, clock=lambda: machine.t, sleep=lambda _: None), machine


def test_the_loop_closes_on_the_current():
    """As the compiled loop, whose spindle is another program: time within 1 %, torque within 3 %."""
    found, machine = go()
    wanted = run(PATH.truth, PATH.model, RULES, standard(), SPINDLE, Loop(ACCELERATION), RULES.torque_ref)
    assert found.ended == "path"
    assert machine.t == pytest.approx(wanted.time, rel=0.01)
    assert machine.greatest == pytest.approx(wanted.torque_max, rel=0.03)
    # what is measured is the torque, behind its lags
    steady = found.column("t_s") > 1.0
    error = found.column("measured_nmm") - found.column("torque_nmm")
    assert abs(error[steady].mean()) < 0.01 * RULES.torque_ref
    assert found.column("speed_rad_s")[steady].mean() == pytest.approx(SPINDLE.speed, rel=1e-3)


@pytest.mark.parametrize("constant", [0.8, 1.25])
def test_a_wrong_torque_constant(constant):
    """The real spindle gives more torque for a current than is believed: the true torque settles as much higher.

    The compiled loop with the deviation that says so finds the same.
    """
    path = round_path(turns=1.0, surprise=1.0)
    job = replace(JOB, path=path, source="current", modelled=False)
    found, machine = go(job, constant=constant)
    deviation = SpindleDeviation(torque_constant_percent=100.0 * (constant - 1.0))
    wanted = run(path.truth, None, RULES, standard(), SPINDLE, Loop(ACCELERATION), 1860.0, monitor=path.model,
                 deviation=deviation)  # fmt: skip
    assert found.ended == wanted.ended == "path"
    assert machine.t == pytest.approx(wanted.time, rel=0.02)
    late = (found.column("s_mm") > 90.0) & (found.column("s_mm") < 145.0)
    share = found.column("torque_nmm")[late] / found.column("measured_nmm")[late]
    # idle current is drawn at the real constant too: (c - 1) K_T I_idle is not seen
    assert np.median(share) == pytest.approx(constant, rel=0.05)


def test_the_loop_closes_on_the_power():
    """The power is torque of the current times speed: told from it the loop is the same; the other pin is refused."""
    spindle = replace(
        SPINDLE, torque_constant=1e3, idle=(0.3 * 2.0, 0.3 * 0.004), noise=0.3 * SPINDLE.noise, current_step=0.0
    )
    job = replace(JOB, spindle=spindle, source="power", identified_from="power")
    by_power, machine = go(job, change=lambda i, w, t: (0.3 * i * math.tau * w, w))
    by_current, other = go()
    assert by_power.ended == "path"
    assert machine.t == pytest.approx(other.t, rel=2e-3)
    # later the last digit moves the override by a step of it
    measured = [found.column("measured_nmm")[:70] for found in (by_power, by_current)]
    np.testing.assert_allclose(*measured, atol=1e-6)
    with pytest.raises(InputError, match="identified from its power: name the pin of that, --power-pin"):
        replace(job, source="current")


def test_a_drift_of_the_idle_current():
    """10 % a minute of 4.512 A is seen as torque that grows by 135 N mm a minute; the true torque falls behind it."""
    drifting = SpindleDeviation(idle_drift_percent_per_min=10.0)
    path = round_path(surprise=1.0)
    fixed = replace(RULES, kind="fixed", start=0.1, quantum=0.0)
    loop = Loop(ACCELERATION)
    plain, warm = (
        run(path.truth, None, fixed, standard(), SPINDLE, loop, 1860.0, monitor=path.model, deviation=d)
        for d in (AS_STATED, drifting)
    )
    t = plain.t[: len(warm.t)]
    more = warm.measured[: len(t)] - plain.measured[: len(t)]
    slope = np.polyfit(t[t > 2.0], more[t > 2.0], 1)[0]
    assert 60.0 * slope == pytest.approx(0.1 * 4.512 * SPINDLE.torque_constant, rel=0.05)


def frozen():
    """The current of 2 s from then on."""
    kept = []

    def change(current, speed, t):
        if t > 2.0 and not kept:
            kept.append(current)
        return (kept[0] if kept else current), speed

    return change


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (frozen(), "no-reading"),
        (lambda i, w, t: (math.nan, w) if t > 2.0 else (i, w), "no-reading"),
        (lambda i, w, t: (i, math.nan) if t > 2.0 else (i, w), "no-reading"),
        (lambda i, w, t: (0.0, w) if t > 2.0 else (i, w), "no-reading"),
        (lambda i, w, t: (i + 50.0, w) if t > 2.0 else (i, w), "overload"),
    ],
)
def test_pins_that_fail(change, reason):
    """A current that stays or is missing, no speed, an unconnected pin, far too much: the machine stops, says why."""
    found, _ = go(change=change, gone_after=1500)
    assert found.ended == reason
    assert found.column("override")[-1] == 0.0
    assert found.column("torque_nmm").max() < 1.1 * RULES.torque_ref


@pytest.mark.parametrize(("factor", "rises"), [(1.0, True), (1.2, False), (0.8, False)])
def test_a_speed_that_was_not_identified(factor, rises):
    """20 % off its speed nothing rises: the idle map says nothing there, even where it would be the same."""
    job = replace(CURRENT, spindle=replace(SPINDLE, idle=(4.512, 0.0)))
    found, _ = go(job, change=lambda i, w, t: (i, factor * w), gone_after=300)
    assert ("run" in {STATUS[int(k)] for k in found.column("status")[20:]}) == rises
    assert (np.diff(found.column("override")[20:]).max() > 0.0) == rises


def test_the_command(tmp_path, monkeypatch):
    """--current-pin and --speed-pin are what HAL is asked for; a deviation comes back from its file; both or none."""
    (tmp_path / "path.csv").write_text(write_path(PATH))
    deviation = SpindleDeviation(torque_constant_percent=5.0, idle_drift_percent_per_min=2.0)
    (tmp_path / "hal.toml").write_text(write_hal(replace(JOB, deviation=deviation), "path.csv"))
    assert load_hal(tmp_path / "hal.toml").deviation == deviation
    asked = {}

    class Pins(WithSpindle):
        def __init__(self, name, python, sources):
            asked.update(sources)
            super().__init__(PATH, gone_after=40)

        def __enter__(self):
            return self

        def __exit__(self, *_):
            return None

    monkeypatch.setattr(hal_client, "HalPins", Pins)
    words = ["hal", str(tmp_path / "hal.toml"), "--out", str(tmp_path / "log.csv"), "--current-pin", "vfd.current"]
    named = ["--speed-pin", "spindle.0.speed-in", "--spindle-override-pin", "halui.spindle.0.override.value"]
    done = CliRunner().invoke(app, [*words, *named])
    assert done.exit_code == 3
    assert "ended: gone" in done.stdout
    assert asked == {
        "current-in": "vfd.current", "speed-in": "spindle.0.speed-in",
        "spindle-override-in": "halui.spindle.0.override.value",
    }  # fmt: skip
    head = (tmp_path / "log.csv").read_text().splitlines()[0].split(",")
    assert {"t_s", "current_a", "speed_rad_s"} <= set(head)
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 2
    assert "--speed-pin: missing: state it with --current-pin" in done.stderr


def test_pins_of_others_are_read_by_name(monkeypatch, capsys):
    """Against a stand-in for LinuxCNC's module: the named pins are read, not the component's own."""

    class Component(dict):
        def __init__(self, name):
            super().__init__()
            self.name = name

        def newpin(self, name, kind, way):
            self[name] = 0.0

        def ready(self):
            pass

        exit = ready

    fake = types.ModuleType("hal")
    fake.component, fake.HAL_FLOAT, fake.HAL_BIT, fake.HAL_S32, fake.HAL_IN, fake.HAL_OUT = Component, 1, 2, 3, 4, 5
    fake.get_info_signals = list
    fake.new_sig = fake.connect = lambda *_: None
    fake.get_value = {"vfd.current": 7.5, "spindle.0.speed-in": 100.0}.__getitem__
    monkeypatch.setitem(sys.modules, "hal", fake)
    monkeypatch.setattr(pins.signal, "signal", lambda *_: None)
    first = {
        "name": "c", "pins": [["feed", "float", "out"], ["x", "float", "in"], ["current-in", "float", "in"]],
        "signals": {}, "sources": {"current-in": "vfd.current"},
    }  # fmt: skip
    monkeypatch.setattr(sys, "stdin", io.StringIO(json.dumps(first) + "\n0.5\n"))
    pins.main()
    ready, answer = capsys.readouterr().out.splitlines()
    assert ready == "ready"
    assert [float(x) for x in answer.split()][1:] == [0.0, 7.5]
