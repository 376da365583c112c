"""Allowable torque with the value of the forces at the confidence of the checks.

The parts of the error of a step are upper bounds from its thickest chip, as in the checks of the result
(:func:`chipload.checking.load_budget.bounded_factors`). They depend on the feed: runout raises a thin chip more. They
are taken at the programmed feed and at the feed that is then allowable, the greater of both.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chipload.checking.load_budget import bounded_factors
from chipload.control.wall import PathLimit
from chipload.cutting.material import Material
from chipload.jobs.torque.cut import CutSteps
from chipload.jobs.torque.job import TorqueJob

Floats = NDArray[np.float64]


def force_factors(job: TorqueJob, planned: CutSteps, material: Material, override: Floats | float = 1.0) -> Floats:
    """Return (n,) what the force of each step may be at the confidence of the checks over its nominal value.

    Parameters
    ----------
    override : (n,) or a number, feed over the programmed one
    """
    c, rows = planned.removal.columns, planned.rows
    columns = {"chip_max_mm": override * np.asarray(c["chip_max_mm"])[rows], "tool": np.asarray(c["tool"])[rows]}
    return bounded_factors(columns, job.cutters, material, job.table.checks.confidence)


def limit_at_confidence(
    job: TorqueJob, planned: CutSteps, material: Material, limit_of: Callable[[Floats], PathLimit]
) -> tuple[PathLimit, Floats]:
    """Return the allowable torque along the plan, and the (n,) factors of the forces with which it was found.

    Parameters
    ----------
    limit_of : function that returns the limit where the forces of the steps are (n,) times as great
    """
    factors = force_factors(job, planned, material)
    limit, loads = limit_of(factors), planned.loads
    cuts = np.isfinite(limit.each) & (loads.torque_cut > 0.0)
    override = np.divide(limit.each - loads.torque_edge, loads.torque_cut, out=np.ones(len(factors)), where=cuts)
    factors = np.maximum(factors, force_factors(job, planned, material, np.clip(override, 0.0, 1.0)))
    return limit_of(factors), factors
