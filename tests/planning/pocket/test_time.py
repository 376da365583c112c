"""Time of a front's path: finite also where a pass is one short step between two stops, and as the program's."""

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.machine.machine import machine_named
from chipload.planning.link_rows import row_ends
from chipload.planning.pocket.clearing_path import CUT, LIFT, LINK, ClearingPath
from chipload.planning.pocket.motions import clock, motions_of, programs_of, samples_of, speeds
from chipload.planning.pocket.request import Clearing
from chipload.planning.result import StrategyResult
from chipload.program.program import Program
from chipload.program.time import program_time

MACHINE = machine_named("vmc")
ASKED = Clearing("down", 0.15, 1.0, 20.0, 838.0, 0.0, 5.0, 0.2, link_feed=20.0, link_lift=0.0)


def path(x, y, kind):
    n = len(x)
    whole = np.zeros(n, dtype=np.int64)
    flat = np.zeros(n)
    return ClearingPath(
        np.array(x, float), np.array(y, float), np.zeros((n, 2)), flat, np.array(kind), flat, whole, (), 1.0, 1.0, 0.0,
        (), {},
    )  # fmt: skip


def programs(run, asked=ASKED):
    motions = motions_of(run, asked.heights, asked.feed, asked.link_feed)
    return motions, programs_of(motions, asked.feed, asked.spindle_speed, 1)


@pytest.mark.parametrize(
    ("x", "y", "kind", "steps_mm"),
    [
        # down, one step, up
        ([0.0, 0.125], [0.0, 0.0], [LIFT, CUT], [0.125]),
        # there and back on the same line: a stop at the turn
        ([0.0, 0.1, 0.0, 5.0], [0.0, 0.0, 0.0, 0.0], [LIFT, CUT, LINK, CUT], [0.1, 0.1, 5.0]),
        # two passes of one step each
        ([0.0, 0.125, 3.0, 3.0], [0.0, 0.0, 1.0, 1.02], [LIFT, CUT, LIFT, CUT], [0.125, 0.02]),
    ],
)
def test_time_between_stops(x, y, kind, steps_mm):
    """From rest to rest: 2 sqrt(L / a), or L / v + v / a where the feed v is reached; the program, which rounds the
    corner below the plunge, takes no longer.
    """
    run = path(x, y, kind)
    motions, parts = programs(run)
    samples = samples_of(motions, 10.0)
    _, speed, own = speeds(motions, samples, MACHINE)
    program = Program.join(parts)
    time = clock(motions, samples, own, parts, row_ends(program, MACHINE))
    assert np.isfinite(time).all()
    assert (speed <= ASKED.feed).all()
    a, v = MACHINE.acceleration_xy, ASKED.feed
    wanted = [2.0 * math.sqrt(d / a) if d < v**2 / a else d / v + v / a for d in steps_mm]
    moves = np.flatnonzero(run.kind != LIFT)
    # rows of one program: the corner below the plunge is rounded, so the first step may be shorter
    assert (time[moves] - time[moves - 1] <= np.array(wanted) * (1.0 + 1e-6)).all()
    assert (time[moves] - time[moves - 1] > 0.0).all()
    level = (program.p_work[:, 2] == -1.0) & (np.diff(program.p_work[:, 2], prepend=9.0) == 0.0)
    assert program_time(program, MACHINE)[level].sum() <= sum(wanted)


def test_a_link_runs_off_the_floor_at_its_own_feed():
    """30 mm of link: 1 mm up and 1 mm down over 0.1 mm, 28 mm between; a link of 1 mm stays on the floor."""
    asked = replace(ASKED, link_feed=200.0, link_lift=0.1)
    run = path([0.0, 5.0, 35.0, 40.0, 41.0, 45.0], np.zeros(6), [LIFT, CUT, LINK, CUT, LINK, CUT])
    _, parts = programs(run, asked)
    program = Program.join(parts)
    level = program.p_work[2:-1]
    assert level[:, 0].tolist() == pytest.approx([5.0, 6.0, 34.0, 35.0, 40.0, 41.0, 45.0])
    assert level[:, 2].tolist() == pytest.approx([-1.0, -0.9, -0.9, -1.0, -1.0, -1.0, -1.0])
    assert program.feed[2:-1].tolist() == [20.0, 200.0, 200.0, 200.0, 20.0, 200.0, 20.0]
    slow = Program.join(programs(run, replace(ASKED, link_lift=0.1))[1])
    # 31 mm at 200 mm/s in place of 20 mm/s, but for the ramps of speed
    gain = program_time(slow, MACHINE).sum() - program_time(program, MACHINE).sum()
    assert 1.1 < gain < 31.0 * (1 / 20 - 1 / 200) + 0.6


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"summary": {"time_s": math.inf}}, "strategy pocket: summary.time_s = inf: must be finite"),
        ({"summary": {"a": {"b": [1.0, math.nan]}}}, "strategy pocket: summary.a.b.1 = nan: must be finite"),
        ({"summary": {"a": np.float64(-np.inf)}}, "strategy pocket: summary.a = -inf: must be finite"),
        (
            {"history": {"x_mm": np.array([1.0, 2.5]), "y_mm": np.zeros(2), "t_s": np.array([0.0, np.inf])}},
            "strategy pocket: history.t_s = inf in row 1 at (2.5, 0): must be finite",
        ),
    ],
)
def test_a_result_refuses_what_is_not_finite(changes, message):
    run = path([0.0, 0.125], [0.0, 0.0], [LIFT, CUT])
    program = Program.join(programs(run)[1])
    good = StrategyResult("pocket", program, {"x_mm": np.zeros(2), "y_mm": np.zeros(2)}, {"time_s": 1.0, "n": 3})
    with pytest.raises(InputError) as refused:
        replace(good, **changes)
    assert str(refused.value).startswith(message)
