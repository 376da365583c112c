"""The run of a fit: read the force files, fit the coefficients, predict every measurement."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.fit import NAMES, TURN, Fit, align_turn, fit_average, predict
from chipload.cutting.fit_turns import fit_instantaneous, turns_in_band
from chipload.cutting.material import Material
from chipload.cutting.measured import read_forces
from chipload.cutting.turns import MeasuredCut, turns_of
from chipload.errors import Finding, InputError, Severity
from chipload.jobs.fit.job import CHANNELS, FitJob
from chipload.jobs.fit.outcome import Comparison, FitResult, MeasuredForces
from chipload.number_text import number_text
from chipload.progress import Progress, silent
from chipload.result import Provenance
from chipload.result.provenance import hashes, title_of, versions
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm

Floats = NDArray[np.float64]
#: share of the measured peaks that the band of a material covers
COVERED = 0.9
#: of the force in the plane: a peak that is predicted below this is not compared
SMALL = 0.1


def read_cuts(job: FitJob) -> tuple[tuple[MeasuredCut, ...], tuple[Finding, ...]]:
    """Read every force file of a job and return its cuts in their order.

    Raises
    ------
    InputError
        A file cannot be read, or a channel is not in it.
    """
    table, cuts, findings = job.table, [], []
    for k, (m, file) in enumerate(zip(table.measurement, job.files, strict=True)):
        try:
            measured, file_findings = read_forces(file, m.window_s)
            channels = m.channels or table.channels
            force = np.full((len(measured.force), 3), np.nan)
            side = -1.0 if channels.on == "work" else 1.0
            for c, key in enumerate(CHANNELS):
                named = getattr(channels, key)
                if named is not None:
                    sign, name = (-1.0, named[1:]) if named.startswith("-") else (1.0, named.removeprefix("+"))
                    force[:, c] = side * sign * measured.column(name.strip())
            cuts.append(
                MeasuredCut(
                    m.file, measured.rate, force, mm_s_from_mm_min(m.feed_mm_min), rad_s_from_rpm(m.speed_rpm),
                    job.arc, table.engagement.axial_depth_mm,
                )
            )  # fmt: skip
        except InputError as err:
            raise InputError(f"{job.path.name}: measurement.{k}: {err}") from None
        findings += [Finding(f.code, f.line, f"{m.file}: {f.text}", f.severity) for f in file_findings]
    return tuple(cuts), tuple(findings)


def run(job: FitJob, progress: Progress = silent) -> FitResult:
    """Fit the coefficients and predict every cut of the job.

    Raises
    ------
    InputError
        As :func:`read_cuts`, :func:`chipload.cutting.fit.fit_average` and
        :func:`chipload.cutting.fit_turns.fit_instantaneous`.
    """
    table = job.table
    progress(0.0, "reading")
    cuts, findings = read_cuts(job)
    uses = tuple(m.use for m in table.measurement)
    fitted = [cut for cut, use in zip(cuts, uses, strict=True) if use == "fit"]
    progress(0.1, "fit")
    if table.method == "average":
        fit = fit_average(fitted, job.cutter)
    else:
        rings = [getattr(table.dynamometer, f"{key}_hz") for key in CHANNELS]
        fit = fit_instantaneous(
            fitted, job.cutter, band=math.tau * (table.band_hz or 0.0), runout=table.runout == "seek", zero=table.zero,
            ringing=[None if hz is None else math.tau * hz for hz in rings],
        )  # fmt: skip
    progress(0.7, "predict")
    comparisons = tuple(_compare_cut(fit, cut, use) for cut, use in zip(cuts, uses, strict=True))
    material, why = _material(job, fit, comparisons)
    notes = tuple(Finding("fit-note", 0, text) for text in fit.notes)
    if not fit.search.converged:
        text = "the search for runout and phase did not converge: widen the windows"
        notes = (Finding("fit-not-converged", 0, text, Severity.UNPROVEN), *notes)
    progress(1.0, "fitted")
    return FitResult(job, title_of(job.path), fit, comparisons, material, (*why, *findings, *notes), _provenance(job))


def check(job: FitJob) -> tuple[list[str], bool]:
    """Return lines on the files of a job, without fitting."""
    cuts, findings = read_cuts(job)
    if job.table.method == "instantaneous":
        fitted = [cut for cut, m in zip(cuts, job.table.measurement, strict=True) if m.use == "fit"]
        turns_in_band(fitted, math.tau * (job.table.band_hz or 0.0))
    lines = [f"{job.path.name}: valid: {len(cuts)} measurements, method {job.table.method}"]
    for cut, m in zip(cuts, job.table.measurement, strict=True):
        lines.append(f"{cut.name}: {m.use}, {len(cut.force)} samples at {cut.rate:g} Hz")
    lines += [f"finding: {f}" for f in findings]
    if job.unchecked:
        lines.append(f"not checked, no limit stated: {', '.join(job.unchecked)}")
    return lines, all(f.severity is Severity.NOTE for f in findings)


def _provenance(job: FitJob) -> Provenance:
    files = {f"measurement {k}": file for k, file in enumerate(job.files)}
    if job.table.cutter.file is not None:
        files["cutter 0"] = job.path.parent / job.table.cutter.file
    return Provenance(hashes(files), job.overrides, "", {job.table.name: job.table.source}, versions())


def _compare_cut(fit: Fit, cut: MeasuredCut, use: str) -> Comparison:
    predicted = predict(fit, cut)
    turns = turns_of(cut, fit.search.harmonics or min(8, math.floor(0.8 * math.pi * cut.rate / cut.speed)))
    mean, high, low = (x.mean(axis=0) for x in (turns.mean, turns.high, turns.low))
    larger = np.abs(high) >= np.abs(low)
    k = np.arange(1, len(turns.amplitude))
    theta = np.linspace(0.0, math.tau, TURN, endpoint=False)
    band = turns.amplitude[0].real + 2.0 * (np.exp(1j * np.outer(theta, k)) @ turns.amplitude[1:]).real
    return Comparison(
        cut, use, turns, predicted,
        MeasuredForces(mean, high, low, band.max(axis=0), band.min(axis=0), float(turns.plane.mean())),
        align_turn(fit, cut, turns), _percent(predicted.mean, mean),
        _percent(np.where(larger, predicted.high, predicted.low), np.where(larger, high, low)),
    )  # fmt: skip


def _percent(predicted: Floats, measured: Floats) -> Floats:
    """Return the error in percent of the measured value; NaN where that is 0."""
    size = np.where(measured == 0.0, np.nan, np.abs(measured))
    return np.asarray((predicted - measured) / size * 100.0)


def peak_excess(comparisons: Sequence[Comparison]) -> float | None:
    """Return the peak excess: the relative amount by which measured peaks exceed predicted ones; None without runs.

    Of each run, fitted or kept back, and each direction (feed, across, axis, and the greatest force in the plane) the
    larger peak of each turn over the predicted one: :data:`COVERED` of the turns are below, and the worst of these
    counts, to 4 digits. A direction whose prediction is below :data:`SMALL` of the force in the plane is left out.
    """
    worst: list[float] = []
    for one in comparisons:
        prediction = one.predicted
        predicted = np.append(np.maximum(np.abs(prediction.high), np.abs(prediction.low)), prediction.resultant)
        turns = one.turns
        seen = np.column_stack([np.maximum(np.abs(turns.high), np.abs(turns.low)), turns.plane])
        measured = np.append(one.cut.measured, one.cut.measured[:2].all())
        counts = measured & np.isfinite(predicted) & (predicted > SMALL * prediction.resultant)
        if counts.any():
            worst.append(float((np.quantile(seen[:, counts], COVERED, axis=0) / predicted[counts]).max() - 1.0))
    return float(f"{max(0.0, *worst):.4g}") if worst else None


def _material(job: FitJob, fit: Fit, comparisons: Sequence[Comparison]) -> tuple[Material | None, tuple[Finding, ...]]:
    """Return the material, or the reason why there is none."""
    table = job.table
    values = fit.coefficients.values.copy()
    source = table.source
    if not fit.identified[[2, 5]].any() and table.axial is not None:
        values[2], values[5] = table.axial.kac_mpa, table.axial.kae_n_mm
        source += f"; axial coefficients: {table.axial.source}"
    unidentified = [name for name, v in zip(NAMES, values, strict=True) if not math.isfinite(v)]
    if unidentified:
        what = (
            "measure them or state [axial]" if set(unidentified) <= {"Kac", "Kae"} else "measure more feeds or channels"
        )
        return None, (_no_material(f"no material is written: {', '.join(unidentified)} not identified: {what}"),)
    chip = max(cut.feed_per_tooth(job.cutter.flutes) for cut in fit.cuts) + 2.0 * fit.cutter.runout[0]
    cutter = job.cutter
    cutter_text = f"{cutter.name or 'end mill'}, D {cutter.diameter:g} mm, {cutter.flutes} teeth, helix "
    cutter_text += f"{math.degrees(cutter.helix):g} deg"
    cuts = f"{table.engagement.milling}, {table.engagement.axial_depth_mm:g} mm deep"
    numbers: dict[str, Any] = {name: float(f"{v:.6g}") for name, v in zip(NAMES, values, strict=True)}
    covariance: Any = None
    found: tuple[Finding, ...] = ()
    if np.isfinite(fit.coefficients.covariance).all():
        covariance = tuple(tuple(float(f"{v:.9g}") for v in row) for row in fit.coefficients.covariance)
    else:
        text = "the uncertainty of the coefficients is not written: the covariance of all six is unknown"
        found = (Finding("fit-covariance", 0, text),)
    excess = peak_excess(comparisons)
    if excess is not None:
        above = number_text(100.0 * excess, 3)
        text = f"90 % of the peaks of each run are at most {above} % above the prediction: limits on peaks"
        found = (*found, Finding("fit-peaks", 0, f"{text} allow for that"))
    if all(one.use == "fit" for one in comparisons):
        text = 'no run has use = "predict": the error of the prediction of other cuts is unknown'
        found = (*found, Finding("fit-peaks", 0, text))
    try:
        made = Material(
            name=table.name, source=f"{source}; {table.method} fit", workpiece=table.workpiece, cutter=cutter_text,
            conditions="; ".join(x for x in (table.conditions, cuts) if x), chip=(0.0, float(f"{chip:.6g}")),
            covariance=covariance, peak_excess=excess or 0.0, **numbers,
        )  # fmt: skip
    except InputError as err:
        return None, (_no_material(f"no material is written: {err}"),)
    return made, found


def _no_material(text: str) -> Finding:
    return Finding("fit-no-material", 0, text, Severity.UNPROVEN)
