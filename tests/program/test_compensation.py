from __future__ import annotations

import math
import random

import numpy as np
import pytest
import shapely

from chipload.errors import InputError
from chipload.program.commands import ARC, DWELL, LINE, PLANE_AXES, RAPID, XY, YZ, ZX
from chipload.program.compensation import Compensation
from rs274 import MISSING, Refused, canonical, rs274_installed


def at(first, second, along=0.0, plane=XY):
    out = [0.0] * 9
    for axis, value in zip(PLANE_AXES[plane], (first, second, along), strict=True):
        out[axis] = value
    return tuple(out)


def run(moves, side, radius, plane=XY, start=(0.0, 0.0), **more):
    """Rows (motion, first, second, along, centre, turns); ``moves``: (motion, end) or (ARC, end, centre, turns)."""
    comp = Compensation(side, radius, plane, at(*start, plane=plane), **more)
    out = []
    for k, (motion, end, *arc) in enumerate(moves):
        out += comp.arc(end, *arc, k) if motion == ARC else comp.line(motion, end, k)
    out += comp.finish()
    axes = PLANE_AXES[plane]
    return [(m.motion, *(m.end[i] for i in axes), *m.centre, m.turns) for m in out]


def lines(*points):
    return [(LINE, at(*p)) for p in points]


def test_outside_a_square_it_goes_round_the_corners():
    got = run(lines((10, 0), (10, 10), (0, 10)), -1, 2.0)
    assert np.allclose(
        np.array(got),
        [
            (LINE, 10, -2, 0, 0, 0, 0),
            (ARC, 12, 0, 0, 10, 0, 1),
            (LINE, 12, 10, 0, 0, 0, 0),
            (ARC, 10, 12, 0, 10, 10, 1),
            (LINE, 0, 12, 0, 0, 0, 0),
        ],
        atol=1e-12,
    )


def test_inside_a_square_it_ends_where_the_offsets_cross():
    got = run(lines((10, 0), (10, 10), (0, 10)), 1, 2.0)
    assert np.allclose(np.array(got)[:, 1:3], [(8, 2), (8, 8), (0, 8)], atol=1e-12)


@pytest.mark.parametrize(("turn", "rows"), [(0.049, 2), (-0.049, 2), (0.051, 2), (-0.051, 3)])
def test_below_0_05_rad_there_is_no_corner(turn, rows):
    got = run(lines((10, 0), (10 + 10 * math.cos(turn), 10 * math.sin(turn))), 1, 2.0)
    assert len(got) == rows
    trimmed = 10 - 2 * math.tan(turn / 2) if turn == 0.051 else 10
    assert got[0][1:3] == pytest.approx((trimmed, 2), abs=1e-12)


def test_a_negative_radius_stands_on_the_other_side():
    moves = lines((10, 0), (10, 10), (0, 10))
    assert run(moves, 1, -2.0) == run(moves, -1, 2.0)


def test_radius_zero_holds_nothing_back():
    comp = Compensation(1, 0.0, XY, at(0, 0))
    assert [m.end for m in comp.line(LINE, at(0, 0, 5), None)] == [at(0, 0, 5)]
    assert [m.end for m in comp.arc(at(0, 0, 5), (3.0, 0.0), 1, None)] == [at(0, 0, 5)]
    assert comp.finish() == []


def test_what_stands_still_in_the_plane_is_moved_with_the_corner():
    comp = Compensation(1, 1.0, XY, at(0, 0, 5))
    assert comp.line(LINE, at(10, 0, 5), "a") == []
    assert comp.line(LINE, at(10, 0, 2), "down") == []
    assert comp.pause("wait") == []
    assert comp.position == at(10, 0, 2)
    assert comp.end == at(10, 1, 2)
    final = comp.line(RAPID, at(10, 10, 2), "b") + comp.finish()
    assert [(m.motion, m.payload) for m in final] == [(LINE, "a"), (LINE, "down"), (DWELL, "wait"), (RAPID, "b")]
    ends = np.array([m.end[:3] for m in final])
    assert np.allclose(ends, [(9, 1, 5), (9, 1, 2), (9, 1, 2), (9, 10, 2)], atol=1e-12)


# LinuxCNC's own test "mill-line-arc-entry": what it prints, tool of radius 0.5, to 4 decimals
ENTRY = [
    (LINE, (1, 4)),
    (ARC, (2, 3), (2, 4), 1),
    (ARC, (3, 2), (2, 2), -1),
    (LINE, (3, -1)),
    (ARC, (2, -2), (2, -1), -1),
]
ENTRY += [(LINE, (-2, -2)), (ARC, (-2.6, -0.2), (-2, -1), -1), (LINE, (1.4, 2.8)), (ARC, (2, 3), (2, 2), -1)]
ENTERED = [(1.5, 4), (2, 3.5), (3.5, 2), (3.5, -1), (2, -2.5), (-2, -2.5), (-2.9, 0.2), (1.1, 3.2), (2, 3.5)]
# and "lathe-comp": plane G18 (Z, X), tool radius 0.05, a tip that is commanded 0.05 before the centre in Z and X
LATHE = [(LINE, (0, 0.1)), (ARC, (0.1, 0), (0.1, 0.1), 1), (LINE, (1, 0)), (ARC, (1.25, -0.25), (1, -0.25), -1)]
LATHE += [(ARC, (1.5, -0.5), (1.5, -0.25), 1), (LINE, (1.75, -0.5))]
TURNED = [(0, 0.05), (0.05, 0), (0.95, 0), (1.25, -0.3), (1.45, -0.5), (1.7, -0.5)]


