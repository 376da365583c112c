"""Stability of a simulated program: the margin of every step, its limit, quiet speeds, numbers.

Steps that cut alike are asked once, see :mod:`chipload.stability.grouping`. Runout is left out; thrust is rigid; modes
have directions in the machine, so that a cutter that leans is not known. The margin has the error of the map and that
of the force by the resolution of the simulation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.material import Material
from chipload.jobs.program.dynamics import Dynamics
from chipload.jobs.program.stability_state import asked_bytes, joined, read_asked
from chipload.machine.machine import Machine
from chipload.result import LimitCheck, check_limit
from chipload.result.limits import Columns
from chipload.simulation.loads import Cuts
from chipload.stability.cuts import DynamicCuts, dynamic_cuts
from chipload.stability.grouping import grouped
from chipload.stability.margin import MOST_MARGIN, stability_margins
from chipload.stability.probability import stable_probability
from chipload.stability.speeds import QuietSpeeds, quiet_speeds
from chipload.stability.surface_error import force_rows, wall_errors
from chipload.units import rpm_from_rad_s

Floats = NDArray[np.float64]

#: columns that the watch adds
STABILITY_COLUMNS = ("stability_margin", "chatter_hz", "chatter_mode", "sle_um")
#: the one that needs spreads of the modes
PROBABILITY = "stable_probability"
#: limits of these, and the margin that is checked where none is stated
STABILITY_LIMITS = ("stability_margin", PROBABILITY, "sle_um")
DEFAULT_MARGIN = 1.0
#: relative error of a margin by the map and by rounding what steps cut
MARGIN_ERROR = 0.01
#: the axis of the cutter is upright where its z is at least this
UPRIGHT = 1.0 - 1e-9
#: cuts of a tool that speeds are looked for with: those nearest to chatter, and those with most edge in cut
NEAREST, LARGEST = 12, 12
#: waves of the fastest mode in a tooth period at the least speed that is looked at: slower ones have no pockets
MOST_WAVES = 20.0
#: speeds that are looked at, evenly spaced in their logarithm, and how a speed is rounded [1/min]
SPEEDS, ROUND_RPM = 161, 10.0


@dataclass(eq=False)
class StabilityWatch:
    """A watch that gives :data:`STABILITY_COLUMNS`, and keeps what it was asked.

    Parameters
    ----------
    dynamics : modes by tool
    material : whose coefficients count
    """

    dynamics: Dynamics
    material: Material
    known: dict[int, dict[bytes, tuple[float, ...]]] = field(default_factory=dict)
    cuts: dict[int, list[DynamicCuts]] = field(default_factory=dict)
    leaning: set[int] = field(default_factory=set)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns."""
        return STABILITY_COLUMNS if self.dynamics.spread is None else (*STABILITY_COLUMNS, PROBABILITY)

    def __call__(self, cuts: Cuts) -> dict[str, Floats]:
        """The columns of some steps of one cutter."""
        out = np.zeros((len(cuts), len(self.columns)))
        frame, modes = cuts.plain.frames, self.dynamics.modes.get(cuts.tool)
        upright = bool((frame[:, 2, 2] >= UPRIGHT).all())
        if not upright:
            self.leaning.add(cuts.tool)
        if modes is not None and upright and len(cuts):
            groups = grouped(cuts.plain, cuts.spindle, any(self.material.exponents))
            table = self.known.setdefault(cuts.tool, {})
            new = {key: k for k, key in reversed(list(enumerate(groups.key))) if key not in table}
            if new:
                at = np.array(sorted(new.values()))
                whole = dynamic_cuts(
                    groups.engagement, cuts.cutter, self.material, modes, cuts.spindle, groups.T, groups.n
                )
                some = whole.chosen(at)
                self.cuts.setdefault(cuts.tool, []).append(some)
                for k, values in zip(at.tolist(), self._values(some, whole, at, groups.engagement), strict=True):
                    table[groups.key[k]] = values
            out = np.array([table[key] for key in groups.key])
            number = np.array([0, *self.dynamics.number[cuts.tool]])
            out[:, 2] = number[out[:, 2].astype(np.int64) + 1]
        return dict(zip(self.columns, out.T.copy(), strict=True))

    def _values(
        self, some: DynamicCuts, whole: DynamicCuts, at: NDArray[np.int64], engagement: Any
    ) -> Iterator[tuple[float, ...]]:
        """The columns of new cuts."""
        found = stability_margins(some)
        error = np.zeros(len(some))
        if not any(self.material.exponents):
            size = np.diff(whole.start)[at]
            row = np.concatenate([np.arange(whole.start[k], whole.start[k] + n) for k, n in zip(at, size, strict=True)])
            rows = np.ascontiguousarray(force_rows(engagement, self.material)[row])
            error = np.where(found.margin >= 1.0, 1e3 * wall_errors(some, rows)[0], 0.0)
        columns = [found.margin, found.frequency, found.mode.astype(np.float64), error]
        if self.dynamics.spread is not None:
            columns.append(stable_probability(some, self.dynamics.spread, _relative_covariance(self.material)))
        return zip(*(x.tolist() for x in columns), strict=True)

    def to_bytes(self) -> bytes:
        """What it was asked so far, for the state of a run."""
        return asked_bytes(self.known, self.cuts, self.leaning, len(self.columns))

    def restore(self, path: Path) -> None:
        """Keep what an earlier run was asked."""
        self.known, self.cuts, self.leaning = read_asked(path, self.dynamics.modes, self.material.exponents)

    def clear(self) -> None:
        """Keep nothing."""
        self.known, self.cuts, self.leaning = {}, {}, set()

    def parts(self, tool: int) -> DynamicCuts | None:
        """Cuts of a tool that speeds are looked for with; None: it has none."""
        some = self.cuts.get(tool, [])
        if not some:
            return None
        whole = joined(some)
        margin = np.array([x[0] for x in self.known[tool].values()])
        first = np.argsort(margin, kind="stable")[:NEAREST]
        most = np.argsort(-engaged_edge(whole), kind="stable")[:LARGEST]
        return whole.chosen(np.unique(np.concatenate([first, most])))


