"""The public names of chipload, and its functions on values against the same job as a file."""

from __future__ import annotations

import inspect
import json
import subprocess
import sys
import tomllib
import typing
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

import chipload
from chipload.examples import copy_example
from chipload.jobs import CAPABILITIES, job_of, load_job
from chipload.result.summary import summary_bytes

MILL = {
    "number": 1, "diameter_mm": 10, "flutes": 4, "helix_deg": 30, "flute_length_mm": 22, "overhang_mm": 35,
    "modulus_gpa": 580,
}  # fmt: skip
OPERATION = {
    "kind": "contour", "cutter": 1, "side": "inside", "milling": "down", "strategies": ["backward"], "joint": "sharp",
    "radial_depth_mm": 0.1, "semifinish_depth_mm": 0.5, "axial_depth_mm": 5, "feed_mm_min": 600, "speed_rpm": 3000,
    "tolerance_mm": 0.05, "step_mm": 0.2, "lead_mm": 3, "clearance_mm": 5,
}  # fmt: skip
LIMITS = {"engagement_deg": 13, "force_xy_n": 450, "torque_nm": 2, "form_error_um": 6}
JOB = {
    "part": {"file": "corner.dxf", "units_if_unstated": "mm"}, "stock": {"top_mm": 0.0}, "machine": {"name": "vmc"},
    "material": {"name": "al7075-carbide"}, "cutter": [chipload.Cutter(**MILL)],
    "operation": [OPERATION], "limits": LIMITS,
}  # fmt: skip
BLOCK = chipload.Stock.block((0, 0, -12), (60, 40, 0))


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("api") / "corner"
    copy_example("contour", out)
    return out


def values(folder: Path, **changed) -> dict:
    """Arguments of ``plan_contour`` for the contour of the example."""
    contours = chipload.read_dxf(folder / "corner.dxf", units_if_unstated="mm").contours
    return {
        "contours": contours, "stock": 0.0, "cutters": chipload.Cutter(**MILL), "material": "al7075-carbide",
        "machine": "vmc", "limits": chipload.ContourLimits(**LIMITS), "operations": chipload.Operation(**OPERATION),
        **changed,
    }  # fmt: skip


@pytest.fixture(scope="module")
def plan(folder):
    return chipload.plan_contour(**values(folder))


# -- names ------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("name", chipload.__all__)
def test_every_name_is_there_documented_and_typed(name):
    value = getattr(chipload, name)
    assert name in dir(chipload)
    if inspect.isfunction(value):
        parts = inspect.signature(value)
        assert parts.return_annotation is not inspect.Signature.empty
        assert all(p.annotation is not inspect.Parameter.empty for p in parts.parameters.values())
    if not isinstance(value, typing.Mapping):
        assert inspect.getdoc(value)


def test_version_and_unknown_names():
    assert chipload.__version__.count(".") >= 1
    with pytest.raises(AttributeError, match="has no attribute 'plan_gear'"):
        chipload.plan_gear  # noqa: B018


@pytest.mark.parametrize(
    ("code", "absent"),
    [
        ("import chipload", "numpy pydantic plotly OCP nicegui trimesh numba scipy"),
        ("from chipload import plan_contour, run_job, read_machine", "numpy pydantic plotly OCP nicegui trimesh numba"),
        ("from chipload import simulate", "plotly OCP nicegui ezdxf pandas matplotlib"),
        ("from chipload import tooth_forces, undeformed_chip, fit", "plotly OCP nicegui trimesh ezdxf pandas shapely"),
        ("from chipload import Cutter, Material, Machine", "plotly OCP nicegui trimesh numba"),
    ],
)
def test_imports_are_late(code, absent):
    show = f"{code}; import sys; print([m for m in {absent.split()} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", show], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# -- values and files -------------------------------------------------------------------------------------------
def test_values_give_the_operations_of_the_job_file(folder, plan, tmp_path):
    lines = ["[part]", 'file = "corner.dxf"', 'units_if_unstated = "mm"', "[stock]", "top_mm = 0.0"]
    lines += ["[machine]", 'name = "vmc"', "[material]", 'name = "al7075-carbide"']
    for head, table in (("[[cutter]]", MILL), ("[[operation]]", OPERATION), ("[limits]", LIMITS)):
        lines += [head, *(f"{key} = {json.dumps(value)}" for key, value in table.items())]
    path = folder / "same.toml"
    path.write_text("\n".join(lines))
    of_file = chipload.run_job(path)
    own, written = (json.loads(summary_bytes(x.result, {})) for x in (plan, of_file))
    assert json.dumps(own["operations"]) == json.dumps(written["operations"])
    assert own["limits"] == written["limits"]
    assert own["tracks"] == written["tracks"]
    assert (own["job"], written["job"]) == ("contour", "same")
    assert {k: v for k, v in own["provenance"].items() if k != "inputs"} == {
        k: v for k, v in written["provenance"].items() if k != "inputs"
    }
    assert chipload.run_job(tomllib.loads(path.read_text()), folder=folder).result.operations == plan.result.operations


def test_a_result_is_written_and_read_back(plan, tmp_path):
    out = chipload.write_result(plan, tmp_path / "out")
    again = chipload.load_result(out)
    assert again.verdict is plan.result.verdict
    assert again.message == plan.result.message
    assert [t.programs for t in again.tracks] == [t.programs for t in plan.result.tracks]
    assert isinstance(again.tracks[0], chipload.Track)
    assert all(isinstance(check, chipload.LimitCheck) for check in again.limits)
    assert plan.result.message in repr(plan)


