"""Forces with a size effect, h^(1 - m), against adaptive quadrature and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import gamma

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_over_turn, greatest_forces, mean_forces
from chipload.cutting.material import Material
from chipload.cutting.wall_error import wall_profile
from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs
from chipload.structure.beam import compliance

KIENZLE = Material("kienzle", 1500.0, 500.0, 200.0, 8.0, 6.0, 3.0, source="made up", exponents=(0.26, 0.4, 0.1))
MILL = Cutter(10.0, 4, math.radians(30.0), 25.0, 35.0, 6e5)

#: phi from, to, along, offset, across: an arc from a zero, between zeros, off them, lifted a little, lifted, constant
BITES = [
    (0.0, math.pi, 0.05, 0.0, 0.0),
    (2.9, math.pi, 0.05, 0.0, 0.0),
    (0.4, 1.1, 0.05, 0.0, 0.0),
    (math.pi / 6, 5 * math.pi / 6, 0.06, -0.03, 0.0),
    (1.0, 1.0 + math.tau, 0.02, 0.021, 0.0),
    (5.5, 8.0, 0.02, 0.05, -0.03),
    (0.3, 0.3 + math.tau, 0.0, 0.04, 0.0),
]


def vector(phi, h, kappa, rho, material):
    """Force along T, n, A and torque of a mm of edge."""
    k = np.array(material.coefficients)
    f = [k[i] * h ** (1.0 - material.exponents[i]) + k[3 + i] for i in range(3)]
    radial = math.sin(kappa) * f[1] + math.cos(kappa) * f[2]
    return np.array(
        [
            -f[0] * math.cos(phi) - radial * math.sin(phi),
            f[0] * math.sin(phi) - radial * math.cos(phi),
            math.cos(kappa) * f[1] - math.sin(kappa) * f[2],
            rho * f[0],
        ]
    )


def one(engaged, kappa, rate, rho=4.0):
    low, high, along, offset, across = engaged
    edge = [[0.0, rho, 0.0, math.sin(kappa), math.cos(kappa), 0.2, rate]]
    return ToothEngagement([0, 1], [[low, high, 1.0, 4.0, along, offset, across]], [0], [0], edge)


def thick(engaged, phi):
    return max(engaged[2] * math.sin(phi) + engaged[4] * math.cos(phi) + engaged[3], 0.0)


@pytest.mark.parametrize("engaged", BITES)
def test_means_against_adaptive_quadrature(engaged):
    kappa = 1.1
    force, torque = mean_forces(one(engaged, kappa, 0.1), MILL, KIENZLE)
    zeros = [z for z in np.arange(0.0, 14.0, math.pi / 6) if engaged[0] < z < engaged[1]]
    for i, ours in enumerate([*force[0], torque[0]]):
        value = quad(
            lambda phi, i=i: vector(phi, thick(engaged, phi), kappa, 4.0, KIENZLE)[i],
            engaged[0], engaged[1], points=zeros or None, epsabs=1e-10, epsrel=1e-12, limit=800,
        )[0]  # fmt: skip
        scale = 1500.0 * 0.05**0.7 * 4.0
        assert ours == pytest.approx(value * 3.0 / math.tau, rel=1e-8, abs=3e-8 * scale)


@pytest.mark.parametrize("engaged", BITES)
@pytest.mark.parametrize("rate", [0.0, 1e-9, 0.05, 1.2])
def test_over_the_turn_against_adaptive_quadrature(engaged, rate):
    kappa = 0.8
    theta = np.array([engaged[0] + 0.3, engaged[0] + 0.75, engaged[1] + 0.1, 3.0])
    force, torque = forces_over_turn(one(engaged, kappa, rate), MILL, KIENZLE, theta)
    for k, turn in enumerate(theta):

        def at(s, i, turn=turn):
            phi = engaged[0] + (turn - 0.2 - rate * s - engaged[0]) % math.tau
            return vector(phi, thick(engaged, phi), kappa, 4.0, KIENZLE)[i] if phi < engaged[1] else 0.0

        phases = [(turn - 0.2 - x) / rate for x in np.arange(-15, 15, math.pi / 6)] if rate > 1e-3 else []
        ends = (
            [(turn - 0.2 - x - math.tau * m) / rate for x in engaged[:2] for m in range(-3, 4)] if rate > 1e-3 else []
        )
        points = sorted({p for p in phases + ends if 1.0 < p < 4.0})
        for i, ours in enumerate([*force[0, k], torque[0, k]]):
            value = quad(at, 1.0, 4.0, args=(i,), points=points or None, epsabs=1e-9, epsrel=1e-11, limit=800)[0]
            assert ours == pytest.approx(value, rel=1e-6, abs=1e-6 * 3.0 * 1500.0 * 0.05**0.7 * 4.0)


def test_mean_torque_of_a_full_slot_is_a_beta_function():
    """integral of sin^(1 - m) over 0 .. pi = sqrt(pi) Gamma(1 - m/2) / Gamma(3/2 - m/2)."""
    m, f = 0.26, 0.05
    material = replace(KIENZLE, Kte=0.0)
    _, torque = mean_forces(engagement_of_arcs([0.0], [math.pi], f, MILL, 5.0), MILL, material)
    integral = math.sqrt(math.pi) * gamma(1.0 - m / 2) / gamma(1.5 - m / 2)
    assert torque[0] == pytest.approx(4 * 5.0 * 5.0 * 1500.0 * f ** (1 - m) * integral / math.tau, rel=1e-8)


def test_exponents_go_to_zero_as_the_linear_law():
    engagement = engagement_of_arcs([0.3, 2.0], [2.5, math.pi], 0.05, MILL, 8.0)
    plain = replace(KIENZLE, exponents=(0.0, 0.0, 0.0))
    near = replace(KIENZLE, exponents=(1e-10, 1e-10, 1e-10))
    theta = np.linspace(0.0, 6.0, 25)
    np.testing.assert_allclose(
        forces_over_turn(engagement, MILL, near, theta)[0],
        forces_over_turn(engagement, MILL, plain, theta)[0],
        atol=1e-6,
    )
    peak, other = greatest_forces(engagement, MILL, near), greatest_forces(engagement, MILL, plain)
    for name in ("torque", "force_axis"):
        np.testing.assert_allclose(peak[name], other[name], rtol=1e-7)


def test_thin_chips_ask_for_more():
    """Halving the feed lessens the mean torque by less than half: by 2^(1 - m) without an edge force."""
    material = replace(KIENZLE, Kte=0.0)
    torque = [
        mean_forces(engagement_of_arcs([2.6], [math.pi], f, MILL, 5.0), MILL, material)[1][0] for f in (0.04, 0.08)
    ]
    assert torque[1] / torque[0] == pytest.approx(2.0 ** (1.0 - 0.26), rel=1e-12)


def test_the_wall_without_helix_up_milling_feels_the_size_effect():
    """Soft work, no helix, a tooth at phi = 0 makes the wall, the others stand at quarter turns: with one tooth more at
    pi/2 the normal force of a mm is Kc f^(1 - m) + Kte there and -Kre at the wall.
    """
    mill = replace(MILL, helix=0.0)
    engagement = engagement_of_arcs([0.0], [2.0], 0.05, mill, 4.0)
    z = np.array([1.0, 3.0])
    ours = wall_profile(engagement, mill, KIENZLE, z, milling="up", work_compliance=1e-3)[0]
    normal = 1500.0 * 0.05 ** (1 - 0.26) + 8.0 - 6.0
    heights = (np.arange(4000) + 0.5) * 4.0 / 4000
    bend = [np.sum(compliance(mill, heights, x) + 1e-3) * 4.0 / 4000 for x in z]
    np.testing.assert_allclose(ours, -normal * np.array(bend), rtol=1e-4)
