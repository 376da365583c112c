from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.machine.kinematics import forward
from chipload.machine.linearise import linearise, trace_path
from chipload.machine.machine import machine_named

FIVE = ("cradle-ac", "dmu50", "xyzac-trunnion", "xyzbc-trunnion", "xyzbc-head-table", "xyzbcw-bridge")


def densely(machine, axes, k, tool):
    """Tips and axes at 400 places while every axis goes straight from row k - 1 to row k."""
    t = np.linspace(0.0, 1.0, 401)[:, None]
    return forward(machine, (1.0 - t) * axes[k - 1] + t * axes[k], tool)


def from_line(x, a, b):
    u = (b - a) / np.linalg.norm(b - a)
    return np.linalg.norm(np.cross(x - a, u), axis=1).max()


@pytest.mark.parametrize("name", FIVE)
@pytest.mark.parametrize("tolerance", [0.1, 0.002])
def test_the_tip_stays_on_its_line_and_the_axis_on_its_great_circle(name, tolerance):
    machine = machine_named(name)
    rng = np.random.default_rng(11)
    tip = rng.uniform(-60.0, 60.0, (6, 3))
    turn = np.cumsum(rng.uniform(0.2, 0.7, 6))
    tilt = rng.uniform(0.4, 0.9, 6)
    axis = np.column_stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
    pieces, _ = linearise(machine, tip, axis, tolerance, 1e-3, tool_length=80.0)
    ends = pieces.part == 1.0
    np.testing.assert_allclose(pieces.tip[ends], tip, atol=1e-12)
    np.testing.assert_allclose(pieces.axis[ends], axis, atol=1e-12)
    assert len(pieces.row) > 6
    worst = angle = 0.0
    for k in range(1, len(pieces.row)):
        row = pieces.row[k]
        x, a = densely(machine, pieces.axes, k, 80.0)
        worst = max(worst, from_line(x, tip[row - 1], tip[row]))
        n = np.cross(axis[row - 1], axis[row])
        angle = max(angle, np.abs(np.arcsin(a @ n / np.linalg.norm(n))).max())
    assert worst <= tolerance
    assert angle <= 1e-3
    assert max(worst / tolerance, angle / 1e-3) > 0.3  # and no finer than it has to be


def test_error_falls_with_the_square_of_the_length():
    tip, axis = [[0.0, 0.0, 0.0], [50.0, 10.0, 0.0]], [[0.1, 0.0, 1.0], [0.6, 0.8, 0.8]]
    tolerance = np.array([1e-1, 1e-2, 1e-3, 1e-4])
    count = [len(linearise(machine_named("cradle-ac"), tip, axis, t, 1.0)[0].row) - 1 for t in tolerance]
    assert np.polyfit(np.log(tolerance), np.log(count), 1)[0] == pytest.approx(-0.5, abs=0.05)


def test_a_move_without_rotation_is_left_alone():
    tip, axis = [[0.0, 0.0, 0.0], [50.0, 10.0, 0.0]], [[0.6, 0.0, 0.8]] * 2
    pieces, findings = linearise(machine_named("cradle-ac"), tip, axis, 1e-6, 1e-9)
    assert pieces.row.tolist() == [0, 1]
    assert findings == ()


@pytest.mark.parametrize("low", [-120.0, 0.0])
def test_past_the_pole_many_pieces_hold(low):
    """0.5 deg beside the pole, A from +10 to -10 or C half a turn round: the tip still keeps its line."""
    machine = machine_named("cradle-ac")
    axes = tuple(replace(a, low=math.radians(low)) if a.letter == "A" else a for a in machine.chain.axes)
    machine = replace(machine, chain=replace(machine.chain, axes=axes))
    tip = np.array([[0.0, 0.0, 0.0], [20.0, 0.0, 0.0]])
    a = math.radians(10.0)
    axis = np.array([[math.radians(0.5), -math.sin(a), math.cos(a)], [math.radians(0.5), math.sin(a), math.cos(a)]])
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    pieces, findings = linearise(machine, tip, axis, 0.01, 1e-3)
    assert "machine-linear" not in [f.code for f in findings]
    worst = max(from_line(densely(machine, pieces.axes, k, 0.0)[0], *tip) for k in range(1, len(pieces.row)))
    assert worst <= 0.01


