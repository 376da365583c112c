"""Dexels against solids in closed form, brute force along single rays, and the booleans of Manifold."""

from __future__ import annotations

import itertools
import math

import manifold3d
import numpy as np
import pytest
import trimesh

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.stock import _dexels
from chipload.stock.dexel import TriDexel, _rays_of_mesh, cutter_shape

FLAT = Cutter(10.0, 4, 0.5, 30.0, 40.0, 6e5)
BALL = Cutter(10.0, 2, 0.5, 30.0, 40.0, 6e5, corner_radius=5.0)
BULL = Cutter(10.0, 2, 0.5, 30.0, 40.0, 6e5, corner_radius=1.5)
TAPER = Cutter(8.0, 2, 0.5, 25.0, 40.0, 6e5, corner_radius=1.0, taper=math.radians(8.0))
DRILL = Cutter(9.0, 2, 0.5, 25.0, 40.0, 6e5, corner_radius=0.8, bottom=math.radians(31.0))
POINT = Cutter(9.0, 2, 0.5, 25.0, 40.0, 6e5, bottom=math.radians(31.0), taper=math.radians(4.0))
SHAPES = {"flat": FLAT, "ball": BALL, "bull": BULL, "taper": TAPER, "drill": DRILL, "point": POINT}
UP = (0.0, 0.0, 1.0)


