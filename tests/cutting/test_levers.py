"""Loads times levers in one call against those rotation by rotation, which integrate each engagement range by
quadrature.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.levers import greatest_height, has_lever_loads, lever_loads
from chipload.cutting.strength import cutter_stress, normal_stress, section_loads, sections_of, von_mises_stress
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.simulation._form_error import loads_of_teeth
from chipload.structure.spindle import Bar, Joint, chain_compliance, tip_compliance
from cutting.test_revolution import STEEL, some_engagement

BARS = (
    Bar(25.0, 2e-9, Joint(1e-5, 1e-8, 1e-7)),
    Bar(10.0, 1e-9, Joint(2e-5, 3e-8)),
    Bar(40.0, 1e-10, Joint(1e-6, 1e-9)),
)


def test_compliance_of_the_tip_is_that_of_the_chain() -> None:
    z = np.linspace(0.0, 25.0, 11)
    np.testing.assert_allclose(np.polyval(tip_compliance(BARS)[::-1], z), chain_compliance(BARS, z, 0.0), rtol=1e-12)


@pytest.mark.parametrize("flutes", [1, 3])
@pytest.mark.parametrize("helix", [0.0, 0.5, 1.1])
@pytest.mark.parametrize("runout", [0.0, 0.01])
def test_loads_are_those_rotation_by_rotation(flutes: int, helix: float, runout: float) -> None:
    cutter = Cutter(10.0, flutes, helix, 20.0, 30.0, 6e5, runout=(runout, 0.4))
    engagement = chips_of_teeth(some_engagement(flutes, helix, flutes), cutter)
    assert has_lever_loads(engagement, cutter, STEEL)
    assert greatest_height(engagement) < 25.0
    count, n = 36, len(engagement)
    theta = np.arange(count) * ((math.tau if runout else math.tau / flutes) / count)
    found = lever_loads(
        engagement, cutter, STEEL, count, [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], tip_compliance(BARS)]
    )
    # a section above all of the edge, and the deflection of the tip
    known = section_loads(engagement, cutter, STEEL, theta, [30.0])[:, :, 0]
    bend = 30.0 * found[:, 4:6] - found[:, 6:8] + found[:, 2:4]
    # quadrature of two to five points: of what is left out, see points_of
    np.testing.assert_allclose(bend, np.swapaxes(known[..., :2], 1, 2), rtol=1e-5, atol=1e-5 * abs(known).max())
    np.testing.assert_allclose(found[:, 0], known[..., 2], rtol=1e-5, atol=1e-5 * abs(found[:, 0]).max())
    np.testing.assert_allclose(found[:, 1], known[..., 3], rtol=1e-5, atol=1e-5 * abs(found[:, 1]).max())
    chain = np.array([[b.length, b.flexibility, b.joint.c_ff, b.joint.c_mm, b.joint.c_fm] for b in BARS])
    out, law = np.empty((n * count, 5)), np.array(STEEL.law)
    rows = (engagement.start, engagement.rows, engagement.tooth, engagement.slice, engagement.slices)
    at = (np.repeat(np.arange(n), count), np.tile(theta, n), np.zeros(n * count))
    loads_of_teeth(*at, *rows, cutter.flutes, law, chain, out)
    moments = np.swapaxes(out.reshape(n, count, 5), 1, 2)
    np.testing.assert_allclose(found[:, 4:6], moments[:, :2], rtol=1e-5, atol=1e-5 * abs(moments[:, :2]).max())
    np.testing.assert_allclose(found[:, 8:], moments[:, 3:], rtol=1e-5, atol=1e-5 * abs(moments[:, 3:]).max())


@pytest.mark.parametrize("modulus", [6e5, 2.1e5])
def test_stress_is_that_of_the_loads_of_the_sections(modulus: float) -> None:
    cutter = Cutter(10.0, 3, 0.5, 25.0, 40.0, modulus)
    engagement = some_engagement(4, 0.5, 3)
    at = sections_of(cutter)
    loads = section_loads(engagement, cutter, STEEL, np.arange(60) * (math.tau / 180.0), at.height)
    stress = (normal_stress if modulus > 3e5 else von_mises_stress)(loads, at.diameter).max(axis=(1, 2))
    np.testing.assert_allclose(
        cutter_stress(engagement, cutter, STEEL), cutter.strength.concentration * stress, rtol=1e-5, atol=1e-6
    )
