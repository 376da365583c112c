"""The result of a fit: a track for each measurement, the errors of the predicted ones against their limits."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.fit import NAMES, TURN, predict_forces
from chipload.jobs.fit.job import CHANNELS
from chipload.jobs.fit.outcome import Comparison, FitResult
from chipload.number_text import number_text
from chipload.result import LimitCheck, Result, Track, TrackKind, Verdict, in_memory, state_of
from chipload.result.limits import Columns
from chipload.units import mm_min_from_mm_s, rpm_from_rad_s

Floats = NDArray[np.float64]

#: file of the material that is made
MATERIAL = "material.toml"
UNITS = ("MPa", "MPa", "MPa", "N/mm", "N/mm", "N/mm")


def result_of(done: FitResult) -> Result:
    """Return the result of a fit; the tracks of the predicted measurements are in use."""
    names = Counter(c.cut.name for c in done.comparisons)
    tracks = tuple(
        _track(done, c, c.cut.name if names[c.cut.name] == 1 else f"{c.cut.name} {k}")
        for k, c in enumerate(done.comparisons)
    )
    ktc, krc = done.fit.coefficients.values[:2]
    return Result(
        capability="fit",
        title=done.title,
        tracks=tuple(sorted(tracks, key=lambda t: not t.in_use)),
        operations=({"kind": "fit", **numbers(done)},),
        findings=done.findings,
        unchecked=tuple(f"limit {name}: not stated" for name in done.job.unchecked),
        provenance=done.provenance,
        note=f"Ktc {number_text(ktc)} MPa, Krc {number_text(krc)} MPa." if np.isfinite([ktc, krc]).all() else "",
    )


def history(done: FitResult, c: Comparison) -> Columns:
    """Return one turn of a measurement: measured and predicted forces on the cutter, with a row for each rotation.

    A channel whose coefficients are not identified has no column of predicted forces.
    """
    theta = np.linspace(0.0, math.tau, TURN, endpoint=False)
    measured, model = c.measured(theta), predict_forces(done.fit, c.cut, theta)
    out: dict[str, NDArray[Any]] = {"t_s": theta / c.turns.speed, "rotation_deg": np.degrees(theta)}
    for k in np.flatnonzero(c.cut.measured):
        out[f"force_{CHANNELS[k]}_measured_n"] = measured[:, k]
        if np.isfinite(model[:, k]).all():
            out[f"force_{CHANNELS[k]}_n"] = model[:, k]
    return out


def _track(done: FitResult, c: Comparison, name: str) -> Track:
    in_use = c.use == "predict"
    errors = {"mean_percent": c.mean_percent, "peak_percent": c.peak_percent}
    limits = tuple(_check(c, name, key, limit, errors[key]) for key, limit in done.job.limits.items()) if in_use else ()
    settings: dict[str, float | str] = {
        "use": c.use,
        "feed_mm_min": mm_min_from_mm_s(c.cut.feed),
        "speed_rpm": rpm_from_rad_s(c.turns.speed),
    }
    return Track(
        name, TrackKind.MEASUREMENT, in_use, None, limits, parameters=settings, blocks=in_memory(history(done, c))
    )


def _check(c: Comparison, track: str, name: str, limit: float, errors: Floats) -> LimitCheck:
    """Return the check of the greatest error of the measured channels; unproven if one has no error."""
    known = np.isfinite(errors)
    unknown = [CHANNELS[k] for k in np.flatnonzero(c.cut.measured & ~known)]
    reason = f"{', '.join(unknown)}: no error could be calculated" if unknown else ""
    if not known.any():
        return LimitCheck(name, limit, None, Verdict.UNPROVEN, track, reason=reason or "no channel was measured")
    worst = float(np.abs(errors[known]).max())
    state, why = state_of(worst, limit, 0.0, reason)
    return LimitCheck(name, limit, worst, state, track, reason=why)


# -- numbers ----------------------------------------------------------------------------------------------------
def numbers(done: FitResult) -> dict[str, Any]:
    """Return the numbers of the fit as JSON values; unknown values are null."""
    fit = done.fit
    size, direction = fit.cutter.runout
    return {
        "material": done.job.table.name,
        "written": done.material is not None,
        "method": fit.method,
        "coefficients": {
            f"{name.lower()}_{unit.lower().replace('/', '_')}": {
                "value": _number(fit.coefficients.values[k]),
                "identified": bool(fit.identified[k]),
                "low_95": _number(fit.coefficients.interval[k, 0]),
                "high_95": _number(fit.coefficients.interval[k, 1]),
                "sd": _number(
                    math.sqrt(fit.coefficients.covariance[k, k])
                    if fit.coefficients.covariance[k, k] >= 0.0
                    else math.nan
                ),
            }
            for k, (name, unit) in enumerate(zip(NAMES, UNITS, strict=True))
        },
        "covariance": [[_number(v) for v in row] for row in fit.coefficients.covariance],
        "degrees_of_freedom": fit.search.freedom,
        "harmonics": fit.search.harmonics,
        "runout_mm": _number(size),
        "runout_deg": _number(math.degrees(direction)) if fit.cutter.flutes > 2 else None,
        "residual_sd_n": _name_values(fit.channels.residual),
        "r2": _name_values(fit.channels.r2),
        "dynamometer_hz": _name_values(fit.channels.resonance[:, 0] / math.tau),
        "dynamometer_damping": _name_values(fit.channels.resonance[:, 1]),
        "measurements": [_measurement(c) for c in done.comparisons],
    }


def _measurement(c: Comparison) -> dict[str, Any]:
    model = c.predicted
    rows = {
        "mean": (c.forces.mean, model.mean, model.half[0]),
        "high": (c.forces.high, model.high, model.half[1]),
        "low": (c.forces.low, model.low, model.half[2]),
        "band_high": (c.forces.band_high, model.band_high, model.half[3]),
        "band_low": (c.forces.band_low, model.band_low, model.half[4]),
    }
    return {
        "file": c.cut.name,
        "use": c.use,
        "feed_mm_min": mm_min_from_mm_s(c.cut.feed),
        "speed_rpm": rpm_from_rad_s(c.turns.speed),
        "turns": len(c.turns.mean),
        "scatter_n": _name_values(c.turns.scatter),
        **{
            f"{key}_n": {
                "measured": _name_values(seen),
                "model": _name_values(predicted),
                "half_95": _name_values(half),
            }
            for key, (seen, predicted, half) in rows.items()
        },
        "plane_max_n": {"measured": _number(c.forces.plane), "model": _number(model.resultant)},
        "mean_error_percent": _name_values(c.mean_percent),
        "peak_error_percent": _name_values(c.peak_percent),
    }


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _name_values(values: Floats) -> dict[str, float | None]:
    return {key: _number(v) for key, v in zip(CHANNELS, values, strict=True)}
