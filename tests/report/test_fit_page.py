"""The result of a fit: its files, its numbers, its exit codes. Forces are the means of a slot by the true paths of the
teeth, constant.
"""

from __future__ import annotations

import json
import math
from functools import cache

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload.cli import app
from chipload.cutting.material import read_material
from chipload.errors import InputError
from chipload.jobs import load_job, run_job
from chipload.report.folder import check_target
from chipload.result import Verdict, load_result
from chipload.result.summary import summary_bytes
from engagement.tooth_paths import loads

KTC, KRC, KAC, KTE, KRE, KAE = 800.0, 240.0, 120.0, 20.0, 25.0, 2.0
JOB = """
name = "made"
source = "made up for this test"
workpiece = "Al"
method = "average"
[cutter]
number = 1
diameter_mm = 10.0
flutes = 2
helix_deg = 30.0
flute_length_mm = 20.0
overhang_mm = 30.0
modulus_gpa = 580.0
[engagement]
milling = "slot"
axial_depth_mm = 2.0
[channels]
feed = "-Fy"
across = "-Fx"
axis = "Fz"
on = "work"
[limits]
mean_percent = 1.0
"""
MORE = """
[[measurement]]
file = "{file}"
use = "{use}"
feed_mm_min = {feed}
speed_rpm = 6000.0
"""


@cache
def slot_means(c):
    """Mean forces on the cutter of JOB along the feed, across it and along its axis [N] at c mm per tooth.

    The textbook's mean of a slot takes the chip of circles, h = c sin(phi): Ktc would be 0.8 % off.
    """
    slices, rotations = 200, 720
    z = (np.arange(slices) + 0.5) * 2.0 / slices
    lag = z * math.tan(math.radians(30.0)) / 5.0
    edge = np.column_stack([0.0 * z + 5.0, 0.0 * z + 1.0, 0.0 * z, lag, 0.0 * z + 2.0 / slices])
    turns = math.tau * (np.arange(rotations) + 0.5) / rotations
    force, torque, thick = np.zeros((rotations, 3)), np.zeros(rotations), np.zeros(rotations)
    coefficients = np.array([KTC, KRC, KAC, KTE, KRE, KAE])
    pitch = np.full(2, math.pi)
    loads(edge, pitch, 2 * c / math.tau, 0.0, 0.0, -50.0, 50.0, coefficients, turns, force, torque, thick)
    return tuple(force.mean(axis=0).tolist())


def made(tmp_path, job=JOB, cuts=((300.0, "fit"), (900.0, "predict"), (1500.0, "fit")), spoil=1.0):
    """A job and its files: Fx and Fy turned as a dynamometer may lie, Fz up on the work."""
    rng = np.random.default_rng(4)
    for feed, use in cuts:
        t, n, a = slot_means(feed / 12_000.0)
        factor = spoil if use == "predict" else 1.0
        on_work = -np.tile([t, n, a], (1000, 1)) * factor + rng.normal(0.0, 0.05, (1000, 3))
        rows = "".join(f"{i / 1e4:.4f},{-f[1]:.6f},{-f[0]:.6f},{f[2]:.6f}\n" for i, f in enumerate(on_work))
        (tmp_path / f"f{feed:g}.csv").write_text("Sampling rate [Hz]:,10000\nTime,Fx,Fy,Fz\ns,N,N,N\n" + rows)
        job += MORE.format(file=f"f{feed:g}.csv", use=use, feed=feed)
    path = tmp_path / "fit.toml"
    path.write_text(job)
    return path


FILES = ["history.parquet", "material.toml", "report.html", "scene.glb", "summary.json"]


def test_folder(tmp_path):
    done = run_job(load_job(made(tmp_path)))
    assert done.result.verdict is Verdict.HOLDS
    out = done.save(tmp_path / "a" / "out")
    assert sorted(p.name for p in out.iterdir()) == FILES
    material = read_material(out / "material.toml")
    assert np.allclose(material.coefficients, [KTC, KRC, KAC, KTE, KRE, KAE], rtol=0.01, atol=0.1)
    assert material.source.startswith("made up for this test")
    assert material.chip == (0.0, 0.125)
    assert np.array(material.covariance).shape == (6, 6)
    written = json.loads((out / "summary.json").read_text())
    assert written["verdict"] == "holds"
    numbers = written["operations"][0]
    ktc = numbers["coefficients"]["ktc_mpa"]
    assert ktc["low_95"] < ktc["value"] < ktc["high_95"]
    third = numbers["measurements"][1]
    assert third["use"] == "predict"
    assert abs(third["mean_error_percent"]["across"]) < 0.1
    # Fy on the work is turned: along the feed the cutter is pushed back
    assert third["mean_n"]["measured"]["feed"] == pytest.approx(slot_means(0.075)[0], abs=0.02)
    page = (out / "report.html").read_text()
    assert "Mean force against feed" in page
    assert "http://" not in page.split("<script>")[0]
    assert "785" not in page.split("<script>")[0]
    # an older fit is replaced, anything else is refused
    done.save(out)
    (out / "mine.txt").write_text("x")
    with pytest.raises(InputError, match="holds files that are not a result of chipload"):
        done.save(out)
    assert (out / "mine.txt").exists()


