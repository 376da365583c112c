"""A four-sided face of a STEP part as a B-spline patch.

Notation: face S(u, v) [mm] of the CAD kernel; its loop of edges as curves in (u, v). If the loop is a box
of parameter lines and S is polynomial, the patch has the poles and knots of S. Otherwise parameters (s, t) in 0..1 are
laid over the face: the four sides of its loop, parametrised by length, are blended to (u, v)(s, t). The patch
interpolates the points of a grid in (s, t), and the grid is refined until the patch is within the tolerance. If lines
of equal u or v lie more than :data:`UNEVEN` times closer in one place than in another, the patch is reparametrised by
length, because its users sample it in even steps of u and v. Patches are made in the process of the CAD kernel.

Reference: [Piegl1997] ch. 9, 10.6 (blended boundaries).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch, basis, patch_through
from chipload.geometry.step import Part
from chipload.geometry.step_faces import Face, KernelFace, kernel_face
from chipload.lazy import scipy

Floats = NDArray[np.float64]

#: two edges that meet at more than this angle [rad] form a corner of their loop
CORNER = np.radians(20.0)
#: numbers of grid points along each side that the fit tries
COUNTS = (17, 33, 65, 129)
#: numbers of pieces per knot span that the reparametrisation by length tries
PIECES = (2, 4, 8, 16)
#: greatest ratio of the distances of parameter lines that needs no reparametrisation
UNEVEN = 2.0
_SAMPLES = 201
POLYNOMIAL = ("plane", "b-spline", "Bezier", "of extrusion")


@dataclass(frozen=True, eq=False)
class ReadFace:
    """The patch that represents a face.

    Attributes
    ----------
    patch : its normal points out of the metal if the part is a solid
    kept : whether its poles and knots are those of the file
    off : greatest measured deviation of the patch and of its rim from the face [mm]
    """

    patch: BSplinePatch
    kept: bool
    off: float

    def __str__(self) -> str:
        n, m = self.patch.control.shape[:2]
        how = "poles and knots of the file" if self.kept else f"fitted by {n} x {m} poles"
        return f"{how}, within {self.off:.2g} mm of the face"


def patch_of(face: Face, key: str, fit: float) -> ReadFace:
    """The patch of a four-sided face.

    Parameters
    ----------
    key : job key that names the face, for messages
    fit : greatest deviation [mm] of the patch from the face

    Raises
    ------
    InputError
        The face has holes, does not have four sides, or the fit deviates by more than ``fit``.
    """
    knots_u, knots_v, control, side, from_file, off = face.part.call("step_patch.patch_data", face.number, key, fit)
    return ReadFace(BSplinePatch(knots_u, knots_v, control, side), from_file, off)


def four_sided(face: Face) -> bool:
    """Whether :func:`patch_of` accepts a face: it has four corners and no holes."""
    return bool(face.part.call("step_patch.has_four", face.number))


# -- in the process of the CAD kernel ---------------------------------------------------------------------------
def has_four(part: Part, number: int) -> bool:
    """As :func:`four_sided`, for the face with this number."""
    from OCP.BRep import BRep_Tool

    face = kernel_face(part, number)
    loop = loop_of(face, BRep_Tool.Surface_s(face.shape))
    return face.holes == 0 and (len(loop) == 4 or len(_corners(loop)) == 4)


def patch_data(part: Part, number: int, key: str, fit: float) -> tuple[Floats, Floats, Floats, int, bool, float]:
    """Knots, poles and side of the patch of a face, whether they are those of the file, and its deviation [mm]."""
    made = _patch_of(kernel_face(part, number), key, fit)
    return made.patch.knots_u, made.patch.knots_v, made.patch.control, made.patch.side, made.kept, made.off


def _patch_of(face: KernelFace, key: str, fit: float) -> ReadFace:
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_REVERSED

    if face.holes:
        holes = "a hole" if face.holes == 1 else f"{face.holes} holes"
        raise InputError(f"{key}: face {face.number} has {holes}: must have none")
    surface = BRep_Tool.Surface_s(face.shape)
    side = -1 if face.shape.Orientation() == TopAbs_REVERSED else 1
    loop = loop_of(face, surface)
    rim, low, high = box_of(loop, surface)
    if rim <= fit and face.kind in POLYNOMIAL:
        patch = kept_of(surface, low, high, side)
        if patch is not None:
            off = max(rim, off_of(patch, lambda s, t: low + np.stack([s, t], axis=-1) * (high - low), surface, 17))
            if off <= fit:
                return _even(ReadFace(patch, True, off), face, key, fit)
    return _fit_face(face, surface, loop, side, key, fit)


@dataclass(frozen=True, eq=False)
class _Piece:
    """An edge in the sense of its loop: (u, v) at a parameter; samples of t, (u, v), point, length from the start."""

    at: Callable[[float], tuple[float, float]]
    t: Floats
    uv: Floats
    points: Floats
    length: Floats


def points_of(surface: Any, uv: Floats) -> Floats:
    """Points (..., 3) [mm] of a kernel surface at the parameters (u, v) (..., 2)."""
    out = [surface.Value(float(u), float(v)) for u, v in uv.reshape(-1, 2)]
    return np.array([(p.X(), p.Y(), p.Z()) for p in out]).reshape(*uv.shape[:-1], 3)


def loop_of(face: KernelFace, surface: Any) -> list[_Piece]:
    """The edges of the outer loop of a face, without those of no length."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve2d
    from OCP.BRepTools import BRepTools, BRepTools_WireExplorer
    from OCP.TopAbs import TopAbs_REVERSED

    out: list[_Piece] = []
    explorer = BRepTools_WireExplorer(BRepTools.OuterWire_s(face.shape), face.shape)
    while explorer.More():
        edge, turned = explorer.Current(), explorer.Orientation() == TopAbs_REVERSED
        explorer.Next()
        if BRep_Tool.Degenerated_s(edge):
            continue
        curve = BRepAdaptor_Curve2d(edge, face.shape)
        ends = (curve.FirstParameter(), curve.LastParameter())
        t = np.linspace(*(ends[::-1] if turned else ends), _SAMPLES)

        def surface_point(x: float, on: Any = curve) -> tuple[float, float]:
            p = on.Value(x)
            return p.X(), p.Y()

        uv = np.array([surface_point(float(x)) for x in t])
        points = points_of(surface, uv)
        length = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()])
        if length[-1] > 0.0:
            out.append(_Piece(surface_point, t, uv, points, length))
    return out


