"""Passes on walls: states against meshes of their own thickness, and the offset function on walls by formula."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chipload.errors import InputError
from chipload.planning.thinwall.blank import SIDES, FinishSurface, WallBlank
from chipload.planning.thinwall.depth import DepthRange
from chipload.planning.thinwall.force_table import ForceTable
from chipload.planning.thinwall.passes import constant, least_first_depth, variable
from chipload.planning.thinwall.threshold import modelled
from chipload.structure.grid import plate
from chipload.structure.places import normals_of, on_side
from chipload.structure.solid import SolidWorkpiece, compliance, factorise

#: F = 100 N/mm d from 0.01 to 1 mm
STRAIGHT = ForceTable(DepthRange(0.01, 1.0), np.array([0.01, 1.0]), np.array([1.0, 100.0]))


def made(thickness: float) -> SolidWorkpiece:
    grid = plate(60.0, 40.0, thickness, (6, 5, 1))
    return SolidWorkpiece(grid, 114000.0, 0.34, 4.43e-9, grid.side("j-"))


def test_state_is_the_thinner_plate():
    wall = WallBlank(made(5.0), (1.0, 1.5), 2)
    left = (np.full(wall.shape, 0.3), np.full(wall.shape, 0.8))
    thin = made(2.5 + 0.3 + 0.8)
    places = on_side(thin.grid, "k+", [0.5, 1.0, 0.25], [1.0, 1.0, 0.5])
    C = compliance(factorise(thin), places, normals_of(thin.grid, places, "k+"))
    found = wall.threshold(left, "k+", 0.05).force.reshape(wall.shape)
    assert_allclose([found[6, 10], found[12, 10], found[3, 5]], 0.05 / C, rtol=1e-7)


def test_surfaces():
    wall = WallBlank(made(5.0), (1.0, 1.5))
    low, high = (wall.surface(s) for s in SIDES)
    assert_allclose(low.points[..., 2], 1.0, atol=1e-12)
    assert_allclose(high.points[..., 2], 3.5, atol=1e-12)
    assert_allclose(low.normals, np.broadcast_to([0.0, 0.0, -1.0], low.normals.shape), atol=1e-12)
    assert_allclose(high.points[6, 5], [60.0, 40.0, 3.5], atol=1e-12)


def test_softest_place_of_an_element():
    """One place without stock makes the elements around it thin, no others."""
    wall = WallBlank(made(5.0), (1.0, 1.0), 2)
    D = np.full(wall.shape, 1.0)
    D[4, 3] = 0.0
    kept = wall.state((np.ones(wall.shape), D)).kept.reshape(6, 5, 2)
    thin = kept[..., 1] < 1.0 - 1e-12
    assert {(int(i), int(j)) for i, j in np.argwhere(thin)} == {(1, 1), (2, 1)}
    assert_allclose(kept[thin][:, 1], 0.8)


def line(allowance: float, n: int = 41) -> FinishSurface:
    x, y = np.meshgrid(np.linspace(0.0, 4.0, n), [0.0, 1.0], indexing="ij")
    points = np.stack([x, y, 0.0 * x], axis=-1)
    return FinishSurface(points, np.broadcast_to([0.0, 0.0, 1.0], points.shape), allowance)


def test_offset_function():
    """F_th = 30 - 20 exp(-x) N, 100 N/mm, as a wall that does not stiffen: D_k = k (0.3 - 0.2 exp(-x)) while steeper
    than nothing, and an envelope where L = 0.1 is less than that slope."""
    surface = line(0.55)
    x = surface.points[..., 0]
    depth = 0.3 - 0.2 * np.exp(-x)

    def bears(left, side):
        return modelled(0.05 / (100.0 * depth).ravel(), 0.05)

    plan = variable([surface], bears, STRAIGHT, 10.0)
    # less than the smallest depth, 0.01, is not left for the pass before
    expected = [np.where(k * depth >= 0.55 - 1e-9, 0.55, np.minimum(k * depth, 0.54)) for k in range(7)]
    assert len(plan.passes) == 6
    for k, p in enumerate(reversed(plan.passes)):
        assert_allclose(p.low, expected[k], atol=1e-9)
        assert_allclose(p.high, expected[k + 1], atol=1e-9)
        assert_allclose(p.force, 100.0 * (expected[k + 1] - expected[k]), atol=1e-6)
    assert plan.holds
    assert plan.deflection_max == pytest.approx(0.05)

    flat = variable([surface], bears, STRAIGHT, 0.1).passes[-1].high[:, 0]
    assert np.abs(np.diff(flat)).max() <= 0.1 * 0.1 + 1e-12
    bend = np.log(2.0)  # where the slope 0.2 exp(-x) is 0.1
    assert_allclose(flat[x[:, 0] > bend + 2.0], depth[:, 0][x[:, 0] > bend + 2.0][: len(flat)], atol=0.1)
    all_pairs = (depth[:, 0][None] + 0.1 * np.abs(x[:, :1] - x[:, 0][None])).min(axis=1)
    assert_allclose(flat, all_pairs, atol=1e-9)


def test_sides_alternate_and_end_on_the_finish():
    asked = []

    def bears(left, side):
        asked.append((side, [float(d.min()) for d in left]))
        return modelled(np.full(left[side].size, 0.05 / 25.0), 0.05)

    plan = variable([line(0.5), line(0.5)], bears, STRAIGHT, 1.0)
    assert [p.side for p in plan.passes] == [0, 1, 0, 1]
    # planned from the end: B1 on the finished wall, A1 with what B1 takes still there, ...
    assert [s for s, _ in asked] == [1, 0, 1, 0]
    assert_allclose([d for _, d in asked], [[0.0, 0.0], [0.0, 0.25], [0.25, 0.25], [0.25, 0.5]])
    for side in (0, 1):
        own = [p for p in plan.passes if p.side == side]
        assert_allclose(own[0].high, 0.5)
        assert_allclose(own[1].low, 0.0)
        assert_allclose(own[0].low, own[1].high)


@pytest.mark.parametrize("kind", ["variable", "constant"])
def test_walls_are_cut_one_after_another(kind):
    """Two walls of two sides: the first one whole before the second, which has all of its stock until then; while the
    second is cut the first one is finished."""
    surfaces = [replace(line(0.5), wall=k // 2) for k in range(4)]
    asked = []

    def bears(left, side):
        asked.append((side, [float(d.min()) for d in left]))
        return modelled(np.full(left[side].size, 0.05 / 25.0), 0.05)

    plan = variable(surfaces, bears, STRAIGHT, 1.0) if kind == "variable" else constant(surfaces, bears, STRAIGHT, 0.25)
    assert [p.side for p in plan.passes] == [0, 1, 0, 1, 2, 3, 2, 3]
    for side, left in asked:
        assert_allclose(left[2:] if side < 2 else left[:2], 0.5 if side < 2 else 0.0)


def test_constant_in_fewest_equal_passes():
    def bears(left, side):
        return modelled(np.linspace(0.05 / 22.0, 0.05 / 80.0, left[side].size), 0.05)

    assert least_first_depth([line(1.0)], bears, STRAIGHT) == pytest.approx(0.22)
    plan = constant([line(1.0)], bears, STRAIGHT, 0.22)
    assert len(plan.passes) == 5
    assert all(p.depth == pytest.approx(0.2) for p in plan.passes)
    assert plan.holds
    assert plan.force_max == pytest.approx(20.0)
    whole = constant([line(1.0)], bears, STRAIGHT, 1.0, "unconstrained")
    assert not whole.holds
    assert whole.deflection_max == pytest.approx(100.0 * 0.05 / 22.0)


def test_places_that_bear_nothing_are_listed():
    def bears(left, side):
        C = np.full(left[side].shape, 0.05 / 50.0)
        C[7, 1] = 0.05 / 0.5
        return modelled(C.ravel(), 0.05)

    plan = variable([line(0.2)], bears, STRAIGHT, 1.0)
    assert plan.infeasible == ((0, 7, 1),)
    assert not plan.holds
    with pytest.raises(InputError, match=r"3 on each side remove only 0\.03 mm"):
        variable([line(0.2)], bears, STRAIGHT, 1.0, most=3)


def test_refused():
    with pytest.raises(InputError, match="leave no wall"):
        WallBlank(made(2.0), (1.0, 1.0))
    with pytest.raises(InputError, match="constant depth_mm = 0: must be above 0"):
        constant([line(1.0)], lambda left, side: modelled([1.0], 0.05), STRAIGHT, 0.0)
    assert math.isclose(float(STRAIGHT.depth(50.0)), 0.5)
