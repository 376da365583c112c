"""The bodies of a simulation: initial stock and its layers, finished part, fixtures."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.geometry.mesh import read_mesh
from chipload.lazy import trimesh
from chipload.machine.machine import Machine
from chipload.machine.table import MachineTable
from chipload.number_text import number_text
from chipload.program.motions import lengths
from chipload.program.program import RAPID, Program
from chipload.ranges import number_field, require_ranges
from chipload.report.bodies import MACHINE_TABLE
from chipload.simulation.surface import MOST_POINTS, fine
from chipload.stock.layers import LayeredStock

#: side of a tile of the stock in diameters of the largest cutter
TILE = 4.0
#: layers where no thickness is stated: thickest and thinnest in smallest diameters, and most of them
LEVEL, SLOPED, THINNEST, MOST = 0.05, 0.0125, 0.0005, 400
#: points of a stock where no distance of them is stated: a pass over them costs a few percent of a step that leans
POINTS = 60_000
#: layers where no cutter comes are so many times as thick
COARSE = 4.0

Corner = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Stock:
    """The initial stock of a program: a block, a closed mesh, or what an earlier result left.

    Parameters
    ----------
    body : two corners of a block [mm], a mesh [mm], or layers, which do not change
    layer_mm : thickness of the layers of a block or a mesh; None: from depths of cut and cutters
    file : from which it was read
    refined_mm : thickness to which layers that were cut before are divided where cutters move; None: they stay

    Examples
    --------
    >>> Stock.block((0, 0, -12), (60, 40, 0)).body
    ((0.0, 0.0, -12.0), (60.0, 40.0, 0.0))
    """

    body: tuple[Corner, Corner] | trimesh.Trimesh | LayeredStock
    layer_mm: float | None = number_field(None, above=0.0)
    file: Path | None = None
    refined_mm: float | None = number_field(None, above=0.0)

    def __post_init__(self) -> None:
        """Refuse what is no body, a thickness out of range, and one for layers that there are."""
        known = isinstance(self.body, (tuple, LayeredStock))
        if not known and not isinstance(self.body, trimesh.Trimesh):
            raise InputError(f"stock: {type(self.body).__name__}: must be a Stock, a closed mesh or a layered stock")
        require_ranges(self, "stock.")
        if self.layer_mm is not None and isinstance(self.body, LayeredStock):
            raise InputError("stock.layer_mm: leave it out: the layers of an earlier result stay")

    @classmethod
    def block(cls, low_mm: Sequence[float], high_mm: Sequence[float], layer_mm: float | None = None) -> Stock:
        """Return a block between two corners (3,) [mm].

        Raises
        ------
        InputError
            A corner is not three finite numbers, or ``low_mm`` is not below ``high_mm``.
        """
        low, high = (tuple(float(x) for x in corner) for corner in (low_mm, high_mm))
        for key, corner in (("low_mm", low), ("high_mm", high)):
            if len(corner) != 3 or not np.isfinite(corner).all():
                raise InputError(f"stock.{key} = {corner}: must be three numbers, x, y and z in mm")
        return cls(((low[0], low[1], low[2]), (high[0], high[1], high[2])), layer_mm)

    @classmethod
    def read(
        cls, path: str | Path, *, units: str | None = None, chord_mm: float = 0.01, layer_mm: float | None = None
    ) -> Stock:
        """Read a mesh (STL), a model (STEP), or ``stock.npz`` of an earlier result.

        Parameters
        ----------
        units : unit of an STL file, which does not state its unit
        chord_mm : greatest deviation of facets from the faces of a model

        Raises
        ------
        InputError
            The file cannot be read.
        """
        path = Path(path)
        if path.suffix.lower() == ".npz":
            return cls(LayeredStock.load(path), layer_mm, path)
        return cls(read_mesh(path, unit=units, chord_mm=chord_mm), layer_mm, path)

    def layered(self, program: Program, cutters: Mapping[int, Cutter]) -> LayeredStock:
        """Return the stock in layers before a program, to be cut.

        Layers have the stated thickness where cutters move and are several times as thick elsewhere. They end at the
        heights at which an upright cutter cuts level.
        """
        if isinstance(self.body, LayeredStock):
            stock = self.body.copied()
            return stock if self.refined_mm is None else _refine_layers(stock, program, cutters, self.refined_mm)
        # a tapered cutter is wider above its tip
        tile = TILE * max(c.diameter + 2.0 * c.flute_length * math.tan(c.taper) for c in cutters.values())
        if isinstance(self.body, tuple):
            low, high = self.body
            layer = self.layer_mm or layer_thickness(program, cutters, high[2])
            stock = LayeredStock.block(low, high, COARSE * layer, tile)
        else:
            layer = self.layer_mm or layer_thickness(program, cutters, float(self.body.bounds[1, 2]))
            stock = LayeredStock.of_mesh(self.body, COARSE * layer, tile)
        return _refine_layers(stock, program, cutters, layer)


@dataclass(frozen=True, eq=False)
class FinishedPart:
    """The part that the program should produce. Material missing from it is a gouge, material left on it is excess.

    Parameters
    ----------
    mesh : closed body [mm]
    spacing_mm : longest side of the triangles whose corners are compared
    excess_range_mm : greatest excess that is measured
    file : from which it was read
    """

    mesh: trimesh.Trimesh
    spacing_mm: float = number_field(above=0.0)
    excess_range_mm: float = number_field(1.0, above=0.0)
    file: Path | None = None

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        require_ranges(self, "part.")

    @classmethod
    def read(
        cls,
        path: str | Path,
        spacing_mm: float,
        excess_range_mm: float = 1.0,
        *,
        units: str | None = None,
        chord_mm: float = 0.01,
    ) -> FinishedPart:
        """Read a closed body, STL or STEP; other parameters as of :meth:`Stock.read`.

        Raises
        ------
        InputError
            The file cannot be read.
        """
        mesh = read_mesh(path, unit=units, chord_mm=chord_mm, key="part.file")
        return cls(mesh, spacing_mm, excess_range_mm, Path(path))


@dataclass(frozen=True, eq=False)
class Fixture:
    """A fixture, which no part of a tool may touch.

    Parameters
    ----------
    mesh : closed body [mm]
    spacing_mm : longest side of the triangles whose corners are compared
    file : from which it was read
    name : in the report; empty: ``fixture`` and its number
    """

    mesh: trimesh.Trimesh
    spacing_mm: float = number_field(above=0.0)
    file: Path | None = None
    name: str = ""

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        require_ranges(self, "fixture.")

    @classmethod
    def read(
        cls,
        path: str | Path,
        spacing_mm: float,
        *,
        units: str | None = None,
        chord_mm: float = 0.1,
        key: str = "fixture.file",
    ) -> Fixture:
        """Read a closed body, STL or STEP; ``key`` names it in messages, other parameters as of :meth:`Stock.read`.

        Raises
        ------
        InputError
            The file cannot be read.
        """
        return cls(read_mesh(path, unit=units, chord_mm=chord_mm, key=key), spacing_mm, Path(path))


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What the tool is compared with besides the stock.

    Parameters
    ----------
    part : None: not stated
    fixtures : in their order
    machine_table : in place of that of the machine; None: that of the machine
    """

    part: FinishedPart | None = None
    fixtures: tuple[Fixture, ...] = ()
    machine_table: MachineTable | None = None

    def fixture_meshes(self, machine: Machine) -> dict[str, trimesh.Trimesh]:
        """Return the meshes of the fixtures by name, followed by that of the machine table."""
        out = {fixture.name or f"fixture {k}": fixture.mesh for k, fixture in enumerate(self.fixtures)}
        if (block := self.machine_table or machine.table) is not None:
            out[MACHINE_TABLE] = trimesh.creation.box(bounds=[block.low, block.high])
        return out

    def fixture_points(self, machine: Machine) -> dict[str, NDArray[np.float64]]:
        """Return points of the fixtures and of the machine table by name."""
        keys = [(fixture.spacing_mm, f"fixture.{k}") for k, fixture in enumerate(self.fixtures)]
        if (block := self.machine_table or machine.table) is not None:
            keys.append((block.spacing, "machine.table" if self.machine_table is None else "machine_table"))
        meshes = self.fixture_meshes(machine).items()
        return {name: fine(mesh, spacing, key)[0] for (name, mesh), (spacing, key) in zip(meshes, keys, strict=True)}


