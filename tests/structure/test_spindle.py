"""Chains of bars and joints against finite elements, textbook bearings and the clamped cutter."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.structure.beam import compliance
from chipload.structure.receptance import Receptance, static_compliance
from chipload.structure.spindle import Bar, Joint, as_measured, bearings, chain_compliance, cutter_bars, springs, tube

MILL = Cutter(10.0, 4, 0.5, 22.0, 40.0, 5.8e5, shank_diameter=12.0)
GRIP = springs(6e4, 8e6)
FLANGE = springs(2e5, 9e8)
CHAIN = (
    *cutter_bars(MILL, GRIP),
    tube(45.0, 32.0, 2.1e5, inner=12.0, joint=FLANGE),
    tube(60.0, 60.0, 2.1e5, inner=20.0, joint=bearings(1.8e5, 9e4, 180.0, 2.1e5 * np.pi * 60.0**4 / 64.0)),
)


def by_elements(bars, rear_span, front, rear, bending):
    """Hermite elements, joints as springs between twin nodes, the spindle on its bearings as one more element."""
    k = np.zeros((200, 200))

    def put(dofs, block):
        k[np.ix_(dofs, dofs)] += block

    def beam(flex, length):
        s, a, b = 1.0 / (flex * length**3), 6.0 * length, length * length
        return s * np.array([[12, a, -12, a], [a, 4 * b, -a, 2 * b], [-12, -a, 12, -a], [a, 2 * b, -a, 4 * b]])

    node, z, heights = 0, 0.0, [0.0]
    for n, bar in enumerate(bars):
        for _ in range(2):
            put(range(2 * node, 2 * node + 4), beam(bar.flexibility, bar.length / 2))
            node, z = node + 1, z + bar.length / 2
            heights.append(z)
        j = bar.joint
        if n < len(bars) - 1 and j.c_ff > 0.0:
            for c, stiff in ((0, 1.0 / j.c_ff), (1, 1.0 / j.c_mm)):
                put([2 * node + c, 2 * node + 2 + c], stiff * np.array([[1.0, -1.0], [-1.0, 1.0]]))
            node += 1
            heights.append(z)
    put(range(2 * node, 2 * node + 4), beam(1.0 / bending, rear_span))
    k[2 * node, 2 * node] += front
    k[2 * node + 2, 2 * node + 2] += rear
    size = 2 * node + 4
    return np.array(heights), np.linalg.inv(k[:size, :size])[: 2 * node + 2 : 2, : 2 * node + 2 : 2]


def test_whole_chain_by_elements():
    heights, expected = by_elements(CHAIN, 180.0, 1.8e5, 9e4, 2.1e5 * np.pi * 60.0**4 / 64.0)
    twins = np.flatnonzero(np.diff(heights) == 0.0) + 1
    keep = np.setdiff1d(np.arange(len(heights)), twins)
    z = heights[keep]
    np.testing.assert_allclose(
        chain_compliance(CHAIN, z[:, None], z[None, :]), expected[np.ix_(keep, keep)], rtol=1e-7, atol=1e-15
    )


def test_clamped_cutter_is_unchanged():
    a, b = np.random.default_rng(1).uniform(0.0, 40.0, (2, 100))
    np.testing.assert_allclose(
        chain_compliance(cutter_bars(MILL), a, b), compliance(MILL, a, b), rtol=1e-12, atol=1e-20
    )


def test_rigid_spindle_on_bearings():
    """Lever: F a/l at the rear, F (1 + a/l) in front."""
    chain = (Bar(50.0, 0.0, bearings(1e5, 2e5, 100.0)),)
    assert float(chain_compliance(chain, 0.0, 0.0)) == pytest.approx(1.5**2 / 1e5 + 0.5**2 / 2e5, rel=1e-13)


def test_measured_tip():
    """A cutter in a holder that only shifts, its tip measured: the sum of both at all heights; one that tilts: of the
    tip, and no less above it."""
    z = np.linspace(0.0, 22.0, 7)
    bars = cutter_bars(MILL)
    own = compliance(MILL, z[:, None], z[None])
    f = np.arange(5.0, 400.0, 5.0)
    for joint, exact in ((springs(2e4), True), (springs(rotation=3e7), False)):
        arm = 40.0 - z
        true = own + joint.c_ff + joint.c_mm * arm[:, None] * arm[None]
        measured = Receptance(f, true[0, 0] / (1.0 - (f / 1800.0) ** 2 + 0.05j * f / 1800.0))
        found = as_measured(bars, static_compliance(measured, (5.0, 300.0))[0])
        C = chain_compliance(found, z[:, None], z[None])
        assert C[0, 0] == pytest.approx(true[0, 0], rel=1e-3)
        assert (C / true >= 1.0 - 1e-3).all()
        if exact:
            np.testing.assert_allclose(C, true, rtol=1e-3)


def test_a_spring_of_rotation_at_a_distance_is_a_joint():
    """A rigid lever of length L on a spring c: displacement L^2 c, rotation c, both L c: just passive, for every L."""
    for length in np.linspace(1.0, 97.0, 60):
        c = 1e-8
        joint = Joint(length**2 * c, c, length * c)
        chain = (Bar(50.0, 0.0, joint),)
        assert chain_compliance(chain, 0.0, 0.0) > 0.0


def test_refused():
    for call, message in (
        (lambda: springs(0.0), "joint.translation = 0: a stiffness must be above 0; inf for a rigid one"),
        (lambda: bearings(1e5, -1.0, 100.0), "bearings.rear = -1: must be above 0"),
        (lambda: tube(10.0, 8.0, 2e5, inner=9.0), "tube: outer_mm = 8, inner_mm = 9"),
        (lambda: Joint(1e-5, 1e-9, 1e-6), "joint: c_ff = 1e-05, c_mm = 1e-09, c_fm = 1e-06"),
        (lambda: Bar(-1.0, 0.0), "bar: length_mm = -1"),
        (lambda: as_measured(cutter_bars(MILL), 1e-6), "tip: measured compliance 0.001 um/N: must be at least that of"),
        (lambda: chain_compliance(CHAIN, 146.0, 0.0), "chain_compliance: z_force = 146 mm: must be from 0 to 145"),
    ):
        with pytest.raises(InputError) as err:
            call()
        assert str(err.value).startswith(message)
