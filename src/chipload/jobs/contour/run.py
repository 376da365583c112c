"""The run of a contour or pocket job: read the files, plan each operation, check each program by simulation.

This module writes no file: the outcome is a value, and the report package writes it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from chipload.checking.default_checks import default_checks
from chipload.checking.settings import CheckSettings
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material, material_named, need_directions, read_material
from chipload.errors import Finding, InputError
from chipload.geometry.contour import Contour, Region
from chipload.jobs.contour.advice import greatest_engagement
from chipload.jobs.contour.earlier_stock import read_stock, standing_between
from chipload.jobs.contour.estimate import clearing_estimate
from chipload.jobs.contour.finish_program import (
    FinishProgram,
    finish_contours,
    is_program,
    read_finish,
    require_reached,
    with_semifinish,
)
from chipload.jobs.contour.job import ContourJob, left_on_walls
from chipload.jobs.contour.outcome import ContourResult, Operation, PlanVerification
from chipload.jobs.contour.part import clear_of_each_other, read_part, require_within_travel
from chipload.jobs.contour.tables import OperationTable
from chipload.jobs.contour.wall_states import levels_text, planned_levels
from chipload.jobs.contour.written_operation import WrittenOperation
from chipload.jobs.tables import value_of
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.planning.contour.plan import Finishing, check_contour, plan_contour
from chipload.planning.hand import require_hand
from chipload.planning.pocket.plan import check_pocket, plan_pocket
from chipload.planning.pocket.request import LINK_LIFT_MM, Clearing, FloorFinish, LargerCutter, WallFinish
from chipload.planning.pocket.tabs import Tabs
from chipload.planning.result import OperationResult, StrategyResult
from chipload.progress import Progress, silent
from chipload.result import Provenance, Verdict
from chipload.result.provenance import provenance_of, title_of
from chipload.simulation.verify import verify_contour
from chipload.stock.layers import LayeredStock
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm

#: greatest deviations with which the simulation proves a program
ENGAGEMENT_DEG, GOUGE_MM, CHORDS_MM = 0.5, 1e-4, 1e-3
#: heights of a program are rounded to this [mm]
ROUNDED_MM = 1e-6
#: passes that descend or rise, whose engagement the simulation in the plane cannot compare; their path it does follow
NOT_LEVEL = ("entry", "ramp")
_NO_CONTOURS: tuple[Contour, ...] = ()
_NO_FINDINGS: tuple[Finding, ...] = ()
VERDICTS = {"proved": Verdict.HOLDS, "failed": Verdict.EXCEEDS, "unproven": Verdict.UNPROVEN}


@dataclass(frozen=True, eq=False)
class Inputs:
    """Data of the files that a job names: contours and top of the stock [mm], machine, material, and findings of the
    readers.

    Where the finish path is that of a program the contours are those of each of its levels.
    """

    contours: tuple[Contour, ...]
    stock: tuple[Contour, ...]
    top: float
    finish: tuple[FinishProgram, ...]
    levels: tuple[tuple[Contour, ...], ...]
    standing: LayeredStock | None
    machine: Machine
    material: Material
    findings: tuple[Finding, ...]


def read_inputs(job: ContourJob) -> Inputs:
    """Read every file that the job names.

    Raises
    ------
    InputError
        A file cannot be read or holds nothing that can be used.
    """
    machine = machine_named(job.machine) if isinstance(job.machine, str) else read_machine(job.machine)
    material = material_named(job.material) if isinstance(job.material, str) else read_material(job.material)
    stock, findings, top = _NO_CONTOURS, _NO_FINDINGS, job.table.stock.top_mm
    finish: tuple[FinishProgram, ...] = ()
    levels: tuple[tuple[Contour, ...], ...] = ()
    if is_program(job.part_file):
        if any(op.kind != "contour" for op in job.operations) or len(job.operations) != 1:
            raise InputError(
                f"part.file = {job.table.part.file}: a program is the finish path of one operation contour"
            )
        op = job.operations[0]
        cutter, part = job.cutters[op.cutter], job.table.part
        finish = read_finish(job.part_file, machine, part.lines, part.labels, top)
        levels = tuple(finish_contours(level, cutter, op.milling, op.side) for level in finish)
        require_reached(finish, levels, cutter)
        deepest = max(level.top - level.floor for level in finish)
        if abs(deepest - op.axial_depth_mm) > ROUNDED_MM:
            raise InputError(
                f"operation.axial_depth_mm = {op.axial_depth_mm:g}: {job.table.part.file} finishes the wall "
                f"{deepest:g} mm deep at once: state axial_depth_mm = {deepest:g}, or check stock.top_mm"
            )
        contours = levels[0]
    else:
        contours, stock, findings = read_part(job)
        require_within_travel(contours, machine, max(job.cutters[op.cutter].radius for op in job.operations))
    _require_machine(job, machine, material)
    file = job.table.stock.file
    standing = None if file is None else read_stock(job.path.parent / file)
    return Inputs(contours, stock, top, finish, levels, standing, machine, material, findings)


def inputs_of_contours(
    job: ContourJob, contours: Sequence[Contour], outline: Sequence[Contour], machine: Machine, material: Material
) -> Inputs:
    """Return inputs of contours that are values; ``outline`` is that of the stock, none: material everywhere.

    Raises
    ------
    InputError
        Contours cross, or the machine or the material cannot be used.
    """
    used, crossings = clear_of_each_other(tuple(contours))
    require_within_travel(used, machine, max(job.cutters[op.cutter].radius for op in job.operations))
    _require_machine(job, machine, material)
    return Inputs(used, tuple(outline), job.table.stock.top_mm, (), (), None, machine, material, crossings)


def _require_machine(job: ContourJob, machine: Machine, material: Material) -> None:
    """Refuse a material without the forces that are limited, cutters of the wrong hand, and speeds out of range."""
    for name in ("force_xy_n", "form_error_um"):
        if name in job.limits:
            need_directions(material, f"limits.{name}")
    for op in job.operations:
        require_hand(machine, job.cutters[op.cutter])
    for at, rpm in _speeds(job):
        speed = rad_s_from_rpm(rpm)
        if not machine.spindle_min * (1.0 - 1e-9) <= speed <= machine.spindle_max * (1.0 + 1e-9):
            low, high = (x / rad_s_from_rpm(1.0) for x in (machine.spindle_min, machine.spindle_max))
            raise InputError(
                f"{job.path.name}: {at}.speed_rpm = {rpm:g}: machine {machine.name} turns from "
                f"{low:g} to {high:g} rpm: state a speed between them"
            )


def _cuts(job: ContourJob, inputs: Inputs) -> list[tuple[OperationTable, Inputs]]:
    """The operations of a job in their order; that of a program once for each level, whose rapids are as high."""
    if not inputs.finish:
        return [(op, inputs) for op in job.operations]
    (op,) = job.operations
    return [
        (
            op.model_copy(
                update={
                    "axial_depth_mm": level.top - level.floor, "clearance_mm": op.clearance_mm + inputs.top - level.top
                }
            ),
            replace(inputs, contours=contours, top=level.top),
        )
        for level, contours in zip(inputs.finish, inputs.levels, strict=True)
    ]  # fmt: skip


def _speeds(job: ContourJob) -> list[tuple[str, float]]:
    """Every spindle speed of a job by where it stands."""
    out = []
    for k, op in enumerate(job.operations):
        out.append((f"operation.{k}", op.speed_rpm))
        out += [
            (f"operation.{k}.{name}", finish.speed_rpm)
            for name, finish in (("floor_finish", op.floor_finish), ("wall_finish", op.wall_finish))
            if finish is not None
        ]
    return out


def run(job: ContourJob, progress: Progress = silent) -> ContourResult:
    """Plan and check every operation of a job.

    Raises
    ------
    InputError
        A file, or the contours, the cutter and the depths together, cannot be used.
    """
    progress(0.0, "reading")
    inputs = read_inputs(job)
    return plan_inputs(job, inputs, _provenance(job, inputs), progress)


def plan_inputs(job: ContourJob, inputs: Inputs, provenance: Provenance, progress: Progress = silent) -> ContourResult:
    """Plan and check every operation of a job whose files were read, or whose contours are values; errors of run."""
    operations: list[Operation] = []
    cuts = _cuts(job, inputs)
    for k, (op, own) in enumerate(cuts):
        share = 1.0 / len(cuts)

        def part(done: float, what: str, start: float = k * share, share: float = share) -> None:
            progress(start + share * done, what)

        operations.append(_operation(job, own, op, [done.result for done in operations], part))
    if inputs.finish:
        operations[0] = replace(operations[0], inserted=_inserted_text(inputs, operations))
    progress(1.0, "done")
    return ContourResult(
        title=title_of(job.path),
        operations=tuple(operations),
        machine=inputs.machine,
        unchecked=job.unchecked,
        findings=(*(Finding("job-key-unused", 0, text) for text in job.findings), *inputs.findings),
        provenance=provenance,
    )


def check(job: ContourJob) -> tuple[list[str], bool]:
    """Contents of the files of a job, and whether each operation can be planned; nothing is simulated.

    Raises
    ------
    InputError
        As :func:`run`.
    """
    inputs = read_inputs(job)
    closed = sum(c.closed for c in inputs.contours)
    lines = [
        f"{job.path.name}: valid: {closed} closed and {len(inputs.contours) - closed} open contours, "
        f"machine {inputs.machine.name}, material {inputs.material.name}"
    ]
    beyond, cleared = list[str](), list[tuple[float, Clearing, float]]()
    for k, (op, own) in enumerate(_cuts(job, inputs)):
        op, _ = _resolve_operation(job, own, op)
        cutter, setting = job.cutters[op.cutter], _planner_request(job, own, op)
        if isinstance(setting, Clearing):
            cleared.append((check_pocket(own.contours, setting, cutter), setting, cutter.radius))
            what = f"{cleared[-1][0]:.6g} mm2"
        else:
            count = check_contour(own.contours, setting, cutter, inputs.material, inputs.machine)
            what = f"{count} pass{'es' if count > 1 else ''}"
        lines.append(f"operation {k}: {op.kind}, cutter {op.cutter} of {cutter.diameter:g} mm, {what}")
        beyond += _above_limit(job, k, op, cutter)
    lines += beyond
    lines += [f"finding: {text}" for text in (*job.findings, *inputs.findings)]
    if job.unchecked:
        lines.append(f"not checked, no limit stated: {', '.join(job.unchecked)}")
    return [*lines, *clearing_estimate(cleared)], not beyond


def _above_limit(job: ContourJob, k: int, op: OperationTable, cutter: Cutter) -> list[str]:
    """Message if the engagement along a straight wall exceeds its limit; in an inside corner it is greater still."""
    limit, depth = job.limits.get("engagement_deg"), op.radial_depth_mm
    if limit is None or depth is None or not 0.0 < depth < cutter.diameter:
        return []
    needed = math.degrees(math.acos(1.0 - depth / cutter.radius))
    if needed <= limit * (1.0 + 1e-9):
        return []
    most = cutter.radius * (1.0 - math.cos(math.radians(limit)))
    return [
        f"limits.engagement_deg = {limit:g} cannot be kept: operation {k} needs {needed:.4g} deg along a straight "
        f"wall: state a radial depth of at most {most:.4g} mm, or a greater limit"
    ]


def _operation(
    job: ContourJob, inputs: Inputs, op: OperationTable, planned: Sequence[OperationResult], progress: Progress
) -> Operation:
    cutter = job.cutters[op.cutter]
    op, advice = _resolve_operation(job, inputs, op)
    first = 0.0
    if op.levels_mm == "limit":
        first = 0.25
        op, text = with_levels(job, op, inputs, lambda done, what: progress(first * done, what))
        advice = (*advice, text)
    result = _plan(job, inputs, op, cutter, planned, lambda done, what: progress(first + (0.5 - first) * done, what))
    result = replace(result, findings=(*result.findings, *advice))
    settings = {k: v for k, v in op.model_dump().items() if v is not None}
    checks = default_checks(value_of(CheckSettings, job.table.checks), {cutter.number: cutter}, inputs.material)
    depth = op.depth_mm or op.axial_depth_mm
    made = Operation(result, settings, cutter, inputs.top, depth, {}, {}, job.limits, checks)
    written = WrittenOperation(title_of(job.path), inputs.machine, len(planned), op.milling, op.step_mm)
    for k, (name, strategy) in enumerate(result.strategies.items()):
        start, share = 0.5 + 0.5 * k / len(result.strategies), 0.25 / len(result.strategies)

        def part(done: float, what: str, start: float = start, share: float = share) -> None:
            progress(start + share * done, f"simulation: {what}")

        verification = verify(strategy, op, cutter, inputs.top, part)
        made = written.with_strategy(made, strategy, partial(part, start=start + share))
        made = replace(made, verifications={**made.verifications, name: verification})
    return made


def with_levels(job: ContourJob, op: OperationTable, inputs: Inputs, progress: Progress) -> tuple[OperationTable, str]:
    """The operation with its planned levels, and a sentence on them."""
    found = planned_levels(job, op, inputs.contours, inputs.top, inputs.material, progress)
    depths = tuple(found.depths.tolist())
    return op.model_copy(update={"levels_mm": depths}), levels_text(found, job.limits["form_error_um"])


def _inserted_text(inputs: Inputs, operations: Sequence[Operation]) -> tuple[str, str]:
    """Name and text of the program that the finish path came from, with the semi-finish passes of all levels."""
    planned = [op.result.strategies[op.result.use].program for op in operations]
    return inputs.finish[0].file.name, with_semifinish(inputs.finish, planned, inputs.machine)


def _plan(
    job: ContourJob,
    inputs: Inputs,
    op: OperationTable,
    cutter: Cutter,
    planned: Sequence[OperationResult],
    progress: Progress,
) -> OperationResult:
    """Call the planner of the operation's kind."""
    setting = _planner_request(job, inputs, op, planned)
    if isinstance(setting, Clearing):
        return plan_pocket(
            inputs.contours, setting, cutter, inputs.material, inputs.machine, limits=job.limits, progress=progress
        )
    return plan_contour(
        inputs.contours, setting, cutter, inputs.material, inputs.machine, limits=job.limits, progress=progress
    )


