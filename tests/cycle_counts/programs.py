"""Short programs for LinuxCNC's trajectory planner, and real ones: the clock is held against the cycles they take."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
START = "G0 X0 Y0 Z0\n"
REAL = Path("nc/linuxcnc_traj/circular-arcs/nc_files")
#: real programs, by their place in the data
REAL_FILES = (
    REAL / "quick-tests/sawtooth.ngc",
    REAL / "quick-tests/square_spiral.ngc",
    REAL / "quick-tests/naive_cam_corner2.ngc",
    REAL / "quick-tests/linearc-convex.ngc",
    REAL / "quick-tests/arc-arc-convex-convex.ngc",
    REAL / "performance/bezel_ex_37tick.ngc",
    REAL / "performance/random_lines_0.001in.ngc",
    REAL / "speed-tests/sam-tail-slowdown.ngc",
)


def _text(head: str, *blocks: str) -> str:
    return "\n".join([f"G21 G90 G17 {head}", START + "\n".join(blocks), "M2", ""])


def _zigzag(head: str) -> str:
    rows = [f"G1 X{0 if k % 2 else 40} F3000\nY{2 * (k + 1)}" for k in range(12)]
    return _text(head, "G1 Z-1 F3000", *rows, "G0 Z5")


def _curve(head: str, n: int, feed: float) -> str:
    rows = []
    for k in range(1, n + 1):
        a = math.tau * k / n
        r = 16.0 * (1.0 + 0.25 * math.cos(5.0 * a))
        rows.append(f"G1 X{r * math.cos(a):.4f} Y{r * math.sin(a):.4f} Z{-k / n:.4f} F{feed:g}")
    return _text(head, "G0 X20", *rows)


def _random(head: str) -> str:
    steps = np.random.default_rng(3).normal(0.0, 1.0, (120, 3)) * (3.0, 3.0, 0.6)
    return _text(head, *(f"G1 X{x:.3f} Y{y:.3f} Z{z:.3f} F2400" for x, y, z in np.cumsum(steps, axis=0)))


def _rapids(head: str) -> str:
    return _text(head, *(f"G0 X{37 * k % 90} Y{53 * k % 70} Z{11 * k % 30}" for k in range(1, 25)))


def _arches(head: str, radius: float, rise: float) -> str:
    """Lines that meet half circles at corners, which bend outwards and inwards in turn."""
    rows, x = [f"G1 X{3 * radius:g} Y0 F2400"], 3.0 * radius
    for k in range(8):
        y = rise * (k % 2)
        rows += [f"G{2 + k // 2 % 2} X{x + 2 * radius:g} Y{y:g} I{radius:g} J0"]
        rows += [f"G1 X{x + 5 * radius:g} Y{rise - y:g}"]
        x += 5.0 * radius
    return _text(head, *rows)


def _corners(head: str, seed: int, straight: float) -> str:
    """Lines and arcs of any radius and angle, one after another; ``straight``: share of lines."""
    rng, x, y, rows = np.random.default_rng(seed), 0.0, 0.0, ["G1 F2400"]
    for k in range(24):
        turn = rng.uniform(0.0, math.tau)
        if (k % 2 == 0) if straight == 0.5 else rng.random() < straight:
            length = 10.0 ** rng.uniform(-0.2, 1.2)
            x, y = round(x + length * math.cos(turn), 6), round(y + length * math.sin(turn), 6)
            rows.append(f"G1 X{x:.6f} Y{y:.6f}")
            continue
        r, sweep = 10.0 ** rng.uniform(-0.3, 1.0), rng.uniform(0.3, 5.5) * rng.choice([-1, 1])
        i, j = -r * math.cos(turn), -r * math.sin(turn)
        x, y = (
            round(c + r * f(turn + sweep), 6) for c, f in ((x + i, math.cos), (y + j, math.sin))
        )  # fmt: skip
        rows.append(f"G{3 if sweep > 0 else 2} X{x:.6f} Y{y:.6f} I{i:.6f} J{j:.6f}")
    return _text(head, *rows)


def _spiral_pocket(head: str) -> str:
    """A pocket of 40 x 30 mm with rounded corners, by rings from inside, after a helix down."""
    rows = ["G0 X2 Y0 Z1", "G3 X2 Y0 Z-1 I-2 J0 F900", "G3 I-2 J0"]
    for k in range(1, 6):
        w, h, r = 4.0 * k, 3.0 * k, 1.0 + 0.4 * k
        rows += [f"G1 X{w:g} Y0 F3000", f"Y{h - r:g}", f"G3 X{w - r:g} Y{h:g} I{-r:g} J0", f"G1 X{r - w:g}"]
        rows += [f"G3 X{-w:g} Y{h - r:g} I0 J{-r:g}", f"G1 Y{r - h:g}", f"G3 X{r - w:g} Y{-h:g} I{r:g} J0"]
        rows += [f"G1 X{w - r:g}", f"G3 X{w:g} Y{r - h:g} I0 J{r:g}", "G1 Y0"]
    return _text(head, *rows, "G0 Z5")


def _five(head: str) -> str:
    rows = [
        f"G1 X{30 * math.sin(k / 15):.3f} Y{20 * math.cos(k / 11) - 20:.3f} Z{3 * math.sin(k / 7):.3f} "
        f"A{15 * math.sin(k / 20):.3f} C{2 * k:.3f} F2000"
        for k in range(1, 121)
    ]
    return _text(head, "G0 A0 C0", *rows)


def own_programs() -> dict[str, tuple[str, str]]:
    """Axes of the machine and text, by name."""
    pockets = [
        f"G0 X{10 * k} Y0 Z5\nG0 Z1\nG1 Z-2 F300\nG1 Y20 F1500\nX{10 * k + 5}\nY0\nX{10 * k}\nG0 Z5" for k in range(6)
    ]
    helix = [f"G3 X10 Y0 Z{-2 * k} I-10 J0 F4000" for k in range(1, 8)]
    helix += ["G1 X30 F4000", "G2 X30 Y-10 Z-10 J-5", "G18", "G2 X40 Z-10 I5"]
    slots = [f"G1 X30 Y{6 * k} F3600\nG3 Y{6 * k + 3} J1.5\nG1 X0\nG2 Y{6 * k + 6} J1.5" for k in range(6)]
    waves = [f"G{2 if k % 2 else 3} X{8 * k} Y0 I4 J0 F5000" for k in range(1, 10)]
    corners = [f"G1 X{20 * k + 10} Y0 F3000\nG2 X{20 * k + 20} Y0 I5 J0" for k in range(6)]
    stops = [f"G1 X{0.2 * k:.2f} Y{0.2 * (k % 2):.2f} F1200" for k in range(1, 100)]
    stairs = [f"G1 X{1.5 * ((k + 1) // 2):g} Y{1.5 * (k // 2):g} F6000" for k in range(1, 80)]
    holes = [f"G81 X{12 * (k % 4)} Y{9 * (k // 4)} Z-4 R2 F300" for k in range(8)]
    deep = [f"G83 X{15 * k} Y{7 * (k % 2)} Z-9 R2 Q3 F400" for k in range(3)]
    mixed = [
        f"G0 Z5\nG0 A{10 * k} C{30 * k}\nG1 Z0 F600\nX20 F2400\nG2 X20 Y-10 J-5\nG1 X0\nG2 X0 Y0 J5"
        for k in range(1, 5)
    ]
    turns = [f"A{23 * k % 50} C{71 * k % 180}" for k in range(1, 15)]
    three = {
        "line, G64": _text("G64", "G1 X50 F1200"),
        "zigzag, G64": _zigzag("G64"),
        "zigzag, G64 P": _zigzag("G64 P0.01"),
        "zigzag, G61": _zigzag("G61"),
        "zigzag, G61.1": _zigzag("G61.1"),
        "300 short lines, G64": _curve("G64", 300, 3000),
        "300 short lines, G64 P": _curve("G64 P0.01", 300, 3000),
        "300 short lines, G61": _curve("G61", 300, 3000),
        "300 short lines, G61.1": _curve("G61.1", 300, 3000),
        "2000 short lines, G64 P": _curve("G64 P0.005", 2000, 4000),
        "2000 short lines, G64 P Q0": _curve("G64 P0.005 Q0", 2000, 4000),
        "lines anywhere, G64": _random("G64"),
        "lines anywhere, G64 P": _random("G64 P0.02"),
        "rapids, G64": _rapids("G64"),
        "rapids, G61": _rapids("G61"),
        "pockets, G64 P": _text("G64 P0.01", *pockets),
        "helices in three planes, G64 P": _text("G64 P0.01", "G0 X10", *helix),
        "slots of lines and arcs, G64 P": _text("G64 P0.02", *slots),
        "arcs one after another, G64": _text("G64", *waves),
        "arcs at corners, G64 P": _text("G64 P0.05", *corners),
        "two circles, G64": _text("G64", "G2 I10 F6000\nG2 I10"),
        "99 short stops, G61.1": _text("G61.1", *stops),
        "half circles at corners, G64": _arches("G64", 2.0, 4.0),
        "large half circles at corners, G64": _arches("G64", 6.0, 9.0),
        "small half circles at corners, G64 P": _arches("G64 P0.1", 0.8, 2.0),
        "lines and arcs anywhere, G64": _corners("G64", 1, 0.5),
        "other lines and arcs anywhere, G64": _corners("G64", 6, 0.5),
        "lines and arcs anywhere, G64 P": _corners("G64 P0.05", 2, 0.5),
        "lines and arcs anywhere, G61": _corners("G61", 3, 0.5),
        "arcs anywhere, G64": _corners("G64", 103, 0.3),
        "staircase of rows of 1.5 mm, G64": _text("G64", *stairs),
        "staircase of rows of 1.5 mm, G64 P": _text("G64 P0.01", *stairs),
        "staircase of rows of 1.5 mm, G61": _text("G61", *stairs),
        "pocket from a helix, G64 P": _spiral_pocket("G64 P0.02"),
        "pocket from a helix, G61": _spiral_pocket("G61"),
        "holes by G81, G64": _text("G64", "G0 Z10", "G98", *holes, "G80"),
        "holes by G83, G64 P": _text("G64 P0.01", "G0 Z10", "G99", *deep, "G80"),
    }
    five = {
        "five axes, G64": _five("G64"),
        "five axes, G64 P": _five("G64 P0.02"),
        "five axes, G61": _five("G61"),
        "angles alone, G64": _text("G64", "G0 A0 C0", *(f"G1 {t} F3000" for t in turns)),
        "arcs between settings of the angles, G64 P": _text("G64 P0.01", "G0 A0 C0", *mixed),
    }
    return {k: ("XYZ", v) for k, v in three.items()} | {k: ("XYZAC", v) for k, v in five.items()}


def random_programs(first: int, number: int) -> dict[str, tuple[str, str]]:
    """As :func:`own_programs`, lines that meet arcs at corners: G64 without and with P, half circles, any radius."""
    out = {}
    for seed in range(first, first + number):
        g = np.random.default_rng(seed)
        head = ("G64", "G64", f"G64 P{10.0 ** g.uniform(-2.0, -0.7):.3f}")[seed % 3]
        if seed % 2:
            radius = float(10.0 ** g.uniform(-0.1, 0.9))
            text = _arches(head, round(radius, 3), round(radius * float(g.uniform(0.5, 3.0)), 3))
        else:
            text = _corners(head, seed, float(g.uniform(0.3, 0.7)))
        out[f"random {seed}, {head}"] = ("XYZ", text)
    return out


def real_programs(data: Path) -> dict[str, tuple[str, str]]:
    """As :func:`own_programs`, real texts after a start at the zero of the machine."""
    found = [data / name for name in REAL_FILES if (data / name).exists()]
    head = "G21 G90 G64\n" + START
    return {p.name: ("XYZ", head + p.read_text(errors="replace").replace("\r", "").replace("%", "")) for p in found}


def digest(text: str) -> str:
    """What tells one text from another."""
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def recorded() -> dict[str, tuple[str, int]]:
    """(digest of the text, servo cycles) by name: counted with LinuxCNC 2.9 by `benchmarks/cycle_time.py --record`."""
    values = json.loads((HERE / "cycles.json").read_text())
    return {name: (str(entry[0]), int(entry[1])) for name, entry in values.items()}
