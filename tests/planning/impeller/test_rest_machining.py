"""What passes leave on a plane, by the closed form of a ball's scallop, and rest passes over what is left out."""

import math

import numpy as np
import pytest

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.geometry.bspline import patch_through
from chipload.planning.impeller.lines import LineMotion
from chipload.planning.impeller.rest_machining import RestSettings, corner_step, face_of, left_over, regions
from chipload.planning.impeller.scene import Scene
from chipload.planning.impeller.track import track_of

BALL = CatalogueCutter(10.0, 5.0)
SMALL = CatalogueCutter(6.0, 3.0)
TABLE = math.radians(40.0)
OWN = Catalogue("own", (BALL, SMALL))
LARGE, LITTLE = OWN.cutters.index(BALL), OWN.cutters.index(SMALL)
UP = np.array([0.0, 0.0, 1.0])
#: 40 by 30 mm
FLAT = patch_through([[[0, 0, 0], [0, 30, 0]], [[40, 0, 0], [40, 30, 0]]], [0, 1], [0, 1])
FLAT = FLAT if FLAT.normal(0.5, 0.5)[0, 2] > 0.0 else patch_through(
    [[[0, 0, 0], [0, 30, 0]], [[40, 0, 0], [40, 30, 0]]], [0, 1], [0, 1], side=-1
)  # fmt: skip


def track(y, cutter=BALL, low=-0.2, high=1.2):
    u = np.linspace(low, high, 9)
    at = np.column_stack([u, np.full(9, y / 30.0)])
    contact = np.column_stack([40.0 * u, np.full(9, y), np.zeros(9)])
    return track_of(at, contact, np.tile(UP, (9, 1)), TABLE, np.zeros(9), cutter, 0)


@pytest.fixture
def face():
    return face_of(0, "plus", FLAT, 0, ((0.0, 1.0), (0.0, 1.0)), 0.1, 5.0)


def scallop(y, lines, r):
    away = np.abs(np.asarray(y)[:, None] - np.asarray(lines)).min(axis=1)
    return r - np.sqrt(r * r - np.minimum(away, r) ** 2)


def test_step_of_a_ball():
    # at the height h over the plane a ball of radius r is 2 sqrt(2 r h - h^2) wide
    assert corner_step(5.0, 0.1) == pytest.approx(2.0 * math.sqrt(1.0 - 0.01))


def test_left_over_is_the_scallop_of_a_ball(face):
    lines = np.arange(0.0, 31.0, 1.9)
    left = left_over(face, [(BALL, [track(y) for y in lines])])
    assert np.diff(face.v).max() * 30.0 <= 0.45 * corner_step(5.0, 0.1)
    assert left.max() == pytest.approx(left[0].max(), abs=1e-3)
    assert np.abs(left - scallop(30.0 * face.v, lines, 5.0)).max() < 2e-3


def test_left_over_is_no_higher_than_the_scallop_where_poses_of_passes_are_not_side_by_side():
    """A point of the crest is as far from either pass: its height is the same, whichever has the nearest pose."""
    fine = face_of(0, "plus", FLAT, 0, ((0.2, 0.8), (0.2, 0.8)), 0.1, 5.0, 0.25)
    lines = np.arange(0.0, 31.0, 1.9)
    left = left_over(fine, [(BALL, [track(y, low=-0.2 - 0.003 * k) for k, y in enumerate(lines)])])
    assert np.abs(left - scallop(30.0 * fine.v, lines, 5.0)).max() < 2e-4


def test_two_cutters_together_leave_what_neither_takes(face):
    lines, more = np.arange(0.0, 20.0, 1.9), np.arange(19.5, 31.0, 1.4)
    left = left_over(face, [(BALL, [track(y) for y in lines]), (SMALL, [track(y, SMALL) for y in more])])
    both = np.minimum(scallop(30.0 * face.v, lines, 5.0), scallop(30.0 * face.v, more, 3.0))
    near = both < 0.4
    assert near.all()
    assert np.abs(left - both).max() < 2e-3