def _rigid(job: ContourJob) -> tuple[float, float]:
    return job.table.checks.deflection_of_feed, job.table.checks.deflection_of_depth


def _resolve_operation(job: ContourJob, inputs: Inputs, op: OperationTable) -> tuple[OperationTable, tuple[str, ...]]:
    """The operation with its radial depth, and how it was found where it is not stated."""
    if op.engagement_deg is None:
        return op, ()
    cutter = job.cutters[op.cutter]
    found: tuple[str, ...] = ()
    if op.engagement_deg == "limit":
        checks = default_checks(value_of(CheckSettings, job.table.checks), {cutter.number: cutter}, inputs.material)
        advice = greatest_engagement(op, cutter, inputs.material, inputs.machine, job.limits, checks, _rigid(job))
        angle, found = advice.engagement, (advice.text,)
    else:
        angle = math.radians(op.engagement_deg)
    return op.model_copy(update={"radial_depth_mm": cutter.radius * (1.0 - math.cos(angle))}), found


def _larger(job: ContourJob, op: OperationTable, planned: Sequence[OperationResult]) -> LargerCutter | None:
    """The cutter whose rest an operation cuts, and what its path left where it is ``planned``."""
    if op.rest_of is None:
        return None
    before = job.operations[op.rest_of]
    left = _NO_CONTOURS
    if op.rest_of < len(planned):
        result = planned[op.rest_of]
        left = tuple(result.strategies[result.use].drawn["leftover"])
    return LargerCutter(job.cutters[before.cutter].radius, left_on_walls(before), left)


