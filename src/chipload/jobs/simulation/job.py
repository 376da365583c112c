"""The job that simulates an existing program: checks of its tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from chipload.checking.dynamics import dynamics_of
from chipload.checking.inputs import contradictions
from chipload.checking.settings import Limits
from chipload.cutter.cutter import Cutter
from chipload.jobs.messages import Errors
from chipload.jobs.simulation.fixtures import fixture_errors
from chipload.jobs.simulation.tables import ProgramLimitsTable, SimulationJobTable, SolidTable
from chipload.jobs.simulation.values import elasticity_of, machine_table_errors, settings_of
from chipload.jobs.sources import Limited, cutters, sources_of
from chipload.jobs.tables import value_of

Job = TypeVar("Job", bound="ProgramJob")


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
    """

    path: Path
    table: SimulationJobTable
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


def program_job(
    kind: type[Job], path: Path, table: SimulationJobTable, overrides: Sequence[str], wrong: Iterable[str] = ()
) -> Job:
    """Return the job of a table that was read.

    Parameters
    ----------
    kind : of job
    wrong : function that yields the errors that the capability itself finds in the table of a simulation

    Raises
    ------
    InputError
        Keys do not go together.
    """
    folder, errors = path.parent, Errors()
    named = [key for key in ("machine", "material") if getattr(table, key) is not None]
    sources: dict[str, str | Path] = {}
    tools: dict[int, Cutter] = {}
    errors.texts += missing_keys(table.model_dump(exclude_none=True))
    with errors.collect():
        sources = sources_of(table, folder, *named)
    if table.operation:
        errors.texts += [*_contradictions(table), *wrong]
        with errors.collect():
            tools = cutters(table.cutter, folder)
        errors.texts += [
            f"operation.0.speeds: cutter {n} is a body (body_mm) whose load is unknown: leave speeds out"
            for n, cutter in tools.items()
            if cutter.body and getattr(table.operation[0], "speeds", None) is not None
        ]
        errors.texts += [text for k, f in enumerate(table.fixture) for text in fixture_errors(f, f"fixture.{k}")]
        with errors.collect("operation.0."):
            settings_of(table.operation[0])
        with errors.collect():
            elasticity = elasticity_of(table, folder)
            errors.texts += contradictions(value_of(Limits, table.limits), elasticity, table.part is not None)
            if elasticity.vibration is not None and tools:
                dynamics_of(elasticity.vibration, tools, elasticity.workpiece)
    else:
        errors.texts += [
            f'{key}: not used where a program is only read: add an [[operation]] with kind = "simulate" or leave it out'
            for key in (
                "stock",
                "part",
                "fixture",
                "machine_table",
                "material",
                "cutter",
                "stiffness",
                "dynamics",
                "workpiece",
                "setup",
            )
            if getattr(table, key, None)
        ]
    errors.refuse()
    tool_table = table.program.tools
    return kind(
        path,
        table,
        folder / table.program.file,
        None if tool_table is None else folder / tool_table,
        sources["machine"],
        tuple(overrides),
        tools,
        sources.get("material"),
    )


def missing_keys(values: Mapping[str, Any]) -> list[str]:
    """Return the tables that a simulation lacks; ``values`` are those of the file."""
    if not values.get("operation"):
        return []
    needs = ("stock", "material", "cutter")
    return [f"{key}: missing: state it (kind = simulate needs it)" for key in needs if not values.get(key)]


def _contradictions(table: SimulationJobTable) -> Iterator[str]:
    """Yield a message for each contradiction between values of a simulation, and if nothing is checked."""
    if table.stock is not None:
        yield from stock_errors(table.stock)
    yield from machine_table_errors(table.machine_table)
    if table.dynamics is None and table.operation[0].speeds is not None:
        yield "operation.0.speeds: needs modes of vibration: state [dynamics] or leave it out"
    if not table.limits.stated:
        names = ", ".join(ProgramLimitsTable.model_fields)
        yield f"limits: none is stated, so nothing would be checked: state at least one of {names}"


def stock_errors(stock: SolidTable) -> Iterator[str]:
    """Yield a message for each contradiction of a stock."""
    block = (stock.low_mm is not None, stock.high_mm is not None)
    if any(block) == (stock.file is not None) or any(block) != all(block):
        yield "stock: state either low_mm and high_mm of a block, or a file"
    saved = stock.file is not None and stock.file.lower().endswith(".npz")
    if saved and stock.layer_mm is not None:
        yield "stock.layer_mm: leave it out: the layers of an earlier result stay"


def note_of_passes(job: ProgramJob, *passes: str) -> str:
    """Return a note on what a stopped job does not resume: these passes and the compliance of a workpiece.

    The simulation of the resulting program does resume.
    """
    if not job.simulates:
        return ""
    found = " and ".join((*passes, *(("the compliance of the workpiece",) if job.table.workpiece is not None else ())))
    if not found:
        return ""
    return f"the calculation of {found} does not resume: if it is stopped there, it starts again; the last pass resumes"
