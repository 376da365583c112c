"""The search of [Wu2019] on an impeller with its dimensions; its blade surface is lost: no diameter of it is claimed.

The oracle is the gouge test of the source, check point by check point, over a grid of the pallet angle.
"""

import math

import numpy as np
import pytest

from chipload.cutter.catalogue import catalogue_named
from chipload.planning.impeller.answer import largest_cutters, one_cutter
from chipload.planning.impeller.closed_form import axis_at, contact_limit, rho_limits
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of

TABLES = np.radians(np.arange(20.0, 91.0, 5.0))
GRID = np.radians(np.arange(0.0, 360.0, 1.0))


def gouges(s, k, diameter, r, T):
    """Check points that a plain cutter meets: axis distance below the profile at their height above the tip."""
    N, S, R = s.normal[k], s.contact[k], 0.5 * diameter
    n = N @ T
    V = (N - n * T) / math.sqrt(1.0 - n * n)
    a = s.check - (S + r * N + (R - r) * V - r * T)
    height = a @ T
    away = np.linalg.norm(a - height[:, None] * T, axis=1)
    radius = np.where(height < r, R - r + np.sqrt(np.clip(r * r - (r - height) ** 2, 0.0, None)), R)
    own = (s.check_surface == 0) & (((s.check - S) ** 2).sum(axis=1) < s.near**2)
    return np.flatnonzero((height >= 0.0) & (away < radius - 1e-9) & ~own)


@pytest.fixture(scope="module")
def found():
    scene = impeller_of(ImpellerShape()).scene(
        0, "plus", (np.linspace(0.03, 0.97, 10), np.linspace(0.30, 0.98, 10)), (31, 31), 2.0, 0, (31, 31)
    )
    return scene, largest_cutters(scene, catalogue_named("wu2019"), TABLES, 0.0)


def test_the_channel_is_as_narrow_as_the_paper_says():
    shape, made = ImpellerShape(), impeller_of(ImpellerShape())
    u = np.linspace(0.0, 1.0, 41)
    foot = [made.body(0).plus.at(u, 0.0), made.body(1).minus.at(u, 0.0)]
    theta = [np.unwrap(np.arctan2(p[:, 1], p[:, 0])) for p in foot]
    wide = np.hypot(foot[0][:, 0], foot[0][:, 1]) * np.angle(np.exp(1j * (theta[1] - theta[0])))
    assert wide.min() == pytest.approx(24.185, abs=1e-9)
    assert np.hypot(*made.blade.plus.at(0.0, 1.0)[0][:2]) - 45.88 == pytest.approx(39.35, abs=1e-9)
    assert shape.blades == 11


def test_every_contact_point_is_reached_and_proved(found):
    _, answer = found
    assert not answer.unreachable
    assert answer.bounded.all()


def test_the_largest_is_clear_and_the_next_is_not(found):
    s, answer = found
    for k in range(0, 100, 9):
        D, t = answer.diameter[k], TABLES[answer.table[k]]
        r = answer.catalogue.cutters[answer.cutter[k]].corner_radius
        for lo, hi in answer.ranges[k]:
            for B in np.linspace(lo, hi, 7)[1:-1]:
                T = axis_at(t, B)
                assert len(gouges(s, k, D, r, T)) == 0
                assert D / 2 - r <= contact_limit(s.normal[k], T, r, s.curvature[k])
        if D < 80.0:
            for table in TABLES[::2]:
                T = axis_at(table, GRID)
                n = T @ s.normal[k]
                for one in T[(n >= 0.0) & (n < 1.0 - 1e-9)]:
                    tight = contact_limit(s.normal[k], one, 2.0, s.curvature[k]) < D / 2 + 1.0 - 2.0
                    assert tight or len(gouges(s, k, D + 2.0, 2.0, one)) > 0


def test_never_smaller_than_the_sampled_search(found):
    s, answer = found
    family = next(f for f in answer.families if f.corner_radius == 2.0)
    for k in range(0, 100, 17):
        keep = ~((s.check_surface == 0) & (((s.check - s.contact[k]) ** 2).sum(axis=1) < s.near**2))
        for j in range(0, 15, 4):
            T = axis_at(TABLES[j], GRID)
            n = T @ s.normal[k]
            T = T[(n >= 0.0) & (n < 1.0 - 1e-9)]
            sampled = (
                max(
                    min(
                        rho_limits(s.check[keep], s.contact[k], s.normal[k], one, 2.0).min(),
                        contact_limit(s.normal[k], one, 2.0, s.curvature[k]),
                    )
                    for one in T
                )
                if len(T)
                else -np.inf
            )
            assert min(sampled, family.cap) <= family.bound[k, j] or family.rho[k, j] == family.cap


def test_one_cutter_for_all_of_it(found):
    s, answer = found
    index, table, ranges = one_cutter(s, answer, 0.0)
    cutter = answer.catalogue.cutters[index]
    for k, rows in enumerate(ranges):
        T = axis_at(answer.tables[table], 0.5 * rows[0].sum())
        assert len(gouges(s, k, cutter.diameter, cutter.corner_radius, T)) == 0
    # at no table angle does the next size go everywhere: some point's proved bound is below it
    family = next(f for f in answer.families if f.corner_radius == 2.0)
    assert (family.bound.min(axis=0) <= cutter.diameter / 2 + 1.0 - 2.0).all()
