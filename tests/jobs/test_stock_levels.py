"""Where layers end, and where a program begins, of texts that other CAM systems write."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload.cli import app
from chipload.stock.layers import LayeredStock

JOB = """[program]
file = "p.ngc"
[machine]
name = "vmc"
[stock]
low_mm = [0.0, 0.0, -8.0]
high_mm = [20.0, 20.0, 0.0]
layer_mm = 1.0
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = 6.0
corner_radius_mm = {corner}
flutes = 2
helix_deg = 30.0
flute_length_mm = 12.0
overhang_mm = 20.0
modulus_gpa = 580.0
[[operation]]
kind = "simulate"
step_mm = 5.0
[limits]
force_n = 5000.0
"""
#: nine short level ways 0.05 mm above one another, and a long one
HEIGHTS = [-2.0 - 0.05 * k for k in range(9)]
SHORT = "".join(f"G1 X{5 + 0.1 * k:g} Z{z:g}\nX{6 + 0.1 * k:g}\n" for k, z in enumerate(HEIGHTS))
TEXT = f"G21 G90 G17 G94\n{{first}}T1 M6\nS8000 M3\nG0 X5 Y5 Z5\nG1 Z-2 F600\n{SHORT}G1 Z-2.37\nY15\nX15\nG0 Z5\nM2\n"


def bounds(folder: Path, corner: float, first: str = "") -> np.ndarray:
    (folder / "job.toml").write_text(JOB.format(corner=corner))
    (folder / "p.ngc").write_text(TEXT.format(first=first))
    done = CliRunner().invoke(app, ["run", str(folder / "job.toml"), "--out", str(folder / "r")])
    assert done.exit_code == 0, done.stderr
    return LayeredStock.load(folder / "r" / "stock.npz").bounds


def near(all_bounds: np.ndarray) -> list[float]:
    """Bounds that are at no whole millimetre."""
    return [round(float(z), 6) for z in all_bounds if abs(z - round(z)) > 1e-6]


def test_a_flat_cutter_has_a_layer_end_at_each_of_its_floors(tmp_path: Path) -> None:
    assert near(bounds(tmp_path, 0.0)) == sorted([*[round(z, 6) for z in HEIGHTS[1:]], -2.37])


def test_a_ball_nose_has_one_where_its_way_is_longest(tmp_path: Path) -> None:
    assert near(bounds(tmp_path, 3.0)) == [-2.37]


def test_rapids_before_the_first_tool_change_are_no_cuts(tmp_path: Path) -> None:
    removed = []
    for first in ("", "G0 Z20\nG0 X1 Y1\n"):
        bounds(tmp_path, 3.0, first)
        (op,) = json.loads((tmp_path / "r" / "summary.json").read_bytes())["operations"]
        removed.append(op["removed_mm3"])
    assert removed[0] > 0.0
    assert removed[1] == pytest.approx(removed[0], rel=1e-12)
