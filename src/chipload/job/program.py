"""A job that runs a program which exists: read, and with an operation run through a stock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import trimesh

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.job.sources import Limited, cutters, source
from chipload.job.tables import LOADS, LoadLimitsTable, ProgramJobTable


@dataclass(frozen=True)
class ProgramJob(Limited):
    """A job that runs a program; paths are absolute.

    Parameters
    ----------
    path : the job file
    table : its values
    program_file : NC text or CL data
    tools_file : tool table; None: none
    machine : a shipped name or a file
    overrides : the `--set` texts that were applied
    cutters : by number; empty where the program is not simulated
    material : a shipped name or a file; None where the program is not simulated
    meshes : what stands for the files of ``stock``, ``part``, ``fixture 0`` and so on
    """

    path: Path
    table: ProgramJobTable
    program_file: Path
    tools_file: Path | None
    machine: str | Path
    overrides: tuple[str, ...]
    cutters: Mapping[int, Cutter]
    material: str | Path | None
    meshes: Mapping[str, trimesh.Trimesh] = field(default_factory=dict)

    @property
    def simulates(self) -> bool:
        """Whether the program is run through a stock."""
        return bool(self.table.operation)


def program_job(path: Path, table: ProgramJobTable, overrides: Sequence[str]) -> ProgramJob:
    """The job of a table that was read.

    Raises
    ------
    InputError
        Keys do not go together.
    """
    folder, tools = path.parent, table.program.tools
    own: dict[int, Cutter] = {}
    if table.operation:
        _check_simulation(table)
        own = cutters(table.cutter, folder)
    else:
        for key in ("stock", "part", "fixture", "material", "cutter", "stiffness"):
            if getattr(table, key):
                raise InputError(
                    f"{key}: not used where a program is only read: add an [[operation]] with "
                    f'kind = "simulate" or leave it out'
                )
    return ProgramJob(
        path,
        table,
        folder / table.program.file,
        None if tools is None else folder / tools,
        source("machine", table.machine, folder),
        tuple(overrides),
        own,
        None if table.material is None else source("material", table.material, folder),
    )


def _check_simulation(table: ProgramJobTable) -> None:
    """What running a program through a stock needs."""
    stock = table.stock
    for key in ("stock", "material", "cutter"):
        if not getattr(table, key):
            raise InputError(f"{key}: missing: state it (kind = simulate needs it)")
    if stock is not None:
        block = (stock.low_mm is not None, stock.high_mm is not None)
        if any(block) == (stock.file is not None) or any(block) != all(block):
            raise InputError("stock: state either low_mm and high_mm of a block, or a file")
        saved = stock.file is not None and stock.file.lower().endswith(".npz")
        if saved == (stock.layer_mm is not None):
            need = "leave it out: the layers of an earlier result stay" if saved else "missing: state it"
            raise InputError(f"stock.layer_mm: {need}")
    for key in ("form_error_um", "gouge_mm", "excess_mm"):
        if table.part is None and getattr(table.limits, key) is not None:
            raise InputError(f"limits.{key}: needs the part that should come out: state [part] or leave it out")
    if table.operation[0].feeds is not None and not any(getattr(table.limits, name) is not None for name in LOADS):
        raise InputError(
            f"operation.0.feeds: no limit of a load is stated, so nothing would hold them: state at least one of "
            f"{', '.join(LOADS)} in [limits]"
        )
    if not table.limits.stated:
        names = ", ".join(LoadLimitsTable.model_fields)
        raise InputError(f"limits: none is stated, so nothing would be checked: state at least one of {names}")