def test_tracks_limits_and_history(tmp_path):
    """One track a measurement; the one that is predicted is in use, and is checked."""
    out = run_job(load_job(made(tmp_path))).save(tmp_path / "out")
    result = load_result(out)
    assert [t.name for t in result.tracks] == ["f900.csv", "f300.csv", "f1500.csv"]
    assert [t.in_use for t in result.tracks] == [True, False, False]
    (check,) = result.limits
    assert (check.name, check.limit, check.state) == ("mean_percent", 1.0, Verdict.HOLDS)
    errors = result.operations[0]["measurements"][1]["mean_error_percent"]
    assert check.worst == pytest.approx(max(map(abs, errors.values())))
    assert "limit peak_percent: not stated" in result.unchecked
    history = result.tracks[0].columns
    assert np.all(np.diff(history["t_s"]) > 0.0)
    # one turn at 6000 rpm; the speed is sought within 1 %, and constant forces do not say it
    assert history["t_s"][-1] + history["t_s"][1] == pytest.approx(0.01, rel=0.011)
    assert history["rotation_deg"][-1] + history["rotation_deg"][1] == pytest.approx(360.0)
    # the measured forces are constant: the model's mean over the turn is theirs, both along their own channel
    means = {name: float(values.mean()) for name, values in history.items() if name.startswith("force")}
    assert means["force_across_n"] == pytest.approx(slot_means(0.075)[1], rel=2e-3)
    for key in ("feed", "across", "axis"):
        assert means[f"force_{key}_n"] == pytest.approx(means[f"force_{key}_measured_n"], rel=0.01)


def test_forces_without_coefficients_have_no_column(tmp_path):
    """One feed does not tell edge from cutting force: what is not known is left out and is not a column of NaN."""
    result = run_job(load_job(made(tmp_path, cuts=((900.0, "fit"), (900.5, "predict"))))).result
    assert result.verdict is Verdict.UNPROVEN
    for track in result.tracks:
        assert [n for n in track.columns if n.startswith("force")] == [
            f"force_{key}_measured_n" for key in ("feed", "across", "axis")
        ]
        assert all(np.isfinite(values).all() for values in track.columns.values())


def test_what_the_mean_turn_leaves_is_the_noise(tmp_path):
    """A wave of 20 N twice a turn on the axis: beside the mean turn at their rotations, samples scatter by 0.05 N."""
    path = made(tmp_path)
    wave = 20.0 * np.cos(math.tau * 2 * np.arange(1000) / 100 + 0.4)
    for name in ("f300.csv", "f900.csv", "f1500.csv"):
        rows = (tmp_path / name).read_text().splitlines()
        cells = [row.split(",") for row in rows[3:]]
        new = [f"{t},{x},{y},{float(z) + w:.6f}" for (t, x, y, z), w in zip(cells, wave, strict=True)]
        (tmp_path / name).write_text("\n".join([*rows[:3], *new]) + "\n")
    for c in run_job(load_job(path)).outcome.comparisons:
        theta = c.phase + c.turns.speed * np.arange(1000) / 1e4
        left = c.cut.force - c.measured(theta)
        assert np.all(left.std(axis=0)[:2] < 0.06)
        # the speed is sought to some 3e-4: over ten turns the wave runs away by that
        assert left.std(axis=0)[2] < 0.05 + 20.0 / math.sqrt(2.0) * (2 * math.tau * 10 * 3e-4) / math.sqrt(3.0)
        assert np.ptp(c.measured(theta)[:, 2]) == pytest.approx(40.0, rel=0.01)


def test_same_input_same_numbers(tmp_path):
    path = made(tmp_path)
    first, second = (summary_bytes(run_job(load_job(path)).result, {}) for _ in range(2))
    assert first == second


