"""What to measure next for a job: what its deciding load depends on, and the cut whose log narrows it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from chipload.checking.load_budget import BUDGETED
from chipload.checking.outcome import ProgramResult
from chipload.control.log_alignment import PredictedTorque, predicted_torque
from chipload.control.measurement_plan import (
    CalibrationTool,
    CandidateCut,
    Floats,
    best_cut,
    calibration_cuts,
    covariance_after,
    cuts_of_program,
    relative_covariance,
    variance_shares,
)
from chipload.cutting.load_parts import LoadParts, with_spread
from chipload.errors import InputError
from chipload.jobs.knowledge_worth import deciding_load
from chipload.number_text import number_text
from chipload.result import LimitCheck, Result
from chipload.result.budget import ErrorBudget
from chipload.result.limits import Columns

#: of the six coefficients, in their order
NAMES = ("Ktc", "Krc", "Kac", "Kte", "Kre", "Kae")
#: a corner above this share of the diameter, or a ball, has no closed form of its test cut here
LARGEST_CORNER = 0.1
#: least feed per tooth of a test cut over its greatest
LOW_CHIP = 0.25


@dataclass(frozen=True, eq=False)
class LoggedCut:
    """A cut, and what a log of it would leave.

    Parameters
    ----------
    cut : that could be logged
    deviation : relative standard deviation of the load by the coefficients after it
    value : the load at the confidence of its limit after it, if the nominal value stays
    """

    cut: CandidateCut
    deviation: float
    value: float


@dataclass(frozen=True, eq=False)
class NextMeasurement:
    """What narrows the deciding load of a job.

    Parameters
    ----------
    check : its limit
    deviation : its relative standard deviation by the coefficients
    shares : (6,) of that variance by coefficient
    whole, lines, test : the whole program, the best range of its lines of up to 20 s, and the best test cut of 20 s;
        None: no test cut is known for the tool
    exact : deviation after the whole program with an exact gain: what the efficiency costs
    """

    check: LimitCheck
    deviation: float
    shares: Floats
    whole: LoggedCut
    lines: LoggedCut
    test: LoggedCut | None
    exact: float

    @property
    def texts(self) -> list[str]:
        """What to measure, a line each."""
        value, limit = self.check.value_at_confidence or 0.0, self.check.limit
        each = ", ".join(
            f"{name} {number_text(100.0 * share, 2)} %"
            for name, share in zip(NAMES, self.shares, strict=True)
            if abs(share) >= 0.005
        )
        out = [
            f"deciding load: {self.check.name} at confidence {number_text(value, 3)} of {number_text(limit)} "
            f"{self.check.column.unit} {self.check.where}; by the coefficients +- {_percent(self.deviation)} % (two "
            "standard deviations)",
            f"share of that variance: {each}",
        ]
        out += [
            f"a log of {measured.cut.name} ({number_text(measured.cut.seconds)} s): +- {_percent(measured.deviation)} "
            f"%, {self.check.name} at confidence {number_text(measured.value, 3)}"
            for measured in (self.test, self.lines, self.whole)
            if measured is not None
        ]
        if self.exact < 0.7 * self.whole.deviation:
            out.append(
                f"with the efficiency known exactly the whole program would leave +- {_percent(self.exact)} %: state "
                "--efficiency and its error, or --spindle"
            )
        silent = float(self.shares[[1, 2, 4, 5]].sum())
        if silent > 0.2:
            out.append(
                f"{number_text(100.0 * silent, 2)} % of the variance are radial and axial coefficients, which the "
                "spindle does not feel: measure forces (chipload fit)"
            )
        return out


def next_measurement(outcome: ProgramResult, result: Result, gain_error: float, power: bool = True) -> NextMeasurement:
    """Return what to measure next for a job of a program that was run.

    Parameters
    ----------
    outcome, result : of the run
    gain_error : relative standard deviation of the gain from the torque to the signal
    power : whether power is logged; else torque or current

    Raises
    ------
    InputError
        Nothing was simulated, several programs are in use, or no load depends on the coefficients.
    """
    if outcome.simulated is None or len(result.in_use) != 1:
        raise InputError(f"{result.title}: one simulated program is needed: state a job with stock, material, cutters")
    checks, columns = outcome.simulated.checks, result.in_use[0].columns
    material = with_spread(checks.material)
    known = [c for c in result.limits if c.budget is not None and _elasticity(checks.parts, c, columns)]
    check = deciding_load(known)
    if check is None or check.budget is None:
        raise InputError(
            f"{result.title}: no limit of a load depends on the coefficients: state one in [limits], as torque_nm"
        )
    elasticity = _elasticity(checks.parts, check, columns)
    before, e = relative_covariance(material), np.array(elasticity)
    predicted = predicted_torque(columns, result.title)
    whole, ranges = cuts_of_program(predicted, power)
    greatest = float((whole.weight * (whole.cutting + whole.edge)).max())

    def measured(cut: CandidateCut, variance: float) -> LoggedCut:
        deviation = math.sqrt(max(variance, 0.0))
        return LoggedCut(cut, deviation, _value_with(check, deviation))

    def after(error: float) -> float:
        return float(e @ covariance_after(before, whole, greatest, error) @ e)

    tool = _tool_of_cuts(outcome, columns, predicted, check)
    lines = best_cut(ranges, elasticity, before, greatest, gain_error)
    own = calibration_cuts(tool, material, power) if tool is not None else []
    test = best_cut(own, elasticity, before, greatest, gain_error)
    if lines is None:
        raise InputError(f"{result.title}: the program has no cut")
    return NextMeasurement(
        check, math.sqrt(float(e @ before @ e)), variance_shares(elasticity, before),
        measured(whole, after(gain_error)), measured(*lines), measured(*test) if test is not None else None,
        math.sqrt(max(after(0.0), 0.0)),
    )  # fmt: skip


def _percent(deviation: float) -> str:
    return number_text(200.0 * deviation, 2)


def _elasticity(parts: Mapping[tuple[int, str], LoadParts], check: LimitCheck, columns: Columns) -> tuple[float, ...]:
    """Return the elasticities of the load of a check; empty: it is no load, or its step was not computed again."""
    load = check.column.name
    if check.row is None or load not in BUDGETED:
        return ()
    own = parts.get((int(columns["tool"][check.row]), BUDGETED[load]))
    return own.elasticity if own is not None else ()


def _value_with(check: LimitCheck, deviation: float) -> float:
    """Return the load at the confidence of its limit with another deviation by the coefficients."""
    if check.budget is None or check.worst is None:
        return math.nan
    parts = [replace(p, deviation=deviation) if p.name.startswith("coefficients") else p for p in check.budget.parts]
    budget = ErrorBudget(check.budget.confidence, tuple(parts))
    return budget.value(abs(check.worst), budget.shown_at)


def _tool_of_cuts(
    outcome: ProgramResult, columns: Columns, predicted: PredictedTorque, check: LimitCheck
) -> CalibrationTool | None:
    """Return what the tool of the deciding load does in its program, which bounds a test cut; None: a round edge."""
    if outcome.simulated is None or check.row is None:
        return None
    number = int(columns["tool"][check.row])
    cutter, own = outcome.simulated.checks.cutters[number], predicted.tool == number
    chip = float(np.asarray(columns["chip_max_mm"])[own].max())
    if cutter.corner_radius > LARGEST_CORNER * cutter.diameter or chip <= 0.0:
        return None
    return CalibrationTool(
        number, cutter.diameter, cutter.flutes, cutter.flute_length, float(predicted.speed[own].max()),
        (LOW_CHIP * chip, chip), float((predicted.cutting + predicted.edge)[own].max()),
    )  # fmt: skip
