"""A clamped part with stock on its walls, in finite cells: compliance of its places in each state of removal.

Notation: C_nn [mm/N] normal compliance of a place, of a force that is spread over a square of the side; at an edge the
square lies within the side. Under a line C_nn would grow without bound with smaller cells. D [mm] stock left on a side,
(n, m) at the places.

The cells are those of a workpiece under any program (:mod:`chipload.structure.cells`): the whole part in its clamps is
elastic, floor and neighbours too. The error is :data:`CORNER` times the difference to cells of :data:`COARSER` times
the side in the finished state, :data:`FLOOR`, and the whole compliance of a half space beneath the square (Johnson,
Contact Mechanics, 1985, section 3.4). In the example `part/walls.toml` it is 11 to 41 %, where cells of 1.5 mm of order
3 find 8 to 30 %.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from chipload.checking.clamped import Workpiece, clamped_volumes, elastic_of, placed_clamps
from chipload.checking.workpiece_compliance import COARSER, CORNER, FLOOR
from chipload.jobs.simulation.values import clamps_of
from chipload.jobs.tables import require_stated
from chipload.jobs.thinwall.job import ThinWallJob
from chipload.jobs.thinwall.part_floor import PartFloor
from chipload.jobs.thinwall.part_shape import PartShape
from chipload.lazy import scipy
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.clamp import Clamp
from chipload.structure.cells.grid import CellGrid
from chipload.structure.cells.stress import greatest_stress
from chipload.structure.cells.thickness import cells_over
from chipload.structure.cells.workpiece import CellWorkpiece, Elastic, cell_workpiece, line_means

Floats = NDArray[np.float64]

#: layers of the stock over the longest side of the part, by which cells are chosen, and in a cell
LAYERS, PER_CELL = 60, 4
#: side of the contact square over the step-over of the rows
CONTACT = 0.5
#: lines up the square at the points of Gauss along u, and their shares of the force
ACROSS, WEIGHTS = (-math.sqrt(0.6), 0.0, math.sqrt(0.6)), (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
#: mean displacement of a half space under an even pressure on a square, over (1 - nu^2) F / (E side)
MEAN = 0.95
#: right-hand sides at once
TOGETHER = 64
#: layers through the greatest stock on a floor
THIN = 8


@dataclass(frozen=True, eq=False)
class PartBlank:
    """The part with its stock, in its clamps.

    Attributes
    ----------
    body : the part and its sides
    places : (n,) u, (m,) v, the same of each side
    contact : [mm] side of the contact square
    elastic, clamps, clamped : of the workpiece; [mm^3] what each clamp holds
    grid, wide : its cells, and those that its error is found with
    """

    body: PartShape
    places: tuple[Floats, Floats]
    contact: float
    elastic: Elastic
    clamps: tuple[Clamp, ...]
    clamped: Floats
    grid: CellGrid
    wide: CellGrid
    _last: dict[str, tuple[bytes, CellWorkpiece]] = field(default_factory=dict)

    @property
    def shape(self) -> tuple[int, int]:
        """Places along and up a side."""
        return len(self.places[0]), len(self.places[1])

    @property
    def unknowns(self) -> int:
        """Number of unknowns of the last state that was solved."""
        return 3 * len(self._last["fine"][1].modes)

    def state(self, left: Sequence[Floats], wide: bool = False) -> CellWorkpiece:
        """Factored part with stock ``left`` on its sides; ``wide``: in the wide cells."""
        key, which = b"".join(np.ascontiguousarray(D).tobytes() for D in left), "wide" if wide else "fine"
        if key != self._last.get(which, (b"", None))[0]:
            grid = self.wide if wide else self.grid
            stock = _layer_part(self.body, self.places, left, float(np.diff(self.grid.planes[2]).max()) / PER_CELL)
            self._last[which] = key, cell_workpiece(stock, grid, self.elastic, self.clamps, self.clamped)
        return self._last[which][1]

    def compliance(self, left: Sequence[Floats], side: int, wide: bool = False) -> Floats:
        """C_nn of the places of a side while stock ``left`` is on all of them, (p,) [mm/N]."""
        return np.asarray((self.motion(left, side, wide) * self._lines(left, side)[1]).sum(axis=1))

    def motion(self, left: Sequence[Floats], side: int, wide: bool = False) -> Floats:
        """Mean displacement (p, 3) [mm/N] of the contact square of each place under a normal force of 1 N on it.

        By Betti's theorem it is also the normal displacement under a force of 1 N along x, y and z.
        """
        lines, normals = self._lines(left, side)
        work = self.state(left, wide)
        loads = sum(w * line_means(work, line) for line, w in zip(lines, WEIGHTS, strict=True)).T.toarray()
        out = np.empty(normals.shape)
        for at in range(0, len(normals), TOGETHER):
            some = slice(at, at + TOGETHER)
            right = loads[:, None, some] * normals[some].T
            found = work.solve(right.reshape(-1, right.shape[2])).reshape(right.shape)
            out[some] = np.einsum("mk,mdk->kd", loads[:, some], found)
        return out

    def error(self, side: int) -> Floats:
        """Relative error (n, m) of the compliance of a finished side by its cells."""
        none = [np.zeros(self.shape) for _ in self.body.each]
        fine, coarse = self.compliance(none, side), self.compliance(none, side, wide=True)
        # what the surface gives beneath a square, which larger cells do not show
        beneath = MEAN * (1.0 - self.elastic.poisson**2) / (self.elastic.modulus * self.contact)
        return np.asarray((CORNER * np.abs(coarse / fine - 1.0) + FLOOR + beneath / fine).reshape(self.shape))

    def stress(self, left: Sequence[Floats], side: int, u: float, v: float, force: float) -> float:
        """Greatest equivalent stress [MPa] under a normal force [N] at a place of a side."""
        lines, normals = self._lines(left, side, (np.array([u]), np.array([v])))
        away = self.grid.widest
        middle = lines[len(lines) // 2, 0]
        return greatest_stress(self.state(left), self.elastic, middle, -force * normals[0], away).stress

    def _lines(
        self, left: Sequence[Floats], side: int, places: tuple[Floats, Floats] | None = None
    ) -> tuple[Floats, Floats]:
        """Lines up the contact squares (w, p, 2, 3) [mm] on what is left of a side, and the normals (p, 3) there."""
        a, b = (x.ravel() for x in np.meshgrid(*(places or self.places), indexing="ij"))
        one = self.body.each[side]
        if isinstance(one, PartFloor):
            return self._squares(one, left[side] if places is None else np.zeros(self.shape), np.column_stack([a, b]))
        length, height = one.size()
        # at an edge the square lies within the side
        along, up = (min(0.5, 0.5 * self.contact / size) for size in (length, height * (1.0 - one.foot)))
        normals = self.body.normals(a, b)[side]
        stock = (left[side].ravel() if places is None else np.zeros(1))[:, None] * normals
        u, v = np.clip(a, along, 1.0 - along), np.clip(b, up, 1.0 - up)
        lines = [
            [self.body.sides(u + t * along, v + s * up)[side] + stock for s in (-1.0, 1.0)] for t in ACROSS
        ]  # fmt: skip
        return np.moveaxis(np.array(lines), 1, 2), normals

    def _squares(self, floor: PartFloor, left: Floats, uv: Floats) -> tuple[Floats, Floats]:
        """Lines across the contact squares of places (p, 2) of a floor, within its outline, and the normals there."""
        half = 0.5 * self.contact
        xy = floor.on(uv * floor.box, half)
        D = scipy.interpolate.RegularGridInterpolator(self.places, left)(np.clip(xy / floor.box, 0.0, 1.0))
        z = D[:, None] * np.array([0.0, 0.0, 1.0])
        lines = []
        for t in ACROSS:
            ends = [(xy + half * np.array([t, s])) / floor.box for s in (-1.0, 1.0)]
            lines.append([floor.at(*e.T) + z for e in ends])
        return np.moveaxis(np.array(lines), 1, 2), floor.normal(*uv.T)


def part_blank(job: ThinWallJob, body: PartShape, step_over: float) -> PartBlank:
    """The part of a job in its clamps.

    Parameters
    ----------
    step_over : [mm] of the rows, of which the contact square's side is the share :data:`CONTACT`

    Raises
    ------
    InputError
        A clamp holds nothing, a rigid motion is free, or the cells do not resolve the thinnest wall.
    """
    made = job.table.workpiece
    n, m = require_stated(job.table.part, "part").places
    places = np.linspace(0.0, 1.0, n), np.linspace(0.0, 1.0, m)
    workpiece = Workpiece(
        modulus_gpa=made.modulus_gpa,
        poisson=made.poisson,
        clamps=clamps_of(made.clamp),
        density_kg_m3=made.density_kg_m3,
    )
    full = [np.full((n, m), s.allowance) for s in body.each]
    layer = float(np.ptp(body.part.bounds, axis=0).max()) / LAYERS
    first, last = (_layer_part(body, places, D, layer) for D in (full, [np.zeros((n, m)) for _ in full]))
    grid, wall = cells_over(first, last, made.cell_mm, made.order or 2)
    body, clamps = replace(body, thickness=wall), placed_clamps(workpiece, first)
    clamped_parts = clamped_volumes(workpiece, first)
    return PartBlank(
        body, places, CONTACT * step_over, elastic_of(workpiece), clamps, clamped_parts, grid, grid.wider(COARSER)
    )


def _layer_part(body: PartShape, places: tuple[Floats, Floats], left: Sequence[Floats], layer: float) -> LayeredStock:
    """The part with its stock in layers, one tile each, that end at its level faces and divide the stock of floors."""
    mesh = body.body(places, left)
    stock = LayeredStock.of_mesh(mesh, layer, 2.0 * float(np.ptp(mesh.bounds, axis=0).max()))
    stock.refine_at(body.levels())
    for side, D in zip(body.each, left, strict=True):
        if isinstance(side, PartFloor) and float(D.max()) > 0.0:
            stock.refine_at(float(side.origin[2]) + float(D.max()) * np.linspace(0.0, 1.0, THIN + 1))
    return stock
