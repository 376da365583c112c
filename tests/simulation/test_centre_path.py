"""The trail alone reproduces the closed forms of engagement."""

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region
from chipload.simulation.centre_path import TOUCH_MM, CentrePath, rim_engagement
from left_material import material_left_of

R, S = 5.0, 0.1


def deg(trail, motion, share, **options):
    return np.degrees(rim_engagement(trail, motion, share, **options).angle)


def corner(radius):
    """Down milling in a concave corner about the origin: line, quarter turn left, line."""
    return Contour(
        [
            [-40, -radius, 0, -radius, 0, 0, 0],
            [0, -radius, radius, 0, 0, 0, np.pi / 2],
            [radius, 0, radius, 40, 0, 0, 0],
        ]
    )


def test_line():
    trail = CentrePath([[-50, S, 50, S, 0, 0, 0], [-50, 0, 50, 0, 0, 0, 0]], R)
    rim = rim_engagement(trail, [0, 1, 1, 1], [0.5, 0.2, 0.5, 0.9])
    assert np.degrees(rim.angle[0]) == pytest.approx(180.0, abs=1e-4)
    assert np.degrees(rim.angle[1:]) == pytest.approx(np.degrees(np.arccos(1 - S / R)), abs=1e-5)
    # material on the right of travel: the wall is left at pi
    assert rim.count.tolist() == [1, 1, 1, 1]
    assert rim.phi[2, 0] == pytest.approx([np.pi - np.arccos(1 - S / R), np.pi], abs=1e-7)


@pytest.mark.parametrize("rc", [7.871, 8.0, 12.0, 30.0])
def test_concave_wall(rc):
    trail = CentrePath(np.vstack([corner(rc - R - S).segments, corner(rc - R).segments]), R)
    expected = np.degrees(np.arccos(1 - S * (2 * rc - S) / (2 * R * (rc - R))))
    # in the middle, where the leading point runs in the corner too
    assert deg(trail, [4], [0.5]) == pytest.approx(expected, abs=1e-4)


def test_the_papers_corner():
    trail = CentrePath(np.vstack([corner(3.0 - S).segments, corner(3.0).segments]), R)
    before = np.array([0.9, 0.7, 0.5, 0.25, 0.0])
    assert deg(trail, [3] * 5, 1 - before / 40) == pytest.approx(
        [11.5133, 11.8641, 12.7340, 14.9054, 18.7375], abs=1e-4
    )
    assert deg(trail, [3, 4, 5], [0.5, 0.5, 0.5]) == pytest.approx([11.47834, 18.73754, 11.47834], abs=1e-4)


@pytest.mark.parametrize("rc", [0.5, 3.0, 20.0])
def test_convex_wall(rc):
    def around(r):
        return Contour.circle((0, 0), r, sense=-1).moved(1.0, 2.0).segments

    trail = CentrePath(np.vstack([around(rc + R + S), around(rc + R)]), R)
    expected = np.degrees(np.arccos(1 - S * (2 * rc + S) / (2 * R * (rc + R))))
    assert deg(trail, [1, 1], [0.3, 0.6]) == pytest.approx(expected, abs=1e-4)


def test_mirrored_wall_is_cut_from_zero():
    trail = CentrePath([[-50, -S, 50, -S, 0, 0, 0], [-50, 0, 50, 0, 0, 0, 0]], R)
    assert rim_engagement(trail, [1], [0.5]).phi[0, 0] == pytest.approx([0.0, np.arccos(1 - S / R)], abs=1e-7)


def test_spiral_out_of_a_bored_hole():
    """Circles with a step of s: concave walls whose closed form is exact once a turn is complete."""
    step, turns = 0.4, 12
    rho = 1.0 + step * np.arange(turns)
    circles = [Contour.circle((0, 0), r).segments for r in rho]
    trail = CentrePath(np.vstack(circles), R)
    rc = rho[1:] + R
    expected = np.degrees(np.arccos(1 - step * (2 * rc - step) / (2 * R * (rc - R))))
    # half a turn in, the stock ahead is that of the circle before
    assert deg(trail, np.arange(1, turns), np.full(turns - 1, 0.5)) == pytest.approx(expected, abs=1e-4)


