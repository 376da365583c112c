"""What the 3D view shows: the bodies of a result's scene, its path in the colours of a column, its cutter.

Notation: the path is a thin tube of three sides through p_0, p_1, ... [mm]; a row above its limit is red whatever the
scale says. The cutter's tip is the origin and its axis +z until the page moves it.
"""

from __future__ import annotations

import io
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.report.figures import SCALE
from chipload.report.shape import thinned
from chipload.web.checks import bound_of
from chipload.web.glb import Shape, glb_bytes
from chipload.web.result import SCENE, PageResult, PageTrack, TextColumn

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: points that a drawn path has at most, about
POINTS = 16_000
#: radius of the tube by the diagonal of the path
THICK = 0.0034
#: the same by the square of the diagonal over the length of the path
DENSE = 0.12
#: colours: above a limit, no value, words one after another; opacity and bend [rad] of edges
ABOVE, NONE = (200, 30, 30, 255), (150, 156, 165, 255)
WORDS = ("#3457a6", "#c9821a", "#0b7a75", "#8a4fa3", "#7a8a2e", "#b0567a", "#4d8fb8", "#6b5b4b", "#94a0ae", "#2f6f3e")
CLEAR, BENT = 150, 0.35
FLUTES, SHANK = (126, 140, 158, 190), (176, 184, 194, 130)
#: largest scene [bytes] and triangles of one body that the page shows
LARGEST, TRIANGLES = 400_000_000, 400_000
#: chords of drawn corners leave them by at most this [mm]; sides of a drawn cutter
CHORD_MM, SIDES = 0.02, 48
#: nodes of a scene that the page draws itself
OWN = ("path", "rapids", "cutter")


@dataclass(frozen=True, eq=False)
class Body:
    """A body of the scene: its name, its GLB, its lower and upper corner [mm], its triangles and colour."""

    name: str
    glb: bytes
    low: Floats
    high: Floats
    mesh: trimesh.Trimesh
    colour: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Scale:
    """How a column is coloured: least and greatest value, the limit that rows exceed, or words with their colours."""

    low: float
    high: float
    limit: float | None
    words: tuple[tuple[str, str], ...] = ()


def bodies(result: PageResult) -> tuple[tuple[Body, ...], str]:
    """The bodies of scene.glb beside path and cutter, and a sentence where there are none."""
    try:
        path = result.file(SCENE)
    except InputError:
        return (), "This result has no scene: only its path is shown."
    try:
        if path.stat().st_size > LARGEST:
            return (), f"{SCENE} is larger than {LARGEST // 1_000_000} MB: only the path is shown."
        scene = trimesh.load(io.BytesIO(path.read_bytes()), file_type="glb", force="scene")
        out = [_body(name, mesh) for name, mesh in _meshes(scene) if not _own(name)]
    except Exception:  # a reader of foreign files may fail in any way; the page says so
        return (), f"{SCENE} cannot be read: only the path is shown."
    return tuple(out), "" if out else "The scene of this result holds no body: only the path is shown."


def edges_glb(body: Body) -> bytes:
    """The edges of a body at which it bends, and those of one face only, to see through it."""
    mesh = body.mesh
    bent = mesh.face_adjacency_edges[mesh.face_adjacency_angles > BENT]
    every, count = np.unique(np.sort(mesh.edges, axis=1), axis=0, return_counts=True)
    lines = np.vstack([bent, every[count == 1]]).astype(np.int64)
    colour = np.append(body.colour[:3], CLEAR).astype(np.uint8)
    return glb_bytes([Shape(np.asarray(mesh.vertices, dtype=np.float64), lines, colour, lit=False)])


def path_glb(result: PageResult, track: PageTrack, column: str) -> tuple[bytes, Scale]:
    """The path of a track coloured by a column, and what the colours mean."""
    values = result.column(track, column)
    rows = shown_rows(track, values)
    if isinstance(values, TextColumn):
        own = [(*_rgb(c), 255) for c in WORDS]
        table = np.array([*(own[k % len(own)] for k in range(len(values.words))), NONE], dtype=np.uint8)
        colours = table[np.where(values.codes[rows] < 0, len(values.words), values.codes[rows])]
        present = np.unique(values.codes[values.codes >= 0]).tolist()
        words = tuple((values.words[k], WORDS[k % len(WORDS)]) for k in present)
        scale = Scale(0.0, 1.0, None, words)
    else:
        finite = values[np.isfinite(values)]
        low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
        bound = bound_of(result, track, column)
        above = bound.above if bound is not None else np.zeros(len(values), dtype=np.bool_)
        scale = Scale(low, high, bound.limit if bound is not None and above.any() else None)
        colours = shades(values[rows], scale, above[rows])
    return glb_bytes([tube(track.place[rows], _apart(track, rows), colours, radius(track))]), scale


