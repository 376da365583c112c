"""Laws that any force model of milling keeps: energy, mirror images, rotation, scale, and the published ratios."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_along, mean_forces
from chipload.cutting.material import Material, material_named, material_names
from chipload.cutting.wall_error import wall_error_along
from chipload.engagement.tooth_engagement import engagement_of_arcs
from engagement.tooth_paths import Cut, true_loads

MILL = Cutter(10.0, 4, math.radians(30.0), 25.0, 35.0, 6e5)
NO_EDGE = Material("no edge", 800.0, 250.0, 150.0, 0.0, 0.0, 0.0, source="made up")

arcs = st.tuples(st.floats(0.0, math.pi), st.floats(0.0, math.pi)).map(sorted).filter(lambda x: x[1] - x[0] > 1e-3)


@settings(max_examples=60, deadline=None)
@given(arcs, st.integers(1, 8), st.floats(0.0, 70.0), st.floats(0.001, 0.3), st.floats(0.0, 0.05), st.floats(0.0, 6.2))
def test_energy(arc, flutes, helix, feed, offset, direction):
    """Mean torque x 2 pi / (N f_z) = Ktc x area of the cross-section R (cos in - cos out) x depth, with any runout."""
    mill = replace(MILL, flutes=flutes, helix=math.radians(helix), runout=(offset, direction))
    _, torque = mean_forces(engagement_of_arcs([arc[0]], [arc[1]], feed, mill, 5.0), mill, NO_EDGE)
    area = 5.0 * mill.radius * (math.cos(arc[0]) - math.cos(arc[1]))
    assert torque[0] * math.tau / (flutes * feed) == pytest.approx(NO_EDGE.Ktc * area, rel=1e-9)


def torque_energy(arc, feed, s, depth):
    """Torque's work, and that of torque and feed, per mm of the path over that of the volume removed; less 1.

    The machine gives T Omega - F v. A tooth sweeps h (Omega R + v_t) - Omega h^2 / 2 of the layer, v_t the feed along
    its edge's velocity: the paths of the teeth are farther from the axis than the middle of their chip. Only the
    tangential force does work here, as the chip is measured along the radius.
    """
    tangential = replace(NO_EDGE, Krc=0.0, Kac=0.0)
    out = forces_along([arc[0]], [arc[1]], feed, [[1.0, 0.0]], MILL, tangential, depth, spindle_speed=300.0)
    v = 4 * feed * 300.0 / math.tau
    a = arc[1] - arc[0]
    bend = 300.0 * 4 / math.tau * depth * 0.5 * feed**2 * (0.5 * a - 0.25 * math.sin(2.0 * a))
    torque = 1000.0 * out["power_w"][0]
    assert torque == pytest.approx(1000.0 * 300.0 * out["torque_mean_nm"][0], rel=1e-12)
    whole = torque - out["force_x_mean_n"][0] * v
    removed = s * depth * v
    return torque / (tangential.Ktc * removed) - 1.0, whole / (tangential.Ktc * (removed + bend)) - 1.0


@pytest.mark.parametrize("up", [True, False], ids=["up", "down"])
def test_energy_at_a_radial_depth(up):
    """Depth s at an engagement of 1 - cos a = s/R: torque and feed together do the work Ktc x volume, to the order of
    the chips, (f / R)^2; the torque alone is off by the share of the feed, c / R, and agrees with true paths.
    """
    a = math.acos(1.0 - 0.1 / 5.0)
    arc = (0.0, a) if up else (math.pi - a, math.pi)
    feeds = np.array([0.05, 0.025, 0.0125])
    alone, whole = np.transpose([torque_energy(arc, f, 0.1, 8.0) for f in feeds])
    shares = 4 * feeds / math.tau / 5.0
    assert (np.sign(alone) == (-1.0 if up else 1.0)).all()
    assert ((abs(alone) > 0.7 * shares) & (abs(alone) < 1.1 * shares)).all()
    assert (abs(whole) < 10.0 * (feeds / 5.0) ** 2).all()
    assert np.log2(abs(whole[:-1] / whole[1:])) == pytest.approx(2.0, abs=0.1)
    for f, off in zip(feeds, alone, strict=True):
        paths = Cut(10.0, 4, 30.0, 8.0, 0.1, f, up=up)
        torque = true_loads(paths, [NO_EDGE.Ktc, 0.0, 0.0, 0.0, 0.0, 0.0])[2]
        assert NO_EDGE.Ktc * 0.1 * 8.0 * (1.0 + off) == pytest.approx(torque * math.tau / (4 * f), rel=1e-3), f


def test_up_and_down_milling_are_mirror_images_in_the_mean():
    """phi -> pi - phi: the tangential part changes sign along T, the radial part along n; torque and axial stay."""
    a = 0.6
    tangential = replace(material_named("al7075-t6"), Krc=0.0, Kre=0.0)
    radial = replace(material_named("al7075-t6"), Ktc=10.0, Kte=0.0)
    for material, signs in ((tangential, [-1.0, 1.0, 1.0]), (radial, None)):
        up, torque_up = mean_forces(engagement_of_arcs([0.0], [a], 0.05, MILL, 5.0), MILL, material)
        down, torque_down = mean_forces(engagement_of_arcs([math.pi - a], [math.pi], 0.05, MILL, 5.0), MILL, material)
        assert torque_up[0] == pytest.approx(torque_down[0], rel=1e-12)
        if signs is not None:
            np.testing.assert_allclose(up[0] * signs, down[0], rtol=1e-12)
        else:
            assert up[0, 0] < 0.0 > up[0, 1]
            assert down[0, 0] < 0.0 < down[0, 1]


def test_mirror_image_of_the_whole_job():
    """Mirrored path, mirrored spindle, mirrored cutter: x and all sizes stay, y changes sign."""
    rng = np.random.default_rng(7)
    low = rng.uniform(0.0, 1.5, 40)
    high = low + rng.uniform(0.05, 1.5, 40)
    angle = rng.uniform(0.0, math.tau, 40)
    heading = np.column_stack([np.cos(angle), np.sin(angle)])
    al = material_named("al6082-t6")
    one = forces_along(low, high, 0.05, heading, MILL, al, 5.0, spindle_speed=300.0)
    other = forces_along(
        math.pi - high, math.pi - low, 0.05, heading * [1.0, -1.0], MILL, al, 5.0, spindle_speed=300.0, spindle="ccw"
    )
    for name, column in one.items():
        sign = -1.0 if name in ("force_y_n", "force_y_mean_n") else 1.0
        np.testing.assert_allclose(other[name], sign * column, rtol=1e-5, atol=1e-5)


def test_turning_the_work_turns_the_force():
    angle = np.linspace(0.0, 6.0, 9)
    heading = np.column_stack([np.cos(angle), np.sin(angle)])
    al = material_named("al7075-hss")
    out = forces_along(np.full(9, 2.6), np.full(9, math.pi), 0.05, heading, MILL, al, 5.0, spindle_speed=300.0)
    turned = (out["force_x_n"] + 1j * out["force_y_n"]) * np.exp(-1j * angle)
    np.testing.assert_allclose(turned, turned[0], rtol=1e-12)
    np.testing.assert_allclose(out["force_xy_n"], abs(turned[0]), rtol=1e-12)


def test_teeth_of_unlike_radii_agree_with_like_ones_as_the_runout_vanishes():
    al = material_named("al7075-t6")
    args = ([2.5], [math.pi], 0.05, [[1.0, 0.0]])
    none = forces_along(*args, MILL, al, 5.0, spindle_speed=300.0)
    little = forces_along(*args, replace(MILL, runout=(1e-9, 0.4)), al, 5.0, spindle_speed=300.0)
    for name, column in none.items():
        np.testing.assert_allclose(little[name], column, rtol=1e-4)
    wall = [
        wall_error_along(*args[:3], mill, al, 5.0, milling="down")["form_error_um"][0]
        for mill in (MILL, replace(MILL, runout=(1e-9, 0.4)))
    ]
    assert wall[1] == pytest.approx(wall[0], rel=1e-4)


@pytest.mark.parametrize("depth", [5.0, 10.0])
@pytest.mark.parametrize(
    "name", [n for n in material_names() if not (material_named(n).tangential or any(material_named(n).exponents))]
)
def test_the_paper_s_reduction_of_the_range_of_force(name, depth):
    """R 5, s 0.1, corner of 8 mm [Uddin2007]: 11.478 to 12.91 deg instead of 18.737 takes 75 to 84 % off the range."""
    a = np.radians([11.478, 12.91, 18.737])
    al = material_named(name)
    cost = forces_along(math.pi - a, np.full(3, math.pi), 0.05, [[1.0, 0.0]] * 3, MILL, al, depth, spindle_speed=300.0)
    cost["mean"] = np.hypot(cost["force_x_mean_n"], cost["force_y_mean_n"])
    cost |= wall_error_along(math.pi - a, np.full(3, math.pi), 0.05, MILL, al, depth, milling="down")
    for column in ("force_xy_n", "mean", "torque_nm", "form_error_um"):
        plain, backward = np.ptp(cost[column]), np.ptp(cost[column][:2])
        assert 0.75 < 1.0 - backward / plain < 0.84, column


def test_same_input_same_bytes():
    al = material_named("al7075-t6")
    low = np.random.default_rng(1).uniform(2.0, 3.0, 50)
    runs = [
        forces_along(low, np.full(50, math.pi), 0.05, [[1.0, 0.0]] * 50, MILL, al, 5.0, spindle_speed=300.0)
        for _ in range(2)
    ]
    for name in runs[0]:
        assert runs[0][name].tobytes() == runs[1][name].tobytes()
