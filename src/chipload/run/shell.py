"""A job on a thin tube or cone: the torque that the wall bears, and the controllers that hold it."""

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
from chipload.control.plant import Loop, Spindle, comparison
from chipload.control.spindle import first_order
from chipload.control.wall import Bearing, Loads, PathLimit, WallPath, bearing, path_limit, row_means, wall_error
from chipload.cutting.material import Material, material_named, read_material
from chipload.errors import InputError
from chipload.job.shell import ShellJob
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.progress import Progress, silent
from chipload.report.shell.outcome import (
    HELD,
    PLAIN,
    Case,
    Compared,
    Estimator,
    Run,
    ShellOutcome,
    Solid,
)
from chipload.run.program import material_provenance
from chipload.run.provenance import hashes, title_of, versions
from chipload.run.shell_cut import (
    Cut,
    Place,
    contact_width,
    cut,
    off_centre,
    program_of,
    shell_stock,
    thinner_share,
    true_loads,
)
from chipload.stock.rings import surface_off
from chipload.structure.shell import Ritz, Shell, compliance, ovalisation, ritz
from chipload.structure.wall_solid import normal_compliance, wall_solid

Floats = NDArray[np.float64]

#: elements of the second opinion: half round, along, through
MESH = (24, 20, 1)
#: the wall is held to bear at most so many times what it bears at the place of the limit
RELIEF_MOST = 3.0
#: what is borne is the least of so many steps on both sides
NEAR = 2
#: the constant feed is lowered so often until the spindle's droop is in it
DROOPS = 8


def run_shell(job: ShellJob, progress: Progress = silent) -> ShellOutcome:
    """Cut the stock as planned and as it is, find the limit, run every controller.

    Raises
    ------
    InputError
        A file cannot be read, or values do not go together.
    """
    machine, material, table = _named(job)
    program = program_of(job, machine)
    surprises, place = job.table.surprise, Place(job.table.shell)
    thinner = thinner_share(surprises)
    planned = cut(job, program, shell_stock(job, program), material, machine.rapid, _part(progress, 0.0, 0.3))
    centre = off_centre(job.table.shell.stock_mm, surprises)
    real = cut(
        job, program, shell_stock(job, program, centre, thinner), material, machine.rapid, _part(progress, 0.3, 0.6)
    )
    loads = true_loads(real.loads, real.points, place, surprises)
    progress(0.6, "the wall")
    shell = wall_of(job)
    width = contact_width(job.table.shell.stock_mm, job.cutters)
    thin = ritz(replace(shell, thickness=shell.thickness - job.table.shell.wall_tolerance_mm))
    true = thin if thin.shell.thickness == shell.thickness * (1.0 - thinner) else ritz(
        replace(shell, thickness=shell.thickness * (1.0 - thinner))
    )  # fmt: skip
    ask = job.table.limits
    allowed = (1e-3 * ask.deflection_um, ask.strength_share * job.table.shell.strength_mpa)
    limit = path_limit(planned.loads, bearing(thin, planned.near, planned.far, width, planned.tool), *allowed)
    walls = bearing(true, real.near, real.far, width, real.tool)
    torque = min(limit.torque, 1e3 * ask.torque_nm) if ask.torque_nm is not None else limit.torque
    path = _path(planned, loads, _relief(limit, torque))
    spindle = _spindle(job, program.spindle)
    controller: Override | None = None
    cases: tuple[Case, ...] = ()
    if torque > 0.0:
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
        "torque_borne_nm": 1e-3 * limit.each,
    }
    low, high = _finished(place, real)
    return ShellOutcome(
        title=title_of(job.path),
        program_name=job.program_file.name if job.program_file is not None else "made: down the wall and once round",
        program=program,
        machine=machine,
        wall=shell,
        thinnest=thin.shell.thickness,
        real=true.shell.thickness,
        strength=job.table.shell.strength_mpa,
        limits=ask.stated,
        unchecked=ask.unstated,
        tolerance=job.table.shell.wall_tolerance_mm,
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
        surprises=tuple(_said(x.model_dump(exclude_none=True)) for x in surprises),
        stock=real.stock,
        findings=(*planned.removal.findings, *real.removal.findings),
        settings=job.table.model_dump(exclude_none=True, exclude={"cutter", "surprise"}),
        provenance=_provenance(job, machine, material),
    )


