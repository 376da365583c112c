"""Time of a front's path: finite also where a pass is one short step between two stops, and as the program's."""

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.machine.machine import machine_named
from chipload.planning.link_rows import row_ends
from chipload.planning.pocket.clearing import CUT, LIFT, LINK, ClearingPath
from chipload.planning.pocket.plan import Clearing, _programs, _speeds, _times
from chipload.planning.result import StrategyResult
from chipload.program.program import Program
from chipload.program.time import program_time

MACHINE = machine_named("vmc")
ASKED = Clearing("down", 0.15, 1.0, 20.0, 838.0, 0.0, 5.0, 0.2)


def path(x, y, kind):
    n = len(x)
    whole = np.zeros(n, dtype=np.int64)
    flat = np.zeros(n)
    return ClearingPath(
        np.array(x, float), np.array(y, float), np.array(kind), flat, flat, whole, whole, (), 1.0, 1.0, 0.0, (), {}
    )


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
    centre = np.column_stack([run.x, run.y])
    _, speed = _speeds(run, centre, ASKED, MACHINE)
    programs = _programs(run, centre, ASKED, 1)
    program = Program.join(programs)
    time = _times(run, programs, row_ends(program, MACHINE))
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
    program = Program.join(_programs(run, np.column_stack([run.x, run.y]), ASKED, 1))
    good = StrategyResult("pocket", program, {"x_mm": np.zeros(2), "y_mm": np.zeros(2)}, {"time_s": 1.0, "n": 3})
    with pytest.raises(InputError) as refused:
        replace(good, **changes)
    assert str(refused.value).startswith(message)
