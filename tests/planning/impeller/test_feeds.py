"""Feeds by the force of a pass: its chip against closed forms and against plane stock, the feed against its limits."""

import math

import numpy as np
import pytest

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.cutter.cutter import Cutter
from chipload.cutter.strength import ToolStrength
from chipload.cutting.force import forces_over_turn
from chipload.cutting.material import material_named
from chipload.errors import InputError
from chipload.planning.impeller.engagement import EarlierPoses, PassPlaces, engagement_at
from chipload.planning.impeller.feeds import (
    LEAST,
    ForceTerms,
    PassRows,
    allowed_factor,
    loads_of,
    nominal_feeds,
    pass_feeds,
)
from chipload.planning.thinwall.plane_stock import CutterPose, engagement_of_depths

MATERIAL = material_named("al7075-t6")


def terms(deflection=0.02, overhang=70.0):
    return ForceTerms(MATERIAL, 2, math.radians(30.0), 5.8e5, 0.5, deflection, 90.0, overhang)


def place(normal, tip, axis, feed=(1.0, 0.0, 0.0), curvature=None):
    K = np.zeros((3, 3)) if curvature is None else curvature
    return PassPlaces(*(np.array([x], dtype=float) for x in ((0, 0, 0), normal, K, tip, axis, feed)))


@pytest.mark.parametrize("bend", [0.0, 0.02, -0.02])
def test_flank_on_a_wall_and_on_cylinders(bend):
    # side milling with the flank: engaged from the wall to where the circle leaves the allowance,
    # R - R cos(a) = d + k (R sin a)^2 / 2 of a wall of the curvature k along the feed, in the same second order
    R, d = 10.0, 0.5
    K = np.diag([bend, 0.0, 0.0])
    mill = Cutter(2 * R, 2, 0.0, 10.0, 40.0, 6e5)
    got = engagement_at(place((0, 1, 0), (0, R, -5), (0, 0, 1), curvature=K), mill, 0.1, d, EarlierPoses.none()).rows
    flank = got[got[:, 3] > 0.0]
    a = np.linspace(0.0, 1.0, 100001)
    inside = R - R * np.cos(a) < d + 0.5 * bend * (R * np.sin(a)) ** 2
    assert np.degrees(flank[:, 1] - flank[:, 0]) == pytest.approx(np.degrees(a[inside].max()), abs=1.0)
    assert (flank[:, 3] - flank[:, 2]).sum() == pytest.approx(10.0)
    # along / f_z is 1 on a flank: h = f_z sin(phi)
    assert flank[:, 4] == pytest.approx(0.1)


@pytest.mark.parametrize(("lead", "tilt", "step"), [(10, -25, 1.5), (-5, 30, -1.5), (0, 20, 2.5)])
def test_forces_of_a_bull_nose_beside_an_earlier_pass_are_those_on_plane_stock(lead, tilt, step):
    mill = Cutter(20.0, 2, math.radians(30.0), 30.0, 60.0, 5.8e5, corner_radius=4.0)
    pose = CutterPose(mill, 0.1, step, lead=math.radians(lead), tilt=math.radians(tilt))
    A, N, r, rho = pose.axis, np.array([0.0, 0.0, 1.0]), 4.0, 6.0
    n = A[2]
    tip = r * N + rho * (N - n * A) / math.sqrt(1.0 - n * n) - r * A
    x = np.linspace(-30.0, 30.0, 3)
    before = EarlierPoses.of(tip + np.column_stack([x, 0 * x - step, 0 * x]), np.tile(A, (3, 1)), rho, r)
    mine = engagement_at(place(N, tip, A), mill, 0.1, 0.6, before)
    exact = engagement_of_depths(pose, [0.6], 16)
    theta = np.linspace(0.0, math.pi, 90)
    force, other = (np.linalg.norm(forces_over_turn(b, mill, MATERIAL, theta)[0], axis=2) for b in (mine, exact))
    assert force.max() == pytest.approx(other.max(), rel=0.1)
    assert force.mean() == pytest.approx(other.mean(), rel=0.1)


