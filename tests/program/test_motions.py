"""Arcs in any plane: dense samples of the helix formula, and the same motions turned in space."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from chipload.errors import InputError
from chipload.program.motions import bases, bounds, directions, lengths, straighten_arcs, sweeps
from chipload.program.program import ARC_CCW, ARC_CW, RAPID, Program


def one_arc(radius, start_deg, sweep_deg, rise, turn=None):
    """A rapid and an arc about +Z at (3, -2), turned in space by ``turn``; and a function of its points."""
    rotation = Rotation.identity() if turn is None else turn
    a0, sweep = math.radians(start_deg), math.radians(sweep_deg)
    turns = int((abs(sweep) - 1e-9) // math.tau)

    def at(u):
        a = a0 + sweep * np.asarray(u)
        points = np.column_stack([3 + radius * np.cos(a), -2 + radius * np.sin(a), 5 + rise * np.asarray(u)])
        return rotation.apply(points)

    return (
        Program(
            motion=[RAPID, ARC_CCW if sweep > 0 else ARC_CW],
            p_work=np.vstack([at([0.0]), at([1.0])]),
            axis=[[0, 0, 1]] * 2,
            centre=rotation.apply([[0, 0, 0], [3, -2, 0]]),
            normal=np.vstack([[0, 0, 1], rotation.apply([0, 0, 1])]),
            turns=[0, turns],
            feed=[0, 10],
            spindle=[100, 100],
            tool=[1, 1],
            line=[0, 0],
            label=[0, 0],
            labels=("cut",),
        ),
        at,
    )


@pytest.mark.parametrize("seed", range(40))
def test_arc_against_samples(seed):
    rng = np.random.default_rng(seed)
    turn = Rotation.random(random_state=seed) if seed % 2 else None
    sweep = rng.uniform(-900, 900)
    rise = 0.0 if seed % 4 < 2 else rng.uniform(-8, 8)
    program, at = one_arc(rng.uniform(0.5, 20), rng.uniform(-180, 180), sweep, rise, turn)
    u = np.linspace(0, 1, 40001)
    points = at(u)
    assert math.degrees(sweeps(program)[1]) == pytest.approx(sweep, abs=1e-6)
    assert lengths(program)[1] == pytest.approx(np.linalg.norm(np.diff(points, axis=0), axis=1).sum(), rel=1e-6)
    low, high = bounds(program)
    assert (low[1] <= points.min(axis=0) + 1e-9).all()
    assert (high[1] >= points.max(axis=0) - 1e-9).all()
    if rise == 0.0:
        np.testing.assert_allclose(low[1], points.min(axis=0), atol=1e-5)
        np.testing.assert_allclose(high[1], points.max(axis=0), atol=1e-5)
    first, last = directions(program)
    step = np.diff(points, axis=0)
    np.testing.assert_allclose(first[1], step[0] / np.linalg.norm(step[0]), atol=1e-3)
    np.testing.assert_allclose(last[1], step[-1] / np.linalg.norm(step[-1]), atol=1e-3)
    chords = straighten_arcs(program, np.array([np.inf, 0.1]))
    n = len(chords) - 1
    np.testing.assert_allclose(chords.p_work[1:], at(np.arange(1, n + 1) / n), atol=1e-9)


def test_planes_are_named_as_controllers_do():
    e1, e2 = bases(np.array([[0.0, 0, 1], [0, 1, 0], [1, 0, 0]]))
    assert e1.tolist() == [[1, 0, 0], [0, 0, 1], [0, 1, 0]]
    assert e2.tolist() == [[0, 1, 0], [1, 0, 0], [0, 0, 1]]


def test_radii_that_differ_in_a_turned_plane():
    program, _ = one_arc(5.0, 0.0, 90.0, 0.0, Rotation.from_euler("y", 30, degrees=True))
    wrong = program.p_work + np.array([[0, 0, 0], [0, 0.01, 0]])
    columns = {k: getattr(program, k) for k in program.__dataclass_fields__}
    with pytest.raises(
        InputError, match=r"^program row 1: an arc starts 5 mm from its centre and ends 5\.01 mm from it"
    ):
        Program(**{**columns, "p_work": wrong})


def test_an_axis_that_turns_on_an_arc_turns_along_its_chords():
    program, _ = one_arc(5.0, 0.0, 180.0, 0.0)
    s, c = math.sin(0.2), math.cos(0.2)
    columns = {k: getattr(program, k) for k in program.__dataclass_fields__}
    chords = straighten_arcs(Program(**{**columns, "axis": [[0, -s, c], [0, s, c]]}), np.array([np.inf, math.pi / 2]))
    np.testing.assert_allclose(chords.axis, [[0, -s, c], [0, 0, 1], [0, s, c]], atol=1e-12)
