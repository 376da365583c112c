"""A side of a blade from faces of a STEP part that are not one four-sided face: several faces, or one of any outline.

Notation: the axis is z after a rotation R of the file's frame; r, z [mm] of a point are its meridional place, theta its
angle. The outlines of the faces, put together in (r, z) and cut off at hub and shroud, are the region of the side. Its
four edges lie on the hub, on the shroud, and between them; blended by shares of length they give a grid of rulings from
hub to tip. At each place of the grid the point of the faces is found, and a patch goes through the points; the grid is
made finer until the patch keeps within the tolerance between them.

Limits: round the axis the side is met once at each place. The deviation is measured at the middles of the grid.

Reference: [Piegl1997] ch. 9, 10.6 (blended boundaries).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch, through
from chipload.geometry.revolve import Revolved
from chipload.geometry.step import Part
from chipload.geometry.step_faces import Face, kernel_face

Floats = NDArray[np.float64]

#: points of a grid that is fitted, along each edge
COUNTS = (17, 33, 65, 129)
#: faces of one side meet within this [mm]
JOIN = 0.02
#: how far an edge of the region may be from hub or shroud [mm], tried one after the other
REACHED = (0.01, 0.03, 0.1, 0.3, 0.8)
#: a tip within this of the shroud is taken as it is [mm]
BESIDE = 0.7
#: a place of the grid is met by a face within this [mm]: at the edges of the side
MET = 0.1
_SAMPLES, _CURVE, _NEWTON = 81, 401, 12


@dataclass(frozen=True, eq=False)
class SampledSide:
    """A side through sampled points.

    Parameters
    ----------
    patch : v from hub to shroud, normal out of the metal where the part is a solid
    faces : their numbers
    off : how far it leaves the surfaces of the faces [mm], at ``looked`` points
    edge : how far it goes beyond the edges of the faces [mm]
    """

    patch: BSplinePatch
    faces: tuple[int, ...]
    off: float
    looked: int
    edge: float

    def __str__(self) -> str:
        n, m = self.patch.control.shape[:2]
        names = f"face {self.faces[0]}" if len(self.faces) == 1 else f"faces {', '.join(map(str, self.faces))}"
        return (
            f"{names}: sampled along rulings from hub to shroud by {n} x {m} poles, within {self.off:.2g} mm of the "
            f"faces at {self.looked} points, its edges within {self.edge:.2g} mm of theirs"
        )


@dataclass(frozen=True, eq=False)
class _Trimmed:
    """A face as a patch over its box, turned; its outline (n, 2) of u and v; samples: u, v (k, 2) and r, z (k, 2)."""

    patch: BSplinePatch
    outline: Any
    uv: Floats
    tree: cKDTree


def side_of(faces: Sequence[Face], key: str, fit: float, R: Floats, hub: Revolved, shroud: Revolved) -> SampledSide:
    """The side that faces make together between hub and shroud.

    Parameters
    ----------
    key : who asks, for a message
    fit : how far [mm] the side may leave the faces
    R : (3, 3) rotation from the frame of the file to that whose axis is z

    Raises
    ------
    InputError
        A face has a hole, they do not meet, do not reach hub or shroud, or the fit leaves them by more.
    """
    numbers = tuple(f.number for f in faces)
    names = f"face {numbers[0]}" if len(numbers) == 1 else f"faces {', '.join(map(str, numbers))}"
    parts, rest = [], 0.0
    for face in faces:
        ku, kv, control, side, off, loop = face.part.call("step_side.trimmed", face.number, key)
        parts.append(_trimmed(BSplinePatch(ku, kv, control @ R.T, side), loop))
        rest = max(rest, off)
    edges = _edges(_region(parts, hub, shroud, key, names), hub, shroud, key, names)
    best, looked = np.inf, 0
    for count in COUNTS:
        x = np.linspace(0.0, 1.0, count)
        grid, sense, edge = _met(parts, _blended(edges, x), key, names)
        patch = through(grid.reshape(count, count, 3), x, x)
        # a normal of the faces tells which side is the metal's
        at = patch.normal(0.5, 0.5)[0]
        if at @ sense[len(sense) // 2] < 0.0:
            patch = through(grid.reshape(count, count, 3), x, x, side=-1)
        middle = np.linspace(0.0, 1.0, 2 * count - 1)
        U, V = (q.ravel() for q in np.meshgrid(middle, middle, indexing="ij"))
        made = patch.at(U, V)
        true, _, _ = _met(parts, np.stack([np.hypot(made[:, 0], made[:, 1]), made[:, 2]], axis=-1), key, names)
        off = rest + float(np.linalg.norm(true - made, axis=1).max())
        looked = len(made)
        best = min(best, off)
        if off <= fit:
            return SampledSide(patch, numbers, off, looked, edge)
    raise InputError(
        f"{key}: {names}: a patch along rulings from hub to shroud deviates by {best:.4g} mm: must be at most "
        f"fit_mm = {fit:g}: raise it, or export the side in smooth faces"
    )


def _trimmed(patch: BSplinePatch, loop: Floats) -> _Trimmed:
    import shapely

    outline = shapely.Polygon(loop).buffer(0.0)
    x = np.linspace(0.0, 1.0, _SAMPLES)
    U, V = (q.ravel() for q in np.meshgrid(x, x, indexing="ij"))
    within = shapely.contains_xy(outline.buffer(1e-9), U, V)
    uv = np.concatenate([np.stack([U, V], axis=-1)[within], np.clip(loop, 0.0, 1.0)])
    return _Trimmed(patch, outline, uv, cKDTree(_meridional(patch.at(*uv.T))))


def _meridional(p: Floats) -> Floats:
    return np.stack([np.hypot(p[:, 0], p[:, 1]), p[:, 2]], axis=-1)


def _region(parts: Sequence[_Trimmed], hub: Revolved, shroud: Revolved, key: str, names: str) -> Any:
    """The region of the side in (r, z) between hub and shroud."""
    import shapely

    rings = []
    for part in parts:
        loop = np.clip(np.array(part.outline.exterior.coords), 0.0, 1.0)
        rings.append(shapely.Polygon(_meridional(part.patch.at(*loop.T))).buffer(0.0).buffer(JOIN))
    whole = shapely.union_all(rings).buffer(-JOIN)
    if whole.geom_type != "Polygon":
        raise InputError(f"{key}: {names}: do not meet within {JOIN:g} mm: state the faces between them")
    s = np.linspace(0.0, 1.0, _CURVE)
    band = shapely.Polygon(np.concatenate([hub.curve(s), shroud.curve(s)[::-1]])).buffer(0.0)
    # a tip that keeps near the shroud is the edge itself; one that goes beyond it is cut off there
    line = shapely.LineString(shroud.curve(s))
    wider = band.union(line.buffer(BESIDE))
    if whole.difference(wider).intersection(line.buffer(1.1 * BESIDE)).area < BESIDE**2:
        band = wider
    cut = whole.intersection(band)
    if cut.geom_type != "Polygon":
        cut = max(getattr(cut, "geoms", ()), key=lambda g: g.area, default=None)
    if cut is None or cut.area < 0.01 * whole.area:
        raise InputError(f"{key}: {names}: lie outside of hub and shroud: check hub, shroud and flow")
    return cut


def _edges(region: Any, hub: Revolved, shroud: Revolved, key: str, names: str) -> list[Floats]:
    """The edges of the region: on the hub, on the shroud, the one where hub and shroud begin, the other (n, 2)."""
    import shapely
    from shapely.ops import linemerge, substring

    ring = shapely.LineString(region.exterior.coords).segmentize(0.25)
    s = np.linspace(0.0, 1.0, _CURVE)
    spans = []
    for curve, what in ((hub, "hub"), (shroud, "shroud")):
        line = shapely.LineString(curve.curve(s))
        for off in REACHED:
            on = shapely.intersection(ring, line.buffer(off))
            on = linemerge(on) if on.geom_type == "MultiLineString" else on
            pieces = [g for g in getattr(on, "geoms", [on]) if g.geom_type == "LineString" and g.length > 0.0]
            ends = _joined(ring, pieces)
            if ends is not None and (ends[1] - ends[0]) % ring.length > 0.05 * line.length:
                break
        else:
            away = float(shapely.distance(ring, line))
            raise InputError(
                f"{key}: {names}: no edge along the {what}, nearest {away:.3g} mm: state all faces of the side, or "
                f"check {what}"
            )
        spans.append(ends)

    def chain(a: float, b: float) -> Floats:
        if b < a:
            first, last = substring(ring, a, ring.length), substring(ring, 0.0, b)
            points = np.concatenate([np.array(first.coords), np.array(last.coords)[1:]])
        else:
            points = np.array(substring(ring, a, b).coords)
        return points

    (h0, h1), (t0, t1) = spans
    if (t0 - h1) % ring.length > (h0 - h1) % ring.length:
        raise InputError(f"{key}: {names}: hub and shroud meet on it: check hub and shroud")
    low, right, high, left = chain(h0, h1), chain(h1, t0), chain(t0, t1), chain(t1, h0)
    return [low, right, high[::-1], left[::-1]]


def _joined(ring: Any, pieces: list[Any]) -> tuple[float, float] | None:
    """From where to where [mm] along a ring the longest of ``pieces`` goes, with those within a millimetre of it."""
    import shapely

    if not pieces:
        return None
    rows = []
    for piece in pieces:
        a, b, m = (ring.project(shapely.Point(piece.interpolate(q, normalized=True))) for q in (1e-6, 1.0 - 1e-6, 0.5))
        if (m - a) % ring.length > (b - a) % ring.length:
            a, b = b, a
        rows.append((a, (b - a) % ring.length))
    rows.sort()
    best = max(rows, key=lambda row: row[1])
    first, size = best
    grown = True
    while grown:
        grown = False
        for a, length in rows:
            gap = (a - (first + size)) % ring.length
            if 0.0 < gap < 1.0:
                size, grown = size + gap + length, True
            gap = (first - (a + length)) % ring.length
            if 0.0 < gap < 1.0:
                first, size, grown = a, size + gap + length, True
    return first % ring.length, (first + size) % ring.length


def _blended(edges: list[Floats], x: Floats) -> Floats:
    """(n n, 2) r and z of a grid: the four edges, each by shares of its length, blended."""
    low, right, high, left = (_by_length(e, x) for e in edges)
    a, b = (q[..., None] for q in np.meshgrid(x, x, indexing="ij"))
    plane = (1 - b) * ((1 - a) * low[0] + a * low[-1]) + b * ((1 - a) * high[0] + a * high[-1])
    out = (1 - b) * low[:, None] + b * high[:, None] + (1 - a) * left[None] + a * right[None] - plane
    return np.asarray(out.reshape(-1, 2), dtype=np.float64)


def _by_length(points: Floats, x: Floats) -> Floats:
    length = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()])
    return np.stack([np.interp(x * length[-1], length, points[:, k]) for k in (0, 1)], axis=-1)


def _met(parts: Sequence[_Trimmed], places: Floats, key: str, names: str) -> tuple[Floats, Floats, float]:
    """Points (n, 3) of the faces at places (n, 2) of r and z, their normals, how far off one is at most [mm]."""
    import shapely

    best = np.full(len(places), np.inf)
    points, normals = np.zeros((len(places), 3)), np.zeros((len(places), 3))
    for part in parts:
        uv = part.uv[part.tree.query(places)[1]]
        for _ in range(_NEWTON):
            p = part.patch.at(*uv.T)
            r = np.maximum(np.hypot(p[:, 0], p[:, 1]), 1e-9)
            off = places - np.stack([r, p[:, 2]], axis=-1)
            u, v = uv.T
            d = [part.patch.at(u, v, *x) for x in ((1, 0), (0, 1))]
            J = np.stack([np.stack([(q[:, :2] * p[:, :2]).sum(axis=1) / r, q[:, 2]], axis=-1) for q in d], axis=-1)
            step = np.einsum("kij,kj->ki", np.linalg.pinv(J), off)
            uv = np.clip(uv + np.clip(step, -0.2, 0.2), 0.0, 1.0)
        p = part.patch.at(*uv.T)
        u, v = uv.T
        size = np.linalg.norm(np.stack([part.patch.at(u, v, *x) for x in ((1, 0), (0, 1))]), axis=2).max(axis=0)
        beyond = shapely.distance(part.outline, shapely.points(uv)) * size
        away = np.linalg.norm(_meridional(p) - places, axis=1) + beyond
        nearer = away < best
        best[nearer], points[nearer], normals[nearer] = away[nearer], p[nearer], part.patch.normal(*uv[nearer].T)
    if best.max() > MET:
        r, z = places[int(best.argmax())]
        raise InputError(
            f"{key}: {names}: no face at r {r:.4g}, z {z:.4g} mm between hub and shroud; the nearest is "
            f"{best.max():.3g} mm away: "
            "state all faces of the side, or sections instead of faces"
        )
    return points, normals, float(best.max())


# -- in the process of the CAD kernel ---------------------------------------------------------------------------
def trimmed(part: Part, number: int, key: str) -> tuple[Floats, Floats, Floats, int, float, Floats]:
    """Knots, poles and side of a face over its box, how far they leave it, its outline (n, 2) in 0..1."""
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_REVERSED

    from chipload.geometry.step_patch import POLYNOMIAL, box_of, kept_of, loop_of, off_of, points_of

    face = kernel_face(part, number)
    if face.holes:
        raise InputError(f"{key}: face {number} has a hole: must be one piece without any")
    surface = BRep_Tool.Surface_s(face.shape)
    side = -1 if face.shape.Orientation() == TopAbs_REVERSED else 1
    loop = loop_of(face, surface)
    _, low, high = box_of(loop, surface)
    patch = kept_of(surface, low, high, side) if face.kind in POLYNOMIAL else None
    off = 0.0
    if patch is None:
        x = np.linspace(0.0, 1.0, 65)
        s, t = np.meshgrid(x, x, indexing="ij")
        patch = through(points_of(surface, low + np.stack([s, t], axis=-1) * (high - low)), x, x, side=side)
        off = off_of(patch, lambda s, t: low + np.stack([s, t], axis=-1) * (high - low), surface, 65)
    outline = np.concatenate([p.uv[:-1] for p in loop])
    return patch.knots_u, patch.knots_v, patch.control, patch.side, off, (outline - low) / (high - low)
