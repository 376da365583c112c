"""Parts with thin walls that must be refused, each with its exact message, before anything is simulated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from command import call

PROGRAM = "%\nG21 G90 G17 G54\nT1 M6\nS6000 M3\nG0 X20. Y10. Z5.\nG1 Z-2. F300.\nG1 X40. F600.\nG0 Z5.\nM30\n%\n"
JOB = """
[program]
file = "pocket.nc"
[machine]
name = "vmc-fanuc"
[stock]
low_mm = [0.0, 0.0, -12.0]
high_mm = [60.0, 30.0, 0.0]
[part]
file = "frame.stl"
units = "mm"
spacing_mm = 5.0
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = 10.0
flutes = 4
helix_deg = 30.0
flute_length_mm = 22.0
overhang_mm = 30.0
modulus_gpa = 580.0
[workpiece]
modulus_gpa = 70.0
poisson = 0.33
{workpiece}
[[workpiece.clamp]]
{clamp}
[[operation]]
kind = "simulate"
step_mm = 4.0
[limits]
deflection_workpiece_um = 50.0
"""
DISTORTION = """
[residual_stress]
{stress}
rolling = "x"
source = "of this test"
[part]
file = "frame.stl"
units = "mm"
[stock]
low_mm = [0.0, 0.0, -12.0]
high_mm = [60.0, 30.0, 0.0]
[workpiece]
modulus_gpa = 71.7
poisson = 0.33
[[setup]]
side = "z+"
"""
EXAMPLE = 'shape = "m"\namplitude_mpa = 20.0\nacross_share = 0.6'


def frame(folder: Path, *, without: int = 0) -> None:
    """A block with one pocket, walls and floor 3 mm; without its last triangles it is an open shell."""
    block = trimesh.creation.box(bounds=[(0, 0, -12), (60, 30, 0)])
    pocket = trimesh.creation.box(bounds=[(3, 3, -9), (57, 27, 1)])
    out = trimesh.boolean.difference([block, pocket], engine="manifold")
    trimesh.Trimesh(out.vertices, out.faces[: len(out.faces) - without], process=False).export(folder / "frame.stl")


def refused(folder: Path, text: str, command: str = "check") -> str:
    """What a command says of a job that it refuses."""
    (folder / "job.toml").write_text(text)
    (folder / "pocket.nc").write_text(PROGRAM)
    more = ["--out", folder / "result"] if command == "run" else []
    code, _, said = call(command, folder / "job.toml", *more)
    assert code == 2
    return " ".join(said.split())


@pytest.mark.parametrize(
    "text",
    [DISTORTION.format(stress=EXAMPLE), JOB.format(workpiece="", clamp='face = "z-"')],
    ids=["distortion", "cut"],
)
def test_an_open_shell(tmp_path: Path, text: str) -> None:
    frame(tmp_path, without=2)
    assert (
        "part.file = frame.stl: the mesh is not closed: 4 open edges: repair it in CAD and export it again"
    ) in refused(tmp_path, text)


def test_a_stress_that_is_not_in_equilibrium(tmp_path: Path) -> None:
    frame(tmp_path)
    stress = "points_mpa = [[0.0, 10.0, 5.0], [6.0, 30.0, 5.0], [12.0, 20.0, 5.0]]"
    assert (
        "residual_stress: its resultant is 100% of the stress: at most 25% is balanced: state the stress over the "
        "whole thickness, 0 to 12 mm, tension positive"
    ) in refused(tmp_path, DISTORTION.format(stress=stress))


@pytest.mark.parametrize(
    ("clamp", "free"),
    [
        ('face = "z-"\ndirections = "z"', ["motion along x", "motion along y", "rotation about z"]),
        ('face = "x-"\ndirections = "y"', ["motion along x", "motion along z", "rotation about y", "rotation about z"]),
    ],
)
def test_clamps_that_leave_a_rigid_motion(tmp_path: Path, clamp: str, free: list[str]) -> None:
    """Points of a face held along z, or those of a face square to x along y, which turn freely about z too."""
    frame(tmp_path)
    said = refused(tmp_path, JOB.format(workpiece="", clamp=clamp))
    listed = said.partition("workpiece.clamp: ")[2].partition(" are free: add a clamp that holds them")[0]
    assert sorted(listed.split(", ")) == sorted(free)


def test_a_clamp_beside_the_stock(tmp_path: Path) -> None:
    frame(tmp_path)
    beside = "low_mm = [70.0, 0.0, -12.0]\nhigh_mm = [80.0, 30.0, 0.0]"
    assert "workpiece.clamp.0: holds nothing: no stock between (70, 0, -12) and (80, 30, 0) mm" in refused(
        tmp_path, JOB.format(workpiece="", clamp=beside)
    )


def test_walls_thinner_than_a_cell(tmp_path: Path) -> None:
    """The pocket of the program leaves a floor of 2 mm in a plate of 4 mm."""
    frame(tmp_path)
    text = JOB.format(workpiece="cell_mm = 6.0", clamp='face = "x-"').replace("-12.0]", "-4.0]")
    text = text.replace('[part]\nfile = "frame.stl"\nunits = "mm"\nspacing_mm = 5.0\n', "")
    assert ("workpiece.cell_mm = 6: the thinnest wall left is 2 mm: at most 2.5 times that, 5") in refused(
        tmp_path, text, "run"
    )


def test_motions_are_named_by_what_they_are() -> None:
    """The stiffness of three points that hold along z against the six motions, by hand."""
    from chipload.errors import InputError
    from chipload.structure.cells.clamp import require_clamped

    rows = [(0, 0, 1, y, -x, 0) for x, y in ((0, 0), (1, 0), (0, 1))]
    with pytest.raises(InputError) as err:
        require_clamped(np.array(rows, dtype=np.float64).T @ np.array(rows, dtype=np.float64))
    assert all(name in str(err.value) for name in ("along x", "along y", "about z"))
    assert "along z" not in str(err.value)
