"""Steps of a coarse run: longer, but not so long that one with changing engagement is calculated at 25 times as many
instants all along (35,000 blocks with a ball of 2 mm: 4.6 GB and a third of the speed with steps of 57 mm).
"""

import math
from pathlib import Path

import pytest

from chipload.errors import Severity
from chipload.jobs import load_job, run_job
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


def volumes(result):
    """Removed volume of each step [mm^3]."""
    return result.to_pandas()["chip_volume_mm3"].to_numpy()


def test_short_blocks_of_a_coarse_run_are_joined(tmp_path: Path):
    """A groove whose floor is a sine of 0.05 mm in 90 blocks: fewer steps, the same volume, unproven with how far.

    By hand: 40 mm of a slot of 10 mm and half a circle at either end; a wave is 4 mm long, so the flat mill leaves its
    lowest places, 2.05 mm below the top.
    """
    moves = "".join(f"G1 X{5 + k * 40 / 90:.4f} Z{-2 + 0.05 * math.sin(k * math.tau / 9):.4f}\n" for k in range(91))
    text = f"G21 G90\nT1 M6\nS3000 M3\nG0 X5 Y20 Z5\nG1 Z-2 F200\n{moves}G0 Z5\nM2\n"
    (tmp_path / "part.ngc").write_text(text)
    (tmp_path / "job.toml").write_text(JOB.format(diameter=10.0, step=1.2))
    loaded = load_job(tmp_path / "job.toml")
    assert "operation.0.join_mm=0.2" in coarser(loaded)
    by_itself = run_job(loaded, accept=True).result
    joined = run_job(load_job(tmp_path / "job.toml", ("operation.0.join_mm=0.2",)), accept=True).result
    steps = [len(volumes(one)) for one in (by_itself, joined)]
    assert steps[1] < 0.7 * steps[0]
    volume = 2.05 * (40.0 * 10.0 + math.pi * 25.0)
    for one, bound in ((by_itself, 0.01), (joined, 0.05)):
        assert volumes(one).sum() == pytest.approx(volume, rel=bound)
    found = [f for f in joined.tracks[0].findings if f.code == "blocks-joined"]
    assert [f.severity for f in found] == [Severity.UNPROVEN]
    assert "at most 0." in found[0].text
    assert not [f for f in by_itself.tracks[0].findings if f.code == "blocks-joined"]
