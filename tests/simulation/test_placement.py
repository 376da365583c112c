"""A stock that does not lie where the program cuts: against cases whose numbers are worked out by hand."""

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.errors import InputError, Severity
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.chips import remove
from chipload.simulation.placement import placement_of, stock_placement
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock

MILL = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
FINE = Resolution(step_mm=2.0, tolerance=1e-3, corner_slices=8, flank_mm=2.0)


def simulated(low, high):
    """A slot 2 mm deep along X 0 to 40 and a way of 40 mm back over it, at the same feed."""
    parts = [rapid([-10.0, 0.0, 40.0], 300.0, 1, "link"), rapid([-10.0, 0.0, -2.0], 300.0, 1, "link")]
    parts += [plunge([50.0, 0.0, -2.0], 10.0, 300.0, 1, "cut"), plunge([50.0, 0.0, 5.0], 10.0, 300.0, 1, "cut")]
    program = Program.join([*parts, plunge([10.0, 0.0, 5.0], 10.0, 300.0, 1, "cut")])
    stock = LayeredStock.block(low, high, 1.0, 20.0)
    bounds = (np.array(low), np.array(high))
    removal = remove(
        program,
        stock,
        {1: MILL},
        material_named("al7075-t6"),
        FINE,
    )
    return removal.columns, bounds


def test_a_stock_where_the_program_cuts():
    columns, bounds = simulated((0.0, -20.0, -10.0), (40.0, 20.0, 0.0))
    at = placement_of(columns, bounds, {1: MILL})
    # 60 + 7 + 40 mm at 10 mm/s; the front half of the cutter meets material from X -5 to 40
    assert at.feed_s == pytest.approx(10.7)
    assert at.air_s == pytest.approx(10.7 - 4.5, abs=0.2)
    assert at.depth_mm == pytest.approx(2.0)
    assert (at.too_deep, at.outside_axes) == (False, ())
    assert stock_placement(columns, bounds, {1: MILL}) is None


def test_a_stock_that_is_too_high():
    """Its zero at the bottom, the program's at the top: the first cut is 32 mm deep with flutes of 20 mm."""
    finding = stock_placement(*simulated((0.0, -20.0, -10.0), (4.0, 20.0, 30.0)), {1: MILL})
    assert finding is not None
    assert (finding.code, finding.severity, finding.row is not None) == ("stock-misplaced", Severity.NOTE, True)
    assert "the first cut is up to 32 mm deep, the flutes are 20 mm long" in finding.text
    assert "the motions at feed lie in Z -2 to 5 mm, the stock in -10 to 30 mm" in finding.text
    assert finding.place is not None
    assert finding.place[1:] == (0.0, -2.0)


def test_a_stock_beside_the_program():
    columns, bounds = simulated((100.0, 30.0, -10.0), (140.0, 60.0, 0.0))
    finding = stock_placement(columns, bounds, {1: MILL})
    assert finding is not None
    assert finding.text == (
        "the stock is probably misplaced: 10.7 of 10.7 s at feed are in air; the motions at feed lie in X -8 to 50 mm, "
        "the stock in 100 to 140 mm; the motions at feed lie in Y 0 to 0 mm, the stock in 30 to 60 mm: compare the "
        "stock with the zero of the program"
    )
    assert (finding.row, finding.place, finding.line) == (None, None, 0)


def columns_of(tip, axis, seconds, volume, rapid):
    n = len(tip)
    tip, axis = np.array(tip, dtype=float), np.array(axis, dtype=float)
    return {
        **{f"{x}_mm": tip[:, k] for k, x in enumerate("xyz")},
        **{f"axis_{x}": np.broadcast_to(axis, (n, 3))[:, k] for k, x in enumerate("xyz")},
        "seconds": np.array(seconds, dtype=float),
        "chip_volume_mm3": np.array(volume, dtype=float),
        "rapid": np.array(rapid),
        "tool": np.ones(n, dtype=np.int64),
        "line": np.arange(10, 10 + n),
    }


def test_the_depth_is_counted_along_a_leaning_axis():
    """From the tip at the origin along (1, 0, 1)/sqrt 2 the corner (10, y, 10) of the stock is 10 sqrt 2 high."""
    axis = np.array([1.0, 0.0, 1.0]) / math.sqrt(2.0)
    columns = columns_of([[0, 0, 0]] * 2, axis, [1, 1], [0, 5], [False, False])
    at = placement_of(columns, (np.array([-10.0, -5.0, -10.0]), np.array([10.0, 5.0, 10.0])), {1: MILL})
    assert at.depth_mm == pytest.approx(10.0 * math.sqrt(2.0))
    assert (at.air_s, at.feed_s, at.first) == (1.0, 2.0, 1)


def test_the_case_of_a_real_job():
    """155 of 183 s in air and a first cut below the flutes: a finding with the line of that cut."""
    tip = [[0, 0, 50], [0, 0, -5], [5, 0, -5]]
    columns = columns_of(tip, [0, 0, 1], [9, 155, 28], [0, 0, 3], [True, False, False])
    finding = stock_placement(columns, (np.array([0.0, -5.0, -20.0]), np.array([9.0, 5.0, 30.0])), {1: MILL})
    assert finding is not None
    assert str(finding).startswith(
        "line 12: the stock is probably misplaced: 155 of 183 s at feed are in air; the first cut (line 12) is up to "
        "35 mm deep"
    )


@pytest.mark.parametrize(
    ("volume", "top"), [([0, 0, 3], 0.0), ([0, 3, 3], 30.0)], ids=["air alone", "a deep first cut alone"]
)
def test_one_sign_alone_is_none(volume, top):
    columns = columns_of([[0, 0, 50], [0, 0, -5], [5, 0, -5]], [0, 0, 1], [9, 155, 28], volume, [True, False, False])
    assert stock_placement(columns, (np.array([0.0, -5.0, -20.0]), np.array([9.0, 5.0, top])), {1: MILL}) is None


def test_rapids_alone_are_refused():
    columns = columns_of([[0, 0, 0]], [0, 0, 1], [1], [0], [True])
    with pytest.raises(InputError, match="no motion at a feed"):
        placement_of(columns, (np.zeros(3), np.ones(3)), {1: MILL})
