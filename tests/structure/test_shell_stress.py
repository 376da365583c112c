"""Stress of the shell against closed forms with Poisson's ratio: ring load, pressure, plate strip, ring; and the solid.

A force spread over the whole circumference (width = 2 pi r) excites n = 0 alone: p = 1 / (2 pi r) per length of a line
load, q = p / length of a pressure. No force acts along s, so sum sigma_s over both faces is 0 in all of these.
Reference: [Timoshenko1959] ch. 15, cylindrical shells loaded symmetrically to the axis.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from chipload.structure.places import locate, normals_of
from chipload.structure.places import weights as weights_of
from chipload.structure.shell import Shell, compliance, ritz, stress
from chipload.structure.solid import displacement
from chipload.structure.stress import stresses
from chipload.structure.wall_solid import wall_solid

R, T, E, NU = 20.0, 1.0, 70e3, 0.33
TUBE = Shell(R, 60.0, T, E, NU)
D = E * T**3 / (12.0 * (1.0 - NU**2))
BETA = (3.0 * (1.0 - NU**2) / (R * T) ** 2) ** 0.25


@pytest.fixture(scope="module")
def axial():
    return ritz(TUBE, harmonics=2, terms=80)


def faces(modes, s_force, s, theta=0.0, **area):
    """Outer and inner stress."""
    return tuple(stress(modes, s_force, s, theta, face, **area) for face in (True, False))


def test_ring_load_on_a_long_tube(axial):
    """w = p e^-bx (cos bx + sin bx) / (8 b^3 D), M = p e^-bx (cos bx - sin bx) / (4 b), spread over 6 mm."""
    width, p = math.tau * R, 1.0 / (math.tau * R)

    def moment(x):
        x = abs(x)
        return math.exp(-BETA * x) * (math.cos(BETA * x) - math.sin(BETA * x)) / (4.0 * BETA)

    def bulge(x):
        x = abs(x)
        return math.exp(-BETA * x) * (math.cos(BETA * x) + math.sin(BETA * x)) / (8.0 * BETA**3 * D)

    for s in (30.0, 32.0, 35.0, 40.0):
        m, w = (
            p * quad(lambda y, s=s, f=f: f(s - y), 27.0, 33.0, points=[30.0, s] if s < 33.0 else [30.0])[0] / 6.0
            for f in (moment, bulge)
        )
        outer, inner = faces(axial, 30.0, s, length=6.0, width=width)
        along, hoop = 6.0 * m / T**2, E * w / R
        scale = p / (BETA * T**2)
        assert outer == pytest.approx([along, hoop + NU * along, 0.0], abs=2e-3 * scale)
        assert inner == pytest.approx([-along, hoop - NU * along, 0.0], abs=2e-3 * scale)
        assert compliance(axial, 30.0, s, length=6.0, width=width)[2, 2] == pytest.approx(w, rel=2e-3)


def test_pressure(axial):
    """Far from the clamp q r / t round and nothing along; at the clamp M = q / (2 b^2), and round m times that."""
    width, q = math.tau * R, 1.0 / (math.tau * R * 60.0)
    outer, inner = faces(axial, 30.0, 35.0, length=60.0, width=width)
    assert outer == pytest.approx([0.0, q * R / T, 0.0], abs=2e-3 * q * R / T)
    assert inner == pytest.approx([0.0, q * R / T, 0.0], abs=2e-3 * q * R / T)
    outer, inner = faces(axial, 30.0, 0.0, length=60.0, width=width)
    clamp = 6.0 * q / (2.0 * BETA**2) / T**2
    # an outward pressure pulls on the outer face beside the load, on the inner face at the clamp
    assert outer == pytest.approx([-clamp, -NU * clamp, 0.0], abs=2e-3 * clamp)
    assert inner == pytest.approx([clamp, NU * clamp, 0.0], abs=2e-3 * clamp)


def test_plate_strip():
    """A tube of 1 km radius is a clamped strip, loaded near its free edge: 6 p (a - s) / t^2 along, m times across."""
    wide = Shell(1e6, 10.0, 1.0, E, NU)
    p = 1.0 / (math.tau * 1e6)
    modes = ritz(wide, harmonics=2, terms=12)
    for s in (0.0, 3.0, 7.0):
        outer, inner = faces(modes, 9.9, s, length=0.2, width=math.tau * 1e6)
        bent = 6.0 * p * (9.9 - s)
        # the strip bends outwards: the outer face is pressed
        assert outer == pytest.approx([-bent, -NU * bent, 0.0], rel=1e-3, abs=1e-3 * bent)
        assert inner == pytest.approx([bent, NU * bent, 0.0], rel=1e-3, abs=1e-3 * bent)


def test_narrow_ring_with_poissons_ratio():
    """0.3 mm wide: P R (1/2 - 1/pi) and P / 2 a quarter round from two opposite forces, and nothing along s."""
    ring = Shell(R, 0.3, 0.2, E, NU, ends="free")
    modes = ritz(ring, harmonics=60, terms=6, repeat=2)
    outer, inner = faces(modes, 0.15, 0.15, math.pi / 2, length=0.3, width=0.5)
    section, area = 0.3 * 0.2**2 / 6.0, 0.3 * 0.2
    bent = R * (0.5 - 1.0 / math.pi) / section
    assert 0.5 * (outer[1] - inner[1]) == pytest.approx(-bent, rel=0.02)
    assert 0.5 * (outer[1] + inner[1]) == pytest.approx(0.5 / area, abs=1e-3 * bent)
    assert abs(outer[0]) < 0.02 * bent
    assert abs(inner[0]) < 0.02 * bent


def test_shear_of_torsion():
    """n = 0 along theta has no stress but shear; here by a normal force beside a plane of symmetry: it changes sign."""
    modes = ritz(TUBE, harmonics=20, terms=20)
    left, right = (stress(modes, 40.0, 20.0, sign * 0.6, length=4.0, width=4.0) for sign in (-1, 1))
    np.testing.assert_allclose(left, right * [1.0, 1.0, -1.0], rtol=1e-9)
    # equilibrium of the cut at s: the shear flow of both faces carries the force, sum of tau t r sin(theta) dtheta = 1
    theta = np.linspace(0.0, math.tau, 720, endpoint=False)
    outer, inner = faces(modes, 40.0, 20.0, theta, length=4.0, width=4.0)
    flow = 0.5 * (outer + inner)[:, 2] * T * R * math.tau / 720
    assert abs((flow * np.sin(theta)).sum()) == pytest.approx(1.0, rel=0.02)
    # and its moment is borne by the stress along: sum of sigma t r^2 cos(theta) dtheta = 20
    pull = 0.5 * (outer + inner)[:, 0] * T * R**2 * math.tau / 720
    assert (pull * np.cos(theta)).sum() == pytest.approx(-20.0, rel=0.02)


@pytest.mark.parametrize("angle_deg", [0.0, 10.0])
def test_against_hexahedra(angle_deg):
    """Stress along and round at the points of integration of a solid wall, away from the force and the clamp."""
    shell = replace(TUBE, cone_angle=math.radians(angle_deg))
    wall = wall_solid(shell, (28, 24, 1), growth=3.0)
    grid = wall.factored.solid.grid
    s_force, length, width = 45.0, 6.0, 6.0
    nodes, weights = np.polynomial.legendre.leggauss(7)
    s = s_force + 0.5 * length * np.repeat(nodes, 7)
    theta = 0.25 * width * (1.0 + np.tile(nodes, 7)) / shell.radius_at(s)
    cf, sf = math.cos(shell.cone_angle), math.sin(shell.cone_angle)
    r = shell.radius_at(s) + 0.5 * T * cf
    z = s * cf - 0.5 * T * sf
    places = locate(grid, "k+", np.column_stack([r * np.cos(theta), r * np.sin(theta), z]), 0.05)
    share = 0.5 * np.outer(weights, weights).ravel() / 4.0
    force = weights_of(grid, places).T @ (share[:, None] * normals_of(grid, places, "k+"))
    u = displacement(wall.factored, force)
    middle = grid.nodes[grid.elements].mean(axis=1)
    angle = np.arctan2(middle[:, 1], middle[:, 0])
    height = middle[:, 2] / cf
    chosen = np.flatnonzero((angle > 0.5) & (angle < 1.5) & (height > 15.0) & (height < 50.0))
    sigma = stresses(wall.factored.solid, u, chosen)
    modes = ritz(shell)
    found, wanted = [], []
    for k, element in enumerate(chosen):
        th, at = angle[element], (middle[element, 2]) / cf
        e_theta = np.array([-math.sin(th), math.cos(th), 0.0])
        e_s = np.array([sf * math.cos(th), sf * math.sin(th), cf])
        mean = sigma[k].mean(axis=0)
        found.append([e_s @ mean @ e_s, e_theta @ mean @ e_theta])
        wanted.append(0.5 * sum(faces(modes, s_force, at, th, length=length, width=width))[:2])
    found, wanted = np.array(found), np.array(wanted)
    scale = np.abs(wanted).max(axis=0)
    assert np.abs(found - wanted).max(axis=0) / scale == pytest.approx([0.0, 0.0], abs=0.06)
