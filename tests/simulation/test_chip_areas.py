"""The chip of a step on the layers, by the boundary theory, in a stock that moves cut: areas in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.program.build import rapid
from chipload.program.program import Program
from chipload.simulation.chip_areas import most_divided_chip
from chipload.simulation.chips import remove
from simulation.test_cut_stock import ALLOY, CUTTERS, FINE, block, path


def test_a_mill_over_a_slot_takes_a_piece_on_each_side() -> None:
    """A slot of a ball is 8 mm wide above its centre, and one of 10 mm over it takes 1 mm on each side: of a step the
    area between two arcs of 5 mm there, as far as it is in the block, x > 0.
    """
    slot = path([[-8.0, 15.0, -6.0], [34.0, 15.0, -6.0], [34.0, 15.0, 9.0]], 2)
    over = path([[-8.0, 15.0, -2.0], [28.0, 15.0, -2.0], [28.0, 15.0, 9.0]])
    program = Program.join([slot, rapid([-8.0, 15.0, 9.0], 300.0, 1, "link"), over])
    stock, after = block(), block()
    removal = remove(program, after, CUTTERS, ALLOY, FINE, accuracy=False)
    chip = most_divided_chip(program, stock, CUTTERS, FINE, removal)
    assert chip is not None
    assert chip.cutter is CUTTERS[1]
    y = 4.0 + (np.arange(2000) + 0.5) / 2000
    begin, end = (np.clip(x + np.sqrt(25.0 - y * y), 0.0, None).mean() for x in chip.move.tip[0, 0] + [[-0.5], [0.5]])
    assert [p.area for p in chip.chips] == pytest.approx([end - begin] * 2, abs=5e-3)
    assert -2.0 < chip.height < 0.0
    assert not stock.cut.any()


def test_a_program_in_air_has_no_chip() -> None:
    program = path([[-8.0, 15.0, 5.0], [48.0, 15.0, 5.0]])
    removal = remove(program, block(), CUTTERS, ALLOY, FINE, accuracy=False)
    assert most_divided_chip(program, block(), CUTTERS, FINE, removal) is None
