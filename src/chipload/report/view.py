"""The document of the 3D view of page and report: a JSON header and arrays, read by viewer/src/document.ts.

Notation: `CLV1`, the length of the header (UInt32), the header, the arrays; an array stands in the header as
``{"at", "n", "t"}``: its place behind the header [bytes], its number of values, its type. Lengths are mm, Z is up.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.report.bodies import MACHINE_TABLE, SceneBody
from chipload.report.operating import OperatingPoints
from chipload.report.shown_maps import ShownMap
from chipload.result.style import SCALE
from chipload.simulation.engagement_samples import EngagementSamples
from chipload.simulation.removal_mesh import RemovalMesh
from chipload.stock.surface_net import STEPS

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

MAGIC = b"CLV1"
#: rows whose place and time the view knows at most; between them it draws straight
KEPT = 400_000
#: how far a path may leave the bodies to be in the first view, in diagonals of their box
AROUND = 0.2
#: chords of drawn corners of a cutter leave them by at most this [mm]
CHORD_MM = 0.02
TYPES = {"f4": "<f4", "u4": "<u4", "u2": "<u2", "u1": "u1"}


@dataclass(frozen=True, eq=False)
class ViewPath:
    """Where the tool stands at each row: ``place`` (n, 3) [mm], ``axis`` (n, 3), time ``t`` [s], path ``s`` [mm],
    number of the ``tool``, ``line`` of the text (None: not known), whether the row is ``apart`` from the one before,
    whether it is in ``air`` (None: not known).
    """

    place: Floats
    axis: Floats
    t: Floats
    s: Floats
    tool: Ints
    line: Ints | None
    apart: Bools
    air: Bools | None = None


@dataclass(frozen=True, eq=False)
class Colouring:
    """Values of a column at the rows through which the path is drawn.

    Parameters
    ----------
    label, unit : of the column
    low, high : ends of the scale; ``limit`` what rows exceed, or, where ``least``, are below; None: none is stated
    words : word and colour of each code, for a column of words
    rows : (m,) that the drawn path goes through
    values : (m,) nan: none
    above : (m,) whether the limit is exceeded
    frames : (f,) greatest value in the rows of each frame of the stock, nan: none; None: it is not draped on the stock
    frames_above : (f,) whether the limit is exceeded in a frame
    """

    label: str
    unit: str
    low: float
    high: float
    limit: float | None
    least: bool
    words: tuple[tuple[str, str], ...]
    rows: Ints
    values: Floats
    above: Bools
    frames: Floats | None = None
    frames_above: Bools | None = None


@dataclass(frozen=True)
class ViewMark:
    """A place that is marked: a ``limit`` that is exceeded, a ``collision`` of ``bodies`` by ``depth_mm``, or the
    ``critical`` limit, which is not exceeded.
    """

    row: int
    at: tuple[float, float, float]
    text: str
    kind: str
    bodies: tuple[str, ...] = ()
    depth_mm: float = 0.0


@dataclass(frozen=True, eq=False)
class ViewScene:
    """All that a view shows: ``cutters`` are parts (kind, profile) by tool number, 0 for every other; ``columns`` other
    colours to choose from; ``samples`` what the teeth cut at some rows, ``bounds`` limits of force [N] and torque
    [N m] by their columns; ``operating`` speed and margin of each row; ``maps`` to choose one from.
    """

    title: str
    bodies: Sequence[SceneBody]
    removal: RemovalMesh | None
    path: ViewPath
    cutters: Mapping[int, Sequence[tuple[str, Floats]]]
    marks: Sequence[ViewMark]
    colouring: Colouring | None
    columns: Sequence[Colouring] = ()
    samples: EngagementSamples | None = None
    bounds: Mapping[str, float] = field(default_factory=dict)
    operating: OperatingPoints | None = None
    maps: Sequence[ShownMap] = ()


class Buffers:
    """The arrays of a document."""

    def __init__(self) -> None:
        self.data = bytearray()

    def put(self, values: NDArray[Any], kind: str) -> dict[str, Any]:
        """Add an array; how the header names it."""
        array = np.ascontiguousarray(values, dtype=TYPES[kind])
        out = {"at": len(self.data), "n": int(array.size), "t": kind}
        self.data += array.tobytes()
        self.data += b"\0" * (-len(self.data) % 4)
        return out


def scene_document(scene: ViewScene, kept: int = KEPT, shared: bool = False, cells: float = 0.0) -> bytes:
    """The document of a scene, with ``kept`` rows of the path at most.

    ``shared``: without bodies and maps, which are those of another document that is shown with it; ``cells``: the
    stock is rounded to so much of the distance of its rays.
    """
    out = Buffers()
    path, removal = scene.path, scene.removal
    low, high = _box(scene)
    header: dict[str, Any] = {
        "title": scene.title,
        "low": low.tolist(),
        "high": high.tolist(),
        "scale": SCALE,
        "bodies": [] if shared else [_body(body, out) for body in scene.bodies],
        "removal": None if removal is None else _removal(removal, out, cells),
        "path": _path(path, out, kept),
        "cutters": {
            str(n): [{"kind": kind, "profile": np.round(p, 6).tolist()} for kind, p in parts]
            for n, parts in scene.cutters.items()
        },
        "marks": [
            {"row": m.row, "at": m.at, "text": m.text, "kind": m.kind, "bodies": m.bodies, "depth": m.depth_mm}
            for m in scene.marks
        ],
        "colouring": None if scene.colouring is None else _colour_values(scene.colouring, path, out),
        "columns": [_colour_values(c, path, out) for c in scene.columns],
        "maps": [] if shared else [_map(one, out) for one in scene.maps],
        "stability": None if scene.operating is None else _chart_values(scene.operating, len(path.t), kept, out),
        "engagement": None if scene.samples is None else _engagement(scene.samples, scene.bounds, out),
    }
    return _document(header, out)


def colouring_document(colouring: Colouring, path: ViewPath) -> bytes:
    """The document of other colours of the same path."""
    out = Buffers()
    return _document({"colouring": _colour_values(colouring, path, out)}, out)


def parts_of(cutter: Cutter) -> list[tuple[str, Floats]]:
    """The parts of a cutter as profiles (m, 2) of distance from the axis and height over the tip [mm].

    >>> [kind for kind, _ in parts_of(Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, holder=((40.0, 32.0),)))]
    ['flutes', 'shank', 'holder']
    """
    flutes = cutter.profile(CHORD_MM)
    rho, top = float(flutes[-1, 0]), float(flutes[-1, 1])
    if flutes[0, 0] > 0.0:
        flutes = np.vstack([[0.0, flutes[0, 1]], flutes])
    wide = 0.5 * cutter.shank_diameter if cutter.shank_diameter is not None else rho
    out = [("flutes", flutes)]
    if cutter.overhang > top:
        out.append(("shank", np.array([[rho, top], [wide, top], [wide, cutter.overhang], [0.0, cutter.overhang]])))
    z = cutter.overhang
    for length, diameter in cutter.holder:
        r = 0.5 * diameter
        out.append(("holder", np.array([[0.0, z], [r, z], [r, z + length], [0.0, z + length]])))
        z += length
    return out


def pointer_parts(size: float) -> list[tuple[str, Floats]]:
    """A pointer for a cutter whose shape is not known: a thin cone on its tip."""
    return [("pointer", np.array([[0.0, 0.0], [0.12 * size, size], [0.0, size]]))]


def viewer_script() -> str:
    """The script that shows a document (three.js within), as built from viewer/."""
    return resources.files("chipload.report").joinpath("viewer", "viewer.js").read_text("utf-8")


def _document(header: Mapping[str, Any], out: Buffers) -> bytes:
    text = json.dumps(header, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return MAGIC + struct.pack("<I", len(text)) + text + bytes(out.data)


def _box(scene: ViewScene) -> tuple[Floats, Floats]:
    """The box that a view shows: the bodies; path and table of the machine as far as they leave them by a share."""
    path, removal = scene.path.place, scene.removal
    boxes = [(b.low, b.high) for b in scene.bodies if b.name != MACHINE_TABLE]
    boxes += [(removal.low, removal.high)] if removal is not None else []
    first, last = path.min(axis=0), path.max(axis=0)
    if not boxes:
        return first, last
    low, high = np.min([b[0] for b in boxes], axis=0), np.max([b[1] for b in boxes], axis=0)
    room = AROUND * float(np.linalg.norm(high - low))
    tables = [b for b in scene.bodies if b.name == MACHINE_TABLE]
    first, last = np.min([first, *(b.low for b in tables)], axis=0), np.max([last, *(b.high for b in tables)], axis=0)
    return np.minimum(low, np.maximum(first, low - room)), np.maximum(high, np.minimum(last, high + room))


def _body(body: SceneBody, out: Buffers) -> dict[str, Any]:
    return {
        "name": body.name,
        "kind": body.kind,
        "positions": out.put(body.vertices, "f4"),
        "index": out.put(body.faces, "u4"),
        **(
            {"colour": body.colours[:3].tolist()}
            if body.colours.ndim == 1
            else {"colours": out.put(body.colours[:, :3], "u1")}
        ),
        **({} if body.legend is None else {"legend": body.legend}),
    }


def _removal(removal: RemovalMesh, out: Buffers, cells: float) -> dict[str, Any]:
    """Corners as vertices in steps and as vertices of quads, each as the difference from the one before."""
    size = removal.high - removal.low
    step = np.maximum(np.round(cells * removal.cell * STEPS / np.where(size > 0.0, size, 1.0)), 1.0)
    corners = np.round(removal.corners.reshape(-1, 3) / step).astype(np.int64)
    # vertices are numbered in the order in which the quads come to them
    coded = pa.array(corners @ [1, 1 << 16, 1 << 32]).dictionary_encode()
    keys, quads = coded.dictionary.to_numpy(), coded.indices.to_numpy().astype(np.int64).reshape(-1, 4)
    vertices = np.stack([keys & 0xFFFF, keys >> 16 & 0xFFFF, keys >> 32], axis=1)
    return {
        "low": removal.low.tolist(),
        "high": removal.high.tolist(),
        "step": step.tolist(),
        "vertices": out.put(_differences(vertices) % (1 << 16), "u2"),
        "quads": out.put(_differences(quads) % (1 << 32), "u4"),
        "seen": out.put(removal.seen, "u2"),
        "rows": out.put(removal.rows, "u4"),
    }


def _differences(rows: Ints) -> Ints:
    """Column by column the difference from the row before: they pack well."""
    return np.ascontiguousarray(np.diff(rows, axis=0, prepend=0).T)


def _path(path: ViewPath, out: Buffers, kept: int) -> dict[str, Any]:
    n = len(path.t)
    rows = _kept_rows(n, kept)
    upright = bool((np.abs(path.axis - [0.0, 0.0, 1.0]) < 1e-9).all())
    return {
        "count": n,
        "rows": out.put(rows, "u4"),
        "points": out.put(path.place[rows], "f4"),
        "axes": None if upright else out.put(path.axis[rows], "f4"),
        "t": out.put(path.t[rows], "f4"),
        "s": out.put(path.s[rows], "f4"),
        "tool": out.put(path.tool[rows], "u4"),
        "apart": out.put(_breaks(path.apart, rows), "u1"),
        "line": None if path.line is None else out.put(np.maximum(path.line[rows], 0), "u4"),
    }


def _colour_values(c: Colouring, path: ViewPath, out: Buffers) -> dict[str, Any]:
    return {
        "label": c.label,
        "unit": c.unit,
        "low": c.low,
        "high": c.high,
        "limit": c.limit,
        "least": c.least,
        "words": c.words,
        "rows": out.put(c.rows, "u4"),
        "points": out.put(path.place[c.rows], "f4"),
        "breaks": out.put(_breaks(path.apart, c.rows), "u1"),
        "air": None if path.air is None else out.put(path.air[c.rows], "u1"),
        "values": out.put(c.values, "f4"),
        "above": out.put(c.above, "u1"),
        "frames": None if c.frames is None else out.put(c.frames, "f4"),
        "frames_above": None if c.frames_above is None else out.put(c.frames_above, "u1"),
    }


def _map(one: ShownMap, out: Buffers) -> dict[str, Any]:
    return {
        "name": one.name,
        "label": one.label,
        "unit": one.unit,
        "low": one.low,
        "high": one.high,
        "limit": one.limit,
        "tolerance": one.tolerance,
        "positions": out.put(one.points, "f4"),
        "index": out.put(one.faces, "u4"),
        "values": out.put(one.values, "f4"),
        "lines": out.put(one.lines, "f4"),
        "moved": None if one.moved is None else out.put(one.moved, "f4"),
        "lines_moved": None if one.lines_moved is None else out.put(one.lines_moved, "f4"),
    }


def _kept_rows(n: int, kept: int) -> Ints:
    """Rows of n that are kept, even and at most so many."""
    return np.arange(n) if n <= kept else np.unique(np.linspace(0, n - 1, kept).astype(np.int64))


def _chart_values(points: OperatingPoints, n: int, kept: int, out: Buffers) -> dict[str, Any]:
    rows = _kept_rows(n, kept)
    charts = {str(tool): {"rpm": rpm, "margin": margin} for tool, (rpm, margin) in points.charts.items()}
    return {
        "wanted": points.wanted,
        "charts": charts,
        "rpm": out.put(points.rpm[rows], "f4"),
        "margin": out.put(points.margin[rows], "f4"),
    }


def _engagement(samples: EngagementSamples, bounds: Mapping[str, float], out: Buffers) -> dict[str, Any]:
    return {
        "stride": samples.stride,
        "bounds": dict(bounds),
        "rotations": samples.turn.shape[1],
        **{name: out.put(getattr(samples, name), "u4") for name in ("row", "tool", "flutes", "periods", "start")},
        **{name: out.put(getattr(samples, name), "f4") for name in ("frame", "ranges", "turn")},
    }


def _breaks(apart: Bools, rows: Ints) -> Bools:
    """Return whether a gap lies between each of the chosen rows and the one before it."""
    count = np.cumsum(apart)[rows]
    return np.asarray(np.diff(count, prepend=count[:1]) > 0)
