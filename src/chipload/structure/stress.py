"""Equivalent stress in the elements of a workpiece under a force.

Notation: u [mm] displacement of the nodes, g gradients of the shape functions at the points of integration,
eps = sym(sum of u g^T), sigma = lambda tr(eps) 1 + 2 mu eps [MPa]; von Mises' sqrt(3/2 s : s), s the deviator of sigma.

Points of integration lie inside the elements: in a plate of one layer the outermost at 0.775 of half the thickness. The
stress is therefore extrapolated to the faces, by the parabola through the three points of each line through the
thickness.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from chipload.structure.grid import Indices
from chipload.structure.hexa import Array, gradients, lame
from chipload.structure.solid import SolidWorkpiece


def stresses(solid: SolidWorkpiece, u: ArrayLike, elements: Indices) -> Array:
    """Stress (m, 27, 3, 3) [MPa] at the points of integration of elements (m,), by displacements u (n, 3) [mm]."""
    nodes = solid.grid.elements[elements]
    g, _ = gradients(solid.grid.nodes[nodes], 27, solid.kept[elements], elements)
    grad = np.einsum("mnc,mpnd->mpcd", np.asarray(u, dtype=np.float64)[nodes], g)
    eps = 0.5 * (grad + np.swapaxes(grad, 2, 3))
    lam, mu = lame(solid.modulus, solid.poisson)
    return np.asarray(lam * np.trace(eps, axis1=2, axis2=3)[..., None, None] * np.eye(3) + 2.0 * mu * eps)


def mises(sigma: Array) -> Array:
    """Equivalent stress (...) of stresses (..., 3, 3).

    >>> float(mises(np.diag([100.0, 0.0, 0.0])))
    100.0
    """
    s = sigma - np.trace(sigma, axis1=-2, axis2=-1)[..., None, None] / 3.0 * np.eye(3)
    return np.asarray(np.sqrt(1.5 * (s * s).sum(axis=(-2, -1))))


def greatest(solid: SolidWorkpiece, u: ArrayLike, elements: Indices) -> float:
    """Greatest equivalent stress [MPa] of elements, at their faces through the thickness."""
    sigma = stresses(solid, u, elements).reshape(len(elements), 9, 3, 3, 3)
    low, middle, high = sigma[:, :, 0], sigma[:, :, 1], sigma[:, :, 2]
    out = 1.0 / np.sqrt(0.6)
    faces = [middle + 0.5 * sign * out * (high - low) + 0.5 * out**2 * (high + low - 2.0 * middle) for sign in (-1, 1)]
    return float(max(mises(f).max() for f in faces))
