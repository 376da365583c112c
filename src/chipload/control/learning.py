"""Force coefficients of a material learned from logs of the spindle while programs ran.

Notation: C, E [N mm] mean torque of a step with the cutting and the edge coefficients of the prior material, w spindle
speed [rad/s], x_c = Ktc / Ktc prior, x_e = Kte / Kte prior, g gain of the signal, d wear of the edge a second of
cutting. A block of a log has the mean signal

    y = idle_0 + idle_1 w + g (1 + u) w (x_c C + x_e (1 + d s) E)

for power, and without w for current and torque; s [s] is the time for which the tool has cut. Unknown are x_c, x_e,
d of each tool, idle_0 of each log, idle_1 where the speed changes, g within the error of the spindle's data, and u, the
error of the simulated torque, common to a log. All have Gaussian priors; those of x_c and x_e are the material's. The
greatest posterior is found by least squares, and its covariance is that of the linear model there. The noise is what
the blocks scatter, more where a block and the next scatter together.

Power and current tell the tangential coefficients alone: the radial and axial ones stay as they were.

Reference: [Altintas2012] ch. 2 for the torque.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.control.log_alignment import AlignedLog, PredictedTorque, align_log
from chipload.control.log_blocks import LogBlocks, blocks_of
from chipload.control.logs import SpindleLog
from chipload.cutting.learned import GainKnowledge, LearnedRecord, LogEvidence
from chipload.cutting.material import Material
from chipload.errors import Finding, InputError, Severity
from chipload.lazy import scipy
from chipload.number_text import number_text

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: tangential coefficients among the six
TANGENTIAL = [0, 3]
#: error of a simulated mean torque, common to a log, as a standard deviation (docs/accuracy.md: within 0.5 % of brute
#: force for steady cuts; engagement and entry add to it)
TORQUE_ERROR = 0.02
#: prior of the wear of an edge: its coefficient may double in so many seconds of cutting, as a standard deviation
WEAR_SCALE_S = 600.0
#: a block further than so many standard deviations from the posterior is left out; of those that scatter normally,
#: 1 of 15,000 is
OUTLIER = 4.0
#: efficiency of a spindle drive that is not stated, and its relative standard deviation: 0.9 with a belt, 0.7 to 0.8
#: with gears [Machinery2020, efficiency of machine tools]; that of one which is stated without its error
EFFICIENCY, EFFICIENCY_ERROR, STATED_ERROR = 0.8, 0.1, 0.05
#: coefficients further from the prior than so many of its standard deviations are another material's
BELIEVED = 3.0
#: share of blocks that may be left out of a log before it contradicts the others
MOST_OUTLIERS = 0.2


class SignalKind(enum.StrEnum):
    """What a log measures of the spindle: the name of its column."""

    POWER = "power"
    CURRENT = "current"
    TORQUE = "torque"


@dataclass(frozen=True)
class Signal:
    """What logs measure of the spindle, and how it follows from the cut.

    Parameters
    ----------
    kind : of the signal
    gain : of the signal over the power [N mm/s] or the torque [N mm] of the cut: 1 / efficiency, 1 / torque constant
        [A/(N mm)], 1
    gain_error : its relative standard deviation
    """

    kind: SignalKind
    gain: float
    gain_error: float

    def __post_init__(self) -> None:
        if not 0.0 < self.gain < math.inf:
            raise InputError(f"signal.gain = {self.gain:g}: must be above 0")
        if not 0.0 <= self.gain_error < 1.0:
            raise InputError(f"signal.gain_error = {self.gain_error:g}: must be from 0 to below 1")

    def of_torque(self, speed: Floats) -> Floats:
        """Return what a gain of 1 makes of a torque of 1 at speeds (n,) [rad/s]."""
        return speed if self.kind is SignalKind.POWER else np.ones(len(speed))


def signal_of_logs(
    logs: Iterable[SpindleLog], efficiency: float | None = None, efficiency_error: float | None = None
) -> Signal:
    """Return the signal of logs that all have torque, or all have power.

    Parameters
    ----------
    efficiency : power of the cut over the logged power, above 0 to 1; None: EFFICIENCY
    efficiency_error : its relative standard deviation, from 0 to below 1; None: that of EFFICIENCY, or STATED_ERROR

    Raises
    ------
    InputError
        Neither is in all logs, a number is out of range, or an efficiency is stated for logs of torque.
    """
    read = list(logs)
    stated = efficiency is not None or efficiency_error is not None
    if all(log.torque is not None for log in read):
        if stated:
            raise InputError("efficiency: not used: the logs state the torque: leave it out")
        return Signal(SignalKind.TORQUE, 1.0, 0.0)
    if not all(log.power is not None for log in read):
        raise InputError("no column of power or torque that all logs have; of current, state the spindle")
    return power_signal(efficiency, efficiency_error)


def power_signal(efficiency: float | None = None, efficiency_error: float | None = None) -> Signal:
    """Return the signal of the power of a spindle; parameters and errors as :func:`signal_of_logs`.

    >>> power_signal(), power_signal(0.5).gain_error
    (Signal(kind=<SignalKind.POWER: 'power'>, gain=1.25, gain_error=0.1), 0.05)
    """
    own = EFFICIENCY if efficiency is None else efficiency
    error = efficiency_error
    if error is None:
        error = EFFICIENCY_ERROR if efficiency is None else STATED_ERROR
    if not 0.0 < own <= 1.0:
        raise InputError(f"efficiency = {own:g}: must be above 0 and at most 1")
    if not 0.0 <= error < 1.0:
        raise InputError(f"efficiency_error = {error:g}: must be from 0 to below 1")
    return Signal(SignalKind.POWER, 1.0 / own, error)


@dataclass(frozen=True, eq=False)
class LearnedMaterial:
    """A material after logs were read.

    Parameters
    ----------
    material, prior : after and before
    wear : tool number -> growth of Kte an hour of cutting, relative, and its standard deviation
    gain : what the logs tell of the gain of the signal
    fit_error : log -> signal of its cut over what the new coefficients predict, less 1
    blocks : log -> (used, left out)
    findings : what contradicts the model, by line
    """

    material: Material
    prior: Material
    wear: dict[int, tuple[float, float]]
    gain: GainKnowledge
    fit_error: dict[str, float]
    blocks: dict[str, tuple[int, int]]
    findings: tuple[Finding, ...]

    @property
    def used(self) -> int:
        """Blocks that were used."""
        return sum(used for used, _ in self.blocks.values())

    @property
    def left_out(self) -> int:
        """Blocks that were left out."""
        return sum(out for _, out in self.blocks.values())

    @property
    def deviations(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Relative standard deviations of Ktc and Kte: (before, before), (after, after)."""
        before, after = (np.sqrt(np.diagonal(tangential_shares(m))) for m in (self.prior, self.material))
        return (float(before[0]), float(before[1])), (float(after[0]), float(after[1]))

    @property
    def torque_known(self) -> tuple[float, float]:
        """Relative standard deviation of the torque that the logs tell best, and the share of the efficiency, or of
        the torque constant, in its variance: w'Vw of Ktc and Kte with the weights w that make it least.
        """
        shares = tangential_shares(self.material)
        weights = np.linalg.pinv(shares, hermitian=True).sum(axis=1)
        weights /= weights.sum()
        variance = float(weights @ shares @ weights)
        common = float(weights @ np.array([self.gain.with_ktc, self.gain.with_kte]))
        rest = self.gain.deviation**2 * variance
        return math.sqrt(variance), min(common**2 / rest, 1.0) if rest > 0.0 else 0.0


