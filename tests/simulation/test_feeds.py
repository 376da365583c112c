"""The loads of a step at other feeds, against the simulation of a program with these feeds."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.loads import Cuts, at_feeds, greatest_loads, join_cuts
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock
from layer_oracle.removal import remove_by_layers

FINE = Resolution(step_mm=2.0, tolerance=1e-3, corner_slices=12, flank_mm=1.0)
STEEL = Material(
    "made up", 1800.0, 700.0, 250.0, 20.0, 30.0, 5.0, source="made up for this test", exponents=(0.2, 0.3, 0.1)
)
PLAIN = Material("plain", 1000.0, 400.0, 200.0, 20.0, 15.0, 3.0, source="made up for this test")


def path(feed: float) -> Program:
    """In at the side, a corner, out on a slope."""
    points = [[14.0, 3.0, -3.0], [14.0, 16.0, -3.0], [26.0, 16.0, -1.5]]
    return Program.join([rapid([-8.0, 3.0, -3.0], 300.0, 1, "link"), plunge(points, feed, 300.0, 1, "cut")])


@pytest.mark.parametrize("material", [PLAIN, STEEL], ids=["plain", "size effect"])
@pytest.mark.parametrize("runout", [(0.0, 0.0), (0.012, 0.7)], ids=["true", "runout"])
@pytest.mark.parametrize("radius", [0.0, 2.0], ids=["flat", "bull"])
def test_other_feeds_cost_what_the_simulation_at_them_says(material, runout, radius) -> None:
    cutter = replace(Cutter(10.0, 3, 0.5, 20.0, 30.0, 6e5, corner_radius=radius), runout=runout)

    def run(feed, watch=None):
        stock = LayeredStock.block((0.0, -6.0, -5.0), (30.0, 24.0, 0.0), 1.0, 20.0)
        return remove_by_layers(path(feed), stock, {1: cutter}, material, FINE, watch=watch).columns

    factors = (0.3, 1.0, 2.5)
    names = ("force_n", "torque_nm", "power_w", "chip_max_mm")

    def watch(cuts: Cuts):
        loads = {}
        for factor in factors:
            made = greatest_loads(at_feeds(cuts, np.full(len(cuts), factor)), material, FINE.rotation)
            loads |= {f"{name} {factor}": made[name] for name in names}
        return loads

    first = run(10.0, watch)
    for factor in factors:
        other = run(10.0 * factor)
        assert other["force_n"].max() > 0.0
        for name in names:
            np.testing.assert_allclose(first[f"{name} {factor}"], other[name], rtol=1e-9, atol=1e-12, err_msg=name)


def test_each_step_has_its_own_factor_and_cuts_join() -> None:
    cutter = Cutter(10.0, 2, 0.0, 20.0, 30.0, 6e5, runout=(0.004, 0.2))
    blocks: list[Cuts] = []
    stock = LayeredStock.block((0.0, -6.0, -5.0), (30.0, 24.0, 0.0), 1.0, 20.0)
    removal = remove_by_layers(
        path(10.0), stock, {1: cutter}, PLAIN, FINE, keep=True, watch=lambda c: blocks.append(c) or {}
    )
    (whole,) = removal.cuts
    assert len(whole) == sum(len(b) for b in blocks)
    factor = np.linspace(0.5, 1.5, len(whole))
    mixed = at_feeds(whole, factor)
    start, old = whole.plain.start, whole.plain.rows
    np.testing.assert_array_equal(mixed.plain.rows[:, :4], old[:, :4])
    for k in range(len(whole)):
        some = slice(start[k], start[k + 1])
        np.testing.assert_allclose(mixed.plain.rows[some, 4:], factor[k] * old[some, 4:], rtol=1e-15)
    # runout does not grow with the feed: chips of the long tooth are thicker by no more than twice its radius, and by
    # the feed marks of true paths, f^2 / (2 R) two teeth apart
    thick, true = mixed.engagement.chip_max(), mixed.plain.chip_max()
    assert (thick - true <= 0.008 + (2.0 * true) ** 2 / 10.0).all()
    assert (thick[true > 1e-3] > true[true > 1e-3]).all()
    again = join_cuts([whole, whole])
    np.testing.assert_array_equal(again.spindle, np.full(2 * len(whole), 300.0))
    assert len(again.plain.rows) == 2 * len(old)
    assert math.isclose(removal.columns["chip_max_mm"].max(), whole.engagement.chip_max().max())
