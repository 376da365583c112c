"""Metal that a splitter has in common with its blade: of blades whose arcs are known, and against points in a body."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from chipload import examples
from chipload.errors import InputError
from chipload.geometry.overlap import overlap_of, splitter_apart
from chipload.geometry.sections import loft, read_sections

PITCH = math.tau / 8
ROUND = np.linspace(0.0, math.tau, 240, endpoint=False)


def elliptic(radii, half_deg, chord=20.0, at_deg=0.0):
    """Sections on cylinders: on each the blade takes 2 half_deg in the middle of its chord, none at its ends."""
    theta = np.radians(at_deg + half_deg * np.sin(ROUND))
    return tuple(np.stack([r * np.cos(theta), r * np.sin(theta), 0.5 * chord * np.cos(ROUND)], axis=-1) for r in radii)


BLADE = elliptic((30.0, 40.0, 50.0), 6.0)


@pytest.mark.parametrize("turn", [-53.0, -8.0, 8.0, 37.0, 53.0])
def test_arcs_that_are_known(turn):
    # 6 deg on either side, 8 deg apart: 4 deg in common in the middle of the chord
    sections = elliptic((32.0, 48.0), 6.0, at_deg=turn)
    found = overlap_of(loft(sections), loft(BLADE), PITCH, np.concatenate(sections))
    for k, r in enumerate((32.0, 48.0)):
        n = len(ROUND)
        assert found.length[k * n : (k + 1) * n].max() == pytest.approx(r * math.radians(4.0), rel=2e-3)
    to_middle = (22.5 - turn + 22.5) % 45.0 - 22.5
    assert math.degrees(found.turn) == pytest.approx(to_middle, abs=0.01)


def test_a_shorter_splitter_within_its_blade():
    sections = elliptic((32.0, 48.0), 1.0, chord=10.0)
    found = overlap_of(loft(sections), loft(BLADE), PITCH, np.concatenate(sections))
    assert found.length.max() == pytest.approx(48.0 * math.radians(2.0), rel=2e-3)


def test_a_thicker_splitter_round_its_blade():
    sections = elliptic((32.0, 48.0), 9.0, chord=19.0)
    found = overlap_of(loft(sections), loft(BLADE), PITCH, np.concatenate(sections))
    assert found.length.max() == pytest.approx(48.0 * math.radians(12.0), rel=2e-3)


@pytest.mark.parametrize("turn", [12.1, 22.5, 32.9])
def test_apart(turn):
    # 6 deg on either side of both, 0.1 deg apart at least: no metal in common; blades at 0 and 45 deg
    sections = elliptic((30.0, 50.0), 6.0, at_deg=turn)
    splitter_apart(loft(sections), loft(BLADE), PITCH, sections)
    found = overlap_of(loft(sections), loft(BLADE), PITCH, np.concatenate(sections))
    assert found.length.max() == 0.0
    assert math.degrees(found.turn) == pytest.approx(22.5 - turn, abs=0.01)


@pytest.mark.parametrize("turn", [11.9, 33.1])
def test_refused(turn):
    sections = elliptic((30.0, 50.0), 6.0, at_deg=turn)
    with pytest.raises(InputError, match=r"^overlaps the blade: sections 1 to 2: up to 0\.087.* mm round the axis"):
        splitter_apart(loft(sections), loft(BLADE), PITCH, sections)


def test_inside_near_the_tip_alone():
    # twisted by 10 deg from foot to tip: apart at the foot, 3 deg in common at the tip
    a, b, c = (elliptic((r,), 6.0, at_deg=t)[0] for r, t in ((30.0, 19.0), (40.0, 14.0), (50.0, 9.0)))
    with pytest.raises(InputError, match=r"sections 3 to 3: up to 2\.62 mm"):
        splitter_apart(loft((a, b, c)), loft(BLADE), PITCH, (a, b, c))
    with pytest.raises(InputError, match=r"72 to 100 % of its height: up to 2\.62 mm"):
        splitter_apart(loft((a, b, c)), loft(BLADE), PITCH)


def test_where_points_of_a_splitter_lie_in_the_body_of_its_blade():
    """The body of a blade as a polyhedron: what lies in it is seen under the whole solid angle."""
    files = sorted((Path(examples.__file__).parent / "hecc").glob("*_??.txt"))
    main, raw = (
        read_sections([f for f in files if f.name.startswith(name)], "inch", True, "X R*THETA R")
        for name in ("main", "splitter")
    )
    body, points = solid(main), np.concatenate(raw[1:-1])[::4]
    splitter, blade, pitch = loft(raw), loft(main), math.tau / 15
    seen = []
    for turn in np.radians([0.0, 7.0, 9.0, 12.0]):
        c, s = math.cos(turn), math.sin(turn)
        spin = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        moved = tuple(p @ spin.T for p in raw)
        back = [
            np.array([[math.cos(k), math.sin(k), 0.0], [-math.sin(k), math.cos(k), 0.0], [0.0, 0.0, 1.0]])
            for k in pitch * np.arange(15)
        ]
        inside = any(within(points @ spin.T @ b.T, body).any() for b in back)
        found = overlap_of(splitter.turned(turn), blade, pitch, np.concatenate(moved))
        seen.append((found.length.max() > 0.0, inside))
    assert seen == [(False, False), (False, False), (True, True), (True, True)]


def solid(sections):
    """Triangles (n, 3, 3) of the body through sections, from one to the next, and its ends."""
    rings = [ring_of(p) for p in sections]
    out = []
    for a, b in itertools.pairwise(rings):
        a1, b1 = np.roll(a, -1, axis=0), np.roll(b, -1, axis=0)
        out += [np.stack([a, a1, b], axis=1), np.stack([a1, b1, b], axis=1)]
    n = len(rings[0]) // 2
    for ring, way in ((rings[0], 1), (rings[-1], -1)):
        # a strip between the two halves from edge to edge
        half, other = ring[: n + 1], np.roll(ring[::-1], 1, axis=0)[: n + 1]
        for tri in (np.stack([half[:-1], other[:-1], half[1:]], 1), np.stack([half[1:], other[:-1], other[1:]], 1)):
            out.append(tri[:, ::way])
    return np.concatenate(out)


def ring_of(p, n=200):
    """A section as n points from the leading edge, with equal numbers on both sides."""
    p = p[:-1] if np.allclose(p[0], p[-1]) else p
    p = np.roll(p, -int(p[:, 2].argmax()), axis=0)
    end = int(np.linalg.norm(p - p[0], axis=1).argmax())
    closed = np.concatenate([p, p[:1]])
    halves = []
    for part in (closed[: end + 1], closed[end:]):
        s = np.concatenate([[0.0], np.linalg.norm(np.diff(part, axis=0), axis=1).cumsum()])
        at = np.linspace(0.0, s[-1], n // 2 + 1)[:-1]
        halves.append(np.stack([np.interp(at, s, part[:, k]) for k in range(3)], axis=-1))
    return np.concatenate(halves)


def within(points, triangles):
    """Which points (n,) see the triangles of a closed body under 4 pi. Reference: van Oosterom and Strackee 1983."""
    out = np.zeros(len(points))
    for k in range(0, len(points), 100):
        a, b, c = (triangles[None, :, j] - points[k : k + 100, None] for j in range(3))
        la, lb, lc = (np.linalg.norm(x, axis=2) for x in (a, b, c))
        top = (a * np.cross(b, c)).sum(axis=2)
        below = la * lb * lc + (a * b).sum(2) * lc + (b * c).sum(2) * la + (c * a).sum(2) * lb
        out[k : k + 100] = 2.0 * np.arctan2(top, below).sum(axis=1)
    return np.abs(out) > 2.0 * math.pi
