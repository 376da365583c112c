"""The figure of a displaced part: where its points stand, how much larger they are displaced, its colours."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.report.shape_figure import magnification, shape_figure, shape_note
from chipload.result import SurfaceMap
from chipload.result.style import SCALE

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
    (flat,) = shape_figure(plate(None)).data
    assert np.asarray(flat.z).tolist() == [0.0] * 4
    # its values have both signs
    assert (flat.cmin, flat.cmax) == (-24.0, 24.0)
    assert shape_note(plate(None)) == "part after release: -12 to 24 \u00b5m."


def test_a_quantity_without_a_sign_is_coloured_from_its_least_value() -> None:
    sizes = SurfaceMap("blade: largest cutter", "largest_diameter_mm", POINTS, np.array([8.0, 25.0, 12.0, 8.0]), FACES)
    (drawn,) = shape_figure(sizes).data
    assert (drawn.cmin, drawn.cmax) == (8.0, 25.0)
    assert drawn.colorscale[0][1] == SCALE[0][1]
    assert shape_note(sizes) == "blade: largest cutter: 8 to 25 mm."
