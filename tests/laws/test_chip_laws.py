"""Laws of chips: nothing is lost, layers converge, three models agree, place, direction and unit do not matter.

Notation: z up, layers of thickness dz; V [mm3] a volume removed. The truth in 3D is Manifold's: convex hulls of the
cutter at neighbouring instants, joined. Polygons of the cutter have the mean radius of their circle, so that their
error in volume is of second order in their sides; a hull of neighbours takes more than the cutter does, of first order
in the time between them where a bottom face turns. Both are taken out by doing it finer (Richardson).
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import manifold3d
import numpy as np
import pytest
import shapely
import trimesh
from numpy.typing import NDArray
from simulation.test_steps import five_axis

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material, material_named
from chipload.engagement.chips.covered import covered_areas
from chipload.engagement.chips.move import Move
from chipload.simulation.chips import Removal, Resolution, remove
from chipload.stock.dexel import TriDexel
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]
FLAT = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
BALL = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0)
BULL = Cutter(12.0, 3, 0.4, 20.0, 30.0, 6e5, corner_radius=2.0)
NO_EDGE = Material("no edge", 800.0, 250.0, 150.0, 0.0, 0.0, 0.0, source="made up")
LOW, HIGH = (0.0, 0.0, -8.0), (30.0, 24.0, 0.0)
FORCES = [f"force_{x}_mean_n" for x in "xyz"]


def walk(seed: int, moves: int = 7) -> tuple[Floats, Floats]:
    """Random tips (moves + 1, 3) [mm] in and above the block, and axes tilted by up to half a radian or so."""
    rng = np.random.default_rng(seed)
    tips = rng.uniform((2.0, 2.0, -5.0), (28.0, 22.0, 1.0), (moves + 1, 3))
    axes = np.column_stack([rng.uniform(-0.4, 0.4, (moves + 1, 2)), np.ones(moves + 1)])
    return tips, axes / np.linalg.norm(axes, axis=1)[:, None]


class Kept(LayeredStock):
    """A stock that writes down what every layer loses, and keeps its edges as they are cut."""

    def remove_many(self, layers: Any, shapes: Any, tidy: float = 0.0) -> list[list[shapely.Polygon]]:
        pieces = super().remove_many(layers, shapes, 0.0)
        self.lost = getattr(self, "lost", np.zeros(self.layers))
        self.asked = getattr(self, "asked", [[] for _ in range(self.layers)])
        for i, shape, some in zip(layers, shapes, pieces, strict=True):
            self.lost[i] += math.fsum(p.area for p in some)
            self.asked[i].append(shape)
        return pieces


@pytest.mark.parametrize(("cutter", "seed"), [(FLAT, 1), (BULL, 2), (BALL, 3)], ids=["flat", "bull", "ball"])
def test_the_sum_of_chips_is_what_the_stock_has_lost(cutter: Cutter, seed: int) -> None:
    """On every layer to 1e-9; and what is left is the block less the union of all that was covered, in one step."""
    resolution = Resolution(3.0, 1e-2, 4, 2.0)
    stock = Kept.block(LOW, HIGH, 0.5, 15.0)
    program = five_axis(*(v.tolist() for v in walk(seed)))
    removal = remove(program, stock, {1: cutter}, NO_EDGE, resolution)
    whole = 30.0 * 24.0
    left = np.array([stock.area(i) for i in range(stock.layers)])
    assert (stock.lost > 10.0).sum() >= 8
    np.testing.assert_allclose(stock.lost, whole - left, rtol=1e-9, atol=1e-9)
    for i, shapes in enumerate(stock.asked):
        at_once = shapely.box(*LOW[:2], *HIGH[:2]).difference(shapely.union_all(shapes)).area
        assert left[i] == pytest.approx(at_once, rel=1e-9)
    assert removal.columns["chip_volume_mm3"].sum() == pytest.approx(0.5 * stock.lost.sum(), rel=1e-9)
    # with edges made simpler on the way, what that takes and gives is in the books too
    tidied = remove(program, LayeredStock.block(LOW, HIGH, 0.5, 15.0), {1: cutter}, NO_EDGE, resolution)
    lost = tidied.volume_before - tidied.volume_after
    assert tidied.columns["chip_volume_mm3"].sum() == pytest.approx(lost, rel=1e-9)
    assert lost == pytest.approx(0.5 * stock.lost.sum(), rel=2e-3)


def solid(cutter: Cutter, tip: Floats, axis: Floats, sides: int, pieces: int) -> manifold3d.Manifold:
    """The cutter as a polyhedron; circles of ``sides``, a quarter of the corner of ``pieces``, of the same area."""
    _, r, e, f, *_, height = cutter.apt
    kappa = np.linspace(0.0, 0.5 * math.pi, pieces + 1)
    arc = r * math.sqrt(kappa[1] / math.sin(kappa[1]))
    corner = np.column_stack([e + arc * np.sin(kappa), f - arc * np.cos(kappa)]) if r > 0.0 else [(e, 0.0)]
    profile = np.vstack([[(0.0, f - arc)] if e > 0.0 or r == 0.0 else np.empty((0, 2)), corner])
    wide = profile[-1, 0]
    profile = np.vstack([profile, [(wide, height), (0.0, height)]])
    turn = 2.0 * math.pi / sides
    profile[:, 0] *= math.sqrt(turn / math.sin(turn))
    body = manifold3d.Manifold.revolve(manifold3d.CrossSection([profile]), sides)
    x = np.cross([0.3, 0.7, -0.2], axis)
    x /= np.linalg.norm(x)
    return body.transform(np.column_stack([x, np.cross(axis, x), axis, tip]))


def swept(cutter: Cutter, move: Move, instants: int, sides: int, pieces: int) -> list[manifold3d.Manifold]:
    """Hulls of the cutter at neighbouring ones of ``instants`` + 1 instants."""
    poses = [solid(cutter, p, a, sides, pieces) for p, a in zip(*move.at(np.linspace(0, 1, instants + 1)), strict=True)]
    return [manifold3d.Manifold.batch_hull(list(pair)) for pair in itertools.pairwise(poses)]


def truth(moves: list[tuple[Cutter, Move]], low: Any, high: Any, instants: int, sides: int) -> float:
    """Volume [mm3] that moves take from a block: without the errors of first and second order in the time between
    instants, and without that of second order in the sides of the cutter.
    """
    block = manifold3d.Manifold.cube(np.subtract(high, low)).translate(low)
    fine = []
    for m in (sides, 2 * sides):
        volumes = []
        for n in (instants, 2 * instants, 4 * instants):
            parts = [block ^ hull for cutter, move in moves for hull in swept(cutter, move, n, m, m // 4)]
            volumes.append(manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add).volume())
        fine.append((8.0 * volumes[2] - 6.0 * volumes[1] + volumes[0]) / 3.0)
    return (4.0 * fine[1] - fine[0]) / 3.0


def dip(t: Floats) -> tuple[Floats, Floats]:
    """Down into the block and out again along a bend, the axis swinging from one side to the other."""
    u = 2.0 * t - 1.0
    tip = np.column_stack([15.0 + 8.0 * u, 12.0 + 3.0 * u**2, -4.0 + 6.5 * u**2])
    return tip, np.column_stack([0.35 * u, 0.2 - 0.2 * u**2, np.ones(len(t))])


def test_layers_give_a_volume_of_second_order() -> None:
    """A smooth cut by a ball nose, its axis turning: the error over dz and over where the layers lie.

    A bottom of the cut that lies anywhere within a layer makes the error jump; its mean square over eight shifts of the
    layers is what falls, with dz to the power of 2.
    """
    move = Move.of(lambda t: (dip(t)[0], dip(t)[1] / np.linalg.norm(dip(t)[1], axis=1)[:, None]))
    exact = truth([(BALL, move)], LOW, HIGH, 6, 48)
    sizes, errors = np.array([2.0, 1.0, 0.5, 0.25]), []
    for dz in sizes:
        off = []
        for shift in (np.arange(8) + 0.5) / 8.0:
            inner = np.arange(LOW[2] + shift * dz, HIGH[2], dz)
            bounds = np.concatenate([[LOW[2]], inner[inner > LOW[2]], [HIGH[2]]])
            areas = covered_areas(move, BALL, 0.5 * (bounds[1:] + bounds[:-1]), 1e-3)
            got = sum(a.area * w for a, w in zip(areas, np.diff(bounds), strict=True) if a is not None)
            off.append(got / exact - 1.0)
        errors.append(math.sqrt(np.mean(np.square(off))))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert ((orders > 1.7) & (orders < 2.3)).all(), (errors, orders)
    assert errors[-1] < 6e-4


def pocket() -> list[tuple[Cutter, Move]]:
    """Thirty-two moves: rows of a flat end mill whose axis leans about, then of a ball nose one across them."""
    out = []
    for cutter, depth, along in ((FLAT, -3.0, 0), (BALL, -5.0, 1)):
        span, rows = ((8.0, 32.0), np.linspace(8.0, 22.0, 4)) if along == 0 else ((7.0, 23.0), np.linspace(9, 31, 4))
        for k, row in enumerate(rows):
            stops = np.linspace(*span, 5)[:: -1 if k % 2 else 1]
            for a, b in itertools.pairwise(stops):
                ends = []
                for s in (a, b):
                    tip = np.array([s, row, 0.0] if along == 0 else [row, s, 0.0])
                    tip[2] = depth + 0.6 * math.sin(0.4 * tip[0]) * math.cos(0.3 * tip[1])
                    axis = np.array([0.25 * math.sin(0.2 * s + row), 0.25 * math.cos(0.15 * s - row), 1.0])
                    ends += [tip, axis]
                out.append((cutter, Move.slerp(*ends)))
    return out


def test_three_models_of_a_five_axis_pocket_agree() -> None:
    """Layers of 0.125 mm and tri-dexels 0.2 mm apart to 2e-4 of the volume removed, Manifold's hulls to 5e-4."""
    low, high = (0.0, 0.0, -8.0), (40.0, 30.0, 0.0)
    moves = pocket()
    exact = truth(moves, low, high, 1, 20)
    stock = LayeredStock.block(low, high, 0.125, 20.0)
    dexels = TriDexel.block(low, high, 0.2)
    for cutter, move in moves:
        shapes = covered_areas(move, cutter, stock.heights, 2e-4)
        met = [i for i, c in enumerate(shapes) if c is not None]
        stock.remove_many(met, [c.polygon for c in shapes if c is not None])
        (p, q), (a, b) = move.at([0.0, 1.0])
        dexels.remove_move(p, a, q, b, cutter.apt, error_mm=1e-3)
    whole = 40.0 * 30.0 * 8.0
    assert len(moves) == 32
    assert whole - stock.volume() == pytest.approx(exact, rel=5e-4)
    assert whole - dexels.volume() == pytest.approx(exact, rel=5e-4)
    assert whole - dexels.volume() == pytest.approx(whole - stock.volume(), rel=2e-4)


