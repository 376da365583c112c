"""Between the check points: points that cover the walls, and cutters clear of them, against dense points."""

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.errors import InputError
from chipload.geometry.bspline import patch_through
from chipload.geometry.revolve import Revolved
from chipload.planning.impeller.answer import largest_cutters
from chipload.planning.impeller.covering.covering import covering_of, depth_of
from chipload.planning.impeller.covering.nodes import hub_nodes, patch_nodes
from chipload.planning.impeller.pallet_ranges import valid_ranges
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.surfaces import ContactSampling, hub_range, surface_of

TOLERANCE = 0.05
#: all of one corner radius; with a neck, a shank and a holder that come near the walls
SHOP = Catalogue(
    "shop",
    tuple(
        CatalogueCutter(D, 2.0, 25.0, neck_diameter=D - 1.0, neck_length=45.0, reach=60.0, holder_diameter=50.0)
        for D in (10.0, 14.0, 18.0, 24.0, 30.0, 36.0, 44.0, 60.0)
    ),
)
TABLES = np.radians([30.0, 55.0, 80.0])
CLEARANCE = 0.5


def wavy(side=1):
    """A patch that bends both ways, its parameters uneven and askew."""
    u, v = np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 7)
    U, V = np.meshgrid(u, v, indexing="ij")
    grid = np.stack([20.0 * U**1.5 + 4.0 * V, 12.0 * V, 1.5 * np.sin(4.0 * U) * np.cos(3.0 * V)], axis=-1)
    return patch_through(grid, u, v, side=side)


@pytest.fixture(scope="module")
def impeller():
    return impeller_of(ImpellerShape(11, 24.185, 45.88, 111.5, 50.0, 39.35, math.radians(20.0), 0.0, 24.0))


@pytest.fixture(scope="module")
def covering(impeller):
    return covering_of(impeller, TOLERANCE, 2.0, 1, hub_range(impeller, 0.0))


def searched(impeller, side, covering):
    up = (0.25, 0.75) if side == "floor" else (0.05, 0.98)
    how = ContactSampling((0.03, 0.97), up, (5, 3), 3.0, 2.0)
    surface = surface_of(impeller, "blade", side, how, covering)
    return surface.scene, largest_cutters(surface.scene, SHOP, TABLES, CLEARANCE)


def dense(impeller, count=9000):
    """Random points of the exact walls, edges too; none of them is a check point or a node."""
    rng = np.random.default_rng(5)
    out = []
    for k in (-1, 0, 1, 2):
        for patch in (impeller.body(k).plus, impeller.body(k).minus):
            u, v = rng.random(count), rng.random(count)
            u[:300], u[300:600], v[600:900], v[900:1200] = 0.0, 1.0, 0.0, 1.0
            out.append(patch.at(u, v))
    low, high = hub_range(impeller, 0.0)
    for k in (-1, 0, 1):
        s, w = low + (high - low) * rng.random(2 * count), rng.random(2 * count)
        ends = impeller.across(k, s, [0.0, 1.0])
        out.append(impeller.hub.at(s, ends[:, 0] + w * (ends[:, 1] - ends[:, 0])))
    return np.concatenate(out)


def depth(points, S, N, table, B, cutter):
    """How deep each point lies in the cutter, by its outline: cutting part, neck, shank, holder; none is enlarged."""
    T = np.array([math.sin(table) * math.cos(B), math.sin(table) * math.sin(B), math.cos(table)])
    n, R, r = N @ T, 0.5 * cutter.diameter, cutter.corner_radius
    tip = S + r * N + (R - r) * (N - n * T) / math.sqrt(1.0 - n * n) - r * T
    a = points - tip
    z = a @ T
    d = np.sqrt(np.maximum((a * a).sum(axis=1) - z * z, 0.0))
    round_part = np.where(d > R - r, r - np.hypot(d - (R - r), z - r), z)
    best = np.where(z <= r, round_part, np.where(z <= cutter.cutting_length, R - d, -np.inf))
    rows = ((cutter.cutting_length, cutter.neck_length, 0.5 * cutter.neck_diameter),
            (cutter.neck_length, cutter.reach, R), (cutter.reach, 500.0, 0.5 * cutter.holder_diameter))  # fmt: skip
    for low, high, P in rows:
        best = np.maximum(best, np.minimum(np.minimum(z - low, high - z), P - d))
    return best


