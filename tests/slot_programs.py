"""Programs of slots and passes of varied step-over, and what feed each place of them allows: an oracle in NumPy.

No code of the package is used. The block is cut by a flat end mill whose every edge point is followed: a point of the
rim is in material where it lies in the block and outside all that the path swept before. The chip is f_z sin(phi).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

D, TEETH, HELIX_DEG, AP, RPM = 10.0, 4, 38.0, 5.0, 6000.0
#: Ktc, Krc, Kac [MPa], Kte, Kre, Kae [N/mm]
COEFFICIENTS = (800.0, 300.0, 150.0, 20.0, 15.0, 5.0)
LOW, HIGH = (0.0, -15.0, -12.0), (40.0, 30.0, 0.0)
LIMIT_N, SLOWEST, FASTEST, PROGRAMMED, ACCELERATION = 450.0, 90.0, 5400.0, 1000.0, 3000.0
#: angles of a revolution, and distance of places on the path [mm]
ANGLES, APART = 720, 0.25


@dataclass(frozen=True)
class Line:
    """A line of the text that cuts: its points (arcs in chords) and its line of the text."""

    points: Floats
    number: int


def program(seed: int, passes: int = 5) -> tuple[str, list[Line]]:
    """A slot, passes of varied step-over to and fro, a corner and an arc; the text and the lines that cut."""
    g = np.random.default_rng(seed)
    text = ["G21 G90 G94 G17", "T1 M6", f"S{RPM:g} M3"]
    out: list[Line] = []

    def go(x: float, y: float) -> None:
        text.extend(["G0 Z5", f"G0 X{x:.3f} Y{y:.3f}", "G0 Z-5"])

    def cut(points: list[tuple[float, float]], words: str) -> None:
        text.append(f"{words} F{PROGRAMMED:g}" if not out else words)
        out.append(Line(np.array(points), len(text)))

    def line(x0: float, y0: float, x1: float, y1: float) -> None:
        cut([(round(x0, 3), round(y0, 3)), (round(x1, 3), round(y1, 3))], f"G1 X{x1:.3f} Y{y1:.3f}")

    go(-10, 0)
    line(-10, 0, 50, 0)
    y = 0.0
    for k in range(passes):
        y += g.uniform(0.5, 7.0)
        x0, x1 = (-10.0, 50.0) if k % 2 == 0 else (50.0, -10.0)
        middle, rise = g.uniform(10.0, 30.0), g.uniform(-0.5, 2.0)
        go(x0, y)
        line(x0, y, middle, y)
        line(middle, y, x1, y + rise)
        y = max(y, y + rise)
    go(20, -20.5)
    line(20, -20.5, 20, -9)
    turn = np.linspace(math.pi, 0.5 * math.pi, 61)
    cut([(26.0 + 6.0 * math.cos(t), -9.0 + 6.0 * math.sin(t)) for t in turn], "G2 X26 Y-3 I6 J0")
    line(26, -3, 45, -3)
    return "\n".join([*text, "G0 Z5", "M2", ""]), out


@dataclass(frozen=True, eq=False)
class Places:
    """Places along the lines: line, way from its beginning, width and whole way of the line [mm], edge in material."""

    line: NDArray[np.int64]
    way: Floats
    width: Floats
    along: Floats
    inside: NDArray[np.bool_]


def places_of(lines: list[Line], apart: float = APART) -> Places:
    """Places in the middle of segments of equal length, and which angles of the rim are in material there."""
    angle = math.tau * (np.arange(ANGLES) + 0.5) / ANGLES
    rim = np.column_stack([np.cos(angle), np.sin(angle)])
    swept: list[tuple[Floats, Floats]] = []
    line, way, width, along, inside = [], [], [], [], []
    for k, own in enumerate(lines):
        a, b = own.points[:-1], own.points[1:]
        size = np.linalg.norm(b - a, axis=1)
        ends = np.concatenate([[0.0], np.cumsum(size)])
        n = max(3, round(ends[-1] / apart))
        for s in (np.arange(n) + 0.5) * ends[-1] / n:
            i = min(int(np.searchsorted(ends, s)) - 1, len(size) - 1)
            unit = (b[i] - a[i]) / size[i]
            c = a[i] + (s - ends[i]) * unit
            p = c + 0.5 * D * rim
            free = (rim @ unit > 1e-9) & (p[:, 0] >= LOW[0]) & (p[:, 0] <= HIGH[0])
            free &= (p[:, 1] >= LOW[1]) & (p[:, 1] <= HIGH[1])
            for p0, p1 in (*swept, *zip(a[:i], b[:i], strict=True), (a[i], c)):
                near = p[free]
                d = p1 - p0
                t = np.clip((near - p0) @ d / max(float(d @ d), 1e-30), 0.0, 1.0)
                free[free] = np.linalg.norm(near - p0 - t[:, None] * d, axis=1) > 0.5 * D - 1e-7
            line.append(k)
            way.append(s)
            width.append(ends[-1] / n)
            along.append(math.atan2(unit[1], unit[0]))
            inside.append(free)
        swept += list(zip(a, b, strict=True))
    return Places(np.array(line), np.array(way), np.array(width), np.array(along), np.array(inside))


def forces(places: Places, feed: Floats) -> Floats:
    """Greatest force (n,) [N] over a revolution at feeds (n,) [mm/min]: slices of the edge are summed."""
    angle = math.tau * (np.arange(ANGLES) + 0.5) / ANGLES
    ktc, krc, kac, kte, kre, kae = COEFFICIENTS
    tooth = feed / RPM / TEETH
    h = np.maximum(tooth[:, None] * np.cos(angle[None] - places.along[:, None]), 0.0)
    ft, fr, fa = (
        np.where(places.inside, k * h + e, 0.0) for k, e in ((ktc, kte), (krc, kre), (kac, kae))
    )  # fmt: skip
    # the spindle turns clockwise; the tooth is pushed against its motion and away from the material
    x = -ft * np.sin(angle) - fr * np.cos(angle)
    y = ft * np.cos(angle) - fr * np.sin(angle)
    # an edge lags by tan(helix) / R over its depth: at one rotation it covers a range of angles
    lag = AP * math.tan(math.radians(HELIX_DEG)) / (0.5 * D)
    span = lag / math.tau * ANGLES
    total = np.zeros((3, len(feed), ANGLES))
    for k, part in enumerate((x, y, -fa)):
        summed = np.concatenate([np.zeros((len(feed), 1)), np.cumsum(np.tile(part, 2), axis=1)], axis=1)
        at = np.arange(ANGLES)
        whole, rest = int(span), span - int(span)
        window = summed[:, at + whole] - summed[:, at] + rest * part[:, (at + whole) % ANGLES]
        one = window * AP / span
        for j in range(TEETH):
            total[k] += np.roll(one, j * ANGLES // TEETH, axis=1)
    return np.asarray(np.sqrt((total**2).sum(axis=0)).max(axis=1))


def allowed_feeds(places: Places) -> Floats:
    """Greatest feed (n,) [mm/min] at which each place keeps the limit, by halving."""
    low, high = np.full(len(places.line), SLOWEST), np.full(len(places.line), FASTEST)
    for _ in range(16):
        middle = 0.5 * (low + high)
        holds = forces(places, middle) <= LIMIT_N
        low, high = np.where(holds, middle, low), np.where(holds, high, middle)
    return low


def travel_time(width: Floats, feed: Floats, acceleration: float = ACCELERATION) -> float:
    """Time [s] of a line from rest to rest at feeds (n,) [mm/min] that hold over widths (n,) [mm]."""
    w, v = np.repeat(width / 10.0, 10), np.repeat(feed / 60.0, 10)
    node = np.concatenate([[0.0], np.minimum(v[:-1], v[1:]), [0.0]])
    for i in range(len(w)):
        node[i + 1] = min(node[i + 1], math.sqrt(node[i] ** 2 + 2.0 * acceleration * w[i]))
    for i in range(len(w) - 1, -1, -1):
        node[i] = min(node[i], math.sqrt(node[i + 1] ** 2 + 2.0 * acceleration * w[i]))
    top = np.minimum(v, np.sqrt(acceleration * w + 0.5 * (node[:-1] ** 2 + node[1:] ** 2)))
    change = (2.0 * top**2 - node[:-1] ** 2 - node[1:] ** 2) / (2.0 * acceleration)
    return float(((2.0 * top - node[:-1] - node[1:]) / acceleration + (w - change) / top).sum())


def total_time(places: Places, feed: Floats) -> float:
    """Time of all lines [s], each from rest to rest."""
    each = (places.line == k for k in np.unique(places.line))
    return sum(travel_time(places.width[own], feed[own]) for own in each)


def lines_in(lines: list[Line], segments: Mapping[int, range]) -> list[range]:
    """The lines of the new text of each line that cuts; ``segments``: those of the lines that are divided."""
    out, more = [], 0
    for line in lines:
        own = segments.get(line.number)
        out.append(range(line.number + more, line.number + more + (1 if own is None else len(own))))
        more += 0 if own is None else len(own) - 1
    return out


def written_feeds(text: str, places: Places, first: list[range]) -> Floats:
    """Feed (n,) [mm/min] of each place in a new text; ``first``: the lines of the text of each line that cuts.

    Where two segments meet within the width of a place the faster feed counts.
    """
    out = np.zeros(len(places.line))
    rows, feed, x, y = text.split("\n"), 0.0, 0.0, 0.0
    spans: dict[int, list[tuple[float, float, float]]] = {}
    of = {number: k for k, numbers in enumerate(first) for number in numbers}
    for number, row in enumerate(rows, 1):
        words = {w[0]: float(w[1:]) for w in row.split("(")[0].split() if w[0] in "XYFIJ"}
        feed, x0, y0 = words.get("F", feed), x, y
        x, y = words.get("X", x), words.get("Y", y)
        if number in of:
            chord = math.hypot(x - x0, y - y0)
            size = chord if "I" not in words else 12.0 * math.asin(min(1.0, chord / 12.0))
            segments = spans.setdefault(of[number], [])
            begin = segments[-1][1] if segments else 0.0
            segments.append((begin, begin + size, feed))
    for k, segments in spans.items():
        at = np.flatnonzero(places.line == k)
        for begin, end, own in segments:
            there = (places.way[at] + 0.5 * places.width[at] > begin) & (places.way[at] - 0.5 * places.width[at] < end)
            out[at[there]] = np.maximum(out[at[there]], own)
    return out


#: the shipped machine without a limit of the jerk, as the times here have none
MACHINE = (
    (files("chipload") / "data" / "machines" / "vmc.toml")
    .read_text(encoding="utf-8")
    .replace("jerk_low_mm_s3 = 20000.0", "jerk_mm_s3 = 1e9")
)

JOB = f"""[program]
file = "a.ngc"
[machine]
file = "machine.toml"
[stock]
low_mm = [{LOW[0]}, {LOW[1]}, {LOW[2]}]
high_mm = [{HIGH[0]}, {HIGH[1]}, {HIGH[2]}]
[material]
file = "m.toml"
[[cutter]]
number = 1
diameter_mm = {D}
flutes = {TEETH}
helix_deg = {HELIX_DEG}
flute_length_mm = 25.0
overhang_mm = 35.0
modulus_gpa = 580.0
runout_mm = 0.0
[[operation]]
kind = "simulate"
step_mm = 0.5
tolerance_mm = 0.002
[operation.feeds]
slowest_percent = {100.0 * SLOWEST / PROGRAMMED}
fastest_percent = {100.0 * FASTEST / PROGRAMMED}
air_mm_min = {FASTEST}
[limits]
force_n = {LIMIT_N}
[checks]
confidence = 0.5
cutter_strength = false
"""
