"""A thin wall that a barrel cutter finishes: planned, written and verified, beside a ball of the same diameter."""

from __future__ import annotations

import math

import pytest

from chipload.examples import copy_example
from chipload.jobs import load_job, run_job
from chipload.result import Verdict

SMALL = (
    "wall.length_mm=8.0",
    "wall.height_mm=15.0",
    "wall.thickness_mm=3.0",
    "wall.foot_mm=9.0",
    "wall.allowance_mm=[0.12, 0.0]",
    "wall.elements=[4, 6]",
    "cutter.0.flute_length_mm=16.0",
    "operation.0.scallop_um=8.0",
    "operation.0.depth_max_mm=0.12",
    "operation.0.step_mm=3.0",
    "operation.0.layer_mm=0.25",
    "operation.0.corner_slices=40",
    "operation.0.reserve=0.1",
    "operation.0.refine=false",
    "operation.0.least_error=false",
    "operation.0.compensate_um=0.0",
    "limits.deflection_workpiece_um=80.0",
)
BARREL = ("cutter.0.corner_radius_mm=1.5", "cutter.0.barrel_radius_mm=40.0", "operation.0.lean_deg=78.5")


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = copy_example("plate", tmp_path_factory.mktemp("barrel") / "plate")
    return {name: run_job(load_job(folder / "job.toml", (*SMALL, *more))) for name, more in
            (("ball", ()), ("barrel", BARREL))}  # fmt: skip


def test_rows_follow_the_radius_of_the_arc(finished) -> None:
    """2 sqrt(2 R h - h^2) between rows: sqrt(10) times that of the ball of 4 mm but for h^2."""
    own = {name: done.result.operations[0] for name, done in finished.items()}
    for name, r in (("ball", 4.0), ("barrel", 40.0)):
        assert own[name]["step_over_mm"] == pytest.approx(2.0 * math.sqrt(2.0 * r * 0.008 - 0.008**2), rel=1e-9)
    once = {name: one["variants"]["variable"] for name, one in own.items()}
    assert once["barrel"]["passes"] == once["ball"]["passes"] == 1
    assert once["barrel"]["time_min"] < 0.6 * once["ball"]["time_min"]
    # the longer contact of the arc costs force
    assert once["barrel"]["force_normal_n_max"] > 1.1 * once["ball"]["force_normal_n_max"]


def test_the_simulation_confirms_the_plan(finished) -> None:
    """No gouge, the scallop that the rows leave, at most the planned force, the limit."""
    for name, done in finished.items():
        one = done.result.operations[0]["variants"]["variable"]
        assert one["gouge_um"] <= 8.0, name
        assert one["left_um"] < 8.0 + 2.0, name  # scallop, and tolerance of the edges of layers
        assert 0.8 < one["force_over_planned"]["median"] < 1.05, name
        assert one["deflection_workpiece_um_max"] < 80.0, name
        assert done.result.verdict is Verdict.HOLDS, name
