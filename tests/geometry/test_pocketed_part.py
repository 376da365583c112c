"""Pockets of parts with known floors, corners and open sides."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
import trimesh

from chipload.geometry.part_walls import find_walls
from chipload.geometry.pocketed_part import find_pockets, level_faces, slabs_of


def prism(shape, low, high):
    out = trimesh.creation.extrude_polygon(shape, high - low)
    out.apply_translation([0.0, 0.0, low])
    return out


def rounded(x0, y0, x1, y1, r):
    return shapely.box(x0 + r, y0 + r, x1 - r, y1 - r).buffer(r, quad_segs=24)


@pytest.fixture(scope="module")
def part():
    """120 x 60 x 30: three pockets with R 6, R 3 and sharp corners, on two floors; a step that is open to x+."""
    block = trimesh.creation.box(bounds=[(0, 0, 0), (120, 60, 30)])
    cuts = [
        prism(rounded(2, 2, 40, 58, 6.0), 2.0, 31.0),
        prism(rounded(42, 2, 70, 58, 3.0), 2.0, 31.0),
        prism(shapely.box(72, 2, 95, 58), 10.0, 31.0),
        prism(shapely.box(97, -1, 121, 61), 20.0, 31.0),
    ]
    return trimesh.boolean.difference([block, *cuts], engine="manifold")


def test_floors_depths_corners_and_openness(part):
    found = {round(p.area_mm2): p for p in find_pockets(part)}
    areas = [38 * 56 - (4 - np.pi) * 36, 28 * 56 - (4 - np.pi) * 9, 23 * 56, 23 * 60]
    assert sorted(found) == pytest.approx(sorted(round(a) for a in areas), abs=2)
    first, second, sharp, step = (min(found.values(), key=lambda p, a=a: abs(p.area_mm2 - a)) for a in areas)
    assert [p.floor_mm for p in (first, second, sharp, step)] == [2.0, 2.0, 10.0, 20.0]
    assert [p.depth_mm for p in (first, second, sharp, step)] == [28.0, 28.0, 20.0, 10.0]
    assert first.corner_mm == pytest.approx(6.0, rel=0.01)
    assert second.corner_mm == pytest.approx(3.0, rel=0.02)
    assert sharp.corner_mm == 0.0
    assert [p.open for p in (first, second, sharp, step)] == [False, False, False, True]
    assert [p.floor_thickness_mm for p in (first, second, sharp, step)] == pytest.approx([2.0, 2.0, 10.0, 20.0])


def test_level_faces(part):
    assert level_faces(part).tolist() == [0.0, 2.0, 10.0, 20.0, 30.0]


def test_a_block_has_none():
    assert find_pockets(trimesh.creation.box(bounds=[(0, 0, 0), (9, 9, 9)])) == ()


def test_walls_with_their_height_over_the_higher_floor(part):
    """By hand: every wall is 2 mm thick; those beside the step and the sharp pocket stand on the higher floor."""
    found = find_walls(slabs_of(part), 5.0)
    assert [w.thickness_mm for w in found] == pytest.approx([2.0] * len(found))
    kinds = sorted((round(w.height_mm, 6), w.outer, round(w.length_mm)) for w in found)
    outside = [(28.0, True, 44), *[(28.0, True, 26)] * 2, *[(28.0, True, 22)] * 2, *[(20.0, True, 23)] * 2]
    between = [(28.0, False, 44), (20.0, False, 50), (10.0, False, 56)]
    assert kinds == sorted([*outside, *between])
    rib = next(w for w in found if not w.outer and w.height_mm > 25.0)
    assert sorted([*rib.start, *rib.end]) == pytest.approx([8.0, 41.0, 41.0, 52.0], abs=0.1)
    assert len(find_walls(slabs_of(part), 5.1)) == len(found) - 1
    assert slabs_of(trimesh.creation.box(bounds=[(0, 0, 0), (9, 9, 9)])) is None
