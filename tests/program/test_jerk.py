"""Time with a limit of the jerk: closed forms, and the integral of the jerk over time."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload.cli import app
from chipload.machine.machine import machine_named
from chipload.program._jerk_limited import jerk_limited
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.program.time import peak_speed, program_time, slow_machine

VMC = replace(machine_named("vmc"), jerk_low=None)


def cut(points, feed):
    return Program.join([rapid(points[0], 800.0, 1, "link"), plunge(points[1:], feed, 800.0, 1, "cut")])


def rest_to_rest(length: float, most: float, a: float, j: float) -> float:
    """The four cases: acceleration and speed reached or not."""
    if most >= a * a / j:
        if length >= most**2 / a + most * a / j:
            return length / most + most / a + a / j
    elif length >= 2.0 * most * math.sqrt(most / j):
        return length / most + 2.0 * math.sqrt(most / j)
    if length >= 2.0 * a**3 / j**2:
        return a / j + math.sqrt((a / j) ** 2 + 4.0 * length / a)
    return 4.0 * (length / (2.0 * j)) ** (1.0 / 3.0)


def one_row(length, v0, v1, most, a, j):
    columns = (np.array([value]) for value in (length, most, a))
    time, peak = jerk_limited(*columns, np.array([v0, v1]), np.array([v0, v1]), j)
    return time[0], peak[0]


def test_rest_to_rest_in_closed_form():
    rng = np.random.default_rng(5)
    for _ in range(300):
        a, j, most = rng.uniform(500, 10000), 10.0 ** rng.uniform(3.7, 6.0), rng.uniform(5, 500)
        length = 10.0 ** rng.uniform(-2, 3)
        assert one_row(length, 0.0, 0.0, most, a, j)[0] == pytest.approx(rest_to_rest(length, most, a, j), rel=1e-12)


def test_a_segment_against_the_integral_of_its_jerk():
    """The phases of constant jerk, integrated exactly one by one, go the whole way and end at the speed asked for."""
    rng = np.random.default_rng(7)
    for _ in range(200):
        a, j, most = rng.uniform(500, 10000), rng.uniform(5e3, 1e6), rng.uniform(5, 500)
        v0, v1 = rng.uniform(0, most, 2)
        dv = abs(v1 - v0)
        least = 0.5 * (v0 + v1) * (dv / a + a / j if dv >= a * a / j else 2.0 * math.sqrt(dv / j))
        length = least * rng.uniform(1.01, 4.0) + 0.01
        time, top = one_row(length, v0, v1, most, a, j)
        assert top <= most * (1.0 + 1e-12)
        v, s, t = v0, 0.0, 0.0
        for goal in (top, v1):
            sense, dv = math.copysign(1.0, goal - v), abs(goal - v)
            rise = min(a / j, math.sqrt(dv / j))
            phases = [(sense * j, rise), (0.0, max(dv / a - a / j, 0.0)), (-sense * j, rise)]
            if goal is v1:
                level = (time - t) - sum(p[1] for p in phases)
                s, t = s + level * v, t + level
            acceleration = 0.0
            for jerk, span in phases:
                s += v * span + acceleration * span**2 / 2.0 + jerk * span**3 / 6.0
                v += acceleration * span + jerk * span**2 / 2.0
                acceleration += jerk * span
                t += span
            assert abs(acceleration) < 1e-6 * a
            assert v == pytest.approx(goal, abs=1e-6 * most)
        assert s == pytest.approx(length, rel=1e-6)


@pytest.mark.parametrize(("jerk", "longer"), [(2e5, 39), (5e4, 121), (2e4, 199)])
def test_rows_of_1_5_mm_at_f6000(jerk: float, longer: int):
    """At 3 m/s^2 from rest to rest with stops: 20 rows of 2 sqrt(L / a) without a limit of the jerk."""
    mill = replace(VMC, corner_tolerance=0.0)
    stairs = [[1.5 * ((k + 1) // 2), 1.5 * (k // 2), 0.0] for k in range(21)]
    without = program_time(cut(stairs, 100.0), mill).sum()
    assert without == pytest.approx(20 * 2.0 * math.sqrt(1.5 / 3000.0), rel=1e-12)
    time = program_time(cut(stairs, 100.0), replace(mill, jerk=jerk)).sum()
    assert 100.0 * (time / without - 1.0) == pytest.approx(longer, abs=0.6)


def test_rows_in_one_direction_are_one_stretch():
    """The same time in 1, 18 and 400 rows; the rows add up to it, and their peaks rise and fall."""
    mill = replace(VMC, jerk=2e5)
    expected = rest_to_rest(90.0, 120.0, 3000.0, 2e5)
    for n in (2, 19, 401):
        rows = cut([[x, 0.0, 0.0] for x in np.linspace(0.0, 90.0, n)], 120.0)
        assert program_time(rows, mill).sum() == pytest.approx(expected, rel=1e-9)
        assert peak_speed(rows, mill).max() == pytest.approx(120.0)
    # rows of the stretch by its speed: the place half a second on from the beginning, integrated in small steps
    times = np.cumsum(program_time(rows, mill))
    t = np.linspace(0.0, 0.5, 200001)
    a = np.minimum(np.minimum(2e5 * t, 3000.0), np.maximum(2e5 * (120.0 / 3000.0 + 3000.0 / 2e5 - t), 0.0))
    v = np.concatenate([[0.0], np.cumsum(0.5 * (a[1:] + a[:-1]) * np.diff(t))])
    way = np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(t))])
    assert np.interp(0.5, times, np.linspace(0.0, 90.0, 401)) == pytest.approx(way[-1], rel=1e-4)


def test_a_high_jerk_is_none_and_a_low_one_only_longer():
    rng = np.random.default_rng(3)
    points = np.vstack([np.zeros(3), np.cumsum(rng.normal(0.0, 3.0, (60, 3)), axis=0)])
    rows = cut(points, 60.0)
    free = program_time(rows, VMC)
    near = program_time(rows, replace(VMC, jerk=1e12))
    np.testing.assert_allclose(near.sum(), free.sum(), rtol=1e-5)
    times = [program_time(rows, replace(VMC, jerk=j)).sum() for j in (1e12, 1e6, 2e5, 2e4)]
    assert times == sorted(times)


def test_a_slower_row_is_reached_without_acceleration():
    """100 mm/s, then 40 mm/s in one direction: the change of speed lies in the first row."""
    a, j = 3000.0, 5e4
    mill = replace(VMC, jerk=j)
    parts = [rapid([0, 0, 0], 800.0, 1, "a"), plunge([80, 0, 0], 100.0, 800.0, 1, "a")]
    rows = Program.join([*parts, plunge([120, 0, 0], 40.0, 800.0, 1, "a")])
    change = 2.0 * math.sqrt(60.0 / j) if a * a / j > 60.0 else 60.0 / a + a / j
    up = 2.0 * math.sqrt(100.0 / j) if a * a / j > 100.0 else 100.0 / a + a / j
    down = 2.0 * math.sqrt(40.0 / j)
    first = up + change + (80.0 - 50.0 * up - 70.0 * change) / 100.0
    assert program_time(rows, mill)[1:] == pytest.approx([first, down + (40.0 - 20.0 * down) / 40.0], rel=1e-9)


def test_the_slow_machine_of_one_whose_jerk_is_not_known():
    assert slow_machine(replace(VMC, jerk_low=None)).jerk == 2e4
    assert slow_machine(replace(VMC, jerk_low=7e4)).jerk == 7e4
    assert slow_machine(replace(VMC, jerk_low=None, jerk=1e5)) is None


def test_feeds_in_small_steps_that_keep_the_jerk_hardly_take_longer():
    """A feed that falls from 30 to 10 mm/s as a smooth curve, in steps of 0.1 mm, between two stops."""
    j, x = 2e4, np.arange(0.0, 60.0, 0.1)
    feeds = 20.0 + 10.0 * np.cos(math.pi * (x + 0.1) / 60.0)
    parts = [rapid([0, 0, 0], 800.0, 1, "a")]
    parts += [plunge([a + 0.1, 0.0, 0.0], f, 800.0, 1, "a") for a, f in zip(x, feeds, strict=True)]
    rows = Program.join(parts)
    free = program_time(rows, VMC).sum()
    time = program_time(rows, replace(VMC, jerk=j)).sum()
    assert free < time < 1.1 * free


def test_a_program_on_a_machine_of_unknown_jerk_has_two_times(tmp_path):
    """The terminal states both: stops at 21 places, without a limit of the jerk and at 20 m/s^3."""
    stairs = "".join(f"G1 X{1.5 * ((k + 1) // 2)} Y{1.5 * (k // 2)} F6000\n" for k in range(1, 21))
    text = tmp_path / "stairs.nc"
    text.write_text(f"G21 G90 G17 G61\nG0 X0 Y0 Z0\n{stairs}M2\n")
    shown = CliRunner().invoke(app, ["check", str(text), "--machine", "vmc"]).output
    low, high = (20.0 * rest_to_rest(1.5, 100.0, 3000.0, j) / 60.0 for j in (1e15, 2e4))
    found = re.search(r" mm, ([0-9.]+) to ([0-9.]+) min; ", shown)
    assert [float(x) for x in found.groups()] == pytest.approx([low, high], rel=5e-3)
    assert "time: An interval: the jerk of the machine is not known" in shown
