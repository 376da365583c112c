"""Accuracy of a simulation: the energy balance and the resolution error of its loads.

Both are calculated from a run and stated with its result.

**Energy balance** of each cutter: (work / energy) - 1, which is 0 if contact, chip thickness and volume are right. The
work is the sum of T omega dt over its steps, T the mean torque of the front without the edge coefficients. The energy
is the sum of K V over its steps, V [mm^3] the volume that the stock has lost in the step and K [MPa] the specific
energy: Ktc of a material without size effect, else the mean of Ktc h^(-m) over the engaged edge, h the chip thickness
with which the loads were computed. A step that lost volume and has no engaged edge takes the mean K of its cutter. V
and the engaged edge come from different computations.

**Resolution error** of each column of loads: some steps are computed a second time. The earlier steps that reach into
the box around such a step are removed from the initial body. The step is computed with MORE times the slices and FINER
times the rotations, once at the same instants and once in halves. With c the load of the run, f that at the same
instants, g that in halves and w the worst load of the run, the error is

    FACTOR max e / w + FLOOR + v / (1 - v),  e the greater of g - w and of |f - c| where c >= w / 2, else f - w.

A small load matters to a limit only if the finer one exceeds the worst. The contact is exact, so that a load that
differs between the halves of a step, as where the cutter enters, is not an error of the resolution unless it exceeds
every load of the run.

* v is the share of the volume that was lost in films, for which no loads are computed.
* FACTOR accounts for the error of the finer run itself, which is of first order: 2. If the axis leans, slices do not
  end where contact ends and the instants of the peak are uneven: 3.
* FLOOR is :data:`MOVES_FLOOR`: with twice the difference of the two resolutions and what the chips leave out it holds
  the true loads of random cuts by all kinds of mills (benchmarks/truth.py, docs/design/engines.md). If all cutters have
  a straight flank and a flat bottom, on which slices are exact, it is :data:`FLAT_FLOOR`; if an axis leans,
  :data:`LEANING_MOVES_FLOOR`.

The computed steps are: a worst one of each column; one that removes most; others at even distances among those in cut;
some that remove nothing, although the cutter is in the stock. Their number is limited by the earlier steps that they
need, at most SHARE of the steps of the run; the first kind and short programs are computed in any case.

**Chip.** To each error what the chips between the paths of the teeth leave out is added, of the steps that are computed
a second time and have at least half of the worst load: :func:`chipload.engagement.tooth_surfaces.chip_error`. The
thickest chip of teeth with runout is that of parts of the edge, and may be off by twice
:data:`chipload.engagement.tooth_surfaces.SHARE` more.

Deflection and form error are proportional to the force. Deflection has its error. In the form error parts of the force
cancel out: its error is that of the force times the deflection over the form error of its worst step.

**Other parts** of the error of a load (:mod:`chipload.cutting.load_parts`) are calculated from the tooth engagement of
the steps that are computed a second time: of each tool and load those of the step whose load is greatest with them.
For them a worst step of each tool is computed too, and the one that would be worst with the runout that is not known,
as many earlier steps as they need at most.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.load_parts import CHIP as THICKEST
from chipload.cutting.load_parts import LoadParts, load_parts, runout_of
from chipload.cutting.material import Material
from chipload.engagement.tooth_surfaces import SHARE as PARTS_OF_EDGE
from chipload.engagement.tooth_surfaces import chip_error
from chipload.simulation.checkpoint import in_rows
from chipload.simulation.loads import LOADS, Cuts
from chipload.simulation.moves import MoveRun, remove_by_moves
from chipload.simulation.steps import Steps, rows_of_steps, step_boxes
from chipload.stock.layers import LayeredStock

if TYPE_CHECKING:
    from chipload.simulation.removal import RunSettings

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Columns = Mapping[str, NDArray[Any]]
#: parts of the errors of the loads of some cuts, by column
SomeParts = list[dict[str, tuple[LoadParts, ...]]]
#: greatest loads of a step that is computed a second time, by column: at the instants of the run (none if that is not
#: compared), and in its parts; and the parts of their errors
Again = Callable[["Window"], tuple[Mapping[str, float], Mapping[str, float], SomeParts]]
#: parts of the error of the worst load of a tool, by tool and column
PartsOfTools = dict[tuple[int, str], LoadParts]

#: columns that are compared; columns of other limits that are proportional to the force
COMPARED = ("force_n", "torque_nm", "torque_mean_nm", "power_w", "chip_max_mm")
FORM = "form_error_um"
WITH_FORCE = ("deflection_um", FORM)
#: columns that can be compared
COMPARABLE = (*COMPARED, "force_normal_n")
#: greatest size of the force along z: it is compared too where a run asks for it, with a column of that name
AXIAL = "force_axial_n"
#: earlier steps that are removed a second time: at most this share of those of the run, or this number in a short run
SHARE, LEAST = 0.05, 60
#: factor on the difference of the two resolutions: upright axis, leaning axis
FACTOR, LEANING = 2.0, 3.0
#: error of a column that a few steps do not show
MOVES_FLOOR = {
    "force_n": 0.005, "torque_nm": 0.005, "torque_mean_nm": 0.005, "power_w": 0.005, "chip_max_mm": 0.035,
    "force_normal_n": 0.035, AXIAL: 0.035,
}  # fmt: skip
#: the same if all cutters are flat mills with a straight flank: slices are exact, and what is left are places between
#: the steps
FLAT_FLOOR = {
    "force_n": 0.007, "torque_nm": 0.007, "torque_mean_nm": 0.005, "power_w": 0.005, "chip_max_mm": 0.01,
    "force_normal_n": 0.01, AXIAL: 0.01,
}  # fmt: skip
#: the same if an axis leans, for any cutter
LEANING_MOVES_FLOOR = {
    "force_n": 0.05, "torque_nm": 0.05, "torque_mean_nm": 0.02, "power_w": 0.02, "chip_max_mm": 0.05,
    "force_normal_n": 0.05, AXIAL: 0.05,
}  # fmt: skip
#: number of slices of the finer run over that of the run, and of its rotations
MORE, FINER = 4, 4
#: steps that are computed besides the worst ones
EVEN, IDLE = 3, 2
#: greatest error of the chip of a step that is computed a second time: of its loads
CHIP = "chip_error"
#: rows of columns that are read together
ROWS = 65_536
#: columns of the energy balance
BALANCED = ("tool", "rapid", "chip_volume_mm3", "engaged_volume_mm3", "cutting_work_j")


def energy_balance(columns: Columns, ktc: float) -> dict[int, float]:
    """Return the energy balance, work over sum of K V less 1, by number of the tools that cut: see the module.

    Parameters
    ----------
    columns : of a removal
    ktc : tangential coefficient [MPa], for a cutter that has no engaged edge in any step

    Examples
    --------
    >>> c = {"tool": [1, 1], "rapid": [False, False], "chip_volume_mm3": [2.0, 2.0], "engaged_volume_mm3": [2.0, 2.2]}
    >>> c = {name: np.array(v) for name, v in {**c, "cutting_work_j": [2.0, 2.2]}.items()}
    >>> round(energy_balance(c, 1000.0)[1], 12)
    0.05
    """
    totals: dict[int, Floats] = {}
    for part in in_rows(columns, ROWS, BALANCED):
        volume = np.where(part["rapid"], 0.0, part["chip_volume_mm3"])
        engaged, work = part["engaged_volume_mm3"], 1000.0 * part["cutting_work_j"]
        has = engaged > 0.0
        known = volume * np.divide(work, engaged, out=np.zeros(len(work)), where=has)
        for tool in np.unique(part["tool"]).tolist():
            own = part["tool"] == tool
            sums = [work[own].sum(), engaged[own].sum(), known[own].sum(), volume[own & ~has].sum(), volume[own].sum()]
            totals[tool] = totals.get(tool, np.zeros(5)) + sums
    out = {}
    for tool, (work, engaged, known, rest, volume) in sorted(totals.items()):
        if volume > 0.0:
            mean = work / engaged if engaged > 0.0 else ktc
            out[tool] = float(work / (known + mean * rest) - 1.0)
    return out


@dataclass(frozen=True, eq=False)
class Window:
    """A step that is computed a second time: its number, its box, and the earlier steps that reach into the box."""

    step: int
    own: Steps
    low: Floats
    high: Floats
    earlier: tuple[Steps, ...]

    @property
    def upright(self) -> bool:
        """Whether the axis stands upright in all of the step."""
        return bool(min(self.own.a0[0, 2], self.own.a1[0, 2]) > 1.0 - 1e-12)

    @property
    def factor(self) -> float:
        """Factor on the difference of the two resolutions."""
        return FACTOR if self.upright else LEANING

    @property
    def cost(self) -> int:
        """Number of earlier steps."""
        return sum(len(s) for s in self.earlier)


def resolution_error(
    blocks: Iterable[Steps],
    before: LayeredStock,
    columns: Columns,
    setting: RunSettings,
    again: Again,
    names: Sequence[str] = COMPARED,
) -> tuple[dict[str, float], PartsOfTools]:
    """Return the relative resolution error of the worst value of each column of loads, and the other parts: see the
    module.

    Parameters
    ----------
    blocks : the steps of the run, in blocks; gone through twice
    before : the stock before the run; it is not changed
    columns : of the removal
    setting : of the run
    again : :func:`moves_again`
    names : columns that are compared, of :data:`COMPARABLE` and :data:`AXIAL`; the force among them

    Returns
    -------
    mapping of ``names`` and :data:`WITH_FORCE` to at least 0; inf where the run has a load of 0 and the finer
    one has not; parts by tool and column
    """
    chosen, count = _chosen_steps(columns, before, names)
    found = dict.fromkeys((*names, *WITH_FORCE), 0.0)
    excess, chip, parts = dict.fromkeys(names, 0.0), dict.fromkeys(names, 0.0), PartsOfTools()
    worst = {name: float(np.max(columns[name], initial=0.0)) for name in names}
    budget, spent = max(int(SHARE * count), LEAST), 0
    of_tools = [k for k in _worst_of_tools(columns, setting.cutters, setting.material) if k not in chosen]
    windows = {w.step: w for w in _windows(blocks, [*chosen, *of_tools], setting)}
    for number, step in enumerate(chosen):
        window = windows[step]
        if number == 0 or spent + window.cost <= budget:
            spent += window.cost
        else:
            continue
        alike, halves, some = again(window)
        _keep_worst(parts, int(window.own.tool[0]), some)
        for name in names:
            c, w = float(columns[name][step]), worst[name]
            same = alike.get(name, c)
            off = max(halves[name] - w, abs(same - c) if c >= 0.5 * w else same - w)
            excess[name] = max(excess[name], window.factor * off)
            if max(c, halves[name]) >= 0.5 * w:
                chip[name] = max(chip[name], halves[CHIP])
    spent = 0
    for step in dict.fromkeys(of_tools):
        spent += windows[step].cost
        if spent <= budget:
            _keep_worst(parts, int(windows[step].own.tool[0]), again(windows[step])[2])
    # the flank of a flat mill is cut into slices where its contact changes: exact
    straight = all(c.straight for c in _used_cutters(windows, setting))
    if "chip_max_mm" in chip and not all(c.teeth_alike for c in _used_cutters(windows, setting)):
        chip["chip_max_mm"] += 2.0 * PARTS_OF_EDGE
    films = _films(columns)
    floors = MOVES_FLOOR if setting.run.upright else LEANING_MOVES_FLOOR
    floors = FLAT_FLOOR if straight and setting.run.upright else floors
    for name in names:
        if worst[name] > 0.0 and films < 1.0:
            found[name] = excess[name] / worst[name] + floors[name] + films / (1.0 - films) + chip[name]
        elif excess[name] > 0.0 or films > 0.0:
            found[name] = math.inf
    force = found["force_n"]
    return found | {name: force * _levers(columns, name) for name in WITH_FORCE}, _of_worst(parts, columns)


def _levers(columns: Columns, name: str) -> float:
    """Return by how much an error of the force counts in the worst value of a column, 1 at least: in the form error
    parts of the force cancel out, of which only the deflection of the step has the whole.
    """
    if name != FORM or name not in columns or "deflection_um" not in columns:
        return 1.0
    left = np.abs(np.asarray(columns[name], dtype=np.float64))
    k = int(np.argmax(left)) if len(left) else 0
    if not len(left) or left[k] <= 0.0:
        return 1.0
    return max(float(np.asarray(columns["deflection_um"])[k] / left[k]), 1.0)


def _keep_worst(parts: PartsOfTools, tool: int, some: SomeParts) -> None:
    """Keep of each load of a tool the parts with which it is greatest."""
    for each in some:
        for name, steps in each.items():
            parts[tool, name] = max((*steps, parts.get((tool, name), steps[0])), key=lambda x: x.load * (1.0 + x.rise))


def _of_worst(parts: PartsOfTools, columns: Columns) -> PartsOfTools:
    """Return the parts relative to the worst load of their tool."""
    tool, out = np.asarray(columns["tool"]), PartsOfTools()
    for (number, name), own in parts.items():
        by = "torque_mean_nm" if name == "power_w" else name
        worst = float(np.max(np.asarray(columns[by])[tool == number], initial=0.0)) if by in columns else own.load
        # a step that is light in the run has parts of its own only
        out[number, name] = own if own.load >= worst else own.relative_to(worst)
    return out


def _used_cutters(windows: Mapping[int, Window], setting: RunSettings) -> list[Cutter]:
    """Return the cutters of the steps that are computed once more, and of those that made a move."""
    some = {int(w.own.tool[0]) for w in windows.values()}
    some |= set(setting.run.stock.table) & set(setting.cutters)
    return [setting.cutters[n] for n in sorted(some)]


def _chosen_steps(columns: Columns, before: LayeredStock, names: Sequence[str]) -> tuple[list[int], int]:
    """Return the steps to compute once more, the most significant first, and the number of steps of the run."""
    rapid, volume = np.asarray(columns["rapid"]), np.asarray(columns["chip_volume_mm3"])
    force = np.asarray(columns["force_n"])
    worst = [_among_worst(np.asarray(columns[name])) for name in names if len(force)]
    cut = np.flatnonzero(force > 0.0)
    out = [k for k in worst if force[k] > 0.0]
    if len(cut):
        out.append(int(cut[np.argmax(volume[cut])]))
        out += cut[((np.arange(EVEN) + 0.5) / EVEN * len(cut)).astype(np.int64)].tolist()
    within = np.asarray(columns["z_mm"]) < before.bounds[-1]
    for i, name in enumerate(("x_mm", "y_mm")):
        borders = before.xs if i == 0 else before.ys
        within &= (np.asarray(columns[name]) > borders[0]) & (np.asarray(columns[name]) < borders[-1])
    idle = np.flatnonzero(within & (force == 0.0) & ~rapid & (np.asarray(columns["seconds"]) > 0.0))
    if len(idle):
        out += idle[((np.arange(IDLE) + 0.5) / IDLE * len(idle)).astype(np.int64)].tolist()
    return list(dict.fromkeys(out)), len(force)


def _worst_of_tools(columns: Columns, cutters: Mapping[int, Cutter], material: Material) -> list[int]:
    """Return of each tool the step with the greatest force, and the one whose force is greatest with a runout that is
    not known, as thin chips rise by most: by e / (h + Kte / Ktc).
    """
    tool, force, thick = (np.asarray(columns[name]) for name in ("tool", "force_n", THICKEST))
    sharp, out = material.Kte / material.Ktc, []
    for number in np.unique(tool[force > 0.0]).tolist():
        own = np.flatnonzero((tool == number) & (force > 0.0))
        chip = thick[own] + sharp
        rise = np.divide(runout_of(cutters[number])[0], chip, out=np.zeros(len(own)), where=chip > 0.0)
        out += [int(own[_among_worst(x)]) for x in (force[own], force[own] * (1.0 + rise))]
    return out


def _among_worst(values: Floats) -> int:
    """Return the middle one of the steps within 1 % of the worst load; the first of them is often an entry."""
    alike = np.flatnonzero(values >= 0.99 * values.max())
    return int(alike[len(alike) // 2])


def _films(columns: Columns) -> float:
    """Return the share of the volume that steps without loads removed, rapids excluded."""
    volume = np.where(columns["rapid"], 0.0, columns["chip_volume_mm3"])
    whole = float(np.abs(volume).sum())
    return float(np.abs(volume[np.asarray(columns["chip_areas"]) == 0]).sum()) / whole if whole > 0.0 else 0.0


def _windows(blocks: Iterable[Steps], chosen: list[int], setting: RunSettings) -> list[Window]:
    """Return the windows of steps, from one pass for the steps and one for the earlier steps."""
    own: dict[int, tuple[Steps, Floats, Floats]] = {}
    earlier: dict[int, list[Steps]] = {k: [] for k in chosen}
    last = max(chosen, default=-1)
    for turn in range(2):
        at = 0
        for block in blocks:
            if at > last:
                break
            a, b = step_boxes(block, setting.cutters)
            for k in chosen:
                if turn == 0 and at <= k < at + len(block):
                    own[k] = (rows_of_steps(block, np.array([k - at])), a[k - at], b[k - at])
                if turn == 1:
                    _, low, high = own[k]
                    near = ((b > low) & (a < high)).all(axis=1) & (at + np.arange(len(block)) < k)
                    if near.any():
                        earlier[k].append(rows_of_steps(block, np.flatnonzero(near)))
            at += len(block)
    return [Window(k, *own[k], tuple(earlier[k])) for k in chosen]


def moves_again(setting: RunSettings, run: MoveRun, columns: Columns) -> Again:
    """Steps by moves with more slices; of the run's ``columns`` the volume says at how many instants it looked at a
    step.
    """
    flank = {n: length / MORE for n, length in run.flank_mm.items()}
    rotation = setting.resolution.rotation / FINER

    def loads_of(
        window: Window, own: Steps, more: tuple[int, int] | None
    ) -> tuple[Mapping[str, float], float, list[Cuts]]:
        stock = run.cropped(window.low, window.high)
        if stock is None:
            return dict.fromkeys((*COMPARABLE, AXIAL, CHIP), 0.0), 0.0, []
        stock.more = stock.more if more is None else more
        finer = replace(run, stock=stock, shank=None, corner_slices=MORE * run.corner_slices, flank_mm=flank)
        for some in window.earlier:
            finer.make(some, len(some))
        found = remove_by_moves(own, finer, 0, setting.cutters, setting.material, rotation, asks_shank=False)
        loads = dict(zip(LOADS, found.loads.T, strict=True))
        worst = {name: float(loads[name].max()) for name in COMPARABLE} | {AXIAL: float(axial_force(loads).max())}
        worst[CHIP] = max((float(chip_error(c.plain, c.cutter).max(initial=0.0)) for c in found.cuts), default=0.0)
        return worst, float(found.removed[:, 0].sum()), found.cuts

    def again(window: Window) -> tuple[Mapping[str, float], Mapping[str, float], SomeParts]:
        volume = float(columns["chip_volume_mm3"][window.step])
        alike = [loads_of(window, window.own, (n, n)) for n in (1, *run.stock.more)]
        same, _, cuts = min(alike, key=lambda each: abs(each[1] - volume))
        own = [load_parts(c.plain, c.cutter, setting.material) for c in cuts if len(c)]
        return same, loads_of(window, _halves(window.own), None)[0], own

    return again


def axial_force(columns: Columns) -> Floats:
    """Return the greatest size (n,) [N] of the force along z over a revolution of each step."""
    return np.maximum(np.abs(columns["force_z_max_n"]), np.abs(columns["force_z_min_n"]))


def _halves(step: Steps) -> Steps:
    """Return the two halves of a step in time, with the axis interpolated between its directions."""
    t = np.array([[0.0], [0.5], [1.0]])
    p, a = step.p0 + t * (step.p1 - step.p0), step.a0 + t * (step.a1 - step.a0)
    p[-1], a = step.p1[0], a / np.linalg.norm(a, axis=1)[:, None]
    alike = {f.name: np.repeat(getattr(step, f.name), 2) for f in fields(Steps) if getattr(step, f.name).ndim == 1}
    alike["seconds"] = alike["seconds"] / 2
    return Steps(**alike, p0=p[:-1], p1=p[1:], a0=a[:-1], a1=a[1:])
