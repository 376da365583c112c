"""Simulate a program from plain Python values, as in a notebook.

The inputs of a job file are plain values here: a Program or a file, a stock, cutters, a material, a machine, limits.
Only the resolution of the simulation has default values; the summary states them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import numpy as np
import trimesh
from numpy.typing import ArrayLike
from pydantic import BaseModel, ValidationError

from chipload.checking.clamped import clamp_errors
from chipload.cutter.cutter import Cutter
from chipload.cutter.table import CutterTable, cutter_from_table
from chipload.cutting.material import Material, material_named, read_material
from chipload.errors import InputError
from chipload.jobs.messages import Errors, table_errors
from chipload.jobs.program.history import History
from chipload.jobs.program.run import simulate_read
from chipload.jobs.program.tables import ProgramJobTable
from chipload.jobs.simulation.job import ProgramJob
from chipload.jobs.simulation.tables import FixtureTable, SolidTable, TargetTable
from chipload.jobs.tables import Table
from chipload.machine.ini import read_ini
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.program.program import Program
from chipload.program.read import ProgramReading, read_program, reading_of
from chipload.program.setup import Setup
from chipload.program.to_work import TOLERANCE_MM
from chipload.progress import Progress, silent
from chipload.result.provenance import provenance_of
from chipload.stock.layers import LayeredStock
from chipload.units import mm_s_from_mm_min

#: a body: a mesh, a file, or the keys of its table with ``mesh`` or ``file``
Body: TypeAlias = trimesh.Trimesh | str | Path | Mapping[str, Any]
#: a stock also: layers that there are, or two corners of a block
Stock: TypeAlias = LayeredStock | Body | Sequence[ArrayLike]
#: cutters: one, a table of numbers with units in their names, or several by tool number
Cutters: TypeAlias = CutterTable | Cutter | Mapping[str, Any] | Mapping[int, CutterTable | Cutter | Mapping[str, Any]]

#: lengths that are not given, in diameters of the smallest cutter: a step, points of part and fixtures
STEP, SPACING = 0.25, 0.1
#: what stands for the name of a file where a value is given
VALUE = "program"

Model = TypeVar("Model", bound=BaseModel)


def simulate(
    program: Program | str | Path,
    stock: Stock,
    cutter: Cutters,
    material: Material | str | Path,
    machine: Machine | str | Path,
    limits: Mapping[str, float],
    *,
    part: Body | None = None,
    fixtures: Sequence[Body] = (),
    stiffness: Mapping[str, float] | None = None,
    dynamics: Mapping[str, Any] | None = None,
    workpiece: Mapping[str, Any] | None = None,
    checks: Mapping[str, Any] | None = None,
    step_mm: float | None = None,
    layer_mm: float | None = None,
    tolerance_mm: float = TOLERANCE_MM,
    dialect: str | None = None,
    feed_mm_min: float | None = None,
    progress: Progress = silent,
    **settings: Any,
) -> History:
    """Simulate a program in its stock: the removal, the loads and the deflection of each step, and the part it leaves.

    Parameters
    ----------
    program : motions, or a file of NC text or CL data
    stock : layers (not changed), a closed mesh [mm], a file, two corners of a block [mm], or keys of ``[stock]``
    cutter : a ``chipload.Cutter``, keys of a ``[[cutter]]``, or several by tool number; one is the only tool
    material, machine : a value, a shipped name, or a file
    limits : by the names that ``[limits]`` of a job has, as ``{"force_n": 800.0}``; none: the default checks
    part : the finished part: mesh [mm], file, or keys of ``[part]`` (``mesh`` in place of ``file``)
    fixtures : bodies that no tool may touch: meshes [mm], files, or keys of ``[[fixture]]``
    stiffness : keys of ``[stiffness]``; what is not stated leaves deflections unproven
    dynamics : keys of ``[dynamics]``, as ``{"mode": ({"frequency_hz": 812.0, ...},)}``; each step then has a margin
    workpiece : keys of ``[workpiece]``, as ``{"modulus_gpa": 70.0, "poisson": 0.33, "clamp": ({"face": "z-"},)}``;
        the deflection of the workpiece in its clamps is then calculated in the state of each step
    checks : keys of ``[checks]``, which are made unless one is false, as ``{"cutter_strength": False}``
    step_mm : longest step of the tip; None: a quarter of the smallest diameter
    layer_mm : thickness of the layers of a block or a mesh; None: from depths of cut and cutters
    tolerance_mm : greatest deviation of the edges of chips, and of moves with a rotary axis
    dialect, feed_mm_min : of the program's file, as in ``[program]``
    settings : further keys of the operation: ``interpolation``, ``engine``, ``corner_slices``, ``flank_mm``,
        ``stock_points_mm``, ``confidence``, ``workers``

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
    >>> block = ([0, -9, -5], [20, 9, 0])
    >>> slot = simulate(Program.join(path), block, mill, "al7075-t6", "vmc", {"force_n": 500.0}, step_mm=6.0)
    >>> str(slot.verdict), round(slot.numbers["removed_mm3"], 3)
    ('holds', 200.0)
    """
    on, metal = _machine(machine), _material(material)
    reading, cutters = _with_cutters(program, on, dialect, feed_mm_min, tolerance_mm, cutter)
    smallest = min(c.diameter for c in cutters.values())
    meshes: dict[str, trimesh.Trimesh] = {}
    name = Path(VALUE) if isinstance(program, Program) else Path(program)
    files = {} if isinstance(program, Program) else {"program": name}
    finest = {"step_mm": STEP * smallest if step_mm is None else step_mm, "tolerance_mm": tolerance_mm}
    table: dict[str, Any] = {
        "program": {"file": name.name or VALUE},
        "machine": {"name": on.name},
        "material": {"name": metal.name},
        "operation": ({"kind": "simulate", **finest, **settings},),
        "limits": dict(limits),
        "checks": dict(checks or {}),
    }
    stated = {"stiffness": stiffness, "dynamics": dynamics, "workpiece": workpiece}
    table |= {key: dict(of) for key, of in stated.items() if of is not None}
    table |= _stock(stock, layer_mm, meshes, files)
    table |= _bodies(part, fixtures, SPACING * smallest, meshes, files)
    made = _table(table, ProgramJobTable)
    _require_sources(made)
    job = ProgramJob(
        path=Path(name).absolute(), table=made, program_file=name, tools_file=None, machine=on.name, overrides=(),
        cutters=cutters, material=metal.name, meshes=meshes,
    )  # fmt: skip
    provenance = provenance_of(files, (), on, (metal,))
    return History(simulate_read(job, reading, on, metal, _copy(stock), provenance, progress))


def _stock(
    stock: Stock, layer_mm: float | None, meshes: dict[str, trimesh.Trimesh], files: dict[str, Path]
) -> dict[str, Any]:
    """Return the table of the stock; a stock in layers has none."""
    if not isinstance(stock, LayeredStock):
        return {"stock": _solid(stock, layer_mm, meshes, files)}
    if layer_mm is not None:
        raise InputError("layer_mm: the stock has its own layers: leave it out")
    return {}


def _bodies(
    part: Body | None,
    fixtures: Sequence[Body],
    spacing: float,
    meshes: dict[str, trimesh.Trimesh],
    files: dict[str, Path],
) -> dict[str, Any]:
    """Return the tables of the part, if there is one, and of the fixtures."""
    found = {} if part is None else {"part": _body("part", part, TargetTable, spacing, meshes, files)}
    of_fixtures = (_body(f"fixture {k}", body, FixtureTable, spacing, meshes, files) for k, body in enumerate(fixtures))
    return {**found, "fixture": tuple(of_fixtures)}


def _require_sources(made: ProgramJobTable) -> None:
    """Refuse limits whose inputs are not stated, and new speeds, which only a program text can have."""
    for key in ("form_error_um", "gouge_mm", "excess_mm"):
        if made.part is None and getattr(made.limits, key) is not None:
            raise InputError(f"limits.{key}: needs the finished part: give part or leave it out")
    for key in ("stability_margin", "stable_probability", "sle_um"):
        if made.dynamics is None and getattr(made.limits, key) is not None:
            raise InputError(f"limits.{key}: needs modes of vibration: give dynamics or leave it out")
    errors = Errors()
    errors.texts += clamp_errors(made)
    errors.refuse()
    if made.operation[0].speeds is not None:
        raise InputError("speeds: can only be changed in the program of a job: write a job and use chipload run")


def _with_cutters(
    program: Program | str | Path,
    machine: Machine,
    dialect: str | None,
    feed: float | None,
    tolerance: float,
    cutter: Cutters,
) -> tuple[ProgramReading, dict[int, Cutter]]:
    """Return the program on its machine, and its cutters by tool number."""
    reading = _reading(program, machine, dialect, feed, tolerance)
    cutters = _cutters(cutter, reading.program)
    if isinstance(program, Program):
        return reading, cutters
    # what the text states about its tools is held against the cutters, and compensation takes their diameters
    return _reading(program, machine, dialect, feed, tolerance, cutters), cutters


def _reading(
    program: Program | str | Path,
    machine: Machine,
    dialect: str | None,
    feed: float | None,
    tolerance: float,
    cutters: Mapping[int, Cutter] | None = None,
) -> ProgramReading:
    """Return the program on its machine."""
    if isinstance(program, Program):
        for key, value in (("dialect", dialect), ("feed_mm_min", feed)):
            if value is not None:
                raise InputError(f"{key}: applies to a program file: leave it out with a Program")
        return reading_of(program, machine, tolerance=tolerance)
    speed = None if feed is None else mm_s_from_mm_min(feed)
    setup = Setup(cutters=cutters or {})
    return read_program(program, machine, dialect=dialect, feed=speed, tolerance=tolerance, setup=setup)


def _machine(given: Machine | str | Path) -> Machine:
    if isinstance(given, Machine):
        return given
    ending = Path(given).suffix.lower()
    if ending == ".ini":
        return read_ini(Path(given))[0]
    return read_machine(given) if isinstance(given, Path) or ending == ".toml" else machine_named(given)


def _material(given: Material | str | Path) -> Material:
    if isinstance(given, Material):
        return given
    is_file = isinstance(given, Path) or given.lower().endswith(".toml")
    return read_material(given) if is_file else material_named(str(given))


def _cutters(given: Cutters, program: Program) -> dict[int, Cutter]:
    """Return the cutters by tool number; a single cutter is the only tool of the program."""
    if isinstance(given, Mapping) and all(isinstance(k, int) for k in given):
        if not given:
            raise InputError("cutter: missing: give at least one")
        several = {int(k): _cutter(v, int(k)) for k, v in given.items()}
        return {k: replace(c, number=k) for k, c in several.items()}
    used = sorted(set(np.asarray(program.tool).tolist()))
    alone = _cutter(given, used[0])
    if len(used) > 1:
        raise InputError(
            f"cutter: the program uses tools {', '.join(map(str, used))}: give one for each, as {{{used[0]}: ...}}"
        )
    return {used[0]: replace(alone, number=used[0])}


def _cutter(given: Any, number: int) -> Cutter:
    if isinstance(given, Cutter):
        return given
    if isinstance(given, CutterTable):
        given = given.model_dump(exclude_none=True)
    if not isinstance(given, Mapping):
        raise InputError(f"cutter {number}: {type(given).__name__}: give a chipload.Cutter or the keys of a [[cutter]]")
    return cutter_from_table({"number": number, **given})


def _solid(
    stock: Any, layer: float | None, meshes: dict[str, trimesh.Trimesh], files: dict[str, Path]
) -> SolidTable | dict[str, Any]:
    """Return the table of a stock."""
    if isinstance(stock, (list, tuple, np.ndarray)):
        low, high = (tuple(float(v) for v in np.asarray(corner, dtype=np.float64).ravel()) for corner in stock)
        return {"low_mm": low, "high_mm": high, "layer_mm": layer}
    if isinstance(stock, Mapping) and "mesh" not in stock and "file" not in stock:
        return {"layer_mm": layer, **stock}
    body = _source("stock", stock, meshes, files)
    saved = str(body.get("file", "")).lower().endswith(".npz")
    return body if saved else {"layer_mm": layer, **body}


def _body(
    name: str,
    given: Body,
    kind: type[Table],
    spacing: float,
    meshes: dict[str, trimesh.Trimesh],
    files: dict[str, Path],
) -> Table:
    """Return the table of a part or a fixture."""
    return _table({"spacing_mm": spacing, **_source(name, given, meshes, files)}, kind)


def _source(name: str, given: Any, meshes: dict[str, trimesh.Trimesh], files: dict[str, Path]) -> dict[str, Any]:
    """Return the keys of a table whose body is a mesh or a file; a mesh is added to ``meshes``."""
    keys = dict(given) if isinstance(given, Mapping) else {}
    body = keys.pop("mesh", keys.pop("file", None)) if isinstance(given, Mapping) else given
    if isinstance(body, trimesh.Trimesh):
        meshes[name] = body
        return {**keys, "file": VALUE}
    if not isinstance(body, (str, Path)):
        raise InputError(f"{name}: {type(body).__name__}: give a mesh, a file, or the keys of its table")
    files[name] = Path(body)
    return {**keys, "file": str(Path(body).absolute())}


def _table(values: Mapping[str, Any], kind: type[Model]) -> Model:
    try:
        return kind.model_validate(values)
    except ValidationError as err:
        errors = Errors()
        errors.texts += table_errors(err, kind)
        errors.refuse()
        raise


def _copy(stock: Stock) -> LayeredStock | None:
    """Return a copy of the layers, so that those of the caller do not change; None if the stock is not in layers."""
    if not isinstance(stock, LayeredStock):
        return None
    out = LayeredStock(stock.bounds, stock.xs, stock.ys, stock.tiles, stock.part)
    out.restore(stock.state())
    return out
