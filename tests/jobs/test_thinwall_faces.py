"""Walls between faces of STEP files: a plate against the one by numbers, a blade against the one through sections."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from chipload.examples import copy_example
from chipload.geometry.sections import check_sections, loft, read_sections
from chipload.geometry.step_faces import read_faces
from chipload.jobs import load_job
from chipload.jobs.thinwall.inputs import WallInputs, read_wall
from step_files import face, written

SIZE = (40.0, 30.0, 3.0)
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
COMMON = """foot_mm = 6.0
allowance_mm = [0.3, 0.2]
elements = [4, 4]
"""
FACES = 'shape = "step"\nfile = "wall.step"\nfront = {front}\nback = {back}\nclamp = {clamp}\n'
SECTIONS = 'shape = "sections"\nfiles = ["wall.curve"]\nunit = "mm"\nedge_share = 0.1\nspan = [0.0, 0.9]\n'


def inputs(folder: Path, keys: str) -> WallInputs:
    """The shipped plate with another wall."""
    path = folder / "job.toml"
    if not path.exists():
        copy_example("plate", folder)
    text = path.read_text()
    path.write_text(f"# a wall\n[wall]\n{keys}{COMMON}\n" + text[text.index("[workpiece]") :])
    return read_wall(load_job(path).job)


def box(path: Path, rotation=TURN) -> None:
    """A plate of SIZE, its length along x, thickness along y, height along z, then turned; a solid."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    length, height, thickness = SIZE
    written(path, BRepPrimAPI_MakeBox(length, thickness, height).Shape(), rotation=rotation)


def at(x: float, y: float, z: float) -> list[float]:
    """A point of the turned plate."""
    return (TURN @ [x, y, z]).round(9).tolist()


def same(found: WallInputs, stated: WallInputs) -> bool:
    """Nodes to 1e-6 mm, what every place bears (so its compliance) to 1e-4."""
    a, b = found.body.wall.solid.grid, stated.body.wall.solid.grid
    nodes = bool((a.elements == b.elements).all()) and float(np.abs(a.nodes - b.nodes).max()) < 1e-6
    return nodes and found.finished_threshold().force == pytest.approx(stated.finished_threshold().force, rel=1e-4)


@pytest.fixture(scope="module")
def plate(tmp_path_factory) -> WallInputs:
    keys = "".join(f"{k}_mm = {x}\n" for k, x in zip(("length", "height", "thickness"), SIZE, strict=True))
    return inputs(tmp_path_factory.mktemp("plate") / "job", f'shape = "plate"\n{keys}')


@pytest.mark.parametrize("by", ["face", "point"])
def test_a_plate_between_faces_of_a_solid(tmp_path, plate, by):
    """Front and back named by points; the clamp as the face below, or as a point of its edge."""
    folder = tmp_path / "job"
    copy_example("plate", folder)
    box(folder / "wall.step")
    below = [f.number for f in read_faces(folder / "wall.step").faces if f.distance(at(20, 1.5, 0)) < 1e-6]
    clamp = below[0] if by == "face" else at(17, 3.0, 0)
    found = inputs(folder, FACES.format(front=at(7, 3, 9), back=at(11, 0, 4), clamp=clamp))
    assert same(found, plate)
    assert "wall between faces" in found.body.shape.name


def test_front_and_back_changed_are_the_wall_turned(tmp_path, plate):
    """By half a turn about z: a plate is the same after that."""
    folder = tmp_path / "job"
    copy_example("plate", folder)
    box(folder / "wall.step")
    found = inputs(folder, FACES.format(front=at(11, 0, 4), back=at(7, 3, 9), clamp=at(17, 0, 0)))
    assert same(found, plate)


@pytest.fixture(scope="module")
def sections() -> np.ndarray:
    """Ellipses of 24 x 3 mm with a camber of 2 mm that twist by 20 deg and taper, stacked along y at x = 100."""
    t = np.linspace(0.0, math.tau, 121)
    out = []
    for k in range(5):
        g, size = math.radians(5.0 * k), 1.0 - 0.05 * k
        a, b = 12.0 * size * np.cos(t), 1.5 * size * np.sin(t) + 2.0 * size * np.sin(t) ** 2
        out.append(
            np.stack([100.0 + b * np.cos(g) + a * np.sin(g), 0 * t + 6.0 * k, a * np.cos(g) - b * np.sin(g)], axis=1)
        )
    return np.array(out)


@pytest.mark.parametrize("flip", [False, True])
def test_a_blade_from_faces_is_that_through_sections(tmp_path, sections, flip):
    folder = tmp_path / "job"
    copy_example("plate", folder)
    text = "".join("# section\n" + "".join(f"{x:.9f} {y:.9f} {z:.9f}\n" for x, y, z in s) for s in sections)
    (folder / "wall.curve").write_text(text)
    given = inputs(folder, SECTIONS)
    made = loft(check_sections(read_sections([folder / "wall.curve"], "mm")))
    # of the section's frame: z up the span, x from the leading edge (greater z of the part), y = z x x
    up = made.plus.at(0.5, 1.0)[0] - made.plus.at(0.5, 0.0)[0]
    along = made.plus.at(1.0, 0.5)[0] - made.plus.at(0.0, 0.5)[0]
    towards = made.plus.at(0.5, 0.5)[0] - made.minus.at(0.5, 0.5)[0]
    front, back = (made.plus, made.minus) if np.cross(up, along) @ towards > 0 else (made.minus, made.plus)
    written(folder / "wall.step", face(back.swapped()), face(front.reversed(flip, True)))
    clamp = made.plus.at(0.4, 0.0)[0].round(9).tolist()
    found = inputs(folder, FACES.format(front=2, back=1, clamp=clamp) + "edge_share = 0.1\nspan = [0.0, 0.9]\n")
    assert same(found, given)
