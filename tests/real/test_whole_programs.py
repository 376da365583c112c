"""Two real programs run whole by the command line; what they remove, against models that know no layers and no chips.

`bear.nc` is a job of CAMotics in three axes, `boat-xyzac.ngc` a demonstration of LinuxCNC in five. Stock and cutter of
the bear are those of its `.camotics` file. The boat's text says "10.0 dia. ENDMILL" and "Table = -13.25" and nothing of
the stock: assumed is the block round its way at a feed, from the table up. Neither says flutes, helix, overhang or
material: assumed are those of a common cutter in aluminium; the removed volume does not depend on them.

The sections of the layers are taken at their middles: a floor that lies within a layer counts as none or as all of it.
On a surface that crosses many layers that averages out, so that the error falls as the square of the thickness.
"""

from __future__ import annotations

import itertools
import json
import math
import os
import re
from pathlib import Path
from typing import Any

import manifold3d
import numpy as np
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

from chipload.cli import app
from chipload.cutter.cutter import Cutter
from chipload.machine.machine import machine_named
from chipload.program.read import read_program
from chipload.stock.dexel import TriDexel
from laws.test_chip_laws import solid

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[3] / "shared" / "data")) / "nc"
BEAR, BOAT = DATA / "camotics" / "bear", DATA / "linuxcnc_5axis" / "boat-xyzac.ngc"
pytestmark = pytest.mark.skipif(not (BEAR.is_dir() and BOAT.is_file()), reason="no real programs: set CHIPLOAD_DATA")
long = pytest.mark.skipif(
    os.environ.get("CHIPLOAD_LONG") != "1", reason="takes minutes: make real, or set CHIPLOAD_LONG=1"
)
INCH = 25.4
JOB = """[program]
file = "{program}"
tolerance_mm = 0.01
[machine]
name = "{machine}"
[stock]
low_mm = {low}
high_mm = {high}
layer_mm = {layer}
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = {cutter.diameter}
corner_radius_mm = {cutter.corner_radius}
flutes = {cutter.flutes}
helix_deg = 30.0
flute_length_mm = {cutter.flute_length}
overhang_mm = {cutter.overhang}
modulus_gpa = 580.0
[[operation]]
kind = "simulate"
step_mm = {step}
tolerance_mm = 0.01
[limits]
force_n = 2500.0
"""
#: the boat: a block round its way at a feed, 10 mm end mill
LOW, HIGH = [-50.0, -27.0, -13.25], [47.0, 23.0, 0.5]
MILL = Cutter(10.0, 3, math.radians(30.0), 30.0, 45.0, 580e3)


def run(folder: Path, layer: float, **said: Any) -> dict:
    """The summary's operation of a job, by the command line."""
    (folder / "job.toml").write_text(JOB.format(layer=layer, **said))
    done = CliRunner().invoke(app, ["run", str(folder / "job.toml"), "--out", str(folder / "result")])
    summary = json.loads((folder / "result" / "summary.json").read_bytes())
    assert done.exit_code == (0 if summary["verdict"] == "holds" else 3), done.stderr
    (op,) = summary["operations"]
    table = pq.read_table(folder / "result" / "history.parquet").to_pydict()
    # the CL data name the cutter, so that the page can draw it
    assert re.search(rf"^CUTTER/{said['cutter'].diameter:g}\b", (folder / "result" / "0-program.apt").read_text(), re.M)
    # what the steps took is what the stock lost, and the last line that moves is reached; by moves the stock that is
    # left is found by itself, in layers
    assert math.fsum(table["chip_volume_mm3"]) == pytest.approx(op["removed_mm3"], rel=1e-3)
    last = np.array([table[f"{x}_mm"][-1] for x in "xyz"])
    return op | {"last": last, "lines": np.array(table["line"])}


def bear() -> tuple[list[float], list[float], Cutter]:
    """Corners of the stock and the cutter that the project file of CAMotics states."""
    said = json.loads((BEAR / "bear.camotics").read_text())
    tool, block = said["tools"]["1"], said["workpiece"]["bounds"]
    assert (said["units"], tool["units"], tool["shape"]) == ("metric", "imperial", "ballnose")
    d, length = INCH * tool["diameter"], INCH * tool["length"]
    return block["min"], block["max"], Cutter(d, 2, math.radians(30.0), length, length + 5.0, 580e3, 0.5 * d)


