"""The figure of a displaced part: where its points stand, how much larger they are displaced, its colours."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.report.shape_figure import magnification, shape_figure, shape_note
from chipload.result import SurfaceMap

POINTS = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 50.0, 0.0], [0.0, 50.0, 0.0]])
MOVED = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.024], [0.0, 0.0, 0.0], [0.0, 0.0, -0.012]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def plate(moved: np.ndarray | None = MOVED) -> SurfaceMap:
    return SurfaceMap("part after release", "distortion_um", POINTS, 1e3 * MOVED[:, 2], FACES, displacement=moved)


def test_points_are_displaced_by_a_round_number() -> None:
    """A tenth of 100 mm over 0.024 mm is 417: 200 is the next round number below."""
    designed, released = shape_figure(plate()).data
    assert np.asarray(designed.z).tolist() == [0.0] * 4
    assert np.asarray(released.z) == pytest.approx([0.0, 4.8, 0.0, -2.4])
    assert np.asarray(released.x) == pytest.approx(POINTS[:, 0])
    assert released.name == "part after release, displacement x 200"
    assert np.asarray(released.intensity) == pytest.approx([0.0, 24.0, 0.0, -12.0])
    assert (released.cmin, released.cmax) == (-24.0, 24.0)
    assert shape_note(plate()) == "The greatest displacement is 24 \u00b5m; it is drawn 200 times as large."


@pytest.mark.parametrize(("most", "times"), [(1.0, 10.0), (2.0, 5.0), (30.0, 0.2), (0.0, 1.0)])
def test_magnification(most: float, times: float) -> None:
    assert magnification(POINTS, most * MOVED / 0.024) == pytest.approx(times)


def test_a_map_without_displacement_stands_where_it_is() -> None:
    assert np.asarray(shape_figure(plate(None)).data[1].z).tolist() == [0.0] * 4
    assert "not displaced" in shape_note(plate(None))
