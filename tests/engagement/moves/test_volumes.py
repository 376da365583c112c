"""Volumes of steps: closed forms, a fine field of heights, a second pass, moved and turned programs."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.moves.stock import Engaged, MoveStock
from engagement.moves.field import BALL, BULL, CUTTERS, FLAT, TAPER, Field

Floats = NDArray[np.float64]
LOW, HIGH = np.array([0.0, 0.0, -12.0]), np.array([30.0, 24.0, 0.0])


def take(stock: MoveStock, points: Floats, corner: int = 12, flank: float = 1.0) -> Engaged:
    tool = np.full(len(points) - 1, 1)
    return stock.take(points[:-1], points[1:], tool, corner_slices=corner, flank_mm={1: flank})


def volumes(stock: MoveStock, points: Floats, **more: float) -> Floats:
    found = take(stock, points, **more)  # type: ignore[arg-type]
    return np.bincount(found.step, found.volume / found.instants, len(points) - 1)


def line(a: object, b: object, step: float) -> Floats:
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    n = math.ceil(float(np.linalg.norm(b - a)) / step - 1e-9)
    return a + np.linspace(0.0, 1.0, n + 1)[:, None] * (b - a)


def random_program(seed: int, cutter: Cutter) -> Floats:
    """Steps of 0.1 to 3 mm that rise and fall within and beside the block."""
    random = np.random.default_rng(seed)
    points = [np.array([6.0, 6.0, 1.0])]
    heading = 0.0
    while len(points) < 60:
        heading += random.normal(0.0, 0.7)
        size = random.choice([0.1, 0.5, 1.0, 3.0])
        step = size * np.array([math.cos(heading), math.sin(heading), random.choice([0.0, 0.0, -0.4, 0.3])])
        if random.uniform() < 0.05:
            step = np.array([0.0, 0.0, random.uniform(-1.0, 0.5)])
        to = points[-1] + step
        if not ((to[:2] > -2.0) & (to[:2] < HIGH[:2] + 2.0)).all() or not -6.0 < to[2] < 1.5:
            heading += 1.5
            continue
        points.append(to)
    return np.array(points)


def section_area(cutter: Cutter, depth: float) -> float:
    """Area of the cutter's outline below a height above its tip."""
    z = np.linspace(0.0, depth, 20001)
    rho = cutter.radius_at(0.5 * (z[1:] + z[:-1]))
    return float(2.0 * (rho * np.diff(z)).sum())


@pytest.mark.parametrize("kind", CUTTERS)
@pytest.mark.parametrize("depth", [0.02, 0.3, 2.0, 5.0])
@pytest.mark.parametrize("step", [0.02, 0.5, 3.0])
def test_a_slot_removes_its_section_times_the_way(kind: str, depth: float, step: float) -> None:
    cutter = CUTTERS[kind]
    points = np.vstack([line((-9.0, 12.0, -depth), (15.0, 12.0, -depth), 4.0)[:-1], [(15.0, 12.0, -depth)]])
    points = np.vstack([points, line((15.0, 12.0, -depth), (15.0 + 3.0 * step, 12.0, -depth), step)[1:]])
    found = volumes(MoveStock(LOW, HIGH, {1: cutter}), points)
    np.testing.assert_allclose(found[-3:], section_area(cutter, depth) * step, rtol=2e-3)


@pytest.mark.parametrize("kind", CUTTERS)
def test_a_plunge_removes_the_cutter(kind: str) -> None:
    cutter = CUTTERS[kind]
    found = volumes(MoveStock(LOW, HIGH, {1: cutter}), line((15.0, 12.0, 0.5), (15.0, 12.0, -6.0), 0.05))
    z = np.linspace(0.0, 6.0, 200001)
    known = math.pi * float((cutter.radius_at(0.5 * (z[1:] + z[:-1])) ** 2 * np.diff(z)).sum())
    assert found.sum() == pytest.approx(known, rel=4e-3)


def test_a_shallow_ramp_removes_a_wedge() -> None:
    """0.04 mm down over 6 mm: half of 6 x 8 x 0.04, and what the rim reaches in front of it."""
    points = line((15.0, 12.0, 0.0), (21.0, 12.0, -0.04), 0.1)
    field = Field(LOW, HIGH, 0.08)
    known = field.cut(FLAT, points[0], points[-1])
    assert volumes(MoveStock(LOW, HIGH, {1: FLAT}), points).sum() == pytest.approx(known, rel=5e-3)


