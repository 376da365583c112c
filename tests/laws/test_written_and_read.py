"""What is written is read back as what it was: Commands to text to Commands, to the written precision."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chipload.machine.machine import machine_named
from chipload.program.commands import ARC, DWELL, LINE, PLANE_AXES, RAPID, Commands, Frame, extents
from chipload.program.gcode.reader import read_gcode
from chipload.program.gcode.writer import write_commands
from chipload.program.release import NOT_SIMULATED

VMC, FANUC, FIVE = machine_named("vmc"), machine_named("vmc-fanuc"), machine_named("xyzac-trunnion")
coordinate = st.floats(-300, 300).map(lambda x: round(x, 3))
angle = st.floats(-300, 300).map(lambda x: math.radians(round(x, 3)))


@st.composite
def some_commands(draw, rotary):
    """A rapid, then motions of every kind; positions on a grid that is coarser than what is written."""
    n = draw(st.integers(2, 12))
    rows = []
    at = np.zeros(9)
    at[:3] = [draw(coordinate) for _ in range(3)]
    rows.append((RAPID, at.copy(), 0, (0.0, 0.0), 0, 0.0, 100.0, 1))
    spindle, tool = 100.0, 1
    for _ in range(n):
        kind = draw(st.sampled_from([RAPID, LINE, LINE, ARC, DWELL, "tool"]))
        if kind == "tool":
            tool = draw(st.integers(1, 9))
            spindle = draw(st.sampled_from([-50.0, 80.0, 300.0]))
            kind = RAPID
        end, plane, centre, turns, feed = at.copy(), 0, (0.0, 0.0), 0, 0.0
        if kind in (RAPID, LINE):
            end[:3] = [draw(coordinate) for _ in range(3)]
            if rotary and draw(st.booleans()):
                end[[3, 5]] = draw(angle), draw(angle)
        if kind == ARC:
            plane = draw(st.integers(0, 2))
            first, second, along = PLANE_AXES[plane]
            r, a, sweep = draw(st.integers(2, 50)), draw(st.floats(0, 6)), draw(st.floats(0.3, 5.9))
            turns = draw(st.sampled_from([1, -1]))
            c = (at[first] - r * math.cos(a), at[second] - r * math.sin(a))
            b = a + turns * sweep
            end[first], end[second] = c[0] + r * math.cos(b), c[1] + r * math.sin(b)
            end[along] = draw(coordinate)
            centre = c
        if kind in (LINE, ARC):
            feed = draw(st.integers(60, 6000)) / 60.0
        if kind == DWELL:
            feed = draw(st.integers(1, 500)) / 100.0
        if kind != DWELL and kind != RAPID and np.abs(end - at).max() < 0.01:
            continue
        rows.append((kind, end.copy(), plane, centre, turns, feed, spindle, tool))
        at = end
    columns = [np.array(x) for x in zip(*rows, strict=True)]
    n = len(rows)
    return Commands(
        columns[0], columns[1], columns[2], columns[3], columns[4], columns[5], columns[6], columns[7],
        np.zeros(n, dtype=bool), np.zeros(n, dtype=int), np.zeros(n, dtype=int), np.zeros(n, dtype=int), (Frame(),),
        ("cut",),
    )  # fmt: skip


def assert_same(meant, read, unit):
    """Rows that round to nothing may be missing; a tool's first row is two."""
    got = iter(range(len(read)))
    place = None
    for k in range(len(meant)):
        fresh = k == 0 or meant.tool[k] != meant.tool[k - 1]
        before = np.zeros(9) if k == 0 else meant.position[k - 1]
        moves = np.abs(meant.position[k] - before).max() > 2 * unit or meant.motion[k] in (ARC, DWELL)
        if not moves and not fresh:
            continue
        j = next(got)
        if fresh and read.motion[j] == RAPID:
            np.testing.assert_allclose(read.position[j, :2], meant.position[k, :2], atol=unit)
            j = next(got)
        assert read.motion[j] == meant.motion[k], k
        np.testing.assert_allclose(read.position[j], meant.position[k], atol=2.1 * unit)
        assert read.tool[j] == meant.tool[k]
        assert read.spindle[j] == pytest.approx(meant.spindle[k], abs=0.06)
        if meant.motion[k] == ARC:
            assert read.plane[j] == meant.plane[k]
            assert read.turns[j] == meant.turns[k]
            np.testing.assert_allclose(read.centre[j], meant.centre[k], atol=4 * unit)
        if meant.motion[k] == DWELL:
            assert read.feed[j] == pytest.approx(meant.feed[k], abs=1e-3)
        elif meant.motion[k] != RAPID:
            time, wanted = extents(read)[j] / read.feed[j], extents(meant)[k] / meant.feed[k]
            assert time == pytest.approx(wanted, rel=2e-3, abs=1e-4)
        place = j
    assert place is not None
    assert next(got, None) is None


@given(some_commands(rotary=False))
@settings(max_examples=150, deadline=None)
def test_three_axes(meant):
    text = write_commands(meant, VMC, title="t", release=NOT_SIMULATED)
    assert_same(meant, read_gcode(text)[0], 1e-6)


@given(some_commands(rotary=False))
@settings(max_examples=100, deadline=None)
def test_fanuc(meant):
    rpm = np.round(meant.spindle * 60 / math.tau) * math.tau / 60
    meant = replace(meant, spindle=rpm)
    text = write_commands(meant, FANUC, title="t", release=NOT_SIMULATED)
    assert_same(meant, read_gcode(text, dialect="fanuc")[0], 1e-4)


@given(some_commands(rotary=True))
@settings(max_examples=150, deadline=None)
def test_five_axes(meant):
    text = write_commands(meant, FIVE, title="t", release=NOT_SIMULATED)
    assert_same(meant, read_gcode(text)[0], 1e-6)
