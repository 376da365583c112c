"""Force of a depth against sums over the sphere; depths against the closed form and against the force.

The closed forms take h = f sin(phi), to which the chips between the true paths tend as f / R goes to 0. They are
compared for the engaged front, and for chips of a feed of 1e-6 R, with edge forces and thresholds as small.
"""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import slices
from chipload.cutting.force import mean_forces
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.errors import InputError
from chipload.planning.thinwall.depth import DEEPEST, INFEASIBLE, THRESHOLD, DepthRange, largest_depths, normal_force
from chipload.planning.thinwall.plane_stock import CutterPose
from layer_oracle.immersion import Section, engagement_rows

BALL = Cutter(10.0, 4, 0.0, 20.0, 30.0, 6e5, corner_radius=5.0)
HELICAL = Cutter(10.0, 2, math.radians(30.0), 20.0, 30.0, 6e5, corner_radius=5.0)
BULL = Cutter(10.0, 4, math.radians(30.0), 20.0, 30.0, 6e5, corner_radius=1.0)
RADIAL = Material("radial", 1500.0, 600.0, 0.0, 20.0, 15.0, 0.0, source="made up")
#: share by which the feed, the edge force and the thresholds are smaller where chips are compared with a closed form
SMALL = 1e-4
SMALL_RADIAL = Material("radial", 1500.0, 600.0, 0.0, 20.0 * SMALL, 15.0 * SMALL, 0.0, source="made up")
FULL = Material("full", 1500.0, 600.0, 250.0, 20.0, 15.0, 5.0, source="made up")


def summed(posture: CutterPose, material: Material, d: float, n: int = 1000) -> float:
    """Mean normal force of a ball: every piece of its sphere that faces forward in uncut stock, over one revolution."""
    R, c, b = posture.cutter.radius, math.cos(posture.lead), posture.step
    A = np.array([math.sin(posture.lead), math.sin(posture.tilt) * c, math.cos(posture.tilt) * c])
    X = np.cross(A, [0.0, 1.0, 0.0])
    X /= np.linalg.norm(X)
    Y = np.cross(A, X)
    reach = math.acos(A[2]) + math.acos(1.0 - d / R)
    k = (np.arange(n) + 0.5) * reach / n
    total, weight = 0.0, reach / n / n
    for phi in (np.arange(n) + 0.5) * math.tau / n:
        u = math.cos(phi) * X + math.sin(phi) * Y
        t = -math.sin(phi) * X + math.cos(phi) * Y
        t = t if np.dot(np.cross(u, t), A) < 0.0 else -t  # seen from above the teeth run clockwise
        nu = np.sin(k)[:, None] * u - np.cos(k)[:, None] * A
        e = np.cos(k)[:, None] * u + np.sin(k)[:, None] * A
        p = R * nu + [0.0, 0.0, R]
        cuts = (nu[:, 0] > 0.0) & (p[:, 2] < d)
        if b is not None:
            cuts &= ~((p[:, 1] + b) ** 2 + (p[:, 2] - R) ** 2 < R * R)
        h = posture.feed_per_tooth * nu[cuts, 0]
        ft, fr, fa = (K * h + E for K, E in zip(material.coefficients[:3], material.coefficients[3:], strict=True))
        total += float((-ft * t[2] - fr * nu[cuts, 2] - fa * e[cuts, 2]).sum()) * R * weight
    return abs(total) * posture.cutter.flutes


def front_force(posture, material, depths):
    """Mean normal force of the engaged front, h = f sin(phi)."""
    return np.abs(mean_forces(posture.engagement(depths), posture.cutter, material)[0] @ posture.frame[:, 2])


def test_closed_form_of_the_slot():
    """d of thresholds 20, 50, 100 N, from the quadratic of q = sqrt(2 R d - d^2)."""
    F, slot = np.array([20.0, 50.0, 100.0]), CutterPose(BALL, 0.05, None)
    A, B, R = 4 * 600 * 0.05 / (math.tau * 5.0), 4 * 15 / 2, 5.0
    q = (-B + np.sqrt(B * B + 4 * A * F)) / (2 * A)
    exact = R - np.sqrt(R * R - q * q)
    assert_allclose(exact, [0.0383435, 0.2036929, 0.6831800], rtol=0.0, atol=1e-6)
    assert_allclose(front_force(slot, RADIAL, exact), F, rtol=2e-8)
    limits = DepthRange(1e-3, 2.0, 1e-8)
    small = largest_depths(CutterPose(BALL, 0.05 * SMALL, None), SMALL_RADIAL, F * SMALL, limits, measure="mean")
    # angles of chips are rounded to 1e-9 rad, 2e-4 of the angle f / R of the second order
    assert_allclose(small.depth, exact, rtol=1e-4)
    assert (small.status == THRESHOLD).all()
    # the true chips are thicker than h = f sin(phi) here: less depth, and never more force than the threshold
    found = largest_depths(slot, RADIAL, F, limits, measure="mean")
    assert (found.depth < exact).all()
    assert_allclose(found.depth, exact, rtol=0.1)


@pytest.mark.parametrize("depth", [0.05, 0.4])
@pytest.mark.parametrize(
    ("lead", "tilt", "step"),
    [(0.0, 0.0, 0.5), (17.0, 0.0, 0.5), (17.0, 23.0, 0.5), (17.0, 23.0, -0.5), (-10.0, 5.0, 0.8), (4.0, 0.0, None)],
)
def test_mean_against_the_sphere(lead, tilt, step, depth):
    posture = CutterPose(BALL, 0.05, step, math.radians(lead), math.radians(tilt))
    found = front_force(posture, FULL, [depth])[0]
    assert found == pytest.approx(summed(posture, FULL, depth), rel=2e-3)


