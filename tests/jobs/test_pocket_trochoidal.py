"""The trochoidal strategy from the job to the simulated program, in a channel hardly wider than the cutter."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from pocket_job import done, operation, swept, written

#: limit of the engagement [deg]; the radial depth asks for 36.87 deg of R 4
LIMIT, DEPTH = 40.0, 0.8
LONG, WIDE, R = 26.0, 10.0, 4.0


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    more = f'radial_depth_mm = {DEPTH}\nstrategies = ["trochoidal"]\nuse = "trochoidal"\n'
    slot = [(0, 0), (LONG, 0), (LONG, WIDE), (0, WIDE)]
    path = written(tmp_path_factory.mktemp("slot"), {"0": [slot]}, operation(more), limits=f"engagement_deg = {LIMIT}")
    return done(path)


def test_the_simulation_meets_no_more_than_the_limit(finished):
    """``done`` also holds the verification of the program: it agrees with the plan."""
    (strategy,), outcome = finished
    (op,) = outcome.operations
    assert list(op.result.strategies) == ["trochoidal"]
    cuts = strategy.history["pass"] != "entry"
    worst = float(np.max(strategy.history["engagement_deg"][cuts]))
    assert worst <= np.degrees(np.arccos(1.0 - DEPTH / R)) + 0.01 <= LIMIT


def test_the_channel_is_cleared_but_for_its_corners(finished):
    """What a disc of R cannot reach of a right angle is (1 - pi / 4) R^2; of the rest 99.8 % is swept."""
    (strategy,), _ = finished
    reachable = LONG * WIDE - (4.0 - np.pi) * R * R
    area = swept(strategy.program, R, -4.0).intersection(shapely.box(0.0, 0.0, LONG, WIDE)).area
    assert 0.998 * reachable < area < 1.0005 * reachable
