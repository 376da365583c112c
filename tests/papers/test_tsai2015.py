"""The equations of [Tsai2015] that were read, its reason, and its claim: less time at the same accuracy.

Dimensions, rule table and results of the paper are lost. The controllers of the examples stand in docs/papers.md; here
are the law of the torque against quadrature, and that a thin wall is a shell and no beam.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.control.fuzzy import standard
from chipload.cutter.cutter import Cutter
from chipload.cutting.force import mean_forces
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.structure.shell import Shell, beam_compliance, compliance, ritz

#: dFt = (Ktc f sin th + Kte) dz within the engaged arc, dT = R dFt, power = torque x speed
KTC, KTE, RADIUS, TEETH, DEPTH = 700.0, 12.0, 5.0, 3, 2.0


@pytest.mark.parametrize(("start", "end", "feed"), [(0.0, math.pi, 0.1), (2.2, math.pi, 0.05), (0.0, 0.6, 0.2)])
def test_the_mean_torque_is_the_sum_of_the_elements(start, end, feed):
    mill = Cutter(2.0 * RADIUS, TEETH, math.radians(30.0), 20.0, 30.0, 6e5)
    law = Material("x", KTC, 200.0, 0.0, KTE, 10.0, 0.0, source="made up")
    torque = float(np.ravel(mean_forces(engagement_of_arcs([start], [end], feed, mill, DEPTH), mill, law)[1])[0])
    theta = np.linspace(start, end, 200_001)
    width, element = (end - start) / 200_000, KTC * feed * np.sin(theta) + KTE
    summed = TEETH * DEPTH * RADIUS / math.tau * float(np.sum(0.5 * (element[1:] + element[:-1])) * width)
    assert torque == pytest.approx(summed, rel=1e-6)


def test_a_thin_tube_ovalises():
    """R 20, L 60, 1 mm: as a beam it would be 25 times too stiff at its free edge."""
    tube = Shell(20.0, 60.0, 1.0, 70e3, 0.33)
    shell = float(1e3 * compliance(ritz(tube), 60.0)[..., 2, 2])
    shear = 2.0 * 1.33 / (4.0 + 3.0 * 0.33) * 70e3 / 2.66 * math.tau * 20.0
    beam = 1e3 * (60.0**3 / (3.0 * 70e3 * math.pi * 20.0**3) + 60.0 / shear)
    assert shell == pytest.approx(1.94, rel=0.003)
    assert 25.0 < shell / beam < 27.0
    assert 1e3 * beam_compliance(tube, 60.0) == pytest.approx(beam, rel=1e-9)


def test_the_rules_are_odd_and_rest_at_no_error():
    rules = standard()
    assert len(rules.error) == len(rules.change) == 7
    centre = len(rules.output) // 2
    assert rules.output[rules.rules[3, 3]] == 0.0
    assert (rules.rules + rules.rules[::-1, ::-1] == 2 * centre).all()
