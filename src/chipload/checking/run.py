"""Simulation of a program in its stock, with the compliance of the workpiece, and its check."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipload.checking.default_checks import PROGRAM_COLUMNS, with_checks
from chipload.checking.drilling import with_drilling
from chipload.checking.form_error import form_error_watch
from chipload.checking.inputs import CheckInputs
from chipload.checking.leaning_stock import check_leaning_stock
from chipload.checking.limits import GOUGE
from chipload.checking.outcome import CollisionCheck, SimulationResult, StockCheck
from chipload.checking.partial import PartialLimits
from chipload.checking.preparation import Bodies, bodies_of, resolution_of, time_rows
from chipload.checking.program_sequence import ProgramSequence
from chipload.checking.stability import stability_of, watch_of
from chipload.checking.state_times import state_times
from chipload.checking.stiffness import deflection_watch, stiffness_of, watched_columns, with_columns
from chipload.checking.stock_check import check_stock
from chipload.checking.tap_torque import tap_torques
from chipload.checking.workpiece import insides, stock_box
from chipload.checking.workpiece_compliance import (
    WorkpieceCompliance,
    with_compliance_error,
    workpiece_compliance,
)
from chipload.cutter.cutter import Cutter
from chipload.cutting.drilling import has_lips
from chipload.errors import Finding, Severity
from chipload.program.motions import lengths
from chipload.program.program import Program
from chipload.program.read import ProgramReading
from chipload.progress import Progress, part_of, silent
from chipload.result.provenance import sources, versions
from chipload.simulation.accuracy import AXIAL, axial_force
from chipload.simulation.checkpoint import Checkpoint, digest
from chipload.simulation.chip_areas import most_divided_chip
from chipload.simulation.chips import remove
from chipload.simulation.chunks import remove_in_chunks
from chipload.simulation.engagement_samples import EngagementRecorder
from chipload.simulation.estimate import LEANING, UPRIGHT, estimate, slowest_step
from chipload.simulation.gouge_refinement import refine_gouges
from chipload.simulation.hand import reversed_cuts
from chipload.simulation.heights.slender_walls import distortion_not_checked
from chipload.simulation.kept_pass import KeptPasses
from chipload.simulation.loads import Cuts
from chipload.simulation.moves import leans
from chipload.simulation.program_findings import ProgramSurroundings, program_findings
from chipload.simulation.ramp import ramp_angle
from chipload.simulation.remaining_stock import Inside
from chipload.simulation.removal import Columns, Watch
from chipload.simulation.steps import StepBlocks
from chipload.simulation.strips import threads_of
from chipload.simulation.surface import Difference, collisions, difference, in_stock
from chipload.stock.layers import LayeredStock

#: progress of a pass by the number of steps that are done
Counted: TypeAlias = Callable[[int], None]

#: share of a simulation that one pass over its steps besides the removal takes
SHARE = 0.2 / 3.0


def simulation_estimate(inputs: CheckInputs, reading: ProgramReading, stock: LayeredStock, passes: int = 1) -> str:
    """Return a line on time and memory of a simulation; inputs that cannot be used are refused."""
    bodies, workpiece = bodies_of(inputs, reading, stock), inputs.elasticity.workpiece
    quick, slow = _step_times(inputs, bodies.program, stock)
    if workpiece is None:
        return estimate(passes * bodies.steps, len(reading.program), quick, slow)
    # an additional run finds where the program cuts
    steps = (passes + 1) * bodies.steps
    more = state_times(workpiece, stock, inputs.surroundings.part)
    return estimate(steps, len(reading.program), quick, slow, more=more)


def _step_times(inputs: CheckInputs, program: Program, stock: LayeredStock) -> tuple[float, float]:
    """Return the least and greatest processor time of a step [s] by moves."""
    cutters = inputs.cutters
    if leans(program).any():
        return LEANING
    length = lengths(program)
    share = {n: float(length[program.tool == n].sum()) for n in cutters}
    slow = sum(share[n] * slowest_step(c) for n, c in cutters.items())
    return UPRIGHT, slow / max(sum(share.values()), np.finfo(float).tiny)


def simulate_program(
    inputs: CheckInputs,
    reading: ProgramReading | ProgramSequence,
    stock: LayeredStock,
    *,
    compliance: WorkpieceCompliance | None = None,
    checkpoint: Checkpoint | None = None,
    watch: Watch | None = None,
    workers: int | None = None,
    progress: Progress = silent,
) -> SimulationResult:
    """Simulate a program in its stock and check it.

    Parameters
    ----------
    reading : the program on its machine, or programs that run one after the other
    stock : before the program; changes
    compliance : of the workpiece; None: not known yet
    checkpoint : folder with finished work, from which a stopped run continues; None: all stays in memory
    watch : called with what each cutter cuts, besides the watches of the checks; without a checkpoint; None: none
    workers : threads; None: as :func:`chipload.simulation.strips.threads_of`

    Raises
    ------
    InputError
        The inputs cannot be used together.
    """
    op, cutters, material, machine = inputs.settings, inputs.cutters, inputs.material, inputs.machine
    bodies, elasticity = bodies_of(inputs, reading, stock), inputs.elasticity
    program, times, fine = bodies.program, bodies.times, bodies.resolution
    if compliance is None:
        compliance = compliance_of_workpiece(inputs, reading, stock, progress)
    gives = bodies.stiffness if compliance is None else stiffness_of(elasticity.stiffness, cutters, compliance.steps)
    before, stiffness = insides(stock), elasticity.stiffness
    initial = stock.copied() if reading.skipped is not None or op.chip_diagram else None
    # layers that were cut before lie face on face, which rays do not distinguish
    blank = None if stock.cut.any() else stock.body()
    kept = KeptPasses(checkpoint, passes_key(inputs, bodies.program) if checkpoint is not None else "")
    steps = StepBlocks(program, op.step_mm, op.tolerance_mm)
    stock_check = replace(check_stock(inputs, bodies.program, stock, steps, kept, progress), blank=blank)
    watches: list[Watch] = [with_checks(inputs.checks, material, deflection_watch(gives, material))]
    if not inputs.loads:
        watches = [lambda cuts: {"ramp_deg": ramp_angle(cuts)}]

    def pass_progress(share: float, what: str) -> Counted:
        return lambda done: progress(share + SHARE * done / bodies.steps, what)

    left, part_points = _difference_from_part(
        inputs, program, steps, before, pass_progress(0.0, "distances to the part"), kept
    )
    # form error costs as much as the chips, and means little without stiffness data
    made = left if stiffness is not None or compliance is not None or inputs.limits.form_error_um is not None else None
    if made is not None:
        watches.append(form_error_watch(made, gives, material))
    stability_watch, recorder = watch_of(inputs, compliance), EngagementRecorder(material)
    watches += [] if stability_watch is None else [stability_watch]
    watches += [recorder] if inputs.loads else []
    watches += [] if watch is None else [watch]

    def watch_all(cuts: Cuts) -> dict[str, NDArray[np.float64]]:
        return {name: values for each in watches for name, values in each(cuts).items()}

    partial = PartialLimits(inputs.limits.stated if inputs.loads else {})
    removing = partial.with_text(part_of(progress, SHARE, SHARE + 0.8))
    if checkpoint is None:
        removal = remove(
            program, stock, cutters, material, fine, watch=watch_all, times=times,
            loads=inputs.loads, outlines=inputs.outlines, workers=threads_of(workers), seen=partial.take,
            uncounted=reading.uncounted if isinstance(reading, ProgramSequence) else -1, progress=removing,
        )  # fmt: skip
    else:
        formed = None if made is None else (made.points, made.faces, made.distance, made.step)
        removal = remove_in_chunks(
            program, stock, cutters, material, fine, checkpoint, watch=watch_all,
            keeps={"engagement": recorder} | ({} if stability_watch is None else {"watch": stability_watch}),
            times=times, workers=threads_of(workers), seen=partial.take,
            progress=removing,
            also=(
                versions(), sources(), repr((stiffness, elasticity.workpiece)), repr(inputs.checks), formed,
                None if stability_watch is None else stability_watch.dynamics,
            ),
        )  # fmt: skip
    loads = (*watched_columns(gives, formed=made is not None), *PROGRAM_COLUMNS)
    if op.chip_diagram and initial is not None:
        removal = replace(removal, piece=most_divided_chip(program, initial, cutters, fine, removal))
    removal = with_columns(removal, loads if inputs.loads else ("ramp_deg",))
    if inputs.limits.thrust_n is not None or any(has_lips(c) for c in cutters.values()):
        removal = with_drilling(removal, cutters, material)
    if inputs.limits.force_axial_n is not None:
        removal = replace(removal, columns={**removal.columns, AXIAL: axial_force(removal.columns)})
    if inputs.outlines and leans(program).any():
        found, unchecked = check_leaning_stock(inputs, program, before, stock)
        stock_check = replace(
            stock_check, findings=(*stock_check.findings, *found), unchecked=(*stock_check.unchecked, *unchecked)
        )
    if compliance is not None:
        more = distortion_not_checked(compliance.wall, inputs.checks.stress_wall_mm)
        stock_check = replace(stock_check, unchecked=(*stock_check.unchecked, *more))
    errors = with_compliance_error(removal.resolution_error, removal.columns, compliance)
    around = program_surroundings(inputs, reading, before, stock_box(stock))
    findings = (
        *removal.findings,
        *_findings_of(program, steps, removal.columns, cutters, around, compliance),
        *tap_torques(reading.program, cutters, material, machine),
        *_joined(bodies),
    )
    removal = replace(removal, resolution_error=errors, samples=recorder.samples(), findings=findings)
    if stability_watch is not None:
        removal = with_columns(removal, stability_watch.columns)
    solids = {**bodies.fixtures, **part_points}
    touched = _collision_check(inputs, bodies, steps, solids, stock_check, pass_progress, kept)
    skipped = None
    if reading.skipped is not None and initial is not None:
        skipped = simulate_program(inputs, reading.skipped, initial)
    checks = replace(bodies.checks, parts=removal.load_parts)
    return SimulationResult(
        removal, stock, machine, inputs.limits, {"kind": "simulate", **op.stated}, checks, touched, left,
        gives.unknown, None if stability_watch is None else stability_of(inputs, stability_watch), compliance,
        skipped,
    )  # fmt: skip


def _findings_of(
    program: Program,
    steps: StepBlocks,
    columns: Columns,
    cutters: Mapping[int, Cutter],
    around: ProgramSurroundings,
    compliance: WorkpieceCompliance | None,
) -> tuple[Finding, ...]:
    """Return what a program does wrong besides its loads, and deflections that their neighbours do not explain."""
    found = (*reversed_cuts(steps, columns, cutters), *program_findings(program, steps, columns, cutters, around))
    if compliance is None:
        return found
    return (*found, *compliance.jumps(columns, max(c.diameter for c in cutters.values())))


def _joined(bodies: Bodies) -> tuple[Finding, ...]:
    """Return the finding on short blocks that are simulated as one."""
    off, rows = bodies.joined
    if off == 0.0:
        return ()
    text = (
        f"join_mm: {rows} motions are simulated as {len(bodies.program)}, at most {off:.3g} mm from their path: leave "
        "it out for a proof"
    )
    return (Finding("blocks-joined", 0, text, Severity.UNPROVEN),)


def program_surroundings(
    inputs: CheckInputs,
    reading: ProgramReading | ProgramSequence,
    inside: Inside,
    box: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> ProgramSurroundings:
    """Return what a program is run in; ``inside`` and ``box`` are of the initial stock."""
    bottom, meshes = float(box[0][2]), inputs.surroundings.fixture_meshes(inputs.machine)
    below = any(float(mesh.bounds[0][2]) < bottom for mesh in meshes.values())
    text = reading.program if reading.of_text else None
    return ProgramSurroundings(inside, *box, below, reading.stops, reading.retractions, text)


def _difference_from_part(
    inputs: CheckInputs,
    program: Program,
    steps: StepBlocks,
    before: Callable[[NDArray[np.float64]], NDArray[np.bool_]],
    progress: Counted,
    kept: KeptPasses,
) -> tuple[Difference | None, dict[str, NDArray[np.float64]]]:
    """Return the distances of the path of the cutters from the part, and its points by name; nothing without a part."""
    part, tolerance, cutters = inputs.surroundings.part, inputs.settings.tolerance_mm, inputs.cutters
    if part is None:
        return None, {}
    left = difference(
        steps, cutters, part.mesh, before, part.spacing_mm, part.excess_range_mm, tolerance, progress, kept
    )
    gouge = inputs.limits.gouge_mm or (GOUGE if inputs.checks.gouge else None)
    points = {"part": left.points}
    if gouge is None:
        return left, points
    used = {n: c for n, c in cutters.items() if bool((program.tool == n).any())}
    return refine_gouges(left, steps, used, tolerance, gouge), points


def _collision_check(
    inputs: CheckInputs,
    bodies: Bodies,
    steps: StepBlocks,
    solids: Mapping[str, NDArray[np.float64]],
    stock_check: StockCheck,
    passing: Callable[[float, str], Counted],
    kept: KeptPasses,
) -> CollisionCheck:
    """Return the collisions of cutter, shank and holder with part and fixtures, and with the stock of each moment."""
    cutters, tolerance = inputs.cutters, inputs.settings.tolerance_mm
    watching, above = passing(0.8 + SHARE, "collisions"), frozenset(["part"])
    touched = collisions(steps, cutters, solids, tolerance, above_only=above, progress=watching, kept=kept)
    touched += stock_check.touched
    if bodies.stock_points is not None:
        watching = passing(0.8 + 2.0 * SHARE, "holders in the stock")
        touched += in_stock(steps, cutters, bodies.stock_points, tolerance, watching, kept)
    compared_with = (*solids, *(["stock"] if inputs.checks.shank_in_stock else []))
    no_holder = tuple(n for n, c in sorted(cutters.items()) if not c.holder)
    fixtures = inputs.surroundings.fixture_meshes(inputs.machine)
    return CollisionCheck(touched, compared_with, no_holder, fixtures, stock_check)


def passes_key(inputs: CheckInputs, program: Program) -> str:
    """Return a hash of all inputs on which the passes over the steps of a program depend."""
    op = inputs.settings
    return digest(program, inputs.cutters, op.step_mm, op.tolerance_mm, versions(), sources())


def compliance_of_workpiece(
    inputs: CheckInputs, reading: ProgramReading | ProgramSequence, stock: LayeredStock, progress: Progress = silent
) -> WorkpieceCompliance | None:
    """Return the compliance of the workpiece where the program cuts it; None if no workpiece is stated."""
    workpiece, cutters, op = inputs.elasticity.workpiece, inputs.cutters, inputs.settings
    if workpiece is None:
        return None
    program, _ = time_rows(reading, cutters, inputs.machine, op.interpolation)
    fine = resolution_of(op, cutters, program)
    return workpiece_compliance(workpiece, program, stock, cutters, inputs.material, fine, progress)
