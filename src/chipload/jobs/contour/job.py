"""The job that plans contours and pockets: checks of its tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chipload.cutter.cutter import Cutter
from chipload.jobs.contour.tables import (
    ALWAYS,
    MAY,
    NEEDS,
    STRATEGIES,
    ContourJobTable,
    ContourLimitsTable,
    OperationTable,
)
from chipload.jobs.messages import Errors
from chipload.jobs.sources import Limited, entries_of, sources_and_cutters, unknown_cutter


@dataclass(frozen=True)
class ContourJob(Limited):
    """A valid job; paths are absolute.

    Parameters
    ----------
    path : the job file
    table : its values
    cutters : by number
    part_file : the drawing or model
    machine, material : a shipped name or a file
    findings : observations that do not stop the job
    overrides : the `--set` texts that were applied
    """

    path: Path
    table: ContourJobTable
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


def load(path: Path, table: ContourJobTable, overrides: Sequence[str]) -> ContourJob:
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
    return ContourJob(
        path, table, tools, folder / table.part.file, sources["machine"], sources["material"], _unused_keys(table),
        tuple(overrides),
    )  # fmt: skip


def missing_keys(values: Mapping[str, Any]) -> list[str]:
    """The keys that an operation lacks by its kind; ``values`` are those of the file."""
    return [
        f"operation.{k}.{key}: missing: state it (kind = {op['kind']} needs it)"
        for k, op in entries_of(values, "operation")
        for key in NEEDS.get(str(op.get("kind")), ())
        if key not in op
    ]


def _contradictions(table: ContourJobTable, cutters: Mapping[int, Cutter]) -> Iterator[str]:
    """Contradictions between an operation and its cutter, and a job without limits."""
    for k, op in enumerate(table.operation):
        at = f"operation.{k}"
        if op.kind in STRATEGIES and op.strategies is not None:
            yield from _wrong_strategies(at, op)
        yield from unknown_cutter(f"{at}.cutter", op.cutter, cutters)
        cutter = cutters.get(op.cutter)
        if op.kind == "pocket":
            yield from _wrong_pocket(at, k, table, cutters)
        if cutter is not None and op.radial_depth_mm is not None and op.radial_depth_mm >= cutter.diameter:
            yield (
                f"{at}.radial_depth_mm = {op.radial_depth_mm:g}: must be below the cutter's diameter_mm = "
                f"{cutter.diameter:g}: take several passes or a larger cutter"
            )
        key, depth = ("axial_depth_mm", op.axial_depth_mm) if op.depth_mm is None else ("depth_mm", op.depth_mm)
        if cutter is not None and depth > cutter.flute_length:
            yield (
                f"{at}.{key} = {depth:g}: must be at most the cutter's flute_length_mm = "
                f"{cutter.flute_length:g}: take several depths or a longer cutter"
            )
    if len(table.part.lines) % 2:
        yield f"part.lines = {list(table.part.lines)}: must be a first and a last line for each height"
    if table.part.lines and table.part.labels:
        yield "part.lines and part.labels: stated twice: state one of them"
    if table.stock.file is not None:
        yield from _wrong_stock(table)
    if not table.limits.stated:
        names = ", ".join(ContourLimitsTable.model_fields)
        yield f"limits: none is stated, so nothing would be checked: state at least one of {names}"


def _wrong_stock(table: ContourJobTable) -> Iterator[str]:
    """Contradictions with a stock of an earlier result."""
    if any(op.kind != "pocket" for op in table.operation):
        yield "stock.file: only pockets can continue from an earlier result: leave it out for other kinds"
    if table.part.stock_layers:
        yield "stock.file and part.stock_layers: state one of them: the file holds the outline"
    for k, op in enumerate(table.operation):
        for key in ("holes_mm", "rest_of"):
            if getattr(op, key) is not None:
                yield f"operation.{k}.{key}: leave it out with stock.file, which holds what was cut before"


def _wrong_pocket(at: str, k: int, table: ContourJobTable, cutters: Mapping[int, Cutter]) -> Iterator[str]:
    """Contradictions between the keys of a pocket."""
    op = table.operation[k]
    if (op.radial_depth_mm is None) == (op.engagement_deg is None):
        state = "missing" if op.radial_depth_mm is None else "stated twice"
        yield f"{at}.radial_depth_mm and {at}.engagement_deg: {state}: state one of them"
    if op.side in ("left", "right"):
        yield f"{at}.side = '{op.side}': must be inside or outside of a pocket"
    if op.entry == "ramp" and "trochoidal" in (op.strategies or ()):
        yield (
            f"{at}.entry = 'ramp': trochoidal passes begin at a bore: state helix, or leave trochoidal out of "
            f"{at}.strategies"
        )
    yield from _wrong_levels(at, op, table, cutters)
    if op.rest_of is None:
        return
    if op.rest_of >= k or table.operation[op.rest_of].kind != "pocket":
        yield f"{at}.rest_of = {op.rest_of}: must be the number of an earlier pocket operation, from 0"
        return
    before = table.operation[op.rest_of]
    if before.tabs is not None:
        yield f"{at}.rest_of = {op.rest_of}: that operation leaves tabs, which this one does not know"
    deep, own_depth = depth_of(before), depth_of(op, finished=True)
    if own_depth > deep + 1e-9:
        yield (
            f"{at}.rest_of = {op.rest_of}: that operation is {deep:g} mm deep without its floor_allowance_mm, this one "
            f"{own_depth:g}: state a depth_mm of at most {deep:g}, or a floor_finish there"
        )
    larger, own = cutters.get(before.cutter), cutters.get(op.cutter)
    if larger is None or own is None:
        return
    left, leaves = left_on_walls(before), left_on_walls(op)
    if own.diameter > larger.diameter or (own.diameter == larger.diameter and leaves >= left):
        yield (
            f"{at}.rest_of = {op.rest_of}: its cutter of {larger.diameter:g} mm leaves nothing for this one of "
            f"{own.diameter:g} mm: state a smaller cutter, or less allowance_mm than its {left:g}"
        )


def _wrong_levels(at: str, op: OperationTable, table: ContourJobTable, cutters: Mapping[int, Cutter]) -> Iterator[str]:
    """Contradictions of the levels of a pocket with its other keys."""
    if op.levels_mm is None:
        return
    if op.levels_mm != "limit":
        whole, depth = sum(op.levels_mm), depth_of(op, finished=True) - (op.floor_allowance_mm or 0.0)
        if abs(whole - depth) > 1e-6:
            yield f"{at}.levels_mm: {whole:g} mm deep together: must be {depth:g}, the depth that clears"
        if max(op.levels_mm, default=0.0) > op.axial_depth_mm + 1e-9:
            yield f"{at}.levels_mm: {max(op.levels_mm):g}: must be at most axial_depth_mm = {op.axial_depth_mm:g}"
        return
    cutter, finish = cutters.get(op.cutter), op.wall_finish
    needs = {
        "[workpiece]": table.workpiece is not None,
        "[stiffness]": table.stiffness is not None or (cutter is not None and cutter.tip_stiffness is not None),
        "limits.form_error_um": table.limits.stated.get("form_error_um") is not None,
        "a part.file that ends in .step": table.part.file.lower().endswith((".step", ".stp")),
    }
    for need in (name for name, stated in needs.items() if not stated):
        yield f"{at}.levels_mm = 'limit': needs {need}, by which the walls bend: state it, or the depths of the levels"
    if finish is not None and (not finish.by_level or finish.axial_depth_mm is not None):
        yield (
            f"{at}.levels_mm = 'limit': the walls are finished with each level: state wall_finish.by_level = true "
            "without wall_finish.axial_depth_mm"
        )
    if op.floor_allowance_mm or op.tabs is not None or op.side == "outside":
        yield f"{at}.levels_mm = 'limit': plans a pocket down to its floor: leave out floor_allowance_mm, tabs and side"


def left_on_walls(op: OperationTable) -> float:
    """Final allowance of a pocket on its walls [mm]."""
    return (op.allowance_mm or 0.0) if op.wall_finish is None else op.wall_finish.allowance_mm


def depth_of(op: OperationTable, finished: bool = False) -> float:
    """Depth of a pocket [mm], or that of its ``finished`` floor."""
    left = 0.0 if finished or op.floor_finish is not None else op.floor_allowance_mm or 0.0
    return (op.axial_depth_mm if op.depth_mm is None else op.depth_mm) - left


def _wrong_strategies(at: str, op: OperationTable) -> Iterator[str]:
    listed, known = op.strategies or (), STRATEGIES[op.kind]
    if not listed or not set(listed) <= set(known):
        yield f"{at}.strategies = {list(listed)}: must name at least one of {', '.join(known)}"
        return
    if len(set(listed)) < len(listed):
        yield f"{at}.strategies = {list(listed)}: a strategy is listed twice: list each once"
    if op.use is None and len(listed) > 1:
        yield f"{at}.use: missing: state which of {', '.join(listed)} is released"
    if op.use is not None and op.use not in listed:
        yield f"{at}.use = '{op.use}': must be one of {at}.strategies = {', '.join(listed)}"


def _unused_keys(table: ContourJobTable) -> tuple[str, ...]:
    """Stated keys that the kind of their operation does not use."""
    out = []
    for k, op in enumerate(table.operation):
        known = {*ALWAYS, "clearance_mm", *NEEDS[op.kind], *MAY[op.kind]}
        stated = [key for key in type(op).model_fields if getattr(op, key) is not None]
        out += [f"operation.{k}.{key}: not used by kind = {op.kind}" for key in stated if key not in known]
    if all(op.levels_mm != "limit" for op in table.operation):
        out += [
            f"{name}: not used without operation.levels_mm = 'limit'"
            for name in ("stiffness", "workpiece")
            if getattr(table, name) is not None
        ]
    return tuple(out)
