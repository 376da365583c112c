"""A thin wall from the sections of Rotor 37: its shape, what it bears, and a pass over it on a five-axis machine."""

import os
from pathlib import Path

import numpy as np
import pytest

from chipload.examples import copy_example
from chipload.jobs import load_job
from chipload.jobs.thinwall.inputs import read_wall
from chipload.jobs.thinwall.wall_program import link_pass_programs, on_machine
from chipload.planning.thinwall.passes import constant
from chipload.simulation.shape_deviation import nearest

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2].parent / "shared" / "data"))
PROFILE = DATA / "blades" / "turbogrid_rotor37" / "profile.curve"

pytestmark = pytest.mark.skipif(not PROFILE.exists(), reason=f"{PROFILE} is missing")

WALL = f"""
[wall]
shape = "sections"
files = ["{PROFILE}"]
unit = "cm"
edge_share = 0.12
span = [0.1, 1.0]
foot_mm = 6.0
allowance_mm = [0.3, 0.3]
elements = [6, 8]
"""


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    path = copy_example("blade", tmp_path_factory.mktemp("r37") / "job") / "job.toml"
    text = path.read_text()
    path.write_text(WALL + text[text.index("[workpiece]") :])
    return read_wall(load_job(path, ["operation.0.step_mm=4.0"]).job)


def test_shape(inputs):
    """Span 68 mm by the file (67.9 along the stacking), chord about 56 mm; thinner towards the tip."""
    length, height, thin = inputs.body.shape.size()
    assert 40.0 < length < 56.0
    assert 55.0 < height < 70.0
    root, tip = (float(inputs.body.shape.thickness(0.5, v)) for v in (0.05, 0.95))
    assert 0.3 < thin < tip < root < 6.0


def test_bears_least_at_the_tip(inputs):
    none = [np.zeros(inputs.body.wall.shape)] * 2
    force = inputs.threshold(inputs.depths.deflection)(none, 0).force.reshape(inputs.body.wall.shape)
    assert np.unravel_index(force.argmin(), force.shape)[1] == force.shape[1] - 1
    assert force[:, 0].min() > 20.0 * force[:, -1].max()


def test_a_pass_is_reached_and_does_not_gouge(inputs):
    surfaces = [inputs.coarse(s) for s in inputs.body.side_numbers]
    plan = constant(surfaces, inputs.threshold(inputs.depths.deflection), inputs.depths.even_law, 0.3)
    legs = link_pass_programs(inputs, plan)
    u, v = np.meshgrid(np.linspace(0.0, 1.0, 161), np.linspace(0.0, 1.0, 201), indexing="ij")
    cloud = np.concatenate([p.reshape(-1, 3) for p in inputs.body.shape.sides(u, v)])
    for leg in legs:
        gap = nearest(leg.program, inputs.cut.cutter, cloud)
        assert gap.distance > -0.02
    moved = on_machine(inputs, legs[-1].program)
    assert moved.exceeding == ()
    assert moved.times.sum() > 60.0
