"""Functions that plan and verify contours and pockets in the plane, from contours that are values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chipload.errors import InputError
from chipload.progress import Progress, silent

if TYPE_CHECKING:
    from chipload.checking.settings import CheckSettings
    from chipload.cutter.table import CutterTable
    from chipload.cutting.material import Material
    from chipload.geometry.contour import Contour
    from chipload.jobs import FinishedJob
    from chipload.jobs.contour.tables import ContourLimitsTable, OperationTable
    from chipload.machine.machine import Machine


@dataclass(frozen=True)
class FlatStock:
    """Stock with a level top, from which contours and pockets are milled.

    Parameters
    ----------
    top_mm : z of its top
    outline : contours of its outline, for pockets; none: material everywhere
    """

    top_mm: float
    outline: tuple[Contour, ...] = ()


def plan_contour(
    contours: Contour | Sequence[Contour],
    stock: FlatStock | float,
    cutters: CutterTable | Sequence[CutterTable],
    material: Material | str | Path,
    machine: Machine | str | Path,
    limits: ContourLimitsTable,
    operations: OperationTable | Sequence[OperationTable],
    *,
    checks: CheckSettings | None = None,
    progress: Progress = silent,
) -> FinishedJob:
    """Plan passes along contours and prove their programs.

    Parameters
    ----------
    contours : lines and arcs [mm] to be milled, as those of :func:`chipload.read_dxf`
    stock : before the first operation; a number is the z of its top [mm]
    cutters : one, or several by the numbers that the operations state
    material, machine : a value, a shipped name, or a file
    limits : :class:`chipload.ContourLimits`; at least one is stated
    operations : :class:`chipload.Operation` of kind ``contour`` or ``forward``, one or several
    checks : switches of the default checks; None: all are made

    Returns
    -------
    FinishedJob
        ``result`` with verdict, limits and tracks; ``save(out)`` writes programs and report.

    Raises
    ------
    InputError
        A value is out of range, contours cross, values do not go together, or an operation is of another kind.
    Cancelled
        By ``progress``.
    """
    given = (contours, stock, cutters, material, machine, limits, operations, checks)
    return _finish(("contour", "forward"), given, progress)


def plan_pocket(
    contours: Contour | Sequence[Contour],
    stock: FlatStock | float,
    cutters: CutterTable | Sequence[CutterTable],
    material: Material | str | Path,
    machine: Machine | str | Path,
    limits: ContourLimitsTable,
    operations: OperationTable | Sequence[OperationTable],
    *,
    checks: CheckSettings | None = None,
    progress: Progress = silent,
) -> FinishedJob:
    """Plan the clearing of pockets at constant engagement and prove its programs.

    Parameters, result and errors are those of :func:`plan_contour`; every operation is of kind ``pocket``.
    """
    given = (contours, stock, cutters, material, machine, limits, operations, checks)
    return _finish(("pocket",), given, progress)


def _finish(kinds: tuple[str, ...], given: tuple[Any, ...], progress: Progress) -> FinishedJob:
    """Plan and check values; ``kinds`` are those that the operations may have."""
    from chipload.api.reading import read_machine, read_material
    from chipload.geometry.contour import Contour
    from chipload.jobs import FinishedJob
    from chipload.jobs.contour import figures, result, run
    from chipload.jobs.contour.job import load
    from chipload.jobs.contour.tables import ContourJobTable, ContourLimitsTable, OperationTable
    from chipload.machine.machine import Machine
    from chipload.result.provenance import provenance_of

    contours, stock, cutters, material, machine, limits, operations, checks = given
    several = [operations] if isinstance(operations, OperationTable) else list(operations)
    for k, op in enumerate(several):
        if not isinstance(op, OperationTable):
            raise InputError(f"operation.{k}: {type(op).__name__}: must be a chipload.Operation")
        if op.kind not in kinds:
            known = f"{'one of ' if len(kinds) > 1 else ''}{', '.join(map(repr, kinds))}"
            raise InputError(f"operation.{k}.kind = {op.kind!r}: must be {known}")
    if not isinstance(limits, ContourLimitsTable):
        raise InputError(f"limits: {type(limits).__name__}: must be a chipload.ContourLimits")
    on = machine if isinstance(machine, Machine) else read_machine(machine)
    metal = read_material(material) if isinstance(material, (str, Path)) else material
    flat = stock if isinstance(stock, FlatStock) else FlatStock(stock)
    tools = list(cutters) if isinstance(cutters, Sequence) else [cutters]
    tables = {
        "part": {"file": "contours"}, "stock": {"top_mm": flat.top_mm}, "machine": {"name": on.name},
        "material": {"name": metal.name}, "cutter": tuple(tools), "operation": tuple(several), "limits": limits,
        "checks": {} if checks is None else _stated_checks(checks, set(_checks_of(ContourJobTable))),
    }  # fmt: skip
    job = load(Path(kinds[0]).absolute(), _validate_tables(ContourJobTable, tables), ())
    own = [contours] if isinstance(contours, Contour) else list(contours)
    inputs = run.inputs_of_contours(job, own, flat.outline, on, metal)
    outcome = run.plan_inputs(job, inputs, provenance_of({}, (), on, (metal,)), progress)
    return FinishedJob(result.result_of(outcome), figures.presentation_of(outcome), outcome)


def _checks_of(table: Any) -> Sequence[str]:
    """Names of the default checks of a job."""
    return tuple(table.model_fields["checks"].annotation.model_fields)


def _stated_checks(checks: CheckSettings, known: set[str]) -> dict[str, Any]:
    """Return the switches of a plan; one of a simulation alone must have its default."""
    other = [f.name for f in fields(checks) if f.name not in known and getattr(checks, f.name) != f.default]
    if other:
        raise InputError(f"checks.{other[0]}: is made of a simulated program, not of a plan: leave it out")
    return {name: value for name, value in asdict(checks).items() if name in known}


def _validate_tables(kind: Any, tables: dict[str, Any]) -> Any:
    """Return the tables, with an :class:`InputError` for each value that they refuse."""
    from pydantic import ValidationError

    from chipload.jobs.messages import Errors, table_errors

    try:
        return kind.model_validate(tables)
    except ValidationError as err:
        errors = Errors()
        errors.texts += table_errors(err, kind)
        errors.refuse()
        raise
