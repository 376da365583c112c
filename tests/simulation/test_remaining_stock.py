"""Whether a cutter stands in the cut, against the areas of discs in the plane (shapely), and by hand."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from chipload.cutter.cutter import Cutter
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.remaining_stock import AHEAD, Standstill, in_cut, stands_in
from chipload.simulation.steps import StepBlocks

MILL = Cutter(10.0, 3, 0.5, 26.0, 40.0, 5.8e5)
BALL = Cutter(10.0, 2, 0.5, 26.0, 40.0, 5.8e5, corner_radius=5.0)
UP = np.array([0.0, 0.0, 1.0])
BLOCK = shapely.box(0.0, 0.0, 60.0, 40.0)


def inside(points: np.ndarray) -> np.ndarray:
    """A block of 60 x 40 x 20 mm, its top at 0."""
    return ((points > (0.0, 0.0, -20.0)) & (points < (60.0, 40.0, 0.0))).all(axis=1)


def standstill(points: list[list[float]], cutter: Cutter = MILL) -> bool:
    """Whether a cutter stands in the cut at the end of a path."""
    path = np.array(points, dtype=float)
    program = Program.join([rapid(path[0], 600.0, 1, "link"), plunge(path[1:], 15.0, 600.0, 1, "cut")])
    steps = StepBlocks(program, 0.5, 0.001)
    count = sum(len(block) for block in steps)
    d = path[-1] - path[-2]
    place = Standstill(count, path[-1], UP, cutter, d / np.linalg.norm(d))
    return in_cut([place], steps, {1: cutter}, inside)[0]


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ([[-10, 20, -2], [30, 20, -2]], True),
        ([[-10, 20, -2], [70, 20, -2]], False),
        # its axis has passed the side of the block, and then not yet
        ([[-10, 20, -2], [66, 20, -2]], False),
        ([[-10, 20, -2], [59, 20, -2]], True),
        # back in its own slot
        ([[-10, 20, -2], [50, 20, -2], [30, 20, -2]], False),
        # along a wall of 0.2 mm, and past it
        ([[-10, -4.8, -2], [30, -4.8, -2]], True),
        ([[-10, -5.0, -2], [30, -5.0, -2]], False),
        # down into the block, and up again
        ([[30, 20, 5], [30, 20, -2]], True),
        ([[30, 20, 5], [30, 20, -2], [30, 20, -1]], False),
        # round a boss and back to where the round began
        ([[-10, 5, -2], [55, 5, -2], [55, 35, -2], [5, 35, -2], [5, 5, -2], [30, 5, -2]], False),
    ],
)
def test_by_hand(path: list[list[float]], expected: bool) -> None:
    assert standstill(path) is expected
    if len({z for _, _, z in path}) == 1:
        # a ball of the same radius, deeper than it
        assert standstill([[x, y, z - 6.0] for x, y, z in path], BALL) is expected


def test_random_paths_against_areas_of_discs() -> None:
    """In the plane a cutter cuts if the disc, moved on, covers area of the block that no disc before has covered."""
    rng, seen = np.random.default_rng(7), []
    for _ in range(24):
        corners = rng.uniform((-8.0, -8.0), (68.0, 48.0), (rng.integers(2, 6), 2))
        swept = shapely.LineString(corners).buffer(5.0, quad_segs=64)
        d = corners[-1] - corners[-2]
        on = shapely.Point(corners[-1] + AHEAD * d / np.linalg.norm(d)).buffer(5.0, quad_segs=64)
        left = on.intersection(BLOCK).difference(swept).area
        if 0.0 < left < 0.02:
            continue  # a sliver, thinner than the points see
        seen.append(left > 0.0)
        assert standstill([[x, y, -2.0] for x, y in corners]) is seen[-1], corners
    assert 4 < sum(seen) < len(seen) - 4


def test_a_cutter_in_a_stock() -> None:
    for at, expected in (((30, 20, -2), True), ((30, 20, 0), False), ((-5, 20, -2), False), ((-4.9, 20, -2), True)):
        assert stands_in(inside, MILL, np.array(at, dtype=float), UP) is expected, at
    # a ball beside the top edge is above it where it is wide
    assert not stands_in(inside, BALL, np.array([-4.9, 20.0, -0.5]), UP)
