"""The bodies of a simulation: stock in layers, finished part, fixtures."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
import shapely
import trimesh
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.geometry.mesh import read_mesh
from chipload.jobs.simulation.job import ProgramJob
from chipload.jobs.tables import stated
from chipload.machine.machine import Machine
from chipload.machine.table import MachineTable
from chipload.program.motions import lengths
from chipload.program.program import RAPID, Program
from chipload.report.bodies import MACHINE_TABLE
from chipload.simulation.surface import MOST_POINTS, fine
from chipload.stock.layers import LayeredStock

#: side of a tile of the stock in diameters of the largest cutter
TILE = 4.0
#: layers where no thickness is stated: thickest and thinnest in smallest diameters, and most of them
LEVEL, SLOPED, THINNEST, MOST = 0.05, 0.0125, 0.0005, 400
#: layers where no cutter comes are so many times as thick
COARSE = 4.0


def part_body(job: ProgramJob) -> trimesh.Trimesh | None:
    """Return the finished part."""
    table = job.table.part
    if table is None or "part" in job.meshes:
        return job.meshes.get("part")
    return read_mesh(job.path.parent / table.file, unit=table.units, chord_mm=table.chord_mm, key="part.file")


def machine_table_of(job: ProgramJob, machine: Machine) -> MachineTable | None:
    """Return the table of the machine from the job, else from the machine file; None if neither states it."""
    block = job.table.machine_table
    return machine.table if block is None else MachineTable(block.low_mm, block.high_mm, block.spacing_mm)


def fixture_points(job: ProgramJob, machine: Machine) -> dict[str, NDArray[np.float64]]:
    """Return points of the fixtures by name."""
    keys = [(table.spacing_mm, f"fixture.{k}") for k, table in enumerate(job.table.fixture)]
    if (block := machine_table_of(job, machine)) is not None:
        keys.append((block.spacing, "machine_table" if job.table.machine_table is not None else "machine.table"))
    meshes = fixture_meshes(job, machine).items()
    return {name: fine(mesh, spacing, key)[0] for (name, mesh), (spacing, key) in zip(meshes, keys, strict=True)}


def fixture_meshes(job: ProgramJob, machine: Machine) -> dict[str, trimesh.Trimesh]:
    """Return the meshes of the fixtures by name, followed by that of the machine table."""
    out = {}
    for k, table in enumerate(job.table.fixture):
        path, key = job.path.parent / table.file, f"fixture.{k}.file"
        mesh = job.meshes.get(f"fixture {k}")
        if mesh is None:
            mesh = read_mesh(path, unit=table.units, chord_mm=table.chord_mm, key=key)
        out[f"fixture {k}"] = mesh
    if (block := machine_table_of(job, machine)) is not None:
        out[MACHINE_TABLE] = trimesh.creation.box(bounds=[block.low, block.high])
    return out


def stock_box(stock: LayeredStock) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the low and high corner of the box of the stock, (3,) [mm] each."""
    low, high = (np.array([stock.xs[i], stock.ys[i], stock.bounds[i]], dtype=np.float64) for i in (0, -1))
    return low, high


def stock_points(stock: LayeredStock, pitch: float) -> NDArray[np.float64]:
    """Return the points [mm] of a grid that lie in the stock."""
    low, high = stock_box(stock)
    count = float(np.prod(np.ceil((high - low) / pitch)))
    if not count <= MOST_POINTS:
        raise InputError(
            f"operation.0.stock_points_mm = {pitch:g}: {count:.4g} points: must be at most {MOST_POINTS}: state a "
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


def stock_body(job: ProgramJob, program: Program) -> LayeredStock:
    """Return the stock of the job in layers.

    Layers have the stated thickness where cutters move and are several times as thick elsewhere. They end at the
    heights at which an upright cutter cuts level.
    """
    table, folder = stated(job.table.stock, "stock"), job.path.parent
    mesh = job.meshes.get("stock")
    if mesh is None and table.file is not None and table.file.lower().endswith(".npz"):
        return LayeredStock.load(folder / table.file)
    # a tapered cutter is wider above its tip
    tile = TILE * max(c.diameter + 2.0 * c.flute_length * math.tan(c.taper) for c in job.cutters.values())
    if mesh is None and table.file is None:
        low, high = stated(table.low_mm, "stock.low_mm"), stated(table.high_mm, "stock.high_mm")
        layer = table.layer_mm or layer_thickness(program, job.cutters, high[2])
        stock = LayeredStock.block(low, high, COARSE * layer, tile)
    else:
        if mesh is None:
            mesh = read_mesh(folder / str(table.file), unit=table.units, chord_mm=table.chord_mm)
        layer = table.layer_mm or layer_thickness(program, job.cutters, float(mesh.bounds[1, 2]))
        stock = LayeredStock.of_mesh(mesh, COARSE * layer, tile)
    top = float(stock.bounds[-1])
    stock.refine(min(_lowest(program, job.cutters), top), top, layer)
    stock.refine_at(_levels(program, job.cutters, layer))
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
        straight = all(c.corner_radius == c.taper == c.bottom == 0.0 and not c.barrel_radius for c in cutters.values())
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
    flat = np.isin(program.tool, [n for n, c in cutters.items() if c.bottom == 0.0 and c.apt[2] > 0.0])
    kept = np.unique(p[level & upright & flat, 2].round(9))
    pointed = level & upright & ~flat
    heights, at = np.unique(p[pointed, 2].round(9), return_inverse=True)
    distance = np.bincount(at.ravel(), lengths(program)[pointed], minlength=len(heights))
    for z in heights[np.argsort(-distance, kind="stable")].tolist():
        if np.abs(kept - z).min(initial=math.inf) >= apart:
            kept = np.append(kept, z)
    return np.sort(kept)
