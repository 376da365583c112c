"""The pallet's greatest rate: moves are slowed down to it, and a program that exceeds it is found."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.machine.machine import machine_named
from chipload.planning.impeller.links import Moves, _within_rate
from chipload.planning.impeller.programs import pallet_rate, program_of, too_fast
from chipload.program.program import LINE, RAPID

MACHINE = machine_named("horizontal-b")


def moves(turn: float, length: float, feed: float, before: float = 3.0) -> Moves:
    """A rapid, and a cut of a length [mm] in which the pallet turns from ``before`` by ``turn`` [rad]."""
    angles = np.array([before, before + turn])
    axis = np.stack([np.cos(angles), np.sin(angles), np.zeros(2)], axis=-1)
    tip = np.array([[0.0, 0.0, 50.0], [length, 0.0, 50.0]])
    return Moves((RAPID, LINE), tip, axis, np.array([0.0, feed]), ("link", "finish"))


@pytest.mark.parametrize("turn", [0.3, -0.3])
@pytest.mark.parametrize(("share", "count"), [(0.999, 0), (1.001, 1)])
def test_a_pallet_that_would_turn_too_fast(turn: float, share: float, count: int) -> None:
    """A cut of 2 mm in which it turns by 0.3 rad takes 2 mm over the feed. From 3 rad it turns over half a turn."""
    feed = share * 2.0 * pallet_rate(MACHINE) / 0.3
    found = too_fast(program_of(moves(turn, 2.0, feed), 500.0, 1), MACHINE)
    assert len(found) == count
    if count:
        asked, most = share * math.degrees(pallet_rate(MACHINE)), math.degrees(pallet_rate(MACHINE))
        assert found[0].text == f"row 1: the pallet turns at {asked:g} deg/s: machine {MACHINE.name} reaches {most:g}"


@pytest.mark.parametrize("turn", [0.3, -0.3])
def test_moves_are_slowed_down_to_the_rate(turn: float) -> None:
    fast = moves(turn, 2.0, 1000.0)
    slow = _within_rate(fast, 0.6)
    assert slow.feed == pytest.approx([0.0, 2.0 * 0.6 / 0.3], rel=1e-8)
    assert slow.feed[1] <= 2.0 * 0.6 / 0.3
    # what is slow enough keeps its feed; a machine without a limit changes nothing
    assert _within_rate(moves(turn, 2.0, 3.9), 0.6).feed.tolist() == [0.0, 3.9]
    assert _within_rate(replace(fast, feed=np.array([0.0, 7.0])), math.inf).feed.tolist() == [0.0, 7.0]
