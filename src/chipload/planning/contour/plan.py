"""Plan of a contour: semi-finishing and finishing by several strategies.

Notation: R cutter radius, s radial depth of the finish pass, a* = arccos(1 - s/R) its engagement angle along a line,
f0 the programmed feed; planning frame as in :mod:`.offsets`.

Reference: [Uddin2007]; `forward` [Stori2000].
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.cutting.rigid import OF_DEPTH, OF_FEED
from chipload.cutting.wall_error import Milling
from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region
from chipload.geometry.distance import distance
from chipload.geometry.offset import offset
from chipload.machine.machine import Machine
from chipload.number_text import number_text
from chipload.planning.contour.backward import concave_kinks, leading_curve
from chipload.planning.contour.blend import ease_arcs
from chipload.planning.contour.compare import FinishPasses, compare_strategies, programmed_feeds
from chipload.planning.contour.forward import forward_pass
from chipload.planning.contour.moves import Speeds, pass_program, speeds
from chipload.planning.contour.offsets import Walls, centre_paths, mirror_contour, run_on, walls_of
from chipload.planning.contour.passes import (
    ContourPass,
    boundary,
    rough_stock,
    run_on_length,
    semifinish_paths,
    start_at_widest,
    surface,
    with_leads,
)
from chipload.planning.contour.sampled import SampledPass, mirrored_pass, sample_pass, stations
from chipload.planning.contour.schedule import LEAST_SHARE, straight_force
from chipload.planning.contour.totals import cleared_percent, counts, elapsed_time
from chipload.planning.cost import CutConditions, cost, stack_histories
from chipload.planning.hand import clockwise_milling, engagement_of_hand, signed_speed
from chipload.planning.link_rows import row_ends, with_links
from chipload.planning.result import Columns, Event, OperationResult, StrategyResult
from chipload.program.motions import lengths
from chipload.program.program import Program
from chipload.progress import Progress, silent

#: strategies that a contour compares
STRATEGIES = ("plain", "backward", "feed")
#: stock that the cutter leaves in a joint is reported from this on [mm]
OVERSHOOT_MM = 1e-4
#: engagement of a semi-finish pass above a* that is reported [deg]
OVERSHOOT_DEG = 0.05


@dataclass(frozen=True)
class Finishing:
    """Parameters of a contour; mm, mm/s, rad/s.

    Parameters
    ----------
    side : `inside`, `outside`, `left`, `right`: where the cutter runs
    milling : `down` or `up`
    strategies : among `plain`, `backward`, `feed`; or `forward` alone
    use : the strategy whose program is released
    joint : `sharp` or `clothoid`
    radial_depth : s of the finish pass
    axial_depth : depth of cut
    semifinish_depth : radial depth that the semi-finish pass takes on a straight wall
    passes : semi-finish passes before the finish pass, or passes of `forward`
    feed : f0 of the centre [mm/s]
    spindle_speed : [rad/s]
    tolerance : how far eased joints may leave the drawn contour, and what a cutter may leave in a corner
    step : of the history, and of the forward method
    lead : radius of the quarter circles in and out, length of run-on and run-off of open chains
    top, clearance : z of the stock's top, height of rapids above it
    rigid : deflection over feed per tooth and over radial depth up to which the rigid model holds
    """

    side: str
    milling: Milling
    strategies: tuple[str, ...]
    use: str
    joint: str
    radial_depth: float
    axial_depth: float
    semifinish_depth: float
    passes: int
    feed: float
    spindle_speed: float
    tolerance: float
    step: float
    lead: float
    top: float
    clearance: float
    rigid: tuple[float, float] = (OF_FEED, OF_DEPTH)

    def engagement(self, radius: float) -> float:
        """a* [rad] for a cutter of radius R.

        Raises
        ------
        InputError
            s is 2 R or more: the cutter would leave a wall behind it.
        """
        if not 0.0 < self.radial_depth < 2.0 * radius:
            raise InputError(
                f"operation.radial_depth_mm = {self.radial_depth:g}: must be above 0 and below the cutter's "
                f"diameter_mm = {2.0 * radius:g}: take several passes"
            )
        return math.acos(1.0 - self.radial_depth / radius)


@dataclass(frozen=True, eq=False)
class _Job:
    """What all strategies of one operation share."""

    setting: Finishing
    cut: CutConditions
    machine: Machine
    limits: Mapping[str, float]
    walls: Walls
    finish: tuple[Contour, ...]
    deviation: float
    events: tuple[Event, ...]

    @property
    def radius(self) -> float:
        return self.cut.cutter.radius

    @property
    def flip(self) -> bool:
        return clockwise_milling(self.setting.milling, self.cut.cutter) == "up"


def plan_contour(
    contours: Sequence[Contour],
    setting: Finishing,
    cutter: Cutter,
    material: Material,
    machine: Machine,
    limits: Mapping[str, float],
    progress: Progress = silent,
) -> OperationResult:
    """Plan the strategies of ``setting`` on drawn ``contours``; ``limits`` as in :data:`chipload.planning.cost.LIMITS`.

    Raises
    ------
    InputError
        The contour, the cutter and the depths do not go together; the message states where, and the remedy.
    """
    job = _prepare_job(contours, setting, cutter, material, machine, limits)
    a = setting.engagement(cutter.radius)
    if setting.strategies == ("forward",):
        only, _ = _strategy(job, "forward", _forward_passes(job, a))
        return OperationResult("forward", "forward", {"forward": only})
    results, finish = {}, {}
    for k, name in enumerate(setting.strategies):
        progress(k / len(setting.strategies), f"contour, {name}")
        results[name], finish[name] = _strategy(job, name, _passes(job, a if name == "backward" else None))
    if len(finish) > 1:
        equal = compare_strategies(finish, setting.use, job.cut, setting.feed, machine)
        results = {name: replace(r, summary={**r.summary, **equal[name]}) for name, r in results.items()}
    progress(1.0, "contour")
    return OperationResult("contour", setting.use, results)


def check_contour(
    contours: Sequence[Contour], setting: Finishing, cutter: Cutter, material: Material, machine: Machine
) -> int:
    """Lay out the passes as :func:`plan_contour` does, without sampling them: how many passes there are.

    Raises
    ------
    InputError
        As :func:`plan_contour`.
    """
    job = _prepare_job(contours, setting, cutter, material, machine, {})
    _stock(job)
    if setting.strategies == ("forward",):
        return len(job.walls.walls) * setting.passes
    a = setting.engagement(cutter.radius)
    return sum(len(_passes(job, a if name == "backward" else None)) for name in setting.strategies)


def _prepare_job(
    contours: Sequence[Contour],
    setting: Finishing,
    cutter: Cutter,
    material: Material,
    machine: Machine,
    limits: Mapping[str, float],
) -> _Job:
    """The walls and the finish path of an operation."""
    radius = cutter.radius
    a = setting.engagement(radius)
    cut = CutConditions(cutter, material, setting.axial_depth, setting.spindle_speed, setting.milling, *setting.rigid)
    milling = clockwise_milling(setting.milling, cutter)
    walls = walls_of(contours, setting.side, milling, run_on_length(radius, setting.lead, setting.passes))
    if setting.strategies == ("forward",):
        return _Job(setting, cut, machine, limits, walls, (), 0.0, ())
    finish = tuple(start_at_widest(p) for p in centre_paths(walls, radius, setting.tolerance))
    deviation, events = 0.0, []
    if setting.joint == "clothoid":
        easings = [ease_arcs(p, radius, a, setting.tolerance) for p in finish]
        finish = tuple(start_at_widest(e.path) for e in easings)
        deviation = max(e.deviation_mm for e in easings)
        events = [x for e in easings for x in e.events]
    return _Job(setting, cut, machine, limits, walls, finish, deviation, tuple(events))


def _rough(job: _Job) -> tuple[Contour, ...]:
    """The surface that roughing left: parallel to the walls at all that the passes take."""
    away = _depth(job) - job.radius
    return offset(job.finish, away) if away != 0.0 else job.finish


def _depth(job: _Job) -> float:
    """What all passes take on a straight wall [mm]."""
    return job.setting.passes * job.setting.radial_depth + job.setting.semifinish_depth


def _stock(job: _Job) -> Region:
    """What the first motion meets, in the work frame."""
    rough = _rough(job) if job.finish else job.walls.extended
    return Region(tuple(_back(c, job.flip) for c in rough_stock(job.walls, rough, _stock_depth_in_part(job)).contours))


def _stock_depth_in_part(job: _Job) -> float:
    """Depth of the considered stock inside the part [mm]."""
    return 0.5 * job.radius + (0.0 if job.finish else job.setting.passes * job.setting.radial_depth)


def _clearing_totals(job: _Job, planar: list[ContourPass]) -> dict[str, float]:
    """What the passes clear; nothing of those into the material, which make a wall of their own."""
    if not job.finish:
        return {}
    stock, depth = rough_stock(job.walls, _rough(job), _stock_depth_in_part(job)), _depth(job)
    return {"cleared_percent": cleared_percent(stock, job.walls, _stock_depth_in_part(job), depth, planar, job.radius)}


def _passes(job: _Job, a: float | None) -> list[ContourPass]:
    """Semi-finish passes and the finish pass, outermost first; ``a``: by the backward method, else parallel."""
    setting, radius = job.setting, job.radius
    paths = [job.finish]
    for k in range(1, setting.passes + 1):
        before = semifinish_paths(paths[0], job.walls, radius, k * setting.radial_depth, a)
        paths.insert(0, tuple(start_at_widest(p) for p in before))
    stock = boundary(_rough(job))
    out = []
    for k, group in enumerate(paths):
        later = setting.passes - k
        name = "semifinish" if later else "finish"
        ahead = 0.0 if a is None else later * radius * math.sin(a)
        out += [with_leads(name, path, stock, job.walls, radius, setting.lead, later, ahead) for path in group]
        if name != "finish":
            stock = boundary(surface(group, radius))
    return out


def _forward_passes(job: _Job, a: float) -> list[ContourPass]:
    """Passes into the material from the drawn contours, each on the surface of the one before."""
    setting, radius = job.setting, job.radius
    out = []
    for wall in job.walls.extended:
        old = start_at_widest(wall)
        for k in range(setting.passes):
            run = forward_pass(old, radius, a, setting.step)
            stock = boundary([old])
            old = run.surface()
            path = run.path()
            if run.event is not None:
                out.append(ContourPass("forward", path, None, None, stock, run.event))
                break
            later, behind = (
                setting.passes - 1 - k,
                k * radius * math.sin(a),
            )  # each pass starts R sin a* before the last
            around = Walls((old,), (old,), job.walls.run_on)
            out.append(with_leads("forward", path, stock, around, radius, setting.lead, later, -behind))
    return out


def _strategy(job: _Job, name: str, planar: list[ContourPass]) -> tuple[StrategyResult, FinishPasses]:
    """Sample, cost and program the passes of one strategy; also its finish passes, as they are compared."""
    setting = job.setting
    runs = [mirrored_pass(p, job.flip) for p in planar]
    z, safe_z = setting.top - setting.axial_depth, setting.top + setting.clearance
    wanted = setting.engagement(job.radius)
    histories: list[Columns] = []
    programs: list[Program] = []
    clocks: list[tuple[SampledPass, Speeds]] = []
    for run in runs:
        steps = sample_pass(run, job.radius, setting.step)
        steps = replace(steps, engagement=engagement_of_hand(steps.engagement, job.cut.cutter))
        regulated = wanted if name == "feed" and run.name == "finish" else None
        speed = speeds(steps, programmed_feeds(steps, job.cut, setting.feed, job.machine, regulated), job.machine)
        makes_wall = (steps.zone == run.name) | (steps.zone == "closing")
        own = cost(
            job.cut, steps.zone, steps.s, speed.time, steps.centre, steps.heading, z, steps.engagement, speed.reached,
            makes_wall,
        )  # fmt: skip
        histories.append(with_links(own, safe_z))
        clocks.append((steps, speed))
        programs.append(
            pass_program(
                run,
                steps,
                speed.programmed,
                z,
                safe_z,
                signed_speed(setting.spindle_speed, job.cut.cutter),
                job.cut.cutter.number,
            )
        )
    program = Program.join(programs)
    history = {**stack_histories(histories), "t_s": _pass_times(programs, clocks, row_ends(program, job.machine))}
    on_wall = np.isin(history["pass"], ["finish", "forward"])
    events = (*job.events, *_events(job, runs, history, name))
    if name == "backward":
        events = (*events, *_semifinish_overshoots(job, histories))
    if name == "feed":
        events = (*events, *_force_above(job, history, on_wall))
    drawn = {
        "stock before": _stock(job).contours,
        "wall" if job.finish else "old surface": tuple(_back(w, job.flip) for w in job.walls.walls),
        "semifinish path": tuple(r.path for r in runs if r.name == "semifinish"),
        "finish path": tuple(r.path for r in runs if r.name != "semifinish"),
        "stock": tuple(Contour(c.segments) for r in runs if r.name != "semifinish" for c in _chains(r.stock.segments)),
    }
    summary = {**_summary(job, name, history, on_wall), **counts(len(runs), history), **_clearing_totals(job, planar)}
    finish = [steps for run, (steps, _) in zip(runs, clocks, strict=True) if run.name == "finish"]
    done = StrategyResult(name, program, history, summary, events, on_wall, drawn)
    return done, FinishPasses(tuple(finish), wanted if name == "feed" else None)


def _pass_times(
    programs: list[Program], clocks: list[tuple[SampledPass, Speeds]], ends: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(n,) time [s] of the steps of all passes and their link rows, from that at the ends of the program's rows.

    A pass is a rapid, the way down, its path, and the way up. Within a row of the path time goes as the speed that the
    step was planned with.
    """
    out, first = [], 0
    for program, (steps, speed) in zip(programs, clocks, strict=True):
        last = first + len(program) - 1
        travel = np.concatenate([[0.0], np.cumsum(lengths(program)[2:-1])])
        own = np.interp(travel, steps.s, speed.time)
        clock = ends[first + 1 : last]
        out.append(np.concatenate([clock[:1], np.interp(speed.time, own, clock), ends[last : last + 1]]))
        first = last + 1
    return np.concatenate(out)