class _SpindleModel:
    """Parameters of several logs in one vector, with their priors, and the prediction of every block."""

    def __init__(self, logs: Sequence[LogBlocks], signal: Signal, prior: Material) -> None:
        self.logs, self.signal = logs, signal
        self.tools = sorted({int(t) for log in logs for t in np.unique(log.tool[log.edge > 0.0])})
        speeds = np.concatenate([log.speed for log in logs])
        self.slope = bool(np.ptp(speeds) > 0.02 * speeds.max())
        n = len(logs)
        # x_c, x_e, gain, wear of tools, error of logs, idle of logs, idle with speed
        self.wear = slice(3, 3 + len(self.tools))
        self.error = slice(self.wear.stop, self.wear.stop + n)
        self.idle = slice(self.error.stop, self.error.stop + n)
        self.size = self.idle.stop + int(self.slope)
        share = tangential_shares(prior)
        typical = max(float(np.abs(np.concatenate([log.signal for log in logs])).max()), np.finfo(np.float64).tiny)
        self.mean = np.zeros(self.size)
        self.mean[:3] = 1.0
        gain = _known_gain(prior, signal)
        deviation = np.full(self.size, 10.0 * typical)
        deviation[2] = max(signal.gain_error, 1e-6)
        deviation[self.wear], deviation[self.error] = 1.0 / WEAR_SCALE_S, TORQUE_ERROR
        if self.slope:
            deviation[-1] = 10.0 * typical / speeds.max()
        covariance = np.diag(deviation**2)
        # a coefficient of 0, as Kte with a size effect, stays
        covariance[:2, :2] = share + np.diag(np.where(np.diagonal(share) > 0.0, 0.0, 1e-12))
        if gain is not None:
            self.mean[2], covariance[2, 2] = gain.ratio, gain.deviation**2
            covariance[2, :2] = covariance[:2, 2] = gain.with_ktc, gain.with_kte
        self.root = np.linalg.inv(np.linalg.cholesky(covariance))

    def predict(self, x: Floats, k: int) -> Floats:
        """Return the signal of the blocks of log k."""
        log = self.logs[k]
        wear = np.zeros(len(log.time))
        for tool, d in zip(self.tools, x[self.wear], strict=True):
            wear[log.tool == tool] = d
        torque = x[0] * log.cutting + x[1] * (log.edge + wear * log.edge_time)
        out = x[self.idle][k] + self.signal.gain * x[2] * (1.0 + x[self.error][k]) * torque * self.signal.of_torque(
            log.speed
        )
        return np.asarray(out + x[-1] * log.speed if self.slope else out)

    def start(self) -> Floats:
        """Return the prior, with the idle signal of each log where nothing is cut."""
        x = self.mean.copy()
        for k, log in enumerate(self.logs):
            air = log.cutting + log.edge == 0.0
            x[self.idle.start + k] = np.median(log.signal[air]) if air.any() else log.signal.min()
        return x


