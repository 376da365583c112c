"""Laws of chips: nothing is lost, layers converge, three models agree, forces are those of closed forms and of arcs.

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
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import slices
from chipload.cutting.force import forces_over_turn
from chipload.cutting.material import Material, material_named
from chipload.engagement.chips.covered import covered_areas
from chipload.engagement.chips.move import Move
from chipload.engagement.tooth_engagement import ToothEngagement, tool_frame
from chipload.geometry.contour import Contour
from chipload.machine.machine import machine_named
from chipload.planning.contour.plan import Finishing, plan_contour
from chipload.simulation.removal import Resolution
from chipload.stock.dexel import TriDexel
from chipload.stock.layers import LayeredStock
from engagement.tooth_paths import Cut
from engagement.tooth_paths import loads as tooth_loads
from layer_oracle.immersion import edges_under, engagement_rows
from layer_oracle.removal import remove_by_layers
from simulation.test_steps import five_axis

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


@pytest.mark.parametrize(("cutter", "seed"), [(FLAT, 1), (BULL, 2), (BALL, 3)], ids=["flat", "bull", "ball"])
def test_the_sum_of_chips_is_what_the_stock_has_lost(cutter: Cutter, seed: int) -> None:
    """On every layer to 1e-9; and what is left is the block less the union of all that was covered, in one step."""
    resolution = Resolution(3.0, 1e-2, 4, 2.0)
    stock = LayeredStock.block(LOW, HIGH, 0.5, 15.0)
    program = five_axis(*(v.tolist() for v in walk(seed)))
    taken, asked = np.zeros(stock.layers), [list[shapely.Geometry]() for _ in range(stock.layers)]

    def took(step: int, layer: int, area: shapely.Geometry, pieces: list[shapely.Polygon]) -> None:
        taken[layer] += sum(p.area for p in pieces)
        asked[layer].append(area)

    removal = remove_by_layers(program, stock, {1: cutter}, NO_EDGE, resolution, took=took)
    left = np.array([stock.area(i) for i in range(stock.layers)])
    assert (taken > 10.0).sum() >= 8
    np.testing.assert_allclose(taken, 30.0 * 24.0 - left, rtol=1e-9, atol=1e-9)
    for i, shapes in enumerate(asked):
        at_once = shapely.box(*LOW[:2], *HIGH[:2]).difference(shapely.union_all(shapes)).area
        assert left[i] == pytest.approx(at_once, rel=1e-9)
    assert removal.columns["chip_volume_mm3"].sum() == pytest.approx(0.5 * taken.sum(), rel=1e-9)


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


def slot_forces(cutter: Cutter, axis: Floats, feed: float, top: float, material: Material) -> Floats:
    """Mean force (3,) [N] and torque [N m] of a slot along x by a double sum over slices of the edge and angles.

    The front half of the cutter, where the feed has a part outward, is in solid below ``top`` [mm] above the tip.
    """
    pieces, angles = 2000, 360
    _, r, *_, height = cutter.apt
    kappa = (np.arange(pieces) + 0.5) * 0.5 * math.pi / pieces
    z = (np.arange(pieces) + 0.5) / pieces
    ball = [r * np.sin(kappa), r - r * np.cos(kappa), kappa, np.full(pieces, 0.5 * math.pi * r / pieces)]
    flank = [np.full(pieces, cutter.radius), r + z * (height - r), np.full(pieces, 0.5 * math.pi)]
    flank.append(np.full(pieces, (height - r) / pieces))
    V = np.array([feed, 0.0, 0.0])
    T = V - (V @ axis) * axis
    T /= np.linalg.norm(T)
    n = np.cross(axis, T)
    phi = ((np.arange(angles) + 0.5) * math.tau / angles)[:, None]
    u, t = np.cos(phi) * n + np.sin(phi) * T, np.cos(phi) * T - np.sin(phi) * n
    out = np.zeros(4)
    for rho, z, k, ds in zip(*np.hstack([ball, flank] if r > 0.0 else [flank]), strict=True):
        nu, e = math.sin(k) * u - math.cos(k) * axis, math.cos(k) * u + math.sin(k) * axis
        h = nu @ V
        cuts = (h > 0.0) & ((z * axis + rho * u)[:, 2] < top)
        ft, fr, fa = (
            ((K * h + E) * cuts)[:, None] * cutter.flutes * ds / angles
            for K, E in ((material.Ktc, material.Kte), (material.Krc, material.Kre), (material.Kac, material.Kae))
        )
        out -= np.append((ft * t + fr * nu + fa * e).sum(axis=0), -rho * ft.sum() / 1000.0)
    return out


def edge_with_feed(feed: float) -> Material:
    """An aluminium whose edge takes the share of the force at ``feed`` that it takes at 20 mm/s."""
    al, k = material_named("al7075-t6"), feed / 20.0
    return replace(al, Kte=k * al.Kte, Kre=k * al.Kre, Kae=k * al.Kae, source="edge scaled")


def slot(
    cutter: Cutter, axis: Floats, depth: float, layer: float, resolution: Resolution, feed: float
) -> tuple[Floats, float]:
    """Mean force and torque in the middle of a slot in layers, and the height of the stock above the tip [mm]."""
    arm = cutter.corner_radius
    tip = np.array([0.0, 0.0, arm - depth]) - arm * axis
    stock = LayeredStock.block((-15.0, -12.0, -5.0), (15.0, 12.0, 0.0), layer, 30.0)
    program = five_axis([[tip[0] + x, tip[1], tip[2]] for x in (-10.0, 0.0, 0.5)], [axis.tolist()] * 3, feed=feed)
    c = remove_by_layers(program, stock, {1: cutter}, edge_with_feed(feed), resolution).columns
    return np.array([c[name][-1] for name in (*FORCES, "torque_mean_nm")]), -float(tip[2])


@pytest.mark.parametrize("lean", [(0.0, 0.0), (0.2, 0.3)], ids=["upright", "leaning"])
def test_a_slot_of_a_ball_nose_costs_what_the_double_sum_says(lean: tuple[float, float]) -> None:
    """To 5e-4 of the force, with layers of 0.5 mm as with 0.1 mm: contact is judged where the
    cutter's surface meets the sections, so that the thickness of the layers does not enter where they end at the top.
    The sum takes circles: at f / R = 1.3e-4 they are the paths of the teeth, but near the tip.
    """
    axis, feed = np.array([*lean, 1.0]) / math.hypot(*lean, 1.0), 0.02
    for layer in (0.5, 0.1):
        loads, top = slot(BALL, axis, 3.0, layer, Resolution(10.0, 1e-4, 120, 0.1), feed)
        exact = slot_forces(BALL, axis, math.tau * feed / (2 * 100.0), top, edge_with_feed(feed))
        size = np.array([*[np.linalg.norm(exact[:3])] * 3, exact[3]])
        assert np.abs((loads - exact) / size).max() < 5e-4, layer


@pytest.mark.parametrize("feed", [2.0, 5.0])
def test_a_slot_of_a_ball_nose_costs_what_true_paths_say(feed: float) -> None:
    """Upright, against the trochoids of all earlier teeth: the torque to 2e-4, where that of circles is off by 7e-3 and
    more; the force, which has parts near the tip, to 4e-3, within the 1 % that is stated of surfaces that lean.
    """
    up = np.array([0.0, 0.0, 1.0])
    loads, top = slot(BALL, up, 3.0, 0.5, Resolution(10.0, 1e-4, 120, 0.1), feed)
    al, f_z = edge_with_feed(feed), math.tau * feed / (2 * 100.0)
    m, cut = 360, Cut(10.0, 2, 0.0, top, 5.0, f_z, ball=True)
    force, torque, thick = np.zeros((m, 3)), np.zeros(m), np.zeros(m)
    K = np.array([al.Ktc, al.Krc, al.Kac, al.Kte, al.Kre, al.Kae])
    turns = math.tau * (np.arange(m) + 0.5) / m
    tooth_loads(cut.slices(1000), cut.pitches, 2 * f_z / math.tau, 0.0, 0.0, -1e3, 1e3, K, turns, force, torque, thick)
    exact = np.append(force.mean(axis=0), 1e-3 * torque.mean())
    circles = slot_forces(BALL, up, f_z, top, al)
    size = np.array([*[np.linalg.norm(exact[:3])] * 3, exact[3]])
    assert (np.abs((loads - exact) / size) < [4e-3, 4e-3, 4e-3, 2e-4]).all()
    assert abs(circles[3] / exact[3] - 1.0) > 7e-3


@pytest.mark.parametrize("lean", [(0.3, 0.0), (0.2, 0.2), (0.0, 0.3)])
def test_a_slot_of_a_leaning_flat_end_mill_costs_what_the_double_sum_says(lean: tuple[float, float]) -> None:
    """To 1e-3 of the force: a flank ends where the layers end. The feed is one at which teeth run on circles."""
    axis, feed = np.array([*lean, 1.0]) / math.hypot(*lean, 1.0), 0.02
    loads, top = slot(FLAT, axis, 3.0, 0.05, Resolution(10.0, 1e-4, 1, 0.1), feed)
    exact = slot_forces(FLAT, axis, math.tau * feed / (4 * 100.0), top, edge_with_feed(feed))
    assert loads[:3] == pytest.approx(exact[:3], abs=1e-3 * float(np.linalg.norm(exact[:3])))
    assert loads[3] == pytest.approx(exact[3], rel=1e-3)


def test_upright_the_chip_is_the_feed_times_the_sine() -> None:
    """What is left by layers and polygons at no tilt: h = f_z sin(phi) from 0 to pi, and nothing else, exactly."""
    f_z, depth = 0.08, 3.0
    stock = LayeredStock.block((-20.0, -12.0, -5.0), (20.0, 12.0, 0.0), 0.5, 30.0)
    shape = covered_areas(Move.lerp([-30, 0, -depth], [0, 0, 1], [0, 0, -depth], [0, 0, 1]), FLAT, [-1.0], 1e-5)[0]
    assert shape is not None
    stock.remove_many(range(4, 10), [shape.polygon] * 6)
    section = edges_under(stock, range(stock.layers), (-5.2, -5.2), (5.2, 5.2))
    frame = tool_frame((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    rows, owner = engagement_rows((0.1, 0.0, -depth), frame, (f_z, 0.0, 0.0), (0.0, 0.0, 0.0), slices(FLAT), section)
    assert (rows[:, 4:] == [f_z, 0.0, 0.0]).all()
    assert rows[:, 0] == pytest.approx(0.0, abs=1e-8)
    assert rows[:, 1] == pytest.approx(math.pi, abs=1e-8)
    assert np.sum(rows[:, 3] - rows[:, 2]) == pytest.approx(depth, rel=1e-12)
    # one straight tooth at any rotation, against the textbook
    mill = Cutter(10.0, 1, 0.0, 20.0, 30.0, 6e5)
    start = np.array([0, len(rows)])
    engagement = ToothEngagement(start, rows, np.full(len(rows), -1), owner, slices(mill).columns, frame[None])
    al, phi = material_named("al7075-t6"), np.linspace(0.05, math.pi - 0.05, 41)
    force, torque = forces_over_turn(engagement, mill, al, phi)
    ft, fr = (depth * (K * f_z * np.sin(phi) + E) for K, E in ((al.Ktc, al.Kte), (al.Krc, al.Kre)))
    np.testing.assert_allclose(force[0, :, 0], -ft * np.cos(phi) - fr * np.sin(phi), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(force[0, :, 1], ft * np.sin(phi) - fr * np.cos(phi), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(force[0, :, 2], -depth * (al.Kac * f_z * np.sin(phi) + al.Kae), rtol=1e-9)
    np.testing.assert_allclose(torque[0], 5.0 * ft, rtol=1e-9)


def test_exact_arcs_and_chips_tell_the_same_force_of_a_finish_pass() -> None:
    """The planner's own history of the corner against layers, 0.1 um chords: over the pass to 1e-3 of the greatest.

    Where the line meets the corner the force turns within half a millimetre; there single steps of 0.5 mm stray to
    3e-3.
    """
    wall = Contour.from_bulges([(0, 0), (20, 0), (28, 8), (28, 28)], [0, math.tan(math.pi / 8), 0, 0])
    setting = Finishing(
        side="inside", milling="down", strategies=("backward",), use="backward", joint="sharp", radial_depth=0.1,
        axial_depth=5.0, semifinish_depth=0.5, passes=1, feed=10.0, spindle_speed=314.0, tolerance=0.05, step=0.05,
        lead=3.0, top=0.0, clearance=5.0,
    )  # fmt: skip
    al = material_named("al7075-t6")
    plan = plan_contour([wall], setting, FLAT, al, machine_named("vmc"), {}).strategies["backward"]
    before = shapely.Polygon(plan.drawn["stock before"][0].flatten(1e-6))
    x0, y0, x1, y1 = before.bounds
    stock = LayeredStock.block((x0, y0, -5.0), (x1, y1, 0.0), 5.0, 20.0)
    stock.remove(0, shapely.box(x0, y0, x1, y1).difference(before))
    removal = remove_by_layers(plan.program, stock, {1: FLAT}, al, Resolution(0.5, 1e-4, 1, 5.0))
    c, told = removal.columns, plan.history
    ours, theirs = c["label"] == removal.labels.index("finish"), told["pass"] == "finish"
    s = (c["s_mm"] - 0.5 * np.diff(c["s_mm"], prepend=0.0))[ours]
    s += told["s_mm"][theirs][-1] - c["s_mm"][ours][-1]
    assert ours.sum() > 80
    pairs = [*((f, f"force_{f[6]}_mean_n") for f in FORCES), ("torque_mean_nm", "torque_mean_nm")]
    for name, other in pairs:
        want = np.interp(s, told["s_mm"][theirs], told[other][theirs])
        off = (c[name][ours] - want) / np.abs(told[other][theirs]).max()
        assert abs(off.mean()) < 1e-3, name
        assert np.quantile(np.abs(off), 0.9) < 2e-3, name
        assert np.abs(off).max() < 3e-3, name