def test_the_hash_is_that_of_the_values(folder):
    tables = tomllib.loads((folder / "job.toml").read_text())
    other = {**tables, "limits": {**tables["limits"], "engagement_deg": 14.0}}
    sources = {job_of(x, folder).source for x in (tables, dict(reversed(tables.items())), other)}
    assert len(sources) == 2
    assert load_job(folder / "job.toml").source.startswith("job.toml sha256 ")


def test_a_job_of_values_is_checked(folder):
    tables = tomllib.loads((folder / "job.toml").read_text())
    lines, holds = chipload.check_job(tables, folder=folder)
    assert holds
    assert lines[0].startswith("contour: valid: 0 closed and 1 open contours")


# -- refused ----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"operation": {**OPERATION, "feed_mm_min": float("nan")}}, r"feed_mm_min = nan: must be a finite number"),
        ({"stock": {"top_mm": np.float64("nan")}}, r"stock.top_mm = nan: must be a finite number"),
        ({"limits": {"engagement_deg": float("inf")}}, r"limits.engagement_deg = inf: must be a finite number"),
        ({"limits": {"engagement": 13.0}}, r"limits.engagement: unknown key; did you mean engagement_deg"),
        ({"limits": {}}, r"limits: none is stated"),
        ({"cutter": {**MILL, "diameter": 10.0}}, r"cutter.0.diameter: unknown key; did you mean diameter_mm"),
        ({"cutter": []}, r"cutter: has no entry"),
        ({"machine": {"name": "vmx"}}, r"machine vmx: not known: the nearest is"),
        ({"part": {"file": "corner.pdf"}}, r"must end in .dxf, .step or .stp"),
        ({"stock": {"top_mm": object()}}, r"object: is not a value that a job can hold"),
    ],
)
def test_refused_tables(folder, change, says):
    tables = {**JOB, **change}
    for key in ("cutter", "operation"):
        tables[key] = tables[key] if isinstance(tables[key], list) else [tables[key]]
    with pytest.raises(chipload.InputError, match=says):
        chipload.run_job(tables, folder=folder)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"operations": OPERATION}, r"operation.0: str: must be a chipload.Operation"),
        ({"operations": chipload.Operation(**{**OPERATION, "kind": "pocket"})}, r"kind = 'pocket': must be one of"),
        ({"limits": LIMITS}, r"limits: dict: must be a chipload.ContourLimits"),
        ({"limits": chipload.ContourLimits()}, r"limits: none is stated"),
        ({"cutters": []}, r"cutter: has no entry"),
        ({"stock": float("nan")}, r"stock.top_mm = nan: must be a finite number"),
        ({"machine": "vmx"}, r"machine vmx: not known: the nearest is"),
        ({"checks": chipload.CheckSettings(loose_stock=False)}, r"checks.loose_stock: is made of a simulated program"),
    ],
)
def test_refused_values(folder, change, says):
    with pytest.raises(chipload.InputError, match=says):
        chipload.plan_contour(**values(folder, **change))


def test_a_pocket_is_no_contour(folder):
    with pytest.raises(chipload.InputError, match="must be 'pocket'"):
        chipload.plan_pocket(**values(folder))


def test_new_feeds_need_their_range(folder):
    with pytest.raises(chipload.InputError, match=r"operation.0.feeds: missing"):
        chipload.optimise_feeds(
            program="a.ngc", stock={}, machine="vmc", material="al7075-t6", cutter=JOB["cutter"],
            operation={"kind": "simulate", "step_mm": 1.0}, limits={"force_n": 100.0},
        )  # fmt: skip


def test_a_cutter_refuses_what_is_no_number():
    with pytest.raises(ValidationError, match="diameter_mm"):
        chipload.Cutter(**{**MILL, "diameter_mm": float("nan")})
    with pytest.raises(ValidationError, match="diameter"):
        chipload.Cutter(**MILL, diameter=10.0)


# -- programs ---------------------------------------------------------------------------------------------------
def test_a_program_runs_with_the_cutter_of_a_job(tmp_path):
    copy_example("notebooks", tmp_path / "n")
    file = tmp_path / "n" / "corner.ngc"
    machine = chipload.read_machine("vmc")
    reading = chipload.read_program(file, machine)
    assert isinstance(reading.program, chipload.Program)
    assert len(chipload.read_program(file, "vmc").program) == len(reading.program)
    runs = [
        chipload.simulate(
            file, BLOCK, cutters, chipload.read_material("al7075-t6"), machine, chipload.Limits(force_n=800), step_mm=4
        )
        for cutters in (chipload.Cutter(**MILL), [chipload.Cutter(**MILL)])
    ]
    assert isinstance(runs[0], chipload.Result)
    assert runs[0].stock.volume() < 60.0 * 40.0 * 12.0
    for other in runs[1:]:
        assert np.array_equal(runs[0]["force_n"], other["force_n"])
    assert set(runs[0].columns) <= set(chipload.COLUMNS)


# -- tables -----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("function", "capability"),
    [
        ("plan_impeller", "impeller"), ("plan_thin_wall", "thinwall"), ("hold_torque", "torque"),
        ("optimise_feeds", "feeds"),
    ],
)  # fmt: skip
def test_every_table_of_the_job_is_a_parameter(function, capability):
    (root,) = (c.root for c in CAPABILITIES if c.name == capability)
    assert set(inspect.signature(getattr(chipload, function)).parameters) - {"folder", "progress"} == set(
        root.model_fields
    )


def test_a_check_that_is_switched_off_is_stated(folder):
    done = chipload.plan_contour(**values(folder, checks=chipload.CheckSettings(cutter_strength=False)))
    assert "cutter_stress_mpa" not in {limit.name for limit in done.result.limits}
    assert any("cutter_strength" in text for text in done.result.unchecked)