def _known_gain(prior: Material, signal: Signal) -> GainKnowledge | None:
    """Return what the logs of the prior tell of the gain; None: it was learned with no or another gain.

    An error of the gain is common to all logs of a spindle. It does not become smaller by learning again, as that of a
    gain which were drawn anew with each log would.
    """
    gain = prior.learned.gain if prior.learned is not None else None
    if gain is None or gain.signal != signal.kind.value:
        return None
    same = math.isclose(gain.stated, signal.gain, rel_tol=1e-6)
    return gain if same and math.isclose(gain.stated_deviation, signal.gain_error, rel_tol=1e-6, abs_tol=1e-9) else None


def learn_material(
    logs: Sequence[LogBlocks],
    signal: Signal,
    prior: Material,
    name: str = "",
    evidence: str = "",
    worn_s: float | None = None,
) -> LearnedMaterial:
    """Return the material after logs of programs that it was cut with.

    Parameters
    ----------
    logs : of one machine, one material and cutters of one kind
    signal : what they measure
    prior : with a spread or a covariance
    name : of the new material; empty: that of the prior with ``-learned``
    evidence : which logs, for the source of the material
    worn_s : time for which the tool has cut after the logs [s]: Kte is that of its edge then; None: of a sharp edge

    Raises
    ------
    InputError
        The prior states no spread, ``worn_s`` is stated and there are several tools, no block is in the cut, the unit
        of the signal is wrong, or logs contradict one another.
    """
    logs = [log for log in logs if len(log.time)]
    if not any((log.cutting > 0.0).any() for log in logs):
        raise InputError("no log has a block in the cut: at least three samples in a row are needed")
    for log in logs:
        _check_unit(log, signal)
    model = _SpindleModel(logs, signal, prior)
    kept = [np.ones(len(log.time), dtype=np.bool_) for log in logs]
    noise = [_noise(log, signal) for log in logs]
    for _ in range(5):
        x, covariance, residuals = _greatest(model, kept, noise)
        fresh = [np.abs(r) <= OUTLIER for r in residuals]
        if all((a == b).all() for a, b in zip(fresh, kept, strict=True)):
            break
        kept = fresh
    off = x[model.error]
    if len(logs) > 1 and np.abs(off).max() > OUTLIER * TORQUE_ERROR:
        # of three logs the two that agree are right
        against = (1.0 + off) / (1.0 + np.median(off)) - 1.0
        worst = int(np.argmax(np.abs(against)))
        raise InputError(
            f"{logs[worst].name}: its cut takes {share_text(against[worst])} than that of the other logs, at most "
            f"{100.0 * OUTLIER * TORQUE_ERROR:.0f} % is believed: one of them has another tool or material, or a worn "
            "edge; leave it out"
        )
    findings = _far_from_prior(prior, x)
    findings += [f for k in range(len(logs)) for f in _findings_of(model, x, k, kept[k], noise[k])]
    for log, own in zip(logs, kept, strict=True):
        out = 1.0 - own.mean()
        if out > MOST_OUTLIERS:
            raise InputError(
                f"{log.name}: {100.0 * out:.0f} % of its blocks contradict the program and the other logs, at most "
                f"{100.0 * MOST_OUTLIERS:.0f} % may: another tool, another material, or worn out; leave it out"
            )
    wear = {
        tool: (
            3600.0 * float(x[model.wear][j]),
            3600.0 * math.sqrt(covariance[model.wear.start + j, model.wear.start + j]),
        )
        for j, tool in enumerate(model.tools)
    }
    for tool, (mean, sd) in wear.items():
        if mean > 2.0 * sd:
            text = (
                f"tool {tool}: Kte grows by {100.0 * mean:.3g} +- {number_text(200.0 * sd, 2)} % an hour "
                "of cutting: the edge wears"
            )
            findings.append(Finding("log-wear", 0, text, Severity.NOTE))
    counts = [(int(own.sum()), int((~own).sum())) for own in kept]
    ratio, shares = _edge_after(model, x, covariance, worn_s)
    material = _material_after(prior, ratio[:2], shares[:2, :2], name, evidence)
    across = [float(shares[2, k] / ratio[k]) if ratio[k] else 0.0 for k in range(2)]
    gain = GainKnowledge(
        signal.kind.value, signal.gain, signal.gain_error, float(ratio[2]), math.sqrt(shares[2, 2]), *across
    )
    return LearnedMaterial(
        material, prior, wear, gain,
        {log.name: _fit_error(model, x, k, kept[k]) for k, log in enumerate(logs)},
        {log.name: count for log, count in zip(logs, counts, strict=True)}, tuple(findings),
    )  # fmt: skip


