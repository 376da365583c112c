"""Patches of an impeller's sides against the source's gouge test and every way there is."""

import math
from itertools import pairwise, product

import numpy as np
import pytest

from chipload.cutter.catalogue import Catalogue, CatalogueCutter, catalogue_named
from chipload.errors import InputError
from chipload.planning.impeller.answer import largest_cutters, one_cutter
from chipload.planning.impeller.closed_form import axis_at
from chipload.planning.impeller.compare import clear_somewhere, cutter_choices, gouges
from chipload.planning.impeller.costs import STEP, ChannelSide, Costs, MeasuredCost, Terms
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.patch import Patch
from chipload.planning.impeller.patches import costs_of, divide_sides, with_begins
from chipload.planning.impeller.scene import Scene
from chipload.planning.impeller.step_over import step_over

TABLES = np.radians([30.0, 55.0, 85.0])
GRID = np.arange(0.0, 2.0 * math.pi + 1e-9, STEP)
TERMS = Terms(2.0, 0.1, 40.0, 15.0, 3)
SHOP = Catalogue(
    "shop",
    (
        CatalogueCutter(14.0, 1.5, 20.0, shank_diameter=16.0, reach=60.0, holder_diameter=40.0),
        CatalogueCutter(20.0, 2.0), CatalogueCutter(26.0, 2.0), CatalogueCutter(32.0, 2.0),
    ),
)  # fmt: skip


def side_of(name, a=5, b=4, catalogue=SHOP, low=0.35):
    u, v = np.linspace(0.05, 0.95, a), np.linspace(low, 0.95, b)
    scene = impeller_of(ImpellerShape()).scene(0, name, (u, v), (25, 15), 2.0, 0, (25, 15))
    answer = largest_cutters(scene, catalogue, TABLES, 0.5)
    area = np.random.default_rng(1).uniform(20.0, 60.0, a * b)
    return ChannelSide(0, name, scene, u, v, area, answer, 0.5)


@pytest.fixture(scope="module")
def sides():
    return [side_of("plus"), side_of("minus")]


def times_by_test(side, costs):
    """(2, c, k, t) by the gouge test on the grid of pallet angles; 0: none of the grid is clear, nan: not asked."""
    scene, (a, b) = side.scene, side.shape
    grid = scene.contact.reshape(a, b, 3)
    along = [x.reshape(-1, 3) for x in (np.gradient(grid, side.v, axis=1), np.gradient(grid, side.u, axis=0))]
    out = np.full(costs.time.shape, np.nan)
    every = list(product(range(a * b), range(len(SHOP.cutters)), range(len(TABLES))))
    for c, k, t in (every[i] for i in np.random.default_rng(2).permutation(len(every))[:60]):
        cutter, table = SHOP.cutters[k], TABLES[t]
        out[:, c, k, t] = 0.0
        T = axis_at(table, GRID)
        n = T @ scene.normal[c]
        good = [
            0.0 <= m < 1.0 and gouges(scene, c, cutter, table, B, 0.5) is None
            for m, B in zip(n, GRID, strict=True)
        ]  # fmt: skip
        for order in range(2) if any(good) else ():
            w = step_over(
                scene.normal[c], T[good], along[order][c], scene.curvature[c], cutter.rho, cutter.corner_radius,
                TERMS.scallop,
            )  # fmt: skip
            out[order, c, k, t] = side.area[c] / w.max() / TERMS.feed
    return out


def test_times_are_those_of_the_gouge_test():
    side = side_of("plus", 4, 3)
    costs = costs_of([side], TERMS)[0]
    first = costs.time.copy()
    costs.prove(list(product(*(range(n) for n in costs.known.shape))))
    assert costs.known.all()
    # what was bounded is not above what is proved
    assert (first <= costs.time).all()
    expected = times_by_test(side, costs)
    some = expected > 0.0
    np.testing.assert_allclose(costs.time[some], expected[some], rtol=1e-9)
    assert some[0].sum() > 20
    # what the grid does not show are ranges between its angles
    for c, k, t in zip(*np.nonzero(expected[0] == 0.0), strict=True):
        rows = costs.ranges.get((c, k, t), np.zeros((0, 2)))
        assert (rows[:, 1] - rows[:, 0] < STEP).all()


