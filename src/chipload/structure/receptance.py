"""Static compliance of a tool tip from its measured receptance.

Notation: f [Hz]; H(f) complex receptance [mm/N]; w = 2 pi f; C static compliance [mm/N].

Below the first resonance each mode adds c_k / (1 - (f / f_k)^2), so Re H = C + c_2 f^2 + c_4 f^4 + ...; C is the
constant of that polynomial, fitted over a band. Accelerometers measure little at low frequencies: choose a band with
good coherence.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.structure.hexa import Array


@dataclass(frozen=True, eq=False)
class Receptance:
    """A measured frequency response at the tool's tip, one direction.

    Parameters
    ----------
    frequency : (n,) float [Hz], increasing, at least 0
    response : (n,) complex [mm/N]

    Raises
    ------
    InputError
        Shapes do not fit, a number is not finite, frequencies do not increase.
    """

    frequency: Array
    response: NDArray[np.complex128]

    def __post_init__(self) -> None:
        f = np.array(self.frequency, dtype=np.float64)
        H = np.array(self.response, dtype=np.complex128)
        if f.ndim != 1 or f.shape != H.shape or len(f) < 4:
            raise InputError(f"receptance: shapes {f.shape} and {H.shape}: must be two columns of at least 4 numbers")
        if not (np.isfinite(f).all() and np.isfinite(H).all() and f[0] >= 0.0 and (np.diff(f) > 0.0).all()):
            raise InputError("receptance: numbers must be finite, frequencies at least 0 and increasing")
        f.setflags(write=False)
        H.setflags(write=False)
        object.__setattr__(self, "frequency", f)
        object.__setattr__(self, "response", H)


def static_compliance(measured: Receptance, band: tuple[float, float]) -> tuple[float, float]:
    """Static compliance, and the scatter about the fit.

    Parameters
    ----------
    band : lowest and highest frequency [Hz] of the fit, well below the first resonance (a third of it or less)

    Returns
    -------
    C : [mm/N]
    scatter : standard deviation of Re H about the polynomial [mm/N]

    Raises
    ------
    InputError
        Fewer than 4 frequencies in the band, or C is not above 0.

    Examples
    --------
    >>> f = np.arange(10.0, 700.0, 10.0)
    >>> one_mode = 1e-4 / (1.0 - (f / 1000.0) ** 2 + 0.06j * f / 1000.0)
    >>> round(static_compliance(Receptance(f, one_mode), (10.0, 300.0))[0] * 1e4, 4)
    1.0
    """
    f = measured.frequency
    inside = (f >= band[0]) & (f <= band[1])
    if inside.sum() < 4:
        raise InputError(
            f"receptance: {inside.sum()} frequencies from {band[0]:g} to {band[1]:g} Hz: must be at least 4"
        )
    x = (f[inside] / band[1]) ** 2
    powers = np.stack([np.ones_like(x), x, x**2], axis=1)
    fit = np.linalg.lstsq(powers, measured.response.real[inside])[0]
    if not fit[0] > 0.0:
        raise InputError(
            f"receptance: static compliance {fit[0]:g} mm/N from {band[0]:g} to {band[1]:g} Hz: must be above 0; the "
            "band holds a resonance or noise, or the sign is that of an accelerance"
        )
    rest = measured.response.real[inside] - powers @ fit
    return float(fit[0]), float(np.sqrt((rest**2).sum() / max(len(x) - 3, 1)))
