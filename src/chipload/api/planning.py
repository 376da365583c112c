"""Functions that plan and verify contours, pockets, impellers and thin walls."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from chipload.api.job_tables import Cutters, Source, Tables, Values, cutters_of, run_tables
from chipload.progress import Progress, silent

if TYPE_CHECKING:
    from chipload.jobs import FinishedJob


def plan_contour(
    *,
    part: Source,
    stock: Values,
    machine: Source,
    material: Source,
    cutter: Cutters,
    operation: Tables,
    limits: Values,
    checks: Values | None = None,
    folder: str | Path = ".",
    progress: Progress = silent,
) -> FinishedJob:
    """Plan passes along contours of a drawing and prove their programs.

    Parameters
    ----------
    part : keys of ``[part]``, or the drawing (DXF, STEP) alone
    stock : keys of ``[stock]``, as ``{"top_mm": 0.0}``
    machine, material : a shipped name, a file, or keys of the table
    cutter : one :class:`chipload.Cutter`, or several
    operation : keys of an ``[[operation]]`` of kind ``contour`` or ``forward``, or several
    limits : keys of ``[limits]``, as ``{"engagement_deg": 13.0}``
    checks : keys of ``[checks]``: which default checks are switched off; None: all are made
    folder : that file names are relative to

    Returns
    -------
    FinishedJob
        ``result`` with verdict, limits and tracks; ``save(out)`` writes programs and report.

    Raises
    ------
    InputError
        A key is unknown, missing or out of range, a file cannot be read, or the operation is of another kind.
    Cancelled
        By ``progress``.

    Examples
    --------
    >>> plan_contour(part="a.dxf", stock={}, machine="vmc", material="al7075-t6", cutter=[], limits={},
    ...              operation={"kind": "pocket"})
    Traceback (most recent call last):
        ...
    chipload.errors.InputError: operation.0.kind = 'pocket': must be one of 'contour', 'forward'
    """
    return run_tables(
        "contour", folder, progress, ("contour", "forward"), part=part, stock=stock, machine=machine, material=material,
        cutter=cutters_of(cutter), operation=operation, limits=limits, checks=checks,
    )  # fmt: skip


def plan_pocket(
    *,
    part: Source,
    stock: Values,
    machine: Source,
    material: Source,
    cutter: Cutters,
    operation: Tables,
    limits: Values,
    checks: Values | None = None,
    folder: str | Path = ".",
    progress: Progress = silent,
) -> FinishedJob:
    """Plan the clearing of pockets at constant engagement and prove its programs.

    Parameters, result and errors are those of :func:`plan_contour`; every operation is of kind ``pocket``.

    Examples
    --------
    >>> plan_pocket(part="a.dxf", stock={}, machine="vmc", material="al7075-t6", cutter=[], limits={},
    ...             operation={"kind": "contour"})
    Traceback (most recent call last):
        ...
    chipload.errors.InputError: operation.0.kind = 'contour': must be 'pocket'
    """
    return run_tables(
        "contour", folder, progress, ("pocket",), part=part, stock=stock, machine=machine, material=material,
        cutter=cutters_of(cutter), operation=operation, limits=limits, checks=checks,
    )  # fmt: skip


def plan_impeller(
    *,
    impeller: Values,
    surface: Tables,
    catalogue: Source,
    machine: Source,
    operation: Tables,
    folder: str | Path = ".",
    progress: Progress = silent,
) -> FinishedJob:
    """Plan the milling of an impeller: the largest cutters that reach its surfaces, and their five-axis programs.

    Result and errors are those of :func:`plan_contour`.

    Parameters
    ----------
    impeller : keys of ``[impeller]``
    surface : keys of a ``[[surface]]``, or several
    catalogue : of cutters: a shipped name, a file, or keys of the table
    machine : a shipped name, a file, or keys of the table
    operation : keys of the ``[[operation]]``
    folder : that file names are relative to
    """
    return run_tables(
        "impeller", folder, progress, impeller=impeller, surface=surface, catalogue=catalogue, machine=machine,
        operation=operation,
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

    Result and errors are those of :func:`plan_contour`.

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
