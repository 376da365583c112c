"""The height map against closed forms: walls beside shanks and holders, rapids, loose stock, slender walls."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.heights.height_map import HeightMap, follow_heights
from chipload.simulation.heights.loose_stock import find_loose_stock
from chipload.simulation.heights.slender_walls import find_slender_walls
from chipload.simulation.steps import Steps, steps_of
from chipload.stock.layers import LayeredStock

pytestmark = pytest.mark.core

PITCH = 0.25
HIDDEN = math.sqrt(2.0) * PITCH


def mill(flutes_mm: float = 26.0, *, shank: float | None = None, corner: float = 0.0, holder: float = 0.0) -> Cutter:
    """A cutter of 10 mm, whose holder begins 40 mm above its tip."""
    parts = ((40.0, holder),) if holder else ()
    return Cutter(10.0, 3, 0.5, flutes_mm, 40.0, 5.8e5, corner_radius=corner, shank_diameter=shank, holder=parts)


def path(*ways: str, step: float = 0.5) -> Steps:
    """Steps of lines such as ``"G0 -10 4 10"``, each a move to a place; its line is its number, from 1."""
    rows = []
    for way in ways:
        kind, *place = way.split()
        at = [float(v) for v in place]
        rows.append(rapid(at, 0, 1, "way") if kind == "G0" else plunge(at, 15.0, 600.0, 1, "way"))
    program = Program.join(rows)
    return steps_of(replace(program, line=np.arange(1, len(program) + 1)), step, 0.001)


def follow(cutter: Cutter, *ways: str, low: float = -20.0, pitch: float = PITCH) -> HeightMap:
    """The height map of a block of 60 x 40 mm with its top at 0 after a path."""
    stock = LayeredStock.block((0.0, 0.0, low), (60.0, 40.0, 0.0), 1.0, 40.0)
    return follow_heights(path(*ways), {1: cutter}, stock, pitch, 0.001)


def slots(y: float, *depths: float) -> list[str]:
    """Ways of slots along x at y, each from a place beside the block."""
    return [way for z in depths for way in (f"G0 -40 {y} 10", f"G0 -40 {y} {z}", f"G1 100 {y} {z}", f"G0 100 {y} 10")]


class TestContact:
    @pytest.mark.parametrize("shank", [11.0, 12.0, 16.0, 20.0])
    def test_shank_wider_than_the_slot(self, shank: float) -> None:
        """A slot 10 mm wide and 15 mm deep: the shank stands (shank - 10) / 2 in each wall, over flutes of 6 mm."""
        found = follow(mill(6.0, shank=shank), *slots(20.0, -5.0, -10.0, -15.0))
        depth = max(c.depth_mm for c in found.contacts)
        assert depth == pytest.approx(0.5 * (shank - 10.0), abs=PITCH)
        assert depth <= 0.5 * (shank - 10.0) + 1e-9
        # at 5 mm the shank is 1 mm above the block
        assert [c.line for c in found.contacts] == [7, 11]
        assert {c.what for c in found.contacts} == {"shank"}

    @pytest.mark.parametrize("shank", [None, 10.0, 9.0, 6.0])
    def test_neck_no_wider_than_the_cutter_touches_nothing(self, shank: float | None) -> None:
        found = follow(mill(6.0, shank=shank), *slots(20.0, -5.0, -10.0, -15.0))
        assert found.contacts == ()

    def test_neck_hits_what_stands_above_the_flutes(self) -> None:
        """A single cut 15 mm deep with flutes of 6 mm: 9 mm stay above them, beside a neck of 8 mm by 1 mm."""
        for shank, depth in ((None, 5.0), (8.0, 4.0)):
            found = follow(mill(6.0, shank=shank), *slots(20.0, -15.0))
            assert max(c.depth_mm for c in found.contacts) == pytest.approx(depth, abs=HIDDEN)

    def test_side_cut_deeper_than_the_flutes_clears_a_neck(self) -> None:
        """1 mm is cut from the side of the block at 15 mm: a neck of 7.9 mm passes beside it, one of 8.6 does not."""
        for shank, touches in ((7.9, False), (8.6, True)):
            assert bool(follow(mill(6.0, shank=shank), *slots(-4.0, -15.0)).contacts) is touches

    def test_holder_beside_a_pocket(self) -> None:
        """A holder of 50 mm goes 3 mm below the top of the block, over a slot of 10 mm."""
        found = follow(mill(43.0 - 3.0, holder=50.0), *slots(20.0, -15.0), low=-50.0)
        assert found.contacts == ()
        cuts = [w for z in (-20.0, -40.0, -43.0) for w in slots(20.0, z)]
        (hit,) = follow(mill(40.0, holder=50.0), *cuts, low=-50.0).contacts
        assert hit.what == "holder"
        assert hit.depth_mm == pytest.approx(3.0, abs=1e-9)
        assert hit.line == 11

    def test_holder_in_a_wide_pocket_touches_nothing(self) -> None:
        """The same holder where all of the block but a low floor is gone."""
        floor = [way for y in range(0, 41, 8) for way in slots(float(y), -20.0, -40.0, -43.0)]
        assert follow(mill(40.0, holder=50.0), *floor, low=-50.0).contacts != ()
        faced = [way for z in (-20.0, -40.0) for y in range(0, 41, 8) for way in slots(float(y), z)]
        assert follow(mill(40.0, holder=50.0), *faced, *slots(20.0, -43.0), low=-50.0).contacts == ()

    def test_stock_is_that_of_the_moment(self) -> None:
        """The wall that a shank of 14 mm meets is cut away afterwards, or before."""
        deep = slots(20.0, -10.0)
        around = [w for y in (12.0, 28.0) for w in slots(y, -5.0, -10.0)]
        shank = mill(6.0, shank=14.0)
        assert follow(shank, *slots(20.0, -5.0), *deep, *around).contacts
        assert not follow(mill(10.0, shank=14.0), *around, *slots(20.0, -5.0), *deep).contacts


class TestRapids:
    @pytest.mark.parametrize("depth", [0.05, 0.49, 3.0])
    def test_depth_of_a_rapid(self, depth: float) -> None:
        found = follow(mill(), "G0 -10 20 10", f"G0 -10 20 {-depth}", f"G0 70 20 {-depth}")
        (cut,) = found.rapids
        assert (cut.line, cut.depth_mm) == (3, pytest.approx(depth, abs=1e-9))

    @pytest.mark.parametrize("corner", [0.0, 1.0, 5.0])
    def test_rapid_on_the_floor_that_it_cut(self, corner: float) -> None:
        ways = ["G0 -10 20 10", "G0 -10 20 -2", "G1 70 20 -2", "G0 -10 20 -2", "G0 30 20 -2", "G0 30 20 10"]
        assert follow(mill(corner=corner), *ways).rapids == ()


class TestHeights:
    def test_ball_slot(self) -> None:
        """z = r - sqrt(r^2 - y^2) over the floor of a ball's slot, and on a slope of 1 : 10."""
        for rise in (0.0, 8.0):
            found = follow(mill(corner=5.0), "G0 -10 20 10", "G0 -10 20 -9", f"G1 70 20 {rise - 9.0}")
            i, j = 120, np.abs(found.y - 20.0) < 4.0
            across = found.y[j] - 20.0
            tilt = math.hypot(1.0, rise / 80.0)
            centre = -9.0 + 5.0 + rise / 80.0 * (found.x[i] + 10.0)
            exact = centre - tilt * np.sqrt(25.0 - across**2)
            assert found.top[i, j] == pytest.approx(exact, abs=2e-3)


