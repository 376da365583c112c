"""The function that simulates and checks a program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from chipload.api.values import AnyCutter, cutter_of, material_of
from chipload.checking.clamped import Workpiece
from chipload.checking.dynamics import Vibration
from chipload.checking.history import History
from chipload.checking.inputs import CheckInputs, Elasticity
from chipload.checking.outcome import ProgramResult, SimulationResult
from chipload.checking.run import simulate_program
from chipload.checking.settings import CheckSettings, Limits, SimulationSettings
from chipload.checking.stiffness import MachineStiffness
from chipload.checking.workpiece import FinishedPart, Fixture, Stock, Surroundings
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.lazy import trimesh
from chipload.machine.ini import read_ini
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.machine.table import MachineTable
from chipload.program.program import Program
from chipload.program.read import ProgramReading, line_times, read_program, reading_of
from chipload.program.setup import Setup
from chipload.progress import Progress, silent
from chipload.result.provenance import provenance_of
from chipload.stock.layers import LayeredStock
from chipload.units import mm_s_from_mm_min

#: longest step that is not stated, in diameters of the smallest cutter
STEP = 0.25
#: name of a program that is a value
VALUE = "program"


def simulate(
    program: Program | str | Path,
    stock: Stock | LayeredStock | trimesh.Trimesh,
    cutters: AnyCutter | Sequence[AnyCutter],
    material: Material | str | Path,
    machine: Machine | str | Path,
    limits: Limits | None = None,
    *,
    part: FinishedPart | None = None,
    fixtures: Sequence[Fixture] = (),
    machine_table: MachineTable | None = None,
    stiffness: MachineStiffness | None = None,
    dynamics: Vibration | None = None,
    workpiece: Workpiece | None = None,
    checks: CheckSettings | None = None,
    step_mm: float | None = None,
    settings: SimulationSettings | None = None,
    dialect: str | None = None,
    feed_mm_min: float | None = None,
    progress: Progress = silent,
) -> History:
    """Simulate a program in its stock: the removal, the loads and the deflection of each step, and the part it leaves.

    Parameters
    ----------
    program : motions, or a file of NC text or CL data
    stock : before the program; it does not change
    cutters : one, which is the only tool of the program, or several with the tool numbers of the program
    material, machine : a value, a shipped name, or a file
    limits : of loads and part; None: the default checks alone
    part : the finished part, with which the program is compared
    fixtures : bodies that no tool may touch
    machine_table : in place of that of the machine
    stiffness : of holder, spindle and workpiece; what is not stated leaves deflections unproven
    dynamics : modes of cutter and workpiece; each step then has a stability margin
    workpiece : elastic, in its clamps; its deflection is calculated in the state of each step
    checks : switches of the default checks; None: all are made
    step_mm : longest step of the tip; None: a quarter of the smallest diameter
    settings : all settings of the simulation, in place of ``step_mm``
    dialect, feed_mm_min : of the program's file: controller, and feed of cuts before the program states one

    Returns
    -------
    History
        A :class:`chipload.Result` with the columns of each step.

    Raises
    ------
    InputError
        A value cannot be used; the message names it.
    Cancelled
        By ``progress``.

    Examples
    --------
    >>> from chipload.program.build import plunge, rapid
    >>> mill = Cutter(10.0, 2, 0.5, 20.0, 30.0, 5.8e5)
    >>> path = [rapid([-6, 0, -1], 300.0, 1, "link"), plunge([30, 0, -1], 8.0, 300.0, 1, "cut")]
    >>> block, limits = Stock.block((0, -9, -5), (20, 9, 0)), Limits(force_n=500.0)
    >>> slot = simulate(Program.join(path), block, mill, "al7075-t6", "vmc", limits, step_mm=6.0)
    >>> str(slot.verdict), round(slot.numbers["removed_mm3"], 3)
    ('holds', 200.0)
    """
    if settings is not None and step_mm is not None:
        raise InputError(f"step_mm = {step_mm:g}: stated with settings, which state it: leave one out")
    on, metal = _machine(machine), material_of(material)
    tolerance = SimulationSettings.tolerance_mm if settings is None else settings.tolerance_mm
    reading, tools = _with_cutters(program, on, cutters, dialect, feed_mm_min, tolerance)
    if settings is None:
        smallest = min(c.diameter for c in tools.values())
        settings = SimulationSettings(STEP * smallest if step_mm is None else step_mm)
    inputs = CheckInputs(
        cutters=tools,
        material=metal,
        machine=on,
        stock=stock if isinstance(stock, Stock) else Stock(stock),
        settings=settings,
        limits=limits or Limits(),
        checks=checks or CheckSettings(),
        surroundings=Surroundings(part, tuple(fixtures), machine_table),
        elasticity=Elasticity(stiffness, workpiece, dynamics),
    )
    layers = inputs.stock.layered(reading.program, tools)
    done = simulate_program(inputs, reading, layers, progress=progress)
    path = Path(VALUE) if isinstance(program, Program) else Path(program)
    files = {} if isinstance(program, Program) else {"program": path}
    return _history(inputs, reading, done, path, files)


def _history(
    inputs: CheckInputs, reading: ProgramReading, done: SimulationResult, path: Path, files: dict[str, Path]
) -> History:
    """Return the result of a simulation; ``files`` are those of the program."""
    around = inputs.surroundings
    fixtures = {f"fixture {k}": fixture for k, fixture in enumerate(around.fixtures)}
    bodies = {"stock": inputs.stock, "part": around.part, **fixtures}
    files |= {name: body.file for name, body in bodies.items() if body is not None and body.file is not None}
    lines, seconds = line_times(reading, inputs.machine)
    provenance = provenance_of(files, (), inputs.machine, (inputs.material,))
    return History.of(
        ProgramResult(path.stem, path.name, reading, lines, seconds, inputs.machine, provenance, done, inputs.cutters)
    )


def _with_cutters(
    program: Program | str | Path,
    machine: Machine,
    cutters: AnyCutter | Sequence[AnyCutter],
    dialect: str | None,
    feed: float | None,
    tolerance: float,
) -> tuple[ProgramReading, dict[int, Cutter]]:
    """Return the program on its machine, and its cutters by tool number."""
    if isinstance(program, Program):
        for key, value in (("dialect", dialect), ("feed_mm_min", feed)):
            if value is not None:
                raise InputError(f"{key}: applies to a program file: leave it out with a Program")
        reading = reading_of(program, machine, tolerance=tolerance)
        return reading, _by_number(cutters, reading.program)
    speed = None if feed is None else mm_s_from_mm_min(feed)

    def read(known: dict[int, Cutter]) -> ProgramReading:
        setup = Setup(cutters=known)
        return read_program(program, machine, dialect=dialect, feed=speed, tolerance=tolerance, setup=setup)

    tools = _by_number(cutters, read({}).program)
    # what the text states about its tools is compared with the cutters, and compensation takes their diameters
    return read(tools), tools


def _by_number(cutters: AnyCutter | Sequence[AnyCutter], program: Program) -> dict[int, Cutter]:
    """Return the cutters by tool number; a single cutter is the only tool of the program."""
    several = [cutters] if isinstance(cutters, AnyCutter) else list(cutters)
    if not several:
        raise InputError("cutters: missing: give at least one")
    found = [cutter_of(cutter, "cutters") for cutter in several]
    if len(found) > 1:
        numbers = [cutter.number for cutter in found]
        if len(set(numbers)) < len(numbers):
            raise InputError(f"cutters: numbers {', '.join(map(str, numbers))}: give each cutter its own")
        return dict(zip(numbers, found, strict=True))
    used = sorted(set(np.asarray(program.tool).tolist()))
    if len(used) > 1:
        raise InputError(f"cutters: the program uses tools {', '.join(map(str, used))}: give a cutter for each")
    return {used[0]: replace(found[0], number=used[0])}


def _machine(name: Machine | str | Path) -> Machine:
    if isinstance(name, Machine):
        return name
    ending = Path(name).suffix.lower()
    if ending == ".ini":
        return read_ini(Path(name))[0]
    return read_machine(name) if isinstance(name, Path) or ending == ".toml" else machine_named(name)
