"""Stress of workpieces in cells against beams."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from chipload.stock.layers import LayeredStock
from chipload.structure.cells.clamp import Clamp
from chipload.structure.cells.grid import grid_over
from chipload.structure.cells.moments import StockRegion
from chipload.structure.cells.stress import greatest_stress
from chipload.structure.cells.workpiece import Elastic, cell_workpiece

#: no Poisson effect: the clamp holds as a beam's does
PLAIN = Elastic(70e3, 0.0)


@pytest.mark.parametrize("shift", [0.0, 0.7])
def test_an_upright_beam_bends_with_six_f_l_over_b_h_squared(shift):
    # 6 x 4 mm, 40 mm high, loaded across the 4 mm at its top, anywhere in the grid
    stock = LayeredStock.block((0, 0, 0), (10, 8, 40), 5.0, 100.0)
    keep = shapely.box(2 + shift, 2 + shift, 8 + shift, 6 + shift)
    for k in range(stock.layers):
        stock.remove(k, shapely.box(-1, -1, 11, 9).difference(keep))
    clamp = Clamp("clamp", StockRegion(shapely.box(-1, -1, 11, 9), 0.0, 0.001), np.ones(3, dtype=np.bool_))
    work = cell_workpiece(stock, grid_over((0, 0, 0), (10, 8, 40), 2.0), PLAIN, [clamp])
    x, y = 5.0 + shift, 2.0 + shift
    found = greatest_stress(
        work, PLAIN, np.array([(x - 3, y, 38.0), (x + 3, y, 38.0)]), np.array([0.0, 120.0, 0.0]), 8.0
    )
    z, y_at = found.place[2], found.place[1] - (4.0 + shift)
    # where it is found: at the clamp, near the face; bending and shear of a beam there
    assert z < 1.0
    assert abs(y_at) > 1.0
    sigma = 120.0 * (38.0 - z) * abs(y_at) / (6.0 * 4.0**3 / 12.0)
    shear = 1.5 * 120.0 / 24.0 * (1.0 - (y_at / 2.0) ** 2)
    assert found.stress == pytest.approx(np.hypot(sigma, np.sqrt(3.0) * shear), rel=0.04)


def test_what_is_near_the_contact_does_not_count():
    stock = LayeredStock.block((0, 0, 0), (20, 20, 10), 10.0, 100.0)
    clamp = Clamp("clamp", StockRegion(shapely.box(-1, -1, 21, 21), 0.0, 0.001), np.ones(3, dtype=np.bool_))
    work = cell_workpiece(stock, grid_over((0, 0, 0), (20, 20, 10), 2.5), PLAIN, [clamp])
    line, force = np.array([(10.0, 10.0, 10.0)] * 2), np.array([0.0, 0.0, -100.0])
    near, far = (greatest_stress(work, PLAIN, line, force, away) for away in (0.0, 5.0))
    assert near.stress > 4.0 * far.stress > 0.0
    assert np.linalg.norm(far.place - line[0]) >= 5.0
