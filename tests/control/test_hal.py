"""The controller beside a machine: its path, its spindle, its loop, against the loop that simulates all of it."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import fields, replace

import numpy as np
import pytest

from chipload.control.fuzzy import additive, standard, write_fuzzy
from chipload.control.hal import control
from chipload.control.hal_file import load_hal, write_hal
from chipload.control.linuxcnc.hal_client import HalPins
from chipload.control.linuxcnc.path import locate, read_path, tool_path, write_path
from chipload.control.linuxcnc.simulated_spindle import Load, advance, at_speed, measure
from chipload.control.override import STATUS, allowed_override, begin
from chipload.control.plant import Loop, run
from chipload.errors import InputError
from simulated_machine import ACCELERATION, FEED, JOB, PATH, PERIOD, RULES, SPINDLE, Simulated, round_path


def go(job=JOB, **more):
    machine = Simulated(job.path, **more)
    return control(job, machine, clock=lambda: machine.t, sleep=lambda _: None), machine


def test_a_place_on_a_helix():
    """Of two rounds 0.5 mm apart the one within the window; a point beside the path is as far as it is."""
    two = round_path(turns=2.0)
    once = math.tau * 25.0
    for s in (3.0, 80.0, once + 3.0):
        p = [np.interp(s, two.model.s, x) for x in two.points.T]
        found, away = locate(two, p, s - 1.0, 5.0)
        assert found == pytest.approx(s, abs=1e-9)
        assert away < 1e-9
    # the same points twice: the round is known by the window alone
    again = tool_path(np.vstack([PATH.points, PATH.points[::-1][1:]]), np.full(2 * len(PATH.points) - 1, FEED),
                      np.zeros((2 * len(PATH.points) - 1, 2)))  # fmt: skip
    whole = float(PATH.model.s[-1])
    p = [np.interp(100.0, PATH.model.s, x) for x in PATH.points.T]
    assert locate(again, p, 98.0, 5.0)[0] == pytest.approx(100.0, abs=1e-9)
    assert locate(again, p, 2.0 * whole - 103.0, 5.0)[0] == pytest.approx(2.0 * whole - 100.0, abs=1e-9)
    # in the middle of a chord: nearest place by brute force
    p = np.array([20.0, 13.0, -0.1])
    fine = np.linspace(0.0, 40.0, 400_001)
    cloud = np.column_stack([np.interp(fine, two.model.s, x) for x in two.points.T])
    d = np.linalg.norm(cloud - p, axis=1)
    found, away = locate(two, p, 15.0, 20.0)
    assert found == pytest.approx(fine[d.argmin()], abs=2e-4)
    assert away == pytest.approx(d.min(), abs=1e-6)


def test_a_path_through_its_file(tmp_path):
    file = tmp_path / "path.csv"
    file.write_text(write_path(PATH))
    back = read_path(file)
    assert back.points == pytest.approx(PATH.points, abs=1e-6)
    assert back.truth.cut == pytest.approx(PATH.truth.cut, rel=1e-7)
    assert back.model.feed == pytest.approx(PATH.model.feed)
    file.write_text("x_mm,y_mm,z_mm,feed_mm_min,edge_nm\n")
    with pytest.raises(InputError, match="column cut_nm is missing"):
        read_path(file)
    file.write_text("x_mm,y_mm,z_mm,feed_mm_min,edge_nm,cut_nm\n0,0,0,600,0,1\n1,0,0,six,0,1\n")
    with pytest.raises(InputError, match="line 3: feed_mm_min: must be a number"):
        read_path(file)


def test_the_spindle_of_a_real_machine_follows_the_simulated_one():
    """The same loads in time: torque and speed as in the compiled loop."""
    quiet = replace(SPINDLE, noise=0.0)
    loop = Loop(ACCELERATION, period=0.001)
    path = round_path(surprise=1.0)
    found = run(path.truth, None, replace(RULES, kind="fixed", start=0.5, quantum=0.0), standard(), quiet, loop, 2e3)
    share = found.feed / FEED
    edge = np.interp(found.s, path.truth.s, path.truth.edge)
    cut = np.interp(found.s, path.truth.s, path.truth.cut) * share
    wheel, speed, measured = at_speed(quiet), [], []
    for k in range(1, len(found.t)):
        # a row of the loop has the torque of the step before it
        now = Load(float(edge[k] if share[k] > 0 else 0.0), float(cut[k]))
        wheel, _ = advance(quiet, wheel, (now, now), (now, now), 0.001, 0.001)
        wheel = measure(quiet, wheel, 0.0, 0.001)
        speed.append(wheel.speed)
        measured.append(wheel.filtered)
    assert np.abs(np.array(speed) - found.speed[1:]).max() < 2e-3 * SPINDLE.speed
    assert np.abs(np.array(measured) - found.measured[1:]).max() < 0.01 * found.measured.max()


def test_the_spindle_settles_at_the_torque():
    """Held speed: what is measured is the torque; what is expected is the model's."""
    wheel, load, light = at_speed(SPINDLE), Load(300.0, 700.0), Load(200.0, 400.0)
    for _ in range(1000):
        wheel, most = advance(SPINDLE, wheel, (load, load), (light, light), 0.01, 0.001)
        wheel = measure(SPINDLE, wheel, 0.0, 0.01)
    assert wheel.filtered == pytest.approx(1000.0, rel=1e-5)
    assert wheel.expected == pytest.approx(600.0, rel=1e-5)
    assert most == pytest.approx(1000.0, rel=1e-5)


