"""A wall with stock on one side or both: finish surfaces as grids of places, compliance and thresholds in a state.

Notation: i, j, k, zeta as in :mod:`chipload.structure.grid`; the mesh is the workpiece with all of its stock, a [mm]
the allowance of a side, D [mm] what is left of it, T [mm] the thickness of the mesh at a place. A place is numbered
along i and j; c places an element edge. The foot, f rows of elements at the clamp, keeps its stock: no place lies in
it. An element keeps (a_m - D_m) / T .. 1 - (a_p - D_p) / T of its thickness, m the
side k-, p the side k+, D the least of its places and T the mean: the wall is taken a little too soft where D varies.

The compliance is that of a force on the face that the cut leaves. A state that differs from the last one everywhere is
factored again: a low-rank correction of every element is no smaller than the stiffness itself.

Reference: [Yan2018] for the thresholds by place; Differs from source: the stiffness is that of the present state.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.planning.thinwall.threshold import Threshold, modelled
from chipload.structure.modes import modes
from chipload.structure.places import MeshPlaces, normals_of, on_cut, on_side, points_of, weights
from chipload.structure.solid import SolidWorkpiece, compliance, factorise, loads

Floats = NDArray[np.float64]
Side = Literal["k-", "k+"]
SIDES: tuple[Side, Side] = ("k-", "k+")
#: points of Gauss along a contact line
LINE_POINTS = 3
#: right-hand sides at once
TOGETHER = 64
#: places on the upper border of the foot are moved up by this [rows of elements], into the row above it
ABOVE = 1e-9


def line_nodes(bottom: Floats, top: Floats) -> tuple[Floats, Floats]:
    """Points of Gauss (k, p) between ends (p,), and their shares (k,) of the length."""
    x, w = np.polynomial.legendre.leggauss(LINE_POINTS)
    return bottom + 0.5 * (x[:, None] + 1.0) * (top - bottom), 0.5 * w


@dataclass(frozen=True, eq=False)
class FinishSurface:
    """Finish surface of one side.

    Attributes
    ----------
    points : (n, m, 3) float [mm], along i and j; j rises from the clamp to the free edge
    normals : (n, m, 3) float, unit vectors out of the wall
    allowance : [mm] of stock on it
    wall : number of the wall that it belongs to
    """

    points: Floats
    normals: Floats
    allowance: float
    wall: int = 0

    def __post_init__(self) -> None:
        shape = self.points.shape
        if len(shape) != 3 or shape[2] != 3 or min(shape[:2]) < 2 or self.normals.shape != shape:
            raise InputError(
                f"surface: points {shape}, normals {self.normals.shape}: need (n, m, 3), n and m at least 2"
            )
        if not np.isclose(np.linalg.norm(self.normals, axis=2), 1.0, atol=1e-6).all():
            raise InputError("surface: normals must be unit vectors")
        if not self.allowance > 0.0:
            raise InputError(f"surface.allowance_mm = {self.allowance:g}: must be above 0")


@dataclass(frozen=True)
class ContactLine:
    """Part of a contact line over which the force acts at one instant. The contact line goes up the wall from a place.

    Parameters
    ----------
    reach : height of its upper end above the place, at most to the free edge
    length : its length downwards from that end; both as shares of the wall's height above the foot
    """

    reach: float
    length: float

    def __post_init__(self) -> None:
        if not 0.0 < self.length <= self.reach <= 1.0:
            raise InputError(
                f"contact line: length {self.length:g} and reach {self.reach:g} of the height above the foot: need "
                "0 < length <= reach <= 1"
            )

    def ends(self, share: Floats) -> tuple[Floats, Floats]:
        """Upper and lower ends of the line of places at shares of the height above the foot.

        >>> [x.round(3).tolist() for x in ContactLine(0.2, 0.1).ends(np.array([0.5, 0.95]))]
        [[0.7, 1.0], [0.6, 0.9]]
        """
        top = np.minimum(share + self.reach, 1.0)
        return top, top - self.length


@dataclass(frozen=True, eq=False)
class WallBlank:
    """A wall with its stock.

    Parameters
    ----------
    solid : the clamped workpiece with all of its stock, one layer of elements thick
    allowance : [mm] of stock on the sides k- and k+; 0: this side is not cut
    density : c >= 1, places along an element's edge
    foot : f, rows of elements at the clamp that keep their stock

    Raises
    ------
    InputError
        There is more than one layer of elements, the stock leaves no wall, or all rows belong to the foot.
    """

    solid: SolidWorkpiece
    allowance: tuple[float, float]
    density: int = 1
    foot: int = 0

    def __post_init__(self) -> None:
        if self.solid.grid.counts[2] != 1:
            raise InputError(f"wall: {self.solid.grid.counts[2]} layers of elements: must be 1 through the thickness")
        if self.density < 1 or min(self.allowance) < 0.0 or max(self.allowance) == 0.0:
            raise InputError(
                f"wall.allowance_mm = {list(self.allowance)}, density = {self.density}: must be at least 0, above 0 on "
                "one side, and at least 1: state stock to cut"
            )
        if not 0 <= self.foot < self.solid.grid.counts[1]:
            raise InputError(
                f"wall: foot of {self.foot} rows of elements: must be from 0 to below {self.solid.grid.counts[1]}"
            )
        if not (self._thickness() > sum(self.allowance) * (1.0 + 1e-9)).all():
            raise InputError(
                f"wall: allowance_mm {self.allowance[0]:g} and {self.allowance[1]:g} leave no wall: it is "
                f"{self._thickness().min():g} mm thick with its stock"
            )

    @property
    def shape(self) -> tuple[int, int]:
        """Places along i and j."""
        i, j, _ = self.solid.grid.counts
        return self.density * i + 1, self.density * (j - self.foot) + 1

    def sides(self) -> tuple[Side, ...]:
        """Sides that have stock."""
        return tuple(s for s, a in zip(SIDES, self.allowance, strict=True) if a > 0.0)

    def _places(self, side: Side) -> MeshPlaces:
        i, j, _ = self.solid.grid.counts
        along, up = np.linspace(0.0, i, self.shape[0]) / i, np.linspace(self.foot, j, self.shape[1]) / j
        up[0] = (self.foot + 1e-9) / j if self.foot else 0.0  # in the row above the foot
        u, v = np.meshgrid(along, up, indexing="ij")
        return on_side(self.solid.grid, side, u.ravel(), v.ravel())

    def _thickness(self) -> Floats:
        low, high = (points_of(self.solid.grid, self._places(s)) for s in SIDES)
        return np.asarray(np.linalg.norm(high - low, axis=1).reshape(self.shape))

    def _blocks(self, values: Floats) -> Floats:
        """Values (n, m) of places as (elements, places of each)."""
        i, j = self.solid.grid.counts[0], self.solid.grid.counts[1] - self.foot
        c = self.density
        parts = [
            values[a : a + c * (i - 1) + 1 : c, b : b + c * (j - 1) + 1 : c] for a in range(c + 1) for b in range(c + 1)
        ]
        return np.stack(parts, axis=-1).reshape(i * j, -1)

    def _cut(self) -> NDArray[np.int64]:
        """Numbers of the elements above the foot, in the order of :meth:`_blocks`."""
        return np.asarray(
            np.arange(len(self.solid.grid.elements)).reshape(self.solid.grid.counts)[:, self.foot :].ravel()
        )

    def state(self, left: Sequence[Floats]) -> SolidWorkpiece:
        """The workpiece while stock ``left`` D, (n, m) float [mm], is on k- and on k+."""
        T = self._blocks(self._thickness()).mean(axis=1)
        D = [
            np.clip(self._blocks(np.asarray(x)).min(axis=1), 0.0, a) for x, a in zip(left, self.allowance, strict=True)
        ]
        kept = np.tile([0.0, 1.0], (len(self.solid.grid.elements), 1))
        kept[self._cut(), 0] = (self.allowance[0] - D[0]) / T
        kept[self._cut(), 1] = 1.0 - (self.allowance[1] - D[1]) / T
        return replace(self.solid, kept=kept)

    def surface(self, side: Side) -> FinishSurface:
        """Finish surface of a side."""
        none = np.zeros(self.shape)
        places = on_cut(self._places(side), self.state((none, none)).kept, side)
        grid = self.solid.grid
        points, normals = points_of(grid, places), normals_of(grid, places, side)
        shape = (*self.shape, 3)
        return FinishSurface(points.reshape(shape), normals.reshape(shape), self.allowance[SIDES.index(side)])

    def threshold(self, left: Sequence[Floats], side: Side, deflection: float, factor: float = 1.0) -> Threshold:
        """Threshold of the places of a side while stock ``left`` is on both.

        Parameters
        ----------
        left : two (n, m) float [mm], on k- and k+
        deflection : [mm] that is allowed
        """
        return modelled(self.compliance(left, side), deflection, factor)

    def compliance(self, left: Sequence[Floats], side: Side, line: ContactLine | None = None) -> Floats:
        """C_nn of the places of a side while stock ``left`` is on both, (p,) [mm/N].

        Parameters
        ----------
        line : that the force is spread over evenly; the displacement is that of its upper end. None: at the place
        """
        solid = self.state(left)
        if line is not None:
            return self._line_compliance(solid, side, line)
        places = on_cut(self._places(side), solid.kept, side)
        n = normals_of(solid.grid, places, side)
        clamped = self._clamped(places)
        C = np.full(len(places), np.inf)
        C[~clamped] = compliance(
            factorise(solid), MeshPlaces(places.element[~clamped], places.local[~clamped]), n[~clamped]
        )
        C[clamped] = C[~clamped].min()
        return C

    def _line_compliance(self, solid: SolidWorkpiece, side: Side, line: ContactLine) -> Floats:
        """Displacement of the upper end of a line under a force spread over the line. By Betti's theorem it is the mean
        displacement of the line under the same force at its upper end.
        """
        j = solid.grid.counts[1]
        along, share = np.meshgrid(
            np.linspace(0.0, 1.0, self.shape[0]), np.linspace(0.0, 1.0, self.shape[1]), indexing="ij"
        )
        top, bottom = line.ends(share.ravel())

        def force(at: Floats) -> scipy.sparse.csc_array:
            up = (self.foot + np.maximum(at, ABOVE) * (j - self.foot)) / j
            places = on_cut(on_side(solid.grid, side, along.ravel(), np.minimum(up, 1.0)), solid.kept, side)
            return loads(factored, places, normals_of(solid.grid, places, side))

        factored = factorise(solid)
        nodes, shares = line_nodes(bottom, top)
        seen = sum((w * force(at) for at, w in zip(nodes[1:], shares[1:], strict=True)), shares[0] * force(nodes[0]))
        acts = force(top)
        out = np.empty(len(top))
        for at in range(0, len(top), TOGETHER):
            some = slice(at, at + TOGETHER)
            out[some] = (seen[:, some].toarray() * factored.solve(acts[:, some].toarray())).sum(axis=0)
        return out

    def modes(self, left: Sequence[Floats], side: Side, count: int) -> tuple[Floats, Floats]:
        """Lowest modes while stock ``left`` is on both sides: frequencies (count,) [Hz] and their shapes at the places
        of a side, (p, 3, count) [1/sqrt(t)].
        """
        solid = self.state(left)
        places = on_cut(self._places(side), solid.kept, side)
        frequency, shapes = modes(factorise(solid), count)
        at = weights(solid.grid, places)
        return frequency, np.stack([at @ shape for shape in shapes], axis=2)

    def _clamped(self, places: MeshPlaces) -> NDArray[np.bool_]:
        """Whether each place lies on the clamp itself, (p,) bool. Such places do not move and take the compliance of
        the stiffest place.
        """
        fixed = np.zeros(len(self.solid.grid.nodes), dtype=np.bool_)
        fixed[self.solid.grid.side("j-")] = self.solid.constrained[self.solid.grid.side("j-")].all(axis=1)
        foot = places.local[:, 1] <= -1.0 + 1e-12
        return np.asarray(foot & fixed[self.solid.grid.elements[places.element]].any(axis=1))
