"""Checks that every capability makes unless the job switches them off: their columns and their limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.checking.feed_law import feed_law_of
from chipload.checking.load_budget import budget_of
from chipload.checking.rubbing import over_feed, rubbing_text, spindle_speed
from chipload.checking.settings import CheckSettings
from chipload.cutter.cutter import Cutter
from chipload.cutting.load_parts import LoadParts
from chipload.cutting.material import Material
from chipload.cutting.rigid import OF_DEPTH, OF_FEED, deflection_share
from chipload.cutting.strength import allowed_stress, cutter_stress
from chipload.errors import Finding, Severity
from chipload.machine.machine import Machine
from chipload.number_text import number_text, percent_text
from chipload.result import CoveredRows, LimitCheck, Verdict, check_limit, column_of, error_of
from chipload.result.limits import Columns, hold_at_confidence
from chipload.simulation.accuracy import AXIAL
from chipload.simulation.chip_space import flute_fill
from chipload.simulation.loads import Cuts, Floats, Ints
from chipload.simulation.ramp import ramp_angle
from chipload.units import mm_min_from_mm_s

#: columns that these checks add to those of the simulation
CHECK_COLUMNS = ("cutter_stress_mpa", "deflection_share")
#: columns that they add to those of a program
PROGRAM_COLUMNS = (*CHECK_COLUMNS, "ramp_deg")
#: a ramp that is at most so much steeper than its limit is as steep [deg]; one that is as much flatter than 90 a plunge
STEEPER = 1e-3


#: steps with less than this share of the greatest load of their tool are not judged by their deflection: the cutter
#: only touches there
LOADED = 0.1
#: what is not checked at a confidence of 0.5
NOMINAL = "at 50 % the spread of coefficients and runout: not counted, checks.confidence is 0.5"
#: share by which the thickest chip between the paths of two teeth may be above the feed, by which a range was measured
RANGE_SLACK = 1e-3
#: the column by which :func:`_could_be_greatest` judges a step, the first that a track has
LOADS = ("force_n", "force_xy_n", "force_normal_n", "torque_mean_nm")
#: what a load does at its place, which a light load may do most
PLACED = (
    "deflection_um", "deflection_workpiece_um", "form_error_um", "stress_mpa", "strength_share", "force_over_allowable",
)  # fmt: skip
#: loads whose direction is not known where the material has a tangential force alone
DIRECTED = (
    "force_n", "deflection_um", "deflection_workpiece_um", "form_error_um", "cutter_stress_mpa", "deflection_share",
)  # fmt: skip
#: columns that follow the greatest force of a turn, not its mean
PEAKS = (
    *DIRECTED, "force_xy_n", "force_normal_n", "force_over_allowable", "stress_mpa", "strength_share", "torque_nm",
    AXIAL,
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class DefaultChecks:
    """Checks in addition to the limits that the job states.

    Parameters
    ----------
    cutters : by tool number
    material : whose coefficients the loads have
    off : names of checks that are switched off
    confidence : one-sided, at which limits of loads are held; 0.5: at their nominal values
    parts : of the errors of the worst loads of the run, by tool and load; what is not among them has upper bounds
    of_feed, of_depth : deflection over feed per tooth and radial depth up to which the rigid model holds
    """

    cutters: Mapping[int, Cutter]
    material: Material
    off: tuple[str, ...] = ()
    confidence: float = CheckSettings.confidence
    parts: Mapping[tuple[int, str], LoadParts] = field(default_factory=dict)
    of_feed: float = OF_FEED
    of_depth: float = OF_DEPTH

    @property
    def unknown_direction(self) -> str:
        """Why forces and what they bend are unproven; empty: they are not."""
        return f"{self.material.name} states the tangential force only" if self.material.tangential else ""

    def allowed_stress(self, tools: ArrayLike) -> NDArray[np.float64]:
        """Stress that the cutter of each row may have [MPa]; inf where it is not known."""
        own = {n: allowed_stress(c) for n, c in self.cutters.items()}
        numbers, of = np.unique(np.asarray(tools), return_inverse=True)
        return np.array([own.get(int(n), math.inf) for n in numbers.tolist()])[of]


def default_checks(settings: CheckSettings, cutters: Mapping[int, Cutter], material: Material) -> DefaultChecks:
    """Checks in addition to the stated limits."""
    return DefaultChecks(
        cutters, material, settings.off, settings.confidence, {}, settings.deflection_of_feed,
        settings.deflection_of_depth,
    )  # fmt: skip


def with_checks(
    settings: CheckSettings, material: Material, bends: Callable[[Cuts], Mapping[str, Floats]]
) -> Callable[[Cuts], dict[str, Floats]]:
    """Columns of ``bends``, which has the deflection, and :data:`PROGRAM_COLUMNS`."""

    def columns(cuts: Cuts) -> dict[str, Floats]:
        found = dict(bends(cuts))
        found["cutter_stress_mpa"] = cutter_stress(cuts.engagement, cuts.cutter, material)
        found["deflection_share"] = deflection_share(
            cuts.plain, found["deflection_um"], settings.deflection_of_feed, settings.deflection_of_depth
        )
        found["ramp_deg"] = ramp_angle(cuts)
        return found

    return columns


def check_columns(
    settings: CheckSettings, cuts: Sequence[Cuts], material: Material, deflection_um: Floats
) -> dict[str, Floats]:
    """:data:`CHECK_COLUMNS` of a removal that kept its cuts, and ``flute_fill`` where a gullet is stated.

    Parameters
    ----------
    cuts : one a cutter that cut
    deflection_um : (n,) float, one row for each step of the removal, by which cutter and workpiece part

    Returns
    -------
    columns, (n,) float each; 0 where nothing is cut
    """
    room = any(c.cutter.gullet is not None for c in cuts)
    out = {name: np.zeros(len(deflection_um)) for name in (*CHECK_COLUMNS, *(["flute_fill"] if room else []))}
    for c in cuts:
        out["cutter_stress_mpa"][c.step] = cutter_stress(c.engagement, c.cutter, material)
        out["deflection_share"][c.step] = deflection_share(
            c.plain, deflection_um[c.step], settings.deflection_of_feed, settings.deflection_of_depth
        )
        if c.cutter.gullet is not None:
            out["flute_fill"][c.step] = flute_fill(c)
    return out


def unchecked_checks(checks: DefaultChecks) -> tuple[str, ...]:
    """Checks that are switched off, what a confidence of 0.5 leaves out, and cutters whose chip space is not stated."""
    out = [] if checks.confidence > 0.5 else [NOMINAL]
    out += [f"check {name}: switched off by the job" for name in checks.off]
    roomless = [n for n, c in sorted(checks.cutters.items()) if c.gullet is None and not c.body]
    if roomless:
        out.append(f"chip space of tools {', '.join(map(str, roomless))}: gullet_mm2 is not stated")
    return tuple(out)


def range_findings(checks: DefaultChecks, columns: Columns) -> tuple[Finding, ...]:
    """Chips and cutting speeds outside the range that the coefficients were measured in.

    Parameters
    ----------
    columns : of a track, one row for each step; ``chip_max_mm``, ``power_w`` and ``torque_mean_nm`` among them
    """
    if "chip_range" in checks.off:
        return ()
    return (*_chip_findings(checks, columns), *_speed_findings(checks, columns))


def _speed_findings(checks: DefaultChecks, columns: Columns) -> list[Finding]:
    """Steps that cut slower or faster than the coefficients were measured at, at the cutter's ``diameter_mm``."""
    material = checks.material
    if material.speed is None:
        return []
    low, high = (mm_min_from_mm_s(v) / 1000.0 for v in material.speed)
    radius = {n: c.diameter / 2.0 for n, c in checks.cutters.items()}
    radii = np.array([radius.get(int(n), 0.0) for n in _tools(checks, columns).tolist()])
    speed = mm_min_from_mm_s(1.0) / 1000.0 * spindle_speed(columns) * radii
    out = []
    for side, k in (("below", _least_above_zero(speed)), ("above", int(np.argmax(speed)) if len(speed) else -1)):
        if k < 0 or not (0.0 < speed[k] < low * (1.0 - 1e-6) if side == "below" else speed[k] > high * (1.0 + 1e-6)):
            continue
        text = (
            f"the cutting speed is {number_text(speed[k])} m/min: the coefficients of {material.name} hold "
            f"from {low:g} to "
            f"{high:g} m/min, the loads {side} that are not known"
        )
        out.append(_at_step(f"speed-{side}-coefficients", columns, k, text))
    return out


