"""Jobs whose passes follow the rows of the user's own finishing program: read back, a foreign zigzag, refusals."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.examples import copy_example
from chipload.jobs import load_job, run_job
from chipload.jobs.thinwall.inputs import read_wall
from chipload.jobs.thinwall.part_shape import part_of_faces
from chipload.jobs.thinwall.places import places_of
from chipload.jobs.thinwall.program_rows import side_at
from chipload.jobs.thinwall.tries import Tried, unlimited_plan
from chipload.jobs.thinwall.wall_program import link_pass_programs
from chipload.planning.thinwall.read_rows import sides_of_program
from chipload.planning.thinwall.variants import DepthOperation, even, limited_to
from chipload.program.apt.writer import write_apt
from chipload.program.program import LINE, RAPID, Program
from chipload.program.release import NOT_SIMULATED
from chipload.progress import silent
from chipload.report.folder import write_result

#: 5 mm above the foot in rows of 1 mm
SMALL = (
    "wall.length_mm=8.0",
    "wall.height_mm=9.0",
    "wall.thickness_mm=1.7",
    "wall.foot_mm=4.0",
    "wall.allowance_mm=[0.3, 0.0]",
    "wall.elements=[4, 5]",
    "limits.deflection_workpiece_um=70.0",
    "operation.0.layer_mm=0.3",
    "operation.0.corner_slices=60",
    "operation.0.least_error=false",
    "operation.0.refine=false",
    "operation.0.reserve=0.15",
)
GIVEN = ("milling", "lean_deg", "lead_deg", "scallop_um", "compensate_um")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    made = copy_example("plate", tmp_path_factory.mktemp("wall") / "plate")
    text = (made / "job.toml").read_text()
    (made / "planned.toml").write_text(text.replace("scallop_um = 20.0", "step_over_mm = 1.0"))
    kept = [line for line in text.splitlines() if not line.startswith(GIVEN)]
    (made / "rows.toml").write_text("\n".join(kept).replace("cutter = 1\n", 'cutter = 1\nrows = "finish.apt"\n'))
    return made


def zigzag() -> str:
    """CL data to and fro over the side towards -y of the plate, 45 deg from its normal, from the free edge down."""
    lines = [
        "PARTNO/ZIGZAG",
        "UNITS/MM",
        "MULTAX/ON",
        "CUTTER/8.0,4.0",
        "LOADTL/1",
        "SPINDL/3000,CLW",
        "FEDRAT/500,MMPM",
    ]
    s = math.sqrt(0.5)
    for k, z in enumerate(np.linspace(9.0, 4.0, 6)):
        ends = [-12.0, 12.0] if k % 2 == 0 else [12.0, -12.0]
        ball = np.array([[x, -0.85 - 4.0, z] for x in ends])
        tip = ball - 4.0 * np.array([0.0, -s, s])
        text = [f"{x:.6f},{y:.6f},{z:.6f},0,{-s:.9f},{s:.9f}" for x, y, z in tip]
        lines += ["RAPID", f"GOTO/{text[0]}", f"GOTO/{text[1]}"]
    return "\n".join([*lines, "RAPID", "GOTO/0,-40,40,0,0,1", "FINI", ""])


def planned(job, even_stock: bool):
    """A plan by the law alone, before anything is simulated."""
    inputs = read_wall(job)
    places = places_of(inputs)
    ones = tuple(np.ones(places.shape) for _ in places.surfaces)
    made = [
        DepthOperation(
            places.threshold(o.depths.deflection, o.depths.factor),
            o.depths.even_law if even_stock else o.depths.law,
            o.leave,
            o.depths.slope,
            ones,
        )
        for o in inputs.operations
    ]
    limited = even if even_stock else limited_to
    return inputs, places, limited(places.surfaces, made, inputs.depths.deflection)


def program(inputs, places, plan) -> Program:
    return Program.join([leg.program for leg in link_pass_programs(inputs, plan.plan, places.grid)])


@pytest.mark.parametrize("side", ["[0.3, 0.0]", "[0.3, 0.3]"])
def test_a_program_of_constant_depth_read_back_gives_the_same_plan(folder, side):
    """Only its last pass touches the finished side; the same rows, law, places, depths and path."""
    change = (*SMALL, f"wall.allowance_mm={side}")
    own = planned(load_job(folder / "planned.toml", change).job, True)
    text = write_apt(program(*own), {1: own[0].cut.cutter}, title="own", release=NOT_SIMULATED)
    (folder / "finish.apt").write_text(text)
    asked = load_job(folder / "rows.toml", change).job
    again = planned(asked, True)
    assert again[0].cut.step_over == pytest.approx(-1.0, abs=1e-6)
    assert again[0].cut.posture.axis == pytest.approx(own[0].cut.posture.axis, abs=1e-7)
    np.testing.assert_allclose(program(*again).p_work, program(*own).p_work, atol=1e-6)
    variable = [planned(load_job(folder / f"{name}.toml", change).job, False)[2] for name in ("planned", "rows")]
    assert len(variable[0].plan.passes) == len(variable[1].plan.passes)
    for one, other in zip(*(v.plan.passes for v in variable), strict=True):
        assert one.side == other.side
        np.testing.assert_allclose(one.low, other.low, atol=1e-6)


def test_forces_along_a_foreign_zigzag(folder):
    """Variable depths along rows to and fro, simulated: the law of both senses bounds the force of even the worst step;
    the program keeps the sense and the axes of the rows."""
    (folder / "finish.apt").write_text(zigzag())
    inputs, places, plan = planned(load_job(folder / "rows.toml", (*SMALL, "wall.allowance_mm=[0.0, 0.3]")).job, False)
    assert {pose[0] for pose in inputs.operations[0].rows.stands} == {-1, 1}
    one = Tried(places, silent).prove(plan, 1.0)
    c = one.columns
    cuts = (c["force_normal_n"] > 0.0) & (c["depth_mm"] >= 0.04)
    ratio = c["force_normal_n"][cuts] / c["force_normal_planned_n"][cuts]
    assert np.median(ratio) > 0.5
    assert ratio.max() < 1.05
    lines = one.program.motion == LINE
    leant = np.tile([0.0, -math.sqrt(0.5), math.sqrt(0.5)], (lines.sum(), 1))
    np.testing.assert_allclose(one.program.axis[lines], leant, atol=1e-8)
    way = np.diff(one.program.p_work[:, 0])[lines[1:] & lines[:-1]]
    assert (way > 1.0).any()
    assert (way < -1.0).any()
    # the finished surface is that of the rows: nothing is cut into it, nothing but scallops is left
    assert one.shape.gouge < 0.01
    assert np.abs(one.finish[0].rigid[one.finish[0].made]).max() < 0.04


def test_a_job_with_rows(folder, tmp_path):
    """The whole job, with a limit that one pass keeps."""
    (folder / "finish.apt").write_text(zigzag())
    change = ("wall.allowance_mm=[0.0, 0.3]", "limits.deflection_workpiece_um=300.0", "operation.0.layer_mm=0.4")
    done = run_job(load_job(folder / "rows.toml", (*SMALL, *change)))
    write_result(done.result, done.presentation, tmp_path / "out")
    numbers = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert numbers["operations"][0]["operations"][0]["rows"] == "finish.apt"
    assert numbers["operations"][0]["step_over_mm"] == pytest.approx(1.0, abs=1e-5)
    assert any("finish.apt" in str(name) for name in numbers["provenance"]["inputs"].values())


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (
            ("operation.0.lean_deg=40.0",),
            "operation.0.lean_deg: not used with operation.0.rows, whose program gives it",
        ),
        (("operation.0.scallop_um=40.0",), "operation.0.scallop_um: not used with operation.0.rows"),
        (('operation.0.rows="none.apt"',), "none.apt: cannot be read"),
    ],
)
def test_refused(folder, change, text):
    (folder / "finish.apt").write_text(zigzag())
    with pytest.raises(InputError) as err:
        read_wall(load_job(folder / "rows.toml", (*SMALL, *change)).job)
    assert text in str(err.value)


def test_a_side_without_rows(folder):
    """Stock on both sides, rows on one."""
    (folder / "finish.apt").write_text(zigzag())
    with pytest.raises(InputError, match=r"operation.0.rows = finish.apt: side 1: 0 rows touch the finished surface"):
        read_wall(load_job(folder / "rows.toml", (*SMALL, "wall.allowance_mm=[0.3, 0.3]")).job)


def test_an_upright_ball_is_refused(folder):
    """Of a cutter that stands upright along the wall the flank cuts at any depth."""
    upright = zigzag().replace(f"0,{-math.sqrt(0.5):.9f},{math.sqrt(0.5):.9f}", "0,0,1")
    shifted = "\n".join(
        f"GOTO/{p[0]},-4.85,{float(p[2]) - 4.0 + 4.0 * math.sqrt(0.5):.6f},0,0,1"
        if len(p := line[5:].split(",")) == 6 and line.startswith("GOTO/") and "-40" not in line
        else line
        for line in upright.splitlines()
    )
    (folder / "finish.apt").write_text(shifted)
    with pytest.raises(InputError, match=r"side 1: the cutter's axis leans by 90 deg from the normal of the side"):
        read_wall(load_job(folder / "rows.toml", (*SMALL, "wall.allowance_mm=[0.0, 0.3]")).job)


def test_rows_on_the_walls_of_a_part(tmp_path):
    """Of the example: rows of a ball put on each side, 45 deg from its normal, are found where they were put."""
    shape = part_of_faces(load_job(copy_example("part", tmp_path / "part") / "walls.toml").job)
    ball = Cutter(6.0, 2, 0.5, 8.0, 30.0, 6e5, corner_radius=3.0)
    v, u = (x.ravel() for x in np.meshgrid(np.linspace(1.0, 0.0, 9), np.linspace(0.0, 1.0, 7), indexing="ij"))
    tips, axes = [], []
    for point, normal in zip(shape.sides(u, v), shape.normals(u, v), strict=True):
        axis = (normal + np.array([0.0, 0.0, 1.0])) / math.sqrt(2.0)
        tips.append(point + 3.0 * normal - 3.0 * axis)
        axes.append(axis)
    tip, axis = np.concatenate(tips), np.concatenate(axes)
    motion = np.where(np.arange(len(tip)) % 7 == 0, RAPID, LINE)
    path = Program(
        motion=motion, p_work=tip, axis=axis, centre=0.0 * tip, normal=np.tile([0.0, 0.0, 1.0], (len(tip), 1)),
        turns=0 * motion, feed=10.0 * (motion == LINE), spindle=np.full(len(tip), 300.0), tool=1 + 0 * motion,
        line=np.arange(len(tip)), label=0 * motion, labels=("finish",),
    )  # fmt: skip
    sides = [side_at(shape, k) for k in range(len(shape.each))]
    found, _ = sides_of_program(path, ball, sides, 0.0, 100.0, "finish.apt")
    assert len(found) == len(shape.each) > 1
    for side in found:
        np.testing.assert_allclose(np.concatenate([row.u for row in side.rows]), u, atol=1e-6)
        np.testing.assert_allclose(np.concatenate([row.v for row in side.rows]), v, atol=1e-6)


def test_planned_rows_need_their_keys(folder):
    text = (folder / "planned.toml").read_text().replace("lean_deg = 45.0\n", "")
    (folder / "less.toml").write_text(text)
    with pytest.raises(InputError) as err:
        load_job(folder / "less.toml")
    assert "operation.0.lean_deg: missing: state it, or a finishing program as operation.0.rows" in str(err.value)


def test_depth_of_all_is_planned_for_rows(folder):
    """The check of a job lays the greatest depth along the rows."""
    (folder / "finish.apt").write_text(zigzag())
    inputs = read_wall(load_job(folder / "rows.toml", (*SMALL, "wall.allowance_mm=[0.0, 0.3]")).job)
    places = places_of(inputs)
    (leg,) = link_pass_programs(inputs, unlimited_plan(places).plan, places.grid)
    assert leg.points[leg.contact][:, 1] == pytest.approx(-0.85, abs=1e-7)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda lines: [*lines[:2], "GOTARC/1,2,3", *lines[2:]], "line 3: GOTARC"),
        (lambda lines: [x for x in lines if not x.startswith("UNITS")], "line 8: no UNITS before it"),
    ],
)
def test_findings_of_the_text_of_the_rows_are_findings_of_the_job(folder, change, text):
    """A statement that is not read, and no unit. The line is of the text of the rows, not of a program of the job."""
    keys = (*SMALL, "wall.allowance_mm=[0.0, 0.3]")
    lines = zigzag().splitlines()
    (folder / "finish.apt").write_text("\n".join(lines) + "\n")
    plain = read_wall(load_job(folder / "rows.toml", keys).job).findings
    (folder / "finish.apt").write_text("\n".join(change(lines)) + "\n")
    (found,) = (f for f in read_wall(load_job(folder / "rows.toml", keys).job).findings if f not in plain)
    assert found.line == 0
    assert found.text.startswith(f"operation.0.rows = finish.apt: {text}")
