"""Canonical commands of LinuxCNC against Commands: the motions that `rs274 -g` prints, or that a golden file holds.

Nothing here uses our reader. Numbers are printed with 4 decimals in the units that are active.
"""

from __future__ import annotations

import math
import os
import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

_CALL = re.compile(r"^\s*(?:\d+\s+)?N\S*\s+(\w+)\((.*)\)\s*$")
_PLANES = {"CANON_PLANE_XY": 0, "CANON_PLANE_XZ": 1, "CANON_PLANE_YZ": 2}
#: half of the last digit that is printed, and a little for the last bit
HALF = 5.0e-5 * 1.001


class Refused(Exception):
    """rs274 did not accept the program; the text is its own."""


@dataclass(frozen=True)
class Canon:
    """One motion: ``kind`` traverse, feed, arc, dwell, probe or nurbs; X Y Z A B C in mm and deg, feed in mm/s or
    deg/s, spindle in rpm; offsets as (6,) in mm and deg; ``unit`` mm of the printed digits."""

    kind: str
    end: tuple[float, ...]
    unit: float
    feed: float
    spindle: float
    tool: int
    number: int
    offset: tuple[float, ...]
    rotation: float
    shift: tuple[float, ...]
    length: tuple[float, ...]
    plane: int = 0
    centre: tuple[float, float] = (0.0, 0.0)
    turns: int = 0
    seconds: float = 0.0