def _edge_after(model: _SpindleModel, x: Floats, covariance: Floats, worn_s: float | None) -> tuple[Floats, Floats]:
    """Return x_c, x_e and the gain with their covariance (3, 3), x_e of the edge after it has cut for ``worn_s``."""
    if worn_s is None:
        return x[:3], covariance[:3, :3]
    if len(model.tools) > 1:
        raise InputError(
            f"edge: the logs have tools {', '.join(map(str, model.tools))}: a material has one edge: learn a sharp "
            "one, or log the tools apart"
        )
    d = model.wear.start
    change = np.zeros((3, len(x)))
    change[[0, 1, 2], [0, 1, 2]] = 1.0, 1.0 + x[d] * worn_s, 1.0
    change[1, d] = x[1] * worn_s
    return np.array([x[0], x[1] * (1.0 + x[d] * worn_s), x[2]]), change @ covariance @ change.T


def share_text(share: float) -> str:
    """Return a difference in words.

    >>> share_text(0.046), share_text(-0.2)
    ('4.6 % more', '20 % less')
    """
    return f"{number_text(100.0 * abs(share), 2)} % {'more' if share >= 0.0 else 'less'}"


def tangential_shares(material: Material) -> Floats:
    """Return the covariance (2, 2) of Ktc and Kte relative to them; 0 for a coefficient of 0.

    >>> plain = Material("plain", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for this example", spread=0.1)
    >>> tangential_shares(plain).round(9).tolist()
    [[0.01, 0.0], [0.0, 0.0]]
    """
    values = np.array(material.coefficients)[TANGENTIAL]
    size = np.outer(values, values)
    own = material.variances[np.ix_(TANGENTIAL, TANGENTIAL)]
    return np.divide(own, size, out=np.zeros((2, 2)), where=size > 0.0)


