"""Export of a result to other programs: CSV, VTK, STL and the setup sheet."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Any

import numpy as np

from chipload.errors import InputError
from chipload.files import cannot_write, fresh_folder
from chipload.lazy import pa, pq
from chipload.report.chip_bodies import chip_bodies, chips_scene
from chipload.report.load_monitor import MONITORS, UNPUBLISHED, afc_table, load_csv, sections_of
from chipload.report.presentation import Content
from chipload.report.removal import REMOVAL, read_removal
from chipload.report.setup_sheet import setup_pdf, setup_sheet
from chipload.report.vtk import faces_file, polyline
from chipload.result import Result, SurfaceMap
from chipload.result.load import HISTORY, load_result
from chipload.simulation.removal_mesh import RemovalMesh
from chipload.stock.layers import LayeredStock

#: kinds of export
KINDS = ("csv", "vtk", "glb", "sheet")
#: rows of a history that are written at once
ROWS = 65_536


def export_result(
    folder: Path, out: Path, kinds: Sequence[str] = KINDS, monitor: str | None = None, spindle: Path | None = None
) -> tuple[str, ...]:
    """Write a result folder as other files into a new or empty folder; whole or not at all.

    ``csv``: history.csv, one row for each step, units in the column names. ``vtk``: the path of each track with all its
    numbers (.vtp), its undeformed chips (.vtu), surface maps with displacements by finite elements (.vtu), the stock
    that is left (.vtu and .stl). ``glb``: the undeformed chips of each track, a body a chip. ``sheet``: setup.html, one
    page, and as setup.pdf where ``chipload[export]`` is installed.
    ``monitor``: reference loads for a load monitor, ``csv`` or ``heidenhain``; ``spindle``: the file that states the
    motor's power.

    Returns
    -------
    the names of the files

    Raises
    ------
    InputError
        It is no result, there is nothing of that kind in it, or ``out`` holds something.
    OutputError
        It cannot be written.
    """
    result = load_result(folder)
    files: dict[str, Callable[[], Content]] = {}
    if "csv" in kinds:
        files["history.csv"] = lambda: lambda file: _csv(folder / HISTORY, file)
    if "vtk" in kinds:
        files |= _vtk(result, folder)
    if "glb" in kinds:
        files |= {
            f"chips-{_safe(name)}.glb": partial(_chips_scene, removed, blocks)
            for name, removed, blocks in _removals(result, folder)
        }
    if "sheet" in kinds:
        files["setup.html"] = lambda: setup_sheet(result)
        if find_spec("fpdf") is not None:
            files["setup.pdf"] = lambda: setup_pdf(result)
    if monitor is not None:
        files |= _load_monitor(result, monitor, spindle)
    elif spindle is not None:
        raise InputError("--spindle: applies to --load-monitor: state both")
    if not files:
        raise InputError(f"{folder}: nothing to export: name one of {', '.join(KINDS)}")
    _write(files, out)
    return tuple(files)


def _load_monitor(result: Result, monitor: str, spindle: Path | None) -> dict[str, Callable[[], Content]]:
    why = UNPUBLISHED.get(monitor.lower().lstrip("."))
    if why is not None:
        raise InputError(
            f"--load-monitor {monitor}: the format of its file is not published: {why}: use csv and enter its numbers"
        )
    if monitor not in MONITORS:
        raise InputError(f"--load-monitor {monitor}: must be one of {', '.join(MONITORS)}")
    sections = sections_of(result, spindle)
    content = load_csv(sections) if monitor == "csv" else afc_table(sections)
    return {MONITORS[monitor]: lambda: content}


def _csv(history: Path, file: IO[bytes]) -> None:
    """history.parquet as text, some rows at a time."""
    from pyarrow import csv

    try:
        with pq.ParquetFile(history) as source:
            writer = None
            for batch in source.iter_batches(ROWS):
                table = pa.Table.from_batches([batch])
                plain = [f.with_type(pa.string()) if pa.types.is_dictionary(f.type) else f for f in table.schema]
                table = table.cast(pa.schema([f.remove_metadata() for f in plain]))
                writer = writer or csv.CSVWriter(file, table.schema)
                writer.write_table(table)
            if writer is None:
                file.write((",".join(f'"{name}"' for name in source.schema_arrow.names) + "\n").encode())
            else:
                writer.close()
    except (pa.ArrowException, UnicodeDecodeError) as err:
        raise InputError(f"{history}: cannot be read: {err}: run the job again") from None


def _vtk(result: Result, folder: Path) -> dict[str, Callable[[], Content]]:
    files: dict[str, Callable[[], Content]] = {}
    for track in result.tracks:
        blocks = list(track.blocks())
        if blocks and all(key in blocks[0] for key in ("x_mm", "y_mm", "z_mm")):
            files[f"path-{_safe(track.name)}.vtp"] = lambda blocks=blocks: _path(blocks)  # type: ignore[misc]
    for name, removed, rows in _removals(result, folder):
        files[f"chips-{_safe(name)}.vtu"] = partial(_chips, removed, rows)
    for k, one in enumerate(result.maps):
        files[f"map-{k}-{_safe(one.name)}.vtu"] = lambda one=one: _map(one)  # type: ignore[misc]
    stock = folder / "stock.npz"
    if stock.is_file():
        bodies: list[Any] = []

        def stock_mesh() -> Any:
            if not bodies:
                bodies.append(LayeredStock.load(stock).mesh())
            return bodies[0]

        files["stock.vtu"] = lambda: faces_file(stock_mesh().vertices, stock_mesh().faces)
        files["stock.stl"] = lambda: _stl(stock_mesh())
    return files


def _removals(result: Result, folder: Path) -> Iterator[tuple[str, RemovalMesh, Sequence[Mapping[str, Any]]]]:
    """Name, stock and history of the tracks whose stock the result holds."""
    path = folder / REMOVAL
    for k, track in enumerate(result.tracks if path.is_file() else ()):
        blocks = list(track.blocks())
        removed = read_removal(path, k) if blocks else None
        if removed is not None and len(removed.rows):
            yield track.name, removed, blocks


def _columns(blocks: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """All numbers of a history."""
    names = [n for n, v in blocks[0].items() if np.asarray(v).dtype.kind in "fiub"]
    return {n: np.concatenate([np.asarray(b[n]) for b in blocks]) for n in names}


def _chips(mesh: RemovalMesh, blocks: Sequence[Mapping[str, Any]]) -> bytes:
    chips = chip_bodies(mesh, _columns(blocks))
    return faces_file(chips.points, chips.faces, of_faces={"chip": chips.chip, **chips.values})


def _chips_scene(mesh: RemovalMesh, blocks: Sequence[Mapping[str, Any]]) -> bytes:
    return chips_scene(chip_bodies(mesh, _columns(blocks)))


def _map(one: SurfaceMap) -> bytes:
    values = {one.column: np.asarray(one.values, dtype=np.float64).ravel()}
    if one.displacement is not None:
        values["displacement_mm"] = one.displacement
    return faces_file(one.points, one.faces, values)


def _path(blocks: Sequence[Mapping[str, Any]]) -> bytes:
    columns = _columns(blocks)
    points = np.column_stack([columns[key] for key in ("x_mm", "y_mm", "z_mm")])
    return polyline(points, columns)


def _stl(mesh: Any) -> bytes:
    out = io.BytesIO()
    mesh.export(out, file_type="stl")
    return out.getvalue()


def _safe(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9_-]+", "-", name).strip("-") or "track"


def _write(files: Mapping[str, Callable[[], Content]], out: Path) -> None:
    target = out.absolute()
    try:
        if target.exists() and (not target.is_dir() or any(target.iterdir())):
            raise InputError(f"--out {out}: is not empty: name a folder that is new or empty")
        target.parent.mkdir(parents=True, exist_ok=True)
        with fresh_folder(target.parent) as fresh:
            for name, make in files.items():
                content = make()
                with (fresh / name).open("wb") as file:
                    if isinstance(content, bytes):
                        file.write(content)
                    else:
                        content(file)
            fresh.chmod(0o755)
            if target.exists():
                target.rmdir()
            fresh.rename(target)
    except OSError as err:
        raise cannot_write(f"--out {out}", err) from None