def test_what_the_model_allows():
    """A step ahead: (q T_ref - edge) / cut there, more by what can be slewed off until then."""
    s = np.array([0.0, 49.0, 50.0, 100.0])
    cut = np.array([1000.0, 1000.0, 3720.0, 3720.0])
    columns = (s, np.full(4, FEED), np.zeros(4), cut)
    rules = replace(RULES, start=1.0, air_override=1.0)
    state = begin(rules, modelled=True)
    assert allowed_override(rules, state, columns, 60.0, 0.5, 0.0, 500.0)[0] == pytest.approx(0.5)
    # 1 mm at 20 mm/s are 0.05 s, of which 0.03 are latency; it falls 5 a second
    most, row = allowed_override(rules, state, columns, 49.0, 1.0, 0.03, 500.0)
    assert most == pytest.approx(0.5 + 5.0 * 0.02)
    assert row == 1
    assert allowed_override(rules, state, columns, 10.0, 1.0, 0.03, 500.0)[0] == 1.0
    with pytest.raises(InputError, match="latency = 0 s: must be above 0 while nothing moves"):
        allowed_override(rules, np.zeros_like(state), columns, 10.0, 0.0, 0.0, 500.0)


def test_the_loop_is_the_simulated_one():
    """A machine that accelerates as the plant does: time within 1 %, torque within 3 % of the compiled loop."""
    found, machine = go()
    wanted = run(PATH.truth, PATH.model, RULES, standard(), SPINDLE, Loop(ACCELERATION), RULES.torque_ref)
    assert found.ended == "path"
    assert machine.t == pytest.approx(wanted.time, rel=0.01)
    assert found.torque_max == pytest.approx(wanted.torque_max, rel=0.03)
    # the beat changes with every step
    beats = np.array([b for _, b in machine.sent])
    assert (beats[1:] != beats[:-1]).all()
    # and the surprise is what slows it down
    same, easy = go(replace(JOB, path=round_path(surprise=1.0)))
    assert same.ended == "path"
    assert easy.t < machine.t


def test_off_the_path_it_is_air():
    """Beside the path there is no cut to be simulated, and the place stays."""

    class Aside(Simulated):
        def exchange(self, feed, beat, torque, status, s, limit):
            seen = super().exchange(feed, beat, torque, status, s, limit)
            return None if seen is None else seen._replace(z=seen.z + 1.0)

    machine = Aside(PATH, gone_after=100)
    found = control(JOB, machine, clock=lambda: machine.t, sleep=lambda _: None)
    assert found.ended == "gone"
    assert (found.column("torque_nmm") == 0.0).all()
    assert (found.column("s_mm") == 0.0).all()
    assert (found.column("away_mm") > 0.5).all()


