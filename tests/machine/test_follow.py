from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.machine.follow import follow
from chipload.machine.kinematics import forward, inverse
from chipload.machine.machine import machine_named

TRUNNION = machine_named("xyzac-trunnion")
TAU = math.tau


def limited(**limits):
    """The trunnion with other limits [deg], and linear axes that reach everything."""
    axes = []
    for a in TRUNNION.chain.axes:
        low, high = limits.get(a.letter, (None, None))
        if low is not None:
            a = replace(a, low=math.radians(low), high=math.radians(high))
        axes.append(a if a.rotary else replace(a, low=-1e4, high=1e4))
    return replace(TRUNNION, chain=replace(TRUNNION.chain, axes=tuple(axes)))


def tilted(c_deg, a_deg=45.0):
    """Axes of the tool on which the trunnion stands at these angles."""
    q = np.zeros((len(c_deg), 9))
    q[:, 5], q[:, 3] = np.radians(c_deg), np.radians(a_deg)
    return forward(TRUNNION, q)[1]


def least_motion(machine, axis, start):
    """Every choice of solution and whole turns within the limits: least sum of the greatest rotary motion of a step."""
    found = inverse(machine, np.zeros_like(axis), axis)
    a, c = machine.chain.axis("A"), machine.chain.axis("C")
    states = []
    for k in range(len(axis)):
        here = []
        for solution in found.axes[k]:
            for i, j in itertools.product(range(-3, 4), repeat=2):
                qa, qc = solution[3] + TAU * i, solution[5] + TAU * j
                if a.low <= qa <= a.high and c.low <= qc <= c.high:
                    here.append((qa, qc))
        states.append(here)
    best = math.inf
    for path in itertools.product(*states):
        steps = ([start] if start else []) + list(path)
        best = min(best, sum(max(abs(p - q) for p, q in zip(s, t, strict=True)) for s, t in itertools.pairwise(steps)))
    return best


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("start", [None, (0.3, 1.0)])
def test_least_motion_against_all_choices(seed, start):
    machine = limited(A=(-100, 80), C=(-270, 270))
    rng = np.random.default_rng(seed)
    axis = tilted(np.cumsum(rng.uniform(-150, 150, 5)), rng.uniform(10, 70, 5))
    begin = None
    if start:
        begin = np.zeros(9)
        begin[[3, 5]] = start
    axes, _ = follow(machine, np.zeros((5, 3)), axis, begin)
    np.testing.assert_allclose(forward(machine, axes)[1], axis, atol=1e-12)
    for letter, column in (("A", 3), ("C", 5)):
        limits = machine.chain.axis(letter)
        assert (axes[:, column] >= limits.low - 1e-9).all()
        assert (axes[:, column] <= limits.high + 1e-9).all()
    steps = np.vstack([begin, axes]) if start else axes
    motion = np.abs(np.diff(steps[:, [3, 5]], axis=0)).max(axis=1).sum()
    assert motion == pytest.approx(least_motion(machine, axis, start), abs=1e-4)


def test_a_limit_of_the_tilt_decides_the_solution():
    """A stops at +50: a tilt of 70 needs A = -70 and C half a turn on."""
    axes, findings = follow(limited(), np.zeros((2, 3)), tilted([0.0, 10.0], 70.0))
    np.testing.assert_allclose(np.degrees(axes[:, 3]), [-70, -70], atol=1e-9)
    np.testing.assert_allclose(np.degrees(np.diff(axes[:, 5])), [10], atol=1e-9)
    assert findings == ()


def test_turns_before_the_path_save_a_rewind():
    """Five quarter turns on a C of -270 to 270 deg: begun at -270 there is room."""
    axes, findings = follow(limited(C=(-270, 270), A=(0, 50)), np.zeros((6, 3)), tilted(90.0 + 90.0 * np.arange(6)))
    np.testing.assert_allclose(np.degrees(axes[:, 5]), [-270, -180, -90, 0, 90, 180], atol=1e-9)
    assert findings == ()


def test_a_rewind_is_reported_narrow():
    """Eight quarter turns on the same C: one turn back is needed."""
    axes, findings = follow(limited(C=(-270, 270), A=(0, 50)), np.zeros((9, 3)), tilted(90.0 + 90.0 * np.arange(9)))
    assert [f.code for f in findings if f.code == "machine-rewind"] == ["machine-rewind"]
    assert (np.abs(np.degrees(axes[:, 5])) < 270 + 1e-9).all()


def test_a_rewind_is_reported_wide():
    """Twelve turns on a C of 11: it begins at its lower end and goes back once, by two turns."""
    machine = limited(C=(-1980, 1980), A=(0, 50))
    axes, findings = follow(machine, np.zeros((145, 3)), tilted(30.0 * np.arange(145)), line=np.arange(145) + 100)
    assert (np.abs(np.degrees(axes[:, 5])) < 1980 + 1e-9).all()
    change = np.degrees(np.diff(axes[:, 5]))
    row = int(np.flatnonzero(change < 0)[0]) + 1
    assert (change[change > 0].round(9) == 30.0).all()
    assert (change < 0).sum() == 1
    assert np.degrees(axes[0, 5]) == pytest.approx(-1800)
    assert [(f.code, f.line) for f in findings if "swings" not in f.text] == [("machine-rewind", row + 100)]
    assert findings[-1].text == "C goes back from 1980 deg to 1290 deg: retract before it"


