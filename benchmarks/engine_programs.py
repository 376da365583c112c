"""Programs that ``benchmarks/engines.py`` runs through both engines: made here, of other people, and of the examples.

Files of others are looked for in the folder of the variable CHIPLOAD_DATA and left out where they are not. Programs of
the examples are planned by the command line into a folder once, ``--planned``.
"""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from chipload.cutter.cutter import Cutter
from chipload.machine.machine import machine_named
from chipload.program.apt.cutters import read_cutters
from chipload.program.program import LINE, RAPID, Program
from chipload.program.read import read_program
from simulation import BALL, finishing

FLAT = Cutter(10.0, 3, math.radians(30.0), 25.0, 40.0, 6e5)
INCH = 25.4
UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Case:
    """A program, its cutters by number, the corners of its block, and the layers and steps that it is simulated with.

    Parameters
    ----------
    kind : of the cutter, as a table of errors names it
    """

    name: str
    kind: str
    program: Program
    cutters: dict[int, Cutter]
    low: tuple[float, ...]
    high: tuple[float, ...]
    layer_mm: float
    step_mm: float


def head(program: Program, rows: int, first: int = 0) -> Program:
    """Some rows; the first is only where they begin. A spindle that the text leaves at rest turns at 1000 rad/s."""
    some = {f.name: getattr(program, f.name)[first : first + rows] for f in fields(Program) if f.name != "labels"}
    some["motion"] = np.concatenate([[RAPID], some["motion"][1:]])
    some["feed"] = np.where(some["motion"] == RAPID, 0.0, some["feed"])
    some["spindle"] = np.where(some["spindle"] == 0.0, 1000.0, some["spindle"])
    return Program(**some, labels=program.labels)


def roughing(moves: int) -> Program:
    """Levels of 2 mm in rows there and back over a block of 120 x 60 mm."""
    rows, along = 21, 134
    k = np.arange(moves + 1)
    at, row, level = k % along, k // along % rows, k // (along * rows)
    x = -7.0 + np.where((k // along) % 2 == 0, at, along - 1 - at)
    y = np.where(level % 2 == 0, 3.0 * row, 3.0 * (rows - 1 - row))
    z = -2.0 * (level + 1.0)
    n = len(k)
    motion = np.full(n, LINE)
    motion[0] = RAPID
    up = np.tile(UP, (n, 1))
    return Program(
        motion=motion, p_work=np.column_stack([x, y, z]), axis=up, centre=np.zeros((n, 3)), normal=up,
        turns=np.zeros(n, dtype=int), feed=np.where(motion == RAPID, 0.0, 20.0), spindle=np.full(n, 1000.0),
        tool=np.ones(n, dtype=int), line=k + 1, label=np.zeros(n, dtype=int), labels=("rough",),
    )  # fmt: skip


def leaning(moves: int) -> Program:
    """The finishing program with an axis that leans by up to 15 deg and turns from point to point."""
    program = finishing(moves)
    x, y = program.p_work[:, 0], program.p_work[:, 1]
    axis = np.column_stack([0.2 * np.sin(x / 9.0), 0.15 * np.cos(y / 8.0), np.ones(len(x))])
    return replace(program, axis=axis / np.linalg.norm(axis, axis=1)[:, None])


def made(name: str, moves: int) -> Case:
    """Finishing over a wave by a ball nose, upright or (``five axes``) leaning, or roughing by a flat mill."""
    if name == "five axes":
        high = (106.0, float(finishing(moves).p_work[:, 1].max()) + 6.0, 0.0)
        return Case(name, "ball", leaning(moves), {1: BALL}, (-6.0, -6.0, -8.0), high, 0.25, 3.0)
    if name == "finishing":
        program = finishing(moves)
        high = (106.0, float(program.p_work[:, 1].max()) + 6.0, 0.0)
        return Case(name, "ball", program, {1: BALL}, (-6.0, -6.0, -8.0), high, 0.25, 3.0)
    deep = 2.0 * (moves // (134 * 21) + 1) + 1.0
    return Case(name, "flat", roughing(moves), {1: FLAT}, (0.0, 0.0, -deep), (120.0, 60.0, 0.0), 2.0, 3.0)


def of_others(rows: int) -> Iterator[Case]:
    """Bear and cameo of CAMotics (ball noses), the boat of LinuxCNC (five axes); their first ``rows``.

    Stock and cutter are those of the project files; of the boat, whose text says neither, a block round its way at a
    feed from the table up. Flutes, helix and overhang are assumed.
    """
    data = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2] / "shared" / "data")) / "nc"
    for name, layer in (("bear", 0.5), ("cameo", 0.25)):
        folder = data / "camotics" / name
        if not folder.is_dir():
            continue
        said = json.loads((folder / f"{name}.camotics").read_text())
        tool, block = said["tools"]["1"], said["workpiece"]["bounds"]
        unit = INCH if tool["units"] == "imperial" else 1.0
        d, length = unit * tool["diameter"], unit * tool["length"]
        ball = Cutter(d, 2, math.radians(30.0), length, length + 5.0, 580e3, 0.5 * d)
        program = read_program(folder / f"{name}.nc", machine_named("vmc")).program
        yield Case(
            name, "ball", head(program, rows), dict.fromkeys(np.unique(program.tool).tolist(), ball),
            tuple(block["min"]), tuple(block["max"]), layer, 1.0,
        )  # fmt: skip
    boat = data / "linuxcnc_5axis" / "boat-xyzac.ngc"
    if boat.is_file():
        program = read_program(boat, machine_named("xyzac-trunnion"), tolerance=0.01).program
        mill = Cutter(10.0, 3, math.radians(30.0), 30.0, 45.0, 580e3)
        first = int(np.flatnonzero(program.tool == 1)[0])
        program = replace(program, tool=np.ones(len(program), dtype=np.int64))
        leans = int(np.argmax(np.abs(program.axis - UP).max(axis=1) > 1e-9))
        for name, at in (("boat, three axes", first), ("boat, five axes", leans)):
            some = {
                f.name: getattr(program, f.name)[at - 1 : at - 1 + rows] for f in fields(Program) if f.name != "labels"
            }
            some["motion"] = np.concatenate([[RAPID], some["motion"][1:]])
            yield Case(
                name, "flat", Program(**some, labels=program.labels), {1: mill}, (-50.0, -27.0, -13.25),
                (47.0, 23.0, 0.5), 0.5, 2.0,
            )  # fmt: skip


