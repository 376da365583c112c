"""A job: one TOML file that names part, stock, machine, material and cutters, what to do, and the limits.

Every key carries its unit in its name; inside chipload the planner gets mm, mm/s and rad/s. A refused job gives one
line: the file, the dotted key, the value, the limit and what to do.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.job.messages import first_error
from chipload.job.override import override
from chipload.job.tables import (
    ALWAYS,
    MAY,
    NEEDS,
    JobTable,
    LimitsTable,
    LoadLimitsTable,
    OperationTable,
    ProgramJobTable,
    SourceTable,
)


@dataclass(frozen=True)
class Job:
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

    @property
    def limits(self) -> dict[str, float]:
        """The limits that are stated, by name."""
        return self.table.limits.stated

    @property
    def unchecked(self) -> tuple[str, ...]:
        """Names of the limits that are not stated, so that nothing holds the job against them."""
        return self.table.limits.unstated


@dataclass(frozen=True)
class ProgramJob:
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
    """

    path: Path
    table: ProgramJobTable
    program_file: Path
    tools_file: Path | None
    machine: str | Path
    overrides: tuple[str, ...]
    cutters: Mapping[int, Cutter]
    material: str | Path | None

    @property
    def simulates(self) -> bool:
        """Whether the program is run through a stock."""
        return bool(self.table.operation)

    @property
    def limits(self) -> dict[str, float]:
        """The limits that are stated, by name."""
        return self.table.limits.stated

    @property
    def unchecked(self) -> tuple[str, ...]:
        """Names of the limits that are not stated."""
        return self.table.limits.unstated


def load_job(path: str | Path, overrides: Sequence[str] = ()) -> Job | ProgramJob:
    """Read a job file and apply ``key.path=value`` overrides; one with a ``[program]`` runs that.

    Raises
    ------
    InputError
        The file cannot be read, a key is unknown or missing, a value is out of range: one line that names it.
    """
    path = Path(path).absolute()
    label = path.name
    try:
        raw = tomllib.loads(path.read_bytes().decode("utf-8"))
    except OSError as err:
        raise InputError(f"{path}: cannot be read: {err.strerror}") from None
    except (ValueError, RecursionError) as err:
        raise InputError(f"{label}: not a TOML file: {err}") from None
    for text in overrides:
        override(raw, text)
    root: type[ProgramJobTable] | type[JobTable] = ProgramJobTable if "program" in raw else JobTable
    try:
        table = root.model_validate(raw)
    except ValidationError as err:
        raise InputError(f"{label}: {first_error(err, root)}") from None
    except OverflowError:
        raise InputError(f"{label}: a number is too large: write it below 1e300") from None
    if isinstance(table, ProgramJobTable):
        return _program_job(path, table, overrides)
    try:
        cutters = _cutters(table, path.parent)
        _check(table, cutters)
    except InputError as err:
        raise InputError(f"{label}: {err}") from None
    return Job(
        path,
        table,
        cutters,
        path.parent / table.part.file,
        _source("machine", table.machine, path.parent, label),
        _source("material", table.material, path.parent, label),
        _unused(table),
        tuple(overrides),
    )


def _program_job(path: Path, table: ProgramJobTable, overrides: Sequence[str]) -> ProgramJob:
    folder, tools, label = path.parent, table.program.tools, path.name
    material = None
    cutters: dict[int, Cutter] = {}
    if table.operation:
        try:
            _check_simulation(table)
            cutters = _cutters(table, folder)
        except InputError as err:
            raise InputError(f"{label}: {err}") from None
        if table.material is not None:
            material = _source("material", table.material, folder, label)
    else:
        for key in ("stock", "material", "cutter"):
            if getattr(table, key):
                raise InputError(
                    f"{label}: {key}: not used where a program is only read: add an [[operation]] with "
                    f'kind = "simulate" or leave it out'
                )
    return ProgramJob(
        path,
        table,
        folder / table.program.file,
        None if tools is None else folder / tools,
        _source("machine", table.machine, folder, label),
        tuple(overrides),
        cutters,
        material,
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
    if not table.limits.stated:
        names = ", ".join(LoadLimitsTable.model_fields)
        raise InputError(f"limits: none is stated, so nothing would be checked: state at least one of {names}")


# -- what one model cannot see ----------------------------------------------------------------------------------
def _source(key: str, table: SourceTable, folder: Path, label: str) -> str | Path:
    if (table.name is None) == (table.file is None):
        said = "none is" if table.name is None else "both are"
        raise InputError(f"{label}: {key}: {said} stated: state either {key}.name or {key}.file")
    return table.name if table.name is not None else folder / str(table.file)


def _cutters(table: JobTable | ProgramJobTable, folder: Path) -> dict[int, Cutter]:
    out: dict[int, Cutter] = {}
    for k, entry in enumerate(table.cutter):
        try:
            cutter = entry.cutter(folder)
        except InputError as err:
            raise InputError(str(err).replace("cutter", f"cutter.{k}", 1)) from None
        if cutter.number in out:
            raise InputError(f"cutter.{k}.number = {cutter.number}: is taken by another cutter: give each its own")
        out[cutter.number] = cutter
    return out


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
