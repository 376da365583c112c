"""Slender walls beside the pockets of a drawing and in a model, of known height and thickness."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import shapely
import trimesh

from chipload.errors import Severity
from chipload.geometry.contour import Contour
from chipload.jobs.contour.walls import find_walls
from chipload.simulation.heights.height_map import columns_of_mesh
from chipload.simulation.heights.slender_walls import slender_walls_of

pytestmark = pytest.mark.core


def rectangle(x0: float, y0: float, x1: float, y1: float) -> Contour:
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    pairs = zip(corners, [*corners[1:], corners[0]], strict=True)
    return Contour(np.array([[*a, *b, 0.0, 0.0, 0.0] for a, b in pairs]))


def job(depth: float, slenderness: float = 5.0, *, on: bool = True, kind: str = "pocket") -> Any:
    checks = SimpleNamespace(slender_walls=on, wall_slenderness=slenderness)
    table = SimpleNamespace(checks=checks, stock=SimpleNamespace(top_mm=0.0))
    op = SimpleNamespace(kind=kind, depth_mm=depth, axial_depth_mm=5.0)
    return SimpleNamespace(part_file=Path("x.dxf"), table=table, operations=(op,))


class TestDrawing:
    @pytest.mark.parametrize(("wall", "depth"), [(1.0, 15.0), (2.0, 15.0), (2.9, 15.0), (2.0, 28.0)])
    def test_wall_between_two_pockets(self, wall: float, depth: float) -> None:
        (found,) = find_walls(job(depth), [rectangle(0, 0, 40, 30), rectangle(40 + wall, 0, 80, 30)])
        assert (found.code, found.severity) == ("slender-wall", Severity.UNPROVEN)
        assert f"a wall {depth:g} mm high" in found.text
        assert found.place is not None
        assert abs(found.place[0] - 40 - 0.5 * wall) < wall

    def test_island(self) -> None:
        (found,) = find_walls(job(15.0), [rectangle(0, 0, 60, 30), rectangle(20, 10, 40, 12)])
        assert found.place is not None
        assert 20.0 < found.place[0] < 40.0

    def test_thick_walls_allowed_walls_and_the_switch(self) -> None:
        thin = [rectangle(0, 0, 40, 30), rectangle(42, 0, 80, 30)]
        assert find_walls(job(15.0), [rectangle(0, 0, 40, 30), rectangle(44, 0, 80, 30)]) == ()
        assert find_walls(job(15.0, 8.0), thin) == ()
        assert find_walls(job(15.0, on=False), thin) == ()
        assert find_walls(job(9.0), thin) == ()
        assert find_walls(job(15.0, kind="backward"), thin) == ()


def test_walls_of_a_frame() -> None:
    """Two pockets 27 mm deep in a block of 120 x 60 x 30 mm: walls of 1.5 mm around them and 6.5 mm between them."""
    pockets = [shapely.box(1.5, 1.5, 56.75, 58.5), shapely.box(63.25, 1.5, 118.5, 58.5)]
    plan = shapely.box(0, 0, 120, 60).difference(shapely.union_all(pockets))
    walls = trimesh.creation.extrude_polygon(plan, 28.0)
    floor = trimesh.creation.extrude_polygon(shapely.box(0, 0, 120, 60), 3.0)
    floor.apply_translation([0.0, 0.0, -30.0])
    walls.apply_translation([0.0, 0.0, -28.0])
    x, y, low, top = columns_of_mesh(trimesh.util.concatenate([walls, floor]), 0.2)
    found = slender_walls_of(x, y, low, top, np.zeros(top.shape), 5.0)
    assert found
    for wall in found:
        assert wall.height_mm == pytest.approx(27.0, abs=0.02)
        assert wall.thickness_mm == pytest.approx(1.5, abs=0.31)
    assert sum(w.length_mm for w in found) == pytest.approx(2 * 120 + 2 * 60, rel=0.3)
