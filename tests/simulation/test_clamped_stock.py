"""What clamps and fixtures hold of a block that is cut in two, against the places of both by hand."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
import trimesh

from chipload.simulation.heights.height_map import HeightMap
from chipload.simulation.heights.loose_stock import find_loose_stock
from chipload.structure.cells.clamp import Clamp
from chipload.structure.cells.moments import StockRegion
from simulation.test_height_map import TestLooseStocks, follow, mill

pytestmark = pytest.mark.core


@pytest.fixture(scope="module")
def halves() -> HeightMap:
    """A block of 60 x 40 mm, 20 mm high, parted at x = 30 by a cutter of 10 mm; both halves are milled on from the
    right, so that the right half, 25 mm long, is cut first.
    """
    return follow(mill(), *TestLooseStocks.across(-8.0, -16.0, -20.5), *TestLooseStocks.after)


def box(*bounds: float) -> trimesh.Trimesh:
    """A block between two corners."""
    return trimesh.creation.box(bounds=np.array(bounds).reshape(2, 3))


def clamp(x0: float, x1: float, directions: str = "xyz") -> Clamp:
    """A clamp of the lowest 5 mm between two places along x."""
    fixed = np.array([axis in directions for axis in "xyz"])
    return Clamp("clamp", StockRegion(shapely.box(x0, 0.0, x1, 40.0), -20.0, -15.0), fixed)


#: jaws on the long sides, over the left half and over both
LEFT_JAWS = (box(0, -10, -20, 20, 0, -10), box(0, 40, -20, 20, 50, -10))
BOTH_JAWS = (box(0, -10, -20, 60, 0, -10), box(0, 40, -20, 60, 50, -10))
#: jaws on the ends: each half touches one of them
END_JAWS = (box(-10, 0, -20, 0, 40, -10), box(60, 0, -20, 70, 40, -10))
PLATE = box(-50, -50, -30, 110, 90, -20)
#: a strap on the top of each half that stays: where the slot along x at y = 20 does not come
STRAPS = (box(0, 2, 0, 8, 8, 6), box(52, 2, 0, 58, 8, 6))


@pytest.mark.parametrize(
    ("fixtures", "loose"),
    [
        ((), 1),
        ((PLATE,), 1),
        (BOTH_JAWS, 0),
        ((PLATE, *BOTH_JAWS), 0),
        (LEFT_JAWS, 1),
        (END_JAWS, 1),
        (BOTH_JAWS[:1], 1),
        (STRAPS, 0),
        (STRAPS[:1], 1),
        ((*LEFT_JAWS, STRAPS[1]), 0),
        # jaws that stand 1 mm away hold nothing
        (tuple(jaw.copy().apply_translation((0, np.sign(jaw.centroid[1]) * 1.0, 0)) for jaw in BOTH_JAWS), 1),
        # a strap 0.5 mm above the top
        ((STRAPS[0], STRAPS[1].copy().apply_translation((0, 0, 0.5))), 1),
    ],
)
def test_fixtures_on_two_halves(halves: HeightMap, fixtures: tuple[trimesh.Trimesh, ...], loose: int) -> None:
    assert len(find_loose_stock(halves, 10.0, fixtures=fixtures)) == loose


@pytest.mark.parametrize(
    ("clamps", "loose"),
    [
        ([clamp(0, 60)], 0),
        ([clamp(0, 5)], 1),
        ([clamp(0, 5), clamp(55, 60)], 0),
        ([clamp(0, 5), clamp(55, 60, "z")], 1),
        ([clamp(0, 5), clamp(55, 60, "z"), clamp(55, 60, "xy")], 0),
    ],
)
def test_clamps_on_two_halves(halves: HeightMap, clamps: list[Clamp], loose: int) -> None:
    assert len(find_loose_stock(halves, 10.0, clamps)) == loose


def test_the_greater_half_is_loose_where_the_clamp_holds_the_other() -> None:
    """Parted at x = 15: the left piece is 10 mm long and clamped, the right one of 40 mm is milled on."""
    ways = [*TestLooseStocks.across(-8.0, -16.0, -20.5, x=15), *TestLooseStocks.after]
    found = follow(mill(), *ways)
    (piece,) = find_loose_stock(found, 10.0, [clamp(0, 5)])
    assert piece.size_mm == (pytest.approx(40.0, abs=0.5), pytest.approx(40.0, abs=0.5))
    (unstated,) = find_loose_stock(found, 10.0)
    assert unstated.size_mm[0] == pytest.approx(10.0, abs=0.5)


def test_a_vise_as_one_body(halves: HeightMap) -> None:
    """Both jaws in one mesh."""
    vise = trimesh.util.concatenate(list(BOTH_JAWS))
    assert find_loose_stock(halves, 10.0, fixtures=(vise,)) == ()
