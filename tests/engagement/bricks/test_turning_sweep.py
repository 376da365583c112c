"""Containment in what a leaning and turning cutter sweeps, against many times of the move."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.cutter.record import cutter_record
from chipload.engagement.bricks._sweep import WAIT, least, outside_distance, swept
from chipload.engagement.bricks.stock import move_rows
from engagement.bricks.programs import inside, turned, unit
from engagement.moves.field import CUTTERS

WAYS = {
    "fixed": ((2.0, -1.0, 0.5), (0.0, 0.0, 0.0)),
    "along the axis": ((1.2, 0.8, 4.0), (0.0, 0.0, 0.0)),
    "turns": ((1.5, 1.0, -0.3), (0.04, -0.02, 0.01)),
    "turns in place": ((0.0, 0.0, 0.0), (0.05, 0.0, 0.0)),
    "turns against its way": ((-1.5, 0.0, 0.1), (0.05, 0.0, 0.0)),
}


@pytest.mark.parametrize("kind", CUTTERS)
@pytest.mark.parametrize("way", WAYS)
def test_swept_is_what_some_time_of_the_move_covers(kind: str, way: str) -> None:
    cutter, (u, lean) = CUTTERS[kind], WAYS[way]
    random = np.random.default_rng(5)
    p0, a0 = np.array([[1.0, 2.0, -3.0]]), unit([[0.3, 0.2, 1.0]])
    p1, a1 = p0 + u, unit(a0 + lean)
    m, c, wait = move_rows(p0, p1, a0, a1)[0], cutter_record(cutter)[0], np.empty((WAIT, 6))
    # around the surface of the cutter at some time
    n = 120
    x = np.empty((n, 3))
    for k, t in enumerate(random.uniform(0.0, 1.0, n)):
        tip, axis = p0[0] + t * np.asarray(u), turned(a0[0], a1[0], float(t))
        w = random.uniform(-0.2, 1.0) * 8.0
        across = np.cross(axis, unit(random.normal(size=3)))
        x[k] = tip + w * axis + unit(across) * random.uniform(0.0, 1.3) * c["wide"]
    known = np.zeros(n, dtype=bool)
    depth = np.full(n, np.inf)
    for t in np.linspace(0.0, 1.0, 401):
        known |= inside(cutter, p0[0] + t * np.asarray(u), turned(a0[0], a1[0], float(t)), x)
        depth = np.minimum(depth, [outside_distance(m, c, t, *p)[0] for p in x])
    found = np.array([swept(m, c, *p, wait) for p in x])
    # between two times a point may be swept that no time shows: by no more than the way between them
    assert not (known & ~found).any()
    assert (depth[found & ~known] < 3e-5).all()
    assert known.any()
    assert (~known).any()
    for p, d in zip(x[:40], depth[:40], strict=True):
        low, high = least(m, c, *p, np.inf, -np.inf, 1e-6, wait)
        assert d - 5e-3 <= low <= high <= d + 1e-6


@pytest.mark.parametrize("kind", CUTTERS)
def test_rates_are_those_of_differences(kind: str) -> None:
    random = np.random.default_rng(8)
    c = cutter_record(CUTTERS[kind])[0]
    a0, a1 = unit([[0.3, 0.2, 1.0]]), unit([[0.33, 0.17, 1.0]])
    m = move_rows(np.zeros((1, 3)), np.array([[1.0, 0.4, -0.3]]), a0, a1)[0]
    for p in random.uniform(-6.0, 9.0, (50, 3)):
        rate = outside_distance(m, c, 0.4, *p)[1]
        known = (outside_distance(m, c, 0.4 + 1e-6, *p)[0] - outside_distance(m, c, 0.4 - 1e-6, *p)[0]) / 2e-6
        assert rate == pytest.approx(known, abs=1e-4)
