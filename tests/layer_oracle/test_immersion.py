"""Tooth engagement in layered material against closed arcs, closed volumes and brute force."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import Slices, slices
from chipload.engagement.tooth_engagement import tool_frame
from chipload.errors import InputError
from layer_oracle.immersion import Section, engagement_rows

Floats = NDArray[np.float64]
MILL = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
BULL = Cutter(12.0, 3, 0.4, 20.0, 30.0, 6e5, corner_radius=3.0)
BALL = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0)
TAPER = Cutter(6.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=1.0, taper=0.1)
UP = (0.0, 0.0, 1.0)


def section_of(polygons: list[shapely.Geometry], bounds: list[float]) -> Section:
    edges, start = [], [0]
    for shape in polygons:
        for ring in shapely.get_rings(shapely.get_parts(shape)):
            p = shapely.get_coordinates(ring)
            edges.append(np.hstack([p[:-1], p[1:]]))
        start.append(sum(len(e) for e in edges))
    return Section(np.array(bounds), np.array(start), np.vstack([*edges, np.empty((0, 4))]))


def volume(rows: Floats, owner: NDArray[np.int64], cutter: Slices, teeth: int) -> float:
    """Integral of h rho dphi ds over all teeth: what a revolution removes [mm^3]."""
    p, q, a, b, along, offset, across = rows.T
    h = along * (np.cos(p) - np.cos(q)) + across * (np.sin(q) - np.sin(p)) + offset * (q - p)
    return teeth * float((h * cutter.rho[owner] * (b - a)).sum())


@pytest.mark.parametrize("depth", [0.1, 2.0, 5.0, 9.9])
def test_an_upright_flank_at_a_straight_wall_meets_the_closed_arc(depth: float) -> None:
    wall = shapely.box(-50.0, -50.0, 50.0, depth - 5.0)
    section = section_of([wall, wall], [0.0, 1.3, 4.0])
    frame = tool_frame(UP, (1.0, 0.0, 0.0))
    rows, _ = engagement_rows((0.0, 0.0, 0.7), frame, (0.05, 0.0, 0.0), (0.0, 0.0, 0.0), slices(MILL), section)
    flank = rows[rows[:, 2] >= 0.0]
    # material on the right of travel: down milling, from pi - a to pi, cos a = 1 - depth / R
    a = math.acos(1.0 - depth / 5.0)
    assert flank[:, 0] == pytest.approx(np.full(2, math.pi - a), abs=1e-12)
    assert flank[:, 1] == pytest.approx(np.full(2, math.pi), abs=1e-8)
    assert sorted(flank[:, 2:4].ravel().round(12).tolist()) == pytest.approx([0.0, 0.6, 0.6, 3.3])
    assert flank[:, 4:] == pytest.approx(np.tile([0.05, 0.0, 0.0], (2, 1)), abs=1e-15)
    assert len(rows) == len(flank)  # a level move cuts nothing with the bottom


def test_a_counter_clockwise_spindle_counts_from_the_other_side() -> None:
    wall = shapely.box(-50.0, -50.0, 50.0, -3.0)
    section = section_of([wall], [0.0, 4.0])
    frame = tool_frame(UP, (1.0, 0.0, 0.0), clockwise=False)
    rows, _ = engagement_rows((0.0, 0.0, 0.0), frame, (0.05, 0.0, 0.0), (0.0, 0.0, 0.0), slices(MILL), section)
    assert rows[:, :2].ravel() == pytest.approx([0.0, math.acos(1.0 - 2.0 / 5.0)], abs=1e-8)


def test_a_plunge_cuts_with_the_whole_bottom_what_it_is_fed() -> None:
    section = section_of([shapely.box(-20.0, -20.0, 20.0, 20.0)] * 4, [-2.0, -1.0, 0.0, 1.0, 2.0])
    cutter = slices(MILL)
    frame = tool_frame(UP, (0.0, 0.0, -1.0))
    rows, owner = engagement_rows((1.0, 2.0, 0.3), frame, (0.0, 0.0, -0.04), (0.0, 0.0, 0.0), cutter, section)
    assert (cutter.cos_kappa[owner] == 1.0).all()
    assert volume(rows, owner, cutter, 4) == pytest.approx(4 * 0.04 * math.pi * 25.0, rel=1e-12)


def test_a_half_drilled_hole_cuts_where_there_is_material_below() -> None:
    section = section_of([shapely.box(0.0, -20.0, 20.0, 20.0)], [-1.0, 0.0])
    cutter = slices(MILL)
    frame = tool_frame(UP, (0.0, 0.0, -1.0))
    rows, owner = engagement_rows((0.0, 0.0, -0.2), frame, (0.0, 0.0, -0.04), (0.0, 0.0, 0.0), cutter, section)
    assert volume(rows, owner, cutter, 4) == pytest.approx(2 * 0.04 * math.pi * 25.0, rel=1e-9)


@pytest.mark.parametrize("cutter", [MILL, BULL, BALL, TAPER], ids=["flat", "bull", "ball", "taper"])
def test_a_full_slot_removes_the_area_of_the_profile_times_the_feed(cutter: Cutter) -> None:
    """Oracle: half the profile, integrated by radius_at, times two, times the feed of a revolution."""
    depth, layers = 4.0, 400
    section = section_of([shapely.box(-50.0, -50.0, 50.0, 50.0)] * layers, np.linspace(0.0, depth, layers + 1).tolist())
    fine = slices(cutter, corner_slices=200, flank_mm=0.05)
    frame = tool_frame(UP, (0.0, 1.0, 0.0))
    rows, owner = engagement_rows((3.0, 2.0, 0.0), frame, (0.0, 0.03, 0.0), (0.0, 0.0, 0.0), fine, section)
    z = (np.arange(20000) + 0.5) * depth / 20000
    area = 2.0 * cutter.radius_at(z).sum() * depth / 20000
    assert volume(rows, owner, fine, cutter.flutes) == pytest.approx(cutter.flutes * 0.03 * area, rel=2e-3)


@pytest.mark.parametrize("seed", range(12))
def test_random_poses_agree_with_sampled_membership_in_the_solid_itself(seed: int) -> None:
    """Oracle: points of the edge and their thickness by definition, in the half space that was cut up."""
    rng = np.random.default_rng(seed)
    cutter = [MILL, BULL, BALL, TAPER][seed % 4]
    bounds = np.linspace(-8.0, 8.0, 321)
    normal = np.array([*rng.normal(size=2) * 0.6, 1.0])
    offset = rng.uniform(0.5, 3.0)
    far = 60.0
    shapes = []
    for z in 0.5 * (bounds[1:] + bounds[:-1]):
        n2 = normal[:2] / np.linalg.norm(normal[:2])
        d = (offset - z * normal[2]) / np.linalg.norm(normal[:2])
        t = np.array([-n2[1], n2[0]])
        corners = [n2 * d + t * far, n2 * d - t * far, n2 * (d - far) - t * far, n2 * (d - far) + t * far]
        shapes.append(shapely.Polygon(corners))
    axis = rng.normal(size=3) * (0.3, 0.3, 0.0) * (seed % 3 > 0) + UP
    axis /= np.linalg.norm(axis)
    feed, turn = rng.normal(size=3) * (0.1, 0.1, 0.03), rng.normal(size=3) * 0.003
    turn = turn - (turn @ axis) * axis
    fine = slices(cutter, corner_slices=60, flank_mm=0.1, bottom_slices=60)
    frame = tool_frame(axis, feed, clockwise=bool(seed % 2))
    rows, owner = engagement_rows((0.0, 0.0, 0.0), frame, feed, turn, fine, section_of(shapes, bounds.tolist()))
    phi = (np.arange(2000) + 0.5) * math.tau / 2000
    u = np.cos(phi)[:, None] * frame[1] + np.sin(phi)[:, None] * frame[0]
    true = 0.0
    for k in range(len(fine)):
        p = fine.z_middle[k] * axis + fine.rho[k] * u
        h = ((feed + np.cross(turn, p)) * (fine.sin_kappa[k] * u - fine.cos_kappa[k] * axis)).sum(axis=1)
        there = (p @ normal < offset) & (p[:, 2] > -8.0) & (p[:, 2] < 8.0) & (h > 0.0)
        true += float((h * there).mean()) * math.tau * fine.rho[k] * float(fine.s_to[k] - fine.s_from[k])
    assert true > 1e-3
    assert volume(rows, owner, fine, 1) == pytest.approx(true, rel=0.025)


def test_points_of_the_edge_lie_on_the_cutter() -> None:
    """With 12 slices the mean height of an arc's ends is up to 13 um inside a ball of 6 mm: short steps find air."""
    ball = slices(Cutter(12.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=6.0), corner_slices=12)
    arc = ball.radius > 0.0
    assert np.hypot(ball.rho[arc], 6.0 - ball.z_middle[arc]) == pytest.approx(6.0, abs=1e-12)
    tops = np.append(ball.z[1:][arc[:-1]], 6.0)[: arc.sum()]
    assert np.abs(0.5 * (ball.z[arc] + tops) - ball.z_middle[arc]).max() == pytest.approx(0.0127, abs=2e-4)


def test_an_axis_that_lies_is_refused() -> None:
    section = section_of([shapely.box(0.0, 0.0, 1.0, 1.0)], [0.0, 1.0])
    frame = tool_frame((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    with pytest.raises(InputError, match=r"axis z = 0: must be above 0"):
        engagement_rows((0.0, 0.0, 0.0), frame, (0.0, 0.1, 0.0), (0.0, 0.0, 0.0), slices(MILL), section)
