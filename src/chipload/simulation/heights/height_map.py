"""The stock as a height map: what shanks and holders meet, what rapids remove, and when columns are cut through.

Notation: columns of material stand on a grid of the plan; each has a low and a top height [mm]. Steps of an
upright axis lower the tops, exactly over each column: the least height of the tool's surface over it during the step.
Hollows count as filled; what stands above the flutes of a cutter that passes under it stays.

Bound: between the columns nothing is examined. A contact or a cut whose area in the plan holds a disc of the diameter
sqrt(2) times the distance of the columns is found, so that what is less deep than that at a wall, or a rod that is
thinner, may be missed (:attr:`HeightMap.hidden_mm`). Heights have no such error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.lazy import LateModule, trimesh
from chipload.number_text import number_text
from chipload.simulation.clearance.body import above_cutting, cutting_part
from chipload.simulation.kept_pass import KeptPasses
from chipload.simulation.steps import Steps
from chipload.stock.dexel import TriDexel
from chipload.stock.layers import LayeredStock

_lower = LateModule("chipload.simulation.heights._lower")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: columns over the least radius of a cutter, and most columns
FINE, MOST = 20.0, 1_000_000
#: columns along the side of a tile, and entries of the table of a cutter's surface
TILE, TABLE = 8, 1025
#: a depth of less than so many tolerances of the path is a film left by chords
FILM = 4.0
#: a step after all others
NEVER = np.iinfo(np.int64).max


@dataclass(frozen=True)
class StockContact:
    """Contact of a shank, neck or holder with the stock: part of the tool, depth, step, line, place."""

    what: str
    depth_mm: float
    step: int
    line: int
    place: tuple[float, float, float]


@dataclass(frozen=True)
class RapidCut:
    """A rapid that removes material: greatest depth of its cut, step and line."""

    depth_mm: float
    step: int
    line: int


@dataclass(frozen=True, eq=False)
class HeightMap:
    """The stock after a program, and what was found on the way.

    Parameters
    ----------
    x, y : (nx,), (ny,) float [mm], places of the columns
    low, top : (nx, ny) float [mm]; top is -inf where no material is left, low inf where none ever was
    before : (nx, ny) float [mm], tops before the program
    gone, last : (nx, ny) int, step that cut a column through and step that cut it last; ``NEVER``, -1: none
    contacts : the deepest of each line and part of a tool
    rapids : the deepest of each line
    travel : (n + 1,) float [mm], length of the path before each step; line : (n,) int
    """

    x: Floats
    y: Floats
    low: Floats
    top: Floats
    before: Floats
    gone: Ints
    last: Ints
    contacts: tuple[StockContact, ...]
    rapids: tuple[RapidCut, ...]
    travel: Floats
    line: Ints

    @property
    def hidden_mm(self) -> float:
        """Depth of a contact or a cut that may lie between the columns [mm]."""
        return math.hypot(self.x[1] - self.x[0], self.y[1] - self.y[0])


def pitch_of(low: Floats, high: Floats, cutters: Mapping[int, Cutter]) -> float:
    """Return the default distance of columns [mm]: a share of the least radius, at most ``MOST`` columns."""
    least = 0.5 * min(c.resolved_diameter for c in cutters.values())
    area = float(np.prod(np.asarray(high[:2]) - low[:2]))
    return max(least / FINE, math.sqrt(area / MOST))


def follow_heights(
    steps: Steps | Iterable[Steps],
    cutters: Mapping[int, Cutter],
    stock: LayeredStock,
    pitch: float,
    tolerance: float,
    progress: Callable[[int], None] = lambda done: None,
    kept: KeptPasses | None = None,
) -> HeightMap:
    """Return the height map of a stock after the steps of upright tools; O(steps x columns under the tool).

    Parameters
    ----------
    steps : all, or block after block
    cutters : by tool number
    stock : before the program
    pitch : distance of the columns [mm]
    tolerance : of the path [mm]
    progress : is told how many steps are done
    kept : where the pass keeps what it has found, and goes on from

    Raises
    ------
    InputError
        There would be too many columns.
    """
    x, y, low, before = columns_of(stock, pitch)
    top, shape = before.copy(), before.shape
    tiles = tuple(-(-n // TILE) for n in shape)
    padded = np.full((tiles[0] * TILE, tiles[1] * TILE), -math.inf)
    padded[: shape[0], : shape[1]] = top
    ceiling = np.ascontiguousarray(padded.reshape(tiles[0], TILE, tiles[1], TILE).max(axis=(1, 3)))
    gone, last = np.full(shape, NEVER), np.full(shape, -1, dtype=np.int64)
    film = FILM * tolerance
    grid = np.array([x[0], y[0], x[1] - x[0], y[1] - y[0], float(top.max())])
    numbers = sorted(cutters)
    rows, tables, bands, names = _tables([cutters[n] for n in numbers])
    contacts, rapids = dict[tuple[int, str], StockContact](), dict[int, RapidCut]()
    length, lines = [np.zeros(1)], [np.zeros(0, dtype=np.int64)]
    done = 0

    def state() -> dict[str, NDArray[Any]]:
        kinds = {name: k for k, name in enumerate(PARTS)}
        touched = [(c.depth_mm, *c.place, c.step, c.line, kinds[c.what]) for c in contacts.values()]
        cut = [(c.depth_mm, c.step, c.line) for c in rapids.values()]
        return {
            "top": top, "ceiling": ceiling, "gone": gone, "last": last, "done": np.array([done]),
            "contacts": np.array(touched, dtype=np.float64).reshape(-1, 7),
            "rapids": np.array(cut, dtype=np.float64).reshape(-1, 3),
            "length": np.concatenate(length), "line": np.concatenate(lines),
        }  # fmt: skip

    def restore(found: Mapping[str, NDArray[Any]]) -> None:
        nonlocal done
        for own, name in ((top, "top"), (ceiling, "ceiling"), (gone, "gone"), (last, "last")):
            own[:] = found[name]
        done = int(found["done"][0])
        length[:], lines[:] = [found["length"]], [found["line"]]
        for depth, px, py, pz, step, line, kind in found["contacts"].tolist():
            what = PARTS[int(kind)]
            contacts[int(line), what] = StockContact(what, depth, int(step), int(line), (px, py, pz))
        for depth, step, line in found["rapids"].tolist():
            rapids[int(line)] = RapidCut(depth, int(step), int(line))

    passes = KeptPasses() if kept is None else kept
    for block in passes.blocks("heights", steps, (x, y, low, before, tolerance), state, restore):
        progress(done)
        out = np.zeros((len(block), 6))
        tool = np.searchsorted(numbers, block.tool)
        p0, p1 = np.ascontiguousarray(block.p0), np.ascontiguousarray(block.p1)
        _lower.lower(
            done, p0, p1, tool, block.rapid, rows, tables, bands, grid, top, low, ceiling, TILE, gone, last, film, out
        )
        for k in np.flatnonzero(out[:, _lower.CONTACT] > 0.0).tolist():
            what, line = names[tool[k]][int(out[k, _lower.BAND])], int(block.line[k])
            depth, place = float(out[k, _lower.CONTACT]), tuple(out[k, _lower.PLACE_X : _lower.PLACE_Z + 1].tolist())
            if (line, what) not in contacts or depth > contacts[line, what].depth_mm:
                contacts[line, what] = StockContact(what, depth, done + k, line, place)
        for k in np.flatnonzero(out[:, _lower.RAPID_DEPTH] > 0.0).tolist():
            line, depth = int(block.line[k]), float(out[k, _lower.RAPID_DEPTH])
            if line not in rapids or depth > rapids[line].depth_mm:
                rapids[line] = RapidCut(depth, done + k, line)
        length.append(np.linalg.norm(p1 - p0, axis=1))
        lines.append(block.line)
        done += len(block)
    ordered = sorted(contacts.values(), key=lambda c: (c.step, c.what))
    return HeightMap(
        x, y, low, top, before, gone, last, tuple(ordered), tuple(sorted(rapids.values(), key=lambda c: c.step)),
        np.cumsum(np.concatenate(length)), np.concatenate(lines),
    )  # fmt: skip


#: names of the parts of a tool above its flutes
PARTS = ("neck", "shank", "holder")


def _tables(cutters: list[Cutter]) -> tuple[Floats, Floats, Floats, list[list[str]]]:
    """Rows, surfaces and bands of cutters as the compiled loop takes them, and the name of each band."""
    each = [bands_of(c) for c in cutters]
    bands = np.zeros((len(cutters), max(map(len, each)), 2))
    rows, tables = np.zeros((len(cutters), 3)), np.zeros((len(cutters), 2, TABLE))
    for k, (cutter, own) in enumerate(zip(cutters, each, strict=True)):
        for b, (_, radius, z) in enumerate(own):
            bands[k, b] = radius, z
        radius, tables[k] = surface_of(cutter)
        rows[k] = radius, cutter.flute_length, float(not tables[k].any())
    return rows, tables, bands, [[name for name, _, _ in own] for own in each]


def bands_of(cutter: Cutter) -> list[tuple[str, float, float]]:
    """Return the cylinders of a tool above its flutes: name, radius and height above the tip where it begins [mm].

    >>> bands_of(Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, shank_diameter=8.0, holder=((15.0, 40.0), (30.0, 50.0))))
    [('neck', 4.0, 20.0), ('holder', 20.0, 30.0), ('holder', 25.0, 45.0)]
    """
    body = above_cutting(cutter)
    out, widest = list[tuple[str, float, float]](), 0.0
    for rho0, z0, rho1, _ in body.lines.tolist():
        radius = max(rho0, rho1)
        if radius <= widest:
            continue
        name = "neck" if 2.0 * radius < cutter.diameter else "shank"
        if cutter.holder and z0 >= cutter.overhang:
            name = "holder"
        out, widest = [b for b in out if b[2] < z0], radius
        out.append((name, radius, z0))
    return out


def surface_of(cutter: Cutter) -> tuple[float, Floats]:
    """Return the greatest radius [mm] of the cutting part, and the height of its surface above the tip (2, m) [mm].

    Rows: at even distances from the axis up to sqrt(1/2) of the radius, then at even squares of them.
    """
    body = cutting_part(cutter)
    points = [body.lines[:, :2], body.lines[:, 2:]]
    for e, f, r, a0, a1 in body.arcs.tolist():
        a = np.linspace(a0, a1, 4 * TABLE)
        points.append(np.column_stack([e + r * np.sin(a), f - r * np.cos(a)]))
    rho, z = np.concatenate(points).T
    radius = float(rho.max())
    order = np.lexsort((z, rho))
    rho, z = rho[order], np.minimum.accumulate(z[order][::-1])[::-1]
    first = np.append(True, np.diff(rho) > 1e-12)
    u = np.linspace(0.0, 1.0, TABLE)
    at = radius * np.stack([math.sqrt(0.5) * u, np.sqrt(0.5 * (1.0 + u))])
    return radius, np.interp(at, rho[first], z[first])


def require_columns(stock: LayeredStock, pitch: float) -> tuple[Floats, Floats]:
    """Return the low and high corner of a stock in the plan (2, 2) [mm], and the number of columns along x and y (2,).

    Raises
    ------
    InputError
        There would be more than a few ``MOST``.
    """
    box = np.array([[stock.xs[i], stock.ys[i]] for i in (0, -1)], dtype=np.float64)
    count = np.maximum(np.ceil((box[1] - box[0]) / pitch), 2.0)
    if not count.prod() <= 4 * MOST:
        raise InputError(
            f"operation.0.stock_points_mm = {pitch:g}: {number_text(count.prod())} columns of the stock: must "
            "be at most "
            f"{4 * MOST}: state a larger one"
        )
    return box, count


def columns_of(stock: LayeredStock, pitch: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Return places x, y and heights low, top (nx, ny) [mm] of the columns of a stock; inf, -inf where it has none."""
    box, count = require_columns(stock, pitch)
    if stock.part is not None and not stock.cut.any():
        return columns_of_mesh(stock.part, pitch)
    size = (box[1] - box[0]) / count
    x, y = (box[0][k] + size[k] * (np.arange(int(count[k])) + 0.5) for k in (0, 1))
    return x, y, *_by_sections(stock, x, y)


