"""Error of the compliance of the finished wall by the mesh of its finite elements, at each place.

Notation: C [mm/N] normal compliance that is used, of a force at a point of the cut face; L [mm/N] that of a force
spread evenly through the thickness, which settles on finer meshes where C does not: under a point the displacement
grows without bound. L_1 is from elements of the job's size, L_2 from elements of half of it in all three directions.

Elements of the second order: the error of L falls at least as the square of their size, so that L is

    L_2 + (L_2 - L_1) / 3 +- |L_2 - L_1| / 3.

The greater end of this over C, less 1, is the error; 0 where C is greater. At a corner of the example `plate` with 8 x
8 elements it is 2.5 %, and elements of a quarter of the size find 1.5 %; of the example `blade` with 7 x 6 elements it
is 8.3 %, and they find 7.3 %.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chipload.geometry.thin_wall import ThinWall
from chipload.jobs.thinwall.inputs import WallInputs
from chipload.lazy import scipy
from chipload.planning.thinwall.blank import SIDES, line_nodes
from chipload.structure.grid import from_map
from chipload.structure.places import MeshPlaces, normals_of, points_of
from chipload.structure.solid import Factored, SolidWorkpiece, factorise, loads

Floats = NDArray[np.float64]

#: Gauss points through each layer, over which the force is spread
SPREAD = 3
#: right-hand sides at once
TOGETHER = 64
#: in the row above the foot
ABOVE = 1e-9


def mesh_error(inputs: WallInputs, used: Floats, side: int) -> Floats:
    """Relative error (n, m) of the compliance ``used`` (n, m) of the finished wall at the places of its elements.

    Parameters
    ----------
    side : index in the sides with stock
    """
    wall, (u, v) = inputs.body.wall, inputs.body.places
    shape, (minus, plus) = inputs.body.swept, inputs.body.allowance
    i, j, _ = wall.solid.grid.counts
    up = np.concatenate([np.linspace(0.0, inputs.body.foot, wall.foot + 1)[:-1], v])
    assert len(up) == j + 1
    spread = []
    for times in (1, 2):
        along = np.linspace(0.0, 1.0, times * i + 1)
        rows = np.interp(np.linspace(0.0, j, times * j + 1), np.arange(j + 1), up)
        solid = finished_wall(shape, (minus, plus), along, rows, times * wall.foot, times, wall.solid)
        top, seen = _heights(inputs, v)
        a = np.repeat(u * times * i, len(v))
        b, *line = (
            np.tile(np.maximum(np.interp(x, rows, np.arange(len(rows))), times * wall.foot + ABOVE), len(u))
            for x in (top, *seen)
        )
        number = inputs.body.side_numbers[side]
        spread.append(spread_compliance(solid, a, b, number, line).reshape(used.shape))
    change = spread[1] - spread[0]
    most = spread[1] + (change + np.abs(change)) / 3.0
    return np.maximum(most / used - 1.0, 0.0)


def _heights(inputs: WallInputs, v: Floats) -> tuple[Floats, Floats]:
    """Parameters v at which the force of places acts (m,), and those of the points of Gauss of the line that it is
    spread over, (k, m); none where it acts at the place.
    """
    if inputs.line is None:
        return v, np.zeros((0, len(v)))
    foot = inputs.body.foot
    top, bottom = inputs.line.ends((v - foot) / (1.0 - foot))
    return foot + (1.0 - foot) * top, foot + (1.0 - foot) * line_nodes(bottom, top)[0]


def error_at(places: tuple[Floats, Floats], error: Floats, u: Floats, v: Floats) -> Floats:
    """Errors (k,) at parameters, linear between places."""
    low, high = places[1][0], places[1][-1]
    return np.asarray(
        scipy.interpolate.RegularGridInterpolator(places, error)(
            np.column_stack([np.clip(u, 0.0, 1.0), np.clip(v, low, high)])
        )
    )


def finished_wall(
    shape: ThinWall,
    allowance: tuple[float, float],
    along: Floats,
    up: Floats,
    foot: int,
    layers: int,
    like: SolidWorkpiece,
) -> SolidWorkpiece:
    """The wall without stock above its foot, in layers that share the finished thickness.

    Parameters
    ----------
    along, up : breaks of u and v
    foot : rows of elements that keep their stock
    layers : through the thickness
    like : a workpiece of the same material
    """

    def place(p: Floats) -> Floats:
        stock = tuple(np.full(len(p), a) for a in allowance)
        low, high = shape.offset(p[:, 0], p[:, 1], (stock[0], stock[1]))
        return np.asarray((1.0 - p[:, 2:]) * low + p[:, 2:] * high)

    middle_u, middle_v = (0.5 * (x[1:] + x[:-1]) for x in (along, up))
    a, b = (x.ravel() for x in np.meshgrid(middle_u, middle_v, indexing="ij"))
    ends = [place(np.column_stack([a, b, np.full(len(a), w)])) for w in (0.0, 1.0)]
    thickness = np.linalg.norm(ends[1] - ends[0], axis=1).reshape(len(middle_u), len(middle_v))
    least = float(thickness.min())
    breaks = np.linspace(allowance[0], least - allowance[1], layers + 1) / least
    breaks[0], breaks[-1] = 0.0, 1.0
    grid = from_map(along.tolist(), up.tolist(), breaks.tolist(), place)
    kept = np.tile([0.0, 1.0], (*grid.counts, 1))
    # the stock is within the outer layers, which may be parts of elements
    lo = np.clip((allowance[0] / thickness)[..., None], breaks[:-1], breaks[1:])
    hi = np.clip((1.0 - allowance[1] / thickness)[..., None], breaks[:-1], breaks[1:])
    size = np.diff(breaks)
    kept[:, foot:, :, 0] = ((lo - breaks[:-1]) / size)[:, foot:]
    kept[:, foot:, :, 1] = ((hi - breaks[:-1]) / size)[:, foot:]
    return SolidWorkpiece(
        grid, like.modulus, like.poisson, like.density, grid.side("j-"), kept=kept.reshape(-1, 2), rule=like.rule
    )


def spread_compliance(solid: SolidWorkpiece, a: Floats, b: Floats, side: int, line: Sequence[Floats] = ()) -> Floats:
    """Compliance (k,) [mm/N] along the normal of a side under a force that is spread through the thickness.

    Parameters
    ----------
    a, b : (k,) places, counted in elements along and up
    side : 0 for k-, 1 for k+
    line : b of the points of Gauss up the line that the force is spread over, of which ``b`` is the upper end; none: it
        acts at the places
    """
    factored = factorise(solid)
    acts = _forces_through(factored, a, b, side)
    seen = acts
    if line:
        shares = line_nodes(b, b)[1]
        seen = shares[0] * _forces_through(factored, a, line[0], side)
        for w, up in zip(shares[1:], line[1:], strict=True):
            seen = seen + w * _forces_through(factored, a, up, side)
    out = np.empty(len(a))
    for at in range(0, len(a), TOGETHER):
        some = slice(at, at + TOGETHER)
        out[some] = np.einsum("fp,fp->p", seen[:, some].toarray(), factored.solve(acts[:, some].toarray()))
    return out


def _forces_through(factored: Factored, a: Floats, b: Floats, side: int) -> scipy.sparse.csc_array:
    """Unit forces along the normal of a side, spread through the thickness, as columns (f, k) over the free degrees of
    freedom.
    """
    solid = factored.solid
    grid = solid.grid
    i, j, layers = grid.counts
    kept = solid.kept.reshape(*grid.counts, 2)
    ei, ej = np.minimum(a.astype(np.int64), i - 1), np.minimum(b.astype(np.int64), j - 1)
    gauss, weight = np.polynomial.legendre.leggauss(SPREAD)
    total = np.zeros(len(a))
    parts = []
    for k in range(layers):
        lo, hi = kept[ei, ej, k].T
        for x, w in zip(gauss, weight, strict=True):
            zeta = lo + hi - 1.0 + (hi - lo) * x
            local = np.column_stack([2.0 * (a - ei) - 1.0, 2.0 * (b - ej) - 1.0, zeta])
            places = MeshPlaces(grid.element(ei, ej, np.full(len(a), k)), local)
            share = 0.5 * w * (hi - lo) * _depth(solid, places)
            parts.append((places, share))
            total += share
    forces = (
        loads(factored, places, normals_of(grid, places, SIDES[side]) * (share / total)[:, None])
        for places, share in parts
    )
    force = next(forces)
    for one in forces:
        force = force + one
    return force


def _depth(solid: SolidWorkpiece, places: MeshPlaces) -> Floats:
    """(k,) thickness of the elements at places [mm]."""
    ends = [
        points_of(
            solid.grid, MeshPlaces(places.element, np.column_stack([places.local[:, :2], np.full(len(places), z)]))
        )
        for z in (-1.0, 1.0)
    ]
    return np.asarray(np.linalg.norm(ends[1] - ends[0], axis=1))