def _tools(checks: DefaultChecks, columns: Columns) -> Ints:
    """The cutter of each step; a strategy of a contour has one, and no column of them."""
    if "tool" in columns:
        return np.asarray(columns["tool"])
    return np.full(len(next(iter(columns.values()))), min(checks.cutters))


def _least_above_zero(values: Floats) -> int:
    """Index of the least value above 0; -1: none is."""
    return int(np.argmin(np.where(values > 0.0, values, math.inf))) if np.any(values > 0.0) else -1


def _chip_findings(checks: DefaultChecks, columns: Columns) -> tuple[Finding, ...]:
    """Chips that are thicker than those that the coefficients were measured with, and steps where all are thinner.

    Parameters
    ----------
    columns : of a track, one row for each step; ``chip_max_mm`` among them
    """
    material, thick = checks.material, columns["chip_max_mm"]
    chip = material.chip
    if chip is None or len(thick) == 0:
        return ()
    out = []
    k = int(np.argmax(thick))
    if _chip_beyond_range(checks, columns):
        text = (
            f"chips are up to {thick[k]:.4g} mm thick: the coefficients of {material.name} hold up to {chip[1]:g} mm, "
            "the loads beyond that are not known"
        )
        out.append(_at_step("chip-beyond-coefficients", columns, k, text))
    thin = np.flatnonzero((thick > 0.0) & (thick < chip[0] * (1.0 - 1e-9)))
    if len(thin):
        text = (
            f"the chips of {len(thin)} steps are thinner than {chip[0]:g} mm: the coefficients of {material.name} "
            "hold from there, the loads below it are not known"
        )
        out.append(_at_step("chip-below-coefficients", columns, int(thin[0]), text))
    return tuple(out)


