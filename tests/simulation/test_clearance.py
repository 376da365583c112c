"""Distances of points from a moving tool: closed forms of what a tool leaves, and many places by brute force."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.clearance.body import above_cutting, cutting_part
from chipload.simulation.clearance.clearance import clearance
from chipload.simulation.steps import steps_of

BALL = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0)
BULL = Cutter(12.0, 4, 0.5, 20.0, 30.0, 6e5, corner_radius=2.0)
FLAT = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
CONE = Cutter(6.0, 2, 0.5, 15.0, 30.0, 6e5, corner_radius=1.0, taper=math.radians(8.0), bottom=math.radians(10.0))


def line(*points):
    """Steps of a path at a feed."""
    moves = [rapid(points[0], 0, 1, "way"), *(plunge(p, 10.0, 800.0, 1, "cut") for p in points[1:])]
    return steps_of(Program.join(moves), 2.0, 0.001)


def distances(cutter, steps, points, far=50.0, tolerance=1e-4, body=cutting_part):
    return clearance(steps, {1: body(cutter)}, points, far, tolerance).distance


def test_a_ball_along_a_line():
    """Below the tip's line the distance is that from the line of centres, less the radius."""
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(1, 29, 400), rng.uniform(-9, 9, 400), rng.uniform(-4, 4.9, 400)])
    found = distances(BALL, line([0, 0, 0], [30, 0, 0]), points)
    expected = np.hypot(points[:, 1], points[:, 2] - 5.0) - 5.0
    shallow = expected > -2.0
    np.testing.assert_allclose(found[shallow], expected[shallow], atol=1.7e-4)
    np.testing.assert_allclose(found, expected, atol=5e-3)


def test_cusps_between_two_passes_of_a_ball():
    """Half way between passes s apart the material is R - sqrt(R^2 - s^2/4) high."""
    s = 1.2
    steps = line([0, 0, 0], [30, 0, 0], [30, s, 0], [0, s, 0])
    height = 5.0 - math.sqrt(25.0 - 0.25 * s * s)
    points = [[15.0, 0.5 * s, 0.0], [15.0, 0.5 * s, height], [15.0, 0.0, 0.0]]
    a, b, c = distances(BALL, steps, points)
    assert a == pytest.approx(math.hypot(0.5 * s, 5.0) - 5.0, abs=1.1e-4)
    assert abs(b) < 1.1e-4
    assert abs(c) < 1.1e-4


@pytest.mark.parametrize("cutter", [BALL, BULL, FLAT, CONE], ids=["ball", "bull", "flat", "cone"])
def test_against_places_by_brute_force(cutter):
    """A slanting path, the profile as fine chords: signed distance to a polygon by its nearest side."""
    rng = np.random.default_rng(7)
    path = np.array([[0.0, 0.0, 0.0], [6.0, 1.0, -3.0], [9.0, -4.0, -3.0]])
    points = rng.uniform([-8, -9, -6], [16, 8, 10], (200, 3))
    found = distances(cutter, line(*path), points, tolerance=2e-3)
    profile = cutter.profile(1e-4)
    u = np.linspace(0.0, 1.0, 800)
    tips = np.concatenate([path[i] + u[:, None] * (path[i + 1] - path[i]) for i in range(2)])
    best = np.full(len(points), np.inf)
    for k, p in enumerate(points):
        rel = p - tips
        rho, z = np.hypot(rel[:, 0], rel[:, 1]), rel[:, 2]
        gap = np.full(len(tips), np.inf)
        for (x0, y0), (x1, y1) in pairwise(profile):
            dx, dy = x1 - x0, y1 - y0
            t = np.clip(((rho - x0) * dx + (z - y0) * dy) / (dx * dx + dy * dy), 0.0, 1.0)
            gap = np.minimum(gap, np.hypot(rho - x0 - t * dx, z - y0 - t * dy))
        at = np.interp(z, *np.maximum.accumulate(profile[:, ::-1] + np.arange(len(profile))[:, None] * [1e-12, 0]).T)
        inside = (z >= 0.0) & (z <= cutter.flute_length) & (rho <= at)
        best[k] = np.where(inside, -gap, gap).min()
    shallow = best > -0.7
    np.testing.assert_allclose(found[shallow], best[shallow], atol=2.5e-3)
    assert ((best < -0.2) & shallow).sum() >= 5
    assert (best > 0.5).sum() > 20


def test_a_tool_that_turns():
    """A ball whose axis turns about its centre stays where it is below."""
    turn = math.radians(40.0)
    centre = np.array([0.0, 0.0, 5.0])
    axes = [np.array([math.sin(a), 0.0, math.cos(a)]) for a in np.linspace(0.0, turn, 30)]
    tips = centre - 5.0 * np.array(axes)
    program = Program.join([rapid(tips[0], 0, 1, "way"), plunge(tips[1:], 10.0, 800.0, 1, "cut")])
    steps = steps_of(replace(program, axis=np.array(axes)), 2.0, 0.001)
    around = np.linspace(math.pi * 1.1, math.pi * 1.55, 40)
    points = np.column_stack([7.0 * np.cos(around), np.zeros(40), 5.0 + 7.0 * np.sin(around)])
    found = distances(BALL, steps, points)
    np.testing.assert_allclose(found, 2.0, atol=1.5e-3)


