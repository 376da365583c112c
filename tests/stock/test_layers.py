"""The layered stock against areas in closed form, a raster, and itself cut up otherwise."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from chipload.errors import InputError
from chipload.stock.layers import LayeredStock


def ellipse(rng: np.random.Generator, reach: float, points: int = 60) -> shapely.Polygon:
    c = rng.uniform(-1.0, reach + 1.0, 2)
    a, b, turn = rng.uniform(1.0, 6.0), rng.uniform(1.0, 6.0), rng.uniform(0.0, math.pi)
    t = np.linspace(0.0, 2.0 * math.pi, points, endpoint=False)
    x, y = a * np.cos(t), b * np.sin(t)
    return shapely.Polygon(
        np.column_stack(
            [c[0] + x * math.cos(turn) - y * math.sin(turn), c[1] + x * math.sin(turn) + y * math.cos(turn)]
        )
    )


def block(tile: float, side: float = 40.0) -> LayeredStock:
    return LayeredStock.block((0.0, 0.0, 0.0), (side, side, 6.0), [0.0, 1.0, 3.0, 6.0], tile)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_chips_and_what_is_left_add_up(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shapes = [ellipse(rng, 40.0) for _ in range(150)]
    stock = block(9.0)
    total = 0.0
    for shape in shapes:
        before = stock.area(1)
        taken = math.fsum(c.area for c in stock.remove(1, shape))
        assert taken + stock.area(1) == pytest.approx(before, rel=1e-12)
        total += taken
    left = 1600.0 - shapely.intersection(shapely.union_all(shapes), shapely.box(0, 0, 40, 40)).area
    assert stock.area(1) == pytest.approx(left, rel=1e-9)
    assert total == pytest.approx(1600.0 - left, rel=1e-9)
    assert stock.volumes()[[0, 2]].tolist() == [1600.0, 4800.0]
    assert stock.cut.tolist() == [False, True, False]


def test_neither_order_nor_tiles_change_what_is_left() -> None:
    rng = np.random.default_rng(7)
    shapes = [ellipse(rng, 40.0) for _ in range(80)]
    areas = []
    for tile in (1000.0, 11.0, 3.7):
        stock = block(tile)
        for n in rng.permutation(80):
            stock.remove(0, shapes[n])
        areas.append(stock.area(0))
        assert stock.section(0).area == pytest.approx(stock.area(0), rel=1e-12)
    assert areas == pytest.approx([areas[0]] * 3, rel=1e-11)


def test_a_raster_counts_the_same() -> None:
    rng = np.random.default_rng(11)
    stock = block(13.0)
    g = (np.arange(400) + 0.5) * 0.1
    x, y = np.meshgrid(g, g)
    left = np.ones(x.shape, dtype=bool)
    for shape in [ellipse(rng, 40.0) for _ in range(25)]:
        chips = stock.remove(2, shape)
        inside = left & shapely.contains_xy(shape, x, y)
        assert sum(c.area for c in chips) == pytest.approx(inside.sum() * 0.01, abs=0.05 * shape.length)
        left &= ~inside
    same = shapely.contains_xy(stock.section(2), x, y) == left
    assert same.all()


def test_a_chip_over_tile_borders_is_one_piece_and_two_are_two() -> None:
    stock = block(5.0)
    disc = shapely.Point(10.0, 10.0).buffer(4.0)
    (chip,) = stock.remove(0, disc)
    assert chip.area == pytest.approx(disc.area, rel=1e-12)
    assert stock.remove(0, disc) == []
    stock.remove(0, shapely.box(20.0, 0.0, 21.0, 40.0))
    pieces = stock.remove(0, shapely.box(19.0, 30.0, 22.0, 33.0))
    assert sorted(p.area for p in pieces) == pytest.approx([3.0, 3.0], rel=1e-12)
    (left, right) = sorted(pieces, key=lambda p: p.bounds[0])
    assert (left.bounds, right.bounds) == ((19.0, 30.0, 20.0, 33.0), (21.0, 30.0, 22.0, 33.0))


def test_many_are_as_one_after_the_other() -> None:
    rng = np.random.default_rng(5)
    shapes = [ellipse(rng, 40.0) for _ in range(40)]
    layers = rng.integers(0, 3, 40)
    one, many = block(8.0), block(8.0)
    single = [one.remove(int(i), s) for i, s in zip(layers, shapes, strict=True)]
    together = many.remove_many(layers, shapes)
    assert [[shapely.to_wkb(p) for p in c] for c in single] == [[shapely.to_wkb(p) for p in c] for c in together]
    assert one.volumes().tolist() == many.volumes().tolist()


def test_what_misses_takes_nothing() -> None:
    stock = block(8.0)
    assert stock.remove(0, shapely.box(-5.0, -5.0, 0.0, 40.0)) == []
    assert stock.remove(0, shapely.box(41.0, 0.0, 42.0, 1.0)) == []
    assert stock.remove(0, shapely.Polygon()) == []
    assert stock.remove_many([], []) == []
    assert not stock.cut.any()
    (chip,) = stock.remove(1, shapely.box(-100.0, -100.0, 100.0, 100.0))
    assert chip.area == pytest.approx(1600.0, rel=1e-12)
    assert stock.area(1) == 0.0
    assert stock.section(1).is_empty


def test_layers_between() -> None:
    stock = block(8.0)
    assert list(stock.layers_between(0.5, 2.0)) == [0, 1]
    assert list(stock.layers_between(1.0, 3.0)) == [1]
    assert list(stock.layers_between(-4.0, 9.0)) == [0, 1, 2]
    assert list(stock.layers_between(6.0, 9.0)) == []
    assert list(stock.layers_between(-2.0, 0.0)) == []
    assert stock.heights.tolist() == [0.5, 2.0, 4.5]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: LayeredStock.block((0, 0, 0), (1, 1, 0), 0.1, 1.0), "each side must be above 0"),
        (lambda: LayeredStock.block((0, 0, 0), (1, 1, 1), 0.0, 1.0), "stock.layer_mm = 0: must be above 0"),
        (lambda: LayeredStock.block((0, 0, 0), (1, 1, 1), 0.1, -1.0), "stock.tile_mm = -1: must be above 0"),
        (lambda: LayeredStock.block((0, 0, 0), (1, 1, 1), [0.0, 2.0], 1.0), "must be the block's, 0 and 1"),
        (lambda: LayeredStock.block((0, 0, 0), (1, 1, 1), [0.0, 1.0, 1.0], 1.0), "ascending heights"),
        (lambda: LayeredStock.block((0, 0, 0), (1e4, 1e4, 1), 0.1, 0.1), "take larger tiles or thicker layers"),
        (lambda: block(8.0).remove(3, shapely.box(0, 0, 1, 1)), "layer 3: must be from 0 to 2"),
        (lambda: block(8.0).remove(0, shapely.Point(0, 0)), "no polygon or crosses itself"),
        (lambda: block(8.0).remove(0, shapely.Polygon([(0, 0), (9, 9), (9, 0), (0, 9)])), "crosses itself"),
        (lambda: block(8.0).remove_many([0], []), "1 layers for 0 polygons"),
    ],
)
def test_refused(call, message: str) -> None:
    with pytest.raises(InputError, match=message):
        call()
