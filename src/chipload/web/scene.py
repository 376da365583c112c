"""The documents of a result folder that the 3D view shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, InputError
from chipload.report.bodies import SceneBody, bodies_note, scene_bodies
from chipload.report.colouring import bounds_of, colouring_of, colouring_of_words, lowest_limit
from chipload.report.engagement import ENGAGEMENT, read_engagement
from chipload.report.marks import marks_of
from chipload.report.operating import COLUMNS as OPERATING
from chipload.report.operating import OperatingPoints, operating_points
from chipload.report.removal import REMOVAL, read_refused, read_removal
from chipload.report.shown_maps import ShownMap, shown_maps
from chipload.report.view import Colouring, ViewMark, ViewPath, ViewScene, scene_document
from chipload.result import LimitCheck
from chipload.simulation.engagement_samples import EngagementSamples
from chipload.simulation.removal_mesh import RemovalMesh
from chipload.web.checks import row_of
from chipload.web.cutters import cutters_of
from chipload.web.loads import cutting_rows
from chipload.web.result import SCENE, PageResult, PageTrack, TextColumn

#: largest scene [bytes] that the page shows
LARGEST = 400_000_000


@dataclass(frozen=True, eq=False)
class PageScene:
    """What is shown of a track: the document, the names of its bodies, the stock at every row, places, a notice,
    whether it shows what the teeth cut, surface maps to choose from, bodies that others cover, hidden at first.
    """

    document: bytes
    bodies: tuple[str, ...]
    removal: RemovalMesh | None
    marks: tuple[ViewMark, ...]
    notice: str
    engaged: bool = False
    maps: tuple[ShownMap, ...] = ()
    covered: tuple[str, ...] = ()


def bodies(result: PageResult) -> tuple[tuple[SceneBody, ...], str]:
    """The bodies of scene.glb besides path and cutter, and a sentence where there are none or they are simplified."""
    try:
        path = result.file(SCENE)
    except InputError:
        return (), "This result has no scene; only its path is shown."
    try:
        if path.stat().st_size > LARGEST:
            return (), f"{SCENE} is larger than {LARGEST // 1_000_000} MB: only the path is shown."
        out = scene_bodies(path.read_bytes())
    except Exception:  # a reader of foreign files may fail in any way; the page states this
        return (), f"{SCENE} cannot be read: only the path is shown."
    return out, bodies_note(out) if out else "The scene of this result has no bodies; only the path is shown."


def covered_bodies(solids: Sequence[SceneBody]) -> tuple[str, ...]:
    """Painted surfaces behind others of the same surface, by the number that their names begin with."""
    out, seen = [], set()
    for body in solids:
        number = body.name.partition("-")[0]
        if body.kind == "body" and body.legend is not None and number.isdigit():
            if number in seen:
                out.append(body.name)
            seen.add(number)
    return tuple(out)


def stock_of(result: PageResult, track: PageTrack) -> RemovalMesh | None:
    """The stock of a track at its rows; None: the result does not hold it."""
    try:
        found = read_removal(result.file(REMOVAL), result.result.tracks.index(track.own))
    except (InputError, ValueError):
        return None
    if found is not None and len(found.rows) and int(found.rows[-1]) >= len(track):
        return None
    return found


def refused_stock(result: PageResult, track: PageTrack) -> str:
    """A sentence why the stock of a track is not shown; empty: it is, or the result has none."""
    try:
        why = read_refused(result.file(REMOVAL), result.result.tracks.index(track.own))
    except (InputError, ValueError):
        return ""
    return f"The stock is not drawn: {why}." if why else ""


def samples_of(result: PageResult, track: PageTrack) -> EngagementSamples | None:
    """Tooth engagement of some rows of a track; None: the result does not hold it."""
    try:
        found = read_engagement(result.file(ENGAGEMENT), result.result.tracks.index(track.own))
    except (InputError, ValueError):
        return None
    return None if found is None or not len(found) or int(found.row[-1]) >= len(track) else found


def operating_of(result: PageResult, track: PageTrack) -> OperatingPoints | None:
    """Spindle speed and stability margin at each row; None: the result does not know them."""
    if not set(OPERATING) <= set(result.columns):
        return None
    columns = {name: result.column(track, name) for name in OPERATING}
    numbers = {name: values for name, values in columns.items() if not isinstance(values, TextColumn)}
    return operating_points(result.result, track.own, numbers)


def view_path(result: PageResult, track: PageTrack) -> ViewPath:
    """Where the tool of a track stands, and where it cuts."""
    tool = track.tool if track.tool is not None else np.zeros(len(track), dtype=np.int64)
    cut = cutting_rows(result, track)
    air = None if cut is None else ~cut
    return ViewPath(track.place, track.axis, track.t, track.s, np.maximum(tool, 0), track.line, track.apart, air)


def page_scene(
    result: PageResult,
    track: PageTrack,
    found: tuple[tuple[SceneBody, ...], str],
    column: str,
    span: tuple[float, float] | None = None,
) -> PageScene:
    """What the 3D view of a track shows, coloured by a column.

    ``found``: its bodies and what is to be said of them; ``span``: ends of the scale, None: the column's own.
    """
    solids, notice = found
    removal = stock_of(result, track)
    if removal is not None:
        solids = tuple(b for b in solids if b.kind != "stock")
        notice = "" if not solids else bodies_note(solids)
        cell = float(removal.cell.max())
        notice += f" The stock is drawn in cells of {cell:.2g} mm, in {len(removal.rows)} frames."
    elif any(b.kind == "stock" for b in solids):
        notice += " The stock does not change with the slider, because this result holds only one state of it."
    if removal is None:
        notice = f"{notice} {refused_stock(result, track)}".strip()
    size = 0.25 * float(np.linalg.norm(np.ptp(track.place, axis=0)))
    parts, unknown = cutters_of(result, track, max(size, 1.0))

    def row(item: LimitCheck | Finding) -> int | None:
        return row_of(track, item)

    samples = samples_of(result, track)
    maps = shown_maps(result.result, track.own, bounds_of(track.own))
    marks = marks_of(result.result, track.own, row, track.place)
    scene = ViewScene(
        result.result.title, solids, removal, view_path(result, track), parts, marks,
        colour_column(result, track, column, removal, span), samples=samples,
        bounds=bounds_of(track.own), operating=operating_of(result, track),
        maps=maps,
    )  # fmt: skip
    names = tuple(b.name for b in solids) + (("stock",) if removal is not None else ())
    notice = " ".join([notice, unknown]).strip()
    return PageScene(
        scene_document(scene), names, removal, marks, notice, samples is not None, maps, covered_bodies(solids)
    )


def colour_column(
    result: PageResult,
    track: PageTrack,
    column: str,
    removal: RemovalMesh | None,
    span: tuple[float, float] | None = None,
) -> Colouring:
    """The colours of a column of a track; ``span``: ends of their scale, None: the column's own."""
    values: NDArray[np.float64] | TextColumn = result.column(track, column)
    path = view_path(result, track)
    if column == "tool" and not isinstance(values, TextColumn):
        numbers, codes = np.unique(values, return_inverse=True)
        values = TextColumn(codes.astype(np.int64), tuple(f"T{number:.0f}" for number in numbers))
    if isinstance(values, TextColumn):
        return colouring_of_words(column, values.codes, values.words, path)
    made = colouring_of(column, values, path, lowest_limit(track.own.limits, column), removal)
    return made if span is None else replace(made, low=span[0], high=span[1])
