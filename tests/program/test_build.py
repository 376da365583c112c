from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.geometry.contour import Contour
from chipload.program.build import follow, helix, plunge, rapid, rows
from chipload.program.motions import bounds, directions, lengths, straighten_arcs, sweeps
from chipload.program.program import ARC_CCW, ARC_CW, LINE, Program

SLOT = Contour.from_bulges([[0, 0], [30, 0], [30, 20], [0, 20]], [0.0, 1.0, 0.0, 1.0], closed=True)


def at_start(contour, part, z=0.0):
    return Program.join([rapid([*contour.start, z], 0.0, 1, "link"), part])


def test_slot_is_four_rows():
    part = follow(SLOT, -1.0, 10.0, 800.0, 2, "finish")
    assert part.motion.tolist() == [LINE, ARC_CCW, LINE, ARC_CCW]
    np.testing.assert_array_equal(part.p_work, [[30, 0, -1], [30, 20, -1], [0, 20, -1], [0, 0, -1]])
    np.testing.assert_allclose(part.centre[:, :2], [[0, 0], [30, 10], [0, 0], [0, 10]], atol=1e-12)
    whole = at_start(SLOT, part, -1.0)
    assert lengths(whole).sum() == pytest.approx(60.0 + 20.0 * math.pi, rel=1e-14)
    np.testing.assert_allclose(np.degrees(sweeps(whole)), [0, 0, 180, 0, 180], atol=1e-9)
    low, high = bounds(whole)
    np.testing.assert_allclose([low.min(axis=0), high.max(axis=0)], [[-10, 0, -1], [40, 20, -1]], atol=1e-12)


def test_directions_are_those_of_the_contour():
    whole = at_start(SLOT, follow(SLOT, 0.0, 10.0, 0.0, 1, "x"))
    first, last = directions(whole)
    np.testing.assert_allclose(first[1:, :2], SLOT.at(SLOT.knots[:-1])[1], atol=1e-12)
    np.testing.assert_allclose(last[1:, :2], SLOT.at(SLOT.knots[1:] - 1e-12)[1], atol=1e-9)
    assert not first[0].any()


@pytest.mark.parametrize("seed", range(5))
def test_feed_along_the_contour(seed):
    """The feed at any length is the one asked for, and the path stays the contour."""
    rng = np.random.default_rng(seed)
    c = SLOT if seed % 2 else Contour.circle((3.0, 4.0), 9.0, -1)
    s = np.unique(np.concatenate([[0.0], rng.uniform(0, c.length, 30), c.knots[1:2] + 1e-9]))
    s = s[s <= c.length]
    f = rng.uniform(1, 9, len(s))
    whole = at_start(c, follow(c, 0.0, (s, f), 0.0, 1, "x"))
    ends = np.cumsum(lengths(whole))
    assert ends[-1] == pytest.approx(c.length, rel=1e-12)
    np.testing.assert_allclose(whole.p_work[1:, :2], c.at(np.clip(ends[1:], 0, c.length))[0], atol=1e-9)
    middle = 0.5 * (ends[1:] + ends[:-1])
    np.testing.assert_array_equal(whole.feed[1:], f[np.searchsorted(s, middle, side="right") - 1])
    np.testing.assert_array_equal(whole.p_work[-1, :2], c.end)


def test_feed_of_each_segment_and_ramp():
    part = follow(SLOT, (0.0, -3.0), [1, 2, 3, 4], 0.0, 1, "ramp")
    assert part.feed.tolist() == [1, 2, 3, 4]
    np.testing.assert_allclose(part.p_work[:, 2], -3.0 * SLOT.knots[1:] / SLOT.length)
    assert part.p_work[-1, 2] == -3.0
    flat = lengths(at_start(SLOT, follow(SLOT, 0.0, 1.0, 0.0, 1, "x")))[1:]
    ramp = lengths(at_start(SLOT, part))[1:]
    np.testing.assert_allclose(ramp, flat * math.hypot(1.0, 3.0 / SLOT.length), rtol=1e-12)


def test_helix_length():
    part = helix((8.0, 0.0), (3.0, 0.0), (0.0, -6.0), 2.5, 4.0, 0.0, 1, "entry", sense=-1)
    assert (part.motion == ARC_CW).all()
    whole = Program.join([rapid([8, 0, 0], 0.0, 1, "link"), part])
    turn = math.hypot(10.0 * math.pi, 2.0)  # 3 turns of 2 mm, then a level one
    assert lengths(whole).sum() == pytest.approx(3 * turn + 10.0 * math.pi, rel=1e-13)
    assert whole.p_work[-1].tolist() == [8, 0, -6]


def test_chords_stay_near():
    whole = at_start(SLOT, follow(SLOT, 0.0, 10.0, 0.0, 1, "x"))
    assert straighten_arcs(whole, np.full(len(whole), math.inf)) is whole
    chords = straighten_arcs(whole, np.full(len(whole), 0.1))
    assert (chords.motion[1:] == LINE).all()
    assert len(chords) == 1 + 2 + 2 * math.ceil(math.pi / 0.1)
    np.testing.assert_array_equal(chords.p_work[-1], whole.p_work[-1])
    n = math.ceil(math.pi / 0.1)
    assert lengths(chords).sum() == pytest.approx(60.0 + 40.0 * n * math.sin(math.pi / 2 / n), rel=1e-12)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: follow(SLOT, 0, [1, 2], 0, 1, "x"),
            "feed: shape (2,): must be one number or one for each of the 4 segments",
        ),
        (
            lambda: follow(SLOT, 0, ([0.0], [1, 2]), 0, 1, "x"),
            "feed: 1 lengths and 2 feeds: must be as many, at least one",
        ),
        (
            lambda: follow(SLOT, 0, ([1.0], [1]), 0, 1, "x"),
            "feed: the lengths must start at 0 and rise to at most 122.832 mm",
        ),
        (lambda: follow(SLOT, 0, 0.0, 0, 1, "x"), "program row 0: a cutting motion without a feed: set its feed"),
        (
            lambda: helix((1, 1), (1, 1), (0, -1), 1, 1, 0, 1, "x"),
            "helix: start (1, 1) is the centre: must be a radius away from it",
        ),
        (lambda: helix((1, 1), (0, 1), (0, -1), 0, 1, 0, 1, "x"), "helix: pitch = 0 mm: must be above 0"),
        (
            lambda: Program.join([rapid([1, 0, 0], 0, 1, "x"), follow(Contour.circle((0, 0), 2.0), 0, 1.0, 0, 1, "x")]),
            "program row 1: an arc starts 1 mm from its centre and ends 2 mm from it: must agree within 0.001 mm",
        ),
    ],
)
def test_refused(call, message):
    with pytest.raises(InputError) as err:
        call()
    assert str(err.value) == message


def test_rows_are_values():
    part = rows([LINE, LINE], [[0, 0, 0], [1, 0, 0]], (0, 0), 2.0, -5.0, 4, "cut")
    assert part.spindle.tolist() == [-5.0, -5.0]
    assert plunge([0, 0, -1], 3.0, 1.0, 4, "entry").feed.tolist() == [3.0]
    with pytest.raises(ValueError, match="read-only"):
        part.feed[0] = 1.0