def _standing_material(job: ContourJob, inputs: Inputs, op: OperationTable) -> tuple[Contour, ...] | None:
    """Material in the depth of a pocket before it begins; None where no file states it."""
    if inputs.standing is None:
        return None
    floor = inputs.top - (op.axial_depth_mm if op.depth_mm is None else op.depth_mm)
    return standing_between(inputs.standing, floor, inputs.top, str(job.table.stock.file))


def _floor_finish(op: OperationTable) -> FloorFinish | None:
    own = op.floor_finish
    return None if own is None else FloorFinish(mm_s_from_mm_min(own.feed_mm_min), rad_s_from_rpm(own.speed_rpm))


def _wall_finish(op: OperationTable) -> WallFinish | None:
    own = op.wall_finish
    if own is None:
        return None
    feed, speed = mm_s_from_mm_min(own.feed_mm_min), rad_s_from_rpm(own.speed_rpm)
    return WallFinish(feed, speed, own.axial_depth_mm, own.allowance_mm, own.by_level)


def _planner_request(
    job: ContourJob, inputs: Inputs, op: OperationTable, planned: Sequence[OperationResult] = ()
) -> Finishing | Clearing:
    """Request of an operation to its planner, after those that are ``planned``."""
    rigid, radial = _rigid(job), op.radial_depth_mm or 0.0
    if op.kind == "pocket":
        return Clearing(
            milling=op.milling,
            radial_depth=radial,
            axial_depth=op.axial_depth_mm,
            feed=mm_s_from_mm_min(op.feed_mm_min),
            spindle_speed=rad_s_from_rpm(op.speed_rpm),
            top=inputs.top,
            clearance=op.clearance_mm,
            step=op.step_mm,
            allowance=op.allowance_mm or 0.0,
            rigid=rigid,
            link_feed=None if op.link_feed_mm_min is None else mm_s_from_mm_min(op.link_feed_mm_min),
            link_lift=LINK_LIFT_MM if op.link_lift_mm is None else op.link_lift_mm,
            depth=op.depth_mm,
            level_depths=op.levels_mm if isinstance(op.levels_mm, tuple) else (),
            stock=inputs.stock,
            around=op.side == "outside",
            holes=op.holes_mm or (),
            larger=_larger(job, op, planned),
            standing=_standing_material(job, inputs, op),
            floor_allowance=op.floor_allowance_mm or 0.0,
            floor_finish=_floor_finish(op),
            wall_finish=_wall_finish(op),
            tabs=None if op.tabs is None else Tabs(op.tabs.at_mm, op.tabs.width_mm, op.tabs.height_mm),
            strategies=tuple(op.strategies or ("pocket",)),
            use=op.use or (op.strategies or ("pocket",))[0],
            entry=op.entry or "helix",
        )
    forward = op.kind == "forward"
    strategies: tuple[str, ...] = ("forward",) if forward else tuple(op.strategies or ())
    return Finishing(
        side=str(op.side),
        milling=op.milling,
        strategies=strategies,
        use=op.use if op.use is not None and not forward else strategies[0],
        joint=op.joint or "sharp",
        radial_depth=radial,
        axial_depth=op.axial_depth_mm,
        semifinish_depth=op.semifinish_depth_mm or 0.0,
        passes=op.passes or 1,
        feed=mm_s_from_mm_min(op.feed_mm_min),
        spindle_speed=rad_s_from_rpm(op.speed_rpm),
        tolerance=op.tolerance_mm or 0.0,
        step=op.step_mm,
        lead=op.lead_mm or 0.0,
        top=inputs.top,
        clearance=op.clearance_mm,
        rigid=rigid,
    )


