"""Compliance of places of a workpiece in one state of removal.

Notation: as in :mod:`chipload.structure.removal`: A and B degrees of freedom of cut elements, W columns of K^-1,
G = W at the rows B, M the correction; F forces, U = K^-1 F; d = 1 or 3 forces at each place, p places, q = p d.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.progress import Progress, silent
from chipload.structure.hexa import Array
from chipload.structure.places import MeshPlaces
from chipload.structure.removal import StructureRemoval
from chipload.structure.solid import Factored, checked_normals, loads


@dataclass(frozen=True, eq=False)
class UnitLoads:
    """Unit forces with their displacements in the base; good for every state of the same base.

    Attributes
    ----------
    base : the factorisation that they belong to
    F : (f, p d) sparse, forces; d = 1 direction at each place, or 3
    U : (r, p d) float, displacements at the rows of the region
    own : (p, d, d) float, F^T U of the forces of each place
    """

    base: Factored
    F: scipy.sparse.csc_array
    U: Array
    own: Array


def _forces(base: Factored, places: MeshPlaces, normals: ArrayLike | None) -> tuple[scipy.sparse.csc_array, int]:
    """Unit forces along the normals, or along x, y, z; and their number at each place."""
    if normals is not None:
        return loads(base, places, checked_normals(places, normals)), 1
    thrice = MeshPlaces(np.repeat(places.element, 3), np.repeat(places.local, 3, axis=0))
    return loads(base, thrice, np.tile(np.eye(3), (len(places), 1))), 3


def _shape_values(values: Array) -> Array:
    """(p,) of one direction, (p, 3, 3) of three."""
    return values[:, 0, 0] if values.shape[1] == 1 else 0.5 * (values + np.swapaxes(values, 1, 2))


def watch(
    state: StructureRemoval, places: MeshPlaces, normals: ArrayLike | None = None, progress: Progress = silent
) -> UnitLoads:
    """Solve unit forces at places once, for many states: one solution each.

    ``normals`` is (p, 3) float, unit vectors along which the forces act. None: three forces at each place, x, y, z.
    """
    F, d = _forces(state.base, places, normals)
    rows = state.columns.rows
    U = np.empty((len(rows), F.shape[1]))
    own = np.empty((len(places), d, d))
    for at in range(0, len(places), 60):
        columns = slice(at * d, (at + 60) * d)
        some = F[:, columns].toarray()
        u = state.base.solve(some)
        U[:, columns] = u[rows]
        k = some.shape[1] // d
        own[at : at + k] = np.einsum("fpa,fpb->pab", some.reshape(-1, k, d), u.reshape(-1, k, d))
        progress(min(1.0, (at + 60) / len(places)), "forces on the workpiece")
    return UnitLoads(state.base, F, U, own)


def alive(state: StructureRemoval, watched: UnitLoads) -> NDArray[np.bool_]:
    """Whether each watched place is still on material, (p,) bool."""
    return _alive(state, watched.F, watched.own.shape[1])


def _alive(state: StructureRemoval, F: scipy.sparse.csc_array, d: int) -> NDArray[np.bool_]:
    weight = np.asarray(abs(F.tocsr()[state.interior.gone]).sum(axis=0))
    return np.asarray(weight.reshape(-1, d).max(axis=1) <= 1e-12)


def compliance(state: StructureRemoval, watched: UnitLoads) -> Array:
    """Compliance of the watched places in this state [mm/N], O(b^2 p).

    Returns
    -------
    C_nn (p,) of places watched along normals; C (p, 3, 3) of those watched along x, y, z.

    Raises
    ------
    InputError
        The forces belong to another factorisation (watch them again), or one acts on material that is gone.
    """
    if watched.base is not state.base:
        raise InputError("compliance: watched before the workpiece was factored again: watch the places again")
    d = watched.own.shape[1]
    _refuse_dead(_alive(state, watched.F, d))
    U = watched.U[state.B]
    V = state.correction(U)
    b, p = len(U), len(watched.own)
    out = watched.own - np.einsum("bpi,bpj->pij", U.reshape(b, p, d), V.reshape(b, p, d))
    weight = np.asarray(abs(watched.F.tocsr()[state.interior.A]).sum(axis=0))
    on_cut = weight.reshape(-1, d).max(axis=1) > 0.0
    if on_cut.any():
        out[on_cut] = _on_cut(state, watched.F[:, np.repeat(on_cut, d)], d)
    return _shape_values(out)


def cut_compliance(state: StructureRemoval, places: MeshPlaces, normals: ArrayLike | None = None) -> Array:
    """Compliance as :func:`compliance`, at places of elements cut since the last factorisation.

    No solution in the base. For new places, e.g. on the cut faces (:func:`chipload.structure.places.on_cut`).

    Raises
    ------
    InputError
        An element was not cut, or a place is on material that is gone.
    """
    stray = places.element[~np.isin(places.element, state.interior.elements)]
    if len(stray):
        raise InputError(
            f"cut_compliance: element {stray[0]} was not cut since the last factorisation: watch the place instead"
        )
    F, d = _forces(state.base, places, normals)
    _refuse_dead(_alive(state, F, d))
    return _shape_values(_on_cut(state, F, d))


def _refuse_dead(living: NDArray[np.bool_]) -> None:
    dead = np.flatnonzero(~living)
    if len(dead):
        raise InputError(f"compliance: place {dead[0]} is on material that is gone: leave it out (see alive)")


def _on_cut(state: StructureRemoval, F: scipy.sparse.csc_array, d: int) -> Array:
    """Forces on the cut elements, by way of B; (p, d, d)."""
    rows = F.tocsr()
    f_A = rows[state.interior.A].toarray()
    u_A = state.interior.solve(f_A)
    g = rows[state.columns.rows[state.B]].toarray() - state.interior.K_BA @ u_A
    G = state.columns.W[np.ix_(state.columns.place[state.B], state.B)]
    u_B = G @ g
    shape = (-1, F.shape[1] // d, d)
    own = np.einsum("api,apj->pij", f_A.reshape(shape), u_A.reshape(shape))
    return np.asarray(own + np.einsum("bpi,bpj->pij", (g - state.correction(u_B)).reshape(shape), u_B.reshape(shape)))
