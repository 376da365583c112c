"""Simulation of the program that a strategy writes: its text is read back and simulated from its first line to its end.

The text is read as a controller reads it and simulated by moves (:mod:`chipload.simulation.moves`) in the stock of the
operation, with the cutter and the machine of the job. The history of a strategy is that of this simulation: its limits,
its figures and its page show the whole program, entries and links included.

Engagement is the part of the front half of the cutter's circle that is in material: of level motions the greater of
those in the middle and at the end of the step, from the path of the centre; of others at any height of the flank, at
the instant of the step's greatest force.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.checking.default_checks import DefaultChecks
from chipload.checking.preparation import with_tool
from chipload.checking.stock_check import contact_findings
from chipload.checking.workpiece import insides, stock_box
from chipload.cutter.cutter import Cutter
from chipload.cutting.force import greatest_forces
from chipload.cutting.load_parts import LoadParts
from chipload.cutting.rigid import deflection_share
from chipload.cutting.strength import cutter_stress
from chipload.cutting.wall_error import Milling, greatest_wall_error
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.errors import Finding, Severity
from chipload.geometry.contour import Contour, Region
from chipload.geometry.distance import distance
from chipload.machine.machine import Machine
from chipload.planning.result import StrategyResult
from chipload.program.control import control_named
from chipload.program.gcode.blocks import comment
from chipload.program.program import Program
from chipload.program.read import ProgramReading, read_program, times_of
from chipload.program.setup import Setup
from chipload.progress import Progress
from chipload.report.programs import ENDINGS
from chipload.simulation.chips import remove
from chipload.simulation.engagement_samples import EngagementRecorder, EngagementSamples
from chipload.simulation.hand import reversed_cuts
from chipload.simulation.level_engagement import level_engagement
from chipload.simulation.loads import Cuts
from chipload.simulation.program_findings import ProgramSurroundings, program_findings
from chipload.simulation.ramp import ramp_angle
from chipload.simulation.removal import Resolution
from chipload.simulation.steps import StepBlocks
from chipload.stock.layers import LayeredStock
from chipload.stock.solid import prisms
from chipload.structure.spindle import chain_compliance, tool_bars

Floats = NDArray[np.float64]

#: chords leave the arcs of the stock by at most this [mm]: 0.006 deg of engagement at 13 deg, R = 5 mm
STOCK_CHORD_MM = 1e-4
#: tolerance of chords and outlines of the simulation [mm]
TOLERANCE_MM = 1e-3
#: side of a tile of the stock, in diameters of the cutter
TILE = 4.0
#: slices of a corner, and half as many of the engaged bottom
SLICES = 24
#: width of the stock around the path where no file states it, in radii of the cutter
AROUND = 2.0
#: a centre is at a wall where its distance from it is R within this [mm]
AT_WALL_MM = 0.02
#: passes that may be closed, and the name of the rows where one meets its own beginning
PASSES, CLOSING = ("semifinish", "finish", "forward"), "closing"
#: a slice whose normal has this sine with the axis, or more, is of the flank
FLANK = 0.5
#: a motion is level within this [mm]
LEVEL_MM = 1e-6
#: columns of :class:`CutColumns`
CUT_COLUMNS = (
    "engagement_deg", "force_xy_n", "deflection_cutter_um", "deflection_share", "cutter_stress_mpa", "ramp_deg",
    "form_error_um",
)  # fmt: skip
#: columns of the removal that the history does not keep
DROPPED = ("label", "seconds", "axis_x", "axis_y", "axis_z")


@dataclass(frozen=True, eq=False)
class SimulatedText:
    """A program as it was read back and simulated.

    Parameters
    ----------
    program : as it was read
    columns : (n,) each, a row for each step of the whole program
    findings : of the reader, of the machine's limits and of the simulation
    resolution_error : relative error of columns
    samples : tooth engagement of some steps; None: nothing is cut
    load_parts : other parts of the error of the worst loads, by tool and load
    stock : that remains; None: the stock of the operation is not stated
    """

    program: Program
    columns: Mapping[str, NDArray[Any]]
    findings: tuple[Finding, ...]
    resolution_error: Mapping[str, float]
    samples: EngagementSamples | None
    load_parts: Mapping[tuple[int, str], LoadParts] = field(default_factory=dict)
    stock: LayeredStock | None = None


@dataclass(frozen=True, eq=False)
class PlaneStock:
    """The stock of an operation: a region of the plane between two heights [mm]; None: a block around the path."""

    region: Region | None
    floor: float
    top: float

    @staticmethod
    def of(contours: Sequence[Contour], floor: float, top: float) -> PlaneStock:
        """The stock within closed contours; a block around the path where there are none."""
        return PlaneStock(Region(tuple(contours)) if contours else None, floor, top)

    def layers(self, program: Program, cutter: Cutter) -> LayeredStock:
        """The stock for a simulation of a program."""
        tile, deep = TILE * cutter.diameter, self.top - self.floor
        if self.region is None:
            low, high = program.p_work[:, :2].min(axis=0), program.p_work[:, :2].max(axis=0)
            room = AROUND * cutter.radius
            return LayeredStock.block([*(low - room), self.floor], [*(high + room), self.top], deep, tile)
        shape = Region.of(self.region.contours).flatten(STOCK_CHORD_MM)
        parts = [p for p in shapely.get_parts(shape) if p.area > 0.0]
        return LayeredStock.of_mesh(prisms([parts], np.array([self.floor, self.top])), deep, tile)


@dataclass(frozen=True, eq=False)
class CutColumns:
    """Columns of the steps of a cutter with a straight flank: engagement, forces in the plane, form error and checks.

    Parameters
    ----------
    checks : material, cutters and range of the rigid model
    milling : which side of the cut is the wall
    depth : greatest axial depth [mm]
    wall : that the program makes; a step whose centre is not R from it has no form error; empty: each step makes one
    """

    checks: DefaultChecks
    milling: Milling
    depth: float
    wall: Sequence[Contour]

    def __call__(self, cuts: Cuts) -> dict[str, Floats]:
        """Columns (c,) of the steps that cut."""
        cutter, material = cuts.cutter, self.checks.material
        peak = greatest_forces(cuts.engagement, cutter, material)
        force = np.hypot(peak["force_t"], peak["force_n"])
        tip = 1000.0 * float(chain_compliance(tool_bars(cutter), 0.0, 0.0))
        share = deflection_share(cuts.plain, tip * force, self.checks.of_feed, self.checks.of_depth)
        return {
            "engagement_deg": np.degrees(flank_engagement(cuts.plain)),
            "force_xy_n": force,
            "deflection_cutter_um": tip * force,
            "deflection_share": share,
            "cutter_stress_mpa": cutter_stress(cuts.engagement, cutter, material),
            "ramp_deg": ramp_angle(cuts),
            "form_error_um": self._form_error(cuts),
        }

    def _form_error(self, cuts: Cuts) -> Floats:
        """Form error (c,) [um] of the wall with its sign; 0 away from it and while the cutter rises or descends."""
        plain, cutter, out = cuts.plain, cuts.cutter, np.zeros(len(cuts))
        makes = np.abs(cuts.ends[:, 5] - cuts.ends[:, 2]) <= LEVEL_MM
        step = np.repeat(np.arange(len(cuts)), np.diff(plain.start))
        makes[step[plain.slices[plain.slice, 3] <= FLANK]] = False
        if self.wall and makes.any():
            away = distance(np.vstack([c.segments for c in self.wall]), cuts.ends[makes, 3:5])
            makes[makes] = np.abs(away - cutter.radius) <= AT_WALL_MM
        if makes.any() and not cutter.pitch:
            own = cuts.engagement.part(np.flatnonzero(makes))
            found = greatest_wall_error(own, cutter, self.checks.material, self.depth, milling=self.milling)
            out[makes] = found["form_error_signed_um"]
        return out


def flank_engagement(engagement: ToothEngagement) -> Floats:
    """Angle (n,) [rad] of the front half of the rim that is in material at any height of the flank.

    >>> from chipload.engagement.tooth_engagement import engagement_of_arcs
    >>> mill = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5)
    >>> flank_engagement(engagement_of_arcs([[0.0, 2.0]], [[1.0, 2.5]], 0.1, mill, 2.0)).tolist()
    [1.5]
    """
    rows, n = engagement.rows, len(engagement)
    flank = engagement.slices[engagement.slice, 3] > FLANK
    step = np.repeat(np.arange(n), np.diff(engagement.start))[flank]
    low, high = rows[flank, 0], rows[flank, 1]
    # the front half once more for ranges that go on behind a whole turn
    step = np.concatenate([step, step])
    low, high = np.concatenate([low, low - math.tau]), np.concatenate([high, high - math.tau])
    low, high = np.clip(low, 0.0, math.pi), np.clip(high, 0.0, math.pi)
    some = high > low
    step, low, high = step[some], low[some], high[some]
    order = np.lexsort((low, step))
    step, low, high = step[order], low[order], high[order]
    apart = 2.0 * math.tau * step
    reached = np.maximum.accumulate(np.concatenate([[-1.0], (high + apart)[:-1]])) if len(step) else np.zeros(0)
    new = np.maximum(high + apart - np.maximum(low + apart, reached), 0.0)
    return np.asarray(np.bincount(step, new, n), dtype=np.float64)


def simulate_text(
    text: str,
    name: str,
    machine: Machine,
    cutter: Cutter,
    stock: PlaneStock,
    columns: CutColumns,
    labels: Sequence[str],
    step_mm: float,
    progress: Progress,
) -> SimulatedText:
    """Read a program text back and simulate it.

    Parameters
    ----------
    text : of the whole program
    name : of its file, without ending
    stock : before its first line
    columns : of the steps, besides those of the removal
    labels : comments of the text that name what the motions belong to: the column ``pass``
    step_mm : longest step

    Raises
    ------
    InputError
        The text cannot be read or simulated.
    """
    cutters = {cutter.number: cutter}
    path = Path(f"{name}.{ENDINGS[machine.dialect]}")
    reading = read_program(path, machine, text=text, setup=Setup(cutters=cutters), strict=True)
    program, times = with_tool(reading.program, cutters), times_of(reading, machine)
    first = len(times) - len(program)
    times = np.concatenate([[times[: first + 1].sum()], times[first + 1 :]])
    recorder = EngagementRecorder(columns.checks.material)

    def watch(cuts: Cuts) -> dict[str, Floats]:
        return {**columns(cuts), **recorder(cuts)}

    fine = Resolution(step_mm, TOLERANCE_MM, SLICES, 0.5 * cutter.radius)
    body = stock.layers(program, cutter)
    around = ProgramSurroundings(
        insides(body), *stock_box(body), True, reading.stops, reading.retractions, reading.program
    )
    steps = StepBlocks(program, step_mm, TOLERANCE_MM)
    off = "shank_in_stock" in columns.checks.off
    contacts = () if off else contact_findings(program, steps, cutters, body, TOLERANCE_MM)
    removal = remove(
        program, body, cutters, columns.checks.material, fine, watch=watch, times=times,
        progress=progress,
    )  # fmt: skip
    found: dict[str, NDArray[Any]] = {k: v for k, v in removal.columns.items() if k not in DROPPED}
    zero = np.zeros(len(found["line"]))
    for column in CUT_COLUMNS:
        found.setdefault(column, zero)
    found["pass"] = labels_of_lines(text, labels, machine)[found["line"]]
    tips = np.column_stack([found[f"{x}_mm"] for x in "xyz"])
    before = np.vstack([program.p_work[:1], tips[:-1]])
    both = np.stack([0.5 * (before + tips), tips], axis=1).reshape(-1, 3)
    level = level_engagement(program, cutter.radius, stock.region, stock.top, both, workers=2).reshape(-1, 2)
    cuts = ~np.isnan(level[:, 1]) & ~found["rapid"]
    level = np.where(cuts[:, None], np.fmax(level, level[:, 1:]), 0.0)
    found["engagement_deg"] = np.where(cuts, level.max(axis=1), found["engagement_deg"])
    most = level.max(axis=0, initial=0.0)
    errors = {**removal.resolution_error, "engagement_deg": float(np.ptp(most) / most.max()) if most.any() else 0.0}
    findings = (
        *_findings(reading),
        *contacts,
        *(replace(f, severity=Severity.EXCEEDS) if f.code == "rapid-cuts" else f for f in removal.findings),
        *reversed_cuts(steps, removal.columns, cutters),
        *program_findings(program, steps, removal.columns, cutters, around),
    )
    left = None if stock.region is None else body
    return SimulatedText(program, found, findings, errors, recorder.samples(), removal.load_parts, left)


def _findings(reading: ProgramReading) -> tuple[Finding, ...]:
    """What the reader finds that is more than a note; a violation of the machine exceeds."""
    return (
        *(f for f in reading.findings if f.severity > Severity.NOTE),
        *(replace(f, severity=Severity.EXCEEDS) for f in reading.violations),
    )


def labels_of_lines(text: str, labels: Sequence[str], machine: Machine) -> NDArray[np.object_]:
    r"""Label of each line of a text, from line 0: that of the last comment that is one of ``labels``; else link.

    >>> from chipload.machine.machine import machine_named
    >>> labels_of_lines("(link)\nG0 X1\n(finish)\nG1 X2", ["link", "finish"], machine_named("vmc")).tolist()
    ['link', 'link', 'link', 'finish', 'finish']
    """
    numbered = control_named(machine.dialect).text.program_number
    names = {comment(label, numbered): label for label in labels}
    out, now = ["link"], "link"
    for line in text.splitlines():
        now = names.get(line.strip(), now)
        out.append(now)
    return np.array(out, dtype=object)


def with_closing(columns: Mapping[str, NDArray[Any]], planned: Mapping[str, NDArray[Any]]) -> NDArray[np.object_]:
    """The column ``pass`` of a simulated program with `closing` where a closed pass meets its own beginning.

    It is as long, from the end of each pass, as in the planned history.
    """
    out = np.asarray(columns["pass"]).copy()
    for name in PASSES:
        own, plan = _runs(out == name), _runs(np.isin(planned["pass"], [name, CLOSING]))
        plan = [run for run in plan if (planned["pass"][run] == name).any()]
        for run, before in zip(own, plan, strict=False) if len(own) == len(plan) else ():
            closing = planned["pass"][before] == CLOSING
            if closing.any():
                length = float(planned["s_mm"][before][-1] - planned["s_mm"][before][closing].min())
                s = columns["s_mm"][run]
                out[run][s > s[-1] - length] = CLOSING
    return out


def _runs(where: NDArray[np.bool_]) -> list[slice]:
    """Stretches of a mask (n,) that are true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(np.int8)))
    return [slice(a, b) for a, b in zip(edges[0::2].tolist(), edges[1::2].tolist(), strict=True)]


def simulated_strategy(strategy: StrategyResult, simulated: SimulatedText) -> StrategyResult:
    """A strategy with the history of its simulated program in place of the planned one, and the totals that follow."""
    planned = strategy.history
    columns = {**simulated.columns, "pass": with_closing(simulated.columns, planned)}
    walls = np.isin(columns["pass"], np.unique(planned["pass"][strategy.wall_rows].astype(str)))
    summary = dict(strategy.summary)
    for name in ("engagement_deg", "force_xy_n", "torque_nm"):
        own = columns[name][walls & (columns[name] > 0.0)]
        if len(own) and isinstance(summary.get(name), Mapping):
            summary[name] = {**summary[name], "min": float(own.min()), "max": float(own.max())}
    error = columns["form_error_um"][walls]
    if len(error):
        summary["form_error_um"] = {
            "max": float(np.abs(error).max()), "signed_min": float(error.min()), "signed_max": float(error.max())
        }  # fmt: skip
    summary["time_s"] = float(columns["t_s"][-1])
    return replace(strategy, history=columns, wall_rows=walls, summary=summary)