def test_a_jump_that_no_piece_mends_is_reported():
    """C goes from -200 to 200 deg and the path from 0 to 300: it must go back once, whatever the pieces."""
    machine = machine_named("cradle-ac")
    ways = {"A": (0.0, 1.0), "C": (-math.radians(200.0), math.radians(200.0))}
    axes = tuple(
        replace(a, low=ways[a.letter][0], high=ways[a.letter][1]) if a.rotary else a for a in machine.chain.axes
    )
    machine = replace(machine, chain=replace(machine.chain, axes=axes))
    t = np.radians(np.arange(0.0, 301.0, 50.0))
    axis = np.column_stack([0.3 * np.sin(t), 0.3 * np.cos(t), np.full(7, math.sqrt(1.0 - 0.09))])
    pieces, findings = linearise(machine, np.zeros((7, 3)), axis, 0.01, 1e-3, np.zeros(9))
    assert [f.code for f in findings] == ["machine-singular", "machine-rewind", "machine-linear"]
    assert np.degrees(np.ptp(pieces.axes[:, 5])) <= 400.0
    assert len(pieces.row) < 300


def test_traced_leaves_the_true_path_by_the_tolerance():
    """A quarter turn of the table and a move of X at once: a spiral; the chords against 400 places each."""
    machine = machine_named("cradle-ac")
    q = np.zeros((3, 9))
    q[:, 0] = 50.0, 80.0, -10.0
    q[1:, 5] = math.pi / 2, math.pi / 2 + 4.0 * math.pi
    path = trace_path(machine, q, 0.01)
    worst = 0.0
    for k in range(1, len(path.row)):
        x, _ = densely(machine, path.axes, k, 0.0)
        share = np.linspace(0.0, 1.0, 401)[:, None]
        chord = (1.0 - share) * path.tip[k - 1] + share * path.tip[k]
        worst = max(worst, np.linalg.norm(x - chord, axis=1).max())
    assert 0.003 < worst <= 0.01
    by_hand = 50.0 + (80.0 - 50.0) * path.part[path.row == 1]
    np.testing.assert_allclose(np.linalg.norm(path.tip[path.row == 1][:, :2], axis=1), by_hand, atol=1e-10)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda m: linearise(m, np.zeros((1, 3)), [[0, 0, 1.0]], 0.0, 1.0),
            "linearise: tolerance 0, angle_tolerance 1: must be above 0",
        ),
        (
            lambda m: linearise(m, np.zeros((2, 3)), [[0, 0, 1.0], [0, 0, -1.0]], 0.1, 1.0),
            "linearise: row 1: the axis turns by 180 deg: must be less, no great circle is the shortest",
        ),
        (
            lambda m: linearise(m, [[0, 0, 0], [50, 50, 0]], [[0, 0, 1.0], [0, 1.0, 1.0]], 1e-6, 1e-3, max_rows=10),
            "pieces are more than max_rows = 10: raise the tolerance or max_rows",
        ),
        (lambda m: trace_path(m, np.zeros((1, 3)), 0.1), "traced: axes (1, 3): must be (n, 9) finite numbers, n >= 1"),
        (lambda m: trace_path(m, np.zeros((1, 9)), -1.0), "traced: tolerance -1: must be above 0"),
        (
            lambda m: trace_path(m, [[0] * 9, [0, 0, 0, 0, 0, 1e12, 0, 0, 0]], 0.1),
            "traced: more than 1000000 pieces: raise the tolerance or max_rows",
        ),
    ],
)
def test_refused(call, message):
    with pytest.raises(InputError) as err:
        call(machine_named("cradle-ac"))
    assert str(err.value).endswith(message)
