"""A ball-nose finishing job of OpenCAMLib's drop-cutter: the surface that the simulation leaves is the drop-cutter's.

A ball of radius R is dropped on a wave whose valleys are narrower than the ball, along lines 0.1 mm apart; its places
are the program. What it leaves is the least height that the ball's underside has over a place. With its places as a
surface turned upside down that is a drop-cutter problem again: the ball dropped on it stops where the material ends.
Between two lines that surface lies lower than the ball goes, by a scallop of at most 1e-3 mm.

The simulation keeps sections at fixed heights, so each point of a section's edge is one of the surface that it leaves.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import shapely
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from typer.testing import CliRunner

from chipload.cli import app
from chipload.stock.layers import LayeredStock

ocl = pytest.importorskip("opencamlib")

Floats = NDArray[np.float64]
#: radius of the ball, side of the square of lines, distances of lines and of points along them, depth of the part [mm]
R, SIDE, ACROSS, ALONG, DEPTH = 2.0, 7.0, 0.1, 0.2, 4.0
JOB = """[program]
file = "finish.ngc"
[machine]
name = "vmc"
[stock]
low_mm = [0.0, 0.0, -4.0]
high_mm = [7.0, 7.0, 0.0]
layer_mm = 0.1
[part]
file = "part.stl"
units = "mm"
spacing_mm = 0.4
excess_range_mm = 0.5
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = 4.0
corner_radius_mm = 2.0
flutes = 2
helix_deg = 30.0
flute_length_mm = 10.0
overhang_mm = 20.0
modulus_gpa = 580.0
[[operation]]
kind = "simulate"
step_mm = 1.0
tolerance_mm = 0.001
[limits]
gouge_mm = 0.002
excess_mm = 0.002
"""


def wave(x: Floats, y: Floats) -> Floats:
    """Height [mm]; radius of the valleys 1.3 mm, less than that of the ball."""
    return -1.4 + 0.5 * np.sin(2.0 * math.pi * x / 5.0) + 0.2 * np.cos(2.0 * math.pi * y / 9.0)


def grid(low: float, high: float, step: float) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Places (n,), (n,) of a square grid and its triangles (m, 3), seen from above counter-clockwise."""
    n = round((high - low) / step) + 1
    at = np.linspace(low, high, n)
    x, y = np.meshgrid(at, at, indexing="ij")
    k = np.arange(n * n).reshape(n, n)
    a, b, c, d = k[:-1, :-1].ravel(), k[1:, :-1].ravel(), k[1:, 1:].ravel(), k[:-1, 1:].ravel()
    return x.ravel(), y.ravel(), np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def dropped(points: Floats, faces: NDArray[np.int64], at: Floats) -> Floats:
    """(n,) height [mm] of the ball's tip over the places (n, 2), by OpenCAMLib."""
    surface = ocl.STLSurf()
    for tri in points[faces]:
        surface.addTriangle(ocl.Triangle(*(ocl.Point(*(float(v) for v in p)) for p in tri)))
    ball = ocl.BallCutter(2.0 * R, 20.0)  # the library keeps no reference of its own
    batch = ocl.BatchDropCutter()
    batch.setSTL(surface)
    batch.setCutter(ball)
    for x, y in at.tolist():
        batch.appendPoint(ocl.CLPoint(x, y, -10.0))
    batch.run()
    found = {(round(p.x, 9), round(p.y, 9)): p.z for p in batch.getCLPoints()}
    return np.array([found[round(x, 9), round(y, 9)] for x, y in at.tolist()])


