"""Error budgets of the loads of a program: parts of the error of each worst value, and what would settle it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from chipload.checking.drilling import THRUST, is_drilling
from chipload.cutter.cutter import Cutter
from chipload.cutting.drilling import MODEL_SPREAD
from chipload.cutting.load_parts import CHIP, MEANS, LoadParts, bounded_parts, bounded_rise, deviation_of_rise
from chipload.cutting.material import Material
from chipload.result.budget import ErrorBudget, ErrorPart, factor_at
from chipload.result.limits import Columns, LimitCheck
from chipload.simulation.accuracy import AXIAL

Floats = NDArray[np.float64]

#: standard deviation of the peak of a turn over its mean, of the measured turns of slots (0.5 to 1.7 %)
TURNS = 0.015
#: loads that follow the force of one rotation
WITH_FORCE = (
    "force_n", "force_xy_n", "force_normal_n", "deflection_um", "deflection_workpiece_um", "form_error_um",
    "cutter_stress_mpa", "stress_mpa", "strength_share", "force_over_allowable",
)  # fmt: skip
#: columns that have a budget, and the load whose parts theirs are
BUDGETED = {
    **dict.fromkeys(WITH_FORCE, "force_n"), "torque_nm": "torque_nm", "torque_mean_nm": "torque_mean_nm",
    # upper bounds: what of the spread of the coefficients acts along the axis is not calculated
    "power_w": "power_w", CHIP: CHIP, THRUST: "torque_mean_nm", AXIAL: AXIAL,
}  # fmt: skip


def budget_parts(
    own: LoadParts,
    load: str,
    cutter: Cutter,
    material: Material,
    error: float,
    peaks: float,
    deflection_mm: float,
    drilling: bool = False,
) -> tuple[ErrorPart, ...]:
    """Return the parts of the error of a load.

    Parameters
    ----------
    own : of the load
    load : its column, of :data:`BUDGETED`
    error : relative, by the resolution of the calculation and the chip
    peaks : how far measured peaks were above predicted ones, relative
    deflection_mm : between cutter and workpiece
    drilling : whether the load is one of a drill along its axis
    """
    mean = BUDGETED[load] in MEANS
    geometric = load == CHIP
    state = f"state runout_mm of tool {cutter.number}, half the reading of a dial gauge"
    fit = "measure the coefficients in a test cut (chipload fit"
    fit += ", or chipload spindle by its power)" if mean else ")"
    textbook = material.covariance is None
    spread = "coefficients, whose spread is not stated" if own.assumed_spread else "coefficients"
    return (
        ErrorPart("resolution and chip", bound=error),
        ErrorPart("measured peaks", bound=0.0 if mean or geometric else peaks),
        ErrorPart("bending", bound=own.bending(deflection_mm)),
        ErrorPart(
            "runout that is not stated" if own.assumed_runout else "runout of unknown direction",
            rise=0.0 if mean else own.rise,
            deviation=0.0 if mean else own.rise_deviation,
            remedy=state if own.assumed_runout else "state runout_deg, the direction of the runout",
            grows=True,
        ),
        ErrorPart(spread, deviation=0.0 if geometric else own.coefficients, remedy=fit if textbook else ""),
        ErrorPart("drill model", deviation=MODEL_SPREAD if drilling and not geometric else 0.0),
        ErrorPart("thin chips", deviation=0.0 if geometric else own.thin_chips, grows=True),
        ErrorPart("turns", deviation=0.0 if mean or geometric else TURNS),
    )


def factors_of_steps(
    parts: Sequence[LoadParts],
    load: str,
    nominal: Floats,
    confidence: float,
    error: float,
    peaks: float,
    deflection_mm: Floats,
) -> Floats:
    """Return (n,) what the value at a confidence is over the nominal one, in each of n steps, as
    :meth:`chipload.result.budget.ErrorBudget.value` of :func:`budget_parts`.

    At other feeds than those of ``parts`` the runout adds the same to a load; what the load then is tells its share.

    Parameters
    ----------
    parts : of each step, at a feed near the one of ``nominal``
    load : column, of :data:`BUDGETED`
    nominal : (n,) the load whose parts they are, as the force of a deflection
    error, peaks : as in :func:`budget_parts`
    deflection_mm : (n,) between cutter and workpiece
    """
    kind, n = BUDGETED[load], len(nominal)
    size, rise, spread, thin, depth = (
        np.array([(x.load, x.rise, x.coefficients, x.thin_chips, x.radial_depth) for x in parts]).reshape(n, 5).T
    )
    assumed = np.array([x.assumed_runout for x in parts])
    mean, geometric = kind in MEANS, load == CHIP
    # of a load that is another one of the force, as a deflection, the force itself is the measure
    share = np.divide(size, nominal, out=np.ones(n), where=nominal > 0.0)
    rise = np.zeros(n) if mean else rise * share
    random = np.zeros(n) if geometric else spread**2 + thin**2
    if not mean and not geometric:
        random = random + TURNS**2
    bends = np.divide(deflection_mm, depth, out=np.zeros(n), where=depth > 0.0)
    bounds = error + (0.0 if mean or geometric else peaks) + bends
    return factor_at(confidence, bounds, rise, np.sqrt(random + np.where(assumed, deviation_of_rise(rise), 0.0) ** 2))


def bounded_factors(columns: Columns, cutters: Mapping[int, Cutter], material: Material, confidence: float) -> Floats:
    """Return (n,) what the peak of each step may be at a confidence over its nominal value with its bounds, from upper
    bounds of the parts of its error; 1 at 0.5.
    """
    chip, tool = (np.asarray(columns[name]) for name in (CHIP, "tool"))
    out = np.ones(len(chip))
    for number in np.unique(tool).tolist() if confidence > 0.5 else ():
        own, cutter = tool == number, cutters.get(int(number), cutters[min(cutters)])
        rise, worst = bounded_rise(cutter, material, chip[own]), bounded_parts(cutter, material, 0.0)
        scatter = deviation_of_rise(rise) if worst.assumed_runout else 0.0
        deviation = np.sqrt(worst.coefficients**2 + TURNS**2 + scatter**2)
        out[own] = factor_at(confidence, 0.0, rise, deviation)
    return out


def budget_of(
    check: LimitCheck,
    confidence: float,
    cutters: Mapping[int, Cutter],
    material: Material,
    known: Mapping[tuple[int, str], LoadParts],
    columns: Columns,
    peaks: float,
) -> ErrorBudget | None:
    """Return the budget of the worst value of a check; None: it is not one of a load, or has no value.

    Parameters
    ----------
    known : parts by tool and load, of the steps that were computed again; the others have upper bounds
    columns : of the track
    peaks : how far measured peaks were above predicted ones, relative
    """
    load = check.column.name
    if check.worst is None or load not in BUDGETED or not cutters:
        return None
    row = check.row
    tool = int(columns["tool"][row]) if row is not None and "tool" in columns else min(cutters)
    cutter = cutters.get(tool, cutters[min(cutters)])
    own = known.get((tool, BUDGETED[load]))
    if own is None:
        own = bounded_parts(cutter, material, _value_in_row(columns, CHIP, row))
    deflection = 1e-3 * _value_in_row(columns, "deflection_um", row)
    drills = is_drilling(columns, row)
    return ErrorBudget(confidence, budget_parts(own, load, cutter, material, check.error, peaks, deflection, drills))


def _value_in_row(columns: Columns, name: str, row: int | None) -> float:
    """Size of a column in a row; its greatest where the row is not known, 0 where the column is not there."""
    if name not in columns:
        return 0.0
    values: NDArray[np.float64] = np.abs(np.asarray(columns[name], dtype=np.float64))
    return float(values.max(initial=0.0) if row is None else values[row])