def box_of(loop: list[_Piece], surface: Any) -> tuple[float, Floats, Floats]:
    """Greatest distance [mm] of a loop from its bounding box in (u, v); lower and upper corner (2,) of the box."""
    uv = np.concatenate([p.uv for p in loop])
    low, high = uv.min(axis=0), uv.max(axis=0)
    natural = np.array(surface.Bounds()).reshape(2, 2)
    for end, bound in ((low, natural[:, 0]), (high, natural[:, 1])):
        near = np.abs(end - bound) <= 1e-9 * (high - low)
        end[near] = bound[near]
    rim = 0.0
    for p in loop:
        away = []
        for axis in (0, 1):
            for value in (low[axis], high[axis]):
                snapped = p.uv.copy()
                snapped[:, axis] = value
                away.append(np.linalg.norm(points_of(surface, snapped) - p.points, axis=1).max())
        rim = max(rim, float(min(away)))
    return rim, low, high


def kept_of(surface: Any, low: Floats, high: Floats, side: int) -> BSplinePatch | None:
    """The patch with the poles and knots of a kernel surface within a box; None if the surface is rational."""
    from OCP.Geom import Geom_RectangularTrimmedSurface
    from OCP.GeomConvert import GeomConvert

    cut = Geom_RectangularTrimmedSurface(surface, low[0], high[0], low[1], high[1])
    b = GeomConvert.SurfaceToBSplineSurface_s(cut)
    n, m = b.NbUPoles(), b.NbVPoles()
    if b.IsURational() or b.IsVRational():
        weights = [b.Weight(i, j) for i in range(1, n + 1) for j in range(1, m + 1)]
        if max(weights) - min(weights) > 1e-12 * max(weights):
            return None
    poles = [[b.Pole(i, j) for j in range(1, m + 1)] for i in range(1, n + 1)]
    control = np.array([[(p.X(), p.Y(), p.Z()) for p in row] for row in poles])
    u = np.repeat([b.UKnot(i) for i in range(1, b.NbUKnots() + 1)], _mults(b.UMultiplicity, b.NbUKnots()))
    v = np.repeat([b.VKnot(i) for i in range(1, b.NbVKnots() + 1)], _mults(b.VMultiplicity, b.NbVKnots()))
    return BSplinePatch(_unit(u), _unit(v), control, side)


