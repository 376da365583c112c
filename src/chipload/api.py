"""The functions of chipload in Python: what the command line does, from values.

Tables and keys are those of the job file, with the units in their names; ``docs/jobs.md`` lists them. Every function
that plans or simulates builds the job that a TOML file of the same keys gives, and gives back its result and what is
written into a result folder. Libraries are imported when a function is called.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from chipload.errors import InputError
from chipload.progress import Progress, silent

if TYPE_CHECKING:
    from chipload.cutter.table import CutterTable
    from chipload.cutting.material import Material
    from chipload.jobs import FinishedJob, LoadedJob
    from chipload.machine.machine import Machine
    from chipload.program.read import ProgramReading
    from chipload.program.setup import Setup
    from chipload.result import Result

#: a table of the job file by its keys
Values: TypeAlias = Mapping[str, Any]
#: one table, or several
Tables: TypeAlias = Values | Sequence[Values]
#: a shipped name, a file (``Path``, or a text that ends in .toml or .ini), or keys of the table
Source: TypeAlias = str | Path | Values
#: one ``[[cutter]]`` or several
Cutters: TypeAlias = "CutterTable | Values | Sequence[CutterTable | Values]"


# -- reading ----------------------------------------------------------------------------------------------------
def read_machine(name: str | Path) -> Machine:
    """Read a machine: a shipped one by its name, a TOML file or a LinuxCNC configuration (.ini).

    Raises
    ------
    InputError
        There is none of this name, or the file cannot be read.

    Examples
    --------
    >>> read_machine("vmc").name
    'vmc'
    """
    if Path(name).suffix.lower() == ".ini":
        from chipload.machine.ini import read_ini

        return read_ini(name)[0]
    from chipload.machine import machine

    return machine.read_machine(name) if _is_file(name) else machine.machine_named(str(name))


def read_material(name: str | Path) -> Material:
    """Read force coefficients: a shipped material by its name, or a TOML file.

    Raises
    ------
    InputError
        There is none of this name, or the file cannot be read.

    Examples
    --------
    >>> read_material("al7075-t6").name
    'al7075-t6'
    """
    from chipload.cutting import material

    return material.read_material(name) if _is_file(name) else material.material_named(str(name))


def read_program(
    path: str | Path,
    machine: Machine | str | Path,
    *,
    dialect: str | None = None,
    tools: str | Path | None = None,
    feed_mm_min: float | None = None,
    tolerance_mm: float = 0.001,
    setup: Setup | None = None,
    progress: Progress = silent,
) -> ProgramReading:
    """Read NC text or CL data as the controller of a machine does.

    Parameters
    ----------
    path : .ngc, .nc, .h, .apt, .cls and so on
    machine : a value, a shipped name or a file
    dialect : linuxcnc, fanuc, sinumerik, heidenhain or apt; None: by the ending of the file and by the machine
    tools : LinuxCNC tool table
    feed_mm_min : feed of cuts before the program states one
    tolerance_mm : how far the tip may leave its path where a move with rotary axes is cut up
    setup : values that the controller holds, work offsets and cutters

    Returns
    -------
    ProgramReading
        ``program`` is the :class:`chipload.Program`; ``findings`` are the reader's,
        ``violations`` what the machine cannot do.

    Raises
    ------
    InputError
        The program cannot be read, or the machine has not the axes that it moves.
    """
    from chipload.program import read
    from chipload.units import mm_s_from_mm_min

    return read.read_program(
        path,
        read_machine(machine) if isinstance(machine, (str, Path)) else machine,
        dialect=dialect,
        tools=None if tools is None else read.read_tools(tools),
        feed=None if feed_mm_min is None else mm_s_from_mm_min(feed_mm_min),
        tolerance=tolerance_mm,
        setup=setup,
        progress=progress,
    )


# -- planning ---------------------------------------------------------------------------------------------------
def plan_contour(
    *,
    part: Source,
    stock: Values,
    machine: Source,
    material: Source,
    cutter: Cutters,
    operation: Tables,
    limits: Values,
    checks: Values | None = None,
    folder: str | Path = ".",
    progress: Progress = silent,
) -> FinishedJob:
    """Plan passes along contours of a drawing and prove their programs.

    Parameters
    ----------
    part : keys of ``[part]``, or the drawing (DXF, STEP) alone
    stock : keys of ``[stock]``, as ``{"top_mm": 0.0}``
    machine, material : a shipped name, a file, or keys of the table
    cutter : one :class:`chipload.Cutter`, or several
    operation : keys of an ``[[operation]]`` of kind ``contour`` or ``forward``, or several
    limits : keys of ``[limits]``, as ``{"engagement_deg": 13.0}``
    checks : keys of ``[checks]``: which default checks are switched off; None: all are made
    folder : that file names are relative to

    Returns
    -------
    FinishedJob
        ``result`` with verdict, limits and tracks; ``save(out)`` writes programs and report.

    Raises
    ------
    InputError
        A key is unknown, missing or out of range, a file cannot be read, or the operation is of another kind.
    Cancelled
        By ``progress``.

    Examples
    --------
    >>> plan_contour(part="a.dxf", stock={}, machine="vmc", material="al7075-t6", cutter=[], limits={},
    ...              operation={"kind": "pocket"})
    Traceback (most recent call last):
        ...
    chipload.errors.InputError: operation.0.kind = 'pocket': must be one of 'contour', 'forward'
    """
    return _run(
        "contour", folder, progress, ("contour", "forward"), part=part, stock=stock, machine=machine, material=material,
        cutter=_cutters(cutter), operation=operation, limits=limits, checks=checks,
    )  # fmt: skip


def plan_pocket(
    *,
    part: Source,
    stock: Values,
    machine: Source,
    material: Source,
    cutter: Cutters,
    operation: Tables,
    limits: Values,
    checks: Values | None = None,
    folder: str | Path = ".",
    progress: Progress = silent,
) -> FinishedJob:
    """Plan the clearing of pockets at constant engagement and prove its programs.

    Parameters, result and errors are those of :func:`plan_contour`; every operation is of kind ``pocket``.

    Examples
    --------
    >>> plan_pocket(part="a.dxf", stock={}, machine="vmc", material="al7075-t6", cutter=[], limits={},
    ...             operation={"kind": "contour"})
    Traceback (most recent call last):
        ...
    chipload.errors.InputError: operation.0.kind = 'contour': must be 'pocket'
    """
    return _run(
        "contour", folder, progress, ("pocket",), part=part, stock=stock, machine=machine, material=material,
        cutter=_cutters(cutter), operation=operation, limits=limits, checks=checks,
    )  # fmt: skip


def plan_impeller(
    *,
    impeller: Values,
    surface: Tables,
    catalogue: Source,
    machine: Source,
    operation: Tables,
    folder: str | Path = ".",
    progress: Progress = silent,
) -> FinishedJob:
    """Plan the milling of an impeller: the largest cutters that reach its surfaces, and their five-axis programs.

    Result and errors are those of :func:`plan_contour`.

    Parameters
    ----------
    impeller : keys of ``[impeller]``
    surface : keys of a ``[[surface]]``, or several
    catalogue : of cutters: a shipped name, a file, or keys of the table
    machine : likewise
    operation : keys of the ``[[operation]]``
    folder : that file names are relative to
    """
    return _run(
        "impeller", folder, progress, impeller=impeller, surface=surface, catalogue=catalogue, machine=machine,
        operation=operation,
    )  # fmt: skip


def plan_thin_wall(
    *,
    wall: Values,
    workpiece: Values,
    machine: Source,
    material: Source,
    cutter: Cutters,
    operation: Tables,
    limits: Values,
    threshold: Source | None = None,
    checks: Values | None = None,
    folder: str | Path = ".",
    progress: Progress = silent,
) -> FinishedJob:
    """Plan the semi-finishing and finishing of a thin wall so that its deflection stays below a limit.

    Result and errors are those of :func:`plan_contour`.

    Parameters
    ----------
    wall, workpiece : keys of ``[wall]`` and ``[workpiece]``
    machine, material : a shipped name, a file, or keys of the table
    cutter : one :class:`chipload.Cutter`, or several
    operation : keys of the ``[[operation]]``
    limits : keys of ``[limits]``
    threshold : measured calibration cuts: a file, or keys of ``[threshold]``; None: the threshold is calculated
    checks : keys of ``[checks]``: which default checks are switched off; None: all are made
    folder : that file names are relative to
    """
    return _run(
        "thinwall", folder, progress, wall=wall, workpiece=workpiece, machine=machine, material=material,
        threshold=threshold, cutter=_cutters(cutter), operation=operation, limits=limits, checks=checks,
    )  # fmt: skip


# -- simulation and control -------------------------------------------------------------------------------------
def hold_torque(
    *,
    torque_control: Values,
    machine: Source,
    material: Source,
    cutter: Cutters,
    spindle: Values,
    loop: Values,
    simulation: Values,
    limits: Values,
    program: Source | None = None,
    round: Values | None = None,
    surprise: Tables = (),
    checks: Values | None = None,
    folder: str | Path = ".",
    progress: Progress = silent,
) -> FinishedJob:
    """Simulate the control of the cutting torque on a thin tube or cone.

    Result and errors are those of :func:`plan_contour`.

    Parameters
    ----------
    torque_control, spindle, loop, simulation, limits : keys of the table of this name
    machine, material : a shipped name, a file, or keys of the table
    cutter : one :class:`chipload.Cutter`, or several
    program, round : a program that exists (its file or keys), or keys of ``[round]`` by which one is made
    surprise : keys of a ``[[surprise]]``, or several
    checks : keys of ``[checks]``: which default checks are switched off; None: all are made
    folder : that file names are relative to
    """
    return _run(
        "torque", folder, progress, torque_control=torque_control, program=program, round=round, machine=machine,
        material=material, cutter=_cutters(cutter), surprise=surprise, spindle=spindle, loop=loop,
        simulation=simulation, limits=limits, checks=checks,
    )  # fmt: skip


def optimise_feeds(
    *,
    program: Source,
    stock: Values,
    machine: Source,
    material: Source,
    cutter: Cutters,
    operation: Tables,
    limits: Values,
    part: Source | None = None,
    fixture: Tables = (),
    stiffness: Values | None = None,
    workpiece: Values | None = None,
    dynamics: Values | None = None,
    checks: Values | None = None,
    folder: str | Path = ".",
    progress: Progress = silent,
) -> FinishedJob:
    """Give the lines of a program the greatest feeds that its limits of loads allow; the path stays.

    Result and errors are those of :func:`plan_contour`.

    Parameters
    ----------
    program : the program's file, or keys of ``[program]``
    stock : keys of ``[stock]``
    machine, material : a shipped name, a file, or keys of the table
    cutter : one :class:`chipload.Cutter`, or several
    operation : keys of the ``[[operation]]`` of kind ``simulate``, with its table ``feeds``
    limits : keys of ``[limits]``; at least one of a load
    part, fixture, stiffness, workpiece, dynamics, checks : keys of the table of this name; None: it is left out
    folder : that file names are relative to
    """
    for k, op in enumerate(_tables("operation", operation)):
        if op.get("feeds") is None:
            raise InputError(f"operation.{k}.feeds: missing: state the range of the new feeds; without it use simulate")
    return _run(
        "program", folder, progress, ("simulate",), program=program, stock=stock, machine=machine, material=material,
        cutter=_cutters(cutter), operation=operation, limits=limits, part=part, fixture=fixture, stiffness=stiffness,
        workpiece=workpiece, dynamics=dynamics, checks=checks,
    )  # fmt: skip


def fit_coefficients(
    *,
    name: str,
    source: str,
    method: str,
    cutter: CutterTable | Values,
    engagement: Values,
    channels: Values,
    measurement: Tables,
    limits: Values,
    folder: str | Path = ".",
    progress: Progress = silent,
    **settings: Any,
) -> FinishedJob:
    """Identify force coefficients from measured forces, and predict the measurements that are kept back.

    ``result.operations[0]`` holds the coefficients with their intervals, ``outcome.material`` the
    :class:`chipload.Material`; ``save(out)`` writes material.toml and the report. Errors are those of
    :func:`plan_contour`.

    Parameters
    ----------
    name, source : of the material that is made
    method : ``average`` or ``instantaneous``
    cutter : that was used
    engagement, channels, limits : keys of the table of this name
    measurement : keys of a ``[[measurement]]``, or several
    folder : that file names are relative to
    settings : further keys: ``workpiece``, ``conditions``, ``band_hz``, ``runout``, ``zero``, ``dynamometer``,
        ``axial``
    """
    return _run(
        "fit", folder, progress, name=name, source=source, method=method, cutter=cutter, engagement=engagement,
        channels=channels, measurement=measurement, limits=limits, **settings,
    )  # fmt: skip


# -- jobs and results -------------------------------------------------------------------------------------------
def run_job(
    job: str | Path | Values,
    overrides: Sequence[str] = (),
    *,
    folder: str | Path = ".",
    progress: Progress = silent,
) -> FinishedJob:
    """Run a job of any kind; nothing is written.

    Parameters
    ----------
    job : the job file, or its tables as values
    overrides : ``key.path=value`` texts, as ``--set`` takes them
    folder : that file names in values are relative to; those in a job file are relative to the file

    Raises
    ------
    InputError
        The job, or a file that it names, cannot be used.
    Cancelled
        By ``progress``.
    """
    from chipload import jobs

    return jobs.run_job(_loaded(job, overrides, folder), progress)


def check_job(
    job: str | Path | Values, overrides: Sequence[str] = (), *, folder: str | Path = "."
) -> tuple[list[str], bool]:
    """Read all that a job names without running it: a line for each thing that was found, and whether it holds.

    Parameters and errors are those of :func:`run_job`.
    """
    from chipload import jobs

    return jobs.check_job(_loaded(job, overrides, folder))


def write_result(job: FinishedJob, out: str | Path) -> Path:
    """Write the folder that ``chipload run`` writes, whole or not at all, and return it.

    Raises
    ------
    InputError
        The folder holds something else than an older result.
    OutputError
        It cannot be written.
    """
    return job.save(out)


def load_result(folder: str | Path) -> Result:
    """Read a result folder back; histories are read when they are asked for.

    Raises
    ------
    InputError
        The folder holds no result that can be read.
    """
    from chipload.result import load

    return load.load_result(folder)


# -- tables from values -----------------------------------------------------------------------------------------
#: tables that a file alone may stand for; those that a shipped name may stand for too; those of which there are several
FILES, SOURCES = ("part", "program", "threshold"), ("machine", "material", "catalogue")
SEVERAL = ("operation", "surface", "surprise", "fixture", "measurement")


def _run(
    capability: str, folder: str | Path, progress: Progress, kinds: tuple[str, ...] = (), /, **given: Any
) -> FinishedJob:
    """Run the job of these tables; None: the table is left out. Its operations must be of one of ``kinds``."""
    from chipload import jobs

    tables = {key: _shaped(key, value) for key, value in given.items() if value is not None}
    for k, op in enumerate(tables["operation"] if kinds else ()):
        if op.get("kind") not in kinds:
            known = f"{'one of ' if len(kinds) > 1 else ''}{', '.join(map(repr, kinds))}"
            raise InputError(f"operation.{k}.kind = {op.get('kind')!r}: must be {known}")
    return jobs.run_job(jobs.job_of(tables, folder, capability=capability), progress)


def _shaped(key: str, given: Any) -> Any:
    """The table or tables that a value of this key stands for."""
    if key in FILES:
        return _file(key, given)
    if key in SOURCES:
        return _source(key, given)
    return _tables(key, given) if key in SEVERAL else given


def _loaded(job: str | Path | Values, overrides: Sequence[str], folder: str | Path) -> LoadedJob:
    from chipload import jobs

    if isinstance(job, Mapping):
        return jobs.job_of(job, folder, overrides)
    return jobs.load_job(job, overrides)


def _tables(key: str, given: Tables) -> list[Values]:
    """One table or several, as a list."""
    several = [given] if isinstance(given, Mapping) else list(given)
    for k, one in enumerate(several):
        if not isinstance(one, Mapping):
            raise InputError(f"{key}.{k} = {one!r}: must be a table of keys and values")
    return several


def _cutters(given: Any) -> list[Any]:
    """One cutter or several, as a list."""
    return list(given) if isinstance(given, (list, tuple)) else [given]


def _source(key: str, given: Source) -> Values:
    """The table of a shipped thing or of a file."""
    table = _file(key, given)
    if isinstance(given, Mapping) or _is_file(given):
        return table
    return {"name": given}


def _file(key: str, given: Source) -> Values:
    """The table of a file."""
    if isinstance(given, Mapping):
        return given
    if not isinstance(given, (str, Path)):
        raise InputError(f"{key}: {type(given).__name__}: give a name, a file, or the keys of its table")
    return {"file": str(given)}


def _is_file(name: str | Path) -> bool:
    return isinstance(name, Path) or Path(name).suffix.lower() in (".toml", ".ini")
