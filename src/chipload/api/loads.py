"""Functions that simulate torque control, optimise feeds and fit force coefficients."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from chipload.api.job_tables import Cutters, Source, Tables, Values, cutters_of, run_tables, tables_of
from chipload.errors import InputError
from chipload.progress import Progress, silent

if TYPE_CHECKING:
    from chipload.cutter.table import CutterTable
    from chipload.jobs import FinishedJob


def hold_torque(
    *,
    torque_control: Values,
    machine: Source,
    material: Source,
    cutter: Cutters,
    spindle: Values,
    loop: Values,
    simulation: Values,
    limits: Values,
    program: Source | None = None,
    round: Values | None = None,
    stock: Values | None = None,
    real_stock: Values | None = None,
    workpiece: Values | None = None,
    surprise: Tables = (),
    checks: Values | None = None,
    folder: str | Path = ".",
    progress: Progress = silent,
) -> FinishedJob:
    """Simulate the control of the cutting torque on a thin tube, a cone or a clamped workpiece.

    Result and errors are those of :func:`plan_impeller`.

    Parameters
    ----------
    torque_control, spindle, loop, simulation, limits : keys of the table of this name
    machine, material : a shipped name, a file, or keys of the table
    cutter : one :class:`chipload.Cutter`
    program, round : a program that exists (its file or keys), or keys of ``[round]`` by which one is made
    stock, real_stock, workpiece : keys of the table of this name, in place of the shell of ``torque_control``
    surprise : keys of a ``[[surprise]]``, or several
    checks : keys of ``[checks]``: which default checks are switched off; None: all are made
    folder : that file names are relative to
    """
    return run_tables(
        "torque", folder, progress, torque_control=torque_control, program=program, round=round, stock=stock,
        real_stock=real_stock, workpiece=workpiece, machine=machine, material=material, cutter=cutters_of(cutter),
        surprise=surprise, spindle=spindle, loop=loop, simulation=simulation, limits=limits, checks=checks,
    )  # fmt: skip


def optimise_feeds(
    *,
    program: Source,
    stock: Values,
    machine: Source,
    material: Source,
    cutter: Cutters,
    operation: Tables,
    limits: Values,
    part: Source | None = None,
    fixture: Tables = (),
    machine_table: Values | None = None,
    stiffness: Values | None = None,
    workpiece: Values | None = None,
    dynamics: Values | None = None,
    checks: Values | None = None,
    folder: str | Path = ".",
    progress: Progress = silent,
) -> FinishedJob:
    """Change the feed of each line of a program to the greatest that the load limits allow; the path does not change.

    Result and errors are those of :func:`plan_impeller`.

    Parameters
    ----------
    program : the program's file, or keys of ``[program]``
    operation : keys of the ``[[operation]]`` of kind ``simulate``, with its table ``feeds``
    limits : keys of ``[limits]``; at least one limits a load
    stock : keys of ``[stock]``
    machine, material : a shipped name, a file, or keys of the table
    cutter : one :class:`chipload.Cutter`, or several
    part, fixture, machine_table, stiffness, workpiece, dynamics : keys of the table of this name; None: it is left out
    checks : keys of ``[checks]``: which default checks are switched off; None: all are made
    folder : that file names are relative to
    """
    for k, op in enumerate(tables_of("operation", operation)):
        if op.get("feeds") is None:
            raise InputError(f"operation.{k}.feeds: missing: state the range of the new feeds; without it use simulate")
    return run_tables(
        "feeds", folder, progress, ("simulate",), program=program, stock=stock, machine=machine, material=material,
        cutter=cutters_of(cutter), operation=operation, limits=limits, part=part, fixture=fixture,
        machine_table=machine_table, stiffness=stiffness,
        workpiece=workpiece, dynamics=dynamics, checks=checks,
    )  # fmt: skip


def fit_coefficients(
    *,
    name: str,
    source: str,
    method: str,
    cutter: CutterTable | Values,
    engagement: Values,
    channels: Values,
    measurement: Tables,
    limits: Values,
    folder: str | Path = ".",
    progress: Progress = silent,
    **settings: Any,
) -> FinishedJob:
    """Identify force coefficients from measured forces, and predict the measurements that are not used for the fit.

    ``result.operations[0]`` holds the coefficients with their intervals, ``outcome.material`` the
    :class:`chipload.Material`; ``save(out)`` writes material.toml and the report. Errors are those of
    :func:`plan_impeller`.

    Parameters
    ----------
    name, source : of the material that is made
    method : ``average`` or ``instantaneous``
    cutter : that was used
    engagement, channels, limits : keys of the table of this name
    measurement : keys of a ``[[measurement]]``, or several
    folder : that file names are relative to
    settings : further keys: ``workpiece``, ``conditions``, ``band_hz``, ``runout``, ``zero``, ``dynamometer``,
        ``axial``
    """
    return run_tables(
        "fit", folder, progress, name=name, source=source, method=method, cutter=cutter, engagement=engagement,
        channels=channels, measurement=measurement, limits=limits, **settings,
    )  # fmt: skip
