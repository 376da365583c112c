"""Findings on what nobody stated about the control of a text: which one it is, its units, its tool table, its times.

A guess that changes path or time leaves the result unproven until the job states it; one that does not is a note.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, Severity
from chipload.number_text import number_text
from chipload.program.commands import ARC, DWELL, LINE, PROBE, Commands, extents
from chipload.program.control import Control
from chipload.program.gcode.tools import ToolTable
from chipload.program.recognise import Recognition, guess_unit, states_distance, states_unit
from chipload.program.reconcile import StatedDiameter
from chipload.program.setup import StatedControl
from chipload.units import MM_PER, mm_min_from_mm_s

Floats = NDArray[np.float64]

#: a block that takes longer is a wrong feed [s]
LONGEST_BLOCK = 1e4 * 60.0
#: no mill cuts at a lower feed [mm/min]: a control that would is not the one
LEAST_FEED_MM_MIN = 0.5
#: a dwell that is longer, or all dwells longer than this share of the program, ask for their unit [s]
LONGEST_DWELL, DWELL_SHARE = 60.0, 0.5
#: two diameters that differ by a smaller share are one
SAME = 0.02
_COMPENSATED = re.compile(r"(?<![A-Z])G4[12](?![0-9.])", re.IGNORECASE)


def unit_of(text: str, control: Control, stated: StatedControl) -> tuple[str, tuple[Finding, ...]]:
    """The unit of lengths before the text states one, and a finding where it never does and nobody stated it."""
    if stated.unit is not None or states_unit(text):
        return stated.unit or "mm", ()
    if control.unit.at_start != "setting":
        return control.unit.at_start, ()
    unit, reasons = guess_unit(text)
    message = (
        f"the program states no unit (G20, G21), and the unit at the start is a setting of the control: read as {unit} "
        f"({reasons}): state program.unit"
    )
    return unit, (Finding("nc-unit", 0, message, Severity.UNPROVEN),)


def distance_findings(text: str, control: Control) -> tuple[Finding, ...]:
    """A finding where a text states neither G90 nor G91 and a setting decides."""
    if control.modal.distance_at_start or states_distance(text):
        return ()
    message = "the program states neither G90 nor G91, which is a setting of the control at its start: read as G90"
    return (Finding("nc-distance", 0, f"{message}: write G90 in its first block", Severity.UNPROVEN),)


def table_in_its_unit(
    tools: ToolTable,
    text: str,
    stated: StatedControl,
    diameters: Mapping[int, float],
    comments: Mapping[int, StatedDiameter],
) -> tuple[ToolTable, tuple[Finding, ...]]:
    """The tool table, read in mm, in its own unit; a finding where that is a guess.

    Parameters
    ----------
    diameters : [mm] of the cutters of the job
    comments : diameters that the comments of the text state
    """
    inch = MM_PER["inch"]
    if stated.tools_unit is not None:
        return (tools.scaled(inch) if stated.tools_unit == "inch" else tools), ()
    known = {n: c.diameter for n, c in comments.items()} | dict(diameters)
    pairs = [(t.diameter, known[n]) for n, t in tools.tools.items() if n in known and t.diameter > 0.0]
    as_mm = sum(abs(d - k) <= SAME * k for d, k in pairs)
    as_inch = sum(abs(inch * d - k) <= SAME * k for d, k in pairs)
    if as_inch > as_mm:
        message = (
            f"the tool table states no unit: {as_inch} of {len(pairs)} diameters agree with the program as inches: "
            'read as inches: state program.tools_unit = "inch"'
        )
        return tools.scaled(inch), (Finding("nc-tools-unit", 0, message, Severity.UNPROVEN),)
    return tools, ()


def control_findings(found: Recognition, text: str, commands: Commands, other: Commands | None) -> tuple[Finding, ...]:
    """Findings on a control that nobody stated.

    Parameters
    ----------
    other : the text as the next best control reads it; None: it does not, or there is none
    """
    if found.stated:
        return ()
    name, reasons = found.control.name, ", ".join(found.reasons)
    said = f"read as a program for {found.control.title} ({reasons})"
    remedy = f'state program.control = "{name}" or another one'
    if found.other is None:
        return (Finding("nc-control", 0, f"{said}: {remedy} if it is not"),)
    if other is not None and same_motions(commands, other):
        return (Finding("nc-control", 0, f"{said}; {found.other.title} reads it in the same way"),)
    if other is None:
        difference = f"{found.other.title} does not read it"
    elif _least_feed(other) < LEAST_FEED_MM_MIN <= _least_feed(commands):
        slow = f"{found.other.title} would cut at {number_text(_least_feed(other))} mm/min"
        return (Finding("nc-control", 0, f"{said}; {slow}: {remedy} if it is not"),)
    else:
        a, b = (programmed_minutes(x) for x in (commands, other))
        difference = (
            f"{found.other.title} reads it otherwise: {number_text(b)} min at the programmed feeds instead of {a:.4g}"
        )
    return (Finding("nc-control", 0, f"{said}; {difference}: {remedy}", Severity.UNPROVEN),)


def _least_feed(commands: Commands) -> float:
    """Least feed of a cut [mm/min]; infinite where nothing cuts."""
    cuts = np.isin(commands.motion, (LINE, ARC)) & (commands.feed > 0.0)
    return mm_min_from_mm_s(float(commands.feed[cuts].min())) if cuts.any() else math.inf


def same_motions(a: Commands, b: Commands) -> bool:
    """Whether two readings of a text move in the same way, at the same feeds and speeds."""
    if len(a) != len(b) or not np.array_equal(a.motion, b.motion):
        return False
    pairs = ((a.position, b.position), (a.feed, b.feed), (a.centre, b.centre), (a.spindle, b.spindle))
    return all(np.allclose(x, y, rtol=1e-9, atol=1e-9) for x, y in pairs) and np.array_equal(a.turns, b.turns)


def programmed_seconds(commands: Commands) -> Floats:
    """(n,) time [s] of each cut at its programmed feed and of each dwell; 0 for rapids."""
    cuts = np.isin(commands.motion, (LINE, ARC, PROBE)) & (commands.feed > 0.0)
    out = np.where(cuts, extents(commands) / np.where(cuts, commands.feed, 1.0), 0.0)
    return np.asarray(np.where(commands.motion == DWELL, commands.feed, out))


def programmed_minutes(commands: Commands) -> float:
    """Time [min] of all cuts and dwells at the programmed feeds."""
    return float(programmed_seconds(commands).sum()) / 60.0


def time_findings(commands: Commands, control: Control, stated: bool) -> tuple[Finding, ...]:
    """Findings on blocks and dwells that take so long that a feed or a unit must be wrong.

    ``stated``: the control is stated.
    """
    seconds = programmed_seconds(commands)
    out = []
    if len(seconds) and seconds.max() > LONGEST_BLOCK:
        k = int(np.argmax(seconds))
        message = (
            f"the block takes {number_text(seconds[k] / 60.0)} min at its feed: must be at most 1e4 min: correct F"
        )
        out.append(Finding("nc-block-time", int(commands.line[k]), message, Severity.UNPROVEN))
    rests = np.where(commands.motion == DWELL, seconds, 0.0)
    if rests.sum() > LONGEST_DWELL * DWELL_SHARE and (
        rests.max() > LONGEST_DWELL or rests.sum() > DWELL_SHARE * seconds.sum()
    ):
        k = int(np.argmax(rests))
        unit = control.dwell.get("p")
        counts = "" if unit is None else f"P counts {unit.whole_s:g} s, with a decimal point {unit.point_s:g} s, on "
        message = (
            f"a dwell of {number_text(rests[k])} s: {counts}{control.title}: state program.settings.dwell_s "
            "if it does not"
        )
        severity = Severity.NOTE if stated else Severity.UNPROVEN
        out.append(Finding("nc-dwell-time", int(commands.line[k]), message, severity))
    return tuple(out)


def compensates(text: str) -> bool:
    """Whether a text has G41 or G42."""
    return _COMPENSATED.search(text) is not None
