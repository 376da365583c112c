"""Thin walls, described by their two finished sides: a plate, a parametric blade, a blade through sections.

Notation: u in 0..1 along the wall (of a blade: from its leading to its trailing edge), v in 0..1 from the clamp to the
free edge; x along u, z along v, the clamp at z = 0. The sides are ``k-`` and ``k+``. The directions of u,
of v, and from k- to k+ are right-handed, so that k+ faces -y. N unit normals out of the wall, a [mm] stock on a side.

Parametric blade: chord c, thickness t and stagger are linear in v. The camber line is an arc that turns by the camber
angle. The thickness over u is t (e + (1 - e) (1 - (2 u - 1)^2)), where e is the share of the thickness at the edges.

A blade through sections is rotated so that the line from the middle of its first section to that of its last is along z
and the chord of its middle section lies in the xz plane. Its edges are not part of the wall: u covers the range from
``edge`` to 1 - ``edge`` of a section.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.geometry.sections import Blade
from chipload.lazy import trimesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: step in u and v of the differences from which normals are calculated
STEP = 1e-5
#: greatest angle [rad] between the lines across a wall and the normals of its sides
LEAN = math.radians(45.0)


@dataclass(frozen=True, eq=False)
class ThinWall:
    """A finished wall.

    Attributes
    ----------
    name : description for messages and reports
    at : function of u (n,), v (n,) that returns points (n, 3) [mm] of k- and of k+
    """

    name: str
    at: Callable[[Floats, Floats], tuple[Floats, Floats]]

    def sides(self, u: ArrayLike, v: ArrayLike) -> tuple[Floats, Floats]:
        """Points (..., 3) [mm] of k- and of k+."""
        a, b = np.broadcast_arrays(np.asarray(u, dtype=np.float64), np.asarray(v, dtype=np.float64))
        minus, plus = self.at(a.ravel(), b.ravel())
        return minus.reshape(*a.shape, 3), plus.reshape(*a.shape, 3)

    def normals(self, u: ArrayLike, v: ArrayLike) -> tuple[Floats, Floats]:
        """Unit normals (..., 3) of k- and of k+, out of the wall."""
        a, b = np.broadcast_arrays(np.asarray(u, dtype=np.float64), np.asarray(v, dtype=np.float64))
        along = [self.sides(np.clip(a + s * STEP, 0.0, 1.0), b) for s in (-1.0, 1.0)]
        up = [self.sides(a, np.clip(b + s * STEP, 0.0, 1.0)) for s in (-1.0, 1.0)]
        out = []
        for k, sign in ((0, -1.0), (1, 1.0)):
            n = sign * np.cross(along[1][k] - along[0][k], up[1][k] - up[0][k])
            out.append(n / np.linalg.norm(n, axis=-1, keepdims=True))
        return out[0], out[1]

    def offset(self, u: ArrayLike, v: ArrayLike, stock: tuple[ArrayLike, ArrayLike]) -> tuple[Floats, Floats]:
        """Points (..., 3) [mm] on the stock (...) [mm] of k- and of k+, measured along the normals."""
        made = [
            p + np.asarray(a, dtype=np.float64)[..., None] * n
            for p, n, a in zip(self.sides(u, v), self.normals(u, v), stock, strict=True)
        ]
        return made[0], made[1]

    def thickness(self, u: ArrayLike, v: ArrayLike) -> Floats:
        """Distance (...) [mm] between the sides at equal u, v."""
        minus, plus = self.sides(u, v)
        return np.asarray(np.linalg.norm(plus - minus, axis=-1))

    def size(self) -> tuple[float, float, float]:
        """Length along u at half height, height and least thickness [mm]."""
        u, v = np.meshgrid(np.linspace(0.0, 1.0, 65), np.linspace(0.0, 1.0, 33), indexing="ij")
        minus, plus = self.sides(u, v)
        middle = 0.5 * (minus + plus)
        length = float(np.linalg.norm(np.diff(middle[:, 16], axis=0), axis=1).sum())
        height = float(np.linalg.norm(np.diff(middle[32], axis=0), axis=1).sum())
        return length, height, float(self.thickness(u, v).min())

    def mesh(self, counts: tuple[int, int], stock: tuple[float, float], low: float = 0.0) -> trimesh.Trimesh:
        """Closed triangle mesh of the wall with ``stock`` [mm] on k- and k+, from v = ``low`` to the free edge, with
        ``counts`` quads along u and v.
        """
        u, v = np.meshgrid(np.linspace(0.0, 1.0, counts[0] + 1), np.linspace(low, 1.0, counts[1] + 1), indexing="ij")
        return closed_between(*self.offset(u, v, stock))


def closed_between(minus: Floats, plus: Floats) -> trimesh.Trimesh:
    """Closed triangle mesh between two grids of points (n, m, 3) [mm]. The directions of their first axis, of their
    second axis, and from ``minus`` to ``plus`` must be right-handed.
    """
    n, m = minus.shape[:2]
    number = np.arange(n * m).reshape(n, m)
    faces = [_quads(number)[:, ::-1], _quads(number + n * m)]
    edges = (number[0, ::-1], number[-1], number[:, 0], number[::-1, -1])
    faces += [_quads(np.stack([edge, edge + n * m], axis=1)) for edge in edges]
    return trimesh.Trimesh(np.vstack([minus.reshape(-1, 3), plus.reshape(-1, 3)]), np.vstack(faces), process=False)


def _quads(number: Ints) -> Ints:
    """Two triangles (k, 3) for each quad of a grid of vertex numbers (n, m), right-handed in the order of its axes."""
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def plate(length: float, height: float, thickness: float) -> ThinWall:
    """An upright plate of length, height and thickness [mm], centred over the origin.

    Raises
    ------
    InputError
        A dimension is not a finite number above 0.

    Examples
    --------
    >>> minus, plus = plate(40.0, 30.0, 3.0).sides([1.0], [1.0])
    >>> minus.tolist(), plus.tolist()
    ([[20.0, 1.5, 30.0]], [[20.0, -1.5, 30.0]])
    """
    for key, value in (("length_mm", length), ("height_mm", height), ("thickness_mm", thickness)):
        if not 0.0 < value < math.inf:
            raise InputError(f"wall.{key} = {value:g}: must be above 0")

    def surface_point(u: Floats, v: Floats) -> tuple[Floats, Floats]:
        x, z, t = (u - 0.5) * length, v * height, np.full(len(u), 0.5 * thickness)
        return np.stack([x, t, z], axis=1), np.stack([x, -t, z], axis=1)

    return ThinWall(f"plate {length:g} x {height:g} x {thickness:g} mm", surface_point)


def blade(
    chord: tuple[float, float],
    height: float,
    thickness: tuple[float, float],
    edge: float,
    camber: float,
    stagger: tuple[float, float],
) -> ThinWall:
    """A blade with given values at root and tip.

    Parameters
    ----------
    chord, thickness : chord, and thickness at mid-chord, at the clamp and at the free edge [mm]
    height : height [mm]
    edge : thickness at the edges as a share of that at mid-chord, above 0, at most 1
    camber : angle by which the camber line turns [rad], below pi / 2
    stagger : angle of the chord about z [rad] at the clamp and at the free edge

    Raises
    ------
    InputError
        A value is out of range.

    Examples
    --------
    >>> b = blade((20.0, 20.0), 30.0, (3.0, 2.0), 0.5, 0.0, (0.0, 0.0))
    >>> b.thickness([0.5, 0.5, 0.0], [0.0, 1.0, 0.0]).tolist()
    [3.0, 2.0, 1.5]
    """
    for key, value in (
        ("chord_root_mm", chord[0]),
        ("chord_tip_mm", chord[1]),
        ("height_mm", height),
        ("thickness_root_mm", thickness[0]),
        ("thickness_tip_mm", thickness[1]),
    ):
        if not 0.0 < value < math.inf:
            raise InputError(f"wall.{key} = {value:g}: must be above 0")
    if not 0.0 < edge <= 1.0:
        raise InputError(f"wall.edge_share = {edge:g}: must be above 0 and at most 1")
    if not abs(camber) < 0.5 * math.pi:
        raise InputError(f"wall.camber_deg = {math.degrees(camber):g}: must be between -90 and 90")

    def surface_point(u: Floats, v: Floats) -> tuple[Floats, Floats]:
        c = chord[0] + v * (chord[1] - chord[0])
        t = thickness[0] + v * (thickness[1] - thickness[0])
        g = stagger[0] + v * (stagger[1] - stagger[0])
        s = u - 0.5
        if camber == 0.0:
            x, y, turn = s * c, 0.0 * s, 0.0 * s
        else:
            radius = 0.5 * c / math.sin(0.5 * camber)
            turn = -camber * s
            x, y = -radius * np.sin(turn), radius * (np.cos(turn) - math.cos(0.5 * camber))
        half = 0.5 * t * (edge + (1.0 - edge) * (1.0 - (2.0 * u - 1.0) ** 2))
        out = []
        for sign in (1.0, -1.0):
            px, py = x - sign * half * np.sin(turn), y + sign * half * np.cos(turn)
            out.append(np.stack([px * np.cos(g) - py * np.sin(g), px * np.sin(g) + py * np.cos(g), v * height], axis=1))
        return out[0], out[1]

    return ThinWall(f"blade, chord {chord[0]:g} to {chord[1]:g} mm, height {height:g} mm", surface_point)


def through_sections(
    made: Blade, edge: float, span: tuple[float, float] = (0.0, 1.0), name: str = "blade through sections"
) -> ThinWall:
    """A blade through sections as an upright wall, without its edges.

    Parameters
    ----------
    made : the two sides of the blade
    edge : share of u that is excluded at each edge, from 0 to below 0.5
    span : range of v that belongs to the wall
    name : description for messages and reports

    Raises
    ------
    InputError
        ``edge`` or ``span`` is out of range.
    """
    if not 0.0 <= edge < 0.5:
        raise InputError(f"wall.edge_share = {edge:g}: must be from 0 to below 0.5")
    if not 0.0 <= span[0] < span[1] <= 1.0:
        raise InputError(f"wall.span = {list(span)}: must rise within 0 .. 1")

    def raw(u: Floats, v: Floats) -> tuple[Floats, Floats]:
        a, b = edge + (1.0 - 2.0 * edge) * u, span[0] + (span[1] - span[0]) * v
        return made.minus.at(a, b), made.plus.at(a, b)

    def middle(u: float, v: float) -> Floats:
        low, high = raw(np.array([u]), np.array([v]))
        return np.asarray(0.5 * (low + high)[0])

    z = middle(0.5, 1.0) - middle(0.5, 0.0)
    z /= np.linalg.norm(z)
    x = middle(1.0, 0.5) - middle(0.0, 0.5)
    x -= (x @ z) * z
    x /= np.linalg.norm(x)
    turned = np.stack([x, np.cross(z, x), z])
    foot = middle(0.5, 0.0)
    low, high = raw(np.array([0.5]), np.array([0.5]))
    swap = float((turned @ (high - low)[0])[1]) > 0.0  # k+ faces -y

    def surface_point(u: Floats, v: Floats) -> tuple[Floats, Floats]:
        one, other = ((p - foot) @ turned.T for p in raw(u, v))
        return (other, one) if swap else (one, other)

    return ThinWall(name, surface_point)


def opposite(wall: ThinWall) -> ThinWall:
    """The wall, after a check that its sides lie opposite each other.

    Lines across the wall, between points of equal u, v, must lean by at most :data:`LEAN` from the normals.

    Raises
    ------
    InputError
        The lines lean by more, or the sides meet.
    """
    u, v = np.meshgrid(np.linspace(0.0, 1.0, 33), np.linspace(0.0, 1.0, 17), indexing="ij")
    minus, plus = wall.sides(u, v)
    across = plus - minus
    thick = np.linalg.norm(across, axis=-1)
    apart = thick > 0.0
    least = min(
        float((sign * (across * n).sum(axis=-1)[apart] / thick[apart]).min(initial=1.0))
        for sign, n in zip((-1.0, 1.0), wall.normals(u, v), strict=True)
    )
    lean = math.acos(max(-1.0, min(1.0, least)))
    if lean > LEAN or not apart.all():
        reason = f"lines across lean by {math.degrees(lean):.3g} deg from the normals" if lean > LEAN else "they meet"
        raise InputError(
            f"{wall.name}: not opposite each other: {reason}: must be at most {math.degrees(LEAN):g} deg, and apart: "
            "state the two sides of one wall, or a greater edge_share"
        )
    return wall