def test_a_restart_in_the_middle():
    """The place is found anew, wherever it is; the override begins at most at its start and rises at its slew."""
    first = Simulated(PATH)
    first.s = 120.0
    found = control(JOB, first, clock=lambda: first.t, sleep=lambda _: None)
    assert found.column("s_mm")[0] == pytest.approx(120.0, abs=1e-6)
    assert found.ended == "path"
    sent = found.column("override")
    assert sent[: RULES.settle_steps - 1].max() <= RULES.start
    assert np.diff(sent).max() <= RULES.slew_up * PERIOD + RULES.quantum + 1e-12
    assert found.column("torque_nmm").max() <= 1.08 * RULES.torque_ref


def test_a_machine_that_goes_back():
    """Taken away from the path and put down before a step: what lies ahead is asked anew."""

    class Back(Simulated):
        def exchange(self, feed, beat, torque, status, s, limit):
            seen = super().exchange(feed, beat, torque, status, s, limit)
            if self.t == pytest.approx(6.0):
                self.s = 2.0
            return seen._replace(z=seen.z + 5.0) if 6.0 < self.t < 6.2 else seen

    machine = Back(PATH)
    found = control(JOB, machine, clock=lambda: machine.t, sleep=lambda _: None)
    assert found.ended == "path"
    again = np.flatnonzero(found.column("t_s") > 6.2)[0]
    assert found.column("s_mm")[again] < 10.0
    heavy = (found.column("s_mm") > 42.0) & (found.column("s_mm") < 50.0) & (np.arange(len(found.rows)) > again)
    assert found.column("torque_nmm")[heavy].max() <= 1.05 * RULES.torque_ref


def test_a_torque_from_a_pin():
    """NaN on the pin is a lost sensor: slower, then stopped; a torque above the limit slows; an overload stops."""
    pin = replace(JOB, source="pin")
    lost, _ = go(pin, gone_after=150)
    status = lost.column("status")
    assert STATUS[int(status[-1])] == "no-reading"
    assert lost.ended == "no-reading"
    assert lost.column("override")[-1] == 0.0
    assert lost.column("override")[2:].max() <= RULES.lost_override
    heavy, _ = go(pin, gone_after=150, torque=5.0)
    assert heavy.ended == STATUS[int(heavy.column("status")[-1])] == "overload"
    assert heavy.column("override")[-1] == 0.0


def test_a_stop_on_request():
    machine = Simulated(PATH)
    found = control(JOB, machine, clock=lambda: machine.t, sleep=lambda _: None, stop=lambda: machine.t > 0.3)
    assert found.ended == "asked"
    assert len(found.rows) == pytest.approx(31, abs=1)


TEXT = """
path = "path.csv"
source = "plant"
acceleration_mm_s2 = 500
period_s = 0.01
latency_s = 0.0
feed_forward = true
window_mm = 5
away_mm = 0.5
[override]
kind = "mamdani"
torque_ref_nm = 1.86
overload_nm = 4.0
torque_most_nm = 18
light_nm = 0.08
floor = 0.05
cap = 1
start = 0.3
air_override = 0.4
lost_override = 0.2
lost_s = 1
slew_down_per_s = 5
settle_steps = 5
[spindle]
speed_rpm = 6000
inertia_kg_m2 = 0.005
torque_constant_nm_a = 0.3
idle_a = [2.0, 0.004]
stiffness_a_s = 0.5
reset_a = 5
most_current_a = 60
sensor_lag_s = 0.01
smoothing_s = 0.02
noise_a = 0.05
"""


def test_a_job_from_its_file(tmp_path):
    (tmp_path / "path.csv").write_text(write_path(PATH))
    file = tmp_path / "hal.toml"
    file.write_text(TEXT)
    job = load_hal(file)
    assert job.override == RULES
    assert job.spindle == replace(SPINDLE, speed=6000.0 * math.tau / 60.0)
    assert job.period == 0.01


