"""Natural frequencies and mode shapes of a workpiece.

Notation: K stiffness, M consistent mass over the free degrees of freedom; K x = w^2 M x, w [rad/s]; s shift [1/s^2].

Lanczos on (K + s M)^-1 finds the lowest modes first; with s = 0 it uses the factors of the compliance. A free part has
six rigid modes of frequency 0, and needs s > 0.
"""

from __future__ import annotations

import numpy as np

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.structure.factors import factor
from chipload.structure.hexa import Array
from chipload.structure.solid import Factored, SolidWorkpiece, assemble, assemble_mass, free_dofs


def modes(part: SolidWorkpiece | Factored, count: int, shift: float = 0.0) -> tuple[Array, Array]:
    """Lowest natural frequencies and their mode shapes.

    One factorisation (none if ``part`` is factored and ``shift`` is 0), then about 3 ``count`` solutions.

    Parameters
    ----------
    part : the workpiece; factored if it is held
    count : number of modes, at least 1 and fewer than degrees of freedom
    shift : s [1/s^2], above 0 for a part that is not held; of the order of w^2 of its first elastic mode

    Returns
    -------
    frequencies : (count,) float [Hz], increasing; a rigid motion has one near 0
    shapes : (count, n, 3) float, modal mass x^T M x = 1 tonne

    Raises
    ------
    InputError
        ``count`` or ``shift`` is out of range, or the part is not held and ``shift`` is 0.
    """
    solid = part.solid if isinstance(part, Factored) else part
    free = part.free if isinstance(part, Factored) else free_dofs(solid)
    if not 1 <= count < len(free):
        raise InputError(f"modes: count = {count}: must be from 1 to {len(free) - 1}")
    if not shift >= 0.0:
        raise InputError(f"modes: shift = {shift:g}: must be at least 0")
    if shift == 0.0 and not isinstance(part, Factored):
        raise InputError("modes: shift = 0 needs a factored part; a part that is not held needs shift > 0")
    M = assemble_mass(solid)[free][:, free].tocsc()
    if isinstance(part, Factored):
        K, factors = part.stiffness, part.factors
    else:
        K = assemble(solid)[free][:, free].tocsc()
    if shift > 0.0:
        factors = factor(K + shift * M)
    inverse = scipy.sparse.linalg.LinearOperator(K.shape, matvec=factors.solve, dtype=np.float64)
    begin = np.random.default_rng(0).standard_normal(len(free))
    values, vectors = scipy.sparse.linalg.eigsh(K, k=count, M=M, sigma=-shift, OPinv=inverse, v0=begin)
    order = np.argsort(values)
    shapes = np.zeros((count, 3 * len(solid.grid.nodes)))
    shapes[:, free] = vectors[:, order].T
    return np.sqrt(np.maximum(values[order], 0.0)) / (2.0 * np.pi), shapes.reshape(count, -1, 3)
