"""Workpieces that bend and must be refused, each with its exact message."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload.cli import app
from chipload.errors import InputError
from chipload.examples import copy_example
from chipload.planning.thinwall.blank import WallBlank
from chipload.planning.thinwall.table import read_cuts
from chipload.planning.thinwall.threshold import Experiments, calibrated, modelled
from chipload.structure.grid import Grid, from_points, plate
from chipload.structure.solid import SolidWorkpiece, factorise

GRID = plate(30.0, 20.0, 2.0, (3, 2, 1))


def clamped(grid: Grid = GRID, modulus: float = 1.14e5, **change) -> SolidWorkpiece:
    return SolidWorkpiece(grid, modulus, 0.34, 4.43e-9, **({"fixed": grid.side("j-")} | change))


def said(call) -> str:
    with pytest.raises(InputError) as err:
        call()
    return str(err.value)


def test_a_wall_that_nothing_holds_says_how_it_can_move() -> None:
    assert said(lambda: factorise(clamped(fixed=np.zeros(0, np.int64)))) == (
        "workpiece: not held against motion along x, along y, along z, about x, about y, about z: 6 rigid motions are "
        "free; fix more nodes"
    )


def test_a_wall_on_one_line_of_nodes_is_a_hinge() -> None:
    line = GRID.lattice[:, 0, 0]
    assert said(lambda: factorise(clamped(fixed=line[line >= 0]))) == (
        "workpiece: not held against motion about x: 1 rigid motion is free; fix more nodes"
    )


def test_a_wall_held_in_some_directions_only() -> None:
    held = np.zeros((len(GRID.nodes), 3), dtype=np.bool_)
    held[GRID.side("j-")] = [True, False, True]
    assert said(lambda: factorise(clamped(fixed=held))) == (
        "workpiece: not held against motion along y, about x, about z: 3 rigid motions are free; fix more nodes"
    )


def test_a_piece_that_is_cut_off_is_named() -> None:
    kept = np.tile([0.0, 1.0], (6, 1))
    kept[GRID.element(np.arange(3), np.full(3, 0), 0)] = 0.0
    grid = GRID
    assert said(lambda: factorise(clamped(grid, kept=kept))) == (
        "workpiece: not held against motion along x, along y, along z, about x, about y, about z: 6 rigid motions are "
        "free; fix more nodes"
    )


def corners() -> np.ndarray:
    """Corner points of three elements in a row."""
    x, y, z = np.meshgrid([0.0, 10.0, 20.0, 30.0], [0.0, 10.0], [0.0, 2.0], indexing="ij")
    return np.stack([x, y, z], axis=-1)


def test_sections_in_the_wrong_order_make_inverted_elements() -> None:
    turned = from_points(corners()[:, :, ::-1])
    assert said(lambda: factorise(clamped(turned))) == (
        "element 0: det(dx/dxi) = -25 mm^3: must be above 0 everywhere; the element is inverted, folded or flat: turn "
        "the order of the points or move its nodes"
    )


@pytest.mark.parametrize("gone", [False, True])
def test_an_element_without_volume_is_named_by_its_own_number(gone: bool) -> None:
    """Also where elements before it are gone: the number is that of the mesh."""
    flat = corners()
    flat[3] = flat[2]
    kept = np.tile([0.0, 1.0], (3, 1))
    if gone:
        kept[0] = 0.0
    message = said(lambda: factorise(clamped(from_points(flat), kept=kept)))
    assert message.startswith("element 2: det(dx/dxi) = ")
    assert message.endswith(
        "must be above 0 everywhere; the element is inverted, folded or flat: turn the order of the points or move its "
        "nodes"
    )


@pytest.mark.parametrize(
    ("modulus", "hint"),
    [(1.14e11, "is it in Pa?"), (1.14e8, "was MPa given for GPa?"), (69.0, "is it in GPa?")],
)
def test_a_modulus_in_another_unit(modulus: float, hint: str) -> None:
    assert said(lambda: clamped(modulus=modulus)) == (
        f"workpiece.modulus = {modulus:g} MPa: must be from 100 to 2e+06 MPa; {hint}"
    )


def test_a_wall_thinner_than_what_is_cut_off_it() -> None:
    assert said(lambda: WallBlank(clamped(), (1.0, 1.5))) == (
        "wall: allowance_mm 1 and 1.5 leave no wall: it is 2 mm thick with its stock"
    )


def test_a_table_of_experiments_with_one_place(tmp_path: Path) -> None:
    one = "experiments: 1 places: must be at least 3, not on a line, for a map of the wall; measure at the corners of "
    assert said(lambda: Experiments(np.array([[0.5, 0.5]]), np.array([20.0]))) == (
        one + "the free edge, its middle and near the clamp"
    )
    path = tmp_path / "cuts.csv"
    path.write_text("u,v,repeat,expected_normal_force_n,normal_force_n,deflection_um,too_much\n0,1,1,20,21,40,\n")
    assert said(lambda: read_cuts(path, 0.05)) == (
        "experiments cuts.csv: 1 places filled in: must be at least 3, not on a line: fill in deflection_um, or "
        "too_much with yes or no, of more cuts"
    )


def test_experiments_on_a_line() -> None:
    line = Experiments(np.array([[0.0, 1.0], [0.5, 1.0], [1.0, 1.0]]), np.array([20.0, 30.0, 20.0]))
    assert said(lambda: calibrated(line, [[0.5, 0.5]], 1.0)) == (
        "experiments: all places lie on a line: add a place off it"
    )


def test_a_compliance_of_nothing() -> None:
    assert said(lambda: modelled([0.0], 0.05)) == ("threshold: the normal compliance of a place is not above 0 mm/N")


def run(job: Path, *changes: str) -> str:
    """What ``chipload run`` says of a job that it refuses with code 2."""
    words = [w for change in changes for w in ("--set", change)]
    done = CliRunner().invoke(app, ["run", str(job), "--out", str(job.parent / "result"), *words])
    assert done.exit_code == 2, done.output
    assert not (job.parent / "result").exists()
    return done.stderr.strip().splitlines()[-1]


@pytest.fixture
def plate_job(tmp_path: Path) -> Path:
    return copy_example("plate", tmp_path / "plate") / "job.toml"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (
            "wall.thickness_mm=0.3",
            "chipload: wall: 0.3 mm thick where it is thinnest, thinner than a cut of 0.4 mm: state less "
            "operation.0.depth_max_mm, or a thicker wall",
        ),
        (
            "workpiece.modulus_gpa=113800.0",
            "chipload: job.toml: workpiece.modulus_gpa = 113800: must be from 1 to 1000 GPa; is it in MPa or Pa?",
        ),
        (
            "wall.allowance_mm=[0.0, 0.0]",
            "chipload: wall.allowance_mm = [0.0, 0.0], density = 1: must be at least 0, above 0 on one side, and at "
            "least 1: state stock to cut",
        ),
    ],
)
def test_a_run_refuses_a_wall(plate_job: Path, change: str, says: str) -> None:
    assert run(plate_job, change).startswith(says)


@pytest.mark.parametrize(
    ("shape", "says"),
    [
        ("corner_radius_mm = 0.0", "cutter.corner_radius_mm = 0: must be above 0: choose a ball or bull nose"),
        (
            "corner_radius_mm = 2.0\ntaper_deg = 3.0",
            "cutter.taper_deg = 3: must be 0: choose a ball or bull nose",
        ),
    ],
)
def test_a_flat_end_and_a_taper_cut_no_wall(plate_job: Path, shape: str, says: str) -> None:
    """They cut with their flanks."""
    text = plate_job.read_text().replace("scallop_um = 20.0", "step_over_mm = 0.5")
    plate_job.write_text(text.replace("corner_radius_mm = 4.0", shape))
    assert run(plate_job) == f"chipload: {says}"


def test_a_body_is_no_cutter_of_a_wall(plate_job: Path) -> None:
    """A body of revolution, as tool libraries state some barrels: the cutter, and the operation that names it."""
    body = "body_mm = [[0.0, 0.0], [3.0, 0.5], [4.0, 5.0], [3.6, 8.0]]"
    plate_job.write_text(plate_job.read_text().replace("corner_radius_mm = 4.0", body))
    done = CliRunner().invoke(app, ["run", str(plate_job), "--out", str(plate_job.parent / "result")])
    assert done.exit_code == 2
    assert done.stderr.strip().splitlines() == [
        "chipload: job.toml: cutter 1: body_mm: for a program that is simulated: leave it out, and state its numbers",
        "chipload: job.toml: operation.0.cutter = 1: is a body (tap, thread mill), whose chips are not simulated: "
        "state a ball nose, a bull nose or a barrel by barrel_radius_mm",
    ]


@pytest.mark.parametrize(
    ("lean", "says"),
    [
        ("60.0", "lean_deg, lead_deg: the axis leans by 60 deg: must be between 69.24 and 90, where the flank arc of "
         "the barrel touches"),
        ("79.0", "wall.foot_mm = 5: must be at least 8.027: the barrel reaches so far below its last row, towards the "
         "clamp: state that, or touch nearer to the tip by less lean_deg"),
    ],
)  # fmt: skip
def test_a_barrel_touches_a_wall_with_its_arc_above_the_foot(plate_job: Path, lean: str, says: str) -> None:
    text = plate_job.read_text().replace("flute_length_mm = 8.0", "flute_length_mm = 16.0")
    text = text.replace("corner_radius_mm = 4.0", "corner_radius_mm = 1.5\nbarrel_radius_mm = 40.0")
    plate_job.write_text(
        text.replace("lean_deg = 45.0", f"lean_deg = {lean}").replace("depth_max_mm = 0.4", "depth_max_mm = 0.1")
    )
    assert run(plate_job) == f"chipload: {says}"


def test_a_run_refuses_a_table_with_one_place(plate_job: Path) -> None:
    (plate_job.parent / "cuts.csv").write_text(
        "u,v,repeat,expected_normal_force_n,normal_force_n,deflection_um,too_much\n0,1,1,20,21,40,\n"
    )
    plate_job.write_text(plate_job.read_text() + '\n[threshold]\nfile = "cuts.csv"\ndeviations = 2.0\n')
    assert run(plate_job) == (
        "chipload: experiments cuts.csv: 1 places filled in: must be at least 3, not on a line: fill in deflection_um, "
        "or too_much with yes or no, of more cuts"
    )


SECTIONS = """[wall]
shape = "sections"
files = ["a.curve"]
unit = "mm"
edge_share = %s
foot_mm = 5.0
allowance_mm = %s
elements = [6, 6]

