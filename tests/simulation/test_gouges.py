"""The deepest gouge between bounds: closed forms on planes, dense points of a curved wall, holders, sharp corners."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.simulation.test_channel import BALL, FLAT

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.geometry.bspline import patch_through
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.channel.channel import left_on, wall
from chipload.simulation.channel.gouges import deepest_gouge

GRID = wall("floor", FLAT, np.linspace(0.05, 0.95, 7), np.linspace(0.05, 0.95, 5))
BULL = CatalogueCutter(10.0, 2.0)


def dip(x, y, z):
    """Down to one place and up again."""
    rows = [rapid([[x, y, 30.0]], 100.0, 1, "link"), plunge([[x, y, z], [x, y, 30.0]], 10.0, 100.0, 1, "finish")]
    return Program.join(rows)


def test_a_gouge_between_the_points_of_the_walls_is_found():
    program = dip(13.37, 8.61, -0.048)
    # on the points of the wall it is not seen at all
    assert left_on([GRID], program, BALL, 1.0, 0.5)[0].deepest[0] == 0.0
    got = deepest_gouge([GRID], program, BALL, 0.5, 0.01, 0.05)
    assert 0.038 <= got.found <= 0.048 + 1e-9 <= got.bound + 1e-9
    assert got.bound <= 0.05
    assert got.bound - got.found <= 0.01
    assert math.hypot(got.place[0] - 13.37, got.place[1] - 8.61) < 0.3
    assert (got.wall, got.row, got.part) == ("floor", 1, 0)
    assert "the cutting part comes 0.04" in got.message


@pytest.mark.parametrize("deep", [0.0499, 0.0501])
def test_near_the_limit_it_is_looked_at_more_closely(deep):
    got = deepest_gouge([GRID], dip(13.37, 8.61, -deep), BALL, 0.5, 0.01, 0.05)
    assert got.found <= deep + 1e-9 <= got.bound + 2e-9
    assert (got.bound <= 0.0509) if deep < 0.05 else (got.found > 0.045)
    assert got.bound - got.found < 0.0101


def test_far_from_a_wall_the_bound_is_small_at_once():
    got = deepest_gouge([GRID], dip(13.37, 8.61, 0.6), BALL, 0.5, 0.01, 0.05)
    assert got.found == 0.0
    assert got.bound <= 0.025
    assert got.message == "nothing comes below a wall"


def test_on_a_curved_wall_no_dense_point_is_deeper_than_the_bound():
    """Bull-nose cutter, tilted at random, moved along the wall and turned on its way."""
    rng = np.random.default_rng(7)
    u, v = np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 9)
    U, V = np.meshgrid(u, v, indexing="ij")
    grid = np.stack([24.0 * U, 24.0 * V, 1.2 * np.sin(5.0 * U) * np.cos(4.0 * V)], axis=-1)
    surface = patch_through(grid, u, v)
    own = wall("wavy", surface, u, v)
    fine = wall("wavy", surface, np.linspace(0.0, 1.0, 171), np.linspace(0.0, 1.0, 167))
    seen = 0
    for _ in range(4):
        at = 0.3 + 0.4 * rng.random((4, 2))
        p = surface.at(*at.T)
        axis = np.array([0.0, 0.0, 1.0]) + 0.25 * rng.normal(size=(4, 3))
        axis /= np.linalg.norm(axis, axis=1)[:, None]
        tips = p + np.array([0.0, 0.0, 1.0]) * rng.uniform(0.9, 1.6, (4, 1))
        program = Program.join([rapid([[0.0, 0.0, 90.0]], 100.0, 1, "link"), plunge(tips, 10.0, 100.0, 1, "finish")])
        program = replace(program, axis=np.concatenate([axis[:1], axis]))
        got = deepest_gouge([own], program, BULL, 1.5, 0.01, 0.02)
        (dense,) = left_on([fine], program, BULL, 1.0, 1.5)
        assert dense.deepest[0] <= got.bound + 1e-6
        assert got.found <= got.bound
        if math.isfinite(got.bound):
            assert got.bound - got.found <= 0.0101
            assert got.found == pytest.approx(dense.deepest[0], abs=0.011)
            seen += got.found > 0.5
    assert seen >= 1


def test_a_rim_of_the_holder_is_seen_and_its_clearance_is_not_a_gouge():
    # the wall is a strip beside the cutter
    strip = wall("strip", FLAT, np.linspace(0.65, 0.75, 3), np.linspace(0.3, 0.6, 5))
    short = CatalogueCutter(8.0, 4.0, 12.0, reach=20.0, holder_diameter=18.0)
    deep = deepest_gouge([strip], dip(12.9, 8.61, -20.03), short, 0.5, 0.01, 0.05)
    assert deep.part == 3
    assert 0.02 <= deep.found <= 0.03 + 1e-9 <= deep.bound + 2e-9
    clear = deepest_gouge([strip], dip(12.9, 8.61, -19.6), short, 0.5, 0.01, 0.05)
    assert clear.found == 0.0
    assert clear.bound <= 0.025


def test_as_deep_as_is_looked_is_enough():
    got = deepest_gouge([GRID], dip(13.37, 8.61, -0.8), BALL, 0.5, 0.01, 0.05)
    assert (got.found, got.bound) == (0.5, math.inf)
    assert got.message.endswith("in row 1")


def test_with_a_sharp_corner_there_is_no_bound():
    got = deepest_gouge([GRID], dip(13.37, 8.61, -0.1), CatalogueCutter(10.0, 0.0), 0.5, 0.01, 0.05)
    assert got.found == pytest.approx(0.1, abs=1e-6)
    assert got.bound == math.inf


def test_numbers_out_of_range_are_refused():
    with pytest.raises(InputError, match="depth, resolution and limit: must be above 0"):
        deepest_gouge([GRID], dip(1.0, 1.0, 0.0), BALL, 0.5, 0.0, 0.05)
