"""The texts of all programs of an impeller, read back and checked on the whole machine in the run that makes them."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

from chipload.checking.workpiece import Surroundings
from chipload.errors import Finding, Severity
from chipload.jobs.impeller.five_axis_outcome import CheckedFlank, CheckedPoints
from chipload.jobs.impeller.machine_check import (
    AroundPart,
    MachineCheck,
    around_part,
    every_channel_findings,
    text_check,
)
from chipload.jobs.impeller.outcome import Checked, CheckedPartition, ImpellerResult
from chipload.jobs.impeller.programs import cutter_of, five_axis_text, program_of, table_text
from chipload.jobs.impeller.read_program import ReadProgram
from chipload.jobs.impeller.roughing_check import CheckedRough
from chipload.machine.machine import Machine
from chipload.program.release import NOT_SIMULATED, same_blocks
from chipload.report.programs import ENDINGS

OfTable = TypeVar("OfTable", Checked, CheckedRough)
OfFiveAxes = TypeVar("OfFiveAxes", CheckedFlank, CheckedPoints)


def with_texts_read_back(milled: ImpellerResult, surroundings: Surroundings, clearance: float) -> ImpellerResult:
    """A result whose programs have what their texts show on the machine.

    Each text of one channel is read. Of the partition that is milled, and of roughing, the texts of all channels are
    read too; if one differs from the plan, another partition may take its place, which is then read as well.

    Parameters
    ----------
    clearance : least distance of neck, shank and holder [mm]
    """
    check = _Check(milled, surroundings, clearance)
    roughs = None if milled.roughs is None else tuple(check.with_every_channel(check.read(r)) for r in milled.roughs)
    checked = None if milled.checked is None else tuple(check.partition(w) for w in milled.checked)
    out = replace(milled, roughs=roughs, checked=checked)
    done: list[CheckedPartition] = []
    while (used := out.used_checked) is not None and not any(used is one for one in done):
        whole = replace(used, programs=tuple(check.with_every_channel(p) for p in used.programs))
        done.append(whole)
        out = replace(out, checked=tuple(whole if one is used else one for one in out.checked or ()))
    flanks = None if milled.flanks is None else tuple(
        check.five_axis(p) if isinstance(p, CheckedFlank) else p for p in milled.flanks
    )  # fmt: skip
    points = None if milled.points is None else tuple(
        check.five_axis(p) if isinstance(p, CheckedPoints) else p for p in milled.points
    )  # fmt: skip
    return replace(out, flanks=flanks, points=points)


class _Check:
    """Checks of the texts of one result; programs that partitions share are read once."""

    def __init__(self, milled: ImpellerResult, surroundings: Surroundings, clearance: float) -> None:
        self.milled, self.surroundings, self.clearance = milled, surroundings, clearance
        self._around: dict[str, AroundPart] = {}
        self._checked: dict[int, Checked] = {}
        self._texts: dict[int, str] = {}

    def around(self, machine: Machine) -> AroundPart:
        """What is around the part on a machine."""
        if machine.name not in self._around:
            own = around_part(self.surroundings, machine, self.milled.impeller, self.clearance)
            self._around[machine.name] = own
        return self._around[machine.name]

    def partition(self, one: CheckedPartition) -> CheckedPartition:
        """A partition with what the texts of its programs show."""
        for p in one.programs:
            if id(p) not in self._checked:
                self._checked[id(p)] = self.read(p)
        return replace(one, programs=tuple(self._checked[id(p)] for p in one.programs))

    def read(self, checked: OfTable) -> OfTable:
        """A program of the index table with what its text of one channel shows."""
        program, machine = program_of(checked), self.milled.machine
        if not len(program):
            return checked
        text = self._texts[id(program)] = table_text(self.milled, checked, None, NOT_SIMULATED)
        found = text_check(text, _file(machine), machine, cutter_of(checked), program, self.around(machine))
        found = found.joined(_check_blocks(text, checked.read))
        return replace(checked, machine_check=checked.machine_check.joined(found))

    def with_every_channel(self, checked: OfTable) -> OfTable:
        """A program of the index table that was read, with what its text of all channels shows in addition."""
        machine, repeat = self.milled.machine, checked.repeat
        one = self._texts.get(id(program_of(checked)))
        if repeat is None or one is None:
            return checked
        every = table_text(self.milled, checked, repeat, NOT_SIMULATED)
        found = every_channel_findings(one, every, _file(machine), machine, cutter_of(checked), repeat)
        return replace(checked, machine_check=checked.machine_check.joined(MachineCheck(found)))

    def five_axis(self, p: OfFiveAxes) -> OfFiveAxes:
        """A program on five axes with what its text of one channel shows."""
        text = five_axis_text(self.milled, p, False, NOT_SIMULATED)
        found = text_check(text, _file(p.machine), p.machine, p.cutter, p.program, self.around(p.machine))
        found = found.joined(_check_blocks(text, p.read))
        return replace(p, machine_check=p.machine_check.joined(found))


def _check_blocks(text: str, read: ReadProgram) -> MachineCheck:
    """What is wrong if the blocks of a text are not those of the program that was simulated."""
    if not read.text or same_blocks(text, read.text):
        return MachineCheck()
    found = Finding("text-differs", 0, "the written text is not the one that was simulated", Severity.EXCEEDS)
    return MachineCheck((found,))


def _file(machine: Machine) -> str:
    """A file name with the ending of a control's programs."""
    return f"program.{ENDINGS[machine.dialect]}"
