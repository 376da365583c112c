"""A job that cuts a thin wall: three variants are planned, written for the machine, and simulated one after another."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.material import beyond
from chipload.job import WallJob
from chipload.machine.limits import limit_findings
from chipload.machine.machine import Machine
from chipload.planning.thinwall.depth import largest_depths, normal_force
from chipload.planning.thinwall.experiments import Proposal, propose_cuts
from chipload.planning.thinwall.passes import Plan
from chipload.planning.thinwall.tours import Leg, Margins, tour
from chipload.planning.thinwall.variants import NAMES, held_to, variants
from chipload.planning.thinwall.variants import Variant as Planned
from chipload.planning.thinwall.wall import SIDES
from chipload.program.check import check_program
from chipload.program.commands import Commands
from chipload.program.program import Program
from chipload.program.read import Reading, line_times
from chipload.program.to_axes import to_axes
from chipload.program.to_work import axes_of
from chipload.progress import Progress, silent
from chipload.report.wall.outcome import USED, Help, PassMap, Variant, Walled, verdict
from chipload.run.provenance import hashes, title_of, versions
from chipload.run.wallinputs import WallInputs, read_wall
from chipload.run.wallproof import Proof, prove

Floats = NDArray[np.float64]

#: share of the work that planning is, for the progress
PLANNING = 0.1
#: plans of variable depths that are simulated at most, until one bends the wall no more than the constant depth does
TRIES = 5
#: the next one is held to this share of what would just do
HOLD = 0.97
#: safe height of the tip over the wall, in radii of the cutter
SAFE = 1.5
#: links sag by this share of their distance to the stock
SAG = 0.3
#: rows run on beyond the edges of the wall by so many [mm], over the reach of the corner in its stock
BEYOND = 1.0


def run_wall(job: WallJob, progress: Progress = silent) -> Walled:
    """Plan the three variants of a job, write their programs and simulate them.

    Raises
    ------
    InputError
        A file cannot be read, values do not go together, or the machine does not reach a place.
    Cancelled
        By ``progress``.
    """
    inputs = read_wall(job)
    planned = dict(_planned(inputs, lambda done, what: progress(PLANNING * done, what)))
    tours = {name: _tour(inputs, one.plan) for name, one in planned.items()}
    work = {name: sum(len(leg.program) for leg in legs) for name, legs in tours.items()}
    whole = sum(work.values()) + work[USED]  # the one in use may be cut again
    made: dict[str, Variant] = {}
    done = 0

    def proved(name: str) -> None:
        nonlocal done
        low, share = PLANNING + (1.0 - PLANNING) * done / whole, (1.0 - PLANNING) * work[name] / whole
        legs = tours[name]

        def tell(part: float, what: str) -> None:
            progress(min(low + share * part, 1.0), f"{name}: {what}")

        proof = prove(inputs, planned[name].plan, legs, tell)
        made[name] = _variant(inputs, name, planned[name], legs, proof)
        done += work[name]

    for name in ("constant", "unconstrained", USED):
        proved(name)
    tries = 1
    while tries < TRIES and made["constant"].deflection < made[USED].deflection and inputs.experiments is None:
        less = HOLD * made["constant"].deflection / made[USED].deflection * planned[USED].deflection
        planned[USED] = _held(inputs, less)
        tours[USED] = _tour(inputs, planned[USED].plan)
        work[USED] = sum(len(leg.program) for leg in tours[USED])
        done = whole - work[USED]
        proved(USED)
        tries += 1
    made = {name: made[name] for name in NAMES}
    body, finished = inputs.stock_mesh(), inputs.finished_mesh()
    text = inputs.finished_bears()
    settings: dict[str, Any] = {k: v for k, v in job.operation.model_dump().items() if v is not None}
    settings |= {
        "gouge_tolerance_mm": inputs.gouge_tolerance,
        "yield_mpa": job.table.workpiece.yield_mpa,
        "simulated_tries": tries,
    }
    return Walled(
        title=title_of(job.path),
        wall=inputs.shape,
        allowance=inputs.allowance,
        stock=(np.asarray(body.vertices), np.asarray(body.faces)),
        finished=(np.asarray(finished.vertices), np.asarray(finished.faces)),
        cutter=inputs.cutter,
        machine=inputs.machine,
        limits=job.limits,
        unchecked=job.unchecked,
        threshold_source=text.source,
        threshold_text=text.text,
        reserve=job.operation.reserve,
        step_over=abs(inputs.step_over),
        feed_per_tooth=inputs.posture.feed_per_tooth,
        variants=made,
        findings=_noticed(inputs),
        settings=settings,
        provenance=_provenance(job, inputs),
    )


def look_at_wall(job: WallJob) -> tuple[list[str], bool]:
    """What the job names: the wall, its finite elements, the greatest threshold; nothing is planned."""
    inputs = read_wall(job)
    length, height, thickness = inputs.shape.size()
    nodes = len(inputs.wall.solid.grid.nodes)
    found = inputs.finished_bears()
    lines = [
        *_noticed(inputs),
        f"{job.path.name}: {inputs.shape.name}: {length:.4g} mm long, {height:.4g} mm high, at least "
        f"{thickness:.4g} mm thick; {len(inputs.wall.solid.grid.elements)} elements, {nodes} nodes",
        f"threshold of the finished side {SIDES[inputs.side_numbers[0]]}, {found.source}: {found.force.min():.4g} to "
        f"{found.force.max():.4g} N; normal force {inputs.law.forces[0]:.4g} N at {inputs.law.depths[0]:g} mm, "
        f"{inputs.law.forces[-1]:.4g} N at {inputs.law.depths[-1]:g} mm",
    ]
    return lines, True


def propose(
    job: WallJob, sites: int, scatter: float, bracket: float, steps: int, repeats: int, progress: Progress = silent
) -> Proposal:
    """Calibration cuts that pin best what the finished wall bears: where and how deep, around the modelled threshold.

    Parameters
    ----------
    sites, scatter, bracket, steps, repeats : as of :func:`chipload.planning.thinwall.experiments.propose_cuts`

    Raises
    ------
    InputError
        A file cannot be read, values do not go together, or a site bears not even the smallest depth.
    """
    inputs = replace(read_wall(job), experiments=None)
    u, v = np.meshgrid(*inputs.places, indexing="ij")
    points = inputs.coarse(inputs.side_numbers[0]).points.reshape(-1, 3)
    places = np.column_stack([u.ravel(), v.ravel()])
    modelled = inputs.finished_bears().force.ravel()
    return propose_cuts(
        places, points, modelled, inputs.law, sites, scatter, bracket=bracket, steps=steps, repeats=repeats,
        progress=progress,
    )  # fmt: skip


def _planned(inputs: WallInputs, progress: Progress) -> Mapping[str, Planned]:
    surfaces = [inputs.coarse(s) for s in inputs.side_numbers]
    return variants(
        surfaces, inputs.bears, inputs.law, inputs.even_law, inputs.slope, inputs.deflection, inputs.factor, progress
    )


def _held(inputs: WallInputs, deflection: float) -> Planned:
    surfaces = [inputs.coarse(s) for s in inputs.side_numbers]
    return held_to(surfaces, inputs.bears, inputs.law, inputs.slope, deflection)


def _tour(inputs: WallInputs, plan: Plan) -> tuple[Leg, ...]:
    sides = [inputs.fine(s) for s in inputs.side_numbers]
    cutter = inputs.cutter
    allowance = max(inputs.allowance)
    reach = math.sqrt(2.0 * cutter.corner_radius * allowance)
    sag = SAG * (inputs.going.clearance - allowance)
    margins = Margins(BEYOND + reach, inputs.top + SAFE * cutter.radius, sag)
    return tour(plan.passes, sides, inputs.places, inputs.going, margins)


def _variant(inputs: WallInputs, name: str, planned: Planned, legs: tuple[Leg, ...], proof: Proof) -> Variant:
    plan = planned.plan
    program = Program.join([leg.program for leg in legs])
    commands, found, seconds = _on_machine(inputs, program)
    maps = tuple(
        PassMap(p.side, inputs.coarse(inputs.side_numbers[p.side]).points, *inputs.places, p.depth, threshold)
        for p, threshold in zip(plan.passes, proof.thresholds, strict=True)
    )
    return Variant(
        name,
        planned.order,
        planned.passes_otherwise,
        planned.deflection,
        maps,
        program,
        commands,
        found,
        seconds,
        proof.columns,
        proof.finish,
        proof.shape,
        plan.force_max,
        plan.deflection_max,
        _infeasible(inputs, plan, planned.deflection) if name == "variable" else (),
        proof.stress,
    )


def _on_machine(inputs: WallInputs, program: Program) -> tuple[Commands, tuple[str, ...], float]:
    """The axes, what the machine does not give, and the time [s]."""
    machine: Machine = inputs.machine
    lengths = {inputs.cutter.number: inputs.cutter.overhang}
    commands, findings = to_axes(program, machine, tool_lengths=lengths)
    axes = axes_of(commands, machine)
    broken = [*check_program(program, machine), *limit_findings(machine, axes, commands.line, placed=False)]
    broken = [f for f in broken if f.code != "machine-offset"]
    _, seconds = line_times(Reading(commands, program, axes, findings, ()), machine)
    return commands, tuple(f.text for f in broken), float(seconds.sum())


def _infeasible(inputs: WallInputs, plan: Plan, held: float) -> tuple[Help, ...]:
    """Places that bear not even the smallest depth in some pass under the limit itself, with what would help there."""
    if not plan.infeasible:
        return ()
    least: dict[tuple[int, int, int], float] = {}
    for p in plan.passes:
        force = p.threshold.force.reshape(p.low.shape)
        for side, i, j in plan.infeasible:
            if side == p.side:
                key = (side, i, j)
                least[key] = min(least.get(key, math.inf), float(force[i, j]))
    keys = sorted(least)
    limits = inputs.law.limits
    plane = float(normal_force(inputs.posture, inputs.material, [limits.smallest], measure=inputs.measure)[0])
    share = plane / float(inputs.law.forces[0])  # what helps is asked of plane stock
    if inputs.experiments is None:  # the plan may be held to less than the limit
        least = {key: force * inputs.deflection / held for key, force in least.items()}
    found = largest_depths(
        inputs.posture, inputs.material, [share * least[k] for k in keys], limits, measure=inputs.measure
    )
    out = []
    for one in found.infeasible:
        side, i, j = keys[one.place]
        x, y, z = inputs.coarse(inputs.side_numbers[side]).points[i, j].tolist()
        out.append(Help(side, (x, y, z), one.threshold / share, one.force / share, one.feed_per_tooth, one.diameter))
    return tuple(out)


def _noticed(inputs: WallInputs) -> tuple[str, ...]:
    """What asks more of the coefficients than they were measured for, and what the experiments' reader noticed."""
    speed = inputs.going.spindle * inputs.cutter.radius * math.sin(inputs.posture.beta)
    found = beyond(inputs.material, inputs.posture.feed_per_tooth, speed)
    return (*found, *(str(f) for f in inputs.noticed))


def _provenance(job: WallJob, inputs: WallInputs) -> dict[str, Any]:
    files: dict[str, Path] = {"job": job.path}
    named = {"machine": job.machine, "material": job.material, "threshold": job.threshold_file}
    files |= {k: v for k, v in named.items() if isinstance(v, Path)}
    files |= {f"section {k}": f for k, f in enumerate(job.section_files)}
    files |= {f"cutter {k}": job.path.parent / c.file for k, c in enumerate(job.table.cutter) if c.file is not None}
    machine, material = inputs.machine, inputs.material
    return {
        "inputs": hashes(files),
        "overrides": list(job.overrides),
        "machine": f"{machine.name}: {machine.note}" if machine.note else machine.name,
        "material": {
            "name": material.name,
            "workpiece": material.workpiece,
            "source": material.source,
            "conditions": material.conditions,
        },
        "workpiece": job.table.workpiece.model_dump(),
        "threshold": inputs.finished_bears().text,
        "versions": versions(),
    }


__all__ = ["look_at_wall", "run_wall", "verdict"]