def _by_sections(stock: LayeredStock, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Low and top of columns by the sections of a layered stock: of the lowest and the highest layer that has them."""
    px, py = (a.ravel() for a in np.meshgrid(x, y, indexing="ij"))
    low, top = np.full(len(px), math.inf), np.full(len(px), -math.inf)
    for heights, order, edge in ((top, range(stock.layers - 1, -1, -1), 1), (low, range(stock.layers), 0)):
        left = np.arange(len(px))
        for layer in order:
            section = stock.section(layer)
            shapely.prepare(section)
            inside = shapely.intersects_xy(section, px[left], py[left])
            heights[left[inside]] = stock.bounds[layer + edge]
            left = left[~inside]
            if len(left) == 0:
                break
    return low.reshape(len(x), len(y)), top.reshape(len(x), len(y))


def columns_of_mesh(body: trimesh.Trimesh, pitch: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Return places and heights of the columns of a closed mesh as :func:`columns_of`, by rays through it."""
    rays = TriDexel.of_mesh(body, pitch, "z").rays[0]
    u0, v0, du, dv, nu, nv = rays.grid
    shape = (int(nu), int(nv))
    filled = rays.count > 0
    low = np.where(filled, rays.ends[:, 0, 0], math.inf)
    top = np.where(filled, rays.ends[np.arange(len(filled)), np.maximum(rays.count - 1, 0), 1], -math.inf)
    return u0 + du * np.arange(shape[0]), v0 + dv * np.arange(shape[1]), low.reshape(shape), top.reshape(shape)
