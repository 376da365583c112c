"""What a torque does to a wall: the two parts of a load, the allowable torque, the error along the path."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.control.plant import Ended, Outcome, TorqueProfile
from chipload.control.wall import (
    Loads,
    UnitResponse,
    WallPath,
    path_limit,
    row_means,
    two_parts,
    unit_response,
    wall_error,
)
from chipload.cutter.cutter import Cutter
from chipload.cutting.force import mean_forces
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.errors import InputError
from chipload.structure.shell import Shell, compliance, equivalent, ritz, stress


def column(*values):
    return np.array(values, dtype=np.float64)


def test_both_parts_are_those_of_the_law():
    """Mean torque of an engaged arc: N b R / 2 pi [Ktc c (cos st - cos ex) + Kte (ex - st)], each part by itself."""
    mill = Cutter(10.0, 3, 0.0, 20.0, 30.0, 6e5)
    whole = Material("x", 700.0, 200.0, 0.0, 12.0, 10.0, 0.0, source="made up")
    light = Material("x", 10.0, 200.0 / 70.0, 0.0, 12.0, 10.0, 0.0, source="made up")
    start, end, feed, depth = 2.0, math.pi, 0.1, 3.0
    engagement = engagement_of_arcs([start], [end], feed, mill, depth)
    torque, little = (mean_forces(engagement, mill, m)[1] for m in (whole, light))
    parts = two_parts(torque, torque, little, little, 10.0 / 700.0)
    scale = 3 * depth * 5.0 / math.tau
    assert parts.torque_cut[0] == pytest.approx(scale * 700.0 * feed * (math.cos(start) - math.cos(end)), rel=1e-6)
    assert parts.torque_edge[0] == pytest.approx(scale * 12.0 * (end - start), rel=1e-6)


@pytest.mark.parametrize("little", [0.0, 1.0, math.nan])
def test_a_share_that_splits_nothing(little):
    one = np.ones(1)
    with pytest.raises(InputError, match="must be above 0 and below 1"):
        two_parts(one, one, one, one, little)


LOADS = Loads(column(40.0, 40.0, 20.0), column(160.0, 60.0, 10.0), column(30.0, 30.0, 10.0), column(100.0, 90.0, 8.0))


def test_the_limit_by_hand():
    """40 um at 0.5 um/N are 80 N, at 0.4 um/N 100 N: overrides 0.5 and 7/9, torques 120 and 86.7; the third step bears
    more than it is asked at the programmed feed."""
    wall = UnitResponse(column(5e-4, 4e-4, 5e-4), column(1.0, 1.0, 1.0))
    found = path_limit(LOADS, wall, 0.04, 1000.0)
    assert found.torque == pytest.approx(40.0 + 60.0 * 7.0 / 9.0)
    assert (found.by, found.step) == ("deflection", 1)
    assert found.force == pytest.approx(100.0)
    assert found.each.tolist() == pytest.approx([120.0, 40.0 + 60.0 * 7.0 / 9.0, 20.0 + 10.0 * 70.0 / 8.0])


def test_the_limit_by_strength():
    """60 MPa at 1 MPa/N are 60 N: less than the 80 N of the deflection."""
    wall = UnitResponse(column(5e-4, 1e-4, 5e-4), column(1.0, 0.1, 1.0))
    found = path_limit(LOADS, wall, 0.04, 60.0)
    assert (found.by, found.step, found.force) == ("strength", 0, pytest.approx(60.0))
    assert found.torque == pytest.approx(40.0 + 160.0 * 0.3)


def test_a_wall_that_bears_the_programmed_feed():
    """Nowhere is the limit reached at an override of 1: it is that of the place that is nearest to it."""
    wall = UnitResponse(np.full(3, 1e-4), np.full(3, 0.1))
    found = path_limit(LOADS, wall, 0.04, 1e3)
    assert found.step == 0
    assert found.torque == pytest.approx(40.0 + 160.0 * 3.7)


def test_a_limit_that_cannot_be_attained():
    """20 N are allowed, the edge alone takes 30."""
    found = path_limit(LOADS, UnitResponse(np.full(3, 1e-3), np.full(3, 0.1)), 0.02, 1e3)
    assert (found.torque, found.by, found.step) == (0.0, "deflection", 1)


def test_nothing_on_the_wall():
    with pytest.raises(InputError, match="cuts nothing from the wall"):
        path_limit(LOADS, UnitResponse(np.zeros(3), np.zeros(3)), 0.02, 1e3)


def test_at_the_limit_the_wall_gives_way_by_what_is_allowed():
    """The same by the shell itself, place by place, and by stresses all over the wall at a random torque below."""
    modes = ritz(Shell(20.0, 60.0, 1.5, 70e3, 0.33), 30, 20)
    near, far = column(0.0, 50.0, 55.0), column(0.0, 53.0, 60.0)
    tool = column(1e-5, 2e-5, 3e-5)
    wall = unit_response(modes, near, far, 4.0, tool)
    assert wall.compliance[0] == 0.0
    for k, (middle, length) in enumerate(((51.5, 3.0), (57.5, 5.0)), start=1):
        alone = float(compliance(modes, middle, s_point=far[k], length=length, width=4.0)[2, 2])
        assert wall.compliance[k] == pytest.approx(alone + tool[k], rel=1e-12)
        around = max(
            float(equivalent(stress(modes, middle, s, np.linspace(0.0, 0.3, 7), face, length, 4.0)).max())
            for s in np.linspace(0.0, 60.0, 61)
            for face in (True, False)
        )
        # the patch and the clamp are looked at, nothing between them is strained more
        assert wall.stress[k] == pytest.approx(around, rel=0.05)
    found = path_limit(LOADS, wall, 0.04, 1e4)
    override = (found.torque - LOADS.torque_edge[found.step]) / LOADS.torque_cut[found.step]
    force = LOADS.force_edge[found.step] + override * LOADS.force_cut[found.step]
    assert force * wall.compliance[found.step] == pytest.approx(0.04, rel=1e-9)


def test_row_means():
    assert row_means(column(1.0, 3.0, 7.0)).tolist() == [1.0, 2.0, 5.0, 7.0]


def test_the_error_along_a_path():
    """Half of the programmed feed, the spindle 10 % slow: (edge + cut 0.5 / 0.9) times the compliance of the step; none
    where no surface is made, or nothing moves."""
    s = column(0.0, 10.0, 20.0)
    path = WallPath(s, np.full(3, 20.0), np.full(3, 90.0), column(1e-3, 0.0))
    profile = TorqueProfile(s, np.full(3, 10.0), np.zeros(3), np.ones(3))
    n = 4
    out = Outcome(
        True, Ended.PATH, 1.0, 1.0, 1.0, 0.0, np.arange(n), column(0.0, 5.0, 5.0, 15.0), column(5.0, 5.0, 0.0, 5.0),
        np.ones(n), np.ones(n), np.ones(n), column(90.0, 90.0, 90.0, 90.0), np.zeros(n, dtype=np.int64),
    )  # fmt: skip
    assert wall_error(path, profile, out, 100.0).tolist() == pytest.approx([0.07, 0.07, 0.0, 0.0])