def axes(rng: np.random.Generator, n: int) -> np.ndarray:
    a = rng.normal(size=(n, 3))
    a[: n // 6, rng.integers(3)] = 0.0
    a[n // 6 : n // 4] = np.eye(3)[rng.integers(0, 3, n // 4 - n // 6)]
    return a / np.linalg.norm(a, axis=1)[:, None]


def inside(s: np.ndarray, ray: np.ndarray, k: int, tip: np.ndarray, axis: np.ndarray, cutter: Cutter) -> np.ndarray:
    """Whether the points s of a ray along axis k are in the cutter, by its profile."""
    p = np.tile(ray, (len(s), 1))
    p[:, k] = s
    w = p - tip
    z = w @ axis
    rho = np.linalg.norm(w - z[:, None] * axis, axis=1)
    return (z >= 0.0) & (z <= cutter.flute_length) & (rho <= cutter.radius_at(np.maximum(z, 0.0)))


@pytest.mark.parametrize("name", SHAPES)
def test_a_ray_is_in_the_cutter_where_its_profile_says(name: str) -> None:
    cutter = SHAPES[name]
    shape = cutter_shape(cutter.apt)
    rng = np.random.default_rng(4)
    met = 0
    for a in axes(rng, 400):
        k = int(rng.integers(3))
        tip = rng.uniform(-20.0, 20.0, 3)
        inner = tip + rng.uniform(-0.2, 1.1) * cutter.flute_length * a + rng.uniform(-4.0, 4.0, 3)
        lo, hi = _dexels.pierce(k, inner[(k + 1) % 3], inner[(k + 2) % 3], tip, a, shape)

        s = np.linspace(inner[k] - 60.0, inner[k] + 60.0, 6001)
        there = s[inside(s, inner, k, tip, a, cutter)]
        if lo > hi:
            assert len(there) <= 2  # a ray that only touches
            continue
        met += 1
        d = 1e-6 if hi - lo > 0.05 else 1e-2
        if hi - lo > 4.0 * d:
            at = np.array([lo - d, lo + d, 0.5 * (lo + hi), hi - d, hi + d])
            assert inside(at, inner, k, tip, a, cutter).tolist() == [0, 1, 1, 1, 0]
        assert len(there) == pytest.approx((hi - lo) / 0.02, abs=1.01)
    assert met > 150


def test_a_slot_of_a_flat_mill() -> None:
    stock = TriDexel.block((0.0, 0.0, 0.0), (40.0, 20.0, 10.0), 0.2)
    taken = stock.remove_move((10.0, 10.0, 6.0), UP, (30.0, 10.0, 6.0), UP, FLAT.apt, error_mm=1e-5)
    slot = 4.0 * (math.pi * 25.0 + 20.0 * 10.0)
    assert taken == pytest.approx(8000.0 - stock.volume(), rel=1e-9)
    for volume in stock.volume_by_direction().values():
        assert volume == pytest.approx(8000.0 - slot, rel=4e-4)
    assert stock.remove_move((10.0, 10.0, 6.0), UP, (30.0, 10.0, 6.0), UP, FLAT.apt, error_mm=1e-5) == 0.0


def test_a_ball_plunges() -> None:
    removed = []
    for pitch in (0.4, 0.2, 0.1):
        stock = TriDexel.block((0.0, 0.0, 0.0), (16.0, 16.0, 12.0), pitch)
        stock.remove_move((8.0, 8.0, 15.0), UP, (8.0, 8.0, 4.0), UP, BALL.apt, samples=40)
        removed.append(16.0 * 16.0 * 12.0 - stock.volume())
    exact = math.pi * 125.0 * 2.0 / 3.0 + math.pi * 25.0 * 3.0
    for volume, rel in zip(removed, (8e-3, 4e-3, 5e-4), strict=True):
        assert volume == pytest.approx(exact, rel=rel)


@pytest.mark.parametrize("tilt", [0.1, 0.5, 0.9])
def test_a_tilted_cylinder_through_a_plate(tilt: float) -> None:
    stock = TriDexel.block((0.0, 0.0, 0.0), (40.0, 30.0, 4.0), 0.1)
    a = np.array([math.sin(tilt), 0.0, math.cos(tilt)])
    tip = np.array([20.0, 15.0, 2.0]) - 14.0 * a
    long = (*FLAT.apt[:6], 28.0)
    stock.remove_move(tip - 30.0 * a, a, tip, a, long, samples=30)
    exact = 40.0 * 30.0 * 4.0 - math.pi * 25.0 * 4.0 / math.cos(tilt)
    for volume in stock.volume_by_direction().values():
        assert volume == pytest.approx(exact, rel=3e-4)


def solid(cutter: Cutter, tip: np.ndarray, axis: np.ndarray, chord: float = 1e-3) -> manifold3d.Manifold:
    """The cutter by Manifold, a polygon of the same area about its axis."""
    n = 120
    swell = math.sqrt(2.0 * math.pi / n / math.sin(2.0 * math.pi / n))
    rho, z = cutter.profile(chord).T
    ring = np.column_stack([rho * swell, z])
    body = manifold3d.Manifold.revolve(manifold3d.CrossSection([np.vstack([ring, [(0.0, z[-1])]])]), n)
    x = np.cross([0.3, 0.7, -0.2], axis)
    x /= np.linalg.norm(x)
    return body.transform(np.column_stack([x, np.cross(axis, x), axis, tip]))


@pytest.mark.parametrize("name", SHAPES)
def test_a_straight_move_is_the_hull_of_its_ends(name: str) -> None:
    cutter = SHAPES[name]
    rng = np.random.default_rng(len(name))
    block = manifold3d.Manifold.cube([30.0, 30.0, 12.0])
    for _ in range(2):
        tilt = rng.normal(0.0, 0.3, 2)
        a = np.array([*tilt, 1.0]) / math.hypot(*tilt, 1.0)
        p, q = rng.uniform((4.0, 4.0, 2.0), (26.0, 26.0, 10.0), (2, 3))
        swept = manifold3d.Manifold.batch_hull([solid(cutter, p, a), solid(cutter, q, a)])
        stock = TriDexel.block((0.0, 0.0, 0.0), (30.0, 30.0, 12.0), 0.2)
        stock.remove_move(p, a, q, a, cutter.apt, error_mm=1e-4)
        removed = {d: 10800.0 - v for d, v in stock.volume_by_direction().items()}
        exact = (block ^ swept).volume()
        assert removed == pytest.approx(dict.fromkeys("xyz", exact), rel=6e-3)
        assert 10800.0 - stock.volume() == pytest.approx(exact, rel=2e-3)


@pytest.mark.parametrize("name", ["flat", "bull", "ball"])
def test_a_move_of_five_axes_is_the_union_of_many_cutters(name: str) -> None:
    cutter = SHAPES[name]
    p, q = np.array([10.0, 12.0, 4.0]), np.array([18.0, 16.0, 3.0])
    a, b = np.array([0.35, 0.1, 1.0]), np.array([-0.1, 0.3, 1.0])
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    angle = math.acos(a @ b)
    stock = TriDexel.block((0.0, 0.0, 0.0), (30.0, 30.0, 12.0), 0.2)
    stock.remove_move(p, a, q, b, cutter.apt, error_mm=1e-4)
    block = manifold3d.Manifold.cube([30.0, 30.0, 12.0])
    under, over = [], []
    for n in (8, 16):
        poses = []
        for t in np.linspace(0.0, 1.0, n + 1):
            axis = (math.sin(angle * (1.0 - t)) * a + math.sin(angle * t) * b) / math.sin(angle)
            poses.append(solid(cutter, p + t * (q - p), axis, 5e-3))
        hulls = [manifold3d.Manifold.batch_hull(list(pair)) for pair in itertools.pairwise(poses)]
        under.append(manifold3d.Manifold.batch_boolean([block ^ m for m in poses], manifold3d.OpType.Add).volume())
        over.append(manifold3d.Manifold.batch_boolean([block ^ m for m in hulls], manifold3d.OpType.Add).volume())
    # the cutters leave scallops, the hulls of neighbours take more than a turn does: both errors fall with the step
    assert under[1] < 10800.0 - stock.volume() < over[1]
    for coarse, fine in (under, over):
        exact = 2.0 * fine - coarse
        for volume in stock.volume_by_direction().values():
            assert 10800.0 - volume == pytest.approx(exact, rel=2.5e-3)


def test_few_instants_already_hold_the_floor_of_a_tilted_mill() -> None:
    """What the bottom edge leaves as a floor has its lowest moment between the instants."""
    a = np.array([math.sin(0.3), 0.0, math.cos(0.3)])
    p, q = np.array([8.0, 10.0, 3.0]), np.array([22.0, 10.0, 3.0])
    exact = manifold3d.Manifold.batch_hull([solid(FLAT, p, a), solid(FLAT, q, a)])
    removed = (manifold3d.Manifold.cube([30.0, 20.0, 8.0]) ^ exact).volume()
    stock = TriDexel.block((0.0, 0.0, 0.0), (30.0, 20.0, 8.0), 0.1, "z")
    stock.remove_move(p, a, q, a, FLAT.apt, samples=15)
    assert 4800.0 - stock.volume() == pytest.approx(removed, rel=1.5e-3)


@pytest.mark.parametrize(
    ("name", "direction"),
    [("flat", "z"), ("flat", "x"), ("ball", "y"), ("bull", "z"), ("bull", "y"), ("taper", "x"), ("drill", "z")],
)
def test_few_instants_take_what_many_moments_cover(name: str, direction: str) -> None:
    """Each ray loses what it has in common with 2000 cutters, though only five are asked for at first."""
    cutter, k = SHAPES[name], "xyz".index(direction)
    t = np.linspace(0.0, 1.0, 5)[:, None]
    tips = np.array([8.0, 11.0, 4.0]) * (1.0 - t) + np.array([21.0, 17.0, 3.0]) * t
    turns = np.column_stack([0.3 - 0.2 * t, 0.1 + 0.3 * t, np.ones(5)])
    turns /= np.linalg.norm(turns, axis=1)[:, None]
    stock = TriDexel.block((0.0, 0.0, 0.0), (30.0, 30.0, 30.0), 1.3, direction)
    stock.remove_poses(tips, turns, cutter.apt, tol=1e-7)
    shape = cutter_shape(cutter.apt)
    moments = []
    for m in np.linspace(0.0, 4.0, 2001):
        i = min(int(m), 3)
        axis = turns[i] + (m - i) * (turns[i + 1] - turns[i])
        moments.append((tips[i] + (m - i) * (tips[i + 1] - tips[i]), axis / np.linalg.norm(axis)))
    (rays,) = stock.rays
    more = []
    for n, (u, v) in enumerate(zip(*rays.places(), strict=True)):
        spans = np.array([_dexels.pierce(k, u, v, tip, axis, shape) for tip, axis in moments[::40]])
        met = spans[:, 0] <= spans[:, 1]
        if met.sum() < 14 or np.count_nonzero(np.diff(met)) > 2:
            continue  # less than a fourth of the move, or two passages: five instants may miss one
        spans = np.array([_dexels.pierce(k, u, v, tip, axis, shape) for tip, axis in moments])
        spans = np.clip(spans[spans[:, 0] <= spans[:, 1]], 0.0, 30.0)
        lo, hi = spans[:, 0].min(), spans[:, 1].max()
        left = rays.ends[n, : rays.count[n]]
        taken = (
            left[0, 1] if len(left) and left[0, 0] == 0.0 else 0.0,
            left[-1, 0] if len(left) and left[-1, 1] == 30.0 else 30.0,
        )
        assert taken[0] <= lo + 2e-4
        assert taken[1] >= hi - 2e-4
        more += [lo - taken[0], taken[1] - hi]
    assert len(more) > 60
    assert np.quantile(more, 0.9) < 0.003


def test_a_quarter_turn_permutes_the_directions() -> None:
    rng = np.random.default_rng(9)
    one = TriDexel.block((0.0, 0.0, 0.0), (20.0, 16.0, 10.0), 0.5)
    two = TriDexel.block((-16.0, 0.0, 0.0), (0.0, 20.0, 10.0), 0.5)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for _ in range(6):
        p, q = rng.uniform((2.0, 2.0, 3.0), (18.0, 14.0, 9.0), (2, 3))
        a, b = (v / np.linalg.norm(v) for v in rng.normal((0.0, 0.0, 2.0), 0.4, (2, 3)))
        one.remove_move(p, a, q, b, BULL.apt, samples=12)
        two.remove_move(turn @ p, turn @ a, turn @ q, turn @ b, BULL.apt, samples=12)
    x, y, z = one.volume_by_direction().values()
    assert [y, x, z] == pytest.approx(list(two.volume_by_direction().values()), rel=1e-9)
    assert x < 2500.0


def test_many_intervals_on_a_ray() -> None:
    stock = TriDexel.block((0.0, 0.0, 0.0), (60.0, 4.0, 4.0), 0.5)
    thin = (1.0, 0.0, 0.5, 0.0, 0.0, 0.0, 20.0)
    order = np.random.default_rng(0).permutation(29)
    for i in order:
        x = 2.0 + 2.0 * i
        stock.remove_move((x, -2.0, 2.0), UP, (x, 6.0, 2.0), UP, thin, samples=40)
    rays = stock.rays[0]
    assert rays.count.max() == 30
    assert rays.volume() == pytest.approx(960.0 - 29.0 * 8.0, rel=1e-6)
    whole = rays.ends[rays.count == 30][0, :30]
    assert whole[1:, 0] == pytest.approx(2.5 + 2.0 * np.arange(29), abs=1e-6)
    stock.remove_move((-5.0, 2.0, -1.0), UP, (65.0, 2.0, -1.0), UP, FLAT.apt, samples=80)
    assert stock.volume_by_direction() == {"x": 0.0, "y": 0.0, "z": 0.0}


def test_one_direction_is_the_same_as_of_three() -> None:
    three, one = (TriDexel.block((0.0, 0.0, 0.0), (20.0, 20.0, 8.0), 0.25, d) for d in ("xyz", "z"))
    for stock in (three, one):
        stock.remove_move((5.0, 5.0, 3.0), UP, (14.0, 9.0, 2.0), UP, BULL.apt, samples=9)
        stock.remove_poses(
            [(5.0, 15.0, 3.0), (10.0, 12.0, 2.0), (15.0, 15.0, 3.0)], [UP, UP, (0.1, 0.0, 1.0)], BALL.apt
        )
    assert list(one.volume_by_direction()) == ["z"]
    assert one.volume() == three.volume_by_direction()["z"]


def test_meshes() -> None:
    ball = trimesh.creation.icosphere(5, 10.0)
    stock = TriDexel.of_mesh(ball, 0.2)
    assert stock.volume() == pytest.approx(ball.volume, rel=2e-4)
    outer, hollow = trimesh.creation.box((10.0, 12.0, 14.0)), trimesh.creation.box((4.0, 5.0, 6.0))
    hollow.invert()
    side = trimesh.creation.box((6.0, 2.0, 2.0))
    side.apply_translation((6.0, 0.0, 0.0))
    stock = TriDexel.of_mesh(trimesh.util.concatenate([side, outer, hollow]), 0.25)
    exact = 10.0 * 12.0 * 14.0 - 4.0 * 5.0 * 6.0 + 4.0 * 2.0 * 2.0
    for volume in stock.volume_by_direction().values():
        assert volume == pytest.approx(exact, rel=5e-3)
    torus = trimesh.creation.torus(10.0, 3.0, 200, 100)
    errors = [TriDexel.of_mesh(torus, pitch).volume() / torus.volume - 1.0 for pitch in (0.4, 0.2, 0.1)]
    assert errors[0] > 2.0 * errors[1] > 4.0 * errors[2] > 0.0  # rays that graze: with the pitch to the power of 1.5
    assert errors[2] < 6e-4


def test_rays_along_edges_find_their_way() -> None:
    """Rays of a pitch that meets vertices and edges of a body of many faces."""
    body = trimesh.creation.box((8.0, 8.0, 8.0)).subdivide().subdivide().subdivide()
    for pitch in (1.0, 0.5, 2.0):
        assert TriDexel.of_mesh(body, pitch).volume() == pytest.approx(512.0, rel=1e-6)
    eight = trimesh.creation.icosphere(1, 5.0)
    assert TriDexel.of_mesh(eight, 10.0 / 51).volume() == pytest.approx(eight.volume, rel=2e-3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: TriDexel.block((0, 0, 0), (1, 1, -1), 0.1), "each side must be above 0"),
        (lambda s: TriDexel.block((0, 0, 0), (1, 1, 1), 0.0), "stock.pitch = 0 mm: must be above 0"),
        (lambda s: TriDexel.block((0, 0, 0), (1, 1, 1), 1e-5), "1e\\+10 rays: at most 5e\\+07"),
        (lambda s: TriDexel.block((0, 0, 0), (1, 1, 1), 0.1, "zz"), "must be of x, y and z"),
        (lambda s: s.remove_move((0, 0, 0), UP, (1, 0, 0), UP, FLAT.apt), "state either samples or error_mm"),
        (lambda s: s.remove_move((0, 0, 0), UP, (1, 0, 0), UP, FLAT.apt, samples=1), "must be at least 2"),
        (lambda s: s.remove_move((0, 0, 0), UP, (1, 0, 0), UP, FLAT.apt, error_mm=0.0), "error_mm = 0: must be above"),
        (lambda s: s.remove_move((0, 0, 0), UP, (1, 0, 0), (0, 0, -1), FLAT.apt, samples=5), "are opposite"),
        (lambda s: s.remove_move((0, 0, 0), (0, 0, 0), (1, 0, 0), UP, FLAT.apt, samples=5), "not all 0"),
        (lambda s: s.remove_move((0, 0, 0), UP, (1, 0, 0), UP, (0, 0, 0, 0, 0, 0, 1), samples=5), "seven APT numbers"),
        (lambda s: s.remove_poses([(0, 0, 0)], [UP], FLAT.apt), "n at least 2"),
        (lambda s: s.remove_move((0, 0, math.nan), UP, (1, 0, 0), UP, FLAT.apt, samples=5), "finite"),
    ],
)
def test_refused(call, message: str) -> None:
    with pytest.raises(InputError, match=message):
        call(TriDexel.block((0.0, 0.0, 0.0), (2.0, 2.0, 2.0), 1.0))


