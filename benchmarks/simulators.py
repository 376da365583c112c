"""Moves a second of the simulation beside another simulator, the same program in one run.

    python benchmarks/simulators.py [--lines 30] [--layer 0.5] [--pitch 0.2]
    python benchmarks/simulators.py --program bear.nc --ball 3.175 --low 0 0 -20 --high 80 80 0

The program is a ball-nose finishing raster over a wave, in moves of 0.5 mm, or straight moves in absolute millimetres
of a file (words X, Y, Z). It goes through:

* layers: :func:`chipload.simulation.chips.remove`, chips, engagement, force, torque and power of every move;
* dexels: :class:`chipload.stock.dexel.TriDexel` with rays along z, geometry alone, found to 0.01 mm;
* FreeCAD's `PathSim`, a field of heights, geometry alone; left out where there is no `freecadcmd`.

Dexels and heights have the same pitch. Times are processor seconds of each process without its start, so that other
work on the computer matters less. The removed volumes say what each makes of the program.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import os
import re
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.program.program import LINE, RAPID, Program
from chipload.simulation.chips import remove
from chipload.simulation.removal import Resolution
from chipload.stock.dexel import TriDexel
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]
UP = (0.0, 0.0, 1.0)
#: what FreeCAD runs; places, block, ball and pitch come from a file
FREECAD = """
import json, os, time
import FreeCAD, Part, Path, PathSimulator
said = json.load(open(os.environ["CHIPLOAD_PEER"]))
(x0, y0, z0), (x1, y1, z1), r = said["low"], said["high"], said["radius"]
block = Part.makeBox(x1 - x0, y1 - y0, z1 - z0, FreeCAD.Vector(x0, y0, z0))
ball = Part.makeSphere(r, FreeCAD.Vector(0, 0, r))
tool = ball.fuse(Part.makeCylinder(r, said["height"], FreeCAD.Vector(0, 0, r)))
sim = PathSimulator.PathSim()
sim.BeginSimulation(block, said["pitch"])
sim.SetToolShape(tool, said["pitch"])
commands = [Path.Command("G1", {"X": x, "Y": y, "Z": z}) for x, y, z in said["places"]]
at = FreeCAD.Placement(FreeCAD.Vector(*said["places"][0]), FreeCAD.Rotation())
begun = time.process_time()
for command in commands[1:]:
    at = sim.ApplyCommand(at, command)