def shades(values: Floats, scale: Scale, above: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """(n, 4) colours: dark (least) to bright (greatest), red above the limit, grey where there is no value.

    >>> shades(np.array([0.0, 2.0, 3.0]), Scale(0.0, 2.0, 2.5), np.array([False, False, True])).tolist()
    [[48, 36, 92, 255], [251, 182, 26, 255], [200, 30, 30, 255]]
    """
    stops = np.array([_rgb(str(c)) for _, c in SCALE], dtype=np.float64)
    span = scale.high - scale.low
    share = np.clip((np.nan_to_num(values) - scale.low) / span, 0.0, 1.0) if span > 0.0 else np.zeros(len(values))
    places = np.array([s for s, _ in SCALE], dtype=np.float64)
    rgb = [np.interp(share, places, stops[:, k]) for k in range(3)]
    out = np.column_stack([*rgb, np.full(len(values), 255.0)]).round().astype(np.uint8)
    out[~np.isfinite(values)] = NONE
    out[above] = ABOVE
    return out


def shown_rows(track: PageTrack, values: Floats | TextColumn) -> Ints:
    """(m,) rows that a drawn path goes through: extremes of place and value, and where it breaks or a word changes."""
    n = len(track)
    if n <= POINTS:
        return np.arange(n)
    worth = values.codes.astype(np.float64) if isinstance(values, TextColumn) else values
    filled = np.where(np.isfinite(worth), worth, 0.0)
    keep = [thinned(track.place[:, k], POINTS // 4) for k in range(3)] + [thinned(filled, POINTS // 4)]
    gaps = np.flatnonzero(track.apart)
    if len(gaps) <= POINTS:
        keep += [gaps, gaps - 1]
    return np.unique(np.concatenate(keep))


def radius(track: PageTrack) -> float:
    """Radius of the drawn tube [mm]: thinner where the path is so long that it would hide itself."""
    size = float(np.linalg.norm(np.ptp(track.place, axis=0)))
    return max(min(THICK * size, DENSE * size * size / max(float(track.s[-1] - track.s[0]), size)), 1e-3)


def tube(points: Floats, apart: NDArray[np.bool_], colours: NDArray[np.uint8], size: float) -> Shape:
    """Three-sided tube of radius ``size`` [mm] through points, not drawn to a point that is ``apart``.

    >>> tube(np.array([[0.0, 0, 0], [9, 0, 0]]), np.array([False, False]), np.zeros((2, 4), np.uint8), 1.0).faces.shape
    (6, 3)
    """
    n = len(points)
    step = np.diff(points, axis=0, append=points[-1:])
    step[:-1][apart[1:]] = 0.0
    before = np.vstack([np.zeros((1, 3)), step[:-1]])
    along = _unit(step) + _unit(before)
    still = np.linalg.norm(along, axis=1) < 1e-9
    along = np.where(still[:, None], np.where(np.linalg.norm(step, axis=1)[:, None] > 0.0, step, before), along)
    along = _unit(along)
    along[np.linalg.norm(along, axis=1) == 0.0] = (1.0, 0.0, 0.0)
    other = np.where(np.abs(along[:, 2:]) < 0.9, np.array([[0.0, 0.0, 1.0]]), np.array([[1.0, 0.0, 0.0]]))
    u = _unit(np.cross(other, along))
    v = np.cross(along, u)
    turns = np.arange(3) * (math.tau / 3.0) + 0.5 * math.pi
    rings = points[:, None, :] + size * (
        np.cos(turns)[None, :, None] * u[:, None, :] + np.sin(turns)[None, :, None] * v[:, None, :]
    )
    k = np.flatnonzero(~apart[1:])
    faces = []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        low_a, low_b, high_a, high_b = 3 * k + a, 3 * k + b, 3 * (k + 1) + a, 3 * (k + 1) + b
        faces += [np.column_stack([low_a, low_b, high_b]), np.column_stack([low_a, high_b, high_a])]
    index = np.vstack(faces) if n > 1 else np.zeros((0, 3), dtype=np.int64)
    return Shape(rings.reshape(-1, 3), index, np.repeat(colours, 3, axis=0), lit=False)


def cutter_glb(cutter: Cutter) -> bytes:
    """The envelope of the flutes and the shank above, its tip in the origin."""
    flutes = cutter.profile(CHORD_MM)
    top = float(flutes[-1, 1])
    wide = 0.5 * cutter.shank_diameter if cutter.shank_diameter is not None else float(flutes[-1, 0])
    shank = np.array([[flutes[-1, 0], top], [wide, top], [wide, cutter.overhang], [0.0, cutter.overhang]])
    shapes = [_revolved(flutes, FLUTES)]
    if cutter.overhang > top:
        shapes.append(_revolved(shank, SHANK))
    return glb_bytes(shapes)


def outline_glb(shape: Sequence[float], height: float) -> bytes:
    """The envelope (d, r, e, f, alpha, beta, h) [mm, rad] that CL data states, up to ``height`` where h is 0."""
    d, r, _, _, alpha, beta, h = shape
    length = h if h > 0.0 else height
    return cutter_glb(Cutter(d, 1, 0.0, length, length, 2e5, corner_radius=r, bottom=alpha, taper=beta))


def needle_glb(size: float) -> bytes:
    """A pointer for a cutter whose shape is not known: a thin cone on its tip."""
    return glb_bytes([_revolved(np.array([[0.0, 0.0], [0.12 * size, size], [0.0, size]]), (60, 70, 84, 220))])


# -- parts ------------------------------------------------------------------------------------------------------
def _rgb(colour: str) -> tuple[int, int, int]:
    """`#rrggbb` as numbers."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def _own(name: str) -> bool:
    """Whether the page draws a node itself.

    >>> [_own(n) for n in ("0-path-plain", "rapids", "0-wall", "stock", "1-cutter")]
    [True, True, False, False, True]
    """
    plain = name.split("-", 1)[1] if name.split("-", 1)[0].isdigit() and "-" in name else name
    return plain.startswith(OWN)


def _meshes(scene: trimesh.Scene) -> list[tuple[str, trimesh.Trimesh]]:
    out = []
    for node in scene.graph.nodes_geometry:
        transform, geometry = scene.graph[node]
        mesh = scene.geometry[geometry]
        if isinstance(mesh, trimesh.Trimesh) and 0 < len(mesh.faces) <= TRIANGLES:
            out.append((str(node), mesh.copy().apply_transform(transform)))
    return out


def _body(name: str, mesh: trimesh.Trimesh) -> Body:
    visual = mesh.visual
    colours = np.asarray(visual.to_color().vertex_colors if visual.kind == "texture" else visual.vertex_colors)
    each = colours.reshape(-1, 4).astype(np.uint8)
    if len(each) != len(mesh.vertices):
        each = np.tile(np.array([[168, 176, 186, 255]], dtype=np.uint8), (len(mesh.vertices), 1))
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    painted = each[0] if (each == each[0]).all() else each
    low, high = mesh.bounds
    glb = glb_bytes([Shape(vertices, np.asarray(mesh.faces, dtype=np.int64), painted)])
    return Body(name, glb, low, high, mesh, each[0])


def _revolved(profile: Floats, colour: tuple[int, int, int, int]) -> Shape:
    """Triangles of a profile (m, 2) (rho, z) turned about z."""
    turn = np.arange(SIDES) * (math.tau / SIDES)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    points = np.concatenate([np.column_stack([rho * ring, np.full(SIDES, z)]) for rho, z in profile])
    a = np.arange(SIDES)
    b = (a + 1) % SIDES
    faces = [
        part
        for k, _ in enumerate(itertools.pairwise(profile))
        for part in (
            np.column_stack([k * SIDES + a, k * SIDES + b, (k + 1) * SIDES + b]),
            np.column_stack([k * SIDES + a, (k + 1) * SIDES + b, (k + 1) * SIDES + a]),
        )
    ]
    return Shape(points, np.vstack(faces), np.array(colour, dtype=np.uint8))


def _apart(track: PageTrack, rows: Ints) -> NDArray[np.bool_]:
    """Whether a gap lies between each of the chosen rows and the one before it."""
    count = np.cumsum(track.apart)[rows]
    return np.asarray(np.diff(count, prepend=count[:1]) > 0)


def _unit(v: Floats) -> Floats:
    length = np.linalg.norm(v, axis=1)[:, None]
    return np.where(length > 0.0, v / np.where(length > 0.0, length, 1.0), 0.0)