def test_a_job_written_and_read(tmp_path):
    """Every value comes back; another table by its file; relief and truth in the path."""
    relief = np.linspace(1.0, 2.0, len(PATH.points))
    config = replace(RULES, quantum=0.01, above_programmed=True, cap=1.2, settle_steps=7, slew_up=1.25)
    job = replace(JOB, path=replace(PATH, relief=relief), override=config, table=additive(5), latency=0.05)
    (tmp_path / "path.csv").write_text(write_path(job.path))
    (tmp_path / "table.toml").write_text(write_fuzzy(job.table))
    (tmp_path / "hal.toml").write_text(write_hal(job, "path.csv", "table.toml"))
    back = load_hal(tmp_path / "hal.toml")
    assert back.override.numbers == pytest.approx(config.numbers, rel=1e-12)
    assert back.override.above_programmed
    assert (back.latency, back.modelled, back.source) == (0.05, True, "plant")
    assert back.spindle.idle == SPINDLE.idle
    for field in fields(SPINDLE):
        if field.name != "idle":
            assert getattr(back.spindle, field.name) == pytest.approx(getattr(SPINDLE, field.name), rel=1e-12)
    for name in ("error", "change", "output", "rules"):
        np.testing.assert_array_equal(getattr(back.table, name), getattr(job.table, name))
    np.testing.assert_allclose(back.path.relief, relief, rtol=1e-8)
    np.testing.assert_allclose(back.path.truth.cut, PATH.truth.cut, rtol=1e-8)
    np.testing.assert_allclose(back.path.over_relief.cut, PATH.model.cut / relief, rtol=1e-8)


def test_a_wall_that_allows_more_is_given_more():
    """Twice the relief everywhere is twice the torque that is held: the same feeds as with twice the limit."""
    double = replace(JOB, path=replace(PATH, relief=np.full(len(PATH.points), 2.0)))
    heavy = replace(RULES, torque_ref=2.0 * RULES.torque_ref, overload=8000.0, torque_most=36e3, light=160.0)
    one, _ = go(double)
    other, _ = go(replace(JOB, override=heavy))
    np.testing.assert_allclose(one.column("override"), other.column("override"), atol=1e-9)
    assert one.torque_max > 1.5 * RULES.torque_ref


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('source = "plant"', 'source = "sensor"', "hal.source = 'sensor': must be one of plant, current, power, pin"),
        ("period_s = 0.01", "", "period_s is missing"),
        ("period_s = 0.01", "period_s = true", "period_s = True: must be a number"),
        ("period_s", "period_ms", "unknown key period_ms: the nearest known one is period_s"),
        ("torque_ref_nm", "torque_ref", "unknown key torque_ref: the nearest known one is torque_ref_nm"),
        ("overload_nm = 4.0", "", "overload_nm is missing"),
        ("overload_nm = 4.0", "overload_nm = 1.0", "override.overload = 1000: must be above 1860"),
        ("idle_a = [2.0, 0.004]", "idle_a = 2", "idle_a = 2: must be two numbers"),
        ("settle_steps = 5", "settle_steps = 5.0", "settle_steps = 5.0: must be a whole number"),
        ('kind = "mamdani"', "kind = 1", "kind = 1: must be a text"),
        ("cap = 1", "cap = 1.2", "above_programmed = true allows more"),
        ('path = "path.csv"', "path = 3", "path = 3: must be a text"),
        ("feed_forward = true", "feed_forward = 1", "feed_forward = 1: must be true or false"),
        ("away_mm = 0.5", "away_mm = 0", "hal.away = 0: must be above 0"),
    ],
)
def test_a_wrong_job(tmp_path, old, new, says):
    (tmp_path / "path.csv").write_text(write_path(PATH))
    file = tmp_path / "hal.toml"
    assert old in TEXT
    file.write_text(TEXT.replace(old, new))
    with pytest.raises(InputError, match=says.replace("(", r"\(")):
        load_hal(file)


def test_the_command(tmp_path):
    """A wrong job: one line, exit code 2, nothing written; the same without LinuxCNC's Python."""
    (tmp_path / "path.csv").write_text(write_path(PATH))
    file, out = tmp_path / "hal.toml", tmp_path / "out.csv"
    file.write_text(TEXT.replace("cap = 1", "cap = 2"))
    call = [sys.executable, "-c", "from chipload.cli import main; main()", "hal", str(file), "--out", str(out)]
    done = subprocess.run(call, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith("chipload: override.cap = 2: must be at least")
    file.write_text(TEXT)
    done = subprocess.run([*call, "--python", sys.executable], capture_output=True, text=True)
    assert done.returncode == 2
    assert "start LinuxCNC first, with its own Python" in done.stderr
    assert not out.exists()


def test_an_interpreter_without_hal():
    with pytest.raises(InputError, match="cannot be run"):
        HalPins("nobody", "/nonexistent/python")
    with pytest.raises(InputError, match=r"not taken: .*hal"):
        HalPins("nobody", sys.executable)
