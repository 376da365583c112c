"""The lobes of the system of [Insperger2004]: one mode along the feed, two straight teeth, by the method of the source.

The oracle is semi-discretisation with a scalar mode. The numbers of the source's figures were not at hand; its system
and its method are compared.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

import chipload

MASS, HZ, DAMPING, KT, KN, TEETH = 0.03993, 922.0, 0.011, 600e6, 200e6, 2
MILL = chipload.Cutter(diameter_mm=10, flutes=TEETH, helix_deg=0, flute_length_mm=22, overhang_mm=35, modulus_gpa=580)
METAL = chipload.Material("source", KT / 1e6, KN / 1e6, 0.0, 0.0, 0.0, 0.0, source="[Insperger2004]")
MODE = chipload.Mode(frequency_hz=HZ, direction="x", damping_ratio=DAMPING, mass_kg=MASS)


def multiplier(rpm, depth_mm, arc, m=160):
    """Greatest multiplier of x'' + 2 z w x' + w^2 x = -(depth H(t) / m) (x(t) - x(t - tau)), SI units."""
    tau, w = 60.0 / (TEETH * rpm), math.tau * HZ
    h, P = tau / m, np.eye(m + 2)
    for i in range(m):
        force = 0.0
        for s in (np.arange(8) + 0.5) / 8:
            for j in range(TEETH):
                phi = (math.tau / TEETH * ((i + s) / m + j)) % math.tau
                if arc[0] < phi < arc[1]:
                    force += math.sin(phi) * (KT * math.cos(phi) + KN * math.sin(phi)) / 8
        push = depth_mm / 1000.0 * force / MASS
        A = np.array([[0.0, 1.0, 0.0], [-(w**2) - push, -2.0 * DAMPING * w, push], [0.0, 0.0, 0.0]])
        step, G = expm(h * A), np.zeros((m + 2, m + 2))
        G[:2, :2] = step[:2, :2]
        G[:2, m] += 0.5 * step[:2, 2]
        G[:2, m + 1] += 0.5 * step[:2, 2]
        G[2, 0] = 1.0
        G[3:, 2 : m + 1] = np.eye(m - 1)
        P = G @ P
    return float(np.abs(np.linalg.eigvals(P)).max())


@pytest.mark.parametrize("milling", ["up", "down"])
@pytest.mark.parametrize("ae", [0.5, 5.0])
def test_growth_is_that_of_semi_discretisation(milling, ae):
    """Lobes and flips lie among the points; the error of the oracle is of the size of its step, 1 / 160 period."""
    cut = chipload.engagement_of_cut(MILL, axial_depth_mm=1, radial_depth_mm=ae, milling=milling)
    speed, depth = np.array([6000.0, 9500.0, 15700.0, 18900.0, 22000.0]), np.array([0.4, 1.1, 2.6])
    chart = chipload.stability_chart(MILL, METAL, cut, 0.05, speed, [MODE], axial_depth_mm=depth)
    arc = math.radians(cut.entry_deg), math.radians(cut.exit_deg)
    want = np.log([[multiplier(rpm, ap, arc) for ap in depth] for rpm in speed])
    evaluated = np.abs(chart.growth - want)
    assert evaluated.max() < 0.03
    clear = np.abs(want) > 0.03
    assert ((chart.growth > 0.0) == (want > 0.0))[clear].all()
    assert (want > 0.0).any()
    assert (want < 0.0).any()