def test_no_point_of_a_patch_is_far_from_a_node():
    patch = wavy()
    made = patch_nodes(patch, 0.5)
    rng = np.random.default_rng(1)
    points = patch.at(rng.random(20000), rng.random(20000))
    away = cKDTree(made.points).query(points)[0].max()
    assert 0.6 * made.reach < away <= made.reach + made.bend
    assert made.reach < 0.6


def test_a_kink_of_a_patch_has_nodes():
    corner = patch_through(
        [[[0, 0, 0], [0, 4, 0]], [[3, 0, 0], [3, 4, 0]], [[3, 0, 3], [3, 4, 3]]], [0, 0.5, 1], [0, 1], (1, 1)
    )
    made = patch_nodes(corner, 1.0)
    assert {tuple(p) for p in made.points.round(9).tolist()} >= {(3.0, float(k), 0.0) for k in range(5)}
    assert made.bend == 0.0
    assert made.reach == pytest.approx(math.sqrt(0.5))


def test_no_point_of_a_hub_is_far_from_a_node():
    s = np.linspace(0.0, 0.5 * math.pi, 12)
    hub = Revolved(np.stack([60.0 - 40.0 * np.cos(s), 30.0 * (1.0 - np.sin(s))], axis=-1), 1)
    made = hub_nodes(hub, (0.1, 0.9), (0.2, 1.1), 0.6)
    rng = np.random.default_rng(2)
    points = hub.at(0.1 + 0.8 * rng.random(20000), 0.2 + 0.9 * rng.random(20000))
    away = cKDTree(made.points).query(points)[0].max()
    assert 0.6 * made.reach < away <= made.reach + made.bend


def test_a_ball_on_four_nodes_lies_as_deep_as_the_lemma_says():
    # a ball of radius 2 rests on the corners of a square of 0.6 mm: its lowest point is below them by this
    assert depth_of(2.0, 0.3 * math.sqrt(2.0), 0.0, 0.0) == pytest.approx(2.0 - math.sqrt(4.0 - 0.18))
    # all of the nodes 0.01 mm deeper: 0.01 mm more, but for what the shallower bowl is narrower
    assert depth_of(2.0, 0.3 * math.sqrt(2.0), 0.0, 0.01) == pytest.approx(0.01 + 1.99 - math.sqrt(1.99**2 - 0.18))
    # a ball that falls through between them
    assert depth_of(0.4, 0.3 * math.sqrt(2.0), 0.0, 0.0) == math.inf


@pytest.mark.parametrize("side", ["plus", "minus", "floor"])
def test_no_wall_is_deeper_in_a_certified_cutter_than_the_tolerance(impeller, covering, side):
    points = dense(impeller)
    assert len(points) >= 100_000
    rng = np.random.default_rng(3)
    worst = {}
    for name, cover in (("with", covering), ("without", None)):
        scene, answer = searched(impeller, side, cover)
        assert answer.bounded.all()
        assert answer.certified.all() == (cover is not None)
        assert answer.tolerance == (TOLERANCE if cover is not None else None)
        assert (answer.cutter >= 0).sum() > 8
        worst[name] = max(
            depth(
                points, scene.contact[k], scene.normal[k], TABLES[answer.table[k]], B, SHOP.cutters[answer.cutter[k]]
            ).max()
            for k in np.flatnonzero(answer.cutter >= 0)
            for low, high in answer.ranges[k]
            for B in (low, high, low + (high - low) * rng.random())
        )
    assert worst["with"] <= TOLERANCE < worst["without"]


