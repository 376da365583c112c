"""Residual stress of a rolled plate as a profile over its thickness.

Notation: z [mm] height above the underside of the plate, 0 .. H; sigma_x(z), sigma_y(z) [MPa] the stress along x and y,
tension positive, linear between points. In a plate that lies free both are in equilibrium:

    N = integral of sigma dz = 0,  M = integral of sigma (z - H / 2) dz = 0.

A profile that is not has its least constant and linear term taken away: N / H + 12 M / H^3 (z - H / 2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError

Array = NDArray[np.float64]

#: |N| and |M| / (H / 2) over the integral of |sigma|, up to which a profile counts as in equilibrium
BALANCED = 0.01
#: the same, above which a profile is refused: it is that of another plate, or half of one
CORRECTABLE = 0.25
#: points of the shapes that are calculated
POINTS = 961


@dataclass(frozen=True, eq=False)
class StressProfile:
    """Stress of a plate over its thickness.

    Parameters
    ----------
    height : (n,) float [mm], rising from 0
    along_x, along_y : (n,) float [MPa], tension positive

    Raises
    ------
    InputError
        Fewer than two heights, heights that do not rise from 0, or a stress that is not finite.
    """

    height: Array
    along_x: Array
    along_y: Array

    def __post_init__(self) -> None:
        """Refuse what is no profile."""
        z = self.height
        if z.ndim != 1 or len(z) < 2 or z[0] != 0.0 or not (np.diff(z) > 0.0).all() or not np.isfinite(z).all():
            raise InputError("residual_stress: heights must rise from 0 at the underside of the plate, two at least")
        for values in (self.along_x, self.along_y):
            if values.shape != z.shape or not np.isfinite(values).all():
                raise InputError("residual_stress: state a finite stress along and across at each height")
            values.setflags(write=False)
        z.setflags(write=False)

    @property
    def thickness(self) -> float:
        """Thickness of the plate [mm]."""
        return float(self.height[-1])

    @property
    def greatest(self) -> float:
        """Greatest stress of either sign [MPa]."""
        return float(max(np.abs(self.along_x).max(), np.abs(self.along_y).max()))

    def at(self, z: Array) -> tuple[Array, Array]:
        """Stress along x and y at heights (k,) [mm]; 0 outside the plate."""
        x, y = (np.interp(z, self.height, v, left=0.0, right=0.0) for v in (self.along_x, self.along_y))
        return np.asarray(x), np.asarray(y)

    def upside_down(self) -> StressProfile:
        """The profile of the plate turned over."""
        z = self.thickness - self.height[::-1]
        return StressProfile(z, self.along_x[::-1].copy(), self.along_y[::-1].copy())

    def turned(self) -> StressProfile:
        """The profile of the plate turned by 90 deg about z."""
        return StressProfile(self.height, self.along_y, self.along_x)

    def unbalance(self) -> float:
        """Greatest of |N| and 2 |M| / H over the integral of |sigma|, of both directions.

        Examples
        --------
        >>> z = np.array([0.0, 1.0, 2.0])
        >>> StressProfile(z, np.array([1.0, 1.0, 1.0]), np.zeros(3)).unbalance()
        1.0
        """
        worst = 0.0
        for values in (self.along_x, self.along_y):
            force, moment, size = _resultants(self.height, values)
            if size > 0.0:
                worst = max(worst, abs(force) / size, 2.0 * abs(moment) / (self.thickness * size))
        return worst

    def balanced(self) -> StressProfile:
        """The profile without the constant and linear term that keep it from equilibrium."""
        H = self.thickness
        out = []
        for values in (self.along_x, self.along_y):
            force, moment, _ = _resultants(self.height, values)
            out.append(values - force / H - 12.0 * moment / H**3 * (self.height - 0.5 * H))
        return StressProfile(self.height, *out)


def _resultants(z: Array, values: Array) -> tuple[float, float, float]:
    """N, M and the integral of |sigma| of a stress that is linear between heights."""
    d, a, b = np.diff(z), values[:-1], values[1:]
    middle = 0.5 * (z[:-1] + z[1:]) - 0.5 * z[-1]
    force = 0.5 * d * (a + b)
    size = np.where(a * b >= 0.0, 0.5 * np.abs(a + b), (a * a + b * b) / (2.0 * np.maximum(np.abs(a - b), 1e-300)))
    return float(force.sum()), float((force * middle + d * d * (b - a) / 12.0).sum()), float((d * size).sum())


def require_balance(profile: StressProfile) -> tuple[StressProfile, float]:
    """A profile in equilibrium, and how far the stated one was from it (see :meth:`StressProfile.unbalance`).

    Raises
    ------
    InputError
        It is farther from equilibrium than :data:`CORRECTABLE`.
    """
    off = profile.unbalance()
    if off > CORRECTABLE:
        raise InputError(
            f"residual_stress: its resultant is {off:.0%} of the stress: at most {CORRECTABLE:.0%} is balanced: state "
            f"the stress over the whole thickness, 0 to {profile.thickness:g} mm, tension positive"
        )
    return profile.balanced(), off


def m_shape(thickness: float, amplitude: float, across: float) -> StressProfile:
    """The M of a stretched plate: -A cos(4 pi z / H), compression at both faces and in the middle.

    The form is that of slitting tests of stretched aluminium plate [Prime2002]; the amplitude is the caller's.

    Parameters
    ----------
    thickness : H [mm]
    amplitude : A [MPa], along the rolling direction, here x
    across : stress across it over that along it
    """
    z = np.linspace(0.0, thickness, POINTS)
    values = -amplitude * np.cos(4.0 * np.pi * z / thickness)
    return StressProfile(z, values, across * values).balanced()


def odd_shape(thickness: float, amplitude: float, across: float) -> StressProfile:
    """A stress that differs from face to face and is in equilibrium: A P_3(2 z / H - 1)."""
    z = np.linspace(0.0, thickness, POINTS)
    s = 2.0 * z / thickness - 1.0
    values = amplitude * (2.5 * s**3 - 1.5 * s)
    return StressProfile(z, values, across * values).balanced()


def profile_of_points(points: ArrayLike) -> StressProfile:
    """The profile of rows (n, 3): height [mm], stress along x and along y [MPa].

    Raises
    ------
    InputError
        See :class:`StressProfile`.
    """
    rows = np.array(points, dtype=np.float64).reshape(-1, 3)
    return StressProfile(rows[:, 0].copy(), rows[:, 1].copy(), rows[:, 2].copy())
