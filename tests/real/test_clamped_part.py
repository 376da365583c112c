"""A real part on its fixture: its own CL data and model; how far it gives way in each line, what form error stays.

`lateral-leg-holder`: a plate of 220 x 75 x 9 mm from a block of 222 x 77 x 9 mm, one end mill of 12 mm. Its STL holds
the whole setup; the plate is one body of it. The file states neither the metal nor how it is held: assumed are an
aluminium alloy and a fixture plate below its middle 125 mm. The outline is cut to the full depth, so that a vice that
grips the sides, which the first test tries, would be cut.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh

from chipload import jobs
from chipload.errors import InputError
from chipload.jobs.program.result import result_of
from chipload.jobs.program.run import run

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[3] / "shared" / "data"))
MODEL = DATA / "cad" / "stl_dmu50_parts" / "lateral-leg-holder.STL"
PROGRAM = DATA / "nc" / "apt_dmu50" / "apt" / "lateral-leg-holder.apt"
pytestmark = pytest.mark.skipif(not (MODEL.is_file() and PROGRAM.is_file()), reason="no real part: set CHIPLOAD_DATA")

HELD = (47.5, 172.5)
BELOW = f"""[[workpiece.clamp]]
face = "z-"
low_mm = [{HELD[0]}, 0.0, -9.0]
high_mm = [{HELD[1]}, 77.0, -9.0]
"""
VICE = "".join(f"""[[workpiece.clamp]]
face = "{face}"
low_mm = [{HELD[0]}, {y}, -9.0]
high_mm = [{HELD[1]}, {y}, -4.0]
""" for face, y in (("y-", 0.0), ("y+", 77.0)))  # fmt: skip
JOB = f"""[program]
file = "{PROGRAM}"
[machine]
name = "vmc"
[stock]
low_mm = [0.0, 0.0, -9.0]
high_mm = [222.0, 77.0, 0.0]
layer_mm = 0.75
[part]
file = "plate.stl"
units = "mm"
spacing_mm = 4.0
[material]
name = "al7075-t6"
[[cutter]]
number = 21
diameter_mm = 12.0
flutes = 4
helix_deg = 30.0
flute_length_mm = 25.0
overhang_mm = 50.0
modulus_gpa = 580.0
[workpiece]
modulus_gpa = 71.7
poisson = 0.33
density_kg_m3 = 2810.0
yield_mpa = 500.0
states = 4
{{clamps}}[[operation]]
kind = "simulate"
step_mm = 6.0
[limits]
deflection_workpiece_um = 100.0
form_error_um = 100.0
"""


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plate")
    bodies = trimesh.load(MODEL).split()
    plate = min(bodies, key=lambda b: abs(b.extents - (220.0, 75.0, 9.0)).sum())
    np.testing.assert_allclose(plate.extents, (220.0, 75.0, 9.0), atol=0.01)
    plate.export(folder / "plate.stl")
    (folder / "vice.toml").write_text(JOB.format(clamps=VICE))
    with pytest.raises(InputError, match=r"workpiece.clamp.1: holds nothing after the program has cut it away"):
        run(jobs.load_job(folder / "vice.toml").job)
    (folder / "job.toml").write_text(JOB.format(clamps=BELOW))
    return run(jobs.load_job(folder / "job.toml").job)


def test_every_line_that_cuts_has_a_deflection(done):
    c = done.simulated.removal.columns
    cuts = (c["chip_areas"] > 0) & ~c["rapid"]
    assert (c["deflection_workpiece_um"][cuts] > 0.0).all()
    numbers = result_of(done).operations[0]
    assert numbers["form_error_um"]["points"] > 100
    assert 0.0 < numbers["form_error_um"]["max"] < numbers["deflection_workpiece_um"]["max"] * 1.5 + 50.0
    assert 2 <= numbers["states"] <= 20
    names = {check.name: check for check in result_of(done).limits}
    assert names["stress_mpa"].worst > 0.0


def test_the_ends_that_stand_out_bend_as_a_plate(done):
    """The middle of the end, loaded upright: a cantilever of the overhang as wide as the plate is the least."""
    steps = done.simulated.workpiece.steps
    x = steps.lines.mean(axis=1)[:, 0]
    across = 1e3 * steps.compliance[:, 1, 2, 2]
    length, width, thick = HELD[0], 77.0, 9.0
    least = 1e3 * length**3 / (3.0 * 71.7e3 * width * thick**3 / 12.0)
    end, held = across[x < 3.0], across[(x > 80.0) & (x < 140.0)]
    assert len(end)
    assert len(held)
    assert (end > least).all()
    assert end.max() < 6.0 * least
    assert held.max() < 0.5 * end.min()
