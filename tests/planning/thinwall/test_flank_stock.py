"""Force of a flank against plane stock: closed form of the mean of the engaged front in up and down milling, the
greatest force and that of a bull nose against sums over the surface of the cutter, by the true paths of its teeth."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import mean_forces
from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.planning.thinwall.depth import DepthRange, largest_depths, normal_force
from chipload.planning.thinwall.flank_stock import FlankPose
from chipload.planning.thinwall.force_table import law_on_stock
from engagement.tooth_paths import loads

STRAIGHT = Cutter(10.0, 4, 0.0, 20.0, 30.0, 6e5)
MILL = Cutter(8.0, 4, math.radians(30.0), 20.0, 30.0, 6e5)
BULL = Cutter(8.0, 4, math.radians(30.0), 20.0, 30.0, 6e5, corner_radius=0.8)
FULL = Material("full", 1500.0, 600.0, 250.0, 20.0, 15.0, 5.0, source="made up")


def closed_form(pose, d):
    """Mean normal force: N b / 2 pi times the integrals of (+-) Ft sin + Fr cos from the wall to psi."""
    psi, f, b, N = math.acos(1.0 - d / pose.cutter.radius), pose.feed_per_tooth, abs(pose.step), pose.cutter.flutes
    Ktc, Krc, _, Kte, Kre, _ = FULL.coefficients
    # chip f sin(psi'); the radial force pushes off the wall, in down milling the tangential one too
    radial = Krc * f * math.sin(psi) ** 2 / 2.0 + Kre * math.sin(psi)
    tangential = Ktc * f * (psi - math.sin(psi) * math.cos(psi)) / 2.0 + Kte * (1.0 - math.cos(psi))
    return N * b / math.tau * (radial + (tangential if pose.down else -tangential))


def summed(pose, d, turns=720, n=600):
    """Normal force over the rotations of a pitch: every piece of the edge by the true paths of the teeth."""
    cutter, b = pose.cutter, abs(pose.step)
    R, r, N = cutter.radius, cutter.corner_radius, cutter.flutes
    corner = (np.arange(n) + 0.5) * (0.5 * math.pi / n)
    top = b + r
    flank = r + (np.arange(4 * n) + 0.5) * ((top - r) / (4 * n))
    h = np.concatenate([r * (1.0 - np.cos(corner)), flank]) if r else flank
    rho = np.concatenate([R - r + r * np.sin(corner), np.full(4 * n, R)]) if r else np.full(4 * n, R)
    sine = np.concatenate([np.sin(corner), np.ones(4 * n)]) if r else np.ones(4 * n)
    size = (
        np.concatenate([np.full(n, r * 0.5 * math.pi / n), np.full(4 * n, (top - r) / (4 * n))])
        if r
        else np.full(4 * n, top / (4 * n))
    )
    above = h - b
    # the stock begins at this distance from the axis towards the wall: the surface, or what the row before has left
    before = np.where(above < 0.0, -1.0, R - r + np.sqrt(np.maximum(r * r - (r - np.clip(above, 0.0, r)) ** 2, 0.0)))
    wall = np.maximum(R - d, before)
    lag = h * math.tan(cutter.helix) / R
    slices = np.column_stack([rho, sine, np.sqrt(np.maximum(1.0 - sine**2, 0.0)), lag, size])
    theta, rate = np.arange(turns) * math.tau / N / turns, N * pose.feed_per_tooth / math.tau
    F, torque, thick = np.zeros((turns, 3)), np.zeros(turns), np.zeros(turns)
    K, pitch = np.array(FULL.coefficients), np.full(N, math.tau / N)
    for piece, low in zip(slices[:, None], wall, strict=True):
        # up milling enters at the wall, ahead of +y of the paths; down milling leaves at it
        between = (-10.0 * R, -low) if pose.down else (low, 10.0 * R)
        loads(piece, pitch, rate, 0.0, 0.0, *between, K, theta, F, torque, thick)
    return F[:, 1]


@pytest.mark.core
@pytest.mark.parametrize("step", [2.0, -2.0])
@pytest.mark.parametrize("depth", [0.05, 0.4, 3.0])
def test_closed_form_of_the_mean(step, depth):
    for cutter in (STRAIGHT, Cutter(10.0, 4, math.radians(30.0), 20.0, 30.0, 6e5)):
        pose = FlankPose(cutter, 0.05, step)
        front = mean_forces(pose.engagement([depth]), cutter, FULL)[0][0] @ pose.frame[:, 2]
        assert_allclose(abs(front), abs(closed_form(pose, depth)), rtol=1e-8)


@pytest.mark.parametrize("step", [1.5, -1.5])
@pytest.mark.parametrize("depth", [0.05, 0.3])
def test_greatest_of_a_helix_against_the_sum_over_its_edges(step, depth):
    pose = FlankPose(MILL, 0.05, step)
    found = normal_force(pose, FULL, [depth], measure="greatest")[0]
    assert_allclose(found, np.abs(summed(pose, depth)).max(), rtol=3e-3)


@pytest.mark.parametrize("step", [1.5, -0.6])
def test_bull_nose_against_the_sum_over_corner_and_flank(step):
    """The second row lies less than the corner radius below the one before."""
    pose = FlankPose(BULL, 0.05, step)
    for depth in (0.1, 0.4):
        F = summed(pose, depth)
        mean = normal_force(pose, FULL, [depth], measure="mean", nodes=64)[0]
        assert_allclose(mean, abs(F.mean()), rtol=4e-3)
        assert_allclose(normal_force(pose, FULL, [depth], measure="greatest")[0], np.abs(F).max(), rtol=0.02)


def test_length_that_a_tooth_bears_on():
    """At the depth d a helix is within the stock over R psi / tan(helix); without helix over all of the line."""
    depth, z = 0.1, np.linspace(0.0, 1.5, 4001)
    psi = math.acos(1.0 - depth / 4.0)
    inside = ((z * math.tan(math.radians(30.0)) / 4.0) <= psi).mean() * 1.5
    assert_allclose(FlankPose(MILL, 0.05, 1.5).tooth_line(depth), min(inside, 1.5), atol=1e-3)
    assert FlankPose(STRAIGHT, 0.05, 1.5).tooth_line(depth) == 1.5


def test_depths_follow_from_the_force():
    """The depth of a threshold has that force; deeper than the corner of a bull nose lets a leaning one cut."""
    pose = FlankPose(BULL, 0.05, 1.0)
    found = largest_depths(pose, FULL, [30.0], DepthRange(0.01, 1.5), measure="greatest")
    assert 0.01 < found.depth[0] < 1.5
    assert_allclose(normal_force(pose, FULL, found.depth, measure="greatest"), 30.0, rtol=1e-3)
    sloped = law_on_stock(pose, FULL, DepthRange(0.05, 0.5), slope=0.05, scallop=0.0, measure="greatest")
    met = 0.5 + 0.05 * math.sqrt(2.0 * 4.0 * 0.5)
    assert_allclose(sloped.forces[-1], normal_force(pose, FULL, [met], measure="greatest")[0], rtol=1e-3)


@pytest.mark.parametrize(
    ("cutter", "step", "message"),
    [
        (Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5, taper=math.radians(3.0)), 1.0, "cutter.taper_deg = 3: must be 0"),
        (Cutter(10.0, 2, 0.5, 9.0, 30.0, 6e5, corner_radius=4.0), 2.0, "axial_depth_mm = 2: must be from above 0 to 1"),
        (STRAIGHT, 0.0, "axial_depth_mm = 0: must be from above 0 to 20"),
    ],
)
def test_refused(cutter, step, message):
    with pytest.raises(InputError, match=message):
        FlankPose(cutter, 0.05, step)


def test_no_deeper_than_the_radius():
    with pytest.raises(InputError, match=r"depth_mm = 4.5: must be above 0 and at most 4, the radius"):
        normal_force(FlankPose(MILL, 0.05, 1.0), FULL, [4.5], measure="mean")
