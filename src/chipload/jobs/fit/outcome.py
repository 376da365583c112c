"""The outcome of a fit: coefficients, and every measurement compared with its prediction.

Peaks are means over the turns of the greatest and the least force of each turn. The error of a peak is that of the one
of larger size; a measured 0 has no error in percent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.fit import Fit, Prediction
from chipload.cutting.material import Material
from chipload.cutting.turns import MeasuredCut, Turns
from chipload.errors import Finding
from chipload.jobs.fit.job import FitJob
from chipload.result import Provenance

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MeasuredForces:
    """Measured forces of a cut, (3,) [N], as in the prediction; ``plane`` greatest in-plane force [N]."""

    mean: Floats
    high: Floats
    low: Floats
    band_high: Floats
    band_low: Floats
    plane: float


@dataclass(frozen=True, eq=False)
class ComparedPeaks:
    """Greatest sizes of the force [N], along the feed, across it, along the axis and in the plane: ``predicted`` (4,),
    and ``measured`` (r, 4) of each turn; NaN where a channel was not measured or is not predicted.
    """

    predicted: Floats
    measured: Floats


@dataclass(frozen=True, eq=False)
class Comparison:
    """A measured cut with its prediction.

    Errors in percent of the measured, (3,): ``mean_percent``, and ``peak_percent`` of the larger peak; ``phase``
    rotation of tooth 0 at the first sample [rad]; ``peaks`` within the band of the fit if the dynamometer rings above
    it, else of every sample.
    """

    cut: MeasuredCut
    use: str
    turns: Turns
    predicted: Prediction
    forces: MeasuredForces
    phase: float
    mean_percent: Floats
    peak_percent: Floats
    peaks: ComparedPeaks

    def measured(self, theta: Floats) -> Floats:
        """(m, 3) float [N] mean turn of the measured forces, within the harmonics, at rotations (m,) of tooth 0."""
        k = np.arange(1, len(self.turns.amplitude))
        wave = np.exp(1j * np.outer(np.asarray(theta) - self.phase, k))
        return np.asarray(self.turns.amplitude[0].real + 2.0 * (wave @ self.turns.amplitude[1:]).real)


@dataclass(frozen=True, eq=False)
class FitResult:
    """Result of a fit.

    Parameters
    ----------
    job : that was run
    title : of the result
    fit : coefficients, runout, dynamometer
    comparisons : every measurement with its prediction, in the order of the job
    material : None where it cannot be written
    findings : of the force files, of the fit, and why there is no material
    provenance : where the numbers come from
    """

    job: FitJob
    title: str
    fit: Fit
    comparisons: tuple[Comparison, ...]
    material: Material | None
    findings: tuple[Finding, ...]
    provenance: Provenance
