"""Roundings and chamfers of conversational contours against plane geometry by shapely and by tangents."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
import shapely

from chipload.errors import Severity
from chipload.program.commands import ARC, LINE
from chipload.program.corners import Element, chamfer, rounding_arc
from chipload.program.heidenhain.reader import read_heidenhain

HEAD = ("BEGIN PGM A MM", "TOOL DEF 1 L+0 R+1", "TOOL CALL 1 Z S1000 F500", "L X+0 Y+10 Z+0 R0 FMAX M3")
SQUARE = (
    "L X+0 Y+20 F500",
    "RND R3",
    "L X+30",
    "RND R4 F100",
    "L Y+0",
    "CHF 5",
    "L X+0",
    "; a comment",
    "RND R2",
    "L Y+10",
)


def read(*blocks):
    return read_heidenhain("\n".join([*HEAD, *blocks, "M30", "END PGM A MM"]))


def points(commands):
    """The path as a polygon of short chords."""
    at, out = None, []
    for k in range(len(commands)):
        end = complex(*commands.position[k, :2])
        if commands.motion[k] == ARC:
            centre, turns = complex(*commands.centre[k]), int(commands.turns[k])
            angle = cmath.phase((end - centre) / (at - centre))
            angle = angle % math.tau if turns > 0 else -(-angle % math.tau)
            out += [centre + (at - centre) * cmath.exp(1j * angle * t) for t in np.linspace(0, 1, 400)[1:]]
        elif commands.motion[k] == LINE:
            out.append(end)
        at = end
    return [(p.real, p.imag) for p in out]


def test_a_square_with_round_corners_and_a_chamfer():
    commands, findings = read(*SQUARE)
    assert all(f.severity < Severity.UNPROVEN for f in findings)
    area = shapely.Polygon([(0.0, 10.0), *points(commands)]).area
    # 30 x 20 less what each corner loses: (1 - pi/4) r^2, and half of 5 x 5
    assert area == pytest.approx(600.0 - (1.0 - math.pi / 4.0) * (9.0 + 16.0 + 4.0) - 12.5, abs=1e-3)
    # the feed of RND is that of the corner alone
    arcs = np.flatnonzero(commands.motion == ARC)
    assert (commands.feed[arcs] * 60.0).round(6).tolist() == [500.0, 100.0, 500.0]
    assert commands.feed[arcs[1] + 1] * 60.0 == pytest.approx(500.0)


def test_beside_a_rounded_contour_the_centre_goes_on_the_offset():
    """RR on the way clockwise round: the tool's centre is on the edge of the part shrunk by its radius."""
    blocks = [b.replace("F500", "RR F500") if k == 0 else b for k, b in enumerate(SQUARE)]
    commands, findings = read(*blocks)
    assert all(f.severity < Severity.UNPROVEN for f in findings)
    plain, _ = read(*SQUARE)
    part = shapely.Polygon([(0.0, 10.0), *points(plain)])
    edge = part.buffer(-1.0, quad_segs=400).exterior
    own = [shapely.Point(p) for p in points(commands)]
    inside = [p for p in own if p.y > 11.0 or p.x > 2.0]
    assert len(inside) > 500
    assert max(edge.distance(p) for p in inside) < 2e-3


@pytest.mark.parametrize("seed", range(60))
def test_a_rounding_touches_both_elements(seed):
    """At both ends the arc goes on in the direction of the element there, on it, with the radius that was asked."""
    rng = np.random.default_rng(seed)
    corner = complex(*rng.uniform(-5, 5, 2))

    def element(before):
        far = corner + complex(*rng.uniform(-20, 20, 2))
        start, end = (far, corner) if before else (corner, far)
        if rng.random() < 0.4:
            return Element(start, end)
        middle, across = 0.5 * (start + end), 1j * (end - start)
        return Element(start, end, middle + across * rng.uniform(-2, 2), int(rng.choice([-1, 1])))

    one, two = element(True), element(False)
    arc = rounding_arc(one, two, 0.3)
    if arc is None:
        return
    for e, point in ((one, arc.start), (two, arc.end)):
        assert abs(point - arc.centre) == pytest.approx(0.3, abs=1e-9)
        assert abs(1j * arc.sense * (point - arc.centre) / 0.3 - e.along(point)) < 1e-6
        if e.sense:
            assert abs(point - e.centre) == pytest.approx(e.radius, abs=1e-9)
            angle = e.sense * cmath.phase((point - e.centre) / (e.start - e.centre)) % math.tau
            whole = e.sense * cmath.phase((e.end - e.centre) / (e.start - e.centre)) % math.tau
            assert angle <= whole + 1e-9
        else:
            assert abs(e.start - point) + abs(point - e.end) == pytest.approx(abs(e.end - e.start), abs=1e-9)


def test_most_random_corners_have_a_rounding():
    found = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        a, b = complex(*rng.uniform(-20, 20, 2)), complex(*rng.uniform(-20, 20, 2))
        found += rounding_arc(Element(a, 0j), Element(0j, b), 0.3) is not None
    assert found >= 55


def test_a_chamfer_has_both_its_ends_as_far_from_the_corner():
    a, b = chamfer(Element(-8 + 0j, 0j), Element(0j, 3 + 4j), 2.0)
    assert (abs(a), abs(b)) == (pytest.approx(2.0), pytest.approx(2.0))
    assert chamfer(Element(-8 + 0j, 0j), Element(0j, 3 + 4j), 5.0) is None


@pytest.mark.parametrize(
    "blocks",
    [
        ("L X+5 F500", "RND R20", "L Y+20"),  # no room
        ("L X+5 F500", "RND R1", "L Y+20 Z-3"),  # not level
        ("L X+5 F500", "CHF 1", "CC X+5 Y+15", "C X+5 Y+20 DR+"),  # not straight
        ("L X+5 F500", "RND R1"),  # nothing behind
        ("RND R1", "L X+5 F500"),
        ("L X+5 F500", "RND R1", "L X+15"),  # no corner
    ],
)
def test_a_corner_that_cannot_be_made_stays_sharp_and_says_so(blocks):
    commands, findings = read(*blocks)
    (found,) = [f for f in findings if f.severity >= Severity.UNPROVEN]
    assert found.code == "heidenhain-corner"
    assert "stays sharp" in found.text
    straight, _ = read(*[b for b in blocks if not b.startswith(("RND", "CHF"))])
    np.testing.assert_array_equal(commands.position, straight.position)


def test_a_jump_on_what_the_controller_knows_is_not_taken_and_named():
    commands, findings = read(
        "FN 18: SYSREAD Q1 = ID990 NR2", "FN 9: IF Q1 EQU 1 GOTO LBL 5", "L X+7 F500", "LBL 5", "L Y+3"
    )
    assert commands.position[-2:, :2].tolist() == [[7.0, 10.0], [7.0, 3.0]]
    (found,) = [f for f in findings if f.severity >= Severity.UNPROVEN]
    assert (found.code, found.line) == ("heidenhain-jump", 6)


def test_radius_compensation_in_a_tilted_plane_is_left_out_until_it_ends():
    commands, findings = read(
        "PLANE SPATIAL SPA+30 SPB+0 SPC+0 STAY", "L X+5 Y+5 RL F500", "L X+9", "L X+0 R0", "PLANE RESET STAY",
        "L X+1 Y+1 Z+0 F500",
    )  # fmt: skip
    assert commands.position[-1, :2].tolist() == [1.0, 1.0]
    assert any(f.code == "heidenhain-plane" and f.severity >= Severity.UNPROVEN for f in findings)