def _far_from_prior(prior: Material, x: Floats) -> list[Finding]:
    """Return a finding on each coefficient that the spread of the prior does not explain."""
    out = []
    for name, ratio, sd in zip(("Ktc", "Kte"), x[:2], np.sqrt(np.diagonal(tangential_shares(prior))), strict=True):
        if sd > 0.0 and abs(ratio - 1.0) > BELIEVED * sd:
            text = (
                f"{name} is {number_text(float(ratio), 3)} times that of {prior.name}, {abs(ratio - 1.0) / sd:.1f} "
                "of its standard deviations away: another material or tool, or a wrong efficiency"
            )
            out.append(Finding("log-material", 0, text, Severity.UNPROVEN))
    return out


def learn_from_logs(
    logs: Mapping[str, SpindleLog],
    predicted: PredictedTorque,
    signal: Signal,
    prior: Material,
    sensor_lag: float = 0.0,
    name: str = "",
    hashes: Mapping[str, str] = MappingProxyType({}),
    *,
    worn: bool = False,
) -> tuple[LearnedMaterial, list[AlignedLog]]:
    """Align logs of one program with its simulation and learn from them.

    Parameters
    ----------
    logs : by name, in the order in which they ran with the same tools
    predicted : of the program, with the prior material
    signal, prior, name : as :func:`learn_material`
    sensor_lag : time constant of the sensor [s]; 0: it is found
    hashes : log -> SHA-256 of its bytes, for the record of the material
    worn : Kte is that of the edge after the last log, with which the next program is cut; else of a sharp edge

    Raises
    ------
    InputError
        As :func:`chipload.control.log_alignment.align_log` and :func:`learn_material`; a log lacks the signal, or the
        prior was learned from it.
    """
    refuse_known_logs(prior, hashes)
    aligned: list[AlignedLog] = []
    blocks: list[LogBlocks] = []
    cut = predicted.cut_seconds
    for key, log in logs.items():
        columns = {SignalKind.POWER: log.power, SignalKind.CURRENT: log.current, SignalKind.TORQUE: log.torque}
        values = columns[signal.kind]
        if values is None:
            raise InputError(f"{key}: no column of {signal.kind}, which the other logs have: learn from them apart")
        aligned.append(align_log(key, log, values, predicted, sensor_lag))
        before = {tool: len(blocks) * seconds for tool, seconds in cut.items()}
        blocks.append(blocks_of(aligned[-1], predicted, before))
    evidence = ", ".join(f"{key} (sha256 {hashes[key][:16]})" if key in hashes else key for key in logs)
    found = learn_material(blocks, signal, prior, name, evidence, len(blocks) * max(cut.values()) if worn else None)
    material = replace(found.material, learned=_record(found, aligned, hashes))
    gaps = tuple(f for one in aligned for f in one.findings)
    return replace(found, material=material, findings=(*gaps, *found.findings)), aligned


