"""The contact lines of the steps of a program, and the stock before some of them.

Additional runs of the program, before the simulation, find them: contact and remaining stock of a step do not depend on
the feed. The stock is that of layers, the lines are those of the engine of the simulation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.program.program import Program
from chipload.progress import Progress, silent
from chipload.simulation.chips import block_of, count_steps, remove_block, setting_of, with_engine
from chipload.simulation.loads import GRAZES, Cuts
from chipload.simulation.moves import Engine, HandOver
from chipload.simulation.removal import Resolution, RunningSums, RunSettings
from chipload.simulation.steps import steps_in_blocks
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.states import StepLines

Floats = NDArray[np.float64]
#: steps (c,), their contact lines (c, 2, 3) [mm], greatest force (c,) [N] and mean force (c, 3) [N]
_Lines = tuple[NDArray[np.int64], Floats, Floats, Floats]

#: steps between two stocks that are kept
TOGETHER = 24


@dataclass(frozen=True, eq=False)
class CutAhead:
    """Result of the additional run of a program before its simulation.

    Attributes
    ----------
    lines : where the steps that cut touch the workpiece
    stocks : (step, removed volume [mm^3], stock before that step), rising; the last is what is left
    mean : (c, 3) float [N], mean force on the cutter of the steps that cut
    """

    lines: StepLines
    stocks: tuple[tuple[int, float, LayeredStock], ...]
    mean: Floats


def cut_ahead(
    program: Program,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    material: Material,
    resolution: Resolution,
    engine: Engine,
    progress: Progress = silent,
) -> CutAhead:
    """Run a program through a stock, which changes; store its contact lines, and the stock every few steps.

    Parameters
    ----------
    engine : of the simulation that will use the lines: it must find its contacts where these are. A step that meets a
        wall at its end cuts by moves, and does not by layers, which look at its middle
    """
    count = count_steps(program, cutters, resolution)
    setting = setting_of(cutters, material, resolution, None, 2)
    found = _lines_by_moves(program, stock, with_engine(engine, setting, program, stock)[0])
    sums, own = RunningSums(stock.volume()), list[_Lines]()
    stocks, before = [(0, 0.0, stock.copied())], [np.zeros(1)]
    for steps in steps_in_blocks(program, resolution.step_mm, resolution.tolerance, size=TOGETHER):
        progress(sums.steps / count, "where it cuts")
        volume, first = float(before[-1][-1]), sums.steps
        sums, columns, cuts = remove_block(steps, stock, sums, setting)
        before.append(volume + np.cumsum(columns["chip_volume_mm3"]))
        own += _lines_of(cuts, columns, first)
        if before[-1][-1] > volume:
            stocks.append((sums.steps, float(before[-1][-1]), stock.copied()))
    removed = np.concatenate(before)
    stocks.append((count, float(removed[-1]), stocks[-1][2]))
    known = own if found is None else found
    if not known:
        none = np.zeros(0)
        return CutAhead(
            StepLines(np.zeros(0, np.int64), np.zeros((0, 2, 3)), none, none), tuple(stocks), np.zeros((0, 3))
        )
    step, lines, force, means = (np.concatenate([some[k] for some in known]) for k in range(4))
    order = np.argsort(step, kind="stable")
    step = step[order]
    return CutAhead(StepLines(step, lines[order], force[order], removed[step]), tuple(stocks), means[order])


def _lines_by_moves(program: Program, stock: LayeredStock, setting: RunSettings) -> list[_Lines] | None:
    """Return the contact lines of a program by moves; None where it is simulated by layers. The stock stays."""
    if setting.moves is None:
        return None
    fine, sums, out = setting.resolution, RunningSums(stock.volume()), list[_Lines]()
    try:
        for steps in steps_in_blocks(program, fine.step_mm, fine.tolerance, size=block_of(setting)):
            first = sums.steps
            sums, columns, cuts = remove_block(steps, stock, sums, setting)
            out += _lines_of(cuts, columns, first)
    except HandOver:
        return None
    return out


def _lines_of(cuts: Sequence[Cuts], columns: Mapping[str, NDArray[Any]], first: int) -> list[_Lines]:
    """Return steps, contact lines, greatest force and mean force of some steps that have a force."""
    out = []
    for c in cuts:
        row = c.step - first
        some = columns["force_n"][row] > 0.0
        mean = np.column_stack([columns[f"force_{x}_mean_n"][row] for x in "xyz"])
        out.append((c.step[some], contact_lines(c)[some], columns["force_n"][row][some], mean[some]))
    return out


def contact_lines(cuts: Cuts) -> Floats:
    """Return the ends (c, 2, 3) [mm] of the contact line of each step on the surface that it leaves.

    It runs along the axis through the mean of the ends of the engagement at which the chip has no thickness, from the
    lowest to the highest of them; where a step leaves no surface, through the middle of its engagement.
    """
    engagement = cuts.plain
    owner = np.repeat(np.arange(len(engagement)), np.diff(engagement.start))
    p, q, a, b, along, offset, across = engagement.rows.T
    s0, rho, z0, sk = engagement.slices[engagement.slice, :4].T
    n = len(engagement)
    total, weight = np.zeros((n, 3)), np.zeros(n)
    low, high = np.full(n, np.inf), np.full(n, -np.inf)
    size = GRAZES * (np.hypot(along, across) + np.abs(offset))
    for leaves in (True, False):
        lacking = weight[owner] == 0.0
        for phi in (p, q) if leaves else (0.5 * (p + q),):
            h = along * np.sin(phi) + across * np.cos(phi) + offset
            counts = (np.abs(h) <= size) | (not leaves)
            counts &= (b > a) & lacking
            k, some = owner[counts], (b - a)[counts]
            middle = 0.5 * (a + b)[counts] - s0[counts]
            at = np.column_stack([
                rho[counts] * np.sin(phi[counts]), rho[counts] * np.cos(phi[counts]), z0[counts] + sk[counts] * middle
            ])  # fmt: skip
            np.add.at(total, k, some[:, None] * at)
            np.add.at(weight, k, some)
            for s in (a, b):
                z = z0[counts] + sk[counts] * (s[counts] - s0[counts])
                np.minimum.at(low, k, z)
                np.maximum.at(high, k, z)
    known = weight > 0.0
    mean = total / np.where(known, weight, 1.0)[:, None]
    ends = np.repeat(mean[:, None], 2, axis=1)
    ends[known, 0, 2], ends[known, 1, 2] = low[known], high[known]
    tip = 0.5 * (cuts.ends[:, :3] + cuts.ends[:, 3:6])
    return np.asarray(tip[:, None] + np.einsum("nei,nij->nej", ends, engagement.frames))
