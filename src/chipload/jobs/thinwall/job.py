"""A thin-wall job: checks of its tables against one another, and the paths of its files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chipload.checking.clamped import wrong_clamps
from chipload.cutter.cutter import Cutter
from chipload.jobs.messages import Errors
from chipload.jobs.simulation.values import clamps_of
from chipload.jobs.sources import Limited, sources_and_cutters, unknown_cutter
from chipload.jobs.thinwall.tables import (
    EVERY,
    SHAPES,
    FaceWallTable,
    ThinWallJobTable,
    WallOperationTable,
    WallTable,
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
    part_file : STEP file of a part with walls; None: the job has one wall of a shape
    threshold_file : experiments; None: the threshold is modelled
    overrides : the `--set` texts that were applied
    """

    path: Path
    table: ThinWallJobTable
    cutters: Mapping[int, Cutter]
    machine: str | Path
    material: str | Path
    section_files: tuple[Path, ...]
    part_file: Path | None
    threshold_file: Path | None
    overrides: tuple[str, ...]

    @property
    def walls(self) -> tuple[FaceWallTable, ...]:
        """The walls of a part; none: the job has one wall of a shape."""
        return self.table.wall if isinstance(self.table.wall, tuple) else ()

    @property
    def wall(self) -> WallTable:
        """The wall of a shape."""
        assert isinstance(self.table.wall, WallTable)
        return self.table.wall

    @property
    def operation(self) -> WallOperationTable:
        """The last operation, which makes the finished surface."""
        return self.table.operation[-1]


def load(path: Path, table: ThinWallJobTable, overrides: Sequence[str]) -> ThinWallJob:
    """The job of a table that was read.

    Raises
    ------
    InputError
        Keys do not go together.
    """
    folder, errors = path.parent, Errors()
    errors.texts += missing_keys(table.model_dump(exclude_none=True))
    sources, tools = sources_and_cutters(table, folder, errors, "machine", "material")
    errors.texts += _contradictions(table, tools)
    errors.refuse()
    wall = table.wall
    files: tuple[str, ...] = ()
    if isinstance(wall, WallTable):
        files = wall.files or (() if wall.file is None else (wall.file,))
    return ThinWallJob(
        path,
        table,
        tools,
        sources["machine"],
        sources["material"],
        tuple(folder / f for f in files),
        None if table.part is None else folder / table.part.file,
        None if table.threshold is None else folder / table.threshold.file,
        tuple(overrides),
    )


def resume_note(job: ThinWallJob) -> str:
    """Note on the part of the work that is not kept while the job runs: the plan that is being simulated."""
    return "simulated plans are kept; the simulation of a plan does not resume: if it is stopped, it starts again"


def missing_keys(values: Mapping[str, Any]) -> list[str]:
    """The keys that a wall lacks by its shape; ``values`` are those of the file."""
    wall = values.get("wall")
    if not isinstance(wall, Mapping):
        return []
    shape = str(wall.get("shape"))
    needs = SHAPES[shape][0] if shape in SHAPES else ()
    return [f"wall.{key}: missing: state it (shape = {shape} needs it)" for key in needs if key not in wall]


def _contradictions(table: ThinWallJobTable, tools: Mapping[int, Cutter]) -> Iterator[str]:
    """Contradictions between wall, operation and cutter."""
    wall = table.wall
    if isinstance(wall, WallTable):
        needs, may = SHAPES[wall.shape]
        for key in type(wall).model_fields:
            if getattr(wall, key) is not None and key not in (*EVERY, *needs, *may):
                yield f"wall.{key}: not used by shape = {wall.shape}: leave it out"
        yield from _of_parts_only(table)
        feet, stock = [("wall.foot_mm", wall.foot_mm)], [a for a in wall.allowance_mm if a > 0.0]
    else:
        yield from _part_contradictions(table, wall)
        feet = [(f"wall.{k}.foot_mm", w.foot_mm) for k, w in enumerate(wall) if w.foot_mm is not None]
        stock = [a for w in wall for a in w.allowance_mm]
    for k, op in enumerate(table.operation):
        yield from _of_operation(op, k, tools, feet, max(stock, default=0.0))
    yield from _of_several(table, min(stock, default=0.0))
    yield from _of_flanks(table, tools)
    yield from _of_ends(table)


