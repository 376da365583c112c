"""Samples of modes: their distribution, the files that hold them, and that the cases are run with them."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from chipload.cutting.material import material_named, material_text
from chipload.errors import InputError
from chipload.jobs.simulation.dynamics_tables import DynamicsTable, ModeTable
from chipload.jobs.simulation.modes_file import read_modes
from chipload.sweep.cases import Samples
from chipload.sweep.run import run_sweep
from chipload.sweep.sampled import modes_texts
from slot_job import slot_job

TABLE = DynamicsTable(frequency_percent=2.0, damping_percent=10.0, stiffness_percent=5.0)
MODES = [
    ModeTable(tool=3, frequency_hz=812.0, damping_ratio=0.021, stiffness_n_um=6.9, direction="x"),
    ModeTable(of="workpiece", frequency_hz=1450.0, damping_ratio=0.01, mass_kg=0.3, direction=(0.6, 0.8)),
]
DYNAMICS = """[dynamics]
frequency_percent = 0.0
damping_percent = 0.0
stiffness_percent = 20.0
[[dynamics.mode]]
frequency_hz = 900.0
damping_ratio = 0.03
stiffness_n_um = 1.5
direction = "y"
"""


def drawn(count: int) -> np.ndarray:
    """(count, 2, 3) frequency [Hz], damping ratio and stiffness [N/um] of the modes, as files state them."""
    normal = norm.ppf(Samples(count).points(6))
    out = []
    for text in modes_texts(MODES, TABLE, normal):
        first, second = tomllib.loads(text)["mode"]
        weight = 1e-6 * second["mass_kg"] * (math.tau * second["frequency_hz"]) ** 2
        out.append(
            [[first["frequency_hz"], first["damping_ratio"], first["stiffness_n_um"]],
             [second["frequency_hz"], second["damping_ratio"], weight]]
        )  # fmt: skip
    return np.array(out)


def test_samples_of_modes_have_the_stated_deviations():
    found = drawn(512)
    stiffness = 1e-6 * 0.3 * (math.tau * 1450.0) ** 2
    stated = np.array([[812.0, 0.021, 6.9], [1450.0, 0.01, stiffness]])
    np.testing.assert_allclose(found.mean(axis=0), stated, rtol=0.005)
    np.testing.assert_allclose(found.std(axis=0) / stated, [[0.02, 0.1, 0.05]] * 2, rtol=0.05)
    assert np.abs(np.corrcoef(found.reshape(512, 6).T) - np.eye(6)).max() < 0.1


def test_the_files_are_files_of_modes(tmp_path):
    (text,) = modes_texts(MODES, TABLE, np.zeros((1, 6)))
    (tmp_path / "modes.toml").write_text(text)
    assert list(read_modes(tmp_path / "modes.toml")) == MODES


@pytest.fixture
def job(tmp_path) -> Path:
    path = slot_job(tmp_path)
    known = replace(material_named("al7075-t6"), spread=1e-6)
    (tmp_path / "known.toml").write_text(material_text(known))
    text = path.read_text().replace('name = "al7075-t6"', 'file = "known.toml"')
    path.write_text(DYNAMICS + text.replace("torque_nm = 5.0", "stability_margin = 0.5"))
    return path


def test_cases_run_with_their_modes(job, tmp_path):
    """The margin is the stiffness times a constant where frequency, damping and coefficients are the same."""
    out = tmp_path / "out"
    done = run_sweep(job, ["limits.force_n=9000"], out, samples=Samples(3))
    margin = np.array([record["limits"]["stability_margin"]["worst"] for record in done.records])
    assert ((margin > 0.0) & (margin < 3.0)).all()
    modes = [tomllib.loads(f.read_text())["mode"][0] for f in sorted((out / "modes" / "001").iterdir())]
    assert {(m["frequency_hz"], m["damping_ratio"]) for m in modes} == {(900.0, 0.03)}
    share = margin / [m["stiffness_n_um"] for m in modes]
    assert np.ptp(margin) > 0.02 * margin.mean()
    np.testing.assert_allclose(share, share[0], rtol=2e-3)


def test_a_limit_of_the_probability_is_refused(job, tmp_path):
    job.write_text(job.read_text() + "stable_probability = 0.9\n")
    with pytest.raises(InputError, match=r"state limits\.stability_margin in place of limits\.stable_probability"):
        run_sweep(job, [], tmp_path / "out", samples=Samples(2))
