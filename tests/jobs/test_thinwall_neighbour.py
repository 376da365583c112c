"""What stands beside one wall: tools that run into it, by where the axis of the cutter is."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from chipload.errors import InputError
from chipload.examples import copy_example
from chipload.jobs import load_job
from chipload.jobs.thinwall.inputs import read_wall
from chipload.jobs.thinwall.neighbours import wall_collisions
from chipload.jobs.thinwall.places import places_of
from chipload.jobs.thinwall.tries import unlimited_plan
from chipload.jobs.thinwall.wall_program import link_pass_programs


def with_neighbour(folder, gap, change=()):
    """A box of 6 mm beside the side towards +y, ``gap`` [mm] from the finished wall, and the job with it."""
    text = (folder / "flank.toml").read_text()
    path = folder / "beside.toml"
    path.write_text(
        text.replace("[workpiece]", '[[neighbour]]\nfile = "beside.stl"\nunits = "mm"\nspacing_mm = 0.5\n\n[workpiece]')
    )
    side = float(read_wall(load_job(folder / "flank.toml").job).body.shape.sides(0.5, 0.5)[0][..., 1])
    box = trimesh.creation.box(bounds=[[-5.0, side + gap, 2.0], [25.0, side + gap + 6.0, 16.0]])
    box.export(folder / "beside.stl")
    return load_job(path, change), side


def found(loaded):
    inputs = read_wall(loaded.job)
    places = places_of(inputs)
    legs = link_pass_programs(inputs, unlimited_plan(places).plan, places.grid)
    return legs, wall_collisions(inputs, legs)


@pytest.fixture
def folder(tmp_path):
    return copy_example("plate", tmp_path / "plate")


def test_a_cutter_that_goes_through_the_channel(folder):
    """The axis of the upright cutter is 4 mm beside the wall, 5.5 mm in links: a box 9 mm away is hit by links alone,
    as far as they lie nearer to it than the radius. The way out leans away from the wall: 13 mm away nothing is hit."""
    loaded, side = with_neighbour(folder, 9.0)
    legs, touched = found(loaded)
    assert {c.into for c in touched} == {"neighbour 0"}
    leg = next(leg for leg in legs if leg.program.p_work[:, 1].mean() > side)
    y = leg.program.p_work[:, 1]
    low = leg.program.p_work[:, 2] < 15.0
    inside = np.where(low & np.roll(low, 1), 4.0 - (side + 9.0 - y), 0.0)
    lines = {int(n) for n in leg.program.line[inside > 0.01]}
    assert lines
    cut = {c.line: c.depth_mm for c in touched if c.what == "cutting part"}
    assert lines <= set(cut)
    assert max(cut[n] for n in lines) == pytest.approx(inside.max(), abs=0.06)
    loaded, _ = with_neighbour(folder, 13.0)
    assert found(loaded)[1] == ()


def test_a_holder_that_comes_down_on_the_wall(folder):
    """The holder ends 13 mm above the tip, the rows go down to 12 mm below the free edge: it stays above the wall, and
    runs into a neighbour beside it that is higher."""
    short = ("cutter.0.overhang_mm=13.0", "cutter.0.flute_length_mm=13.0", "cutter.0.holder_mm=[[10.0, 24.0]]")
    loaded, _ = with_neighbour(folder, 14.5, short)
    _, touched = found(loaded)
    assert touched == ()
    vertices, faces = read_wall(loaded.job).neighbour_meshes["neighbour 0"]
    assert np.ptp(vertices, axis=0).tolist() == pytest.approx([30.0, 6.0, 14.0])
    assert len(faces) == 12
    path = folder / "beside.stl"
    high = trimesh.load(path)
    high.apply_translation([0.0, 0.0, 6.0])
    high.export(path)
    _, touched = found(load_job(folder / "beside.toml", short))
    assert {(c.what, c.into) for c in touched} == {("shank or holder", "neighbour 0")}
    assert all(np.isfinite(c.depth_mm) and c.depth_mm > 0.0 for c in touched)


def test_a_part_has_its_own_neighbours(folder, tmp_path):
    part = copy_example("part", tmp_path / "part") / "walls.toml"
    path = part.with_name("more.toml")
    path.write_text(
        part.read_text().replace("[workpiece]", '[[neighbour]]\nfile = "ribs.step"\nspacing_mm = 1.0\n\n[workpiece]')
    )
    with pytest.raises(InputError, match=r"neighbour: for one \[wall\] only"):
        load_job(path)
