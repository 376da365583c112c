"""Removal of the written programs of an impeller from a stock, step by step, by the engine of program jobs.

Without `forces` of the job neither the teeth nor the material are stated: others stand for them, and only the removal
is kept: volume of each step, rapids and shank in material, material above the flutes. With `forces` every load, limit
and default check is that of a program job.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.contact_lines import contact_lines
from chipload.checking.inputs import CheckInputs
from chipload.checking.limits import program_limits
from chipload.checking.outcome import SimulationResult
from chipload.checking.program_sequence import ProgramSequence
from chipload.checking.result import simulation_findings
from chipload.checking.rows import step_rows
from chipload.checking.run import simulate_program
from chipload.checking.settings import CheckSettings, SimulationSettings
from chipload.checking.workpiece import Stock
from chipload.cutter.catalogue import CatalogueCutter
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.errors import Finding, InputError, Severity
from chipload.jobs.impeller.machine_check import LONGEST
from chipload.jobs.impeller.program_removal import ProgramRemoval
from chipload.jobs.impeller.read_program import ReadProgram
from chipload.machine.machine import Machine
from chipload.planning.impeller.feeds import ForceTerms
from chipload.program.program import Program
from chipload.progress import Progress, silent
from chipload.result import check_limit, error_of
from chipload.simulation.loads import Cuts

Floats = NDArray[np.float64]

#: longest step of a simulation with loads, of the smallest diameter, as that of a program job; without them [mm], so
#: that a row of the text is a step
STEP, STEP_MM = 0.25, 100.0
#: slices of a corner, and of the flank [mm], where there are no loads: the volume of a step is then known to 0.2 %
SLICES, FLANK_MM = 12, 5.0
#: teeth and helix that stand for those that are not stated
FLUTES, HELIX = 2, math.radians(30.0)
#: stands for a material that is not stated
MATERIAL = Material("not stated", 1000.0, 300.0, 100.0, 10.0, 10.0, 1.0, source="stands for a material")
#: columns that depend neither on the teeth nor on the material
OF_REMOVAL = (
    "line", "tool", "label", "rapid", "s_mm", "t_s", "duration_s", "wait_s", "seconds", "x_mm", "y_mm", "z_mm",
    "axis_x", "axis_y", "axis_z", "feed_mm_min", "chip_volume_mm3", "chip_areas", "chip_layers", "axial_overrun_mm",
    "ramp_deg",
)  # fmt: skip
#: findings that the check on the machine has, of all channels
OF_MACHINE = ("tool-change-in-stock", "below-stock", "cutter-speed")


@dataclass(frozen=True, eq=False)
class ImpellerProgram:
    """A program as its text was read, the name of its track, and its cutter."""

    name: str
    read: ReadProgram
    cutter: CatalogueCutter

    def numbered_from(self, number: int) -> ImpellerProgram:
        """Return the program with its tool number raised by ``number``, so that others keep theirs."""
        program = self.read.program
        return replace(self, read=replace(self.read, program=replace(program, tool=program.tool + number)))


def removal_of_programs(
    programs: Sequence[ImpellerProgram],
    stock: Stock,
    machine: Machine,
    terms: ForceTerms | None,
    touch: float = 0.0,
    progress: Progress = silent,
    *,
    contacts: bool = False,
    earlier: Sequence[ImpellerProgram] = (),
) -> list[ProgramRemoval]:
    """Return what each program removes, in the order in which they run; a tool number is of one cutter.

    Parameters
    ----------
    touch : volume that a rapid may remove in one row [mm^3]
    contacts : whether the contact lines of the steps are kept
    earlier : programs that run before these and only make room for them: what they remove is not calculated
    """
    run = [*earlier, *programs]
    sequence = ProgramSequence.of([(p.read.program, p.read.times) for p in run], len(earlier))
    tools = {int(p.read.program.tool[0]): tool_with_teeth(p.cutter, p.read.program, terms) for p in run}
    inputs = inputs_of(tools, stock, machine, terms)
    try:
        body = stock.layered(sequence.program, tools)
        lines = ContactLines() if contacts else None
        simulation = simulate_program(inputs, sequence, body, watch=lines, progress=progress)
    except InputError as err:
        found = Finding("not-simulated", 0, f"the programs are not simulated in the blank: {err}", Severity.UNPROVEN)
        return [ProgramRemoval(findings=(found,)) for _ in programs]
    taken = _taken_by_rapids(simulation)
    findings = [
        f
        for f in simulation_findings(simulation)
        if f.code not in OF_MACHINE and not (f.code == "rapid-cuts" and taken.get(f.line, math.inf) <= touch)
    ]
    parts = [_of_program(k, p, sequence, simulation, findings, terms) for k, p in enumerate(programs, len(earlier))]
    return parts if lines is None else _keep_contact(parts, lines, sequence, simulation, len(earlier))


class ContactLines:
    """The contact line of each step that cuts, kept while a simulation runs."""

    def __init__(self) -> None:
        self._parts: list[tuple[NDArray[np.int64], Floats]] = []

    def __call__(self, cuts: Cuts) -> Mapping[str, Floats]:
        """Keep the lines of some steps; there are no columns of them."""
        self._parts.append((cuts.step, contact_lines(cuts)))
        return {}

    def of_rows(self, count: int) -> Floats:
        """Ends of the lines of all rows, (n, 2, 3) [mm]; nan where nothing is cut."""
        out = np.full((count, 2, 3), np.nan)
        for step, lines in self._parts:
            out[step] = lines
        return out


def _keep_contact(
    found: Sequence[ProgramRemoval],
    lines: ContactLines,
    sequence: ProgramSequence,
    simulation: SimulationResult,
    first: int,
) -> list[ProgramRemoval]:
    """What each program from the number ``first`` on removes, with the contact lines of its rows."""
    row = np.asarray(simulation.removal.columns["line"]) - 1
    of = np.searchsorted(sequence.first, row, "right") - 1
    every = lines.of_rows(len(row))
    return [replace(one, contact=every[of == k]) if one.columns else one for k, one in enumerate(found, first)]


def _taken_by_rapids(simulation: SimulationResult) -> dict[int, float]:
    """Volume [mm^3] that the rapid of each line removes, where it removes some."""
    c = simulation.removal.columns
    own = np.asarray(c["rapid"]) & (np.asarray(c["chip_volume_mm3"]) > 0.0)
    lines, of = np.unique(np.asarray(c["line"])[own], return_inverse=True)
    volume = np.bincount(of.ravel(), np.asarray(c["chip_volume_mm3"])[own], len(lines))
    return dict(zip(lines.tolist(), volume.tolist(), strict=True))


def inputs_of(tools: Mapping[int, Cutter], stock: Stock, machine: Machine, terms: ForceTerms | None) -> CheckInputs:
    """Return the inputs of the simulation; fixtures and table are compared in all channels by the check on the machine.

    The blades are the part, which may be slender, and the neighbour channels are uncut: loose pieces and slender walls
    are not searched. No catalogue states how steeply its cutters may ramp.
    """
    loads = terms is not None
    checks = CheckSettings(
        loose_stock=False, slender_walls=False, plunge=False, cutter_strength=loads, chip_space=loads, chip_range=loads,
        spindle=loads, rigid_model=loads,
    )  # fmt: skip
    settings = SimulationSettings(STEP * min(tool.diameter for tool in tools.values()))
    if not loads:
        settings = SimulationSettings(STEP_MM, resolution_error=False, corner_slices=SLICES, flank_mm=FLANK_MM)
    material = MATERIAL if terms is None else terms.material
    return CheckInputs(tools, material, machine, stock, settings, checks=checks, loads=loads, outlines=False)


def tool_with_teeth(size: CatalogueCutter, program: Program, terms: ForceTerms | None) -> Cutter:
    """Return the whole tool of a program, with the teeth of `forces`; what has no end reaches over the part."""
    overhang = None if terms is None else terms.overhang
    extent = float(np.linalg.norm(np.ptp(program.p_work, axis=0))) + size.diameter
    tool = size.assembled(int(program.tool[0]), overhang or min(extent, LONGEST))
    if terms is None:
        return replace(tool, flutes=FLUTES, helix=HELIX)
    return replace(tool, flutes=terms.flutes, helix=terms.helix, modulus=terms.modulus, strength=terms.strength)


def _findings_of(
    k: int, read: ReadProgram, sequence: ProgramSequence, findings: Sequence[Finding], begin: int
) -> tuple[Finding, ...]:
    """Findings of a program, with the lines of its text and the rows of its history, which begins at row ``begin``."""
    out = []
    for f in findings:
        of, row = sequence.program_at(f.line) if f.line > 0 else (0, 0)
        if of == k:
            line = int(read.program.line[row]) if f.line > 0 else 0
            out.append(replace(f, line=line, row=None if f.row is None else max(f.row - begin, 0)))
    return tuple(out)


def _of_program(
    k: int,
    one: ImpellerProgram,
    sequence: ProgramSequence,
    simulation: SimulationResult,
    findings: Sequence[Finding],
    terms: ForceTerms | None,
) -> ProgramRemoval:
    """Part of a simulation that is of one program: its rows with the lines of its text, its limits and findings."""
    whole, first, read, name = simulation.removal.columns, sequence.first, one.read, one.name
    row = np.asarray(whole["line"]) - 1
    own = np.flatnonzero((row >= first[k]) & (row < first[k + 1]))
    begin, lines = int(own[0]) if len(own) else 0, np.asarray(read.program.line)
    c: dict[str, NDArray[Any]] = {
        key: np.asarray(v)[own] for key, v in whole.items() if terms is not None or key in OF_REMOVAL
    }
    at = row[own] - int(first[k])
    c["line"] = lines[at]
    if len(own):
        c["t_s"] = c["t_s"] - (c["t_s"][0] - c["duration_s"][0])
        c["s_mm"] = c["s_mm"] - (float(np.asarray(whole["s_mm"])[begin - 1]) if begin else 0.0)
    of_own = _findings_of(k, read, sequence, findings, begin)
    removal = replace(simulation.removal, columns=c)
    limits = list(program_limits(simulation, c, name)) if len(own) else []
    if terms is not None and len(own):
        error = error_of("deflection_cutter_um", simulation.errors)
        limits.append(
            check_limit("deflection_cutter_um", 1000.0 * terms.deflection, c, track=name, error=error)
        )  # fmt: skip
    rows = list(step_rows(simulation, removal)) if len(own) else []
    columns = {key: np.concatenate([r[key] for r in rows]) for key in rows[0]} if rows else {}
    balance = {n: v for n, v in simulation.removal.energy_balance.items() if n == int(read.program.tool[0])}
    step = np.maximum(np.searchsorted(at, np.arange(len(read.program)), "right") - 1, 0)
    return ProgramRemoval(
        columns, step, tuple(limits), of_own, balance if terms is not None else {}, terms is not None,
        (simulation.removal.volume_before, simulation.removal.volume_after),
    )  # fmt: skip
