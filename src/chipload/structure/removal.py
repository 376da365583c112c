"""Compliance of the workpiece while it is cut: the factors of the first state, corrected by a small dense system.

Notation: f free degrees of freedom; K stiffness at the last factorisation (the base), K' = K + dK the present one.
Elements that were cut since the base touch the degrees of freedom A, which belong to no other element, and B, which
they share with the rest; b = |B| is the rank. S = K_BB - K_BA K_AA^-1 K_AB of the cut elements alone, before (S) and
after (S'); D = S' - S. P_B unit columns; W = K^-1 P_B, G = P_B^T W; F forces, U = K^-1 F; M = (I + D G)^-1 D.

The cut elements are condensed on B, so any change of them (thinned or removed) has rank b. By Woodbury,
without an inverse of D, forces away from A have

    F^T K'^-1 F = F^T U - U_B^T M U_B,

and a force on the cut elements, f_A and f_B, is carried to B: g = f_B - K'_BA K'_AA^-1 f_A,

    F^T K'^-1 F = f_A^T K'_AA^-1 f_A + g^T (G - G M G) g,

without any solution in the base. Each column of W costs one solution and is stored. After that a state costs
O(b^3 + b^2 q) for q forces, independent of f. ``prepare`` solves the columns in advance, so that the states along a
pass require dense algebra only. When b exceeds ``limit`` the workpiece is factored again.

Valid while every piece is supported (checked at each cut). A slice thinner than a thousandth of its element loses
digits: the shape functions of the element are then stretched a thousand times. Remove such an element. Neighbours
share their nodes whatever remains of them: two that are cut from opposite sides until their slices do not meet are
still connected.

Reference: [Hager1989] for the formula and its history.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.progress import Progress, silent
from chipload.structure.factors import Factors, factor
from chipload.structure.grid import Indices
from chipload.structure.hexa import Array, stiffness
from chipload.structure.solid import Factored, SolidWorkpiece, check_clamped, element_dofs, factorise

#: rank at which the workpiece is factored again, over sqrt(f); see benchmarks/structure.py
LIMIT_FACTOR = 5.0

#: pivot of I + D G below which it counts as zero: no cut makes a workpiece 10^9 times softer
SMALLEST_PIVOT = 1e-9


@dataclass(frozen=True, eq=False)
class SolvedColumns:
    """Columns of K^-1 that were solved, at the rows of interest.

    Attributes
    ----------
    rows : (r,) int, free degrees of freedom of the region, increasing
    known : (c,) int, which degree of freedom each column belongs to, as a number in ``rows``
    place : (r,) int, the column of each row; -1: not known
    W : (c, r) float, one column of K^-1 a row
    """

    rows: Indices
    known: Indices
    place: Indices
    W: Array


@dataclass(frozen=True, eq=False)
class CutElements:
    """The cut elements, condensed on their shared degrees of freedom.

    Attributes
    ----------
    A : (a,) int, free degrees of freedom of the base that belong to cut elements only and still lie on material
    gone : (g,) int, those that no longer lie on material
    elements : (e,) int, the elements that were cut since the base
    K_BA : (b, a) sparse, K' between B and A
    factors : of K'_AA; None: A is empty
    """

    A: Indices
    gone: Indices
    elements: Indices
    K_BA: scipy.sparse.csc_array
    factors: Factors | None

    def solve(self, force: Array) -> Array:
        """K'_AA^-1 times (a, q)."""
        return force if self.factors is None else self.factors.solve(force)


@dataclass(frozen=True, eq=False)
class StructureRemoval:
    """A workpiece in one state of its removal.

    Attributes
    ----------
    solid : the workpiece in its present state
    base : its last factorisation
    region : (e,) int, elements that may be cut
    columns : the known columns of K^-1
    B : (b,) int, rows of ``columns``
    D : (b, b) float [N/mm]
    lu : factors of I + D G, as :func:`scipy.linalg.lu_factor` gives them
    interior : the cut elements
    limit : greatest rank before the workpiece is factored again
    factorisations : number of factorisations so far
    """

    solid: SolidWorkpiece
    base: Factored
    region: Indices
    columns: SolvedColumns
    B: Indices
    D: Array
    lu: tuple[Array, NDArray[np.int32]]
    interior: CutElements
    limit: int
    factorisations: int = 1

    def correction(self, U: Array) -> Array:
        """M U (b, q) [N/mm] of displacements (b, q) of B in the base."""
        return np.asarray(scipy.linalg.lu_solve(self.lu, self.D @ U, check_finite=False)) if len(self.B) else U

    @property
    def rank(self) -> int:
        """Size b of the correction."""
        return len(self.B)