def refuse_known_logs(prior: Material, hashes: Mapping[str, str]) -> None:
    """Refuse logs that a material was learned from.

    Parameters
    ----------
    hashes : log -> SHA-256 of its bytes

    Raises
    ------
    InputError
        One of them is.
    """
    known = {log.sha256 for log in prior.learned.logs} if prior.learned is not None else set()
    for key, value in hashes.items():
        if value in known:
            raise InputError(
                f"{key}: {prior.name} was learned from it: a log counts once, or its interval would be too narrow; "
                "leave it out, or start from the material before"
            )


def _record(found: LearnedMaterial, aligned: Iterable[AlignedLog], hashes: Mapping[str, str]) -> LearnedRecord:
    """Return what the material was before the first log, and all its logs."""
    own, prior = [], found.prior
    for log in aligned:
        inside = np.flatnonzero(log.row >= 0)
        rows = (int(inside[0]) + 1, int(inside[-1]) + 1)
        own.append(LogEvidence(log.name, hashes.get(log.name, ""), rows, *found.blocks[log.name]))
    if prior.learned is not None:
        return replace(prior.learned, logs=(*prior.learned.logs, *own), worth=(), gain=found.gain)
    before = found.deviations[0]
    return LearnedRecord(prior.name, (prior.Ktc, before[0]), (prior.Kte, before[1]), tuple(own), gain=found.gain)


def _check_unit(log: LogBlocks, signal: Signal) -> None:
    """Refuse a signal whose size is 10 or 1000 times off: the unit."""
    load = (log.cutting + log.edge) * signal.of_torque(log.speed)
    if not (load > 0.0).any():
        return
    centred = load - load.mean()
    ratio = float(centred @ (log.signal - log.signal.mean()) / max(float(centred @ centred), 1e-300)) / signal.gain
    if ratio > 0.0 and not 0.2 < ratio < 5.0:
        tens = 10.0 ** round(math.log10(ratio))
        raise InputError(
            f"{log.name}: {signal.kind} is {number_text(ratio, 3)} times what the program predicts: check "
            "its unit (a factor of "
            f"{tens:g}) and the data of the spindle"
        )


def _greatest(
    model: _SpindleModel, kept: Sequence[NDArray[np.bool_]], noise: Sequence[Floats]
) -> tuple[Floats, Floats, list[Floats]]:
    """Return the greatest posterior, its covariance, and the residuals of all blocks over their noise."""

    def residuals(x: Floats) -> list[Floats]:
        return [(log.signal - model.predict(x, k)) / noise[k] for k, log in enumerate(model.logs)]

    def misfit(x: Floats) -> Floats:
        parts = [r[own] for r, own in zip(residuals(x), kept, strict=True)]
        return np.concatenate([*parts, model.root @ (x - model.mean)])

    found = scipy.optimize.least_squares(misfit, model.start(), x_scale="jac")
    return found.x, np.linalg.inv(found.jac.T @ found.jac), residuals(found.x)


def _noise(log: LogBlocks, signal: Signal) -> Floats:
    """Return the standard deviation of the blocks of a log: how they scatter about the line that fits the log alone,
    and what a shift of a sample changes.

    Residuals of neighbours that are alike (correlation r) count as fewer: variance times (1 + r) / (1 - r).
    """
    factor = signal.of_torque(log.speed)
    design = np.column_stack(
        [np.ones(len(log.time)), *(factor * part for part in (log.cutting, log.edge, log.edge_time))]
    )
    scale = np.abs(design).max(axis=0)
    design = design[:, scale > 0.0] / scale[scale > 0.0]
    own = np.zeros(len(log.time))
    weight = np.ones(len(log.time))
    least = max(1e-3 * float(np.ptp(log.signal)), np.finfo(np.float64).tiny)
    for _ in range(10):
        line, *_ = np.linalg.lstsq(design * weight[:, None], log.signal * weight, rcond=None)
        own = log.signal - design @ line
        # the scatter by the median, which outliers do not move
        size = max(1.4826 * float(np.median(np.abs(own))), least)
        weight = np.sqrt(1.0 / (1.0 + (own / (2.0 * size)) ** 2))
    inside = own[np.abs(own) <= OUTLIER * size]
    below = float(inside @ inside)
    r = min(max(float(inside[1:] @ inside[:-1]) / below, 0.0), 0.9) if below > 0.0 and len(inside) > 8 else 0.0
    return np.asarray(np.sqrt(size**2 * (1.0 + r) / (1.0 - r) + (signal.gain * factor * log.misfit) ** 2))


