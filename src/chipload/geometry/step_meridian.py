"""Conversion of faces of revolution of a STEP part into the meridional curve of a hub or a shroud.

Notation: the axis is z after a rotation R of the file's frame; r, z [mm] of a point. Of a face of revolution either the
lines of equal u or those of equal v are its meridians; a plane across the axis has straight ones. Where blades stand on
a face, or holes go through it, does not matter.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.step import Part
from chipload.geometry.step_faces import Face, KernelFace, kernel_face

Floats = NDArray[np.float64]

#: faces of one curve meet within this [mm]
JOIN = 1e-2
#: and at a smaller angle than this [rad]
SMOOTH = np.radians(10.0)
#: a face is of revolution if the radius and the height round it change by less [mm]
ROUND = 1e-3
#: the long edges of the tip of a blade are nearer than this in radius and height [mm]
TIP = 1.0
#: points of a face's meridian
COUNT = 201


def meridian_of(faces: Sequence[Face], R: Floats, key: str, tips: bool = False) -> Floats:
    """The meridional curve of faces, from the inlet to the outlet: from the end that lies high and near to the axis.

    Parameters
    ----------
    faces : in any order, each going on where another ends
    R : (3, 3) rotation from the frame of the file to that whose axis is z
    key : who asks, for a message
    tips : a face that is not of revolution counts as the tip of a blade: its meridian is the middle of its long edges

    Returns
    -------
    (n, 2) float [mm] r and z

    Raises
    ------
    InputError
        A face is not of revolution about the axis, or they do not go on smoothly one after another.
    """
    out: Floats = faces[0].part.call("step_meridian.joined", [f.number for f in faces], R, key, tips)
    return out


# -- in the process of the CAD kernel ---------------------------------------------------------------------------
def joined(part: Part, numbers: Sequence[int], R: Floats, key: str, tips: bool) -> Floats:
    """What :func:`meridian_of` gives of the faces of these numbers."""
    rest = [kernel_face(part, number) for number in numbers]
    left = [meridian_in(f, R, key, tips) for f in rest]
    # begin with the piece that has the first of all ends
    ends = [max(_first(p[0]), _first(p[-1])) for p in left]
    k = int(np.argmax(ends))
    out, number = left.pop(k), rest.pop(k).number
    if _first(out[-1]) > _first(out[0]):
        out = out[::-1]
    while left:
        gap = [min(np.linalg.norm(p[0] - out[-1]), np.linalg.norm(p[-1] - out[-1])) for p in left]
        k = int(np.argmin(gap))
        piece, next_number = left.pop(k), rest.pop(k).number
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
    """Greater for what the flow meets first: it comes down along the axis and goes outwards."""
    return float(p[1] - p[0])


def meridian_in(face: KernelFace, R: Floats, key: str, tips: bool) -> Floats:
    """(n, 2) r and z of one face, in either sense."""
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
        return _across(face, R)
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
    """Half-way between the two longest edges of the tip of a blade, by shares of their length."""
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


def _across(face: KernelFace, R: Floats) -> Floats:
    """Of a plane across the axis: from its least to its greatest radius along its edges."""
    p = np.concatenate(_edges(face, R))
    r = np.hypot(p[:, 0], p[:, 1])
    return np.stack([np.linspace(r.min(), r.max(), COUNT), np.full(COUNT, p[:, 2].mean())], axis=-1)


def _edges(face: KernelFace, R: Floats) -> list[Floats]:
    """Points (n, 3) of each edge of a face."""
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
