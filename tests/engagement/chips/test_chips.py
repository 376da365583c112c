"""Chips against differences of polygons, their edges against where they lie; the figure of the diagram."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from chipload.engagement.chips.chips import chips
from chipload.engagement.chips.covered import covered
from chipload.engagement.chips.diagram import diagram
from chipload.engagement.chips.move import Move
from chipload.engagement.chips.ring import Origin
from chipload.engagement.chips.section import depth
from chipload.errors import InputError
from chipload.report.diagram import diagram_figure
from engagement.chips.brute import CUTTERS, random_move

FLAT = CUTTERS["flat"]
UP = [0.0, 0.0, 1.0]
SLOT = Move.lerp([0, 0, 0], UP, [6, 0, 0], UP)


def test_chip_of_a_slot_after_the_first_section():
    """New of a straight move: 2 R d. Its edges: the first section is old, the sides graze, the last is the front."""
    tolerance = 1e-6
    now, first = (
        covered(SLOT, FLAT, 1.0, tolerance),
        covered(Move.lerp([0, 0, 0], UP, [0, 0, 0], UP), FLAT, 1.0, tolerance),
    )
    (chip,) = chips(now, shapely.box(-20, -20, 20, 20), before=first)
    assert chip.area == pytest.approx(60.0, rel=1e-7)
    ring = chip.rings[0]
    middle = 0.5 * (ring.points + np.roll(ring.points, -1, axis=0))
    side = np.abs(np.abs(middle[:, 1]) - 5.0) < 1e-4
    front = np.hypot(middle[:, 0] - 6.0, middle[:, 1]) > 5.0 - 1e-5
    assert (ring.origin[side & (middle[:, 0] > 0.03) & (middle[:, 0] < 5.9)] == Origin.GRAZING).all()
    assert (ring.origin[front & (middle[:, 0] > 6.1)] == Origin.LAST).all()
    assert (ring.origin[(middle[:, 0] < 5.0) & (np.abs(middle[:, 1]) < 4.9)] == Origin.STOCK).all()


def test_half_a_slot_at_the_edge_of_the_stock():
    stock = shapely.box(-50, 0, 50, 50)
    (chip,) = chips(covered(SLOT, FLAT, 1.0, 1e-5), stock)
    assert chip.area == pytest.approx((math.pi * 25.0 + 60.0) / 2.0, rel=1e-7)
    straight = chip.rings[0].origin == Origin.STOCK
    assert straight.sum() == 1


def test_two_walls_give_two_chips_and_none_where_there_is_no_stock():
    stock = shapely.MultiPolygon([shapely.box(-50, 4, 50, 9), shapely.box(-50, -9, 50, -3)])
    found = chips(covered(SLOT, FLAT, 1.0, 1e-4), stock)
    assert len(found) == 2
    assert found[0].area > found[1].area
    assert chips(covered(SLOT, FLAT, 1.0, 1e-4), shapely.box(30, 30, 40, 40)) == ()


@pytest.mark.parametrize("seed", range(12))
def test_origin_theta_and_time_lead_back_to_the_edge(seed):
    """Every vertex lies on the cutter's edge at its time, and stock edges lie on the stock's outline."""
    rng = np.random.default_rng(seed)
    cutter = list(CUTTERS.values())[seed % 5]
    move = random_move(rng, ("lerp", "slerp", "machine")[seed % 3])
    height = float(move.at([0.5])[0][0, 2]) + 2.0
    c = covered(move, cutter, height, 1e-3)
    x, y = shapely.get_coordinates(shapely.centroid(c.polygon))[0]
    stock = shapely.box(x - 3.0, y - 50.0, x + 40.0, y + 50.0)
    for chip in chips(c, stock):
        for ring in chip.rings:
            old = ring.origin == Origin.STOCK
            q = np.roll(ring.points, -1, axis=0)
            assert (stock.exterior.distance(shapely.points(0.5 * (ring.points + q)[old])) < 1e-9).all()
            for p, t in zip(ring.points[~old], ring.t[~old], strict=True):
                assert abs(depth(move, cutter, height, float(np.clip(t, 0, 1)), p[None])[0]) < 4e-3


def test_sum_of_chips_is_the_stock_that_went():
    rng = np.random.default_rng(8)
    stock = shapely.box(-8, -8, 8, 8)
    left, total = stock, 0.0
    p, a = np.zeros(3), np.array(UP)
    for _ in range(12):
        q, b = p + rng.uniform(-2, 2, 3) * [1, 1, 0.3], np.append(rng.uniform(-0.3, 0.3, 2), 1.0)
        c = covered(Move.slerp(p, a, q, b), FLAT, 2.0, 1e-4)
        total += sum(chip.polygon.area for chip in chips(c, left, slivers=True))
        left = left.difference(c.polygon)
        p, a = q, b
    assert total == pytest.approx(stock.area - left.area, rel=1e-9)


def test_diagram_holds_what_the_boundary_is_made_of():
    move = Move.slerp([0, 0, 0], [0.5, 0.1, 1], [6, 3, -1.5], [-0.2, 0.5, 1])
    made = diagram(move, FLAT, 1.0, 1e-3, times=21, angles=37)
    assert made.V.shape == (21, 37)
    used = set(np.concatenate([ring.origin for ring in made.covered.rings]).tolist())
    assert used <= set(made.edges[:, 10].astype(int).tolist())
    assert {Origin.FIRST, Origin.LAST, Origin.GRAZING, Origin.CHORD_END, Origin.FIRST_CHORD} <= used


def test_figure_shows_pieces_in_the_same_colours_on_both():
    move = Move.slerp([0, 0, 0], [0.5, 0.1, 1], [6, 3, -1.5], [-0.2, 0.5, 1])
    figure = diagram_figure(move, FLAT, 1.0, shapely.box(-2, -8, 12, 4), title="a step")
    by_name = {}
    for trace in figure.data:
        if trace.type == "scatter" and trace.line.width == 3:
            by_name.setdefault(trace.name, []).append((trace.xaxis, trace.line.color))
    both = [name for name, found in by_name.items() if len(found) == 2]
    assert {"first section, leaving edge", "last section, advancing edge", "grazing points"} <= set(both)
    for found in by_name.values():
        assert len({colour for _, colour in found}) == 1
    assert figure.layout.title.text == "a step"
    with pytest.raises(InputError, match="the cutter is never in this layer"):
        diagram_figure(move, FLAT, 100.0)