def words() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Places (n, 3) [mm] and lines of the bear, read here: straight moves in absolute millimetres are all it has."""
    at, places, lines = {"X": 0.0, "Y": 0.0, "Z": 20.0}, [], []
    for number, text in enumerate((BEAR / "bear.nc").read_text().splitlines(), 1):
        assert not re.search(r"G(2|3|20|53|9\d)(?!\d)", text)
        found = dict(re.findall(r"([XYZ])(-?[.\d]+)", text))
        if found:
            at |= {k: float(v) for k, v in found.items()}
            places.append([at[k] for k in "XYZ"])
            lines.append(number)
    return np.array(places), np.array(lines)


def dexels_of_bear(pitch: float) -> float:
    """Removed [mm^3] by rays along z through the places of the text."""
    low, high, ball = bear()
    stock = TriDexel.block(low, high, pitch, "z")
    for a, b in itertools.pairwise(words()[0]):
        stock.remove_move(a, (0, 0, 1), b, (0, 0, 1), ball.apt, error_mm=0.005)
    return float(np.prod(np.subtract(high, low)) - stock.volume())


def poses_of_boat() -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Tip and axis after each row that has the tool in the spindle; how texts are read has tests of its own."""
    p = read_program(BOAT, machine_named("xyzac-trunnion"), tolerance=0.01).program
    first = int(np.flatnonzero(p.tool == 1)[0])
    return [(p.p_work[k], p.axis[k]) for k in range(first - 1, len(p))]


def dexels_of_boat(pitch: float) -> dict[str, float]:
    """Removed [mm^3] by rays along each axis."""
    stock = TriDexel.block(LOW, HIGH, pitch)
    for (p, a), (q, b) in itertools.pairwise(poses_of_boat()):
        stock.remove_move(p, a, q, b, MILL.apt, error_mm=0.005)
    whole = float(np.prod(np.subtract(HIGH, LOW)))
    return {k: whole - v for k, v in stock.volume_by_direction().items()}


def hulls_of_boat(sides: int, turn: float) -> float:
    """Removed [mm^3] by hulls of the cutter, of ``sides``, at places between which it turns by ``turn`` [rad]."""
    block = manifold3d.Manifold.cube(np.subtract(HIGH, LOW)).translate(LOW)
    under = []
    for (p, a), (q, b) in itertools.pairwise(poses_of_boat()):
        parts = max(1, math.ceil(math.acos(min(1.0, float(a @ b))) / turn))
        bodies = []
        for t in np.linspace(0.0, 1.0, parts + 1):
            axis = (1.0 - t) * a + t * b
            bodies.append(solid(MILL, (1.0 - t) * p + t * q, axis / np.linalg.norm(axis), sides, 1))
        under += [manifold3d.Manifold.batch_hull(list(pair)) ^ block for pair in itertools.pairwise(bodies)]
    return float(manifold3d.Manifold.batch_boolean(under, manifold3d.OpType.Add).volume())


def run_bear(folder: Path, layer: float) -> dict:
    low, high, ball = bear()
    return run(
        folder, layer, program=BEAR / "bear.nc", machine="vmc", low=low, high=high, cutter=ball, step=100.0
    )  # fmt: skip


def run_boat(folder: Path, layer: float) -> dict:
    return run(
        folder, layer, program=BOAT, machine="xyzac-trunnion", low=LOW, high=HIGH, cutter=MILL, step=20.0
    )  # fmt: skip


@long
def test_the_bear_whole(tmp_path: Path) -> None:
    """15,152 moves of a 3.175 mm ball nose in three axes; rays 0.4 mm apart know the volume to 1e-4."""
    done, (places, lines) = run_bear(tmp_path, 2.0), words()
    assert set(done["lines"]) <= set(lines.tolist())
    moved = np.linalg.norm(np.diff(places, axis=0, prepend=places[:1]), axis=1) > 0.0
    assert set(lines[moved]) <= set(done["lines"].tolist())
    np.testing.assert_allclose(done["last"], places[-1], atol=1e-9)
    assert done["removed_mm3"] == pytest.approx(dexels_of_bear(0.4), rel=1e-3)


def test_the_boat_whole(tmp_path: Path) -> None:
    """Roughing and two five-axis finishing passes; the rays of the three axes agree within 2e-4 of each other."""
    done, other = run_boat(tmp_path, 1.0), dexels_of_boat(0.4)
    tip, _ = poses_of_boat()[-1]
    np.testing.assert_allclose(done["last"], tip, atol=1e-9)
    mean = math.fsum(other.values()) / 3.0
    assert max(other.values()) - min(other.values()) < 2e-4 * mean
    assert done["removed_mm3"] == pytest.approx(mean, rel=3e-4)


@long
def test_the_bear_finer(tmp_path: Path) -> None:
    """Levels within a layer and chords within 0.01 mm leave 3.2e-4 apart."""
    assert run_bear(tmp_path, 0.5)["removed_mm3"] == pytest.approx(dexels_of_bear(0.2), rel=4e-4)


@long
def test_the_boat_finer(tmp_path: Path) -> None:
    """Against finer rays, and against the union of hulls, which cover more where the axis turns."""
    removed = run_boat(tmp_path, 1.0)["removed_mm3"]
    assert removed == pytest.approx(dexels_of_boat(0.2)["z"], rel=2e-4)
    assert removed == pytest.approx(hulls_of_boat(24, math.radians(2.0)), rel=2e-3)
