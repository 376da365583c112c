"""A side of a blade from several faces of a STEP part, or from one face that is not four-sided.

Notation: z is the axis of rotation after a rotation R of the file's frame; a point has meridional coordinates r, z [mm]
and the angle theta. The region of the side is the union of the outlines of the faces in (r, z), trimmed at hub and
shroud. Its four edges lie on the hub, on the shroud, and between them. Parametrised by length and blended, they give a
grid of rulings from hub to tip. The faces are intersected at each place of the grid, and a patch interpolates the
points. The grid is refined until the patch is within the tolerance between the points.

Limits: a circle about the axis meets the side at most once. The deviation is measured midway between grid points.

Reference: [Piegl1997] ch. 9, 10.6 (blended boundaries).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch, patch_through
from chipload.geometry.revolve import Revolved
from chipload.geometry.step import Part
from chipload.geometry.step_faces import Face, kernel_face
from chipload.lazy import scipy

Floats = NDArray[np.float64]

#: numbers of grid points along each edge that the fit tries
COUNTS = (17, 33, 65, 129)
#: greatest gap between adjacent faces of a side [mm]
JOIN = 0.02
#: greatest distance of an edge of the region from hub or shroud [mm]; the values are tried in this order
REACHED = (0.01, 0.03, 0.1, 0.3, 0.8)
#: a tip within this distance of the shroud is not trimmed [mm]
NEAR_SHROUD = 0.7
#: greatest distance of a grid point at the edges of the side from the nearest face [mm]
MET = 0.1
_SAMPLES, _CURVE, _NEWTON = 81, 401, 12


@dataclass(frozen=True, eq=False)
class SampledSide:
    """A side through sampled points.

    Parameters
    ----------
    patch : v runs from hub to shroud; the normal points out of the metal if the part is a solid
    faces : numbers of the faces
    off : greatest deviation from the surfaces of the faces [mm], measured at ``looked`` points
    edge : greatest extension beyond the edges of the faces [mm]
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
    """A face as a rotated patch over its (u, v) box; outline and samples (k, 2) in (u, v), a tree of their (r, z)."""

    patch: BSplinePatch
    outline: Any
    uv: Floats
    tree: scipy.spatial.cKDTree


