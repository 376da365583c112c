"""Checks against the stock as it is at each moment: shank and holder, rapids, loose stock, slender walls.

An upright axis is followed over columns of the stock (:mod:`chipload.simulation.heights.height_map`). Where the axis
leans, shank and holder are compared with points of the stock, and the stock that is left is checked for pieces and
slender walls (:mod:`chipload.checking.leaning_stock`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chipload.checking.clamped import placed_clamps
from chipload.checking.inputs import CheckInputs
from chipload.checking.outcome import StockCheck
from chipload.checking.part_place import find_misplaced_part
from chipload.checking.workpiece import default_spacing, stock_box
from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, Severity
from chipload.program.program import RAPID, Program
from chipload.progress import Progress
from chipload.simulation.heights.height_map import HeightMap, bands_of, follow_heights, pitch_of
from chipload.simulation.heights.loose_stock import find_loose_stock
from chipload.simulation.heights.slender_walls import distortion_not_checked, find_slender_walls, slender_wall_findings
from chipload.simulation.kept_pass import KeptPasses
from chipload.simulation.moves import FILM, leans
from chipload.simulation.steps import StepBlocks
from chipload.simulation.surface import Collision
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]

#: columns stand so many times as close where a shank or holder wider than its cutter goes below the top of the stock
CLOSER = 3.0
#: films that may be thicker [mm] are named where nothing else shows a rapid through material
FILM_MM = 0.02


def check_stock(
    inputs: CheckInputs, program: Program, stock: LayeredStock, steps: StepBlocks, kept: KeptPasses, progress: Progress
) -> StockCheck:
    """Return the findings on the stock along a program; ``stock`` is that before it."""
    checks, op, part = inputs.checks, inputs.settings, inputs.surroundings.part
    placed = () if part is None else find_misplaced_part(part.mesh.bounds, part.mesh.volume, *stock_box(stock))
    if leans(program).any():
        return replace(_check_leaning_axis(inputs, stock), findings=placed)
    pitch = pitch_at(inputs.cutters, program, stock, op.stock_points_mm)
    what = "shank and holder in the stock"
    progress(0.0, what)
    found = follow_heights(steps, inputs.cutters, stock, pitch, op.tolerance_mm, lambda done: progress(0.0, what), kept)
    # a feed with the spindle at rest is a finding of its own
    rapid = set(program.line[program.motion == RAPID].tolist())
    findings = [
        Finding("rapid-cuts", c.line, f"a rapid goes through material, {c.depth_mm:.3g} mm deep", Severity.EXCEEDS,
                None, c.step)
        for c in found.rapids
        if c.line in rapid
    ]  # fmt: skip
    hidden, unchecked, touched = found.hidden_mm, list[str](), tuple[Collision, ...]()
    if checks.shank_in_stock:
        touched = tuple(Collision(c.what, "stock", c.depth_mm, c.step, c.line, c.place) for c in found.contacts)
        unchecked.append(
            f"shank and holder in the stock: a contact less than {hidden:.2g} mm deep, or with what is thinner, may be "
            "missed between the columns of the stock that are compared"
        )
    if checks.loose_stock:
        findings += _loose(found, inputs, stock)
    if checks.slender_walls and inputs.elasticity.workpiece is None:
        walls = find_slender_walls(found, checks.wall_slenderness)
        findings += slender_wall_findings(walls, checks.wall_slenderness)
        thinnest = min((wall.thickness_mm for wall in walls), default=math.inf)
        unchecked += distortion_not_checked(thinnest, checks.stress_wall_mm)
    return StockCheck((*placed, *findings), touched, hidden, tuple(unchecked))


def contact_findings(
    program: Program, steps: StepBlocks, cutters: Mapping[int, Cutter], stock: LayeredStock, tolerance: float
) -> tuple[Finding, ...]:
    """Return the contacts of shank and holder of upright tools with a stock, for a program that a planner has written.

    Parameters
    ----------
    stock : before the program
    tolerance : of the path [mm]
    """
    if not any(_dips(cutters[n], n, program, stock_box(stock)[1]) for n in cutters):
        return ()
    found = follow_heights(steps, cutters, stock, pitch_at(cutters, program, stock), tolerance)
    return tuple(
        Finding("collision", c.line, f"{c.what} goes {c.depth_mm:.3g} mm into stock", Severity.EXCEEDS, c.place, c.step)
        for c in found.contacts
    )


def pitch_at(
    cutters: Mapping[int, Cutter], program: Program, stock: LayeredStock, stated: float | None = None
) -> float:
    """Return the distance of the columns [mm]: closer where a wide shank or holder goes below the top of the stock."""
    low, high = stock_box(stock)
    pitch = pitch_of(low, high, cutters)
    if any(_dips(cutters[n], n, program, high) for n in cutters):
        pitch = max(pitch / CLOSER, math.sqrt(float(np.prod(high[:2] - low[:2]))) / 1000.0)
    return pitch if stated is None else min(pitch, stated)


def _dips(cutter: Cutter, number: int, program: Program, high: Floats) -> bool:
    """Return whether a part above the flutes that is wider than the cutter goes below the top of the stock."""
    tip = np.asarray(program.p_work)[program.tool == number]
    return any(2.0 * radius > cutter.diameter and (tip[:, 2] + z < high[2]).any() for _, radius, z in bands_of(cutter))


def _check_leaning_axis(inputs: CheckInputs, stock: LayeredStock) -> StockCheck:
    """What the check of a program whose axis leans cannot show."""
    checks, unchecked, hidden = inputs.checks, list[str](), 0.0
    film = FILM * inputs.settings.tolerance_mm
    if film > FILM_MM:
        unchecked.append(f"rapids that take less than {film:.2g} mm of material: taken as films, by tolerance_mm")
    if checks.shank_in_stock:
        hidden = math.sqrt(3.0) * (inputs.settings.stock_points_mm or default_spacing(stock))
        unchecked.append(
            f"shank and holder in the stock: a contact less than {hidden:.2g} mm deep, or with what is thinner, may be "
            "missed between the points of the stock that are compared"
        )
    return StockCheck((), (), hidden, tuple(unchecked))


def _loose(found: HeightMap, inputs: CheckInputs, stock: LayeredStock) -> list[Finding]:
    """Return a finding for each piece that is cut on after it was cut free, and that nothing stated holds."""
    out = []
    workpiece, fixtures = inputs.elasticity.workpiece, [f.mesh for f in inputs.surroundings.fixtures]
    clamps = () if workpiece is None else placed_clamps(workpiece, stock)
    diameter = max(c.resolved_diameter for c in inputs.cutters.values())
    for piece in find_loose_stock(found, diameter, clamps, fixtures):
        x, y = piece.size_mm
        text = (
            f"cuts a piece of {x:.3g} x {y:.3g} mm that line {piece.freed_line} has cut free of the stock, and no "
            "stated clamp or fixture holds it: leave tabs or a floor, cut it free last, or state what holds it as a "
            "[[fixture]] or a [[workpiece.clamp]]"
        )
        out.append(Finding("loose-stock", piece.line, text, Severity.UNPROVEN, piece.place, piece.step))
    return out