def look_at_shell(job: ShellJob) -> tuple[list[str], bool]:
    """Read all that the job names; nothing is cut."""
    machine, material, table = _named(job)
    program = program_of(job, machine)
    shell = wall_of(job)
    kind = "tube" if shell.cone_angle == 0.0 else "cone"
    stock = shell_stock(job, program, off_centre(job.table.shell.stock_mm, job.table.surprise))
    return [
        f"{job.path.name}: a {kind}, radius {shell.radius:g}, length {shell.length:g}, wall {shell.thickness:g} mm; "
        f"{len(program)} motions on machine {machine.name}, stock of {stock.volume():.5g} mm3, material "
        f"{material.name}, controller {table.name}, {len(job.table.surprise)} surprises"
    ], True


def wall_of(job: ShellJob) -> Shell:
    """The finished wall as planned."""
    t = job.table.shell
    return Shell(t.mean_radius_mm, t.length_mm, t.wall_mm, 1e3 * t.modulus_gpa, t.poisson, math.radians(t.angle_deg))


def _named(job: ShellJob) -> tuple[Machine, Material, FuzzyTable]:
    machine = machine_named(job.machine) if isinstance(job.machine, str) else read_machine(job.machine)
    material = material_named(job.material) if isinstance(job.material, str) else read_material(job.material)
    return machine, material, read_fuzzy(job.control_file) if job.control_file is not None else standard()


def _part(progress: Progress, low: float, high: float) -> Progress:
    return lambda done, what: progress(low + (high - low) * done, what)


def _relief(limit: PathLimit, torque: float) -> Floats:
    """(n + 1,) what is borne at the ends of the steps over what is held, the least of the steps near."""
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


def _walls(path: ToolPath, loads: Loads, walls: Bearing, real: Cut) -> tuple[WallPath, WallPath]:
    """For the error (of the finished surface) and for the stress (everywhere), per newton."""
    force = (row_means(loads.force_edge), row_means(loads.force_cut))
    error = WallPath(path.model.s, *force, np.where(real.makes, walls.compliance, 0.0))
    return error, WallPath(path.model.s, *force, walls.stress)


def _spindle(job: ShellJob, speeds: Floats) -> Spindle:
    t = job.table.spindle
    return Spindle(
        speed=float(np.abs(speeds).max()), inertia=1e3 * t.inertia_kg_m2, torque_constant=1e3 * t.torque_constant_nm_a,
        idle=t.idle_a, stiffness=t.stiffness_a_s, reset=t.reset_a, most_current=t.most_current_a,
        sensor_lag=t.sensor_lag_s, smoothing=t.smoothing_s, noise=t.noise_a,
    )  # fmt: skip


def _controller(job: ShellJob, torque: float) -> Override:
    t = job.table.control.override.model_dump()
    hold = t.pop("hold")
    for key, value in (("light_nm", 1e3 * t["light_nm"]), ("overload_nm", 1e3 * t["overload_nm"])):
        if (value >= hold * torque) == (key == "light_nm"):
            side = "below" if key == "light_nm" else "above"
            raise InputError(
                f"control.override.{key} = {1e-3 * value:g}: must be {side} the torque that is held, "
                f"{1e-3 * hold * torque:.4g} N m"
            )
    newton_mm = {k: 1e3 * t.pop(f"{k}_nm") for k in ("overload", "torque_most", "light")}
    plain = {k.removesuffix("_per_s"): v for k, v in t.items()}
    return Override(kind="mamdani", torque_ref=hold * torque, quantum=0.0, **newton_mm, **plain)