def _mults(of: Callable[[int], int], count: int) -> list[int]:
    return [of(i) for i in range(1, count + 1)]


def _unit(knots: Floats) -> Floats:
    out: Floats = (knots - knots[0]) / (knots[-1] - knots[0])
    return out


def off_of(patch: BSplinePatch, uv_of: Callable[[Floats, Floats], Floats], surface: Any, count: int) -> float:
    """Greatest distance [mm] between patch and surface on a grid of ``2 count - 1`` places in each direction."""
    x = np.linspace(0.0, 1.0, 2 * count - 1)
    s, t = np.meshgrid(x, x, indexing="ij")
    points = points_of(surface, uv_of(s, t))
    return float(np.linalg.norm(patch.at(s.ravel(), t.ravel()).reshape(points.shape) - points, axis=2).max())


def _fit_face(face: KernelFace, surface: Any, loop: list[_Piece], side: int, key: str, fit: float) -> ReadFace:
    sides = [_side(pieces) for pieces in _four(face, loop, key)]
    corners = np.array([s(np.zeros(1))[0] for s in sides])

    def uv_of(s: Floats, t: Floats) -> Floats:
        flat = [x.ravel() for x in (s, t)]
        a, b = (x[:, None] for x in flat)
        low, right, high, left = (
            _at_shares(side_at, x)
            for side_at, x in zip(sides, (flat[0], flat[1], 1.0 - flat[0], 1.0 - flat[1]), strict=True)
        )
        plane = (1 - b) * ((1 - a) * corners[0] + a * corners[1]) + b * (a * corners[2] + (1 - a) * corners[3])
        out: Floats = ((1 - b) * low + b * high + (1 - a) * left + a * right - plane).reshape(*s.shape, 2)
        return out

    best = np.inf
    for count in COUNTS:
        x = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, count))
        x[0], x[-1] = 0.0, 1.0
        s, t = np.meshgrid(x, x, indexing="ij")
        uv = uv_of(s, t)
        e, f = uv[1:, :-1] - uv[:-1, :-1], uv[:-1, 1:] - uv[:-1, :-1]
        sense = e[..., 0] * f[..., 1] - e[..., 1] * f[..., 0]
        if (sense <= 0.0).any() and (sense >= 0.0).any():
            raise InputError(
                f"{key}: face {face.number} folds over between its four sides: split it in CAD, or state sections"
            )
        patch = patch_through(points_of(surface, uv), x, x, side=int(np.sign(sense[0, 0])) * side)
        middles = np.sort(np.concatenate([x, 0.5 * (x[1:] + x[:-1])]))
        s, t = np.meshgrid(middles, middles, indexing="ij")
        points = points_of(surface, uv_of(s, t))
        off = float(np.linalg.norm(patch.at(s.ravel(), t.ravel()).reshape(points.shape) - points, axis=2).max())
        best = min(best, off)
        if off <= fit:
            return _even(ReadFace(patch, False, off), face, key, fit)
    raise _deviation(face, key, best, fit)


def _deviation(face: KernelFace, key: str, best: float, fit: float) -> InputError:
    return InputError(
        f"{key}: the fit of face {face.number} deviates by {best:.4g} mm: must be at most fit_mm = {fit:g}: raise it, "
        "or export the face in smooth parts"
    )


def _even(face_patch: ReadFace, face: KernelFace, key: str, fit: float) -> ReadFace:
    """The same surface, reparametrised by length if its parameter lines are uneven."""
    out = face_patch
    for _ in range(2):
        out = _even_u(out, face, key, fit)
        out = ReadFace(out.patch.swapped(), out.kept, out.off)
    return out


