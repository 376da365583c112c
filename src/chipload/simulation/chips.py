"""Simulation of a Program in a workpiece: the removal and the loads of every step, by :mod:`chipload.simulation.moves`.

Notation: a step as in :mod:`chipload.simulation.steps`. Its chip is what the cutter covers during the step and what is
still there. Forces are on the cutter, in the work frame, over one revolution of the spindle.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.band import deviations
from chipload.cutting.material import Material
from chipload.errors import Finding, InputError
from chipload.number_text import number_text
from chipload.program.check import SPINDLE_OFF
from chipload.program.motions import lengths
from chipload.program.program import DWELL, RAPID, Program
from chipload.progress import Progress, silent
from chipload.simulation.accuracy import (
    COMPARED,
    WITH_FORCE,
    PartsOfTools,
    energy_balance,
    moves_again,
    resolution_error,
)
from chipload.simulation.loads import (
    LOADS,
    TORQUE_RISE,
    Cuts,
    join_cuts,
)
from chipload.simulation.moves import (
    MaterialAboveFlutes,
    Moved,
    MoveRun,
    run_by_moves,
)
from chipload.simulation.removal import (
    Columns,
    Removal,
    Resolution,
    RunningSums,
    RunSettings,
    Seen,
    Watch,
    unseen,
)
from chipload.simulation.steps import BLOCK, StepBlocks, Steps, moving_rows, number_of_steps, steps_in_blocks
from chipload.simulation.strips import number_of_strips, remove_in_strips
from chipload.stock.layers import LayeredStock
from chipload.units import mm_min_from_mm_s

Floats = NDArray[np.float64]

#: volume of a chip that is the rounding of its layers, whose areas are sums of products of coordinates [mm^3]
ROUNDING_MM3 = 1e-9
#: columns that are means over a step of what a revolution has
OF_STEPS = ("torque_mean_nm", "power_w")
#: most steps of a simulation
MOST_STEPS = 50_000_000
#: blocks of steps that go together by moves
MOVES = 8


def remove(
    program: Program,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    material: Material,
    resolution: Resolution,
    *,
    keep: bool = False,
    watch: Watch | None = None,
    times: Floats | None = None,
    accuracy: bool = True,
    workers: int = 2,
    loads: bool = True,
    outlines: bool = True,
    uncounted: int = -1,
    seen: Seen = unseen,
    progress: Progress = silent,
) -> Removal:
    """Remove the cuts of a program from ``stock``, which changes, and calculate the loads of every step.

    All columns stay in memory; :func:`chipload.simulation.chunks.remove_in_chunks` stores them in files and continues a
    stopped run.

    Parameters
    ----------
    program : in the work frame of the stock
    cutters : by tool number
    keep : keep the tooth engagement of every step, for :mod:`chipload.simulation.deflection`; some kB a step
    watch : called with what one cutter cut in some hundred steps; gives more columns, a value for each of them; they
        are 0 in steps that do not cut
    times : (n,) float [s], time of each row of the program on the machine (:mod:`chipload.program.time`), for ``t_s``
        and ``duration_s``; None: at the commanded feed, rapids take none
    accuracy : calculate ``energy_balance`` and ``resolution_error``, for which some steps are computed once more
    workers : threads; the result does not depend on them
    loads : False: only what is removed is needed; the loads are 0
    outlines : False: of what is left only the volume is needed: ``stock`` stays as it was, and its volume afterwards is
        that before less the chips
    uncounted : last line whose steps only make room for those after it: what they remove is not calculated, and their
        columns and chips are 0; -1: none
    seen : takes the columns of each block of steps as soon as they are known

    Returns
    -------
    Removal
        With the columns ``line``, ``tool``, ``label``, ``rapid``, ``s_mm``, ``t_s``, ``duration_s`` (on the
    machine), ``seconds`` (at the commanded feed, which chips and loads go by), ``x_mm``, ``y_mm``, ``z_mm``,
    ``axis_x..z``, ``feed_mm_min``, ``axial_overrun_mm`` (height of the shank that stands in material above the flutes
    when the step ends), ``chip_volume_mm3``, ``chip_areas`` (pieces of the engaged surface),
    ``chip_layers`` (layers that lost something; where all of it is films, narrower than a few tolerances, there are no
    pieces and no loads), ``chip_max_mm`` (thickest),
    ``force_{x,y,z}_{mean,max,min}_n`` over the revolution, ``force_n`` (greatest size), ``torque_mean_nm``,
    ``torque_nm`` (greatest), ``power_w`` (mean),
    ``force_normal_n`` (greatest force that presses on the surface that the step leaves, along its normal; 0 where it
    leaves two that face each other, as in a slot), ``engaged_volume_mm3`` (what the engaged edge sweeps in the step, if
    it goes on as in its middle), ``cutting_work_j`` (of the torque without the edge coefficients, likewise)

    Raises
    ------
    InputError
        A tool has no cutter, an axis lies or looks down at the stock.

    Notes
    -----
    O(n m): n steps, m earlier moves near each.
    """
    setting = RunSettings(cutters, material, resolution, watch, workers, loads=loads, uncounted=uncounted)
    return _remove_program(
        program, stock, setting, times, keep=keep, accuracy=accuracy, outlines=outlines, seen=seen, progress=progress
    )[0]


def remove_with_edge(
    program: Program,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    material: Material,
    edge: Material,
    resolution: Resolution,
    *,
    accuracy: bool = True,
    progress: Progress = silent,
) -> tuple[Removal, Removal]:
    """Return :func:`remove` with the tooth engagement kept, and the same with the loads of another material, that of
    the edge alone, without its accuracy: the contact is found once for both.
    """
    setting = RunSettings(cutters, material, resolution, None, 2, other=edge)
    whole, of_edge = _remove_program(
        program, stock, setting, None, keep=True, accuracy=accuracy, outlines=True, seen=unseen, progress=progress
    )
    return whole, of_edge


@dataclass(eq=False)
class _Collected:
    """What the steps of a run gave so far; ``keep``: their tooth engagement too."""

    sums: RunningSums
    keep: bool
    columns: list[Columns] = field(default_factory=list)
    kept: dict[int, list[Cuts]] = field(default_factory=dict)

    def add(self, steps: Steps, moved: Moved, setting: RunSettings) -> Columns:
        """Add some steps; their columns."""
        self.sums, some, cuts = remove_block(steps, moved, self.sums, setting)
        self.columns.append(some)
        for engaged in cuts if self.keep else ():
            self.kept.setdefault(engaged.tool, []).append(engaged)
        return some

    def removal(self, program: Program, stock: LayeredStock, material: Material) -> Removal:
        """Return the removal after all steps."""
        cut = tuple(join_cuts(self.kept[number]) for number in sorted(self.kept))
        return removal_of(program, stock, material, self.sums, stack_blocks(self.columns), cut)


def _remove_program(
    program: Program,
    stock: LayeredStock,
    setting: RunSettings,
    times: Floats | None,
    *,
    keep: bool,
    accuracy: bool,
    outlines: bool,
    seen: Seen,
    progress: Progress,
) -> tuple[Removal, ...]:
    """:func:`remove`, and the removal with the loads of the other material of the settings, if there is one."""
    count = count_steps(program, setting.cutters, setting.resolution)
    progress(0.0, "removing")
    setting = with_moves(setting, program, stock)
    before = stock.copied() if accuracy else None
    alone = replace(setting, material=setting.other or setting.material, other=None, watch=None)
    while True:
        begun = RunningSums(stock.volume(), shank=setting.asks_shank)
        own, others = _Collected(begun, keep), _Collected(begun, keep)
        try:
            for steps, moved in _moved_blocks(program, stock, setting, times, count):
                seen(own.add(steps, moved, setting))
                if moved.other is not None:
                    others.add(steps, moved.other, alone)
                progress(own.sums.steps / count, "removing")
            break
        except MaterialAboveFlutes:
            setting = with_moves(setting, program, stock, shank=True)
    progress(1.0, "removed")
    if outlines:
        setting.run.finish(stock, setting.workers)
    removal = own.removal(program, stock, setting.material)
    further = () if setting.other is None else (others.removal(program, stock, alone.material),)
    if not outlines:
        chips = float(removal.columns["chip_volume_mm3"].sum())
        removal = replace(removal, volume_after=removal.volume_before - chips)
    return with_accuracy(removal, program, before, setting), *further


def _moved_blocks(
    program: Program, stock: LayeredStock, setting: RunSettings, times: Floats | None, count: int
) -> Iterator[tuple[Steps, Moved]]:
    """Yield one block of the ``count`` steps after another with its removal."""
    fine, size = setting.resolution, block_of(setting)
    blocks = steps_in_blocks(program, fine.step_mm, fine.tolerance, size=size, times=times)
    runs = runs_of_threads(program, stock, setting, count)
    yield from remove_in_strips(blocks, setting, runs, 0)


def block_of(setting: RunSettings) -> int:
    """Steps that are simulated together: of an upright axis some more, of which each costs less."""
    return MOVES * BLOCK if setting.run.upright else BLOCK


def with_moves(setting: RunSettings, program: Program, stock: LayeredStock, *, shank: bool = False) -> RunSettings:
    """Return the settings with the run of the program by moves; ``shank``: material stands above the flutes, and the
    shank is looked for.
    """
    return replace(setting, moves=_run_of(setting, program, stock, shank=shank))


def runs_of_threads(program: Program, stock: LayeredStock, setting: RunSettings, count: int) -> list[MoveRun]:
    """Return the run of each thread that shares ``count`` steps, that of the settings first."""
    further = number_of_strips(setting.workers, count, block_of(setting)) - 1
    return [setting.run, *(_run_of(setting, program, stock, shank=setting.asks_shank) for _ in range(further))]


def _run_of(setting: RunSettings, program: Program, stock: LayeredStock, *, shank: bool) -> MoveRun:
    """A run of the program by moves, before its first step."""
    fine = setting.resolution
    run = run_by_moves(
        program, stock, setting.cutters, fine.step_mm, fine.tolerance, fine.corner_slices, fine.flank_mm,
        setting.loads, shank=shank,
    )  # fmt: skip
    return replace(run, uncounted=setting.uncounted)


def with_accuracy(removal: Removal, program: Program, before: LayeredStock | None, setting: RunSettings) -> Removal:
    """Add energy balance and resolution error to a removal; ``before`` is the stock before it, None: add nothing."""
    if before is None:
        return removal
    errors, parts = resolution_error_of(program, before, removal.columns, setting)
    return replace(
        removal,
        energy_balance=energy_balance(removal.columns, setting.material.Ktc),
        resolution_error=errors,
        load_parts=parts,
    )


def resolution_error_of(
    program: Program,
    before: LayeredStock,
    columns: Columns,
    setting: RunSettings,
    names: Sequence[str] = COMPARED,
) -> tuple[dict[str, float], PartsOfTools]:
    """Return the relative error of the worst value of columns of a removal, and the other parts of their error
    (:mod:`chipload.simulation.accuracy`).

    It is inf, not known, where the resolution states that it is not estimated.
    """
    if not setting.resolution.estimated:
        return dict.fromkeys((*names, *WITH_FORCE), math.inf), {}
    blocks = StepBlocks(program, setting.resolution.step_mm, setting.resolution.tolerance)
    again = moves_again(setting, setting.run, columns)
    found, parts = resolution_error(blocks, before, columns, setting, again, names)
    rises = {
        name: (1.0 + found[name]) * (1.0 + rise_within_steps(columns, name)) - 1.0 for name in OF_STEPS if name in found
    }
    return found | rises, parts


def rise_within_steps(columns: Columns, name: str) -> float:
    """Return how far a mean load over a revolution goes within a step above the greatest of the steps, relative.

    >>> rise_within_steps({"power_w": np.array([100.0, 20.0]), "torque_rise": np.array([0.0, 9.0])}, "power_w")
    1.0
    """
    if name not in columns or TORQUE_RISE not in columns:
        return 0.0
    values = np.asarray(columns[name])
    worst = float(values.max(initial=0.0))
    return float((values * (1.0 + np.asarray(columns[TORQUE_RISE]))).max()) / worst - 1.0 if worst > 0.0 else 0.0


def require_steps(program: Program, step_mm: float) -> float:
    """Return the least number of steps of a program; refuse more than can be simulated.

    Raises
    ------
    InputError
        There are more than ``MOST_STEPS``.
    """
    least = float(np.sum(lengths(program))) / step_mm
    if not least <= MOST_STEPS:
        raise InputError(
            f"operation.0.step_mm = {step_mm:g}: {number_text(least)} steps: must be at most {MOST_STEPS}: "
            "state a longer one, "
            "or split the program"
        )
    return least


def count_steps(program: Program, cutters: Mapping[int, Cutter], resolution: Resolution) -> int:
    """Return the number of steps of a program; refuse it if a tool has no cutter.

    Raises
    ------
    InputError
        One has none, there is no step, or there are too many.
    """
    require_steps(program, resolution.step_mm)
    moving = np.flatnonzero(moving_rows(program))
    for number, row in zip(*np.unique(program.tool[moving], return_index=True), strict=True):
        if number not in cutters:
            known = ", ".join(str(n) for n in sorted(cutters))
            line = int(program.line[moving[row]])
            raise InputError(f"line {line}: tool {number}: no [[cutter]] has this number: state one beside {known}")
    count = number_of_steps(program, resolution.step_mm, resolution.tolerance)
    if count == 0:
        raise InputError("program: no motion: nothing to simulate")
    return count


def remove_block(
    steps: Steps, found: Moved, sums: RunningSums, setting: RunSettings
) -> tuple[RunningSums, dict[str, NDArray[Any]], list[Cuts]]:
    """Return the sums after some steps, whose removal was ``found``, their columns and tooth engagement."""
    watched: dict[str, Floats] = dict(found.bands)
    if setting.watch is not None:
        for cut in found.cuts:
            for name, values in setting.watch(cut).items():
                watched.setdefault(name, np.zeros(len(steps)))[cut.step - sums.steps] = values
    columns = {**columns_of_steps(steps, found.removed, found.loads, sums), **watched}
    return add_steps(sums, steps, found.removed, columns, sums.basis + found.basis), columns, found.cuts


def add_steps(
    sums: RunningSums,
    steps: Steps,
    removed: Floats,
    columns: Columns,
    basis: Floats,
) -> RunningSums:
    """Return the sums after some steps."""
    cuts = (removed[:, 0] > 0.0) & ~steps.rapid
    # a chip that only takes back what the simplification of outlines had added is no material
    lines = steps.line[steps.rapid & (removed[:, 1] > 0.0) & (removed[:, 0] > ROUNDING_MM3)].tolist()
    return replace(
        sums,
        steps=sums.steps + len(steps),
        s_mm=float(columns["s_mm"][-1]),
        t_s=float(columns["t_s"][-1]),
        cut_s=sums.cut_s + float(steps.seconds[cuts].sum()),
        basis=basis,
        rapids=tuple(dict.fromkeys((*sums.rapids, *lines))),
    )


def removal_of(
    program: Program,
    stock: LayeredStock,
    material: Material,
    sums: RunningSums,
    columns: Columns,
    cuts: tuple[Cuts, ...] = (),
) -> Removal:
    """Return the removal after all steps."""
    band = None
    if material.has_band:
        sd = deviations(sums.basis / sums.cut_s, material) if sums.cut_s > 0.0 else np.zeros(4)
        band = (*sd[:3].tolist(), float(sd[3]) / 1000.0)
    # rapids that cut more than films
    feeds = ~np.isin(program.motion, (RAPID, DWELL))
    resting = set(program.line[feeds & (program.spindle == 0.0)].tolist())
    rapids = [line for line in sums.rapids if line not in resting]
    found = [Finding("rapid-cuts", line, "a rapid goes through material") for line in rapids]
    if lines := [line for line in sums.rapids if line in resting]:
        more = f" in {len(lines)} lines" if len(lines) > 1 else ""
        text = f"cuts with the spindle at rest{more}: start it (M3 S) before the cut"
        found.append(Finding(SPINDLE_OFF, lines[0], text))
    return Removal(columns, sums.before, stock.volume(), band, None, tuple(found), program.labels, cuts)


def stack_blocks(blocks: Sequence[Columns]) -> dict[str, NDArray[Any]]:
    """Return the columns of blocks one below the other; a column that a block lacks is 0 there."""
    count = [len(b["line"]) for b in blocks]
    return {
        name: np.concatenate([b[name] if name in b else np.zeros(n) for b, n in zip(blocks, count, strict=True)])
        for name in dict.fromkeys(name for b in blocks for name in b)
    }


def columns_of_steps(steps: Steps, removed: Floats, loads: Floats, sums: RunningSums) -> dict[str, NDArray[Any]]:
    """Return the columns of some steps that every run has."""
    length = np.linalg.norm(steps.p1 - steps.p0, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        feed = np.where(steps.seconds > 0.0, mm_min_from_mm_s(1.0) * length / steps.seconds, 0.0)
    return {
        "line": steps.line,
        "tool": steps.tool,
        "label": steps.label,
        "rapid": steps.rapid,
        "s_mm": np.cumsum([sums.s_mm, *length])[1:],
        "t_s": np.cumsum([sums.t_s, *steps.duration])[1:],
        "duration_s": steps.duration,
        "wait_s": steps.wait,
        "seconds": steps.seconds,
        **{f"{x}_mm": steps.p1[:, i] for i, x in enumerate("xyz")},
        **{f"axis_{x}": steps.a1[:, i] for i, x in enumerate("xyz")},
        "feed_mm_min": feed,
        "chip_volume_mm3": removed[:, 0],
        "chip_areas": removed[:, 1].astype(np.int64),
        "chip_layers": removed[:, 2].astype(np.int64),
        "axial_overrun_mm": removed[:, 3],
        **{name: loads[:, i] for i, name in enumerate(LOADS)},
    }