def _cases(
    job: ShellJob, path: ToolPath, controller: Override, table: FuzzyTable, spindle: Spindle, torque: float,
    walls: tuple[WallPath, WallPath], machine: Machine, progress: Progress,
) -> tuple[Case, ...]:  # fmt: skip
    """Every controller without latency, and with what the job states."""
    ask = job.table.loop
    most = min(machine.acceleration[:2])
    if ask.acceleration_mm_s2 is not None and ask.acceleration_mm_s2 > most:
        raise InputError(
            f"loop.acceleration_mm_s2 = {ask.acceleration_mm_s2:g}: must be at most {most:g}, that of machine "
            f"{machine.name}"
        )
    out = []
    for k, (latency, quantum) in enumerate(((0.0, 0.0), (1e-3 * ask.latency_ms, ask.override_step))):
        loop = Loop(
            ask.acceleration_mm_s2 or most,
            1e-3 * ask.period_ms,
            latency,
            min(1e-3, 1e-3 * ask.period_ms),
            seed=ask.seed,
        )
        config = replace(controller, quantum=quantum)

        def one(override: Override, modelled: bool, loop: Loop = loop) -> Run:
            model = path.model if modelled else None
            found = plant.run(path.truth, model, override, table, spindle, loop, torque, relief=path.relief)
            error, stress = (wall_error(w, path.model, found, spindle.speed) for w in walls)
            return Run(override, modelled, found, error, stress)

        constant = _constant(path, config, torque, one)
        runs: dict[str, Run] = {}
        for name, (override, modelled) in comparison(constant, config).items():
            runs[name] = one(override, modelled)
            if name == PLAIN:
                # its override follows the model, nothing is measured
                runs["constant_torque"] = one(replace(config, kind="fixed"), True)
        out.append(Case(loop, quantum, runs))
        progress(0.75 + 0.05 * k, "controllers")
    return tuple(out)


def _constant(path: ToolPath, config: Override, torque: float, one: Callable[[Override, bool], Run]) -> float:
    """The greatest constant override that respects the limit everywhere, the droop of the spindle and all."""
    t, cuts = path.truth, path.truth.cut > 0.0
    borne = (torque * path.relief - t.edge)[cuts] / t.cut[cuts]
    value = min(float(borne.min(initial=np.inf)), config.cap)
    if value <= 0.0:
        return config.floor
    for _ in range(DROOPS):
        found = one(comparison(value, config)[PLAIN][0], False).outcome.load_max
        if found <= torque:
            break
        value *= torque / found
    return value


def _one_tooth(limit: PathLimit, planned: Cut, material: Material, job: ShellJob) -> float:
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
        light=controller.light,
        light_share=float((found.torque[cutting] < controller.light).mean()) if cutting.any() else 0.0,
    )


def _second_opinion(modes: Ritz, width: float, planned: Cut) -> Solid:
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
        out.append(Compared(b, shell, normal_compliance(wall, middle, b, length, width)))
    return Solid(tuple(out), wall.counts, len(wall.factored.solid.grid.nodes))


def _finished(place: Place, cut_: Cut) -> tuple[float, float]:
    """Heights between which the surface was made [mm]."""
    rows = np.flatnonzero(cut_.makes)
    if not len(rows):
        return 0.0, 0.0
    return float(cut_.points[rows + 1, 2].min()), place.ends[1]


def _said(values: dict[str, Any]) -> str:
    return ", ".join(f"{k} {v:g}" if isinstance(v, float) else str(v) for k, v in values.items())


def _provenance(job: ShellJob, machine: Machine, material: Material) -> dict[str, Any]:
    named = {
        "program": job.program_file,
        "machine": job.machine,
        "material": job.material,
        "controller": job.control_file,
    }
    files: dict[str, Path] = {"job": job.path} | {k: v for k, v in named.items() if isinstance(v, Path)}
    files |= {f"cutter {k}": job.path.parent / c.file for k, c in enumerate(job.table.cutter) if c.file is not None}
    return {
        "inputs": hashes(files),
        "overrides": list(job.overrides),
        "machine": f"{machine.name}: {machine.note}" if machine.note else machine.name,
        "material": material_provenance(material),
        "versions": versions(),
    }
