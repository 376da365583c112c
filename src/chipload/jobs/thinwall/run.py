"""A job that cuts a thin wall: three variants are planned, written for the machine, and simulated one after another."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.material import beyond
from chipload.errors import Finding, InputError, Severity
from chipload.jobs.checks import default_checks
from chipload.jobs.provenance import provenance_of, title_of
from chipload.jobs.thinwall.comparison import compensated, least_error
from chipload.jobs.thinwall.inputs import WallInputs, read_wall
from chipload.jobs.thinwall.job import ThinWallJob
from chipload.jobs.thinwall.outcome import (
    OVER,
    Help,
    PassMap,
    ThinWallResult,
    Variant,
    VariantPlan,
    WallGeometry,
    WallPlanning,
)
from chipload.jobs.thinwall.places import Places, places_of
from chipload.jobs.thinwall.proof import Proof, prove, resolution_of, wall_stock
from chipload.machine.limits import limit_findings
from chipload.machine.machine import Machine
from chipload.planning.thinwall.blank import SIDES
from chipload.planning.thinwall.correction import found
from chipload.planning.thinwall.depth import largest_depths, normal_force
from chipload.planning.thinwall.experiments import Proposal, propose_cuts
from chipload.planning.thinwall.force_table import ForceTable
from chipload.planning.thinwall.linking import Margins, PassProgram, link_passes
from chipload.planning.thinwall.passes import Plan, ThresholdOf
from chipload.planning.thinwall.variants import PlannedVariant as Planned
from chipload.planning.thinwall.variants import even, limited_to, unlimited
from chipload.program.check import check_program
from chipload.program.commands import Commands
from chipload.program.program import Program
from chipload.program.read import times_on
from chipload.program.to_axes import to_axes
from chipload.program.to_work import axes_of
from chipload.progress import Progress, silent
from chipload.result import Provenance
from chipload.simulation.chips import counted
from chipload.simulation.estimate import estimate

Floats = NDArray[np.float64]

#: of depths that are compared
VARIANTS = 3
#: share of the work that reading and planning is, for the progress
PLANNING = 0.05
#: plans of variable depths that are corrected by the simulation of the one before, and simulated
ROUNDS = 3
#: simulated at most, where none of those holds
TRIES = 6
#: these are held to this share of what would just do
HOLD = 0.97
#: share of the limit that a plan is to use; one that uses less is raised to this share of it, with its error, and
#: simulated, in so many turns at most
USED_SHARE, FULL, RAISES = 0.95, 0.99, 4
#: a plan is worth another simulation if it takes at most this share of the best one's time
FASTER = 0.97
#: constant depths that are simulated at most, until one holds
CONSTANTS = 3
#: safe height of the tip over the wall, in radii of the cutter
SAFE = 1.5
#: links sag by this share of their distance to the stock
SAG = 0.3
#: rows run on beyond the edges of the wall by so many [mm], over the reach of the corner in its stock
BEYOND = 1.0


def run(job: ThinWallJob, progress: Progress = silent) -> ThinWallResult:
    """Plan the three variants of a job, write their programs and simulate them.

    Raises
    ------
    InputError
        A file cannot be read, values do not go together, or the machine does not reach a place.
    Cancelled
        By ``progress``.
    """
    inputs = read_wall(job)
    _thick_enough(inputs)
    tried = _Tried(places_of(inputs), progress)
    free = tried.prove(_unlimited(tried.places), 0.25)
    constant, corrections = _constant(tried, free)
    variable = _variable(tried, corrections, constant)
    made = {"variable": variable, "constant": constant, "unconstrained": free, **_compared(tried, variable, constant)}
    progress(1.0, "proved")
    body, finished = inputs.stock_mesh(), inputs.finished_mesh()
    text = inputs.finished_threshold()
    settings: dict[str, Any] = {k: v for k, v in job.operation.model_dump().items() if v is not None}
    settings |= {
        "gouge_tolerance_mm": inputs.gouge_tolerance,
        "yield_mpa": job.table.workpiece.yield_mpa,
        "simulated_tries": tried.variable,
    }
    if job.table.dynamics is not None:
        settings["dynamics"] = job.table.dynamics.model_dump()
    cut = inputs.cut
    return ThinWallResult(
        title=title_of(job.path),
        geometry=WallGeometry(
            shape=inputs.body.shape,
            allowance=inputs.body.allowance,
            stock=(np.asarray(body.vertices), np.asarray(body.faces)),
            finished=(np.asarray(finished.vertices), np.asarray(finished.faces)),
        ),
        planning=WallPlanning(
            cutter=cut.cutter,
            machine=cut.machine,
            threshold_source=text.source,
            threshold_text=text.text,
            reserve=job.operation.reserve,
            step_over=abs(cut.step_over),
            feed_per_tooth=cut.posture.feed_per_tooth,
        ),
        limits=job.limits,
        unchecked=job.unchecked,
        variants=made,
        findings=_findings(inputs),
        settings=settings,
        checks=default_checks(job.table.checks, {cut.cutter.number: cut.cutter}, cut.material, 0.5),
        provenance=_provenance(job, inputs),
    )


def _thick_enough(inputs: WallInputs) -> None:
    """Refuse a finished wall that is thinner than what is cut off it at once."""
    thickness, deepest = inputs.body.shape.size()[2], min(inputs.depths.law.limits.greatest, max(inputs.body.allowance))
    if not thickness >= deepest:
        raise InputError(
            f"wall: {thickness:.4g} mm thick where it is thinnest, thinner than a cut of {deepest:g} mm: state less "
            "operation.0.depth_max_mm, or a thicker wall"
        )


def check(job: ThinWallJob) -> tuple[list[str], bool]:
    """What the job names: the wall, its finite elements, the greatest threshold, and the steps of the first variant,
    which is laid out but not simulated.

    Raises
    ------
    InputError
        As :func:`run`.
    """
    inputs = read_wall(job)
    _thick_enough(inputs)
    places = places_of(inputs)
    legs = _linked(inputs, _unlimited(places).plan, places.grid)
    program = Program.join([leg.program for leg in legs])
    _on_machine(inputs, program)
    wall_stock(inputs)
    count = counted(program, {inputs.cut.cutter.number: inputs.cut.cutter}, resolution_of(inputs, legs))
    length, height, thickness = inputs.body.shape.size()
    nodes = len(inputs.body.wall.solid.grid.nodes)
    bearing, law = inputs.finished_threshold(), inputs.depths.law
    lines = [
        *map(str, _findings(inputs)),
        f"{job.path.name}: {inputs.body.shape.name}: {length:.4g} mm long, {height:.4g} mm high, at least "
        f"{thickness:.4g} mm thick; {len(inputs.body.wall.solid.grid.elements)} elements, {nodes} nodes",
        f"threshold of the finished side {SIDES[inputs.body.side_numbers[0]]}, {bearing.source}: "
        f"{bearing.force.min():.4g} to {bearing.force.max():.4g} N; normal force {law.forces[0]:.4g} N at "
        f"{law.depths[0]:g} mm, {law.forces[-1]:.4g} N at {law.depths[-1]:g} mm",
        f"{VARIANTS} variants or more; the unconstrained one: {estimate(count, 0)}",
    ]
    return lines, True


def propose(
    job: ThinWallJob, sites: int, scatter: float, bracket: float, steps: int, repeats: int, progress: Progress = silent
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
    inputs = read_wall(job)
    inputs = replace(inputs, depths=replace(inputs.depths, experiments=None))
    u, v = np.meshgrid(*inputs.body.places, indexing="ij")
    points = inputs.coarse(inputs.body.side_numbers[0]).points.reshape(-1, 3)
    places = np.column_stack([u.ravel(), v.ravel()])
    modelled = inputs.finished_threshold().force.ravel()
    return propose_cuts(
        places, points, modelled, inputs.depths.law, sites, scatter, bracket=bracket, steps=steps, repeats=repeats,
        progress=progress,
    )  # fmt: skip


class _Tried:
    """Plans that are simulated one after another; how far that is, is told on the way."""

    def __init__(self, places: Places, progress: Progress) -> None:
        self.places, self.progress = places, progress
        self.done = PLANNING
        self.variable = 0
        self.planned: dict[str, Planned] = {}
        self.corrections: tuple[Floats, ...] = ()
        self.share = 1.0

    def prove(self, planned: Planned, share: float) -> Variant:
        """Write and simulate a plan, which takes this share of what is left to do."""
        name, low = planned.plan.name, self.done
        width = share * (1.0 - low)
        self.variable += name == "variable"
        legs = _linked(self.places.inputs, planned.plan, self.places.grid)
        program = Program.join([leg.program for leg in legs])
        run = _on_machine(self.places.inputs, program)
        proof = prove(
            self.places, planned.plan, legs, run.times, lambda p, w: self.progress(low + width * p, f"{name}: {w}")
        )
        self.done = low + width
        return _variant(self.places, planned, program, run, proof)


def _unlimited(places: Places) -> Planned:
    inputs = places.inputs
    return unlimited(
        places.surfaces, places.threshold(inputs.depths.deflection, inputs.depths.factor), inputs.depths.even_law
    )


def _thresholds(places: Places, share: float) -> ThresholdOf:
    """Thresholds that allow a share of the deflection limit, or of measured forces."""
    depths = places.inputs.depths
    if depths.experiments is None:
        return places.threshold(share * depths.deflection, depths.factor)
    return places.threshold(depths.deflection, share * depths.factor)


def _room(one: Variant) -> tuple[float, float]:
    """Error of the normal force of a variant, and the share of the limit that leaves room for it; no room is left for
    an error that is not known.
    """
    error = one.load_error["force_normal_n"]
    error = error if math.isfinite(error) else 0.0
    return error, 1.0 / (1.0 + error)


def _over(one: Variant, modelled: bool, assumed: float) -> tuple[float, bool]:
    """Greatest F_n over F_th with the errors that the limit is checked with, and whether the limit holds; the error of
    the loads is ``assumed`` where the limit does not hold with that.
    """
    most = 1.0 if modelled else 1.0 + OVER
    over = one.over_with_error(modelled, assumed)
    if over > most or len(one.over):
        return over, False
    over = one.over_with_error(modelled)
    return over, over <= most


def _constant(tried: _Tried, free: Variant) -> tuple[Variant, tuple[Floats, ...]]:
    """The constant depth that the simulation of the greatest one lets expect, corrected until it holds; and the
    corrections of the force in even stock that the greatest one gave.
    """
    places = tried.places
    inputs, law = places.inputs, places.inputs.depths.even_law
    modelled = inputs.depths.experiments is None
    assumed, share = _room(free)
    at_most = _measured(places, free, law, tuple(np.ones(places.shape) for _ in places.surfaces))
    corrections = at_most
    for turn in range(CONSTANTS):
        held = share * inputs.depths.deflection if modelled else inputs.depths.deflection
        planned = even(places.surfaces, _thresholds(places, share), law, held, corrections)
        constant = tried.prove(planned, 0.4)
        if turn == CONSTANTS - 1 or _smallest(places, planned) or _over(constant, modelled, assumed)[1]:
            break
        measured = _measured(places, constant, law, corrections)
        corrections = tuple(np.maximum(c, m) for c, m in zip(corrections, measured, strict=True))
    return constant, at_most


def _smallest(places: Places, planned: Planned) -> bool:
    """Whether the passes are as thin as they may be."""
    return max(float(p.depth.max()) for p in planned.plan.passes) <= places.inputs.depths.law.limits.smallest * (
        1.0 + 1e-9
    )


def _variable(tried: _Tried, corrections: tuple[Floats, ...], like: Variant) -> Variant:
    """Variable depths within the limit: planned, simulated, corrected by what was found. Of the plans that hold the
    fastest one; where none does, the one that exceeds least.

    Parameters
    ----------
    corrections : of the law's forces, to begin with
    like : whose error of the loads is expected
    """
    places = tried.places
    inputs = places.inputs
    modelled, held = inputs.depths.experiments is None, inputs.depths.deflection
    best: Variant | None = None
    least: list[tuple[float, Variant]] = []  # of those that exceed, the one that exceeds least
    assumed, share = _room(like)
    raised = False
    for turn in range(TRIES):
        planned = limited_to(
            places.surfaces, _thresholds(places, share), inputs.depths.law, inputs.depths.slope, share * held,
            corrections,
        )  # fmt: skip
        if best is not None and not raised and _seconds(places, planned) > FASTER * best.seconds:
            break
        one = tried.prove(planned, 0.4)
        over, good = _over(one, modelled, assumed)
        if good and (best is None or one.seconds < best.seconds):
            best, tried.planned["variable"], tried.corrections, tried.share = one, planned, corrections, share
        elif not good:
            least = [min([*least, (over, one)], key=lambda pair: pair[0])]
        used = best is not None and (not modelled or best.over_with_error(modelled) >= USED_SHARE)
        if best is not None and turn >= ROUNDS - 1 and (used or turn >= RAISES):
            break
        measured = _measured(places, one, inputs.depths.law, corrections)
        if not good:
            measured = tuple(np.maximum(c, m) for c, m in zip(corrections, measured, strict=True))
            share *= HOLD / over if turn >= ROUNDS - 1 and math.isfinite(over) else 1.0
        # what is left of the limit is used
        raised = good and not used
        share *= FULL / over if raised else 1.0
        corrections = measured
    if best is not None:
        return best
    tried.planned["variable"], tried.corrections, tried.share = planned, corrections, share
    return least[0][1]


def _compared(tried: _Tried, variable: Variant, constant: Variant) -> dict[str, Variant]:
    """Variants that the job asks for beside the three."""
    places, op, out = tried.places, tried.places.inputs.job.operation, {}
    if op.least_error:
        out["least_error"] = least_error(
            places, _thresholds(places, tried.share), tried.corrections, constant.seconds,
            lambda planned: _seconds(places, planned), lambda planned: tried.prove(planned, 0.4),
        )  # fmt: skip
    if op.compensate_um is not None:
        out["compensated"] = compensated(
            places,
            tried.planned["variable"],
            variable,
            1e-3 * op.compensate_um,
            lambda planned: tried.prove(planned, 0.4),
        )
    return out


def _seconds(places: Places, planned: Planned) -> float:
    """Time of a plan on the machine."""
    legs = _linked(places.inputs, planned.plan, places.grid)
    return float(_on_machine(places.inputs, Program.join([leg.program for leg in legs])).times.sum())


def _measured(places: Places, one: Variant, law: ForceTable, before: tuple[Floats, ...]) -> tuple[Floats, ...]:
    """Corrections of the law by what a variant was found to do; where it did nothing, those before."""
    c = one.columns
    cut = (c["force_normal_n"] > 0.0) & (c["depth_mm"] >= law.limits.smallest * (1.0 - 1e-9))
    out = []
    for side, old in enumerate(before):
        k = np.flatnonzero(cut & (c["side"] == side))
        new = found(places.grid, c["u"][k], c["v"][k], c["force_normal_n"][k] / law.force(c["depth_mm"][k]))
        out.append(np.where(np.isnan(new), old, new))
    return tuple(out)


def _linked(inputs: WallInputs, plan: Plan, places: tuple[Floats, Floats] | None = None) -> tuple[PassProgram, ...]:
    """The way of a plan at these places, u and v; None: those of the elements."""
    sides = [inputs.fine(s) for s in inputs.body.side_numbers]
    cutter = inputs.cut.cutter
    allowance = max(inputs.body.allowance)
    reach = math.sqrt(2.0 * cutter.corner_radius * allowance)
    sag = SAG * (inputs.cut.pass_motion.clearance - allowance)
    margins = Margins(BEYOND + reach, inputs.top + SAFE * cutter.radius, sag)
    return link_passes(plan.passes, sides, places or inputs.body.places, inputs.cut.pass_motion, margins)


def _variant(places: Places, planned: Planned, program: Program, run: _OnMachine, proof: Proof) -> Variant:
    plan = planned.plan
    maps = tuple(
        PassMap(
            p.side,
            places.surfaces[p.side].points,
            *places.grid,
            p.depth,
            threshold,
            None if p.threshold.depth is None else p.threshold.depth.reshape(p.depth.shape),
            p.threshold.speed,
        )
        for p, threshold in zip(plan.passes, proof.thresholds, strict=True)
    )
    return Variant(
        plan.name,
        VariantPlan(
            planned.order,
            planned.passes_otherwise,
            planned.deflection,
            maps,
            plan.force_max,
            plan.deflection_max,
            _infeasible(places, plan, planned.deflection) if plan.name == "variable" else (),
        ),
        program,
        run.commands,
        run.exceeding,
        float(run.times.sum()),
        proof.columns,
        proof.finish,
        proof.shape,
        proof.stress,
        proof.find_load_error,
    )


@dataclass(frozen=True, eq=False)
class _OnMachine:
    """A program on the machine: the axes, the time of each row of the tip [s], what the machine does not give."""

    commands: Commands
    times: Floats
    exceeding: tuple[Finding, ...]


def _on_machine(inputs: WallInputs, program: Program) -> _OnMachine:
    """What the axes do for a program."""
    machine: Machine = inputs.cut.machine
    lengths = {inputs.cut.cutter.number: inputs.cut.cutter.overhang}
    commands, _ = to_axes(program, machine, tool_lengths=lengths)
    axes = axes_of(commands, machine)
    broken = [*check_program(program, machine), *limit_findings(machine, axes, commands.line, placed=False)]
    exceeding = tuple(replace(f, severity=Severity.EXCEEDS) for f in broken if f.code != "machine-offset")
    return _OnMachine(commands, times_on(program, machine, lengths), exceeding)


def _infeasible(places: Places, plan: Plan, held: float) -> tuple[Help, ...]:
    """Places that bear not even the smallest depth in some pass under the limit itself, with what would help there."""
    if not plan.infeasible:
        return ()
    inputs = places.inputs
    least: dict[tuple[int, int, int], float] = {}
    for p in plan.passes:
        force = p.threshold.force.reshape(p.low.shape)
        for side, i, j in plan.infeasible:
            if side == p.side:
                key = (side, i, j)
                least[key] = min(least.get(key, math.inf), float(force[i, j]))
    keys = sorted(least)
    limits = inputs.depths.law.limits
    plane = float(
        normal_force(inputs.cut.posture, inputs.cut.material, [limits.smallest], measure=inputs.cut.measure)[0]
    )
    share = plane / float(inputs.depths.law.forces[0])  # what helps is asked of plane stock
    if inputs.depths.experiments is None:  # the plan may be held to less than the limit
        least = {key: force * inputs.depths.deflection / held for key, force in least.items()}
    shares = [share / float(plan.corrections[side][i, j]) for side, i, j in keys]
    asked = largest_depths(
        inputs.cut.posture,
        inputs.cut.material,
        [s * least[k] for s, k in zip(shares, keys, strict=True)],
        limits,
        measure=inputs.cut.measure,
    )
    out = []
    for one in asked.infeasible:
        side, i, j = keys[one.place]
        x, y, z = places.surfaces[side].points[i, j].tolist()
        s = shares[one.place]
        out.append(Help(side, (x, y, z), one.threshold / s, one.force / s, one.feed_per_tooth, one.diameter))
    return tuple(out)


def _findings(inputs: WallInputs) -> tuple[Finding, ...]:
    """What asks more of the coefficients than they were measured for, and what the experiments' reader noticed."""
    speed = inputs.cut.pass_motion.spindle * inputs.cut.cutter.radius * math.sin(inputs.cut.posture.beta)
    asked = beyond(inputs.cut.material, inputs.cut.posture.feed_per_tooth, speed)
    beyond_range = (Finding("chip-beyond-coefficients", 0, text, Severity.UNPROVEN) for text in asked)
    return (*beyond_range, *inputs.findings)


def _provenance(job: ThinWallJob, inputs: WallInputs) -> Provenance:
    files: dict[str, Path] = {}
    named = {"machine": job.machine, "material": job.material, "threshold": job.threshold_file}
    files |= {k: v for k, v in named.items() if isinstance(v, Path)}
    files |= {f"section {k}": f for k, f in enumerate(job.section_files)}
    files |= {f"cutter {k}": job.path.parent / c.file for k, c in enumerate(job.table.cutter) if c.file is not None}
    return provenance_of(files, job.overrides, inputs.cut.machine, (inputs.cut.material,))
