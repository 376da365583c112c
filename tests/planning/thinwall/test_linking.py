"""Tours over a plate by geometry: the ball touches what a pass leaves, links stay off the stock, sides change above."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.geometry.thin_wall import plate
from chipload.planning.thinwall.blank import FinishSurface
from chipload.planning.thinwall.linking import FineSide, OperationMotion, link_passes, refine_depths
from chipload.planning.thinwall.pass_program import Margins
from chipload.planning.thinwall.passes import WallPass
from chipload.planning.thinwall.paths import PassMotion
from chipload.planning.thinwall.plane_stock import CutterPose
from chipload.planning.thinwall.threshold import modelled
from chipload.program.program import LINE, RAPID

BALL = Cutter(8.0, 2, 0.5, 8.0, 30.0, 6e5, corner_radius=4.0)
WALL = plate(20.0, 18.0, 2.0)
PLACES = (np.linspace(0.0, 1.0, 5), np.linspace(0.3, 1.0, 4))
TILT = math.radians(45.0)


def sides(step: float) -> list[FineSide]:
    u, v = np.linspace(0.0, 1.0, 9), np.linspace(0.3, 1.0, math.ceil(12.6 / abs(step)) + 1)
    a, b = np.meshgrid(u, v, indexing="ij")
    return [FineSide(FinishSurface(WALL.sides(a, b)[k], WALL.normals(a, b)[k], 0.5), u, v) for k in (0, 1)]


def two_passes() -> list[WallPass]:
    """Side 1 from 0.5 to 0.1 + 0.2 u, side 2 from 0.5 to 0 where u is above 0.5."""
    u = np.broadcast_to(PLACES[0][:, None], (5, 4))
    low = (0.1 + 0.2 * u, np.where(u > 0.5, 0.0, 0.5))
    threshold = modelled(np.full(20, 1e-3), 0.05)
    ones = np.ones((5, 4))
    return [WallPass(k, low[k], 0.5 * ones, threshold, 0.0 * u, u > 2.0, ones) for k in (0, 1)]


def over(each: list[FineSide], pass_motion: PassMotion) -> OperationMotion:
    return OperationMotion(each, pass_motion, Margins(3.0, 26.0, 0.3))


@pytest.mark.parametrize("step", [-0.9, 0.9])
def test_ball_touches_what_the_pass_leaves(step):
    pass_motion = PassMotion(CutterPose(BALL, 0.05, step, 0.0, -math.copysign(TILT, step)), 10.0, 100.0, 300.0, 1.5)
    legs = link_passes(two_passes(), [over(sides(step), pass_motion)], PLACES)
    for k, leg in enumerate(legs):
        p, outwards = leg.program, (1.0, -1.0)[k]
        centre = p.p_work + 4.0 * p.axis
        flat = leg.contact & (leg.depth > 0.0)
        u, v = leg.place[flat].T
        low = refine_depths(two_passes()[k].low, PLACES, (np.linspace(0.0, 1.0, 9), np.array([0.3, 1.0])))[:, 0]
        expected = 1.0 + np.interp(u, np.linspace(0.0, 1.0, 9), low)
        n = leg.normals[flat]
        # the middle of the ball is 4 mm along the normal from the point, and that is on the surface
        assert_allclose(centre[flat], leg.points[flat] + 4.0 * n, atol=1e-9)
        assert_allclose(leg.points[flat][:, 1] * outwards, expected, atol=1e-9)
        # the axis leans by 45 deg towards the free edge and stands above the layers
        assert_allclose(np.degrees(np.arccos((p.axis[flat] * n).sum(axis=1))), 45.0, atol=1e-6)
        assert p.axis[:, 2].min() > 0.6
        # planned depth of the contact points is that between the surfaces
        assert_allclose(leg.depth[flat], 1.5 - expected, atol=1e-9)
        # rows from the free edge to the foot
        assert v[0] == pytest.approx(1.0)
        assert v[-1] == pytest.approx(0.3)
        # rapids stay at least the clearance less sag off the stock; first and last are over the wall
        away = centre[p.motion == RAPID][:, 1] * outwards - 1.5 - 4.0
        assert away.min() > 1.5 - 0.5 - 0.31
        assert p.p_work[0, 2] >= 26.0 - 1e-9
        assert p.p_work[-1, 2] >= 26.0 - 1e-9
    lines = np.concatenate([leg.program.line for leg in legs])
    assert_allclose(lines, np.arange(1, len(lines) + 1))


def test_only_half_is_cut():
    """The second pass finds stock where u is above 0.5 (and in the interval before, where its depth rises)."""
    pass_motion = PassMotion(CutterPose(BALL, 0.05, -0.9, 0.0, TILT), 10.0, 100.0, 300.0, 1.5)
    leg = link_passes(two_passes()[1:2], [over(sides(-0.9), pass_motion)], PLACES)[0]
    assert leg.place[leg.contact, 0].min() == pytest.approx(0.5)


def test_feed_is_that_of_the_ball():
    pass_motion = PassMotion(CutterPose(BALL, 0.05, -0.9, 0.0, TILT), 10.0, 100.0, 300.0, 1.5)
    for leg in link_passes(two_passes(), [over(sides(-0.9), pass_motion)], PLACES):
        p = leg.program
        centre = p.p_work + 4.0 * p.axis
        k = np.flatnonzero((p.motion[1:] == LINE) & (p.motion[:-1] == LINE)) + 1
        seconds = np.linalg.norm(p.p_work[k] - p.p_work[k - 1], axis=1) / p.feed[k]
        assert_allclose(np.linalg.norm(centre[k] - centre[k - 1], axis=1) / seconds, 10.0, rtol=1e-9)


def test_refined_stays_between_its_neighbours():
    rng = np.random.default_rng(3)
    values = rng.uniform(0.0, 1.0, (5, 4))
    fine = refine_depths(values, PLACES, (np.linspace(0.0, 1.0, 33), np.linspace(0.3, 1.0, 25)))
    assert_allclose(fine[::8, ::8], values, atol=1e-12)
    for i in range(4):
        for j in range(3):
            corner, part = values[i : i + 2, j : j + 2], fine[8 * i : 8 * i + 9, 8 * j : 8 * j + 9]
            assert part.min() >= corner.min() - 1e-12
            assert part.max() <= corner.max() + 1e-12


def test_axis_below_the_horizontal_is_refused():
    pass_motion = PassMotion(CutterPose(BALL, 0.05, -0.9, 0.0, -TILT), 10.0, 100.0, 300.0, 1.5)
    with pytest.raises(
        InputError, match=r"stands -4\d\S* deg above the horizontal: lean it more towards the free edge"
    ):
        link_passes(two_passes()[:1], [over(sides(-0.9), pass_motion)], PLACES)
