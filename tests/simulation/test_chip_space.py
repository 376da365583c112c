"""Room for chips, against the volume that a tooth cuts in a turn."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.chip_space import flute_fill
from chipload.simulation.chips import remove
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock
from layer_oracle.removal import remove_by_layers

AL = material_named("al7075-t6")
MILL = Cutter(10.0, 3, math.radians(30.0), 20.0, 30.0, 6e5, gullet=10.0, chip_ratio=5.0)
FEED, SPEED = 15.0, 300.0
TOOTH = math.tau * FEED / (3 * SPEED)


def fill(cutter: Cutter, width: float, depth: float) -> tuple[float, float]:
    """Greatest fill, and the fill of the middle of the way, beside an edge that stands ``width`` into the cutter."""
    stock = LayeredStock.block((0.0, -20.0, -8.0), (40.0, width - 5.0, 0.0), 0.25, 20.0)
    path = [rapid([-10.0, 0.0, -depth], SPEED, 1, "link"), plunge([30.0, 0.0, -depth], FEED, SPEED, 1, "cut")]
    fine = Resolution(2.0, 1e-4, 60, 0.5)
    done = remove_by_layers(
        Program.join(path), stock, {1: cutter}, AL, fine, watch=lambda cuts: {"flute_fill": flute_fill(cuts)}
    )
    x, share = done.columns["x_mm"], done.columns["flute_fill"]
    return float(share.max()), float(share[np.argmin(np.abs(x - 15.0))])


@pytest.mark.parametrize(("width", "depth"), [(10.0, 3.0), (4.0, 6.0), (1.0, 2.0)])
def test_a_tooth_of_an_end_mill_cuts_its_feed_times_the_width(width: float, depth: float) -> None:
    greatest, middle = fill(MILL, width, depth)
    assert middle == pytest.approx(5.0 * TOOTH * width / 10.0, rel=1e-6)
    assert greatest == pytest.approx(middle, rel=1e-6)


def test_a_bull_nose_cuts_its_own_section() -> None:
    """Of a slot 3 mm deep by corners of 2 mm: 10 times 3 less two corners (1 - pi / 4) r^2."""
    bull = replace(MILL, corner_radius=2.0)
    section = 30.0 - 2.0 * (1.0 - 0.25 * math.pi) * 4.0
    assert fill(bull, 10.0, 3.0)[1] == pytest.approx(5.0 * TOOTH * section / (10.0 * 3.0), rel=2e-3)


def test_with_runout_the_tooth_that_cuts_most_counts() -> None:
    """Radii of three teeth differ by the runout; each cuts the difference to the one before more or less."""
    odd = replace(MILL, runout=(0.004, 0.3))
    plain, uneven = fill(MILL, 10.0, 2.0)[1], fill(odd, 10.0, 2.0)[1]
    radii = [0.004 * math.cos(math.tau * j / 3 - 0.3) for j in range(3)]
    most = max(radii[j] - radii[j - 1] for j in range(3))
    # the chip is thicker by that difference all along a half turn of the rim
    assert uneven == pytest.approx(plain + 5.0 * 5.0 * math.pi * most / 10.0, rel=0.02)


def test_a_plunge_of_a_flat_end_is_not_judged() -> None:
    stock = LayeredStock.block((-10.0, -10.0, -5.0), (10.0, 10.0, 0.0), 0.5, 20.0)
    path = [rapid([0.0, 0.0, 1.0], SPEED, 1, "link"), plunge([0.0, 0.0, -0.4], 2.0, SPEED, 1, "cut")]
    fine = Resolution(2.0, 1e-4, 4, 0.5)
    done = remove(
        Program.join(path),
        stock,
        {1: MILL},
        AL,
        fine,
        watch=lambda c: {"flute_fill": flute_fill(c)},
    )
    assert done.columns["chip_volume_mm3"].sum() > 0.0
    assert not done.columns["flute_fill"].any()