def test_ranges_end_where_a_node_is_met(impeller, covering):
    """Every B of what is kept is clear of every node, every B of what is taken away meets one."""
    scene, answer = searched(impeller, "floor", None)
    where = np.flatnonzero(answer.cutter >= 0)
    taken = 0
    for k in where[:3]:
        cutter, table = SHOP.cutters[answer.cutter[k]], TABLES[answer.table[k]]
        before = (answer.ranges[k],)
        (after,), told = covering.clear_ranges(scene, cutter, np.array([table]), CLEARANCE, np.array([k]), before, 1e-9)
        assert told.all()
        stages = covering.stages(cutter, CLEARANCE)
        for low, high in answer.ranges[k]:
            for B in np.linspace(low, high, 15)[1:-1]:
                kept = any(a < B < b for a, b in after)
                near = min(abs(B - x) for x in [*after.ravel(), low, high])
                if near > 1e-6:
                    assert kept == (met(covering.points, scene, k, table, B, cutter, stages) <= 0.0)
                    taken += not kept
    assert taken > 5


def met(points, scene, k, table, B, cutter, stages):
    """Greatest depth of the points in the cutter with stages as they are tested."""
    T = np.array([math.sin(table) * math.cos(B), math.sin(table) * math.sin(B), math.cos(table)])
    S, N, r, rho = scene.contact[k], scene.normal[k], cutter.corner_radius, cutter.rho
    n = N @ T
    a = points - (S + r * N + rho * (N - n * T) / math.sqrt(1.0 - n * n))
    h = a @ T
    d = np.sqrt(np.maximum((a * a).sum(axis=1) - h * h, 0.0))
    corner = np.where(d > rho, r - np.hypot(d - rho, h), h + r)
    best = np.where(h <= 0.0, corner, -np.inf)
    ends = [*stages[1:, 0], np.inf]
    for (low, P), high in zip(stages, ends, strict=True):
        best = np.maximum(best, np.where((h >= low) & (h <= high), P - d, -np.inf))
    return best.max()


def test_sharp_corners_and_rims_are_not_certified(impeller, covering):
    assert covering.proves(CatalogueCutter(20.0, 2.0), 0.0)
    assert not covering.proves(CatalogueCutter(20.0, 0.0), 0.0)
    holder = CatalogueCutter(20.0, 2.0, 30.0, reach=40.0, holder_diameter=50.0)
    assert covering.proves(holder, 0.5)
    assert not covering.proves(holder, 0.0)
    how = ContactSampling((0.2, 0.8), (0.4, 0.9), (2, 2), 4.0, 2.0)
    scene = surface_of(impeller, "blade", "plus", how, covering).scene
    answer = largest_cutters(scene, Catalogue("sharp", (CatalogueCutter(10.0, 0.0),)), TABLES, 0.0)
    assert (answer.cutter == 0).any()
    assert not answer.certified[answer.cutter == 0].any()


def test_what_no_cutter_reaches_between_the_check_points(impeller, covering):
    """With few check points the cutter falls between them; the walls leave it nowhere to go, and the reason is said."""
    how = ContactSampling((0.03, 0.97), (0.02, 0.98), (5, 4), 12.0, 2.0)
    cutter = CatalogueCutter(44.0, 2.0)
    surface = surface_of(impeller, "blade", "plus", how, covering)
    answer = largest_cutters(surface.scene, Catalogue("large", (cutter,)), TABLES, 0.0)
    told = [u for u in answer.unreachable if u.reason == "between"]
    assert told
    for one in told:
        got = [valid_ranges(surface.scene, cutter, table, 0.0, points=[one.point]) for table in TABLES]
        assert any(g.between[0] for g in got)
        assert not any(len(g.ranges[0]) for g in got)


def test_too_many_points_are_refused(impeller):
    with pytest.raises(InputError, match=r"a corner radius of 0.05 mm needs about .* points of the walls: must be at "):
        covering_of(impeller, 1e-4, 0.05, 1, hub_range(impeller, 0.0))
