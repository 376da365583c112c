"""What limits a thin tube: its deflection or its strength; and what would do where no torque is borne."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload import examples
from chipload.cli import app
from chipload.control.wall import unit_response
from chipload.structure.shell import Shell, ritz


@pytest.mark.parametrize(("micrometres", "by"), [(72, "deflection"), (200, "strength")])
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
