"""Ramp angle of steps into material: closed forms of straight and helical ramps, plunges beside and into material."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.program.build import plunge, rapid, rows
from chipload.program.program import ARC_CCW, Program
from chipload.simulation.chips import remove
from chipload.simulation.ramp import ramp_angle
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock

MILL, BULL = Cutter(6.0, 2, 0.5, 18.0, 25.0, 6e5), Cutter(6.0, 2, 0.5, 18.0, 25.0, 6e5, corner_radius=1.0)
BALL = Cutter(6.0, 2, 0.5, 18.0, 25.0, 6e5, corner_radius=3.0)
DRILL = Cutter(6.0, 2, 0.5, 18.0, 25.0, 6e5, bottom=math.radians(31.0))


def ramps(program: Program, cutter: Cutter) -> list[float]:
    """Greatest ramp angle [deg] of each motion that cuts, by the motion's line; 0 where there is none."""
    found: dict[int, float] = {}
    stock = LayeredStock.block((0.0, 0.0, -10.0), (40.0, 30.0, 0.0), 1.0, 24.0)
    done = remove(
        program, stock, {1: cutter}, material_named("al7075-t6"), Resolution(2.0, 0.01, 12, 3.0, grading=2.0),
        watch=lambda cuts: {"ramp_deg": ramp_angle(cuts)},
    )  # fmt: skip
    for line, angle in zip(done.columns["line"].tolist(), done.columns["ramp_deg"].tolist(), strict=True):
        found[line] = max(found.get(line, 0.0), angle)
    return [found[n] for n in sorted(found)]


def numbered(*parts: Program) -> Program:
    """The parts as one program whose rows are lines from 0."""
    joined = Program.join(parts)
    columns = {name: getattr(joined, name) for name in joined.__dataclass_fields__}
    return Program(**{**columns, "line": np.arange(len(joined))})


@pytest.mark.parametrize("cutter", [MILL, BULL, BALL, DRILL])
def test_a_straight_ramp_has_its_slope(cutter: Cutter) -> None:
    run = 12.0
    path = [[10, 15, -1.0], [10 + run, 15, -3.0], [20, 15, -3.0], [20, 15, -1.0], [20, 15, -2.9]]
    found = ramps(numbered(rapid([10, 15, 0], 600.0, 1, "a"), plunge(path, 5.0, 600.0, 1, "b")), cutter)
    # plunge, ramp, back through what it left, up, and down into the hole
    assert found == pytest.approx([90.0, math.degrees(math.atan2(2.0, run)), 0.0, 0.0, 0.0], abs=1e-6)


def test_a_helix_has_the_slope_of_its_path() -> None:
    fall, radius = 1.5, 4.0
    turn = rows([ARC_CCW, ARC_CCW], [[16, 15, -0.5 * fall], [24, 15, -fall]], (20.0, 15.0), 5.0, 600.0, 1, "b")
    found = ramps(numbered(rapid([24, 15, 0], 600.0, 1, "a"), turn), MILL)
    expected = math.degrees(math.atan2(fall, math.tau * radius))
    assert found == pytest.approx([expected, expected], rel=2e-2)  # steps of 2 mm are chords of the helix


def test_a_plunge_without_material_under_the_centre_has_no_ramp_angle() -> None:
    # beside the edge, over half a hole, and into a hole as wide as the cutter
    paths = [
        (rapid([-2, 15, 1], 600.0, 1, "a"), plunge([-2, 15, -3], 5.0, 600.0, 1, "b")),
        (
            rapid([20, 15, 1], 600.0, 1, "a"), plunge([20, 15, -4], 5.0, 600.0, 1, "b"),
            rapid([[20, 15, 1], [21.5, 15, 1]], 600.0, 1, "a"), plunge([21.5, 15, -3], 5.0, 600.0, 1, "b"),
        ),
    ]  # fmt: skip
    assert ramps(numbered(*paths[0]), MILL) == [0.0]
    found = ramps(numbered(*paths[1]), MILL)
    assert found[0] == pytest.approx(90.0)
    assert found[-1] == 0.0
