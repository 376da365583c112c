"""``chipload learn``: logs whose power is that of the same program simulated with other coefficients."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import partial
from hashlib import sha256

import numpy as np
import pytest

from chipload import jobs
from chipload.control import machine_watch
from chipload.control.linuxcnc import hal_client
from chipload.control.linuxcnc.hal_client import PinValues
from chipload.control.logs import read_log
from chipload.cutting.learned import LearnedRecord, LogEvidence
from chipload.cutting.material import knowledge_text, material_named, material_text, read_material
from chipload.errors import Severity
from chipload.jobs.next_measurement import next_measurement
from command import call
from spindle_logs import IDLE, KT, spindle_log

JOB = """
[program]
file = "part.nc"
[machine]
name = "vmc-fanuc"
[stock]
low_mm = [0.0, 0.0, -20.0]
high_mm = [120.0, 80.0, 0.0]
[material]
{material}
[[cutter]]
number = 1
diameter_mm = 10.0
flutes = 4
helix_deg = 30.0
flute_length_mm = 22.0
overhang_mm = 35.0
modulus_gpa = 580.0
runout_mm = 0.0
[[operation]]
kind = "simulate"
step_mm = 2.0
[limits]
force_n = 5000.0
torque_nm = {torque}
"""
#: passes of unlike width, depth and feed, with air between them
PASSES = [(2.0, 6.0, 900), (1.0, 3.0, 1500), (6.0, 4.0, 700), (9.0, 2.0, 500), (0.5, 8.0, 2000), (4.0, 5.0, 1000)]
TRUE = {"ktc_mpa": 950.0, "kte_n_mm": 22.0}
#: of the spindle [rad/s], 8000 rpm
SPEED = 837.76


def job_text(material: str, torque: float = 20.0) -> str:
    return JOB.format(material=material, torque=torque)


def program_text() -> str:
    """Return passes along the edge of a block, each from the side that the pass before left."""
    lines, y = ["%", "O0001 (PART)", "G21 G90 G54 G94", "T1 M6", "S8000 M3", "G43 H1 Z20."], 0.0
    for width, depth, feed in PASSES:
        y += width
        lines += [f"G0 X-10. Y{y - 5.0:.3f}", f"Z-{depth:.3f}", f"G1 X130. F{feed}", "G0 Z20."]
    return "\n".join([*lines, "M5", "M30", "%", ""])


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cell")
    (folder / "part.nc").write_text(program_text())
    (folder / "job.toml").write_text(job_text('name = "al7075-t6"'))
    true = "\n".join(f"{key} = {value}" for key, value in TRUE.items())
    rest = "krc_mpa = 168.8\nkac_mpa = 222.0\nkre_n_mm = 26.6\nkae_n_mm = 0.7\nspread = 0.1\n"
    (folder / "true.toml").write_text(f'name = "true"\nsource = "drawn for this test"\n{true}\n{rest}')
    (folder / "true_job.toml").write_text(job_text('file = "true.toml"'))
    history = jobs.run_job(jobs.load_job(folder / "true_job.toml")).result.in_use[0].columns
    end = history["t_s"]
    rng = np.random.default_rng(1)
    t = np.arange(0.0, end[-1], 0.05)
    current = IDLE[0] + IDLE[1] * SPEED + history["torque_mean_nm"][np.searchsorted(end, t)] / KT
    rows = zip(t + 5.0, current + 0.02 * rng.standard_normal(len(t)), strict=True)
    (folder / "current.csv").write_text("time_s,current_a\n" + "".join(f"{a:.3f},{i:.4f}\n" for a, i in rows))
    for k in range(2):
        t = np.arange(0.0, 1.1 * end[-1] + 8.0, 0.05)
        place = (t - 3.0) / 1.1
        row = np.minimum(np.searchsorted(end, place), len(end) - 1)
        power = np.where((place >= 0.0) & (place < end[-1]), history["power_w"][row], 0.0) / 0.85
        rows = zip(t, power + 310.0 + 5.0 * rng.standard_normal(len(t)), strict=True)
        (folder / f"log{k}.csv").write_text("time_s,power_w\n" + "".join(f"{a:.3f},{p:.3f}\n" for a, p in rows))
    return folder


def test_coefficients_are_found(cell, monkeypatch):
    """Both within two standard deviations, each known to 5 %; the material is one that a job takes. What is said of its
    worth and of what to measure next is that of the runs with the material before and after.
    """
    runs, run = [], jobs.run_job
    monkeypatch.setattr(jobs, "run_job", lambda *given, **named: runs.append(run(*given, **named)) or runs[-1])
    code, out, err = call(
        "learn", cell / "log0.csv", cell / "log1.csv", "--job", cell / "job.toml", "--out", cell / "learned.toml",
        "--efficiency", "0.85",
    )  # fmt: skip
    assert (code, err) == (0, "")
    found = tomllib.loads((cell / "learned.toml").read_text())
    for k, (key, value) in enumerate(TRUE.items()):
        deviation = found["covariance"][3 * k][3 * k] ** 0.5
        assert deviation < 0.05 * value
        assert abs(found[key] - value) < 2.0 * deviation
    assert found["krc_mpa"] == 168.8
    assert "log0.csv (sha256" in found["source"]
    assert "power and current tell the tangential force alone" in out
    before, after = (done.result for done in runs)
    record = found["learned"]
    assert record["prior_ktc_mpa"] == 767.01
    assert record["log"][0]["sha256"] == sha256((cell / "log0.csv").read_bytes()).hexdigest()
    worth = record["worth"][0]
    held = [next(c for c in r.limits if c.name == worth["limit"]) for r in (before, after)]
    assert worth["of_limit"] == pytest.approx([c.value_at_confidence / c.limit for c in held], rel=1e-9)
    assert held[1].budget.value(1.0) < held[0].budget.value(1.0) - 0.2
    notes = [f for f in (*after.findings, *after.in_use[0].findings) if f.code == "learned-material"]
    assert [f.severity for f in notes] == [Severity.NOTE]
    assert "log1.csv (rows " in notes[0].text
    learned = read_material(cell / "learned.toml")
    assert f"worth: {learned.learned.worth[0].text}\n" in out
    assert knowledge_text(learned).startswith(notes[0].text.removeprefix("al7075-t6-learned: "))
    following = next_measurement(runs[1].outcome, after, 0.05)
    assert "\n".join(following.texts) in out
    assert following.deviation == pytest.approx(held[1].budget.parts[0].deviation, rel=0.02)


def test_current_of_an_identified_spindle(cell, tmp_path):
    """The torque constant is the one that the spindle was identified with, on logs of its own."""
    logs = [spindle_log(tmp_path / f"{k}.csv", k, torques, speeds=(600.0, SPEED)) for k, torques in
            enumerate(((0.5, 1.0, 2.0), (0.8, 1.5)))]  # fmt: skip
    assert call("spindle", *logs, "--out", tmp_path / "spindle.toml")[0] == 0
    code, _, err = call(
        "learn", cell / "current.csv", "--job", cell / "job.toml", "--out", tmp_path / "m.toml", "--spindle",
        tmp_path / "spindle.toml", "--no-worth",
    )  # fmt: skip
    assert (code, err) == (0, "")
    found = tomllib.loads((tmp_path / "m.toml").read_text())
    for k, (key, value) in enumerate(TRUE.items()):
        deviation = found["covariance"][3 * k][3 * k] ** 0.5
        assert deviation < 0.06 * value
        assert abs(found[key] - value) < 2.5 * deviation


def test_what_to_measure_next_without_a_log(cell, monkeypatch):
    """And a watch of the same job: its run is used for both."""
    runs, run = [], jobs.run_job
    monkeypatch.setattr(jobs, "run_job", lambda *given, **named: runs.append(run(*given, **named)) or runs[-1])
    code, out, _ = call("next-measurement", cell / "job.toml", "--efficiency-error", "0.0")
    assert code == 0
    monkeypatch.setattr(jobs, "run_job", lambda *_, **__: runs[0])
    history = runs[0].result.in_use[0].columns
    t = np.arange(0.0, history["t_s"][-1], 0.05)
    row = np.searchsorted(history["t_s"], t)
    cut = history["power_w"][row] / 0.85
    lines, seen = history["line"][row], {}
    for name, keep in (("whole", np.ones(len(t))), ("missing", lines != lines[np.argmax(cut)])):
        rows = zip(t, 300.0 + cut * keep, lines, strict=True)
        text = "".join(f"{a:.3f},{p:.2f},{line}\n" for a, p, line in rows)
        (cell / f"{name}.csv").write_text("time_s,power_w,line\n" + "0,300,0\n" + text)
        seen[name] = call("watch", cell / f"{name}.csv", "--job", cell / "job.toml", "--once", "--efficiency", "0.85")
    assert seen["whole"][0] == 0, seen["whole"]
    assert seen["whole"][1].endswith("; 0 alarms\n")
    assert seen["missing"][0] == 3
    alarms = [x for x in seen["missing"][1].splitlines() if x.startswith("line ")]
    assert [x.split(":")[0] for x in alarms] == [f"line {lines[np.argmax(cut)]}"]
    assert "tool 1 cuts air where the program cuts material: missing stock, or it broke before" in alarms[0]
    _hold_by_pins(cell, monkeypatch, t, 300.0 + cut * (lines != lines[np.argmax(cut)]), lines)
    lines = out.splitlines()
    assert lines[0].startswith("deciding load: spindle_power_w at confidence ")
    assert lines[1].startswith("share of that variance: Ktc ")
    assert "Krc" not in lines[1]
    code, _, err = call("next-measurement", cell / "job.toml", "--efficiency-error", "1.5")
    assert code == 2
    assert "--efficiency-error = 1.5: must be from 0 to below 1" in err


def _hold_by_pins(cell, monkeypatch, time, power, lines) -> None:
    """Watch the stream on the pins of a LinuxCNC; the alarm holds the feed, and the log is one that is read."""
    sent, asked = [], {}

    class Pins:
        def __init__(self, name, python, sources):
            asked.update(sources)
            self.rows = iter(zip(time, power, lines, strict=True))

        def __enter__(self):
            return self

        def __exit__(self, *_):
            return None

        def exchange(self, feed, *_):
            sent.append(feed)
            row = next(self.rows, None)
            return None if row is None else PinValues(row[0], 0, 0, 0, 20.0, 0, feed, current=row[1], line=row[2])

    monkeypatch.setattr(hal_client, "HalPins", Pins)
    monkeypatch.setattr(machine_watch, "machine_samples", partial(machine_watch.machine_samples, sleep=lambda _: None))
    words = ["watch", "hal", "--job", cell / "job.toml", "--efficiency", "0.85", "--signal-pin", "vfd.power"]
    code, out, _ = call(*words, "--hold", "air", "--out", cell / "pins.csv")
    assert code == 3
    assert asked == {
        "current-in": "vfd.power", "line-in": "motion.program-line", "velocity": "motion.current-vel"
    }  # fmt: skip
    assert "feed hold: air\n" in out
    assert "feed held by watch-air: the machine stands" in out
    assert sorted(set(sent)) == [0.0, 1.0]
    assert sent == sorted(sent, reverse=True)
    log, _ = read_log(cell / "pins.csv")
    np.testing.assert_allclose(log.power, 1e3 * power[: len(log.power)], atol=1.0)
    assert "feed hold: none: alarms are only written\n" in call(*words)[1]
    code, _, err = call("watch", "log.csv", "--job", cell / "job.toml", "--hold", "air")
    assert code == 2
    assert "--hold, --signal-pin, --override-pin: apply to hal" in err


def test_refusals(cell, tmp_path):
    job, out = cell / "job.toml", tmp_path / "m.toml"
    (tmp_path / "current.csv").write_text("time_s,current_a\n0,1\n1,2\n2,1\n")
    code, _, err = call("learn", tmp_path / "current.csv", "--job", job, "--out", out)
    assert code == 2
    assert "no column of power or torque that all logs have; of current, state the spindle" in err
    (tmp_path / "torque.csv").write_text("time_s,torque_nm\n0,1\n1,2\n2,1\n")
    code, _, err = call("learn", tmp_path / "torque.csv", "--job", job, "--out", out, "--efficiency", "0.9")
    assert code == 2
    assert "efficiency: not used: the logs state the torque: leave it out" in err
    learned = replace(material_named("al7075-t6"), name="learned", learned=LearnedRecord(
        "al7075-t6", (767.0, 0.25), (27.7, 0.25),
        (LogEvidence("x.csv", sha256((cell / "log0.csv").read_bytes()).hexdigest(), (1, 9), 9, 0),),
    ))  # fmt: skip
    (tmp_path / "learned.toml").write_text(material_text(learned))
    assert read_material(tmp_path / "learned.toml") == learned
    again = tmp_path / "again.toml"
    again.write_text(job_text('file = "learned.toml"'))
    (tmp_path / "part.nc").write_text(program_text())
    code, _, err = call("learn", cell / "log0.csv", "--job", again, "--out", out, "--no-worth")
    assert code == 2
    assert "log0.csv: learned was learned from it: a log counts once" in err
    code, _, err = call("learn", cell / "log0.csv", "--job", job, "--out", out, "--efficiency", "1.5")
    assert code == 2
    assert "efficiency = 1.5: must be above 0 and at most 1" in err
    noise = np.random.default_rng(0).normal(500.0, 50.0, 400)
    text = "".join(f"{0.1 * k:.1f},{p:.2f}\n" for k, p in enumerate(noise))
    (tmp_path / "noise.csv").write_text("time_s,power_w\n" + text)
    code, _, err = call("learn", tmp_path / "noise.csv", "--job", job, "--out", out)
    assert code == 2
    assert "it is the log of another program" in err
    assert not out.exists()
