"""removal.npz: the stock of each track at all its rows, calculated from the blank and the history."""

from __future__ import annotations

import io
import multiprocessing
import re
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from chipload.arrays import read_arrays
from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.processes import cores
from chipload.report.presentation import Blank
from chipload.report.view import parts_of
from chipload.result import Result, Track
from chipload.simulation.removal_mesh import RemovalMesh, ToolPoses, removal_mesh

if TYPE_CHECKING:
    import trimesh

Floats = NDArray[np.float64]

#: the file
REMOVAL = "removal.npz"
#: why the stock of a track is not in it; arrays of a track
REFUSED = "refused"
ARRAYS = ("low", "high", "corners", "seen", "rows", "volumes", "cell")
#: columns that it is made from
PLACE, AXIS = ("x_mm", "y_mm", "z_mm"), ("axis_x", "axis_y", "axis_z")
#: tracks of a result whose stock is kept, those in use first
TRACKS = 8


@dataclass(frozen=True, eq=False)
class ShownStocks:
    """The stock over the rows of tracks, by their number; of those ``refused`` why it is not shown."""

    meshes: Mapping[int, RemovalMesh]
    refused: Mapping[int, str]


def removal_meshes(result: Result, blanks: Mapping[str, Blank]) -> ShownStocks:
    """The stock over the rows of tracks that have a blank.

    A blank that is not closed, or that rays do not enter as often as they leave it, is refused: a result is not lost
    for its picture.
    """
    order = sorted(range(len(result.tracks)), key=lambda k: not result.tracks[k].in_use)
    known = [k for k in order if (own := blanks.get(result.tracks[k].name)) is not None and own.mesh is not None]
    out: dict[int, RemovalMesh] = {}
    refused = dict.fromkeys(known[TRACKS:], f"the stock of {TRACKS} tracks is kept, those in use first")
    tasks = [(k, *task) for k in known[:TRACKS] if (task := _removal(result, blanks, k)) is not None]
    # the loops of the dexels run without the interpreter's lock
    with ThreadPoolExecutor(threads()) as pool:
        found = pool.map(lambda task: _stock(*task[1:]), tasks)
        for (k, *_), stock in zip(tasks, found, strict=True):
            if isinstance(stock, RemovalMesh):
                out[k] = stock
            else:
                refused[k] = stock
    return ShownStocks(out, refused)


def threads() -> int:
    """Threads for the stocks of tracks: one for each core; one in a process that shares the cores with others."""
    return 1 if multiprocessing.parent_process() is not None else cores()


def _removal(
    result: Result, blanks: Mapping[str, Blank], k: int
) -> tuple[trimesh.Trimesh, ToolPoses, dict[int, Cutter], list[ToolPoses], float] | None:
    """Blank, path, cutters and earlier paths of track k, and how wide the cells are; None: it has no history."""
    blank = blanks[result.tracks[k].name]
    path = tool_path(result.tracks[k], blank)
    if path is None or blank.mesh is None:
        return None
    before, cutters = _paths_before(result, blanks, blank)
    solid = {n: c for n, c in (cutters | dict(blank.cutters)).items() if not c.body and not c.shape}
    # a copy: tracks may share their blank, and its index of triangles is not for two threads
    return blank.mesh.copy(), path, solid, before, blank.wider


def _stock(
    mesh: trimesh.Trimesh, path: ToolPoses, cutters: dict[int, Cutter], before: list[ToolPoses], wider: float
) -> RemovalMesh | str:
    """The stock over the rows of a track, or why it is refused."""
    try:
        return removal_mesh(mesh, path, cutters, before, wider)
    except InputError as err:
        return str(err)


def _paths_before(
    result: Result, blanks: Mapping[str, Blank], blank: Blank
) -> tuple[list[ToolPoses], dict[int, Cutter]]:
    """The paths that have cut a stock before, with their cutters."""
    paths: list[ToolPoses] = []
    cutters: dict[int, Cutter] = {}
    for track in (t for name in blank.before for t in result.tracks if t.name == name):
        own = tool_path(track, blanks[track.name])
        if own is not None:
            paths.append(own)
            cutters |= dict(blanks[track.name].cutters)
    return paths, cutters


def shapes_of(blank: Blank) -> dict[int, Sequence[tuple[str, Floats]]]:
    """The parts of the cutters of a track as they are drawn."""
    return {n: parts_of(c) for n, c in blank.cutters.items()} | dict(blank.shapes)


def tool_path(track: Track, blank: Blank) -> ToolPoses | None:
    """Return the tool's place at each row of a track; None if it has no history, or no place."""
    parts: dict[str, list[NDArray[Any]]] = {}
    for block in track.blocks():
        for name in (*PLACE, *AXIS, "s_mm", "tool"):
            if name in block:
                parts.setdefault(name, []).append(np.asarray(block[name]))
    columns = {name: np.concatenate(parts.pop(name)) for name in list(parts)}
    if not set(PLACE) <= set(columns) or len(columns[PLACE[0]]) == 0:
        return None
    tip = np.column_stack([columns[c] for c in PLACE]).astype(np.float64, copy=False)
    n = len(tip)
    axis = axes_of_rows(columns, n)
    only = next(iter(blank.cutters)) if len(blank.cutters) == 1 else 0
    tool = columns["tool"].astype(np.int64) if "tool" in columns else np.full(n, only, dtype=np.int64)
    return ToolPoses(tip, axis, tool, breaks(tip, columns.get("s_mm")))


