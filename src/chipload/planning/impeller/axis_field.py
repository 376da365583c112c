"""Smooth field of cutter axes over a surface, clear of all walls, for point milling on five simultaneous axes.

Notation: S(u, v) the surface with its normal N, T(u, v) the axis of the cutter there, n = N.T. The field is stored at
nodes, a grid of u and v, and interpolated between them by cubic splines of its components.

At every node a fixed set of directions is tested. Allowed are those that the machine reaches away from its pole, that
lean by ``lean`` from the normal at least, and at which the whole cutter is clear of all check points. The depth of a
direction is its angle to the nearest one of the set that is not allowed. The cost of a direction is (1 - depth /
wanted)^2 where it is less deep than wanted, and how much longer the path is there than with the widest step-over of the
node. The cost of two neighbouring nodes is the square of the angle between them. Lines of nodes are solved one after
another by dynamic programming with their neighbouring lines fixed, until nothing changes. Finally the axes are moved
towards the mean of their neighbours, as far as they stay clear and deep.

Reference: [Jun2003] for the set of directions and the smooth choice among them. Differs from source: whole surface, not
line by line, and the step-over counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import CatalogueCutter
from chipload.geometry.bspline import BSplinePatch
from chipload.lazy import scipy
from chipload.machine.kinematics import inverse
from chipload.machine.machine import Machine
from chipload.number_text import number_text
from chipload.planning.impeller.clearance import clearance
from chipload.planning.impeller.profile import contact_band
from chipload.planning.impeller.scene import Floats, Scene
from chipload.planning.impeller.step_over import step_over

Flags = NDArray[np.bool_]

#: directions of the set on the whole sphere
_DIRECTIONS = 900
#: least angle from the machine's pole [rad]
_POLE = math.radians(6.0)
#: depth of a direction that costs nothing [rad]; what an angle of one radian between two nodes costs, squared
_WANTED, _SMOOTH = math.radians(15.0), 40.0
#: weight of a wide step-over
_WIDE = 1.0
#: sweeps over the lines of nodes, rounds of drawing towards the mean
_SWEEPS, _ROUNDS = 4, 40
#: share of the depth that a smoothed axis keeps
_KEEP = 0.7
#: numbers of nodes that are tried; places between two of them at which the field is checked
_COUNTS, _FINER = ((9, 5), (17, 9), (33, 17)), 3


@dataclass(frozen=True)
class AxisLimits:
    """Limits of the axis of a cutter.

    Parameters
    ----------
    lean : least angle from the normal [rad]
    touch : how deep check points may lie in the cutter [mm]
    above : clearance of neck, shank and holder [mm]
    scallop : height by which the step-over is weighed [mm]
    """

    lean: float
    touch: float
    above: float
    scallop: float


@dataclass(frozen=True, eq=False)
class AxisField:
    """Axis field over a box of a surface.

    Parameters
    ----------
    u, v : (a,), (b,) of the nodes, ascending
    nodes : (a, b, 3) unit axes there
    width : (a, b) step-over with lines along u, and along v [mm]: (2, a, b)
    """

    u: Floats
    v: Floats
    nodes: Floats
    width: Floats

    def at(self, u: Floats, v: Floats) -> Floats:
        """Unit axes (k, 3) at places (k,)."""
        degree = [min(3, len(x) - 1) for x in (self.u, self.v)]
        parts = [
            scipy.interpolate.RectBivariateSpline(
                self.u, self.v, self.nodes[..., k], kx=degree[0], ky=degree[1], s=0
            ).ev(u, v)
            for k in range(3)
        ]
        T = np.stack(parts, axis=-1)
        out: Floats = T / np.linalg.norm(T, axis=-1)[..., None]
        return out

    def path(self, surface: BSplinePatch, along: str) -> float:
        """Estimated length of the path over the box [mm]: area over step-over."""
        U, V = (x.ravel() for x in np.meshgrid(self.u, self.v, indexing="ij"))
        size = np.linalg.norm(np.cross(surface.at(U, V, 1, 0), surface.at(U, V, 0, 1)), axis=1)
        w = self.width[0 if along == "u" else 1].ravel()
        box = (self.u[-1] - self.u[0]) * (self.v[-1] - self.v[0])
        return float((size / w).mean() * box)


def pose(contact: Floats, normal: Floats, axis: Floats, cutter: CatalogueCutter) -> Floats:
    """Tips (n, 3) [mm] of a cutter that touches at contact points (n, 3) with its axes (n, 3).

    >>> pose(np.zeros((1, 3)), np.array([[1.0, 0, 0]]), np.array([[0, 0, 1.0]]), CatalogueCutter(20.0, 2.0)).tolist()
    [[10.0, 0.0, -2.0]]
    """
    n = (normal * axis).sum(axis=-1)[..., None]
    V = (normal - n * axis) / np.sqrt(np.clip(1.0 - n * n, 1e-300, None))
    r, e, f = cutter.contact_arc
    out: Floats = contact + r * normal + e * V - f * axis
    return out


def directions(machine: Machine, count: int = _DIRECTIONS) -> tuple[Floats, Flags]:
    """Unit directions (count, 3) spread evenly over the sphere, and which of them the machine reaches.

    >>> from chipload.machine.machine import machine_named
    >>> T, able = directions(machine_named("cradle-ac"), 200)
    >>> float(T[able][:, 2].min()) < -0.4, float(T[~able][:, 2].max()) > 0.99
    (True, True)
    """
    k = np.arange(count) + 0.5
    z, a = 1.0 - 2.0 * k / count, math.pi * (1.0 + math.sqrt(5.0)) * k
    s = np.sqrt(1.0 - z * z)
    T = np.stack([s * np.cos(a), s * np.sin(a), z], axis=-1)
    found = inverse(machine, np.zeros((count, 3)), T)
    within = np.zeros(count, dtype=np.bool_)
    for branch in range(found.axes.shape[1]):
        ok = np.ones(count, dtype=np.bool_)
        for axis in found.free:
            q = found.axes[:, branch, axis.column]
            turns = q[:, None] + math.tau * np.array([-1.0, 0.0, 1.0])
            ok &= ((turns >= axis.low) & (turns <= axis.high)).any(axis=1)
        within |= ok
    return T, within & (found.miss == 0.0) & (found.pole > _POLE)


def clear_field(
    surface: BSplinePatch,
    box: tuple[tuple[float, float], tuple[float, float]],
    scene: Scene,
    cutter: CatalogueCutter,
    reachable: tuple[Floats, Flags],
    limits: AxisLimits,
) -> AxisField | str:
    """Axis field with the fewest nodes with which it is also clear between them; or the reason why there is none.

    Parameters
    ----------
    box : (low, high) of u, of v
    reachable : of :func:`directions`
    """
    least, why = math.inf, ""
    for count in _COUNTS:
        field = axis_field(surface, box, count, scene, cutter, reachable, limits)
        if isinstance(field, float):
            return f"it reaches {number_text(100.0 * field, 3)} % of the surface"
        U, V = (
            x.ravel()
            for x in np.meshgrid(
                *(np.linspace(*b, _FINER * (k - 1) + 1) for b, k in zip(box, count, strict=True)), indexing="ij"
            )
        )
        S, N, T = surface.at(U, V), surface.normal(U, V), field.at(U, V)
        got, _ = clearance(scene, cutter, pose(S, N, T, cutter), T, 0.5, limits.above)
        n = (N * T).sum(axis=1)
        low, high = contact_band(cutter, 0.5 * limits.lean, chosen=False)
        on_arc = cutter.straight or (n.min() >= low and n.max() <= high)
        if got.min() >= -limits.touch and n.max() < math.cos(0.5 * limits.lean) and on_arc:
            return field
        if not on_arc:
            turned = math.degrees(max(math.asin(low) - math.asin(n.min()), math.asin(n.max()) - math.asin(high)))
            why = f"with a smooth axis its contact leaves its arc by {turned:.3g} deg"
            continue
        least = min(least, -float(got.min()))
    return f"with a smooth axis it cuts {least:.3g} mm into a wall" if math.isfinite(least) else why


def axis_field(
    surface: BSplinePatch,
    box: tuple[tuple[float, float], tuple[float, float]],
    count: tuple[int, int],
    scene: Scene,
    cutter: CatalogueCutter,
    reachable: tuple[Floats, Flags],
    limits: AxisLimits,
) -> AxisField | float:
    """Axis field over a box (low, high) of u, of v; or the share of the nodes that the cutter reaches if not all.

    Parameters
    ----------
    count : nodes along u and v, at least 2 each
    reachable : of :func:`directions`
    """
    u, v = (np.linspace(*x, k) for x, k in zip(box, count, strict=True))
    U, V = (x.ravel() for x in np.meshgrid(u, v, indexing="ij"))
    job = _Nodes(surface.at(U, V), surface.normal(U, V), surface.curvature(U, V), scene, cutter, limits)
    T, able = reachable
    clear = job.clear(T, able)
    if not clear.any(axis=1).all():
        return float(clear.any(axis=1).mean())
    along = np.stack([surface.at(U, V, 1, 0), surface.at(U, V, 0, 1)])
    used = np.flatnonzero(clear.any(axis=0))
    cost, depth = job.costs(T, clear, used, along)
    turn = np.arccos(np.clip(T[used] @ T[used].T, -1.0, 1.0))
    chosen = _choose_directions(cost.reshape(*count, -1), _SMOOTH * turn**2)
    rows = np.arange(len(U))
    start = T[used][chosen.ravel()]
    drawn = job.drawn(start, count, T, clear, depth[rows, chosen.ravel()])
    width = np.stack([job.width(drawn, x) for x in along]).reshape(2, *count)
    return AxisField(u, v, drawn.reshape(*count, 3), width)


@dataclass(frozen=True, eq=False)
class _Nodes:
    """Contact points S, N, K of the nodes (m, ...), and what is milled with."""

    contact: Floats
    normal: Floats
    curvature: Floats
    scene: Scene
    cutter: CatalogueCutter
    limits: AxisLimits

    def clear(self, T: Floats, able: Flags) -> Flags:
        """(m, k) whether the cutter may stand at a node in a direction (k, 3)."""
        n = self.normal @ T.T
        low, high = contact_band(self.cutter, self.limits.lean)
        some = able & (n > low) & (n < high)
        node, direction = np.nonzero(some)
        out = np.zeros(some.shape, dtype=np.bool_)
        out[node, direction] = self._free(node, T[direction])
        return out

    def _free(self, node: NDArray[np.intp], T: Floats) -> Flags:
        S, N = self.contact[node], self.normal[node]
        got, _ = clearance(self.scene, self.cutter, pose(S, N, T, self.cutter), T, 0.5, self.limits.above)
        return np.asarray(got >= -self.limits.touch)

    def width(self, T: Floats, along: Floats, node: NDArray[np.intp] | None = None) -> Floats:
        """(k,) step-over [mm]; 0 where the cutter does not fit the curvature."""
        at = slice(None) if node is None else node
        r, e, _ = self.cutter.contact_arc
        return step_over(self.normal[at], T, along[at], self.curvature[at], e, r, self.limits.scallop)

    def costs(self, T: Floats, clear: Flags, used: NDArray[np.intp], along: Floats) -> tuple[Floats, Floats]:
        """(m, k) cost of each direction ``used`` at each node, inf where it is not clear; its depth [rad]."""
        depth = np.zeros((len(clear), len(used)))
        angle = np.arccos(np.clip(T[used] @ T.T, -1.0, 1.0))
        for m, free in enumerate(clear):
            depth[m] = np.where(free[used], angle[:, ~free].min(axis=1) if not free.all() else math.pi, 0.0)
        node, k = np.nonzero(clear[:, used])
        w = np.maximum(self.width(T[used[k]], along[0], node), self.width(T[used[k]], along[1], node))
        wide = np.zeros(depth.shape)
        wide[node, k] = w
        most = wide.max(axis=1, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            cost = np.clip(1.0 - depth / _WANTED, 0.0, None) ** 2 + _WIDE * (most / wide - 1.0)
        return np.where(wide > 0.0, cost, np.inf), depth

    def drawn(self, start: Floats, count: tuple[int, int], T: Floats, clear: Flags, depth: Floats) -> Floats:
        """Axes (m, 3) drawn towards the mean of their neighbours where they stay clear and deep."""
        out = start
        least = np.minimum(_KEEP * depth, _KEEP * _WANTED)
        low, high = contact_band(self.cutter, self.limits.lean)
        for _ in range(_ROUNDS):
            padded = np.pad(out.reshape(*count, 3), ((1, 1), (1, 1), (0, 0)), mode="reflect", reflect_type="odd")
            mean = 0.25 * (padded[:-2, 1:-1] + padded[2:, 1:-1] + padded[1:-1, :-2] + padded[1:-1, 2:])
            new = 0.5 * out + 0.5 * mean.reshape(-1, 3)
            new /= np.linalg.norm(new, axis=1)[:, None]
            n = (self.normal * new).sum(axis=1)
            deep = np.where(clear, -1.0, new @ T.T).max(axis=1)
            ok = (n > low) & (n < high) & (np.arccos(np.clip(deep, -1.0, 1.0)) >= least)
            rows = np.flatnonzero(ok)
            ok[rows] = self._free(rows, new[rows])
            if not ok.any():
                break
            out = np.where(ok[:, None], new, out)
        return out


def _choose_directions(cost: Floats, turn: Floats) -> NDArray[np.intp]:
    """(a, b) direction of each node with the least cost (a, b, k) and turns (k, k) between neighbours."""
    a, b, _ = cost.shape
    chosen = np.full((a, b), -1, dtype=np.intp)
    for sweep in range(_SWEEPS):
        before = chosen.copy()
        # lines along u and lines along v in turn
        for lines, picks in ((cost.transpose(1, 0, 2), chosen.T), (cost, chosen)):
            for j, line in enumerate(lines):
                shifted = line.copy()
                for side in (j - 1, j + 1):
                    if 0 <= side < len(lines):
                        known = picks[side] >= 0
                        shifted[known] += turn[picks[side][known]]
                picks[j] = _line(shifted, turn)
        if sweep and (chosen == before).all():
            break
    return chosen


def _line(cost: Floats, turn: Floats) -> NDArray[np.intp]:
    """Directions (n,) along a line of nodes by dynamic programming over their costs (n, k)."""
    came = []
    total = cost[0]
    for own in cost[1:]:
        both = total[:, None] + turn
        came.append(both.argmin(axis=0))
        total = both.min(axis=0) + own
    at = int(total.argmin())
    out = [at]
    for back in reversed(came):
        at = int(back[at])
        out.append(at)
    return np.array(out[::-1], dtype=np.intp)
