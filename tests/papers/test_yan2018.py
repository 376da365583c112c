"""What [Yan2018] claims, on a plain wall: variable depths take less time than a constant one at no more deflection.

The paper's own numbers are not at hand; what is found here stands in docs/design/thinwall.md.
"""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.planning.thinwall.blank import SIDES, WallBlank
from chipload.planning.thinwall.depth import DepthRange, normal_force
from chipload.planning.thinwall.force_table import law_of
from chipload.planning.thinwall.passes import constant, least_first_depth, variable
from chipload.planning.thinwall.paths import PassMotion, gouges, pass_programs, rows_of, seconds
from chipload.planning.thinwall.plane_stock import CutterPose
from chipload.structure.grid import plate
from chipload.structure.places import MeshPlaces, normals_of, on_cut, on_side
from chipload.structure.solid import SolidWorkpiece, factorise, full_compliance

TITANIUM = Material("titanium", 1900.0, 600.0, 300.0, 24.0, 20.0, 5.0, source="made up, of the usual size")
BALL = Cutter(8.0, 2, math.radians(30.0), 20.0, 30.0, 6e5, corner_radius=4.0)
POSTURE = CutterPose(BALL, 0.05, -0.4, math.radians(15.0))
GOING = PassMotion(POSTURE, 10.0, 100.0, 800.0, 2.0)
DEFLECTION = 0.1


@pytest.fixture(scope="module")
def plans():
    """Wall of 100 x 60 x 3 mm with 1 mm of stock on both sides."""
    grid = plate(100.0, 60.0, 5.0, (20, 12, 1))
    wall = WallBlank(SolidWorkpiece(grid, 114000.0, 0.34, 4.43e-9, grid.side("j-"), rule=8), (1.0, 1.0))
    surfaces = [wall.surface(s) for s in wall.sides()]
    law = law_of(POSTURE, TITANIUM, DepthRange(0.01, 1.0), measure="greatest")

    def bears(limit):
        return lambda left, side: wall.threshold(left, SIDES[side], limit)

    allowed = bears(DEFLECTION)
    even = constant(surfaces, allowed, law, least_first_depth(surfaces, allowed, law))
    least = even.deflection_max
    assert least is not None
    plain = constant(surfaces, allowed, law, 1.0, "unconstrained")
    return wall, surfaces, law, variable(surfaces, bears(least), law, 0.1), even, plain


def minutes(plan, surfaces):
    return sum(seconds(p, GOING.rapid) for p in pass_programs(plan.passes, surfaces, GOING)) / 60.0


def test_less_time_at_no_more_deflection(plans):
    _, surfaces, _, uneven, even, plain = plans
    assert uneven.holds
    assert even.holds
    assert not uneven.infeasible
    assert uneven.deflection_max <= even.deflection_max <= DEFLECTION
    assert minutes(uneven, surfaces) < 0.5 * minutes(even, surfaces)
    assert plain.deflection_max > DEFLECTION
    assert not plain.holds


def test_every_pass_in_its_own_state(plans):
    """Force by the engagement ranges of the depth itself, compliance by the full tensor of a workpiece made for the
    pass.
    """
    wall, _, _, uneven, _, _ = plans
    for p in uneven.passes[-2:]:
        other = next((q for q in uneven.passes[-2:] if q.side != p.side), p)
        left = [np.zeros(wall.shape), np.zeros(wall.shape)]
        left[p.side] = p.low
        left[1 - p.side] = other.high if p.side == 0 else other.low
        solid = wall.state(left)
        u, v = np.array([0.0, 0.5, 1.0, 0.5]), np.array([1.0, 1.0, 1.0, 0.5])
        side = SIDES[p.side]
        places = on_cut(on_side(solid.grid, side, u, v), solid.kept, side)
        n = normals_of(solid.grid, places, side)
        C = np.einsum("pi,pij,pj->p", n, full_compliance(factorise(solid), MeshPlaces(places.element, places.local)), n)
        at = (20 * u).astype(int), (12 * v).astype(int)
        force = normal_force(POSTURE, TITANIUM, p.depth[at], measure="greatest")
        assert_allclose(p.deflection[at], force * C, rtol=0.01)
        assert (force <= p.threshold.force.reshape(wall.shape)[at] * 1.01).all()


def test_deeper_where_the_wall_is_stiffer(plans):
    """First pass: least at the corners of the free edge, more in its middle, most towards the clamp."""
    depth = plans[3].passes[-1].depth
    assert depth.min() == pytest.approx(depth[[0, -1], -1].min())
    assert depth[0, -1] < depth[10, -1] <= depth[10, 6] <= depth[10, 0]
    assert_allclose(depth, depth[::-1], rtol=1e-6)


def test_nothing_is_gouged(plans):
    _, surfaces, _, uneven, _, _ = plans
    for p in uneven.passes:
        rows = rows_of(surfaces[p.side], p.low, p.high, POSTURE)
        assert len(gouges(rows, surfaces[p.side], p.low, POSTURE, 0.005)) == 0
