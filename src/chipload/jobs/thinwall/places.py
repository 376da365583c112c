"""Places at which a wall is planned: those of its elements along it, and every row of the cutter up it.

Notation: u, v parameters of a side; C_nn [mm/N] normal compliance; D [mm] stock left on a side, (n, m) at the places.

Finite elements have compliances at their own places only. Between them the logarithm of the compliance is interpolated
by cubics, as in the simulation. A state of the wall is solved once, for all who use it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chipload.jobs.kept_parts import KeptRecords
from chipload.jobs.tables import require_stated
from chipload.jobs.thinwall.chatter import WallChatter, chatter_of
from chipload.jobs.thinwall.inputs import WallInputs
from chipload.jobs.thinwall.mesh_error import error_at, mesh_error
from chipload.jobs.thinwall.part_floor import PartFloor
from chipload.jobs.thinwall.part_shape import PartShape
from chipload.lazy import scipy
from chipload.planning.thinwall.blank import ContactLine, FinishSurface
from chipload.planning.thinwall.floor_rows import points_under
from chipload.planning.thinwall.passes import ThresholdOf
from chipload.planning.thinwall.threshold import Threshold, modelled
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]

#: side of a tile of the stock, in diameters of the cutter
TILE = 1.0
#: layers below the reach of the cutter are so many times as thick
COARSE = 8.0


def wall_stock(inputs: WallInputs) -> LayeredStock:
    """The workpiece before it is cut, in layers that are thin where the cutter comes.

    Raises
    ------
    InputError
        There are too many layers.
    """
    layer = min(o.table.layer_mm for o in inputs.operations)
    diameter = max(o.cut.cutter.diameter for o in inputs.operations)
    stock = LayeredStock.of_mesh(inputs.stock_mesh(), COARSE * layer, TILE * diameter)
    low = (inputs.lowest_row if inputs.body.part else inputs.foot_height) - inputs.below
    high = float(stock.bounds[-1])
    if isinstance(inputs.body.shape, PartShape):
        stock.refine_at(inputs.body.shape.levels())
        if inputs.body.shape.floors:  # from below the lowest floor, where a gouge would be, to the highest stock
            low = inputs.lowest_row - layer
            high = max(float(s.origin[2]) + s.allowance for s in inputs.body.shape.each if isinstance(s, PartFloor))
    if inputs.line is not None:  # the ends of the flank, row by row
        rows = np.concatenate([inputs.fine(s).surface.points[0, :, 2] for s in inputs.body.side_numbers])
        stock.refine_at(np.unique(np.concatenate([rows, rows - inputs.below]).round(9)))
    stock.refine(max(low, float(stock.bounds[0])), high, layer)
    return stock


@dataclass(frozen=True, eq=False)
class Places:
    """Places of all sides with stock.

    Attributes
    ----------
    u, v : (n,), (m,) float
    surfaces : finish surface of each side at them
    chatter : of the wall and the cutter; None: it is not calculated
    keep : of the run; None: compliance is not kept
    """

    inputs: WallInputs
    u: Floats
    v: Floats
    surfaces: tuple[FinishSurface, ...]
    chatter: WallChatter | None = None
    keep: KeptRecords | None = None
    _solved: dict[tuple[bytes, int, ContactLine | None], Floats] = field(default_factory=dict)
    _errors: dict[int, Floats] = field(default_factory=dict)
    _moved: dict[tuple[bytes, int], Floats] = field(default_factory=dict)
    _reached: dict[int, Floats] = field(default_factory=dict)

    @cached_property
    def uncut(self) -> LayeredStock:
        """The stock before it is cut: copied by what cuts it."""
        return wall_stock(self.inputs)

    @property
    def grid(self) -> tuple[Floats, Floats]:
        """Parameters u and v."""
        return self.u, self.v

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers n and m."""
        return len(self.u), len(self.v)

    def coarse(self, left: Sequence[Floats]) -> list[Floats]:
        """Stock at the places of the elements, from the stock at these places; on a floor what an upright cutter
        leaves whose tip follows it, the least within its radius.
        """
        v = self.inputs.body.places[1]
        return [
            np.array([np.interp(v, self.v, row) for row in D]) if floor is None else self._under_cutter(floor, D)
            for D, floor in zip(left, map(self.inputs.floor, self.inputs.body.side_numbers), strict=True)
        ]

    def _under_cutter(self, floor: PartFloor, left: Floats) -> Floats:
        """Least stock of a floor within the radius of the greatest cutter, at the places of the elements."""
        radius = max(o.cut.cutter.radius for o in self.inputs.operations)
        under = points_under(radius) / floor.box
        at = np.stack(np.meshgrid(*self.inputs.body.places, indexing="ij"), axis=-1)
        near = np.clip(at[:, :, None] + under, 0.0, 1.0)
        return np.asarray(scipy.interpolate.RegularGridInterpolator(self.grid, left)(near).min(axis=2))

    def compliance(self, left: Sequence[Floats], side: int, *, of_surface: bool = False) -> Floats:
        """C_nn at the elements' places of a side with stock ``left`` at these places on all sides.

        Parameters
        ----------
        of_surface : of the points of the surface that a flank makes, not of its contact line
        """
        states = self.inputs.both(self.coarse(left))
        line = self.inputs.surface_line if of_surface else self.inputs.line
        key = (b"".join(D.tobytes() for D in states), side, line)
        if key not in self._solved:
            body = self.inputs.body
            number = body.side_numbers[side]
            known = ("compliance", number, tuple(states), line and (line.reach, line.length))
            C = (
                self.keep(known, lambda: body.compliance(states, number, line))
                if self.keep
                else body.compliance(states, number, line)
            )
            self._solved[key] = C.reshape(body.elastic.shape)
        return self._solved[key]

    def motion(self, left: Sequence[Floats], side: int) -> Floats:
        """Displacement (n, m, 3) [mm/N] of the elements' places of a part's side under a normal force of 1 N."""
        states, part = self.inputs.both(self.coarse(left)), require_stated(self.inputs.body.part, "part")
        key = (b"".join(D.tobytes() for D in states), side)
        if key not in self._moved:
            number = self.inputs.body.side_numbers[side]
            found = (self.keep or KeptRecords(None, "", ()))(
                ("motion", number, tuple(states)), lambda: part.motion(states, number)
            )
            self._moved[key] = found.reshape(*part.shape, 3)
        return self._moved[key]

    def pressed(self, left: Sequence[Floats], side: int, uv: Floats) -> Floats:
        """Displacement (..., 3) [mm/N] of places (..., 2) of a floor under a normal force of 1 N on them.

        C_nn between places by cubics of its logarithm, the other components over it straight.
        """
        known, places = self.motion(left, side), self.inputs.body.places
        flat = np.clip(uv.reshape(-1, 2), 0.0, 1.0)
        C = interpolate_places(places, known[..., 2], *flat.T)
        share = scipy.interpolate.RegularGridInterpolator(places, known / known[..., 2:])(flat)
        return np.asarray((C[:, None] * share).reshape(*uv.shape[:-1], 3))

    def error(self, side: int) -> Floats:
        """Relative error of the compliance of a side by its mesh, at the elements' places of the finished wall."""
        if side not in self._errors:
            none, part = [np.zeros(self.shape) for _ in self.surfaces], self.inputs.body.part
            self._errors[side] = (
                mesh_error(self.inputs, self.compliance(none, side), side) if part is None else part.error(side)
            )
        return self._errors[side]

    def threshold(self, deflection: float, factor: float, spare: bool = True) -> ThresholdOf:
        """Thresholds at these places for an allowed deflection [mm]; ``factor`` of them is used.

        Parameters
        ----------
        spare : what is planned holds: the compliance is taken with the error of its mesh, depths within chatter
        """
        u, v = (x.ravel() for x in np.meshgrid(self.u, self.v, indexing="ij"))

        def limited(left: Sequence[Floats], side: int) -> Threshold:
            if self.inputs.floor(self.inputs.body.side_numbers[side]) is not None:
                return modelled(self._greatest_compliance(left, side, spare), deflection, factor)
            C = interpolate_places(self.inputs.body.places, self.compliance(left, side), u, v)
            if spare:
                C *= 1.0 + error_at(self.inputs.body.places, self.error(side), u, v)
            return modelled(C, deflection, factor)

        def measured(left: Sequence[Floats], side: int) -> Threshold:
            inputs = replace(self.inputs, body=replace(self.inputs.body, places=self.grid))
            known = inputs.threshold(deflection)(left, side)
            return replace(known, force=factor * known.force, factor=factor * known.factor)

        found = limited if self.inputs.depths.experiments is None else measured
        return found if self.chatter is None or not spare else self.chatter.limited(self, found)

    def _greatest_compliance(self, left: Sequence[Floats], side: int, spare: bool) -> Floats:
        """Greatest C_nn (p,) of the places that a cutter presses on over each place of a floor; ``spare``: with its
        error.
        """
        if side not in self._reached:
            number = self.inputs.body.side_numbers[side]
            floor, radius = self.inputs.floor(number), max(o.cut.cutter.radius for o in self.inputs.operations)
            u, v = (x.ravel() for x in np.meshgrid(self.u, self.v, indexing="ij"))
            self._reached[side] = require_stated(floor, "floor").reached(u, v, self.inputs.floor_area(number), radius)
        reached = self._reached[side]
        C = self.pressed(left, side, reached)[..., 2]
        if spare:
            error = error_at(self.inputs.body.places, self.error(side), *reached.reshape(-1, 2).T)
            C = C * (1.0 + error.reshape(C.shape))
        return np.asarray(C.max(axis=0))