def ramp_findings(checks: DefaultChecks, columns: Columns) -> tuple[Finding, ...]:
    """Plunges and ramps into material of cutters that cannot, or are not known to, do so: the steepest of each tool.

    A cutter with a stated ``ramp_angle`` is checked against that instead, see :func:`default_limits`.

    Parameters
    ----------
    columns : of a track, one row for each step; ``ramp_deg`` among them, else nothing is found
    """
    if "plunge" in checks.off or "ramp_deg" not in columns:
        return ()
    ramp, tool, out = np.asarray(columns["ramp_deg"]), _tools(checks, columns), []
    for number, cutter in sorted(checks.cutters.items()):
        own = np.where(tool == number, ramp, 0.0)
        k = int(np.argmax(own)) if len(own) else 0
        if cutter.ramp_angle is not None or cutter.plunges or not len(own) or not own[k] > STEEPER:
            continue
        plunge = own[k] >= 90.0 - STEEPER
        does = "plunges into solid material" if plunge else f"ramps into solid material at {own[k]:.3g} deg"
        if cutter.centre_cutting is None:
            why = (
                f"whether its {cutter.flutes} teeth reach its axis is not known: state centre_cutting, or "
                "ramp_angle_deg (RMPX), in its [[cutter]]"
            )
        elif plunge:
            why = "no tooth cuts under its centre (centre_cutting = false): enter by a ramp, a helix or a drilled hole"
        else:
            why = (
                "how steep it may is not known (centre_cutting = false): state ramp_angle_deg (RMPX) in its [[cutter]]"
            )
        found = _at_step("plunge", columns, k, f"tool {number} {does}: {why}")
        severe = plunge and cutter.centre_cutting is False
        out.append(replace(found, severity=Severity.EXCEEDS) if severe else found)
    return tuple(out)


def _chip_beyond_range(checks: DefaultChecks, columns: Columns) -> float:
    """The thickest chip [mm] where it is above those that the coefficients were measured with; 0: none is."""
    chip = checks.material.chip
    if chip is None or "chip_range" in checks.off or "chip_max_mm" not in columns:
        return 0.0
    thickest = float(np.max(columns["chip_max_mm"], initial=0.0))
    return thickest if thickest > chip[1] * (1.0 + RANGE_SLACK) else 0.0


def _at_step(code: str, c: Columns, k: int, text: str) -> Finding:
    """A finding that leaves the result unproven, at a step."""
    place = (float(c["x_mm"][k]), float(c["y_mm"][k]), float(c["z_mm"][k]))
    return Finding(code, int(c["line"][k]) if "line" in c else 0, text, Severity.UNPROVEN, place, k)


