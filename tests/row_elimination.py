"""How far places give way while a wall is cut row by row: eliminated from both sides, joined where the cutter is.

Notation: rows 0 .. J - 1 of elements along one direction of the mesh, planes 0 .. J between them; whole rows are cut,
row J - 1 first. State c: the c last rows are as after the pass, the others as before it. L_r [N/mm] stiffness of
the rows below plane r as they were, U_r of those above it as they become, condensed on the plane; f forces at places, g
what they are on the plane, own their compliance while the plane is held.

The part below a plane knows nothing of the cut, the part above has it behind it. So both are eliminated once, row by
row towards each other (e: a plane with the row beside it, n: the next plane),

    S_n = K_nn - K_ne K_ee^-1 K_en,  g_n = f_n - K_ne K_ee^-1 f_e,  own += f_e^T K_ee^-1 f_e,

and every state is one join: C = own + g^T (L_r + U_r)^-1 g at r = J - c. A state costs O(b^3 / 3 + b^2 q) for b degrees
of freedom of a plane, whatever the rank of the cut is; a row O(4 b^3) once, on each side. A low-rank correction of a
whole row (:mod:`chipload.structure.removal`) has a rank of b and more.

Reference: [Przemieniecki1963] for parts that are condensed on what they share.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import LinAlgError, cholesky, solve_triangular
from scipy.linalg.blas import dsyrk
from scipy.sparse import coo_array

from chipload.errors import InputError
from chipload.progress import Progress, silent
from chipload.structure.factors import SMALLEST_PIVOT
from chipload.structure.grid import Indices, side_axis
from chipload.structure.hexa import Array, shape, stiffness
from chipload.structure.places import MeshPlaces
from chipload.structure.solid import SolidWorkpiece, check_clamped, checked_normals, element_dofs


@dataclass(frozen=True, eq=False)
class CondensedPart:
    """The rows on one side of a plane, condensed on it.

    Attributes
    ----------
    dofs : (a,) int, degrees of freedom of the plane that the part has
    S : (a, a) float [N/mm]
    g : (a, p d) float, unit forces in the part as they act on the plane
    own : (p, d, d) float [mm/N], compliance while the plane is held; 0 of places elsewhere
    """

    dofs: Indices
    S: Array
    g: Array
    own: Array


def row_compliances(
    before: SolidWorkpiece,
    after: ArrayLike,
    places: MeshPlaces,
    normals: ArrayLike | None = None,
    *,
    side: str,
    cut: ArrayLike | None = None,
    places_after: MeshPlaces | None = None,
    progress: Progress = silent,
) -> Array:
    """Compliance of places in the states of a pass that takes row after row.

    Parameters
    ----------
    before : the workpiece before the pass
    after : (m, 2) float, what is kept of each element after it, as in :class:`chipload.structure.solid.Solid`
    places : where it is asked for
    normals : (p, 3) float, unit; None: along x, y and z
    side : from which it is cut: ``"j+"``: the last row along j first
    cut : (c,) int, numbers of rows that are cut, rising; None: 0 .. J, all states
    places_after : the same places once their row is cut, e.g. on the face that the cut leaves
        (:func:`chipload.structure.places.on_cut`); None: as before

    Returns
    -------
    (c, p) float [mm/N], or (c, p, 3, 3) without normals.

    Raises
    ------
    InputError
        Material comes back, a place is on material that is gone, the workpiece or a piece of it is loose.
    """
    grid = before.grid
    axis, end = side_axis(side)
    J = grid.counts[axis]
    states = np.arange(J + 1) if cut is None else np.asarray(cut, dtype=np.int64)
    if not (len(states) and states[0] >= 0 and states[-1] <= J and (np.diff(states) > 0).all()):
        raise InputError(f"row_compliances: cut must rise within 0 .. {J}, the rows along {side[0]}")
    done = replace(before, kept=np.asarray(after, dtype=np.float64))
    _check(before, done)
    later = places if places_after is None else places_after
    directions = np.tile(np.eye(3), (len(places), 1, 1))
    if normals is not None:
        directions = checked_normals(places, normals)[:, None]
    numbers = np.moveaxis(np.arange(len(grid.elements)).reshape(grid.counts), axis, 0).reshape(J, -1)
    lattice = np.moveaxis(grid.lattice, axis, 0).reshape(2 * J + 1, -1)
    if end == 0:
        lattice, numbers = lattice[::-1], numbers[::-1]
    planes = J - states
    low, high = int(planes.min()), int(planes.max())
    total = high + J - low
    above: dict[int, CondensedPart] = {}
    for count, (plane, part) in enumerate(_parts(done, later, directions, lattice[::-1], numbers[::-1], J - low)):
        progress(count / max(total, 1), "rows from above")
        if J - plane in planes:
            above[J - plane] = part
    out = np.empty((len(states), len(places), *directions.shape[1:2] * 2))
    for count, (plane, part) in enumerate(_parts(before, places, directions, lattice, numbers, high)):
        progress((J - low + count) / max(total, 1), "rows from below")
        if plane in above:
            out[np.flatnonzero(planes == plane)[0]] = _joined(part, above.pop(plane))
    return out[:, :, 0, 0] if normals is not None else out


def _check(before: SolidWorkpiece, done: SolidWorkpiece) -> None:
    empty = done.kept[:, 0] >= done.kept[:, 1]
    back = ~empty & ((done.kept[:, 0] < before.kept[:, 0]) | (done.kept[:, 1] > before.kept[:, 1]))
    if back.any():
        e = int(np.flatnonzero(back)[0])
        raise InputError(
            f"row_compliances: element {e} keeps {done.kept[e].tolist()} of its thickness, had "
            f"{before.kept[e].tolist()}: material cannot come back"
        )
    for solid in (before, done):
        check_clamped(solid)


def _parts(
    solid: SolidWorkpiece, places: MeshPlaces, directions: Array, lattice: Indices, numbers: Indices, last: int
) -> Iterator[tuple[int, CondensedPart]]:
    """Rows 0, 1, .. on top of one another, condensed on planes 0, 1, .. ``last``."""
    p, d = directions.shape[:2]
    row_of = np.empty(numbers.size, dtype=np.int64)
    row_of[numbers.ravel()] = np.repeat(np.arange(len(numbers)), numbers.shape[1])
    part = CondensedPart(np.zeros(0, np.int64), np.zeros((0, 0)), np.zeros((0, p * d)), np.zeros((p, d, d)))
    yield 0, part
    for row in range(last):
        part = _eliminated(solid, part, lattice[2 * row + 2], numbers[row], places, directions, row_of == row)
        yield row + 1, part


def _eliminated(
    solid: SolidWorkpiece,
    part: CondensedPart,
    plane: Indices,
    row: Indices,
    places: MeshPlaces,
    directions: Array,
    here: NDArray[np.bool_],
) -> CondensedPart:
    """The part with one row more, condensed on the next plane."""
    grid = solid.grid
    there = row[solid.kept[row, 1] > solid.kept[row, 0]]
    free = ~solid.constrained.ravel()
    mine = element_dofs(grid.elements[there])
    touched = np.unique(mine[free[mine]])
    far = np.isin(touched // 3, plane)
    a = len(part.dofs)
    dofs = np.concatenate([part.dofs, np.setdiff1d(touched[~far], part.dofs), touched[far]])
    e = len(dofs) - int(far.sum())
    number = np.full(free.size, -1, dtype=np.int64)
    number[dofs] = np.arange(len(dofs))
    K = _dense(solid, there, number[mine], len(dofs))
    K[:a, :a] += part.S
    p, d = directions.shape[:2]
    f = np.zeros((len(dofs), p * d))
    f[:a] = part.g
    own = part.own.copy()
    inside = np.flatnonzero(here[places.element])
    gone = inside[~np.isin(places.element[inside], there)]
    if len(gone):
        raise InputError(f"row_compliances: place {gone[0]} is on material that is gone: leave it out")
    at = number[element_dofs(grid.elements[places.element[inside]])].reshape(-1, 20, 3)
    loads = shape(places.local[inside])[:, None, :, None] * directions[inside][:, :, None, :]
    k, c, node, axis = np.nonzero(np.broadcast_to((at >= 0)[:, None], loads.shape))
    np.add.at(f, (at[k, node, axis], inside[k] * d + c), loads[k, c, node, axis])
    if e:
        lower = _factor(K[:e, :e], int(row[0]))
        Y = solve_triangular(lower, K[:e, e:], lower=True, check_finite=False, overwrite_b=True)
        y = solve_triangular(lower, f[:e], lower=True, check_finite=False)
        own += _blocks(y, p, d)
        return CondensedPart(dofs[e:], K[e:, e:] - _square(Y), f[e:] - Y.T @ y, own)
    return CondensedPart(dofs, K, f, own)


def _joined(below: CondensedPart, above: CondensedPart) -> Array:
    """Compliance (p, d, d) of both parts on their plane."""
    dofs = np.union1d(below.dofs, above.dofs)
    K, g = np.zeros((len(dofs), len(dofs))), np.zeros((len(dofs), below.g.shape[1]))
    for part in (below, above):
        at = np.searchsorted(dofs, part.dofs)
        K[np.ix_(at, at)] += part.S
        g[at] += part.g
    own = below.own + above.own
    if not len(dofs):
        return own
    y = solve_triangular(_factor(K, None), g, lower=True, check_finite=False)
    return np.asarray(own + _blocks(y, len(own), own.shape[1]))


def _blocks(y: Array, p: int, d: int) -> Array:
    """(p, d, d) squares of the columns of each place."""
    three = y.reshape(len(y), p, d)
    return np.asarray(np.einsum("api,apj->pij", three, three))


def _square(Y: Array) -> Array:
    """Y^T Y, half of which is computed."""
    if not Y.shape[1]:
        return np.zeros((0, 0))
    half = dsyrk(1.0, Y, trans=1, lower=1)
    return np.asarray(half + np.tril(half, -1).T)


def _factor(K: Array, element: int | None) -> Array:
    """Lower Cholesky factor; refused where a pivot is too small for what it came from."""
    at = "the workpiece" if element is None else f"the row of element {element}"
    try:
        lower = cholesky(K, lower=True, check_finite=False)
    except LinAlgError:
        raise InputError(f"stiffness: {at} hangs on a hinge of nodes or hardly at all") from None
    ratio = float((lower.diagonal() ** 2 / K.diagonal()).min()) if len(K) else math.inf
    if not ratio > SMALLEST_PIVOT:
        raise InputError(
            f"stiffness: smallest pivot {ratio:.1e} of its diagonal, must be above {SMALLEST_PIVOT:.1e}: {at} hangs on "
            "a hinge of nodes or hardly at all"
        )
    return np.asarray(lower)


def _dense(solid: SolidWorkpiece, elements: Indices, at: Indices, size: int) -> Array:
    """Stiffness (size, size) of elements; ``at`` (m, 60) int the rows of their degrees of freedom, -1: held."""
    xyz = solid.grid.nodes[solid.grid.elements[elements]]
    K = stiffness(xyz, solid.modulus, solid.poisson, solid.rule, solid.kept[elements], elements)
    rows, columns = np.repeat(at, 60, axis=1).ravel(), np.tile(at, (1, 60)).ravel()
    free = (rows >= 0) & (columns >= 0)
    return np.asarray(coo_array((K.ravel()[free], (rows[free], columns[free])), shape=(size, size)).toarray())