def start(
    solid: SolidWorkpiece | Factored, region: ArrayLike | None = None, limit: int | None = None
) -> StructureRemoval:
    """Start the removal with the present state of a workpiece.

    Parameters
    ----------
    solid : the workpiece, factored or not
    region : (e,) int, elements that may be cut; None: all. Fewer elements need less memory: 60 e values per column
    limit : greatest rank before the workpiece is factored again; None: 5 sqrt(f)

    Raises
    ------
    InputError
        The workpiece can move as a rigid body, or an element of ``region`` does not exist.
    """
    base = solid if isinstance(solid, Factored) else factorise(solid)
    m = len(base.solid.grid.elements)
    chosen = np.arange(m) if region is None else np.unique(np.asarray(region, dtype=np.int64))
    if len(chosen) and not (chosen[0] >= 0 and chosen[-1] < m):
        raise InputError(f"removal.region: an element outside 0 .. {m - 1}")
    if limit is None:
        limit = math.ceil(LIMIT_FACTOR * math.sqrt(len(base.free)))
    return _fresh(base, chosen, limit, 1)


def _fresh(base: Factored, region: Indices, limit: int, factorisations: int) -> StructureRemoval:
    rows = _rows(base, region)
    columns = SolvedColumns(rows, np.zeros(0, np.int64), np.full(len(rows), -1), np.zeros((0, len(rows))))
    none = np.zeros(0, dtype=np.int64)
    interior = CutElements(none, none, none, scipy.sparse.csc_array((0, 0)), None)
    return StructureRemoval(
        base.solid,
        base,
        region,
        columns,
        none,
        np.zeros((0, 0)),
        (np.zeros((0, 0)), np.zeros(0, np.int32)),
        interior,
        limit,
        factorisations,
    )


def _rows(base: Factored, elements: Indices) -> Indices:
    """Free degrees of freedom of elements, as indices into ``base.free``."""
    number = np.full(3 * len(base.solid.grid.nodes), -1, dtype=np.int64)
    number[base.free] = np.arange(len(base.free))
    found = np.unique(number[element_dofs(base.solid.grid.elements[elements])])
    return found[found >= 0]


def prepare(
    state: StructureRemoval, elements: ArrayLike | None = None, progress: Progress = silent
) -> StructureRemoval:
    """Solve the columns of elements before they are cut. ``elements``: (e,) int; None: the whole region."""
    chosen = state.region if elements is None else np.asarray(elements, dtype=np.int64)
    wanted = np.searchsorted(state.columns.rows, _rows(state.base, chosen))
    return replace(state, columns=_with_columns(state.columns, state.base, wanted, progress))


def _with_columns(
    columns: SolvedColumns, base: Factored, wanted: Indices, progress: Progress = silent
) -> SolvedColumns:
    new = wanted[columns.place[wanted] < 0]
    if not len(new):
        return columns
    W = np.empty((len(new), len(columns.rows)))
    for at in range(0, len(new), 64):
        some = columns.rows[new[at : at + 64]]
        unit = np.zeros((len(base.free), len(some)))
        unit[some, np.arange(len(some))] = 1.0
        W[at : at + 64] = base.solve(unit, columns.rows).T
        progress(min(1.0, (at + 64) / len(new)), "columns of the compliance")
    place = columns.place.copy()
    place[new] = len(columns.known) + np.arange(len(new))
    return SolvedColumns(columns.rows, np.concatenate([columns.known, new]), place, np.concatenate([columns.W, W]))


