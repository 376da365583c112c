"""Loads over a revolution in one call against those rotation by rotation, which integrate each engagement range in
closed form.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_over_turn
from chipload.cutting.material import Material
from chipload.cutting.revolution import _one_by_one, loads_over_turn, rotations
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.engagement.tooth_surfaces import chips_of_teeth

STEEL = Material("steel", 1800.0, 700.0, 250.0, 25.0, 18.0, 6.0, source="made up")


def some_engagement(seed: int, helix: float, flutes: int) -> ToothEngagement:
    """ToothEngagement of random ranges of immersion on slices of a ball, a flank and a bottom."""
    random = np.random.default_rng(seed)
    start, rows, slices = [0], [], []
    lag = math.tan(helix) / 5.0
    for _ in range(30):
        for _ in range(random.integers(0, 5)):
            kappa = random.choice([random.uniform(0.05, 1.5), 0.5 * math.pi, 0.0])
            s, length, z = random.uniform(-2.0, 6.0), random.choice([0.1, 3.0, 12.0]), random.uniform(0.0, 9.0)
            for _ in range(random.integers(1, 3)):
                a = random.uniform(0.0, math.tau)
                b = a + random.uniform(0.01, 2.0)
                h = random.uniform(0.01, 0.2, 3) * [1.0, 1.0, 0.3]
                offset = max(0.0, -(h[0] * np.sin(x := np.linspace(a, b, 99)) + h[1] * np.cos(x)).min()) + h[2]
                rows.append([a, b, s, s + length, h[0], offset, h[1], len(slices)])
            sk = math.sin(kappa)
            slices.append([s, random.uniform(0.5, 5.0), z, sk, math.cos(kappa), lag * z, lag * sk])
        start.append(len(rows))
    table = np.array(rows)
    n = len(start) - 1
    frame = np.linalg.qr(random.normal(size=(n, 3, 3)))[0]
    piece = table[:, 7].astype(int)
    return ToothEngagement(np.array(start), table[:, :7].copy(), np.full(len(rows), -1), piece, np.array(slices), frame)


@pytest.mark.parametrize("flutes", [1, 2, 4])
@pytest.mark.parametrize("helix", [0.0, 0.5, 1.1])
@pytest.mark.parametrize("runout", [0.0, 0.01])
def test_loads_are_those_rotation_by_rotation(flutes: int, helix: float, runout: float) -> None:
    cutter = Cutter(10.0, flutes, helix, 20.0, 30.0, 6e5, runout=(runout, 0.4))
    plain = some_engagement(flutes, helix, flutes)
    engagement = chips_of_teeth(plain, cutter)
    left = np.random.default_rng(5).normal(size=(len(engagement), 3))
    found, at, _ = loads_over_turn(engagement, cutter, STEEL, math.radians(3.0), left)
    count = rotations(cutter, math.radians(3.0))
    known = _one_by_one(engagement, cutter, STEEL, count, left)
    np.testing.assert_allclose(found, known[:, :15], rtol=1e-6, atol=1e-6)
    # at the rotations that are said to be worst the loads are the greatest
    pitch = math.tau if runout > 0.0 else math.tau / flutes
    numbers = np.rint(at * count / pitch).astype(int)
    np.testing.assert_allclose(at, numbers * pitch / count, atol=1e-12)
    force, torque = forces_over_turn(engagement, cutter, STEEL, np.arange(count) * (pitch / count))
    rows = np.arange(len(engagement))
    np.testing.assert_allclose(np.linalg.norm(force[rows, numbers[:, 0]], axis=1), known[:, 9], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(torque[rows, numbers[:, 1]], known[:, 11], rtol=1e-6, atol=1e-6)


def test_a_full_circle_that_begins_at_a_rotation_counts_once() -> None:
    """A plunge: the bottom and the flank cut all around."""
    cutter = Cutter(10.0, 2, 0.4, 20.0, 30.0, 6e5)
    rows = np.array(
        [[0.0, math.tau, 0.0, 2.0, 0.0, 0.05, 0.0], [1.5 * math.pi, 3.5 * math.pi, 2.0, 4.0, 0.0, 0.1, 0.0]]
    )
    slices = np.array([[0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0], [2.0, 3.0, 0.0, 0.0, 1.0, 0.0, 0.0]])
    frame = np.eye(3)[None]
    engagement = ToothEngagement(np.array([0, 2]), rows, np.full(2, -1), np.arange(2), slices, frame)
    found, _, _ = loads_over_turn(engagement, cutter, STEEL, math.radians(3.0), np.zeros((1, 3)))
    # two teeth, 2 mm each of edge
    known = 2 * 2.0 * ((1800.0 * 0.05 + 25.0) * 1.0 + (1800.0 * 0.1 + 25.0) * 3.0)
    assert found[0, 10] == pytest.approx(known)
    assert found[0, 11] == pytest.approx(known)


def test_a_size_effect_takes_the_other_way() -> None:
    cutter = Cutter(10.0, 2, 0.4, 20.0, 30.0, 6e5)
    engagement = some_engagement(3, 0.4, 2)
    left = np.zeros((len(engagement), 3))
    law = replace(STEEL, exponents=(0.2, 0.2, 0.2))
    assert not np.allclose(
        loads_over_turn(engagement, cutter, law, 0.05, left)[0][:, 9],
        loads_over_turn(engagement, cutter, STEEL, 0.05, left)[0][:, 9],
    )


@pytest.mark.parametrize("runout", [0.0, 0.01])
def test_entries_that_cut_alike_have_the_loads_of_the_first(runout: float) -> None:
    """Each of 30 entries five times: as it is, with chips 5e-9 and 1e-6 thicker, turned by 1e-6 rad, with no normal."""
    cutter = Cutter(10.0, 3, 0.5, 20.0, 30.0, 6e5, runout=(runout, 0.4))
    plain = some_engagement(7, 0.5, 3)
    n, size = len(plain), np.diff(plain.start)
    row = np.concatenate([np.tile(np.arange(plain.start[i], plain.start[i + 1]), 5) for i in range(n)])
    which = np.concatenate([np.repeat(np.arange(5), k) for k in size])
    rows = plain.rows[row]
    rows[which == 1, 4:] *= 1.0 + 5e-9
    rows[which == 2, 4:] *= 1.0 + 1e-6
    rows[which >= 3, :2] += 1e-6
    start, frames = np.concatenate([[0], np.cumsum(np.repeat(size, 5))]), np.repeat(plain.frames, 5, axis=0)
    five = ToothEngagement(start, rows, plain.tooth[row], plain.slice[row], plain.slices, frames)
    left = np.repeat(np.random.default_rng(5).normal(size=(n, 3)), 5, axis=0)
    left[4::5] = 0.0
    engagement = chips_of_teeth(five, cutter)
    found = loads_over_turn(engagement, cutter, STEEL, math.radians(3.0), left)[0]
    known = _one_by_one(engagement, cutter, STEEL, rotations(cutter, math.radians(3.0)), left)[:, :15]
    np.testing.assert_allclose(found, known, rtol=1e-6, atol=1e-6)
    each = found.reshape(n, 5, 15)[size > 0]
    np.testing.assert_array_equal(each[:, 1, 9], each[:, 0, 9])
    assert (each[:, 2, 9] > each[:, 0, 9]).mean() > 0.95
    assert (each[:, 3, 9] != each[:, 2, 9]).mean() > 0.95
    assert each[:, 3, 14].max() > 0.0
    assert each[:, 4, 14].max() == 0.0


def peaks(front: ToothEngagement, cutter: Cutter) -> np.ndarray:
    """Greatest force and greatest torque of a front."""
    theta = math.tau * np.arange(720) / 720
    force, torque = forces_over_turn(chips_of_teeth(front, cutter), cutter, STEEL, theta)
    return np.array([np.linalg.norm(force[0], axis=1).max(), torque[0].max()])


def test_borders_that_run_are_those_of_many_slices() -> None:
    """One slice whose borders run along it, at rates of their own, against 2,000 whose borders do not."""
    cutter, count = Cutter(10.0, 2, 0.4, 20.0, 30.0, 6e5), 2000
    row, slices = [1.0, 2.2, 0.0, 2.0, 0.1, 0.0, 0.02], [0.0, 3.0, 0.5, 0.8, 0.6, 0.2, 0.05]
    for low, high in ((-0.1, 0.15), (0.1, 0.15), (0.2, -0.2), (0.0, -0.05)):
        own = [*slices, low, high, 1.0, 1.0, 1.2, 0.0]
        one = ToothEngagement([0, 1], [row], [-1], [0], [own], np.eye(3)[None])
        s = np.linspace(0.0, 2.0, count + 1)
        off = 0.5 * (s[1:] + s[:-1]) - 1.0
        rows = np.tile(row, (count, 1))
        rows[:, :4] = np.column_stack([1.0 + low * off, 2.2 + high * off, s[:-1], s[1:]])
        many = np.tile(slices, (count, 1))
        many[:, 0], many[:, 5] = s[:-1], 0.2 + 0.05 * s[:-1]
        dense = ToothEngagement([0, count], rows, np.full(count, -1), np.arange(count), many)
        theta = np.linspace(0.0, math.tau, 240, endpoint=False)
        known, known_torque = forces_over_turn(dense, cutter, STEEL, theta)
        force, torque = forces_over_turn(one, cutter, STEEL, theta)
        np.testing.assert_allclose(force, known, atol=2e-3 * np.abs(known).max())
        np.testing.assert_allclose(torque, known_torque, atol=2e-3 * known_torque.max())
        found = loads_over_turn(one, cutter, STEEL, math.radians(3.0), np.zeros((1, 3)))[0]
        each = _one_by_one(one, cutter, STEEL, rotations(cutter, math.radians(3.0)), np.zeros((1, 3)))
        # the means are those of the middle
        kept = [3, 4, 5, 6, 7, 8, 9, 11]
        np.testing.assert_allclose(found[:, kept], each[:, kept], rtol=1e-6, atol=1e-6)


def test_the_chip_at_a_wall_runs_with_its_border() -> None:
    """A ball beside a wall: six slices whose borders run are within 1 % of 300, others are 4 % off."""
    R, wall, deep, fz = 8.0, 6.9, 5.0, 0.17
    cutter = Cutter(2.0 * R, 6, math.radians(30.0), 40.0, 50.0, 6e5, corner_radius=R)
    lead = math.tan(math.radians(30.0)) / R

    def front(count: int, runs: bool) -> ToothEngagement:
        ends = np.linspace(math.asin(wall / R), math.acos(1.0 - deep / R), count + 1)
        a, b = ends[:-1], ends[1:]
        mid, s = 0.5 * (a + b), R * ends

        def wide(kappa: np.ndarray) -> np.ndarray:
            return np.arccos(np.clip(wall / (R * np.sin(kappa)), -1.0, 1.0))

        sk, none = np.sin(mid), np.zeros(count)
        rows = np.column_stack([none, wide(mid), s[:-1], s[1:], fz * sk, none, none])
        z = R * (1.0 - np.cos(a))
        table = np.column_stack([s[:-1], R * sk, z, sk, np.cos(mid), lead * z, lead * sk])
        if runs:
            rate = (wide(b) - wide(a)) / (R * (b - a))
            table = np.column_stack([table, none, rate, R * mid, none, wide(mid), none])
        return ToothEngagement([0, count], rows, np.full(count, -1), np.arange(count), table)

    known = peaks(front(300, False), cutter)
    assert (np.abs(peaks(front(6, True), cutter) / known - 1.0) < 0.01).all()
    assert (peaks(front(6, False), cutter) / known - 1.0 > 0.03).all()
