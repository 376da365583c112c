"""Static compliance of responses whose modes are known."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.structure.receptance import Receptance, static_compliance

F = np.arange(5.0, 2000.0, 5.0)


def response(*modes):
    return sum(c / (1.0 - (F / f) ** 2 + 2j * z * F / f) for c, f, z in modes)


def test_sum_of_modes():
    H = response((2e-4, 900.0, 0.03), (0.6e-4, 2600.0, 0.02))
    assert static_compliance(Receptance(F, H), (5.0, 250.0))[0] == pytest.approx(2.6e-4, rel=1e-4)


def test_scatter_is_that_of_the_noise():
    noise = np.random.default_rng(4).normal(0.0, 3e-6, (2, len(F)))
    H = response((2e-4, 1900.0, 0.03)) + noise[0] + 1j * noise[1]
    c, scatter = static_compliance(Receptance(F, H), (20.0, 600.0))
    assert scatter == pytest.approx(3e-6, rel=0.2)
    assert abs(c - 2e-4) < 3e-6


def test_refused():
    H = response((2e-4, 900.0, 0.03))
    with pytest.raises(InputError, match="2 frequencies from 5 to 10 Hz: must be at least 4"):
        static_compliance(Receptance(F, H), (5.0, 10.0))
    with pytest.raises(InputError, match=r"static compliance -0\.0\d+ mm/N from 5 to 250 Hz: must be above 0"):
        static_compliance(Receptance(F, -H), (5.0, 250.0))
    with pytest.raises(InputError, match="frequencies at least 0 and increasing"):
        Receptance(F[::-1], H)
    with pytest.raises(InputError, match="two columns"):
        Receptance(F, H[1:])
