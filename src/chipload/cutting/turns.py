"""Measured steady cuts, and the spindle speed, harmonics and extremes of their whole turns.

Notation: T unit feed direction, n across it, as in :mod:`chipload.cutting.force`; Omega [rad/s] spindle speed; k
harmonic of the spindle; c_k complex amplitude: F(t) = c_0 + 2 Re(sum over k of c_k exp(i k Omega t)), t from the first
sample.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.lazy import scipy

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


#: blocks of whole turns of a cut, whose harmonics are compared
BLOCKS = 12
#: rotations at which the peak of some harmonics is sought
PEAK_SAMPLES = 360


@dataclass(frozen=True, eq=False)
class MeasuredCut:
    """A steady cut that was measured.

    Parameters
    ----------
    name : as messages call it
    rate : samples a second [Hz], above 0
    force : (n, 3) float [N], on the cutter along T, n and the axis; a column of NaN was not measured
    feed : of the cutter's centre [mm/s], above 0
    speed : of the spindle, nominal [rad/s], above 0
    arc : (from, to) engaged immersion [rad], within 0 .. pi; a slot is (0, pi)
    depth : axial depth [mm]

    Raises
    ------
    InputError
        A number is out of range, a column is measured in part, or the window holds less than one turn.
    """

    name: str
    rate: float
    force: Floats
    feed: float
    speed: float
    arc: tuple[float, float]
    depth: float

    def __post_init__(self) -> None:
        force = np.array(self.force, dtype=np.float64)
        for key, value in (("feed_mm_min", self.feed * 60.0), ("rate_hz", self.rate), ("speed", self.speed)):
            if not 0.0 < value < math.inf:
                raise InputError(f"{self.name}: {key} = {value:g}: must be above 0")
        if force.ndim != 2 or force.shape[1] != 3:
            raise InputError(f"{self.name}: force of shape {force.shape}: must be (n, 3)")
        missing = np.isnan(force)
        if (missing.any(axis=0) & ~missing.all(axis=0)).any() or np.isinf(force).any():
            raise InputError(f"{self.name}: samples are missing within the window: choose a window without gaps")
        if missing.all():
            raise InputError(f"{self.name}: no channel is measured: name at least one")
        turn = self.rate * math.tau / self.speed
        if len(force) < turn or turn < 4.0:
            raise InputError(
                f"{self.name}: {len(force)} samples, {turn:.4g} in a turn: needs a whole turn, and 4 samples in it: "
                "choose a longer window or a higher rate"
            )
        force.setflags(write=False)
        object.__setattr__(self, "force", force)

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Mask (3,) of the components along T, n and the axis that were measured."""
        return np.asarray(~np.isnan(self.force[0]))

    def feed_per_tooth(self, flutes: int) -> float:
        """Feed per tooth f_z [mm] = feed / (Omega / (2 pi) N).

        >>> cut = MeasuredCut("c", 100.0, np.zeros((200, 3)), 10.0, math.tau * 5.0, (0.0, math.pi), 1.0)
        >>> cut.feed_per_tooth(2)
        1.0
        """
        return self.feed * math.tau / (self.speed * flutes)


@dataclass(frozen=True, eq=False)
class Turns:
    """Speed, harmonics and extremes of the whole turns of a cut.

    ``speed`` [rad/s] that was found; ``amplitude`` (H + 1, 3) complex [N], c_k; ``mean``, ``high`` and ``low`` (r, 3)
    [N] of each turn; ``plane`` (r,) [N] greatest in-plane force of each turn; ``scatter`` (3,) [N] standard deviation
    of the samples about the harmonics; ``blocks`` (B, H + 1, 3) complex [N], by how much c_k of each block of whole
    turns differs, B at most :data:`BLOCKS`. NaN: not measured.
    """

    speed: float
    amplitude: Complexes
    mean: Floats
    high: Floats
    low: Floats
    plane: Floats
    scatter: Floats
    blocks: Complexes


