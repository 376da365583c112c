"""Stability of a simulated program: the margin of every step, its limit, quiet speeds, numbers.

One calculation serves all steps with the same cut, see :mod:`chipload.stability.grouping`. The axial direction is rigid
unless a mode moves along z. Modes have directions in the machine, so that the margin of a leaning cutter is not known.
The error of a margin is that of the map and that of the force by the resolution of the simulation.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.dynamics import dynamics_of
from chipload.checking.inputs import CheckInputs
from chipload.checking.stability_watch import PROBABILITY, StabilityWatch, relative_covariance
from chipload.checking.workpiece_compliance import WorkpieceCompliance
from chipload.cutting.load_parts import with_spread
from chipload.cutting.material import Material
from chipload.machine.machine import Machine
from chipload.result import CoveredRows, LimitCheck, check_limit, error_of
from chipload.result.budget import ErrorBudget, ErrorPart
from chipload.result.limits import Columns, hold_at_confidence
from chipload.stability.cuts import join_dynamic_cuts
from chipload.stability.margin import MOST_MARGIN, stability_margins
from chipload.stability.probability import stable_probability, variance_shares
from chipload.stability.speeds import QuietSpeeds, quiet_speeds, speed_windows
from chipload.units import rpm_from_rad_s

Floats = NDArray[np.float64]

#: limits of stability, and the margin that is checked where none is stated
STABILITY_LIMITS = ("stability_margin", PROBABILITY, "sle_um")
DEFAULT_MARGIN = 1.0
#: relative error of a margin by the map and by rounding what steps cut
MARGIN_ERROR = 0.01
#: steps with the least margins for which the error of followed frequencies is calculated
UNSURE = 48
#: probabilities of stability [%] that windows of speeds are given at, where spreads of the modes are stated
SURE = (50, 95)
#: waves of the fastest mode in a tooth period at the least speed that is searched: slower ones have no pockets
MOST_WAVES = 20.0
#: speeds that are searched, evenly spaced in their logarithm, and how a speed is rounded [1/min]
SPEEDS, ROUND_RPM = 161, 10.0


def _tool_of(unknown: str) -> int | None:
    """Return the tool whose modes a text on what is not stated names; None: it is on something else."""
    words = unknown.split()
    return int(words[3]) if words[:3] == ["modes", "of", "tool"] else None


@dataclass(frozen=True, eq=False)
class StabilityResult:
    """Stability of a program: margins of its different cuts, and quiet speeds of its tools.

    Parameters
    ----------
    watch : with every different cut
    machine : whose spindle bounds the speeds
    wanted : the least required margin
    radii : of the cutters [mm], by tool
    fastest : greatest speed of the cutters [rad/s], by tool; one that is not known is left out
    speeds : least and greatest speed to consider [1/min]; None: that of the machine
    """

    watch: StabilityWatch
    machine: Machine
    wanted: float
    radii: Mapping[int, float]
    fastest: Mapping[int, float]
    speeds: tuple[float | None, float | None] = (None, None)

    def reason(self, tools: NDArray[Any]) -> str:
        """Return why margins may be smaller, for the ``tools`` that cut; empty if the margins are known."""
        used = {int(t) for t in tools}
        dynamics = self.watch.dynamics
        out = [text for text in dynamics.unknown if _tool_of(text) in (None, *used)]
        texts = [f"{', '.join(out)} {'is' if len(out) == 1 else 'are'} not stated"] if out else []
        leaning = sorted(self.watch.leaning & used)
        if leaning:
            texts.append(f"tool {leaning[0]} leans: modes are known for an upright axis only")
        return "; ".join(texts)

    @cached_property
    def quiet(self) -> Mapping[int, QuietSpeeds]:
        """Least margins of each tool over spindle speed."""
        out = {}
        for tool in sorted(self.watch.cuts):
            parts = self.watch.parts(tool)
            low, high = self.range_of(tool)
            if parts is not None and high > low:
                out[tool] = quiet_speeds([parts], np.geomspace(low, high, SPEEDS), self.wanted)
        return out

    @cached_property
    def stable_share(self) -> Mapping[int, Floats]:
        """Probability of stability over the speeds of :attr:`quiet`, by tool, of the cut with the least margin at each.

        Empty if spreads of the modes are not stated.
        """
        spread, out = self.watch.dynamics.spread, {}
        if spread is not None:
            for tool, quiet in self.quiet.items():
                parts = self.watch.parts(tool)
                if parts is not None and quiet.cut is not None:
                    some = parts.chosen(quiet.cut).at_speeds(parts.pitch / quiet.speed)
                    out[tool] = stable_probability(some, spread, relative_covariance(self.watch.material))
        return out

    def variance_shares(self, tool: int) -> dict[str, float]:
        """Return the variance shares of the cut of a tool that is nearest to chatter, by cause, greatest first."""
        spread, parts = self.watch.dynamics.spread, self.watch.parts(tool)
        if spread is None or parts is None:
            return {}
        worst = parts.chosen([int(np.argmin(stability_margins(parts).margin))])
        modes, cutting = variance_shares(worst, spread, relative_covariance(self.watch.material))
        out = {"cutting coefficients": cutting}
        for number, shares in zip(self.watch.numbers(tool), modes.tolist(), strict=True):
            for what, share in zip(("frequency", "damping ratio", "stiffness"), shares, strict=True):
                out[f"{what} of {self.watch.name_of(number)}"] = share
        return dict(sorted(out.items(), key=lambda item: -item[1]))

    @cached_property
    def frequency_share(self) -> float:
        """Relative decrease of the least margins if the followed frequencies change by their error either way."""
        watch, worst = self.watch, 0.0
        if not watch.follows or watch.workpiece is None:
            return 0.0
        for tool, some in sorted(watch.cuts.items()):
            margin = np.array([x[0] for x in watch.known[tool].values()])
            first = np.argsort(margin, kind="stable")[:UNSURE]
            cuts, count = join_dynamic_cuts(some).chosen(first), watch.workpiece.frequency.shape[1]
            for sign in (-1.0, 1.0):
                factor = np.ones(cuts.omega.shape[1])
                factor[-count:] += sign * watch.workpiece.error
                off = stability_margins(replace(cuts, omega=cuts.omega * factor)).margin
                worst = max(worst, 1.0 - float(off.min() / margin[first].min()))
        return worst

    def range_of(self, tool: int) -> tuple[float, float]:
        """Return the range of speeds [rad/s] of a tool by machine, job and coefficients, without very slow speeds."""
        per = rpm_from_rad_s(1.0)
        low, high = (x / per if x is not None else None for x in self.speeds)
        low = max(low or 0.0, self.machine.spindle_min, 0.02 * self.machine.spindle_max)
        high = min(high or math.inf, self.machine.spindle_max)
        high = min(high, self.fastest.get(tool, math.inf))
        some = self.watch.cuts.get(tool)
        if some:
            stated = self.watch.dynamics.modes.get(tool)
            fastest = float(stated.frequency.max() if stated is not None else some[0].omega.min() / math.tau)
            low = max(low, fastest * some[0].pitch / MOST_WAVES)
        radius, measured = self.radii.get(tool, 0.0), self.watch.material.speed
        if measured is not None and radius > 0.0:
            low, high = max(low, measured[0] / radius), min(high, measured[1] / radius)
        return low, high


def stability_limits(
    stability: StabilityResult | None,
    stated: Mapping[str, float],
    columns: Columns,
    track: str,
    errors: Mapping[str, float],
    direction: str,
    confidence: float,
) -> tuple[LimitCheck, ...]:
    """Return the checks of :data:`STABILITY_LIMITS`: those of the job, and a margin of 1 if modes are stated.

    Parameters
    ----------
    stability : of the track; None: no modes are stated
    stated : limits of the job
    errors : relative error of columns by the resolution of the simulation
    direction : why the direction of forces is not known; empty: it is
    confidence : one-sided, at which the margin is held with the spread of the coefficients; 0.5: at the nominal margin
    """
    limits = {name: stated[name] for name in STABILITY_LIMITS if name in stated}
    if stability is None:
        return tuple(
            check_limit(name, v, {}, track=track, reason="no [dynamics] is stated") for name, v in limits.items()
        )
    limits.setdefault("stability_margin", DEFAULT_MARGIN)
    margin = np.asarray(columns["stability_margin"])
    cutting = cutting_rows(columns)
    reason = direction or stability.reason(np.unique(np.asarray(columns["tool"])[cutting]))
    if not reason and (margin[cutting] == 0.0).any():
        reason = "the margin of some steps is unknown"
    error = MARGIN_ERROR + stability.frequency_share + error_of("force_n", errors)
    out = []
    for name, limit in limits.items():
        why = reason
        if name == "sle_um" and not why and (margin[cutting] < 1.0).any():
            why = "the error of a step that chatters is undefined"
        if name == "sle_um" and not why and (slow := stability.watch.slow_tool()) is not None:
            why = f"tool {slow} turns so slowly that the harmonics of its force do not reach its modes"
        if name == "sle_um" and any(stability.watch.material.exponents):
            why = f"material {stability.watch.material.name} has a size effect"
        uneven = [t for t in np.unique(np.asarray(columns["tool"])[cutting]).tolist() if stability.watch.uneven(int(t))]
        if name == "sle_um" and uneven:
            why = f"the teeth of tool {int(uneven[0])} differ"
        spatial = [
            t for t in np.unique(np.asarray(columns["tool"])[cutting]).tolist() if stability.watch.spatial(int(t))
        ]
        if name == "sle_um" and spatial and not uneven:
            why = f"tool {int(spatial[0])} and workpiece move along the axis"
        rows = CoveredRows(margin > 0.0, "cuts with a known margin", "where one is calculated")
        if name == "sle_um":
            rows = CoveredRows(cutting, "cuts at a feed", "where a wall is made")
        known = 0.0 if name == PROBABILITY else error
        check = check_limit(name, limit, columns, track=track, rows=rows, error=known, reason=why)
        if name == "stability_margin" and check.worst is not None:
            check = hold_at_confidence(check, _margin_budget(stability.watch.material, confidence, error))
        out.append(check)
    return tuple(out)


def _margin_budget(material: Material, confidence: float, error: float) -> ErrorBudget:
    """Return the error budget of the stability margin: it is inversely proportional to the coefficients."""
    spread = float(np.sqrt(np.diag(relative_covariance(with_spread(material))).max()))
    fit = "measure the coefficients in a test cut (chipload fit)" if material.covariance is None else ""
    name = "coefficients" if material.has_band else "coefficients, whose spread is not stated"
    known = error if math.isfinite(error) else 0.0
    parts = (ErrorPart("resolution and frequencies", bound=known), ErrorPart(name, deviation=spread, remedy=fit))
    return ErrorBudget(confidence, parts)


def cutting_rows(columns: Columns) -> NDArray[np.bool_]:
    """Return a mask (n,) of the steps that cut at a feed."""
    return np.asarray((np.asarray(columns["chip_areas"]) > 0) & ~np.asarray(columns["rapid"]))


def filled_margins(columns: Mapping[str, NDArray[Any]]) -> NDArray[np.float64]:
    """Return ``stability_margin`` with the greatest margin where nothing is cut; 0 where it is not known."""
    margin = np.asarray(columns["stability_margin"])
    return np.asarray(np.where((margin == 0.0) & ~cutting_rows(columns), MOST_MARGIN, margin))


def filled_probability(columns: Mapping[str, NDArray[Any]]) -> NDArray[np.float64]:
    """Return ``stable_probability`` with 1 where nothing is cut."""
    known = np.asarray(columns[PROBABILITY])
    return np.asarray(np.where((known == 0.0) & ~cutting_rows(columns), 1.0, known))


def stability_numbers(stability: StabilityResult, columns: Columns) -> dict[str, Any]:
    """Return ``stability`` of the operation in summary.json: the step nearest to chatter, quiet speeds of its tool."""
    margin = np.asarray(columns["stability_margin"])
    known = np.flatnonzero(margin > 0.0)
    dynamics = stability.watch.dynamics
    process = None if dynamics.process is None else asdict(dynamics.process)
    out: dict[str, Any] = {
        "margin_wanted": stability.wanted, "not_stated": list(dynamics.unknown), "process_damping": process,
    }  # fmt: skip
    if not len(known):
        empty = dict.fromkeys(("margin_min", "line", "tool", "chatter_hz", "mode", "speed_rpm", "speed_rpm_advised"))
        return {**out, **empty, "stable_probability": None, "margin_advised": None, "windows": [], "different_cuts": 0}
    k = int(known[np.argmin(margin[known])])
    tool, number = int(columns["tool"][k]), int(columns["chatter_mode"][k])
    speed = speed_of(columns, k)
    quiet = stability.quiet.get(tool)
    out |= {
        "margin_min": float(margin[k]),
        "stable_probability": float(np.asarray(columns[PROBABILITY])[known].min()) if PROBABILITY in columns else None,
        "line": int(columns["line"][k]),
        "tool": tool,
        "chatter_hz": float(columns["chatter_hz"][k]),
        "mode": stability.watch.name_of(number),
        "speed_rpm": speed,
        "speed_rpm_advised": None,
        "margin_advised": None,
        "windows": [],
        "different_cuts": sum(map(len, stability.watch.known.values())),
    }
    if dynamics.spread is not None:
        out["variance_shares"] = stability.variance_shares(tool)
    workpiece = stability.watch.workpiece
    if stability.watch.follows and workpiece is not None:
        followed = _followed_numbers(stability.watch, columns, stability.wanted)
        out["workpiece_modes"] = {"frequency_error_percent": 100.0 * workpiece.error, **followed}
    if stability.quiet:
        out["chart"] = [
            {
                "tool": number,
                "speed_rpm": [round(rpm_from_rad_s(v), 2) for v in own.speed.tolist()],
                "margin": [round(m, 4) for m in own.margin.tolist()],
            }
            for number, own in stability.quiet.items()
        ]
    if quiet is not None:
        best, least = quiet.advised(speed / rpm_from_rad_s(1.0))
        out |= {"speed_rpm_advised": rounded_rpm(best), "margin_advised": least}
        out["windows"] = [
            {"low_rpm": rpm_from_rad_s(w.low), "high_rpm": rpm_from_rad_s(w.high), "margin": w.margin}
            for w in quiet.windows
        ]
        if tool in stability.stable_share:
            for share in SURE:
                out[f"windows_{share}_percent"] = [
                    {"low_rpm": rpm_from_rad_s(w.low), "high_rpm": rpm_from_rad_s(w.high), "probability": w.margin}
                    for w in speed_windows(quiet.speed, stability.stable_share[tool], 0.01 * share)
                ]
    return out


def _followed_numbers(watch: StabilityWatch, columns: Columns, wanted: float) -> dict[str, Any]:
    """Return the modes of the workpiece for summary.json, and the results with its modes before the first cut."""
    margin, line = np.asarray(columns["stability_margin"]), np.asarray(columns["line"])
    steps = np.array(sorted(watch.first_margin), dtype=np.int64)
    first = np.array([watch.first_margin[k] for k in steps.tolist()])
    differs = (first < wanted) != (margin[steps] < wanted)
    k = int(np.argmin(first))
    return {
        "start_state_margin_min": float(first[k]),
        "start_state_line": int(line[steps[k]]),
        "verdict_differs_steps": int(differs.sum()),
        "verdict_differs_lines": np.unique(line[steps[differs]]).tolist(),
    }


def speed_of(columns: Columns, k: int) -> float:
    """Return the spindle speed [1/min] of a cutting step from its power and mean torque."""
    torque = float(columns["torque_mean_nm"][k])
    return round(rpm_from_rad_s(float(columns["power_w"][k]) / torque), 6) if torque > 0.0 else 0.0


def rounded_rpm(speed: float) -> float:
    """Return a speed [rad/s] rounded as it is written in a program [1/min]."""
    return ROUND_RPM * round(rpm_from_rad_s(speed) / ROUND_RPM)


def watch_of(inputs: CheckInputs, workpiece: WorkpieceCompliance | None) -> StabilityWatch | None:
    """Return the watch that computes the margins of a program; None if no modes are stated."""
    if inputs.elasticity.vibration is None:
        return None
    dynamics = dynamics_of(inputs.elasticity.vibration, inputs.cutters, inputs.elasticity.workpiece)
    return StabilityWatch(dynamics, inputs.material, None if workpiece is None else workpiece.modes)


def stability_of(inputs: CheckInputs, watch: StabilityWatch) -> StabilityResult:
    """Return the stability result of a watch that has seen every step."""
    wanted = max(inputs.limits.stability_margin or DEFAULT_MARGIN, DEFAULT_MARGIN)
    radii = {n: c.radius for n, c in inputs.cutters.items()}
    fastest = {n: c.max_speed for n, c in inputs.cutters.items() if c.max_speed is not None}
    return StabilityResult(watch, inputs.machine, wanted, radii, fastest, inputs.speeds_rpm)