def rows_up(inputs: WallInputs, operation: int) -> Floats:
    """Parameters v of the rows of an operation, on the side with most of them."""
    return max((inputs.fine(s, operation).v for s in inputs.body.side_numbers), key=len)


def places_of(inputs: WallInputs, keep: KeptRecords | None = None) -> Places:
    """The places; as many rows as the operation and the side with most of them have."""
    u, shape = inputs.body.places[0], inputs.body.shape
    v = max((rows_up(inputs, k) for k in range(len(inputs.operations))), key=len)
    a, b = np.meshgrid(u, v, indexing="ij")
    surfaces = tuple(
        FinishSurface(shape.sides(a, b)[s], shape.normals(a, b)[s], inputs.body.allowance[s], inputs.body.wall_of(s))
        for s in inputs.body.side_numbers
    )
    return Places(inputs, u, v, surfaces, chatter_of(inputs), keep)


def interpolate_places(places: tuple[Floats, Floats], values: Floats, u: Floats, v: Floats) -> Floats:
    """Values above 0 of places (n, m) at parameters (k,), by cubics of their logarithm."""
    n, m = values.shape
    spline = scipy.interpolate.RectBivariateSpline(*places, np.log(values), kx=min(3, n - 1), ky=min(3, m - 1))
    return np.asarray(np.exp(spline.ev(u, v)))