def side_of(faces: Sequence[Face], key: str, fit: float, R: Floats, hub: Revolved, shroud: Revolved) -> SampledSide:
    """The side that faces make together between hub and shroud.

    Parameters
    ----------
    key : job key that names the faces, for messages
    fit : greatest deviation [mm] of the side from the faces
    R : (3, 3) rotation from the frame of the file to the frame with z along the axis of rotation
    hub, shroud : surfaces that bound the side

    Raises
    ------
    InputError
        A face has a hole, the faces do not meet or do not reach hub or shroud, or the fit deviates by more.
    """
    numbers = tuple(f.number for f in faces)
    names = f"face {numbers[0]}" if len(numbers) == 1 else f"faces {', '.join(map(str, numbers))}"
    parts, rest = [], 0.0
    for face in faces:
        ku, kv, control, side, off, loop = face.part.call("step_side.trim_face", face.number, key)
        parts.append(_trim_patch(BSplinePatch(ku, kv, control @ R.T, side), loop))
        rest = max(rest, off)
    edges = _edges(_region(parts, hub, shroud, key, names), hub, shroud, key, names)
    best, looked = np.inf, 0
    for count in COUNTS:
        x = np.linspace(0.0, 1.0, count)
        grid, sense, edge = _points_on_faces(parts, _blend_edges(edges, x), key, names)
        patch = patch_through(grid.reshape(count, count, 3), x, x)
        # orient the patch by a normal of the faces
        at = patch.normal(0.5, 0.5)[0]
        if at @ sense[len(sense) // 2] < 0.0:
            patch = patch_through(grid.reshape(count, count, 3), x, x, side=-1)
        middle = np.linspace(0.0, 1.0, 2 * count - 1)
        U, V = (q.ravel() for q in np.meshgrid(middle, middle, indexing="ij"))
        made = patch.at(U, V)
        true, _, _ = _points_on_faces(
            parts, np.stack([np.hypot(made[:, 0], made[:, 1]), made[:, 2]], axis=-1), key, names
        )
        off = rest + float(np.linalg.norm(true - made, axis=1).max())
        looked = len(made)
        best = min(best, off)
        if off <= fit:
            return SampledSide(patch, numbers, off, looked, edge)
    raise InputError(
        f"{key}: {names}: a patch along rulings from hub to shroud deviates by {best:.4g} mm: must be at most "
        f"fit_mm = {fit:g}: raise it, or export the side in smooth faces"
    )


def _trim_patch(patch: BSplinePatch, loop: Floats) -> _Trimmed:
    import shapely

    outline = shapely.Polygon(loop).buffer(0.0)
    x = np.linspace(0.0, 1.0, _SAMPLES)
    U, V = (q.ravel() for q in np.meshgrid(x, x, indexing="ij"))
    within = shapely.contains_xy(outline.buffer(1e-9), U, V)
    uv = np.concatenate([np.stack([U, V], axis=-1)[within], np.clip(loop, 0.0, 1.0)])
    return _Trimmed(patch, outline, uv, scipy.spatial.cKDTree(_meridional(patch.at(*uv.T))))


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
    # a tip near the shroud is the edge of the side; a side that extends beyond the shroud is trimmed there
    line = shapely.LineString(shroud.curve(s))
    wider = band.union(line.buffer(NEAR_SHROUD))
    if whole.difference(wider).intersection(line.buffer(1.1 * NEAR_SHROUD)).area < NEAR_SHROUD**2:
        band = wider
    cut = whole.intersection(band)
    if cut.geom_type != "Polygon":
        cut = max(getattr(cut, "geoms", ()), key=lambda g: g.area, default=None)
    if cut is None or cut.area < 0.01 * whole.area:
        raise InputError(f"{key}: {names}: lie outside of hub and shroud: check hub, shroud and flow")
    return cut


def _edges(region: Any, hub: Revolved, shroud: Revolved, key: str, names: str) -> list[Floats]:
    """The four edges (n, 2) of the region: along the hub, along the shroud, at their start, at their end."""
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
            ends = _join_parts(ring, pieces)
            if ends is not None and (ends[1] - ends[0]) % ring.length > 0.05 * line.length:
                break
        else:
            away = float(shapely.distance(ring, line))
            raise InputError(
                f"{key}: {names}: no edge lies along the {what}, the nearest is {away:.3g} mm away: state all "
                f"faces of the side, or check {what}"
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
        raise InputError(f"{key}: {names}: their edges along hub and shroud overlap: check hub and shroud")
    low, right, high, left = chain(h0, h1), chain(h1, t0), chain(t0, t1), chain(t1, h0)
    return [low, right, high[::-1], left[::-1]]


def _join_parts(ring: Any, pieces: list[Any]) -> tuple[float, float] | None:
    """Start and end [mm] along a ring of the longest of ``pieces``, joined with those within 1 mm of it."""
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


def _blend_edges(edges: list[Floats], x: Floats) -> Floats:
    """(n n, 2) r and z of the grid that blends the four edges, each parametrised by length."""
    low, right, high, left = (_by_length(e, x) for e in edges)
    a, b = (q[..., None] for q in np.meshgrid(x, x, indexing="ij"))
    plane = (1 - b) * ((1 - a) * low[0] + a * low[-1]) + b * ((1 - a) * high[0] + a * high[-1])
    out = (1 - b) * low[:, None] + b * high[:, None] + (1 - a) * left[None] + a * right[None] - plane
    return np.asarray(out.reshape(-1, 2), dtype=np.float64)


def _by_length(points: Floats, x: Floats) -> Floats:
    length = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()])
    return np.stack([np.interp(x * length[-1], length, points[:, k]) for k in (0, 1)], axis=-1)


def _points_on_faces(parts: Sequence[_Trimmed], places: Floats, key: str, names: str) -> tuple[Floats, Floats, float]:
    """Points (n, 3) of the faces at (r, z) (n, 2), their normals (n, 3), and the greatest distance of one [mm]."""
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
def trim_face(part: Part, number: int, key: str) -> tuple[Floats, Floats, Floats, int, float, Floats]:
    """Knots, poles and side of the patch over the (u, v) box of a face, its deviation [mm], its outline (n, 2)."""
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_REVERSED

    from chipload.geometry.step_patch import POLYNOMIAL, box_of, kept_of, loop_of, off_of, points_of

    face = kernel_face(part, number)
    if face.holes:
        raise InputError(f"{key}: face {number} has a hole: must have none")
    surface = BRep_Tool.Surface_s(face.shape)
    side = -1 if face.shape.Orientation() == TopAbs_REVERSED else 1
    loop = loop_of(face, surface)
    _, low, high = box_of(loop, surface)
    patch = kept_of(surface, low, high, side) if face.kind in POLYNOMIAL else None
    off = 0.0
    if patch is None:
        x = np.linspace(0.0, 1.0, 65)
        s, t = np.meshgrid(x, x, indexing="ij")
        patch = patch_through(points_of(surface, low + np.stack([s, t], axis=-1) * (high - low)), x, x, side=side)
        off = off_of(patch, lambda s, t: low + np.stack([s, t], axis=-1) * (high - low), surface, 65)
    outline = np.concatenate([p.uv[:-1] for p in loop])
    return patch.knots_u, patch.knots_v, patch.control, patch.side, off, (outline - low) / (high - low)