def engaged_edge(cuts: DynamicCuts) -> Floats:
    """(n,) length of the edge in cut times its immersion, of each cut [mm rad]."""
    step = np.repeat(np.arange(len(cuts)), np.diff(cuts.start))
    return np.asarray(
        np.bincount(step, (cuts.rows[:, 1] - cuts.rows[:, 0]) * cuts.rows[:, 4], len(cuts)), dtype=np.float64
    )


@dataclass(frozen=True, eq=False)
class StabilityResult:
    """What is known of the stability of a program.

    Parameters
    ----------
    watch : with every different cut
    machine : whose spindle bounds the speeds
    wanted : the least margin that is wanted
    radii : of the cutters [mm], by tool
    speeds : least and greatest speed that is asked for [1/min]; None: that of the machine
    """

    watch: StabilityWatch
    machine: Machine
    wanted: float
    radii: Mapping[int, float]
    speeds: tuple[float | None, float | None] = (None, None)

    def reason(self, tools: NDArray[Any]) -> str:
        """Why margins may be smaller; empty: they are known. ``tools`` that cut."""
        used = {int(t) for t in tools}
        dynamics = self.watch.dynamics
        other = {f"modes of tool {t}" for t in dynamics.number.keys() | dynamics.modes.keys()} - {
            f"modes of tool {t}" for t in used
        }
        out = [text for text in dynamics.unknown if text not in other]
        texts = [f"{', '.join(out)} {'is' if len(out) == 1 else 'are'} not stated"] if out else []
        leaning = sorted(self.watch.leaning & used)
        if leaning:
            texts.append(f"tool {leaning[0]} leans: modes are known for an upright axis only")
        return "; ".join(texts)

    @cached_property
    def quiet(self) -> Mapping[int, QuietSpeeds]:
        """Least margins over speeds, by tool."""
        out = {}
        for tool in sorted(self.watch.cuts):
            parts = self.watch.parts(tool)
            low, high = self.range_of(tool)
            if parts is not None and high > low:
                out[tool] = quiet_speeds([parts], np.geomspace(low, high, SPEEDS), self.wanted)
        return out

    def range_of(self, tool: int) -> tuple[float, float]:
        """Speeds [rad/s] that machine, job and range of the coefficients allow a tool, but for slow ones."""
        per = rpm_from_rad_s(1.0)
        low, high = (x / per if x is not None else None for x in self.speeds)
        low = max(low or 0.0, self.machine.spindle_min, 0.02 * self.machine.spindle_max)
        high = min(high or math.inf, self.machine.spindle_max)
        some = self.watch.cuts.get(tool)
        if some:
            low = max(low, float(some[0].modes.frequency.max()) * some[0].pitch / MOST_WAVES)
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
    sigma: float,
) -> tuple[LimitCheck, ...]:
    """Checks of :data:`STABILITY_LIMITS`: those that the job states, and a margin of 1 where modes are stated.

    Parameters
    ----------
    stability : of the track; None: no modes are stated
    stated : limits of the job
    errors : relative error of columns by the resolution of the simulation
    direction : why the direction of forces is not known; empty: it is
    sigma : the margin is held at coefficients greater by so many of their standard deviations
    """
    limits = {name: stated[name] for name in STABILITY_LIMITS if name in stated}
    if stability is None:
        return tuple(
            check_limit(name, v, {}, track=track, reason="no [dynamics] is stated") for name, v in limits.items()
        )
    limits.setdefault("stability_margin", DEFAULT_MARGIN)
    spread = float(np.sqrt(np.diag(_relative_covariance(stability.watch.material)).max())) if sigma > 0.0 else 0.0
    margin = np.asarray(columns["stability_margin"]) / (1.0 + sigma * spread)
    columns = {**columns, "stability_margin": margin}
    cutting = cutting_rows(columns)
    reason = direction or stability.reason(np.unique(np.asarray(columns["tool"])[cutting]))
    if not reason and (margin[cutting] == 0.0).any():
        reason = "the margin of some steps is not known"
    error = MARGIN_ERROR + (errors.get("force_n", 0.0) if math.isfinite(errors.get("force_n", 0.0)) else 0.0)
    out = []
    for name, limit in limits.items():
        why = reason
        if name == "sle_um" and not why and (margin[cutting] < 1.0).any():
            why = "where a step chatters the error is not a number"
        if name == "sle_um" and any(stability.watch.material.exponents):
            why = f"material {stability.watch.material.name} has a size effect"
        rows = cutting if name == "sle_um" else margin > 0.0
        known = 0.0 if name == PROBABILITY else error
        out.append(check_limit(name, limit, columns, track=track, rows=rows, error=known, reason=why))
    return tuple(out)


