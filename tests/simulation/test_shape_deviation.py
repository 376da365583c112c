"""A path and a stock beside a finished body, by formula."""

import math

import numpy as np
import pytest
import trimesh

from chipload.cutter.cutter import Cutter
from chipload.program.program import LINE, RAPID, Program
from chipload.simulation.initial_stock import initial_stock, skip_moves
from chipload.simulation.shape_deviation import mesh_points, nearest, shape_deviation
from chipload.stock.layers import LayeredStock

BALL = Cutter(8.0, 2, 0.5, 10.0, 30.0, 6e5, corner_radius=4.0)
ALONG = np.array([40.0, 0.0, 0.0])
FLAT = Cutter(4.0, 2, 0.5, 20.0, 30.0, 6e5)
BULL = Cutter(10.0, 4, 0.5, 10.0, 30.0, 6e5, corner_radius=1.5)


def path(points, axis) -> Program:
    p = np.asarray(points, dtype=np.float64)
    n = len(p)
    zero, none = np.zeros((n, 3)), np.zeros(n, dtype=np.int64)
    motion = np.array([RAPID] + [LINE] * (n - 1))
    return Program(
        motion, p, np.tile(axis, (n, 1)), zero, np.tile([0.0, 0.0, 1.0], (n, 1)), none,
        np.where(motion == LINE, 5.0, 0.0),
        np.full(n, 100.0), np.ones(n, dtype=np.int64), none, none, ("x",),
    )  # fmt: skip


def wall_points() -> np.ndarray:
    """The plane y = 0, z 0 .. 30."""
    x, z = np.meshgrid(np.linspace(-15.0, 15.0, 301), np.linspace(0.0, 30.0, 301), indexing="ij")
    return np.stack([x, 0.0 * x, z], axis=-1)


@pytest.mark.parametrize("deep", [0.0, 0.03, -0.2])
def test_ball_beside_a_wall(deep):
    """Centre 4 - deep from the plane, axis leaning 40 deg away: the distance is -deep."""
    a = math.radians(40.0)
    axis = np.array([0.0, math.sin(a), math.cos(a)])
    centre = np.array([[-5.0, 4.0 - deep, 15.0], [5.0, 4.0 - deep, 15.0]])
    found = nearest(path(centre - 4.0 * axis, axis), BALL, wall_points())
    assert found.distance == pytest.approx(-deep, abs=1e-3)
    assert found.at[2] == pytest.approx(15.0, abs=0.2)


def test_flank_leans_into_a_wall():
    """Axis leaning 5 deg towards the wall, centre 5 mm off it: 5 - (h - 4) sin 5 - 4 at a height h along it."""
    a = math.radians(5.0)
    axis = np.array([0.0, -math.sin(a), math.cos(a)])
    centre = np.array([[-2.0, 5.0, 5.0], [2.0, 5.0, 5.0]])
    found = nearest(path(centre - 4.0 * axis, axis), BALL, wall_points())
    top = max(h for h in np.arange(4.0 + 2.0, 30.0, 2.0))
    assert found.distance == pytest.approx(5.0 - (top - 4.0) * math.sin(a) - 4.0, abs=0.02)


def test_bull_nose_stands_in_a_floor():
    """Upright on z = 0, corner 1.5 deep by 0.1."""
    x, y = np.meshgrid(np.linspace(-9.0, 9.0, 181), np.linspace(-9.0, 9.0, 181), indexing="ij")
    floor = np.stack([x, y, 0.0 * x], axis=-1)
    up = np.array([0.0, 0.0, 1.0])
    found = nearest(path([[0.0, 0.0, -0.1], [1.0, 0.0, -0.1]], up), BULL, floor)
    assert found.distance == pytest.approx(-0.1, abs=1e-9)


def test_stock_beside_a_block():
    """A block of 10 mm in a stock of 12: 1 mm left at the sides and none at the ends; a slot 0.25 mm into it is a gouge
    of 0.25 there, and leaves nothing.
    """
    layers = LayeredStock.block((-6.0, -6.0, 0.0), (6.0, 6.0, 4.0), 1.0, 20.0)
    points, normals = mesh_points(trimesh.creation.box(bounds=[[-5.0, -5.0, 0.0], [5.0, 5.0, 4.0]]), 2000)
    for lean in (0.0, 0.2):
        stock = initial_stock(layers, {1: FLAT}, upright=lean == 0.0)
        found = shape_deviation(stock, points, normals, 0.0)
        assert (found.gouge, found.left, found.points) == (0.0, pytest.approx(1.0, abs=1e-6), len(points))
        # the flank goes along y = 4.75, at the lower height with an axis that leans along its way
        axis = np.array([[math.sin(lean), 0.0, math.cos(lean)]])
        tip = np.array([[-20.0, 4.75 + FLAT.radius, 2.0]])
        skip_moves(stock, tip, tip + ALONG, axis, axis, np.array([1]))
        cut = shape_deviation(stock, points, normals, 2.5)
        assert cut.gouge == pytest.approx(0.25, abs=1e-6)
        assert 4.75 < cut.at[1] <= 5.0 + 1e-9
        side = points[:, 1] > 4.9
        cut = shape_deviation(stock, points[side], normals[side], 2.5)
        assert cut.left == 0.0


def test_a_scallop_is_as_high_as_two_balls_leave_it():
    """Rows of a ball 2 mm apart over a level face leave 4 - sqrt(16 - 1) mm between them."""
    layers = LayeredStock.block((-6.0, -6.0, -2.0), (6.0, 6.0, 1.0), 1.0, 20.0)
    stock = initial_stock(layers, {1: BALL}, upright=True)
    y = np.arange(-4.0, 5.0, 2.0)
    tip = np.column_stack([np.full(5, -20.0), y, np.zeros(5)])
    up = np.tile([0.0, 0.0, 1.0], (5, 1))
    skip_moves(stock, tip, tip + ALONG, up, up, np.ones(5, dtype=np.int64))
    at = np.column_stack([np.zeros(97), np.linspace(-3.0, 3.0, 97), np.zeros(97)])
    found = shape_deviation(stock, at, np.tile([0.0, 0.0, 1.0], (97, 1)), -9.0)
    assert found.gouge < 1e-6
    assert found.left == pytest.approx(4.0 - math.sqrt(15.0), rel=2e-3)