@pytest.mark.parametrize("kind", CUTTERS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_random_programs_remove_what_a_fine_field_loses(kind: str, seed: int) -> None:
    cutter = CUTTERS[kind]
    points = random_program(seed, cutter)
    stock, field = MoveStock(LOW, HIGH, {1: cutter}), Field(LOW, HIGH, 0.08)
    parts = [line(a, b, 0.1)[1:] for a, b in itertools.pairwise(points)]
    found = volumes(stock, np.vstack([points[:1], *parts]))
    known = np.array([field.cut(cutter, a, b) for a, b in itertools.pairwise(points)])
    assert found.sum() == pytest.approx(known.sum(), rel=1e-2)
    each = np.bincount(np.repeat(np.arange(len(points) - 1), [len(p) for p in parts]), found)
    # a bottom that comes down on a level floor meets it at once: known to the one instant of a part
    fall = np.abs(np.diff(points[:, 2])) / [len(p) for p in parts]
    share = 0.003 if kind == "ball" else 0.01
    assert (np.abs(each - known) <= 0.01 * known + share * known.max() + math.pi * cutter.apt[2] ** 2 * fall).all()


@pytest.mark.parametrize("kind", CUTTERS)
def test_a_program_twice_removes_nothing(kind: str) -> None:
    cutter = CUTTERS[kind]
    points = random_program(4, cutter)
    stock = MoveStock(LOW, HIGH, {1: cutter})
    first = volumes(stock, points)
    assert first.sum() > 1.0
    again = take(stock, points)
    assert len(again.span) == 0
    backwards = take(stock, points[::-1].copy())
    assert len(backwards.span) == 0


@pytest.mark.parametrize("kind", CUTTERS)
def test_moved_turned_and_mirrored_programs_remove_the_same(kind: str) -> None:
    cutter = CUTTERS[kind]
    points = random_program(5, cutter)
    known = volumes(MoveStock(LOW, HIGH, {1: cutter}), points, corner=24, flank=0.5)
    shift = np.array([123.4, -56.7, 8.9])
    moved = volumes(MoveStock(LOW + shift, HIGH + shift, {1: cutter}), points + shift, corner=24, flank=0.5)
    np.testing.assert_allclose(moved, known, atol=2e-3 * known.max())
    turned = points[:, [1, 0, 2]] * [-1.0, 1.0, 1.0]
    low, high = np.array([-HIGH[1], LOW[0], LOW[2]]), np.array([-LOW[1], HIGH[0], HIGH[2]])
    found = volumes(MoveStock(low, high, {1: cutter}), turned, corner=24, flank=0.5)
    np.testing.assert_allclose(found, known, atol=2e-3 * known.max())
    low, high = LOW * [-1, 1, 1], HIGH * [-1, 1, 1]
    low[0], high[0] = -HIGH[0], -LOW[0]
    mirrored = volumes(MoveStock(low, high, {1: cutter}), points * [-1, 1, 1], corner=24, flank=0.5)
    np.testing.assert_allclose(mirrored, known, atol=2e-3 * known.max())


def test_moves_that_do_not_touch_can_be_made_in_any_order() -> None:
    a = line((-6.0, 5.0, -1.0), (31.0, 5.0, -1.0), 1.0)
    b = line((-6.0, 18.0, -2.0), (31.0, 18.0, -1.0), 1.0)
    lift = np.array([[0.0, 0.0, 20.0]])
    one, two = MoveStock(LOW, HIGH, {1: BULL}), MoveStock(LOW, HIGH, {1: BULL})
    first = volumes(one, np.vstack([a, a[-1:] + lift, b[:1] + lift, b]))
    last = volumes(two, np.vstack([b, b[-1:] + lift, a[:1] + lift, a]))
    n = len(a) - 1
    np.testing.assert_array_equal(first[:n], last[-n:])
    np.testing.assert_array_equal(first[-(len(b) - 1) :], last[: len(b) - 1])


def test_the_cells_decide_costs_only(monkeypatch: pytest.MonkeyPatch) -> None:
    points = random_program(6, BALL)
    known = volumes(MoveStock(LOW, HIGH, {1: BALL}), points, corner=24)
    monkeypatch.setattr("chipload.engagement.moves.stock.CELL", 0.037)
    found = volumes(MoveStock(LOW, HIGH, {1: BALL}), points, corner=24)
    np.testing.assert_allclose(found, known, atol=5e-3 * known.max())


def test_several_cutters_leave_one_stock() -> None:
    """A slot by a flat mill, then a ball along it: the ball finds only what is beside the slot."""
    small = Cutter(4.0, 2, 0.5, 20.0, 30.0, 6e5)
    stock = MoveStock(LOW, HIGH, {1: small, 2: BALL})
    points = line((-6.0, 12.0, -2.0), (36.0, 12.0, -2.0), 0.5)
    n = len(points) - 1
    for number in (1, 2):
        found = stock.take(points[:-1], points[1:], np.full(n, number), corner_slices=48, flank_mm={1: 1.0, 2: 1.0})
        each = np.bincount(found.step, found.volume / found.instants, n)[40:60]
        z = np.linspace(0.0, 2.0, 100001)
        rho = BALL.radius_at(z)
        both = float((2.0 * np.clip(rho - 2.0, 0.0, None)).mean() * 2.0 * 0.5)
        known = 4.0 * 2.0 * 0.5 if number == 1 else both
        np.testing.assert_allclose(each, known, rtol=3e-3)


def test_a_body_gives_what_its_box_gives() -> None:
    box = trimesh.creation.box(bounds=[LOW, HIGH])
    for kind in ("ball", "flat"):
        points = random_program(7, CUTTERS[kind])
        known = volumes(MoveStock(LOW, HIGH, {1: CUTTERS[kind]}), points)
        found = volumes(MoveStock(LOW, HIGH, {1: CUTTERS[kind]}, box), points)
        np.testing.assert_allclose(found, known, atol=1e-6 * known.max())


def test_a_wedge_gives_its_section() -> None:
    """A roof whose height rises from 2 mm at y = 0 to 8 mm at y = 24; a slot along x at its middle height."""
    corners = np.array([[x, y, z] for x in (0.0, 30.0) for y, z in ((0.0, 0.0), (24.0, 0.0), (0.0, 2.0), (24.0, 8.0))])
    roof = trimesh.convex.convex_hull(corners)
    stock = MoveStock(corners.min(axis=0), corners.max(axis=0), {1: FLAT}, roof)
    found = volumes(stock, line((-6.0, 12.0, 4.0), (36.0, 12.0, 4.0), 0.5), flank=0.05)[40:50]
    # 8 mm wide, 1 mm deep at the middle, 0.25 a mm
    np.testing.assert_allclose(found, 8.0 * 1.0 * 0.5, rtol=5e-3)


def test_long_steps_are_looked_at_more_than_once() -> None:
    points = np.array([[-6.0, 12.0, -1.0], [36.0, 12.0, -1.0]])
    found = volumes(MoveStock(LOW, HIGH, {1: TAPER}), points)
    assert found[0] == pytest.approx(section_area(TAPER, 1.0) * 30.0, rel=0.01)


def test_material_above_the_flutes_is_seen() -> None:
    short = Cutter(8.0, 2, 0.5, 3.0, 30.0, 6e5)
    stock = MoveStock(LOW, HIGH, {1: short})
    assert not take(stock, line((-6.0, 12.0, -2.9), (10.0, 12.0, -2.9), 1.0)).above.any()
    assert take(stock, line((36.0, 5.0, -3.1), (20.0, 5.0, -3.1), 1.0)).above.any()


def test_a_groove_of_an_engraver_whose_tip_is_almost_a_point() -> None:
    """45 deg, a tip of 0.01 mm, 0.5 mm deep: (0.01 + 0.5) 0.5 mm^2 over each mm, looked at a few times a step."""
    cutter = Cutter(0.01, 1, 0.0, 3.0, 30.0, 6e5, taper=math.radians(45.0))
    stock = MoveStock(LOW, HIGH, {1: cutter})
    points = line((4.0, 12.0, -0.5), (26.0, 12.0, -0.5), 0.8)
    assert stock.instants(points[:-1], points[1:], np.ones(len(points) - 1, dtype=np.int64)).max() < 20
    step = float(np.linalg.norm(points[1] - points[0]))
    np.testing.assert_allclose(volumes(stock, points)[2:-2], 0.51 * 0.5 * step, rtol=2e-3)
