"""The cut of a program in a clamped workpiece, and the torque that the workpiece allows along it.

Notation: o the override; D(o) = D_e + D_c o greatest distance over a revolution by which workpiece and cutter part
along the normal of the surface that a step leaves, anywhere on its contact line (their whole deflection where it leaves
two surfaces that face each other), W(o) deflection of the workpiece in any direction, F(o) greatest force, g greatest
stress of the workpiece per force. All are convex in o, so between 0 and 1 the straight line lies above them.

Compliance is that of the state of removal of each step, which no feed changes. It is known to a share e: the limit is
made for compliance and stress (1 + e) times as great. Stress is calculated in the steps that bend the workpiece most
and in those with most force; the greatest g among them counts everywhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.checking.workpiece import Stock
from chipload.checking.workpiece_compliance import WorkpieceCompliance, workpiece_compliance
from chipload.control.linuxcnc.path import ToolPath
from chipload.control.wall import (
    LimitedResponse,
    Loads,
    PathLimit,
    WallPath,
    edge_and_cut,
    limit_by_responses,
    row_means,
    two_parts,
)
from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.jobs.simulation.tables import SolidTable
from chipload.jobs.simulation.values import stock_of, workpiece_of
from chipload.jobs.tables import require_stated
from chipload.jobs.torque.allowable import path_of, relief_of
from chipload.jobs.torque.confidence import limit_at_confidence
from chipload.jobs.torque.cut import (
    LITTLE_MPA,
    CutSteps,
    edge_material,
    feed_rows,
    require_linear,
    resolution_in_stock,
    step_feeds,
    step_points,
    surprise_factors,
    torque_of_cuts,
)
from chipload.jobs.torque.job import TorqueJob
from chipload.jobs.torque.tables import SurpriseTable
from chipload.machine.machine import Machine
from chipload.program.program import Program
from chipload.progress import Progress, part_of, silent
from chipload.simulation.chips import remove_with_edge
from chipload.simulation.deflection import contacts, step_deflections, tip_deflections
from chipload.simulation.removal import Removal
from chipload.stock.layers import LayeredStock
from chipload.structure.spindle import Bar, tool_bars

Floats = NDArray[np.float64]

#: angle between two rotations at which forces are calculated [rad]
ROTATION = math.radians(1.0)


@dataclass(frozen=True, eq=False)
class TwoParts:
    """A quantity of n steps in two parts, by the edge and in proportion to the feed: (n,) float each."""

    edge: Floats
    cut: Floats

    def times(self, edge: Floats, cut: Floats) -> TwoParts:
        """The quantity with other factors of both parts, (n,) each."""
        return TwoParts(self.edge * edge, self.cut * cut)


@dataclass(frozen=True, eq=False)
class WorkpieceCut(CutSteps):
    """Cutting data of the steps of a program in a workpiece; the force of its loads is the greatest of each step.

    Parameters
    ----------
    error : D of each step [mm]
    whole : deflection of workpiece and cutter in any direction [mm]
    work : W, that of the workpiece alone [mm]
    compliance : of the workpiece through the removal
    strained : g [MPa/N]
    """

    error: TwoParts
    whole: TwoParts
    work: TwoParts
    compliance: WorkpieceCompliance
    strained: float


@dataclass(frozen=True, eq=False)
class AllowableWorkpiece:
    """Planned cut, real cut, and the allowable torque of the workpiece.

    Parameters
    ----------
    planned, real : what is cut; the same where no [real_stock] is stated
    loads : of the real cut, with a worn cutter and hard spots
    factors : (n,) of the parts of the edge and of the feed, by these
    limit : of torque, from the workpiece alone
    torque : the limit that is kept [N mm], the least of that and the stated one; 0: not attainable
    true_limit : what the workpiece would allow as it really is
    path : with what is planned and what is true
    """

    planned: WorkpieceCut
    real: WorkpieceCut
    loads: Loads
    factors: tuple[Floats, Floats]
    limit: PathLimit
    torque: float
    true_limit: PathLimit
    path: ToolPath

    @property
    def walls(self) -> tuple[WallPath, ...]:
        """For the form error, the stress, the whole deflection, and that of the workpiece alone."""
        s, one, real = self.path.model.s, np.ones(len(self.real.feed)), self.real
        known = [x.times(*self.factors) for x in (real.error, real.whole, real.work)]
        error, whole, work = (WallPath(s, row_means(x.edge), row_means(x.cut), one) for x in known)
        force = (row_means(self.loads.force_edge), row_means(self.loads.force_cut))
        return error, WallPath(s, *force, np.full(len(one), real.strained)), whole, work


def stock_of_workpiece(job: TorqueJob, solid: SolidTable) -> Stock:
    """The stock of the workpiece, in layers as thick as the simulation states; those of an earlier result stay."""
    stock = stock_of(solid.model_copy(update={"layer_mm": None}), job.path.parent)
    return stock if isinstance(stock.body, LayeredStock) else Stock(stock.body, job.table.simulation.layer_mm)


def workpiece_cut(
    job: TorqueJob,
    solid: SolidTable,
    program: Program,
    material: Material,
    rapids: float,
    progress: Progress = silent,
) -> WorkpieceCut:
    """Simulate the program in the stock of the workpiece, with the material and with its edge alone.

    Parameters
    ----------
    rapids : feed of the rapids between two cuts [mm/s]

    Raises
    ------
    InputError
        The program cuts nothing, the tip stands, the material has a size effect, or the clamps leave a rigid motion.
    """
    require_linear(material)
    stock = stock_of_workpiece(job, solid).layered(program, job.cutters)
    fine, elastic = resolution_in_stock(job, program), workpiece_of(require_stated(job.workpiece, "workpiece"))
    known = workpiece_compliance(
        elastic, program, stock, job.cutters, material, fine, progress=part_of(progress, 0.0, 0.5)
    )
    if known.strained is None:
        raise InputError("stock: the program cuts nothing from the workpiece: check its corners and the work offset")
    removal, less = remove_with_edge(
        program, stock, job.cutters, material, edge_material(material), fine, progress=part_of(progress, 0.5, 1.0)
    )
    little, rows = LITTLE_MPA / material.Ktc, feed_rows(removal)
    c, light = removal.columns, less.columns
    bars = {number: tool_bars(cutter) for number, cutter in job.cutters.items()}
    whole = deflections(removal, material, known, bars)
    edge = deflections(less, edge_material(material), known, bars)
    error, all_of_it, work = (
        TwoParts(*edge_and_cut(a[rows], b[rows], little)) for a, b in zip(whole, edge, strict=True)
    )
    loads = two_parts(
        torque_of_cuts(removal, material)[rows], c["force_n"][rows],
        torque_of_cuts(less, edge_material(material))[rows], light["force_n"][rows], little,
    )  # fmt: skip
    return WorkpieceCut(
        removal, stock, step_points(removal, program), step_feeds(removal, rapids), loads, error, all_of_it, work,
        known, float(known.strained.per_force.max()),
    )  # fmt: skip


def deflections(
    removal: Removal, material: Material, known: WorkpieceCompliance, bars: dict[int, tuple[Bar, ...]]
) -> tuple[Floats, Floats, Floats]:
    """D, the whole deflection, and W of each row of a removal, (n,) [mm]; 0 where nothing is cut."""
    n = len(removal.columns["line"])
    whole, work = np.zeros(n), np.zeros(n)
    for cuts in removal.cuts:
        found = tip_deflections(cuts, material, bars=bars[cuts.tool], work=known.steps.at(cuts.step), rotation=ROTATION)
        whole[cuts.step] = 1e-3 * found["deflection_um"]
        work[cuts.step] = 1e-3 * found["deflection_workpiece_um"]
    place = contacts(removal)
    soft, error = known.steps.at(place.step), np.zeros(n)
    for station in np.moveaxis(soft, 1, 0):
        found = step_deflections(removal, material, place, work=station, bars=bars, rotation=ROTATION)
        np.maximum(error, found["deflection_mm"], out=error)
    facing = place.step[~place.normal.any(axis=1)]
    error[facing] = whole[facing]
    return error, whole, work


def responses_of(
    job: TorqueJob, cut: WorkpieceCut, factors: tuple[Floats, Floats] | None = None, margin: Floats | float = 0.0
) -> list[LimitedResponse]:
    """Limited responses of a cut by the limits of the job.

    Parameters
    ----------
    factors : (n,) of the parts of the edge and of the feed
    margin : (n,) or a number, share by which compliance and stress count as greater
    """
    limits, ones = job.table.limits, np.ones(len(cut.feed))
    e, c = factors or (ones, ones)
    e, c = (1.0 + margin) * e, (1.0 + margin) * c
    most = 1e-3 * limits.form_error_um
    strength = limits.strength_share * require_stated(
        require_stated(job.workpiece, "workpiece").yield_mpa, "workpiece.yield_mpa"
    )
    force = TwoParts(cut.loads.force_edge, cut.loads.force_cut)
    out = [
        ("deflection", cut.error, most),
        ("strength", force.times(cut.strained * ones, cut.strained * ones), strength),
    ]
    if limits.deflection_workpiece_um is not None:
        out.append(("workpiece deflection", cut.work, 1e-3 * limits.deflection_workpiece_um))
    return [LimitedResponse(name, x.edge * e, x.cut * c, most) for name, x, most in out]


def limit_on_workpiece(loads: Loads, responses: list[LimitedResponse]) -> PathLimit:
    """Allowable torque of a workpiece along a program.

    Raises
    ------
    InputError
        No feed changes anything.
    """
    found = limit_by_responses(loads, responses)
    if found is None:
        raise InputError("stock: the program cuts nothing from the workpiece that a feed would change: check the stock")
    return found


def planned_limit(job: TorqueJob, planned: WorkpieceCut, material: Material) -> tuple[PathLimit, Floats]:
    """Allowable torque along the plan with the forces at the confidence of the checks, and the (n,) share by which the
    responses count as greater for it.
    """
    wider = 1.0 + planned.compliance.error
    limit, factors = limit_at_confidence(
        job, planned, material,
        lambda x: limit_on_workpiece(planned.loads, responses_of(job, planned, margin=wider * x - 1.0)),
    )  # fmt: skip
    return limit, wider * factors - 1.0


def allowable_on_workpiece(
    job: TorqueJob, program: Program, material: Material, machine: Machine, progress: Progress = silent
) -> AllowableWorkpiece:
    """Simulate the cut in the planned and in the real stock, and find the torque limit.

    Raises
    ------
    InputError
        As :func:`workpiece_cut`; the real stock is not cut by the same steps.
    """
    table, half = job.table, part_of(progress, 0.0, 0.5)
    planned = workpiece_cut(job, require_stated(table.stock, "stock"), program, material, machine.rapid, half)
    real = planned
    if table.real_stock is not None:
        real = workpiece_cut(job, table.real_stock, program, material, machine.rapid, part_of(progress, 0.5, 1.0))
    factors = surprise_factors(len(real.feed), lambda x: _spot_distance(real, x), table.surprise)
    e, c = factors
    loads = Loads(
        real.loads.torque_edge * e, real.loads.torque_cut * c, real.loads.force_edge * e, real.loads.force_cut * c
    )
    limit, _ = planned_limit(job, planned, material)
    most = table.limits.torque_nm
    torque = limit.torque if most is None else min(limit.torque, 1e3 * most)
    return AllowableWorkpiece(
        planned, real, loads, factors, limit, torque, limit_on_workpiece(loads, responses_of(job, real, factors)),
        path_of(planned, loads, relief_of(limit, torque)),
    )  # fmt: skip


def real_stock_body(job: TorqueJob, program: Program) -> LayeredStock:
    """The real stock before the program."""
    solid = job.table.real_stock or require_stated(job.table.stock, "stock")
    return stock_of_workpiece(job, solid).layered(program, job.cutters)


def _spot_distance(cut: WorkpieceCut, x: SurpriseTable) -> Floats:
    """(n,) distance of the steps from the middle of a hard spot [mm]."""
    middle = 0.5 * (cut.points[1:] + cut.points[:-1])
    return np.asarray(np.linalg.norm(middle - np.array(require_stated(x.at_mm, "surprise.at_mm")), axis=1))