def test_feed_keeps_the_limits_and_no_lower_one_would_do():
    size = CatalogueCutter(12.0, 2.0, cutting_length=20.0)
    mill = terms().cutter(size)
    wall = place((0, 1, 0), (0, 6.0, -5), (0, 0, 1))
    engagement = engagement_at(wall, mill, 0.1, 0.5, EarlierPoses.none())
    ends = [loads_of(engagement, wall, mill, MATERIAL, np.full(1, f))[1][0] for f in (LEAST, 1.0)]
    t = terms(deflection=0.5 * sum(ends) * (1.0 + terms().error))
    f = allowed_factor(engagement, wall, mill, t)
    assert LEAST < f[0] < 1.0
    _, bend, _ = loads_of(engagement, wall, mill, MATERIAL, f)
    assert 0.97 <= bend[0] * (1.0 + t.error) / t.deflection <= 1.0
    # a stepped cantilever by integration of its moments
    E = 5.8e5
    theta = np.linspace(0.0, math.pi, 24, endpoint=False)
    rows = engagement.rows.copy()
    rows[:, 4:7] *= f[0]
    fed = type(engagement)(engagement.start, rows, engagement.tooth, engagement.slice, engagement.slices)
    lateral = np.hypot(*forces_over_turn(fed, mill, MATERIAL, theta)[0][0, :, :2].T).max()
    z = np.linspace(5.0, 70.0, 20001)
    inertia = math.pi * np.where(z < 20.0, 0.8 * 12.0, 12.0) ** 4 / 64.0
    middle = 10.5  # of what cuts: all of the flutes but a part of the corner
    moment = np.clip(z - middle, 0.0, None) * np.clip(z - 5.0, 0.0, None) / (E * inertia)
    assert bend[0] == pytest.approx(lateral * np.trapezoid(moment, z), rel=0.05)


def test_what_no_feed_allows_keeps_the_least_feed_and_shows_its_load():
    t = terms(deflection=1e-4)
    x = np.linspace(0.0, 10.0, 11)
    axis, tip = np.tile([0.0, 0.0, 1.0], (11, 1)), np.column_stack([x, 0 * x + 6.0, 0 * x - 5.0])
    contact, normal = np.column_stack([x, 0 * x, 0 * x]), np.tile([0.0, 1.0, 0.0], (11, 1))
    one = PassRows(np.arange(11), tip, axis, contact, normal, np.zeros((11, 3, 3)))
    ((feeds, loads),) = pass_feeds([(CatalogueCutter(12.0, 2.0), [one])], t, 5.0)
    assert feeds == [pytest.approx(LEAST * 5.0)]
    assert (loads.deflection > loads.most).all()


def test_the_second_time_along_nothing_is_left_and_the_feed_is_the_greatest():
    t = terms(deflection=0.01)
    x = np.linspace(0.0, 30.0, 31)
    axis, tip = np.tile([0.0, 0.0, 1.0], (31, 1)), np.column_stack([x, 0 * x + 6.0, 0 * x - 5.0])
    contact, normal = np.column_stack([x, 0 * x, 0 * x]), np.tile([0.0, 1.0, 0.0], (31, 1))
    one = PassRows(np.arange(31), tip, axis, contact, normal, np.zeros((31, 3, 3)))
    # in a program of its own and then in a second one
    (first, _), (second, loads) = pass_feeds([(CatalogueCutter(12.0, 2.0), [one])] * 2, t, 5.0)
    assert first[0] < 5.0
    assert second == [5.0]
    # poses 0.4 mm apart leave next to nothing: at the greatest feed less than 3 % of what the first pass takes there
    mill = t.cutter(CatalogueCutter(12.0, 2.0))
    engagement = engagement_at(one.places(), mill, 5.0 * math.tau / 180.0, 0.5, EarlierPoses.none())
    assert loads.force.max() < 0.03 * loads_of(engagement, one.places(), mill, MATERIAL, np.ones(3))[0].max()


def test_slender_cutters_are_fed_more_slowly():
    sizes = Catalogue("some", tuple(CatalogueCutter(d, 2.0) for d in (6.0, 8.0, 12.0, 20.0)))
    feeds = nominal_feeds(sizes, terms(deflection=0.02), 0.1, 5.0)
    assert list(feeds) == sorted(feeds)
    assert feeds[0] < 0.5 * feeds[-1] <= 2.5


def test_an_overhang_must_be_known_and_long_enough():
    with pytest.raises(InputError) as caught:
        terms(overhang=None).cutter(CatalogueCutter(12.0, 2.0))
    assert str(caught.value) == (
        "operation.0.forces.overhang_mm: missing: the catalogue states no reach of D 12 r 2 mm: state the overhang"
    )
    with pytest.raises(InputError) as caught:
        terms(overhang=20.0).cutter(CatalogueCutter(12.0, 2.0, cutting_length=30.0))
    assert "operation.0.forces.overhang_mm = 20: must be at least the cutting length" in str(caught.value)
    long = CatalogueCutter(6.0, 1.0, 12.0, 5.6, 60.0, 10.0, 80.0, 28.0)
    assert terms(overhang=None).cutter(long).shank_diameter == 5.6
    assert terms().strength == ToolStrength()
