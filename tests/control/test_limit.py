"""What the wall bears, against the force and stress that it then has."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.control.limit import torque_limit, wall_limit
from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.structure.shell import Shell, compliance, equivalent, ritz, stress

MODES = ritz(Shell(20.0, 60.0, 1.0, 70e3, 0.33), harmonics=60, terms=24)
ALLOY = Material("alloy", 800.0, 300.0, 0.0, 20.0, 15.0, 0.0, source="made up")


def test_at_the_limit():
    """At the force found, wall and cutter give way by what is allowed, and no place is strained beyond it."""
    s = np.array([20.0, 40.0, 57.0])
    found = wall_limit(MODES, s, 5e-5, 0.02, 150.0, 4.0, 1.0)
    own = compliance(MODES, s)[:, 2, 2]
    np.testing.assert_allclose(found.by_deflection * (own + 5e-5), 0.02, rtol=0.04)
    for x, force in zip(s, found.by_strength, strict=True):
        theta = np.linspace(-math.pi, math.pi, 121)
        for face in (True, False):
            clamp = force * equivalent(stress(MODES, x, 0.0, theta, face, 4.0, 1.0))
            near = force * equivalent(stress(MODES, x, x, theta / 20.0, face, 4.0, 1.0))
            assert max(clamp.max(), near.max()) <= 150.0 * 1.001
    assert np.all(np.diff(found.by_deflection) < 0.0)
    np.testing.assert_array_equal(found.force, np.minimum(found.by_deflection, found.by_strength))


def test_torque_by_hand():
    """b = 3: 120 N = 300 A + 45, A = 0.25; F_t = 200 + 60 = 260 N; R = 5, half of the peak: 650 N mm."""
    found = torque_limit([120.0, 44.0], 5.0, 3.0, ALLOY, 0.5)
    assert found.torque.tolist() == [650.0, 0.0]
    assert found.attainable.tolist() == [True, False]


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: wall_limit(MODES, 30.0, 0.0, 0.0, 1.0, 1.0, 1.0), "wall_limit.deflection = 0: must be above 0 mm"),
        (
            lambda: torque_limit(1.0, 5.0, 1.0, ALLOY, 1.5),
            "torque_limit.mean_over_peak = 1.5: must be above 0 and at most 1",
        ),
        (
            lambda: torque_limit(1.0, 5.0, 1.0, Material("x", 800.0, 0.0, 0.0, 1.0, 1.0, 0.0, source="y"), 1.0),
            "material.krc_mpa = 0: must be above 0, else the radial force does not limit the torque",
        ),
        (
            lambda: wall_limit(MODES, 59.0, 0.0, 1.0, 1.0, 4.0, 1.0),
            "shell: s = 59 mm with a patch of 4 mm: must lie on the wall, from 0 to 60",
        ),
    ],
)
def test_refused(make, text):
    with pytest.raises(InputError) as err:
        make()
    assert str(err.value) == text