def _back(contour: Contour, flip: bool) -> Contour:
    return mirror_contour(contour).reversed() if flip else contour


def _chains(seg: NDArray[np.float64]) -> list[Contour]:
    """Contours of a boundary's rows, cut where one does not follow the other."""
    cut = np.flatnonzero(np.hypot(*(seg[1:, 0:2] - seg[:-1, 2:4]).T) > 1e-6) + 1
    return [Contour(part) for part in np.split(seg, cut)]


def _summary(job: _Job, name: str, history: Columns, on_wall: NDArray[np.bool_]) -> dict[str, object]:
    def span(column: str) -> dict[str, float]:
        values = history[column][on_wall]
        return {"min": float(values.min()), "max": float(values.max())}

    wanted = math.degrees(job.setting.engagement(job.radius))
    finish = np.isin(history["pass"], ["finish", "forward", "closing"])
    error = history["form_error_signed_um"][on_wall]
    return {
        "engagement_deg": {**span("engagement_deg"), "wanted": wanted},
        "force_xy_n": span("force_xy_n"),
        "force_xy_mean_n": {
            "min": float(np.hypot(history["force_x_mean_n"], history["force_y_mean_n"])[on_wall].min()),
            "max": float(np.hypot(history["force_x_mean_n"], history["force_y_mean_n"])[on_wall].max()),
        },
        "torque_nm": span("torque_nm"),
        "form_error_um": {
            "max": float(history["form_error_um"][on_wall].max()),
            "signed_min": float(error.min()),
            "signed_max": float(error.max()),
        },
        "feed_mm_min": span("feed_mm_min"),
        "force_straight_n": straight_force(job.cut, math.radians(wanted), job.setting.feed),
        "time_s": float(history["t_s"][-1]),
        "finish_time_s": float(elapsed_time(history, finish)),
        "path_mm": float(history["s_mm"][-1]),
        "deviation_mm": job.deviation,
    }