"""


def with_sections(job: Path, heights, edge: float, allowance) -> None:
    """A job of slender sections stacked on the axis of rotation; the second is thin, and begins at its other edge."""
    lines = []
    for k, z in enumerate(heights):
        t = np.linspace(0.0, 2.0 * np.pi, 81) + (np.pi if k == 1 else 0.0)
        x, y = 10.0 * np.cos(t), (0.03 if k == 1 else 1.5) * np.sin(t) * np.abs(np.sin(t)) ** 0.2
        lines += [f"# Profile {k + 1}", *(f"{a:.6f} {b:.6f} {z:.6f}" for a, b in zip(x, y, strict=True))]
    (job.parent / "a.curve").write_text("\n".join(lines) + "\n")
    text = job.read_text()
    job.write_text(SECTIONS % (edge, list(allowance)) + text[text.index("[workpiece]") :])


@pytest.mark.parametrize(
    ("heights", "edge", "allowance", "says"),
    [
        ((40.0, 50.0, 60.0), 0.1, (0.4, 0.4), "chipload: wall: 0.0325 mm thick where it is thinnest"),
        ((40.0, 60.0, 50.0), 0.1, (0.4, 0.4), "chipload: section 2: is not between sections 1 and 3"),
        ((40.0, 50.0, 50.0), 0.1, (0.4, 0.4), "chipload: section 2: is not between sections 1 and 3"),
        (
            (40.0, 50.0, 60.0),
            0.0,
            (0.4, 0.0),
            "chipload: wall: allowance_mm 0.4 and 0 leave no wall: it is 0.4 mm thick with its stock",
        ),
    ],
)
def test_a_run_refuses_sections(plate_job: Path, heights, edge: float, allowance, says: str) -> None:
    """Nearly without thickness, out of order, a layer of elements without height, no thickness at the edges."""
    with_sections(plate_job, heights, edge, allowance)
    assert run(plate_job).startswith(says)