def of_examples(folder: Path, rows: int) -> Iterator[Case]:
    """The contour, the pocket and a roughing program of the impeller, as ``chipload run`` plans them; first ``rows``.

    The stock is the block round their way at a feed, as wide as the cutter beside it.
    """
    for name in ("contour", "pocket", "impeller"):
        result = folder / name / "result"
        if not result.is_dir():
            words = [sys.executable, "-m", "chipload"]
            subprocess.run([*words, "example", name, str(folder / name)], check=True, capture_output=True)
            subprocess.run([*words, "run", str(folder / name / "job.toml"), "--out", str(result)], capture_output=True)
        files = sorted(result.glob("*.apt"))
        rough = [f for f in files if "rough" in f.name] if name == "impeller" else files
        if not rough:
            continue
        program = read_program(rough[0], machine_named("vmc" if name != "impeller" else "horizontal-b")).program
        cutters = cutters_of(rough[0].read_text()) or cutter_named(rough[0].name)
        yield in_block(name, head(program, rows), cutters)


def cutters_of(text: str) -> dict[int, Cutter]:
    """The cutters that CL data describe, with three flutes of 30 deg."""
    return {
        n: Cutter(d, 3, math.radians(30.0), h, h + d, 6e5, r, bottom=alpha, taper=beta)
        for n, (d, r, _, _, alpha, beta, h) in read_cutters(text)[0].items()
    }


def cutter_named(name: str) -> dict[int, Cutter]:
    """The cutter that the name of an impeller's program states, as ``1-rough-D26r2-90deg``, with flutes of 60 mm."""
    found = re.search(r"D([.0-9]+)r([.0-9]+)", name)
    assert found is not None, name
    return {1: Cutter(float(found[1]), 3, math.radians(30.0), 60.0, 80.0, 6e5, float(found[2]))}


def in_block(name: str, program: Program, cutters: dict[int, Cutter]) -> Case:
    """A program in the block round its way at a feed, turned so that the mean of its axes stands along z."""
    up = program.axis.mean(axis=0) / np.linalg.norm(program.axis.mean(axis=0))
    first = np.eye(3)[0] if np.allclose(up, UP) else np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    first = first / np.linalg.norm(first)
    turned = np.array([first, np.cross(up, first), up]).T
    axis = program.axis @ turned
    vectors = {name: getattr(program, name) @ turned for name in ("p_work", "centre", "normal")}
    program = replace(program, axis=axis / np.linalg.norm(axis, axis=1)[:, None], **vectors)
    way = program.p_work[program.motion != RAPID]
    wide = 2.0 * max(c.radius for c in cutters.values())
    deep = max(5.0, 0.2 * float(np.ptp(way[:, 2])))
    low = (*(way[:, :2].min(axis=0) - wide).tolist(), float(way[:, 2].min()) - 1.0)
    high = (*(way[:, :2].max(axis=0) + wide).tolist(), float(way[:, 2].min()) + deep)
    kind = "bull nose" if any(c.corner_radius > 0.0 for c in cutters.values()) else "flat"
    return Case(name, kind, program, cutters, low, high, 1.0, 1.0)
