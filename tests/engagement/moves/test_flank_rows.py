"""Rows of an upright cutter along a wall, one below the other and pass behind pass: each row meets the floors of rows
above it in cells that the wall fills to its top."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from chipload.cutter.cutter import Cutter
from chipload.engagement.moves.stock import MoveStock

R, L, TOP, AP = 4.0, 20.0, 9.0, 1.25
MILL = Cutter(2.0 * R, 4, 0.5, 20.0, 30.0, 6e5)
#: longest slice of the flank at the default of a job
FLANK = 0.5 * R


def wall(mesh: bool, thick: float) -> MoveStock:
    """A plate along x whose face to be cut is y = 0."""
    low, high = np.array([0.0, -thick, 0.0]), np.array([L, 0.0, TOP])
    body = trimesh.creation.box(high - low) if mesh else None
    if body is not None:
        body.apply_translation(0.5 * (low + high))
    return MoveStock(low, high, {1: MILL}, body)


def row(stock: MoveStock, depth: float, z: float):
    """Cut a row at a depth below the face; the engagement and the volume of each step of 0.5 mm."""
    x = np.arange(-6.0, L + 6.1, 0.5)
    p = np.column_stack([x, np.full_like(x, R - depth), np.full_like(x, z)])
    found = stock.take(p[:-1], p[1:], np.ones(len(p) - 1, dtype=np.int64), corner_slices=12, flank_mm={1: FLANK})
    return found, np.bincount(found.step, found.volume / found.instants, len(x) - 1)


@pytest.mark.core
@pytest.mark.parametrize("mesh", [False, True])
@pytest.mark.parametrize("depths", [(0.3,), (0.1, 0.2), (0.02, 0.05, 0.08)])
def test_each_row_engages_its_axial_depth(mesh: bool, depths: tuple[float, ...]) -> None:
    """Immersion acos(1 - ae / R) over ap, and ae ap a length: in every row, in every pass."""
    stock, depth = wall(mesh, 3.0), 0.0
    for ae in depths:
        depth += ae
        for k in range(4):
            z = TOP - AP * (k + 1)
            found, volume = row(stock, depth, z)
            assert volume.sum() == pytest.approx(ae * AP * L, rel=3e-3)
            middle = int(np.searchsorted(found.step, 30))
            assert found.z[middle] == pytest.approx([z, z + AP], abs=2e-3)
            own = slice(found.start[middle], found.start[middle + 1])
            assert np.ptp(found.span[own], axis=1) == pytest.approx(math.acos(1.0 - ae / R), abs=2e-3)
            assert found.areas[middle] == 1


def test_a_row_below_rows_of_unlike_depths() -> None:
    """Three depths behind one another along the flank: 0.1, 0.2 and 0.25 mm, each over its own height."""
    stock = wall(True, 3.0)
    left = {0.5: 0.2, 1.7: 0.1, 2.4: 0.05}
    for below, depth in left.items():
        row(stock, depth, TOP - below)
    found, volume = row(stock, 0.3, TOP - 2.4)
    per_mm = 0.5 * 0.1 + 1.2 * 0.2 + 0.7 * 0.25
    assert volume.sum() == pytest.approx(per_mm * L, rel=1e-3)
    middle = int(np.searchsorted(found.step, 30))
    own = slice(found.start[middle], found.start[middle + 1])
    heights = found.slices[found.slice[own]]
    for low, high, ae in ((0.0, 0.7, 0.25), (0.7, 1.9, 0.2), (1.9, 2.4, 0.1)):
        inside = (heights[:, 3] > low - 2e-3) & (heights[:, 3] < high - 2e-3)
        assert (heights[inside, 1] - heights[inside, 0]).sum() == pytest.approx(high - low, abs=3e-3)
        assert np.ptp(found.span[own][inside], axis=1) == pytest.approx(math.acos(1.0 - ae / R), abs=2e-3)