@pytest.mark.parametrize(("cutter", "lead", "step"), [(BALL, 10.0, 0.6), (BULL, 8.0, 0.6), (BULL, 8.0, -0.6)])
def test_mean_against_layers(cutter, lead, step):
    """The immersion of the simulation in thin layers of the stock that the row before has left."""
    d, layer = 0.3, 0.0005
    posture = CutterPose(cutter, 0.05, step, math.radians(lead), math.radians(6.0))
    bounds = np.arange(-4.0 * layer, d + 0.5 * layer, layer)
    y = np.linspace(-6.0, 6.0, 240001)
    hollow = posture.outline(y + step)
    edges = []
    for z in 0.5 * (bounds[:-1] + bounds[1:]):
        gone = y[hollow < z]
        low, high = (gone[0], gone[-1]) if len(gone) else (20.0, 20.0)
        for a, b in ((-30.0, low), (high, 30.0)):
            ring = [(-30, a), (30, a), (30, b), (-30, b), (-30, a)]
            edges += [(*ring[i], *ring[i + 1]) for i in range(4)]
    start = 8 * np.arange(len(bounds))
    tip = posture.centre - cutter.apt[3] * posture.axis
    profile = slices(cutter, corner_slices=600, bottom_slices=60)
    rows, owner = engagement_rows(
        tip, posture.frame, [0.05, 0.0, 0.0], [0.0, 0.0, 0.0], profile, Section(bounds, start, np.array(edges))
    )
    engagement = ToothEngagement([0, len(rows)], rows, np.full(len(rows), -1), owner, profile.columns)
    layered = abs(float(mean_forces(engagement, cutter, FULL)[0][0] @ posture.frame[:, 2]))
    assert front_force(posture, FULL, [d])[0] == pytest.approx(layered, rel=0.01)


def test_force_stays_below_the_threshold():
    posture = CutterPose(HELICAL, 0.05, 0.4, math.radians(15.0), 0.0)
    F = np.linspace(6.0, 60.0, 12)
    limits = DepthRange(0.01, 1.5, 1e-6)
    found = largest_depths(posture, FULL, F, limits, measure="greatest")
    again = normal_force(posture, FULL, found.depth, measure="greatest")
    # chips are rounded to a share of the radius, and the force with them
    assert (again <= F * (1.0 + 1e-7)).all()
    assert_allclose(found.force, again, rtol=1e-7)
    inner = found.status == THRESHOLD
    assert inner.sum() > 3
    assert (normal_force(posture, FULL, found.depth[inner] + 2e-6, measure="greatest") > F[inner]).all()
    assert (found.depth[found.status == DEEPEST] == 1.5).all()


def test_what_makes_a_place_feasible():
    """With a threshold between edge and whole force a feed, below that of the edge a cutter."""
    posture = CutterPose(BALL, 0.05 * SMALL, None)
    limits = DepthRange(0.1, 1.0)
    edge = 4 * 15 * math.sqrt(2 * 5 * 0.1 - 0.01) / 2
    whole = edge + 4 * 600 * 0.05 * (0.2 - 0.002) / math.tau
    thresholds = [0.5 * SMALL * (edge + whole), 0.5 * SMALL * edge]
    found = largest_depths(posture, SMALL_RADIAL, thresholds, limits, measure="mean")
    assert (found.status == INFEASIBLE).all()
    assert (found.depth == 0.0).all()
    feed, smaller = found.infeasible
    assert feed.edge_force == pytest.approx(SMALL * edge, rel=1e-5)
    assert feed.feed_per_tooth == pytest.approx(0.025 * SMALL, rel=2e-4)
    assert smaller.feed_per_tooth is None
    assert smaller.diameter is not None
    R = 0.5 * smaller.diameter
    shape = 4 * 600 * 0.05 * (0.2 - 0.01 / R) / math.tau + 4 * 15 * math.sqrt(0.2 * R - 0.01) / 2
    assert shape == pytest.approx(0.5 * edge, rel=1e-4)


def test_refused():
    with pytest.raises(InputError, match=r"corner_radius_mm = 0: must be above 0"):
        CutterPose(Cutter(10.0, 4, 0.0, 20.0, 30.0, 6e5), 0.05, None)
    with pytest.raises(InputError, match=r"depth_max_mm = 4: must be at most 2\.5"):
        largest_depths(
            CutterPose(BALL, 0.05, None, math.radians(30.0)), RADIAL, [5.0], DepthRange(0.1, 4.0), measure="mean"
        )
    with pytest.raises(InputError, match="depth_min_mm = 0"):
        DepthRange(0.0, 1.0)
    with pytest.raises(InputError, match="threshold: a place of the wall has no threshold above 0"):
        largest_depths(CutterPose(BALL, 0.05, None), RADIAL, [0.0], DepthRange(0.1, 1.0), measure="mean")


@pytest.mark.parametrize(("Krc", "Kre", "power"), [(600.0, 0.0, 1.0), (0.0, 15.0, 2.0)])
def test_depth_grows_as_a_power_of_the_threshold(Krc, Kre, power):
    """Shallow slot: the chip's force grows as d, the edge's as sqrt(d)."""
    material = Material("one", 1500.0, Krc, 0.0, 20.0, Kre, 0.0, source="made up")
    F = np.array([2.0, 2.2]) * (0.1 * SMALL if Kre == 0.0 else 1.0)
    slot = CutterPose(BALL, 0.05 * SMALL, None)
    found = largest_depths(slot, material, F, DepthRange(1e-5, 1.0, 1e-10), measure="mean")
    assert np.diff(np.log(found.depth))[0] / math.log(1.1) == pytest.approx(power, rel=2e-3)
