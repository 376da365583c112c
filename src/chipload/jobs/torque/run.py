"""The run of a torque job: find the torque limit, then run the controllers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from chipload.checking.clamped import require_clamped
from chipload.checking.default_checks import default_checks
from chipload.checking.inputs import CheckInputs
from chipload.checking.outcome import StockCheck
from chipload.checking.result import collision_findings
from chipload.checking.settings import CheckSettings
from chipload.checking.stock_check import check_stock
from chipload.checking.workpiece import Stock, insides, stock_box
from chipload.control.fuzzy import FuzzyTable, read_fuzzy, standard
from chipload.control.identification import alias_frequency, bandwidth
from chipload.control.override import Override
from chipload.control.resolution import check_light, torque_resolution
from chipload.control.spindle import first_order
from chipload.control.spindle_model import Spindle
from chipload.control.wall import Loads, WallPath
from chipload.cutting.material import Material, material_named, need_directions, read_material
from chipload.errors import Finding, InputError
from chipload.jobs.simulation.values import workpiece_of
from chipload.jobs.tables import value_of
from chipload.jobs.torque.allowable import allowable, wall_of
from chipload.jobs.torque.controllers import cases_of, controller_of, shortest
from chipload.jobs.torque.cut import CutSteps, require_linear, resolution_in_stock, settings_of
from chipload.jobs.torque.job import TorqueJob
from chipload.jobs.torque.outcome import (
    HELD,
    ClampedWorkpiece,
    ControlComparison,
    ControllerCase,
    ShellWall,
    SpindleEstimate,
    TorqueInputs,
    TorqueResult,
)
from chipload.jobs.torque.shell_limit import preview_of_shell, real_shell_stock, shell_torque, shell_wall
from chipload.jobs.torque.spindle import deviation_of, estimate_range, identified_from, require_resolved, spindle_of
from chipload.jobs.torque.step_checks import step_checks
from chipload.jobs.torque.workpiece_cut import allowable_on_workpiece, real_stock_body
from chipload.jobs.torque.workpiece_limit import allowable_torque, clamped_workpiece, preview_on_workpiece
from chipload.jobs.torque.written_program import WrittenProgram, written_program
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.number_text import number_text
from chipload.program.program import Program
from chipload.progress import Progress, part_of, silent
from chipload.report.presentation import Blank
from chipload.result import Provenance
from chipload.result.provenance import provenance_of, title_of
from chipload.simulation.accuracy import energy_balance
from chipload.simulation.chips import count_steps
from chipload.simulation.estimate import estimate
from chipload.simulation.kept_pass import KeptPasses
from chipload.simulation.program_findings import ProgramSurroundings, program_findings
from chipload.simulation.steps import StepBlocks
from chipload.stock.blank_mesh import blank_mesh
from chipload.stock.layers import LayeredStock


def run(job: TorqueJob, progress: Progress = silent) -> TorqueResult:
    """Simulate the cut in the planned and in the real stock, find the torque limit, and run every controller.

    Raises
    ------
    InputError
        A file cannot be read, or values do not go together.
    """
    machine, material, table, written, spindle = open_inputs(job)
    program = written.program
    cutting = part_of(progress, 0.0, 0.65)
    wall: ShellWall | ClampedWorkpiece
    if job.workpiece is not None:
        work = allowable_on_workpiece(job, program, material, machine, cutting)
        found, wall = allowable_torque(job, work, material), clamped_workpiece(job, work)
        own = Followed(work.planned, work.real, work.loads, work.walls)
    else:
        a = allowable(job, program, material, machine, cutting)
        found, wall = shell_torque(job, a, material), shell_wall(job, a)
        own = Followed(a.planned, a.real, a.loads, a.walls)
    torque, path = found.torque, found.path
    progress(0.7, "controllers")
    controller: Override | None = None
    cases: tuple[ControllerCase, ...] = ()
    shortest_time = math.inf
    if torque > 0.0:
        require_resolved(job, spindle, torque)
        controller, acceleration = controller_of(job, torque), _acceleration(job, machine)
        cases = cases_of(job, path, controller, table, spindle, torque, own.walls, acceleration, progress)
        shortest_time = written.approach + shortest(path, controller, torque, acceleration) + written.retract
    both = (("planned", own.planned), ("real", own.real))
    in_stock = _stock_check(job, program, machine, material)
    return TorqueResult(
        job=_inputs(job, written, machine, material),
        wall=wall,
        allowable=found,
        control=ControlComparison(
            cases=cases,
            controller=controller,
            table=table,
            spindle=spindle,
            identified_from=identified_from(job, spindle),
            deviation=deviation_of(job),
            estimate=_estimate(job, cases, spindle, controller) if controller is not None else None,
            ideal_time=shortest_time,
        ),
        step_checks=step_checks(own.real, own.loads, material, _fastest(cases)),
        blank=Blank(blank_mesh(_real_stock(job, program)), job.cutters),
        stock_check=in_stock,
        findings=(
            *_of_removals(own, in_stock),
            *_of_program(job, written, machine, own.real),
            *written.findings,
        ),
        resolution_error=own.real.removal.resolution_error,
        energy_balance={name: energy_balance(cut.removal.columns, material.Ktc) for name, cut in both},
    )


def _stock_check(job: TorqueJob, program: Program, machine: Machine, material: Material) -> StockCheck:
    """Rapids, shank and holder, and loose pieces in the real stock as it is at each moment.

    The deflection of the wall is what the job calculates, so that no wall counts as too slender to be rigid.
    """
    stock, settings = _real_stock(job, program), settings_of(job)
    checks = replace(value_of(CheckSettings, job.table.checks), slender_walls=False)
    inputs = CheckInputs(job.cutters, material, machine, Stock(stock), settings, checks=checks)
    steps = StepBlocks(program, settings.step_mm, settings.tolerance_mm)
    return check_stock(inputs, program, stock, steps, KeptPasses(), silent)


def _of_removals(own: Followed, in_stock: StockCheck) -> tuple[Finding, ...]:
    """Findings of both removals and on the stock, a rapid that cuts once."""
    removals = (own.planned,) if own.real is own.planned else (own.planned, own.real)
    out = [f for each in removals for f in each.removal.findings]
    known = {(f.code, f.line) for f in out}
    out += [f for f in in_stock.findings if f.code != "rapid-cuts" or (f.code, f.line) not in known]
    return (*out, *collision_findings(in_stock.touched))


def _of_program(job: TorqueJob, written: WrittenProgram, machine: Machine, real: CutSteps) -> tuple[Finding, ...]:
    """Findings on the whole program in the real stock, besides its loads."""
    program = written.program
    stock, fine = _real_stock(job, program), resolution_in_stock(job, program)
    around = ProgramSurroundings(
        insides(stock), *stock_box(stock), machine.table is not None, written.stops, written.retractions, written.whole
    )
    steps = StepBlocks(program, fine.step_mm, fine.tolerance)
    return program_findings(program, steps, real.removal.columns, job.cutters, around)


def _real_stock(job: TorqueJob, program: Program) -> LayeredStock:
    """The real stock before the program."""
    return real_stock_body(job, program) if job.workpiece is not None else real_shell_stock(job, program)


@dataclass(frozen=True, eq=False)
class Followed:
    """Data of the path for the controllers and the checks: planned and real cut, loads, and responses."""

    planned: CutSteps
    real: CutSteps
    loads: Loads
    walls: tuple[WallPath, ...]


def _inputs(job: TorqueJob, written: WrittenProgram, machine: Machine, material: Material) -> TorqueInputs:
    """What the job states."""
    limits = job.table.limits
    return TorqueInputs(
        title=title_of(job.path),
        program_name=job.program_file.name
        if job.program_file is not None
        else "generated: a helix down the wall and one turn at the bottom",
        written=written,
        machine=machine,
        limits=limits.stated,
        unchecked=limits.unstated,
        settings=job.table.model_dump(exclude_none=True, exclude={"cutter", "surprise"}),
        surprises=tuple(_text_of(x.model_dump(exclude_none=True)) for x in job.table.surprise),
        surprise_angles=tuple((x.at_deg, x.kind) for x in job.table.surprise if x.at_deg is not None),
        checks=default_checks(value_of(CheckSettings, job.table.checks), job.cutters, material),
        check_settings=value_of(CheckSettings, job.table.checks),
        provenance=_provenance(job, machine, material),
    )


def check(job: TorqueJob) -> tuple[list[str], bool]:
    """Read the files that the job names, report values that do not go together, and find the torque limit coarsely.

    Raises
    ------
    InputError
        As :func:`run`, but for what only the exact limit of torque shows.
    """
    machine, material, table, written, spindle = open_inputs(job)
    program = written.program
    if job.workpiece is not None:
        stock = real_stock_body(job, program)
        what, count = "a workpiece", len(job.workpiece.clamp)
        what += f" in {count} clamp{'s' if count > 1 else ''}"
        text, attainable = preview_on_workpiece(job, program, material, machine)
    else:
        stock = real_shell_stock(job, program)
        shell = wall_of(job)
        what = "a tube" if shell.cone_angle == 0.0 else "a cone"
        what += f", radius {shell.radius:g}, length {shell.length:g}, wall {shell.thickness:g} mm"
        text, attainable = preview_of_shell(job, program, material, machine)
    wrong = 1.0 + spindle.torque_constant_error
    granted = 1.0 + 1e-2 * job.table.limits.torque_over_percent - wrong * job.table.torque_control.override.hold
    least = torque_resolution(spindle, 1e-3 * job.table.loop.period_ms).total / granted if granted > 0.0 else math.inf
    # below this set point the readings count as air, or the estimate is not valid
    least = max(least, estimate_range(job, spindle)[0] / job.table.torque_control.override.hold)
    count, number = count_steps(program, job.cutters, resolution_in_stock(job, program)), len(job.table.surprise)
    return [
        f"{job.path.name}: {what}; "
        f"{len(program)} motions on machine {machine.name}, stock of {number_text(stock.volume(), 5)} mm3, material "
        f"{material.name}, controller {table.name}, {number} surprise{'' if number == 1 else 's'}",
        f"the controller can hold torque limits from {number_text(1e-3 * least, 3)} N m up",
        text,
        estimate(4 * count, len(program)),
    ], attainable


def open_inputs(job: TorqueJob) -> tuple[Machine, Material, FuzzyTable, WrittenProgram, Spindle]:
    """Machine, material, fuzzy table, written program and spindle of a job, checked against one another.

    Raises
    ------
    InputError
        A file cannot be read, the spindle does not resolve the torque, or the loop exceeds the machine.
    """
    machine, material, table = _read_named(job)
    require_linear(material)
    _acceleration(job, machine)
    written = written_program(job, machine)
    program = written.program
    spindle = spindle_of(job, program.spindle)
    period = 1e-3 * job.table.loop.period_ms
    check_light(spindle, period, 1e3 * job.table.torque_control.override.light_nm)
    if job.table.limits.torque_nm is not None:
        # the limit is at most this one, so that a spindle that cannot hold this one holds none
        require_resolved(job, spindle, 1e3 * job.table.limits.torque_nm)
    count_steps(program, job.cutters, resolution_in_stock(job, program))
    if job.workpiece is not None:
        require_clamped(workpiece_of(job.workpiece), real_stock_body(job, program))
    return machine, material, table, written, spindle


def _acceleration(job: TorqueJob, machine: Machine) -> float:
    """Acceleration along the path [mm/s^2]."""
    stated, most = job.table.loop.acceleration_mm_s2, min(machine.acceleration[:2])
    if stated is not None and stated > most:
        raise InputError(
            f"loop.acceleration_mm_s2 = {stated:g}: must be at most {most:g}, that of machine {machine.name}"
        )
    return stated or most


def _read_named(job: TorqueJob) -> tuple[Machine, Material, FuzzyTable]:
    machine = machine_named(job.machine) if isinstance(job.machine, str) else read_machine(job.machine)
    material = material_named(job.material) if isinstance(job.material, str) else read_material(job.material)
    need_directions(material, "the wall of a shell" if job.workpiece is None else "an elastic workpiece")
    return machine, material, read_fuzzy(job.control_file) if job.control_file is not None else standard()


def _estimate(
    job: TorqueJob, cases: tuple[ControllerCase, ...], spindle: Spindle, controller: Override
) -> SpindleEstimate:
    case = cases[-1]
    found = case.runs[HELD].outcome
    share = min(case.loop.period / spindle.smoothing, 1.0) if spindle.smoothing > 0.0 else 1.0
    behind = first_order(first_order(found.torque, found.t, spindle.sensor_lag), found.t, spindle.smoothing)
    later = slice(min(len(found.t) // 10, 50), None)
    cutting = found.torque > 0.0
    passing = max(c.flutes for c in job.cutters.values()) * spindle.speed / math.tau
    return SpindleEstimate(
        noise=spindle.torque_constant * spindle.noise * math.sqrt(share / (2.0 - share)),
        seen=float(np.std((found.measured - behind)[later])),
        behind=float(np.abs(behind - found.torque)[later].max()),
        lag=spindle.sensor_lag + spindle.smoothing,
        bandwidth=bandwidth(spindle.sensor_lag, spindle.smoothing),
        range=estimate_range(job, spindle),
        resolution=torque_resolution(spindle, case.loop.period).total,
        constant_error=spindle.torque_constant_error,
        light=controller.light,
        light_share=float((found.torque[cutting] < controller.light).mean()) if cutting.any() else 0.0,
        aliased=(passing, alias_frequency(passing, 1.0 / case.loop.period)),
    )


def _fastest(cases: tuple[ControllerCase, ...]) -> float:
    """Greatest feed over the programmed one that any controller reaches, at least 1."""
    return max((float(run.ratio.max()) for case in cases for run in case.runs.values()), default=1.0)


def _text_of(values: dict[str, Any]) -> str:
    return ", ".join(f"{k} {v:g}" if isinstance(v, float) else str(v) for k, v in values.items())


def _provenance(job: TorqueJob, machine: Machine, material: Material) -> Provenance:
    named = {
        "program": job.program_file,
        "machine": job.machine,
        "material": job.material,
        "controller": job.control_file,
        "spindle": job.spindle_file,
    }
    files = {k: v for k, v in named.items() if isinstance(v, Path)}
    for name in ("stock", "real_stock"):
        solid = getattr(job.table, name)
        if solid is not None and solid.file is not None:
            files[name] = job.path.parent / solid.file
    files |= {f"cutter {k}": job.path.parent / c.file for k, c in enumerate(job.table.cutter) if c.file is not None}
    return provenance_of(files, job.overrides, machine, (material,))
