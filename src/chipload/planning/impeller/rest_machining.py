"""Rest machining: places that all passes together leave too high, and the rest passes for them.

Notation: p, q the parameters along a rest pass and across; h height of the scallop. A surface has a grid finer than the
narrowest step of a corner. The excess at a grid point is its distance from the poses of every track that touch near it,
along the normal by one step of the secant (``scallop_height.py``). Connected points are a region. A region is milled
with the cutter and table angle that have valid pallet angles at most of its points: first one in use, then the cutters
in use at any angle, then smaller ones. The grid is checked again after each round; a cutter that was tried in a region
at an angle is not tried there again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.geometry.bspline import BSplinePatch
from chipload.lazy import LateModule, scipy
from chipload.planning.impeller.kept import Keep, anew
from chipload.planning.impeller.lines import LineMotion, Lines, stretch_stations
from chipload.planning.impeller.pallet_ranges import valid_ranges
from chipload.planning.impeller.scallop_height import pose_distance
from chipload.planning.impeller.scene import Floats, Ints, Scene
from chipload.planning.impeller.track import ToolTrack

_scallop = LateModule("chipload.planning.impeller._scallop")

#: points of a region that are tried
_SAMPLE = 10
#: width of the cells in which poses are searched, as a share of the cutter's radius, and the least [mm]
_CELL, _LEAST_CELL = 0.5, 2.0
#: distance of grid points, and of rest passes, as a share of the step of a corner on a plane
_GRID, _STEP = 0.45, 0.85
#: distance of poses by which what is left is counted, over that by which steps are laid out: a point beside the highest
#: of a scallop, counted by the pass that is farther away, must not come out above it
_FINER = 0.5
#: stations of a rest pass are no farther apart than this [mm]
_STATIONS = 1.5

Flags = NDArray[np.bool_]
Pair = tuple[int, float]  # index of a cutter, table angle [rad]


@dataclass(frozen=True, eq=False)
class SurfaceGrid:
    """Grid of points over a surface that is milled.

    Parameters
    ----------
    body, side : as of a patch
    surface, number : the patch with u and v, its number in the scene
    u, v : of the grid
    points, normals : (a, b, 3)
    tried : for each cutter at a table angle the points (a, b) of regions that were milled so
    """

    body: int
    side: str
    surface: BSplinePatch
    number: int
    u: Floats
    v: Floats
    points: Floats
    normals: Floats
    tried: dict[Pair, Flags] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class RestPasses:
    """Rest passes of one region.

    Parameters
    ----------
    body, side : of the surface
    box : (low, high) of u, of v
    tracks : the passes
    """

    body: int
    side: str
    box: tuple[tuple[float, float], tuple[float, float]]
    tracks: tuple[ToolTrack, ...]


def face_of(
    body: int, side: str, surface: BSplinePatch, number: int, box: tuple[tuple[float, float], tuple[float, float]],
    scallop: float, corner: float, fine: float = 1.0,
) -> SurfaceGrid:  # fmt: skip
    """The grid of a surface, fine enough for what a corner [mm] leaves at a scallop [mm]. Its points are closer
    together as ``fine`` falls below 1.
    """
    spacing = fine * _GRID * corner_step(corner, scallop)
    t = [np.linspace(low, high, 33) for low, high in box]
    sizes = []
    for k in (0, 1):
        lines = [surface.at(t[0], q) if k == 0 else surface.at(q, t[1]) for q in t[1 - k][::8]]
        sizes.append(max(float(np.linalg.norm(np.diff(x, axis=0), axis=1).sum()) for x in lines))
    u, v = (np.linspace(*b, max(3, math.ceil(size / spacing) + 1)) for b, size in zip(box, sizes, strict=True))
    U, V = (x.ravel() for x in np.meshgrid(u, v, indexing="ij"))
    shape = (len(u), len(v), 3)
    return SurfaceGrid(
        body, side, surface, number, u, v, surface.at(U, V).reshape(shape), surface.normal(U, V).reshape(shape)
    )


def corner_step(corner: float, scallop: float) -> float:
    """Step-over [mm] at which a corner leaves the scallop on a plane; the least of any toroid.

    >>> round(corner_step(2.0, 0.1), 4)
    1.249
    """
    h = min(scallop, corner)
    return 2.0 * math.sqrt(max(h * (2.0 * corner - h), 0.0))


def left_over(face: SurfaceGrid, passes: Sequence[tuple[CatalogueCutter, Sequence[ToolTrack]]]) -> Floats:
    """Excess that the tracks of every cutter leave on the grid, (a, b) float [mm]; inf where none comes near."""
    points = np.ascontiguousarray(face.points.reshape(-1, 3))
    normals = np.ascontiguousarray(face.normals.reshape(-1, 3))
    out = np.full(len(points), np.inf)
    for cutter, tracks in passes:
        contact, tips, axes, of = _poses(tracks, _FINER * pose_distance(cutter.corner_radius))
        if not len(contact):
            continue
        # two passes lie at most a radius apart: a point between them is within half of that from one of them
        size = max(0.5 * cutter.diameter * _CELL, _LEAST_CELL)
        low = contact.min(axis=0)
        at = np.floor((contact - low) / size).astype(np.int64)
        cells = at.max(axis=0) + 1
        number = (at[:, 0] * cells[1] + at[:, 1]) * cells[2] + at[:, 2]
        order = np.argsort(number, kind="stable")
        starts = np.searchsorted(number[order], np.arange(int(cells.prod()) + 1))
        _scallop.excess_of_poses(
            points, normals, cells, low, size, starts, order, tips, axes, of, cutter.rho, cutter.corner_radius, out
        )
    return out.reshape(face.points.shape[:2])


def _poses(tracks: Sequence[ToolTrack], fine: float) -> tuple[Floats, Floats, Floats, Ints]:
    """Contacts, tips, axes (n, 3) of tracks, at most ``fine`` apart [mm], and which track each is of."""
    parts: list[list[Floats]] = [[], [], []]
    for t in tracks:
        length = np.concatenate([[0.0], np.linalg.norm(np.diff(t.tip, axis=0), axis=1).cumsum()])
        at = np.linspace(0.0, length[-1], max(2, math.ceil(length[-1] / fine) + 1))
        for part, x in zip(parts, (t.contact, t.tip, t.axis), strict=True):
            part.append(np.column_stack([np.interp(at, length, x[:, k]) for k in range(3)]))
    contact, tip, axis = (np.concatenate(x) if x else np.zeros((0, 3)) for x in parts)
    of = np.repeat(np.arange(len(parts[0])), [len(x) for x in parts[0]])
    return contact, tip, axis / np.linalg.norm(axis, axis=1)[:, None], of


def regions(left: Floats, scallop: float, hopeless: Flags) -> list[Flags]:
    """Connected points (a, b) where the excess is more than the scallop, the largest region first."""
    over = (left > scallop) & ~hopeless
    joined, count = scipy.ndimage.label(scipy.ndimage.binary_dilation(over), structure=np.ones((3, 3)))
    out = [over & (joined == k) for k in range(1, count + 1)]
    return sorted((x for x in out if x.any()), key=lambda x: -int(x.sum()))


@dataclass(frozen=True, eq=False)
class RestSettings:
    """Parameters with which rest passes are planned.

    Parameters
    ----------
    scene, catalogue, motion, pallets, workers, keep : as for the patches
    used : cutters at table angles that are in use
    tables : all table angles [rad]
    """

    scene: Scene
    catalogue: Catalogue
    motion: LineMotion
    scallop: float
    overrun: float
    used: tuple[Pair, ...]
    tables: Floats
    pallets: tuple[tuple[float, float], ...]
    workers: int
    keep: Keep = anew

    def chosen(self, face: SurfaceGrid, region: Flags) -> Pair | None:
        """The cutter and table angle for a region; None: no untried one reaches any of its points."""
        return self.keep(self.pair_key(face, region), lambda: self._choose_pair(face, region))

    def pair_key(self, face: SurfaceGrid, region: Flags) -> tuple[object, ...]:
        """Key of the cutter and table angle of a region: everything that they depend on."""
        tried = tuple((k, a, x & region) for (k, a), x in face.tried.items() if (x & region).any())
        return ("rest pair", *self._place(face, region), self.catalogue, self.used, tried)

    def passes_key(self, face: SurfaceGrid, region: Flags, pair: Pair) -> tuple[object, ...]:
        """Key of the passes of a region."""
        return ("rest passes", *self._place(face, region), self.catalogue.cutters[pair[0]], pair[1])

    def _place(self, face: SurfaceGrid, region: Flags) -> tuple[object, ...]:
        """What a region is known by."""
        return (face.body, face.side, face.u, face.v, region)

    def _choose_pair(self, face: SurfaceGrid, region: Flags) -> Pair | None:
        where = np.argwhere(region)
        some = where[np.unique(np.linspace(0, len(where) - 1, _SAMPLE).round().astype(int))]
        best: tuple[float, float] = (0.0, 0.0)
        found: Pair | None = None
        for group in self._groups():
            for pair in group:
                tried = face.tried.get(pair)
                fresh = some if tried is None else some[~tried[some[:, 0], some[:, 1]]]
                if len(fresh) <= best[0] * len(some):
                    continue
                widths = self._widths(face, fresh, pair)
                score = (float((widths > 0.0).sum() / len(some)), float(widths.min()))
                if score[0] > 0.0 and score > best:
                    best, found = score, pair
            if best[0] == 1.0:
                break
        return found

    def _groups(self) -> list[list[Pair]]:
        """What is tried first, and then."""
        cutters = self.catalogue.cutters
        mine = sorted({k for k, _ in self.used}, key=lambda k: -cutters[k].diameter)
        least = min(cutters[k].diameter for k in mine)
        small = sorted((k for k, c in enumerate(cutters) if c.diameter < least), key=lambda k: -cutters[k].diameter)
        tables = self.tables.tolist()
        rest = [(k, a) for k in mine for a in tables if (k, a) not in self.used]
        return [list(self.used), rest, *([(k, a) for a in tables] for k in small)]

    def _widths(self, face: SurfaceGrid, some: Ints, pair: Pair) -> Floats:
        """Widest range [rad] of the pallet at each of the points; 0: none."""
        u, v = face.u[some[:, 0]], face.v[some[:, 1]]
        scene = self.scene.at_contacts(*face.surface.shape(u, v)[:3], face.number)
        got = valid_ranges(
            scene, self.catalogue.cutters[pair[0]], pair[1], self.motion.clearance, self.pallets, workers=self.workers
        )
        return np.array([float((r[:, 1] - r[:, 0]).max()) if len(r) else 0.0 for r in got.ranges])

    def passes(self, face: SurfaceGrid, region: Flags, pair: Pair) -> RestPasses:
        """Passes over a region along its longer side."""
        cutter, alpha = self.catalogue.cutters[pair[0]], pair[1]
        tried = face.tried.setdefault(pair, np.zeros(region.shape, dtype=np.bool_))
        tried |= region
        return self.keep(self.passes_key(face, region, pair), lambda: self._passes(face, region, cutter, alpha))

    def _passes(self, face: SurfaceGrid, region: Flags, cutter: CatalogueCutter, alpha: float) -> RestPasses:
        i, j = np.nonzero(region)
        cell = [float(np.linalg.norm(np.diff(face.points, axis=k), axis=2).mean()) for k in (0, 1)]
        along = "u" if np.ptp(i) * cell[0] >= np.ptp(j) * cell[1] else "v"
        p_at, q_at, x, y, width = (face.u, face.v, i, j, cell[1]) if along == "u" else (face.v, face.u, j, i, cell[0])
        columns = np.unique(x)
        low, high = (np.array([f(y[x == k]) for k in columns]) for f in (np.min, np.max))
        P = (float(p_at[columns[0]]), float(p_at[columns[-1]]))
        half = 0.5 * float(p_at[1] - p_at[0])
        P = (max(P[0] - half, 0.0), min(P[1] + half, 1.0))
        middle = float(q_at[int(np.median(y))])
        ends = [face.surface.at(*((x, middle) if along == "u" else (middle, x)))[0] for x in P]
        count = max(3, math.ceil(float(np.linalg.norm(ends[1] - ends[0])) / _STATIONS) + 1)
        p = stretch_stations(face.surface, along, P, (middle, middle), count, self.overrun)
        lines = Lines(
            face.surface, along, p, self.scene, face.number, cutter, alpha, self.motion, self.pallets, self.workers
        )
        step = _STEP * corner_step(cutter.corner_radius, self.scallop)
        bottom, top = (
            _draw_smooth(np.interp(p, p_at[columns], q_at[edge]), sign) for edge, sign in ((low, -1.0), (high, 1.0))
        )
        number = max(1, math.ceil((int((high - low).max()) + 1) * width / step))
        tracks: list[ToolTrack] = []
        before = np.full(len(p), np.nan)
        for k in range(number):
            q = bottom + (top - bottom) * (k + 0.5) / number
            one = lines.line(q, before)
            before = one.pallet
            new, _ = lines.tracks(one, np.ones(len(p), dtype=np.bool_), k)
            tracks += new
        box = ((float(face.u[i.min()]), float(face.u[i.max()])), (float(face.v[j.min()]), float(face.v[j.max()])))
        return RestPasses(face.body, face.side, box, tuple(tracks))


def _draw_smooth(q: Floats, sign: float) -> Floats:
    """A border drawn smooth, nowhere inside the given one."""
    soft = scipy.ndimage.gaussian_filter1d(q, 1.0, mode="nearest")
    out: Floats = np.clip(np.maximum(soft, q) if sign > 0.0 else np.minimum(soft, q), 0.0, 1.0)
    return out
