"""The notebooks that draw a published figure run, by public names alone, and agree with their sources.

Their cells run in this process, without a kernel, each notebook once.
"""

from __future__ import annotations

import ast
import json
import math
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("plotly")

FOLDER = Path(str(files("chipload") / "examples" / "notebooks"))
NAMES = sorted(path.stem for path in FOLDER.glob("published_*.ipynb"))


def source_of(name: str) -> str:
    """The code of a notebook."""
    cells = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    return "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")


@cache
def run_notebook(name: str) -> tuple[dict[str, Any], int]:
    """The value of the last line of a notebook, and how many of its values are figures."""
    *lines, last = ast.parse(source_of(name)).body
    names: dict[str, Any] = {}
    exec(compile(ast.Module(lines, []), name, "exec"), names)
    value = eval(compile(ast.Expression(last.value), name, "eval"), names)  # type: ignore[attr-defined]
    return value, len(names["figure"].data)


@pytest.mark.parametrize("name", NAMES)
def test_it_takes_public_names_alone(name):
    taken = {
        (node.module if isinstance(node, ast.ImportFrom) else alias.name)
        for node in ast.walk(ast.parse(source_of(name)))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    }
    assert taken == {"chipload", "math", "numpy", "plotly.graph_objects"}


def test_forces_of_titanium():
    """[Budak1996]: mean forces of straight slices in closed form, by the coefficients of the paper."""
    value, curves = run_notebook("published_forces")
    assert curves == 6
    assert value["off_percent"] < 0.6
    # the mean over a turn does not depend on the helix: N a / (2 pi) times the integral over the arc, 0 to 90 deg
    depth, feed, share = 5.08, 0.0508, 4 / math.tau * 5.08
    along = -(share * (value["ktc_mpa"] * feed / 2.0 + 24.0) + share * (value["krc_mpa"] * feed * math.pi / 4.0 + 43.0))
    across = share * (value["ktc_mpa"] * feed * math.pi / 4.0 + 24.0) - share * (value["krc_mpa"] * feed / 2.0 + 43.0)
    axial = -4 / math.tau * depth * value["kac_mpa"] * feed
    assert value["mean_n"] == pytest.approx([along, across, axial], rel=6e-3)
    assert value["greatest_n"] == pytest.approx(value["greatest_model_n"], rel=2e-3)


def test_multipliers_and_lobes():
    """[Ding2010] to 0.15 %; zero order is exact for constant factors only: its least depth is 6 % too small here."""
    value, curves = run_notebook("published_lobes")
    assert curves == 13
    assert value["multiplier"] == pytest.approx(value["published"], rel=1.5e-3)
    # the mean force slope is N Krc / 4 for each mm of depth; one mode bears 2 k zeta (1 + zeta) of it at least
    stiffness = 0.03993 * (math.tau * 922.0) ** 2 / 1000.0
    assert value["least_depth_zero_order_mm"] == pytest.approx(4.0 * stiffness * 0.011 * 1.011 / 200.0, rel=1e-3)
    assert 1.0 < value["least_depth_mm"] / value["least_depth_zero_order_mm"] < 1.1


def test_a_chip_in_two_pieces():
    """[Chips2017]: two congruent pieces; the covered area is the number of the closed form."""
    value, curves = run_notebook("published_chip")
    assert curves == 2
    assert value["covered_mm2"] == pytest.approx(95.866335, abs=1e-6)
    assert value["areas_mm2"] == pytest.approx([value["closed_form_mm2"]] * 2, rel=1e-3)
    assert value["pieces_by_height"] == [1, 2, 2, 2, 1]


def test_error_of_a_wall():
    """[Budak1995]: the cantilever in its collet; the plate of the paper gives way as a beam does within a factor."""
    value, curves = run_notebook("published_wall")
    assert curves == 2
    assert value["off_percent"] < 0.4
    assert value["greatest_um"] == pytest.approx(value["formula_um"], rel=2e-3)
    edge, half = value["plate_um_n"]
    # middle of the free edge of a cantilever plate, aspect 63.5 / 34: 0.2114 P a^2 / D where it is 2
    bending = 110e3 * 2.45**3 / (12.0 * (1.0 - 0.34**2))
    assert edge == pytest.approx(1000.0 * 0.2114 * 34.0**2 / bending, rel=0.1)
    assert 0.0 < half < edge