@pytest.mark.parametrize("pallet_deg", [0.0, 60.0, 90.0])
def test_left_over_of_a_small_corner_is_its_sweep(pallet_deg):
    """Balls of the corner's radius round the rim, swept straight along x: cylinders."""
    cutter, B = CatalogueCutter(12.0, 1.0), math.radians(pallet_deg)
    face = face_of(0, "plus", FLAT, 0, ((0.3, 0.7), (0.45, 0.55)), 0.1, 1.0)
    u = np.linspace(-0.2, 1.2, 9)
    contact = np.column_stack([40.0 * u, np.full(9, 15.0), np.zeros(9)])
    one = track_of(np.column_stack([u, np.full(9, 0.5)]), contact, np.tile(UP, (9, 1)), TABLE, np.full(9, B), cutter, 0)
    left = left_over(face, [(cutter, [one])])
    axis, tip = one.axis[0], one.tip[0]
    e = np.cross(axis, UP) / np.linalg.norm(np.cross(axis, UP))
    round_ = np.linspace(0.0, math.tau, 200_000)
    rim = tip + axis + 5.0 * (np.outer(np.cos(round_), e) + np.outer(np.sin(round_), np.cross(axis, e)))
    for k, y in enumerate(30.0 * face.v):
        near = np.abs(y - rim[:, 1]) < 1.0
        height = (rim[near, 2] - np.sqrt(1.0 - (y - rim[near, 1]) ** 2)).min(initial=math.inf)
        if height < 0.15:
            assert np.abs(left[:, k] - height).max() < 2e-3


def resting(pallets=((0.0, 2.0 * math.pi),)):
    far = np.array([[0.0, 0.0, -500.0]])
    scene = Scene(far, UP[None], np.zeros((1, 3, 3)), np.array([9]), far, np.array([9]), 1.0)
    return RestSettings(
        scene, OWN, LineMotion(0.01, 2.0, 2.0, 0.0), 0.1, 1.0, ((LARGE, TABLE),),
        np.array([TABLE]), pallets, 1,
    )  # fmt: skip


def test_rest_passes_take_what_lines_left_out(face):
    lines = np.concatenate([np.arange(0.0, 9.0, 1.9), np.arange(14.0, 31.0, 1.9)])
    own = [track(y) for y in lines]
    left = left_over(face, [(BALL, own)])
    none = np.zeros(left.shape, dtype=bool)
    found = regions(left, 0.1, none)
    # one gap, from a line at 7.6 to one at 14 mm
    assert len(found) == 1
    i, j = np.nonzero(found[0])
    assert np.ptp(i) == len(face.u) - 1
    assert 7.6 < 30.0 * face.v[j.min()] < 9.0
    assert 12.1 < 30.0 * face.v[j.max()] < 13.0
    plan = resting()
    pair = plan.chosen(face, found[0])
    assert pair == (LARGE, TABLE)
    rest = plan.passes(face, found[0], pair)
    after = left_over(face, [(BALL, [*own, *rest.tracks])])
    assert after.max() <= 0.1
    # no more passes than the gap needs at the step of the ball, one for luck
    assert len(rest.tracks) <= math.ceil((14.0 - 7.6) / corner_step(5.0, 0.1)) + 2
    # what was tried is not tried so again: the smaller cutter is next, then nothing is
    assert plan.chosen(face, found[0]) == (LITTLE, TABLE)
    plan.passes(face, found[0], (LITTLE, TABLE))
    assert plan.chosen(face, found[0]) is None
    assert not regions(left, 0.1, found[0])


def test_a_pallet_that_cannot_turn_so_far_reaches_nothing(face):
    wall = Scene(
        np.zeros((1, 3)), UP[None], np.zeros((1, 3, 3)), np.array([9]),
        np.array([[x, y, 8.0] for x in range(-10, 50, 2) for y in range(-10, 40, 2)], dtype=float),
        np.full(30 * 25, 9), 1.0,
    )  # fmt: skip
    # a lid of check points over all of the plane: no cutter goes under it
    plan = RestSettings(
        wall, OWN, LineMotion(0.01, 2.0, 2.0, 0.0), 0.1, 1.0, ((LARGE, TABLE),),
        np.array([TABLE]), ((0.0, 2.0 * math.pi),), 1,
    )  # fmt: skip
    assert plan.chosen(face, np.ones((len(face.u), len(face.v)), dtype=bool)) is None
