"""Pallet angles of tapered cutters: the cylinders round the cone, brute force over B, the limit of no taper."""

import math

import numpy as np
import pytest
from tests.planning.impeller.test_covering import CLEARANCE, TABLES, TOLERANCE, dense
from tests.planning.impeller.test_profile_cutters import BALL, BULL, gaps, tapered_ball

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.errors import InputError
from chipload.planning.impeller.answer import largest_cutters
from chipload.planning.impeller.axis_field import pose
from chipload.planning.impeller.covering.covering import covering_of
from chipload.planning.impeller.pallet_ranges import corner_ranges, valid_ranges
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.scene import Scene
from chipload.planning.impeller.surfaces import ContactSampling, hub_range, surface_of

STEEP = tapered_ball(1.5, 8.0, 20.0, shank_diameter=12.0, reach=40.0, holder_diameter=30.0)


def axes_at(alpha, B):
    """Axes (n, 3) at the pallet angles B (n,)."""
    s = math.sin(alpha)
    return np.stack([s * np.cos(B), s * np.sin(B), np.full(len(B), math.cos(alpha))], axis=-1)


def solid(cutter, clearance, d, z):
    """Distances from the corner and the cylinders of the rows, below 0 inside."""
    rows, r = cutter.enclosing(clearance), cutter.corner_radius
    h = z - r
    rho = cutter.rho
    corner = np.where(d > rho, np.hypot(d - rho, h) - r, -h - r)
    out = np.where(h <= 0.0, corner, np.inf)
    for k, (low, radius) in enumerate(rows):
        high = rows[k + 1, 0] if k + 1 < len(rows) else np.inf
        off, away = d - radius, np.maximum(low - h, h - high)
        part = np.where((off <= 0.0) & (away <= 0.0), np.maximum(off, away), np.hypot(off.clip(0.0), away.clip(0.0)))
        out = np.minimum(out, part)
    return out


@pytest.mark.parametrize("cutter", [BALL, BULL, STEEP])
def test_the_cylinders_enclose_the_cone(cutter):
    p = cutter.shape.profile(1e-4)
    p = np.vstack(
        [p, np.stack([cutter.shape.radius_at(z := np.linspace(0.0, cutter.cutting_length, 4001)), z], axis=-1)]
    )
    out = solid(cutter, 0.0, p[:, 0], p[:, 1])
    assert out.max() <= cutter.not_enclosed + 1e-9
    assert out[p[:, 1] >= cutter.corner_radius].max() <= 1e-9
    assert cutter.not_enclosed < 0.016
    # what stands out of the cone grows with the height
    h = np.linspace(0.001, cutter.cutting_length - cutter.corner_radius - 1e-6, 5000)
    rows = cutter.enclosing(0.0)
    count = np.searchsorted(rows[:, 0], h, side="right") - 1
    over = rows[count, 1] - cutter.shape.radius_at(h + cutter.corner_radius)
    assert over.min() > -1e-9
    assert (over <= (0.4 + 0.3 * h) * math.tan(cutter.taper) + 1e-9).all()


def test_of_a_barrel_there_are_none():
    with pytest.raises(InputError, match="cutter barrel 85 D 12 r 2: a barrel is not enclosed by cylinders"):
        CatalogueCutter(12.0, 2.0, 28.0, barrel_radius=85.0).enclosing(0.0)


def test_on_the_corner_is_where_the_normal_belongs_to_it():
    rng = np.random.default_rng(4)
    B = np.linspace(0.0, math.tau, 4001)
    for _ in range(40):
        N = rng.normal(size=3)
        N /= np.linalg.norm(N)
        alpha, taper = rng.uniform(0.0, 1.5), rng.uniform(0.0, 0.6)
        given = np.array([[0.3, 2.0], [2.5, 5.9]])
        got = corner_ranges(given, N, alpha, taper, 0.0)
        T = np.stack(
            [math.sin(alpha) * np.cos(B), math.sin(alpha) * np.sin(B), np.full(len(B), math.cos(alpha))], axis=-1
        )
        gap = T @ N - math.sin(taper)
        within = ((B[:, None] > given[:, 0]) & (B[:, None] < given[:, 1])).any(axis=1)
        told = ((B[:, None] > got[:, 0]) & (B[:, None] < got[:, 1])).any(axis=1)
        sure = np.abs(gap) > 1e-3
        assert (told == (within & (gap > 0.0)))[sure].all()