def stock_box(stock: LayeredStock) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the low and high corner of the box of the stock, (3,) [mm] each."""
    low, high = (np.array([stock.xs[i], stock.ys[i], stock.bounds[i]], dtype=np.float64) for i in (0, -1))
    return low, high


def default_spacing(stock: LayeredStock) -> float:
    """Return the distance of the points of a stock [mm] if none is stated: at most ``POINTS`` fill its box."""
    low, high = stock_box(stock)
    return float(np.cbrt(np.prod(high - low) / POINTS))


def stock_points(stock: LayeredStock, pitch: float) -> NDArray[np.float64]:
    """Return the points [mm] of a grid that lie in the stock."""
    low, high = stock_box(stock)
    count = float(np.prod(np.ceil((high - low) / pitch)))
    if not count <= MOST_POINTS:
        raise InputError(
            f"operation.0.stock_points_mm = {pitch:g}: {number_text(count)} points: must be at most "
            f"{MOST_POINTS}: state a "
            "larger one"
        )
    x, y, z = (np.arange(a + 0.5 * pitch, b, pitch) for a, b in zip(low, high, strict=True))
    grid = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    return grid[insides(stock)(grid)]


def insides(stock: LayeredStock) -> Callable[[NDArray[np.float64]], NDArray[np.bool_]]:
    """Return a function that returns which points [mm] lie in the present stock."""
    bounds, sections = np.asarray(stock.bounds), [stock.section(i) for i in range(stock.layers)]

    def contains(points: NDArray[np.float64]) -> NDArray[np.bool_]:
        layer = np.searchsorted(bounds, points[:, 2], side="right") - 1
        out = np.zeros(len(points), dtype=np.bool_)
        for i in np.unique(layer[(layer >= 0) & (layer < len(sections))]).tolist():
            own = layer == i
            out[own] = shapely.contains_xy(sections[i], points[own, 0], points[own, 1])
        return out

    return contains


def _refine_layers(stock: LayeredStock, program: Program, cutters: Mapping[int, Cutter], layer: float) -> LayeredStock:
    """Return the stock with layers of a thickness where cutters move, divided where they cut level; it changes."""
    top = float(stock.bounds[-1])
    stock.refine(min(_lowest(program, cutters), top), top, layer)
    stock.refine_at(_levels(program, cutters, layer))
    return stock


def layer_thickness(program: Program, cutters: Mapping[int, Cutter], top: float) -> float:
    """Return the thickness of layers [mm] if none is stated.

    Where at least half of the path at a feed below the top is level, with the axis upright, the layers end at its
    levels: a tenth (a fifth, where no cutter has a corner or a taper) of the least step down between those that
    have a twentieth of the way, at most :data:`LEVEL` of the smallest diameter. Else a sixteenth of the whole
    depth, at most :data:`SLOPED` of the smallest diameter. At least :data:`THINNEST` of the diameter, and so
    thick that there are at most :data:`MOST` layers from the lowest point of the program to the top: the cost of
    a step goes with the layers that the cutter meets.
    """
    smallest = min(c.resolved_diameter for c in cutters.values())
    deep = top - min(_lowest(program, cutters), top)
    p, distance = np.asarray(program.p_work), lengths(program)
    cuts = (program.motion != RAPID) & (p[:, 2] < top)
    level = cuts & (np.abs(np.diff(p[:, 2], prepend=p[:1, 2])) < 1e-9) & (np.asarray(program.axis)[:, 2] > 1.0 - 1e-12)
    whole = float(distance[cuts].sum())
    if whole > 0.0 and float(distance[level].sum()) >= 0.5 * whole:
        heights, at = np.unique(p[level, 2].round(9), return_inverse=True)
        long = np.bincount(at.ravel(), distance[level], minlength=len(heights)) >= 0.05 * whole
        down = np.diff(np.append(heights[long], top))
        straight = all(c.straight for c in cutters.values())
        share = 0.2 if straight else 0.1
        layer = min(LEVEL * smallest, share * float(down.min(initial=math.inf)))
    else:
        layer = min(SLOPED * smallest, 0.0625 * deep) if deep > 0.0 else SLOPED * smallest
    return max(layer, THINNEST * smallest, deep / MOST)


def _lowest(program: Program, cutters: Mapping[int, Cutter]) -> float:
    """Return a height [mm] below which no cutter moves at a feed."""
    feeds = np.flatnonzero(program.motion != RAPID)
    if len(feeds) == 0:
        return math.inf
    rows = np.unique(np.concatenate([feeds, np.maximum(feeds - 1, 0)]))
    widest = max(max(c.radius, float(c.radius_at([c.flute_length])[0])) for c in cutters.values())
    lean = np.sqrt(np.clip(1.0 - np.asarray(program.axis)[rows, 2] ** 2, 0.0, None))
    return float((np.asarray(program.p_work)[rows, 2] - widest * lean).min())


def _levels(program: Program, cutters: Mapping[int, Cutter], apart: float) -> NDArray[np.float64]:
    """Return the heights [mm] at which an upright cutter moves level at a feed.

    A cutter that ends in a point leaves a floor only where it goes to and fro for long: of its heights those on which
    its way is longest, none nearer to another than ``apart`` [mm].
    """
    p = np.asarray(program.p_work)
    level = (np.abs(np.diff(p[:, 2], prepend=p[:1, 2])) < 1e-9) & (program.motion != RAPID)
    upright = np.asarray(program.axis)[:, 2] > 1.0 - 1e-12
    flat = np.isin(program.tool, [n for n, c in cutters.items() if c.flat_radius > 0.0])
    kept = np.unique(p[level & upright & flat, 2].round(9))
    pointed = level & upright & ~flat
    heights, at = np.unique(p[pointed, 2].round(9), return_inverse=True)
    distance = np.bincount(at.ravel(), lengths(program)[pointed], minlength=len(heights))
    for z in heights[np.argsort(-distance, kind="stable")].tolist():
        if np.abs(kept - z).min(initial=math.inf) >= apart:
            kept = np.append(kept, z)
    return np.sort(kept)
