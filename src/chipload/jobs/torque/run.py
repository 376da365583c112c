"""A job on a thin tube or cone: the allowable torque of the wall, and the controllers that hold it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from chipload.control import plant
from chipload.control.fuzzy import FuzzyTable, read_fuzzy, standard
from chipload.control.limit import torque_limit
from chipload.control.linuxcnc.path import ToolPath, tool_path
from chipload.control.override import Override
from chipload.control.plant import Loop, comparison
from chipload.control.resolution import check_light, check_limit, torque_resolution
from chipload.control.spindle import first_order
from chipload.control.spindle_model import Spindle
from chipload.control.wall import (
    Loads,
    PathLimit,
    UnitResponse,
    WallPath,
    path_limit,
    row_means,
    unit_response,
    wall_error,
)
from chipload.cutting.material import Material, material_named, need_directions, read_material
from chipload.errors import InputError
from chipload.jobs.checks import default_checks
from chipload.jobs.provenance import provenance_of, title_of
from chipload.jobs.torque.cut import (
    Cut,
    Place,
    contact_width,
    cut,
    off_centre,
    program_of,
    require_linear,
    resolution_of,
    shell_stock,
    thinner_share,
    true_loads,
)
from chipload.jobs.torque.job import TorqueJob
from chipload.jobs.torque.outcome import (
    HELD,
    PLAIN,
    Case,
    ComplianceComparison,
    ControllerRun,
    Estimator,
    SolidComparison,
    TorqueResult,
)
from chipload.jobs.torque.step_checks import feed_ratio, step_checks
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.program.program import Program
from chipload.progress import Progress, silent
from chipload.result import Provenance
from chipload.simulation.chips import counted
from chipload.simulation.estimate import estimate
from chipload.stock.rings import surface_off
from chipload.structure.shell import Ritz, Shell, compliance, ovalisation, ritz
from chipload.structure.wall_solid import normal_compliance, wall_solid

Floats = NDArray[np.float64]

#: elements of the second opinion: half round, along, through
MESH = (24, 20, 1)
#: the torque that is allowed anywhere is at most so many times the limit
RELIEF_MOST = 3.0
#: the allowable torque is the least of so many steps on both sides
NEAR = 2
#: the constant feed is lowered so often until the spindle's droop is in it
DROOPS = 8


def run(job: TorqueJob, progress: Progress = silent) -> TorqueResult:
    """Cut the stock as planned and as it is, find the limit, run every controller.

    Raises
    ------
    InputError
        A file cannot be read, or values do not go together.
    """
    machine, material, table, program, spindle = _opened(job)
    surprises, place = job.table.surprise, Place(job.shell)
    thinner = thinner_share(surprises)
    planned = cut(job, program, shell_stock(job, program), material, machine.rapid, _part(progress, 0.0, 0.3))
    centre = off_centre(job.shell.stock_mm, surprises)
    real = cut(
        job, program, shell_stock(job, program, centre, thinner), material, machine.rapid, _part(progress, 0.3, 0.6),
        keep=True,
    )  # fmt: skip
    loads = true_loads(real.loads, real.points, place, surprises)
    progress(0.6, "the wall")
    shell = wall_of(job)
    width = contact_width(job.shell.stock_mm, job.cutters)
    thin = ritz(replace(shell, thickness=shell.thickness - job.shell.wall_tolerance_mm))
    true = thin if thin.shell.thickness == shell.thickness * (1.0 - thinner) else ritz(
        replace(shell, thickness=shell.thickness * (1.0 - thinner))
    )  # fmt: skip
    ask = job.table.limits
    allowed = (1e-3 * ask.form_error_um, ask.strength_share * job.shell.strength_mpa)
    limit = path_limit(planned.loads, unit_response(thin, planned.near, planned.far, width, planned.tool), *allowed)
    walls = unit_response(true, real.near, real.far, width, real.tool)
    torque = min(limit.torque, 1e3 * ask.torque_nm) if ask.torque_nm is not None else limit.torque
    path = _path(planned, loads, _relief(limit, torque))
    controller: Override | None = None
    cases: tuple[Case, ...] = ()
    if torque > 0.0:
        _resolved(job, spindle, torque)
        controller = _controller(job, torque)
        cases = _cases(
            job, path, controller, table, spindle, torque, _walls(path, loads, walls, real), machine, progress
        )
    progress(0.9, "second opinion")
    c = planned.removal.columns
    first = int(np.flatnonzero(~c["rapid"])[0])
    own = slice(first, first + len(planned.feed))
    steps = {
        "line": c["line"][own],
        "s_mm": path.model.s[1:],
        **{f"{x}_mm": c[f"{x}_mm"][own] for x in "xyz"},
        "torque_planned_nm": 1e-3 * (planned.loads.torque_edge + planned.loads.torque_cut),
        "torque_true_nm": 1e-3 * (loads.torque_edge + loads.torque_cut),
        "torque_allowable_nm": 1e-3 * limit.each,
    }
    low, high = _finished(place, real)
    return TorqueResult(
        title=title_of(job.path),
        program_name=job.program_file.name if job.program_file is not None else "made: down the wall and once round",
        program=program,
        machine=machine,
        wall=shell,
        thinnest=thin.shell.thickness,
        real=true.shell.thickness,
        strength=job.shell.strength_mpa,
        limits=ask.stated,
        unchecked=ask.unstated,
        tolerance=job.shell.wall_tolerance_mm,
        limit=limit,
        torque=torque,
        true_torque=path_limit(loads, walls, *allowed).torque,
        one_tooth=_one_tooth(limit, planned, material, job),
        path=path,
        steps=steps,
        cases=cases,
        controller=controller,
        table=table,
        spindle=spindle,
        estimator=_estimator(cases, spindle, controller) if controller is not None else None,
        oval=ovalisation(thin, thin.shell.length),
        oval_s=thin.shell.length,
        solid=_second_opinion(thin, width, planned),
        surface=surface_off(real.stock, place.outer, low, high),
        surprises=tuple(_text_of(x.model_dump(exclude_none=True)) for x in surprises),
        stock=real.stock,
        findings=(*planned.removal.findings, *real.removal.findings),
        settings=job.table.model_dump(exclude_none=True, exclude={"cutter", "surprise"}),
        checks=default_checks(job.table.checks, job.cutters, material, 0.5),
        check_table=job.table.checks,
        step_checks=step_checks(real, loads, material, _fastest(cases)),
        provenance=_provenance(job, machine, material),
    )


def check(job: TorqueJob) -> tuple[list[str], bool]:
    """Read all that the job names and what of it does not go together; nothing is cut.

    Raises
    ------
    InputError
        As :func:`run`, but for what only the limit of torque shows, which the cut gives.
    """
    machine, material, table, program, spindle = _opened(job)
    shell = wall_of(job)
    kind = "tube" if shell.cone_angle == 0.0 else "cone"
    thinner = thinner_share(job.table.surprise)
    shell_stock(job, program)
    stock = shell_stock(job, program, off_centre(job.shell.stock_mm, job.table.surprise), thinner)
    granted = 1.0 + 1e-2 * job.table.limits.torque_over_percent - job.table.torque_control.override.hold
    least = torque_resolution(spindle, 1e-3 * job.table.loop.period_ms).total / granted if granted > 0.0 else math.inf
    count = counted(program, job.cutters, resolution_of(job))
    return [
        f"{job.path.name}: a {kind}, radius {shell.radius:g}, length {shell.length:g}, wall {shell.thickness:g} mm; "
        f"{len(program)} motions on machine {machine.name}, stock of {stock.volume():.5g} mm3, material "
        f"{material.name}, controller {table.name}, {len(job.table.surprise)} surprises",
        f"the spindle holds limits of torque from {1e-3 * least:.3g} N m; the limit is found when the job is run",
        estimate(4 * count, len(program)),
    ], True


def _opened(job: TorqueJob) -> tuple[Machine, Material, FuzzyTable, Program, Spindle]:
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
    spindle = _spindle(job, program.spindle)
    period = 1e-3 * job.table.loop.period_ms
    check_light(spindle, period, 1e3 * job.table.torque_control.override.light_nm)
    if job.table.limits.torque_nm is not None:
        # the limit is at most this one, so that a spindle that cannot hold this one holds none
        _resolved(job, spindle, 1e3 * job.table.limits.torque_nm)
    counted(program, job.cutters, resolution_of(job))
    return machine, material, table, program, spindle


def _resolved(job: TorqueJob, spindle: Spindle, torque: float) -> None:
    """Refuse a limit of torque [N mm] that the spindle cannot hold, or that counts as light."""
    hold = job.table.torque_control.override.hold
    excess = 1e-2 * job.table.limits.torque_over_percent
    check_limit(spindle, 1e-3 * job.table.loop.period_ms, torque, hold, excess)
    light = 1e3 * job.table.torque_control.override.light_nm
    if light >= hold * torque:
        raise _wrong_side("light_nm", light, hold * torque)


def _wrong_side(key: str, value: float, held: float) -> InputError:
    side = "below" if key == "light_nm" else "above"
    return InputError(
        f"torque_control.override.{key} = {1e-3 * value:g}: must be {side} the torque that is held, "
        f"{1e-3 * held:.4g} N m"
    )


def _acceleration(job: TorqueJob, machine: Machine) -> float:
    """Acceleration along the path [mm/s^2]."""
    stated, most = job.table.loop.acceleration_mm_s2, min(machine.acceleration[:2])
    if stated is not None and stated > most:
        raise InputError(
            f"loop.acceleration_mm_s2 = {stated:g}: must be at most {most:g}, that of machine {machine.name}"
        )
    return stated or most


def wall_of(job: TorqueJob) -> Shell:
    """The finished wall as planned."""
    t = job.shell
    return Shell(t.mean_radius_mm, t.length_mm, t.wall_mm, 1e3 * t.modulus_gpa, t.poisson, math.radians(t.angle_deg))


def _named(job: TorqueJob) -> tuple[Machine, Material, FuzzyTable]:
    machine = machine_named(job.machine) if isinstance(job.machine, str) else read_machine(job.machine)
    material = material_named(job.material) if isinstance(job.material, str) else read_material(job.material)
    need_directions(material, "the wall of a shell")
    return machine, material, read_fuzzy(job.control_file) if job.control_file is not None else standard()


def _part(progress: Progress, low: float, high: float) -> Progress:
    return lambda done, what: progress(low + (high - low) * done, what)


def _relief(limit: PathLimit, torque: float) -> Floats:
    """(n + 1,) allowable torque at the ends of the steps over the limit, the least of the steps near."""
    if torque <= 0.0:
        return np.ones(len(limit.each) + 1)
    # a stated limit holds everywhere
    each = np.clip(limit.each / torque, 1.0, RELIEF_MOST if torque >= limit.torque else 1.0)
    padded = np.concatenate([np.repeat(each[:1], NEAR + 1), each, np.repeat(each[-1:], NEAR + 1)])
    return np.asarray(sliding_window_view(padded, 2 * NEAR + 2).min(axis=1)[: len(each) + 1])


def _path(planned: Cut, true: Loads, relief: Floats) -> ToolPath:
    believed = np.column_stack([row_means(planned.loads.torque_edge), row_means(planned.loads.torque_cut)])
    real = np.column_stack([row_means(true.torque_edge), row_means(true.torque_cut)])
    return tool_path(planned.points, np.append(planned.feed, planned.feed[-1]), believed, real, relief)


def _walls(path: ToolPath, loads: Loads, walls: UnitResponse, real: Cut) -> tuple[WallPath, WallPath, WallPath]:
    """For the error (of the finished surface), for the stress and for the deflection (everywhere), per newton."""
    force = (row_means(loads.force_edge), row_means(loads.force_cut))
    error = WallPath(path.model.s, *force, np.where(real.makes, walls.compliance, 0.0))
    return error, WallPath(path.model.s, *force, walls.stress), WallPath(path.model.s, *force, walls.compliance)


def _spindle(job: TorqueJob, speeds: Floats) -> Spindle:
    t = job.table.spindle
    return Spindle(
        speed=float(np.abs(speeds).max()), inertia=1e3 * t.inertia_kg_m2, torque_constant=1e3 * t.torque_constant_nm_a,
        idle=t.idle_a, stiffness=t.stiffness_a_s, reset=t.reset_a, most_current=t.most_current_a,
        sensor_lag=t.sensor_lag_s, smoothing=t.smoothing_s, noise=t.noise_a, current_step=t.current_step_a,
        idle_error=t.idle_error_share,
    )  # fmt: skip


def _controller(job: TorqueJob, torque: float) -> Override:
    t = job.table.torque_control.override.model_dump()
    hold = t.pop("hold")
    overload = 1e3 * t["overload_nm"]
    if overload < hold * torque:
        raise _wrong_side("overload_nm", overload, hold * torque)
    newton_mm = {k: 1e3 * t.pop(f"{k}_nm") for k in ("overload", "torque_most", "light")}
    plain = {k.removesuffix("_per_s"): v for k, v in t.items()}
    return Override(kind="mamdani", torque_ref=hold * torque, quantum=0.0, **newton_mm, **plain)


def _cases(
    job: TorqueJob, path: ToolPath, controller: Override, table: FuzzyTable, spindle: Spindle, torque: float,
    walls: tuple[WallPath, WallPath, WallPath], machine: Machine, progress: Progress,
) -> tuple[Case, ...]:  # fmt: skip
    """Every controller without latency, and with what the job states."""
    ask = job.table.loop
    acceleration = _acceleration(job, machine)
    out = []
    for k, (latency, quantum) in enumerate(((0.0, 0.0), (1e-3 * ask.latency_ms, ask.override_step))):
        loop = Loop(
            acceleration,
            1e-3 * ask.period_ms,
            latency,
            min(1e-3, 1e-3 * ask.period_ms),
            seed=ask.seed,
        )
        config = replace(controller, quantum=quantum)

        def one(override: Override, modelled: bool, loop: Loop = loop) -> ControllerRun:
            model = path.model if modelled else None
            found = plant.run(
                path.truth, model, override, table, spindle, loop, torque, relief=path.relief, monitor=path.model
            )
            error, stress, bent = (wall_error(w, path.model, found, spindle.speed) for w in walls)
            ratio = feed_ratio(path.model, found, spindle.speed)
            return ControllerRun(override, modelled, found, error, stress, bent, ratio)

        constant = _constant(path, config, torque, one)
        runs: dict[str, ControllerRun] = {}
        for name, (override, modelled) in comparison(constant, config).items():
            runs[name] = one(override, modelled)
            if name == PLAIN:
                # its override follows the model, nothing is measured
                runs["constant_torque"] = one(replace(config, kind="fixed"), True)
                runs["derated_schedule"] = _derated(config, torque, one)
        out.append(Case(loop, quantum, runs))
        progress(0.75 + 0.05 * k, "controllers")
    return tuple(out)


def _constant(path: ToolPath, config: Override, torque: float, one: Callable[[Override, bool], ControllerRun]) -> float:
    """The greatest constant override that respects the limit everywhere, the droop of the spindle and all."""
    t, cuts = path.truth, path.truth.cut > 0.0
    most = (torque * path.relief - t.edge)[cuts] / t.cut[cuts]
    value = min(float(most.min(initial=np.inf)), config.cap)
    if value <= 0.0:
        return config.floor
    for _ in range(DROOPS):
        found = one(comparison(value, config)[PLAIN][0], False).outcome.load_max
        if found <= torque:
            break
        value *= torque / found
    return value


def _derated(config: Override, torque: float, one: Callable[[Override, bool], ControllerRun]) -> ControllerRun:
    """The feed schedule of the model alone, planned with the greatest torque at which it respects the limit in
    truth.
    """
    planned = config.torque_ref
    run = one(replace(config, kind="fixed"), True)
    for _ in range(DROOPS):
        if run.outcome.load_max <= torque:
            break
        planned *= torque / run.outcome.load_max
        if planned <= config.light:
            break
        run = one(replace(config, kind="fixed", torque_ref=planned), True)
    return run


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


def _estimator(cases: tuple[Case, ...], spindle: Spindle, controller: Override) -> Estimator:
    case = cases[-1]
    found = case.runs[HELD].outcome
    share = min(case.loop.period / spindle.smoothing, 1.0) if spindle.smoothing > 0.0 else 1.0
    behind = first_order(first_order(found.torque, found.t, spindle.sensor_lag), found.t, spindle.smoothing)
    later = slice(min(len(found.t) // 10, 50), None)
    cutting = found.torque > 0.0
    return Estimator(
        noise=spindle.torque_constant * spindle.noise * math.sqrt(share / (2.0 - share)),
        seen=float(np.std((found.measured - behind)[later])),
        behind=float(np.abs(behind - found.torque)[later].max()),
        lag=spindle.sensor_lag + spindle.smoothing,
        resolution=torque_resolution(spindle, case.loop.period).total,
        light=controller.light,
        light_share=float((found.torque[cutting] < controller.light).mean()) if cutting.any() else 0.0,
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


def _fastest(cases: tuple[Case, ...]) -> float:
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
    }
    files = {k: v for k, v in named.items() if isinstance(v, Path)}
    files |= {f"cutter {k}": job.path.parent / c.file for k, c in enumerate(job.table.cutter) if c.file is not None}
    return provenance_of(files, job.overrides, machine, (material,))
