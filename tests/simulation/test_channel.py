"""The independent check of channels against closed forms: scallop, gouge, neck, holder."""

import math

import numpy as np
import pytest

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.geometry.bspline import patch_through
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.channel.channel import PARTS, left_on, scallop_numbers, tool_parts, wall

FLAT = patch_through([[[0, 0, 0], [0, 20, 0]], [[30, 0, 0], [30, 20, 0]]], [0, 1], [0, 1])
BALL = CatalogueCutter(8.0, 4.0, 12.0, neck_diameter=6.0, neck_length=25.0, reach=40.0, holder_diameter=30.0)


def over(ys, z=0.0):
    rows = [rapid([[-10.0, ys[0], 30.0]], 100.0, 1, "link")]
    for y in ys:
        rows.append(plunge([[-10.0, y, z], [40.0, y, z], [40.0, y, 30.0]], 10.0, 100.0, 1, "finish"))
        rows.append(rapid([[-10.0, y, 30.0]], 100.0, 1, "link"))
    return Program.join(rows)


def test_scallop_of_a_ball_between_parallel_passes():
    w = 2.0
    grid = wall("floor", FLAT, np.linspace(0.2, 0.8, 5), np.linspace(0.0, 1.0, 2001))
    ys = np.arange(0.0, 20.1, w)
    (got,) = left_on([grid], over(ys), BALL, 1.0, 0.5, step=1.0, tol=1e-9)
    h = 4.0 - math.sqrt(16.0 - 1.0)
    crests = got.scallops("v")
    assert len(crests) == 5 * 10
    assert np.abs(crests - h).max() < 1e-6
    y = grid.points[:, 1]
    off = np.abs(y - w * np.round(y / w))
    assert np.abs(got.rest - (4.0 - np.sqrt(16.0 - off**2))).max() < 1e-6
    assert got.deepest[0] < 1e-9
    # a pass is four rows after the first rapid, its second one cuts: the nearest pass leaves what is left
    nearest = np.abs(y[:, None] - ys).argmin(axis=1)
    one = np.abs(off - 0.5 * w) > 1e-6
    assert (got.rest_row == 2 + 4 * nearest)[one].all()
    numbers = scallop_numbers(crests, 0.15)
    assert numbers["mean_share"] == pytest.approx(h / 0.15, rel=1e-6)


def test_depth_and_place_of_a_gouge():
    grid = wall("floor", FLAT, np.linspace(0.2, 0.8, 5), np.linspace(0.0, 1.0, 201))
    (got,) = left_on([grid], over([6.0], z=-0.3), BALL, 1.0, 0.5)
    deep, k = got.deepest
    assert deep == pytest.approx(0.3, abs=1e-6)
    assert grid.points[k, 1] == pytest.approx(6.0)
    assert int(got.row[k]) == 2
    assert "cutting part comes 0.3000 mm below" in got.message()
    # half the width of the gouge: sqrt(R^2 - (R - 0.3)^2)
    cut = np.abs(grid.points[got.gouge > 1e-9, 1] - 6.0).max()
    assert cut == pytest.approx(math.sqrt(16.0 - 3.7**2), abs=0.1)


@pytest.mark.parametrize(("x", "part", "deep"), [(-3.5, 0, 0.5), (-3.5, 1, 0.0), (-15.0 + 0.4, 3, 0.4)])
def test_each_part_of_the_tool_beside_a_wall(x, part, deep):
    """A wall x = 0 that the tool, standing along +Z at x < 0, goes by: which part meets which band of heights."""
    # the wall's normal looks to -x
    heights = {0: (4.0, 12.0), 1: (12.1, 24.9), 3: (40.1, 60.0)}[part]
    side = patch_through(
        [[[0, 0, heights[0]], [0, 0, heights[1]]], [[0, 20, heights[0]], [0, 20, heights[1]]]], [0, 1], [0, 1], side=-1
    )
    grid = wall("side", side, np.linspace(0.3, 0.7, 5), np.linspace(0.0, 1.0, 9))
    assert grid.normals[0, 0] == -1.0
    path = [rapid([[x, -30.0, 0.0]], 100.0, 1, "link"), rapid([[x, 50.0, 0.0]], 100.0, 1, "link")]
    (got,) = left_on([grid], Program.join(path), BALL, 1.0, 0.9, tol=1e-9)
    assert np.abs(got.gouge - deep).max() < 1e-6
    if deep:
        assert {PARTS[int(k)] for k in got.part} == {PARTS[part]}
    # rapids take nothing
    assert (got.rest == 1.0).all()


def test_parts_without_end_and_refusals():
    starts, shapes, kinds = tool_parts(CatalogueCutter(10.0, 1.0))
    assert (starts.tolist(), kinds.tolist(), shapes[0, 8]) == ([0.0], [0], 500.0)
    grid = wall("floor", FLAT, np.linspace(0, 1, 3), np.linspace(0, 1, 3))
    with pytest.raises(InputError, match="must be above 0"):
        left_on([grid], over([6.0]), BALL, 0.0, 0.5)
