"""Removal from tiles as rings of numbers, against :meth:`LayeredStock.remove_many`, which GEOS does."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import shapely

from chipload.stock.areas import areas_of
from chipload.stock.layers import LayeredStock
from chipload.stock.tile_rings import TileRings


def capsules(rng: np.random.Generator, count: int) -> list[shapely.Polygon]:
    """Of a cutter that goes on from place to place, now and then along itself."""
    places = rng.uniform(0.0, 40.0, (count + 1, 2))
    places[5::4] = places[3:-2:4][: len(places[5::4])]
    discs = [shapely.Point(*p).buffer(4.0, 8) for p in places]
    return [a.union(b).convex_hull for a, b in itertools.pairwise(discs)]


def test_a_removal_takes_what_geos_takes_and_leaves_what_geos_leaves() -> None:
    """Areas, pieces joined over tiles, films left out, sections, volumes; layers cut alike share their tiles."""
    rng = np.random.default_rng(5)
    stock = LayeredStock.block((0.0, 0.0, 0.0), (40.0, 40.0, 4.0), 1.0, 9.0)
    known, tiles, film = stock.copied(), TileRings(stock), 0.05
    for n, shape in enumerate(capsules(rng, 60)):
        other = shapely.affinity.scale(shape, 0.9, 0.9)
        areas, layers, of = areas_of([shape, other]), np.array([0, 1, 3]), np.array([0, 0, 1])
        found = tiles.remove(layers, of, areas, film)
        pieces = known.remove_many(layers, [shape, shape, other])
        assert found.area == pytest.approx([math.fsum(p.area for p in some) for some in pieces], abs=1e-9), n
        for e, some in enumerate(pieces):
            whole = [p.area for p in some if 2.0 * p.area > film * p.length]
            assert found.parts[e] == len(whole), n
            assert found.least[e] == pytest.approx(min(whole, default=0.0), abs=1e-9), n
            assert found.whole[e] == pytest.approx(math.fsum(whole), abs=1e-9), n
            assert sum(p.area for p in tiles.parts_of(e)) == pytest.approx(found.area[e], abs=1e-9)
        if n % 10 == 9:
            tiles.finish()
            tiles = TileRings(stock)
    tiles.finish()
    assert stock.by_geos == 0
    assert stock.volume() == pytest.approx(known.volume(), abs=1e-9)
    for i in range(stock.layers):
        assert stock.section(i).symmetric_difference(known.section(i)).area < 1e-9
    assert shapely.is_valid(stock.tiles.ravel()).all()
    assert all(a is b for a, b in zip(stock.tiles[0].ravel(), stock.tiles[1].ravel(), strict=True))
    assert stock.cut.tolist() == [True, True, False, True]


def test_a_piece_goes_over_the_borders_of_tiles_and_two_that_meet_in_a_corner_are_two() -> None:
    stock = LayeredStock.block((0.0, 0.0, 0.0), (20.0, 20.0, 1.0), 1.0, 10.0)
    tiles = TileRings(stock)
    whole = shapely.box(5.0, 5.0, 15.0, 15.0)
    halves = shapely.MultiPolygon([shapely.box(2.0, 2.0, 4.0, 3.0), shapely.box(16.0, 16.0, 17.0, 18.0)])
    first = tiles.remove(np.array([0]), np.array([0]), areas_of([halves]), 0.0)
    assert (first.parts.tolist(), first.area.tolist()) == ([2], [4.0])
    corner = shapely.MultiPolygon([shapely.box(9.0, 9.0, 10.0, 10.0), shapely.box(10.0, 10.0, 11.0, 11.0)])
    assert tiles.remove(np.array([0]), np.array([0]), areas_of([corner]), 0.0).parts.tolist() == [2]
    second = tiles.remove(np.array([0]), np.array([0]), areas_of([whole]), 0.0)
    assert second.parts.tolist() == [1]
    assert second.area[0] == pytest.approx(98.0, abs=1e-12)


def test_edges_and_points_are_those_of_the_stock() -> None:
    rng = np.random.default_rng(2)
    stock = LayeredStock.block((0.0, 0.0, 0.0), (40.0, 40.0, 3.0), 1.0, 9.0)
    tiles = TileRings(stock)
    for shape in capsules(rng, 6):
        tiles.remove(np.arange(2), np.zeros(2, dtype=np.int64), areas_of([shape]), 0.0)
    low, high = np.array([3.0, 4.0]), np.array([25.0, 30.0])
    bounds, start, edges = tiles.edges(range(3), low, high)
    points = rng.uniform(0.0, (40.0, 40.0, 3.0), (200, 3))
    inside = [tiles.holds(p[None]) for p in points]
    tiles.finish()
    known = stock.edges(range(3), low, high)
    assert bounds.tolist() == known[0].tolist()
    assert start.tolist() == known[1].tolist()
    for a, b in itertools.pairwise(start):
        # whichever way they go and whatever their order
        some, other = (sorted(sorted((e[:2], e[2:])) for e in rows[a:b].tolist()) for rows in (edges, known[2]))
        assert some == other
    section = [stock.section(i) for i in range(3)]
    assert inside == [bool(shapely.intersects_xy(section[int(z)], x, y)) for x, y, z in points]
    assert not tiles.holds(np.array([[-1.0, 5.0, 1.0], [5.0, 5.0, 7.0]]))


def test_what_crosses_itself_goes_to_geos_and_is_counted() -> None:
    """A bow tie of two triangles that go round the other way; a bar takes from both."""
    stock = LayeredStock.block((-2.0, -2.0, 0.0), (8.0, 8.0, 1.0), 1.0, 10.0)
    bow = shapely.Polygon([(0.0, 0.0), (6.0, 0.0), (6.0, 3.0), (1.0, -1.0)])
    stock.tiles[0, 0, 0] = bow
    bar, known = shapely.box(-1.0, -0.5, 7.0, 1.4), shapely.make_valid(bow)
    tiles = TileRings(stock)
    found = tiles.remove(np.array([0]), np.array([0]), areas_of([bar]), 0.0)
    tiles.finish()
    assert stock.by_geos == 1
    assert found.area[0] == pytest.approx(known.intersection(bar).area, rel=1e-12)
    assert found.parts[0] == 2
    assert stock.volume() == pytest.approx(known.difference(bar).area, rel=1e-12)


def test_tiles_with_many_points_are_made_simpler_and_what_that_takes_is_counted() -> None:
    """The volume of the stock is the block's less what was taken, plus what it gained."""
    stock = LayeredStock.block((0.0, 0.0, 0.0), (40.0, 40.0, 1.0), 1.0, 40.0)
    tiles, lost = TileRings(stock), 0.0
    for k in range(300):
        disc = shapely.Point(5.0 + 0.1 * k, 20.0).buffer(4.0, 32)
        lost += float(tiles.remove(np.array([0]), np.array([0]), areas_of([disc]), 0.0, 0.01).area[0])
    tiles.finish()
    assert stock.tidied != 0.0
    assert stock.volume() == pytest.approx(1600.0 - lost + stock.tidied, abs=1e-9)
    assert shapely.get_num_coordinates(stock.tiles[0, 0, 0]) < 400
    assert stock.room[0, 0, 0] > 128
