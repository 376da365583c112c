"""The compliance of the workpiece of a job in the state of each step, and its error.

The compliance is solved in a few states, the stock before some steps of the program. The error by the cells is found at
the worst places: the same states are solved there in cells of :data:`COARSER` times the side, between the same faces of
the part. At an inner corner of 90 degrees the error of a deflection falls with the power 1.09 of the side: the error of
the finer cells is then 1 / (COARSER^1.09 - 1) = 1.8 of the difference, :data:`CORNER`. Elsewhere it falls faster.

Reference: [Szabo1991] for the power, twice 0.544.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.bent_workpiece import JACK, BentWorkpiece, bent_workpiece
from chipload.checking.clamped import Workpiece, clamped_volumes, elastic_of, placed_clamps
from chipload.checking.contact_lines import CutAhead, cut_ahead
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.errors import Finding, Severity
from chipload.number_text import number_text
from chipload.program.program import Program
from chipload.progress import Progress, silent
from chipload.simulation.deflection_jumps import jump_findings
from chipload.simulation.removal import Columns, Resolution
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.followed import FollowedModes, ModesOfStates
from chipload.structure.cells.grid import CellGrid
from chipload.structure.cells.states import RemovalState, StepCompliances, size_of, step_compliances
from chipload.structure.cells.stress import greatest_stress
from chipload.structure.cells.thickness import cells_over
from chipload.structure.cells.workpiece import CellWorkpiece, Elastic, cell_workpiece, line_compliances

Floats = NDArray[np.float64]

#: side of the cells that the error is found with, over that of the cells
COARSER = 1.5
#: error of the cells over the difference to the wider ones
CORNER = 1.8
#: least distance of contact lines that are solved, in cells
SPACING = 0.5
#: error of the cells that is not found so
FLOOR = 0.01
#: change of a frequency between two states, over that of the deflection
FREQUENCY = 0.5
#: numbers of the factors of states, of which half may be kept while another is made: 1.8 GB
KEPT = 220_000_000
#: steps with most deflection, and with most force, whose stress is calculated
STRAINED = 6


@dataclass(frozen=True, eq=False)
class StrainedSteps:
    """Stress in the workpiece of selected steps.

    Attributes
    ----------
    step : (c,) int, rows of the history
    per_force : (c,) float [MPa/N], greatest stress per force of the step
    place : (c, 3) float [mm] of that stress
    strength : yield stress [MPa]
    """

    step: NDArray[np.int64]
    per_force: Floats
    place: Floats
    strength: float

    def worst(self, force: Floats) -> tuple[int, float, tuple[float, float, float]]:
        """Return row, stress [MPa] and place of the greatest stress under the greatest force of each step (n,) [N]."""
        stress = self.per_force * force[self.step]
        k = int(np.argmax(stress))
        x, y, z = self.place[k].tolist()
        return int(self.step[k]), float(stress[k]), (x, y, z)


@dataclass(frozen=True, eq=False)
class WorkpieceCompliance:
    """Compliance of the workpiece of a program.

    Attributes
    ----------
    steps : compliance in the state of each step
    wall : [mm] thinnest wall that is left
    cell : [mm] longest side of the cells
    unknowns : of the state with most
    error : relative error of the greatest deflection, by cells and states
    state_change : relative amount by which the greatest deflection may exceed the calculated one between two states
    findings : material that is not connected to a clamp; fewer states than passes
    bent : the workpiece in its worst step; None: nothing is cut
    modes : of vibration, followed through the removal; None: the density is not stated
    strained : stress of the steps that bend it most and of those with most force; None: no yield stress is stated
    """

    steps: StepCompliances
    wall: float
    cell: float
    unknowns: int
    error: float
    state_change: float
    findings: tuple[Finding, ...]
    bent: BentWorkpiece | None
    modes: FollowedModes | None = None
    strained: StrainedSteps | None = None

    def jumps(self, columns: Columns, reach: float) -> tuple[Finding, ...]:
        """Return the steps of a history whose compliance is not that of their neighbours within ``reach`` [mm]."""
        steps = self.steps
        return jump_findings(
            columns, steps.step, steps.lines.mean(axis=1), 1e3 * size_of(steps.compliance), reach, "force_n"
        )

    @property
    def numbers(self) -> Mapping[str, Any]:
        """The numbers for summary.json."""
        return {
            "states": len(self.steps.states),
            "state_change_percent": 100.0 * self.state_change,
            "cell_mm": self.cell,
            "thinnest_wall_mm": self.wall,
            "unknowns": self.unknowns,
            "support": None if self.bent is None else self._support(self.bent),
            **({} if self.modes is None else {"natural_frequencies": self._frequencies(self.modes)}),
        }

    @staticmethod
    def _frequencies(modes: FollowedModes) -> Mapping[str, Any]:
        f = modes.state_frequency
        return {
            "states": len(modes.states),
            "start_hz": f[0].tolist(),
            "end_hz": f[-1].tolist(),
            "least_hz": f.min(axis=0).tolist(),
            "greatest_hz": f.max(axis=0).tolist(),
            "error_percent": 100.0 * modes.error,
        }

    @staticmethod
    def _support(bent: BentWorkpiece) -> Mapping[str, Any]:
        lowers = 100.0 * (1.0 - bent.after / bent.before) if bent.before > 0.0 else 0.0
        place, normal = bent.place.round(4).tolist(), bent.normal.round(4).tolist()
        return {"stiffness_n_um": JACK / 1e3, "place": place, "normal": normal, "lowers_percent": lowers}


def workpiece_compliance(
    workpiece: Workpiece,
    program: Program,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    material: Material,
    resolution: Resolution,
    progress: Progress = silent,
) -> WorkpieceCompliance:
    """Return the compliance of the workpiece where its program cuts.

    Parameters
    ----------
    stock : before the program; it does not change

    Raises
    ------
    InputError
        A clamp holds nothing, a rigid motion is free, or the cells do not resolve the thinnest wall.
    """
    elastic, clamps = elastic_of(workpiece), placed_clamps(workpiece, stock)
    clamped_parts = clamped_volumes(workpiece, stock)
    ahead = cut_ahead(
        program, stock, cutters, material, resolution, lambda done, what: progress(0.4 * done, what),
    )  # fmt: skip
    grid, wall = cells_over(
        stock, ahead.before(ahead.states[-1][0]), workpiece.cell_mm, workpiece.order, resolution.tolerance
    )
    build = _WorkpieceStates(ahead, lambda then, cells: cell_workpiece(then, cells, elastic, clamps, clamped_parts))
    states = [RemovalState(k, v, lambda k=k: build(k, grid)) for k, v in ahead.states]  # type: ignore[misc]
    share = workpiece.state_change_percent / 100.0
    spacing = SPACING * grid.widest
    watch = None if workpiece.density_kg_m3 is None else ModesOfStates(ahead.lines, workpiece.modes, spacing)
    found = step_compliances(
        ahead.lines, states, tolerance=share, most=max(workpiece.states, 2), spacing=spacing, built=watch,
        progress=lambda done, what: progress(0.4 + 0.5 * done, what),
    )  # fmt: skip
    deflection = size_of(found.compliance) * ahead.lines.force
    upper = float((deflection * (1.0 + found.uncertainty)).max(initial=0.0))
    change = upper / float(deflection.max()) - 1.0 if upper > 0.0 else 0.0
    progress(0.9, "error of the cells")
    error = _cell_error(found, ahead, grid, build)
    modes = None
    if watch is not None:
        modes = watch.followed(
            states, tolerance=FREQUENCY * share, most=max(workpiece.states, 2), error=0.5 * (error + FLOOR),
            progress=lambda done, what: progress(0.9 + 0.05 * done, what),
        )  # fmt: skip
    bent = _bend_workpiece(found, ahead, grid, build, cutters) if len(found.worst) else None
    strained = None
    if workpiece.yield_mpa is not None and len(found.step):
        strained = _stress_of_steps(found, ahead, grid, build, elastic, workpiece.yield_mpa)
    findings: tuple[Finding, ...] = ()
    if found.loose > 1e-6 * stock.volume():
        text = f"{number_text(found.loose, 3)} mm3 of the workpiece are connected to nothing and carry no force"
        findings = (Finding("loose-material", 0, text, Severity.UNPROVEN),)
    most = max(workpiece.states, 2)
    if found.wanted > most and change > share:
        text = (
            f"workpiece.states = {most}: a state before each pass over a place takes {found.wanted}; between the "
            f"states that are solved the deflection of the workpiece may be {number_text(100.0 * change, 2)} % greater"
        )
        findings = (*findings, Finding("few-states", 0, text, Severity.NOTE))
    return WorkpieceCompliance(
        found,
        wall,
        grid.widest,
        build.unknowns,
        float(error + FLOOR + change),
        change,
        findings,
        bent,
        modes,
        strained,
    )


class _WorkpieceStates:
    """The workpiece before steps of a program; those that were used last are kept, as far as :data:`KEPT` allows.

    Attributes
    ----------
    unknowns : of the state with most
    """

    def __init__(self, ahead: CutAhead, make: Callable[[LayeredStock, CellGrid], CellWorkpiece]) -> None:
        self.ahead, self.make, self.unknowns = ahead, make, 0
        self._kept: dict[tuple[int, CellGrid], CellWorkpiece] = {}

    def __call__(self, step: int, cells: CellGrid) -> CellWorkpiece:
        """Return the workpiece before a step, in cells."""
        key = (step, cells)
        made = self._kept.pop(key, None)
        if made is None:
            while self._kept and 2 * self._kept_entries() > KEPT:
                self._kept.pop(next(iter(self._kept)))
            made = self.make(self.ahead.before(step), cells)
            self.unknowns = max(self.unknowns, 3 * len(made.modes))
        self._kept[key] = made
        return made

    def _kept_entries(self) -> int:
        return sum(work.factors.entries for work in self._kept.values())


def _stress_of_steps(
    found: StepCompliances,
    ahead: CutAhead,
    grid: CellGrid,
    build: Callable[[int, CellGrid], CellWorkpiece],
    elastic: Elastic,
    strength: float,
) -> StrainedSteps:
    """Return the stress of the steps with the greatest deflection of the workpiece, and with the greatest force."""
    lines = ahead.lines
    order = np.argsort(-size_of(found.compliance) * lines.force, kind="stable")
    rows = np.unique(np.concatenate([order[:STRAINED], np.argsort(-lines.force, kind="stable")[:STRAINED]]))
    first = np.array([step for step, _ in ahead.states])
    after = np.minimum(np.searchsorted(first, lines.step[rows], side="right"), len(first) - 1)
    away = grid.widest
    per_force, place = np.zeros(len(rows)), np.zeros((len(rows), 3))
    for state in np.unique(after).tolist():
        work = build(ahead.states[state][0], grid)
        for k in np.flatnonzero(after == state).tolist():
            force = _force(ahead, int(rows[k]))
            found_one = greatest_stress(work, elastic, lines.lines[rows[k]], force, away)
            size = float(np.linalg.norm(force))
            per_force[k], place[k] = found_one.stress / size if size > 0.0 else 0.0, found_one.place
    return StrainedSteps(lines.step[rows], per_force, place, strength)


def _force(ahead: CutAhead, row: int) -> Floats:
    """Return the greatest force (3,) [N] of a step on the workpiece, along the mean of its revolution."""
    mean = ahead.mean[row]
    size = float(np.linalg.norm(mean))
    return np.asarray(-mean * (float(ahead.lines.force[row]) / size if size > 0.0 else 0.0))


def _bend_workpiece(
    found: StepCompliances,
    ahead: CutAhead,
    grid: CellGrid,
    build: Callable[[int, CellGrid], CellWorkpiece],
    cutters: Mapping[int, Cutter],
) -> BentWorkpiece:
    """Return the deformed workpiece in the state after its worst step, under the force of that step."""
    row, state = int(found.worst[0]), ahead.states[int(found.after[0])][0]
    force = _force(ahead, row)
    away = max(cutter.diameter for cutter in cutters.values())
    return bent_workpiece(build(state, grid), ahead.before(state), int(found.step[row]), found.lines[row], force, away)


def _cell_error(
    found: StepCompliances,
    ahead: CutAhead,
    grid: CellGrid,
    build: Callable[[int, CellGrid], CellWorkpiece],
) -> float:
    """Return the error by the cells: from the greatest relative difference to wider cells at the worst places."""
    wide, error = grid.wider(COARSER), 0.0
    for state in np.unique(found.after).tolist():
        own = np.flatnonzero(found.after == state)
        work = build(ahead.states[state][0], wide)
        other = size_of(line_compliances(work, found.lines[found.worst[own]]))
        size = size_of(found.after_compliance[own])
        error = max(error, float(np.abs(other / size - 1.0).max(initial=0.0)))
    return CORNER * error


def with_compliance_error(
    errors: Mapping[str, float], columns: Columns, compliance: WorkpieceCompliance | None
) -> dict[str, float]:
    """Return the relative errors of columns; those of deflections include the error of the workpiece's compliance."""
    if compliance is None or not errors:
        return dict(errors)
    work, whole = (float(columns[name].max(initial=0.0)) for name in ("deflection_workpiece_um", "deflection_um"))
    share = min(work / whole, 1.0) if whole > 0.0 else 0.0
    own = {
        "deflection_workpiece_um": compliance.error,
        "deflection_um": share * compliance.error,
        "form_error_um": compliance.error,
    }
    return {**errors, **{name: errors["force_n"] + error for name, error in own.items()}}
