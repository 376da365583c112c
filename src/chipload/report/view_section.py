"""The 3D view of report.html: bodies, stock at every row, path, cutter of the tracks in use, in the file itself."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping, Sequence
from html import escape
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding
from chipload.report.bodies import SceneBody, bodies_note, scene_bodies
from chipload.report.colouring import FIRST, bounds_of, colouring_of, lowest_limit, rows_in_air
from chipload.report.marks import marks_of
from chipload.report.operating import COLUMNS as OPERATING
from chipload.report.operating import operating_points
from chipload.report.presentation import Blank
from chipload.report.removal import AXIS, PLACE, ShownStocks, axes_of_rows, breaks, shapes_of
from chipload.report.shown_maps import shown_maps
from chipload.report.view import Colouring, ViewPath, ViewScene, pointer_parts, scene_document
from chipload.result import LimitCheck, Result, Track
from chipload.result.coverage import CUTTING
from chipload.simulation.engagement_samples import EngagementSamples
from chipload.simulation.removal_mesh import RemovalMesh

#: rows of a path that are kept, points that it is drawn through, columns to choose from, triangles of a body
KEPT, POINTS, COLUMNS_SHOWN, TRIANGLES = 12_000, 6_000, 3, 60_000
#: steps whose tooth engagement is kept
SAMPLES = 200
#: how a file of glTF begins; another scene holds no body
GLTF = b"glTF"
#: element of the view, and class of its documents, one a track
VIEW, DATA = "view3d", "view3d-data"
#: how far the stock is rounded, of the distance of its rays
ROUNDED = 0.0625
#: of compression: 9 takes ten times as long, and gives no fewer bytes
LEVEL = 6
#: characters of all documents: what lies beyond is left out, but the first
LARGEST = 3_000_000


def view_section(
    result: Result,
    bodies: tuple[SceneBody, ...],
    stocks: ShownStocks,
    blanks: Mapping[str, Blank],
    samples: Mapping[str, EngagementSamples] = MappingProxyType({}),
) -> list[str]:
    """HTML of the view of the tracks in use that have a place, else of the first one; empty: there is none."""
    shown = _shown_tracks(result)
    if not shown:
        return []
    documents: dict[str, str] = {}
    notes, left, length = [bodies_note(bodies)], [], 0
    for k, track, columns in shown:
        own = _scene(result, track, columns, bodies, stocks.meshes.get(k), blanks, samples)
        data = base64.b64encode(zlib.compress(scene_document(own, KEPT, bool(documents), ROUNDED), LEVEL)).decode()
        if documents and length + len(data) > LARGEST:
            left.append(track.name)
            continue
        length += len(data)
        documents[track.name] = data
        of = f"{track.name}: " if len(shown) > 1 else ""
        if own.removal is not None:
            notes.append(f"{of}The stock is drawn in cells of {float(own.removal.cell.max()):.2g} mm.")
        elif k in stocks.refused:
            notes.append(f"{of}The stock is not drawn: {stocks.refused[k]}.")
        if len(own.path.t) > POINTS:
            notes.append(f"{of}The drawn path has about {POINTS} of its {len(own.path.t)} steps.")
    if left:
        notes.append(f"Not in this file, to keep it small: {', '.join(left)}.")
    names, note = ", ".join(documents), " ".join(filter(None, notes))
    caption = f"{escape(names)}. Drag to turn, scroll to zoom, drag with the right button to pan. {escape(note)}"
    return [
        "<h2>In space</h2>",
        f'<p class="note">{caption}</p>',
        f'<div id="{VIEW}" class="view3d"><p class="note">The view needs a browser with scripts and WebGL.</p></div>',
        *(
            f'<script class="{DATA}" data-name="{escape(name)}" type="text/plain">{data}</script>'
            for name, data in documents.items()
        ),
    ]


def drawn_bodies(result: Result, scene_glb: bytes, stocks: ShownStocks) -> tuple[SceneBody, ...]:
    """The bodies of a scene.glb that the view draws: without the stock of the end where it is shown row by row."""
    if not scene_glb.startswith(GLTF):
        return ()
    used = [k in stocks.meshes for k, track in enumerate(result.tracks) if track.in_use]
    return scene_bodies(scene_glb, TRIANGLES, ("stock",) if used and all(used) else ())


def _scene(
    result: Result,
    track: Track,
    columns: dict[str, NDArray[Any]],
    bodies: Sequence[SceneBody],
    removal: RemovalMesh | None,
    blanks: Mapping[str, Blank],
    samples: Mapping[str, EngagementSamples],
) -> ViewScene:
    """Return the scene of a track."""
    path, blank = _path(columns), blanks.get(track.name)
    if removal is not None:
        bodies = tuple(b for b in bodies if b.kind != "stock")
    size = max(0.25 * float(np.linalg.norm(np.ptp(path.place, axis=0))), 1.0)
    parts = shapes_of(blank) if blank is not None else {}
    parts = {0: next(iter(parts.values()))} if len(parts) == 1 else {0: pointer_parts(size), **parts}

    def row(item: LimitCheck | Finding) -> int | None:
        return item.row if item.row is not None and item.row < len(path.t) else None

    colours, own = _colours(track, columns, path, removal), samples.get(track.name)
    return ViewScene(
        result.title, bodies, removal, path, parts, marks_of(result, track, row, path.place),
        colours[0] if colours else None, colours, None if own is None else own.at_most(SAMPLES), bounds_of(track),
        operating_points(result, track, columns), shown_maps(result, track, bounds_of(track)),
    )  # fmt: skip


def _shown_tracks(result: Result) -> list[tuple[int, Track, dict[str, NDArray[Any]]]]:
    """Number, track and columns of the tracks in use that have a place, the one of the critical limit first; where none
    has, of the first that has.
    """
    out: list[tuple[int, Track, dict[str, NDArray[Any]]]] = []
    critical = result.critical_program
    for k, track in sorted(enumerate(result.tracks), key=lambda item: (not item[1].in_use, item[1].name != critical)):
        if out and not track.in_use:
            break
        columns = _columns(track)
        if len(columns.get(PLACE[0], ())):
            out.append((k, track, columns))
    return out


def _columns(track: Track) -> dict[str, NDArray[Any]]:
    """The columns of a track that the view needs."""
    wanted = {*PLACE, *AXIS, "t_s", "s_mm", "tool", "line", *FIRST, *OPERATING}
    parts: dict[str, list[NDArray[Any]]] = {}
    for block in track.blocks():
        # one column tells where it cuts
        for name in wanted.union(c for c in CUTTING[:1] if c in block) & set(block):
            parts.setdefault(name, []).append(np.asarray(block[name]))
    return {name: np.concatenate(parts.pop(name)) for name in list(parts)}


def _path(columns: dict[str, NDArray[Any]]) -> ViewPath:
    """The path of a track; its columns are taken out of ``columns``."""
    place = np.column_stack([columns.pop(c) for c in PLACE]).astype(np.float64, copy=False)
    n = len(place)
    axis = axes_of_rows(columns, n)
    for name in AXIS:
        columns.pop(name, None)
    rising = [np.maximum.accumulate(np.nan_to_num(columns.get(c, np.arange(n)).astype(float))) for c in ("t_s", "s_mm")]
    tool = columns["tool"].astype(np.int64) if "tool" in columns else np.zeros(n, dtype=np.int64)
    line = columns["line"].astype(np.int64) if "line" in columns else None

    def numbers(name: str) -> NDArray[np.float64] | None:
        values = columns[name].astype(np.float64) if name in columns else None
        return values if values is not None and np.isfinite(values).any() else None

    apart = breaks(place, columns.get("s_mm"))
    return ViewPath(place, axis, rising[0], rising[1], np.maximum(tool, 0), line, apart, rows_in_air(numbers))


def _colours(
    track: Track, columns: Mapping[str, NDArray[Any]], path: ViewPath, removal: RemovalMesh | None
) -> list[Colouring]:
    """Columns to choose from: those with a limit first."""
    limited = [c.column.name for c in track.limits]
    usable = [c for c in FIRST if c in columns and np.isfinite(columns[c].astype(float)).any()]
    order = sorted(usable, key=lambda c: c not in limited)[:COLUMNS_SHOWN]
    return [
        colouring_of(c, columns[c].astype(float), path, lowest_limit(track.limits, c), removal, POINTS) for c in order
    ]
