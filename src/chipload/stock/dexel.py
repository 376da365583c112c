"""The workpiece as dexels: rays along the axes with the intervals over which they lie in material.

Notation: along each axis k in use there is a grid of rays in the middles of equal cells, no wider than the pitch. A
ray stores the ends (lo, hi) [mm] of its solid intervals in ascending order. The cutter is the solid of revolution of
the APT numbers (d, r, e, f, alpha, beta, h), of a barrel cutter with the arc of its flank (E, F, R, kappa where it
begins); T is its tip, A its unit axis. On a move a ray loses, for each passage of the cutter, the interval from the
least to the greatest coordinate that it covers. Passages are found at **instants** along the move; bisection and
golden section find their beginning, end and extremes between instants. A passage that falls between two instants is
missed: on a surface with radius of curvature q the loss is at most s^2 / (8 q), where s is the distance between
instants.

This is an independent calculation of the removed volume: it uses neither the engagement nor the layers.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.geometry.mesh import require_closed
from chipload.lazy import LateModule, trimesh

if TYPE_CHECKING:
    from trimesh.ray.ray_pyembree import RayMeshIntersector

_dexels = LateModule("chipload.stock._dexels")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: greatest number of rays in one direction
RAY_LIMIT = 50_000_000
#: attempts to shift rays that run along an edge of a mesh, and the shift of each as a share of the pitch
TRIES, ASIDE = 8, 1e-4


@dataclass(eq=False)
class Rays:
    """The rays along one axis; :meth:`TriDexel.remove_move` changes ``ends`` and ``count``.

    Parameters
    ----------
    k : axis, 0 to 2
    grid : [u0, v0, du, dv, nu, nv] [mm]: first ray, distances and numbers along the axes (k + 1) % 3 and (k + 2) % 3
    ends : (nu nv, room, 2) float [mm] solid intervals
    count : (nu nv,) int, number of solid intervals of each ray
    """

    k: int
    grid: Floats
    ends: Floats
    count: Ints

    def volume(self) -> float:
        """Solid volume [mm^3]."""
        there = np.arange(self.ends.shape[1]) < self.count[:, None]
        lengths = np.where(there, self.ends[:, :, 1] - self.ends[:, :, 0], 0.0)
        return float(lengths.sum() * self.grid[2] * self.grid[3])

    def places(self) -> tuple[Floats, Floats]:
        """Return u and v (n,), (n,) [mm] of each ray."""
        u0, v0, du, dv, nu, nv = self.grid
        u, v = np.meshgrid(u0 + du * np.arange(int(nu)), v0 + dv * np.arange(int(nv)), indexing="ij")
        return u.ravel(), v.ravel()


class TriDexel:
    """A solid in dexels; :meth:`remove_move` and :meth:`remove_poses` remove the volume that a cutter covers.

    Examples
    --------
    >>> stock = TriDexel.block((0.0, 0.0, 0.0), (20.0, 20.0, 10.0), 0.25)
    >>> stock.volume()
    4000.0
    >>> mill = (10.0, 0.0, 5.0, 0.0, 0.0, 0.0, 30.0)
    >>> path = (-10.0, 10.0, 6.0), (0, 0, 1), (30.0, 10.0, 6.0), (0, 0, 1)
    >>> round(stock.remove_move(*path, mill, error_mm=0.001), 3)
    800.0
    >>> {k: round(v, 3) for k, v in stock.volume_by_direction().items()}  # a slot 10 wide and 4 deep
    {'x': 3200.0, 'y': 3200.0, 'z': 3200.0}
    """

    def __init__(self, rays: Sequence[Rays]) -> None:
        self.rays = tuple(rays)

    @classmethod
    def block(cls, low: ArrayLike, high: ArrayLike, pitch: float, directions: str = "xyz") -> TriDexel:
        """Return a cuboid between the corners ``low`` and ``high`` (3,) [mm].

        Parameters
        ----------
        pitch : greatest distance between rays [mm]
        directions : axes that have rays; ``"z"`` suffices for drafts of three-axis milling
        """
        a, b = (np.asarray(corner, dtype=np.float64) for corner in (low, high))
        if a.shape != (3,) or b.shape != (3,) or not np.isfinite([a, b]).all() or not (b > a).all():
            raise InputError(f"stock: from {a.tolist()} to {b.tolist()} mm: each side must be above 0 and finite")
        made = []
        for k, grid in _grids(a, b, pitch, directions):
            n = int(grid[4] * grid[5])
            ends = np.zeros((n, 4, 2))
            ends[:, 0] = a[k], b[k]
            made.append(Rays(k, grid, ends, np.ones(n, dtype=np.int64)))
        return cls(made)

    @classmethod
    def of_mesh(cls, mesh: trimesh.Trimesh, pitch: float, directions: str = "xyz") -> TriDexel:
        """Return the dexels of a closed mesh; overlapping bodies are joined. Parameters as for :meth:`block`.

        Raises
        ------
        InputError
            The mesh is not closed, or rays do not leave it as often as they enter it.
        """
        if len(mesh.faces) == 0:
            raise InputError("stock: the mesh has no triangles")
        require_closed(mesh, "stock")
        from trimesh.ray.ray_pyembree import RayMeshIntersector

        caster = RayMeshIntersector(mesh)
        low, high = (np.asarray(b, dtype=np.float64) for b in mesh.bounds)
        return cls([_rays_of_mesh(mesh, caster, k, grid) for k, grid in _grids(low, high, pitch, directions)])

    def volume_by_direction(self) -> dict[str, float]:
        """Return the solid volume [mm^3] by the rays along each axis."""
        return {"xyz"[r.k]: r.volume() for r in self.rays}

    def volume(self) -> float:
        """Return the solid volume [mm^3], the mean over the directions."""
        return math.fsum(r.volume() for r in self.rays) / len(self.rays)

    def remove_move(
        self,
        tip0: ArrayLike,
        axis0: ArrayLike,
        tip1: ArrayLike,
        axis1: ArrayLike,
        apt: Sequence[float],
        *,
        samples: int | None = None,
        error_mm: float | None = None,
        tol: float | None = None,
    ) -> float:
        """Remove the volume that the cutter sweeps: its tip on the line and its axis on the arc between two poses.

        Returns the volume [mm^3] that the solid lost, the mean over the directions.

        Parameters
        ----------
        tip0, tip1 : (3,) float [mm]
        axis0, axis1 : (3,) float, from the tip to the holder, not opposite
        apt : (d, r, e, f, alpha, beta, h) [mm, rad] of a cutter; it cuts up to the height h
        samples : number of instants, at least 2; state either this or ``error_mm``
        error_mm : greatest loss between instants on a surface with the radius of the corner, or of the cutter where it
            has no corner radius. At a sharp bottom edge that leaves its own plane at an angle w it is s sin(w) at most
        tol : greatest error [mm] of the extremes of a ray within one passage; None: a fiftieth of ``error_mm``, and
            1e-6 mm where ``samples`` are given

        Raises
        ------
        InputError
            Numbers out of range, or neither or both of ``samples`` and ``error_mm`` given.
        """
        t0, t1 = (np.asarray(t, dtype=np.float64) for t in (tip0, tip1))
        if t0.shape != (3,) or t1.shape != (3,) or not np.isfinite([t0, t1]).all():
            raise InputError(f"stock: tips {t0.tolist()} and {t1.tolist()}: must be three finite numbers each")
        a0, a1 = _unit(axis0), _unit(axis1)
        shape = cutter_shape(apt)
        if (samples is None) == (error_mm is None):
            raise InputError("stock: state either samples or error_mm")
        angle = math.atan2(float(np.linalg.norm(np.cross(a0, a1))), float(a0 @ a1))
        if angle > math.pi - 1e-6:
            raise InputError("stock: axis0 and axis1 are opposite: state a move between them")
        h, big = float(shape[8]), float(shape[9])
        travel = max(float(np.linalg.norm(t1 - t0)), float(np.linalg.norm(t1 + h * a1 - t0 - h * a0))) + big * angle
        if samples is None:
            if error_mm is None or not error_mm > 0.0:
                raise InputError(f"stock: error_mm = {error_mm:g}: must be above 0")
            samples = 1 + max(1, math.ceil(travel / math.sqrt(8.0 * (shape[0] or 0.5 * apt[0]) * error_mm)))
        if tol is None:
            tol = 1e-6 if error_mm is None else 0.02 * error_mm
        if samples < 2:
            raise InputError(f"stock: samples = {samples}: must be at least 2")
        t = np.linspace(0.0, 1.0, samples)[:, None]
        if angle < 1e-9:
            axes = a0 * (1.0 - t) + a1 * t
        else:
            axes = (np.sin(angle * (1.0 - t)) * a0 + np.sin(angle * t) * a1) / math.sin(angle)
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        # parts about as long as the cutter is wide test few rays that they do not reach
        parts = min(samples - 1, max(1, math.ceil(travel / big)))
        borders = np.linspace(0, samples - 1, parts + 1).round().astype(int)
        tips = t0 * (1.0 - t) + t1 * t
        return math.fsum(
            self._remove(tips[a : b + 1], axes[a : b + 1], shape, tol) for a, b in itertools.pairwise(borders)
        )

    def remove_poses(self, tips: ArrayLike, axes: ArrayLike, apt: Sequence[float], *, tol: float = 1e-6) -> float:
        """Remove the volume that the cutter sweeps through the poses (n, 3), (n, 3), n >= 2, which are the instants.

        Between two poses tip and axis are interpolated linearly, the axis normalised; ``tol`` and what is returned as
        of :meth:`remove_move`.
        """
        p = np.ascontiguousarray(tips, dtype=np.float64)
        a = np.array([_unit(axis) for axis in np.asarray(axes, dtype=np.float64)])
        if p.ndim != 2 or p.shape != a.shape or p.shape[1] != 3 or len(p) < 2 or not np.isfinite(p).all():
            raise InputError(
                f"stock: poses of shapes {p.shape} and {a.shape}: must be (n, 3), n at least 2, and finite"
            )
        return self._remove(p, a, cutter_shape(apt), tol)

    def _remove(self, tips: Floats, axes: Floats, shape: Floats, tol: float) -> float:
        """Remove what a cutter covers on its path through poses; the volume [mm^3] that this takes."""
        taken = 0.0
        for rays in self.rays:
            lost = np.zeros(1)
            while not _dexels.cut(rays.k, rays.grid, tol, tips, axes, shape, rays.ends, rays.count, lost):
                rays.ends = np.concatenate([rays.ends, np.zeros_like(rays.ends)], axis=1)
            taken += float(lost[0] * rays.grid[2] * rays.grid[3])
        return taken / len(self.rays)


def _unit(axis: ArrayLike) -> Floats:
    a = np.asarray(axis, dtype=np.float64)
    length = float(np.linalg.norm(a))
    if a.shape != (3,) or not (math.isfinite(length) and length > 0.0):
        raise InputError(f"stock: axis {a.tolist()}: must be three numbers, not all 0")
    return a / length


def cutter_shape(apt: Sequence[float]) -> Floats:
    """Return the shape (14,) of a cutter for the kernels, from the seven numbers of APT or the eleven of a barrel."""
    d, r, e, f, alpha, beta, h = (float(x) for x in apt[:7])
    E, F, R, end = (float(x) for x in apt[7:]) if len(apt) == 11 else (e, f, 0.0, 0.5 * math.pi - beta)
    good = all(math.isfinite(x) for x in (d, r, e, f, alpha, beta, h)) and d > 0.0 and h > 0.0 and r >= 0.0
    good = good and all(math.isfinite(x) for x in (E, F)) and (R == 0.0 or r < R) and alpha <= end + 1e-12
    if not (good and min(e, alpha, beta) >= 0.0 and alpha + beta < 0.5 * math.pi):
        raise InputError(f"stock: cutter {tuple(apt)}: not the seven APT numbers of a cutter that is convex")
    m = 1.0 / math.tan(alpha) if alpha > 0.0 else 0.0
    z1, z2 = f - r * math.cos(alpha), f - r * math.cos(end)
    z3 = F - R * math.sin(beta) if R > 0.0 else z2
    tb = math.tan(beta)
    c = (E + R * math.cos(beta) if R > 0.0 else e + r * math.cos(beta)) - z3 * tb
    big = max(c + tb * h, e + r)
    return np.array([r, e, f, m, z1, z2, c, tb, h, big, R, E, F, z3])


def _grids(low: Floats, high: Floats, pitch: float, directions: str) -> list[tuple[int, Floats]]:
    """Axis and grid of each direction."""
    if not 0.0 < pitch < math.inf:
        raise InputError(f"stock.pitch = {pitch:g} mm: must be above 0")
    if not directions or len(set(directions)) != len(directions) or not set(directions) <= set("xyz"):
        raise InputError(f"stock.directions = '{directions}': must be of x, y and z")
    numbers = np.ceil((high - low) / pitch * (1.0 - 1e-12))
    sides = (high - low) / numbers
    made = []
    for k in sorted("xyz".index(c) for c in directions):
        u, v = (k + 1) % 3, (k + 2) % 3
        if numbers[u] * numbers[v] > RAY_LIMIT:
            raise InputError(f"stock.pitch = {pitch:g} mm: {numbers[u] * numbers[v]:.3g} rays: at most {RAY_LIMIT:g}")
        first = low + 0.5 * sides
        made.append((k, np.array([first[u], first[v], sides[u], sides[v], numbers[u], numbers[v]])))
    return made


def _rays_of_mesh(mesh: trimesh.Trimesh, caster: RayMeshIntersector, k: int, grid: Floats) -> Rays:
    """Rays through a mesh. A ray that does not leave it as often as it enters runs along an edge and is shifted."""
    u, v = Rays(k, grid, np.zeros((0, 1, 2)), np.zeros(0, dtype=np.int64)).places()
    n = len(u)
    low, high = mesh.bounds[:, k]
    margin = 0.01 * float(high - low) + float(grid[2])
    ends, count = np.zeros((n, 4, 2)), np.zeros(n, dtype=np.int64)
    normals = np.asarray(mesh.triangles_cross)[:, k]
    left = np.arange(n)
    for aside in range(TRIES):
        origins = np.empty((len(left), 3))
        origins[:, k] = low - margin
        origins[:, (k + 1) % 3] = u[left] + ASIDE * aside * grid[2]
        origins[:, (k + 2) % 3] = v[left] + ASIDE * aside * grid[3] * 0.7
        ahead = np.zeros((len(left), 3))
        ahead[:, k] = 1.0
        where, ray, face = caster.intersects_location(origins, ahead)
        if not len(ray):  # aside of the edge that they ran along nothing is met
            return Rays(k, grid, ends, count)
        order = np.lexsort((where[:, k], ray))
        s, ray, sense = where[order, k], ray[order], np.where(normals[face[order]] < 0.0, 1, -1)
        depth = np.cumsum(sense)
        first = np.flatnonzero(np.diff(ray, prepend=-1))
        before = np.repeat(depth[first] - sense[first], np.diff([*first, len(ray)]))
        depth -= before
        bad = np.zeros(len(left), dtype=bool)
        bad[ray[depth < 0]] = True
        bad[ray[np.append(first[1:], len(ray)) - 1][depth[np.append(first[1:], len(ray)) - 1] != 0]] = True
        good = ~bad[ray]
        enter, leave = good & (depth == 1) & (sense == 1), good & (depth == 0) & (sense == -1)
        rows = left[ray[enter]]
        at = np.arange(len(rows)) - np.repeat(*_runs(rows)) if len(rows) else rows
        if len(rows) and int(at.max()) >= ends.shape[1]:
            ends = np.concatenate([ends, np.zeros((n, int(at.max()) + 1 - ends.shape[1], 2))], axis=1)
        ends[rows, at, 0], ends[rows, at, 1] = s[enter], s[leave]
        np.add.at(count, rows, 1)
        left = left[bad]
        if not len(left):
            return Rays(k, grid, ends, count)
    raise InputError(f"stock: {len(left)} rays along {'xyz'[k]} enter the mesh more often than they leave: repair it")


def _runs(rows: Ints) -> tuple[Ints, Ints]:
    """First index and length of each run of equal numbers."""
    first = np.flatnonzero(np.diff(rows, prepend=-1))
    return first, np.diff([*first, len(rows)])