seconds = time.process_time() - begun
outer, inner = sim.GetResultMesh()
outer.addMesh(inner)
print("RESULT " + json.dumps({"seconds": seconds, "left": outer.Volume}))
"""


def raster(lines: int) -> Floats:
    """Places (n, 3) [mm] of a ball over a wave, lines 0.5 mm apart and 60 mm long."""
    out = []
    for k in range(lines):
        x = np.arange(0.0, 60.01, 0.5)[:: 1 if k % 2 == 0 else -1]
        y = np.full(len(x), 0.5 * k)
        out.append(np.column_stack([x, y, -3.0 + np.sin(x / 5.0) * np.cos(0.5 * k / 7.0)]))
    return np.vstack(out)


def words(path: Path) -> Floats:
    """Places (n, 3) [mm] of the words X, Y, Z of a file."""
    at, out = {"X": 0.0, "Y": 0.0, "Z": 0.0}, []
    for text in path.read_text().splitlines():
        found = dict(re.findall(r"([XYZ])(-?[.\d]+)", text))
        if found:
            at |= {k: float(v) for k, v in found.items()}
            out.append([at[k] for k in "XYZ"])
    places = np.array(out)
    return places[np.append(True, np.abs(np.diff(places, axis=0)).max(axis=1) > 0.0)]


def program_of(places: Floats) -> Program:
    """Straight moves at 20 mm/s."""
    n = len(places)
    motion = np.where(np.arange(n) == 0, RAPID, LINE)
    return Program(
        motion, places, np.tile(UP, (n, 1)), np.zeros((n, 3)), np.tile(UP, (n, 1)), np.zeros(n),
        np.where(motion == LINE, 20.0, 0.0), np.full(n, 1000.0), np.ones(n), np.arange(n), np.zeros(n), ("cut",),
    )  # fmt: skip


def with_forces(places: Floats, low: Floats, high: Floats, ball: Cutter, layer: float) -> tuple[float, float]:
    """Processor seconds and removed volume [mm^3]."""
    stock = LayeredStock.block(low, high, layer, 4.0 * ball.diameter)
    begun = time.process_time()
    done = remove(
        program_of(places), stock, {1: ball}, material_named("al7075-t6"),
        Resolution(1000.0, 0.01, 12, 0.5 * ball.radius),
    )  # fmt: skip
    return time.process_time() - begun, done.volume_before - done.volume_after


def dexels(places: Floats, low: Floats, high: Floats, ball: Cutter, pitch: float) -> tuple[float, float]:
    """Processor seconds and removed volume [mm^3]."""
    stock = TriDexel.block(low, high, pitch, "z")
    before, begun = stock.volume(), time.process_time()
    for a, b in itertools.pairwise(places):
        stock.remove_move(a, UP, b, UP, ball.apt, error_mm=0.01)
    return time.process_time() - begun, before - stock.volume()


def freecad(places: Floats, low: Floats, high: Floats, ball: Cutter, pitch: float) -> tuple[float, float] | None:
    """Processor seconds and removed volume [mm^3]; None: there is none, or it fails."""
    command = shutil.which("freecadcmd") or shutil.which("FreeCADCmd")
    if command is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        said, script = Path(folder) / "said.json", Path(folder) / "peer.py"
        said.write_text(
            json.dumps(
                {
                    "low": list(low),
                    "high": list(high),
                    "radius": ball.radius,
                    "height": ball.flute_length,
                    "pitch": pitch,
                    "places": places.tolist(),
                }
            )
        )
        script.write_text(FREECAD)
        env = os.environ | {"CHIPLOAD_PEER": str(said), "QT_QPA_PLATFORM": "offscreen"}
        env.pop("PYTHONPATH", None)
        done = subprocess.run([command, str(script)], env=env, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    found = re.search(r"RESULT (\{.*\})", done.stdout)
    if found is None:
        print(done.stdout[-500:], done.stderr[-500:])
        return None
    result = json.loads(found[1])
    return result["seconds"], float(np.prod(np.subtract(high, low))) - abs(result["left"])


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--lines", type=int, default=30)
    parser.add_argument("--program", type=Path)
    parser.add_argument("--ball", type=float, default=6.0)
    parser.add_argument("--low", type=float, nargs=3, default=(-3.0, -3.0, -6.0))
    parser.add_argument("--high", type=float, nargs=3)
    parser.add_argument("--layer", type=float, default=0.5)
    parser.add_argument("--pitch", type=float, default=0.2)
    said = parser.parse_args()
    places = raster(said.lines) if said.program is None else words(said.program)
    high = np.array(said.high or (63.0, 0.5 * said.lines + 2.5, 0.0))
    low = np.array(said.low)
    ball = Cutter(said.ball, 2, math.radians(30.0), 25.0, 40.0, 580e3, 0.5 * said.ball)
    moves = len(places) - 1
    with_forces(places[:20], low, high, ball, said.layer)  # compiles
    dexels(places[:20], low, high, ball, said.pitch)
    print(f"{moves} moves, ball {said.ball:g} mm, layers {said.layer:g} mm, pitch {said.pitch:g} mm")
    base: float | None = None
    for name, done in (
        ("FreeCAD PathSim, geometry", freecad(places, low, high, ball, said.pitch)),
        ("dexels, geometry", dexels(places, low, high, ball, said.pitch)),
        ("moves, chips and forces", with_forces(places, low, high, ball, said.layer)),
    ):
        if done is None:
            print(f"{name:28s} left out: there is none here")
            continue
        seconds, removed = done
        base = base or seconds
        print(
            f"{name:28s} {moves / seconds:10.0f} moves/s {1e6 * seconds / moves:9.1f} us a move "
            f"{seconds / base:8.1f} times the first   removed {removed:.0f} mm3"
        )


if __name__ == "__main__":
    main()
