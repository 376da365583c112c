"""What any file that chipload reads holds: a job, or one of the files that they name; nothing is run.

The kind of a TOML file follows from the tables and keys that only it has, that of another file from its extension.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from chipload.errors import InputError
from chipload.files import read_regular
from chipload.jobs import CAPABILITIES, check_job, load_job
from chipload.number_text import number_text
from chipload.tables import LARGEST_FILE, parse_toml

#: lines about a file, and whether what it holds can be used as it is
Inspected = tuple[list[str], bool]


def inspect_file(path: Path, overrides: Sequence[str] = ()) -> Inspected | None:
    """What a file holds; None: it is none of the kinds, so that it is read as a program.

    Parameters
    ----------
    overrides : ``key.path=value`` of a job

    Raises
    ------
    InputError
        It cannot be read, or would be refused where it is used: a line for each error of a job.
    """
    ending = path.suffix.lower()
    if ending == ".toml":
        kind = _toml_kind(path)
        return check_job(load_job(path, overrides)) if kind is None else (kind(path), True)
    reader = BY_ENDING.get(ending)
    return None if reader is None else (reader(path), True)


def _toml_kind(path: Path) -> Callable[[Path], list[str]] | None:
    """How a TOML file is read that is no job; None: it is one."""
    values = parse_toml(path.name, read_regular(path, str(path), LARGEST_FILE, "not a file of chipload"))
    if set(MEASURED_WALLS) <= set(values):
        return _walls
    if any(c.key in values for c in CAPABILITIES):
        return None
    if any(isinstance(table, dict) and "column" in table for table in values.values()):
        return _columns
    return next((reader for keys, reader in BY_KEYS if keys <= set(values)), None)


def inspect_folder(folder: Path) -> Inspected:
    """What the TOML files of a folder hold, as the machines, spindles, materials, cutters, modes and jobs of a cell; a
    file that would be refused, and a job that names a material of which the folder has a learned one.

    Raises
    ------
    InputError
        It has no TOML file.
    """
    files = sorted(folder.glob("*.toml"))
    if not files:
        raise InputError(f"{folder}: no TOML file: name a folder with the files of a cell, or a file")
    lines, holds = [], True
    for path in files:
        try:
            found = inspect_file(path)
        except InputError as err:
            lines.append(f"{path.name}: refused: {err}")
            holds = False
            continue
        if found is not None:
            lines += found[0]
            holds &= found[1]
    return [*lines, *_superseded_lines(files)], holds


def _superseded_lines(files: Sequence[Path]) -> list[str]:
    """Lines on jobs whose material was learned further in another file."""
    from chipload.cutting.material import read_material

    learned, jobs = {}, {}
    for path in files:
        with suppress(InputError):
            if _toml_kind(path) is _material:
                made = read_material(path)
                if made.learned is not None:
                    learned[made.learned.prior] = f"{path.name} ({made.name})"
            elif (named := getattr(load_job(path).job, "material", None)) is not None:
                jobs[path.name] = read_material(named).name if isinstance(named, Path) else str(named)
    return [
        f"{job}: names {name}, which was learned further: {learned[name]} knows it better"
        for job, name in jobs.items()
        if name in learned
    ]


def _material(path: Path) -> list[str]:
    from chipload.cutting.material import knowledge_text, read_material

    made = read_material(path)
    names = ("Ktc", "Krc", "Kac", "Kte", "Kre", "Kae")
    values = ", ".join(f"{name} {v:g}" for name, v in zip(names, made.coefficients, strict=True))
    knowledge = knowledge_text(made)
    return [
        f"{path.name}: material {made.name}: {values} (MPa, N/mm)",
        f"source: {made.source}",
        *([f"learned: {knowledge}"] if knowledge else []),
    ]


def _spindle(path: Path) -> list[str]:
    from chipload.control.spindle_file import read_spindle

    made = read_spindle(path, None)
    constant = made.values.get("torque_constant_nm_a")
    name, unit = ("efficiency", "") if made.source == "power" else ("torque constant", " N m/A")
    error = number_text(100.0 * float(made.values.get("torque_constant_error_share", 0.0)), 2)
    known = "unknown" if constant is None else f"{number_text(float(constant))}{unit} +- {error} %"
    return [f"{path.name}: spindle identified by its {made.source}, {name} {known}"]


def _modes(path: Path) -> list[str]:
    from chipload.jobs.simulation.modes_file import read_modes

    modes = read_modes(path)
    low, high = (number_text(f(m.frequency_hz for m in modes)) for f in (min, max))
    span = low if low == high else f"{low} to {high}"
    return [f"{path.name}: {len(modes)} mode{'s' if len(modes) > 1 else ''} of a hammer test, {span} Hz"]


def _machine(path: Path) -> list[str]:
    from chipload.machine.machine import read_machine

    return [_machine_line(path, read_machine(path))]


def _ini(path: Path) -> list[str]:
    from chipload.machine.ini import read_ini

    made, findings = read_ini(path)
    return [*(f"finding: {f}" for f in findings), _machine_line(path, made)]


def _machine_line(path: Path, machine: Any) -> str:
    axes = ", ".join(f"{a.letter} {a.low:g} to {a.high:g}" for a in machine.chain.axes if a.letter in "XYZ")
    turning = "".join(a.letter for a in machine.chain.axes if a.letter not in "XYZ")
    return f"{path.name}: machine {machine.name}: {axes} mm{f', rotary axes {turning}' if turning else ''}"


def _catalogue(path: Path) -> list[str]:
    from chipload.cutter.catalogue import read_catalogue

    made = read_catalogue(path)
    sizes = sorted({c.diameter for c in made.cutters})
    return [f"{path.name}: catalogue {made.name}: {len(made.cutters)} cutters, {sizes[0]:g} to {sizes[-1]:g} mm"]


def _hal(path: Path) -> list[str]:
    from chipload.control.hal_file import load_hal

    job = load_hal(path)
    held = number_text(1e-3 * job.override.torque_ref)
    return [f"{path.name}: a controller for chipload hal, torque held {held} N m"]


def _fuzzy(path: Path) -> list[str]:
    from chipload.control.fuzzy import read_fuzzy

    return [f"{path.name}: rules of a fuzzy controller: {read_fuzzy(path).name}"]


def _walls(path: Path) -> list[str]:
    from chipload.jobs.wall_measurement import read_wall_file

    walls, prior, _, _ = read_wall_file(path)
    values = sum(len(wall.error_um) for wall in walls)
    number = f"{len(walls)} measured wall{'s' if len(walls) > 1 else ''}"
    return [f"{path.name}: {number} of {prior.name} with {values} values, for chipload learn-wall"]


def _columns(path: Path) -> list[str]:
    from chipload.control.logs import columns_text

    return [f"{path.name}: columns of a log: {columns_text(path)}; for --columns"]


def _log(path: Path) -> list[str]:
    from chipload.control.logs import read_log

    log, findings = read_log(path)
    names = ", ".join(key for key, value in vars(log).items() if value is not None and key != "time")
    seconds = number_text(log.time[-1] - log.time[0])
    count = f"{len(log.time)} sample{'' if len(log.time) == 1 else 's'}"
    return [*(f"finding: {f}" for f in findings), f"{path.name}: a log of {count} over {seconds} s: {names}"]


def _model(path: Path) -> list[str]:
    from chipload.geometry.step_faces import read_faces
    from chipload.geometry.step_roles import roles_of

    model = read_faces(path, "model")
    return [*model.lines(), *roles_of(model)]


def _mesh(path: Path) -> list[str]:
    from chipload.geometry.mesh import read_mesh

    mesh = read_mesh(path, unit="mm", key="model")
    return [
        f"{path.name}: a closed mesh of {len(mesh.faces)} triangles, {float(mesh.volume):.6g} mm3; {_box(mesh.bounds)}",
        "the file does not state its unit: mm here; a job states it (units)",
    ]


def _drawing_lines(path: Path) -> list[str]:
    from chipload.geometry.dxf import read_dxf

    drawing = read_dxf(path, units_if_unstated="mm")
    closed = sum(c.closed for c in drawing.contours)
    low, high = np.array([c.bounds for c in drawing.contours]).reshape(-1, 2, 2).transpose(1, 0, 2)
    box = _box(np.array([low.min(axis=0), high.max(axis=0)]))
    contours = f"{closed} closed and {len(drawing.contours) - closed} open contours; {box}"
    return [*(f"finding: {f}" for f in drawing.findings), f"{path.name}: {contours}"]


def _tools(path: Path) -> list[str]:
    from chipload.program.read import read_tools

    return [f"{path.name}: a tool table of {len(read_tools(path).lengths())} tools"]


def _tool_bit(path: Path) -> list[str]:
    from chipload.cutter.fctb import read_fctb

    return [f"{path.name}: a tool bit: " + ", ".join(f"{k} = {v}" for k, v in read_fctb(path).items())]


def _box(bounds: Any) -> str:
    return (
        ", ".join(f"{x} {a:g} to {b:g}" for x, a, b in zip("xyz", *np.asarray(bounds).tolist(), strict=False)) + " mm"
    )


#: keys of a file of measured walls; a job has ``wall`` too
MEASURED_WALLS = ("wall", "compliance_error")
#: keys that only one kind of TOML file has, and how it is read
BY_KEYS: tuple[tuple[set[str], Callable[[Path], list[str]]], ...] = (
    ({"override", "path"}, _hal),
    ({"rules", "error"}, _fuzzy),
    ({"ktc_mpa"}, _material),
    ({"input", "idle_error_share"}, _spindle),
    ({"mode"}, _modes),
    ({"axis", "rapid_mm_min"}, _machine),
    ({"name", "cutter"}, _catalogue),
)
#: how files are read that are no TOML, by their ending
BY_ENDING: dict[str, Callable[[Path], list[str]]] = {
    ".step": _model, ".stp": _model, ".stl": _mesh, ".dxf": _drawing_lines, ".ini": _ini,
    ".tbl": _tools, ".fctb": _tool_bit, ".csv": _log, ".parquet": _log,
}  # fmt: skip
