"""Form error of a stated part while a program is simulated, against bars in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

import chipload
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from engagement.tooth_paths import Cut, greatest_wall_error

#: where h = 0 the edge alone pushes along the normal: a known force, whatever is cut
EDGE = Material("edge", 1000.0, 0.0, 0.0, 0.0, 20.0, 0.0, source="made up for this test")
MILL = Cutter(10.0, 4, 0.0, 20.0, 30.0, 6e5)
DEPTH = 4.0
RIGID = dict.fromkeys(
    ("holder_gpa", "grip_n_um", "grip_nm_rad", "spindle_n_um", "spindle_nm_rad", "work_n_um"), math.inf
)


def walled(rows=(0.0,), width=1.5, limits=None, part_z=(-6.0, 0.0), **stiffness):
    """A wall at y = 0 whose material lies below it; the cutter goes along x, climb, each row so far from it."""
    parts = [rapid([-10.0, 30.0, 5.0], 300.0, 1, "link")]
    for gap in rows:
        y = MILL.radius + gap
        parts += [rapid([[-10.0, y, 5.0], [-10.0, y, -DEPTH]], 300.0, 1, "link")]
        parts += [plunge([40.0, y, -DEPTH], 20.0, 300.0, 1, "cut"), rapid([40.0, y, 5.0], 300.0, 1, "link")]
    wall = trimesh.creation.box(bounds=[[0.0, -8.0, part_z[0]], [30.0, 0.0, part_z[1]]])
    return chipload.simulate(
        Program.join(parts), chipload.Stock.block((0.0, -8.0, part_z[0]), (30.0, width, 0.0), 0.5), MILL, EDGE, "vmc",
        chipload.Limits(form_error_um=50.0) if limits is None else limits, part=chipload.FinishedPart(wall, 1.0),
        stiffness=chipload.MachineStiffness(**(RIGID | stiffness)),
        settings=chipload.SimulationSettings(2.0, tolerance_mm=1e-4, flank_mm=0.5),
    )  # fmt: skip


def bar(z: float) -> float:
    """Motion [mm] at z of the clamped bar under 20 N/mm from 0 to the depth: by sums over the load and the bar."""
    a = (np.arange(1000) + 0.5) * DEPTH / 1000
    h = (np.arange(3000) + 0.5) * 30.0 / 3000
    moment = np.where(h[:, None] > a, h[:, None] - a, 0.0).sum(axis=1) * DEPTH / 1000
    stiff = np.where(h < 20.0, 6e5 * math.pi * 8.0**4 / 64.0, 6e5 * math.pi * 10.0**4 / 64.0)
    return float(20.0 * (moment * np.where(h > z, h - z, 0.0) / stiff).sum() * 30.0 / 3000)


def test_the_wall_is_left_as_far_out_as_a_bar_bends() -> None:
    history = walled()
    said = history.numbers["form_error_um"]
    assert said["points"] > 100
    # greatest at the tip, between two points of the part
    assert said["max"] == said["greatest"] == pytest.approx(1e3 * bar(0.0), rel=2e-3)
    # nothing is taken from the wall, and higher up less is left
    assert said["least"] >= 0.0
    error = history["form_error_um"][history["form_points"] > 0.0]
    assert (error > 1e3 * bar(DEPTH)).all()
    assert history.verdict == "holds"
    assert history.limits[0].name == "form_error_um"


def test_the_work_gives_way_too_and_what_is_not_stated_is_unproven() -> None:
    history = walled(work_n_um=40.0)
    # 20 N/mm over 4 mm against 40 N/um
    assert history.numbers["form_error_um"]["max"] == pytest.approx(1e3 * bar(0.0) + 80.0 / 40.0, rel=2e-3)
    history = walled(limits=chipload.Limits(form_error_um=0.1))
    assert history.verdict == "exceeds"
    _, marks = history.plot("form_error_um").data
    assert len(marks.y) == (np.abs(history["form_error_um"]) > 0.1).sum()
    assert history.message.startswith("Exceeds: form error ")


def test_roughing_finishes_nothing_and_the_last_row_makes_the_wall() -> None:
    rough = walled(rows=(0.5,), width=2.0)
    assert rough.numbers["form_error_um"] == {
        "max": None, "greatest": None, "least": None, "line": 0, "place": None, "points": 0,
    }  # fmt: skip
    assert rough.verdict == "unproven"
    assert "no point of the part is finished" in rough.message
    both = walled(rows=(0.5, 0.0), width=2.0)
    made = both["form_points"] > 0.0
    assert (np.abs(both["y_mm"][made] - MILL.radius) < 1e-9).all()
    assert both.numbers["form_error_um"]["max"] == pytest.approx(1e3 * bar(0.0), rel=2e-3)


def test_an_edge_of_the_part_is_no_surface() -> None:
    """The wall ends 2 mm below the stock's top: points on that edge face the sky as much as the tool."""
    history = walled(part_z=(-6.0, -2.0))
    left = history.program.simulated.left
    x, y, z = left.points.T
    wall = (np.abs(y) < 1e-9) & (x > 1e-9) & (x < 30.0 - 1e-9) & (z >= -DEPTH)
    inside = wall & (z < -2.0 - 1e-9)
    assert (left.over & wall & ~inside).any()
    # where the tip goes along, its sharp corner may leave a point to no step
    above = inside & (z > -DEPTH + 1e-9)
    assert above.sum() <= history.numbers["form_error_um"]["points"] <= inside.sum()
    assert history.numbers["form_error_um"]["max"] == pytest.approx(1e3 * bar(0.0), rel=2e-3)


@pytest.mark.parametrize(
    ("cut", "overhang"),
    [(Cut(10.0, 4, 30.0, 12.0, 0.5, 0.05, up=False), 30.0), (Cut(8.0, 3, 45.0, 9.0, 0.3, 0.04, up=False), 32.0)],
)
def test_the_greatest_error_of_a_helical_wall_is_that_of_every_slice(cut: Cut, overhang: float) -> None:
    """Points of the part 1 mm apart miss corners of the error along the edge: 2 to 3 % low without a search between."""
    K = (800.0, 300.0, 150.0, 20.0, 15.0, 5.0)
    known = greatest_wall_error(cut, K, overhang, 6e5)
    mill = Cutter(cut.D, cut.N, math.radians(cut.helix), cut.ap + 2.0, overhang, 6e5)
    feed, y = cut.fz * cut.N * 300.0 / math.tau, mill.radius
    path = [[-10.0, 30.0, 5.0], [-10.0, y, 5.0], [-10.0, y, -cut.ap]]
    program = Program.join([rapid(path, 300.0, 1, "link"), plunge([20.0, y, -cut.ap], feed, 300.0, 1, "cut")])
    low = -cut.ap - 3.0
    wall = trimesh.creation.box(bounds=[[0.0, -8.0, low], [12.0, 0.0, 0.0]])
    found = chipload.simulate(
        program, chipload.Stock.block((0.0, -8.0, low), (12.0, cut.ae, 0.0)), mill,
        Material("m", *K, source="made up"), "vmc", chipload.Limits(form_error_um=500.0),
        part=chipload.FinishedPart(wall, 1.0), stiffness=chipload.MachineStiffness(**RIGID),
        settings=chipload.SimulationSettings(1.0),
    )  # fmt: skip
    assert found.numbers["form_error_um"]["max"] == pytest.approx(1e3 * known, rel=5e-3)
