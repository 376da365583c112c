"""Some steps of a tooth engagement: each has the rows, slices and frame that it had."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.band import force_deviation, peak_band, torque_deviation
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs

MILL = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5)
ARCS = ([0.0, 0.3, 1.0, 2.0], [1.0, 0.8, 3.0, math.pi])


@pytest.mark.parametrize("kept", [[0, 1, 2, 3], [1], [0, 3], []])
def test_a_part_is_the_engagement_of_its_steps(kept: list[int]) -> None:
    whole = engagement_of_arcs(*ARCS, 0.1, MILL, 2.0)
    frame = np.stack([np.eye(3)[[0, 1, 2]], np.eye(3)[[1, 2, 0]], np.eye(3)[[2, 0, 1]], np.eye(3)[[0, 2, 1]]])
    whole = ToothEngagement(whole.start, whole.rows, whole.tooth, whole.slice, whole.slices, frame)
    part = whole.part(np.array(kept, dtype=np.int64))
    assert len(part) == len(kept)
    assert np.array_equal(part.frames, frame[kept])
    for i, k in enumerate(kept):
        own, was = slice(part.start[i], part.start[i + 1]), slice(whole.start[k], whole.start[k + 1])
        assert np.array_equal(part.rows[own], whole.rows[was])
        assert np.array_equal(part.slices[part.slice[own]], whole.slices[whole.slice[was]])
        assert np.array_equal(part.tooth[own], whole.tooth[was])
    assert not part.rows.flags.writeable
    assert not part.frames.flags.writeable


def test_deviations_of_force_and_torque_alone() -> None:
    """K alone is uncertain, by a tenth: so are force and torque, which are proportional to it."""
    plain = Material("plain", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up", spread=0.1)
    slot = engagement_of_arcs([0.0], [math.pi], 0.1, Cutter(10.0, 1, 0.0, 20.0, 30.0, 6e5), 2.0)
    mill = Cutter(10.0, 1, 0.0, 20.0, 30.0, 6e5)
    # at 90 and 30 deg h = 0.1 and 0.05 mm, 2 mm deep, R 5 mm
    assert force_deviation(slot, mill, plain, [math.pi / 2]) == pytest.approx([20.0])
    assert torque_deviation(slot, mill, plain, [math.pi / 6]) == pytest.approx([50.0])
    assert [x[0] for x in peak_band(slot, mill, plain, [math.pi / 2], [math.pi / 6])] == pytest.approx([20.0, 50.0])