def run(tips: Floats, axes: Floats, cutter: Cutter, stock: LayeredStock, k: float = 1.0) -> Removal:
    """A program with all lengths k times as long."""
    material = replace(material_named("al7075-t6"), source="scaled")
    material = replace(material, Kte=k * material.Kte, Kre=k * material.Kre, Kae=k * material.Kae)
    program = five_axis((k * tips).tolist(), axes.tolist(), feed=20.0 * k)
    return remove(program, stock, {1: cutter}, material, Resolution(3.0 * k, 2e-3 * k, 8, 1.0 * k))


@pytest.mark.parametrize(("cutter", "seed"), [(FLAT, 11), (BALL, 12)], ids=["flat", "ball"])
def test_a_rigid_motion_leaves_volumes_and_turns_forces(cutter: Cutter, seed: int) -> None:
    """The job moved and turned about z by an angle of no meaning: only the tiles lie otherwise."""
    tips, axes = walk(seed, 5)
    mesh = trimesh.creation.box(bounds=[LOW, HIGH])
    angle, shift = 0.7, np.array([310.0, -45.0, 12.5])
    turn = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    one = run(tips, axes, cutter, LayeredStock.of_mesh(mesh, 0.5, 15.0))
    mesh.vertices = mesh.vertices @ turn.T + shift
    two = run(tips @ turn.T + shift, axes @ turn.T, cutter, LayeredStock.of_mesh(mesh, 0.5, 15.0))
    a, b = one.columns, two.columns
    force, turned = (np.column_stack([c[name] for name in FORCES]) for c in (a, b))
    np.testing.assert_allclose(b["chip_volume_mm3"], a["chip_volume_mm3"], atol=1e-4 * a["chip_volume_mm3"].max())
    assert b["chip_volume_mm3"].sum() == pytest.approx(a["chip_volume_mm3"].sum(), rel=1e-5)
    np.testing.assert_allclose(turned, force @ turn.T, atol=1e-3 * np.abs(force).max())
    np.testing.assert_allclose(b["torque_mean_nm"], a["torque_mean_nm"], atol=1e-3 * a["torque_mean_nm"].max())