def turns_of(cut: MeasuredCut, harmonics: int, search: float = 0.01, seek: int = 8) -> Turns:
    """Return spindle speed, harmonics and extremes of the whole turns of a cut.

    Parameters
    ----------
    harmonics : H, at least 1 and below half the samples of a turn
    search : part of the nominal speed within which the speed is sought; 0: the nominal speed is exact
    seek : the speed is that at which the harmonics up to this one contain the most power

    Raises
    ------
    InputError
        The samples cannot resolve so many harmonics.
    """
    given = np.flatnonzero(cut.measured)
    force = cut.force[:, given] - cut.force[:, given].mean(axis=0)
    speed = cut.speed
    most = math.ceil(math.pi * cut.rate / (cut.speed * (1.0 + search))) - 1
    if not 1 <= harmonics <= most:
        raise InputError(f"{cut.name}: {harmonics} harmonics: must be from 1 to {most}, below half the sampling rate")
    if search > 0.0:
        speed = _speed(force, cut.rate, cut.speed, search, min(seek, most))
    turn = math.tau * cut.rate / speed
    count = int(len(force) / turn + 1e-9)
    edges = np.round(np.arange(count + 1) * turn).astype(int)
    whole = cut.force[: edges[-1], given]
    basis = np.exp(1j * speed / cut.rate * np.outer(np.arange(len(whole)), np.arange(1, harmonics + 1)))
    design = np.column_stack([np.ones(len(whole)), 2.0 * basis.real, -2.0 * basis.imag])
    # nearly orthogonal columns: the normal equations lose nothing
    x = np.linalg.solve(design.T @ design, design.T @ whole)
    left = whole - design @ x
    amplitude = np.full((harmonics + 1, 3), np.nan, dtype=np.complex128)
    amplitude[0, given] = x[0]
    amplitude[1:, given] = x[1 : harmonics + 1] + 1j * x[harmonics + 1 :]
    mean, high, low = (np.full((count, 3), np.nan) for _ in range(3))
    for i, (a, b) in enumerate(pairwise(edges)):
        part = whole[a:b]
        mean[i, given], high[i, given], low[i, given] = part.mean(axis=0), part.max(axis=0), part.min(axis=0)
    plane = np.array([np.hypot(*cut.force[a:b, :2].T).max() for a, b in pairwise(edges)])
    scatter = np.full(3, np.nan)
    scatter[given] = np.sqrt(np.sum(left**2, axis=0) / max(len(whole) - design.shape[1], 1))
    blocks = np.full((min(BLOCKS, count), harmonics + 1, 3), np.nan, dtype=np.complex128)
    turned = np.concatenate([np.ones((len(whole), 1)), np.conj(basis)], axis=1)
    ends = edges[np.round(np.linspace(0, count, len(blocks) + 1)).astype(int)]
    for i, (a, b) in enumerate(pairwise(ends)):
        blocks[i, :, given] = (turned[a:b].T @ left[a:b] / (b - a)).T
    return Turns(speed, amplitude, mean, high, low, plane, scatter, blocks)


def peaks_in_band(cut: MeasuredCut, turns: Turns, harmonics: int) -> Floats:
    """Return the greatest size (r, 4) [N] of the first ``harmonics`` of each whole turn: along T, n and the axis, and
    in the plane of T and n; NaN: not measured.
    """
    turn = math.tau * cut.rate / turns.speed
    edges = np.round(np.arange(len(turns.mean) + 1) * turn).astype(int)
    theta = np.linspace(0.0, math.tau, PEAK_SAMPLES, endpoint=False)
    shown = _waves(theta, harmonics)
    out = np.full((len(turns.mean), 4), np.nan)
    for i, (a, b) in enumerate(pairwise(edges)):
        design = _waves(turns.speed / cut.rate * np.arange(b - a), harmonics)
        given = np.flatnonzero(cut.measured)
        force = np.full((PEAK_SAMPLES, 3), np.nan)
        force[:, given] = shown @ np.linalg.lstsq(design, cut.force[a:b, given], rcond=None)[0]
        out[i, :3] = np.abs(force).max(axis=0)
        out[i, 3] = np.hypot(force[:, 0], force[:, 1]).max()
    return out


def _waves(theta: Floats, harmonics: int) -> Floats:
    """Return 1, cosines and sines (m, 2 H + 1) of the harmonics at rotations (m,)."""
    turned = np.outer(theta, np.arange(1, harmonics + 1))
    return np.column_stack([np.ones(len(theta)), np.cos(turned), np.sin(turned)])


def _speed(force: Floats, rate: float, nominal: float, search: float, top: int) -> float:
    """Return the speed at which harmonics 1 .. top have most power: on bins of a padded transform, then between."""
    n = len(force)
    size = 8 * 2 ** math.ceil(math.log2(n))
    power = np.sum(np.abs(np.fft.rfft(force, size, axis=0)) ** 2, axis=1)
    line = math.tau * rate / size
    step = line / (2.0 * top)
    reach = math.ceil(search * nominal / step)
    tried = nominal + np.arange(-reach, reach + 1) * step
    k = np.arange(1, top + 1)
    at = np.minimum(np.rint(np.outer(tried, k) / line).astype(int), len(power) - 1)
    best = float(tried[int(np.argmax(power[at].sum(axis=1)))])
    t = np.arange(n) / rate
    heard = force.astype(np.complex128)

    def negative_power(w: float) -> float:
        """Less the squares of the harmonics of w."""
        one = np.exp(-1j * w * t)
        total, turned = 0.0, one
        for _ in range(top):
            total += float(np.sum(np.abs(turned @ heard) ** 2))
            turned = turned * one
        return -total

    found = scipy.optimize.minimize_scalar(
        negative_power, bounds=(best - line, best + line), method="bounded", options={"xatol": 1e-8 * nominal}
    )
    return float(found.x)
