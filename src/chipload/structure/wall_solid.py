"""A thin tube or cone as a solid of hexahedra, to check :mod:`chipload.structure.shell` by another method.

Notation as there. Half the wall, theta from 0 to pi, is meshed. On both cuts the displacement along y is 0, so loads
that are even in theta are those of the whole. Elements are short near theta = 0, where the cutter is, and grow evenly
from there. The solid does not use the theory of the shell; it includes shear through the thickness and the thickness
itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.structure.grid import from_map
from chipload.structure.places import locate, normals_of
from chipload.structure.shell import Shell
from chipload.structure.solid import Factored, SolidWorkpiece, factorise, loads

Floats = NDArray[np.float64]

#: density of a workpiece whose mass is not used [tonne/mm^3]
DENSITY = 2.7e-9
#: greatest distance of a place from the curved faces of the mesh, in thicknesses
NEAR = 0.05
#: places on the area of a force, along s and round
SPREAD = (7, 7)


@dataclass(frozen=True, eq=False)
class WallSolid:
    """Half a wall, factored."""

    shell: Shell
    factored: Factored

    @property
    def counts(self) -> tuple[int, int, int]:
        """Elements round (half), along and through the wall."""
        return self.factored.solid.grid.counts


def wall_solid(shell: Shell, counts: tuple[int, int, int] = (28, 24, 1), growth: float = 8.0) -> WallSolid:
    """Mesh and factor half of a clamped wall.

    Parameters
    ----------
    shell : clamped at s = 0, free at its length
    counts : elements round (half), along, through
    growth : width of the last element round over that of the first

    Raises
    ------
    InputError
        The wall is not clamped, or a count is below 1.
    """
    if shell.ends != "clamped":
        raise InputError(f"wall_solid: shell.ends = {shell.ends!r}: must be clamped")
    if min(counts) < 1:
        raise InputError(f"wall_solid: counts = {counts}: must be at least 1")
    wide = growth ** np.linspace(0.0, 1.0, counts[0])
    theta = math.pi * np.concatenate([[0.0], np.cumsum(wide) / wide.sum()])
    theta[-1] = math.pi
    along = np.linspace(0.0, shell.length, counts[1] + 1)
    through = np.linspace(-0.5, 0.5, counts[2] + 1) * shell.thickness
    grid = from_map(theta.tolist(), along.tolist(), through.tolist(), lambda p: _place(shell, p))
    fixed = np.zeros((len(grid.nodes), 3), dtype=np.bool_)
    fixed[grid.side("j-")] = True
    for side in ("i-", "i+"):
        fixed[grid.side(side), 1] = True
    return WallSolid(shell, factorise(SolidWorkpiece(grid, shell.modulus, shell.poisson, DENSITY, fixed)))


def normal_compliance(wall: WallSolid, s_force: float, s_point: float, length: float, width: float) -> float:
    """Normal displacement of a point of the wall under a unit normal force that is spread over an area [mm/N].

    Parameters
    ----------
    wall : from :func:`wall_solid`
    s_force : middle of the area, at theta = 0 [mm]
    s_point : where the displacement is calculated, at theta = 0, the mean of both faces [mm]
    length, width : of the area, along s and round [mm]

    Raises
    ------
    InputError
        The area does not lie on the wall.
    """
    shell, grid = wall.shell, wall.factored.solid.grid
    ds, dt = (np.polynomial.legendre.leggauss(n) for n in SPREAD)
    s = s_force + 0.5 * length * np.repeat(ds[0], SPREAD[1])
    if not (s.min() >= 0.0 and s.max() <= shell.length):
        raise InputError(f"wall_solid: s = {s_force:g} mm with an area of {length:g} mm: must lie on the wall")
    # the half of the area that is on this half of the wall takes half of the force
    round_ = 0.25 * width * (1.0 + np.tile(dt[0], SPREAD[0]))
    weight = 0.5 * np.outer(ds[1] / ds[1].sum(), dt[1] / dt[1].sum()).ravel()
    top = _place(shell, np.column_stack([round_ / shell.radius_at(s), s, np.full(len(s), 0.5 * shell.thickness)]))
    places = locate(grid, "k+", top, NEAR * shell.thickness)
    force = np.asarray(loads(wall.factored, places, normals_of(grid, places, "k+")) @ weight)
    moved = wall.factored.solve(force[:, None])[:, 0]
    answer = 0.0
    for side, z in (("k-", -0.5), ("k+", 0.5)):
        point = _place(shell, np.array([[0.0, s_point, z * shell.thickness]]))
        normal = np.array([[math.cos(shell.cone_angle), 0.0, -math.sin(shell.cone_angle)]])
        load = loads(wall.factored, locate(grid, side, point, NEAR * shell.thickness), normal)
        answer += 0.5 * float((load.T @ moved)[0])
    return answer


def _place(shell: Shell, p: Floats) -> Floats:
    """(p, 3) theta, s and distance from the middle surface to x, y, z; s = 0 at z = 0."""
    theta, s, out = p.T
    r = shell.radius_at(s) + out * math.cos(shell.cone_angle)
    z = s * math.cos(shell.cone_angle) - out * math.sin(shell.cone_angle)
    return np.column_stack([r * np.cos(theta), r * np.sin(theta), z])