def test_an_open_mesh_is_refused() -> None:
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    with pytest.raises(InputError, match="not closed: 3 open edges"):
        TriDexel.of_mesh(trimesh.Trimesh(box.vertices, box.faces[1:]), 0.1)


@pytest.mark.parametrize("bend", [0.0, 0.03], ids=["even", "arc"])
def test_a_path_takes_what_its_parts_take(bend):
    """Poses in one call, and two at a time, along the surface of an earlier pass: what an even path may skip is air."""
    rng = np.random.default_rng(5)
    box = trimesh.creation.box(bounds=[[0, 0, 0], [20, 20, 10]])
    for case in range(24):
        n, radius, turn = int(rng.integers(3, 12)), rng.uniform(2.0, 6.0), 0.02 * (case % 3)
        corner = (0.0, 0.3 * radius, radius)[case % 3]
        apt = (2.0 * radius, corner, radius - corner, corner, 0.0, 0.0, 15.0)
        angle = rng.uniform(0.0, math.tau) + bend * np.arange(n)
        steps = 0.3 * radius * np.column_stack([np.cos(angle), np.sin(angle), np.full(n, rng.normal(0.0, 0.2))])
        tips = np.array([10.0, 10.0, rng.uniform(2.0, 9.0)]) + np.cumsum(steps, axis=0) - 0.5 * steps.sum(axis=0)
        axes = np.array([0.0, 0.0, 1.0]) + turn * rng.normal(size=3) * np.arange(n)[:, None]
        left = []
        for parts in ([slice(0, n)], [slice(k, k + 2) for k in range(n - 1)]):
            stock = TriDexel.of_mesh(box, 0.8)
            stock.remove_poses(tips + np.array([1.0, 0.5, 0.3]), axes, apt, tol=0.01)
            for part in parts:
                stock.remove_poses(tips[part], axes[part], apt, tol=0.001)
            within = [np.arange(r.ends.shape[1]) < r.count[:, None] for r in stock.rays]
            lengths = [np.diff(r.ends)[..., 0] for r in stock.rays]
            left.append([np.where(w, s, 0.0).sum(axis=1) for w, s in zip(within, lengths, strict=True)])
        for whole, two in zip(*left, strict=True):
            assert np.abs(whole - two).max() < 0.02


class Grazing:
    """A caster whose rays enter a face along its edge at first, and then meet nothing beside it."""

    tries = 0

    def intersects_location(self, origins: np.ndarray, ahead: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        self.tries += 1
        hits = 1 if self.tries == 1 else 0
        return np.zeros((hits, 3)), np.zeros(hits, dtype=np.int64), np.zeros(hits, dtype=np.int64)


def test_a_ray_along_an_edge_beside_which_there_is_nothing() -> None:
    """It is empty: a bracket of NIST has such an edge, at the border of its projection."""
    body, caster = trimesh.creation.box((1.0, 1.0, 1.0)), Grazing()
    rays = _rays_of_mesh(body, caster, 2, np.array([9.0, 0.0, 1.0, 1.0, 1.0, 1.0]))
    assert caster.tries == 2
    assert rays.count.tolist() == [0]