def test_the_holder_is_held_apart_from_the_cutting_part():
    cutter = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5, holder=((25.0, 40.0),))
    wall = [[12.0, 0.0, 10.0], [12.0, 0.0, 29.0], [12.0, 0.0, 31.0], [26.0, 0.0, 40.0]]
    steps = line([0, 0, 0], [0, 3, 0])
    cutting = distances(cutter, steps, wall)
    above = distances(cutter, steps, wall, body=above_cutting)
    np.testing.assert_allclose(cutting[0], 7.0, atol=1e-4)
    np.testing.assert_allclose(above, [math.hypot(7.0, 10.0), 1.0, -1.0, 6.0], atol=1e-4)


def test_far_points_and_no_work():
    found = clearance(line([0, 0, 0], [1, 0, 0]), {1: cutting_part(BALL)}, [[0.0, 0.0, -3.0]], 2.0, 1e-3)
    assert (found.distance.tolist(), found.step.tolist()) == ([math.inf], [-1])
    with pytest.raises(InputError, match="clearance: far = 0: must be above 0 mm"):
        clearance(line([0, 0, 0], [1, 0, 0]), {1: cutting_part(BALL)}, [[0.0, 0.0, -3.0]], 0.0, 1e-3)


def test_one_worker_and_two_find_the_same():
    rng = np.random.default_rng(3)
    points = rng.uniform(-9, 9, (500, 3))
    steps = line([0, 0, 0], [6, 1, -3], [9, -4, -3])
    one, two = (clearance(steps, {1: cutting_part(BULL)}, points, 3.0, 1e-3, workers=w) for w in (1, 2))
    assert one.distance.tobytes() == two.distance.tobytes()
    assert one.step.tobytes() == two.step.tobytes()


@pytest.mark.parametrize(("low", "far"), [(15.55, 0.05), (29.0, 2.0)], ids=["at the end of the flutes", "in the shank"])
def test_a_small_block_of_many_points_in_a_shank(low, far):
    """Cells that nothing can change are left out: every point has its distance from the cylinders of the tool."""
    cutter = Cutter(10.0, 4, 0.5, 20.0, 40.0, 6e5, shank_diameter=12.0, holder=((25.0, 40.0),))
    x, y, z = (a.ravel() for a in np.meshgrid(np.linspace(-4, 4, 14), np.linspace(3, 9, 12), np.linspace(0, 6, 12)))
    points = np.column_stack([x, y, z + low])
    path = np.array([[-9.0, 5.0, 0.0], [9.0, 5.0, 0.0], [9.0, 8.0, 4.0], [-9.0, 8.0, 4.0]])
    found = clearance(line(*path), {1: above_cutting(cutter)}, points, far, 1e-4)
    u = np.linspace(0.0, 1.0, 1500)
    tips = np.concatenate([path[i] + u[:, None] * (path[i + 1] - path[i]) for i in range(3)])
    best = np.full(len(points), np.inf)
    for tip in tips:
        rho, height = np.hypot(points[:, 0] - tip[0], points[:, 1] - tip[1]), points[:, 2] - tip[2]
        gap = np.full(len(points), np.inf)
        for (r0, z0), (r1, z1) in (((5, 20), (6, 20)), ((6, 20), (6, 40)), ((6, 40), (20, 40)), ((20, 40), (20, 65))):
            at = np.clip(((rho - r0) * (r1 - r0) + (height - z0) * (z1 - z0)) / math.hypot(r1 - r0, z1 - z0) ** 2, 0, 1)
            gap = np.minimum(gap, np.hypot(rho - r0 - at * (r1 - r0), height - z0 - at * (z1 - z0)))
        inside = ((height >= 20.0) & (height <= 40.0) & (rho <= 6.0)) | ((height >= 40.0) & (rho <= 20.0))
        best = np.minimum(best, np.where(inside & (height <= 65.0), -gap, gap))
    best[best > far] = np.inf
    near = np.isfinite(best) & np.isfinite(found.distance)
    assert near.sum() > 50
    # deep points differ by the distance of two places
    np.testing.assert_allclose(found.distance[near], best[near], atol=0.07)
    shallow = near & (best > -0.7)
    np.testing.assert_allclose(found.distance[shallow], best[shallow], atol=7e-3)
    assert (found.distance[near] >= best[near] - 1e-2).all()
    # what is looked for ends where it should
    assert (np.isfinite(found.distance) == np.isfinite(best))[np.abs(best - far) > 0.07].all()
