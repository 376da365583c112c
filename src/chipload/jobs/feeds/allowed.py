"""Calculation of the greatest feed of each line from the engagement of its steps, and of the new F words.

Notation: a factor is the new feed over the programmed one, see :mod:`chipload.planning.feeds`. At another feed a step
cuts with the same tooth engagement and a chip thickness in proportion to the feed; runout is added afterwards. The new
text is read again and compared with the old program motion by motion: only the feeds may differ, by the wanted
factors. The caller proves the limits by simulating the new program from fresh stock.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.default_checks import DefaultChecks, peak_excess
from chipload.checking.drilling import with_drill_loads
from chipload.checking.load_budget import BUDGETED, factors_of_steps
from chipload.checking.program_text import has_blocks, text_with_feeds
from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import edge_lag
from chipload.cutting.load_parts import LoadParts, bounded_parts, load_parts
from chipload.cutting.material import Material
from chipload.cutting.strength import allowed_stress, cutter_stress
from chipload.engagement.tooth_surfaces import thickest_of_teeth
from chipload.jobs.feeds.division import Allowed, DividedProgram, divide_lines, undivided_program, whole_feeds
from chipload.jobs.feeds.outcome import FeedResult
from chipload.jobs.feeds.tables import FeedsTable
from chipload.jobs.feeds.verify import require_same, rubbing_lines, speeds_of, tooth_feeds
from chipload.machine.feed import row_time_limited
from chipload.machine.machine import Machine
from chipload.planning.feeds import (
    AIR,
    FASTEST,
    KEPT,
    LIMITED,
    MACHINE,
    SLOWEST,
    LineFeeds,
    StepContact,
    greatest_factor,
    line_feeds,
    steady_feeds,
)
from chipload.program.gcode.feed_words import DIGITS
from chipload.program.heidenhain import kept_feeds
from chipload.program.program import DWELL, RAPID, Program
from chipload.program.read import ProgramReading
from chipload.program.tapping import tapping_motions
from chipload.program.time import peak_speed, program_time
from chipload.result import column_of, error_of
from chipload.simulation.accuracy import AXIAL
from chipload.simulation.loads import Cuts, at_feeds, greatest_loads
from chipload.simulation.removal import Removal, Watch
from chipload.simulation.steps import Steps
from chipload.units import mm_s_from_mm_min

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: the limit, and the column, of the stress of a cutter
STRESS = "cutter_stress_mpa"
#: the thickest chip of a step
CHIP = "chip_max_mm"
#: angles kappa at which a chip with runout is evaluated, and halvings of the chip without runout
KAPPAS, HALVINGS = 41, 40
#: how often the parts of the errors of loads are calculated, each time at the feeds found before
PARTS_AGAIN = 2
#: lags of the edge at which its runout is evaluated
LAGS = 12
#: columns of the removal in which a watch states what each step allows
_FACTOR, _BY = "feed_factor", "feed_by"


@dataclass(frozen=True, eq=False)
class FeedRequest:
    """Requirements of the job on the new feeds.

    Parameters
    ----------
    table : keys of the job
    limits : by name, those that depend on the feed
    rotation : angle between two rotations at which the force is calculated [rad]
    checks : made by default; the stress of the cutters is a limit unless it is switched off
    errors : relative error of loads by the resolution of the simulation, by column; a load is at most its limit
        over 1 + error, so that the limit holds for any error up to this one
    more : watch that computes further columns in addition to the greatest loads; None: none
    """

    table: FeedsTable
    limits: Mapping[str, float]
    rotation: float
    checks: DefaultChecks
    errors: Mapping[str, float] = field(default_factory=dict)
    more: Watch | None = None

    @property
    def feed_limits(self) -> tuple[str, ...]:
        """Names of the limits that restrict the feed: ``limits``, then the stress of the cutter."""
        return (*self.limits, *(() if "cutter_strength" in self.checks.off else (STRESS,)))

    def factors(
        self, limit: str, parts: Mapping[str, Sequence[LoadParts]], loads: Mapping[str, Floats], bends: Floats
    ) -> Floats | float:
        """Return what the value of each step at the confidence of the checks is over the nominal one.

        Parameters
        ----------
        parts : of the errors of the loads of the steps
        loads : nominal, at the feeds that are tried
        bends : (c,) deflection over force [um/N] of the steps
        """
        column = column_of(limit).name
        if self.checks.confidence <= 0.5 or column not in BUDGETED:
            return 1.0 + self.error(limit)
        error, peaks, kind = error_of(column, self.errors), peak_excess(self.checks.material, column), BUDGETED[column]
        nominal = loads["torque_mean_nm" if kind == "power_w" else kind]
        return factors_of_steps(
            parts[kind], column, nominal, self.checks.confidence, error if math.isfinite(error) else 0.0, peaks,
            1e-3 * bends * loads["force_n"],
        )  # fmt: skip

    def error(self, limit: str) -> float:
        """Return the relative error of the column that a limit bounds, including the peak excess of the material.

        An error that is not finite counts as 0: no step has this load.
        """
        column = column_of(limit).name
        error = error_of(column, self.errors)
        peaks = peak_excess(self.checks.material, column)
        return (1.0 + (error if math.isfinite(error) else 0.0)) * (1.0 + peaks) - 1.0


def allowed_feed_watch(
    steps: Steps,
    request: FeedRequest,
    cutters: Mapping[int, Cutter],
    material: Material,
    machine: Machine,
    before: Mapping[str, NDArray[Any]],
) -> Watch:
    """Return a watch that computes, for each cutting step, the greatest feed factor within the limits and its cause.

    The cause is the limit that determines the factor. ``before`` are the columns at the programmed feeds. A watch
    receives the instant of a step with the greatest force. Where another instant has a greater torque, the loads are
    raised to it in the same ratio at every feed. :func:`_chip_of_instant` gives the thicker chip of another instant.
    """
    least, most, by = _bounds(steps, request.table, cutters, machine)

    def watch(cuts: Cuts) -> dict[str, Floats]:
        low, high = least[cuts.step], most[cuts.step]
        there = with_drill_loads(greatest_loads(cuts, material, request.rotation), cuts, material)
        beyond = {
            name: np.maximum(np.divide(before[name][cuts.step], x, out=np.ones(len(x)), where=x > 0.0), 1.0)
            for name, x in there.items()
            if name in before
        }
        chip = np.where(beyond.get(CHIP, 1.0) > 1.0, before[CHIP][cuts.step], 0.0) if CHIP in before else 0.0
        chip_at = _chip_of_instant(np.broadcast_to(chip, low.shape), cuts.cutter, cuts.engagement.slices[:, 3])

        force = np.asarray(before["force_n"])[cuts.step]
        deflection = (
            np.asarray(before["deflection_um"])[cuts.step] if "deflection_um" in before else np.zeros(len(force))
        )
        bends = np.divide(deflection, force, out=np.zeros(len(force)), where=force > 0.0)

        def ratios(factor: Floats, parts: Mapping[str, Sequence[LoadParts]]) -> Floats:
            thickest = chip_at(factor)
            moved = at_feeds(cuts, factor)
            loads: dict[str, Floats] = with_drill_loads(
                greatest_loads(moved, material, request.rotation), moved, material
            )
            if request.more is not None:
                loads |= request.more(moved)
            if STRESS in request.feed_limits and STRESS not in loads:
                loads[STRESS] = cutter_stress(moved.engagement, moved.cutter, material)
            limits = {**request.limits, STRESS: allowed_stress(moved.cutter)}
            return np.array(
                [
                    np.maximum(loads[column] * beyond.get(column, 1.0), thickest if column == CHIP else 0.0)
                    * request.factors(name, parts, loads, bends)
                    / limits[name]
                    for name in request.feed_limits
                    for column in (column_of(name).name,)
                ]
            )

        def greatest(parts: Mapping[str, Sequence[LoadParts]]) -> Floats:
            return greatest_factor(lambda k: np.asarray(ratios(k, parts).max(axis=0)), low, high)

        parts: dict[str, Sequence[LoadParts]] = {}
        factor = np.ones(len(low))
        if request.checks.confidence > 0.5:
            # at the programmed feeds, then at those that are found with them
            for _ in range(PARTS_AGAIN):
                parts = {**load_parts(at_feeds(cuts, factor).plain, cuts.cutter, material)}
                if AXIAL in request.limits:
                    parts[AXIAL] = _axial_parts(at_feeds(cuts, factor), material, request.rotation)
                factor = greatest(parts)
                factor = np.where(np.isnan(factor), low, factor)
        factor = greatest(parts)
        worst = LIMITED + ratios(np.where(np.isnan(factor), low, factor), parts).argmax(axis=0)
        return {_FACTOR: factor, _BY: np.where(factor == high, by[cuts.step], worst).astype(np.float64)}

    return watch


def _axial_parts(cuts: Cuts, material: Material, rotation: float) -> tuple[LoadParts, ...]:
    """Return upper bounds of the parts of the axial force of each cut."""
    loads = with_drill_loads(greatest_loads(cuts, material, rotation), cuts, material)
    return tuple(
        replace(bounded_parts(cuts.cutter, material, chip), load=load)
        for chip, load in zip(loads[CHIP].tolist(), loads[AXIAL].tolist(), strict=True)
    )


def _chip_of_instant(chip: Floats, cutter: Cutter, sines: Floats) -> Callable[[Floats], Floats]:
    """Return a function that gives the thickest chip [mm] of an instant at a feed factor.

    Without runout the thickness is proportional to the feed. The part that runout adds does not depend on the feed, so
    that a slower feed reduces the thickness by less. The angle kappa of the edge at the instant is not known: the
    greatest thickness over all angles is taken, and over all lags of the edge.

    Parameters
    ----------
    chip : (n,) at the programmed feed [mm], 0 where the instant does not count
    sines : sin(kappa) of the slices of the cutter
    """
    counts = np.flatnonzero(chip > 0.0)
    if cutter.teeth_alike or not len(counts):
        return lambda factor: factor * chip
    sine = np.unique(np.linspace(float(sines.min()), float(sines.max()), KAPPAS))
    lags = np.linspace(0.0, min(edge_lag(cutter) * cutter.flute_length, math.tau), LAGS if cutter.helix > 0.0 else 1)
    least = np.zeros((len(counts), len(sine)))
    # without runout it is at most what it is with it
    most = np.repeat(chip[counts, None], len(sine), axis=1)
    for _ in range(HALVINGS):
        middle = 0.5 * (least + most)
        thicker = thickest_of_teeth(middle, cutter, sine, lags) >= chip[counts, None]
        least, most = np.where(thicker, least, middle), np.where(thicker, middle, most)

    def loads_at(factor: Floats) -> Floats:
        out = factor * chip
        out[counts] = thickest_of_teeth(factor[counts, None] * most, cutter, sine, lags).max(axis=1)
        return out

    return loads_at


def with_new_feeds(
    text: str,
    dialect: str,
    reading: ProgramReading,
    steps: Steps,
    before: Removal,
    allowed: Mapping[str, NDArray[Any]],
    request: FeedRequest,
    cutters: Mapping[int, Cutter],
    machine: Machine,
    read: Callable[[str], ProgramReading],
    seconds: float,
) -> tuple[FeedResult, ProgramReading]:
    """Return the text with new feeds, and its program as it is read again.

    Parameters
    ----------
    text, dialect : see :func:`changeable`
    reading : of this text
    steps, before : steps of its program, and their removal
    allowed : columns of a removal with the watch of :func:`allowed_feed_watch`
    read : function that reads a text
    seconds : time of the unchanged program [s]

    Raises
    ------
    InputError
        The feeds cannot be changed in the text: the line is named.
    """
    c = before.columns
    feeds, touch = ~steps.rapid, np.where(c["chip_layers"] > 0, StepContact.FILM, StepContact.AIR)
    touch[c["chip_areas"] > 0] = StepContact.CUT
    least, most, by = _bounds(steps, request.table, cutters, machine)
    cuts = feeds & (touch == StepContact.CUT)
    if cuts.any():
        most, by = np.where(cuts, allowed[_FACTOR], most), np.where(cuts, allowed[_BY].astype(np.int64), by)
    of_steps = Allowed(touch, least, most, by)
    if request.table.divide:
        air = np.where(feeds, _air_factor(speeds_of(steps), request.table, machine), 1.0)
        divided = divide_lines(text, dialect, reading, steps, of_steps, air, machine, read)
    else:
        divided = undivided_program(text, reading, steps, of_steps)
    of_steps, at = divided.allowed, divided.step
    lines = line_feeds(divided.line, of_steps.touch[at], of_steps.least[at], of_steps.most[at], of_steps.by[at])
    lines = _in_air(lines, divided, speeds_of(steps), request.table, machine)
    fixed = frozenset[int]() if has_blocks(dialect) else kept_feeds(divided.text)
    lines = _with_kept_feeds(lines, divided.reading.program, cutters, fixed)
    segments = np.isin(lines.line, [line for lines_of in divided.segments.values() for line in lines_of])
    factor, useful = _feed_factors(lines, divided.reading, machine, request.table, segments)
    new = text_with_feeds(divided.text, dialect, dict(zip(lines.line.tolist(), factor.tolist(), strict=True)))
    after = read(new)
    require_same(divided.reading.program, after.program, lines.line, factor)
    names = {FASTEST: "fastest", MACHINE: "machine", AIR: "air", SLOWEST: "slowest", KEPT: "programmed"}
    names |= {LIMITED + k: name for k, name in enumerate(request.feed_limits)}
    limited_by = np.where((useful < lines.allowed) & (lines.by != SLOWEST), MACHINE, lines.by)
    fed = FeedResult(
        text=new,
        dialect=dialect,
        line=lines.line,
        factor=factor,
        by=tuple(names[k] for k in limited_by.tolist()),
        before=before,
        rubs=rubbing_lines(lines, factor, divided, steps, cuts, request.table, cutters),
        tooth_feed_least=request.table.tooth_feed_least_mm,
        segments=divided.segments,
        not_divided=divided.kept,
        seconds_before=seconds,
    )
    return fed, after


def _bounds(
    steps: Steps, table: FeedsTable, cutters: Mapping[int, Cutter], machine: Machine
) -> tuple[Floats, Floats, Ints]:
    """Return the least and the greatest factor of each step by job and machine, and the cause of the greatest."""
    speed = speeds_of(steps)
    n = len(steps)
    most, by = np.full(n, 0.01 * table.fastest_percent), np.full(n, FASTEST)
    with np.errstate(divide="ignore"):
        if table.fastest_mm_min is not None:
            most = np.minimum(most, mm_s_from_mm_min(table.fastest_mm_min) / speed)
        able = machine.feed_max / speed
        by, most = np.where(able < most, MACHINE, by), np.minimum(able, most)
        least = np.full(n, 0.01 * table.slowest_percent)
        if table.tooth_feed_least_mm is not None:
            least = np.maximum(least, table.tooth_feed_least_mm / tooth_feeds(steps, cutters))
    return np.minimum(least, most), most, by


def _air_factor(speed: Floats, table: FeedsTable, machine: Machine) -> Floats:
    """Return the feed factor in air (n,) of speeds [mm/s]: 1 for those that are no slower than the feed in air."""
    if table.air_mm_min is None:
        return np.ones(len(speed))
    feed = min(mm_s_from_mm_min(table.air_mm_min), machine.feed_max)
    return np.where((speed > 0.0) & (speed < feed), feed / np.where(speed > 0.0, speed, 1.0), 1.0)


def _in_air(lines: LineFeeds, divided: DividedProgram, speed: Floats, table: FeedsTable, machine: Machine) -> LineFeeds:
    """Raise the feed of lines that cut nothing to the feed in air of the job; faster lines keep theirs."""
    air = lines.touch == StepContact.AIR
    allowed, by = np.where(air, 1.0, lines.allowed), np.where(air, KEPT, lines.by)
    if table.air_mm_min is not None:
        fastest = np.zeros(len(lines.line))
        np.maximum.at(fastest, np.searchsorted(lines.line, divided.line), speed[divided.step])
        factor = _air_factor(fastest, table, machine)
        allowed = np.where(air, factor, allowed)
        by = np.where(
            air & (factor > 1.0), MACHINE if mm_s_from_mm_min(table.air_mm_min) > machine.feed_max else AIR, by
        )
    return replace(lines, least=np.where(air, 1.0, lines.least), allowed=allowed, by=by)


def _with_kept_feeds(
    lines: LineFeeds, program: Program, cutters: Mapping[int, Cutter], fixed: frozenset[int]
) -> LineFeeds:
    """Keep the feed of ``fixed`` lines, and of those on which a tool without chips moves (its load is not known) or
    taps (F is the pitch).
    """
    bodies = [number for number, cutter in cutters.items() if cutter.body]
    kept = np.isin(program.tool, bodies)
    kept[tapping_motions(program).rows] = True
    own = np.isin(lines.line, program.line[kept]) | np.isin(lines.line, list(fixed))
    return replace(
        lines, least=np.where(own, 1.0, lines.least), allowed=np.where(own, 1.0, lines.allowed),
        by=np.where(own, KEPT, lines.by),
    )  # fmt: skip


def _feed_factors(
    lines: LineFeeds, reading: ProgramReading, machine: Machine, table: FeedsTable, segments: NDArray[np.bool_]
) -> tuple[Floats, Floats]:
    """Return factors (m,) to write, and those above which the machine is no faster (at least 1 or the allowed).

    ``segments`` (m,) are the lines that are segments of one: each was cut off to have a feed of its own.
    """
    program = reading.program
    row = np.flatnonzero(np.isin(program.line, lines.line) & (program.motion != RAPID) & (program.motion != DWELL))
    of, m = np.searchsorted(lines.line, program.line[row]), len(lines.line)
    feed = np.array(program.feed)
    feed[row] *= lines.allowed[of]
    peak, old = peak_speed(replace(program, feed=feed), machine)[row], program.feed[row]
    moves = peak > 0.0
    reach, slow, fast = np.zeros(m), np.full(m, np.inf), np.zeros(m)
    np.maximum.at(reach, of[moves], peak[moves] / old[moves])
    np.minimum.at(slow, of[moves], old[moves])
    np.maximum.at(fast, of[moves], old[moves])
    reach = np.where(fast > 0.0, reach, np.inf)
    if machine.chain.rotary:
        reach = np.minimum(reach, _by_rates(lines, reading, machine))
    useful = np.minimum(lines.allowed, np.maximum(reach, 1.0))
    # a line whose feed changes within it (a rotary axis moves) is no neighbour of others
    one = (fast > 0.0) & (fast - slow <= 1e-9 * fast) & ~segments
    out = useful.copy()
    whole = segments & (fast > 0.0)
    written = 60.0 * fast[whole] * useful[whole]
    out[whole] = useful[whole] * whole_feeds(written) / written
    was = fast[one]
    most, enough, least = (was * x[one] for x in (lines.allowed, useful, lines.least))
    out[one] = steady_feeds(most, enough, least, was, 0.01 * table.change_least_percent) / was
    # rounding must not pass for a change
    return np.where(np.abs(out - 1.0) < 10.0 ** -(DIGITS + 4), 1.0, out), useful


def _by_rates(lines: LineFeeds, reading: ProgramReading, machine: Machine) -> Floats:
    """Return the factor (m,) at which each line takes the time that the axis rates require."""
    least = np.concatenate([[0.0], row_time_limited(machine, reading.axes)])[: len(reading.commands)]
    own = np.concatenate([[0.0], program_time(reading.program, machine)[1:]])
    rates, path = np.zeros(len(lines.line)), np.zeros(len(lines.line))
    for total, line, seconds in ((rates, reading.commands.line, least), (path, reading.program.line, own)):
        known = np.isin(line, lines.line)
        np.add.at(total, np.searchsorted(lines.line, line[known]), seconds[known])
    return np.asarray(np.where(rates > 0.0, path / np.where(rates > 0.0, rates, 1.0), np.inf))
