"""Run a Program through a layered workpiece: what every step removes, and what that costs.

Notation: a step as in :mod:`chipload.simulation.steps`; t in 0..1 within it. Its chip is, layer by layer, what the
cutter covers during the step and what is still there; its volume the sum of area times thickness. Where the stock's
edges are made simpler, by half the tolerance, what that takes or gives counts with the step. Forces are those at
the middle of the step (t = 1/2), on the cutter, in the work frame, over one revolution of the spindle.

What is known at each layer is the section at half its height: see :mod:`chipload.stock.layers` for the error in volume
and :mod:`chipload.engagement.immersion.immersion` for the one in force.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon, box

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import Slices, slices
from chipload.cutting.band import deviations, mean_basis
from chipload.cutting.material import Material
from chipload.engagement.bites import with_runout
from chipload.engagement.chips.move import Move
from chipload.engagement.immersion.immersion import Section
from chipload.errors import Finding, InputError
from chipload.program.program import Program
from chipload.progress import Progress, silent
from chipload.simulation.loads import LOADS, Cuts, StepBite, bite_of_step, bites_of_steps, joined, loads_of_steps
from chipload.simulation.steps import BLOCK, ROWS, Steps, steps_in_blocks
from chipload.simulation.swept import TOGETHER, Interpolation, swept_ahead
from chipload.stock.layers import LayeredStock
from chipload.stock.tiles import polygons
from chipload.units import mm_min_from_mm_s

Floats = NDArray[np.float64]
Columns = Mapping[str, NDArray[Any]]

#: more columns of steps that cut
Watch = Callable[[Cuts], Mapping[str, Floats]]

#: a piece of a chip narrower than so many tolerances is a film left by chords, no piece
FILM = 4.0


@dataclass(frozen=True)
class Resolution:
    """How fine the simulation looks.

    Parameters
    ----------
    step_mm : longest step of the tip [mm]
    tolerance : how far chords leave the edges of chips [mm]
    corner_pieces : slices of a corner radius
    flank_mm : length of a slice along the flank [mm]
    rotation : between two rotations at which the force is looked at [rad]
    """

    step_mm: float
    tolerance: float
    corner_pieces: int
    flank_mm: float
    rotation: float = math.radians(1.0)


@dataclass(frozen=True, eq=False)
class Piece:
    """The chip of one step on one layer: the one with most pieces, of those the one whose pieces are most alike.

    Parameters
    ----------
    step : its number
    move, cutter : of the step
    height : of the layer's section [mm]
    before : (multi)polygon, the section before the step, around the cutter
    chips : the pieces
    """

    step: int
    move: Move
    cutter: Cutter
    height: float
    before: Any
    chips: tuple[Polygon, ...]


@dataclass(frozen=True, eq=False)
class Removal:
    """What a program removed.

    Parameters
    ----------
    columns : (n,) each, a row a step, see :func:`remove`
    volume_before, volume_after : of the stock [mm^3]
    mean_band : (4,) standard deviation of the mean force x, y, z [N] and torque [N m] over the time in cut, from that
        of the coefficients; None: the material does not say how sure they are
    piece : the chip with most pieces that are most alike; None where nothing was cut
    findings : rapids that cut
    labels : of the program, `label` of the columns counts in them
    cuts : what the teeth cut, one a cutter that cut; empty unless it was asked for
    """

    columns: Columns
    volume_before: float
    volume_after: float
    mean_band: tuple[float, ...] | None
    piece: Piece | None
    findings: tuple[Finding, ...]
    labels: tuple[str, ...]
    cuts: tuple[Cuts, ...] = ()


@dataclass(frozen=True, eq=False)
class Setting:
    """What a run keeps to, step after step: see :func:`remove`; ``profiles`` are slices of the cutters."""

    cutters: Mapping[int, Cutter]
    profiles: Mapping[int, Slices]
    material: Material
    resolution: Resolution
    interpolation: Interpolation
    watch: Watch | None
    workers: int


@dataclass(frozen=True, eq=False)
class Sums:
    """What is known after some steps and goes on in the next.

    Parameters
    ----------
    before : volume of the stock before the first step [mm^3]
    steps : how many they are
    s_mm, t_s, cut_s : their length [mm], their time and the time in cut [s]
    basis : (4, 6) integral over the time in cut of what the coefficients are multiplied with
    rapids : lines with rapids that cut
    piece : as in :class:`Removal`
    """

    before: float
    steps: int = 0
    s_mm: float = 0.0
    t_s: float = 0.0
    cut_s: float = 0.0
    basis: Floats = field(default_factory=lambda: np.zeros((4, 6)))
    rapids: tuple[int, ...] = ()
    piece: Piece | None = None


def remove(
    program: Program,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    material: Material,
    resolution: Resolution,
    *,
    interpolation: Interpolation = "slerp",
    keep: bool = False,
    watch: Watch | None = None,
    workers: int = 2,
    progress: Progress = silent,
) -> Removal:
    """Take what the program cuts from ``stock``, which changes, and say what it costs.

    All columns are kept in memory; :func:`chipload.simulation.pieces.remove_in_pieces` keeps them in files and goes on
    where it was stopped.

    Parameters
    ----------
    program : in the work frame of the stock
    cutters : by tool number
    interpolation : of the axis within a step: along a great circle (slerp) or normalised straight line (lerp)
    keep : keep what the teeth cut in every step, for :mod:`chipload.simulation.deflection`; some kB a step
    watch : called with what one cutter cut in some hundred steps; gives more columns, a value for each of them; they
        are 0 in steps that do not cut
    workers : threads that find areas ahead of the removal; the result does not depend on it

    Returns
    -------
    Removal
        With the columns ``line``, ``tool``, ``label``, ``rapid``, ``s_mm``, ``t_s``, ``seconds``, ``x_mm``,
    ``y_mm``, ``z_mm``, ``axis_x..z``, ``feed_mm_min``, ``chip_volume_mm3``, ``chip_pieces`` (most on one layer),
    ``chip_layers`` (layers that lost something; where all of it is films, narrower than a few tolerances, there are no
    pieces and no loads), ``chip_max_mm`` (thickest),
    ``force_{x,y,z}_{mean,max,min}_n`` over the revolution, ``force_n`` (greatest size), ``torque_mean_nm``,
    ``torque_nm`` (greatest), ``power_w`` (mean),
    ``force_normal_n`` (greatest force that presses on the surface that the step leaves, along its normal; 0 where it
    leaves two that face each other, as in a slot)

    Raises
    ------
    InputError
        A tool has no cutter, an axis lies or looks down at the stock, a cut is made with the spindle at rest.

    Notes
    -----
    O(n l m): n steps, l layers under the cutter, m edges of the stock around it; m does not grow with n.
    """
    count = counted(program, cutters, resolution)
    setting = setting_of(cutters, material, resolution, interpolation, watch, workers)
    sums, kept, columns = Sums(stock.volume()), dict[int, list[Cuts]](), list[Columns]()
    for steps in steps_in_blocks(program, resolution.step_mm, resolution.tolerance, size=BLOCK):
        progress(sums.steps / count, "removing")
        sums, some, cuts = remove_block(steps, stock, sums, setting)
        columns.append(some)
        for bite in cuts if keep else ():
            kept.setdefault(bite.tool, []).append(bite)
    progress(1.0, "removed")
    cut = tuple(joined(kept[number]) for number in sorted(kept))
    return removal_of(program, stock, material, sums, stacked(columns), cut)


def setting_of(
    cutters: Mapping[int, Cutter],
    material: Material,
    resolution: Resolution,
    interpolation: Interpolation,
    watch: Watch | None,
    workers: int,
) -> Setting:
    """What a run keeps to."""
    pieces, flank = resolution.corner_pieces, resolution.flank_mm
    profiles = {n: slices(c, corner_pieces=pieces, flank_mm=flank) for n, c in cutters.items()}
    return Setting(cutters, profiles, material, resolution, interpolation, watch, workers)


def counted(program: Program, cutters: Mapping[int, Cutter], resolution: Resolution) -> int:
    """The number of steps of a program of which every tool has a cutter.

    Raises
    ------
    InputError
        One has none, or there is no step.
    """
    count = 0
    for steps in steps_in_blocks(program, resolution.step_mm, resolution.tolerance, size=ROWS):
        count += len(steps)
        for number in np.unique(steps.tool).tolist():
            if number not in cutters:
                line = int(steps.line[np.flatnonzero(steps.tool == number)[0]])
                known = ", ".join(str(n) for n in sorted(cutters))
                raise InputError(f"line {line}: tool {number}: no [[cutter]] has this number: state one beside {known}")
    if count == 0:
        raise InputError("program: no motion: nothing to simulate")
    return count


def remove_block(
    steps: Steps, stock: LayeredStock, sums: Sums, setting: Setting
) -> tuple[Sums, dict[str, NDArray[Any]], list[Cuts]]:
    """Take what some steps cut from the stock: the sums after them, their columns, what the teeth cut in them."""
    removed, bites, piece = _removed(steps, stock, sums, setting)
    loads, basis, cut = np.zeros((len(steps), len(LOADS))), sums.basis, list[Cuts]()
    watched: dict[str, Floats] = {}
    for number in sorted({int(steps.tool[c.step]) for c in bites}):
        own = [c for c in bites if steps.tool[c.step] == number]
        at, cutter, material = [c.step for c in own], setting.cutters[number], setting.material
        plain = bites_of_steps(own, setting.profiles[number])
        bitten = with_runout(plain, cutter)
        loads[at] = loads_of_steps(bitten, own, cutter, material, setting.resolution.rotation, steps.spindle[at])
        way = np.hstack([steps.p0[at], steps.p1[at], steps.a0[at], steps.a1[at]])
        cut.append(Cuts(number, cutter, sums.steps + np.array(at), way, bitten, plain, steps.spindle[at]))
        if setting.watch is not None:
            for name, values in setting.watch(cut[-1]).items():
                watched.setdefault(name, np.zeros(len(steps)))[at] = values
        if _sure(material):
            each = mean_basis(bitten, cutter, material, bitten.frame)
            basis = basis + np.tensordot(steps.seconds[at], each, 1)
    columns = {**_columns(steps, removed, loads, sums), **watched}
    cuts = (removed[:, 0] > 0.0) & ~steps.rapid
    lines = steps.line[steps.rapid & (removed[:, 1] > 0.0)].tolist()
    after = Sums(
        sums.before,
        sums.steps + len(steps),
        float(columns["s_mm"][-1]),
        float(columns["t_s"][-1]),
        sums.cut_s + float(steps.seconds[cuts].sum()),
        basis,
        tuple(dict.fromkeys((*sums.rapids, *lines))),
        piece,
    )
    return after, columns, cut


def removal_of(
    program: Program,
    stock: LayeredStock,
    material: Material,
    sums: Sums,
    columns: Columns,
    cuts: tuple[Cuts, ...] = (),
) -> Removal:
    """What was removed when all steps are done."""
    band = None
    if _sure(material):
        sd = deviations(sums.basis / sums.cut_s, material) if sums.cut_s > 0.0 else np.zeros(4)
        band = (*sd[:3].tolist(), float(sd[3]) / 1000.0)
    # rapids that cut more than films
    found = tuple(Finding("rapid-cuts", line, "a rapid goes through material") for line in sums.rapids)
    return Removal(columns, sums.before, stock.volume(), band, sums.piece, found, program.labels, cuts)


def stacked(blocks: Sequence[Columns]) -> dict[str, NDArray[Any]]:
    """Columns of blocks one below the other; a column that a block lacks is 0 there."""
    count = [len(b["line"]) for b in blocks]
    return {
        name: np.concatenate([b[name] if name in b else np.zeros(n) for b, n in zip(blocks, count, strict=True)])
        for name in dict.fromkeys(name for b in blocks for name in b)
    }


def _removed(
    steps: Steps, stock: LayeredStock, sums: Sums, setting: Setting
) -> tuple[Floats, list[StepBite], Piece | None]:
    """(n, 3) volume, pieces and layers of each chip; what the teeth cut; the chip of most pieces so far."""
    thickness, tolerance, best = stock.thickness, setting.resolution.tolerance, sums.piece
    rank = _rank(best.chips) if best is not None else (0, 0.0)
    removed = np.zeros((len(steps), 3))
    cutting: list[tuple[int, Move, Section]] = []
    waiting: list[Future[list[StepBite]]] = []

    def bites(those: list[tuple[int, Move, Section]]) -> list[StepBite]:
        tools = [int(steps.tool[k]) for k, _, _ in those]
        return [
            bite_of_step(steps, k, move, setting.cutters[n], setting.profiles[n], there)
            for n, (k, move, there) in zip(tools, those, strict=True)
        ]

    ahead = swept_ahead(steps, stock, setting.cutters, setting.interpolation, tolerance, setting.workers)
    with ThreadPoolExecutor(1) as beside:
        for k, swept in ahead:
            met, low, high = swept.met, swept.low[:2], swept.high[:2]
            # a face that looks down is held against the layer below
            layers = range(max(swept.layers.start - 1, 0), swept.layers.stop)
            there = Section(*stock.edges(layers, low, high))
            tidied = stock.tidied
            taken = stock.remove_many([i for i, _ in met], [shape for _, shape in met], 0.5 * tolerance)
            removed[k, 0] = tidied - stock.tidied
            for i, pieces, area, whole in _chips(met, taken, tolerance):
                removed[k] += (area * thickness[i], 0.0, 1.0)
                removed[k, 1] = max(removed[k, 1], len(whole))
                if whole and rank < (len(whole), 1.0 / len(whole)) and _rank(whole) > rank:
                    rank = _rank(whole)
                    near = polygons(stock.section(i).union(MultiPolygon(pieces)).intersection(box(*low, *high)))
                    cutter, z = setting.cutters[int(steps.tool[k])], float(stock.heights[i])
                    best = Piece(sums.steps + k, swept.move, cutter, z, MultiPolygon(near), tuple(whole))
            # what is thinner than the tolerance can tell is no cut
            if removed[k, 1] > 0.0 and not steps.rapid[k]:
                cutting.append((k, swept.move, there))
            if len(cutting) == TOGETHER:
                waiting.append(beside.submit(bites, cutting))
                cutting = []
        waiting.append(beside.submit(bites, cutting))
        return removed, [bite for several in waiting for bite in several.result()], best


def _sure(material: Material) -> bool:
    """Whether the material says how sure its coefficients are."""
    return material.spread is not None or material.covariance is not None


def _rank(whole: Sequence[Polygon]) -> tuple[int, float]:
    """By how many pieces a chip stands out, and by how alike they are."""
    areas = [p.area for p in whole]
    return len(areas), min(areas) / sum(areas) if areas else 0.0


def _chips(
    met: list[tuple[int, Polygon | MultiPolygon]], taken: list[list[Polygon]], tolerance: float
) -> Iterator[tuple[int, list[Polygon], float, list[Polygon]]]:
    """Of each layer that lost something: its number, the pieces, their area, those that are more than films."""
    flat = [p for pieces in taken for p in pieces]
    area = shapely.area(flat)
    film = 2.0 * area <= FILM * tolerance * shapely.length(flat)
    at = 0
    for (i, _), pieces in zip(met, taken, strict=True):
        if pieces:
            a, b = at, at + len(pieces)
            whole = [p for p, thin in zip(pieces, film[a:b].tolist(), strict=True) if not thin]
            yield i, pieces, float(area[a:b].sum()), whole
            at = b


def _columns(steps: Steps, removed: Floats, loads: Floats, sums: Sums) -> dict[str, NDArray[Any]]:
    length = np.linalg.norm(steps.p1 - steps.p0, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        feed = np.where(steps.seconds > 0.0, mm_min_from_mm_s(1.0) * length / steps.seconds, 0.0)
    return {
        "line": steps.line,
        "tool": steps.tool,
        "label": steps.label,
        "rapid": steps.rapid,
        "s_mm": np.cumsum([sums.s_mm, *length])[1:],
        "t_s": np.cumsum([sums.t_s, *steps.seconds])[1:],
        "seconds": steps.seconds,
        **{f"{x}_mm": steps.p1[:, i] for i, x in enumerate("xyz")},
        **{f"axis_{x}": steps.a1[:, i] for i, x in enumerate("xyz")},
        "feed_mm_min": feed,
        "chip_volume_mm3": removed[:, 0],
        "chip_pieces": removed[:, 1].astype(np.int64),
        "chip_layers": removed[:, 2].astype(np.int64),
        **{name: loads[:, i] for i, name in enumerate(LOADS)},
    }
