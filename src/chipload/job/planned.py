"""A job whose program is planned in the plane: a drawing, what is cut from it and how."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.job.sources import Limited, cutters, source
from chipload.job.tables import ALWAYS, MAY, NEEDS, JobTable, LimitsTable, OperationTable


@dataclass(frozen=True)
class Job(Limited):
    """A job that was read and found whole; paths are absolute.

    Parameters
    ----------
    path : the job file
    table : its values
    cutters : by number
    part_file : the drawing or model
    machine, material : a shipped name or a file
    findings : what was noticed and does not stop the job
    overrides : the `--set` texts that were applied
    """

    path: Path
    table: JobTable
    cutters: Mapping[int, Cutter]
    part_file: Path
    machine: str | Path
    material: str | Path
    findings: tuple[str, ...]
    overrides: tuple[str, ...]

    @property
    def operations(self) -> tuple[OperationTable, ...]:
        """The operations in their order."""
        return self.table.operation


def planned_job(path: Path, table: JobTable, overrides: Sequence[str]) -> Job:
    """The job of a table that was read.

    Raises
    ------
    InputError
        Keys do not go together.
    """
    folder = path.parent
    tools = cutters(table.cutter, folder)
    _check(table, tools)
    return Job(
        path, table, tools, folder / table.part.file, source("machine", table.machine, folder),
        source("material", table.material, folder), _unused(table), tuple(overrides),
    )  # fmt: skip


def _check(table: JobTable, cutters: Mapping[int, Cutter]) -> None:
    """What an operation needs by its kind and by its cutter, and that something is checked at all."""
    for k, op in enumerate(table.operation):
        at = f"operation.{k}"
        for key in NEEDS[op.kind]:
            if getattr(op, key) is None:
                raise InputError(f"{at}.{key}: missing: state it (kind = {op.kind} needs it)")
        if op.kind == "contour":
            _check_strategies(at, op)
        if op.cutter not in cutters:
            known = ", ".join(str(n) for n in sorted(cutters))
            raise InputError(f"{at}.cutter = {op.cutter}: no [[cutter]] has this number: state one of {known}")
        cutter = cutters[op.cutter]
        if op.radial_depth_mm >= cutter.diameter:
            raise InputError(
                f"{at}.radial_depth_mm = {op.radial_depth_mm:g}: must be below the cutter's diameter_mm = "
                f"{cutter.diameter:g}: take several passes or a larger cutter"
            )
        if op.axial_depth_mm > cutter.flute_length:
            raise InputError(
                f"{at}.axial_depth_mm = {op.axial_depth_mm:g}: must be at most the cutter's flute_length_mm = "
                f"{cutter.flute_length:g}: take several depths or a longer cutter"
            )
    if not table.limits.stated:
        names = ", ".join(LimitsTable.model_fields)
        raise InputError(f"limits: none is stated, so nothing would be checked: state at least one of {names}")


def _check_strategies(at: str, op: OperationTable) -> None:
    listed = op.strategies or ()
    if not listed:
        raise InputError(f"{at}.strategies = []: must name at least one of plain, backward, feed")
    if len(set(listed)) < len(listed):
        raise InputError(f"{at}.strategies = {list(listed)}: a strategy is listed twice: list each once")
    if op.use is None and len(listed) > 1:
        raise InputError(f"{at}.use: missing: state which of {', '.join(listed)} is released")
    if op.use is not None and op.use not in listed:
        raise InputError(f"{at}.use = '{op.use}': must be one of {at}.strategies = {', '.join(listed)}")


def _unused(table: JobTable) -> tuple[str, ...]:
    """Keys that are stated but mean nothing to the kind of their operation."""
    out = []
    for k, op in enumerate(table.operation):
        known = {*ALWAYS, "clearance_mm", *NEEDS[op.kind], *MAY[op.kind]}
        stated = [key for key in type(op).model_fields if getattr(op, key) is not None]
        out += [f"operation.{k}.{key}: not used by kind = {op.kind}" for key in stated if key not in known]
    return tuple(out)