def test_where_no_turn_is_within_the_limits_the_least_is_broken():
    axes, findings = follow(limited(C=(-30, 30), A=(0, 50)), np.zeros((3, 3)), tilted([0.0, 20.0, 40.0]))
    np.testing.assert_allclose(np.degrees(axes[:, 5]), [0, 20, 40], atol=1e-9)
    assert [f.text for f in findings] == ["row 2: C = 40 deg: machine xyzac-trunnion travels from -30 deg to 30 deg"]


def test_linear_limits_are_found():
    _, findings = follow(TRUNNION, [[0.0, 0.0, 0.0], [250.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]] * 2)
    assert [f.code for f in findings] == ["machine-singular", "machine-limit"]
    assert findings[1].text == "row 1: X = 250 mm: machine xyzac-trunnion travels from -200 mm to 200 mm"


def test_through_the_pole():
    """Straight through it the tilt changes sign and C stays; at it C stays too."""
    tip, axis = np.full((5, 3), 7.0), tilted([30.0] * 5, [20.0, 10.0, 0.0, -10.0, -20.0])
    axes, findings = follow(limited(), tip, axis)
    np.testing.assert_allclose(forward(TRUNNION, axes)[0], tip, atol=1e-12)
    np.testing.assert_allclose(np.degrees(axes[:, 5]), [30] * 5, atol=1e-7)
    np.testing.assert_allclose(np.degrees(axes[:, 3]), [20, 10, 0, -10, -20], atol=1e-9)
    assert [f.text for f in findings] == ["row 2: the tool's axis lies along that of C: C is free and stays as it was"]


def test_past_the_pole_c_swings():
    """A great circle 1 deg beside the pole: C goes round by nearly half a turn while the tool turns by 2 deg."""
    a = np.radians(np.arange(-11.0, 12.0, 2.0))
    axis = np.column_stack([np.full(12, math.sin(math.radians(1.0))), np.sin(a), np.cos(a)])
    axes, findings = follow(limited(A=(0, 50)), np.zeros((12, 3)), axis)
    swing = math.degrees(2.0 * math.atan2(1.0, 1.0))
    assert np.degrees(np.abs(np.diff(axes[:, 5])).max()) == pytest.approx(swing, abs=0.1)
    assert [f.code for f in findings] == ["machine-singular"]
    assert "swings by" in findings[0].text


def test_start_is_kept_at_a_pole_and_by_axes_that_are_held():
    start = np.zeros(9)
    start[[4, 5]] = 0.7, 0.0
    machine = machine_named("horizontal-b")
    start[3] = np.radians(40.0)
    T = [[math.sin(math.radians(50)), 0.0, math.cos(math.radians(50))]]
    axes, findings = follow(machine, np.zeros((1, 3)), T, start)
    assert math.degrees(axes[0, 3]) == pytest.approx(40.0)
    assert findings == ()
    pole = np.zeros(9)
    pole[5] = 0.7
    axes, _ = follow(TRUNNION, np.zeros((2, 3)), [[0.0, 0.0, 1.0]] * 2, pole)
    assert axes[:, 5].tolist() == [0.7, 0.7]


def test_out_of_reach_and_off_its_step():
    machine = machine_named("horizontal-b")
    start = np.zeros(9)
    start[3] = math.radians(42.0)
    _, findings = follow(machine, np.zeros((2, 3)), [[1.0, 0.0, 0.0], [0.0, 1.0, 1.0]], start)
    assert [f.code for f in findings] == ["machine-reach", "machine-index"]
    assert (
        findings[0].text
        == "row 0: the tool's axis is out of reach by 42 deg: B reaches no nearer one (2 rows, the first is 0)"
    )
    assert findings[1].text.startswith("row 0: A = 42 deg: machine horizontal-b stands at multiples of 5 deg")


def test_no_rows_and_bad_start():
    assert follow(TRUNNION, np.zeros((0, 3)), np.zeros((0, 3)))[0].shape == (0, 9)
    with pytest.raises(InputError, match="start: must be nine finite numbers"):
        follow(TRUNNION, np.zeros((1, 3)), [[0.0, 0.0, 1.0]], [1.0])


def test_three_axes():
    axes, findings = follow(machine_named("vmc"), [[1.0, 2.0, 3.0]], [[0.0, 0.0, 1.0]])
    assert axes[0, :3].tolist() == [1.0, 2.0, 3.0]
    assert findings == ()
    _, findings = follow(machine_named("vmc"), [[1.0, 2.0, 3.0]], [[0.0, 1.0, 1.0]])
    assert findings[0].text == "row 0: the tool's axis is out of reach by 45 deg: there is no rotary axis to reach it"
