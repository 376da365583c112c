"""Outlines of a swept area at many heights: each distinct one is found once, and is that of its own height."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import MultiPolygon

from chipload.cutter.cutter import Cutter
from chipload.engagement.moves.stock import MoveStock
from chipload.simulation.section_outlines import Marks, nested_outlines

HEIGHTS = np.linspace(-9.95, -0.05, 100).tolist()


@pytest.mark.parametrize("corner", [0.0, 2.0])
@pytest.mark.parametrize("levels", [[], [-7.0, -3.0], [-8.1, -0.05]])
def test_each_height_has_its_own_outlines(corner: float, levels: list[float]) -> None:
    cutter = Cutter(10.0, 3, 0.5, 20.0, 35.0, 5.8e5, corner_radius=corner)
    stock = MoveStock(np.array([0.0, 0.0, -10.0]), np.array([40.0, 30.0, 0.0]), {1: cutter}, None)
    # two levels, and a ramp between them
    p = np.array([[8.0, 8.0, -3.0], [30.0, 8.0, -3.0], [30.0, 20.0, -7.0], [12.0, 20.0, -7.0]])
    stock.skip(p[:-1], p[1:], np.ones(3, dtype=np.int64))
    asked: list[float] = []

    def outlines(z: float, below: Marks | None, above: Marks | None) -> tuple[MultiPolygon, Marks]:
        asked.append(z)
        return stock.outlines_between(z, 0.005, below, above)

    found = nested_outlines(outlines, HEIGHTS, np.array(levels), 1)
    assert len(asked) == len(set(asked))
    for z, shape in zip(HEIGHTS, found, strict=True):
        assert shape == stock.outlines(z, 0.005)
    # below the lowest level and above the upper one of a flat end nothing changes; of a corner above its radius
    alike = [z for z in HEIGHTS if z < -7.0 or z > -3.0 + corner]
    assert len(set(asked) & set(alike)) <= len(alike) // 2
    assert len({id(shape) for z, shape in zip(HEIGHTS, found, strict=True) if z > -3.0 + corner}) == 1


def test_nothing_is_asked_without_heights() -> None:
    assert nested_outlines(lambda z, *_: (MultiPolygon(), np.zeros(1, dtype=bool)), [], np.array([1.0]), 1) == []