def test_full_slot_and_air():
    block = Region((Contour.polyline([[0, -20], [40, -20], [40, 20], [0, 20]], closed=True),))
    trail = CentrePath([[-30, 0, 80, 0, 0, 0, 0]], R, block)
    x = np.array([-10.0, 20.0, 38.0, 60.0])
    got = deg(trail, [0] * 4, (x + 30) / 110)
    # at 38 the rim sticks out of the block by 3 mm: engaged where R sin(phi) < 2
    assert got == pytest.approx([0.0, 180.0, 2 * np.degrees(np.arcsin(2 / R)), 0.0], abs=1e-4)


def test_thin_wall_makes_two_arcs():
    wall = Region((Contour.polyline([[0, -20], [1, -20], [1, 20], [0, 20]], closed=True),))
    trail = CentrePath([[-30, 0, 30, 0, 0, 0, 0]], R, wall)
    rim = rim_engagement(trail, [0], [(30 - 2.0) / 60])  # centre 2 mm before the wall: x 2..3 of the rim
    one = np.arcsin(3 / R) - np.arcsin(2 / R)
    assert rim.count[0] == 2
    assert rim.angle[0] == pytest.approx(2 * one, abs=1e-7)


def test_a_pass_repeated_meets_nothing():
    trail = CentrePath([[-50, 0, 50, 0, 0, 0, 0]] * 2, R)
    assert deg(trail, [1], [0.5])[0] <= 2 * np.degrees(np.arccos(1 - TOUCH_MM / R)) + 1e-6


@pytest.mark.parametrize("s", [1e-2, 1e-3, 1e-4, 1e-5])
def test_thin_engagement_at_the_end_of_the_front_half(s):
    trail = CentrePath([[-50, s, 50, s, 0, 0, 0], [-50, 0, 50, 0, 0, 0, 0]], R)
    assert deg(trail, [1], [0.5]) == pytest.approx(np.degrees(np.arccos(1 - s / R)), abs=1e-4)


def test_membership_against_brute_force():
    rng = np.random.default_rng(3)
    p = np.cumsum(rng.normal(0, 2, (60, 2)), axis=0)
    seg = np.column_stack([p[:-1], p[1:], np.zeros((59, 3))])
    block = Region((Contour.circle((0, 0), 12.0), Contour.circle((1, 2), 4.0, -1)))
    trail = CentrePath(seg, 2.0, block)
    points = rng.uniform(-15, 15, (4000, 2))
    k = rng.integers(0, 59, 4000)
    w = rng.uniform(0, 1, 4000)
    expected = block.contains(points)
    for i in range(4000):
        a, d = p[: k[i] + 1], np.diff(p[: k[i] + 2], axis=0)
        d[-1] *= w[i]
        u = np.clip(((points[i] - a) * d).sum(1) / (d**2).sum(1), 0, 1)
        expected[i] &= np.hypot(*(points[i] - a - u[:, None] * d).T).min() >= 2.0
    assert (trail.uncut(points, k, w) == expected).all()


def test_workers_do_not_matter():
    trail = CentrePath(np.vstack([corner(3.0 - S).segments, corner(3.0).segments]), R)
    w = np.linspace(0, 1, 101)
    one, two = (rim_engagement(trail, np.full(101, 3), w, workers=n) for n in (1, 2))
    assert (one.angle == two.angle).all()
    assert (one.phi == two.phi).all()


def test_open_chain_bounds_a_half_plane():
    chain = Contour.polyline([[0, 0], [10, 0]])
    region = material_left_of(chain, 100.0)
    assert region.contains([[5, 1], [5, -1], [-40, 1], [60, -1]]).tolist() == [True, False, True, False]


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (
            lambda: CentrePath(np.zeros((2, 3)), 1.0),
            "centre path: segments of shape (2, 3): need (n, 7) finite numbers",
        ),
        (lambda: CentrePath(np.zeros((1, 7)), 0.0), "centre path: radius = 0 mm: must be above 0"),
        (
            lambda: CentrePath(np.zeros((1, 7)), 1.0, None, [False]),
            "centre path: 0 of 1 motions cut: need at least one",
        ),
        (
            lambda: rim_engagement(CentrePath(np.zeros((1, 7)), 1.0), [1], [0.0]),
            "centre path: moments must be motions 0..0 and shares 0..1",
        ),
    ],
)
def test_refused(make, text):
    with pytest.raises(InputError) as e:
        make()
    assert str(e.value) == text
