"""The contact lines of the steps of a program, and the stock before some of them.

An additional run of the program, before the simulation, finds them: contact and remaining stock of a step do not depend
on the feed. The stock before a step is made when it is asked for, from the moves before it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.program.program import Program
from chipload.progress import Progress, silent
from chipload.simulation.chips import remove
from chipload.simulation.loads import GRAZES, Cuts
from chipload.simulation.moves import stock_before
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.states import StepLines

Floats = NDArray[np.float64]

#: steps between two stocks that can be asked for
TOGETHER = 24
#: stocks that are kept
KEPT = 32
#: columns of a removal with the ends of the contact line [mm]
LINE = tuple(f"contact_{end}_{x}_mm" for end in ("low", "high") for x in "xyz")


@dataclass(frozen=True, eq=False)
class CutAhead:
    """Result of the additional run of a program before its simulation.

    Attributes
    ----------
    lines : where the steps that cut touch the workpiece
    states : (step, removed volume [mm^3] before it), rising, of steps before which the stock can be asked for; the last
        is what is left
    mean : (c, 3) float [N], mean force on the cutter of the steps that cut
    before : makes the stock before a step
    """

    lines: StepLines
    states: tuple[tuple[int, float], ...]
    mean: Floats
    before: Callable[[int], LayeredStock]


def cut_ahead(
    program: Program,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    material: Material,
    resolution: Resolution,
    progress: Progress = silent,
) -> CutAhead:
    """Run a program through a stock, which stays; return its contact lines, and the stock before every few steps."""
    left = stock.copied()
    removal = remove(
        program, left, cutters, material, resolution, accuracy=False,
        watch=lambda cuts: dict(zip(LINE, contact_lines(cuts).reshape(-1, 6).T, strict=True)),
        progress=lambda done, _: progress(done, "where it cuts"),
    )  # fmt: skip
    c = removal.columns
    removed = np.concatenate([[0.0], np.cumsum(c["chip_volume_mm3"])])
    count = len(removed) - 1
    ends = np.append(np.arange(0, count, TOGETHER), count)
    rises = np.flatnonzero(np.diff(removed[ends]) > 0.0) + 1
    states = [(int(k), float(removed[k])) for k in (0, *ends[rises].tolist())]
    if states[-1][0] < count:
        states.append((count, float(removed[count])))

    @lru_cache(KEPT)
    def before(step: int) -> LayeredStock:
        if step == count:
            return left
        return stock_before(step, program, stock, cutters, resolution, left)

    step = np.flatnonzero(c["force_n"] > 0.0)
    lines = np.column_stack([c[name] if name in c else np.zeros(count) for name in LINE])[step].reshape(-1, 2, 3)
    mean = np.column_stack([c[f"force_{x}_mean_n"] for x in "xyz"])[step]
    return CutAhead(StepLines(step, lines, c["force_n"][step], removed[step]), tuple(states), mean, before)


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
