"""LinuxCNC's own interpreter as an independent reader: what it understands a program to mean.

`rs274 -g` prints canonical commands with 4 decimals; nothing here uses our reader or our writer.
"""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

MISSING = "rs274 is not installed: apt-get install linuxcnc-uspace"
_CALL = re.compile(r"^\s*\d+\s+N\S*\s+(\w+)\((.*)\)\s*$")


def rs274_installed() -> bool:
    return shutil.which("rs274") is not None


@dataclass(frozen=True)
class Motion:
    """``kind`` traverse, feed, arc or dwell; ``end`` [mm]; ``turns`` of an arc, > 0 counter-clockwise; ``feed``
    [mm/min]; ``spindle`` [rpm] > 0 clockwise; ``fresh``: the first since a change of tool."""

    kind: str
    end: tuple[float, float, float]
    feed: float
    spindle: float
    tool: int
    fresh: bool
    centre: tuple[float, float] = (0.0, 0.0)
    turns: int = 0
    seconds: float = 0.0


class Refused(Exception):
    """rs274 did not accept the program; the text is its own."""


def canonical(text: str, tools: tuple[int, ...] = tuple(range(1, 100))) -> list[tuple[str, list[str]]]:
    """(name, words) of every canonical command; :class:`Refused` where rs274 finds an error."""
    with tempfile.TemporaryDirectory() as folder:
        program, table = Path(folder) / "program.ngc", Path(folder) / "tool.tbl"
        program.write_text(text)
        table.write_text("".join(f"T{n} P{n} D1\n" for n in tools))
        call = ["rs274", "-g", "-t", str(table), "-v", str(Path(folder) / "rs274.var"), str(program)]
        # its tool table is a memory map under HOME: a home of its own lets several run side by side
        home = {**os.environ, "HOME": folder}
        done = subprocess.run(call, capture_output=True, text=True, cwd=folder, timeout=120, env=home)
    if done.returncode != 0:
        raise Refused(done.stderr)
    calls = [_CALL.match(line) for line in done.stdout.splitlines()]
    return [(hit[1], [x.strip() for x in hit[2].split(",")]) for hit in calls if hit is not None]


def run_rs274(text: str, tools: tuple[int, ...] = tuple(range(1, 100))) -> list[Motion]:
    """The canonical motions of a program, in mm, arcs in the XY plane; :class:`Refused` where rs274 finds an error."""
    motions: list[Motion] = []
    feed = speed = sense = seconds = 0.0
    tool, fresh = 0, True
    unit = 1.0
    for name, words in canonical(text, tools):
        kind, end, centre, turns = "", (0.0, 0.0, 0.0), (0.0, 0.0), 0
        if name == "USE_LENGTH_UNITS":
            unit = {"CANON_UNITS_MM": 1.0, "CANON_UNITS_INCHES": 25.4}[words[0]]
        elif name == "SET_FEED_RATE":
            feed = unit * float(words[0])
        elif name == "SELECT_PLANE":
            assert words[0] == "CANON_PLANE_XY"
        elif name == "SET_SPINDLE_SPEED":
            speed = float(words[1])
        elif name == "START_SPINDLE_CLOCKWISE":
            sense = 1.0
        elif name == "START_SPINDLE_COUNTERCLOCKWISE":
            sense = -1.0
        elif name == "STOP_SPINDLE_TURNING":
            sense = 0.0
        elif name == "SELECT_TOOL":
            tool = int(words[0])
        elif name == "CHANGE_TOOL":
            fresh = True
        elif name == "STRAIGHT_TRAVERSE":
            kind, end = "traverse", tuple(unit * float(x) for x in words[:3])
        elif name == "STRAIGHT_FEED":
            kind, end = "feed", tuple(unit * float(x) for x in words[:3])
        elif name == "ARC_FEED":
            x, y, cx, cy, turns, z = (float(w) for w in words[:6])
            kind, end, centre, turns = "arc", (unit * x, unit * y, unit * z), (unit * cx, unit * cy), int(turns)
        elif name == "DWELL":
            kind, seconds = "dwell", float(words[0])
            end = motions[-1].end if motions else end
        if kind:
            motions.append(Motion(kind, end, feed, sense * speed, tool, fresh, centre, turns, seconds))
            fresh = False
    return motions


def assert_same_motions(motions: list[Motion], program, *, mm: float = 1e-4, unit: float = 1e-6) -> int:
    """Assert that canonical motions are a Program's rows; how many rows were left out because they round to nothing.

    A row may be left out, or an arc be a line, only where the difference is below the written ``unit``.
    """
    kinds = {0: "traverse", 1: "feed", 2: "arc", 3: "arc", 4: "dwell"}
    queue = list(motions)
    left = 0
    before = np.array(program.p_work[0])
    for k in range(len(program)):
        end, kind = program.p_work[k], kinds[int(program.motion[k])]
        where = f"row {k}: {kind} to {end.tolist()}"
        chord = float(np.abs(end - before).max())
        near = chord <= 2.0 * unit
        got = queue[0] if queue else None
        if got is not None and got.fresh and kind == "traverse":
            # over the start, then down: two traverses for one row
            assert got.kind == "traverse", where
            assert np.abs(np.array(got.end)[:2] - end[:2]).max() <= mm, where
            queue.pop(0)
            got = queue[0] if queue else None
        radius = math.hypot(*(end[:2] - program.centre[k, :2]))
        plane = math.hypot(*(end[:2] - before[:2]))
        flat = kind == "arc" and (plane**2 / (8.0 * max(radius, unit)) <= unit or plane <= 3.0 * unit)
        match = got is not None and np.abs(np.array(got.end) - end).max() <= mm
        match = match and (got.kind == kind or (flat and got.kind == "feed"))
        full = kind == "arc" and plane <= 1e-7
        if not match:
            assert near, f"{where}: got {got}"
            assert not full, f"{where}: got {got}"
            left += 1
            before = end
            continue
        queue.pop(0)
        if got.kind == "arc":
            assert np.abs(np.array(got.centre) - program.centre[k, :2]).max() <= mm, f"{where}: got {got}"
            assert got.turns == (1 if program.motion[k] == 3 else -1), f"{where}: got {got}"
        if kind == "dwell":
            assert abs(got.seconds - program.feed[k]) <= 1e-4, where
        elif kind != "traverse":
            assert abs(got.feed - 60.0 * program.feed[k]) <= 1.01e-3, (
                f"{where}: feed {got.feed} is not {60.0 * program.feed[k]}"
            )
        assert got.tool == program.tool[k], where
        assert abs(got.spindle - program.spindle[k] * 60.0 / math.tau) <= 1.01e-3, where
        before = end
    assert not queue, f"motions that no row has: {queue[:3]}"
    return left