def _even_u(face_patch: ReadFace, face: KernelFace, key: str, fit: float) -> ReadFace:
    """The same surface with u replaced by the share of length along u, if the lines of equal u are uneven."""
    patch, x, few = face_patch.patch, np.linspace(0.0, 1.0, 2 * _SAMPLES), np.linspace(0.0, 1.0, 9)
    grid = patch.at(*_mesh(x, few)).reshape(len(x), len(few), 3)
    step = np.linalg.norm(np.diff(grid, axis=0), axis=2).mean(axis=1)
    if step.max() <= UNEVEN * step.min():
        return face_patch
    u_of = scipy.interpolate.CubicSpline(np.concatenate([[0.0], step.cumsum()]) / step.sum(), x)
    s_of = scipy.interpolate.CubicSpline(x, np.concatenate([[0.0], step.cumsum()]) / step.sum())
    ends = np.clip(s_of(np.unique(patch.knots_u)), 0.0, 1.0)
    degree = patch.degrees[0]
    off = np.inf
    for count in PIECES:
        s = np.concatenate([np.linspace(a, b, count, endpoint=False) for a, b in pairwise(ends)] + [[1.0]])
        first, N = basis(patch.knots_u, degree, np.clip(u_of(s), 0.0, 1.0))
        curves = np.einsum("ki,kijd->kjd", N, patch.control[first[:, None] + np.arange(degree + 1)])
        spline = scipy.interpolate.make_interp_spline(s, curves, k=3)
        made = BSplinePatch(spline.t, patch.knots_v, spline.c, patch.side)
        S, V = _mesh(np.sort(np.concatenate([s, 0.5 * (s[1:] + s[:-1])])), few)
        off = float(np.linalg.norm(made.at(S, V) - patch.at(np.clip(u_of(S), 0.0, 1.0), V), axis=1).max())
        if face_patch.off + off <= fit:
            return ReadFace(made, False, face_patch.off + off)
    raise _deviation(face, key, face_patch.off + off, fit)


def _mesh(u: Floats, v: Floats) -> tuple[Floats, Floats]:
    a, b = np.meshgrid(u, v, indexing="ij")
    return a.ravel(), b.ravel()


def _at_shares(side: Callable[[Floats], Floats], shares: Floats) -> Floats:
    """(u, v) (n, 2) at shares (n,); each distinct share is computed once."""
    x, back = np.unique(shares, return_inverse=True)
    return side(x)[back]


def _four(face: KernelFace, loop: list[_Piece], key: str) -> list[list[_Piece]]:
    """The edges of a loop, grouped into four sides.

    Raises
    ------
    InputError
        The loop has neither four edges nor four corners.
    """
    if len(loop) == 4:
        return [[p] for p in loop]
    starts = _corners(loop)
    if len(starts) != 4:
        at = ", ".join("(" + ", ".join(f"{x:.4g}" for x in loop[k].points[0]) + ")" for k in starts.tolist()[:6])
        raise InputError(
            f"{key}: face {face.number} has {len(loop)} edges and {len(starts)} corners of more than "
            f"{np.degrees(CORNER):.0f} deg{f', at {at} mm' if at else ''}: must have four sides: along the "
            "hub, the shroud and two edges of a blade, or around a wall: split the face in CAD along the missing edge, "
            "or state sections instead of faces"
        )
    ring = loop[starts[0] :] + loop[: starts[0]]
    ends = [*(starts - starts[0]).tolist(), len(loop)]
    return [ring[a:b] for a, b in pairwise(ends)]


def _corners(loop: list[_Piece]) -> NDArray[np.int64]:
    """Numbers (k,) of the edges of a loop that begin at a corner."""
    corner = []
    for before, after in zip([loop[-1], *loop[:-1]], loop, strict=True):
        a, b = before.points[-1] - before.points[-2], after.points[1] - after.points[0]
        turn = np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)
        corner.append(bool(turn > CORNER))
    return np.flatnonzero(corner)


def _side(pieces: list[_Piece]) -> Callable[[Floats], Floats]:
    """The function from shares (n,) of the length of a side to its (u, v) (n, 2)."""
    ends = np.concatenate([[0.0], np.cumsum([p.length[-1] for p in pieces])])
    inverse = [scipy.interpolate.CubicSpline(p.length, p.t) for p in pieces]

    def surface_point(shares: Floats) -> Floats:
        x = shares * ends[-1]
        number = np.clip(np.searchsorted(ends, x, side="right") - 1, 0, len(pieces) - 1)
        out = np.empty((len(x), 2))
        for k, (n, length) in enumerate(zip(number.tolist(), x.tolist(), strict=True)):
            p = pieces[n]
            here = min(max(length - float(ends[n]), 0.0), float(p.length[-1]))
            out[k] = p.at(float(np.clip(inverse[n](here), *sorted((p.t[0], p.t[-1])))))
        return out

    return surface_point