@pytest.mark.parametrize("most", [1, 2])
def test_least_time_of_all_ways(sides, most):
    side = sides[0]
    found = divide_sides(costs_of([side], TERMS), most)
    costs = costs_of([side], TERMS)[0]
    costs.prove(list(product(*(range(n) for n in costs.known.shape))))
    K, T = costs.known.shape[1:]
    states = list(product(range(K), range(T)))
    best = math.inf
    for order in range(2):
        whole = costs.cells(order).sum(axis=1) * TERMS.repeats
        assert np.isfinite(whole).any(axis=(1, 2)).all()
        for run in product(states, repeat=len(whole)):
            if len({k for k, _ in run}) <= most:
                total = sum(whole[i, k, t] for i, (k, t) in enumerate(run))
                for a, b in pairwise(run):
                    total += TERMS.cutter_change * (a[0] != b[0]) + TERMS.table_change * (a[1] != b[1])
                best = min(best, total)
    assert found.total == pytest.approx(best, rel=1e-12)


def test_every_point_of_a_patch_is_clear(sides):
    for most in (1, 2, None):
        found = divide_sides(costs_of(sides, TERMS), most)
        assert found.bound_any_shape <= found.bound <= found.total
        for side in sides:
            own = [p for p in found.patches if p.side == side.side]
            # the patches cover the side, once
            assert len(np.unique(np.concatenate([p.at for p in own]), axis=0)) == len(side.area)
            assert sum(len(p.at) for p in own) == len(side.area)
            reached = side.answer.cutter >= 0
            assert sum(p.area for p in own) == pytest.approx(side.area[reached].sum())
            spans = sorted((p.low, p.high) for p in own)
            assert all(a[1] == b[0] for a, b in pairwise(spans))
            for p in own:
                for (u, v), rows in zip(p.at, p.ranges, strict=True):
                    c = int(np.abs(side.u - u).argmin() * len(side.v) + np.abs(side.v - v).argmin())
                    assert (len(rows) > 0) == bool(reached[c])
                    for lo, hi in rows:
                        cutter = SHOP.cutters[p.cutter]
                        assert gouges(side.scene, c, cutter, p.table, 0.5 * (lo + hi), 0.5) is None
        milling = sum(p.time for p in found.patches) * TERMS.repeats
        changes = TERMS.cutter_change * found.cutter_changes + TERMS.table_change * found.table_changes
        assert found.total == pytest.approx(milling + changes, rel=1e-12)
        assert found.path == pytest.approx(milling * TERMS.feed, rel=1e-12)


def test_one_hard_point_decides_its_strip_alone():
    side = side_of("plus", 6, 4)
    # a post stands off one contact point: only the smallest cutter gets between
    where, s = side.scene.contact[3 * 4 + 1], side.scene
    post = where + 15.0 * s.normal[3 * 4 + 1] + np.linspace(-8, 40, 25)[:, None] * np.array([0.0, 0.0, 1.0])
    scene = Scene(
        s.contact, s.normal, s.curvature, s.surface, np.concatenate([s.check, post]),
        np.concatenate([s.check_surface, np.full(25, 9)]), s.near,
    )  # fmt: skip
    answer = largest_cutters(scene, SHOP, TABLES, 0.5)
    free = Terms(2.0, 0.1, 0.0, 0.0)
    hard = ChannelSide(0, "plus", scene, side.u, side.v, side.area, answer, 0.5)
    small = divide_sides(costs_of([hard], free), None)
    sizes = {SHOP.cutters[p.cutter].diameter for p in small.patches}
    assert len(sizes) > 1
    assert small.total > divide_sides(costs_of([side], free), None).total


def test_what_nothing_reaches_is_listed():
    # a lid over one row of points
    side = side_of("plus", 4, 3)
    s = side.scene
    lid = s.contact[4] + 6.0 * s.normal[4]
    u = np.linspace(-5, 5, 11)
    e1 = np.cross(s.normal[4], [0.0, 0.0, 1.0])
    e2 = np.cross(s.normal[4], e1)
    plate = lid + (u[:, None, None] * e1 + u[None, :, None] * e2).reshape(-1, 3)
    scene = Scene(
        s.contact, s.normal, s.curvature, s.surface, np.concatenate([s.check, plate]),
        np.concatenate([s.check_surface, np.full(121, 9)]), s.near,
    )  # fmt: skip
    answer = largest_cutters(scene, SHOP, TABLES, 0.5)
    missed = {x.point for x in answer.unreachable}
    assert 4 in missed
    assert len(missed) < 12
    found = divide_sides(costs_of([ChannelSide(0, "plus", scene, side.u, side.v, side.area, answer, 0.5)], TERMS), None)
    assert {x.point for x in found.unreachable[0]} == missed
    assert sum(p.area for p in found.patches) == pytest.approx(side.area[answer.cutter >= 0].sum())
    assert sum(len(rows) == 0 for p in found.patches for rows in p.ranges) == len(missed)