def _of_operation(
    op: WallOperationTable, number: int, tools: Mapping[int, Cutter], feet: Sequence[tuple[str, float]], most: float
) -> Iterator[str]:
    """Contradictions of an operation with its cutter, the feet of the walls and the greatest stock."""
    where = f"operation.{number}"
    yield from unknown_cutter(f"{where}.cutter", op.cutter, tools)
    if op.cutter in tools and tools[op.cutter].body:
        yield (
            f"{where}.cutter = {op.cutter}: is a body (tap, thread mill), whose chips are not simulated: state a "
            "ball nose, a bull nose or a barrel by barrel_radius_mm"
        )
    yield from _of_rows(op, where)
    if op.rows is None and op.contact == "corner" and (op.step_over_mm is None) == (op.scallop_um is None):
        state = "none is" if op.step_over_mm is None else "both are"
        yield f"{where}: {state} stated: state either step_over_mm or scallop_um"
    for key, foot in feet:
        barrel = op.cutter in tools and tools[op.cutter].barrel_radius is not None
        if op.cutter in tools and not barrel and foot < tools[op.cutter].corner_radius:
            yield (
                f"{key} = {foot:g}: must be at least the corner radius of cutter {op.cutter}, "
                f"{tools[op.cutter].corner_radius:g}: the cutter reaches so far below its last row, towards the clamp"
            )
    if op.clearance_mm <= most:
        yield (
            f"{where}.clearance_mm = {op.clearance_mm:g}: must be above wall.allowance_mm = {most:g}: the cutter "
            "goes back over stock"
        )


def _of_rows(op: WallOperationTable, where: str) -> Iterator[str]:
    """Keys of planned rows that a finishing program gives, or that are missing without one."""
    if op.ramp_deg is not None and op.contact != "end":
        yield f"{where}.ramp_deg: for contact = end only: leave it out"
    if op.slope is None and op.contact != "end":
        yield f"{where}.slope: missing: state it"
    if op.contact == "flank":
        yield from _of_flank_keys(op, where)
        return
    if op.contact == "end":
        yield from _of_end_keys(op, where)
        return
    if op.axial_depth_mm is not None:
        yield f"{where}.axial_depth_mm: for contact = flank only: leave it out"
    for key in ("milling", "lean_deg", "lead_deg"):
        if op.rows is None and getattr(op, key) is None:
            yield f"{where}.{key}: missing: state it, or a finishing program as {where}.rows"
    for key in ("milling", "lean_deg", "lead_deg", "step_over_mm", "scallop_um"):
        if op.rows is not None and getattr(op, key) is not None:
            yield f"{where}.{key}: not used with {where}.rows, whose program gives it: leave it out"


def _of_flank_keys(op: WallOperationTable, where: str) -> Iterator[str]:
    """Keys that flank contact needs, and those that it does not use."""
    for key in ("milling", "axial_depth_mm"):
        if getattr(op, key) is None:
            yield f"{where}.{key}: missing: state it (contact = flank needs it)"
    for key in ("rows", "lean_deg", "lead_deg", "step_over_mm", "scallop_um"):
        if getattr(op, key) is not None:
            yield f"{where}.{key}: not used with contact = flank, whose axis stands along the wall: leave it out"


def _of_end_keys(op: WallOperationTable, where: str) -> Iterator[str]:
    """Keys that end contact needs, and those that it does not use."""
    for key in ("milling", "step_over_mm"):
        if getattr(op, key) is None:
            yield f"{where}.{key}: missing: state it (contact = end needs it)"
    for key in ("rows", "lean_deg", "lead_deg", "scallop_um", "axial_depth_mm", "slope"):
        if getattr(op, key) is not None:
            yield f"{where}.{key}: not used with contact = end (level passes, upright axis): leave it out"
    if op.compensate_um > 0.0:
        yield f"{where}.compensate_um: not for floors, whose form error is a bound only: leave it out"


def _of_ends(table: ThinWallJobTable) -> Iterator[str]:
    """Contradictions of end contact with the walls and with operations of other contact."""
    ends = [k for k, op in enumerate(table.operation) if op.contact == "end"]
    if not ends:
        if not isinstance(table.wall, WallTable):
            for k, wall in enumerate(table.wall):
                if wall.foot_mm is None:
                    yield f"wall.{k}.foot_mm: missing: state it (a side of a wall needs it)"
        return
    where = f"operation.{ends[0]}.contact = end"
    if isinstance(table.wall, WallTable):
        yield f"{where}: cuts floors of a part: state them as [[wall]], or contact = corner"
        return
    if len(ends) < len(table.operation):
        yield f"{where}: all operations of the job must have it: plan floors and sides in jobs of their own"
    for k, wall in enumerate(table.wall):
        if wall.foot_mm is not None:
            yield f"wall.{k}.foot_mm: not used with contact = end: leave it out"
        if wall.opposite is not None:
            yield f"wall.{k}.opposite: a floor is cut from above only: plan its lower side in a setup of its own"


