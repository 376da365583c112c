"""The result of a fit: its files, its numbers, its exit codes. Forces are the textbook's means of a slot, constant."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload.cli import app
from chipload.cutting.fit_job import load_fit, run_fit
from chipload.cutting.material import read_material
from chipload.errors import InputError
from chipload.report.fit import check_fit_target, summary, write_fit

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


def made(tmp_path, job=JOB, cuts=((300.0, "fit"), (900.0, "predict"), (1500.0, "fit")), spoil=1.0):
    """A job and its files: Fx and Fy turned as a dynamometer may lie, Fz up on the work."""
    rng = np.random.default_rng(4)
    for feed, use in cuts:
        c = feed / 12_000.0
        t = -(2 * 2.0 / 4 * KRC * c + 2 * 2.0 / math.pi * KRE)
        n = 2 * 2.0 / 4 * KTC * c + 2 * 2.0 / math.pi * KTE
        a = -(2 * 2.0 / math.pi * KAC * c + 2 * 2.0 / 2 * KAE)
        factor = spoil if use == "predict" else 1.0
        on_work = -np.tile([t, n, a], (1000, 1)) * factor + rng.normal(0.0, 0.05, (1000, 3))
        rows = "".join(f"{i / 1e4:.4f},{-f[1]:.6f},{-f[0]:.6f},{f[2]:.6f}\n" for i, f in enumerate(on_work))
        (tmp_path / f"f{feed:g}.csv").write_text("Sampling rate [Hz]:,10000\nTime,Fx,Fy,Fz\ns,N,N,N\n" + rows)
        job += MORE.format(file=f"f{feed:g}.csv", use=use, feed=feed)
    path = tmp_path / "fit.toml"
    path.write_text(job)
    return path


def test_folder(tmp_path):
    done = run_fit(load_fit(made(tmp_path)))
    assert done.holds
    out = write_fit(done, tmp_path / "a" / "out")
    assert sorted(p.name for p in out.iterdir()) == ["material.toml", "report.html", "summary.json"]
    material = read_material(out / "material.toml")
    assert np.allclose(material.coefficients, [KTC, KRC, KAC, KTE, KRE, KAE], rtol=0.01, atol=0.1)
    assert material.source.startswith("made up for this test")
    assert material.chip == (0.0, 0.125)
    assert np.array(material.covariance).shape == (6, 6)
    numbers = json.loads((out / "summary.json").read_text())
    assert numbers["holds"] is True
    ktc = numbers["coefficients"]["ktc_mpa"]
    assert ktc["low_95"] < ktc["value"] < ktc["high_95"]
    third = numbers["measurements"][1]
    assert third["use"] == "predict"
    assert abs(third["mean_error_percent"]["across"]) < 0.1
    # Fy on the work is turned: along the feed the cutter is pushed back
    assert third["mean_n"]["measured"]["feed"] == pytest.approx(-(KRC * 0.075 + 4 / math.pi * KRE), abs=0.02)
    page = (out / "report.html").read_text()
    assert "Mean force against feed" in page
    assert "http://" not in page.split("<script>")[0]
    assert "785" not in page.split("<script>")[0]
    # an older fit is replaced, anything else is refused
    write_fit(done, out)
    (out / "mine.txt").write_text("x")
    with pytest.raises(InputError, match="holds files that are no fit of chipload"):
        write_fit(done, out)
    assert (out / "mine.txt").exists()


def test_same_input_same_numbers(tmp_path):
    path = made(tmp_path)
    assert summary(run_fit(load_fit(path))) == summary(run_fit(load_fit(path)))


def test_command(tmp_path):
    run = CliRunner().invoke(app, ["fit", str(made(tmp_path)), "--out", str(tmp_path / "out")])
    assert run.exit_code == 0, run.output
    assert "Ktc 800" in run.output or "Ktc 799" in run.output
    spoiled = tmp_path / "spoiled"
    spoiled.mkdir()
    run = CliRunner().invoke(app, ["fit", str(made(spoiled, spoil=1.05)), "--out", str(tmp_path / "out")])
    assert run.exit_code == 3
    assert "mean feed is off by 4.7" in run.output
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["holds"] is False


def test_axis_not_measured(tmp_path):
    """Without Fz no axial coefficient is invented; stated ones are taken with their source."""
    job = JOB.replace('axis = "Fz"\n', "")
    path = made(tmp_path, job)
    done = run_fit(load_fit(path))
    assert done.material is None
    assert "Kac, Kae not identified: measure them or state [axial]" in done.failures[0]
    out = write_fit(done, tmp_path / "out")
    assert sorted(p.name for p in out.iterdir()) == ["report.html", "summary.json"]
    numbers = json.loads((out / "summary.json").read_text())
    assert numbers["coefficients"]["kac_mpa"] == {
        "value": None, "identified": False, "low_95": None, "high_95": None, "sd": None,
    }  # fmt: skip
    assert "not identified" in (out / "report.html").read_text()
    stated = "[axial]\nkac_mpa = 100.0\nkae_n_mm = 1.0\nsource = 'a handbook'\n"
    done = run_fit(load_fit(made(tmp_path, job + stated)))
    assert done.material is not None
    assert (done.material.Kac, done.material.Kae) == (100.0, 1.0)
    assert "axial coefficients: a handbook" in done.material.source
    assert done.material.covariance is None


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('source = "made up for this test"\n', "", "source: missing: state it"),
        ('source = "made up for this test"', 'source = ""', "source: must not be empty"),
        ('method = "average"', 'method = "guess"', "method: must be one of 'average', 'instantaneous'"),
        ('method = "average"', 'method = "instantaneous"', "band_hz: missing"),
        ('method = "average"', 'metod = "average"', "metod: unknown key; did you mean method?"),
        ("axial_depth_mm = 2.0", "axial_depth_mm = -2.0", "engagement.axial_depth_mm: must be above 0"),
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
        check_fit_target(tmp_path / "file")