@pytest.mark.parametrize(
    ("moves", "ends", "side", "radius", "plane", "start", "shift"),
    [(ENTRY, ENTERED, 1, 0.5, XY, (1, 5), (0, 0)), (LATHE, TURNED, 1, 0.05, ZX, (0, 0.3), (-0.05, -0.05))],
)
def test_golden(moves, ends, side, radius, plane, start, shift):
    moves = [(motion, at(*end, plane=plane), *arc) for motion, end, *arc in moves]
    got = run(moves, side, radius, plane, start, shift=shift)
    assert np.allclose(np.array(got)[:, 1:3], ends, atol=5.1e-5)
    for (motion, _end, *arc), row in zip(moves, got, strict=True):
        assert row[0] == motion
        if arc:
            assert np.allclose(row[4:], [arc[0][0] + shift[0], arc[0][1] + shift[1], arc[1]], atol=1e-12)


@pytest.mark.parametrize(
    ("moves", "message"),
    [
        (
            lines((1.5, 0)),
            "radius compensation: its first motion is 1.5 mm long: must be longer than the tool's radius 2 mm: start "
            "farther away or use a smaller tool",
        ),
        (
            [*lines((10, 0)), (ARC, at(10, 3), (10, 1.5), 1)],
            "radius compensation: an arc of radius 1.5 mm would cause gouging with a tool of radius 2 mm: use a "
            "smaller tool",
        ),
        (
            lines((10, 0), (10, 3.9), (0, 3.9)),
            "radius compensation: a line between two corners would cause gouging with a tool of radius 2 mm: use a "
            "smaller tool or a longer line",
        ),
    ],
)
def test_refused(moves, message):
    with pytest.raises(InputError) as error:
        run(moves, 1, 2.0)
    assert str(error.value) == message


def test_the_plane_yz_is_compensated():
    """In Y and Z as in X and Y: the offset of a line to the left of +Y lies at +Z."""
    beside = Compensation(1, 1.0, YZ, (0.0,) * 9)
    moves = [*beside.line(LINE, (0.0, 5.0, 0.0, *[0.0] * 6), 0), *beside.line(LINE, (0.0, 9.0, 0.0, *[0.0] * 6), 0)]
    moves += beside.finish()
    assert [m.end[:3] for m in moves] == [(0.0, 5.0, 1.0), (0.0, 9.0, 1.0)]


def flattened(rows, start):
    """The path of rows in XY, arcs as chords with a sagitta below 1e-6 of their radius."""
    out, here = [], start
    for motion, x, y, _z, cx, cy, turns in rows:
        if motion == ARC:
            a = math.atan2(here[1] - cy, here[0] - cx)
            sweep = math.copysign((math.copysign(1, turns) * (math.atan2(y - cy, x - cx) - a)) % math.tau, turns)
            t = a + np.linspace(0, sweep, 2000)[1:]
            out += list(
                zip(
                    cx + math.hypot(x - cx, y - cy) * np.cos(t),
                    cy + math.hypot(x - cx, y - cy) * np.sin(t),
                    strict=True,
                )
            )
        else:
            out.append((x, y))
        here = (x, y)
    return np.array(out)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("seed", range(1, 5))
def test_the_centre_is_one_radius_from_a_closed_contour(side, seed):
    """A star with corners of both kinds: the path is the edge of the contour's buffer, by another library."""
    rng = random.Random(seed)
    n, r = 9, 1.5
    angles = [math.tau * (k + 0.2 * rng.random()) / n for k in range(n)]
    sizes = [rng.uniform(18, 40) for _ in angles]
    star = [(q * math.cos(a), q * math.sin(a)) for q, a in zip(sizes, angles, strict=True)]
    first, last = np.array(star[0]), np.array(star[-1])
    middle = tuple(0.5 * (first + last))
    # the first motion comes along the edge itself, so that it ends on the offset
    start = np.array(middle) - 5.0 * (first - last) / np.hypot(*(first - last))
    rows = run(lines(middle, *star, middle), side, r, start=tuple(start))
    path = flattened(rows[1:], (rows[0][1], rows[0][2]))[1:]
    ring = shapely.LinearRing(star)
    middles = 0.5 * (path[1:] + path[:-1])
    beside = shapely.distance(shapely.points(middles), ring)
    assert np.abs(beside - r).max() < 1e-5
    inside = shapely.contains_xy(shapely.Polygon(star), *middles.T)
    assert inside.all() if side > 0 else not inside.any()


