"""Covered areas of barrel cutters against membership by the profile alone, upright and leaning.

The oracle is that of the random moves: dense sections by halved rays (never high, low by 0.1 % in the median), and
points just inside the polygon's edge looked up at 3001 times.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.covered import covered
from chipload.engagement.chips.move import Move
from chipload.engagement.chips.section import depth, section
from engagement.chips.brute import inside, random_move, sections

TOLERANCE, MARGIN, MOVES = 1e-3, 1e-2, 120
BARRELS = {
    "round tip": Cutter(10.0, 4, 0.5, 14.0, 40.0, 6e5, corner_radius=1.0, barrel_radius=60.0),
    "short arc": Cutter(10.0, 4, 0.5, 16.0, 40.0, 6e5, corner_radius=2.5, barrel_radius=20.0),
    "conical": Cutter(6.0, 4, 0.5, 14.0, 40.0, 6e5, corner_radius=1.5, barrel_radius=90.0, taper=math.radians(9.0)),
    "sharp": Cutter(10.0, 4, 0.5, 14.0, 40.0, 6e5, corner_e=2.0, barrel_radius=25.0),
    "flat tip": Cutter(10.0, 4, 0.5, 14.0, 40.0, 6e5, corner_radius=1.0, corner_e=2.0, barrel_radius=40.0),
    "drilled": Cutter(
        10.0, 4, 0.5, 14.0, 40.0, 6e5, corner_radius=1.0, corner_e=1.0, barrel_radius=40.0, bottom=math.radians(15.0)
    ),
}


@pytest.fixture(scope="module")
def cases():
    rng = np.random.default_rng(85)
    made, names = [], list(BARRELS)
    for k in range(MOVES):
        cutter = BARRELS[names[k % len(names)]]
        move = random_move(rng, ("lerp", "slerp", "machine")[(k // len(names)) % 3])
        above = rng.choice([rng.uniform(-2, 1), rng.uniform(1, 8), rng.uniform(8, 14)])
        height = float(move.at([0.5])[0][0, 2] + above)
        made.append((cutter, move, height, covered(move, cutter, height, TOLERANCE)))
    return made


def test_every_dense_section_is_covered_and_little_else(cases):
    short = []
    for cutter, move, height, c in cases:
        found = sections(cutter, move, height, np.linspace(0.0, 1.0, 51), 80)
        if c is None:
            assert not found
            continue
        union = shapely.unary_union(found) if found else shapely.Polygon()
        polygon = c.polygon
        assert polygon.is_valid
        assert union.difference(polygon.buffer(1.5 * TOLERANCE)).area < 1e-9
        # a sliver thinner than the rays tell apart is short by its whole area
        short.append((polygon.area - union.area) / max(polygon.area, 0.01))
    assert len(short) > 90
    assert np.median(short) < 3e-3
    assert np.quantile(short, 0.9) < 0.02
    assert max(short) < 0.08


def test_points_just_inside_are_covered_at_some_time(cases):
    times = np.linspace(0.0, 1.0, 2001)
    looked = 0
    for cutter, move, height, c in cases:
        edge = shapely.Polygon() if c is None else c.polygon.buffer(-MARGIN).boundary
        if edge.is_empty:
            continue
        points = shapely.get_coordinates(shapely.line_interpolate_point(edge, np.linspace(0, 1, 15), normalized=True))
        tip, axis = move.at(times)
        for p in points:
            assert inside(cutter, tip, axis, height, np.broadcast_to(p, (len(times), 2))).any(), (height, p)
            looked += 1
    assert looked > 1300


@pytest.mark.parametrize("name", BARRELS)
def test_an_upright_slot_is_as_wide_as_the_profile(name):
    cutter = BARRELS[name]
    move = Move.lerp([0, 0, 0], [0, 0, 1], [20, 0, 0], [0, 0, 1])
    for z in (0.1, 0.7, 2.3, 6.1, 13.9):
        rho = float(cutter.radius_at([z])[0])
        assert covered(move, cutter, z, 1e-4).area == pytest.approx(math.pi * rho**2 + 40.0 * rho, rel=1e-7)


def test_the_edge_of_a_section_lies_on_the_profile():
    rng = np.random.default_rng(2)
    seen = set()
    for k in range(60):
        cutter = list(BARRELS.values())[k % len(BARRELS)]
        move = random_move(rng, "slerp")
        height = float(move.at([0.5])[0][0, 2] + rng.uniform(0.2, 11.0))
        edge = section(move, cutter, height, 0.5, np.linspace(0.0, math.tau, 40))
        if edge is None:
            continue
        seen |= set(edge.piece.tolist())
        assert np.abs(depth(move, cutter, height, 0.5, edge.points)).max() < 1e-9
        tip, axis = (v[0] for v in move.at([0.5]))
        assert inside(cutter, tip, axis, height, edge.points - 1e-6 * edge.normal).all()
        assert not inside(cutter, tip, axis, height, edge.points + 1e-6 * edge.normal).any()
    assert seen >= {1, 2, 3, 4, 6}
