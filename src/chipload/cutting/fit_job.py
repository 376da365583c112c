"""A fit: one TOML file that names measured cuts, the cutter and the engagement; what is fitted, and what is predicted.

Notation: T unit feed direction, n = Rot(+90 deg) T (to the left of the feed, seen from above), the axis from tip to
holder, all for a clockwise spindle. A channel is named with its sign: ``across = "-Fx"`` says that Fx, turned round, is
the component along n. ``on`` says whether the channels show the force on the work, as a dynamometer under it does, or
on the cutter.

Peaks are means over the turns of the greatest and the least of each turn. The error of a peak is taken of that of the
two that is larger in size; a measured 0 has no error in percent.
"""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from chipload.cutter.cutter import Cutter
from chipload.cutter.table import cutter_from_table
from chipload.cutting.fit import NAMES, TURN, Fit, Prediction, aligned, fit_average, predict
from chipload.cutting.fit_turns import fit_instantaneous
from chipload.cutting.material import Material
from chipload.cutting.measured import read_forces
from chipload.cutting.turns import Cut, Turns, turns_of
from chipload.errors import Finding, InputError
from chipload.progress import Progress, silent
from chipload.tables import nearest
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm

Floats = NDArray[np.float64]

#: the channels, in the order of the components
CHANNELS = ("feed", "across", "axis")