def _findings_of(model: _SpindleModel, x: Floats, k: int, kept: NDArray[np.bool_], noise: Floats) -> list[Finding]:
    """Return what is wrong with blocks that were left out: air where metal should be, metal where none should be."""
    log = model.logs[k]
    expected = model.predict(x, k)
    idle = x[model.idle][k] + (x[-1] * log.speed if model.slope else 0.0)
    cut = expected - idle
    share = np.divide(log.signal - idle, cut, out=np.full(len(cut), np.nan), where=cut > 5.0 * noise)
    out = []
    kinds = {
        "log-air": ((share < 0.2), "cuts air where the program cuts material: missing stock, or a broken tool"),
        "log-more": ((share > 1.3), "is above what the program predicts: more stock, another tool, or a worn edge"),
        "log-metal": ((cut <= 0.0) & (log.signal - idle > 5.0 * noise), "shows a cut where the program cuts air"),
    }
    for code, (wrong, text) in kinds.items():
        wrong = _with_neighbour(wrong & ~kept)
        if wrong.any():
            first = int(np.flatnonzero(wrong)[0])
            lines = sorted({int(v) for v in log.line[wrong]})
            at = f"lines {lines[0]} to {lines[-1]}" if len(lines) > 1 else f"line {lines[0]}"
            message = (
                f"{log.name}: {at}, at {number_text(log.time[first])} s: {model.signal.kind} {text} "
                f"({int(wrong.sum())} blocks)"
            )
            out.append(Finding(code, lines[0], message, Severity.UNPROVEN))
    return out


def _with_neighbour(wrong: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the blocks of which the one before or after is wrong too: one alone is where a line begins or ends."""
    edge = np.concatenate([[False], wrong, [False]])
    return np.asarray(wrong & (edge[:-2] | edge[2:]))


def _fit_error(model: _SpindleModel, x: Floats, k: int, kept: NDArray[np.bool_]) -> float:
    """Return the mean cut of a log over its prediction, less 1."""
    log = model.logs[k]
    idle = x[model.idle][k] + (x[-1] * log.speed if model.slope else 0.0)
    own = kept & (log.cutting > 0.0)
    predicted = float((model.predict(x, k) - idle)[own].sum()) / (1.0 + float(x[model.error][k]))
    return float((log.signal - idle)[own].sum()) / predicted - 1.0 if predicted > 0.0 else math.nan


def _material_after(prior: Material, ratio: Floats, share: Floats, name: str, evidence: str) -> Material:
    """Return the prior with other tangential coefficients; the others and their covariance stay.

    Cov(others, tangential) = Cov0(others, tangential) Cov0(tangential)^-1 Cov(tangential), which keeps the matrix
    without negative variances.
    """
    values = np.array(prior.coefficients)
    before = prior.variances
    after = before.copy()
    t, o = TANGENTIAL, [1, 2, 4, 5]
    tangential = share * np.outer(values[t], values[t])
    after[np.ix_(t, t)] = tangential
    across = before[np.ix_(o, t)] @ np.linalg.pinv(before[np.ix_(t, t)], hermitian=True) @ tangential
    after[np.ix_(o, t)], after[np.ix_(t, o)] = across, across.T
    source = f"{prior.source}; tangential coefficients learned from {evidence or 'logs of the spindle'}"
    numbers: dict[str, Any] = {"Ktc": float(values[0] * ratio[0]), "Kte": float(values[3] * ratio[1])}
    covariance: Any = tuple(map(tuple, (0.5 * (after + after.T)).tolist()))
    return replace(
        prior, name=name or f"{prior.name}-learned", source=source, spread=None, spread_directions=None,
        covariance=covariance, **numbers,
    )  # fmt: skip
