"""The elastic workpiece in its clamps: what is stated of it, and the places of the clamps on the stock."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.errors import InputError, InputErrors
from chipload.ranges import choice_field, number_field, require_ranges
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.assembly import modes_of, shares
from chipload.structure.cells.clamp import Clamp, clamp_stiffness
from chipload.structure.cells.grid import CellGrid, grid_over
from chipload.structure.cells.moments import StockRegion, stock_moments
from chipload.structure.cells.workpiece import Elastic

#: thickness of the slab that stands for a face [mm], and N/mm in 1 N/um, MPa in 1 GPa
SLAB, PER = 0.001, 1000.0
#: t/mm^3 in 1 kg/m^3
T_MM3 = 1e-12
#: sides of the polygon that stands for a circle
ROUND = 48


FACES = ("x-", "x+", "y-", "y+", "z-", "z+")
DIRECTIONS = ("x", "y", "z", "xy", "xz", "yz", "xyz")

Corner = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class WorkpieceClamp:
    """A clamp. It holds the stock on a face, in a box, or around a point such as a screw.

    Parameters
    ----------
    face : side of the stock; with ``low_mm`` and ``high_mm`` only the area between them
    low_mm, high_mm : corners of a box
    point_mm, diameter_mm : centre of an upright cylinder, its diameter and height
    directions : in which the clamp holds
    stiffness_n_um : stiffness of the whole clamp in each direction, e.g. of soft jaws or vacuum; None: rigid
    """

    face: str | None = choice_field(None, *FACES)
    low_mm: Corner | None = None
    high_mm: Corner | None = None
    point_mm: Corner | None = None
    diameter_mm: float | None = number_field(None, above=0.0)
    directions: str = choice_field("xyz", *DIRECTIONS)
    stiffness_n_um: float | None = number_field(None, above=0.0)

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        require_ranges(self, "workpiece.clamp.")


@dataclass(frozen=True, kw_only=True)
class Workpiece:
    """Elastic properties of the workpiece and its clamps.

    The deflection of each step accounts for the material that is left at that step.

    Parameters
    ----------
    modulus_gpa, poisson : Young's modulus and Poisson's ratio
    clamps : together they allow no rigid motion
    density_kg_m3 : required for natural frequencies of the workpiece
    damping_ratio : of the clamped workpiece; without it stability is unproven
    yield_mpa : yield stress; if stated, it limits the stress of the workpiece
    modes : number of lowest modes that are tracked as material is removed
    order : polynomial order of a cell; 3 takes longer and is more accurate in corners
    cell_mm : side of the cells; None: from the thinnest remaining wall
    states : greatest number of states of removal that are solved
    state_change_percent : a state is added between two whose deflections differ by more than this share of the greatest
    """

    modulus_gpa: float = number_field(above=0.0, most=1000.0)
    poisson: float = number_field(least=0.0, below=0.5)
    clamps: tuple[WorkpieceClamp, ...]
    density_kg_m3: float | None = number_field(None, least=500.0, most=25000.0)
    damping_ratio: float | None = number_field(None, above=0.0, below=0.5)
    yield_mpa: float | None = number_field(None, least=10.0, most=5000.0)
    modes: int = number_field(4, least=1, most=20, whole=True)
    order: Literal[2, 3] = number_field(2, least=2, most=3, whole=True)
    cell_mm: float | None = number_field(None, above=0.0)
    states: int = number_field(16, least=1, most=200, whole=True)
    state_change_percent: float = number_field(5.0, above=0.0, most=100.0)

    def __post_init__(self) -> None:
        """Refuse values out of range, and clamps that state no place or more than one."""
        require_ranges(self, "workpiece.")
        wrong = [*wrong_clamps(self.clamps)] if self.clamps else ["workpiece.clamps: missing: state at least one"]
        if wrong:
            raise InputErrors(*wrong) if len(wrong) > 1 else InputError(wrong[0])


def wrong_clamps(clamps: Sequence[WorkpieceClamp]) -> Iterator[str]:
    """Yield a message for each clamp that states no place, or more than one."""
    for k, clamp in enumerate(clamps):
        key = f"workpiece.clamp.{k}"
        box = (clamp.low_mm is not None, clamp.high_mm is not None)
        point = (clamp.point_mm is not None, clamp.diameter_mm is not None)
        if any(box) != all(box) or any(point) != all(point):
            yield f"{key}: state both low_mm and high_mm of a box, both point_mm and diameter_mm of a cylinder"
        elif all(point) == (all(box) or clamp.face is not None):
            yield f"{key}: state either a face, a box by low_mm and high_mm, or a cylinder by point_mm and diameter_mm"
        elif clamp.low_mm is not None and clamp.high_mm is not None:
            for axis, a, b in zip("xyz", clamp.low_mm, clamp.high_mm, strict=True):
                if not a < b and not (clamp.face is not None and clamp.face[0] == axis):
                    yield f"{key}.high_mm: {axis} = {b:g} must be above that of low_mm, {a:g}"


def placed_clamps(workpiece: Workpiece, stock: LayeredStock) -> tuple[Clamp, ...]:
    """Return the clamps on a stock before its first cut."""
    return tuple(place_clamp(clamp, f"workpiece.clamp.{k}", stock) for k, clamp in enumerate(workpiece.clamps))


def elastic_of(workpiece: Workpiece) -> Elastic:
    """Return the elastic properties of the workpiece."""
    density = None if workpiece.density_kg_m3 is None else T_MM3 * workpiece.density_kg_m3
    return Elastic(PER * workpiece.modulus_gpa, workpiece.poisson, density)


def place_clamp(stated: WorkpieceClamp, name: str, stock: LayeredStock) -> Clamp:
    """Return a clamp on a stock; ``name`` is its key in messages."""
    low, high = (np.array([stock.xs[k], stock.ys[k], stock.bounds[k]], dtype=np.float64) for k in (0, -1))
    if stated.face is not None and stated.face[0] != "z":
        # the outermost material: tiles may end beyond it
        boxes = shapely.total_bounds(stock.tiles.ravel())
        low[:2], high[:2] = boxes[:2], boxes[2:]
    if stated.low_mm is not None and stated.high_mm is not None:
        a, b = np.array(stated.low_mm), np.array(stated.high_mm)
        free = np.array([stated.face is not None and axis == stated.face[0] for axis in "xyz"])
        low, high = np.where(free, low, a), np.where(free, high, b)
    if stated.face is not None:
        axis = "xyz".index(stated.face[0])
        if stated.face[1] == "-":
            high[axis] = low[axis] + SLAB
        else:
            low[axis] = high[axis] - SLAB
    outline = shapely.box(low[0], low[1], high[0], high[1])
    if stated.point_mm is not None and stated.diameter_mm is not None:
        x, y, z = stated.point_mm
        outline = shapely.Point(x, y).buffer(0.5 * stated.diameter_mm, quad_segs=ROUND // 4)
        low[2], high[2] = z - 0.5 * stated.diameter_mm, z + 0.5 * stated.diameter_mm
    fixed_axes = np.array([axis in stated.directions for axis in "xyz"])
    stiffness = np.inf if stated.stiffness_n_um is None else PER * stated.stiffness_n_um
    return Clamp(name, StockRegion(outline, float(low[2]), float(high[2])), fixed_axes, stiffness)


def clamped_volumes(workpiece: Workpiece, stock: LayeredStock) -> NDArray[np.float64]:
    """Return the volume of stock (c,) [mm^3] that each clamp holds.

    Raises
    ------
    InputError
        One holds nothing, or a rigid motion is free.
    """
    grid = stock_cells(stock, 1e9, 1)
    modes = modes_of(grid, shares(stock_moments(stock, grid)))
    return clamp_stiffness(placed_clamps(workpiece, stock), stock, grid, modes, PER * workpiece.modulus_gpa).volumes


def require_clamped(workpiece: Workpiece | None, stock: LayeredStock) -> None:
    """Refuse clamps that hold nothing or leave a rigid motion free; see :func:`clamped_volumes`."""
    if workpiece is not None:
        clamped_volumes(workpiece, stock)


def stock_cells(stock: LayeredStock, cell_mm: float, order: int) -> CellGrid:
    """Return the cells over a whole stock."""
    low, high = ([float(v[k]) for v in (stock.xs, stock.ys, stock.bounds)] for k in (0, -1))
    return grid_over(low, high, cell_mm, order)
