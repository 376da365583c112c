"""The zero-order limit: the cut's mean over a period, in closed form. A first guess, never a verdict.

Notation: A_0 the mean of the directional matrix over a tooth period [N/mm], G(w) the receptance along T and n [mm/N],
tau the tooth period. The mean cut is at its limit where gain (1 - e^(-i w tau)) lambda = 1 for an eigenvalue lambda of
A_0 G(w): where the imaginary part of that is 0, the gain is one over the real part. Exact where A is constant: evenly
spaced straight teeth in a slot, four or more, or a depth of one axial pitch. For small radial depths it may be far off
to either side.

Reference: [Altintas1995].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.stability import _directional
from chipload.stability.cuts import DynamicCuts

Floats = NDArray[np.float64]

#: steps of frequency in a half-width of the sharpest mode, and in a wave of the delay
FINE, PER_LOBE = 20.0, 60.0
#: frequencies looked at, in natural frequencies
RANGE = (0.3, 2.5)


def zero_order_margin(cuts: DynamicCuts) -> tuple[Floats, Floats]:
    """Factor on the force at which the mean cut begins to chatter, and its frequency [Hz]: (n,) each; inf and 0 where
    none is found.
    """
    margin, hz = np.full(len(cuts), np.inf), np.zeros(len(cuts))
    for i in range(len(cuts)):
        mean = np.zeros((16, 3, 4))
        _directional.matrices(cuts.rows, cuts.start[i], cuts.start[i + 1], cuts.pitch, 16, cuts.exponents, mean)
        A = (mean * _directional.W3[None, :, None]).sum(axis=(0, 1)).reshape(2, 2) / 16.0
        if not A.any():
            continue
        omega = cuts.omega[i]
        step = min(float((cuts.damping * omega).min()) / FINE, 2.0 * np.pi / cuts.period[i] / PER_LOBE)
        w = np.arange(RANGE[0] * omega.min(), RANGE[1] * omega.max(), step)
        share = 1.0 / (omega**2 - w[:, None] ** 2 + 2j * cuts.damping * omega * w[:, None])
        G = np.einsum("ak,wk,bk->wab", cuts.U[i], share, cuts.U[i])
        root = np.linalg.eigvals(A @ G) * (1.0 - np.exp(-1j * w * cuts.period[i]))[:, None]
        for j in range(1, len(w)):  # the two roots, each followed from one frequency to the next
            if np.abs(root[j] - root[j - 1]).sum() > np.abs(root[j, ::-1] - root[j - 1]).sum():
                root[j] = root[j, ::-1]
        for branch in root.T:
            crosses = (branch.imag[:-1] * branch.imag[1:] <= 0.0) & (np.diff(branch.imag) != 0.0)
            for j in np.flatnonzero(crosses).tolist():
                t = branch.imag[j] / (branch.imag[j] - branch.imag[j + 1])
                real = branch.real[j] + t * (branch.real[j + 1] - branch.real[j])
                if real > 0.0 and 1.0 / real < margin[i]:
                    margin[i], hz[i] = 1.0 / real, (w[j] + t * (w[j + 1] - w[j])) / (2.0 * np.pi)
    return margin, hz