class TestLooseStocks:
    across: Callable[..., list[str]] = staticmethod(
        lambda *depths, x=30: [
            w for z in depths for w in (f"G0 {x} -10 10", f"G0 {x} -10 {z}", f"G1 {x} 50 {z}", f"G0 {x} 50 10")
        ]
    )
    after = ("G0 70 20 10", "G0 70 20 -5", "G1 -10 20 -5")

    def test_part_off_and_mill_on(self) -> None:
        found = follow(mill(), *self.across(-8.0, -16.0, -20.5), *self.after)
        (piece,) = find_loose_stock(found, 10.0)
        # two halves of 25 mm; the one that is cut on first keeps less and is the loose one
        assert piece.freed_line == 11
        assert piece.line == 15
        assert piece.size_mm == (pytest.approx(25.0, abs=PITCH), pytest.approx(40.0, abs=PITCH))

    @pytest.mark.parametrize(
        "ways",
        [
            [*across.__func__(-8.0, -16.0, -20.5), "G0 30 60 10"],  # nothing after
            [*across.__func__(-8.0, -16.0, -19.5), *after],  # a floor of 0.5 mm is left
            [*across.__func__(-8.0, -16.0), "G0 30 -10 -20.5", "G1 30 30 -20.5", "G0 30 30 10", *after],  # a bridge
            [*across.__func__(-8.0, -16.0, -20.5, x=50), "G0 20 -10 10", "G0 20 -10 -5", "G1 20 50 -5"],  # the rest
        ],
    )
    def test_what_is_held_is_milled_on(self, ways: list[str]) -> None:
        assert find_loose_stock(follow(mill(), *ways), 10.0) == ()

    def test_contour_with_and_without_a_tab(self) -> None:
        """A square of 16 mm is cut out of the block, then its top is milled."""
        around = ("15 7", "41 7", "41 33", "15 33", "15 7")
        top = ("G0 15 7 10", "G0 12 20 10", "G0 12 20 -1", "G1 48 20 -1")
        whole = ["G0 15 7 10", "G1 15 7 -20.5", *(f"G1 {p} -20.5" for p in around)]
        (piece,) = find_loose_stock(follow(mill(26.0), *whole, *top), 10.0)
        assert piece.line == 11
        assert piece.size_mm == (pytest.approx(16.0, abs=2 * PITCH),) * 2
        tab = ["G0 15 7 10", "G1 15 7 -20.5", "G1 41 7 -20.5", "G1 41 33 -20.5", "G1 41 33 -18", "G1 26 33 -18"]
        tabs = [*tab, "G1 26 33 -20.5", "G1 15 33 -20.5", "G1 15 7 -20.5"]
        assert find_loose_stock(follow(mill(26.0), *tabs, *top), 10.0) == ()


