"""A wall with stock on one side and thresholds from a table of cuts, from its job to its result."""

import numpy as np
import pytest

from chipload.examples import copy_example
from chipload.jobs import load_job, run_job
from chipload.jobs.thinwall.result import result_of

SMALL = (
    "operation.0.refine=false",
    "wall.length_mm=8.0",
    "wall.height_mm=9.0",
    "wall.thickness_mm=1.7",
    "wall.foot_mm=4.0",
    "wall.allowance_mm=[0.2, 0.0]",
    "wall.elements=[4, 5]",
    "operation.0.scallop_um=40.0",
    "operation.0.depth_max_mm=0.2",
    "operation.0.step_mm=3.0",
    "operation.0.layer_mm=0.5",
    "operation.0.corner_slices=60",
    "operation.0.reserve=0.1",
    "limits.deflection_workpiece_um=48.0",
)


def bears(v):
    """Threshold [N]: force times limit over deflection at the free edge, four times of it at the clamp, between them
    straight in its logarithm."""
    return 40.0 * 48.0 / 30.0 * 4.0 ** (1.0 - v)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    job = copy_example("plate", tmp_path_factory.mktemp("calibrated") / "plate") / "job.toml"
    places = [(u, v) for u in (0, 1) for v in (0, 1)] + [(0.5, 1)]
    rows = [f"{u},{v},1,60,{40 if v == 1 else 160},30," for u, v in places]
    head = "u,v,repeat,expected_normal_force_n,normal_force_n,deflection_um,too_much"
    (job.parent / "cuts.csv").write_text("\n".join([head, *rows, ""]))
    job.write_text(job.read_text() + '\n[threshold]\nfile = "cuts.csv"\ndeviations = 0.0\n')
    return run_job(load_job(job, SMALL)).outcome


def test_the_threshold_is_that_of_the_table_and_says_so(done):
    operation = result_of(done).operations[0]
    assert operation["threshold_source"] == "calibrated"
    for one in done.variants.values():
        c = one.columns
        cut = c["force_normal_n"] > 0.0
        expected = bears(c["v"][cut])
        assert np.allclose(c["force_allowable_n"][cut], expected, rtol=1e-6)
        assert np.allclose(c["force_over_allowable"][cut], c["force_normal_n"][cut] / expected, rtol=1e-6)


def test_one_side_is_cut_and_all_of_its_stock_taken(done):
    """As in test_wall.py, of one side."""
    fillet, scallop = 2.0 / 3.0 * 0.2 * np.sqrt(2.0 * 4.0 * 0.2), 0.04
    expected = 8.0 * (5.0 * (0.2 - scallop / 3.0) + fillet)
    for one in done.variants.values():
        assert {m.side for m in one.plan.maps} == {0}
        assert [f.side for f in one.finish] == [0]
        # the path that is moved against the form error cuts deeper in the rigid simulation
        taken = expected + one.shift * 8.0 * 5.0 if one.name == "compensated" else expected
        assert 0.96 * expected <= one.columns["chip_volume_mm3"].sum() <= 1.04 * taken
        assert one.plan.passes_otherwise is None
    assert done.variants["variable"].columns["force_over_allowable"].max() <= 1.01
    # without refinement the first plan that holds is taken
    assert done.settings["simulated_tries"] == 1
