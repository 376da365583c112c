"""Functions that plan and verify impellers and thin walls."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from chipload.api.job_tables import Cutters, Source, Tables, Values, cutters_of, run_tables
from chipload.progress import Progress, silent

if TYPE_CHECKING:
    from chipload.jobs import FinishedJob


def plan_impeller(
    *,
    impeller: Values,
    surface: Tables,
    catalogue: Source,
    machine: Source,
    operation: Tables,
    fixture: Tables = (),
    machine_table: Values | None = None,
    stock: Values | None = None,
    folder: str | Path = ".",
    progress: Progress = silent,
) -> FinishedJob:
    """Plan the milling of an impeller: the largest cutters that reach its surfaces, and their five-axis programs.

    Parameters
    ----------
    impeller : keys of ``[impeller]``
    surface : keys of a ``[[surface]]``, or several
    catalogue : of cutters: a shipped name, a file, or keys of the table
    machine : a shipped name, a file, or keys of the table
    operation : keys of the ``[[operation]]``
    fixture, machine_table : keys of the table of this name; None: it is left out
    stock : keys of ``[stock]``, the stock before finishing, where no roughing is stated; None: programs are unproven
    folder : that file names are relative to

    Returns
    -------
    FinishedJob
        ``result`` with verdict, limits and tracks; ``save(out)`` writes programs and report.

    Raises
    ------
    InputError
        A key is unknown, missing or out of range, or a file cannot be read.
    Cancelled
        By ``progress``.
    """
    return run_tables(
        "impeller", folder, progress, impeller=impeller, surface=surface, catalogue=catalogue, machine=machine,
        operation=operation, fixture=fixture, machine_table=machine_table, stock=stock,
    )  # fmt: skip


def plan_thin_wall(
    *,
    wall: Values | Tables,
    workpiece: Values,
    machine: Source,
    material: Source,
    cutter: Cutters,
    operation: Tables,
    limits: Values,
    part: Source | None = None,
    threshold: Source | None = None,
    dynamics: Values | None = None,
    neighbour: Tables = (),
    checks: Values | None = None,
    folder: str | Path = ".",
    progress: Progress = silent,
) -> FinishedJob:
    """Plan the semi-finishing and finishing of a thin wall so that its deflection stays below a limit.

    Result and errors are those of :func:`plan_impeller`.

    Parameters
    ----------
    wall : keys of ``[wall]``, or of each ``[[wall]]`` of a part
    workpiece : keys of ``[workpiece]``
    part : finished part that several walls belong to: a STEP file, or keys of ``[part]``
    operation : keys of the ``[[operation]]``
    threshold : measured calibration cuts: a file, or keys of ``[threshold]``; None: the threshold is calculated
    dynamics : keys of ``[dynamics]``; None: chatter is not calculated
    neighbour : keys of each ``[[neighbour]]``, a body next to one wall that no part of a tool may touch
    machine, material : a shipped name, a file, or keys of the table
    cutter : one :class:`chipload.Cutter`, or several
    limits : keys of ``[limits]``, as ``{"deflection_workpiece_um": 54.0}``
    checks : keys of ``[checks]``: which default checks are switched off; None: all are made
    folder : that file names are relative to
    """
    return run_tables(
        "thinwall", folder, progress, part=part, wall=wall, workpiece=workpiece, machine=machine, material=material,
        threshold=threshold, cutter=cutters_of(cutter), dynamics=dynamics, neighbour=neighbour, operation=operation,
        limits=limits, checks=checks,
    )  # fmt: skip