class TestThinWalls:
    pocket: Callable[[float], list[str]] = staticmethod(
        lambda wall: [w for y in (20.0 - 5.0 - wall / 2, 20.0 + 5.0 + wall / 2) for w in slots(y, -8.0, -16.0)]
    )

    @pytest.mark.parametrize("wall", [1.0, 2.0, 3.0])
    def test_wall_between_two_slots(self, wall: float) -> None:
        """A wall 16 mm high between two slots: slenderness 16, 8 and 5.3."""
        (thin,) = find_slender_walls(follow(mill(), *self.pocket(wall)), 5.0)
        assert thin.height_mm == pytest.approx(16.0, abs=0.02)
        assert thin.thickness_mm == pytest.approx(wall, abs=1.5 * PITCH)
        assert thin.length_mm == pytest.approx(60.0, rel=0.4)
        assert abs(thin.place[1] - 20.0) < wall

    def test_thick_walls_and_corners(self) -> None:
        """A wall of 4 mm is less slender than 5; a block with sharp corners has no wall."""
        assert find_slender_walls(follow(mill(), *self.pocket(4.0)), 5.0) == ()
        around = ["G0 -4 -20 10", "G0 -4 -20 -18", "G1 -4 44 -18", "G1 64 44 -18", "G1 64 -4 -18", "G1 -4 -4 -18"]
        assert find_slender_walls(follow(mill(), *around), 5.0) == ()


def test_finer_steps_change_nothing() -> None:
    """Heights of a ramp of a bull nose do not depend on the length of the steps."""
    stock = partial(LayeredStock.block, (0.0, 0.0, -20.0), (60.0, 40.0, 0.0), 1.0, 40.0)
    ways = ("G0 5 20 10", "G1 50 25 -9", "G1 5 20 -9")
    maps = [follow_heights(path(*ways, step=s), {1: mill(corner=2.0)}, stock(), PITCH, 0.001) for s in (0.4, 50.0)]
    some = np.isfinite(maps[0].top)
    assert np.abs(maps[0].top - maps[1].top)[some].max() < 2e-3
