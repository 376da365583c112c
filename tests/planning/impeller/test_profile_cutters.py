"""Point milling with tapered and barrel cutters: closed forms, dense profiles against surfaces, no taper at all."""

import math

import numpy as np
import pytest
from tests.planning.impeller.test_point_milling import (
    LIMITS,
    REACHABLE,
    WHOLE,
    fence,
    hollow,
    plane,
    scene_of,
    upright,
)

from chipload.cutter.catalogue import CatalogueCutter
from chipload.planning.impeller import _clearance
from chipload.planning.impeller.axis_field import AxisField, axis_field, clear_field, pose
from chipload.planning.impeller.clearance import clearance
from chipload.planning.impeller.point_milling import point_path
from chipload.planning.impeller.profile import contact_band, profile_numbers, support
from chipload.planning.impeller.scallop_height import profile_scallops
from chipload.planning.impeller.scallop_width import reaches
from chipload.planning.impeller.scene import Scene


def tapered_ball(r, deg, top=25.0, **more):
    """A round tip of radius r in a cone of that half angle."""
    beta = math.radians(deg)
    return CatalogueCutter(2.0 * r * (1.0 - math.sin(beta)) / math.cos(beta), r, top, taper=beta, **more)


BALL = tapered_ball(2.0, 4.0)
BULL = CatalogueCutter(8.0, 2.0, 25.0, taper=math.radians(5.0))
OVAL = CatalogueCutter(12.0, 2.0, 28.0, barrel_radius=85.0)
CONE = CatalogueCutter(8.0, 1.5, 20.0, barrel_radius=250.0, taper=math.radians(12.0))
ALL = pytest.mark.parametrize("cutter", [BALL, BULL, OVAL, CONE], ids=["ball", "bull", "oval", "cone"])


def gaps(cutter, d, z, chord=1e-5):
    """Distances of points at d from the axis and z above the tip from the solid of the profile, laid out in chords."""
    p = cutter.shape.profile(chord)
    p = np.vstack([p, [0.0, p[-1, 1]]])
    a, b = p[:-1], p[1:]
    side, size = b - a, ((b - a) ** 2).sum(axis=1)
    q = np.stack([d, z], axis=-1)
    out = np.full(len(q), np.inf)
    for k in range(0, len(q), 500):
        x = q[k : k + 500, None] - a
        w = np.clip((x * side).sum(axis=-1) / size, 0.0, 1.0)
        out[k : k + 500] = np.sqrt(((x - w[..., None] * side) ** 2).sum(axis=-1)).min(axis=1)
    within = (z > 0.0) & (z < p[-1, 1]) & (d < cutter.shape.radius_at(np.maximum(z, 0.0)))
    return np.where(within, -out, out)


def away(points, tips, axes, cutter, parts):
    """Least distance of points from the cutting part in all poses and so many between every two."""
    share = np.linspace(0.0, 1.0, parts + 1)[:-1, None, None]
    p, A = (((1.0 - share) * x[:-1] + share * x[1:]).reshape(-1, 3) for x in (tips, axes))
    A = A / np.linalg.norm(A, axis=1)[:, None]
    out = np.full(len(points), np.inf)
    top, wide = cutter.cutting_length, 0.5 * cutter.top_diameter
    for tip, axis in zip(p, A, strict=True):
        y = points - tip
        z = y @ axis
        d = np.sqrt(np.maximum((y * y).sum(axis=1) - z * z, 0.0))
        near = np.flatnonzero((z > -0.3) & (z < top + 0.3) & (d < wide + 0.3))
        if len(near):
            out[near] = np.minimum(out[near], gaps(cutter, d[near], z[near], 1e-4))
    return out


@ALL
def test_the_distance_is_that_of_the_profile_in_chords(cutter):
    rng = np.random.default_rng(3)
    d, z = rng.uniform(0.0, 14.0, 4000), rng.uniform(-4.0, cutter.cutting_length, 4000)
    numbers, stages = profile_numbers(cutter), cutter.stages(0.0)[:1]
    got = np.array([_clearance.profile_distance(b, a, numbers, stages) for a, b in zip(d, z, strict=True)])
    want = gaps(cutter, d, z)
    out = want > 0.0
    # a point that is nearest to the rim of the top is looked at as if the flank went on
    rim = z > cutter.cutting_length - np.maximum(d - 0.5 * cutter.top_diameter, 0.0) * 0.35
    assert np.abs(got - want)[out & ~rim].max() < 2e-5
    assert (got[out] <= want[out] + 2e-5).all()
    near = ~out & (want > -0.5) & (z < cutter.cutting_length - 1.0)
    assert np.abs(got - want)[near].max() < 2e-5
    assert (got[~out] <= 1e-5).all()


