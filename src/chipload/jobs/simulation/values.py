"""The tables of a simulation as values: settings, stock, workpiece and clamps, modes of vibration."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from chipload.checking.clamped import Workpiece, WorkpieceClamp
from chipload.checking.dynamics import Mode, Vibration
from chipload.checking.inputs import Elasticity
from chipload.checking.settings import SimulationSettings
from chipload.checking.stiffness import MachineStiffness
from chipload.checking.workpiece import Stock
from chipload.jobs.simulation.dynamics_tables import DynamicsTable
from chipload.jobs.simulation.modes_file import read_modes
from chipload.jobs.simulation.tables import (
    ClampTable,
    MachineTableTable,
    SimulateTable,
    SimulationJobTable,
    SolidTable,
    WorkpieceTable,
)
from chipload.jobs.tables import require_stated, value_of
from chipload.machine.table import MachineTable
from chipload.stability.process_damping import ProcessDamping


def settings_of(table: SimulateTable) -> SimulationSettings:
    """Return the settings of an operation."""
    return value_of(SimulationSettings, table)


def stock_of(table: SolidTable, folder: Path) -> Stock:
    """Return the initial stock of a table; its file is read."""
    if table.file is None:
        return Stock.block(
            require_stated(table.low_mm, "stock.low_mm"), require_stated(table.high_mm, "stock.high_mm"), table.layer_mm
        )
    return Stock.read(folder / table.file, units=table.units, chord_mm=table.chord_mm, layer_mm=table.layer_mm)


def machine_table_of(table: MachineTableTable | None) -> MachineTable | None:
    """Return the table or pallet that a job states."""
    return None if table is None else MachineTable(table.low_mm, table.high_mm, table.spacing_mm)


def machine_table_errors(table: MachineTableTable | None) -> Iterator[str]:
    """Yield a message for each axis along which the corners of a table are in the wrong order."""
    for axis, low, high in zip("XYZ", table.low_mm, table.high_mm, strict=True) if table is not None else ():
        if not low < high:
            yield f"machine_table.low_mm: {axis} = {low:g}: must be below high_mm, {axis} = {high:g}"


def clamps_of(tables: Sequence[ClampTable]) -> tuple[WorkpieceClamp, ...]:
    """Return clamps as values."""
    return tuple(value_of(WorkpieceClamp, clamp) for clamp in tables)


def elasticity_of(table: SimulationJobTable, folder: Path) -> Elasticity:
    """Return what bends or vibrates in a job; the file of modes is read."""
    return Elasticity(
        None if table.stiffness is None else value_of(MachineStiffness, table.stiffness),
        None if table.workpiece is None else workpiece_of(table.workpiece),
        None if table.dynamics is None else vibration_of(table.dynamics, folder),
    )


def workpiece_of(table: WorkpieceTable, **other: Any) -> Workpiece:
    """Return the elastic workpiece of a table; ``other`` values replace those of the table."""
    return value_of(Workpiece, table, clamps=clamps_of(table.clamp), **other)


def vibration_of(table: DynamicsTable, folder: Path) -> Vibration:
    """Return the modes of a table and of the file that it names."""
    listed = [*table.mode, *(read_modes(folder / table.file) if table.file is not None else ())]
    worn = table.process_damping
    damping = None if worn is None else ProcessDamping(worn.indentation_n_mm3, worn.wear_land_mm, worn.friction)
    return value_of(Vibration, table, modes=tuple(value_of(Mode, mode) for mode in listed), process_damping=damping)