def test_command(tmp_path):
    run = CliRunner().invoke(app, ["fit", str(made(tmp_path)), "--out", str(tmp_path / "out")])
    assert run.exit_code == 0, run.output
    assert "Ktc 800" in run.output or "Ktc 799" in run.output
    spoiled = tmp_path / "spoiled"
    spoiled.mkdir()
    for command in ("fit", "run"):
        run = CliRunner().invoke(app, [command, str(made(spoiled, spoil=1.05)), "--out", str(tmp_path / "out")])
        assert run.exit_code == 3
        assert "error of mean force 4.7" in run.output
        assert json.loads((tmp_path / "out" / "summary.json").read_text())["verdict"] == "exceeds"
    run = CliRunner().invoke(app, ["check", str(tmp_path / "fit.toml")])
    assert run.exit_code == 0
    assert "f900.csv: predict, 1000 samples at 10000 Hz" in run.output


def test_without_a_limit_nothing_is_proved(tmp_path):
    done = run_job(load_job(made(tmp_path, JOB.replace("mean_percent = 1.0", ""))))
    assert done.result.verdict is Verdict.UNPROVEN
    assert done.result.message == "Unproven: no limit was checked."


def test_axis_not_measured(tmp_path):
    """Without Fz no axial coefficient is invented; stated ones are taken with their source."""
    job = JOB.replace('axis = "Fz"\n', "")
    path = made(tmp_path, job)
    done = run_job(load_job(path))
    assert done.outcome.material is None
    assert done.result.verdict is Verdict.UNPROVEN
    assert "Kac, Kae not identified: measure them or state [axial]" in done.result.message
    out = done.save(tmp_path / "out")
    assert sorted(p.name for p in out.iterdir()) == [name for name in FILES if name != "material.toml"]
    numbers = json.loads((out / "summary.json").read_text())["operations"][0]
    assert numbers["coefficients"]["kac_mpa"] == {
        "value": None, "identified": False, "low_95": None, "high_95": None, "sd": None,
    }  # fmt: skip
    assert "not identified" in (out / "report.html").read_text()
    stated = "[axial]\nkac_mpa = 100.0\nkae_n_mm = 1.0\nsource = 'a handbook'\n"
    done = run_job(load_job(made(tmp_path, job + stated))).outcome
    assert done.material is not None
    assert (done.material.Kac, done.material.Kae) == (100.0, 1.0)
    assert "axial coefficients: a handbook" in done.material.source
    assert done.material.covariance is None


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('source = "made up for this test"\n', "", "source: missing: state it"),
        ('source = "made up for this test"', 'source = ""', "source = '': must not be empty"),
        ('method = "average"', 'method = "guess"', "method = 'guess': must be one of 'average', 'instantaneous'"),
        ('method = "average"', 'method = "instantaneous"', "band_hz: missing"),
        ('method = "average"', 'metod = "average"', "metod: unknown key; did you mean method?"),
        ("axial_depth_mm = 2.0", "axial_depth_mm = -2.0", "engagement.axial_depth_mm = -2: must be above 0"),
        ("axial_depth_mm = 2.0", "axial_depth_mm = 2.0\nradial_depth_mm = 4.0", "a slot is as wide as the cutter"),
        ('milling = "slot"', 'milling = "up"', "engagement.radial_depth_mm: missing"),
        ('milling = "slot"', 'milling = "up"\nradial_depth_mm = 11.0', "must be at most cutter.diameter_mm = 10"),
        ('axis = "Fz"', 'axis = "Fw"', "measurement.0: channel Fw: not in the file: it has Fx, Fy, Fz"),
        ("flutes = 2\n", "", "cutter.flutes is missing"),
        ('file = "f300.csv"', 'file = "none.csv"', "measurement.0: forces none.csv: cannot be read"),
        ('file = "f300.csv"', 'file = "f300.csv"\nwindow_s = [2.0, 1.0]', "window_s = [2.0, 1.0]: must rise"),
        ('use = "fit"', 'use = "predict"', "none has use = fit"),
        ("[limits]", "[limits", "not a TOML file"),
    ],
)
def test_refused(tmp_path, old, new, says):
    path = made(tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    run = CliRunner().invoke(app, ["fit", str(path), "--out", str(tmp_path / "out")])
    assert run.exit_code == 2
    assert says in " ".join(run.output.split())
    assert not (tmp_path / "out").exists()


def test_target_that_is_a_file(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="is not a folder"):
        check_target(tmp_path / "file")
