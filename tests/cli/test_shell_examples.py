"""The examples on a thin tube and a thin cone keep what they promise, with coarser steps than their own."""

from __future__ import annotations

import json
import math
import re

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload import examples
from chipload.cli import app
from chipload.control.wall import unit_response
from chipload.structure.shell import Shell, ritz

COARSE = ("simulation.step_mm=2.0", "simulation.tolerance_mm=0.01")


@pytest.mark.parametrize("name", ["tube", "cone"])
def test_torque_held(name, tmp_path):
    """A fifth shorter than the constant feed that respects the limit everywhere, at most 5 % over the limit, wall error
    within 10 % of the constant one's; with 100 ms latency and steps of 1 % too. Feedback alone does not keep the limit.
    """
    folder = examples.copy_example(name, tmp_path / name)
    words = ["run", folder / "job.toml", "--out", tmp_path / "r", *(w for x in COARSE for w in ("--set", x))]
    done = CliRunner().invoke(app, [str(w) for w in words])
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    what = summary["operations"][0]
    late = what["with_latency"]
    assert (late["latency_ms"], late["override_step"]) == (100.0, 0.01)
    for case in (what, late):
        controllers = case["controllers"]
        held, constant = controllers["fuzzy_feedforward"], controllers["constant"]
        assert held["time_s"] < 0.8 * constant["time_s"]
        assert held["torque_nm_max"] < 1.05 * what["torque_limit_nm"]
        assert held["form_error_um_max"] < 1.1 * constant["form_error_um_max"]
        assert constant["torque_nm_max"] == pytest.approx(what["torque_limit_nm"], rel=2e-3)
        for other in ("model_not_derated", "fuzzy"):
            assert controllers[other]["torque_nm_max"] > 1.05 * what["torque_limit_nm"]
    assert (done.exit_code == 0) == (summary["verdict"] == "holds")


@pytest.mark.parametrize(("micrometres", "by"), [(60, "deflection"), (200, "strength")])
def test_a_long_tube_is_limited_by_what_it_may(micrometres, by, tmp_path):
    """R 12, L 90, wall 1.6 mm: half its strength is reached at some 0.1 mm of deflection, as the shell says."""
    folder = examples.copy_example("tube", tmp_path / "tube")
    words = ["check", folder / "long.toml", "--set", f"limits.form_error_um={micrometres}", "--set"]
    done = CliRunner().invoke(app, [str(w) for w in (*words, "simulation.step_mm=2.5")])
    assert done.exit_code == 0, done.stderr
    assert f"by the wall's {by}" in done.stdout
    wall = ritz(Shell(12.0, 90.0, 1.55, 70e3, 0.33, 0.0))
    near, far, tool = (np.array([x]) for x in (88.5, 90.0, 0.0))
    free = unit_response(wall, near, far, math.sqrt(1.0 * (10.0 - 1.0)), tool)
    at_half_the_strength = 1e3 * free.compliance[0] * 0.5 * 250.0 / free.stress[0]
    assert 60.0 < at_half_the_strength < 200.0


def test_a_titanium_tube_and_what_would_do(tmp_path):
    """Its edge forces are high: of a deeper helix the check names changes, and the shallower one is the example."""
    folder = examples.copy_example("tube", tmp_path / "tube")
    coarse = ["--set", "simulation.step_mm=2.5"]
    done = CliRunner().invoke(app, ["check", str(folder / "titanium.toml"), *coarse])
    assert done.exit_code == 0, done.stdout + done.stderr
    assert "by the wall's deflection" in done.stdout
    deeper = ["--set", "round.pitch_mm=2.0", "--set", "limits.form_error_um=40"]
    done = CliRunner().invoke(app, ["check", str(folder / "titanium.toml"), *coarse, *deeper])
    assert done.exit_code == 3
    assert "no torque is allowable" in done.stdout
    assert re.search(r"a depth of cut of at most \d", done.stdout)
    assert re.search(r"a wall of at least 2\.\d+ mm \(now 2\)", done.stdout)
