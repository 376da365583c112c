"""Valid pallet angles of whole cutters, against a test of every check point at many angles."""

import math

import numpy as np
import pytest

from chipload.cutter.catalogue import Catalogue, CatalogueCutter, catalogue_named
from chipload.planning.impeller import _pallet_ranges
from chipload.planning.impeller.answer import largest_cutters, one_cutter
from chipload.planning.impeller.closed_form import axis_at, contact_limit
from chipload.planning.impeller.pallet_ranges import valid_ranges
from chipload.planning.impeller.scene import Scene

PLAIN = CatalogueCutter(20.0, 2.0)
WHOLE = CatalogueCutter(
    16.0, 2.0, 10.0, neck_diameter=14.0, neck_length=25.0, shank_diameter=18.0, reach=38.0, holder_diameter=50.0
)


def channel(points=6, seed=3):
    """Two walls that lean, 24 mm apart at the floor, a floor, contact points on the first wall (a plane)."""
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(-40, 40, 41), np.linspace(0, 40, 21)))
    N = np.array([math.cos(0.1), 0.0, -math.sin(0.1)])
    first = np.stack([v * math.tan(0.1), u, v], axis=-1)
    second = np.stack([24.0 + 2.0 * np.sin(u / 20.0), u, v], axis=-1)
    floor = np.stack([np.abs(u) * 0.6, 2.0 * (v - 20.0), np.zeros_like(u)], axis=-1)
    rng = np.random.default_rng(seed)
    y, z = rng.uniform(-30, 30, points), rng.uniform(6, 36, points)
    contact = np.stack([z * math.tan(0.1), y, z], axis=-1)
    check = np.concatenate([first, second, floor])
    own = np.repeat([0, 1, 2], len(u))
    return Scene(contact, np.tile(N, (points, 1)), np.zeros((points, 3, 3)), np.zeros(points, int), check, own, 1.5)


def clear(s, k, cutter, table, pallet, clearance):
    """The gouge test of the source at one pallet angle: every check point against the profile of the cutter."""
    T, S, N, r = axis_at(table, pallet), s.contact[k], s.normal[k], cutter.corner_radius
    n = N @ T
    if n < 0.0 or n >= 1.0 or cutter.rho > contact_limit(N, T, r, s.curvature[k]):
        return False
    V = (N - n * T) / math.sqrt(1.0 - n * n)
    tip = S + r * N + cutter.rho * V - r * T
    keep = ~((s.check_surface == s.surface[k]) & (((s.check - S) ** 2).sum(axis=1) < s.near**2))
    a = s.check[keep] - tip
    height = a @ T
    away = np.linalg.norm(a - height[:, None] * T, axis=1)
    radius = np.where(height < r, cutter.rho + np.sqrt(np.clip(r * r - (r - height) ** 2, 0, None)), cutter.rho + r)
    if cutter.cutting_length is not None:
        radius = np.where(height >= cutter.cutting_length, 0.5 * cutter.neck_diameter + clearance, radius)
        radius = np.where(height >= cutter.neck_length, 0.5 * cutter.shank_diameter + clearance, radius)
        radius = np.where(height >= cutter.reach, 0.5 * cutter.holder_diameter + clearance, radius)
    return bool(((height < 0.0) | (away >= radius)).all())


@pytest.mark.parametrize("cutter", [PLAIN, WHOLE, CatalogueCutter(8.0, 4.0)])
@pytest.mark.parametrize("table", [0.5, 0.9, 0.5 * math.pi])
def test_ranges_agree_with_the_gouge_test(cutter, table):
    s = channel()
    got = valid_ranges(s, cutter, table, clearance=0.5)
    assert got.complete.all()
    # a step that does not divide the circle, so that no sample falls on an end
    B = np.arange(0.001, 2.0 * math.pi, 0.00873)
    for k in range(len(s.contact)):
        inside = np.zeros(len(B), dtype=bool)
        for lo, hi in got.ranges[k]:
            inside |= (lo < B) & (hi > B)
        away = np.min([np.abs(B - e) for e in got.ranges[k].ravel()] or [np.ones(len(B))], axis=0) > 1e-7
        expected = np.array([clear(s, k, cutter, table, b, 0.5) for b in B])
        np.testing.assert_array_equal(inside[away], expected[away])


def test_blockers_of_a_cutter_that_goes_nowhere_forbid_it():
    s = channel()
    large = CatalogueCutter(40.0, 2.0)
    got = valid_ranges(s, large, 0.4)
    B = np.arange(0.001, 2.0 * math.pi, 0.00873)
    for k in range(len(s.contact)):
        assert len(got.ranges[k]) == 0
        who = got.blockers[k][got.blockers[k] >= 0]
        few = Scene(
            s.contact[k : k + 1], s.normal[k : k + 1], s.curvature[:1], s.surface[:1], s.check[who],
            s.check_surface[who], s.near,
        )  # fmt: skip
        assert not any(clear(few, 0, large, 0.4, b, 0.0) for b in B)


