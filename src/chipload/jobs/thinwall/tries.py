"""Plans of a thin wall, simulated one after another until one holds with the errors of its limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chipload.checking.load_budget import bounded_factors
from chipload.jobs.kept_parts import KeptRecords
from chipload.jobs.thinwall.comparison import compensate_passes, least_error
from chipload.jobs.thinwall.kept_proofs import RECORDS, kept_proof
from chipload.jobs.thinwall.outcome import OVER, Help, PassMap, Variant, VariantPlan
from chipload.jobs.thinwall.places import Places, rows_up
from chipload.jobs.thinwall.proof import Proof, prove
from chipload.jobs.thinwall.wall_operation import DepthRules
from chipload.jobs.thinwall.wall_program import OnMachine, link_pass_programs, on_machine
from chipload.planning.thinwall.correction import greatest_ratios
from chipload.planning.thinwall.depth import largest_depths, normal_force
from chipload.planning.thinwall.pass_program import PassProgram
from chipload.planning.thinwall.passes import Plan, ThresholdOf, WallPass
from chipload.planning.thinwall.variants import DepthOperation, even, limited_to, plan_without_limit
from chipload.planning.thinwall.variants import PlannedVariant as Planned
from chipload.program.program import Program
from chipload.progress import Progress
from chipload.simulation.continued import KnownRemoval

Floats = NDArray[np.float64]
#: of the forces of each operation, side by side, (n, m) at the places
Corrections = tuple[tuple[Floats, ...], ...]

#: share of the work that reading and planning is, for the progress
PLANNING = 0.05
#: plans of variable depths that are corrected by the simulation of the one before, and simulated
ROUNDS = 3
#: simulated at most, where none of those holds
TRIES = 6
#: these keep this share of what would just hold
HOLD = 0.97
#: share of the limit that a plan is to use; one that uses less is raised to this share of it, with its error, and
#: simulated, in so many turns at most
USED_SHARE, FULL, RAISES = 0.95, 0.99, 4
#: a plan is worth another simulation if it takes at most this share of the best one's time
FASTER = 0.97
#: greatest number of constant depths that are simulated
CONSTANTS = 3


class Tried:
    """Plans that are simulated one after another, with their progress; those that begin as the variable one, as far as
    it is found, continue from its simulation.
    """

    def __init__(self, places: Places, progress: Progress, keep: KeptRecords | None = None) -> None:
        self.places, self.progress = places, progress
        self.keep = keep or KeptRecords(None, "", RECORDS)
        self.done = PLANNING
        self.variable = 0
        self.planned: dict[str, Planned] = {}
        self.proved: list[tuple[Program, Planned, tuple[PassProgram, ...]]] = []
        self.corrections: Corrections = ()
        self.share = 1.0
        self.last: KnownRemoval | None = None
        self.first_passes: KnownRemoval | None = None
        self._written: list[tuple[Sequence[WallPass], tuple[Program, tuple[PassProgram, ...], OnMachine]]] = []

    def written(self, planned: Planned) -> tuple[Program, tuple[PassProgram, ...], OnMachine]:
        """Return the program of a plan, its passes, and it on the machine; those of the last two plans are kept, of
        which one may be the best so far.
        """
        known = next((one for passes, one in self._written if passes is planned.plan.passes), None)
        if known is None:
            pass_programs = link_pass_programs(self.places.inputs, planned.plan, self.places.grid)
            program = Program.join([one.program for one in pass_programs])
            known = program, pass_programs, on_machine(self.places.inputs, program)
            self._written = [*self._written[-1:], (planned.plan.passes, known)]
        return known

    def seconds(self, planned: Planned) -> float:
        """Return the time of a plan on the machine."""
        return float(self.written(planned)[2].times.sum())

    def prove(self, planned: Planned, share: float) -> Variant:
        """Write and simulate a plan, which takes this share of the remaining progress."""
        name, low = planned.plan.name, self.done
        width = share * (1.0 - low)
        self.variable += name == "variable"
        program, pass_programs, run = self.written(planned)
        proof = kept_proof(
            self.keep,
            planned.plan,
            lambda: prove(
                self.places,
                planned.plan,
                pass_programs,
                run.times,
                lambda p, w: self.progress(low + width * p, f"{name}: {w}"),
                before=self.first_passes,
            ),
        )
        self.last = proof.removal
        self.done = low + width
        self.proved.append((program, planned, pass_programs))
        return _variant(self.places, planned, program, run, proof)

    def prove_text(self, one: Variant, read: Program, times: Floats) -> Variant:
        """Return a variant as the simulation of its written text finds it.

        Parameters
        ----------
        one : as it was planned and simulated
        read : its text as it was read back, with the lines of its program
        times : (n,) float [s], time of each row of it on the machine
        """
        planned, pass_programs = next((p, own) for program, p, own in self.proved if program is one.program)
        proof = kept_proof(
            self.keep,
            replace(planned.plan, name=f"text of {one.name}"),
            lambda: prove(
                self.places,
                planned.plan,
                pass_programs,
                times,
                lambda p, w: self.progress(self.done + (1.0 - self.done) * p, f"text of {one.name}: {w}"),
                read,
            ),
        )
        run = OnMachine(one.commands, times, one.beyond)
        return _variant(self.places, planned, one.program, run, proof)


def unlimited_plan(places: Places) -> Planned:
    """Passes of the greatest depth, without the limit of the wall."""
    operations = [
        DepthOperation(places.threshold(o.depths.deflection, o.depths.factor), o.depths.even_law, o.leave)
        for o in places.inputs.operations
    ]
    return plan_without_limit(places.surfaces, operations)


def _depth_operations(places: Places, share: float, corrections: Corrections, even_stock: bool) -> list[DepthOperation]:
    """The operations with thresholds that allow a share of the deflection limit, and the law of even stock or not."""
    return [
        DepthOperation(
            _thresholds(places, o.depths, share),
            o.depths.even_law if even_stock else o.depths.law,
            o.leave,
            o.depths.slope,
            c,
            o.table.contact == "flank",
            o.table.contact == "end",
        )
        for o, c in zip(places.inputs.operations, corrections, strict=True)
    ]


def _thresholds(places: Places, depths: DepthRules, share: float) -> ThresholdOf:
    """Thresholds that allow a share of the deflection limit, or of measured forces."""
    if depths.experiments is None:
        return places.threshold(share * depths.deflection, depths.factor)
    return places.threshold(depths.deflection, share * depths.factor)


def _room(one: Variant) -> tuple[float, float]:
    """Error of the normal force of a variant, and the share of the limit that leaves room for it and for what the force
    may be at the confidence of the checks where it is greatest; no room is left for an error that is not known.
    """
    error = one.load_error["force_normal_n"]
    error = error if math.isfinite(error) else 0.0
    worst = int(np.argmax(one.columns["force_over_allowable"] * one.plan.at_confidence))
    more = float(np.broadcast_to(one.plan.at_confidence, one.columns["force_over_allowable"].shape)[worst])
    return error, 1.0 / ((1.0 + error) * more)


def _overload(one: Variant, modelled: bool, assumed: float) -> tuple[float, bool]:
    """Greatest F_n over F_th with the errors that the limit is checked with, and whether the limit holds; the error of
    the loads is ``assumed`` where the limit does not hold with that.
    """
    most = 1.0 if modelled else 1.0 + OVER
    over = one.over_with_error(modelled, assumed)
    if over > most or len(one.over):
        return over, False
    over = one.over_with_error(modelled)
    return over, over <= most


def constant_within(tried: Tried, free: Variant) -> tuple[Variant, Corrections]:
    """Constant depth from the forces of the simulated greatest depth, corrected until it holds; and the corrections of
    the force in even stock from that simulation.
    """
    places = tried.places
    inputs = places.inputs
    modelled = inputs.depths.experiments is None
    assumed, share = _room(free)
    ones = tuple(np.ones(places.shape) for _ in places.surfaces)
    at_most = _measure_corrections(places, free, tuple(ones for _ in inputs.operations), even_stock=True)
    corrections = at_most
    for turn in range(CONSTANTS):
        deflection = share * inputs.depths.deflection if modelled else inputs.depths.deflection
        planned = even(places.surfaces, _depth_operations(places, share, corrections, True), deflection)
        constant = tried.prove(planned, 0.4)
        if turn == CONSTANTS - 1 or _smallest(places, planned) or _overload(constant, modelled, assumed)[1]:
            break
        corrections = _greater(corrections, _measure_corrections(places, constant, corrections, even_stock=True))
    return constant, at_most


def _smallest(places: Places, planned: Planned) -> bool:
    """Whether the passes are as thin as they may be."""
    laws = [o.depths.law for o in places.inputs.operations]
    return all(float(p.depth.max()) <= laws[p.operation].limits.smallest * (1.0 + 1e-9) for p in planned.plan.passes)


def variable_within(tried: Tried, corrections: Corrections, like: Variant) -> Variant:
    """Variable depths within the limit: planned, simulated, and corrected by the simulation. The result is the fastest
    plan that holds, or the first where the job does not ask for more; where none holds, the one that exceeds least.

    Parameters
    ----------
    corrections : of the law's forces, to begin with
    like : whose error of the loads is expected
    """
    places = tried.places
    inputs = places.inputs
    modelled, deflection = inputs.depths.experiments is None, inputs.depths.deflection
    refine = inputs.job.operation.refine
    best: Variant | None = None
    least: list[tuple[float, Variant]] = []  # of those that exceed, the one that exceeds least
    assumed, share = _room(like)
    raised = False
    for turn in range(TRIES):
        planned = limited_to(places.surfaces, _depth_operations(places, share, corrections, False), share * deflection)
        if best is not None and not raised and tried.seconds(planned) > FASTER * best.seconds:
            break
        one = tried.prove(planned, 0.4)
        over, good = _overload(one, modelled, assumed)
        if good and (best is None or one.seconds < best.seconds):
            best, tried.planned["variable"], tried.corrections, tried.share = one, planned, corrections, share
            tried.first_passes = tried.last
            if not refine:
                break
        elif not good:
            least = [min([*least, (over, one)], key=lambda pair: pair[0])]
        used = best is not None and (not modelled or best.over_with_error(modelled) >= USED_SHARE)
        if best is not None and turn >= ROUNDS - 1 and (used or turn >= RAISES):
            break
        measured = _measure_corrections(places, one, corrections, even_stock=False)
        if not good:
            measured = _greater(corrections, measured)
            share *= HOLD / over if (turn >= ROUNDS - 1 or not refine) and math.isfinite(over) else 1.0
        # what is left of the limit is used
        raised = good and not used and over > 0.0
        share *= FULL / over if raised else 1.0
        corrections = measured
    if best is not None:
        return best
    tried.planned["variable"], tried.corrections, tried.share = planned, corrections, share
    tried.first_passes = tried.last
    return least[0][1]


def compared_variants(tried: Tried, variable: Variant, constant: Variant) -> dict[str, Variant]:
    """Variants that the job states in addition to the three."""
    places, op, out = tried.places, tried.places.inputs.job.operation, {}
    if op.least_error:
        out["least_error"] = least_error(
            places, _depth_operations(places, tried.share, tried.corrections, False), constant,
            tried.seconds, lambda planned: tried.prove(planned, 0.4),
        )  # fmt: skip
    if op.compensate_um > 0.0:
        out["compensated"] = compensate_passes(
            places,
            tried.planned["variable"],
            variable,
            1e-3 * op.compensate_um,
            lambda planned: tried.prove(planned, 0.4),
        )
    return out


def _greater(one: Corrections, other: Corrections) -> Corrections:
    """The greater of two corrections at each place."""
    return tuple(tuple(map(np.maximum, a, b)) for a, b in zip(one, other, strict=True))


def _measure_corrections(places: Places, one: Variant, before: Corrections, *, even_stock: bool) -> Corrections:
    """Corrections of the laws by what a variant was found to do; where it did nothing, those before.

    The places of an operation are its own rows; those of the places are between them in proportion.
    """
    c, out = one.columns, []
    for number, (operation, own) in enumerate(zip(places.inputs.operations, before, strict=True)):
        law = operation.depths.even_law if even_stock else operation.depths.law
        cut = (c["force_normal_n"] > 0.0) & (c["depth_mm"] >= law.limits.smallest * (1.0 - 1e-9))
        cut &= c["operation"] == number
        v = rows_up(places.inputs, number)
        each = []
        for side, old in enumerate(own):
            k = np.flatnonzero(cut & (c["side"] == side))
            ratio = c["force_normal_n"][k] / law.force(c["depth_mm"][k])
            new = greatest_ratios((places.u, v), c["u"][k], c["v"][k], ratio)
            if operation.table.contact == "flank":  # no row is on the free edge: the one below reaches up to it
                new[:, -1] = new[:, -2]
            if len(v) != len(places.v):
                known = np.stack([np.interp(v, places.v, row) for row in old])
                new = np.where(np.isnan(new), known, new)
                new = np.stack([np.interp(places.v, v, row) for row in new])
            each.append(np.where(np.isnan(new), old, new))
        out.append(tuple(each))
    return tuple(out)


def _variant(places: Places, planned: Planned, program: Program, run: OnMachine, proof: Proof) -> Variant:
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
            p.operation,
        )
        for p, threshold in zip(plan.passes, proof.thresholds, strict=True)
    )
    inputs = places.inputs
    level = inputs.job.table.checks.confidence
    factors = bounded_factors(proof.columns, inputs.job.cutters, inputs.cut.material, level)
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
            factors,
        ),
        program,
        run.commands,
        run.exceeding,
        float(run.times.sum()),
        proof.columns,
        proof.find_surfaces,
        proof.find_load_error,
    )


def _infeasible(places: Places, plan: Plan, deflection: float) -> tuple[Help, ...]:
    """Places where even the smallest depth of some pass exceeds the limit itself, with changes that would help."""
    out: list[Help] = []
    for number in range(len(places.inputs.operations)):
        out += _infeasible_in(places, [p for p in plan.passes if p.operation == number], plan.infeasible, deflection)
    return tuple(out)


def _infeasible_in(
    places: Places, passes: Sequence[WallPass], infeasible: Sequence[tuple[int, int, int]], deflection: float
) -> list[Help]:
    """Those of one operation, by its passes."""
    inputs = places.inputs
    own = inputs.operations[passes[0].operation]
    least: dict[tuple[int, int, int], float] = {}
    correction: dict[tuple[int, int, int], float] = {}
    law = own.depths.law
    for p in passes:
        force = p.threshold.force.reshape(p.low.shape)
        for side, i, j in infeasible:
            if side == p.side and force[i, j] < p.correction[i, j] * law.forces[0]:
                key = (side, i, j)
                least[key] = min(least.get(key, math.inf), float(force[i, j]))
                correction[key] = float(p.correction[i, j])
    if not least:
        return []
    keys = sorted(least)
    limits = law.limits
    plane = float(normal_force(own.cut.posture, own.cut.material, [limits.smallest], measure=own.cut.measure)[0])
    share = plane / float(law.forces[0])  # remedies are calculated for plane stock
    if own.depths.experiments is None:  # the plan may be held to less than the limit
        least = {key: force * own.depths.deflection / deflection for key, force in least.items()}
    shares = [share / correction[key] for key in keys]
    largest = largest_depths(
        own.cut.posture,
        own.cut.material,
        [s * least[k] for s, k in zip(shares, keys, strict=True)],
        limits,
        measure=own.cut.measure,
    )
    out = []
    for one in largest.infeasible:
        side, i, j = keys[one.place]
        x, y, z = places.surfaces[side].points[i, j].tolist()
        s = shares[one.place]
        out.append(Help(side, (x, y, z), one.threshold / s, one.force / s, one.feed_per_tooth, one.diameter))
    return out
