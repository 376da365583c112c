"""Conversion of faces of revolution of a STEP part into the meridional curve of a hub or a shroud.

Notation: the axis is z after a rotation R of the file's frame; r, z [mm] of a point. The meridians of a face of
revolution are its lines of equal u, or those of equal v; those of a plane normal to the axis are straight. Blades on a
face, and holes through it, have no influence.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.step import Part
from chipload.geometry.step_faces import Face, KernelFace, kernel_face

Floats = NDArray[np.float64]

#: greatest gap between successive faces of a curve [mm]
JOIN = 1e-2
#: greatest angle between successive faces of a curve [rad]
SMOOTH = np.radians(10.0)
#: greatest change of radius and height around a face of revolution [mm]
ROUND = 1e-3
#: greatest distance between the long edges of the tip of a blade, in radius and height [mm]
TIP = 1.0
#: number of points of the meridian of a face
COUNT = 201


def meridian_of(faces: Sequence[Face], R: Floats, key: str, tips: bool = False) -> Floats:
    """The meridional curve of faces from inlet to outlet; the inlet is the end with the greatest z - r.

    Parameters
    ----------
    faces : adjacent faces, in any order
    R : (3, 3) rotation from the frame of the file to the frame with z along the axis of rotation
    key : job key that names the faces, for messages
    tips : treat a face that is not of revolution as the tip of a blade, with the mean of its long edges as meridian

    Returns
    -------
    (n, 2) float [mm] r and z

    Raises
    ------
    InputError
        A face is not of revolution about the axis, or the faces do not join smoothly.
    """
    out: Floats = faces[0].part.call("step_meridian.join_meridians", [f.number for f in faces], R, key, tips)
    return out


# -- in the process of the CAD kernel ---------------------------------------------------------------------------
def join_meridians(part: Part, numbers: Sequence[int], R: Floats, key: str, tips: bool) -> Floats:
    """As :func:`meridian_of`, for the faces with these numbers."""
    rest = [kernel_face(part, number) for number in numbers]
    curves = [meridian_in(f, R, key, tips) for f in rest]
    # begin with the curve that has the end nearest to the inlet
    ends = [max(_first(p[0]), _first(p[-1])) for p in curves]
    k = int(np.argmax(ends))
    out, number = curves.pop(k), rest.pop(k).number
    if _first(out[-1]) > _first(out[0]):
        out = out[::-1]
    while curves:
        gap = [min(np.linalg.norm(p[0] - out[-1]), np.linalg.norm(p[-1] - out[-1])) for p in curves]
        k = int(np.argmin(gap))
        piece, next_number = curves.pop(k), rest.pop(k).number
        if gap[k] > JOIN:
            raise InputError(
                f"{key}: face {next_number} begins {gap[k]:.4g} mm from the end of face {number}: state the faces "
                "between them"
            )
        if np.linalg.norm(piece[-1] - out[-1]) < np.linalg.norm(piece[0] - out[-1]):
            piece = piece[::-1]
        a, b = out[-1] - out[-2], piece[1] - piece[0]
        turn = abs(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b))
        if turn > SMOOTH:
            raise InputError(
                f"{key}: faces {number} and {next_number} meet at {np.degrees(turn):.3g} deg: must join smoothly: "
                "state only the faces along the channel"
            )
        out, number = np.concatenate([out, piece[1:]]), next_number
    return out


def _first(p: Floats) -> float:
    """Order z - r [mm] of a point (2,), which falls along the flow: it enters along -z and leaves outwards."""
    return float(p[1] - p[0])


def meridian_in(face: KernelFace, R: Floats, key: str, tips: bool) -> Floats:
    """(n, 2) r and z [mm] of the meridian of one face, in either sense.

    Raises
    ------
    InputError
        The face is not of revolution about the axis and, with ``tips``, not the tip of a blade.
    """
    from OCP.BRep import BRep_Tool
    from OCP.BRepTools import BRepTools

    surface = BRep_Tool.Surface_s(face.shape)
    bounds = np.array([float(x) for x in BRepTools.UVBounds_s(face.shape)])
    u, v = np.linspace(bounds[0], bounds[1], COUNT), np.linspace(bounds[2], bounds[3], COUNT)

    def rz(a: Floats, b: Floats) -> Floats:
        made = [surface.Value(float(x), float(y)) for x, y in zip(a.ravel(), b.ravel(), strict=True)]
        p = np.array([(q.X(), q.Y(), q.Z()) for q in made]) @ R.T
        return np.stack([np.hypot(p[:, 0], p[:, 1]), p[:, 2]], axis=-1).reshape(*a.shape, 2)

    few = slice(None, None, (COUNT - 1) // 10)
    grid = rz(*np.meshgrid(u[few], v[few], indexing="ij"))
    if face.kind == "plane":
        if np.ptp(grid[..., 1]) > ROUND:
            raise InputError(f"{key}: face {face.number} is a plane along the axis: must be of revolution about it")
        return _meridian_across(face, R)
    round_u, round_v = (float(np.ptp(grid, axis=k).max()) for k in (0, 1))
    if min(round_u, round_v) > ROUND and tips:
        return _tip(face, R, key)
    if min(round_u, round_v) > ROUND:
        raise InputError(
            f"{key}: face {face.number} is not of revolution about the axis: radius and height round it change by "
            f"{min(round_u, round_v):.4g} mm: check flow, and that the axis goes through the origin"
        )
    if round_u <= round_v:
        return rz(np.full(COUNT, u[0]), v)
    return rz(u, np.full(COUNT, v[0]))


def _tip(face: KernelFace, R: Floats, key: str) -> Floats:
    """Mean (n, 2) of r and z of the two longest edges of the tip of a blade, at equal shares of their lengths."""
    rows = sorted(_edges(face, R), key=lambda e: -float(np.linalg.norm(np.diff(e, axis=0), axis=1).sum()))[:2]
    curves = []
    for p in rows:
        m = np.stack([np.hypot(p[:, 0], p[:, 1]), p[:, 2]], axis=-1)
        length = np.concatenate([[0.0], np.linalg.norm(np.diff(m, axis=0), axis=1).cumsum()])
        if length[-1] == 0.0:
            raise InputError(
                f"{key}: face {face.number} is not the tip of a blade: an edge has no length along the axis"
            )
        share = np.linspace(0.0, length[-1], COUNT)
        curves.append(np.stack([np.interp(share, length, m[:, k]) for k in (0, 1)], axis=-1))
    a, b = curves
    if np.linalg.norm(a[0] - b[-1]) < np.linalg.norm(a[0] - b[0]):
        b = b[::-1]
    apart = float(np.linalg.norm(a - b, axis=1).max())
    if apart > TIP:
        raise InputError(
            f"{key}: face {face.number} is neither of revolution about the axis nor the tip of a blade: its edges are "
            f"{apart:.4g} mm apart in radius and height, at most {TIP:g} mm: check flow, or state a file of points"
        )
    return np.asarray(0.5 * (a + b), dtype=np.float64)


def _meridian_across(face: KernelFace, R: Floats) -> Floats:
    """Meridian (n, 2) of a plane normal to the axis, from the least to the greatest radius of its edges."""
    p = np.concatenate(_edges(face, R))
    r = np.hypot(p[:, 0], p[:, 1])
    return np.stack([np.linspace(r.min(), r.max(), COUNT), np.full(COUNT, p[:, 2].mean())], axis=-1)


def _edges(face: KernelFace, R: Floats) -> list[Floats]:
    """Points (n, 3) [mm] of each edge of a face, rotated by R."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    rows = []
    explorer = TopExp_Explorer(face.shape, TopAbs_EDGE)
    while explorer.More():
        curve = BRepAdaptor_Curve(TopoDS.Edge(explorer.Current()))
        explorer.Next()
        t = np.linspace(curve.FirstParameter(), curve.LastParameter(), COUNT)
        made = [curve.Value(float(x)) for x in t]
        rows.append(np.array([(p.X(), p.Y(), p.Z()) for p in made]) @ R.T)
    return rows