def test_answer_agrees_with_the_gouge_test_over_the_catalogue():
    s = channel(points=5)
    tables = np.radians([25.0, 45.0, 65.0])
    catalogue = catalogue_named("wu2019")
    found = largest_cutters(s, catalogue, tables, clearance=0.0)
    assert found.bounded.all()
    # without a covering of the walls nothing is certified between the check points
    assert not found.certified.any()
    B = np.radians(np.arange(0.25, 360.0, 0.5))
    for k in range(3):
        D = found.diameter[k]
        # the sizes up to it go somewhere, the next two nowhere
        goes = {
            d: any(clear(s, k, CatalogueCutter(d, 2.0), t, b, 0.0) for t in tables for b in B)
            for d in (D, D + 2, D + 4)
        }
        assert goes == {D: True, D + 2: False, D + 4: False}
    for k in range(5):
        for lo, hi in found.ranges[k]:
            assert clear(s, k, catalogue.cutters[found.cutter[k]], tables[found.table[k]], 0.5 * (lo + hi), 0.0)


def test_one_cutter_for_all():
    s = channel(points=5)
    tables = np.radians([25.0, 45.0, 65.0])
    found = largest_cutters(s, catalogue_named("wu2019"), tables, clearance=0.0)
    index, table, ranges = one_cutter(s, found, 0.0)
    cutter = found.catalogue.cutters[index]
    for k, rows in enumerate(ranges):
        for lo, hi in rows:
            assert clear(s, k, cutter, tables[table], 0.5 * (lo + hi), 0.0)
    B = np.radians(np.arange(0.25, 360.0, 0.5))
    larger = min(c.diameter for c in found.catalogue.cutters if c.diameter > cutter.diameter)
    bigger = next(c for c in found.catalogue.cutters if c.diameter == larger and c.corner_radius == 2.0)
    for t in tables:
        assert not all(any(clear(s, k, bigger, t, b, 0.0) for b in B) for k in range(5))


def test_the_holder_makes_a_point_unreachable():
    s = channel(points=3)
    short = CatalogueCutter(10.0, 1.0, 6.0, reach=8.0, holder_diameter=60.0)
    found = largest_cutters(s, Catalogue("short", (short,)), [0.4], clearance=1.0)
    assert [u.reason for u in found.unreachable] == ["above"] * 3
    assert (found.cutter == -1).all()


def test_unreachable_is_listed_with_what_would_fit():
    s = channel(points=3)
    found = largest_cutters(s, Catalogue("large", (CatalogueCutter(60.0, 2.0),)), [0.4], clearance=0.0)
    assert [u.reason for u in found.unreachable] == ["cutting part"] * 3
    for u in found.unreachable:
        fits = CatalogueCutter(u.fits - 1e-6, 2.0)
        assert len(valid_ranges(s, fits, 0.4).ranges[u.point])


def test_turned_away():
    s = channel(points=1)
    down = Scene(s.contact, np.array([[0.0, 0.0, -1.0]]), s.curvature, s.surface, s.check, s.check_surface, 1.0)
    found = largest_cutters(down, catalogue_named("wu2019"), [0.3], clearance=0.0)
    assert [u.reason for u in found.unreachable] == ["turned away"]


@pytest.mark.parametrize("cutter", [PLAIN, WHOLE])
def test_a_point_that_bounds_prove_clear_is_clear_at_every_angle(cutter):
    """Of many points and parts of B the gouge test of the point alone, at angles within the part."""
    s, rng = channel(1), np.random.default_rng(7)
    table, stages = 0.9, cutter.enclosing(0.5)
    cone, proved, met, open_ = np.array([math.sin(table), math.cos(table)]), 0, 0, 0
    for i in rng.choice(len(s.check), 400, replace=False).tolist():
        one = Scene(s.contact, s.normal, s.curvature, s.surface, s.check[i : i + 1], s.check_surface[i : i + 1], s.near)
        low = rng.uniform(-1.2, 1.0)
        part = low, low + math.radians(8.0)
        goes = all(clear(one, 0, cutter, table, B, 0.5) for B in np.linspace(*part, 41))
        if _pallet_ranges.clear_within(
            s.check, i, s.rows[0], cone, cutter.corner_radius, cutter.rho, stages, *part, math.radians(0.5)
        ):
            assert goes
            proved += 1
        else:
            met, open_ = met + (not goes), open_ + goes
    # most of what is clear is proved
    assert min(proved, met) > 20
    assert open_ <= 0.2 * proved