@ALL
def test_the_clearance_of_the_whole_cutter_is_that_of_every_point(cutter):
    rng = np.random.default_rng(5)
    points = rng.uniform(-40.0, 40.0, (60, 3))
    whole = CatalogueCutter(
        cutter.diameter, cutter.corner_radius, cutter.cutting_length, shank_diameter=16.0, reach=45.0,
        holder_diameter=30.0, taper=cutter.taper, barrel_radius=cutter.barrel_radius,
    )  # fmt: skip
    scene = Scene(points[:1], [[0.0, 0, 1]], np.zeros((1, 3, 3)), [0], points, np.zeros(60, int), 0.0)
    axes = rng.normal(size=(150, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    tips = rng.uniform(-40.0, 40.0, (150, 3))
    got, _ = clearance(scene, whole, tips, axes, 5.0, above=0.5)
    seen = 0
    for k in range(150):
        x = points - tips[k]
        z = x @ axes[k]
        d = np.sqrt(np.maximum((x * x).sum(axis=1) - z * z, 0.0))
        every = gaps(cutter, d, z, 1e-4)
        for low, high, R in ((cutter.cutting_length, 45.0, 8.5), (45.0, np.inf, 15.5)):
            every = np.minimum(every, np.hypot(np.maximum(d - R, 0.0), np.maximum(np.maximum(low - z, z - high), 0.0)))
        if every.min() > 1e-3:
            # beside the rim of the top it may be less
            assert got[k] <= min(every.min(), 5.0) + 1e-4
            assert got[k] >= min(every.min(), 5.0) - 0.3
            seen += every.min() < 5.0
        else:
            assert got[k] <= 1e-3
    assert seen > 20


@ALL
def test_the_contact_is_on_the_arc_and_touches_the_plane(cutter):
    low, high = contact_band(cutter, 0.1)
    for n in (low + 1e-9, 0.5 * (low + high), high - 1e-9):
        T = np.array([[math.sqrt(1.0 - n * n), 0.0, n]])
        N = np.array([[0.0, 0.0, 1.0]])
        (tip,) = pose(np.zeros((1, 3)), N, T, cutter)
        # the whole profile lies above the plane and touches it in the origin
        p = cutter.shape.profile(1e-6)
        lowest = tip + p[:, :1] * np.array([-n, 0.0, T[0, 0]]) * -1.0 + p[:, 1:] * T[0]
        other = tip + p[:, :1] * np.array([-n, 0.0, T[0, 0]]) + p[:, 1:] * T[0]
        both = np.vstack([lowest, other])
        k = both[:, 2].argmin()
        assert both[k, 2] == pytest.approx(0.0, abs=2e-6)
        assert np.abs(both[k, :2]).max() < 0.03


@ALL
def test_the_support_is_that_of_the_profile(cutter):
    low, high = contact_band(cutter, 0.1)
    n = 0.5 * (low + high)
    T, N = np.array([math.sqrt(1.0 - n * n), 0.0, n]), np.array([0.0, 0.0, 1.0])
    V = (N - n * T) / math.sqrt(1.0 - n * n)
    (tip,) = pose(np.zeros((1, 3)), N[None], T[None], cutter)
    p = cutter.shape.profile(1e-6)
    rng = np.random.default_rng(11)
    seen = 0
    for u in rng.normal(size=(200, 3)):
        u /= np.linalg.norm(u)
        H = support(cutter, *(np.array(x) for x in (u @ N, u @ V, u @ T)))
        # the disc of the profile at each height
        want = u @ tip + (p[:, 1] * (u @ T) + p[:, 0] * math.sqrt(max(1.0 - (u @ T) ** 2, 0.0))).max()
        if u @ T < 0.0:
            assert float(H) == pytest.approx(want, abs=1e-5)
            seen += 1
    assert seen > 50


def lines_on(surface, lean, cutter, y):
    """Tips and axes of two lines along x of a plane at these y, 0.1 mm apart, the axis leaned along y."""
    x = np.arange(-4.0, 4.01, 0.1)
    T = np.tile([0.0, math.sin(lean), math.cos(lean)], (len(x), 1))
    N = np.tile([0.0, 0.0, 1.0], (len(x), 1))
    S = [np.stack([x, 0.0 * x + one, 0.0 * x], axis=-1) for one in y]
    return x, tuple(pose(s, N, T, cutter) for s in S), (T, T)


def crest_of(cutter, lean, w):
    """Scallop height in the middle of two lines on a plane, w apart."""
    x, tips, axes = lines_on(None, lean, cutter, (0.0, w))
    share = (np.arange(15) + 0.5) / 15
    points = np.stack(np.broadcast_arrays(x[:, None], share * w, 0.0), axis=-1)
    normals = np.broadcast_to([0.0, 0.0, 1.0], points.shape)
    return profile_scallops(points, normals, tips, axes, cutter)[len(x) // 2]


def test_scallops_on_a_plane_in_closed_form():
    # on the ball of a tapered one as on any ball
    assert crest_of(BALL, 0.6, 1.0) == pytest.approx(2.0 - math.sqrt(4.0 - 0.25), abs=1e-5)
    # the same on the flank arc of a barrel, whose axis leans across the lines
    assert crest_of(OVAL, math.radians(80.0), 3.0) == pytest.approx(85.0 - math.sqrt(85.0**2 - 1.5**2), abs=1e-5)
    # lines so far apart that the cone meets the ball of the next line: it is at 6 deg over the plane
    phi, w = math.radians(6.0), 1.4
    y = np.linspace(0.0, w, 200_001)
    line = 2.0 + (y * math.sin(phi) - 2.0) / math.cos(phi)
    cone = np.where(y < 2.0 * math.sin(phi), 2.0 - np.sqrt(4.0 - np.minimum(y, 2.0) ** 2), line)
    back = 2.0 - np.sqrt(np.maximum(4.0 - (w - y) ** 2, 0.0))
    want = np.minimum(cone, back).max()
    # along the normal by one secant: rather too high
    assert want - 1e-4 <= crest_of(BALL, math.radians(80.0), w) <= 1.03 * want
    assert want < 0.65 * (2.0 - math.sqrt(4.0 - 0.49))


def turned_lines(cutter, lean, centre, delta, sphere, inside=True):
    """Scallop of two lines round an axis z in a hollow cylinder or sphere of the radius ``centre``, delta apart.

    On a cylinder along its axis, on a sphere along circles of latitude; the axis leans across the lines.
    """
    s = np.arange(-4.0, 4.01, 0.1)
    sign = -1.0 if inside else 1.0
    share = (np.arange(15) + 0.5) / 15

    def at(a, s):
        if sphere:
            phi = s / centre
            N = np.stack([np.cos(a) * np.cos(phi), np.cos(a) * np.sin(phi), np.sin(a) + 0.0 * phi], axis=-1)
            e = np.stack([-np.sin(a) * np.cos(phi), -np.sin(a) * np.sin(phi), np.cos(a) + 0.0 * phi], axis=-1)
            return centre * N, sign * N, e
        a, s = np.broadcast_arrays(a, s)
        N = np.stack([np.cos(a), np.sin(a), 0.0 * a], axis=-1)
        e = np.stack([-np.sin(a), np.cos(a), 0.0 * a], axis=-1)
        return centre * N + s[..., None] * np.array([0.0, 0.0, 1.0]), sign * N, e

    tips, axes = [], []
    for a in (-0.5 * delta, 0.5 * delta):
        S, N, e = at(np.full(len(s), a), s)
        T = math.cos(lean) * N + math.sin(lean) * e
        tips.append(pose(S, N, T, cutter))
        axes.append(T)
    S, N, _ = at(-0.5 * delta + share * delta, s[:, None])
    return profile_scallops(S, N, tuple(tips), tuple(axes), cutter)[len(s) // 2]


@pytest.mark.parametrize("sphere", [False, True], ids=["cylinder", "sphere"])
@pytest.mark.parametrize(
    ("cutter", "lean", "radius", "centre", "delta"),
    [(BALL, 0.6, 2.0, 30.0, 0.04), (OVAL, math.radians(80.0), 85.0, 150.0, 0.03)],
    ids=["tapered", "barrel"],
)
def test_scallops_in_a_hollow_in_closed_form(cutter, lean, radius, centre, delta, sphere):
    """Two circles of the arc's radius that touch the one of the hollow from inside meet half-way."""
    off = centre - radius
    c, s = math.cos(0.5 * delta), math.sin(0.5 * delta)
    want = centre - off * c - math.sqrt(radius**2 - (off * s) ** 2)
    assert turned_lines(cutter, lean, centre, delta, sphere) == pytest.approx(want, rel=1e-3, abs=1e-6)


@pytest.mark.parametrize(("cutter", "lean"), [(BALL, 0.6), (BULL, 0.4), (OVAL, math.radians(80.0))])
def test_the_reach_of_a_pass_is_where_its_profile_is_as_high(cutter, lean):
    """Seen along the pass the profile is the outline of all of its discs; the axis leans across the pass."""
    h = 0.06
    T, N, d = (np.array([x]) for x in ([0.0, math.sin(lean), math.cos(lean)], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))
    r, e, _ = cutter.contact_arc
    ahead, behind = reaches(N, T, d, np.zeros((1, 3, 3)), e, r, h, cutter)
    (tip,) = pose(np.zeros((1, 3)), N, T, cutter)
    p = cutter.shape.profile(1e-6)
    lateral = np.array([0.0, -math.cos(lean), math.sin(lean)])
    outline = np.concatenate([tip + sign * p[:, :1] * lateral + p[:, 1:] * T[0] for sign in (-1.0, 1.0)])
    low = outline[outline[:, 2] <= h]
    assert float(ahead[0]) == pytest.approx(low[:, 1].max(), rel=0.01)
    assert float(behind[0]) == pytest.approx(-low[:, 1].min(), rel=0.01)


@pytest.mark.parametrize("corner", [3.0, 1.5], ids=["ball", "bull"])
def test_without_taper_the_path_is_that_of_the_straight_cutter(corner):
    straight, limit = CatalogueCutter(6.0, corner, 25.0), CatalogueCutter(6.0, corner, 25.0, taper=1e-8)
    surface, paths = hollow(), []
    field = None
    for cutter in (straight, limit):
        # of a ball many fields are equally good
        if field is None or corner < 3.0:
            field = clear_field(surface, WHOLE, scene_of(surface, fence(25.0)), cutter, REACHABLE, LIMITS)
        paths.append(point_path(surface, "u", WHOLE, field, cutter, 0.1, 0.01))
    assert paths[1].length == pytest.approx(paths[0].length, rel=1e-5)
    if corner < 3.0:
        # on the ball the narrowest step may as well be at the other border
        assert paths[1].tip == pytest.approx(paths[0].tip, abs=1e-4)
        assert paths[1].axis == pytest.approx(paths[0].axis, abs=1e-6)
    assert paths[1].lines == paths[0].lines


@pytest.mark.parametrize(("cutter", "along"), [(BALL, "u"), (BULL, "v"), (OVAL, "u")], ids=["ball", "bull", "oval"])
def test_nothing_is_left_above_the_scallop_and_nothing_gouges(cutter, along):
    surface, h = hollow(), 0.15
    walls = [] if cutter is OVAL else [fence(25.0)]
    field = clear_field(surface, WHOLE, scene_of(surface, *walls), cutter, REACHABLE, LIMITS)
    assert isinstance(field, AxisField)
    path = point_path(surface, along, WHOLE, field, cutter, h, 0.005)
    # a barrel leaves the corners of a surface on which its lines do not run on
    edge = 0.15 if cutter is OVAL else 0.04
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(edge, 1 - edge, 17), np.linspace(0.01, 0.99, 61), indexing="ij"))
    own = away(surface.at(u, v), path.tip, path.axis, cutter, 4)
    assert own.min() > -0.01
    assert own.max() <= h
    for one in walls:
        wall = one.at(*(x.ravel() for x in np.meshgrid(np.linspace(0, 1, 40), np.linspace(0, 1, 30))))
        assert away(wall, path.tip, path.axis, cutter, 2).min() > -0.01
    # contacts stay on their arc
    n = (path.normal * path.axis).sum(axis=1)
    low, high = contact_band(cutter, 0.5 * LIMITS.lean, chosen=False)
    assert low <= n.min() <= n.max() <= high


def test_a_barrel_takes_fewer_lines_than_the_ball_of_its_tip():
    """On a plane, the axis across the lines: as the roots of the radii."""
    h, lean = 0.05, math.radians(80.0)
    T = np.array([0.0, math.sin(lean), math.cos(lean)])
    nodes = np.tile(T, (2, 2, 1))
    field = AxisField(np.array([0.0, 1.0]), np.array([0.0, 1.0]), nodes, np.ones((2, 2, 2)))
    path = point_path(plane(), "u", WHOLE, field, OVAL, h, 0.005)
    y = np.array([path.at[path.line == k, 1].mean() * 20.0 for k in range(path.lines)])
    most = 2.0 * math.sqrt(2.0 * h * 85.0 - h * h)
    assert len(y) == math.ceil((y[-1] - y[0]) / (most * math.sqrt(0.95))) + 1
    assert np.diff(y).max() <= most
    ball = point_path(plane(), "u", WHOLE, upright(plane(), 0.4), CatalogueCutter(4.0, 2.0), h, 0.005)
    assert path.lines < ball.lines / 4


def test_a_barrel_that_does_not_fit_a_hollow_is_said():
    surface = hollow(8.0, 1.0)
    found = axis_field(surface, WHOLE, (5, 5), scene_of(surface), CONE, REACHABLE, LIMITS)
    assert isinstance(found, float)
    assert found < 1.0
