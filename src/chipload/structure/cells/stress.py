"""Equivalent stress of a workpiece in cells, under a force on a contact line.

Notation: eps = sym(grad u), sigma = lambda tr(eps) 1 + 2 mu eps; von Mises' sqrt(3/2 s : s), s the deviator. Stress is
taken at 2 x 2 x 2 points of each cell, where they lie in material.

Near the contact the chip is formed and the metal yields anyway: points nearer to the contact line than a stated
distance do not count.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely

from chipload.structure.cells.grid import Array, shape_gradients
from chipload.structure.cells.workpiece import CellWorkpiece, Elastic, line_means

#: number of cells whose stress is calculated at once
BLOCK = 2048


@dataclass(frozen=True, eq=False)
class GreatestStress:
    """The greatest equivalent stress [MPa], and its place (3,) float [mm]."""

    stress: float
    place: Array


def greatest_stress(work: CellWorkpiece, elastic: Elastic, line: Array, force: Array, away: float) -> GreatestStress:
    """Greatest equivalent stress of a workpiece under a force, and its place.

    Parameters
    ----------
    line : (2, 3) float [mm], contact over which the force is spread
    force : (3,) float [N]
    away : [mm] least distance from the contact at which stress counts
    """
    weight = line_means(work, np.asarray(line, dtype=np.float64).reshape(1, 2, 3)).toarray()[0]
    u = work.solve((weight[:, None] * np.asarray(force, dtype=np.float64)).reshape(-1, 1)).reshape(-1, 3)
    g = 1.0 / math.sqrt(3.0)
    local = np.array([(x, y, z) for x in (-g, g) for y in (-g, g) for z in (-g, g)])
    gradients = shape_gradients(work.grid, local)
    la = elastic.modulus * elastic.poisson / (1.0 + elastic.poisson) / (1.0 - 2.0 * elastic.poisson)
    mu = 0.5 * elastic.modulus / (1.0 + elastic.poisson)
    best = GreatestStress(0.0, np.asarray(line, dtype=np.float64).mean(axis=0))
    for at in range(0, len(work.modes.cells), BLOCK):
        cells, number = work.modes.cells[at : at + BLOCK], work.modes.number[at : at + BLOCK]
        own = np.where((number >= 0)[..., None], u[number], 0.0)
        slope = np.einsum("emc,pmd->epcd", own, gradients) * (2.0 / work.grid.sides(cells))[:, None, None]
        strain = 0.5 * (slope + np.swapaxes(slope, 2, 3))
        sigma = la * np.trace(strain, axis1=2, axis2=3)[..., None, None] * np.eye(3) + 2.0 * mu * strain
        s = sigma - np.trace(sigma, axis1=2, axis2=3)[..., None, None] / 3.0 * np.eye(3)
        mises = np.sqrt(1.5 * (s * s).sum(axis=(2, 3))).ravel()
        points = work.grid.points(cells.repeat(len(local), axis=0), np.tile(local, (len(cells), 1)))
        mises[_distance(points, line) < away] = 0.0
        for k in np.argsort(-mises, kind="stable").tolist():
            if mises[k] <= best.stress:
                break
            if _in_material(work, points[k]):
                best = GreatestStress(float(mises[k]), points[k])
                break
    return best


def _distance(points: Array, line: Array) -> Array:
    """(n,) distance [mm] of points from a segment (2, 3)."""
    a, b = np.asarray(line, dtype=np.float64)
    size = float((b - a) @ (b - a))
    t = np.clip((points - a) @ (b - a) / size, 0.0, 1.0) if size > 0.0 else np.zeros(len(points))
    return np.asarray(np.linalg.norm(points - a - t[:, None] * (b - a), axis=1))


def _in_material(work: CellWorkpiece, point: Array) -> bool:
    """Whether a point lies in material."""
    x, y, z = point.tolist()
    own = work.sections
    return any(
        low <= z <= high and shapely.contains_xy(shape, x, y)
        for low, high, shape in zip(own.low, own.high, own.shapes, strict=True)
    )