class Finished:
    """The program's points (lines, points, 3), the summary of the run and the points of the edges of what is left."""

    def __init__(self, folder: Path) -> None:
        x, y, faces = grid(-3.0, SIDE + 3.0, 0.2)
        xs = np.linspace(0.0, SIDE, round(SIDE / ACROSS) + 1)
        ys = np.linspace(0.0, SIDE, round(SIDE / ALONG) + 1)
        at = np.array([(a, b) for k, a in enumerate(xs) for b in (ys if k % 2 == 0 else ys[::-1])]).round(6)
        z = dropped(np.column_stack([x, y, wave(x, y)]), faces, at).round(6)
        self.way = np.column_stack([at, z])
        self.lines = self.way.reshape(len(xs), len(ys), 3)
        x0, y0, z0 = self.way[0]
        text = ["G21 G90 G17 G94", "T1 M6", "S12000 M3", f"G0 X{x0:.6f} Y{y0:.6f} Z5", f"G1 Z{z0:.6f} F600"]
        text += [f"X{p[0]:.6f} Y{p[1]:.6f} Z{p[2]:.6f}" for p in self.way[1:]]
        (folder / "finish.ngc").write_text("\n".join([*text, "G0 Z5", "M2"]) + "\n")
        (folder / "job.toml").write_text(JOB)
        part().export(folder / "part.stl")
        self.exit = CliRunner().invoke(app, ["run", str(folder / "job.toml"), "--out", str(folder / "out")]).exit_code
        (self.op,) = json.loads((folder / "out" / "summary.json").read_bytes())["operations"]
        stock = LayeredStock.load(folder / "out" / "stock.npz")
        edges = []
        for i in range(stock.layers):
            xy = shapely.get_coordinates(shapely.segmentize(stock.section(i), 0.05))
            inner = (xy > R).all(axis=1) & (xy < SIDE - R).all(axis=1)
            edges.append(np.column_stack([xy[inner], np.full(int(inner.sum()), stock.heights[i])]))
        self.edges = np.vstack(edges)


def part() -> trimesh.Trimesh:
    """The solid below the wave."""
    x, y, faces = grid(0.0, SIDE, 0.2)
    n = len(x)
    top = np.column_stack([x, y, wave(x, y)])
    low = np.column_stack([x, y, np.full(n, -DEPTH)])
    edges = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, at, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    a, b = edges[at[count == 1]].T
    walls = np.vstack([np.column_stack([b, a, a + n]), np.column_stack([b, a + n, b + n])])
    mesh = trimesh.Trimesh(np.vstack([top, low]), np.vstack([faces, faces[:, ::-1] + n, walls]), process=False)
    assert mesh.is_watertight
    assert mesh.volume > 0.0
    return mesh


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    return Finished(tmp_path_factory.mktemp("finish"))


def test_the_surface_left_is_the_drop_cutters(job: Finished) -> None:
    """Edges of the sections, a ball radius and more from the border, within 2e-3 mm of OpenCAMLib's surface."""
    points = job.way * (1.0, 1.0, -1.0)
    n, m = job.lines.shape[:2]
    k = np.arange(n * m).reshape(n, m)
    k[1::2] = k[1::2, ::-1]  # every other line runs back
    a, b, c, d = k[:-1, :-1].ravel(), k[1:, :-1].ravel(), k[1:, 1:].ravel(), k[:-1, 1:].ravel()
    faces = np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    left = -dropped(points, faces, job.edges[:, :2])
    assert len(left) > 500
    over = job.edges[:, 2] - left
    print(f"{len(left)} points: {over.min():.2e} to {over.max():.2e} mm")
    assert np.abs(over).max() < 2e-3
    # the wave itself is not what is left: its valleys are too narrow for the ball
    assert (left - wave(*job.edges[:, :2].T)).max() > 0.02


def test_gouge_and_excess_are_those_of_the_ball(job: Finished) -> None:
    """To the job's tolerance the distance of a point from the ball's way is that of its centre's polyline less R."""
    centres = job.way + np.array([0.0, 0.0, R])
    fine = np.vstack([centres[:-1] + (centres[1:] - centres[:-1]) * t for t in np.linspace(0.0, 1.0, 40)])
    x, y, _ = grid(0.0, SIDE, 0.2)
    # at the border the stock does not stand over the part, so that nothing can be left there
    inner = (np.minimum(x, y) > 0.1) & (np.maximum(x, y) < SIDE - 0.1)
    gap = cKDTree(fine).query(np.column_stack([x, y, wave(x, y)])[inner])[0] - R
    assert gap.max() > 0.05
    assert job.op["excess_mm"]["max"] == pytest.approx(gap.max(), abs=1e-3)
    assert job.op["gouge_mm"]["max"] == pytest.approx(max(0.0, -gap.min()), abs=1e-3)
    assert job.exit == 3
