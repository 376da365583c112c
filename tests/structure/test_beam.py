"""The stepped cantilever against textbook bars, finite elements and quadrature."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.structure import _beam
from chipload.structure.beam import compliance, flexibilities

MILL = Cutter(10.0, 4, 0.5, 22.0, 40.0, 5.8e5, shank_diameter=12.0)
BAR = Cutter(8.0, 4, 0.5, 30.0, 30.0, 6e5)


def stiffness(flex, length):
    """Euler-Bernoulli element, (w, slope) at both ends."""
    k = 1.0 / (flex * length**3)
    a, b = 6.0 * length, length * length
    return k * np.array([[12, a, -12, a], [a, 4 * b, -a, 2 * b], [-12, -a, 12, -a], [a, 2 * b, -a, 4 * b]])


def by_elements(cutter, nodes, factor):
    """Deflection of every node under a unit force at every node, exact for Hermite elements with forces at nodes."""
    i_flute = math.pi * (factor * cutter.diameter) ** 4 / 64.0
    i_shank = math.pi * cutter.shank_diameter**4 / 64.0
    n = len(nodes)
    k = np.zeros((2 * n, 2 * n))
    for e in range(n - 1):
        inertia = i_flute if nodes[e + 1] <= cutter.flute_length else i_shank
        at = slice(2 * e, 2 * e + 4)
        k[at, at] += stiffness(1.0 / (cutter.modulus * inertia), nodes[e + 1] - nodes[e])
    free = np.zeros((2 * n, 2 * n))
    free[: 2 * n - 2, : 2 * n - 2] = np.linalg.inv(k[:-2, :-2])
    return free[::2, ::2]


def test_uniform_bar_textbook():
    """Tip l^3/3EI; tip under a force at a: (l-a)^2 (2l+a) / 6EI; at the clamp nothing."""
    ei = 6e5 * math.pi * 8.0**4 / 64.0
    a = np.array([0.0, 5.0, 12.0, 30.0])
    ours = compliance(BAR, a, 0.0, fluted_factor=1.0)
    np.testing.assert_allclose(ours, (30.0 - a) ** 2 * (60.0 + a) / (6.0 * ei), rtol=1e-13, atol=1e-30)
    assert ours[0] == pytest.approx(30.0**3 / (3.0 * ei), rel=1e-13)


@pytest.mark.parametrize("factor", [0.8, 0.65, 1.0])
def test_finite_elements(factor):
    nodes = np.array([0.0, 3.0, 7.5, 15.0, 22.0, 28.0, 33.0, 40.0])
    ours = compliance(MILL, nodes[:, None], nodes[None, :], fluted_factor=factor)
    np.testing.assert_allclose(ours, by_elements(MILL, nodes, factor), rtol=1e-8, atol=1e-18)


@pytest.mark.parametrize(("a", "b"), [(0.0, 0.0), (4.0, 11.0), (11.0, 4.0), (20.0, 30.0), (25.0, 31.0)])
def test_quadrature_of_the_unit_load_method(a, b):
    def integrand(z):
        d = 0.8 * MILL.diameter if z < MILL.flute_length else MILL.shank_diameter
        return (z - a) * (z - b) / (MILL.modulus * math.pi * d**4 / 64.0)

    lo = max(a, b)
    expected = quad(integrand, lo, 40.0, points=[MILL.flute_length] if lo < 22.0 else None, epsrel=1e-12)[0]
    assert float(compliance(MILL, a, b)) == pytest.approx(expected, rel=1e-10)


def test_reciprocity_and_the_compiled_twin():
    z = np.random.default_rng(3).uniform(0.0, 40.0, (200, 2))
    ours = compliance(MILL, z[:, 0], z[:, 1])
    np.testing.assert_array_equal(ours, compliance(MILL, z[:, 1], z[:, 0]))
    flex = flexibilities(MILL)
    twin = [_beam.beam_deflection(a, b, MILL.overhang, MILL.flute_length, *flex) for a, b in z]
    np.testing.assert_allclose(twin, ours, rtol=1e-12)


def test_longer_or_thinner_gives_more():
    tip = float(compliance(MILL, 0.0, 0.0))
    assert float(compliance(replace(MILL, overhang=50.0), 0.0, 0.0)) > tip
    assert float(compliance(replace(MILL, shank_diameter=8.0), 0.0, 0.0)) > tip
    assert float(compliance(MILL, 0.0, 0.0, fluted_factor=0.7)) > tip


def test_refused():
    with pytest.raises(InputError) as err:
        compliance(MILL, [1.0, 41.0], 0.0)
    assert str(err.value) == "compliance: z_force = 41 mm: must be from 0 to cutter.overhang_mm = 40"
    with pytest.raises(InputError) as err:
        compliance(MILL, 0.0, math.nan)
    assert str(err.value) == "compliance: z_point = nan mm: must be from 0 to cutter.overhang_mm = 40"
    with pytest.raises(InputError) as err:
        compliance(MILL, 0.0, 0.0, fluted_factor=0.0)
    assert str(err.value) == "cutter.fluted_factor = 0: must be above 0 and at most 1 (0.8 is usual for end mills)"
