"""200 random five-axis moves against unions of sections that are found by membership alone.

Resolution of the oracle: 71 sections of 80 rays. Its area is never high; it is low by 0.1 % in the median, by up to 6 %
where sections are slender (rays cut their ends) or a corner's track is a saw of few teeth. What the polygon has too
much is found by points 0.01 mm inside its edge instead, looked up at 3001 times.
"""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from chipload.engagement.chips.covered import covered
from engagement.chips.brute import CUTTERS, inside, random_move, sections
from engagement.chips.grazing import grazing

TOLERANCE, MARGIN, MOVES = 1e-3, 1e-2, 200
WAYS = ("lerp", "slerp", "machine")


@pytest.fixture(scope="module")
def cases():
    rng = np.random.default_rng(2017)
    made = []
    names = list(CUTTERS)
    for k in range(MOVES):
        cutter, move = CUTTERS[names[k % len(names)]], random_move(rng, WAYS[(k // len(names)) % 3])
        above = rng.choice([rng.uniform(-2, 1), rng.uniform(1, 8), rng.uniform(8, 14)])
        height = float(move.at([0.5])[0][0, 2] + above)
        made.append((cutter, move, height, covered(move, cutter, height, TOLERANCE)))
    return made


def test_every_dense_section_is_covered_and_little_else(cases):
    short = []
    for cutter, move, height, c in cases:
        found = sections(cutter, move, height, np.linspace(0.0, 1.0, 71), 80)
        if c is None:
            assert not found
            continue
        union = shapely.unary_union(found) if found else shapely.Polygon()
        polygon = c.polygon
        assert polygon.is_valid
        assert union.difference(polygon.buffer(1.5 * TOLERANCE)).area < 1e-9
        assert abs(c.area - polygon.area) <= TOLERANCE * polygon.length
        short.append((polygon.area - union.area) / polygon.area)
    assert len(short) > 150
    assert np.median(short) < 2e-3
    assert np.quantile(short, 0.9) < 0.01
    assert max(short) < 0.06


def test_points_just_inside_are_covered_at_some_time(cases):
    times = np.linspace(0.0, 1.0, 3001)
    looked = 0
    for cutter, move, height, c in cases:
        if c is None:
            continue
        edge = c.polygon.buffer(-MARGIN).boundary
        if edge.is_empty:
            continue
        points = shapely.get_coordinates(shapely.line_interpolate_point(edge, np.linspace(0, 1, 25), normalized=True))
        tip, axis = move.at(times)
        for p in points:
            assert inside(cutter, tip, axis, height, np.broadcast_to(p, (len(times), 2))).any(), (height, p)
            looked += 1
    assert looked > 3000


def test_two_and_four_grazing_points_and_both_ways_occur(cases):
    counts = {0: 0, 2: 0, 4: 0}
    ways = {True: 0, False: 0}
    pieces = set()
    for cutter, move, height, c in cases:
        if c is None:
            continue
        ways[c.simple] += 1
        for t in np.linspace(0.0, 1.0, 9):
            g = grazing(move, cutter, height, t, 1e-6)
            if g is not None and len(g.theta) in counts:
                counts[len(g.theta)] += 1
                pieces |= set(g.piece.tolist())
    assert counts[2] > 500
    assert counts[4] > 50
    assert min(ways.values()) > 20
    assert pieces >= {1, 2, 3, 5}
