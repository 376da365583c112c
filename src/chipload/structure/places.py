"""Places at which a force acts on the workpiece: local coordinates in an element, found from a point or on a side.

Notation: (xi, eta, zeta) in [-1, 1]^3 local place in an element; N shape functions; x the point [mm].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.structure.grid import Grid, Indices, side_axis
from chipload.structure.hexa import NODES, Array, shape, shape_gradient


@dataclass(frozen=True, eq=False)
class MeshPlaces:
    """Places on a mesh.

    Attributes
    ----------
    element : (p,) int
    local : (p, 3) float, xi, eta, zeta
    """

    element: Indices
    local: Array

    def __post_init__(self) -> None:
        self.element.setflags(write=False)
        self.local.setflags(write=False)

    def __len__(self) -> int:
        return len(self.element)


def on_side(grid: Grid, side: str, u: ArrayLike, v: ArrayLike) -> MeshPlaces:
    """Places on a side at the fractions u, v along its two directions.

    Parameters
    ----------
    side : e.g. ``"k+"``
    u, v : (p,) float in 0 .. 1, along the two other directions in the order i, j, k, counted in elements

    Raises
    ------
    InputError
        A number is outside 0 .. 1, or the side is not known.
    """
    axis, end = side_axis(side)
    a, b = np.broadcast_arrays(np.asarray(u, dtype=np.float64).ravel(), np.asarray(v, dtype=np.float64).ravel())
    along = [c for c in range(3) if c != axis]
    index = np.zeros((len(a), 3), dtype=np.int64)
    local = np.empty((len(a), 3))
    index[:, axis] = 0 if end == 0 else grid.counts[axis] - 1
    local[:, axis] = -1.0 if end == 0 else 1.0
    for c, t in zip(along, (a, b), strict=True):
        if not ((t >= 0.0) & (t <= 1.0)).all():
            raise InputError(f"side {side}: a place along {'ijk'[c]} is outside 0 .. 1")
        scaled = t * grid.counts[c]
        index[:, c] = np.minimum(scaled.astype(np.int64), grid.counts[c] - 1)
        local[:, c] = 2.0 * (scaled - index[:, c]) - 1.0
    return MeshPlaces(grid.element(*index.T), local)


def locate(grid: Grid, side: str, points: ArrayLike, tolerance: float) -> MeshPlaces:
    """Nearest places of a side to given points, by Newton steps inside the nearest faces.

    Parameters
    ----------
    points : (p, 3) float [mm]
    tolerance : greatest distance of a point from the side [mm]

    Raises
    ------
    InputError
        A point lies farther from the side than ``tolerance``.

    Notes
    -----
    The four nearest faces (by their middles and corners) are tried for each point. This suits faces whose sides have
    similar lengths. O(p log m).
    """
    x = np.atleast_2d(np.asarray(points, dtype=np.float64))
    axis, end = side_axis(side)
    numbers = np.take(np.arange(len(grid.elements)).reshape(grid.counts), end, axis=axis).ravel()
    along = [c for c in range(3) if c != axis]
    face = NODES[:, axis] == (-1.0 if end == 0 else 1.0)
    seeds = grid.nodes[grid.elements[np.ix_(numbers, np.flatnonzero(face))]]
    owner = np.repeat(np.arange(len(numbers)), seeds.shape[1])
    start = np.tile(NODES[face], (len(numbers), 1))
    tree = scipy.spatial.cKDTree(seeds.reshape(-1, 3))
    near = np.asarray(tree.query(x, k=min(12, len(owner)))[1]).reshape(len(x), -1)
    best = np.full(len(x), np.inf)
    element = np.zeros(len(x), dtype=np.int64)
    local = np.zeros((len(x), 3))
    for column in near.T:
        e, xi = numbers[owner[column]], start[column].copy()
        xyz = grid.nodes[grid.elements[e]]
        for _ in range(12):
            r = np.einsum("pn,pnc->pc", shape(xi), xyz) - x
            T = np.einsum("pnd,pnc->pdc", shape_gradient(xi), xyz)[:, along]
            step = np.linalg.solve(T @ np.swapaxes(T, 1, 2), np.einsum("pdc,pc->pd", T, r)[..., None])[..., 0]
            xi[:, along] = np.clip(xi[:, along] - step, -1.0, 1.0)
        d = np.linalg.norm(np.einsum("pn,pnc->pc", shape(xi), xyz) - x, axis=1)
        better = d < best
        best[better], element[better], local[better] = d[better], e[better], xi[better]
    farthest = int(np.argmax(best)) if len(x) else 0
    if len(x) and not best[farthest] <= tolerance:
        raise InputError(
            f"point {farthest} ({', '.join(f'{c:g}' for c in x[farthest])}) lies {best[farthest]:g} mm from "
            f"side {side}: must be within {tolerance:g} mm"
        )
    return MeshPlaces(element, local)


def on_cut(places: MeshPlaces, kept: Array, side: str) -> MeshPlaces:
    """The same places moved along the thickness to the faces after a cut.

    Parameters
    ----------
    kept : (m, 2) float, as of :class:`chipload.structure.solid.SolidWorkpiece`
    side : ``"k+"`` or ``"k-"``, the side that was cut

    Raises
    ------
    InputError
        ``side`` is another side, or an element is removed.
    """
    if side not in ("k-", "k+"):
        raise InputError(f"on_cut: side = {side!r}: must be k- or k+")
    part = kept[places.element]
    gone = places.element[part[:, 1] <= part[:, 0]]
    if len(gone):
        raise InputError(f"on_cut: element {gone[0]} is gone")
    local = places.local.copy()
    local[:, 2] = 2.0 * part[:, 1 if side == "k+" else 0] - 1.0
    return MeshPlaces(places.element, local)


def points_of(grid: Grid, places: MeshPlaces) -> Array:
    """Points (p, 3) [mm] of places."""
    return np.asarray(np.einsum("pn,pnc->pc", shape(places.local), grid.nodes[grid.elements[places.element]]))


def normals_of(grid: Grid, places: MeshPlaces, side: str) -> Array:
    """Unit normals (p, 3) of the faces in which places lie, pointing out of the body.

    Examples
    --------
    >>> from chipload.structure.grid import plate
    >>> g = plate(10.0, 10.0, 1.0, (1, 1, 1))
    >>> normals_of(g, on_side(g, "k-", 0.3, 0.4), "k-").tolist()[0][2]
    -1.0
    """
    axis, end = side_axis(side)
    T = np.einsum("pnd,pnc->pdc", shape_gradient(places.local), grid.nodes[grid.elements[places.element]])
    n = np.cross(T[:, (axis + 1) % 3], T[:, (axis + 2) % 3]) * (1.0 if end else -1.0)
    return np.asarray(n / np.linalg.norm(n, axis=1)[:, None])


def weights(grid: Grid, places: MeshPlaces) -> scipy.sparse.csr_array:
    """Shape functions at the places, sparse (p, n): they distribute a force at a place to nodes and interpolate the
    motion of the nodes at the place.
    """
    N = shape(places.local)
    rows = np.repeat(np.arange(len(places)), 20)
    out = scipy.sparse.csr_array(
        (N.ravel(), (rows, grid.elements[places.element].ravel())), shape=(len(places), len(grid.nodes))
    )
    out.eliminate_zeros()
    return out