def program(moves, side, radius, plane):
    """The same as a text for LinuxCNC."""
    first, second, _ = PLANE_AXES[plane]
    out = [f"G21 G90 G40 F100 {'G18' if plane == ZX else 'G17'}", f"G{41 if side > 0 else 42}.1 D{2 * radius:.9f}"]
    here = at(0, 0, plane=plane)
    for motion, end, *arc in moves:
        word = f"X{end[0]:.9f} Y{end[1]:.9f} Z{end[2]:.9f}"
        if motion == ARC:
            (c0, c1), turns = arc
            word += f" {'IJK'[first]}{c0 - here[first]:.9f} {'IJK'[second]}{c1 - here[second]:.9f} P{abs(turns)}"
            out.append(f"G{3 if turns > 0 else 2} {word}")
        else:
            out.append(f"G{0 if motion == RAPID else 1} {word}")
        here = end
    return "\n".join([*out, "G40", "M2", ""])


def printed(calls, plane):
    """Rows as of :func:`run` from what rs274 printed."""
    axes, out = PLANE_AXES[plane], []
    for name, words in calls:
        if name == "ARC_FEED":
            a, b, c0, c1, turns, along = (float(w) for w in words[:6])
            out.append((ARC, a, b, along, c0, c1, int(turns)))
        elif name in ("STRAIGHT_FEED", "STRAIGHT_TRAVERSE"):
            end = [float(w) for w in words[:3]]
            out.append((LINE if name == "STRAIGHT_FEED" else RAPID, *(end[i] for i in axes), 0.0, 0.0, 0))
    return out


def drawn(rng, arcs, plane):
    """A random programme, in µm so that the four printed decimals are many."""
    moves, x, y, z, heading = [], 0.0, 0.0, 0.0, None
    for k in range(rng.randint(2, 7)):
        if k and rng.random() < 0.15:
            z = rng.uniform(-5e3, 5e3)
            moves.append((rng.choice([LINE, RAPID]), at(x, y, z, plane)))
            continue
        if rng.random() < 0.3:
            z = rng.uniform(-5e3, 5e3)
        h = rng.uniform(0, math.tau)
        if heading is not None and rng.random() < 0.35:
            h = heading + rng.choice([0, 0, 0.03, -0.03, 0.06, -0.06, math.pi - 0.03, math.pi, math.pi + 0.03])
        if rng.random() < arcs:
            size, sense = rng.uniform(500, 5000), rng.choice([1, -1])
            cx, cy = x - sense * size * math.sin(h), y + sense * size * math.cos(h)
            sweep = sense * rng.uniform(0.1, 6.2)
            if rng.random() < 0.1:
                sweep = sense * math.tau
            else:
                a = math.atan2(y - cy, x - cx) + sweep
                x, y = cx + size * math.cos(a), cy + size * math.sin(a)
            moves.append((ARC, at(x, y, z, plane), (cx, cy), sense * (3 if rng.random() < 0.1 else 1)))
            heading = h + sweep
        else:
            length = rng.uniform(300, 6000)
            x, y, heading = x + length * math.cos(h), y + length * math.sin(h), h
            moves.append((RAPID if rng.random() < 0.1 else LINE, at(x, y, z, plane)))
    return moves


@pytest.mark.skipif(not rs274_installed(), reason=MISSING)
@pytest.mark.parametrize("plane", [XY, ZX])
@pytest.mark.parametrize("arcs", [0.0, 0.5, 0.8])
def test_as_linuxcnc_does_it(arcs, plane):
    """The same motions to the printed decimals, or refused by both."""
    rng = random.Random(int(100 * arcs) + plane)
    refused = 0
    for _ in range(30):
        moves = drawn(rng, arcs, plane)
        side, radius = rng.choice([1, -1]), rng.choice([0.0, 100.0, 300.0, 500.0, 1000.0, 2000.0])
        text = program(moves, side, radius, plane)
        try:
            want = printed(canonical(text), plane)
        except Refused:
            refused += 1
            with pytest.raises(InputError):
                run(moves, side, radius, plane)
            continue
        got = run(moves, side, radius, plane)
        assert [(row[0], row[-1]) for row in got] == [(row[0], row[-1]) for row in want], text
        assert np.allclose(np.array(got), np.array(want), rtol=0.0, atol=2e-4), text
    assert 3 < refused < 25


@pytest.mark.parametrize("radius", [1e-61, 1e-12, -1e-61])
def test_a_radius_that_coordinates_do_not_show_counts_as_none(radius):
    def path(r):
        beside = Compensation(1, r, XY, [0.0] * 9)
        out = []
        for end in ([20.0, 0.0], [20.0, 20.0], [0.0, 20.0]):
            out += beside.line(LINE, [*end, *[0.0] * 7], None)
        return [(m.motion, tuple(m.end)) for m in [*out, *beside.finish()]]

    assert path(radius) == path(0.0)
