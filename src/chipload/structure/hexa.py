"""Shape functions, stiffness and mass of 20-node hexahedra, many elements at once.

Notation: m elements, 20 nodes each, (xi, eta, zeta) in [-1, 1]^3 the local place, N_i shape functions, J = dx/dxi;
g_i = dN_i/dx [1/mm]; lambda, mu [MPa] Lame's constants; kept (lo, hi) the remaining part of the thickness, as
fractions 0 .. 1 along zeta. Degrees of freedom of an element are node by node: 3 i + c.

Nodes: 0-3 corners at zeta = -1 counter-clockwise from (-1, -1), 4-7 those at zeta = 1, 8-11 and 12-15 the middles of
the edges after each corner at zeta = -1 and 1, 16-19 those of the edges along zeta: the order of C3D20 in CalculiX.

The shape functions of the element span the same space under zeta -> a zeta + b. So an element that has lost a slice of
its thickness is integrated over the rest with its first shape functions. For a flat plate this is the thinner element
exactly; next to an uncut neighbour there is a step, still conforming. No node moves.

Reference: [Zienkiewicz2005] ch. 4 to 6; the rule of 14 points is that of [Irons1971].
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError

Array = NDArray[np.float64]

#: local places of the nodes
NODES: Array = np.array(
    [
        *([-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]),
        *([0, -1, -1], [1, 0, -1], [0, 1, -1], [-1, 0, -1], [0, -1, 1], [1, 0, 1], [0, 1, 1], [-1, 0, 1]),
        *([-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]),
    ],
    dtype=np.float64,
)
NODES.setflags(write=False)

#: rules of integration: points in all
RULES = (8, 14, 27)

_CHUNK = 256


def gauss(points: int = 27) -> tuple[Array, Array]:
    """Places and weights of a rule on [-1, 1]^3, exact for degree 3 (8 points) or 5 (14 and 27).

    Parameters
    ----------
    points : 8, 14 or 27. 27 never gives a spurious motion; 8 is softer in bending of flat elements and may

    Returns
    -------
    places (points, 3) float, weights (points,) float whose sum is 8.

    Raises
    ------
    InputError
        No such rule.

    Examples
    --------
    >>> x, w = gauss(14)
    >>> round(float(w @ x[:, 0] ** 4), 12) == 1.6
    True
    """
    if points not in RULES:
        raise InputError(f"gauss: points = {points}: must be one of 8, 14, 27")
    if points == 14:
        a, b = np.sqrt(19.0 / 30.0), np.sqrt(19.0 / 33.0)
        places = np.array([*(s * a * e for e in np.eye(3) for s in (-1.0, 1.0)), *itertools.product((-b, b), repeat=3)])
        return places, np.repeat([320.0 / 361.0, 121.0 / 361.0], [6, 8])
    x, w = np.polynomial.legendre.leggauss(2 if points == 8 else 3)
    return np.array(list(itertools.product(x, repeat=3))), np.einsum("a,b,c->abc", w, w, w).ravel()


def shape(local: Array) -> Array:
    """Shape functions N (p, 20) at local places (p, 3); they add up to 1.

    Examples
    --------
    >>> shape(np.zeros((1, 3)))[0, [0, 8]].tolist()
    [-0.25, 0.25]
    """
    f = 1.0 + local[:, None, :] * NODES
    out = np.empty(f.shape[:2])
    out[:, :8] = 0.125 * f[:, :8].prod(axis=2) * (f[:, :8].sum(axis=2) - 5.0)
    for i in range(8, 20):
        c = int(np.flatnonzero(NODES[i] == 0.0)[0])
        out[:, i] = 0.25 * (1.0 - local[:, c] ** 2) * np.delete(f[:, i], c, axis=1).prod(axis=1)
    return out


def shape_gradient(local: Array) -> Array:
    """dN/d(xi, eta, zeta) (p, 20, 3) at local places (p, 3)."""
    f = 1.0 + local[:, None, :] * NODES
    out = np.empty(f.shape)
    bracket = f[:, :8].sum(axis=2) - 5.0
    for c in range(3):
        others = np.delete(f, c, axis=2)
        out[:, :8, c] = 0.125 * NODES[:8, c] * others[:, :8].prod(axis=2) * (bracket + f[:, :8, c])
        for i in range(8, 20):
            zero = int(np.flatnonzero(NODES[i] == 0.0)[0])
            if c == zero:
                out[:, i, c] = -0.5 * local[:, c] * others[:, i].prod(axis=1)
            else:
                third = 3 - c - zero
                out[:, i, c] = 0.25 * (1.0 - local[:, zero] ** 2) * NODES[i, c] * f[:, i, third]
    return out


def lame(modulus: float, poisson: float) -> tuple[float, float]:
    """Lame's lambda and mu [MPa] of an isotropic material."""
    return modulus * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)), 0.5 * modulus / (1.0 + poisson)


def _integration(kept: Array | None, m: int, rule: int) -> tuple[Array, Array, bool]:
    """Places (k, g, 3) and weights (k, g), k = 1 for all elements alike or m; whether they are alike."""
    places, weights = gauss(rule)
    if kept is None or bool((kept == [0.0, 1.0]).all()):
        return places[None], weights[None], True
    span = kept[:, 1] - kept[:, 0]
    local = np.repeat(places[None], m, axis=0)
    local[:, :, 2] = 2.0 * kept[:, :1] - 1.0 + span[:, None] * (places[:, 2] + 1.0)
    return local, weights * span[:, None], False


