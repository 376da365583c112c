"""Structured meshes of a plate or a blade: 20-node hexahedra in rows, columns and layers.

Notation: I, J, K elements along i (length), j (height), k (thickness). The half grid has (2 I + 1, 2 J + 1, 2 K + 1)
places; those with at most one odd index are nodes (20 an element). Element (i, j, k) has the number (i J + j) K + k.
Sides are ``"i-" "i+" "j-" "j+" "k-" "k+"``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.structure.hexa import NODES, Array

Indices = NDArray[np.int64]

SIDES = ("i-", "i+", "j-", "j+", "k-", "k+")


@dataclass(frozen=True, eq=False)
class Grid:
    """A structured mesh of 20-node hexahedra.

    Attributes
    ----------
    nodes : (n, 3) float [mm]
    elements : (m, 20) int, order of :mod:`chipload.structure.hexa`
    lattice : (2 I + 1, 2 J + 1, 2 K + 1) int, number of the node at each place of the half grid; -1 where there is none
    """

    nodes: Array
    elements: Indices
    lattice: Indices

    def __post_init__(self) -> None:
        for a in (self.nodes, self.elements, self.lattice):
            a.setflags(write=False)

    @property
    def counts(self) -> tuple[int, int, int]:
        """Elements along i, j, k."""
        a, b, c = self.lattice.shape
        return a // 2, b // 2, c // 2

    def element(self, i: Indices | int, j: Indices | int, k: Indices | int) -> Indices:
        """Number of the element in row i, column j, layer k."""
        return np.asarray(np.ravel_multi_index((i, j, k), self.counts), dtype=np.int64)

    def side(self, name: str) -> Indices:
        """Nodes of one side, e.g. ``"j-"``."""
        axis, end = side_axis(name)
        found = np.take(self.lattice, end, axis=axis).ravel()
        return np.asarray(found[found >= 0])


def side_axis(name: str) -> tuple[int, int]:
    """Axis (0, 1, 2) of a side and which end of it it is (0 or -1)."""
    if name not in SIDES:
        raise InputError(f"side = {name!r}: must be one of {', '.join(SIDES)}")
    return "ijk".index(name[0]), 0 if name[1] == "-" else -1


def from_half_grid(points: Array) -> Grid:
    """Mesh of points that hold the middles of the edges too.

    Parameters
    ----------
    points : (2 I + 1, 2 J + 1, 2 K + 1, 3) float [mm]; places with two or three odd indices are not read

    Raises
    ------
    InputError
        The shape does not fit, or a point that is read is not finite.

    Examples
    --------
    >>> g = from_half_grid(np.stack(np.meshgrid(*[np.arange(3.0)] * 3, indexing="ij"), axis=-1))
    >>> g.nodes.shape, g.elements.shape
    ((20, 3), (1, 20))
    """
    points = np.asarray(points, dtype=np.float64)
    if points.ndim != 4 or points.shape[3] != 3 or any(s < 3 or s % 2 == 0 for s in points.shape[:3]):
        raise InputError(f"mesh: points of shape {points.shape}: must be (2 I + 1, 2 J + 1, 2 K + 1, 3), I, J, K >= 1")
    index = np.indices(points.shape[:3])
    is_node = (index % 2).sum(axis=0) <= 1
    nodes = points[is_node]
    if not np.isfinite(nodes).all():
        raise InputError("mesh: a point is not finite")
    lattice = np.full(points.shape[:3], -1, dtype=np.int64)
    lattice[is_node] = np.arange(len(nodes))
    first = np.indices((len(points) // 2, points.shape[1] // 2, points.shape[2] // 2)).reshape(3, -1).T
    corner = 2 * first[:, None, :] + 1
    i, j, k = np.moveaxis(corner + NODES.astype(np.int64), -1, 0)
    return Grid(nodes, lattice[i, j, k], lattice)


def from_map(u: Sequence[float], v: Sequence[float], w: Sequence[float], place: Callable[[Array], Array]) -> Grid:
    """Mesh whose corners and middles of edges lie on the caller's map.

    Parameters
    ----------
    u, v, w : breaks of the parameters along i, j, k, increasing, at least two each; the middle of an edge is at the
        middle of its parameters
    place : (p, 3) float parameters -> (p, 3) float [mm], right-handed

    Raises
    ------
    InputError
        Too few breaks, or breaks that do not increase.
    """
    half = []
    for name, breaks in zip("uvw", (u, v, w), strict=True):
        b = np.asarray(breaks, dtype=np.float64)
        if b.ndim != 1 or len(b) < 2 or not (np.diff(b) > 0.0).all():
            raise InputError(f"mesh: breaks {name}: must be at least two numbers that increase")
        fine = np.empty(2 * len(b) - 1)
        fine[::2], fine[1::2] = b, 0.5 * (b[1:] + b[:-1])
        half.append(fine)
    parameters = np.stack(np.meshgrid(*half, indexing="ij"), axis=-1)
    return from_half_grid(np.asarray(place(parameters.reshape(-1, 3))).reshape(parameters.shape))


def from_points(points: Array) -> Grid:
    """Mesh of corner points alone; middles of edges on the polynomial through the four nearest points of the line.

    With three points on a line it is a parabola, with two a straight edge. Exact for lines of third degree.

    Parameters
    ----------
    points : (I + 1, J + 1, K + 1, 3) float [mm], e.g. sections of a blade: i along the chord, j along the span, k
        through the thickness; right-handed
    """
    half = np.asarray(points, dtype=np.float64)
    if half.ndim != 4 or half.shape[3] != 3 or min(half.shape[:3]) < 2:
        raise InputError(f"mesh: points of shape {half.shape}: must be (I + 1, J + 1, K + 1, 3) with I, J, K >= 1")
    for axis in range(3):
        half = _with_middles(half, axis)
    return from_half_grid(half)


def _with_middles(points: Array, axis: int) -> Array:
    """Put a point between each two along one axis."""
    p = np.moveaxis(points, axis, 0)
    n = len(p)
    out = np.empty((2 * n - 1, *p.shape[1:]))
    out[::2] = p
    if n == 2:
        out[1] = 0.5 * (p[0] + p[1])
    elif n == 3:
        out[1] = (3.0 * p[0] + 6.0 * p[1] - p[2]) / 8.0
        out[3] = (3.0 * p[2] + 6.0 * p[1] - p[0]) / 8.0
    else:
        out[3:-2:2] = (9.0 * (p[1:-2] + p[2:-1]) - p[:-3] - p[3:]) / 16.0
        out[1] = (5.0 * p[0] + 15.0 * p[1] - 5.0 * p[2] + p[3]) / 16.0
        out[-2] = (5.0 * p[-1] + 15.0 * p[-2] - 5.0 * p[-3] + p[-4]) / 16.0
    return np.moveaxis(out, 0, axis)


def plate(length: float, height: float, thickness: float, counts: tuple[int, int, int]) -> Grid:
    """Flat plate: x along i 0 .. length, y along j 0 .. height, z along k 0 .. thickness [mm].

    Examples
    --------
    >>> plate(100.0, 60.0, 2.0, (4, 3, 1)).nodes.shape
    (122, 3)
    """
    size = np.array([length, height, thickness], dtype=np.float64)
    if not ((size > 0.0) & np.isfinite(size)).all() or min(counts) < 1:
        raise InputError(
            f"plate: length_mm, height_mm, thickness_mm = {length:g}, {height:g}, {thickness:g}, counts = {counts}: "
            "must be above 0"
        )
    u, v, w = (np.linspace(0.0, 1.0, c + 1) for c in counts)
    return from_map(u.tolist(), v.tolist(), w.tolist(), lambda p: p * size)
