"""The run of a fit: read the force files, fit the coefficients, predict every measurement."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.fit import NAMES, TURN, Fit, Prediction, align_turn, fit_average, predict
from chipload.cutting.fit_turns import fit_instantaneous, turns_in_band
from chipload.cutting.material import Material
from chipload.cutting.measured import read_forces
from chipload.cutting.turns import MeasuredCut, Turns, peaks_in_band, turns_of
from chipload.errors import Finding, InputError, Severity
from chipload.jobs.fit.job import CHANNELS, FitJob
from chipload.jobs.fit.outcome import ComparedPeaks, Comparison, FitResult, MeasuredForces
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
        peaks_of_turns(fit, cut, turns, predicted),
    )  # fmt: skip


def _percent(predicted: Floats, measured: Floats) -> Floats:
    """Return the error in percent of the measured value; NaN where that is 0."""
    size = np.where(measured == 0.0, np.nan, np.abs(measured))
    return np.asarray((predicted - measured) / size * 100.0)


def peaks_of_turns(fit: Fit, cut: MeasuredCut, turns: Turns, predicted: Prediction) -> ComparedPeaks:
    """Return the peaks of a cut that are compared: see :class:`ComparedPeaks`.

    What a dynamometer shows at and above the frequencies at which it rings is not the force.
    """
    if fit.search.harmonics and np.isfinite(fit.channels.resonance[:, 0]).any():
        sizes = np.maximum(np.abs(predicted.band_high), np.abs(predicted.band_low))
        return ComparedPeaks(
            np.append(sizes, predicted.band_resultant), peaks_in_band(cut, turns, fit.search.harmonics)
        )
    sizes = np.maximum(np.abs(predicted.high), np.abs(predicted.low))
    measured = np.column_stack([np.maximum(np.abs(turns.high), np.abs(turns.low)), turns.plane])
    return ComparedPeaks(np.append(sizes, predicted.resultant), measured)


def peak_excess(all_peaks: Sequence[ComparedPeaks]) -> tuple[float | None, float | None]:
    """Return the peak excess in the plane and along the axis: the relative amount by which measured peaks exceed
    predicted ones; None where nothing is compared.

    Of each run, fitted or kept back, the peak of each turn over the predicted one: :data:`COVERED` of the turns are
    below, and the run with the greatest counts, to 4 digits. In the plane it is the greater of the force across the
    feed and the greatest in the plane, which limits hold; a direction whose prediction is below :data:`SMALL` of the
    force in the plane is left out.
    """
    plane, axis = list[float](), list[float]()
    for peaks in all_peaks:
        known = np.isfinite(peaks.measured).all(axis=0) & np.isfinite(peaks.predicted)
        known &= peaks.predicted > SMALL * peaks.predicted[3]
        for worst, direction in ((plane, 1), (axis, 2), (plane, 3)):
            if known[direction]:
                most = np.quantile(peaks.measured[:, direction], COVERED)
                worst.append(float(most / peaks.predicted[direction] - 1.0))
    excess = [float(f"{max(0.0, *worst):.4g}") if worst else None for worst in (plane, axis)]
    return excess[0], excess[1]


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
    excess, axial = peak_excess([one.peaks for one in comparisons])
    for where, more in (("in the plane", excess), ("along the axis", axial)):
        if more is not None:
            text = f"90 % of the peaks {where} of each run are at most {number_text(100.0 * more, 3)} % above the"
            found = (*found, Finding("fit-peaks", 0, f"{text} prediction: limits on peaks allow for that"))
    if np.isfinite(fit.channels.resonance[:, 0]).any() and fit.search.harmonics:
        band = number_text(table.band_hz or 0.0, 4)
        text = f"peaks are compared up to {band} Hz: above it the dynamometer rings, and the force is not known there"
        found = (*found, Finding("fit-peaks", 0, text))
    if all(one.use == "fit" for one in comparisons):
        text = 'no run has use = "predict": the error of the prediction of other cuts is unknown'
        found = (*found, Finding("fit-peaks", 0, text))
    try:
        made = Material(
            name=table.name, source=f"{source}; {table.method} fit", workpiece=table.workpiece, cutter=cutter_text,
            conditions="; ".join(x for x in (table.conditions, cuts) if x), chip=(0.0, float(f"{chip:.6g}")),
            covariance=covariance, peak_excess=excess or 0.0,
            peak_excess_axial=axial or 0.0, **numbers,
        )  # fmt: skip
    except InputError as err:
        return None, (_no_material(f"no material is written: {err}"),)
    return made, found


def _no_material(text: str) -> Finding:
    return Finding("fit-no-material", 0, text, Severity.UNPROVEN)