def _events(job: _Job, runs: list[ContourPass], history: Columns, name: str) -> list[Event]:
    """What the passes could not keep: no room for leads, stock too thin for the method, broken boundaries."""
    out = [r.stopped for r in runs if r.stopped is not None]
    for r in runs:
        if r.lead_in is None and r.stopped is None:
            x, y = r.path.start
            out.append(Event("lead-none", x, y, f"{r.name}: no room to lead in: the cutter enters on the wall"))
    unknown = history["arcs"] < 0
    if unknown.any():
        k = int(np.flatnonzero(unknown)[0])
        out.append(
            Event(
                "engagement-unknown",
                float(history["x_mm"][k]),
                float(history["y_mm"][k]),
                f"the stock's boundary is broken here: engagement unknown in {int(unknown.sum())} steps",
                failure=True,
            )
        )
    return out + (_thin_stock(job, runs) + _overshoots(job, runs) if name == "backward" else [])


def _overshoots(job: _Job, runs: list[ContourPass]) -> list[Event]:
    """Joints of the finish path where the cutter cannot make the surface that constant engagement needs."""
    out = []
    wanted = job.setting.engagement(job.radius)
    surface = np.vstack([r.stock.segments for r in runs if r.name == "finish"])
    for path in job.finish:
        lead = leading_curve(path, job.radius, wanted)
        points, turn = concave_kinks(lead)
        if job.flip:
            points = points * [1.0, -1.0]
        left = distance(surface, points)
        for (x, y), gap, delta in zip(points.tolist(), left, np.degrees(turn), strict=True):
            if gap > OVERSHOOT_MM:
                out.append(
                    Event(
                        "joint-overshoot",
                        x,
                        y,
                        f"the stock would need a kink of {delta:.3f} deg here; the cutter leaves {1e3 * gap:.2f} µm in "
                        "it, and the engagement overshoots: joint = clothoid removes it",
                    )
                )
    return out


