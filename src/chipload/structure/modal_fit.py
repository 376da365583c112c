"""Modes from a measured receptance of the tool's tip.

Notation: f [Hz], w = 2 pi f; the model is H = sum over modes of c_k / (1 - (w / w_k)^2 + 2 i z_k w / w_k) + C with the
modal compliance c_k = 1 / k_k [mm/N], real because the structure is passive and force and response are at one
point, and C the compliance of the omitted modes.

The fit is a variable projection: least squares finds frequencies and damping ratios, and c_k and C follow from them
linearly. Modes are added where the residual is largest, until it is small.

Reference: [Golub1973] for the projection; [Ewins2000] for the model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.number_text import number_text
from chipload.structure.hexa import Array
from chipload.structure.receptance import Receptance

#: greatest number of modes; a mode is added while the residual is above ENOUGH of the peak and falls by a third
MOST_MODES, ENOUGH, GAIN = 8, 0.005, 0.67
#: greatest residual of a fit as a share of the peak, without the worst hundredth of the frequencies
LEFT = 0.05
QUANTILE = 0.99
#: plausible range of the modal stiffness of a tool's tip [N/mm], and of damping ratios
STIFFNESS, DAMPING = (100.0, 1e6), (5e-4, 0.3)
#: least plausible frequency of such a mode [Hz]; machines on their feet are above it
LEAST_HZ = 5.0
#: least coherence near the frequency of a mode
COHERENT = 0.8


@dataclass(frozen=True, eq=False)
class ModalFit:
    """Modes of one direction.

    Parameters
    ----------
    frequency : (M,) float [Hz], rising
    damping : (M,) float, damping ratio
    stiffness : (M,) float [N/mm]
    compliance : of the omitted modes [mm/N]
    left : residual of the fit as a share of the peak
    coherence : (M,) float, mean near each mode; None: not measured
    """

    frequency: Array
    damping: Array
    stiffness: Array
    compliance: float
    left: float
    coherence: Array | None


def fit_modes(measured: Receptance, band: tuple[float, float], coherence: Array | None = None) -> ModalFit:
    """Fit the modes of a receptance between two frequencies.

    Parameters
    ----------
    band : lowest and highest frequency [Hz] of the fit
    coherence : (n,) float, of the measurement

    Raises
    ------
    InputError
        There are too few frequencies, the residual is above 5 % of the peak, or a mode has a stiffness or damping ratio
        that is implausible for a tool's tip (as with a wrong unit), lies at the end of the band, or was not measured
        coherently.

    Examples
    --------
    >>> f = np.arange(100.0, 1500.0, 2.0)
    >>> h = 2e-4 / (1.0 - (f / 600.0) ** 2 + 0.06j * f / 600.0)
    >>> found = fit_modes(Receptance(f, h), (150.0, 1400.0))
    >>> found.frequency.round(3).tolist(), found.damping.round(5).tolist(), found.stiffness.round(2).tolist()
    ([600.0], [0.03], [5000.0])
    """
    inside = (measured.frequency >= band[0]) & (measured.frequency <= band[1]) & (measured.frequency > 0.0)
    f, H = measured.frequency[inside], measured.response[inside]
    if len(f) < 20:
        raise InputError(f"receptance: {len(f)} frequencies from {band[0]:g} to {band[1]:g} Hz: must be at least 20")
    peak = float(np.abs(H).max())
    if peak == 0.0:
        raise InputError("receptance: every value is 0: check the channel of the sensor")
    start: list[float] = []
    best, rest, left = np.zeros(0), H, np.inf
    while len(start) < 2 * MOST_MODES:
        tried = _search(f, H, np.array([*best, *_next_mode(f, rest)]))
        remains = H - _model(f, H, tried)[0]
        share = float(np.quantile(np.abs(remains), QUANTILE)) / peak
        if share > GAIN * left:
            break
        best, rest, left, start = tried, remains, share, [*start, 0.0, 0.0]
        if left < ENOUGH:
            break
    if not left <= LEFT:
        raise InputError(
            f"receptance: {len(best) // 2} modes leave {number_text(100.0 * left, 3)} % of the peak: must be at most "
            f"{100.0 * LEFT:g} %: take another band (--from-hz, --to-hz), or measure again"
        )
    c = _model(f, H, best)[1]
    frequency, damping = np.exp(best[0::2]), np.exp(best[1::2])
    order = np.argsort(frequency)
    frequency, damping, modal = frequency[order], damping[order], c[:-1][order]
    # modes within the residual of the fit are dropped
    seen = np.abs(modal) / (2.0 * damping) > max(2.0 * left, ENOUGH) * peak
    frequency, damping, modal = frequency[seen], damping[seen], modal[seen]
    _check(frequency, damping, modal, band)
    about = None
    if coherence is not None:
        whole = np.asarray(coherence, dtype=np.float64)[inside]
        about = np.array([_coherence_near(f, whole, a, z) for a, z in zip(frequency, damping, strict=True)])
        if (about < COHERENT).any():
            k = int(np.argmin(about))
            raise InputError(
                f"receptance: coherence {about[k]:.3g} about the mode at {frequency[k]:.5g} Hz: must be at least "
                f"{COHERENT:g}: hit harder, with a harder tip, and take the mean of more blows"
            )
    return ModalFit(frequency, damping, 1.0 / modal, float(c[-1]), left, about)


def _check(frequency: Array, damping: Array, modal: Array, band: tuple[float, float]) -> None:
    """Refuse modes that are implausible for a tool's tip."""
    if not len(frequency):
        raise InputError("receptance: no mode was found: take another band (--from-hz, --to-hz)")
    for f, z, c in zip(frequency.tolist(), damping.tolist(), modal.tolist(), strict=True):
        if c <= 0.0:
            raise InputError(
                f"receptance: the mode at {f:.5g} Hz has a compliance below 0: hammer and sensor must point the same "
                "way at the same place, and the response must be a displacement"
            )
        if not band[0] < f < band[1]:
            raise InputError(f"receptance: a mode at {f:.5g} Hz: must lie within {band[0]:g} to {band[1]:g} Hz")
        if f < LEAST_HZ:
            raise InputError(
                f"receptance: the mode at {number_text(f)} Hz: must be at least {LEAST_HZ:g} Hz: check the unit of the "
                "frequency"
            )
        if not DAMPING[0] <= z <= DAMPING[1]:
            raise InputError(
                f"receptance: the mode at {f:.5g} Hz has the damping ratio {z:.3g}: must be from {DAMPING[0]:g} to "
                f"{DAMPING[1]:g}"
            )
        if not STIFFNESS[0] <= 1.0 / c <= STIFFNESS[1]:
            raise InputError(
                f"receptance: the mode at {f:.5g} Hz has the stiffness {number_text(1e-3 / c, 3)} N/um: must be from "
                f"{1e-3 * STIFFNESS[0]:g} to {1e-3 * STIFFNESS[1]:g} N/um: check the unit"
            )


