"""A support by its closed form against one that is built into the stiffness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from scipy.sparse import bsr_array

from chipload.errors import InputError
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.clamp import Clamp
from chipload.structure.cells.grid import grid_over
from chipload.structure.cells.moments import StockRegion
from chipload.structure.cells.supernodes import factor_supernodes
from chipload.structure.cells.support import support_line
from chipload.structure.cells.workpiece import Elastic, cell_workpiece, displacements, line_compliances, mode_weights


@pytest.fixture(scope="module")
def wall():
    stock = LayeredStock.block((0, 0, 0), (40, 2.5, 25), 25.0, 50.0)
    clamp = Clamp("clamp", StockRegion(shapely.box(-1, -1, 41, 4), 0.0, 0.001), np.ones(3, dtype=np.bool_))
    return cell_workpiece(stock, grid_over((0, 0, 0), (40, 2.5, 25), 5.0), Elastic(7e4, 0.33), [clamp])


LINE, FORCE = [(12.0, 0.0, 24.0), (12.0, 0.0, 24.0)], np.array([3.0, 50.0, -8.0])


def test_a_support_is_a_spring_in_the_stiffness(wall):
    points, normals = [(14.0, 2.5, 22.0), (40.0, 2.5, 5.0)], [(0.0, 1.0, 0.0), (0.0, 0.6, 0.8)]
    found = support_line(wall, LINE, FORCE, points, normals, 1e4)
    for k, (point, normal) in enumerate(zip(points, normals, strict=True)):
        w = mode_weights(wall, np.array([point])).toarray()[0]
        r = np.outer(w, normal).ravel()
        K = bsr_array(wall.stiffness + 1e4 * bsr_array(np.outer(r, r), blocksize=(3, 3)))
        factors = factor_supernodes(K, wall.order[::3] // 3, [len(wall.modes)])
        built = replace(wall, stiffness=K, factors=factors)
        C = line_compliances(built, [LINE])[0, 1]
        assert found.after[k] == pytest.approx(np.linalg.norm(C @ FORCE), rel=1e-6)
    assert found.best == 0
    assert found.before == pytest.approx(np.linalg.norm(line_compliances(wall, [LINE])[0, 1] @ FORCE), rel=1e-12)


def test_displacements_are_those_of_the_compliance(wall):
    C = displacements(wall, LINE, [LINE[0]])
    np.testing.assert_allclose(C[0], line_compliances(wall, [LINE])[0, 1], rtol=1e-9, atol=1e-15)


def test_a_support_without_stiffness_is_refused(wall):
    with pytest.raises(InputError, match="stiffness 0 N/mm: must be above 0"):
        support_line(wall, LINE, FORCE, [(1.0, 0.0, 5.0)], [(0.0, 1.0, 0.0)], 0.0)
