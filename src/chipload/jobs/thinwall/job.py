"""A job that cuts a thin wall: its tables checked against one another, its files found."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chipload.cutter.cutter import Cutter
from chipload.jobs.messages import Errors
from chipload.jobs.sources import Limited, sources_and_cutters, unknown_cutter
from chipload.jobs.thinwall.tables import (
    EVERY,
    SHAPES,
    ThinWallJobTable,
    WallOperationTable,
)


@dataclass(frozen=True)
class ThinWallJob(Limited):
    """A job that cuts a thin wall; paths are absolute.

    Parameters
    ----------
    path : the job file
    table : its values
    cutters : by number
    machine, material : a shipped name or a file
    section_files : of the sections, or the STEP file; empty for other shapes
    threshold_file : experiments; None: the threshold is modelled
    overrides : the `--set` texts that were applied
    """

    path: Path
    table: ThinWallJobTable
    cutters: Mapping[int, Cutter]
    machine: str | Path
    material: str | Path
    section_files: tuple[Path, ...]
    threshold_file: Path | None
    overrides: tuple[str, ...]

    @property
    def operation(self) -> WallOperationTable:
        """The operation."""
        return self.table.operation[0]


def load(path: Path, table: ThinWallJobTable, overrides: Sequence[str]) -> ThinWallJob:
    """The job of a table that was read.

    Raises
    ------
    InputError
        Keys do not go together.
    """
    folder, errors = path.parent, Errors()
    errors.texts += missing(table.model_dump(exclude_none=True))
    sources, tools = sources_and_cutters(table, folder, errors, "machine", "material")
    errors.texts += _contradictions(table, tools)
    errors.refuse()
    wall = table.wall
    return ThinWallJob(
        path,
        table,
        tools,
        sources["machine"],
        sources["material"],
        tuple(folder / f for f in wall.files or (() if wall.file is None else (wall.file,))),
        None if table.threshold is None else folder / table.threshold.file,
        tuple(overrides),
    )


def missing(values: Mapping[str, Any]) -> list[str]:
    """The keys that a wall lacks by its shape; ``values`` are those of the file."""
    wall = values.get("wall")
    if not isinstance(wall, Mapping):
        return []
    shape = str(wall.get("shape"))
    needs = SHAPES[shape][0] if shape in SHAPES else ()
    return [f"wall.{key}: missing: state it (shape = {shape} needs it)" for key in needs if key not in wall]


def _contradictions(table: ThinWallJobTable, tools: Mapping[int, Cutter]) -> Iterator[str]:
    """What values of the wall, the operation and its cutter contradict."""
    wall, op = table.wall, table.operation[0]
    needs, may = SHAPES[wall.shape]
    for key in type(wall).model_fields:
        if getattr(wall, key) is not None and key not in (*EVERY, *needs, *may):
            yield f"wall.{key}: not used by shape = {wall.shape}: leave it out"
    yield from unknown_cutter("operation.0.cutter", op.cutter, tools)
    if (op.step_over_mm is None) == (op.scallop_um is None):
        said = "none is" if op.step_over_mm is None else "both are"
        yield f"operation.0: {said} stated: state either step_over_mm or scallop_um"
    if op.cutter in tools and wall.foot_mm < tools[op.cutter].corner_radius:
        yield (
            f"wall.foot_mm = {wall.foot_mm:g}: must be at least the corner radius of cutter {op.cutter}, "
            f"{tools[op.cutter].corner_radius:g}: the cutter reaches so far below its last row, towards the clamp"
        )
    if op.clearance_mm <= max(wall.allowance_mm):
        yield (
            f"operation.0.clearance_mm = {op.clearance_mm:g}: must be above wall.allowance_mm = "
            f"{max(wall.allowance_mm):g}: the cutter goes back over stock"
        )
