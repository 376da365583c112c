"""Contacts of shank and holder of planned programs, and the distance of the columns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chipload.checking.stock_check import contact_findings, pitch_at
from chipload.cutter.cutter import Cutter
from chipload.errors import Severity
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.heights.height_map import pitch_of
from chipload.simulation.steps import StepBlocks
from chipload.stock.layers import LayeredStock

pytestmark = pytest.mark.core
LOW, HIGH = (0.0, 0.0, -20.0), (60.0, 40.0, 0.0)


def mill(**keys: float | tuple[tuple[float, float], ...]) -> Cutter:
    return Cutter(10.0, 3, 0.5, 6.0, 12.0, 5.8e5, **keys)  # type: ignore[arg-type]


def slots(*depths: float) -> Program:
    """Slots along x through the middle of the block, a line each move."""
    rows = []
    for z in depths:
        rows += [rapid([-20.0, 20.0, 10.0], 0, 1, "x"), rapid([-20.0, 20.0, z], 0, 1, "x")]
        rows += [plunge([80.0, 20.0, z], 15.0, 600.0, 1, "x"), rapid([80.0, 20.0, 10.0], 0, 1, "x")]
    program = Program.join(rows)
    return replace(program, line=np.arange(1, len(program) + 1))


@pytest.mark.parametrize(
    ("cutter", "found"),
    [
        (mill(shank_diameter=20.0), [("shank", 7, 4.0), ("shank", 11, 5.0)]),
        (mill(shank_diameter=9.0), []),
        (mill(), []),
        # the holder begins 12 mm above the tip, that is 3 mm below the top in the last slot
        (mill(holder=((40.0, 40.0),)), [("holder", 11, 3.0)]),
    ],
)
def test_contacts_of_a_planned_program(cutter: Cutter, found: list[tuple[str, int, float]]) -> None:
    program = slots(-5.0, -10.0, -15.0)
    stock = LayeredStock.block(LOW, HIGH, 1.0, 40.0)
    made = contact_findings(program, StepBlocks(program, 0.5, 0.001), {1: cutter}, stock, 0.001)
    said = [(f.text.split()[0], f.line, float(f.text.split()[2])) for f in made]
    assert said == [(what, line, pytest.approx(depth, abs=0.2)) for what, line, depth in found]
    assert all((f.code, f.severity) == ("collision", Severity.EXCEEDS) for f in made)


def test_columns_are_closer_where_a_wide_shank_goes_below_the_top() -> None:
    stock = LayeredStock.block(LOW, HIGH, 1.0, 40.0)
    plain = pitch_of(np.array(LOW), np.array(HIGH), {1: mill()})
    assert plain == pytest.approx(0.25)
    for depth, share in ((-5.0, 1.0), (-10.0, 3.0)):
        assert pitch_at({1: mill(shank_diameter=20.0)}, slots(depth), stock) == pytest.approx(plain / share)
    assert pitch_at({1: mill()}, slots(-10.0), stock, 0.1) == 0.1
