"""Modes of the workpiece in a program job: followed through the removal, the verdict of the start state is another."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from chipload import jobs
from chipload.errors import InputError
from chipload.jobs.program.result import result_of
from chipload.jobs.program.run import check, run
from chipload.result import Verdict

#: a wall of 3 mm, 40 mm long and 32 mm high, is made 2 mm thin from its free edge down
ROWS = "".join(f"G0 Y-10.\nG0 X-8.\nG0 Z-{5 * k}.\nG0 Y-4.\nG1 X48. F1800.\n" for k in range(1, 7))
PROGRAM = f"%\nG21 G90 G17 G54\nT1 M6\nS12000 M3\nG0 X-12. Y-10. Z10.\n{ROWS}G0 Z10.\nM30\n%\n"
MATERIAL = """name = "made up"
workpiece = "none"
source = "made up for this test"
conditions = "none"
ktc_mpa = 400.0
krc_mpa = 100.0
kac_mpa = 60.0
kte_n_mm = 10.0
kre_n_mm = 12.0
kae_n_mm = 2.0
"""
MODE = """[[dynamics.mode]]
tool = 1
frequency_hz = 900.0
damping_ratio = 0.03
stiffness_n_um = 40.0
direction = "{}"
"""
JOB = f"""[program]
file = "wall.nc"
[machine]
name = "vmc-fanuc"
[stock]
low_mm = [0.0, 0.0, -32.0]
high_mm = [40.0, 3.0, 0.0]
layer_mm = 5.0
[material]
file = "m.toml"
[[cutter]]
number = 1
diameter_mm = 10.0
flutes = 3
helix_deg = 30.0
flute_length_mm = 40.0
overhang_mm = 50.0
modulus_gpa = 580.0
[workpiece]
modulus_gpa = 110.0
poisson = 0.33
density_kg_m3 = 4430.0
damping_ratio = 0.02
states = 6
[[workpiece.clamp]]
face = "z-"
[dynamics]
{MODE.format("x")}{MODE.format("y")}[[operation]]
kind = "simulate"
step_mm = 8.0
tolerance_mm = 0.005
[limits]
stability_margin = 1.0
"""


@pytest.fixture
def job_file(tmp_path: Path) -> Path:
    (tmp_path / "wall.nc").write_text(PROGRAM)
    (tmp_path / "m.toml").write_text(MATERIAL)
    (tmp_path / "job.toml").write_text(JOB)
    return tmp_path / "job.toml"


def changed(job_file: Path, old: str, new: str) -> Path:
    text = job_file.read_text()
    assert old in text
    job_file.write_text(text.replace(old, new))
    return job_file


def test_the_verdict_of_the_start_state_is_another(job_file):
    done = run(jobs.load_job(job_file).job)
    result = result_of(done)
    numbers = result.operations[0]
    followed, stability = numbers["stability"]["workpiece_modes"], numbers["stability"]
    # the wall before its first cut would be quiet at this speed; as it thins it is not
    assert followed["start_state_margin_min"] > 1.3
    assert stability["margin_min"] < 0.95
    assert stability["mode"].startswith("workpiece mode")
    assert followed["verdict_differs_lines"]
    assert stability["line"] in followed["verdict_differs_lines"]
    limit = next(c for c in result.limits if c.name == "stability_margin")
    assert limit.state in (Verdict.EXCEEDS, Verdict.UNPROVEN)
    assert limit.resolution_error > 0.01
    # a beam of 2 mm with clamped foot: (1.875)^2 / (2 pi) sqrt(E I / (rho A)) / L^4, a plate is a little stiffer
    beam = 1.8751**2 / (2 * np.pi) * np.sqrt(110e3 * 2.0**2 / 12.0 / 4.43e-9) / 32.0**2
    frequencies = numbers["natural_frequencies"]
    assert 0.9 * beam < frequencies["end_hz"][0] < 1.15 * beam
    assert frequencies["start_hz"][0] == pytest.approx(1.5 * beam, rel=0.12)
    # it is heavier above first
    assert frequencies["greatest_hz"][0] > 1.1 * frequencies["start_hz"][0]
    assert frequencies["states"] >= 4


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("density_kg_m3 = 4430.0\n", "", "workpiece.damping_ratio: needs density_kg_m3"),
        ("density_kg_m3 = 4430.0", "density_kg_m3 = 4.43", "workpiece.density_kg_m3"),
        ("damping_ratio = 0.02\n", "damping_ratio = -0.02\n", "workpiece.damping_ratio"),
        ("[dynamics]\n", '[dynamics]\nmode = [{of = "workpiece", frequency_hz = 1.0, direction = "x"}]\n', "dynamics"),
        ("tool = 1\n", 'tool = 1\nof = "workpiece"\n', "of the workpiece: leave it out: workpiece.density_kg_m3"),
    ],
)
def test_what_contradicts_is_refused(job_file, old, new, message):
    with pytest.raises(InputError, match=re.escape(message)):
        check(jobs.load_job(changed(job_file, old, new)).job)


def test_without_the_damping_of_the_workpiece_stability_is_unproven(job_file):
    path = changed(job_file, "damping_ratio = 0.02\nstates = 6", "states = 2")
    path.write_text(path.read_text().replace("step_mm = 8.0", "step_mm = 20.0"))
    result = result_of(run(jobs.load_job(path).job))
    limit = next(c for c in result.limits if c.name == "stability_margin")
    assert limit.state is Verdict.UNPROVEN
    assert "damping of the workpiece is not stated" in limit.reason
    assert "workpiece_modes" not in result.operations[0]["stability"]