def test_hand_picked_beside_one_and_two(sides):
    ways = [choice.partition() for choice in cutter_choices(sides, TERMS, 0, (1, 2, None))]
    assert [w.name for w in ways] == ["hand-picked", "1 cutter", "2 cutters", "any cutters"]
    picked, *others = (w.divided for w in ways)
    totals = [d.total for d in others]
    assert totals == sorted(totals, reverse=True)
    # it is one of the catalogue
    assert others[0].total <= picked.total
    assert [w.share for w in ways] == [1.0] * 4
    (alone,) = cutter_choices(sides, Terms((2.0, 9.0, 9.0, 9.0), 0.1, 40.0, 15.0, 3), 0, ())
    assert picked.total == pytest.approx(alone.partition().divided.total)


def test_the_answer_is_clear_everywhere_and_the_next_size_is_not():
    catalogue = catalogue_named("wu2019")
    side = side_of("plus", 3, 3, catalogue)
    index, table, _ = one_cutter(side.scene, side.answer, 0.0)
    cutter = catalogue.cutters[index]
    B = np.radians(np.arange(0.5, 360.0, 1.0))
    every = range(len(side.area))
    assert all(clear_somewhere(side.scene, c, cutter, TABLES[table], B) for c in every)
    larger = CatalogueCutter(cutter.diameter + 2.0, cutter.corner_radius)
    assert larger in catalogue.cutters
    for t in TABLES:
        assert not all(clear_somewhere(side.scene, c, larger, t, B) for c in every)
    # and point by point
    for c in every:
        size = side.answer.diameter[c]
        assert clear_somewhere(side.scene, c, catalogue.cutters[side.answer.cutter[c]], TABLES, B)
        if size < 80.0:
            assert not clear_somewhere(side.scene, c, CatalogueCutter(size + 2.0, 2.0), TABLES, B)


def test_refused(sides):
    s = sides[0]
    with pytest.raises(InputError, match="side plus: u 5, v 3, 20 contact points: must be a grid of at least 2 x 2"):
        ChannelSide(0, "plus", s.scene, s.u, s.v[1:], s.area, s.answer)
    with pytest.raises(InputError, match="scallop_mm = 0: must be above 0"):
        Terms(1.0, 0.0, 1.0, 1.0)
    with pytest.raises(InputError, match="feed_mm_s = -1: must be above 0"):
        Terms((1.0, -1.0), 0.1, 1.0, 1.0)
    with pytest.raises(InputError, match="feed_mm_s: 2 numbers: must be one or 4"):
        costs_of(sides, Terms((1.0, 2.0), 0.1, 1.0, 1.0))
    with pytest.raises(InputError, match="hand_picked = 4: must be an index of the 4 cutters"):
        cutter_choices(sides, TERMS, 4)
    with pytest.raises(InputError, match="contact point 0: the axis is at"):
        gouges(s.scene, 0, SHOP.cutters[0], math.pi / 2, math.atan2(-s.scene.normal[0][1], -s.scene.normal[0][0]))


def test_what_programs_take_leads_the_next_division():
    costs = Costs.__new__(Costs)
    costs.factor = np.ones((2, 3, 2))
    costs.measured([])
    # a patch that no cutter reaches predicts nothing
    costs.measured([MeasuredCost(1, 1, 0, 0.0, 0.0)])
    assert (costs.factor == 1.0).all()
    costs.measured(
        [MeasuredCost(0, 1, 0, 10.0, 30.0), MeasuredCost(0, 1, 0, 30.0, 30.0), MeasuredCost(0, 2, 1, 10.0, 50.0)]
    )
    # two patches of one cutter at one angle together; what has no program yet as the mean of its order, or of all
    assert costs.factor[0, 1, 0] == 1.5
    assert costs.factor[0, 2, 1] == 5.0
    assert costs.factor[0, 0, 0] == costs.factor[1, 1, 0] == 110.0 / 50.0


def test_lines_begin_at_a_border_with_another_patch():
    def patch(side, low, high, order="u"):
        return Patch(0, side, order, low, high, 0, 1.0, np.zeros((0, 2)), (), 0.0, 0.0, 0.0)

    given = (
        patch("plus", 0.0, 0.4), patch("plus", 0.4, 0.7), patch("plus", 0.7, 1.0), patch("minus", 0.0, 1.0),
        patch("floor", 0.0, 0.4), patch("floor", 0.4, 1.0, "v"),
    )  # fmt: skip
    # the first of three begins at its end; a patch alone, and one whose neighbour lies across it, where they may
    assert [p.begin for p in with_begins(given)] == ["high", "low", "low", "any", "any", "any"]