def _semifinish_overshoots(job: _Job, histories: list[Columns]) -> list[Event]:
    """The greatest engagement of every semi-finish pass but the first that rises above a*, one event a pass.

    Each pass back raises the curvature of O*, until a cutter of radius R cannot make that surface. The
    finish pass has its own events.
    """
    wanted = math.degrees(job.setting.engagement(job.radius))
    out = []
    for number, h in enumerate(histories, start=1):
        at = np.flatnonzero(h["pass"] == "semifinish")
        if number <= len(job.finish) or not len(at):
            continue
        k = at[h["engagement_deg"][at].argmax()]
        highest = float(h["engagement_deg"][k])
        if highest > wanted + OVERSHOOT_DEG:
            text = (
                f"semi-finish pass {number} of {len(histories) - len(job.finish)}: the engagement rises to "
                f"{highest:.4g} deg here, {wanted:.4g} deg are required: the cutter cannot make the surface that "
                "constant engagement requires of the preceding pass"
            )
            out.append(Event("semifinish-overshoot", float(h["x_mm"][k]), float(h["y_mm"][k]), text))
    return out


def _force_above(job: _Job, history: Columns, on_wall: NDArray[np.bool_]) -> list[Event]:
    """Where no feed down to the least keeps the force of a straight wall: the edge force does not know the feed."""
    straight = straight_force(job.cut, job.setting.engagement(job.radius), job.setting.feed)
    force = np.where(on_wall, history["force_xy_n"], 0.0)
    k = int(force.argmax())
    if force[k] <= 1.005 * straight:
        return []
    text = (
        f"no feed down to {LEAST_SHARE:.0%} of feed_mm_min holds the force of a straight wall, "
        f"{number_text(straight)} N: "
        f"{number_text(force[k])} N here, mostly edge force, which does not depend on the feed"
    )
    return [Event("feed-least", float(history["x_mm"][k]), float(history["y_mm"][k]), text)]


def _thin_stock(job: _Job, runs: list[ContourPass]) -> list[Event]:
    """Where a reshaped surface lies outside the stock that roughing left, so that the pass after it meets less."""
    rough = job.setting.passes * job.setting.radial_depth + job.setting.semifinish_depth
    beyond = job.setting.passes * job.radius  # P* of an open chain runs ahead of it by R sin a* a pass
    made = (run_on(c, beyond) for c in surface(job.finish, job.radius))
    wall = np.vstack([_back(c, job.flip).segments for c in made])
    worst, place = 0.0, (0.0, 0.0)
    for r in runs[len(job.finish) :]:
        points = np.vstack([c.at(stations(c, job.setting.step))[0] for c in _chains(r.stock.segments)])
        depth = distance(wall, points)
        k = int(depth.argmax())
        if depth[k] > worst:
            worst, place = float(depth[k]), (float(points[k, 0]), float(points[k, 1]))
    if worst <= rough + 1e-6:
        return []
    return [
        Event(
            "stock-thin",
            *place,
            f"constant engagement needs {worst:.4g} mm of stock on the wall here, roughing leaves {rough:.4g} mm: "
            f"raise semifinish_depth_mm by {worst - rough:.4g}",
            failure=True,
        )
    ]
