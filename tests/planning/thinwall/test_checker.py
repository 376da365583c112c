"""The depth's force against the simulation: two rows through a layered block, the second one beside the first."""

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.planning.thinwall.blank import FinishSurface
from chipload.planning.thinwall.depth import DepthRange, largest_depths, normal_force
from chipload.planning.thinwall.paths import PassMotion, program_of, rows_of
from chipload.planning.thinwall.plane_stock import CutterPose
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock
from layer_oracle.removal import remove_by_layers

STEEL = Material("steel", 1900.0, 600.0, 300.0, 24.0, 20.0, 5.0, source="made up, of the usual size")
BALL = Cutter(8.0, 2, math.radians(30.0), 20.0, 30.0, 6e5, corner_radius=4.0)
BULL = Cutter(8.0, 4, math.radians(30.0), 20.0, 30.0, 6e5, corner_radius=2.0)


def simulated(posture: CutterPose, d: float, layers: int, feed: float, spindle: float) -> tuple[float, float]:
    """Size of the mean and greatest size of the normal force [N] in the middle of the second row."""
    x, y = np.meshgrid(np.linspace(0.0, 10.0, 6), [0.0, abs(posture.step or 0.0)], indexing="ij")
    points = np.stack([x, y, 0.0 * x], axis=-1)
    surface = FinishSurface(points, np.broadcast_to([0.0, 0.0, 1.0], points.shape), d)
    none = np.zeros(x.shape)
    program = program_of(
        rows_of(surface, none, none + d, posture), PassMotion(posture, feed, 100.0, spindle, 8.0), "rows"
    )
    bounds = np.concatenate([[-1.0], np.linspace(-0.008, 0.0, 3)[:-1], np.linspace(0.0, d, layers + 1)])
    stock = LayeredStock.block((-10.0, -12.0, -1.0), (20.0, 12.0, d), bounds, 16.0)
    c = remove_by_layers(program, stock, {1: posture.cutter}, STEEL, Resolution(1.0, 0.002, 96, 0.5)).columns
    k = int(np.flatnonzero(~c["rapid"] & (np.abs(c["x_mm"] - 5.5) < 2.0) & (c["chip_volume_mm3"] > 0.0))[-1])
    return abs(float(c["force_z_mean_n"][k])), float(max(c["force_z_max_n"][k], -c["force_z_min_n"][k]))


@pytest.mark.parametrize(
    ("cutter", "lead", "tilt", "step", "threshold"),
    [(BALL, 15.0, 0.0, -0.5, 20.0), (BULL, 8.0, 5.0, 0.5, 14.0)],
)
def test_simulated_row(cutter, lead, tilt, step, threshold):
    """The mean within 1.2 % of what 30 and 60 layers tend to (their error halves); the greatest within 4 %: engagement
    ranges count as whole slices there."""
    feed, spindle = 10.0, 628.0
    tooth = feed * math.tau / (spindle * cutter.flutes)
    posture = CutterPose(cutter, tooth, step, math.radians(lead), math.radians(tilt))
    found = largest_depths(posture, STEEL, [threshold], DepthRange(0.02, 0.8, 1e-5), measure="greatest")
    d = float(found.depth[0])
    assert 0.1 < d < 0.7
    coarse, fine = (simulated(posture, d, n, feed, spindle) for n in (30, 60))
    mean = float(normal_force(posture, STEEL, [d], measure="mean")[0])
    assert 2.0 * fine[0] - coarse[0] == pytest.approx(mean, rel=0.012)
    assert fine[1] == pytest.approx(threshold, rel=0.04)


BARREL = Cutter(8.0, 2, math.radians(30.0), 16.0, 30.0, 6e5, corner_radius=1.5, barrel_radius=40.0)


@pytest.mark.parametrize(("lead", "tilt", "step"), [(0.0, 77.0, -1.2), (3.0, -76.0, 1.0)])
def test_simulated_row_of_a_barrel(lead, tilt, step):
    """Its flank arc touches: the plane-stock formulas with e = D / 2 - R below 0 against the layered block."""
    feed, spindle, d = 10.0, 628.0, 0.12
    tooth = feed * math.tau / (spindle * BARREL.flutes)
    posture = CutterPose(BARREL, tooth, step, math.radians(lead), math.radians(tilt))
    assert posture.deepest > d
    found = simulated(posture, d, 30, feed, spindle)
    mean = float(normal_force(posture, STEEL, [d], measure="mean")[0])
    greatest = float(normal_force(posture, STEEL, [d], measure="greatest")[0])
    assert found[0] == pytest.approx(mean, rel=0.015)
    assert found[1] == pytest.approx(greatest, rel=0.03)


def test_the_outline_of_a_barrel_is_its_arc_across_the_feed():
    """With no lead the circle of radius R lies across the feed: step-over^2 / (8 R) is left between two rows."""
    posture = CutterPose(BARREL, 0.05, 1.2, 0.0, math.radians(-77.0))
    y = np.linspace(-2.0, 2.0, 41)
    assert posture.outline(y) == pytest.approx(40.0 - np.sqrt(40.0**2 - y**2), abs=2e-6)
    assert posture.deepest == pytest.approx(
        40.0 * (1.0 - math.cos(math.radians(77.0) - BARREL.flank_arc.kappa_from)), rel=1e-12
    )
    tip = posture.centre - BARREL.flank_arc.f * posture.axis
    # the arc ends 40 sin(7.8 deg) from the contact towards the tip, and 40 sin(13 deg) towards the shank
    ends = np.sign(tip[1]) * np.array([5.3, 5.5, -8.9, -9.1])
    assert np.isfinite(posture.outline(ends)).tolist() == [True, False, True, False]
    z = np.linspace(0.0, 16.0, 400)
    # every circle of the profile: its lowest point is at z = 0 or above, and its reach towards the tip within `below`
    low = tip[2] + z * posture.axis[2] - BARREL.radius_at(z) * math.sin(posture.beta)
    assert low.min() == pytest.approx(0.0, abs=1e-4)
    assert low.min() > -1e-9
    assert float(np.max(np.abs(tip[1]))) <= posture.below