def axes_of_rows(columns: Mapping[str, NDArray[Any]], n: int) -> Floats:
    """(n, 3) axis of each row: z where the columns do not state it everywhere; one row if all agree."""
    upright = np.broadcast_to([0.0, 0.0, 1.0], (n, 3))
    if not n or not set(AXIS) <= set(columns) or any(np.isnan(columns[c]).any() for c in AXIS):
        return upright
    if all((columns[c] == columns[c][0]).all() for c in AXIS):
        return np.broadcast_to([float(columns[c][0]) for c in AXIS], (n, 3))
    return np.column_stack([columns[c] for c in AXIS])


def breaks(place: Floats, s: NDArray[Any] | None) -> NDArray[np.bool_]:
    """(n,) whether a row does not continue from the row before: the path must be longer by their distance."""
    if s is None:
        return np.zeros(len(place), dtype=np.bool_)
    leap = np.linalg.norm(np.diff(place, axis=0, prepend=place[:1]), axis=1)
    along = np.maximum.accumulate(np.nan_to_num(np.asarray(s, dtype=np.float64)))
    apart = leap > np.diff(along, prepend=along[:1]) * (1.0 + 1e-6) + 1e-3
    return np.asarray(apart & (np.arange(len(place)) > 0))


def removal_bytes(result: Result, stocks: ShownStocks, blanks: Mapping[str, Blank]) -> bytes:
    """The file: the stock of each track or why there is none, and the parts of its cutters."""
    sink = io.BytesIO()
    arrays: dict[str, NDArray[Any]] = {}
    for k, track in enumerate(result.tracks):
        if track.name not in blanks:
            continue
        if k in stocks.meshes:
            arrays |= {f"{k}-{name}": getattr(stocks.meshes[k], name) for name in ARRAYS}
        elif k in stocks.refused:
            arrays[f"{k}-{REFUSED}"] = np.frombuffer(stocks.refused[k].encode(), dtype=np.uint8)
        for number, parts in shapes_of(blanks[track.name]).items():
            for n, (kind, profile) in enumerate(parts):
                arrays[f"{k}-cutter-{number}-{n}-{kind}"] = profile
    np.savez_compressed(sink, **arrays)  # type: ignore[arg-type]
    return sink.getvalue()


def read_cutter_parts(path: Path, track: int) -> dict[int, list[tuple[str, Floats]]]:
    """Parts of the cutters of a track by tool number; empty: the file has none.

    Raises
    ------
    InputError
        It cannot be read.
    """
    out: dict[int, list[tuple[int, str, Floats]]] = {}
    for name, profile in read_arrays(path, wanted=re.compile(rf"{track}-cutter-\d+-\d+-[a-z]+").fullmatch).items():
        _, _, tool, n, kind = name.split("-")
        if profile.ndim != 2 or profile.shape[1] != 2 or profile.dtype.kind != "f" or not np.isfinite(profile).all():
            raise _damaged_error(path)
        out.setdefault(int(tool), []).append((int(n), kind, profile))
    return {number: [(kind, p) for _, kind, p in sorted(parts, key=lambda x: x[0])] for number, parts in out.items()}


def read_refused(path: Path, track: int) -> str:
    """Why the stock of a track is not in the file; empty: it is, or the track has none.

    Raises
    ------
    InputError
        It cannot be read.
    """
    stored = read_arrays(path, wanted=f"{track}-{REFUSED}".__eq__)
    return "".join(text.tobytes().decode("utf-8", "replace") for text in stored.values())


def read_removal(path: Path, track: int) -> RemovalMesh | None:
    """The stock of a track; None: the file has none.

    Raises
    ------
    InputError
        It cannot be read.
    """
    own = {f"{track}-{name}": name for name in ARRAYS}
    arrays = {own[name]: values for name, values in read_arrays(path, wanted=own.__contains__).items()}
    if "corners" not in arrays:
        return None
    if arrays.keys() != set(ARRAYS):
        raise _damaged_error(path)
    corners, seen, rows, volumes = (arrays[name] for name in ("corners", "seen", "rows", "volumes"))
    boxes = [arrays[name] for name in ("low", "high", "cell")]
    fits = (
        corners.ndim == 3 and corners.shape[1:] == (4, 3) and corners.dtype == seen.dtype == np.uint16
        and seen.shape == (len(corners), 2) and rows.ndim == 1 and rows.dtype.kind == "i"
        and (np.diff(rows) >= 0).all() and (rows >= 0).all() and volumes.shape == (len(rows) + 1,)
        and all(box.shape == (3,) for box in boxes)
        and all(np.isfinite(values).all() for values in (*boxes, volumes))
    )  # fmt: skip
    if not fits:
        raise _damaged_error(path)
    return RemovalMesh(**arrays)


def _damaged_error(path: Path) -> InputError:
    return InputError(f"{path.name}: damaged: its parts do not match: run the job again")