def stated_limits(
    checks: DefaultChecks | None,
    limits: Mapping[str, float],
    columns: Columns,
    track: str,
    errors: Mapping[str, float],
    rows: Mapping[str, CoveredRows] | None = None,
) -> tuple[LimitCheck, ...]:
    """Return the check of each limit that a job states, a load with the parts of its error.

    Parameters
    ----------
    checks : of the loads; None: no coefficients are known, and no load is limited
    limits : by name
    columns : of the track, one row for each step
    track : its name
    errors : relative error of columns by the resolution
    rows : that a limit covers, by its name; all steps where it is not among them
    """
    found = (
        check_limit(
            name, limit, columns, track=track, rows=(rows or {}).get(name),
            error=error_of(column_of(name).name, errors),
        )
        for name, limit in limits.items()
    )  # fmt: skip
    return tuple(check if checks is None else with_budget(check, checks, columns) for check in found)


def default_limits(
    checks: DefaultChecks, machine: Machine, columns: Columns, track: str, errors: Mapping[str, float]
) -> tuple[LimitCheck, ...]:
    """Spindle torque and power, chip space, cutter stress, flute length, and whether the rigid model holds.

    Parameters
    ----------
    columns : of the track, one row for each step
    track : its name
    errors : relative error of columns by the resolution
    """
    out: list[LimitCheck] = []
    if "spindle" not in checks.off:
        out += _spindle(machine, columns, track, errors)
    if "flute_fill" in columns and "chip_space" not in checks.off:
        out.append(check_limit("flute_fill", 1.0, columns, track=track, error=error_of("flute_fill", errors)))
    direction = checks.unknown_direction
    if "cutter_strength" not in checks.off and "cutter_stress_mpa" in columns:
        allowed = checks.allowed_stress(columns["tool"])
        k = int(np.argmax(columns["cutter_stress_mpa"] / allowed))
        if np.isfinite(allowed[k]):
            limit, error = float(allowed[k]), error_of("cutter_stress_mpa", errors)
            check = check_limit("cutter_stress_mpa", limit, columns, track=track, at=k, error=error, reason=direction)
            out.append(check)
    if "flute_length" not in checks.off and "axial_overrun_mm" in columns:
        # what stands in material above the flutes is found to half a layer, see simulation.shank
        out.append(check_limit("axial_overrun_mm", 0.0, columns, track=track, error=0.0))
    if "plunge" not in checks.off and "ramp_deg" in columns:
        out += _ramp(checks, columns, track)
    if "rigid_model" not in checks.off and "deflection_share" in columns:
        rows, error = _could_be_greatest(columns, checks), error_of("deflection_share", errors)
        why = direction or ("" if rows.mask.any() else "nothing is cut")
        check = check_limit("deflection_share", 1.0, columns, track=track, rows=rows, error=error, reason=why)
        out.append(_rigid(check, checks, columns))
    return tuple(with_budget(check, checks, columns) for check in out)


def _ramp(checks: DefaultChecks, columns: Columns, track: str) -> list[LimitCheck]:
    """The steepest ramp over the ramp angle of its cutter, where one is stated."""
    stated = {n: math.degrees(c.ramp_angle) for n, c in checks.cutters.items() if c.ramp_angle is not None}
    tool, ramp = _tools(checks, columns), np.asarray(columns["ramp_deg"])
    if not len(tool) or not np.isin(tool, list(stated)).any():
        return []
    allowed = np.array([stated.get(n, math.inf) for n in tool.tolist()])
    ramp = np.where(ramp <= allowed + STEEPER, np.minimum(ramp, allowed), ramp)
    k = int(np.argmax(np.where(np.isfinite(allowed), ramp / allowed, -1.0)))
    return [check_limit("ramp_deg", float(allowed[k]), {**columns, "ramp_deg": ramp}, track=track, at=k)]


def _could_be_greatest(columns: Columns, checks: DefaultChecks) -> CoveredRows:
    """Steps with a load or a deflection that, greater by what the deflection may add to the chip, would be the greatest
    of their tool.

    A tooth takes at most its feed and the deflection of the tooth before it, and the radial depth is greater by the
    deflection at most: of other steps no value that is limited comes above those that limits are held against.
    """
    load = np.asarray(columns[next(c for c in LOADS if c in columns)])
    tool = np.asarray(columns["tool"]) if "tool" in columns else np.zeros(len(load), dtype=np.int64)
    share = np.asarray(columns["deflection_share"])
    of_feed = np.minimum(checks.of_feed * share, over_feed(columns, tool, checks.cutters))
    more = (1.0 + of_feed) * (1.0 + checks.of_depth * share)
    judged = [np.abs(np.asarray(columns[c])) for c in dict.fromkeys((*LOADS, *PLACED)) if c in columns]
    out = np.zeros(len(load), dtype=np.bool_)
    for number in np.unique(tool):
        own = tool == number
        touches = load[own] < LOADED * load[own].max(initial=0.0)
        could = np.any([v[own] * more[own] >= v[own].max(initial=0.0) for v in judged], axis=0)
        out[own] = could & ~touches & (load[own] > 0.0)
    return CoveredRows(out, "steps with the greatest loads", "where a greater load could follow from it")


