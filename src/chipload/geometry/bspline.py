"""B-spline surfaces (tensor products) through a grid of points, with normals and curvatures.

Notation: S(u, v) = sum of N_i(u) M_j(v) P_ij with basis functions N, M of degrees p, q over knots in 0..1, P_ij control
points [mm]. E, F, G and L, M, N first and second fundamental form; K curvature tensor in space (3, 3) [1/mm],
K = J I^-1 II I^-1 J^T with J = (S_u, S_v): t K t is the normal curvature along a unit tangent t, positive where the
surface bends towards its normal.

Reference: [Piegl1997] ch. 2, 9.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import LateModule, scipy

_bspline = LateModule("chipload.geometry._bspline")

Floats = NDArray[np.float64]

_NO_NORMAL = "patch: no normal where S_u and S_v are parallel: exclude that edge"


class LocalShape(NamedTuple):
    """A surface near k points of it.

    Parameters
    ----------
    points, normals : S [mm], unit normals (k, 3)
    curvatures : K (k, 3, 3) [1/mm]
    tangents : S_u and S_v (2, k, 3) [mm]
    """

    points: Floats
    normals: Floats
    curvatures: Floats
    tangents: Floats


@dataclass(frozen=True, eq=False)
class BSplinePatch:
    """A B-spline surface over the unit square.

    Parameters
    ----------
    knots_u, knots_v : (n + p + 1,), (m + q + 1,) float, ascending; the end knots are repeated p + 1 and q + 1 times
    control : control points P, (n, m, 3) float [mm]
    side : 1 or -1; the normal has the direction of ``side`` S_u x S_v

    Raises
    ------
    InputError
        ``control`` has another shape, or ``side`` another value.
    """

    knots_u: Floats
    knots_v: Floats
    control: Floats
    side: int = 1

    def __post_init__(self) -> None:
        for name in ("knots_u", "knots_v", "control"):
            value = np.array(getattr(self, name), dtype=np.float64)
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        if self.control.ndim != 3 or self.control.shape[2] != 3 or self.side not in (1, -1):
            raise InputError(
                f"patch: control points {self.control.shape}, side {self.side}: must be (n, m, 3), 1 or -1"
            )

    @property
    def degrees(self) -> tuple[int, int]:
        """Degrees (p, q) in u and v."""
        n, m = self.control.shape[:2]
        return len(self.knots_u) - n - 1, len(self.knots_v) - m - 1

    def at(self, u: ArrayLike, v: ArrayLike, du: int = 0, dv: int = 0) -> Floats:
        """Points, or derivatives of order ``du`` in u and ``dv`` in v, each in 0..2.

        Parameters
        ----------
        u, v : (k,) float in 0..1

        Returns
        -------
        (k, 3) float [mm]

        Raises
        ------
        InputError
            A parameter is outside the range of the knots.
        """
        a, b = np.broadcast_arrays(np.asarray(u, dtype=np.float64), np.asarray(v, dtype=np.float64))
        p, q = self.degrees
        x, y = a.ravel(), b.ravel()
        _require_within(self.knots_u, p, x)
        _require_within(self.knots_v, q, y)
        out = np.empty((len(x), 3))
        _bspline.points_of(self.knots_u, self.knots_v, self.control, p, q, x, y, du, dv, out)
        return out

    def normal(self, u: ArrayLike, v: ArrayLike) -> Floats:
        """Unit normals (k, 3).

        Raises
        ------
        InputError
            S_u and S_v are parallel or 0 there.
        """
        return self.facing(u, v)[1]

    def facing(self, u: ArrayLike, v: ArrayLike) -> tuple[Floats, Floats]:
        """Points [mm] and unit normals (k, 3): in a third of the time of :meth:`at` and derivatives.

        Raises
        ------
        InputError
            S_u and S_v are parallel or 0 there.
        """
        a, b = np.broadcast_arrays(np.asarray(u, dtype=np.float64), np.asarray(v, dtype=np.float64))
        p, q = self.degrees
        x, y = a.ravel(), b.ravel()
        _require_within(self.knots_u, p, x)
        _require_within(self.knots_v, q, y)
        points, normals = np.empty((len(x), 3)), np.empty((len(x), 3))
        if not _bspline.facing_of(
            self.knots_u, self.knots_v, self.control, self.side, p, q, x, y, points, normals
        ):  # fmt: skip
            raise InputError(_NO_NORMAL)
        return points, normals

    def shape(self, u: ArrayLike, v: ArrayLike) -> LocalShape:
        """Points, normals, curvature tensors and tangents: as the other methods, in less time.

        Raises
        ------
        InputError
            A parameter is outside the range of the knots, or S_u and S_v are parallel or 0 there.

        Examples
        --------
        >>> flat = patch_through([[[0, 0, 0], [0, 2, 0]], [[3, 0, 0], [3, 2, 0]]], [0, 1], [0, 1])
        >>> shape = flat.shape(0.5, 0.5)
        >>> shape.points.tolist(), shape.normals.tolist(), shape.tangents[:, 0].tolist()
        ([[1.5, 1.0, 0.0]], [[0.0, 0.0, 1.0]], [[3.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
        """
        a, b = np.broadcast_arrays(np.asarray(u, dtype=np.float64), np.asarray(v, dtype=np.float64))
        p, q = self.degrees
        x, y = a.ravel(), b.ravel()
        _require_within(self.knots_u, p, x)
        _require_within(self.knots_v, q, y)
        points, N, tangents, bends = (np.empty((*size, len(x), 3)) for size in ((), (), (2,), (3,)))
        if not _bspline.shape_of(
            self.knots_u, self.knots_v, self.control, self.side, p, q, x, y, points, N, tangents, bends
        ):  # fmt: skip
            raise InputError(_NO_NORMAL)
        J = np.stack([tangents[0], tangents[1]], axis=-1)
        second = [np.einsum("kd,kd->k", one, N) for one in bends]
        II = np.stack([np.stack(second[:2], axis=-1), np.stack(second[1:], axis=-1)], axis=-2)
        A = np.linalg.solve(np.swapaxes(J, 1, 2) @ J, np.swapaxes(J, 1, 2))
        return LocalShape(points, N, np.swapaxes(A, 1, 2) @ II @ A, tangents)

    def curvature(self, u: ArrayLike, v: ArrayLike) -> Floats:
        """Curvature tensors K (k, 3, 3) [1/mm], positive towards :meth:`normal`."""
        return self.shape(u, v).curvatures

    def principal(self, u: ArrayLike, v: ArrayLike) -> Floats:
        """Principal curvatures (k, 2) [1/mm], ascending."""
        K, N = self.curvature(u, v), self.normal(u, v)
        # in the plane across N: the third eigenvalue of K is 0 along N
        other = np.eye(3)[np.abs(N).argmin(axis=1)]
        a = np.cross(N, other)
        a /= np.linalg.norm(a, axis=1)[:, None]
        b = np.cross(N, a)
        k11, k12, k22 = (np.einsum("ki,kij,kj->k", x, K, y) for x, y in ((a, a), (a, b), (b, b)))
        mean, spread = 0.5 * (k11 + k22), np.hypot(0.5 * (k11 - k22), k12)
        return np.stack([mean - spread, mean + spread], axis=-1)

    def turned(self, angle: float) -> BSplinePatch:
        """The patch rotated about z by an angle [rad]."""
        c, s = np.cos(angle), np.sin(angle)
        return replace(self, control=self.control @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))

    def rotated(self, R: Floats) -> BSplinePatch:
        """The patch rotated by a matrix R (3, 3)."""
        return replace(self, control=self.control @ R.T)

    def swapped(self) -> BSplinePatch:
        """The same surface, with the same normal, with u and v exchanged."""
        return BSplinePatch(self.knots_v, self.knots_u, np.swapaxes(self.control, 0, 1), -self.side)

    def reversed(self, u: bool, v: bool) -> BSplinePatch:
        """The same surface, with the same normal, with u, v or both reversed.

        >>> flat = patch_through([[[0, 0, 0], [0, 2, 0]], [[3, 0, 0], [3, 2, 0]]], [0, 1], [0, 1])
        >>> flat.reversed(True, False).at(0.0, 1.0).tolist()
        [[3.0, 2.0, 0.0]]
        """
        return BSplinePatch(
            1.0 - self.knots_u[::-1] if u else self.knots_u,
            1.0 - self.knots_v[::-1] if v else self.knots_v,
            self.control[:: -1 if u else 1, :: -1 if v else 1],
            self.side if u == v else -self.side,
        )


def _require_within(knots: Floats, degree: int, x: Floats) -> None:
    """Refuse parameters outside the range of the knots."""
    if (x < knots[degree]).any() or (x > knots[-degree - 1]).any():
        raise InputError(f"patch: parameter out of {knots[degree]:g}..{knots[-degree - 1]:g}")


def basis(knots: Floats, degree: int, x: Floats, derivative: int = 0) -> tuple[NDArray[np.int64], Floats]:
    """First index (k,) of the basis functions that are not 0 at x (k,); their values or derivatives (k, degree + 1).

    >>> first, N = basis(np.array([0.0, 0.0, 1.0, 1.0]), 1, np.array([0.25]))
    >>> N.tolist()
    [[0.75, 0.25]]
    """
    _require_within(knots, degree, x)
    count = len(knots) - degree - 1
    span = np.clip(np.searchsorted(knots, x, side="right") - 1, degree, count - 1)
    values = np.ones((len(x), 1))
    for d in range(1, degree + 1):
        low, high = knots[span[:, None] + np.arange(1 - d, 1)], knots[span[:, None] + np.arange(1, d + 1)]
        raised = np.zeros((len(x), d + 1))
        if d > degree - derivative:
            part = d * values / (high - low)
            raised[:, :-1] -= part
        else:
            part = values / (high - low)
            raised[:, :-1] += part * (high - x[:, None])
            part = part * (x[:, None] - low)
        raised[:, 1:] += part
        values = raised
    return span - degree, values if derivative <= degree else np.zeros_like(values)


def patch_through(
    points: ArrayLike, u: ArrayLike, v: ArrayLike, degrees: tuple[int, int] = (3, 3), side: int = 1
) -> BSplinePatch:
    """The patch through a grid of points (n, m, 3) [mm] at the parameters u (n,), v (m,), each from 0 to 1.

    A degree is lowered to the number of points less one.

    Raises
    ------
    InputError
        The parameters do not ascend from 0 to 1, or there are fewer than two in u or in v.
    """
    grid = np.asarray(points, dtype=np.float64)
    a, b = np.asarray(u, dtype=np.float64), np.asarray(v, dtype=np.float64)
    for name, x, size in (("u", a, grid.shape[0]), ("v", b, grid.shape[1])):
        ok = len(x) == size and size >= 2 and x[0] == 0.0 and x[-1] == 1.0 and (np.diff(x) > 0.0).all()
        if not ok:
            raise InputError(f"patch.{name}: must ascend from 0 to 1, one for each of {size} points, at least two")
    p, q = min(degrees[0], len(a) - 1), min(degrees[1], len(b) - 1)
    first = scipy.interpolate.make_interp_spline(a, grid, k=p, axis=0)
    second = scipy.interpolate.make_interp_spline(b, first.c, k=q, axis=1)
    # the first axis of the coefficients is that of v
    return BSplinePatch(first.t, second.t, np.swapaxes(second.c, 0, 1), side)
