"""A small picture of a result for the list of results: its bodies, and the path coloured by its critical limit.

Notation: the picture is taken as the first view is, parallel and from a corner; pixels (h, w) with y down, depth
towards the eye. It is drawn twice as large and averaged, so that edges are smooth.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.lazy import pa, pq
from chipload.report.bodies import MACHINE_TABLE, SceneBody, scene_bodies
from chipload.report.removal import REMOVAL, read_removal
from chipload.result import read_summary
from chipload.result.first_lines import critical_check
from chipload.result.load import HISTORY
from chipload.result.style import SCALE, STOCK
from chipload.result.summary import Summary, limit_from
from chipload.stock.surface_net import STEPS
from chipload.web.folder_access import resolve_name
from chipload.web.result import PLACE, SCENE

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: width and height [pixels], how many times as large it is drawn, and its margin
WIDE, HIGH, FINE, MARGIN = 312, 198, 2, 8
#: direction to the eye, as the first view of the page has it
EYE = np.array([0.62, -1.0, 0.78]) / np.linalg.norm([0.62, -1.0, 0.78])
RIGHT = np.array([1.0, 0.62, 0.0]) / np.hypot(1.0, 0.62)
UP = np.cross(EYE, RIGHT)
#: direction to the light
LIGHT = 0.55 * EYE - 0.35 * RIGHT + 0.76 * UP
#: largest scene [bytes], points of the bodies and rows of the path that are drawn
LARGEST, POINTS, ROWS = 60_000_000, 1_500_000, 20_000
#: points of a surface a pixel
DENSE = 4.0
#: a path that cuts nothing
SOFT = np.array([120.0, 132.0, 146.0])


def thumbnail(root: Path, name: str) -> bytes:
    """Return the picture of a result as a PNG with a transparent ground.

    Raises
    ------
    InputError
        It is no result.
    """
    summary = read_summary(resolve_name(root, name))
    shown = _shown_track(summary)
    try:
        place, colours = _path(resolve_name(root, f"{name}/{HISTORY}"), summary, shown)
    except (InputError, OSError, pa.ArrowException, UnicodeDecodeError, KeyError):
        place, colours = np.zeros((0, 3)), np.zeros((0, 3))
    return png(picture(_bodies(root, name, shown), place, colours))


def picture(bodies: list[SceneBody], place: Floats, colours: Floats) -> NDArray[np.uint8]:
    """Return the (HIGH, WIDE, 4) picture of bodies and of a path.

    Parameters
    ----------
    place, colours : (n, 3) places of the path [mm], and the colour of each, 0 to 255
    """
    shown = np.vstack([np.zeros((0, 3)), *(b.vertices for b in bodies)]) if bodies else place
    wide, high = WIDE * FINE, HIGH * FINE
    image, depth = np.zeros((high * wide, 4)), np.full(high * wide, -np.inf)
    if not len(shown):
        return np.zeros((HIGH, WIDE, 4), dtype=np.uint8)
    flat = np.stack([shown @ RIGHT, shown @ UP], axis=1)
    low, size = flat.min(axis=0), np.maximum(np.ptp(flat, axis=0), 1e-6)
    scale = float(min((wide - 2 * FINE * MARGIN) / size[0], (high - 2 * FINE * MARGIN) / size[1]))
    middle = low + 0.5 * size

    def pixels(points: Floats) -> tuple[Ints, NDArray[np.bool_]]:
        x = np.floor((points @ RIGHT - middle[0]) * scale + 0.5 * wide).astype(np.int64)
        y = np.floor((middle[1] - points @ UP) * scale + 0.5 * high).astype(np.int64)
        in_picture = (x >= 0) & (x < wide) & (y >= 0) & (y < high)
        return np.where(in_picture, y * wide + x, 0), in_picture

    for body in bodies:
        points, shades = _surface(body, scale, POINTS // len(bodies))
        # a part in a plane of the stock lies behind it
        near = points @ EYE - (0.004 * float(size.max()) if body.kind == "part" else 0.0)
        at, in_picture = pixels(points)
        seen = np.flatnonzero(in_picture & (near > depth[at]))
        seen = seen[np.argsort(near[seen], kind="stable")]
        image[at[seen], :3], image[at[seen], 3], depth[at[seen]] = shades[seen], 255.0, near[seen]
    _fill(image.reshape(high, wide, 4), depth.reshape(high, wide), 0.002 * float(size.max()))
    points, shades = _dots(place, colours, scale)
    near = points @ EYE + 0.01 * float(size.max())
    for shift in (0, 1, wide, wide + 1):
        at, in_picture = pixels(points)
        at = np.minimum(at + shift, high * wide - 1)
        seen = np.flatnonzero(in_picture & (near > depth[at]))
        image[at[seen], :3], image[at[seen], 3] = shades[seen], 255.0
    parts = image.reshape(HIGH, FINE, WIDE, FINE, 4)
    cover = parts[..., 3:].sum(axis=(1, 3))
    mean = (parts[..., :3] * parts[..., 3:]).sum(axis=(1, 3)) / np.maximum(cover, 1.0)
    return np.concatenate([mean, cover / FINE**2], axis=-1).round().astype(np.uint8)


def png(pixels: NDArray[np.uint8]) -> bytes:
    """Return a picture (h, w, 4) as a PNG file (ISO/IEC 15948: signature, header, data, end)."""
    high, wide = pixels.shape[:2]

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = np.hstack([np.zeros((high, 1), dtype=np.uint8), pixels.reshape(high, -1)])
    header = struct.pack(">IIBBBBB", wide, high, 8, 6, 0, 0, 0)
    parts = chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)), chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


# -- parts ------------------------------------------------------------------------------------------------------
def _shown_track(summary: Summary) -> int:
    """The number of the first track in use that has rows, else of the first that has."""
    with_rows = [k for k, one in enumerate(summary.tracks) if one.rows]
    return next((k for k in with_rows if summary.tracks[k].in_use), with_rows[0] if with_rows else 0)


def _bodies(root: Path, name: str, track: int) -> list[SceneBody]:
    """Part, painted surfaces and stock, which is that after the last row where the result has it."""
    try:
        removal = read_removal(resolve_name(root, f"{name}/{REMOVAL}"), track)
    except InputError:
        removal = None
    try:
        scene = resolve_name(root, f"{name}/{SCENE}")
        without = ("fixture",) if removal is None else ("fixture", "stock")
        found = scene_bodies(scene.read_bytes(), without=without) if scene.stat().st_size <= LARGEST else ()
    except Exception:  # a reader of foreign files may fail in any way; the path is drawn alone
        found = ()
    bodies = [b for b in found if b.name != MACHINE_TABLE]
    if removal is not None:
        last = removal.seen[:, 1] > len(removal.rows)
        vertices = removal.low + removal.corners[last].reshape(-1, 3) * ((removal.high - removal.low) / STEPS)
        first = 4 * np.arange(len(vertices) // 4)[:, None]
        faces = np.vstack([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
        colour = np.array([int(STOCK[k : k + 2], 16) for k in (1, 3, 5)], dtype=np.uint8)
        bodies.append(SceneBody("stock", "stock", vertices, faces, colour, len(faces)))
    return [b for b in bodies if len(b.faces)]


def _surface(body: SceneBody, scale: float, most: int) -> tuple[Floats, Floats]:
    """Points (n, 3) spread over the triangles of a body, dense enough for its pixels, and their shaded colours."""
    faces = body.faces
    a, b, c = (body.vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    kept = np.flatnonzero(length > 0.0)
    a, b, c, normal, length, faces = a[kept], b[kept], c[kept], normal[kept], length[kept], faces[kept]
    facing = np.abs(normal @ EYE) / length
    area = 0.5 * length * facing * scale**2
    count = np.ceil(DENSE * area * min(1.0, most / max(DENSE * float(area.sum()), 1.0))).astype(np.int64) + 1
    of = np.repeat(np.arange(len(count)), count)
    k = np.arange(len(of))
    # even points of a square (the additive sequence of the plastic number), folded into the triangle
    u, v = (0.5 + k * 0.7548776662466927) % 1.0, (0.5 + k * 0.5698402909980532) % 1.0
    fold = u + v > 1.0
    u, v = np.where(fold, 1.0 - u, u)[:, None], np.where(fold, 1.0 - v, v)[:, None]
    points = a[of] + u * (b - a)[of] + v * (c - a)[of]
    shade = 0.5 + 0.5 * np.abs(normal @ LIGHT) / length
    own = body.colours[:3] if body.colours.ndim == 1 else body.colours[faces[:, 0], :3]
    return points, np.minimum(np.broadcast_to(own, (len(faces), 3)) * shade[:, None], 255.0)[of]


def _fill(image: Floats, depth: Floats, step: float) -> None:
    """Close gaps of one pixel between nearer ones on both sides, in place: no point fell into them."""
    for axis in (1, 0):
        before, after = np.roll(depth, 1, axis), np.roll(depth, -1, axis)
        empty = np.minimum(before, after) > depth + step
        image[empty], depth[empty] = np.roll(image, 1, axis)[empty], before[empty]


def _dots(place: Floats, colours: Floats, scale: float) -> tuple[Floats, Floats]:
    """Points along a path, one a pixel, and their colours."""
    if len(place) < 2:
        return place, colours
    step = np.diff(place, axis=0)
    count = np.minimum(np.ceil(np.linalg.norm(step, axis=1) * scale), WIDE * FINE).astype(np.int64) + 1
    of = np.repeat(np.arange(len(count)), count)
    k = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    return place[of] + (k / count[of])[:, None] * step[of], colours[of + 1]


def _path(history: Path, summary: Summary, track: int) -> tuple[Floats, Floats]:
    """Places of a track, and their colours by the column of its critical limit; soft where nothing is cut."""
    if not summary.tracks:
        return np.zeros((0, 3)), np.zeros((0, 3))
    model, first = summary.tracks[track], sum(one.rows for one in summary.tracks[:track])
    critical = critical_check(limit_from(one) for one in model.limits)
    column = critical.column.name if critical is not None else ""
    known = pq.read_schema(history).names
    table = pq.read_table(history, columns=[*PLACE, *([column] if column in known else [])]).slice(first, model.rows)
    if not table.num_rows:
        return np.zeros((0, 3)), np.zeros((0, 3))
    rows = np.unique(np.linspace(0, table.num_rows - 1, ROWS).astype(np.int64))
    read = {n: np.asarray(table[n].to_numpy(), dtype=np.float64)[rows] for n in table.column_names}
    place = np.nan_to_num(np.stack([read[n] for n in PLACE], axis=1))
    values = np.nan_to_num(np.abs(read[column])) if column in read else np.zeros(len(rows))
    share = np.clip(values / max(float(values.max(initial=0.0)), 1e-30), 0.0, 1.0)
    stops = np.array([s for s, _ in SCALE], dtype=np.float64)
    scale = np.array([[int(str(c)[k : k + 2], 16) for k in (1, 3, 5)] for _, c in SCALE], dtype=np.float64)
    colours = np.stack([np.interp(share, stops, scale[:, k]) for k in range(3)], axis=1)
    return place, np.where(values[:, None] > 0.0, colours, SOFT)