def _rigid(check: LimitCheck, checks: DefaultChecks, columns: Columns) -> LimitCheck:
    """A deflection beyond the rigid model makes loads unknown; it is no limit that is exceeded."""
    if check.state is not Verdict.EXCEEDS:
        return check
    if (rubs := rubbing_text(check, checks.material, checks.of_feed, checks.cutters, columns)) is not None:
        return replace(check, state=Verdict.UNPROVEN, reason=rubs)
    reason = "the cutter bends further than the rigid model covers, so its loads are not known: shorten it or cut less"
    return replace(check, state=Verdict.UNPROVEN, reason=reason)


def _spindle(machine: Machine, columns: Columns, track: str, errors: Mapping[str, float]) -> list[LimitCheck]:
    """Torque and power of the spindle; its torque depends on the speed, so the step with the greatest share counts."""
    out = []
    torque = np.asarray(columns["torque_mean_nm"])
    able = machine.torque_at(spindle_speed(columns)) / 1000.0
    k = int(np.argmax(torque / able))
    if np.isfinite(able[k]):
        limit, error = float(able[k]), error_of("torque_mean_nm", errors)
        out.append(check_limit("spindle_torque_nm", limit, columns, track=track, at=k, error=error))
    if machine.power_w is not None:
        error = error_of("power_w", errors)
        out.append(check_limit("spindle_power_w", machine.power_w, columns, track=track, error=error))
    return out


def peak_excess(material: Material, column: str) -> float:
    """How far a column may be above its value because measured peaks were above predicted ones, relative.

    >>> from chipload.cutting.material import Material
    >>> own = Material("own", 800.0, 200.0, 50.0, 20.0, 20.0, 2.0, source="made up", peak_excess=0.4)
    >>> peak_excess(own, "force_n"), peak_excess(own, "torque_mean_nm")
    (0.4, 0.0)
    """
    if column == AXIAL:
        return material.peak_excess_axial
    return material.peak_excess if column in PEAKS else 0.0


def with_budget(check: LimitCheck, checks: DefaultChecks, columns: Columns) -> LimitCheck:
    """Return the check of a load with the parts of its error, held at the confidence of the checks, and as
    :func:`with_peaks`.

    Parameters
    ----------
    columns : of the track, one row for each step
    """
    peaks = peak_excess(checks.material, check.column.name)
    budget = budget_of(check, checks.confidence, checks.cutters, checks.material, checks.parts, columns, peaks)
    law = feed_law_of(check, checks.cutters, checks.material, columns)
    held = replace(with_peaks(check, checks, columns), feed_law=law)
    return held if budget is None else hold_at_confidence(held, budget)


def with_peaks(check: LimitCheck, checks: DefaultChecks, columns: Columns) -> LimitCheck:
    """A check of a peak that holds by prediction alone is unproven where measured peaks were that far above, and where
    a chip is thicker than any that was measured: how far peaks are above there is not known.

    Parameters
    ----------
    columns : of the track, one row for each step; ``chip_max_mm`` among them, where it is known
    """
    if check.state is not Verdict.HOLDS or check.worst is None or check.column.name not in PEAKS:
        return check
    material = checks.material
    if material.chip is not None and (thickest := _chip_beyond_range(checks, columns)):
        reason = f"chips are up to {thickest:.4g} mm thick, {material.name} was measured up to {material.chip[1]:g} mm"
        return replace(check, state=Verdict.UNPROVEN, reason=reason)
    excess = peak_excess(material, check.column.name)
    if abs(check.worst) * (1.0 + check.error) * (1.0 + excess) <= check.limit:
        return check
    reason = f"measured peaks of {material.name} were up to {percent_text(excess)} above predicted ones"
    return replace(check, state=Verdict.UNPROVEN, reason=reason)
