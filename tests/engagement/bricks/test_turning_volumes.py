"""Volumes of steps whose axis leans or turns: the upright engine turned, closed forms, points, a second pass."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.bricks.stock import MORE, BrickStock
from chipload.engagement.moves.stock import MoveStock
from engagement.bricks.programs import UP, inside, take, turn, turned, unit, volumes
from engagement.moves.field import BALL, BULL, CUTTERS, FLAT
from engagement.moves.test_volumes import random_program

Floats = NDArray[np.float64]
LOW, HIGH = np.array([0.0, 0.0, -12.0]), np.array([30.0, 24.0, 0.0])


def upright_volumes(cutter: Cutter, points: Floats) -> Floats:
    """Of each step by the upright engine, which looks at it as often."""
    stock = MoveStock(LOW, HIGH, {1: cutter})
    stock.more = MORE
    tool = np.ones(len(points) - 1, dtype=int)
    return volumes(stock.take(points[:-1], points[1:], tool, corner_slices=24, flank_mm={1: 0.5}), len(tool))


@pytest.mark.parametrize("kind", CUTTERS)
def test_upright_programs_remove_what_the_upright_engine_removes(kind: str) -> None:
    cutter, points = CUTTERS[kind], random_program(5, CUTTERS[kind])
    tool = np.ones(len(points) - 1, dtype=int)
    known = upright_volumes(cutter, points)
    found = volumes(take(BrickStock(LOW, HIGH, {1: cutter}), points, UP, 24, 0.5), len(tool))
    # of a height field of 0.03 mm under the path of the bull nose the upright engine is 0.03 % over, this one 0.23 %
    assert found.sum() == pytest.approx(known.sum(), rel=3e-3)
    # a bottom that comes down on a level floor is known to one part of a step
    fall = math.pi * cutter.apt[2] ** 2 * np.abs(np.diff(points[:, 2])) / MORE[1]
    assert (np.abs(found - known) <= 6e-3 * known.max() + fall).all()


@pytest.mark.parametrize("kind", ["ball", "flat", "bull"])
def test_a_turned_body_gives_the_volumes_of_the_upright_one(kind: str) -> None:
    """Body, points and axis of an upright program, turned by 40 degrees about a skew line."""
    cutter, points = CUTTERS[kind], random_program(6, CUTTERS[kind])[:40]
    tool = np.ones(len(points) - 1, dtype=int)
    known = upright_volumes(cutter, points)
    R = turn([1.0, 2.0, 0.5], math.radians(40.0))
    box = trimesh.creation.box(bounds=[LOW, HIGH])
    body = trimesh.Trimesh(np.asarray(box.vertices) @ R.T, box.faces)
    stock = BrickStock(*np.asarray(body.bounds), {1: cutter}, body)
    found = volumes(take(stock, points @ R.T, R @ UP, 24, 0.5), len(tool))
    # contact of a ball that is narrower than two samples is apart
    assert found.sum() == pytest.approx(known.sum(), rel=4e-3 if kind == "ball" else 2e-3)
    # a bottom that comes down on a level floor is known to one part of a step
    fall = math.pi * cutter.apt[2] ** 2 * np.abs(np.diff(points[:, 2])) / MORE[1]
    assert (np.abs(found - known) <= 6e-3 * known.max() + fall).all()


@pytest.mark.parametrize("kind", CUTTERS)
def test_a_plunge_along_a_leaning_axis_removes_the_cutter(kind: str) -> None:
    cutter, axis = CUTTERS[kind], unit([0.3, -0.2, 1.0])
    stock = BrickStock(np.array([-20.0, -20.0, -20.0]), np.array([20.0, 20.0, 3.0]), {1: cutter})
    # from beside the block down into it; of the cutter only what is below z = 3
    points = axis * np.linspace(12.0, -4.0, 161)[:, None]
    found = volumes(take(stock, points, axis), 160).sum()
    x = np.random.default_rng(2).uniform([-9.0, -9.0, -6.0], [9.0, 9.0, 3.0], (400_000, 3))
    known = inside(cutter, points[-1], axis, x).mean() * 18.0 * 18.0 * 9.0
    assert found == pytest.approx(known, rel=0.01)


def five_axes(seed: int, steps: int) -> tuple[Floats, Floats]:
    """Points and axes of a path through the block whose axis turns by up to 3 degrees a step."""
    random = np.random.default_rng(seed)
    points, axes, heading = [np.array([5.0, 8.0, -1.0])], [unit([0.2, 0.1, 1.0])], 0.0
    while len(points) <= steps:
        heading += random.normal(0.0, 0.4)
        way = random.uniform(0.2, 1.0) * np.array([math.cos(heading), math.sin(heading), random.normal(0.0, 0.2)])
        to = points[-1] + way
        if not ((to[:2] > 2.0) & (to[:2] < HIGH[:2] - 2.0)).all() or not -4.0 < to[2] < -0.5:
            heading += 1.0
            continue
        points.append(to)
        lean = axes[-1] + random.uniform(0.0, 0.04) * unit(random.normal(size=3))
        axes.append(unit(lean * [0.95, 0.95, 1.0]))
    return np.array(points), np.array(axes)


@pytest.mark.parametrize("kind", ["ball", "flat", "bull", "taper"])
def test_random_five_axis_programs_remove_what_points_lose(kind: str) -> None:
    """Random points in the block, each asked at many times of each step."""
    cutter = CUTTERS[kind]
    points, axes = five_axes(3, 40)
    parts = list[tuple[Floats, Floats]]()
    for (a, b), (c, d) in zip(itertools.pairwise(points), itertools.pairwise(axes), strict=True):
        parts += [(a + t * (b - a), turned(c, d, t)) for t in np.linspace(0.0, 1.0, 5)[:-1].tolist()]
    fine, lean = np.array([*(p for p, _ in parts), points[-1]]), np.array([*(a for _, a in parts), axes[-1]])
    found = volumes(take(BrickStock(LOW, HIGH, {1: cutter}), fine, lean), len(fine) - 1).sum()
    x = np.random.default_rng(4).uniform(LOW, HIGH, (150_000, 3))
    gone = np.zeros(len(x), dtype=bool)
    for (a, b), (c, d) in zip(itertools.pairwise(points), itertools.pairwise(axes), strict=True):
        for t in np.linspace(0.0, 1.0, 9):
            gone[~gone] = inside(cutter, a + t * (b - a), turned(c, d, t), x[~gone])
    known = gone.mean() * float((HIGH - LOW).prod())
    # the first cutter's own volume is not cut on the way: it begins in the block
    began = inside(cutter, points[0], axes[0], x).mean() * float((HIGH - LOW).prod())
    deviation = float((HIGH - LOW).prod()) * math.sqrt(gone.mean() / len(x))
    assert found == pytest.approx(known - began, abs=3.0 * deviation + 0.01 * known)


@pytest.mark.parametrize("kind", ["ball", "flat", "bull"])
def test_a_five_axis_program_twice_removes_nothing(kind: str) -> None:
    cutter = CUTTERS[kind]
    points, axes = five_axes(7, 40)
    stock = BrickStock(LOW, HIGH, {1: cutter})
    assert volumes(take(stock, points, axes), 40).sum() > 1.0
    assert len(take(stock, points, axes).span) == 0
    assert len(take(stock, points[::-1].copy(), axes[::-1].copy()).span) == 0


def test_the_bricks_decide_costs_only(monkeypatch: pytest.MonkeyPatch) -> None:
    points, axes = five_axes(9, 40)
    known = volumes(take(BrickStock(LOW, HIGH, {1: BULL}), points, axes, 24), 40)
    monkeypatch.setattr("chipload.engagement.bricks.stock.BRICK", 0.13)
    found = volumes(take(BrickStock(LOW, HIGH, {1: BULL}), points, axes, 24), 40)
    np.testing.assert_allclose(found, known, atol=5e-3 * known.max())


def test_material_above_the_flutes_of_a_leaning_cutter_is_seen() -> None:
    short = Cutter(8.0, 2, 0.5, 3.0, 30.0, 6e5)
    axis = unit([0.0, 0.3, 1.0])
    points = np.array([[-9.0, 12.0, 0.0], [4.0, 12.0, 0.0], [9.0, 12.0, 0.0]])
    assert not take(BrickStock(LOW, HIGH, {1: short}), points - np.array([0.0, 0.0, 1.0]), axis).above.any()
    assert take(BrickStock(LOW, HIGH, {1: short}), points - np.array([0.0, 0.0, 3.5]), axis).above.any()


def test_several_cutters_leave_one_stock() -> None:
    small = Cutter(4.0, 2, 0.5, 20.0, 30.0, 6e5)
    stock = BrickStock(LOW, HIGH, {1: small, 2: FLAT})
    points, axis = np.array([[x, 12.0, -2.0] for x in np.arange(-6.0, 30.0, 1.0)]), unit([0.3, 0.0, 1.0])
    first = volumes(take(stock, points, axis, tool=1), len(points) - 1)[18:24]
    second = volumes(take(stock, points, axis, tool=2), len(points) - 1)[18:24]
    alone = volumes(take(BrickStock(LOW, HIGH, {2: FLAT}), points, axis, tool=2), len(points) - 1)[18:24]
    np.testing.assert_allclose(first + second, alone, rtol=2e-3)


def test_a_ball_removes_the_same_whatever_its_axis() -> None:
    """Below its centre a ball has no direction; the centres go along one line."""
    centres = np.array([[x, 12.0, 2.5] for x in np.arange(-6.0, 20.0, 0.5)])
    area = 16.0 * math.acos(2.5 / 4.0) - 2.5 * math.sqrt(16.0 - 2.5**2)
    known = np.full(len(centres) - 31, 0.5 * area)
    axis = unit([0.1, 0.15, 1.0])
    found = volumes(take(BrickStock(LOW, HIGH, {1: BALL}), centres - 4.0 * axis, axis), len(centres) - 1)[30:]
    np.testing.assert_allclose(found, known, rtol=2e-3)
