"""`chipload init` of an STL: the pockets of one floor, whose outline is written as a drawing beside the job."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import pytest
import shapely
import trimesh

from chipload.jobs import check_job, load_job
from command import call

#: chords of a quarter circle, radius [mm] of corners and of the island
QUARTER, CORNER, ISLAND = 24, 5.0, 4.0


def chord_share(chords: int) -> float:
    """Area of a regular polygon over that of its circle."""
    return math.sin(2.0 * math.pi / chords) * chords / (2.0 * math.pi)


@pytest.fixture
def housing(tmp_path: Path) -> Path:
    """A block of 60 x 40 x 15 mm with a pocket 50 x 30 x 10 mm around an island, at x + 100."""
    pocket = shapely.box(10.0, 10.0, 50.0, 30.0).buffer(CORNER, quad_segs=QUARTER)
    pocket = pocket.difference(shapely.Point(30.0, 20.0).buffer(ISLAND, quad_segs=QUARTER))
    hollow = trimesh.creation.extrude_polygon(pocket, 11.0)
    hollow.apply_translation([0.0, 0.0, 5.0])
    block = trimesh.creation.box(bounds=[[0.0, 0.0, 0.0], [60.0, 40.0, 15.0]])
    part = trimesh.boolean.difference([block, hollow], engine="manifold")
    part.apply_translation([100.0, 0.0, 0.0])
    part.export(tmp_path / "housing.stl")
    return tmp_path / "housing.stl"


def test_a_mesh_is_the_pocket_of_its_floor(housing: Path) -> None:
    code, said, error = call("init", housing, housing.parent / "job")
    assert code == 0, error
    # a rectangle with round corners less the island, both of chords
    share = chord_share(4 * QUARTER)
    area = 50.0 * 30.0 - (4.0 - math.pi * share) * CORNER**2 - math.pi * share * ISLAND**2
    assert f"Clear the floor at z = 5 mm of housing.stl: {area:.4g} mm2" in said
    assert "found: 1 pocket" in said
    job = tomllib.loads((housing.parent / "job" / "job.toml").read_text())
    assert (job["part"]["file"], job["part"]["units"]) == ("housing-floor.dxf", "mm")
    assert job["stock"]["top_mm"] == 15.0
    assert job["operation"][0]["depth_mm"] == 10.0
    assert job["cutter"][0]["flute_length_mm"] > 10.0
    lines, _ = check_job(load_job(housing.parent / "job" / "job.toml"))
    assert any(line.startswith("operation 0: pocket, cutter 1") for line in lines)
    # the same mesh gives the same drawing
    first = (housing.parent / "job" / "housing-floor.dxf").read_bytes()
    call("init", housing, housing.parent / "again")
    assert (housing.parent / "again" / "housing-floor.dxf").read_bytes() == first


def test_a_mesh_without_a_pocket_is_refused_with_what_can_be_planned(tmp_path: Path) -> None:
    trimesh.creation.icosphere(subdivisions=2, radius=10.0).export(tmp_path / "ball.stl")
    code, _, said = call("init", tmp_path / "ball.stl", tmp_path / "job")
    assert code == 2
    assert "ball.stl: no pocket with a level floor and closed sides to plan from: export STEP or DXF" in said
    assert not (tmp_path / "job").exists()