@pytest.mark.parametrize("cutter", [BALL, STEEP])
def test_ranges_are_those_of_brute_force(cutter):
    """Random check points round contact points; every B of a grid by the profile itself and by its cylinders."""
    rng = np.random.default_rng(9)
    S = np.zeros((4, 3))
    N = rng.normal(size=(4, 3))
    N /= np.linalg.norm(N, axis=1)[:, None]
    check = rng.uniform(-22.0, 22.0, (60, 3))
    scene = Scene(S, N, np.zeros((4, 3, 3)), np.zeros(4, int), check, np.ones(60, int), 1.0)
    B, clearance, seen = np.radians(np.arange(0.0, 360.0, 0.5) + 0.13), 0.5, 0
    for alpha in np.radians([25.0, 50.0, 80.0]):
        found = valid_ranges(scene, cutter, alpha, clearance)
        T = np.stack(
            [math.sin(alpha) * np.cos(B), math.sin(alpha) * np.sin(B), np.full(len(B), math.cos(alpha))], axis=-1
        )
        for k in range(4):
            n = T @ N[k]
            rows = found.ranges[k]
            told = ((B[:, None] > rows[:, 0]) & (B[:, None] < rows[:, 1])).any(axis=1)
            some = (n > math.sin(cutter.taper)) & (n < 0.999)
            assert not told[n < math.sin(cutter.taper) - 1e-6].any()
            for b in np.flatnonzero(some):
                (tip,) = pose(S[k : k + 1], N[k : k + 1], T[b : b + 1], cutter)
                x = check - tip
                z = x @ T[b]
                d = np.sqrt(np.maximum((x * x).sum(axis=1) - z * z, 0.0))
                if told[b]:
                    # the profile itself is clear
                    assert gaps(cutter, d, z, 1e-3).min() > -cutter.not_enclosed - 2e-3
                    seen += 1
                elif solid(cutter, clearance, d, z).min() > 0.05:
                    # 0.5 deg of B beside an end of a range
                    near = np.abs(rows - B[b]).min() if len(rows) else np.inf
                    assert near < math.radians(0.5)
    assert seen > 100


def test_without_taper_the_ranges_are_those_of_the_straight_cutter():
    rng = np.random.default_rng(1)
    N = rng.normal(size=(6, 3))
    N /= np.linalg.norm(N, axis=1)[:, None]
    check = rng.uniform(-25.0, 25.0, (40, 3))
    scene = Scene(np.zeros((6, 3)), N, np.zeros((6, 3, 3)), np.zeros(6, int), check, np.ones(40, int), 1.0)
    pair = [CatalogueCutter(8.0, 2.0, 20.0, reach=40.0, holder_diameter=30.0, taper=taper) for taper in (0.0, 1e-9)]
    for alpha in np.radians([30.0, 70.0]):
        straight, limit = (valid_ranges(scene, c, alpha, 0.5).ranges for c in pair)
        assert sum(len(x) for x in straight) > 0
        for a, b in zip(straight, limit, strict=True):
            assert b == pytest.approx(a, abs=1e-6)


#: balls and bull noses in cones up to a shank, one steep
SHOP = Catalogue(
    "shop",
    tuple(
        CatalogueCutter(
            D, 2.0, 25.0, shank_diameter=D + 6.0, reach=60.0, holder_diameter=50.0, taper=math.radians(taper)
        )
        for D, taper in ((6.0, 8.0), (10.0, 4.0), (14.0, 4.0), (18.0, 3.0), (24.0, 4.0))
    ),
)


def deepest(points, S, N, table, B, cutter):
    """How deep the deepest of the points lies in the profile, or in shank or holder without their clearance."""
    T = axes_at(table, np.array([B]))
    (tip,) = pose(S[None], N[None], T, cutter)
    x = points - tip
    z = x @ T[0]
    d = np.sqrt(np.maximum((x * x).sum(axis=1) - z * z, 0.0))
    top = cutter.cutting_length
    inside = np.flatnonzero((z > 0.0) & (z < top) & (d < cutter.shape.radius_at(np.clip(z, 0.0, top))))
    deep = -gaps(cutter, d[inside], z[inside], 1e-4).min() if len(inside) else 0.0
    for low, high, R in ((top, 60.0, 0.5 * cutter.shank_diameter), (60.0, np.inf, 25.0)):
        part = (z > low) & (z < high)
        deep = max(deep, float((R - d[part]).max(initial=0.0)))
    return deep


@pytest.mark.parametrize("side", ["plus", "floor"])
def test_no_wall_is_deeper_in_a_certified_tapered_cutter_than_the_tolerance(side):
    impeller = impeller_of(ImpellerShape())
    slack = max(c.not_enclosed for c in SHOP.cutters)
    covering = covering_of(impeller, TOLERANCE, 2.0, 1, hub_range(impeller, 0.0), slack)
    assert covering.tolerance == TOLERANCE
    assert all(covering.proves(c, CLEARANCE) for c in SHOP.cutters)
    # a steeper one, and one of a smaller corner, are not proved by it
    assert not covering.proves(CatalogueCutter(10.0, 4.0, 25.0, taper=math.radians(9.0)), CLEARANCE)
    assert not covering.proves(CatalogueCutter(10.0, 1.95, 25.0, taper=math.radians(4.0)), CLEARANCE)
    points, rng, worst = dense(impeller), np.random.default_rng(3), {}
    for name, cover in (("with", covering), ("without", None)):
        up = (0.25, 0.75) if side == "floor" else (0.05, 0.98)
        scene = surface_of(impeller, "blade", side, ContactSampling((0.03, 0.97), up, (5, 3), 3.0, 2.0), cover).scene
        answer = largest_cutters(scene, SHOP, TABLES, CLEARANCE)
        assert answer.certified.all() == (cover is not None)
        where = np.flatnonzero(answer.cutter >= 0)
        assert len(where) > 8
        worst[name] = max(
            deepest(
                points, scene.contact[k], scene.normal[k], TABLES[answer.table[k]], B, SHOP.cutters[answer.cutter[k]]
            )
            for k in where
            for low, high in answer.ranges[k]
            for B in (low, high, low + (high - low) * rng.random())
        )
    assert worst["with"] <= TOLERANCE < worst["without"]
