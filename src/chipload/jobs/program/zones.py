"""The passes of a program, and the zones with separate spindle speeds.

A pass is a continuous cut of a tool between two lines that are wholly out of the material. Its speed can change in the
first line after the previous pass; existing S words between two passes are used.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.checking.outcome import ToolSpeed
from chipload.checking.stability import SPEEDS, StabilityResult, rounded_rpm
from chipload.checking.stability_watch import engaged_edge
from chipload.program.program import DWELL, RAPID, Program
from chipload.result.limits import Columns
from chipload.stability.cuts import join_dynamic_cuts
from chipload.stability.margin import stability_margins
from chipload.stability.zones import speed_zones
from chipload.units import rad_s_from_rpm, rpm_from_rad_s

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: greatest number of passes of a tool that are treated separately; more are merged with their neighbours
MOST_PASSES = 60
#: cuts of a tool with which speeds are searched: nearest to chatter, with most edge in cut; least of each in a pass
NEAREST, LARGEST, LEAST = 12, 12, 2


@dataclass(frozen=True, eq=False)
class ProgramPass:
    """A pass: a cut of a tool that does not leave the material.

    Parameters
    ----------
    tool : its number
    lines : first and last that cut
    change : line in which its speed can change, after the previous pass
    cuts : (c,) int, numbers of the cuts of its steps
    present : its greatest present speed [rad/s]
    """

    tool: int
    lines: tuple[int, int]
    change: int
    cuts: Ints
    present: float


def passes_of(stability: StabilityResult, program: Program, columns: Columns, tool: int) -> tuple[ProgramPass, ...]:
    """Return the passes of a tool in their order.

    Parameters
    ----------
    columns : of the steps of the simulation
    """
    steps, numbers = stability.watch.cuts_of(tool)
    if not len(steps):
        return ()
    line = np.asarray(columns["line"], dtype=np.int64)
    cutting = np.unique(line[np.asarray(columns["chip_areas"]) > 0])
    own, at = line[steps], program.line.astype(np.int64)
    moves, first_at = np.unique(at, return_index=True)
    tools, cuts_here = program.tool[first_at], np.isin(moves, cutting)
    # a pass ends where a line does not cut, or another tool does
    begins = cuts_here & ~np.concatenate([[False], cuts_here[:-1] & (tools[1:] == tools[:-1])])
    number = np.cumsum(begins) - 1
    out = []
    for k in np.unique(number[cuts_here & (tools == tool)]).tolist():
        some = moves[cuts_here & (number == k)]
        first, last = int(some[0]), int(some[-1])
        inside = (own >= first) & (own <= last)
        if not inside.any():
            continue
        rows = (at >= first) & (at <= last) & (program.motion != RAPID) & (program.motion != DWELL)
        before = moves[(moves < first) & (tools == tool)]
        ended = before[np.isin(before, cutting)]
        between = before[before > ended[-1]] if len(ended) else before
        speed = float(np.abs(program.spindle[rows]).max()) if rows.any() else 0.0
        change = int(between[0]) if len(between) else first
        out.append(ProgramPass(tool, (first, last), change, np.unique(numbers[inside]), speed))
    return _merged_passes(out)


def _merged_passes(passes: Sequence[ProgramPass]) -> tuple[ProgramPass, ...]:
    """Join neighbouring passes so that at most :data:`MOST_PASSES` remain."""
    if len(passes) <= MOST_PASSES:
        return tuple(passes)
    return tuple(
        ProgramPass(
            some[0].tool, (some[0].lines[0], some[-1].lines[1]), some[0].change,
            np.unique(np.concatenate([p.cuts for p in some])), max(p.present for p in some),
        )
        for some in (
            [passes[k] for k in part] for part in np.array_split(np.arange(len(passes)), MOST_PASSES)
        )
    )  # fmt: skip


def zone_speeds(
    stability: StabilityResult, program: Program, columns: Columns, tool: int
) -> tuple[tuple[ToolSpeed, int], ...]:
    """Return the speeds of the zones of a tool, each with its first line; with one or none, zones are unused."""
    low, high = stability.range_of(tool)
    passes = passes_of(stability, program, columns, tool)
    if len(passes) < 2 or not high > low:
        return ()
    speeds = np.geomspace(low, high, SPEEDS)
    chosen = _choose_cuts(stability, tool, passes)
    every = np.unique(np.concatenate(chosen))
    cuts = join_dynamic_cuts(stability.watch.cuts[tool]).chosen(every)
    some = cuts.chosen(np.repeat(np.arange(len(cuts)), len(speeds)))
    found = stability_margins(some.at_speeds(np.tile(cuts.pitch / speeds, len(cuts))))
    margin = found.margin.reshape(len(cuts), len(speeds))
    least = np.array([margin[np.searchsorted(every, own)].min(axis=0) for own in chosen])
    zones = speed_zones(speeds, least, stability.wanted, [p.present for p in passes])
    out = []
    for zone in zones:
        own = passes[zone.first : zone.last + 1]
        before = tuple(round(rpm_from_rad_s(x), 6) for x in sorted({p.present for p in own}))
        lines = (own[0].lines[0], own[-1].lines[1])
        out.append((ToolSpeed(tool, before, rounded_rpm(zone.speed), zone.margin, lines), own[0].change))
    return tuple(out)


def _choose_cuts(stability: StabilityResult, tool: int, passes: Sequence[ProgramPass]) -> list[Ints]:
    """Return for each pass the cuts with which its speed is searched."""
    margin = np.array([x[0] for x in stability.watch.known[tool].values()])
    edge = engaged_edge(join_dynamic_cuts(stability.watch.cuts[tool]))
    near, large = (max(LEAST, count // len(passes)) for count in (NEAREST, LARGEST))
    out = []
    for own in passes:
        first = own.cuts[np.argsort(margin[own.cuts], kind="stable")[:near]]
        most = own.cuts[np.argsort(-edge[own.cuts], kind="stable")[:large]]
        out.append(np.unique(np.concatenate([first, most])))
    return out


def row_speeds(
    program: Program, tools: Sequence[tuple[ToolSpeed, int]], words: Ints
) -> tuple[Floats, dict[int, float]]:
    """Return the wanted speed [rad/s] of each row of a program (NaN: unchanged), and new S words by line [1/min].

    Parameters
    ----------
    tools : speeds by zone, each with the line in which it can begin, in the order of the program
    words : (w,) int, lines of the S words of the text, rising
    """
    wanted, added = np.full(len(program), np.nan), dict[int, float]()
    line = program.line.astype(np.int64)
    before: ToolSpeed | None = None
    for speed, change in tools:
        own, first = program.tool == speed.tool, change
        if before is None or before.tool != speed.tool:
            wanted[own] = rad_s_from_rpm(speed.rpm)
        else:
            between = words[(words > before.lines[1]) & (words <= speed.lines[0])]
            if len(between):
                first = int(between[0])
            else:
                added[change] = speed.rpm
            wanted[own & (line >= first)] = rad_s_from_rpm(speed.rpm)
        before = speed
    return wanted, added
