"""Distance by which a tool must be retracted before a change, against samples along its axis."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.errors import Severity
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.tool_change import changes_in_stock, retract_needed

LOW, HIGH = np.array([0.0, 0.0, -10.0]), np.array([40.0, 30.0, 0.0])
MILL = Cutter(6.0, 2, 0.5, 18.0, 25.0, 6e5)


@pytest.mark.parametrize("seed", range(40))
def test_the_distance_is_that_of_the_last_disc_that_reaches_the_box(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tip, axis = rng.uniform([-20.0, -20.0, -20.0], [60.0, 50.0, 10.0]), rng.normal(size=3)
    axis[rng.integers(3)] *= float(seed % 4 != 0)
    axis /= np.linalg.norm(axis)
    t = np.arange(0.0, 150.0, 2e-3)
    # the rim of the disc, point by point: how far it reaches along each coordinate
    across = np.linalg.svd(axis[None, :])[2][1:]
    angle = np.linspace(0.0, math.tau, 3600)
    rim = 3.0 * (np.cos(angle)[:, None] * across[0] + np.sin(angle)[:, None] * across[1])
    centre = tip + t[:, None] * axis
    meets = ((centre + rim.max(axis=0) > LOW) & (centre + rim.min(axis=0) < HIGH)).all(axis=1)
    expected = t[meets].max(initial=0.0) if meets[t < 25.0].any() else 0.0  # the tool is 25 mm long
    assert retract_needed(tip, axis, 3.0, 25.0, LOW, HIGH) == pytest.approx(expected, abs=3e-3)


@pytest.mark.parametrize(
    ("tip", "needed"),
    [
        ((20.0, 15.0, -2.0), 2.0),
        ((20.0, 15.0, 0.0), 0.0),  # it touches the top
        ((-3.0, 15.0, -2.0), 0.0),  # it touches a side
        ((-2.9, 15.0, -2.0), 2.0),
        ((20.0, 15.0, -12.0), 12.0),  # through the stock
        ((20.0, 15.0, -30.0), 30.0),
        ((20.0, 15.0, -40.0), 0.0),  # 25 mm long, it is below the stock
        ((20.0, 15.0, 3.0), 0.0),
    ],
)
def test_an_upright_tool_must_rise_above_the_top(tip: tuple[float, float, float], needed: float) -> None:
    found = retract_needed(np.array(tip), np.array([0.0, 0.0, 1.0]), 3.0, 25.0, LOW, HIGH)
    assert found == pytest.approx(needed, abs=1e-12)


def changed(height: float, line: int = 9) -> Program:
    """Tool 1 cuts to ``height`` and tool 2 goes on from there."""
    parts = [
        rapid([-8, 15, 5], 300.0, 1, "a"), plunge([20, 15, height], 5.0, 300.0, 1, "a"),
        plunge([48, 15, height], 5.0, 300.0, 2, "b"),
    ]  # fmt: skip
    program = Program.join(parts)
    columns = {name: getattr(program, name) for name in program.__dataclass_fields__}
    return Program(**{**columns, "line": np.array([4, 6, line])})


def test_a_change_in_the_stock_is_unproven_and_one_above_it_is_not() -> None:
    cutters = {1: MILL, 2: MILL}
    (found,) = changes_in_stock(changed(-2.0), cutters, LOW, HIGH)
    assert (found.line, found.severity, found.place) == (9, Severity.UNPROVEN, (20.0, 15.0, -2.0))
    assert "tool 1 is changed for tool 2 at X20 Y15 Z-2, 2 mm inside the stock" in found.text
    assert "more than 2 mm" in found.text
    assert changes_in_stock(changed(0.5), cutters, LOW, HIGH) == ()
    assert changes_in_stock(changed(-2.0), {2: MILL}, LOW, HIGH) == ()


@pytest.mark.parametrize(("line", "retraction", "found"), [(9, 7, 0), (9, 10, 1), (9, 3, 1), (3, 2, 0), (3, 5, 1)])
def test_a_retraction_without_a_row_counts_between_the_lines_of_the_change(
    line: int, retraction: int, found: int
) -> None:
    """A change on line 3 after a cut on line 6 stands behind a call of a subroutine at the end of the text."""
    assert len(changes_in_stock(changed(-2.0, line), {1: MILL}, LOW, HIGH, [retraction])) == found
