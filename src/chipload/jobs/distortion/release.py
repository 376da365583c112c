"""The part through its setups: its shape when each surface is made, and after its release.

Notation: u_k displacement of the free body after setup k, u_0 that of the blank, all from the uncut plate, which is
flat. In setup k the body is clamped at g_k: u_(k-1) as it lies, or the rigid motion nearest to that, pressed flat. With
clamps of stiffness C, K u = f + C g_k in the state that the setup leaves; without clamps its surfaces stay at u_(k-1).
A surface that setup k makes is where it should be at that displacement, so that after the last release it is off by

    e = u_K - u(when it was made).

A face of the plate was made in the uncut plate, u = 0. All is linear in the stress, so the columns of a plan are those
of the stated stress and of the odd one, upside down where the plate is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.checking.clamped import place_clamp
from chipload.checking.workpiece import insides
from chipload.errors import InputError
from chipload.jobs.distortion.outcome import Banded, PlanOutcome
from chipload.jobs.distortion.plans import Clamping, MillingPlan
from chipload.jobs.distortion.shapes import PartLayers, SideCut, part_layers
from chipload.jobs.distortion.surface import UNDERSIDE, PartSurface
from chipload.lazy import trimesh
from chipload.number_text import number_text
from chipload.structure.cells.clamp import clamp_stiffness, rigid_motions
from chipload.structure.cells.faces import flat_faces, grid_on_faces
from chipload.structure.cells.grid import CellGrid
from chipload.structure.cells.initial_stress import FreeBody, displacements_of_modes, free_body
from chipload.structure.cells.workpiece import CellBody, CellWorkpiece, Elastic, cell_workpiece, mode_weights
from chipload.structure.stress_profile import StressProfile

Floats = NDArray[np.float64]

#: share of the surface that no setup makes, above which a plan is refused
UNMADE = 1e-3
#: side and least stock [mm] to which it has been milled
Left = frozenset[tuple[str, float]]

#: cells along the longest side of the blank
CELLS = 15


@dataclass(eq=False)
class PlateRelease:
    """The states of a part at one place in its plate; each is solved once.

    Parameters
    ----------
    layers : of the part in the blank
    grid, elastic : of the finite cells
    profiles : stated, odd, and both upside down
    """

    layers: PartLayers
    grid: CellGrid
    elastic: Elastic
    profiles: tuple[StressProfile, ...]
    _states: dict[Left, FreeBody] = field(default_factory=dict)

    def shapes(self, left: Left) -> list[shapely.Geometry]:
        """Sections of what is left when each side has been milled to some stock."""
        out = self.layers.blank()
        for side, stock in sorted(left):
            out = self.layers.after(out, SideCut(side, stock))
        return out

    def state(self, cuts: Sequence[SideCut]) -> FreeBody:
        """What is left after cuts, lying free: whatever their order, the least stock of each side counts."""
        least: dict[str, float] = {}
        for cut in cuts:
            least[cut.side] = min(cut.stock, least.get(cut.side, np.inf))
        left = frozenset(least.items())
        if left not in self._states:
            stock = self.layers.stock(self.shapes(left))
            under = float(self.layers.low[2])
            self._states[left] = free_body(stock, self.grid, self.elastic, self.profiles, under)
        return self._states[left]

    def clamped(self, before: FreeBody, after: FreeBody, setup: Clamping) -> tuple[CellWorkpiece, Floats, Floats]:
        """The body in its clamps when a setup ends: its cells, its displacement (3 u, q), its force (q,)."""
        clamps = tuple(place_clamp(c, f"setup.clamp.{k}", before.stock) for k, c in enumerate(setup.clamps))
        work = cell_workpiece(after.stock, self.grid, self.elastic, clamps)
        springs = clamp_stiffness(clamps, after.stock, self.grid, work.modes, self.elastic.modulus).matrix
        g = displacements_of_modes(before, work, before.moved)
        if setup.flat:
            R = rigid_motions(self.grid, work.modes, 0.5 * (self.grid.low + self.grid.high))
            g = R @ np.linalg.solve(R.T @ (springs @ R), R.T @ (springs @ g))
        forces = displacements_of_modes(after, work, after.forces)
        u = work.solve(forces + springs @ g)
        press = springs @ (g - u)
        return work, u, np.asarray(np.abs(press.reshape(-1, 3, press.shape[1])).sum(axis=(0, 1)) / 2.0)

    def outcome(self, plan: MillingPlan, surface: PartSurface, spread: float) -> PlanOutcome:
        """The part after its release.

        Parameters
        ----------
        spread : share by which the stress differs from plate to plate

        Raises
        ------
        InputError
            A clamp holds nothing, or a part of the surface is milled in no setup.
        """
        cuts = tuple(s.cut for s in plan.setups)
        states = [self.state(cuts[:k]) for k in range(len(cuts) + 1)]
        made = surface.made_by([insides(s.stock) for s in states])
        self._require_made(plan, surface, made)
        columns = np.array([2, 3] if plan.flipped else [0, 1])
        every = np.arange(len(surface.points))
        e = _surface_motion(states[-1], states[-1].moved[:, columns], surface, every)
        force, corner = np.zeros(len(cuts)), np.repeat(made, 3)
        unknowns = max(3 * len(s.modes) for s in states)
        for k, setup in enumerate(plan.setups, start=1):
            rows = np.flatnonzero(corner == k)
            work: CellBody = states[k - 1]
            u = states[k - 1].moved
            if setup.clamps:
                work, u, press = self.clamped(states[k - 1], states[k], setup)
                force[k - 1] = press[columns[0]]
            if len(rows):
                e[rows] -= _surface_motion(work, u[:, columns], surface, rows)
        return _outcome_of_plan(plan, surface, e, made, force, unknowns, spread)

    def _require_made(self, plan: MillingPlan, surface: PartSurface, made: NDArray[np.int64]) -> None:
        lost = made > len(plan.setups)
        share = float(surface.areas[lost].sum() / surface.areas.sum())
        if share > UNMADE:
            area = float(surface.areas[lost].sum())
            x, y, z = surface.middles()[lost][int(surface.areas[lost].argmax())]
            raise InputError(
                f"setup: {number_text(area)} mm2 of the part are milled in no setup, as at ({x:.4g}, {y:.4g}, {z:.4g}) "
                "mm: add a setup of the side that they are open to, with stock_mm = 0"
            )


def _surface_motion(work: CellBody, u: Floats, surface: PartSurface, rows: NDArray[np.int64]) -> Floats:
    """Displacements (r, 3, q) [mm] of corners of the surface, of those (3 u, q) of the modes."""
    _, first, same = np.unique(surface.corner[rows], return_index=True, return_inverse=True)
    weights = mode_weights(work, surface.points[rows[first]])
    moved = weights @ u.reshape(-1, 3 * u.shape[1])
    return np.asarray(moved.reshape(-1, 3, u.shape[1])[same])


def _outcome_of_plan(
    plan: MillingPlan,
    surface: PartSurface,
    e: Floats,
    made: NDArray[np.int64],
    force: Floats,
    unknowns: int,
    spread: float,
) -> PlanOutcome:
    """Flatness and distortion of displacements e (3 m, 3, 2): by the stated stress and by the odd one."""
    by, odd = e[:, :, 0], e[:, :, 1]

    def over(measure: Callable[[Floats], float]) -> Banded:
        value, alone = measure(by), measure(odd)
        high = max(measure(s * by + t * odd) for s in (1.0 - spread, 1.0 + spread) for t in (-1.0, 1.0))
        return Banded(value, max((1.0 - spread) * value - alone, 0.0), max(high, value))

    faces = {f.name: over(partial(surface.flatness, f)) for f in surface.faces}
    distortion = over(lambda v: float(np.abs(surface.deviations(v)).max()))
    flatness = faces.get(UNDERSIDE, distortion)
    return PlanOutcome(plan, flatness, distortion, faces, by, made, force, unknowns)


def plate_release(
    mesh: trimesh.Trimesh,
    low: Floats,
    high: Floats,
    stocks: Sequence[float],
    profiles: tuple[StressProfile, StressProfile],
    elastic: Elastic,
    cell_mm: float | None,
) -> PlateRelease:
    """The states of a part in a blank between the corners ``low`` and ``high`` [mm].

    Parameters
    ----------
    stocks : [mm] that setups leave
    profiles : stated and odd
    cell_mm : side of the cells; None: see :data:`CELLS`
    """
    layers = part_layers(mesh, low, high, stocks)
    finished = layers.stock(list(layers.shapes))
    size = cell_mm or float((high - low).max()) / CELLS
    grid = grid_on_faces(layers.stock(layers.blank()), flat_faces(finished), size, 2)
    upside = tuple(p.upside_down() for p in profiles)
    return PlateRelease(layers, grid, elastic, (*profiles, *upside))


def in_wider_cells(release: PlateRelease, times: float) -> PlateRelease:
    """The same part in cells so many times as wide."""
    return replace(release, grid=release.grid.wider(times), _states={})
