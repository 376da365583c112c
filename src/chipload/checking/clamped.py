"""The clamps of a job: checks of their tables, and their places on the stock."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.jobs.simulation.tables import ClampTable, SimulationJobTable, WorkpieceTable
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


def clamp_errors(table: SimulationJobTable) -> Iterator[str]:
    """Yield a message for each contradiction between the keys of ``[workpiece]`` and others."""
    limited = table.limits.deflection_workpiece_um is not None
    given = table.stiffness is not None and table.stiffness.work_n_um is not None
    if limited and table.workpiece is None and not given:
        yield "limits.deflection_workpiece_um: needs the workpiece and its clamps: state [workpiece]"
    if table.workpiece is None:
        return
    if given:
        yield "stiffness.work_n_um: leave it out: [workpiece] states its compliance"
    if table.workpiece.damping_ratio is not None and table.workpiece.density_kg_m3 is None:
        yield "workpiece.damping_ratio: needs density_kg_m3, without which the workpiece has no modes"
    if table.workpiece.density_kg_m3 is not None and table.dynamics is not None:
        for k, mode in enumerate(table.dynamics.mode):
            if mode.of == "workpiece":
                yield f"dynamics.mode.{k}: of the workpiece: leave it out: workpiece.density_kg_m3 gives its modes"
    yield from wrong_clamps(table.workpiece.clamp)


def wrong_clamps(clamps: Sequence[ClampTable]) -> Iterator[str]:
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


def clamps_of(table: WorkpieceTable, stock: LayeredStock) -> tuple[Clamp, ...]:
    """Return the clamps on a stock before its first cut."""
    return tuple(_clamp(clamp, f"workpiece.clamp.{k}", stock) for k, clamp in enumerate(table.clamp))


def elastic_of(table: WorkpieceTable) -> Elastic:
    """Return the elastic properties of the workpiece."""
    density = None if table.density_kg_m3 is None else T_MM3 * table.density_kg_m3
    return Elastic(PER * table.modulus_gpa, table.poisson, density)


def _clamp(table: ClampTable, name: str, stock: LayeredStock) -> Clamp:
    low, high = (np.array([stock.xs[k], stock.ys[k], stock.bounds[k]], dtype=np.float64) for k in (0, -1))
    if table.face is not None and table.face[0] != "z":
        # the outermost material: tiles may end beyond it
        boxes = shapely.total_bounds(stock.tiles.ravel())
        low[:2], high[:2] = boxes[:2], boxes[2:]
    if table.low_mm is not None and table.high_mm is not None:
        a, b = np.array(table.low_mm), np.array(table.high_mm)
        free = np.array([table.face is not None and axis == table.face[0] for axis in "xyz"])
        low, high = np.where(free, low, a), np.where(free, high, b)
    if table.face is not None:
        axis = "xyz".index(table.face[0])
        if table.face[1] == "-":
            high[axis] = low[axis] + SLAB
        else:
            low[axis] = high[axis] - SLAB
    outline = shapely.box(low[0], low[1], high[0], high[1])
    if table.point_mm is not None and table.diameter_mm is not None:
        x, y, z = table.point_mm
        outline = shapely.Point(x, y).buffer(0.5 * table.diameter_mm, quad_segs=ROUND // 4)
        low[2], high[2] = z - 0.5 * table.diameter_mm, z + 0.5 * table.diameter_mm
    fixed_axes = np.array([axis in table.directions for axis in "xyz"])
    stiffness = np.inf if table.stiffness_n_um is None else PER * table.stiffness_n_um
    return Clamp(name, StockRegion(outline, float(low[2]), float(high[2])), fixed_axes, stiffness)


def clamped_volumes(table: WorkpieceTable, stock: LayeredStock) -> NDArray[np.float64]:
    """Return the volume of stock (c,) [mm^3] that each clamp holds.

    Raises
    ------
    InputError
        One holds nothing, or a rigid motion is free.
    """
    grid = stock_cells(stock, 1e9, 1)
    modes = modes_of(grid, shares(stock_moments(stock, grid)))
    return clamp_stiffness(clamps_of(table, stock), stock, grid, modes, PER * table.modulus_gpa).volumes


def require_clamped(table: WorkpieceTable | None, stock: LayeredStock) -> None:
    """Refuse clamps that hold nothing or leave a rigid motion free; see :func:`clamped_volumes`."""
    if table is not None:
        clamped_volumes(table, stock)


def stock_cells(stock: LayeredStock, cell_mm: float, order: int) -> CellGrid:
    """Return the cells over a whole stock."""
    low, high = ([float(v[k]) for v in (stock.xs, stock.ys, stock.bounds)] for k in (0, -1))
    return grid_over(low, high, cell_mm, order)
