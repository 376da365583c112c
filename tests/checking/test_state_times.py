"""The estimate of the states of an elastic workpiece, by hand and from more unknowns to more time."""

from __future__ import annotations

from dataclasses import replace

import pytest
import trimesh

from chipload.checking.clamped import Workpiece, WorkpieceClamp
from chipload.checking.state_times import state_times
from chipload.checking.workpiece import FinishedPart
from chipload.stock.layers import LayeredStock

HELD = Workpiece(modulus_gpa=70.0, poisson=0.33, clamps=(WorkpieceClamp(face="z-"),), states=2)


def test_cells_that_a_job_chooses() -> None:
    """Three times 8,000 modes: 5 states of 0.6 s at least, 20 of 1.44 s and 5 ms for each of 6 layers at most."""
    stock = LayeredStock.block((0, 0, 0), (30, 20, 6), 1.0, 60.0)
    assert state_times(HELD, stock, None) == pytest.approx((5 * 0.6, 20 * (1.44 + 0.03)))
    strained = replace(HELD, yield_mpa=400.0)
    assert state_times(strained, stock, None)[1] == pytest.approx(32 * (1.44 + 0.03))


def test_a_block_of_four_cells() -> None:
    """5 x 5 x 3 places of order 2 have 75 modes, three unknowns each."""
    stock = LayeredStock.block((0, 0, 0), (20, 20, 10), 10.0, 60.0)
    least, most = state_times(replace(HELD, cell_mm=10.0), stock, None)
    assert least == pytest.approx(5 * 225 * 25e-6)
    assert most == pytest.approx(20 * (225 * 60e-6 + 5e-3))


def test_a_part_with_walls_counts_where_it_has_more() -> None:
    """A thick block keeps the corners of its inner cells only, which a part with walls does not."""
    stock = LayeredStock.block((0, 0, 0), (40, 40, 20), 2.0, 60.0)
    body = trimesh.creation.box(bounds=[(0, 0, 0), (40, 40, 20)])
    pocket = trimesh.creation.box(bounds=[(2, 2, 2), (38, 38, 21)])
    tray = FinishedPart(trimesh.boolean.difference([body, pocket], engine="manifold"), 5.0)
    cells = replace(HELD, cell_mm=2.0)
    assert state_times(cells, stock, tray)[0] > 1.02 * state_times(cells, stock, None)[0]
