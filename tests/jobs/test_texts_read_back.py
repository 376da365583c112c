"""Texts of thin walls and of torque-controlled cuts are read back; those of left-hand cutters start by M4."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chipload.examples import copy_example
from chipload.jobs import load_job
from chipload.jobs.thinwall.inputs import read_wall
from chipload.jobs.thinwall.places import places_of
from chipload.jobs.thinwall.tries import unlimited_plan
from chipload.jobs.thinwall.wall_program import link_pass_programs, on_machine
from chipload.jobs.torque.cut import program_of
from chipload.jobs.torque.written_program import override_text
from chipload.machine.machine import machine_named
from chipload.program.gcode.writer import write_commands
from chipload.program.program import LINE, RAPID, Program
from chipload.program.read_back import text_findings
from chipload.program.release import NOT_SIMULATED
from torque_job import TUBE_JOB

LEFT = ("number = 1\n", "number = 1\nleft_hand = true\n")
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
)


def tube(folder: Path, left: bool) -> tuple[Program, str, dict]:
    folder.mkdir()
    (folder / "job.toml").write_text(TUBE_JOB.replace(*LEFT) if left else TUBE_JOB)
    job = load_job(folder / "job.toml").job
    machine = machine_named("vmc")
    program = program_of(job, machine)
    return program, override_text("tube", program, machine, NOT_SIMULATED), job.cutters


def test_the_round_of_a_left_hand_cutter_is_the_mirror_image(tmp_path: Path) -> None:
    (right, own, _), (left, text, cutters) = tube(tmp_path / "right", False), tube(tmp_path / "left", True)
    np.testing.assert_allclose(left.p_work, right.p_work * (1.0, -1.0, 1.0), atol=1e-9)
    assert (left.spindle == -right.spindle).all()
    assert " M3" in own
    assert " M4" in text
    assert text_findings(text, "0-override.ngc", machine_named("vmc"), cutters, left) == ()
    (wrong, *_) = text_findings(text.replace(" M4", " M3"), "0-override.ngc", machine_named("vmc"), cutters, left)
    assert wrong.code == "spindle-reversed"


def test_the_override_is_taken_before_the_first_motion(tmp_path: Path) -> None:
    _, text, _ = tube(tmp_path / "job", False)
    lines = text.splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("G0 "))
    assert "M52 P1" in lines[:first]


@pytest.fixture(scope="module")
def plate(tmp_path_factory) -> Path:
    made = copy_example("plate", tmp_path_factory.mktemp("wall") / "plate")
    text = (made / "job.toml").read_text()
    (made / "left.toml").write_text(text.replace(*LEFT))
    return made


def wall_text(path: Path) -> tuple[Program, str, dict, object]:
    inputs = read_wall(load_job(path, SMALL).job)
    places = places_of(inputs)
    program = Program.join(
        [leg.program for leg in link_pass_programs(inputs, unlimited_plan(places).plan, places.grid)]
    )
    commands = on_machine(inputs, program).commands
    machine = inputs.cut.machine
    text = write_commands(commands, machine, title="wall", release=NOT_SIMULATED)
    return program, text, {o.cut.cutter.number: o.cut.cutter for o in inputs.operations}, machine


@pytest.mark.parametrize("hand", ["job", "left"])
def test_the_text_of_a_wall_is_the_simulated_program(plate: Path, hand: str) -> None:
    program, text, cutters, machine = wall_text(plate / f"{hand}.toml")
    assert (" M4" in text) is (hand == "left")
    assert (" M3" in text) is (hand == "job")
    assert text_findings(text, "0.ngc", machine, cutters, program, lengths=True) == ()
    moved = program.p_work.copy()
    k = int(np.flatnonzero(program.motion == LINE)[len(program) // 3])
    moved[k] += (0.0, 0.2, 0.0)
    found = text_findings(text, "0.ngc", machine, cutters, replace(program, p_work=moved), lengths=True)
    assert [f.code for f in found] == ["text-differs"]


def test_down_milling_of_a_left_hand_cutter_has_the_rows_of_up_milling(plate: Path) -> None:
    left = wall_text(plate / "left.toml")[0]
    text = (plate / "job.toml").read_text()
    (plate / "up.toml").write_text(text.replace('milling = "down"', 'milling = "up"'))
    up = wall_text(plate / "up.toml")[0]
    np.testing.assert_allclose(left.p_work, up.p_work, atol=1e-9)
    cuts = up.motion != RAPID
    assert (left.spindle[cuts] == -up.spindle[cuts]).all()