def run_canonical(text: str, *, table: str = "", files: dict[str, str] | None = None, timeout: float = 120.0) -> str:
    """What rs274 prints; :class:`Refused` where it finds an error."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "program.ngc").write_text(text)
        (folder / "tool.tbl").write_text(table)
        for other, body in (files or {}).items():
            (folder / other).write_text(body)
        call = ["rs274", "-g", "-t", "tool.tbl", "-v", "rs274.var", "program.ngc"]
        home = {**os.environ, "HOME": name}
        done = subprocess.run(
            call, capture_output=True, text=True, cwd=folder, timeout=timeout, env=home, errors="replace"
        )
    if done.returncode != 0:
        raise Refused(done.stderr.replace("executing", "").strip())
    return done.stdout


def parse_canonical(printed: str) -> tuple[list[Canon], list[str]]:
    """Motions and messages of what rs274 prints."""
    motions: list[Canon] = []
    messages: list[str] = []
    unit, feed, mode, speed, sense, tool, chosen, number, plane = 1.0, 0.0, 0, 0.0, 0, 0, 0, 1, 0
    offset = shift = length = (0.0,) * 6
    rotation = 0.0
    at = (0.0,) * 6

    def six(words: list[str]) -> tuple[float, ...]:
        return tuple(float(w) * (unit if k < 3 else 1.0) for k, w in enumerate(words[:6]))

    for line in printed.splitlines():
        hit = _CALL.match(line)
        if hit is None:
            continue
        name = hit[1]
        words = [w for w in re.split(r"[,\s]+", hit[2].strip()) if w]
        kind, end, extra = "", at, {}
        if name == "USE_LENGTH_UNITS":
            unit = {"CANON_UNITS_MM": 1.0, "CANON_UNITS_INCHES": 25.4}[words[0]]
        elif name == "SET_G5X_OFFSET":
            number, offset = int(words[0]), six(words[1:])
        elif name == "SET_G92_OFFSET":
            shift = six(words)
        elif name == "SET_XY_ROTATION":
            rotation = float(words[0])
        elif name == "USE_TOOL_LENGTH_OFFSET":
            length = six(words)
        elif name == "SET_FEED_RATE":
            feed, feed_unit = float(words[0]), unit
        elif name == "SET_FEED_MODE":
            mode = int(words[1])
        elif name == "SELECT_PLANE":
            plane = _PLANES[words[0]]
        elif name == "SET_SPINDLE_SPEED":
            speed = float(words[1])
        elif name == "START_SPINDLE_CLOCKWISE":
            sense = 1
        elif name == "START_SPINDLE_COUNTERCLOCKWISE":
            sense = -1
        elif name == "STOP_SPINDLE_TURNING":
            sense = 0
        elif name == "SELECT_TOOL":
            chosen = int(words[0])
        elif name in ("CHANGE_TOOL", "CHANGE_TOOL_NUMBER"):
            tool = int(words[0]) if words else chosen
        elif name == "MESSAGE":
            messages.append(hit[2].strip('"').strip())
        elif name == "STRAIGHT_TRAVERSE":
            kind, end = "traverse", six(words)
        elif name == "STRAIGHT_FEED":
            kind, end = "feed", six(words)
        elif name == "STRAIGHT_PROBE":
            kind, end = "probe", six(words)
        elif name == "ARC_FEED":
            first, second, one, two, turns, along, *rest = (float(w) for w in words)
            places = ((0, 1, 2), (2, 0, 1), (1, 2, 0))[plane]
            xyz = [0.0, 0.0, 0.0]
            for place, value in zip(places, (first, second, along), strict=True):
                xyz[place] = unit * value
            kind, end = "arc", (*xyz, *rest[:3])
            extra = {"centre": (unit * one, unit * two), "turns": int(turns)}
        elif name == "NURBS_FEED":
            kind = "nurbs"
        elif name == "DWELL":
            kind, extra = "dwell", {"seconds": float(words[0])}
        if not kind:
            continue
        turning = kind == "feed" and end[:3] == at[:3] and end[3:] != at[3:]
        rate = 0.0
        if kind in ("feed", "arc", "probe"):
            rate = feed * (1.0 if turning else feed_unit) * (speed if mode else 1.0) / 60.0
        motions.append(
            Canon(kind, end, unit, rate, sense * speed, tool, number, offset, rotation, shift, length, plane, **extra)
        )
        at = end
    return motions, messages


def compare_commands(motions: list[Canon], commands, *, spindle: bool = True, tools: bool = True) -> int:
    """Assert that Commands are the canonical motions; how many were compared."""
    kinds = {0: "traverse", 1: "feed", 2: "arc", 3: "dwell", 4: "probe"}
    row = 0
    for k, motion in enumerate(motions):
        if motion.kind == "nurbs":
            line = commands.line[row]
            while row < len(commands) and commands.line[row] == line:
                assert commands.motion[row] == 1
                row += 1
            continue
        where = f"motion {k} ({motion}) and row {row}"
        assert row < len(commands), f"{where}: only {len(commands)} rows"
        where += f" of line {commands.line[row]}"
        assert kinds[int(commands.motion[row])] == motion.kind, f"{where}: {kinds[int(commands.motion[row])]}"
        near = HALF * motion.unit
        got = commands.position[row]
        if motion.kind != "dwell":
            size = np.maximum(1.0, np.abs(got[:3]) * 1e-11)
            assert (np.abs(got[:3] - motion.end[:3]) <= near * size).all(), f"{where}: {got}"
            assert np.abs(np.degrees(got[3:6]) - motion.end[3:6]).max() <= HALF, f"{where}: {got}"
        if motion.kind == "arc":
            assert commands.plane[row] == motion.plane, where
            bound = near * max(1.0, float(np.abs(commands.centre[row]).max()) * 1e-9)
            assert np.abs(commands.centre[row] - motion.centre).max() <= bound, f"{where}: {commands.centre[row]}"
            assert commands.turns[row] == motion.turns, where
        if motion.kind == "dwell":
            assert abs(commands.feed[row] - motion.seconds) <= HALF, where
        elif motion.kind in ("feed", "arc", "probe"):
            feed = commands.feed[row]
            turning = abs(feed - motion.feed) > abs(math.degrees(feed) - motion.feed)
            feed = math.degrees(feed) if turning else feed
            assert abs(feed - motion.feed) <= 1e-6 + HALF * motion.unit / 60.0 * 1.5 + 1e-9 * feed, (
                f"{where}: feed {feed}"
            )
        else:
            assert commands.feed[row] == 0.0, where
        if spindle:
            rpm = commands.spindle[row] * 60.0 / math.tau
            assert abs(rpm - motion.spindle) <= HALF + 1e-9 * abs(rpm), f"{where}: spindle {rpm}"
        if tools:
            assert commands.tool[row] == motion.tool, f"{where}: tool {commands.tool[row]}"
        frame = commands.frames[commands.frame[row]]
        for name, wanted in (("offset", motion.offset), ("shift", motion.shift), ("tool", motion.length)):
            value = getattr(frame, name).copy()
            value[3:6] = np.degrees(value[3:6])
            # what was printed may have been printed in the other units
            assert np.abs(value[:6] - wanted).max() <= 1.0001 * HALF * 25.4, f"{where}: {name} {value}"
        assert frame.number == motion.number, where
        assert abs(math.degrees(frame.rotation) - motion.rotation) <= HALF, where
        row += 1
    assert row == len(commands), (
        f"{len(commands) - row} rows that rs274 does not know, the first on line {commands.line[row]}"
    )
    return len(motions)
