"""An impeller job: checks of its tables against one another, and the paths of its files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chipload.jobs.impeller.tables import (
    ImpellerJobTable,
    ImpellerOperationTable,
    ImpellerTable,
    SectionsTable,
    StepTable,
    SurfaceTable,
)
from chipload.jobs.messages import Errors
from chipload.jobs.simulation.fixtures import fixture_errors
from chipload.jobs.simulation.job import stock_errors
from chipload.jobs.simulation.values import machine_table_errors
from chipload.jobs.sources import source, sources_of

#: of flank passes and point milling, whose feeds forces do not find
_NO_FORCES = (
    "operation.0.{}.feed_mm_min: missing: operation.0.forces finds the feeds of the index table alone, none on five "
    "axes: state it"
)


@dataclass(frozen=True)
class ImpellerJob:
    """A job that mills an impeller; paths are absolute.

    Parameters
    ----------
    path : the job file
    table : its values
    machine, catalogue : a shipped name or a file
    material : likewise, of the force coefficients; None: the job has no `forces`
    flank_machine, point_machine : likewise, of flank passes and of point milling on five axes; None: there is none
    files : what the part is read from, by what it is
    overrides : the `--set` texts that were applied
    """

    path: Path
    table: ImpellerJobTable
    machine: str | Path
    catalogue: str | Path
    files: dict[str, Path]
    overrides: tuple[str, ...]
    material: str | Path | None = None
    flank_machine: str | Path | None = None
    point_machine: str | Path | None = None

    @property
    def operation(self) -> ImpellerOperationTable:
        """The operation."""
        return self.table.operation[0]


def load(path: Path, table: ImpellerJobTable, overrides: Sequence[str]) -> ImpellerJob:
    """The job of a table that was read.

    Raises
    ------
    InputError
        Keys do not go together.
    """
    folder, part, errors = path.parent, table.impeller, Errors()
    sources: dict[str, str | Path] = {}
    errors.texts += missing_keys(table.model_dump(exclude_none=True))
    with errors.collect():
        sources = sources_of(table, folder, "machine", "catalogue")
    forces = table.operation[0].forces
    material: str | Path | None = None
    if forces is not None:
        with errors.collect():
            material = source("operation.0.forces.material", forces.material, folder)
    flank = table.operation[0].flank
    flank_machine: str | Path | None = None
    if flank is not None:
        with errors.collect():
            flank_machine = source("operation.0.flank.machine", flank.machine, folder)
        errors.texts += _wrong_flank(table)
    points = table.operation[0].point_milling
    point_machine: str | Path | None = None
    if points is not None:
        with errors.collect():
            point_machine = source("operation.0.point_milling.machine", points.machine, folder)
        if table.operation[0].paths is None:
            errors.add("operation.0.point_milling: takes its links from [operation.paths]: state that too")
    if table.operation[0].blades is not None:
        errors.texts += _wrong_blades(table)
    if forces is not None and flank is not None and flank.feed_mm_min is None:
        errors.add(_NO_FORCES.format("flank"))
    if forces is not None and points is not None and points.feed_mm_min is None:
        errors.add(_NO_FORCES.format("point_milling"))
    for k, surface in enumerate(table.surface):
        errors.texts += _wrong_surface(f"surface.{k}", surface, part)
        if any((s.body, s.side) == (surface.body, surface.side) for s in table.surface[:k]):
            errors.add(f"surface.{k}: {surface.body} {surface.side} appears twice: list each surface once")
    errors.texts += [*_wrong_paths(table.operation[0]), *machine_table_errors(table.machine_table)]
    errors.texts += _wrong_stock(table)
    errors.texts += [text for k, f in enumerate(table.fixture) for text in fixture_errors(f, f"fixture.{k}")]
    if part.sections is not None:
        errors.texts += _wrong_sections(part.sections)
    if part.step is not None:
        errors.texts += _wrong_step(part.step)
    errors.refuse()
    return ImpellerJob(
        path, table, sources["machine"], sources["catalogue"], _files(part, folder), tuple(overrides), material,
        flank_machine, point_machine,
    )  # fmt: skip


def resume_note(job: ImpellerJob) -> str:
    """Note on the part of the work that is not kept while the job runs: nothing that takes long."""
    return ""


def missing_keys(values: Mapping[str, Any]) -> list[str]:
    """Keys that a part lacks or has twice; ``values`` are those of the file."""
    part = values.get("impeller")
    if not isinstance(part, Mapping):
        return []
    stated = [key for key in ("shape", "sections", "step") if key in part]
    if len(stated) == 1:
        return []
    count_text = f"{' and '.join(stated)} are" if stated else "none is"
    return [f"impeller: {count_text} stated: state one of [impeller.shape], [impeller.sections], [impeller.step]"]


def _wrong_paths(op: ImpellerOperationTable) -> Iterator[str]:
    paths, rough = op.paths, op.rough
    if paths is not None and not paths.touch_mm < paths.margin_mm < paths.lift_mm:
        yield (
            f"operation.0.paths.margin_mm = {paths.margin_mm:g}: must be above touch_mm = {paths.touch_mm:g} and below "
            f"lift_mm = {paths.lift_mm:g}"
        )
    if paths is not None and paths.lead_mm is not None and paths.lead_mm > paths.lift_mm:
        yield f"operation.0.paths.lead_mm = {paths.lead_mm:g}: must be at most lift_mm = {paths.lift_mm:g}"
    if rough is not None and paths is not None and paths.lead_mm is not None:
        stands = max(rough.blades_mm, rough.hub_mm)
        if paths.lead_mm < stands:
            yield (
                f"operation.0.paths.lead_mm = {paths.lead_mm:g}: must be at least the allowance of roughing, "
                f"{stands:g} mm, which stands beside a pass"
            )
    if op.forces is not None and op.forces.allowance_mm is None and not _allowance(op) > 0.0:
        yield (
            "operation.0.forces.allowance_mm: missing: there is no allowance of roughing: state what stands on the "
            "surfaces"
        )
    if rough is not None and paths is None:
        yield "operation.0.rough: takes its links from [operation.paths]: state that too"
    if rough is not None and (rough.diameter_mm is None) != (rough.corner_radius_mm is None):
        yield "operation.0.rough: state both diameter_mm and corner_radius_mm, or neither for the largest that fits"


def _wrong_stock(table: ImpellerJobTable) -> Iterator[str]:
    if table.stock is None:
        return
    yield from stock_errors(table.stock)
    if table.operation[0].rough is not None:
        yield "stock: leave it out: the programs begin with the blank of [operation.rough]"
    if table.operation[0].paths is None:
        yield "stock: there are no programs to simulate in it: state [operation.paths] or leave it out"


def _wrong_blades(table: ImpellerJobTable) -> Iterator[str]:
    op, at = table.operation[0], "operation.0.blades"
    if op.forces is None:
        yield f"{at}: there are no forces that bend the blades: state [operation.forces]"
    if op.rough is None and table.stock is None:
        yield f"{at}: forces are those of the simulation in the stock: state [operation.rough] or [stock]"


def _wrong_flank(table: ImpellerJobTable) -> Iterator[str]:
    if table.operation[0].paths is None:
        yield "operation.0.flank: takes its links from [operation.paths]: state that too"
    if not any(s.side in ("plus", "minus") for s in table.surface):
        yield "operation.0.flank: no [[surface]] is a side: list one with side plus or minus, or leave flank out"


def _allowance(op: ImpellerOperationTable) -> float:
    """What roughing leaves at most [mm]."""
    return max(op.rough.blades_mm, op.rough.hub_mm) if op.rough is not None else 0.0


def _wrong_sections(given: SectionsTable) -> Iterator[str]:
    for name in (*given.blade, *given.splitter, given.hub, given.shroud):
        if name.lower().endswith((".stp", ".step")):
            yield f"impeller.sections: {name}: is a STEP file: name its faces in [impeller.step]"


def _files(part: ImpellerTable, folder: Path) -> dict[str, Path]:
    """What the part is read from, by what it is."""
    if part.step is not None:
        points = {key: folder / name for key, name in _point_files(part.step).items()}
        return {"step": folder / part.step.file} | points
    if part.sections is None:
        return {}
    given = part.sections
    files = {f"blade {k}": folder / name for k, name in enumerate(given.blade, 1)}
    files |= {f"splitter {k}": folder / name for k, name in enumerate(given.splitter, 1)}
    return files | {"hub": folder / given.hub, "shroud": folder / given.shroud}


def _point_files(given: StepTable) -> dict[str, str]:
    """Hub and shroud where they are files of points."""
    return {key: name for key in ("hub", "shroud") if isinstance(name := getattr(given, key), str)}


def _wrong_step(given: StepTable) -> Iterator[str]:
    if (given.splitter_plus is None) != (given.splitter_minus is None):
        missing = "plus" if given.splitter_plus is None else "minus"
        yield f"impeller.step.splitter_{missing}: missing: state both sides of the splitter or neither"
    points = _point_files(given)
    for key in ("hub", "shroud"):
        if not getattr(given, key):
            yield f"impeller.step.{key} = []: must name at least one face, or a file of points"
    if bool(points) == (given.unit is None):
        problem = (
            "missing: state it for the points of " + " and ".join(points) if points else "of no file: leave it out"
        )
        yield f"impeller.step.unit: {problem}"


def _wrong_surface(at: str, surface: SurfaceTable, part: ImpellerTable) -> Iterator[str]:
    for key in ("along", "up"):
        low, high = getattr(surface, key)
        if low >= high:
            yield f"{at}.{key} = [{low:g}, {high:g}]: must ascend within 0 to 1"
    if min(surface.points) < 2:
        yield f"{at}.points = {list(surface.points)}: must be at least 2 each"
    if surface.side.endswith(" fillet") and part.fillet_mm is None:
        yield f"{at}.side = {surface.side!r}: the impeller has no fillets: state impeller.fillet_mm"
    if surface.body == "splitter" and not part.has_splitter:
        yield f"{at}.body = 'splitter': the impeller has no splitter: leave it out"
