"""What is written is read back: programs of lines, arcs in all planes, tilts, tools, feeds, spindle, dwells.

Notation: an arc is compared as sweep times normal, so that it does not matter which way the normal points.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chipload.cutter.cutter import Cutter
from chipload.program.apt.reader import read_apt
from chipload.program.apt.writer import write_apt
from chipload.program.motions import is_arc, lengths, radii, starts, sweeps
from chipload.program.program import ARC_CCW, ARC_CW, DWELL, LINE, RAPID, Program
from chipload.program.release import NOT_SIMULATED

MILLS = {n: Cutter(8.0 + n, 4, 0.5, 22.0, 35.0, 6e5) for n in (1, 2, 3)}
UP = np.array([0.0, 0.0, 1.0])


def unit(v):
    return v / np.linalg.norm(v)


def turned(v, n, a):
    """v turned by a about n: Rodrigues."""
    return math.cos(a) * v + math.sin(a) * np.cross(n, v) + (1.0 - math.cos(a)) * (n @ v) * n


def random_program(seed, rows, *, tilted=True, sweep_most=1.5 * math.pi):
    """A random walk; arcs of at most ``sweep_most``."""
    rng = np.random.default_rng(seed)
    p, axis = rng.uniform(-50, 50, 3), UP
    tool, spindle, feed, label = 1, 0.0, 10.0, 0
    out = [(RAPID, p, axis, np.zeros(3), UP, 0.0, spindle, tool, label)]
    for _ in range(rows):
        if rng.random() < 0.1:
            tool = int(rng.integers(1, 4))
        if rng.random() < 0.2:
            spindle = float(rng.choice([0.0, 300.0, -150.25, 1234.5]))
        if rng.random() < 0.3:
            feed = float(rng.uniform(0.5, 200.0))
        if rng.random() < 0.1:
            label = int(rng.integers(0, 3))
        kind = rng.choice(["rapid", "line", "arc", "dwell", "turn"], p=[0.2, 0.3, 0.35, 0.1, 0.05])
        if kind == "dwell":
            out.append((DWELL, p, axis, np.zeros(3), UP, float(rng.uniform(0.01, 5.0)), spindle, tool, label))
            continue
        if tilted and (kind == "turn" or rng.random() < 0.3):
            axis = unit(rng.normal(size=3))
        if kind == "turn":
            out.append((LINE, p, axis, np.zeros(3), UP, float(rng.uniform(0.01, 1.0)), spindle, tool, label))
        elif kind == "arc":
            n = unit(rng.normal(size=3)) if rng.random() < 0.5 else np.eye(3)[rng.integers(3)] * rng.choice([-1.0, 1.0])
            arm = unit(np.cross(n, rng.normal(size=3))) * rng.uniform(0.05, 80.0)
            sense = rng.choice([-1, 1])
            a = sense * rng.uniform(0.01, sweep_most)
            centre = p - arm
            p = centre + turned(arm, n, a)
            at = centre + rng.uniform(-9, 9) * n
            out.append((ARC_CCW if sense > 0 else ARC_CW, p, axis, at, n, feed, spindle, tool, label))
        else:
            p = p + rng.normal(size=3) * 20.0
            motion = RAPID if kind == "rapid" else LINE
            out.append((motion, p, axis, np.zeros(3), UP, feed * (motion == LINE), spindle, tool, label))
    motion, p, axis, centre, normal, feeds, spindles, tools, labels = zip(*out, strict=True)
    none = np.zeros(len(out), dtype=int)
    columns = (motion, p, axis, centre, normal, none, feeds, spindles, tools, none, labels)
    return Program(*(np.array(c) for c in columns), labels=("link", "finish", "wall 2"))


def same(a, b):
    """Row by row, to the written precision."""
    kind = np.array([0, 1, 2, 2, 3])
    assert kind[a.motion].tolist() == kind[b.motion].tolist()
    np.testing.assert_allclose(b.p_work, a.p_work, atol=1e-6)
    np.testing.assert_allclose(b.axis, a.axis, atol=2e-9)
    np.testing.assert_allclose(b.feed, a.feed, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(b.spindle, a.spindle, atol=1e-4)
    assert a.tool.tolist() == b.tool.tolist()
    assert [a.labels[k] for k in a.label] == [b.labels[k] for k in b.label]
    np.testing.assert_allclose(sweeps(b)[:, None] * b.normal, sweeps(a)[:, None] * a.normal, atol=2e-4)
    np.testing.assert_allclose(radii(b), radii(a), atol=4e-6)
    arc = is_arc(a)
    off = (b.centre - a.centre)[arc]
    n = a.normal[arc]
    assert np.linalg.norm(off - (off * n).sum(axis=1)[:, None] * n, axis=1).max(initial=0.0) < 4e-6


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.booleans())
def test_read_of_written_is_the_program(seed, rows, tilted):
    program = random_program(seed, rows, tilted=tilted)
    text = write_apt(program, MILLS, title="x", release=NOT_SIMULATED)
    back, findings = read_apt(text)
    assert findings == ()
    same(program, back)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 12))
def test_long_arcs_keep_their_length_and_side(seed, rows):
    """Arcs of up to a turn come back as pieces: same length, ends, and middle."""
    program = random_program(seed, rows, sweep_most=1.99 * math.pi)
    back, _ = read_apt(write_apt(program, MILLS, title="x", release=NOT_SIMULATED))
    assert lengths(back).sum() == pytest.approx(lengths(program).sum(), abs=1e-4 * rows)
    ends = np.linalg.norm(back.p_work[None] - program.p_work[:, None], axis=2).min(axis=1)
    assert ends.max() < 2e-6


@pytest.mark.parametrize("turns", [0, 1, 3])
@pytest.mark.parametrize("sense", [-1, 1])
def test_whole_turns(turns, sense):
    """A full circle in a tilted plane, and two and four of them, as halves."""
    n = unit(np.array([1.0, 2.0, 3.0]))
    arm = 5.0 * unit(np.cross(n, [1.0, 0.0, 0.0]))
    start = random_program(0, 1)
    one = replace(
        start,
        motion=[RAPID, ARC_CCW if sense > 0 else ARC_CW],
        p_work=np.tile(arm, (2, 1)),
        centre=np.zeros((2, 3)),
        normal=[UP, n],
        turns=[0, turns],
        feed=[0.0, 3.0],
    )
    back, findings = read_apt(write_apt(one, MILLS, title="x", release=NOT_SIMULATED))
    assert findings == ()
    assert len(back) == 1 + 2 * (1 + turns)
    np.testing.assert_allclose(back.p_work[1::2], np.tile(-arm, (1 + turns, 1)), atol=1e-6)
    total = (sweeps(back)[:, None] * back.normal).sum(axis=0)
    np.testing.assert_allclose(total, sense * 2.0 * math.pi * (1 + turns) * n, atol=1e-6)


def test_helix_in_a_tilted_plane_is_chords_within_tolerance():
    n = unit(np.array([0.0, 1.0, 1.0]))
    arm, rise = 4.0 * np.array([1.0, 0.0, 0.0]), 3.0
    start = random_program(0, 1)
    end = turned(arm, n, 1.5) + rise * n
    helix = replace(
        start,
        motion=[RAPID, ARC_CCW],
        p_work=[arm, end],
        centre=np.zeros((2, 3)),
        normal=[UP, n],
        feed=[0.0, 3.0],
    )
    back, _ = read_apt(write_apt(helix, MILLS, title="x", release=NOT_SIMULATED, chord_mm=0.01))
    assert set(back.motion[1:].tolist()) == {LINE}
    middle = 0.5 * (starts(back) + back.p_work)[1:]
    away = 4.0 - np.linalg.norm(middle - (middle @ n)[:, None] * n, axis=1)
    assert 0.004 < away.max() < 0.01 + 1e-6


def test_a_tiny_arc_does_not_become_a_turn():
    start = random_program(0, 1)
    end = np.array([5.0 * math.cos(6e-8), 5.0 * math.sin(6e-8), 0.0])
    tiny = replace(
        start,
        motion=[RAPID, ARC_CCW],
        p_work=[[5.0, 0.0, 0.0], end],
        centre=np.zeros((2, 3)),
        normal=[UP, UP],
        feed=[0.0, 3.0],
    )
    assert lengths(tiny).sum() == pytest.approx(3e-7, rel=1e-3)
    back, _ = read_apt(write_apt(tiny, MILLS, title="x", release=NOT_SIMULATED))
    assert lengths(back).sum() < 1e-5
