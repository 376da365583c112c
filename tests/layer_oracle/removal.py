"""Removal of a program from the layers of a stock by GEOS, and its loads: the oracle of the moves.

Each step takes what it covers of each layer (:mod:`chipload.engagement.chips.covered`), and is engaged where its edge
is in the section of the layers before it (:mod:`layer_oracle.immersion`). Nothing is shared with the moves but the
steps, the cutter and the force model.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import slices
from chipload.cutting.band import mean_basis
from chipload.cutting.material import Material
from chipload.engagement.chips.covered import covered_areas
from chipload.engagement.chips.move import LEAST_AXIS_Z, Move
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.errors import InputError
from chipload.program.program import Program
from chipload.simulation.accuracy import energy_balance
from chipload.simulation.chips import add_steps, columns_of_steps, count_steps, removal_of, stack_blocks
from chipload.simulation.loads import LOADS, Cuts, bands_of_steps, join_cuts, over_turn
from chipload.simulation.removal import Removal, Resolution, RunningSums, Watch
from chipload.simulation.steps import Steps, step_boxes, steps_in_blocks
from chipload.stock.layers import LayeredStock
from layer_oracle.immersion import edges_under
from layer_oracle.loads import StepEngagement, engagement_of_step, engagement_of_steps, loads_of_steps

Floats = NDArray[np.float64]
#: a piece of a chip narrower than so many tolerances is a film left by chords, no piece
FILM = 4.0
#: instants of a turn at which the shank is compared with the stock
AROUND = 16
#: a step, a layer, the area that it covers and the pieces that it took
Took = Callable[[int, int, shapely.Geometry, list[shapely.Polygon]], None]


@dataclass(frozen=True, eq=False)
class _Run:
    """What holds for all steps of a run."""

    stock: LayeredStock
    cutters: Mapping[int, Cutter]
    material: Material
    fine: Resolution
    watch: Watch | None
    took: Took | None


def remove_by_layers(
    program: Program,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    material: Material,
    resolution: Resolution,
    *,
    keep: bool = False,
    watch: Watch | None = None,
    times: Floats | None = None,
    took: Took | None = None,
) -> Removal:
    """Remove a program from ``stock``, which changes: see :func:`chipload.simulation.chips.remove`; ``took`` is called
    with each area that a step covers and what it took of the layer.
    """
    count_steps(program, cutters, resolution)
    run = _Run(stock, cutters, material, resolution, watch, took)
    sums, columns, kept = RunningSums(stock.volume()), list[Mapping[str, NDArray[Any]]](), dict[int, list[Cuts]]()
    for steps in steps_in_blocks(program, resolution.step_mm, resolution.tolerance, times=times):
        sums, some, cuts = _remove_block(steps, run, sums)
        columns.append(some)
        for one in cuts if keep else ():
            kept.setdefault(one.tool, []).append(one)
    cut = tuple(join_cuts(kept[number]) for number in sorted(kept))
    removal = removal_of(program, stock, material, sums, stack_blocks(columns), cut)
    return replace(removal, energy_balance=energy_balance(removal.columns, material.Ktc))


def _remove_block(
    steps: Steps, run: _Run, sums: RunningSums
) -> tuple[RunningSums, dict[str, NDArray[Any]], list[Cuts]]:
    """Sums, columns and tooth engagement of some steps."""
    removed, engagement = _remove_steps(steps, run)
    material, loads, basis, cut = run.material, np.zeros((len(steps), len(LOADS))), sums.basis, list[Cuts]()
    watched: dict[str, Floats] = {}
    for number in sorted({int(steps.tool[c.step]) for c in engagement}):
        own = [c for c in engagement if steps.tool[c.step] == number]
        at, cutter = [c.step for c in own], run.cutters[number]
        plain = engagement_of_steps(own, _profile(cutter, run.fine))
        bitten = chips_of_teeth(plain, cutter)
        turn = over_turn(bitten, cutter, material, run.fine.rotation)
        loads[at] = loads_of_steps(plain, bitten, own, cutter, material, turn, steps.spindle[at], steps.seconds[at])
        ends = np.hstack([steps.p0[at], steps.p1[at], steps.a0[at], steps.a1[at]])
        cut.append(Cuts(number, cutter, sums.steps + np.array(at), ends, bitten, plain, steps.spindle[at]))
        each = run.watch(cut[-1]) if run.watch is not None else {}
        bands = bands_of_steps(bitten, cutter, material, turn, steps.spindle[at])
        for name, values in {**each, **bands}.items():
            watched.setdefault(name, np.zeros(len(steps)))[at] = values
        if material.has_band:
            mean = mean_basis(bitten, cutter, material, bitten.frame)
            basis = basis + np.tensordot(steps.seconds[at], mean, 1)
    columns = {**columns_of_steps(steps, removed, loads, sums), **watched}
    return add_steps(sums, steps, removed, columns, basis), columns, cut


def _profile(cutter: Cutter, fine: Resolution) -> Any:
    return slices(
        cutter, bottom_slices=fine.bottom_slices, corner_slices=fine.corner_slices, flank_mm=fine.flank_mm,
        grading=fine.grading,
    )  # fmt: skip


def _remove_steps(steps: Steps, run: _Run) -> tuple[Floats, list[StepEngagement]]:
    """(n, 4) volume [mm^3], pieces and layers of each chip, length of the shank in material [mm]; tooth engagement of
    the steps that cut.
    """
    stock, tolerance = run.stock, run.fine.tolerance
    removed, engaged = np.zeros((len(steps), 4)), list[StepEngagement]()
    profiles = {n: _profile(c, run.fine) for n, c in run.cutters.items()}
    for k, move, low, high, layers in _steps_near(steps, run):
        tool = int(steps.tool[k])
        cutter = run.cutters[tool]
        # a point below the lowest section of the box is held against the section below it
        around = range(max(layers.start - 1, 0), min(layers.stop + 1, stock.layers))
        there = edges_under(stock, around, low[:2], high[:2])
        met, areas = _areas_of_step(steps, k, cutter, move, layers, run)
        chips = stock.remove_many(met, areas)
        for i, area, pieces in zip(met, areas, chips, strict=True) if run.took is not None else ():
            run.took(k, i, area, pieces)
        lost = [math.fsum(p.area for p in pieces) for pieces in chips]
        parts = [sum(2.0 * p.area > FILM * tolerance * p.length for p in pieces) for pieces in chips]
        removed[k, 0] = math.fsum((np.array(lost) * stock.thickness[met]).tolist()) if met else 0.0
        removed[k, 1:3] = max(parts, default=0), np.count_nonzero(lost)
        if removed[k, 1]:
            removed[k, 3] = _axial_overrun(stock, cutter, steps.p1[k], steps.a1[k], FILM * tolerance)
            # what is thinner than the tolerance can tell is no cut
            if not steps.rapid[k]:
                engaged.append(engagement_of_step(steps, k, move, cutter, profiles[tool], there, tolerance))
    return removed, engaged


def _steps_near(steps: Steps, run: _Run) -> Iterator[tuple[int, Move, Floats, Floats, range]]:
    """Steps of cutters whose box reaches into the stock, with its corners and its layers."""
    stock, (low, high) = run.stock, step_boxes(steps, run.cutters)
    near = (high[:, 0] >= stock.xs[0]) & (low[:, 0] <= stock.xs[-1])
    near &= (high[:, 1] >= stock.ys[0]) & (low[:, 1] <= stock.ys[-1])
    near &= ~np.isin(steps.tool, [n for n, c in run.cutters.items() if c.body])
    for k in np.flatnonzero(near).tolist():
        layers = stock.layers_between(low[k, 2], high[k, 2])
        if layers:
            yield k, _move(steps, k), low[k], high[k], layers


def _areas_of_step(
    steps: Steps, k: int, cutter: Cutter, move: Move, layers: range, run: _Run
) -> tuple[list[int], list[shapely.Geometry]]:
    """Layers that a step covers something of, and the areas; layers that an upright flank crosses share one."""
    heights = run.stock.heights[layers.start : layers.stop]
    flank = _flank(steps, k, cutter, heights)
    # which are left does not choose the height of the one that stands for all
    own = [*np.flatnonzero(~flank).tolist(), *np.flatnonzero(flank)[:1].tolist()]
    found = covered_areas(move, cutter, heights[own].tolist(), run.fine.tolerance)
    shape = {i: None if area is None else shapely.buffer(area.polygon, 0.0) for i, area in zip(own, found, strict=True)}
    first = int(np.argmax(flank))
    of = [shape[first if flank[i] else i] for i in range(len(layers))]
    met = [i for i, area in enumerate(of) if area is not None and not area.is_empty]
    return [layers.start + i for i in met], [of[i] for i in met]


def _flank(steps: Steps, k: int, cutter: Cutter, heights: Floats) -> NDArray[np.bool_]:
    """Which layers only the flank of an upright cylinder crosses, in all of the step."""
    if cutter.shape or not (steps.a0[k, 2] == steps.a1[k, 2] == 1.0 and cutter.taper == 0.0):
        return np.zeros(len(heights), dtype=np.bool_)
    _, r, _, f, _, _, top = cutter.apt
    low, high = sorted((steps.p0[k, 2], steps.p1[k, 2]))
    foot = f if r > 0.0 else cutter.radius * math.tan(cutter.bottom)
    if cutter.flank_arc is not None:
        foot = cutter.flank_arc.z_to
    return np.asarray((heights > high + foot) & (heights < low + top))


def _move(steps: Steps, k: int) -> Move:
    if steps.a0[k, 2] == steps.a1[k, 2] == 1.0:
        return Move.upright(steps.p0[k], steps.p1[k])
    if min(steps.a0[k, 2], steps.a1[k, 2]) < LEAST_AXIS_Z:
        raise InputError(f"line {steps.line[k]}: the axis lies or looks down: the layers do not know what it cuts")
    return Move.slerp(steps.p0[k], steps.a0[k], steps.p1[k], steps.a1[k])


def _axial_overrun(stock: LayeredStock, cutter: Cutter, tip: Floats, axis: Floats, margin: float) -> float:
    """Length of the shank in material, from the end of the flutes upwards [mm]; 0 if none.

    Parameters
    ----------
    tip, axis : (3,) where the cutter is [mm], and its axis, unit
    margin : what the shank may touch [mm]
    """
    shank = cutter.diameter if cutter.shank_diameter is None else cutter.shank_diameter
    radius = 0.5 * shank - margin
    low = float(tip[2] + cutter.flute_length * axis[2])
    lean = radius * math.sqrt(max(1.0 - float(axis[2]) ** 2, 0.0))
    first = int(np.searchsorted(stock.heights, low - lean))
    if radius <= 0.0 or first >= stock.layers:
        return 0.0
    turn = np.arange(AROUND) * (math.tau / AROUND)
    across = np.cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.9 else (0.0, 1.0, 0.0))
    across /= np.linalg.norm(across)
    ring = radius * (np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(axis, across))
    ring = np.vstack([np.zeros(3), 0.5 * ring, ring])
    height, step = cutter.flute_length, float(stock.thickness[first])
    # the lowest section above the flutes decides where an upright cutter begins
    offset = float(stock.heights[first] - low) if lean < 1e-9 else 0.5 * step
    found = 0.0
    while height + offset < cutter.overhang and _holds(stock, tip + (height + offset) * axis + ring):
        height += step
        found = height - cutter.flute_length
    return found


def _holds(stock: LayeredStock, points: Iterable[Floats]) -> bool:
    """Whether one of some points [mm] lies in the stock."""
    for x, y, z in points:
        layer = int(np.searchsorted(stock.bounds, z, "right")) - 1
        if 0 <= layer < stock.layers and shapely.contains_xy(stock.section(layer, (x, y), (x + 1e-9, y + 1e-9)), x, y):
            return True
    return False