def _of_flanks(table: ThinWallJobTable, tools: Mapping[int, Cutter]) -> Iterator[str]:
    """Contradictions of flank contact with the wall, other operations, and the length of cutter and flutes."""
    flanks = [k for k, op in enumerate(table.operation) if op.contact == "flank"]
    if not flanks:
        return
    where, wall = f"operation.{flanks[0]}.contact = flank", table.wall
    if not isinstance(wall, WallTable) or wall.shape != "plate":
        yield f"{where}: a flank touches a plane wall along a line: state [wall] shape = plate, or contact = corner"
        return
    if len(table.operation) > 1:
        yield f"{where}: for one operation only: plan each operation in a job of its own"
    for key in ("threshold", "dynamics"):
        if getattr(table, key) is not None:
            yield f"{key}: for contact = corner only: leave it out"
    op, height = table.operation[flanks[0]], wall.height_mm
    if op.cutter not in tools or height is None:
        return
    cutter = tools[op.cutter]
    needed = height - wall.foot_mm + cutter.corner_radius
    if cutter.overhang <= needed:
        yield (
            f"cutter.{op.cutter}.overhang_mm = {cutter.overhang:g}: must be above {needed:g}: the cutter stands along "
            "the wall, and its holder would collide with it"
        )
    thinner = cutter.shank_diameter is not None and cutter.shank_diameter < cutter.diameter
    if cutter.flute_length < needed and not thinner:
        yield (
            f"cutter.{op.cutter}.flute_length_mm = {cutter.flute_length:g}: must be at least {needed:g}, from the last "
            "row to the free edge, or shank_diameter_mm below the diameter: the shank would rub on the wall"
        )


def _of_several(table: ThinWallJobTable, least: float) -> Iterator[str]:
    """Contradictions of consecutive operations: the stock that they leave, and keys of the last one.

    ``least`` is the least stock of a side before the first one [mm].
    """
    found = least
    for k, op in enumerate(table.operation):
        where, last = f"operation.{k}", k == len(table.operation) - 1
        if last and op.leave_mm > 0.0:
            yield f"{where}.leave_mm = {op.leave_mm:g}: the last operation finishes: leave it out"
        elif not last and not 0.0 < op.leave_mm < found:
            yield (
                f"{where}.leave_mm = {op.leave_mm:g}: must be above 0 and below {found:g}, the stock that the "
                "operation finds: it is what the next one cuts"
            )
        if not last:
            for key in ("least_error", "compensate_um"):
                if getattr(op, key):
                    yield f"{where}.{key}: belongs to the last operation, which makes the form error: move it there"
            if not op.refine:
                yield f"{where}.refine: belongs to the last operation and holds for all of them: move it there"
            found = op.leave_mm
    if table.dynamics is not None and any(op.rows is not None for op in table.operation):
        yield "dynamics: for planned rows only: leave it out, or operation.rows"
    if len(table.operation) > 1:
        for key in ("threshold", "dynamics"):
            if getattr(table, key) is not None:
                yield f"{key}: for one operation only: leave it out, or plan each operation in a job of its own"


def _of_parts_only(table: ThinWallJobTable) -> Iterator[str]:
    """Keys that a wall of a shape does not use."""
    if table.part is not None:
        yield "part: not used by one [wall]: leave it out, or state walls of the part as [[wall]]"
    for key in ("clamp", "order", "cell_mm"):
        if getattr(table.workpiece, key):
            yield f"workpiece.{key}: not used by one [wall], which is clamped at its foot: leave it out"


def _part_contradictions(table: ThinWallJobTable, walls: Sequence[FaceWallTable]) -> Iterator[str]:
    """What the walls of a part lack, and keys that they do not use."""
    if table.neighbour:
        yield "neighbour: for one [wall] only: leave it out; what stands next to a [[wall]] belongs to the part"
    if not walls:
        yield "wall: has no entry: state at least one [[wall]]"
    if table.part is None:
        yield "part: missing: state [part] with the file of the model whose faces [[wall]] names"
    if not table.workpiece.clamp:
        yield "workpiece.clamp: missing: state how the part is held, as [[workpiece.clamp]]"
    yield from wrong_clamps(clamps_of(table.workpiece.clamp))
    for key in ("threshold", "dynamics"):
        if getattr(table, key) is not None:
            yield f"{key}: for one [wall] of a shape only: leave it out"
    for k, wall in enumerate(walls):
        sides = 1 if wall.opposite is None else 2
        if len(wall.allowance_mm) != sides:
            yield (
                f"wall.{k}.allowance_mm: {len(wall.allowance_mm)} stated for {sides} "
                f"side{'s' if sides > 1 else ''}: state one for the face, and one for the opposite face if it is stated"
            )
