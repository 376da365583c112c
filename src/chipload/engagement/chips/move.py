"""A five-axis move: tip and axis of the cutter as polynomials of time.

Notation: t in 0 .. 1; p(t) [mm] tip, A(t) unit axis from the tip to the spindle, B(t) any vector along it; T_k
Chebyshev polynomial of u = 2 t - 1. p = sum_k P_k T_k(u), B = sum_k B_k T_k(u), A = B / |B|: one form for every
interpolation of the axis, so that the area that is covered depends on the interpolation and the code does not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.machine.kinematics import forward
from chipload.machine.machine import Machine

Floats = NDArray[np.float64]

#: least A_z of an axis that a layer is cut with: 0.6 degrees above the layer
LEAST_AXIS_Z = 0.01
#: most a fitted move may be off [mm] and [rad]
FIT = 1e-10
_ORDERS = (4, 8, 16, 32)
_REMEDY = "split the move"
_ORDER = np.arange(26)
_JACOBI_ANGER = np.where(_ORDER == 0, 1.0, 2.0) * np.where(_ORDER // 2 % 2 == 0, 1.0, -1.0)


@dataclass(frozen=True, eq=False)
class Move:
    """Tip and axis of a cutter over one move.

    Parameters
    ----------
    tip : (n, 3) float [mm], P_k
    axis : (m, 3) float, B_k, of any length

    Raises
    ------
    InputError
        A number is not finite, or A_z is somewhere below ``LEAST_AXIS_Z``.
    """

    tip: Floats
    axis: Floats

    def __post_init__(self) -> None:
        for name in ("tip", "axis"):
            c = np.ascontiguousarray(getattr(self, name), dtype=np.float64)
            if c.ndim != 2 or c.shape[1] != 3 or len(c) == 0 or not np.isfinite(c).all():
                raise InputError(f"move.{name} {c.shape}: must be (n, 3) finite coefficients, n >= 1")
            c.setflags(write=False)
            object.__setattr__(self, name, c)
        low = _least_z(self.axis)
        if not low >= LEAST_AXIS_Z:
            raise InputError(
                f"move: the axis has A_z = {low:.4g} somewhere: must be at least {LEAST_AXIS_Z:g}, "
                "above the layer: cut the part by layers in another direction"
            )

    def at(self, t: ArrayLike) -> tuple[Floats, Floats]:
        """Return tip (n, 3) [mm] and unit axis (n, 3) at the times t (n,).

        >>> Move.lerp([0, 0, 0], [0, 0, 1], [4, 0, 0], [0, 0, 1]).at([0.25])[0].tolist()
        [[1.0, 0.0, 0.0]]
        """
        u = 2.0 * np.asarray(t, dtype=np.float64) - 1.0
        b = chebyshev.chebval(u, self.axis).T
        tip = np.asarray(chebyshev.chebval(u, self.tip).T, dtype=np.float64)
        return tip, np.asarray(b / np.linalg.norm(b, axis=1)[:, None])

    def rates(self, t: ArrayLike) -> tuple[Floats, Floats]:
        """Return the rates p' (n, 3) [mm] and A' (n, 3), per unit of t."""
        u = 2.0 * np.asarray(t, dtype=np.float64) - 1.0
        b, db = chebyshev.chebval(u, self.axis).T, 2.0 * chebyshev.chebval(u, chebyshev.chebder(self.axis)).T
        length = np.linalg.norm(b, axis=1)[:, None]
        a = b / length
        db = db / length
        rate = 2.0 * np.asarray(chebyshev.chebval(u, chebyshev.chebder(self.tip)).T, dtype=np.float64)
        return rate, np.asarray(db - a * (a * db).sum(1)[:, None])

    @staticmethod
    def lerp(p0: ArrayLike, a0: ArrayLike, p1: ArrayLike, a1: ArrayLike) -> Move:
        """Tip and axis vector straight from start to end, the vector normalised: as controllers of tool vectors do."""
        (p0, p1), (a0, a1) = (_three("tip", p0), _three("tip", p1)), (_unit(a0), _unit(a1))
        return Move(np.array([p0 + p1, p1 - p0]) / 2.0, np.array([a0 + a1, a1 - a0]) / 2.0)

    @staticmethod
    def upright(p0: Floats, p1: Floats) -> Move:
        """Return :meth:`lerp` between two tips (3,) [mm], known to be finite, with an upright axis.

        >>> Move.upright(np.zeros(3), np.array([4.0, 0.0, 0.0])).at([0.25])[0].tolist()
        [[1.0, 0.0, 0.0]]
        """
        # known to be valid: to check it took most of the time of a move
        out, tip = object.__new__(Move), np.array([p0 + p1, p1 - p0]) / 2.0
        tip.setflags(write=False)
        object.__setattr__(out, "tip", tip)
        object.__setattr__(out, "axis", _UPRIGHT)
        return out

    @staticmethod
    def slerp(p0: ArrayLike, a0: ArrayLike, p1: ArrayLike, a1: ArrayLike) -> Move:
        """Return a move with a straight tip path and the axis at a constant rate in the plane of both directions."""
        (p0, p1), (a0, a1) = (_three("tip", p0), _three("tip", p1)), (_unit(a0), _unit(a1))
        angle = 2.0 * math.atan2(float(np.linalg.norm(a1 - a0)), float(np.linalg.norm(a1 + a0)))
        middle, across = a0 + a1, a1 - a0
        if angle == 0.0:
            return Move.lerp(p0, a0, p1, a1)
        middle, across = middle / np.linalg.norm(middle), across / np.linalg.norm(across)
        # cos and sin of u angle / 2 in Chebyshev polynomials (Jacobi and Anger)
        size = scipy.special.jv(_ORDER, 0.5 * angle) * _JACOBI_ANGER
        axis = size[:, None] * np.where(_ORDER[:, None] % 2 == 0, middle, across)
        return Move(np.array([p0 + p1, p1 - p0]) / 2.0, _short(axis))

    @staticmethod
    def machine_linear(
        machine: Machine,
        axes0: ArrayLike,
        axes1: ArrayLike,
        tool_length: float = 0.0,
        work_zero: ArrayLike | None = None,
    ) -> Move:
        """Return a move with every machine axis at a constant rate, as G1 without tool centre point control.

        Parameters
        ----------
        axes0, axes1 : (9,) float [mm, rad]
            X Y Z A B C U V W at start and end.
        tool_length : float [mm], work_zero : (3,) float [mm]
            As in :func:`chipload.machine.kinematics.forward`.
        """
        q0, q1 = (np.asarray(q, dtype=np.float64) for q in (axes0, axes1))
        if q0.shape != (9,) or q1.shape != (9,):
            raise InputError(f"machine_linear: axes {q0.shape} and {q1.shape}: must be (9,): X Y Z A B C U V W")
        return Move.of(lambda t: forward(machine, q0 + t[:, None] * (q1 - q0), tool_length, work_zero))

    @staticmethod
    def of(function: Callable[[Floats], tuple[Floats, Floats]]) -> Move:
        """A move by Chebyshev interpolation of ``function`` (t (n,) -> tip (n, 3), axis (n, 3)).

        Raises
        ------
        InputError
            Polynomials of order 32 are off by more than ``FIT`` [mm, rad] between their points.
        """
        miss = math.inf
        for order in _ORDERS:
            u, back, between = _NODES[order]
            tip, axis = (np.asarray(x, dtype=np.float64) for x in function(0.5 * (u + 1.0)))
            P, B = back @ tip, back @ axis
            want_p, want_a = function(0.5 * (between + 1.0))
            got_p, got_a = chebyshev.chebval(between, P).T, chebyshev.chebval(between, B).T
            miss = max(float(np.abs(got_p - want_p).max()), float(np.abs(got_a - want_a).max()))
            if miss <= FIT:
                return Move(_short(P), _short(B))
        raise InputError(f"move: polynomials of order 32 are off by {miss:.3g}: must be within {FIT:g} mm: {_REMEDY}")


_UPRIGHT: Floats = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
_UPRIGHT.setflags(write=False)


def _nodes(order: int) -> tuple[Floats, Floats, Floats]:
    u: Floats = np.cos(np.pi * (np.arange(order + 1) + 0.5) / (order + 1))
    back = 2.0 / (order + 1) * np.asarray(chebyshev.chebvander(u, order).T, dtype=np.float64)
    back[0] *= 0.5
    between: Floats = np.cos(np.pi * np.arange(order + 2) / (order + 1))
    return u, back, between


_NODES = {order: _nodes(order) for order in _ORDERS}


def _short(c: Floats) -> Floats:
    """Without last coefficients that together matter less than rounding of the greatest."""
    tail = np.cumsum(np.abs(c).max(1)[::-1])[::-1]
    return c[: max(1, int((tail > 1e-15 * tail[0]).sum()))]


def _least_z(axis: Floats) -> float:
    """Least A_z of coefficients, or a bound below it that is enough; of two of them (a great arc), that of an end."""
    most, rest = float(np.linalg.norm(axis, axis=1).sum()), float(np.abs(axis[1:, 2]).sum())
    if float(axis[0, 2]) - rest >= LEAST_AXIS_Z * most > 0.0:
        return LEAST_AXIS_Z  # by the coefficients alone
    u = np.array([-1.0, 1.0]) if len(axis) <= 2 else _FINE
    b = chebyshev.chebval(u, axis).T
    length = np.linalg.norm(b, axis=1)
    return float((b[:, 2] / length).min()) if (length > 0.0).all() else -math.inf


_FINE = np.cos(np.linspace(0.0, np.pi, 129))


def _three(name: str, v: ArrayLike) -> Floats:
    out = np.asarray(v, dtype=np.float64)
    if out.shape != (3,) or not np.isfinite(out).all():
        raise InputError(f"move: {name} {out.tolist()}: must be three finite numbers")
    return out


def _unit(v: ArrayLike) -> Floats:
    out = _three("axis", v)
    length = float(np.linalg.norm(out))
    if not length > 1e-6:
        raise InputError(f"move: axis {out.tolist()}: must have a length above 0")
    return out / length