def _relative_covariance(material: Material) -> Floats:
    """(2, 2) of the tangential and the radial cutting coefficient, over their sizes; 0: the material does not say."""
    size = np.abs(np.array(material.coefficients[:2]))
    if not material.has_band or not (size > 0.0).all():
        return np.zeros((2, 2))
    return np.asarray(material.variances[:2, :2] / np.outer(size, size))


def cutting_rows(columns: Columns) -> NDArray[np.bool_]:
    """(n,) steps that cut at a feed."""
    return np.asarray((np.asarray(columns["chip_pieces"]) > 0) & ~np.asarray(columns["rapid"]))


def filled_margins(columns: Mapping[str, NDArray[Any]]) -> NDArray[np.float64]:
    """``stability_margin`` with the greatest where nothing is cut; 0 where it is not known."""
    margin = np.asarray(columns["stability_margin"])
    return np.asarray(np.where((margin == 0.0) & ~cutting_rows(columns), MOST_MARGIN, margin))


def filled_probability(columns: Mapping[str, NDArray[Any]]) -> NDArray[np.float64]:
    """``stable_probability`` with 1 where nothing is cut."""
    known = np.asarray(columns[PROBABILITY])
    return np.asarray(np.where((known == 0.0) & ~cutting_rows(columns), 1.0, known))


def stability_numbers(stability: StabilityResult, columns: Columns) -> dict[str, Any]:
    """``stability`` of the operation in summary.json: the step nearest to chatter, and quiet speeds of its tool."""
    margin = np.asarray(columns["stability_margin"])
    known = np.flatnonzero(margin > 0.0)
    dynamics = stability.watch.dynamics
    out: dict[str, Any] = {"margin_wanted": stability.wanted, "not_stated": list(dynamics.unknown)}
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
        "mode": dynamics.name.get(number),
        "speed_rpm": speed,
        "speed_rpm_advised": None,
        "margin_advised": None,
        "windows": [],
        "different_cuts": sum(map(len, stability.watch.known.values())),
    }
    if quiet is not None:
        best, least = quiet.advised(speed / rpm_from_rad_s(1.0))
        out |= {"speed_rpm_advised": rounded_rpm(best), "margin_advised": least}
        out["windows"] = [
            {"low_rpm": rpm_from_rad_s(w.low), "high_rpm": rpm_from_rad_s(w.high), "margin": w.margin}
            for w in quiet.windows
        ]
    return out


def speed_of(columns: Columns, k: int) -> float:
    """Spindle speed of a step that cuts [1/min], from its power and mean torque."""
    torque = float(columns["torque_mean_nm"][k])
    return round(rpm_from_rad_s(float(columns["power_w"][k]) / torque), 6) if torque > 0.0 else 0.0


def rounded_rpm(speed: float) -> float:
    """A speed [rad/s] as it is written [1/min]."""
    return ROUND_RPM * round(rpm_from_rad_s(speed) / ROUND_RPM)
