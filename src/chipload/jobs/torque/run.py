"""A job on a thin tube or cone: the allowable torque of the wall, and the controllers that hold it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.control.fuzzy import FuzzyTable, read_fuzzy, standard
from chipload.control.identification import aliased, bandwidth
from chipload.control.limit import torque_limit
from chipload.control.override import Override
from chipload.control.resolution import check_light, torque_resolution
from chipload.control.spindle import first_order
from chipload.control.spindle_model import Spindle
from chipload.control.wall import (
    PathLimit,
    path_limit,
)
from chipload.cutting.material import Material, material_named, need_directions, read_material
from chipload.errors import InputError
from chipload.jobs.checks import default_checks
from chipload.jobs.provenance import provenance_of, title_of
from chipload.jobs.torque.allowable import Allowable, allowable, allowed, feed_at, limit_of, thinnest, wall_of
from chipload.jobs.torque.controllers import cases_of, controller_of, shortest
from chipload.jobs.torque.cut import (
    Cut,
    Place,
    cut,
    off_centre,
    program_of,
    require_linear,
    resolution_of,
    shell_stock,
    thinner_share,
)
from chipload.jobs.torque.job import TorqueJob
from chipload.jobs.torque.outcome import (
    HELD,
    AllowableTorque,
    ComplianceComparison,
    ControlComparison,
    ControllerCase,
    ShellWall,
    SolidComparison,
    SpindleEstimate,
    TorqueInputs,
    TorqueResult,
)
from chipload.jobs.torque.remedies import remedy_text
from chipload.jobs.torque.spindle import deviation_of, estimate_range, require_resolved, spindle_of, told_from
from chipload.jobs.torque.step_checks import step_checks
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.program.program import Program
from chipload.progress import Progress, silent
from chipload.result import Provenance
from chipload.simulation.accuracy import energy_balance
from chipload.simulation.chips import counted
from chipload.simulation.estimate import estimate
from chipload.stock.rings import surface_off
from chipload.structure.shell import Ritz, compliance, ovalisation
from chipload.structure.wall_solid import normal_compliance, wall_solid
from chipload.units import mm_min_from_mm_s

Floats = NDArray[np.float64]

#: elements of the second opinion: half round, along, through
MESH = (24, 20, 1)
#: a check simulates the plan with steps and layers so many times as long, if these are at most so many steps
COARSER, COARSER_LAYERS, MOST_PREVIEWED = 4.0, 2.0, 3000


def run(job: TorqueJob, progress: Progress = silent) -> TorqueResult:
    """Cut the stock as planned and as it is, find the limit, run every controller.

    Raises
    ------
    InputError
        A file cannot be read, or values do not go together.
    """
    machine, material, table, program, spindle = opened(job)
    a = allowable(job, program, material, machine, lambda done, what: progress(0.65 * done, what))
    shell, place, torque = wall_of(job), Place(job.shell), a.torque
    progress(0.7, "controllers")
    controller: Override | None = None
    cases: tuple[ControllerCase, ...] = ()
    shortest_time = math.inf
    if torque > 0.0:
        require_resolved(job, spindle, torque)
        controller, acceleration = controller_of(job, torque), _acceleration(job, machine)
        cases = cases_of(job, a.path, controller, table, spindle, torque, a.walls, acceleration, progress)
        shortest_time = shortest(a.path, controller, torque, acceleration)
    progress(0.9, "second opinion")
    low, high = _finished(place, a.real)
    return TorqueResult(
        job=_inputs(job, program, machine, material),
        wall=ShellWall(
            shell=shell,
            thinnest=a.thin.shell.thickness,
            real=a.true.shell.thickness,
            strength=job.shell.strength_mpa,
            tolerance=job.shell.wall_tolerance_mm,
            oval=ovalisation(a.thin, a.thin.shell.length),
            oval_s=a.thin.shell.length,
            solid=_second_opinion(a.thin, a.width, a.planned),
            surface=surface_off(a.real.stock, place.outer, low, high),
            stock=a.real.stock,
        ),
        allowable=AllowableTorque(
            limit=a.limit,
            torque=torque,
            true_torque=path_limit(a.loads, a.response, *allowed(job)).torque,
            one_tooth=_one_tooth(a.limit, a.planned, material, job),
            remedy="" if torque > 0.0 else remedy_text(job, a.thin.shell, a.planned, a.limit),
            path=a.path,
            steps=_step_columns(a),
        ),
        control=ControlComparison(
            cases=cases,
            controller=controller,
            table=table,
            spindle=spindle,
            told_from=told_from(job, spindle),
            deviation=deviation_of(job),
            estimate=_estimate(job, cases, spindle, controller) if controller is not None else None,
            ideal_time=shortest_time,
        ),
        step_checks=step_checks(a.real, a.loads, material, _fastest(cases)),
        findings=(*a.planned.removal.findings, *a.real.removal.findings),
        resolution_error=a.real.removal.resolution_error,
        energy_balance={
            name: energy_balance(cut.removal.columns, material.Ktc)
            for name, cut in (("planned", a.planned), ("real", a.real))
        },
    )


def _inputs(job: TorqueJob, program: Program, machine: Machine, material: Material) -> TorqueInputs:
    """What the job states."""
    ask = job.table.limits
    return TorqueInputs(
        title=title_of(job.path),
        program_name=job.program_file.name if job.program_file is not None else "made: down the wall and once round",
        program=program,
        machine=machine,
        limits=ask.stated,
        unchecked=ask.unstated,
        settings=job.table.model_dump(exclude_none=True, exclude={"cutter", "surprise"}),
        surprises=tuple(_text_of(x.model_dump(exclude_none=True)) for x in job.table.surprise),
        checks=default_checks(job.table.checks, job.cutters, material, 0.5),
        check_table=job.table.checks,
        provenance=_provenance(job, machine, material),
    )


def _step_columns(a: Allowable) -> dict[str, NDArray[Any]]:
    """Columns of the steps of the plan."""
    c, planned, true = a.planned.removal.columns, a.planned.loads, a.loads
    first = int(np.flatnonzero(~c["rapid"])[0])
    own = slice(first, first + len(a.planned.feed))
    return {
        "line": c["line"][own],
        "s_mm": a.path.model.s[1:],
        **{f"{x}_mm": c[f"{x}_mm"][own] for x in "xyz"},
        "torque_planned_nm": 1e-3 * (planned.torque_edge + planned.torque_cut),
        "torque_true_nm": 1e-3 * (true.torque_edge + true.torque_cut),
        "torque_allowable_nm": 1e-3 * a.limit.each,
    }


def check(job: TorqueJob) -> tuple[list[str], bool]:
    """Read all that the job names, say what of it does not go together, and find the limit of torque coarsely.

    Raises
    ------
    InputError
        As :func:`run`, but for what only the exact limit of torque shows.
    """
    machine, material, table, program, spindle = opened(job)
    shell = wall_of(job)
    kind = "tube" if shell.cone_angle == 0.0 else "cone"
    thinner = thinner_share(job.table.surprise)
    shell_stock(job, program)
    stock = shell_stock(job, program, off_centre(job.shell.stock_mm, job.table.surprise), thinner)
    wrong = 1.0 + spindle.torque_constant_error
    granted = 1.0 + 1e-2 * job.table.limits.torque_over_percent - wrong * job.table.torque_control.override.hold
    least = torque_resolution(spindle, 1e-3 * job.table.loop.period_ms).total / granted if granted > 0.0 else math.inf
    count = counted(program, job.cutters, resolution_of(job))
    text, attainable = _preview(job, program, material, machine)
    return [
        f"{job.path.name}: a {kind}, radius {shell.radius:g}, length {shell.length:g}, wall {shell.thickness:g} mm; "
        f"{len(program)} motions on machine {machine.name}, stock of {stock.volume():.5g} mm3, material "
        f"{material.name}, controller {table.name}, {len(job.table.surprise)} surprises",
        f"the spindle holds limits of torque from {1e-3 * least:.3g} N m",
        text,
        estimate(4 * count, len(program)),
    ], attainable


def _preview(job: TorqueJob, program: Program, material: Material, machine: Machine) -> tuple[str, bool]:
    """The limit of torque by a coarse simulation of the plan, in a sentence, and whether there is one."""
    fine = job.table.simulation
    coarse = fine.model_copy(
        update={
            "step_mm": min(COARSER * fine.step_mm, 10.0),
            "layer_mm": min(COARSER_LAYERS * fine.layer_mm, 10.0),
            "tolerance_mm": max(fine.tolerance_mm, 0.02),
        }
    )
    rough = replace(job, table=job.table.model_copy(update={"simulation": coarse}))
    if counted(program, job.cutters, resolution_of(rough)) > MOST_PREVIEWED:
        return "the limit of torque is found when the job is run", True
    planned = cut(rough, program, shell_stock(rough, program), material, machine.rapid, silent)
    _, limit = limit_of(rough, planned)
    where = f"by the wall's {limit.by}, {planned.far[limit.step]:.3g} mm from the clamp"
    if limit.torque <= 0.0:
        shell = thinnest(rough)
        return f"no torque is allowable, {where}: {remedy_text(rough, shell, planned, limit)}", False
    feed = feed_at(planned, limit, limit.step)
    return (
        f"by a coarse simulation the limit of torque is about {1e-3 * limit.torque:.2g} N m, {where}; the feed must be "
        f"at most {feed:.3g} mm/min there, {mm_min_from_mm_s(float(planned.feed[limit.step])):.4g} are programmed",
        True,
    )


def opened(job: TorqueJob) -> tuple[Machine, Material, FuzzyTable, Program, Spindle]:
    """What the job names, if its values go together.

    Raises
    ------
    InputError
        A file cannot be read, the spindle does not resolve the torque, or the loop asks too much of the machine.
    """
    machine, material, table = _named(job)
    require_linear(material)
    _acceleration(job, machine)
    program = program_of(job, machine)
    spindle = spindle_of(job, program.spindle)
    period = 1e-3 * job.table.loop.period_ms
    check_light(spindle, period, 1e3 * job.table.torque_control.override.light_nm)
    if job.table.limits.torque_nm is not None:
        # the limit is at most this one, so that a spindle that cannot hold this one holds none
        require_resolved(job, spindle, 1e3 * job.table.limits.torque_nm)
    counted(program, job.cutters, resolution_of(job))
    return machine, material, table, program, spindle


def _acceleration(job: TorqueJob, machine: Machine) -> float:
    """Acceleration along the path [mm/s^2]."""
    stated, most = job.table.loop.acceleration_mm_s2, min(machine.acceleration[:2])
    if stated is not None and stated > most:
        raise InputError(
            f"loop.acceleration_mm_s2 = {stated:g}: must be at most {most:g}, that of machine {machine.name}"
        )
    return stated or most


def _named(job: TorqueJob) -> tuple[Machine, Material, FuzzyTable]:
    machine = machine_named(job.machine) if isinstance(job.machine, str) else read_machine(job.machine)
    material = material_named(job.material) if isinstance(job.material, str) else read_material(job.material)
    need_directions(material, "the wall of a shell")
    return machine, material, read_fuzzy(job.control_file) if job.control_file is not None else standard()


def _one_tooth(limit: PathLimit, planned: Cut, material: Material, job: TorqueJob) -> float:
    """The closed formula of one tooth at the place of the limit."""
    k, c = limit.step, planned.removal.columns
    first = int(np.flatnonzero(~c["rapid"])[0])
    depth = float(planned.far[k] - planned.near[k])
    peak, mean = float(c["torque_nm"][first + k]), float(c["torque_mean_nm"][first + k])
    if material.Krc <= 0.0 or peak <= 0.0 or depth <= 0.0:
        return 0.0
    radius = job.cutters[int(c["tool"][first + k])].radius
    return float(torque_limit(limit.force, radius, depth, material, min(mean / peak, 1.0)).torque)


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
        aliased=(passing, aliased(passing, 1.0 / case.loop.period)),
    )


def _second_opinion(modes: Ritz, width: float, planned: Cut) -> SolidComparison:
    """The wall by hexahedra, nearest to the free end, in the middle of the rounds and nearest to the clamp."""
    on = np.flatnonzero(planned.makes & (planned.far > planned.near))
    rows = on[np.argsort(planned.far[on], kind="stable")] if len(on) else np.argsort(planned.far)[-1:]
    wall = wall_solid(modes.shell, MESH)
    out = []
    for k in dict.fromkeys((int(rows[-1]), int(rows[len(rows) // 2]), int(rows[0]))):
        a, b = float(planned.near[k]), float(planned.far[k])
        if b <= a:
            continue
        middle, length = 0.5 * (a + b), b - a
        shell = float(compliance(modes, middle, s_point=b, length=length, width=width)[2, 2])
        out.append(ComplianceComparison(b, shell, normal_compliance(wall, middle, b, length, width)))
    return SolidComparison(tuple(out), wall.counts, len(wall.factored.solid.grid.nodes))


def _fastest(cases: tuple[ControllerCase, ...]) -> float:
    """Greatest feed over the programmed one that any controller reaches, at least 1."""
    return max((float(run.ratio.max()) for case in cases for run in case.runs.values()), default=1.0)


def _finished(place: Place, cut_: Cut) -> tuple[float, float]:
    """Heights between which the surface was made [mm]."""
    rows = np.flatnonzero(cut_.makes)
    if not len(rows):
        return 0.0, 0.0
    return float(cut_.points[rows + 1, 2].min()), place.ends[1]


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
    files |= {f"cutter {k}": job.path.parent / c.file for k, c in enumerate(job.table.cutter) if c.file is not None}
    return provenance_of(files, job.overrides, machine, (material,))
