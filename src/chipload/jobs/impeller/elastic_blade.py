"""A finished blade as an elastic solid that the hub clamps at its foot: by how much its sides give under a force.

Notation: u along the flow, v from the hub up, both 0 to 1, w from the minus side to the plus side; n normal of a side,
out of the metal; C (3, 3) compliance at a point [mm/N]. A force F at that point displaces it along n by g . F, where
g = n C.

A blade is softest when it is finished: allowances and the uncut channel beside it only stiffen it. The hub is rigid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.geometry.sections import Blade
from chipload.structure.grid import Grid, from_map
from chipload.structure.places import normals_of, on_side, points_of
from chipload.structure.solid import SolidWorkpiece, factorise, full_compliance

Floats = NDArray[np.float64]

#: elements along u, along v of a side, along v of its fillet; how many fewer a coarser mesh has
ALONG, UP, FILLET, COARSER = 16, 8, 1, 1.5
#: share of a side that is left out at its edges, where both sides meet
EDGE = 0.01
#: places of a side along u and v at which the compliance is solved
SOLVED = (13, 9)
#: of the mass, which a static deflection does not depend on [tonne/mm^3]
DENSITY = 4.4e-9


@dataclass(frozen=True, eq=False)
class ElasticBlade:
    """Points of both sides of a blade, and by how much each gives.

    Parameters
    ----------
    points, gives : (p, 3) [mm], and g [mm/N]: displacement out of the metal under unit forces along x, y, z
    spacing : greatest distance of two neighbouring points [mm]
    error : relative error of the greatest |g|, by the elements
    """

    points: Floats
    gives: Floats
    spacing: float
    error: float

    def turned(self, angle: float) -> ElasticBlade:
        """The blade rotated about z by an angle [rad]."""
        c, s = np.cos(angle), np.sin(angle)
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return ElasticBlade(self.points @ R.T, self.gives @ R.T, self.spacing, self.error)


def elastic_blade(
    blade: Blade, fillet: Blade | None, modulus: float, poisson: float, apart: tuple[int, int] = (61, 31),
    elements: tuple[int, int] = (ALONG, UP),
) -> ElasticBlade:  # fmt: skip
    """Return a blade of one material.

    Parameters
    ----------
    fillet : between its sides and the hub; None: the sides end at the hub
    modulus, poisson : of the workpiece [MPa], [1]
    apart : points of each side along u and v
    elements : along u and v
    """
    points, gives = _solve_compliance(blade, fillet, modulus, poisson, elements)
    coarse = (max(round(elements[0] / COARSER), 2), max(round(elements[1] / COARSER), 2))
    most, other = (
        float(np.linalg.norm(g, axis=-1).max())
        for g in (gives, _solve_compliance(blade, fillet, modulus, poisson, coarse)[1])
    )
    fine_points, fine_gives = (np.stack([_refine_grid(x, apart) for x in both]) for both in (points, gives))
    steps = (np.linalg.norm(np.diff(fine_points, axis=k), axis=-1).max() for k in (1, 2))
    return ElasticBlade(
        fine_points.reshape(-1, 3), fine_gives.reshape(-1, 3), float(np.hypot(*steps)), abs(most - other) / most
    )


def _solve_compliance(
    blade: Blade, fillet: Blade | None, modulus: float, poisson: float, elements: tuple[int, int]
) -> tuple[Floats, Floats]:
    """Points and g of both sides, (2, a, b, 3), at :data:`SOLVED` places each."""
    foot = 0 if fillet is None else FILLET
    grid = _grid(blade, fillet, elements, foot)
    clamped = grid.lattice[:, 0, :]
    solid = SolidWorkpiece(grid, modulus, poisson, DENSITY, clamped[clamped >= 0])
    factored = factorise(solid)
    u, v = np.meshgrid(np.linspace(0.0, 1.0, SOLVED[0]), np.linspace(0.0, 1.0, SOLVED[1]), indexing="ij")
    up = (foot + v * elements[1]) / (foot + elements[1])
    points, gives = [], []
    for side in ("k-", "k+"):
        at = on_side(grid, side, u.ravel(), up.ravel())
        n = normals_of(grid, at, side)
        points.append(points_of(grid, at).reshape(*SOLVED, 3))
        gives.append(np.einsum("pi,pij->pj", n, full_compliance(factored, at)).reshape(*SOLVED, 3))
    return np.stack(points), np.stack(gives)


def _grid(blade: Blade, fillet: Blade | None, elements: tuple[int, int], foot: int) -> Grid:
    """Elements between the sides, one through the thickness, ``foot`` of them between the fillets."""
    low = -foot / elements[1]

    def place(parameters: Floats) -> Floats:
        u, v, w = parameters.T
        out = np.empty((len(parameters), 3))
        for own, of, up in ((v >= 0.0, blade, v), (v < 0.0, fillet, 1.0 - v / low if foot else v)):
            if of is not None and own.any():
                minus, plus = (side.at(u[own], np.clip(up[own], 0.0, 1.0)) for side in (of.minus, of.plus))
                out[own] = minus + w[own, None] * (plus - minus)
        return out

    u = np.linspace(EDGE, 1.0 - EDGE, elements[0] + 1).tolist()
    v = np.linspace(low, 1.0, foot + elements[1] + 1).tolist()
    v[foot] = 0.0
    centre = np.array([[0.5, 0.5, 0.5]])
    J = [place(centre + 1e-3 * e) - place(centre - 1e-3 * e) for e in np.eye(3)]
    if float(np.linalg.det(np.concatenate(J))) > 0.0:
        return from_map(u, v, [0.0, 1.0], place)
    return from_map(u, v, [0.0, 1.0], lambda p: place(p * (1.0, 1.0, -1.0) + (0.0, 0.0, 1.0)))


def _refine_grid(values: Floats, apart: tuple[int, int]) -> Floats:
    """Values (a, b, 3) on a finer grid, linear between those of the coarser one."""
    for axis, count in enumerate(apart):
        t = np.linspace(0.0, values.shape[axis] - 1.0, count)
        k = np.minimum(t.astype(np.int64), values.shape[axis] - 2)
        share = (t - k).reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        values = (1.0 - share) * values.take(k, axis) + share * values.take(k + 1, axis)
    return values
