"""Every program of every way, as its text reads, against points of the true surfaces: cutter, neck, shank and holder.

Nothing of the planner and of the check is used but the surfaces: rows are read by regular expressions, poses come from
the machine's chain, and a point is in the tool or it is not. The points are random, and no check points.
"""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload import examples
from chipload.cli import app
from chipload.machine.kinematics import forward
from chipload.machine.machine import machine_named
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of

MACHINE, BLADES, GOUGE = machine_named("horizontal-b"), 11, 0.05
CUTTERS = """name = "with holders"
note = "made up"

[[cutter]]
diameter_mm = 12.0
corner_radius_mm = 2.0
cutting_length_mm = 26.0
neck_diameter_mm = 11.0
neck_length_mm = 60.0
shank_diameter_mm = 12.0
reach_mm = 80.0
holder_diameter_mm = 30.0

[[cutter]]
diameter_mm = 14.0
corner_radius_mm = 1.5
cutting_length_mm = 26.0
shank_diameter_mm = 14.0
reach_mm = 90.0
holder_diameter_mm = 30.0
"""
SURFACE = """[[surface]]
body = "blade"
side = "minus"
along = [0.55, 0.70]
up = [0.45, 0.65]
points = [4, 4]

"""


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    root = tmp_path_factory.mktemp("surfaces")
    text = (Path(examples.__file__).parent / "impeller" / "job.toml").read_text()
    text = text[: text.index("[[surface]]")] + SURFACE + text[text.index("[[operation]]") :]
    text = text[: text.index("[operation.rough]")] + text[text.index("[operation.paths]") :]
    text = text.replace('name = "wu2019"', 'file = "cutters.toml"').replace("most_cutters = 3", "most_cutters = 1")
    (root / "job.toml").write_text(text)
    (root / "cutters.toml").write_text(CUTTERS)
    done = CliRunner().invoke(app, ["run", str(root / "job.toml"), "--out", str(root / "out")])
    assert done.exit_code in (0, 3), done.output
    return root / "out", json.loads((root / "out" / "summary.json").read_bytes())


@pytest.fixture(scope="module")
def points():
    """Points (n, 3) of every blade and of the whole hub; not of the very edges, where a wall has another beside it."""
    impeller, rng, out = impeller_of(ImpellerShape()), np.random.default_rng(5), []
    for k in range(BLADES):
        for patch in (impeller.body(k).plus, impeller.body(k).minus):
            u, v = rng.uniform(0.005, 0.995, 2500), rng.uniform(0.0, 0.995, 2500)
            out.append(patch.at(u, v))
    s, theta = rng.uniform(0.0, 1.0, 20000), rng.uniform(0.0, math.tau, 20000)
    out.append(impeller.hub.at(s, theta))
    return np.concatenate(out)


def rows_of(text):
    """Axes (n, 9) of the rows of the loop's body, of the first channel from its first Z on, and the loop's count."""
    q, out, count, placed = np.zeros(9), [], 1, False
    for line in text.splitlines():
        if line.startswith("o100 repeat"):
            count = int(re.search(r"repeat \[(\d+)\]", line)[1])
        if line.startswith(("(", "#", "o", "G52")):
            continue
        words = re.findall(r"([XYZAB])(-?[\d.]+)", line)
        for letter, value in words:
            q["XYZAB".index(letter)] = float(value) * (math.pi / 180.0 if letter in "AB" else 1.0)
        placed |= any(letter == "Z" for letter, _ in words)
        if words and placed:
            out.append(q.copy())
    return np.array(out), count


def deepest(points, squares, tip, axis, tool):
    """How deep a point lies in the cutting part, neck, shank or holder at a pose [mm], roughly: the least way out.

    ``squares`` (n,) of the lengths of the points.
    """
    h = points @ axis - tip @ axis
    square = squares - points @ (2.0 * tip) + (tip @ tip - h * h)
    R, r, stages = tool
    # what lies farther away is outside of every part by over 1 mm
    near = (h > -1.0) & (square < (1.0 + max(R, *(radius for *_, radius in stages))) ** 2)
    h, away = h[near], np.sqrt(np.clip(square[near], 0.0, None))
    inner = np.where(h < r, np.sqrt(np.clip(r * r - (r - h) ** 2, 0.0, None)), r)
    worst = np.where((h >= 0.0) & (h <= stages[0][0]), R - r + inner - away, -1.0).max(initial=-1.0)
    for low, high, radius in stages:
        inside = np.minimum(radius - away, np.minimum(h - low, high - h))
        worst = max(worst, float(inside.max(initial=-1.0)))
    return worst


def tool_of(diameter):
    """R, r, and the parts above the cutting part: from, to, radius."""
    if diameter == 12.0:
        return 6.0, 2.0, [(26.0, 60.0, 5.5), (60.0, 80.0, 6.0), (80.0, 200.0, 15.0)]
    return 7.0, 1.5, [(26.0, 90.0, 7.0), (90.0, 200.0, 15.0)]


def test_no_program_of_any_way_gouges_the_true_surfaces_in_any_channel(result, points):
    out, summary = result
    programs, squares = sorted(out.glob("*-all.ngc")), (points * points).sum(axis=1)
    (op,) = summary["operations"]
    assert len(programs) >= len(op["ways"]) == 2
    for path in programs:
        diameter = float(re.search(r"D(\d+)r", path.stem)[1])
        rows, count = rows_of(path.read_text())
        assert count == BLADES
        for channel in (0, 4, 10):
            q = rows.copy()
            q[:, 4] += channel * math.tau / BLADES
            # every sixth row, and half-way to the one after it
            tips, axes = forward(MACHINE, np.concatenate([q[:-1:6], 0.5 * (q[:-1:6] + q[1::6])]))
            tool = tool_of(diameter)
            worst = max(deepest(points, squares, p, a, tool) for p, a in zip(tips, axes, strict=True))
            assert worst <= GOUGE, f"{path.name}, channel {channel}"
            assert worst > -1.0
        # seen to fail: pushed along the axis by three times the gouge it meets the blade it mills
        tips, axes = forward(MACHINE, rows[::3])
        assert max(deepest(points, squares, p - 0.15 * a, a, tool) for p, a in zip(tips, axes, strict=True)) > GOUGE
