"""Tooth engagement: what is refused, and the thickest chip."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.errors import InputError


def one_bite(low, width, along, offset, across, kappa):
    """An engagement range of every tooth, cut down to where h > 0 by bisection of the range; None where there is no
    such part.
    """
    edge = [[0.0, 5.0, 0.0, math.sin(kappa), math.cos(kappa), 0.0, 0.1]]
    return ToothEngagement([0, 1], [[low, low + width, 0.0, 2.0, along, offset, across]], [-1], [0], edge)


@settings(max_examples=100, deadline=None)
@given(st.floats(0.0, 6.28), st.floats(0.0, 6.28), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(0.0, 0.1))
def test_the_thickest_chip(low, width, along, across, offset):
    engagement = one_bite(low, width, along, offset, across, 1.0)
    phi = low + np.linspace(0.0, width, 2001)
    h = along * np.sin(phi) + across * np.cos(phi) + offset
    assert engagement.chip_max()[0] >= max(h.max(), 0.0) - 1e-15
    assert engagement.chip_max()[0] == pytest.approx(max(h.max(), 0.0), abs=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rows": np.zeros((1, 6))}, "tooth engagement: rows of shape (1, 6): need (b, 7) finite numbers"),
        ({"slices": np.zeros((1, 6))}, "tooth engagement: slices of shape (1, 6): need (k, 7) finite numbers"),
        ({"start": [0, 2]}, "tooth engagement: 1 rows, 1 teeth, start up to 2: must agree"),
        ({"slice": [1]}, "tooth engagement: slice of shape (1,): need (1,) from 0 to 0"),
        (
            {"rows": [[6.5, 7.0, 0.0, 1.0, 0.1, 0.0, 0.0]]},
            "tooth engagement: row 0: 6.5 to 7 rad: must begin within 0 to 2 pi and rise by at most 2 pi",
        ),
        (
            {"rows": [[1.0, 8.0, 0.0, 1.0, 0.1, 0.0, 0.0]]},
            "tooth engagement: row 0: 1 to 8 rad: must begin within 0 to 2 pi and rise by at most 2 pi",
        ),
        ({"rows": [[1.0, 2.0, 2.0, 1.0, 0.1, 0.0, 0.0]]}, "tooth engagement: row 0: s from 2 to 1 mm: must rise"),
        ({"frame": np.eye(3)}, "tooth engagement: frame of shape (3, 3): need (1, 3, 3) finite numbers"),
        (
            {"slices": [[0.0, 5.0, 0.0, 1.0, 0.0, -0.1, 0.1]]},
            "tooth engagement: slice 0: rho = 5, lag = -0.1, rate = 0.1: must be at least 0",
        ),
    ],
)
def test_refused(change, message):
    good = {
        "start": [0, 1],
        "rows": [[1.0, 2.0, 0.0, 1.0, 0.1, 0.0, 0.0]],
        "tooth": [-1],
        "slice": [0],
        "slices": [[0.0, 5.0, 0.0, 1.0, 0.0, 0.0, 0.1]],
    }
    with pytest.raises(InputError) as err:
        ToothEngagement(**{**good, **change})
    assert str(err.value) == message
