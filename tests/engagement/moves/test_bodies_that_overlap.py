"""A stock of bodies that overlap, or that touch as a floor and its walls do, is one solid."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from chipload.cutter.cutter import Cutter
from chipload.engagement.bricks.stock import BrickStock
from chipload.engagement.moves.stock import MoveStock
from chipload.geometry.mesh import sections

MILL = Cutter(8.0, 3, 0.5, 16.0, 26.0, 6e5)


def box(low, high, inside_out: bool = False) -> trimesh.Trimesh:
    body = trimesh.creation.box(np.subtract(high, low))
    body.apply_translation(0.5 * np.add(low, high))
    if inside_out:
        body.invert()
    return body


def joined(*bodies: trimesh.Trimesh) -> trimesh.Trimesh:
    whole = trimesh.util.concatenate(bodies)
    return trimesh.Trimesh(whole.vertices, whole.faces, process=False)


@pytest.mark.core
@pytest.mark.parametrize("kind", [MoveStock, BrickStock])
def test_a_slot_through_an_overlap(kind) -> None:
    """Two boxes that share 4 of 40 mm: each step of a slot of 8 x 2 mm removes its whole section."""
    body = joined(box((0, -10, -6), (22, 10, 0)), box((18, -10, -6), (40, 10, 0)))
    stock = kind(*body.bounds, {1: MILL}, body)
    x = np.arange(5.0, 36.0, 1.0)
    p = np.column_stack([x, 0.0 * x, np.full_like(x, -2.0)])
    tool, up = np.ones(len(x) - 1, dtype=np.int64), np.tile([0.0, 0.0, 1.0], (len(x) - 1, 1))
    axis = () if kind is MoveStock else (up, up)
    found = stock.take(p[:-1], p[1:], *axis, tool, corner_slices=12, flank_mm={1: 4.0})
    volume = np.bincount(found.step, found.volume / found.instants, len(tool))
    assert volume[5:] == pytest.approx(16.0, rel=1e-3)


def test_sections_join_bodies() -> None:
    """A filling that reaches 1e-6 mm into the walls of its pocket, and a cavity that another body fills in part."""
    pocket = joined(box((0, 0, 0), (40, 30, 8)), box((4, 4, 2), (36, 26, 7), inside_out=True))
    e = 1e-6
    filled = joined(pocket, box((4 - e, 4 - e, 1.9), (36 + e, 26 + e, 5)))
    for h, area in ((1.0, 1200.0), (3.0, 1200.0), (6.0, 1200.0 - 32.0 * 22.0)):
        (section,) = sections(filled, [h])
        assert section.area == pytest.approx(area, rel=1e-9)
        assert len(section.geoms) == 1
        assert len(section.geoms[0].interiors) == (1 if area < 1200.0 else 0)
    part = joined(pocket, box((-5, 10, 1), (10, 20, 7.5)))
    (section,) = sections(part, [3.0])
    assert section.area == pytest.approx(1200.0 - 32.0 * 22.0 + 5.0 * 10.0 + 6.0 * 10.0, rel=1e-9)
