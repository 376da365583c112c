"""The claims of [Chips2017] that were read: ellipses on layers, two or four grazing points, chips in two pieces.

The oracles are the quartic of a cylinder, sampled membership and closed forms; none of the paper's timings was at hand.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.chips import chips
from chipload.engagement.chips.covered import covered
from chipload.engagement.chips.move import Move
from chipload.engagement.chips.section import section
from engagement.chips.grazing import ellipse_grazing

R = 5.0
MILL = Cutter(2.0 * R, 4, 0.5, 60.0, 80.0, 6e5)
STOCK = shapely.box(-40.0, -40.0, 40.0, 40.0)
HEIGHT = 20.0


def turning(tilt: float, turn: float, height: float = HEIGHT) -> Move:
    """The axis turns about z by ``turn`` at a fixed tilt; its line stays on the point (0, 0, HEIGHT)."""

    def at(t):
        phi = turn * t
        lean = math.sin(tilt) * np.array([np.cos(phi), np.sin(phi)])
        a = np.column_stack([*lean, np.full(len(t), math.cos(tilt))])
        return np.array([0.0, 0.0, height]) - a * height / a[:, 2:], a

    return Move.of(at)


@pytest.mark.parametrize("tilt", [0.0, 0.3, 0.7])
def test_the_edge_on_a_layer_is_an_ellipse(tilt):
    """Semi-axes R across the lean and R / cos(tilt) along it."""
    theta = np.linspace(0.0, math.tau, 41)[:-1]
    found = section(turning(tilt, 0.5), MILL, HEIGHT, 0.0, theta)
    x, y = found.points.T
    np.testing.assert_allclose((x * math.cos(tilt) / R) ** 2 + (y / R) ** 2, 1.0, atol=1e-12)


def test_two_grazing_points_of_three_axes_and_four_of_five():
    rng = np.random.default_rng(1)
    for _ in range(50):
        rate = rng.normal(size=3)
        theta, _ = ellipse_grazing(R, 1.0, [0, 0, 0], [0, 0, 1], rate, [0, 0, 0], 1e-6)
        assert len(theta) == 2
    # the axis turns about a point of the layer: the edge leaves on two sides and enters on two
    (p, a), (dp, da) = (f([0.5]) for f in (turning(0.5, 0.9).at, turning(0.5, 0.9).rates))
    theta, sign = ellipse_grazing(R, HEIGHT, p[0], a[0], dp[0], da[0], 1e-6)
    assert len(theta) == 4
    assert sorted(sign.tolist()) == [-1, -1, 1, 1]


@pytest.mark.parametrize("turn", [0.3, 0.9, 2.0])
def test_a_chip_in_two_pieces(turn):
    tilt = 0.5
    p = R / math.cos(tilt)
    new = turn * p * p + 2.0 * p * R * math.atan(p / R * math.tan((math.pi - turn) / 2.0)) - math.pi * R * p
    now, first = (covered(turning(tilt, t), MILL, HEIGHT, 1e-5) for t in (turn, 0.0))
    found = chips(now, STOCK, before=first)
    assert [chip.area for chip in found] == pytest.approx([new / 2.0, new / 2.0], rel=1e-6)


def test_layers_of_a_move_add_up_to_its_volume():
    """A move of three axes at fixed lean, no swept volume built: (base area) x (path across the axis), by Cavalieri.

    Between two heights at which the flank alone cuts, each layer loses the strip of the ellipse: width across the
    feed times the feed.
    """
    tilt, d = 0.4, 3.0
    a = [math.sin(tilt), 0.0, math.cos(tilt)]
    move = Move.lerp([0.0, 0.0, 0.0], a, [0.0, d, 0.0], a)
    heights = np.linspace(6.0, 16.0, 21)[:-1] + 0.25
    total = 0.0
    for h in heights:
        before = covered(Move.lerp([0.0, 0.0, 0.0], a, [0.0, 0.0, 0.0], a), MILL, float(h), 1e-5)
        total += 0.5 * sum(chip.area for chip in chips(covered(move, MILL, float(h), 1e-5), STOCK, before=before))
    assert total == pytest.approx(10.0 * 2.0 * R / math.cos(tilt) * d, rel=1e-6)