def cut(
    state: StructureRemoval, elements: ArrayLike, kept: ArrayLike = (0.0, 0.0), progress: Progress = silent
) -> StructureRemoval:
    """Remove material from elements.

    Parameters
    ----------
    elements : (e,) int, in the region
    kept : (2,) or (e, 2) float, the part lo .. hi of the thickness (along k, 0 .. 1) that remains: (0, 1 - x) for
        an element thinned by x from the side k+; (0, 0): the element is removed

    Raises
    ------
    InputError
        An element is not in the region, material would come back, or a piece would be loose.
    """
    e = np.atleast_1d(np.asarray(elements, dtype=np.int64))
    stray = e[~np.isin(e, state.region)]
    if len(stray):
        raise InputError(f"cut: element {stray[0]} is not in the region of this removal")
    now = state.solid.kept.copy()
    new = np.broadcast_to(np.asarray(kept, dtype=np.float64), (len(e), 2))
    empty = new[:, 0] >= new[:, 1]
    back = ~empty & ((new[:, 0] < now[e, 0]) | (new[:, 1] > now[e, 1]))
    if back.any():
        k = int(np.flatnonzero(back)[0])
        raise InputError(
            f"cut: element {e[k]} keeps {new[k].tolist()} of its thickness, had {now[e[k]].tolist()}: material cannot "
            "come back"
        )
    now[e] = np.where(empty[:, None], 0.0, new)
    solid = replace(state.solid, kept=now)
    check_clamped(solid)
    touched, rest, before, after = _cut_elements(state.base, solid)
    B, A = np.flatnonzero(rest), np.flatnonzero(~rest)
    if len(B) > state.limit or len(A) > 0.5 * len(state.base.free):
        return _fresh(factorise(solid), state.region, state.limit, state.factorisations + 1)
    gone = after.diagonal()[A] == 0.0
    live = A[~gone]
    D = after[B][:, B].toarray() - before[B][:, B].toarray()
    if len(A):
        D += before[B][:, A] @ factor(before[A][:, A].tocsc()).solve(before[A][:, B].toarray())
    K_BA = after[B][:, live].tocsc()
    interior = CutElements(
        touched[live],
        touched[A[gone]],
        np.flatnonzero((now != state.base.solid.kept).any(axis=1)),
        K_BA,
        factor(after[live][:, live].tocsc()) if len(live) else None,
    )
    if len(live):
        D -= K_BA @ interior.solve(K_BA.T.toarray())
    at = np.searchsorted(state.columns.rows, touched[B])
    columns = _with_columns(state.columns, state.base, at, progress)
    G = columns.W[np.ix_(columns.place[at], at)]
    D = 0.5 * (D + D.T)
    within = D @ G
    within[np.diag_indices(len(B))] += 1.0
    lu = scipy.linalg.lu_factor(within, overwrite_a=True, check_finite=False) if len(B) else state.lu
    pivot = float(abs(lu[0].diagonal()).min()) if len(B) else 1.0
    if not pivot > SMALLEST_PIVOT:
        raise InputError(
            f"cut: smallest pivot {pivot:.1e}, must be above {SMALLEST_PIVOT:.1e}: a piece of the workpiece would hang "
            "on a hinge of nodes or hardly at all"
        )
    return replace(state, solid=solid, columns=columns, B=at, D=D, lu=lu, interior=interior)


def _cut_elements(
    base: Factored, solid: SolidWorkpiece
) -> tuple[Indices, NDArray[np.bool_], scipy.sparse.csc_array, scipy.sparse.csc_array]:
    """Cut elements: their free degrees of freedom, which other elements share, stiffness before and after."""
    differs = (base.solid.kept != solid.kept).any(axis=1)
    e = np.flatnonzero(differs)
    elements = solid.grid.elements[e]
    touched = _rows(base, e)
    number = np.full(3 * len(solid.grid.nodes), -1, dtype=np.int64)
    number[base.free[touched]] = np.arange(len(touched))
    dofs = number[element_dofs(elements)]
    rows, columns = np.repeat(dofs, 60, axis=1).ravel(), np.tile(dofs, (1, 60)).ravel()
    free = (rows >= 0) & (columns >= 0)
    xyz = solid.grid.nodes[elements]

    def sum_kept(kept: Array) -> scipy.sparse.csc_array:
        K = np.zeros((len(e), 60, 60))
        part = kept[:, 1] > kept[:, 0]
        K[part] = stiffness(xyz[part], solid.modulus, solid.poisson, solid.rule, kept[part], e[part])
        size = (len(touched), len(touched))
        return scipy.sparse.coo_array((K.ravel()[free], (rows[free], columns[free])), shape=size).tocsc()

    other = np.zeros(len(solid.grid.nodes), dtype=np.bool_)
    other[solid.grid.elements[~differs & (solid.kept[:, 1] > solid.kept[:, 0])]] = True
    return touched, other[base.free[touched] // 3], sum_kept(base.solid.kept[e]), sum_kept(solid.kept[e])
