"""Cuts in the form that the stability kernels need: tooth engagement, force coefficients, speed, modes.

Notation: as in :mod:`chipload.stability._directional`. On a slice whose outward normal makes the angle kappa
with the axis, a displacement r across the axis changes the chip thickness by sin(kappa) u.r, and the force across the
axis is -dFt e - (sin(kappa) dFr + cos(kappa) dFa) u. So kt = sin(kappa) Ktc, kr = sin(kappa)^2 Krc,
ka = sin(kappa) cos(kappa) Kac; with an exponent m each is (1 - m) times that at a thickness of 1 mm, the slope of the
force at the nominal thickness. Edge forces do not depend on the thickness. In two directions thrust is rigid, see
:mod:`chipload.stability._several_delays` for three. Each tooth cuts what the one before it left, but for runout: see
:mod:`chipload.stability.delays`.

Reference: [Altintas1995]; [Engin2001] for kappa.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.errors import InputError
from chipload.stability.delays import engagement_of_teeth
from chipload.stability.modes import Modes
from chipload.stability.process_damping import ProcessDamping

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def no_rows() -> Floats:
    """Return kernel rows without process damping."""
    return np.zeros((0, 11))


@dataclass(frozen=True, eq=False)
class DynamicCuts:
    """Tooth engagement, force coefficients, speeds and modes of n cuts by one cutter.

    Parameters
    ----------
    start : (n + 1,) int; the rows of cut i are start[i] .. start[i + 1] - 1
    rows : (b, 11) float, or (b, 13) with three directions, as the kernels take them
    exponents : (3,) float, of the size effect
    period : (n,) float [s], time between two teeth
    pitch : angle between two teeth [rad]
    damping : (M,) float, damping ratio of each mode of cutter and work
    omega : (n, M) float [rad/s], natural frequencies in each cut
    U : (n, d, M) float [1/sqrt(t)], shapes along T and n of each cut, with d = 3 also along A
    damped : (b, 11) float, as :meth:`chipload.stability.process_damping.ProcessDamping.rows`; (0, 11): none
    pitches : (N,) angles [rad] of each tooth to the one before it; empty: all are ``pitch``
    delay : (b,) float [rad], the spindle turns by it between the tooth of a row and the one whose surface it cuts, and
        the lag of the row is that of its own tooth; empty: every tooth has all rows, and cuts what the one before left
    """

    start: Ints
    rows: Floats
    exponents: Floats
    period: Floats
    pitch: float
    damping: Floats
    omega: Floats
    U: Floats
    damped: Floats = field(default_factory=no_rows)
    pitches: tuple[float, ...] = ()
    delay: Floats = field(default_factory=lambda: np.zeros(0))

    def __len__(self) -> int:
        return len(self.period)

    @property
    def uneven(self) -> bool:
        """Whether teeth differ by pitch or runout."""
        return bool(self.pitches) or len(self.delay) > 0

    @property
    def several(self) -> bool:
        """Whether the map has several delays or three directions."""
        return self.uneven or self.U.shape[1] == 3

    def at_speeds(self, period: ArrayLike) -> DynamicCuts:
        """Return the same cuts with other times between two teeth [s]."""
        times = np.array(np.broadcast_to(np.asarray(period, dtype=np.float64), (len(self),)))
        if not ((times > 0.0) & np.isfinite(times)).all():
            raise InputError("stability: the time between two teeth must be above 0 s")
        return replace(self, period=times)

    def chosen(self, index: ArrayLike) -> DynamicCuts:
        """Return some of the cuts; a cut may be chosen several times."""
        at = np.asarray(index, dtype=np.int64).ravel()
        size = np.diff(self.start)[at]
        start = np.concatenate([[0], np.cumsum(size)])
        row = np.repeat(self.start[at] - start[:-1], size) + np.arange(start[-1])
        period, omega, U = (np.ascontiguousarray(x[at]) for x in (self.period, self.omega, self.U))
        rows = np.ascontiguousarray(self.rows[row])
        damped, delay = (np.ascontiguousarray(x[row]) if len(x) else x for x in (self.damped, self.delay))
        return replace(self, start=start, rows=rows, period=period, omega=omega, U=U, damped=damped, delay=delay)

    def with_modes(self, damping: ArrayLike, omega: ArrayLike, U: ArrayLike) -> DynamicCuts:
        """Return the same cuts with further modes: (m,) damping ratios, (n, m) [rad/s], (n, d, m) [1/sqrt(t)]."""
        more = tuple(np.asarray(x, dtype=np.float64) for x in (damping, omega, U))
        z = np.concatenate([self.damping, more[0]])
        w, shapes = np.concatenate([self.omega, more[1]], axis=1), np.concatenate([self.U, more[2]], axis=2)
        return replace(self, damping=z, omega=w, U=np.ascontiguousarray(shapes))


def join_dynamic_cuts(some: Sequence[DynamicCuts]) -> DynamicCuts:
    """Return cuts of one cutter with the same modes joined in order."""
    sizes = np.concatenate([np.diff(c.start) for c in some])
    start = np.concatenate([[0], np.cumsum(sizes)])
    names = ("rows", "period", "omega", "U", "damped", "delay")
    rows, period, omega, U, damped, delay = (np.concatenate([getattr(c, name) for c in some]) for name in names)
    return replace(some[0], start=start, rows=rows, period=period, omega=omega, U=U, damped=damped, delay=delay)


def dynamic_cuts(
    engagement: ToothEngagement,
    cutter: Cutter,
    material: Material,
    modes: Modes | None,
    speed: ArrayLike,
    T: ArrayLike | None = None,
    n: ArrayLike | None = None,
    process: ProcessDamping | None = None,
    *,
    A: ArrayLike | None = None,
    directions: int | None = None,
) -> DynamicCuts:
    """Return the cuts of a cutter at their speeds for the stability kernels.

    Parameters
    ----------
    engagement : without runout, of evenly spaced teeth; runout and the pitches of others are those of the cutter
    modes : None: cutter and work are rigid, as far as no modes are added
    speed : () or (n,) float [rad/s], of the spindle, either sign
    T, n : (n, 2) float, in x and y of the machine; None: those of ``engagement.frame``
    process : damping by worn edges; None: left out
    A : (n, 3) float, axis from the tip to the holder in the machine; T and n then have three columns as well. None: z
    directions : 2: thrust is rigid, 3: cutter and work move along the axis as well; None: 3 where a mode does

    Raises
    ------
    InputError
        The spindle stands, teeth are listed one by one, there is no frame, or modes along the axis meet a thrust that
        is rigid.
    """
    if (engagement.tooth >= 0).any():
        raise InputError("stability: tooth engagement of single teeth: give the engagement without runout")
    omega = np.abs(np.broadcast_to(np.asarray(speed, dtype=np.float64), (len(engagement),)))
    if not ((omega > 0.0) & np.isfinite(omega)).all():
        raise InputError("stability: a spindle speed of 0: must be above 0 rad/s")
    if T is None or n is None:
        if engagement.frame is None:
            raise InputError("stability: the tooth engagement has no frames: give T and n")
        T, n, A = engagement.frame[:, 0], engagement.frame[:, 1], engagement.frame[:, 2]
    count = directions or (3 if modes is not None and modes.axial else 2)
    if count == 2 and modes is not None and modes.axial:
        raise InputError("stability: a mode along the axis with a rigid thrust: ask for 3 directions")
    if modes is None:
        U, damping, w = np.zeros((len(np.asarray(T)), count, 0)), np.zeros(0), np.zeros(0)
    else:
        U, damping, w = modes.in_frames(T, n, A, directions=count), modes.damping, modes.omega
    if len(U) != len(engagement):
        raise InputError(f"stability: {len(U)} frames for {len(engagement)} cuts: need one each")
    pitches, delay, each = cutter.pitch, np.zeros(0), engagement
    tooth = np.zeros(len(engagement.rows), dtype=np.int64)
    if cutter.flutes > 1 and cutter.runout[0] != 0.0:
        each, delay = engagement_of_teeth(engagement, cutter)
        pitches, tooth = (), np.array(each.tooth)
    rows = kernel_rows(each, material, directions=count)
    rows[:, 2:4] += (math.tau / cutter.flutes * tooth)[:, None]
    return DynamicCuts(
        np.array(each.start), rows, np.array(material.exponents, dtype=np.float64),
        np.ascontiguousarray(math.tau / (cutter.flutes * omega)), math.tau / cutter.flutes, damping,
        np.tile(w, (len(U), 1)), U, no_rows() if process is None else process.rows(each, rows), pitches, delay,
    )  # fmt: skip


def kernel_rows(engagement: ToothEngagement, material: Material, directions: int = 2) -> Floats:
    """(b, 11) float: phi from and to, lag at both ends, length, kt, kr, ka, along, across, offset; with three
    directions (b, 13): kt, kr and ka are those of the edge itself, and sin(kappa) and cos(kappa) follow.
    """
    own = engagement.slices[engagement.slice]
    low, high, s_from, s_to, along, offset, across = engagement.rows.T
    sine, cosine, lag, rate = own[:, 3], own[:, 4], own[:, 5], own[:, 6]
    kt, kr, ka = ((1.0 - m) * k for m, k in zip(material.exponents, material.coefficients[:3], strict=True))
    first = lag + rate * (s_from - own[:, 0])
    length = s_to - s_from
    slopes = [kt * sine, kr * sine**2, ka * sine * cosine]
    if directions == 3:
        slopes = [np.full(len(sine), k) for k in (kt, kr, ka)]
    columns = [low, high, first, first + rate * length, length, *slopes, along, across, offset]
    return np.ascontiguousarray(np.column_stack([*columns, sine, cosine] if directions == 3 else columns))
