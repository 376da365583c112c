"""What the wall bears, against the force and stress that it then has."""

from __future__ import annotations

import pytest

from chipload.control.limit import torque_limit
from chipload.cutting.material import Material
from chipload.errors import InputError

ALLOY = Material("alloy", 800.0, 300.0, 0.0, 20.0, 15.0, 0.0, source="made up")


def test_torque_by_hand():
    """b = 3: 120 N = 300 A + 45, A = 0.25; F_t = 200 + 60 = 260 N; R = 5, half of the peak: 650 N mm."""
    found = torque_limit([120.0, 44.0], 5.0, 3.0, ALLOY, 0.5)
    assert found.torque.tolist() == [650.0, 0.0]
    assert found.attainable.tolist() == [True, False]


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (
            lambda: torque_limit(1.0, 5.0, 1.0, ALLOY, 1.5),
            "torque_limit.mean_over_peak = 1.5: must be above 0 and at most 1",
        ),
        (
            lambda: torque_limit(1.0, 5.0, 1.0, Material("x", 800.0, 0.0, 0.0, 1.0, 1.0, 0.0, source="y"), 1.0),
            "material.krc_mpa = 0: must be above 0, else the radial force does not limit the torque",
        ),
    ],
)
def test_refused(make, text):
    with pytest.raises(InputError) as err:
        make()
    assert str(err.value) == text