def _determinant(J: Array, numbers: Sequence[int] | NDArray[np.int64]) -> Array:
    """Det J of every element and point; refused where it is not above 0."""
    det = np.asarray(np.linalg.det(J))
    bad = np.flatnonzero(~(det.min(axis=1) > 0.0))
    if len(bad):
        raise InputError(
            f"element {numbers[bad[0]]}: det(dx/dxi) = {det[bad[0]].min():g} mm^3: must be above 0 everywhere; the "
            "element is inverted, folded or flat: turn the order of the points or move its nodes"
        )
    return det


def gradients(
    xyz: Array, rule: int = 27, kept: Array | None = None, numbers: NDArray[np.int64] | None = None
) -> tuple[Array, Array]:
    """Gradients g (m, points, 20, 3) [1/mm] and weight times det J (m, points) [mm^3] of elements (m, 20, 3) [mm].

    ``numbers`` (m,) int are their numbers in messages; None: 0, 1, ..
    """
    local, weights, alike = _integration(kept, len(xyz), rule)
    if alike:
        dN = shape_gradient(local[0])[None]
    else:
        dN = shape_gradient(local.reshape(-1, 3)).reshape(*local.shape[:2], 20, 3)
    J = np.swapaxes(dN, 2, 3) @ xyz[:, None]  # rows: d/dxi, columns: x y z
    volume = _determinant(J, range(len(xyz)) if numbers is None else numbers) * weights
    return dN @ np.swapaxes(np.linalg.inv(J), 2, 3), volume


def stiffness(
    xyz: Array,
    modulus: float,
    poisson: float,
    rule: int = 27,
    kept: Array | None = None,
    numbers: NDArray[np.int64] | None = None,
) -> Array:
    """Stiffness of every element.

    K[ia, jb] = lambda H[ia, jb] + mu H[ib, ja] + mu delta_ab sum_c H[ic, jc] with H[ia, jb] = integral of g_ia g_jb.
    O(m 60^2 points): 0.15 ms for each element.

    Parameters
    ----------
    xyz : (m, 20, 3) float [mm]
    modulus, poisson : E [MPa], nu
    rule : points of integration, 8, 14 or 27
    kept : (m, 2) float, remaining part of the thickness; None: all of it. (0, 0) gives zeros
    numbers : (m,) int, of the elements in messages; None: 0, 1, ..

    Returns
    -------
    (m, 60, 60) float [N/mm], symmetric.

    Raises
    ------
    InputError
        An element is inverted or has no volume.

    Examples
    --------
    A cube of 1 mm, stretched by 1 with nu 0, needs E A: twice the energy is u^T K u = E.

    >>> cube = 0.5 * NODES[None]
    >>> u = (cube[0] * [1.0, 0.0, 0.0]).ravel()
    >>> round(float(u @ stiffness(cube, 1000.0, 0.0)[0] @ u), 9)
    1000.0
    """
    lam, mu = lame(modulus, poisson)
    called = np.arange(len(xyz)) if numbers is None else numbers
    out = np.empty((len(xyz), 60, 60))
    for at in range(0, len(xyz), _CHUNK):
        part = slice(at, at + _CHUNK)
        g, volume = gradients(xyz[part], rule, None if kept is None else kept[part], called[part])
        flat = g.reshape(len(g), -1, 60) * np.sqrt(volume)[:, :, None]
        H = np.swapaxes(flat, 1, 2) @ flat
        blocks = H.reshape(-1, 20, 3, 20, 3)
        K = lam * blocks + mu * blocks.transpose(0, 1, 4, 3, 2)
        trace = mu * (blocks[:, :, 0, :, 0] + blocks[:, :, 1, :, 1] + blocks[:, :, 2, :, 2])
        for c in range(3):
            K[:, :, c, :, c] += trace
        K = K.reshape(-1, 60, 60)
        out[part] = 0.5 * (K + np.swapaxes(K, 1, 2))
    return out


def mass(xyz: Array, density: float, rule: int = 27, kept: Array | None = None) -> Array:
    """Consistent mass of every element, one direction: integral of density N_i N_j, (m, 20, 20) float [tonne].

    ``density`` is in tonne/mm^3 (steel 7.85e-9); other arguments as in :func:`stiffness`. Not with 8 points: too few.

    Examples
    --------
    >>> round(float(mass(0.5 * NODES[None], 7.85e-9).sum()) * 1e9, 9)
    7.85
    """
    out = np.empty((len(xyz), 20, 20))
    for at in range(0, len(xyz), _CHUNK):
        part = slice(at, at + _CHUNK)
        some = None if kept is None else kept[part]
        _, volume = gradients(xyz[part], rule, some, np.arange(at, at + len(xyz[part])))
        local, _, _ = _integration(some, len(volume), rule)
        N = shape(local.reshape(-1, 3)).reshape(*local.shape[:2], 20)
        flat = N * np.sqrt(density * volume)[:, :, None]
        out[part] = np.swapaxes(flat, 1, 2) @ flat
    return out