def verify(
    strategy: StrategyResult, op: OperationTable, cutter: Cutter, top: float, progress: Progress
) -> PlanVerification:
    """Compare the history of one strategy with a simulation of its program that is independent of the planner.

    ``drawn`` states the stock from which the program starts (`stock before`, closed contours; a pocket starts in the
    solid) and the `wall`, whose travel has the part on its right.
    """
    before = strategy.drawn.get("stock before", ())
    if not before and op.kind != "pocket":
        return PlanVerification(Verdict.UNPROVEN, "the planner does not state the stock from which the program starts")
    # eased joints may leave the drawn wall to either side, a cutter may leave stock in a corner; the path of a pocket
    # lies within a tolerance of its region, and what it leaves over is judged by its area, which the planner reports
    leave = op.tolerance_mm or 0.0
    gouge = leave if op.joint == "clothoid" else 0.0
    if op.kind == "pocket":
        leave, gouge = op.radial_depth_mm or 0.0, CHORDS_MM
    below = strategy.drawn.get("wall below", ())
    height = top - (op.depth_mm or op.axial_depth_mm) + (op.tabs.height_mm if op.tabs is not None else 0.0)
    names = np.asarray(strategy.history["pass"]).astype(str)
    left_out = int(np.isin(names, NOT_LEVEL).sum())
    verification = verify_contour(
        strategy.program,
        cutter.radius,
        strategy.history,
        stock=Region(tuple(before)) if before else None,
        stock_top_mm=top,
        wall=strategy.drawn.get("wall", ()),
        wall_below=(height, below) if below else None,
        material="right",
        engagement_tolerance_deg=ENGAGEMENT_DEG,
        gouge_tolerance_mm=max(GOUGE_MM, gouge),
        excess_tolerance_mm=max(GOUGE_MM, leave),
        passes=sorted(set(names.tolist()) - set(NOT_LEVEL)),
        workers=2,
        progress=progress,
    )
    verdict, text = VERDICTS[verification.verdict], "; ".join((*verification.reasons, verification.text))
    apart = verification.engagement_difference_deg
    if apart > ENGAGEMENT_DEG and len(verification.reasons) == 1:
        # the limits hold for the simulated engagement: the difference is a fault of the planner
        x, y = verification.engagement_at
        verdict = Verdict.UNPROVEN
        text = (
            f"the planned engagement differs by {apart:.3g} deg from that of its path at ({x:.4g}, {y:.4g}), "
            f"more than {ENGAGEMENT_DEG:g} deg"
        )
    return PlanVerification(
        verdict,
        text,
        {
            "engagement_difference_deg": verification.engagement_difference_deg,
            "engagement_at_mm": list(verification.engagement_at),
            "gouge_mm": verification.gouge_mm,
            "gouge_at_mm": list(verification.gouge_at),
            "excess_mm": verification.excess_mm,
            "excess_at_mm": list(verification.excess_at),
            "rapids_through_stock": [list(p) for p in verification.rapids],
            "rows_compared": verification.compared,
            "rows_not_compared": left_out,
        },
    )


# -- reading ----------------------------------------------------------------------------------------------------
def _provenance(job: ContourJob, inputs: Inputs) -> Provenance:
    files: dict[str, Path] = {"part": job.part_file}
    files |= {k: v for k, v in (("machine", job.machine), ("material", job.material)) if isinstance(v, Path)}
    files |= {} if job.table.stock.file is None else {"stock": job.path.parent / job.table.stock.file}
    files |= {f"cutter {k}": job.path.parent / c.file for k, c in enumerate(job.table.cutter) if c.file is not None}
    return provenance_of(files, job.overrides, inputs.machine, (inputs.material,))