class _Table(BaseModel):
    """A table of the file: unknown keys are refused, kinds are not guessed."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, hide_input_in_errors=True)


class EngagementTable(_Table):
    """What the cutter meets: the same in every file."""

    milling: Literal["slot", "up", "down"]
    axial_depth_mm: float = Field(gt=0.0)
    radial_depth_mm: float | None = Field(None, gt=0.0)


class ChannelsTable(_Table):
    """Which column of the files is which component, with its sign."""

    feed: str | None = None
    across: str | None = None
    axis: str | None = None
    on: Literal["work", "cutter"]


class DynamometerTable(_Table):
    """About where the dynamometer rings; what is not stated is taken as rigid."""

    feed_hz: float | None = Field(None, gt=0.0)
    across_hz: float | None = Field(None, gt=0.0)
    axis_hz: float | None = Field(None, gt=0.0)


class MeasurementTable(_Table):
    """One file."""

    file: str = Field(min_length=1)
    use: Literal["fit", "predict"]
    feed_mm_min: float = Field(gt=0.0)
    speed_rpm: float = Field(gt=0.0)
    window_s: tuple[float, float] | None = None
    channels: ChannelsTable | None = None


class AxialTable(_Table):
    """Axial coefficients from elsewhere, where the axis was not measured."""

    kac_mpa: float
    kae_n_mm: float
    source: str = Field(min_length=1)


class LimitsTable(_Table):
    """How far the predictions may be off."""

    mean_percent: float | None = Field(None, gt=0.0)
    peak_percent: float | None = Field(None, gt=0.0)


class FitTable(_Table):
    """The whole file."""

    name: str = Field(min_length=1)
    source: str = Field(min_length=1)
    workpiece: str = ""
    conditions: str = ""
    method: Literal["average", "instantaneous"]
    band_hz: float | None = Field(None, gt=0.0)
    runout: Literal["seek", "given"] = "seek"
    zero: bool = False
    cutter: dict[str, Any]
    engagement: EngagementTable
    channels: ChannelsTable
    dynamometer: DynamometerTable = Field(default_factory=DynamometerTable.model_construct)
    axial: AxialTable | None = None
    limits: LimitsTable = Field(default_factory=LimitsTable.model_construct)
    measurement: tuple[MeasurementTable, ...] = Field(min_length=1)


@dataclass(frozen=True, eq=False)
class FitJob:
    """A fit that was read and found whole: ``cuts`` in the order of the file, ``uses`` what each is for."""

    path: Path
    table: FitTable
    cutter: Cutter
    cuts: tuple[Cut, ...]
    uses: tuple[str, ...]
    findings: tuple[Finding, ...]
    provenance: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Comparison:
    """A cut beside its prediction.

    ``mean``, ``high``, ``low``, ``band_high``, ``band_low`` (3,) [N] measured, as in the prediction; errors in percent
    of the measured, (3,): ``mean_percent``, and ``peak_percent`` of the larger peak; ``plane`` greatest in-plane force
    measured [N]; ``phase`` rotation of tooth 0 at the first sample [rad].
    """

    cut: Cut
    use: str
    turns: Turns
    said: Prediction
    mean: Floats
    high: Floats
    low: Floats
    band_high: Floats
    band_low: Floats
    plane: float
    phase: float
    mean_percent: Floats
    peak_percent: Floats


@dataclass(frozen=True, eq=False)
class Fitted:
    """What a fit ends with: ``material`` None where it cannot be written, and ``failures`` then says why."""

    job: FitJob
    fit: Fit
    comparisons: tuple[Comparison, ...]
    material: Material | None
    failures: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def holds(self) -> bool:
        """Whether the search ended, a material can be written, and the stated limits hold."""
        return not self.failures


# -- reading ----------------------------------------------------------------------------------------------------
def load_fit(path: str | Path) -> FitJob:
    """Read a fit and every file that it names; files are relative to its folder.

    Raises
    ------
    InputError
        The file, or one that it names, cannot be read or does not say what is needed.
    """
    file = Path(path)
    try:
        data = file.read_bytes()
        values = tomllib.loads(data.decode("utf-8"))
    except OSError as err:
        raise InputError(f"fit {file.name}: cannot be read: {err.strerror}") from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as err:
        raise InputError(f"fit {file.name}: not a TOML file: {err}") from None
    try:
        table = FitTable.model_validate(values)
        _check(table)
        cutter = cutter_from_table(table.cutter, file.parent)
        arc = _arc(table.engagement, cutter)
    except ValidationError as err:
        raise InputError(f"{file.name}: {_first(err)}") from None
    except InputError as err:
        raise InputError(f"{file.name}: {err}") from None
    cuts, findings, hashes = [], [], {file.name: sha256(data).hexdigest()}
    for k, m in enumerate(table.measurement):
        target = file.parent / m.file
        try:
            if m.window_s is not None and not m.window_s[0] < m.window_s[1]:
                raise InputError(f"window_s = {list(m.window_s)}: must rise")
            measured, noticed = read_forces(target, m.window_s)
            channels = m.channels or table.channels
            force = np.full((len(measured.force), 3), np.nan)
            side = -1.0 if channels.on == "work" else 1.0
            for c, key in enumerate(CHANNELS):
                said = getattr(channels, key)
                if said is not None:
                    sign, name = (-1.0, said[1:]) if said.startswith("-") else (1.0, said.removeprefix("+"))
                    force[:, c] = side * sign * measured.column(name.strip())
            cuts.append(
                Cut(
                    m.file, measured.rate, force, mm_s_from_mm_min(m.feed_mm_min), rad_s_from_rpm(m.speed_rpm), arc,
                    table.engagement.axial_depth_mm,
                )
            )  # fmt: skip
            hashes[m.file] = sha256(target.read_bytes()).hexdigest()
        except InputError as err:
            raise InputError(f"{file.name}: measurement.{k}: {err}") from None
        findings += [Finding(f.code, f.line, f"{m.file}: {f.text}") for f in noticed]
    return FitJob(
        file, table, cutter, tuple(cuts), tuple(m.use for m in table.measurement), tuple(findings), {"sha256": hashes}
    )


def _check(table: FitTable) -> None:
    """What one table alone cannot see."""
    if all(getattr(table.channels, key) is None for key in CHANNELS):
        raise InputError('channels: name at least one of feed, across, axis, as feed = "-Fy"')
    if table.method == "instantaneous" and table.band_hz is None:
        raise InputError("band_hz: missing: state how far the harmonics count, below the resonance of the dynamometer")
    if not any(m.use == "fit" for m in table.measurement):
        raise InputError("measurement: none has use = fit: mark those that the coefficients come from")


def _arc(engagement: EngagementTable, cutter: Cutter) -> tuple[float, float]:
    """The engaged immersion [rad]."""
    depth = engagement.radial_depth_mm
    if engagement.milling == "slot":
        if depth is not None and abs(depth - cutter.diameter) > 1e-6:
            raise InputError(
                f"engagement.radial_depth_mm = {depth:g}: a slot is as wide as the cutter, "
                f"{cutter.diameter:g}: leave it out"
            )
        return 0.0, math.pi
    if depth is None:
        raise InputError("engagement.radial_depth_mm: missing: state it for up and down milling")
    if not depth <= cutter.diameter:
        raise InputError(
            f"engagement.radial_depth_mm = {depth:g}: must be at most cutter.diameter_mm = {cutter.diameter:g}"
        )
    a = math.acos(1.0 - depth / cutter.radius)
    return (0.0, a) if engagement.milling == "up" else (math.pi - a, math.pi)


def _first(err: ValidationError) -> str:
    """The first thing that is wrong, in our words; an unknown key before what it leaves missing."""
    rows = sorted(err.errors(include_url=False), key=lambda e: e["type"] != "extra_forbidden")
    e = rows[0]
    key = ".".join(str(x) for x in e["loc"])
    if e["type"] == "extra_forbidden":
        tables: dict[str, type[BaseModel]] = {
            "engagement": EngagementTable, "channels": ChannelsTable, "dynamometer": DynamometerTable,
            "axial": AxialTable, "limits": LimitsTable, "measurement": MeasurementTable,
        }  # fmt: skip
        inside = [str(x) for x in e["loc"][:-1] if isinstance(x, str)]
        model = tables.get(inside[-1], FitTable) if inside else FitTable
        return f"{key}: unknown key; did you mean {nearest(str(e['loc'][-1]), list(model.model_fields))}?"
    if e["type"] == "missing":
        return f"{key}: missing: state it"
    words = {
        "greater_than": f"must be above {e.get('ctx', {}).get('gt', 0):g}",
        "float_type": "must be a number",
        "float_parsing": "must be a number",
        "string_type": "must be a text",
        "string_too_short": "must not be empty",
        "literal_error": f"must be one of {str(e.get('ctx', {}).get('expected', '')).replace(' or ', ', ')}",
        "too_short": "has no entry: state at least one",
    }
    return f"{key}: {words.get(e['type'], e['msg'])}"


# -- running ----------------------------------------------------------------------------------------------------
def run_fit(job: FitJob, progress: Progress = silent) -> Fitted:
    """Fit the coefficients and predict every cut of the job.

    Raises
    ------
    InputError
        As :func:`chipload.cutting.fit.fit_average` and :func:`chipload.cutting.fit_turns.fit_instantaneous`.
    """
    table = job.table
    cuts = [cut for cut, use in zip(job.cuts, job.uses, strict=True) if use == "fit"]
    progress(0.0, "fit")
    if table.method == "average":
        fit = fit_average(cuts, job.cutter)
    else:
        rings = [getattr(table.dynamometer, f"{key}_hz") for key in CHANNELS]
        fit = fit_instantaneous(
            cuts, job.cutter, band=math.tau * (table.band_hz or 0.0), runout=table.runout == "seek", zero=table.zero,
            ringing=[None if hz is None else math.tau * hz for hz in rings],
        )  # fmt: skip
    progress(0.7, "predict")
    comparisons = tuple(_compared(fit, cut, use) for cut, use in zip(job.cuts, job.uses, strict=True))
    failures = [] if fit.converged else ["the search for runout and phase did not end: widen the windows"]
    failures += _exceeded(table.limits, comparisons)
    notes = list(fit.notes)
    material, why = _material(job, fit, notes)
    progress(1.0, "fitted")
    return Fitted(job, fit, comparisons, material, tuple(failures + why), tuple(notes))


def _compared(fit: Fit, cut: Cut, use: str) -> Comparison:
    said = predict(fit, cut)
    turns = turns_of(cut, fit.harmonics or min(8, math.floor(0.8 * math.pi * cut.rate / cut.speed)))
    mean, high, low = (x.mean(axis=0) for x in (turns.mean, turns.high, turns.low))
    larger = np.abs(high) >= np.abs(low)
    k = np.arange(1, len(turns.amplitude))
    theta = np.linspace(0.0, math.tau, TURN, endpoint=False)
    band = turns.amplitude[0].real + 2.0 * (np.exp(1j * np.outer(theta, k)) @ turns.amplitude[1:]).real
    return Comparison(
        cut, use, turns, said, mean, high, low, band.max(axis=0), band.min(axis=0), float(turns.plane.mean()),
        aligned(fit, cut, turns), _percent(said.mean, mean),
        _percent(np.where(larger, said.high, said.low), np.where(larger, high, low)),
    )  # fmt: skip


def _percent(said: Floats, seen: Floats) -> Floats:
    """How far off, in percent of what was seen; NaN where that is 0."""
    size = np.where(seen == 0.0, np.nan, np.abs(seen))
    return np.asarray((said - seen) / size * 100.0)


def _exceeded(limits: LimitsTable, comparisons: tuple[Comparison, ...]) -> list[str]:
    """Predictions that are farther off than is allowed."""
    out = []
    for c in comparisons:
        for word, limit, errors in (
            ("mean", limits.mean_percent, c.mean_percent),
            ("peak", limits.peak_percent, c.peak_percent),
        ):
            if limit is not None and c.use == "predict":
                out += [
                    f"{c.cut.name}: {word} {key} is off by {e:.3g} % of at most {limit:g} %"
                    for key, e in zip(CHANNELS, errors, strict=True)
                    if abs(e) > limit
                ]
    return out


def _material(job: FitJob, fit: Fit, notes: list[str]) -> tuple[Material | None, list[str]]:
    """The material, or why there is none."""
    table = job.table
    values = fit.values.copy()
    source = table.source
    if not fit.identified[[2, 5]].any() and table.axial is not None:
        values[2], values[5] = table.axial.kac_mpa, table.axial.kae_n_mm
        source += f"; axial coefficients: {table.axial.source}"
    lost = [name for name, v in zip(NAMES, values, strict=True) if not math.isfinite(v)]
    if lost:
        what = "measure them or state [axial]" if set(lost) <= {"Kac", "Kae"} else "measure more feeds or channels"
        return None, [f"no material is written: {', '.join(lost)} not identified: {what}"]
    chip = max(cut.feed_per_tooth(job.cutter.flutes) for cut in fit.cuts) + 2.0 * fit.cutter.runout[0]
    cutter = job.cutter
    said = f"{cutter.name or 'end mill'}, D {cutter.diameter:g} mm, {cutter.flutes} teeth, helix "
    said += f"{math.degrees(cutter.helix):g} deg"
    cuts = f"{table.engagement.milling}, {table.engagement.axial_depth_mm:g} mm deep"
    numbers: dict[str, Any] = {name: float(f"{v:.6g}") for name, v in zip(NAMES, values, strict=True)}
    covariance: Any = None
    if np.isfinite(fit.covariance).all():
        covariance = tuple(tuple(float(f"{v:.9g}") for v in row) for row in fit.covariance)
    else:
        notes.append("how sure the coefficients are is not written: the covariance of all six is not known")
    try:
        made = Material(
            name=table.name, source=f"{source}; {table.method} fit", workpiece=table.workpiece, cutter=said,
            conditions="; ".join(x for x in (table.conditions, cuts) if x), chip=(0.0, float(f"{chip:.6g}")),
            covariance=covariance, **numbers,
        )  # fmt: skip
    except InputError as err:
        return None, [f"no material is written: {err}"]
    return made, []


def material_text(material: Material) -> str:
    """The material as :func:`chipload.cutting.material.read_material` reads it."""
    text: Callable[[str], str] = lambda s: json.dumps(s, ensure_ascii=False)  # noqa: E731
    lines = [f"name = {text(material.name)}"]
    if material.workpiece:
        lines.append(f"workpiece = {text(material.workpiece)}")
    keys = ("ktc_mpa", "krc_mpa", "kac_mpa", "kte_n_mm", "kre_n_mm", "kae_n_mm")
    lines += [f"{key} = {float(v)!r}" for key, v in zip(keys, material.coefficients, strict=True)]
    if material.chip is not None:
        lines += [f"chip_min_mm = {material.chip[0]!r}", f"chip_max_mm = {material.chip[1]!r}"]
    if material.covariance is not None:
        rows = ",\n".join(f"    [{', '.join(repr(v) for v in row)}]" for row in material.covariance)
        lines.append(f"covariance = [\n{rows},\n]")
    lines += [f"source = {text(material.source)}", f"cutter = {text(material.cutter)}"]
    lines.append(f"conditions = {text(material.conditions)}")
    return "\n".join(lines) + "\n"
