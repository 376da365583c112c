"""Compliance of a clamped workpiece by finite elements: one factorisation serves all forces.

Notation: n nodes, K stiffness [N/mm] over the free degrees of freedom (3 node + c), f force [N], u displacement [mm],
K u = f. N_p shape functions at a place p; compliance C_p = N_p K^-1 N_p^T (3, 3) [mm/N]; C_nn = normal . C_p normal.

K is symmetric and positive definite, so it is factored without pivots (:mod:`chipload.structure.factors`). A plate of
35,000 degrees of freedom takes about 2 s; every right-hand side after that about 10 ms.

Under a point force the displacement grows without bound as the mesh is refined, by about 1 / (E h) with the element
size h. For a thin wall this is a small part of the bending, about t^3 / (h a^2) of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.progress import Progress, silent
from chipload.structure.factors import Factors, factor
from chipload.structure.grid import Grid, Indices
from chipload.structure.hexa import Array, mass, stiffness
from chipload.structure.places import MeshPlaces, weights

#: range of Young's modulus of a workpiece [MPa]
MODULUS_RANGE = (100.0, 2e6)
#: range of the density of a workpiece [tonne/mm^3]
DENSITY_RANGE = (1e-10, 3e-8)
RIGID_MOTIONS = ("along x", "along y", "along z", "about x", "about y", "about z")


@dataclass(frozen=True, eq=False)
class SolidWorkpiece:
    """A workpiece: mesh, material, supports and remaining material.

    Parameters
    ----------
    grid : the mesh
    modulus : E [MPa], 100 .. 2e6
    poisson : nu, 0 <= nu < 0.5
    density : [tonne/mm^3], 1e-10 .. 3e-8
    fixed : (n, 3) bool, directions in which nodes are fixed; (n,) bool, nodes fixed in all three; or (k,) int, their
        numbers
    kept : (m, 2) float, the part lo .. hi of each element's thickness (along k, 0 .. 1) that remains; (0, 0): the
        element is removed. (2,) float: the same for every element
    rule : number of integration points for the stiffness, 8, 14 or 27

    Raises
    ------
    InputError
        A number is out of its range, or the arrays do not fit.
    """

    grid: Grid
    modulus: float
    poisson: float
    density: float
    fixed: NDArray[np.bool_] | Indices
    kept: Array = field(default_factory=lambda: np.array([0.0, 1.0]))
    rule: int = 27
    constrained: NDArray[np.bool_] = field(init=False)

    def __post_init__(self) -> None:
        lo, hi = MODULUS_RANGE
        if not lo <= self.modulus <= hi:
            hint = (
                "is it in GPa?"
                if self.modulus < lo
                else "is it in Pa?"
                if self.modulus > 1e9
                else "was MPa given for GPa?"
            )
            raise InputError(f"workpiece.modulus = {self.modulus:g} MPa: must be from {lo:g} to {hi:g} MPa; {hint}")
        lo, hi = DENSITY_RANGE
        if not lo <= self.density <= hi:
            hint = "is it in kg/m^3 (times 1e-12) or g/cm^3 (times 1e-9)?"
            raise InputError(f"workpiece.density = {self.density:g} tonne/mm^3: must be from {lo:g} to {hi:g}; {hint}")
        if not 0.0 <= self.poisson < 0.5:
            raise InputError(f"workpiece.poisson = {self.poisson:g}: must be at least 0 and below 0.5")
        n, m = len(self.grid.nodes), len(self.grid.elements)
        fixed = np.asarray(self.fixed)
        constrained = np.zeros((n, 3), dtype=np.bool_)
        if fixed.dtype == np.bool_ and fixed.shape in ((n,), (n, 3)):
            constrained[:] = fixed if fixed.ndim == 2 else fixed[:, None]
        elif fixed.ndim == 1 and (fixed.size == 0 or np.issubdtype(fixed.dtype, np.integer)):
            if fixed.size and not (fixed.min() >= 0 and fixed.max() < n):
                raise InputError(f"workpiece.fixed: a node outside 0 .. {n - 1}")
            constrained[fixed.astype(np.int64)] = True
        else:
            raise InputError(f"workpiece.fixed of shape {fixed.shape}: must be node numbers, ({n},) or ({n}, 3) bool")
        kept = np.array(self.kept, dtype=np.float64)
        kept = np.tile(kept, (m, 1)) if kept.shape == (2,) else kept
        if kept.shape != (m, 2):
            raise InputError(f"workpiece.kept of shape {kept.shape}: must be ({m}, 2)")
        bad = ~((kept[:, 0] >= 0.0) & (kept[:, 0] <= kept[:, 1]) & (kept[:, 1] <= 1.0))
        if bad.any():
            e = int(np.flatnonzero(bad)[0])
            raise InputError(f"workpiece.kept of element {e} = {kept[e].tolist()}: must be 0 <= lo <= hi <= 1")
        kept.setflags(write=False)
        constrained.setflags(write=False)
        object.__setattr__(self, "kept", kept)
        object.__setattr__(self, "constrained", constrained)

    @property
    def there(self) -> Indices:
        """Numbers of the elements that are not removed."""
        return np.flatnonzero(self.kept[:, 1] > self.kept[:, 0])


def element_dofs(elements: Indices) -> Indices:
    """Degrees of freedom (m, 60) of elements (m, 20)."""
    return (3 * elements[:, :, None] + np.arange(3)).reshape(len(elements), 60)


def _sum(blocks: Array, dofs: Indices, size: int) -> scipy.sparse.csc_array:
    rows = np.repeat(dofs, dofs.shape[1], axis=1).ravel()
    columns = np.tile(dofs, (1, dofs.shape[1])).ravel()
    return scipy.sparse.coo_array((blocks.ravel(), (rows, columns)), shape=(size, size)).tocsc()


def assemble(solid: SolidWorkpiece) -> scipy.sparse.csc_array:
    """Stiffness (3 n, 3 n) [N/mm] of the workpiece without its supports."""
    e = solid.there
    elements = solid.grid.elements[e]
    K = stiffness(solid.grid.nodes[elements], solid.modulus, solid.poisson, solid.rule, solid.kept[e], e)
    return _sum(K, element_dofs(elements), 3 * len(solid.grid.nodes))


def assemble_mass(solid: SolidWorkpiece) -> scipy.sparse.csc_array:
    """Consistent mass (3 n, 3 n) [tonne]."""
    e = solid.there
    elements = solid.grid.elements[e]
    M = mass(solid.grid.nodes[elements], solid.density, 27, solid.kept[e])
    dofs = element_dofs(elements).reshape(-1, 20, 3)
    rows = np.repeat(dofs, 20, axis=1).reshape(len(e), 20, 20, 3)
    columns = np.tile(dofs, (1, 20, 1)).reshape(len(e), 20, 20, 3)
    values = np.broadcast_to(M[..., None], rows.shape)
    size = 3 * len(solid.grid.nodes)
    return scipy.sparse.coo_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)).tocsc()


def free_dofs(solid: SolidWorkpiece) -> Indices:
    """Degrees of freedom that are not fixed and belong to a node of at least one element."""
    used = np.zeros(len(solid.grid.nodes), dtype=np.bool_)
    used[solid.grid.elements[solid.there]] = True
    return np.flatnonzero((used[:, None] & ~solid.constrained).ravel())


def check_clamped(solid: SolidWorkpiece) -> None:
    """Refuse a workpiece, or a piece of it, that can move as a rigid body.

    Raises
    ------
    InputError
        No element remains, or a piece can move; the message names the free rigid motions of the piece with the lowest
        element number.
    """
    e = solid.there
    if not len(e):
        raise InputError("workpiece: no element is left")
    elements = solid.grid.elements[e]
    n = len(solid.grid.nodes)
    incidence = scipy.sparse.csr_array(
        (np.ones(elements.size), elements.ravel(), np.arange(0, elements.size + 1, 20)), shape=(len(e), n)
    )
    count, piece = scipy.sparse.csgraph.connected_components(incidence @ incidence.T, directed=False)
    for number in range(count):
        mine = np.unique(elements[piece == number])
        x = solid.grid.nodes[mine] - solid.grid.nodes[mine].mean(axis=0)
        size = float(np.abs(x).max())
        motion = np.zeros((len(mine), 3, 6))
        for c in range(3):
            motion[:, c, c] = 1.0
            a, b = (c + 1) % 3, (c + 2) % 3
            motion[:, b, 3 + c], motion[:, a, 3 + c] = x[:, a] / size, -x[:, b] / size
        stopped = motion[solid.constrained[mine]]
        if len(stopped):
            values, vectors = np.linalg.eigh(stopped.T @ stopped)
        else:
            values, vectors = np.zeros(6), np.eye(6)
        loose = vectors[:, values <= 1e-9 * len(mine)]
        if loose.shape[1]:
            names = _motions(loose)
            what = "workpiece" if count == 1 else f"the piece of element {int(e[np.argmax(piece == number)])}"
            raise InputError(
                f"{what}: not held against motion {', '.join(names)}: "
                f"{loose.shape[1]} rigid {'motion is' if loose.shape[1] == 1 else 'motions are'} free; fix more nodes"
            )


def _motions(loose: Array) -> list[str]:
    """Names of free rigid motions (6, k): directions of the translations and axes of the rotations."""
    _, sizes, turned = np.linalg.svd(loose[3:])
    still = np.ones(loose.shape[1], dtype=np.bool_)
    still[: len(sizes)] = sizes <= 1e-6
    along = ((loose[:3] @ turned[still].T) ** 2).sum(axis=1)
    turning = loose[3:] @ turned[~still].T
    about = ((turning / np.linalg.norm(turning, axis=0)) ** 2).sum(axis=1)
    return [name for name, share in zip(RIGID_MOTIONS, (*along, *about), strict=True) if share > 0.1]


@dataclass(frozen=True, eq=False)
class Factored:
    """A workpiece with its factored stiffness.

    Attributes
    ----------
    solid : the workpiece
    free : (f,) int, degrees of freedom that are solved for
    stiffness : (f, f) sparse
    factors : factors of ``stiffness``
    """

    solid: SolidWorkpiece
    free: Indices
    stiffness: scipy.sparse.csc_array
    factors: Factors

    def solve(self, force: Array, rows: Indices | None = None) -> Array:
        """Displacements (f, q) [mm] of the free degrees of freedom under forces (f, q) [N], or some rows of them."""
        return self.factors.solve(force, rows)


def factorise(solid: SolidWorkpiece) -> Factored:
    """Assemble and factor; O(f^1.5) for a plate.

    Raises
    ------
    InputError
        The workpiece can move as a rigid body, or an element is inverted.
    """
    check_clamped(solid)
    free = free_dofs(solid)
    K = assemble(solid)[free][:, free].tocsc()
    return Factored(solid, free, K, factor(K))


def loads(factored: Factored, places: MeshPlaces, directions: Array) -> scipy.sparse.csc_array:
    """Unit forces at places as columns (f, p) over the free degrees of freedom.

    ``directions`` is (p, 3) float.
    """
    N = weights(factored.solid.grid, places).tocoo()
    rows, nodes = N.coords
    values = N.data[:, None] * directions[rows]
    at = (3 * nodes[:, None] + np.arange(3)).ravel()
    shape = (3 * len(factored.solid.grid.nodes), len(places))
    return (
        scipy.sparse.coo_array((values.ravel(), (at, np.repeat(rows, 3))), shape=shape).tocsr()[factored.free].tocsc()
    )


def displacement(factored: Factored, force: ArrayLike) -> Array:
    """Displacements (n, 3) [mm] under nodal forces (n, 3) [N]."""
    f = np.asarray(force, dtype=np.float64)
    if f.shape != factored.solid.grid.nodes.shape or not np.isfinite(f).all():
        raise InputError(f"force of shape {f.shape}: must be finite and of shape {factored.solid.grid.nodes.shape}")
    out = np.zeros(f.size)
    out[factored.free] = factored.solve(f.ravel()[factored.free])
    return out.reshape(f.shape)


def checked_normals(places: MeshPlaces, normals: ArrayLike) -> Array:
    """Normals as an array (p, 3); refused unless they are unit vectors, one for each place."""
    n = np.asarray(normals, dtype=np.float64)
    if n.shape != (len(places), 3) or not np.isclose(np.linalg.norm(n, axis=1), 1.0, rtol=0.0, atol=1e-6).all():
        raise InputError(f"normals of shape {n.shape}: must be unit vectors of shape ({len(places)}, 3)")
    return n


def compliance(factored: Factored, places: MeshPlaces, normals: ArrayLike, progress: Progress = silent) -> Array:
    """Normal compliance C_nn (p,) [mm/N] at places: normal displacement under a unit normal force.

    It takes one solution for each place. ``normals`` is (p, 3) float, unit vectors.

    Raises
    ------
    InputError
        The normals are not unit vectors, one for each place.
    """
    n = checked_normals(places, normals)
    F = loads(factored, places, n)
    out = np.empty(len(places))
    for at in range(0, len(places), 64):
        some = F[:, at : at + 64].toarray()
        out[at : at + 64] = np.einsum("fp,fp->p", some, factored.solve(some))
        progress(min(1.0, (at + 64) / len(places)), "compliance")
    return out


def full_compliance(factored: Factored, places: MeshPlaces, progress: Progress = silent) -> Array:
    """Compliance C_p (p, 3, 3) [mm/N] at places: displacement (first axis) under unit forces (second). Symmetric."""
    F = [loads(factored, places, np.tile(axis, (len(places), 1))) for axis in np.eye(3)]
    out = np.empty((len(places), 3, 3))
    for at in range(0, len(places), 64):
        part = slice(at, at + 64)
        some = [f[:, part].toarray() for f in F]
        for b in range(3):
            u = factored.solve(some[b])
            for a in range(3):
                out[part, a, b] = np.einsum("fp,fp->p", some[a], u)
        progress(min(1.0, (at + 64) / len(places)), "compliance")
    return 0.5 * (out + np.swapaxes(out, 1, 2))
