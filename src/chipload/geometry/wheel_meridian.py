"""Meridional shape of a bladed wheel that is a closed mesh: its hub, and the surface on which its blades end.

Notation: z is the axis of rotation; r, z [mm] of a point. The **core** is what is solid all round the axis, the
**channel** what is solid in part: the blades swept round the axis. The channel has the hub as its edge on the core; its
other edges are those of the leading edges, of the tips and of the trailing edges, with a corner between them.

The core is the intersection of the sections by half-planes through the axis. The channel is the union of the triangles,
turned into one half-plane, less the core.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from chipload.geometry.mesh import sections
from chipload.lazy import scipy, trimesh

Floats = NDArray[np.float64]

#: planes through the axis, each two half-planes; their angles go on by the golden section, so they meet no pattern
PLANES = 24
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)
#: share of the radius of the wheel that is a detail; how many details thick a channel is at least
FINE, FILM = 1e-3, 5.0
#: length of the corner of a square over that of its sides, and a little more: sharper corners are cut off
SQUARE = 1.5
#: places round the outline of the channel
PLACES = 800
#: least share of the outline that is the hub, and of the edges that are not which is the tips
LEAST_HUB, LEAST_TIPS = 0.15, 0.3
#: share of a line over which a corner turns, and by which angle [rad] at least
CORNER, SHARP = 0.02, 0.5
#: share of the length of a line by which it leaves a straight one
STRAIGHT = 2e-3
#: points of a curve; its ends are continued straight by this share of its length
COUNT, BEYOND = 1201, 0.5
#: spans of the curve that is fitted to the hub
SPANS = 24
#: a vertex belongs to the hub where its normal leaves the meridional plane by less than this sine
ROUND = 0.05


@dataclass(frozen=True, eq=False)
class Curve:
    """A meridional curve whose ends go on straight, with the signed distance of points from it.

    Parameters
    ----------
    points : (n, 2) float [mm] r and z, at equal distances
    side : 1: distances are positive to the left of the curve in the (r, z) plane, -1: to its right
    beyond : (2, 2) float, unit vectors in which the first and the last end go on
    """

    points: Floats
    side: int
    beyond: Floats
    _tree: scipy.spatial.cKDTree = field(init=False, repr=False)
    _long: Floats = field(init=False, repr=False)
    _normal: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        p = self.points
        step = float(np.linalg.norm(np.diff(p, axis=0), axis=1).mean())
        far = np.arange(1, int(BEYOND * len(p)))[:, None] * step
        whole = np.concatenate([(p[0] + far * self.beyond[0])[::-1], p, p[-1] + far * self.beyond[1]])
        along = np.gradient(whole, axis=0)
        normal = self.side * np.stack([-along[:, 1], along[:, 0]], axis=-1)
        object.__setattr__(self, "_long", whole)
        object.__setattr__(self, "_normal", normal / np.linalg.norm(normal, axis=1)[:, None])
        object.__setattr__(self, "_tree", scipy.spatial.cKDTree(whole))

    def away(self, rz: Floats) -> Floats:
        """Signed distances (k,) [mm] of points (k, 2)."""
        return self.locate(rz)[0]

    def locate(self, rz: Floats) -> tuple[Floats, Floats]:
        """Signed distances (k,) [mm] of points (k, 2), and their places (k,) along the curve, within it 0 to 1."""
        far, which = self._tree.query(rz)
        out: Floats = ((rz - self._long[which]) * self._normal[which]).sum(axis=1)
        before = (len(self._long) - len(self.points)) // 2
        # where the curve has a corner, the nearest point is its point
        step = np.linalg.norm(self._long[1] - self._long[0])
        corner = far**2 - out**2 > step * step
        out = np.where(corner, np.copysign(far, out), out)
        return out, (which - before) / (len(self.points) - 1.0)


@dataclass(frozen=True, eq=False)
class WheelMeridian:
    """The channel of a wheel between its hub and its shroud.

    Parameters
    ----------
    hub, shroud : from the same end of the channel; distances are positive in the channel
    channel : outline of the blades swept round the axis, in the (r, z) plane
    fine : [mm] details of the outline that are left out
    hub_off : [mm] greatest distance of a vertex of the hub from its curve
    closed : whether the blades end on a second surface of revolution of the wheel
    """

    hub: Curve
    shroud: Curve
    channel: Polygon
    fine: float
    hub_off: float
    closed: bool = False

    def height(self, points: Floats) -> Floats:
        """Height (k,) of points (k, 3) between hub, 0, and shroud, 1, by the distances from both; below the hub < 0."""
        rz = meridional(points)
        low, high = self.hub.away(rz), self.shroud.away(rz)
        total = np.abs(low) + np.abs(high)
        return np.asarray(low / np.where(total > 0.0, total, 1.0))


def meridional(points: Floats) -> Floats:
    """(k, 2) r and z of points (k, 3)."""
    return np.stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]], axis=-1)


def wheel_meridian(mesh: trimesh.Trimesh) -> WheelMeridian | None:
    """The channel of a wheel; None where the mesh is solid all round the axis, or its channel has no hub or no tips.

    Parameters
    ----------
    mesh : closed, in mm, z along the axis of rotation
    """
    p = np.asarray(mesh.vertices, dtype=np.float64)
    fine = FINE * float(np.hypot(p[:, 0], p[:, 1]).max())
    core = _core(mesh)
    if core.area < fine * fine:
        return None
    channel = _channel(mesh, core, fine)
    if channel.area < (20.0 * fine) ** 2:
        return None
    ring = np.array(channel.exterior.segmentize(channel.exterior.length / PLACES).coords)[:-1]
    on_core = shapely.distance(core, shapely.points(ring)) < 2.0 * fine
    runs = [run for run in _runs(on_core, len(ring) // 50) if len(run) > LEAST_HUB * len(ring)]
    if not 1 <= len(runs) <= 2:
        return None
    if len(runs) == 2:
        inner, outer = sorted(runs, key=lambda run: float(ring[run, 0].mean()))
        rough, shroud = _even(ring[inner]), _even(ring[outer][::-1])
    else:
        run = _smooth(ring, runs[0])
        rest = np.arange(run[-1], run[-1] + len(ring) - len(run) + 2) % len(ring)
        rough, tips = _even(ring[run]), _tips(ring[rest][::-1])
        if tips is None:
            return None
        shroud = tips
    side = _side_of(rough, channel)
    beyond = _beyond(rough, shroud)
    hub, off = _fit_hub(mesh, Curve(rough, side, beyond), fine)
    end = Curve(shroud, _side_of(shroud, channel), beyond)
    return WheelMeridian(Curve(hub, side, beyond), end, channel, fine, off, len(runs) == 2)


# -- parts ------------------------------------------------------------------------------------------------------
def _core(mesh: trimesh.Trimesh) -> shapely.Geometry:
    """What is solid all round the axis, in the (r, z) plane."""
    p = np.asarray(mesh.vertices, dtype=np.float64)
    half = shapely.box(0.0, p[:, 2].min() - 1.0, 2.0 * np.abs(p).max() + 1.0, p[:, 2].max() + 1.0)
    core: shapely.Geometry = half
    for k in range(PLANES):
        angle = np.pi * (0.1234 + k * _GOLDEN % 1.0)
        c, s = np.cos(angle), np.sin(angle)
        turned = mesh.copy()
        turned.vertices = np.stack([p[:, 0] * c + p[:, 1] * s, p[:, 2], p[:, 0] * s - p[:, 1] * c], axis=-1)
        cut = sections(turned, [0.0])[0]
        mirrored = shapely.transform(cut, lambda q: q * np.array([-1.0, 1.0]))
        for shape in (cut, mirrored):
            core = shapely.intersection(core, shapely.make_valid(shape))
        if core.is_empty:
            return core
    return core


def _channel(mesh: trimesh.Trimesh, core: shapely.Geometry, fine: float) -> Polygon:
    """The largest part of what is solid in part, without what is thinner than ``fine`` on both sides."""
    rz = meridional(np.asarray(mesh.vertices, dtype=np.float64))
    faces = np.asarray(mesh.faces)
    near = core.buffer(fine)
    shapely.prepare(near)
    outside = ~shapely.contains_xy(near, rz[:, 0], rz[:, 1])
    # a third of the wheel has all that three equal blades or more have
    theta = np.arctan2(*np.asarray(mesh.vertices)[:, 1::-1].T)
    third = np.abs(theta) < np.pi / 3.0
    kept = rz[faces[outside[faces].any(axis=1) & third[faces].any(axis=1)]]
    a, b = kept[:, 1] - kept[:, 0], kept[:, 2] - kept[:, 0]
    flat = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) < 1e-3 * fine * fine
    shapes = shapely.polygons(kept[~flat])
    # slits between triangles are closed first; corners of edges and tips stay sharp
    whole = shapely.union_all(shapes).buffer(fine, join_style="mitre", mitre_limit=SQUARE)
    whole = whole.buffer(-fine, join_style="mitre", mitre_limit=SQUARE).difference(core)
    around = whole.buffer(-FILM * fine).buffer(FILM * fine, join_style="mitre", mitre_limit=SQUARE)
    parts = [q for q in shapely.get_parts(around) if isinstance(q, Polygon)]
    return max(parts, key=lambda q: float(q.area), default=Polygon())


def _runs(flag: NDArray[np.bool_], bridge: int) -> list[NDArray[np.intp]]:
    """The runs of places of a ring where a flag holds, in their order; gaps of up to ``bridge`` places are closed."""
    n = len(flag)
    if flag.all() or not flag.any():
        return [np.arange(n)] if flag.all() else []
    begin = int(np.flatnonzero(flag & ~np.roll(flag, 1))[0])
    order = (np.arange(n) + begin) % n
    flagged = np.flatnonzero(flag[order])
    cuts = np.flatnonzero(np.diff(flagged) > bridge + 1) + 1
    parts = [np.arange(part[0], part[-1] + 1) for part in np.split(flagged, cuts)]
    if len(parts) > 1 and n - parts[-1][-1] - 1 <= bridge:
        parts[0] = np.arange(parts[-1][0] - n, parts[0][-1] + 1)
        parts.pop()
    return [order[part % n] for part in parts]


def _smooth(ring: Floats, run: NDArray[np.intp]) -> NDArray[np.intp]:
    """The longest part of a run without a corner: a flat nose beside the hub is none of it."""
    w = max(len(run) // 50, 2)
    turn = _turns(ring[run], w)
    peaks = [k for k in range(w, len(run) - w) if turn[k] > SHARP and turn[k] == turn[k - w : k + w + 1].max()]
    ends = [0, *peaks, len(run) - 1]
    a, b = max(itertools.pairwise(ends), key=lambda e: e[1] - e[0])
    return run[a : b + 1]


def _even(points: Floats, count: int = COUNT) -> Floats:
    """``count`` points (count, 2) at equal distances along a polyline."""
    at = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()])
    places = np.linspace(0.0, at[-1], count)
    return np.stack([np.interp(places, at, x) for x in points.T], axis=-1)


def _tips(free: Floats) -> Floats | None:
    """The tips among the edges beside the hub: between the two corners that turn most; None: there are none.

    Where the tips go smoothly on into an edge, that edge ends where it leaves its straight line.
    """
    line = _even(free)
    w = max(int(CORNER * COUNT), 2)
    turn = _turns(line, w)
    peaks = [k for k in range(w, COUNT - w) if turn[k] > SHARP and turn[k] == turn[k - w : k + w + 1].max()]
    corners = [(turn[i] + turn[j], i, j) for i in peaks for j in peaks if j - i > LEAST_TIPS * COUNT]
    if corners:
        _, i, j = max(corners)
    else:
        first, last = _straight(line), COUNT - 1 - _straight(line[::-1])
        i = next((k for k in peaks if k <= first + w), first)
        j = next((k for k in peaks[::-1] if k >= last - w), last)
    if j - i <= LEAST_TIPS * COUNT:
        return None
    return _even(line[i : j + 1])


def _turns(line: Floats, w: int) -> Floats:
    """Angle (n,) [rad] by which a polyline turns between the chords over ``w`` places before and behind each."""
    out = np.zeros(len(line))
    a, b = line[w:-w] - line[: -2 * w], line[2 * w :] - line[w:-w]
    out[w:-w] = np.abs(np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1)))
    return out


def _straight(line: Floats) -> int:
    """The place at which a polyline of equal steps leaves the straight line that it begins with."""
    n, begin = len(line), len(line) // 50
    step = float(np.linalg.norm(line[1] - line[0]))
    for k in range(3 * begin, n):
        d = (line[k] - line[begin]) / np.linalg.norm(line[k] - line[begin])
        off = line[begin:k] - line[begin]
        if np.abs(off[:, 0] * d[1] - off[:, 1] * d[0]).max() > STRAIGHT * n * step:
            return k
    return n - 1


def _beyond(hub: Floats, shroud: Floats) -> Floats:
    """Unit vectors (2, 2) across the lines between the first and the last ends of hub and shroud, out of the channel.

    Both curves go on in them, so that the surfaces between them reach the edges of the blades evenly.
    """
    out = []
    for end, inner in ((0, len(hub) // 4), (-1, -len(hub) // 4)):
        across = shroud[end] - hub[end]
        normal = np.array([-across[1], across[0]]) / np.linalg.norm(across)
        outward = 0.5 * (hub[end] + shroud[end] - hub[inner] - shroud[inner])
        out.append(normal * np.copysign(1.0, float(normal @ outward)))
    return np.array(out)


def _side_of(curve: Floats, channel: Polygon) -> int:
    """On which side of a curve the channel lies: 1 left, -1 right."""
    p, d = curve[len(curve) // 2], curve[len(curve) // 2 + 1] - curve[len(curve) // 2 - 1]
    left = p + 0.02 * np.sqrt(channel.area) * np.array([-d[1], d[0]]) / np.linalg.norm(d)
    return 1 if channel.contains(shapely.Point(left)) else -1


def _fit_hub(mesh: trimesh.Trimesh, curve: Curve, fine: float) -> tuple[Floats, float]:
    """The hub (n, 2) through its vertices, whose normals lie in the meridional plane, and their greatest distance.

    Where the mesh has no such vertices, the rough curve stands for them.
    """
    p = np.asarray(mesh.vertices, dtype=np.float64)
    rz = meridional(p)
    r = np.maximum(rz[:, 0], fine)
    around = np.abs(mesh.vertex_normals[:, 1] * p[:, 0] - mesh.vertex_normals[:, 0] * p[:, 1]) / r
    rough, side = curve.points, curve.side
    off, place = curve.locate(rz)
    own = (np.abs(off) < 2.0 * fine) & (around < ROUND) & (place >= 0.0) & (place <= 1.0)
    at, off_hub = place[own], off[own]
    x = np.linspace(0.0, 1.0, 4 * SPANS + 1)
    bare = np.array([not (np.abs(at - t) < 1.0 / (4 * SPANS)).any() for t in x])
    at, off_hub = np.concatenate([at, x[bare]]), np.concatenate([off_hub, np.zeros(bare.sum())])
    order = np.argsort(at, kind="stable")
    at, off_hub = at[order], off_hub[order]
    knots = np.concatenate([np.zeros(4), np.linspace(0.0, 1.0, SPANS + 1)[1:-1], np.ones(4)])
    for _ in range(3):
        spline = scipy.interpolate.make_lsq_spline(at, off_hub, knots, k=3)
        apart = np.abs(off_hub - spline(at))
        fits = apart <= max(4.0 * float(np.median(apart)), 1e-4 * fine)
        if fits.all():
            break
        # feet of blades whose vertices have mean normals
        at, off_hub = _drop_outliers(at, off_hub, fits, x)
    s = np.linspace(0.0, 1.0, COUNT)
    along = np.gradient(rough, axis=0)
    normal = side * np.stack([-along[:, 1], along[:, 0]], axis=-1)
    hub = rough + spline(s)[:, None] * normal / np.linalg.norm(normal, axis=1)[:, None]
    return _even(hub), float(np.abs(off_hub - spline(at)).max())


def _drop_outliers(at: Floats, off_hub: Floats, fits: NDArray[np.bool_], x: Floats) -> tuple[Floats, Floats]:
    """Places and distances that fit, but all of those where none else is near."""
    lonely = np.array([not (np.abs(at[fits] - t) < x[1]).any() for t in at])
    keep = fits | lonely
    return at[keep], off_hub[keep]
