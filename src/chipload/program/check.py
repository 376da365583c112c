"""Checks of a program against the limits of a machine, row by row.

Notation: a row's line is that of its source where it has one; rows are counted from 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding
from chipload.machine.limits import text_of_rows
from chipload.machine.machine import AXES, Machine
from chipload.program.motions import bounds, is_arc
from chipload.program.program import DWELL, LINE, RAPID, Program
from chipload.units import mm_min_from_mm_s, rpm_from_rad_s

#: code of a finding on cuts with the spindle at rest
SPINDLE_OFF = "machine-spindle-off"


def check_program(
    program: Program, machine: Machine, travel: bool = True, probes: Sequence[int] = ()
) -> tuple[Finding, ...]:
    """Span of the axes (arcs with their bulge), greatest feed, range of the spindle, spindle at rest in a cut, tilted
    axis.

    Span and tilt of a machine without rotary axes; with them :func:`~chipload.machine.limits.limit_findings` says
    what the axes do. Where the work lies in the machine is not known here: what a program spans along an axis is
    compared with what the axis travels. :func:`~chipload.program.travel.travel_findings` compares positions.

    Parameters
    ----------
    travel : whether the span is compared
    probes : lines of the source that probe, where the spindle rests

    One finding a code and axis: the worst row and its value, how many rows, the first of them. Codes: `machine-limit`,
    `machine-feed`, `machine-spindle`, `machine-spindle-off`, `machine-axis`, `program-start`.

    Examples
    --------
    >>> from chipload.machine.machine import machine_named
    >>> from chipload.program.build import rapid
    >>> check_program(rapid([[0, 0, 5], [801, 0, 5]], 0.0, 1, "link"), machine_named("vmc"))[0].text
    'row 1: X goes from 0 to 801 mm: machine vmc travels 800 mm, wherever the work lies'
    """
    found: list[Finding] = []

    def report(code: str, bad: NDArray[np.bool_], excess: NDArray[np.float64], text: str, values: object) -> None:
        at = np.flatnonzero(bad)
        if len(at) == 0:
            return
        worst = int(at[np.argmax(excess[at])])
        shown = text.format(np.asarray(values)[worst])
        found.append(Finding(code, int(program.line[worst]), text_of_rows(at, worst, shown, program.line)))

    low, high = bounds(program)
    slack = 1e-9
    for i, axis in enumerate(AXES if travel and not machine.chain.rotary and len(program) else ()):
        least, most = machine.limits[i]
        a, b, span = float(low[:, i].min()), float(high[:, i].max()), most - least
        text = (
            f"{axis.upper()} goes from {a:g} to {b:g} mm: machine {machine.name} travels {span:g} mm, wherever the "
            "work lies"
        )
        far = high[:, i] == b
        report("machine-limit", far & (b - a > span + slack), high[:, i], text, high[:, i])
    cuts = (program.motion == LINE) | is_arc(program)
    feed = np.where(cuts, program.feed, 0.0)
    top = f"feed {{:g}} mm/min: machine {machine.name} reaches {mm_min_from_mm_s(machine.feed_max):g} mm/min"
    report("machine-feed", feed > machine.feed_max * (1.0 + 1e-12), feed, top, mm_min_from_mm_s(1.0) * feed)
    speed = np.abs(program.spindle)
    turning = speed > 0.0
    over = np.maximum(speed / machine.spindle_max, machine.spindle_min / np.where(turning, speed, math.inf))
    text = (
        f"spindle {{:g}} rpm: machine {machine.name} turns from {rpm_from_rad_s(machine.spindle_min):g} "
        f"to {rpm_from_rad_s(machine.spindle_max):g} rpm"
    )
    report("machine-spindle", turning & (over > 1.0 + 1e-12), over, text, rpm_from_rad_s(1.0) * speed)
    none = np.zeros(len(program))
    cutting = cuts & ~np.isin(program.line, probes)
    report(SPINDLE_OFF, cutting & ~turning, none, "cuts with the spindle at rest: state a spindle speed", none)
    tilt = np.degrees(np.arccos(np.clip(program.axis[:, 2], -1.0, 1.0)))
    tilted = (np.hypot(program.axis[:, 0], program.axis[:, 1]) > 1e-9) | (program.axis[:, 2] < 0.0)
    text = f"axis tilted by {{:g}} deg: machine {machine.name} has three axes"
    report("machine-axis", tilted & (program.motion != DWELL) & (not machine.chain.rotary), tilt, text, tilt)
    first = "starts with a cutting motion: must start with a rapid to the start of the cut"
    start = np.zeros(len(program), dtype=np.bool_)
    # a dwell while the spindle starts is no motion
    moving = np.flatnonzero(program.motion != DWELL)[:1]
    start[moving] = program.motion[moving] != RAPID
    report("program-start", start, none, first, none)
    return tuple(found)
