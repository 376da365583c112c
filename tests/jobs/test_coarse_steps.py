"""Steps of a coarse run: longer, but not so long that one with changing engagement is calculated at 25 times as many
instants all along (35,000 blocks with a ball of 2 mm: 4.6 GB and a third of the speed with steps of 57 mm).
"""

from pathlib import Path

import pytest

from chipload.jobs import load_job
from chipload.jobs.coarse import coarser

JOB = """[program]
file = "part.ngc"
[machine]
name = "vmc"
[stock]
low_mm = [0.0, 0.0, -10.0]
high_mm = [50.0, 40.0, 0.0]
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = {diameter}
flutes = 2
helix_deg = 30.0
flute_length_mm = 10.0
overhang_mm = 20.0
modulus_gpa = 580.0
[[operation]]
kind = "simulate"
step_mm = {step}
[limits]
torque_nm = 10.0
"""


@pytest.mark.parametrize(("diameter", "step", "coarse"), [(20.0, 1.2, "9.6"), (2.0, 1.2, "2"), (2.0, 7.2, "7.2")])
def test_a_coarse_step_is_at_most_a_diameter(tmp_path: Path, diameter, step, coarse):
    (tmp_path / "part.ngc").write_text("G21 G90\nT1 M6\nS3000 M3\nG0 X0 Y0 Z5\nG1 Z-1 F200\nX10\nM2\n")
    (tmp_path / "job.toml").write_text(JOB.format(diameter=diameter, step=step))
    asked = coarser(load_job(tmp_path / "job.toml"))
    assert f"operation.0.step_mm={coarse}" in asked