def _basis(f: Array, x: Array) -> NDArray[np.complex128]:
    """(n, M + 1) receptance per unit of each compliance; ``x``: logarithms of frequency and damping, mode by mode."""
    r = f[:, None] / np.exp(x[0::2])
    modes = 1.0 / (1.0 - r**2 + 2j * np.exp(x[1::2]) * r)
    return np.column_stack([modes, np.ones(len(f))])


def _model(f: Array, H: NDArray[np.complex128], x: Array) -> tuple[NDArray[np.complex128], Array]:
    """The nearest receptance with these modes, and its compliances."""
    basis = _basis(f, x)
    real = np.concatenate([basis.real, basis.imag])
    c = np.linalg.lstsq(real, np.concatenate([H.real, H.imag]))[0]
    return basis @ c, c


def _search(f: Array, H: NDArray[np.complex128], start: Array) -> Array:
    scale = float(np.abs(H).max())

    def residual(x: Array) -> Array:
        rest = (H - _model(f, H, x)[0]) / scale
        return np.concatenate([rest.real, rest.imag])

    low = np.tile([np.log(0.5 * f[0]), np.log(1e-4)], len(start) // 2)
    high = np.tile([np.log(2.0 * f[-1]), np.log(0.9)], len(start) // 2)
    found = scipy.optimize.least_squares(
        residual, np.clip(start, low + 1e-6, high - 1e-6), bounds=(low, high), x_scale=0.02
    )
    return np.asarray(found.x, dtype=np.float64)


def _next_mode(f: Array, rest: NDArray[np.complex128]) -> tuple[float, float]:
    """Logarithms of frequency and damping where the residual is largest."""
    # a moving mean over a few frequencies, so that noise does not count as a mode
    width = max(3, len(f) // 200)
    smooth = np.convolve(np.abs(rest), np.ones(width) / width, mode="same")
    k = int(np.argmax(smooth))
    over = smooth >= smooth[k] / np.sqrt(2.0)
    low, high = k, k
    while low > 0 and over[low - 1]:
        low -= 1
    while high < len(f) - 1 and over[high + 1]:
        high += 1
    z = float(np.clip((f[high] - f[low]) / (2.0 * f[k]), 0.003, 0.1))
    return float(np.log(f[k])), float(np.log(z))


def _coherence_near(f: Array, coherence: Array, at: float, z: float) -> float:
    """Mean coherence within two half-widths of a mode."""
    near = np.abs(f - at) <= max(2.0 * z * at, 2.0 * float(np.diff(f).max()))
    return float(coherence[near].mean())
