"""The layered stock against areas in closed form, a raster, and itself cut up otherwise."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
import trimesh

from chipload.errors import InputError
from chipload.stock import tile_grid
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


def worn(seed: int = 3, moves: int = 60) -> LayeredStock:
    """A block from which discs were taken at random."""
    rng = np.random.default_rng(seed)
    stock = block(9.0)
    for _ in range(moves):
        stock.remove(int(rng.integers(3)), ellipse(rng, 40.0))
    return stock


@pytest.mark.parametrize("moves", [0, 1, 60, 160])
def test_the_mesh_is_closed_and_has_the_volume(moves: int) -> None:
    stock = worn(moves=moves)
    mesh = stock.mesh()
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(stock.volume(), rel=1e-9)


def test_the_mesh_is_closed_where_rings_touch_in_a_point() -> None:
    stock = LayeredStock.block((0.0, 0.0, 0.0), (8.0, 8.0, 1.0), 1.0, 100.0)
    for x, y in ((1, 1), (2, 2), (3, 3), (3, 1), (0, 4), (4, 0)):
        stock.remove(0, shapely.box(x, y, x + 1, y + 1))
    stock.remove(0, shapely.Polygon([(6.0, 5.0), (8.0, 6.0), (6.0, 7.0), (5.0, 6.0)]))
    mesh = stock.mesh()
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(64.0 - 6.0 - 3.0, rel=1e-12)


def test_nothing_left_is_an_empty_mesh() -> None:
    stock = LayeredStock.block((0.0, 0.0, 0.0), (8.0, 8.0, 1.0), 1.0, 100.0)
    stock.remove(0, shapely.box(0.0, 0.0, 8.0, 8.0))
    assert len(stock.mesh().faces) == 0


def sphere() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(5, 10.0)


def test_a_sphere_by_layers_converges_with_the_square() -> None:
    body = sphere()
    errors = [LayeredStock.of_mesh(body, 20.0 / n, 7.0).volume() - body.volume for n in (5, 10, 20, 40)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([2.0] * 3, abs=0.1)
    assert errors[0] == pytest.approx(math.pi * 20.0 * 4.0**2 / 12.0, rel=0.01)  # of the midpoint rule on a true sphere


def test_tiles_hold_the_whole_section() -> None:
    body = sphere()
    for tile in (3.0, 100.0):
        stock = LayeredStock.of_mesh(body, [-10.0, -4.0, 0.0, 11.0], tile)
        for i, h in enumerate((-7.0, -2.0, 5.5)):
            assert stock.heights[i] == h
            radius = math.sqrt(100.0 - h * h)
            assert stock.area(i) == pytest.approx(math.pi * radius**2, rel=2e-3)
            assert stock.section(i).area == pytest.approx(stock.area(i), rel=1e-12)


def test_refined_layers_are_cut_from_the_mesh_again() -> None:
    body = sphere()
    stock = LayeredStock.of_mesh(body, 4.0, 7.0)
    fine = LayeredStock.of_mesh(body, 1.0, 7.0)
    stock.remove(2, shapely.box(0.0, 0.0, 20.0, 20.0))
    cut = stock.volumes()[2]
    stock.refine(-7.0, 1.0, 1.0)
    assert stock.bounds.tolist() == pytest.approx([*range(-10, 3), 6, 10])
    assert stock.volumes()[:8] == pytest.approx(fine.volumes()[:8], rel=1e-12)
    assert stock.volumes()[8:12] == pytest.approx([cut / 4.0] * 4, rel=1e-12)
    assert stock.cut.tolist() == [False] * 8 + [True] * 4 + [False] * 2
    assert stock.volumes()[13] == LayeredStock.of_mesh(body, 4.0, 7.0).volumes()[4]


def test_parts_of_a_stock_share_the_sections_of_its_mesh(monkeypatch) -> None:
    """Cut out twice and split at the same heights, the mesh is cut once; tiles are those of a stock alone."""
    body, heights = sphere(), [-6.5, -6.0, -5.5, 0.25]
    stock = LayeredStock.of_mesh(body, 4.0, 7.0)
    made = []
    for whole in (LayeredStock.of_mesh(body, 4.0, 7.0), stock, stock, stock.copied()):
        corner = whole.cropped((-8.0, -8.0), (1.0, 2.0))
        corner.refine_at(heights)
        made.append(corner)
        known = dict(whole.sections)
    for corner in made[1:]:
        assert shapely.to_wkb(corner.tiles).tolist() == shapely.to_wkb(made[0].tiles).tolist()
    assert stock.sections.keys() == known.keys()
    assert known.keys() == set(made[0].heights[~np.isin(made[0].heights, stock.heights)])
    # what has more points than are kept is cut again
    monkeypatch.setattr(tile_grid, "KEPT", 10)
    stock.cropped((-8.0, -8.0), (1.0, 2.0)).refine_at([-3.0])
    assert stock.sections == {}


def test_levels_become_bounds() -> None:
    stock = block(9.0)
    stock.remove(1, shapely.box(0.0, 0.0, 10.0, 10.0))
    stock.refine_at([2.5, -1.0, 3.0 + 1e-12, 0.25, 2.5, 9.0])
    assert stock.bounds.tolist() == [0.0, 0.25, 1.0, 2.5, 3.0, 6.0]
    assert stock.volumes() == pytest.approx([400.0, 1200.0, 2250.0, 750.0, 4800.0], rel=1e-12)
    stock.refine_at([])
    stock.refine(0.0, 6.0, 10.0)
    assert stock.layers == 5


def test_restored_is_as_it_was() -> None:
    stock = worn()
    state, before = stock.state(), stock.volumes()
    for _ in range(2):
        stock.remove(0, shapely.box(0.0, 0.0, 20.0, 40.0))
        stock.refine(0.0, 6.0, 0.5)
        assert stock.layers == 12
        stock.restore(state)
        assert stock.volumes().tolist() == before.tolist()


@pytest.mark.parametrize("meshed", [False, True])
def test_saved_and_loaded_it_goes_on_the_same(tmp_path, meshed: bool) -> None:
    rng = np.random.default_rng(2)
    stock = LayeredStock.of_mesh(sphere(), 3.0, 7.0) if meshed else worn()
    for _ in range(5):
        stock.remove(2, ellipse(rng, 10.0))
    stock.save(tmp_path / "a.npz")
    stock.save(tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    again = LayeredStock.load(tmp_path / "a.npz")
    for _ in range(20):
        shape = ellipse(rng, 40.0)
        left, right = stock.remove(1, shape), again.remove(1, shape)
        assert [shapely.to_wkb(p) for p in left] == [shapely.to_wkb(p) for p in right]
    for each in (stock, again):
        each.refine(-20.0, 20.0, 0.7)
    assert stock.bounds.tolist() == again.bounds.tolist()
    assert stock.cut.tolist() == again.cut.tolist()
    assert [shapely.to_wkb(t) for t in stock.tiles.ravel()] == [shapely.to_wkb(t) for t in again.tiles.ravel()]


def test_damaged_and_foreign_files_are_refused(tmp_path) -> None:
    path = tmp_path / "a.npz"
    worn(moves=5).save(path)
    whole = path.read_bytes()
    rng = np.random.default_rng(1)
    damaged = [whole[:n] for n in (0, 10, len(whole) // 2, len(whole) - 1)]
    for at in rng.integers(0, len(whole), 150):
        spoilt = bytearray(whole)
        spoilt[at] ^= 1 << int(rng.integers(8))
        damaged.append(bytes(spoilt))
    refused = 0
    for data in damaged:
        path.write_bytes(data)
        try:
            LayeredStock.load(path)  # a bit of a date or a name that nobody reads may be spoilt
        except InputError as error:
            assert "stock.file = a.npz: " in str(error)  # noqa: PT017
            refused += 1
    assert refused > 100
    np.savez(path, kind=np.zeros(3))
    with pytest.raises(InputError, match="damaged"):
        LayeredStock.load(path)
    np.savez(path, kind=np.array([{}], dtype=object))
    with pytest.raises(InputError, match="damaged"):
        LayeredStock.load(path)
    np.save(tmp_path / "c.npy", np.zeros(3))
    with pytest.raises(InputError, match="damaged"):
        LayeredStock.load(tmp_path / "c.npy")
    with pytest.raises(InputError, match="no such file"):
        LayeredStock.load(tmp_path / "none.npz")


def test_a_mesh_that_is_open_is_refused() -> None:
    body = sphere()
    with pytest.raises(InputError, match="stock: the mesh is not closed: 6 open edges"):
        LayeredStock.of_mesh(trimesh.Trimesh(body.vertices, np.delete(body.faces, [3, 300], axis=0)), 1.0, 5.0)
    with pytest.raises(InputError, match="must hold the mesh, -10 to 10 mm"):
        LayeredStock.of_mesh(body, [-9.0, 10.0], 5.0)
