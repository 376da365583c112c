"""Gouges between the corners of large triangles, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from chipload.cutter.cutter import Cutter
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.gouge_refinement import hidden_gouge, refine_gouges, spacing_for
from chipload.simulation.steps import Steps, steps_of
from chipload.simulation.surface import Difference, difference

pytestmark = pytest.mark.core
BLOCK = trimesh.creation.box(bounds=[[0.0, 0.0, -20.0], [60.0, 40.0, 0.0]])


def mill(diameter: float, corner: float = 0.0) -> Cutter:
    return Cutter(diameter, 2, 0.5, 26.0, 40.0, 5.8e5, corner_radius=corner)


def hole(x: float, y: float, depth: float) -> Steps:
    """A plunge from 10 mm over the block."""
    ways = [rapid([x, y, 10.0], 0, 1, "hole"), plunge([x, y, -depth], 5.0, 600.0, 1, "hole")]
    return steps_of(Program.join(ways), 0.5, 0.001)


def found(cutter: Cutter, steps: Steps, limit: float, spacing: float = 100.0) -> Difference:
    """The difference of the block whose triangles are as large as ``spacing``."""
    tools = {1: cutter}
    left = difference(steps, tools, BLOCK, lambda p: np.ones(len(p), dtype=np.bool_), spacing, 1.0, 0.001)
    return refine_gouges(left, steps, tools, 0.001, limit)


@pytest.mark.parametrize("spacing", [100.0, 25.0, 8.0])
@pytest.mark.parametrize("cutter", [mill(10.0), mill(3.0), mill(10.0, 5.0), mill(6.0, 0.5)])
@pytest.mark.parametrize("place", [(33.0, 7.0), (11.3, 21.7)])
def test_depth_of_a_hole_is_within_the_bound(cutter: Cutter, place: tuple[float, float], spacing: float) -> None:
    """The deepest place of a hole 0.5 mm deep, at its axis, is found up to the stated bound."""
    left = found(cutter, hole(*place, 0.5), 0.05, spacing)
    deepest = -min(left.distance.min(), left.between[1].min(initial=0.0))
    assert deepest <= 0.5 + 1e-9
    assert deepest >= 0.5 - left.hidden - 1e-9
    assert left.hidden <= 0.25 * 0.05 + 1e-9
    # the whole block would have 60,000
    assert len(left.between[0]) < 8_000


def test_gouge_in_the_middle_of_a_wall() -> None:
    """A cutter of 10 mm beside the block, 0.2 mm in it: the gouge is that of its flank."""
    left = found(mill(10.0), hole(64.8, 20.0, 10.0), 0.05)
    deepest = -left.between[1].min()
    assert 0.2 - left.hidden <= deepest <= 0.2 + 1e-9
    k = int(left.between[1].argmin())
    assert left.between[0][k, 0] == pytest.approx(60.0)
    assert left.deepest.min() == pytest.approx(-deepest)


def test_bound_is_the_sagitta() -> None:
    """R - sqrt(R^2 - q^2) and back; beyond the radius all of q may hide."""
    for depth in (0.001, 0.02, 0.3):
        assert hidden_gouge(spacing_for(depth, 5.0), 5.0) == pytest.approx(depth)
    assert hidden_gouge(100.0, 5.0) == pytest.approx(100.0 / math.sqrt(3.0))


def test_where_the_tool_does_not_come_nothing_is_added() -> None:
    left = found(mill(10.0), hole(200.0, 200.0, 5.0), 0.05)
    assert len(left.between[0]) < 200
