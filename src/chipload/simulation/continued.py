"""Removal of a program that begins as another one did: the steps that both have in common are taken from the other.

What a step engages depends on the moves before it and on the other steps of its block. A program therefore continues
after the last block that is the same in both, so that its columns have the same bytes as without the other program.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.program.motions import lengths
from chipload.program.program import Program
from chipload.progress import Progress, silent
from chipload.simulation.chips import (
    ROUNDING_MM3,
    block_of,
    count_steps,
    removal_of,
    remove,
    remove_block,
    runs_of_threads,
    stack_blocks,
    with_moves,
)
from chipload.simulation.loads import Cuts, join_cuts
from chipload.simulation.moves import MaterialAboveFlutes
from chipload.simulation.removal import Columns, Removal, Resolution, RunningSums, RunSettings, removal_between
from chipload.simulation.steps import steps_in_blocks
from chipload.simulation.strips import remove_in_strips
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]

#: threads
WORKERS = 2


@dataclass(frozen=True, eq=False)
class KnownRemoval:
    """The removal of a program, from which one that begins alike continues.

    Parameters
    ----------
    program, times, resolution : of the run, as of :func:`chipload.simulation.chips.remove`
    removal : with the tooth engagement of every step; its mean band is not calculated
    shank : the run asked for the shank in material: no other continues from it
    """

    program: Program
    times: Floats
    resolution: Resolution
    removal: Removal
    shank: bool = False

    def steps_alike(self, program: Program, times: Floats, resolution: Resolution) -> int:
        """Return how many steps of another program are those of this one: 0 where they do not begin alike."""
        shorter = min(resolution.step_mm, self.resolution.step_mm)
        if self.shank or replace(resolution, step_mm=shorter) != replace(self.resolution, step_mm=shorter):
            return 0
        n = min(len(program), len(self.program))
        alike = np.asarray(times)[:n] == np.asarray(self.times)[:n]
        for name in (f.name for f in fields(Program) if f.name != "labels"):
            own, other = (np.asarray(getattr(one, name))[:n] for one in (program, self.program))
            same = own == other
            alike &= same if same.ndim == 1 else same.reshape(n, -1).all(axis=1)
        if resolution.step_mm != self.resolution.step_mm:
            # undivided with both
            alike &= lengths(program)[:n] <= shorter
        rows = n if alike.all() else int(np.argmin(alike))
        lines = np.asarray(self.program.line)
        # a wait of the next row is part of the last step
        if rows < 2 or (np.diff(lines) < 0).any():
            return 0
        return int(np.searchsorted(self.removal.columns["line"], lines[rows - 2], side="right"))


def remove_from(
    before: KnownRemoval | None,
    program: Program,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    material: Material,
    resolution: Resolution,
    times: Floats,
    progress: Progress = silent,
) -> KnownRemoval:
    """Remove a program as :func:`chipload.simulation.chips.remove` does, and keep the tooth engagement.

    The moves are stored with ``stock``; its layers stay as they were where its body is known.

    Parameters
    ----------
    before : of another program in the same stock with the same cutters and material; None: there is none

    Raises
    ------
    InputError
        As :func:`chipload.simulation.chips.remove`.
    """
    count = count_steps(program, cutters, resolution)
    progress(0.0, "removing")
    setting = with_moves(RunSettings(cutters, material, resolution, None, WORKERS), program, stock)
    size = block_of(setting)
    first = 0 if before is None else before.steps_alike(program, times, resolution) // size * size
    done, cuts, sums = list[Columns](), dict[int, list[Cuts]](), RunningSums(stock.volume())
    if before is not None and first:
        known = removal_between(before.removal, 0, first)
        done, cuts, sums = [known.columns], {one.tool: [one] for one in known.cuts}, _sums_after(known, sums)
    runs = runs_of_threads(program, stock, setting, count)
    try:
        if first:
            for run in runs:
                run.skip(program, resolution.step_mm, first)
        blocks = steps_in_blocks(program, resolution.step_mm, resolution.tolerance, size=size, first=first, times=times)
        for steps, moved in remove_in_strips(blocks, setting, runs, first):
            sums, some, engaged = remove_block(steps, moved, sums, setting)
            done.append(some)
            for one in engaged:
                cuts.setdefault(one.tool, []).append(one)
            progress(sums.steps / count, "removing")
    except MaterialAboveFlutes:
        whole = remove(
            program, stock, cutters, material, resolution, keep=True, accuracy=False, times=times, progress=progress
        )
        return KnownRemoval(program, times, resolution, replace(whole, mean_band=None), shank=True)
    progress(1.0, "removed")
    setting.run.store_moves(stock, WORKERS)
    joined = tuple(join_cuts(cuts[number]) for number in sorted(cuts))
    made = removal_of(program, stock, material, sums, stack_blocks(done), joined)
    left = made.volume_before - float(made.columns["chip_volume_mm3"].sum())
    return KnownRemoval(program, times, resolution, replace(made, volume_after=left, mean_band=None))


def _sums_after(known: Removal, sums: RunningSums) -> RunningSums:
    """The sums after the steps of a removal; those of the mean band are not known."""
    c = known.columns
    through = c["rapid"] & (c["chip_areas"] > 0) & (c["chip_volume_mm3"] > ROUNDING_MM3)
    return replace(
        sums,
        steps=len(c["line"]),
        s_mm=float(c["s_mm"][-1]),
        t_s=float(c["t_s"][-1]),
        rapids=tuple(dict.fromkeys(c["line"][through].tolist())),
    )
