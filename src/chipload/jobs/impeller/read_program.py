"""A program of an impeller as its text is read back: the check simulates what was read, not what was planned."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.machine.machine import Machine
from chipload.program.gcode.writer import write_gcode
from chipload.program.program import Program
from chipload.program.read import times_of
from chipload.program.read_back import read_back, rows_of_source
from chipload.program.release import NOT_SIMULATED
from chipload.program.travel import leading_rows
from chipload.report.programs import ENDINGS

Floats = NDArray[np.float64]

#: comments in the head of every text of an impeller, so that lines are those of the files; height of tools [mm]
COMMENTS, LONGEST = ("tool", "table", "channels"), 1400.0


@dataclass(frozen=True, eq=False)
class ReadProgram:
    """A program of one channel as its text is read back.

    Parameters
    ----------
    program : from the row on at which each axis was sent somewhere; the labels are those of the plan
    times : (n,) float [s], of its rows on the machine
    source : (n,) row of the plan that each comes from
    text : as it was read; empty: none can be read, and the program is the plan
    """

    program: Program
    times: Floats
    source: NDArray[np.int64]
    text: str

    @property
    def seconds(self) -> float:
        """Time of the whole program [s]."""
        return float(self.times.sum())

    def in_cut(self) -> NDArray[np.bool_]:
        """Rows of tracks, (n,) bool: neither leads nor links."""
        return np.array([name == "finish" for name in self.program.labels])[self.program.label]

    def as_planned(self, planned: Program) -> Program:
        """The planned rows, each with the end, the axis and the feed that were read; one that is not read stays."""
        at = np.searchsorted(self.source, np.arange(len(planned)), "right") - 1
        known = (at >= 0) & (self.source[np.maximum(at, 0)] == np.arange(len(planned)))
        at = at[known]
        place, axis, feed = planned.p_work.copy(), planned.axis.copy(), planned.feed.copy()
        place[known], axis[known] = self.program.p_work[at], self.program.axis[at]
        feed[known] = self.program.feed[at]
        return replace(planned, p_work=place, axis=axis, feed=feed)


def read_program_of(planned: Program, machine: Machine, cutter: CatalogueCutter) -> ReadProgram:
    """Write a program of one tool for a machine, and read its text back."""
    rows = np.arange(len(planned))
    plan = ReadProgram(planned, np.zeros(len(planned)), rows, "")
    if not len(planned):
        return plan
    number = int(planned.tool[0])
    text = write_gcode(planned, machine, title="impeller", release=NOT_SIMULATED, comments=COMMENTS)
    tool = {number: cutter.assembled(number, LONGEST)}
    try:
        reading = read_back(text, f"program.{ENDINGS[machine.dialect]}", machine, tool)
    except InputError:
        # the text is read once more with its comments, where this is a finding
        return plan
    first = leading_rows(reading.program.path_mode)
    source = rows_of_source(planned, reading)[first:]
    kept = {f.name: getattr(reading.program, f.name)[first:] for f in fields(Program) if f.name != "labels"}
    kept["label"] = planned.label[source]
    times = times_of(reading, machine)
    times = np.concatenate([[times[: first + 1].sum()], times[first + 1 :]])
    return ReadProgram(replace(reading.program, **kept, labels=planned.labels), times, source, text)
