"""Wall error against slices and hand formulas; e, C, phi as in chipload.cutting.wall_error."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.cutting.wall_error import wall_error_along, wall_profile
from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs
from chipload.engagement.tooth_surfaces import chips_of_teeth, tooth_radii
from chipload.errors import InputError
from chipload.structure.beam import compliance

AL = material_named("al7075-t6")
MILL = Cutter(10.0, 4, math.radians(30.0), 25.0, 35.0, 6e5)


def sliced_error(z, arc, feed, cutter, depth, milling, work=0.0, slices=20000):
    """e(z) by summing slices at the instant when tooth 0 passes the wall at height z."""
    zs = (np.arange(slices) + 0.5) * depth / slices
    lag = math.tan(cutter.helix) / cutter.radius
    gen = 0.0 if milling == "up" else math.pi
    load = np.zeros(slices)
    for j in range(cutter.flutes):
        phi = (gen + lag * (z - zs) - math.tau * j / cutter.flutes) % math.tau
        cut = (phi > arc[0]) & (phi < arc[1])
        h = feed * np.sin(phi)
        f = (AL.Ktc * h + AL.Kte) * np.sin(phi) - (AL.Krc * h + AL.Kre) * np.cos(phi)
        load += np.where(cut, f, 0.0)
    bend = np.sum(load * (compliance(cutter, zs, z) + work)) * depth / slices
    return bend if milling == "down" else -bend


@pytest.mark.parametrize(
    ("milling", "arc", "depth", "helix", "flutes"),
    [
        ("down", (math.pi - 0.3, math.pi), 5.0, 30.0, 4),
        ("down", (math.pi - 1.5, math.pi), 25.0, 45.0, 6),
        ("up", (0.0, 0.4), 6.0, 20.0, 3),
        ("up", (0.0, math.pi), 12.0, 40.0, 5),
    ],
)
def test_profile_equals_the_sum_of_slices(milling, arc, depth, helix, flutes):
    mill = replace(MILL, helix=math.radians(helix), flutes=flutes)
    engagement = engagement_of_arcs([arc[0]], [arc[1]], 0.05, mill, depth)
    z = np.linspace(0.01 * depth, 0.99 * depth, 7)
    ours = wall_profile(engagement, mill, AL, z, milling=milling, work_compliance=2e-6)[0]
    brute = np.array([sliced_error(x, arc, 0.05, mill, depth, milling, 2e-6) for x in z])
    assert np.abs(brute).max() > 1e-4
    np.testing.assert_allclose(ours, brute, rtol=0.0, atol=3e-4 * np.abs(brute).max())


def test_without_helix_down_milling_shows_the_edge_force_alone():
    """At phi = pi h = 0 on the front: e(z) = Kre integral of C(z', z) dz', whatever feed and engagement. The chip
    between true paths is f^2 / (2 R) thick there.
    """
    mill = replace(MILL, helix=0.0)
    zs = (np.arange(4000) + 0.5) * 6.0 / 4000
    z = np.array([0.0, 3.0, 6.0])
    expected = [AL.Kre * compliance(mill, zs, x).sum() * 6.0 / 4000 for x in z]
    for feed, a in ((0.01, 0.1), (0.2, 1.2)):
        engagement = engagement_of_arcs([math.pi - a], [math.pi], feed, mill, 6.0)
        np.testing.assert_allclose(wall_profile(engagement, mill, AL, z, milling="down")[0], expected, rtol=1e-6)
        worst = wall_error_along([math.pi - a], [math.pi], feed, mill, AL, 6.0, milling="down")
        # the paths of two teeth are f^2 / (2 R) apart there, what is left of the height of a feed mark
        more = 1.0 + AL.Krc * feed**2 / (2.0 * mill.radius) / AL.Kre
        assert worst["form_error_um"][0] == pytest.approx(1000.0 * expected[0] * more, rel=1e-4)
        assert worst["error_z_mm"][0] == 0.0


def test_signs_material_is_left_in_down_milling_and_taken_in_up_milling():
    """Ft alone pushes the cutter to its left, off a wall on the right, into a wall on the left."""
    a = 1.0
    tangential = replace(AL, Krc=0.0, Kre=0.0)
    down = wall_error_along([math.pi - a], [math.pi], 0.1, MILL, tangential, 5.0, milling="down")
    up = wall_error_along([0.0], [a], 0.1, MILL, tangential, 5.0, milling="up")
    assert down["form_error_signed_um"][0] == down["form_error_um"][0] > 1.0
    assert up["form_error_signed_um"][0] == -up["form_error_um"][0] < -1.0


def test_counter_clockwise_is_the_mirror_image():
    """M4 with the wall on the left is down milling: the arc [0, a] counted clockwise from n."""
    a = 0.4
    right = wall_error_along([math.pi - a], [math.pi], 0.05, MILL, AL, 5.0, milling="down")
    left = wall_error_along([0.0], [a], 0.05, MILL, AL, 5.0, milling="down", spindle="ccw")
    assert left["form_error_um"][0] == pytest.approx(right["form_error_um"][0], rel=1e-9)


@pytest.mark.parametrize(("milling", "depth"), [("down", 5.0), ("down", 25.0), ("up", 9.0)])
def test_worst_is_that_of_a_fine_profile(milling, depth):
    for a in (0.2, 0.5, 1.4):
        arc = (math.pi - a, math.pi) if milling == "down" else (0.0, a)
        mill = replace(MILL, helix=math.radians(38.0))
        worst = wall_error_along([arc[0]], [arc[1]], 0.05, mill, AL, depth, milling=milling)
        engagement = chips_of_teeth(engagement_of_arcs([arc[0]], [arc[1]], 0.05, mill, depth), mill)
        fine = wall_profile(engagement, mill, AL, np.linspace(0.0, depth, 3001), milling=milling)[0]
        assert worst["form_error_um"][0] == pytest.approx(1000.0 * np.abs(fine).max(), rel=1e-3)
        at = wall_profile(engagement, mill, AL, worst["error_z_mm"], milling=milling)[0, 0]
        assert worst["form_error_signed_um"][0] == pytest.approx(1000.0 * at, rel=1e-9)


def test_with_runout_the_greatest_tooth_makes_the_wall():
    """Stiff cutter: its excess of radius is taken away; soft work gives the edge force of one tooth back, and that of
    the chip between its path and that of the tooth before, which stood out by less.
    """
    stiff = replace(MILL, helix=0.0, runout=(0.01, 0.2), modulus=1e6, overhang=25.0)
    radii = tooth_radii(stiff)
    hard = wall_error_along([2.8], [math.pi], 0.05, stiff, AL, 0.01, milling="down")
    assert hard["form_error_signed_um"][0] == pytest.approx(-1000.0 * radii.max(), abs=0.02)
    soft = wall_error_along([2.8], [math.pi], 0.05, stiff, AL, 0.01, milling="down", work_compliance=1e-3)
    # tooth 0 stands out most; the least of what the teeth before left, m feeds before
    h = min((m * 0.05) ** 2 / 10.0 + radii[0] - radii[-m % 4] for m in (1, 2, 3, 4))
    given_way = 1e-3 * (AL.Krc * h + AL.Kre) * 0.01
    found = soft["form_error_signed_um"][0] - hard["form_error_signed_um"][0]
    assert found == pytest.approx(1000.0 * given_way, rel=1e-3)


def test_a_step_that_does_not_reach_the_wall_makes_none():
    out = wall_error_along([2.0, 2.0], [math.pi - 0.01, math.pi - 1e-7], 0.05, MILL, AL, 5.0, milling="down")
    assert out["wall_made"].tolist() == [False, True]
    assert out["form_error_um"][0] == 0.0
    assert out["form_error_um"][1] > 0.0


def test_work_that_gives_way_adds_the_whole_normal_force():
    mill = replace(MILL, helix=0.0)
    engagement = engagement_of_arcs([2.8], [math.pi], 0.05, mill, 4.0)
    rigid = wall_profile(engagement, mill, AL, [1.0], milling="down")[0, 0]
    soft = wall_profile(engagement, mill, AL, [1.0], milling="down", work_compliance=1e-4)[0, 0]
    assert soft - rigid == pytest.approx(1e-4 * AL.Kre * 4.0, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"milling": "left"}, "milling = 'left': must be up or down"),
        ({"work_compliance": -1.0}, "work_compliance = -1 mm/N: must be at least 0 (0 is rigid)"),
        ({"heights": 2}, "heights = 2: must be at least 3"),
        ({"spindle": "M3"}, "spindle = 'M3': must be cw or ccw"),
        (
            {"fluted_factor": 1.2},
            "cutter.fluted_factor = 1.2: must be above 0 and at most 1 (0.8 is usual for end mills)",
        ),
    ],
)
def test_refused(change, message):
    with pytest.raises(InputError) as err:
        wall_error_along([2.8], [math.pi], 0.05, MILL, AL, 5.0, **{"milling": "down", **change})
    assert str(err.value) == message


def test_refuses_heights_outside_the_cutter():
    engagement = engagement_of_arcs([2.8], [math.pi], 0.05, MILL, 4.0)
    with pytest.raises(InputError) as err:
        wall_profile(engagement, MILL, AL, [40.0], milling="down")
    assert str(err.value) == "z: must be heights from 0 to cutter.overhang_mm = 35"


def test_a_bite_counted_along_another_profile_is_the_same_wall():
    """The flank of a profile whose s begins elsewhere: heights and lags are what counts."""
    flat = engagement_of_arcs([2.6], [math.pi], 0.05, MILL, 6.0)
    rows = np.array(flat.rows)
    rows[:, 2:4] += 3.0 - 1.0
    lead = math.tan(MILL.helix) / 5.0
    edge = [[0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0], [3.0, 5.0, 1.0, 1.0, 0.0, lead, lead]]
    other = ToothEngagement(flat.start, rows, flat.tooth, np.ones(len(rows), dtype=int), edge)
    z = np.linspace(0.0, 6.0, 5)
    np.testing.assert_allclose(
        wall_profile(other, MILL, AL, z, milling="down"), wall_profile(flat, MILL, AL, z, milling="down"), rtol=1e-12
    )


def test_refuses_what_is_no_straight_flank():
    flat = engagement_of_arcs([2.6], [math.pi], 0.05, MILL, 6.0)
    edge = [[0.0, 4.0, 0.0, 0.6, 0.8, 0.0, 0.1]]
    with pytest.raises(InputError) as err:
        wall_profile(
            ToothEngagement(flat.start, flat.rows, flat.tooth, flat.slice, edge), MILL, AL, [1.0], milling="down"
        )
    assert str(err.value) == (
        "tooth engagement: row 0: rho = 4 mm, sin(kappa) = 0.6: the wall's error is known for a straight flank only, "
        "rho = 5 mm and sin(kappa) = 1"
    )