def scaled(cutter: Cutter, k: float) -> Cutter:
    return replace(
        cutter,
        diameter=k * cutter.diameter,
        flute_length=k * cutter.flute_length,
        overhang=k * cutter.overhang,
        corner_radius=k * cutter.corner_radius,
    )


@pytest.mark.parametrize("k", [0.1, 25.4])
@pytest.mark.parametrize(("cutter", "seed"), [(FLAT, 21), (BULL, 22)], ids=["flat", "bull"])
def test_the_unit_of_length_does_not_matter(cutter: Cutter, seed: int, k: float) -> None:
    """Areas grow by k^2, volumes by k^3, forces by k^2 where the edge terms grow by k; torques by k^3."""
    tips, axes = walk(seed, 5)
    move, larger = (Move.slerp(s * tips[0], axes[0], s * tips[1], axes[1]) for s in (1.0, k))
    heights = tips[0, 2] + np.array([0.2, 1.7, 4.0])
    for a, b in zip(
        covered_areas(move, cutter, heights, 1e-3),
        covered_areas(larger, scaled(cutter, k), k * heights, 1e-3 * k),
        strict=True,
    ):
        assert b.area == pytest.approx(k**2 * a.area, rel=1e-9)
    stocks = [LayeredStock.block(np.multiply(LOW, s), np.multiply(HIGH, s), 0.5 * s, 15.0 * s) for s in (1.0, k)]
    one = run(tips, axes, cutter, stocks[0]).columns
    two = run(tips, axes, scaled(cutter, k), stocks[1], k).columns
    for name, power in (("chip_volume_mm3", 3), *((f, 2) for f in FORCES), ("torque_mean_nm", 3), ("chip_max_mm", 1)):
        size = np.abs(one[name]).max()
        np.testing.assert_allclose(two[name] / k**power, one[name], rtol=1e-6, atol=1e-6 * size, err_msg=name)
