"""Force of an upright end mill or bull nose beside the row before: closed form of the mean, and sums over the edges."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_over_turn, mean_forces
from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.planning.thinwall.end_stock import EndPose

FLAT = Cutter(10.0, 4, math.radians(30.0), 20.0, 30.0, 6e5)
BULL = Cutter(8.0, 3, math.radians(30.0), 16.0, 30.0, 6e5, corner_radius=0.8)
FULL = Material("full", 1500.0, 600.0, 250.0, 20.0, 15.0, 5.0, source="made up")


@pytest.mark.core
@pytest.mark.parametrize("step", [2.5, -2.5, 9.0])
@pytest.mark.parametrize("depth", [0.2, 3.0])
def test_closed_form_of_the_mean_axial_force(step, depth):
    """N d / 2 pi (Kac f (1 - cos psi) + Kae psi) along the axis, psi the angle of engagement."""
    psi = math.acos(1.0 - abs(step) / 5.0)
    engagement = EndPose(FLAT, 0.05, step).engagement([depth])
    _, _, Kac, _, _, Kae = FULL.coefficients
    expected = 4.0 * depth / math.tau * (Kac * 0.05 * (1.0 - math.cos(psi)) + Kae * psi)
    assert_allclose(abs(mean_forces(engagement, FLAT, FULL)[0][0, 2]), expected, rtol=1e-9)


def summed(pose, d, theta, n=500):
    """Force on the cutter along feed, left and axis at a rotation: every piece of the edge, by where it is in stock.

    Teeth turn clockwise seen from above; the row before lies at y = -b.
    """
    cutter, b = pose.cutter, pose.step
    R, r, e = cutter.radius, cutter.corner_radius, cutter.radius - cutter.corner_radius
    kappa = (np.arange(n) + 0.5) * (math.acos(max(1.0 - d / r, 0.0)) / n) if r else np.zeros(0)
    size = [np.full(len(kappa), r * math.acos(max(1.0 - d / r, 0.0)) / n) if r else np.zeros(0)]
    z = [r * (1.0 - np.cos(kappa))]
    if d > r:
        z.append(r + (np.arange(n) + 0.5) * ((d - r) / n))
        size.append(np.full(n, (d - r) / n))
        kappa = np.concatenate([kappa, np.full(n, 0.5 * math.pi)])
    z, size = np.concatenate(z), np.concatenate(size)
    rho = np.where(z < r, e + r * np.sin(kappa), R) if r else np.full(len(z), R)
    Ktc, Krc, Kac, Kte, Kre, Kae = FULL.coefficients
    total = np.zeros(3)
    for j in range(cutter.flutes):
        # from the left of the feed, clockwise towards the feed
        phi = theta - j * math.tau / cutter.flutes - z * math.tan(cutter.helix) / R
        x, y = np.sin(phi), np.cos(phi)
        free = np.abs(rho * y + b) <= rho
        cuts = (x > 0.0) & ~free
        chip = pose.feed_per_tooth * np.sin(kappa) * x
        ft, fr, fa = Ktc * chip + Kte, Krc * chip + Kre, Kac * chip + Kae
        radial = fr * np.sin(kappa) + fa * np.cos(kappa)
        axial = fr * np.cos(kappa) - fa * np.sin(kappa)
        # on the cutter: against its motion, inwards, up
        total += [
            ((-ft * y - radial * x) * cuts * size).sum(),
            ((ft * x - radial * y) * cuts * size).sum(),
            (axial * cuts * size).sum(),
        ]
    return total


@pytest.mark.parametrize(("cutter", "step"), [(FLAT, 4.0), (FLAT, -4.0), (BULL, 3.0), (BULL, -6.0)])
def test_over_a_turn_against_the_sum_over_the_edges(cutter, step):
    """Greatest axial force, and the range of the others, over the rotations."""
    pose = EndPose(cutter, 0.05, step)
    pitch = math.tau / cutter.flutes
    for depth in (0.3, 1.5):
        angles = np.arange(0.0, pitch, math.radians(0.25))
        exact = np.array([summed(pose, depth, t) for t in angles])
        engagement = pose.engagement([depth], 256)
        found = forces_over_turn(engagement, cutter, FULL, np.arange(0.0, pitch, math.radians(0.25)))[0][0]
        assert_allclose(found[:, 2].max(), exact[:, 2].max(), rtol=0.01, atol=0.02)
        assert_allclose(found[:, 2].min(), exact[:, 2].min(), rtol=0.01, atol=0.02)
        size = np.abs(exact).max()
        for k in (0, 1):
            assert_allclose(found[:, k].mean(), exact[:, k].mean(), atol=0.01 * size)


def test_the_flat_of_the_bottom():
    with pytest.raises(InputError, match=r"step_over_mm = 7: must be from above 0 to 6.4, the flat of the bottom"):
        EndPose(BULL, 0.05, 7.0)
    with pytest.raises(InputError, match=r"corner_radius_mm = 4: must be below 4 on a floor"):
        EndPose(Cutter(8.0, 3, 0.5, 16.0, 30.0, 6e5, corner_radius=4.0), 0.05, 2.0)
    with pytest.raises(InputError, match=r"^depth_mm = 17: must be above 0 and at most 16, the length of the flutes$"):
        EndPose(BULL, 0.05, 2.0).engagement([1.0, 17.0])
    assert EndPose(BULL, 0.05, -2.0).down
    assert not EndPose(BULL, 0.05, 2.0).down
