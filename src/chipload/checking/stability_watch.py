"""The watch of a simulation that calculates the stability of every step and stores the results.

One calculation serves all steps with the same cut, see :mod:`chipload.stability.grouping`. If the modes of the
workpiece are followed through the removal, each step has its own modes and its own calculation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.dynamics import Dynamics
from chipload.checking.stability_state import known_cuts_bytes, read_known_cuts
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.simulation.loads import Cuts
from chipload.stability.cuts import DynamicCuts, dynamic_cuts, join_dynamic_cuts
from chipload.stability.grouping import group_steps
from chipload.stability.margin import stability_margins
from chipload.stability.modes import Modes
from chipload.stability.probability import stable_probability
from chipload.stability.surface_error import force_rows, harmonics_reach, wall_errors
from chipload.structure.cells.followed import FollowedModes

Floats = NDArray[np.float64]

#: columns that the watch adds
STABILITY_COLUMNS = ("stability_margin", "chatter_hz", "chatter_mode", "sle_um")
#: the one that needs spreads of the modes
PROBABILITY = "stable_probability"
#: the axis of the cutter is upright where its z is at least this
UPRIGHT = 1.0 - 1e-9
#: cuts of a tool with which speeds are searched: those nearest to chatter, and those with most edge in cut
NEAREST, LARGEST = 12, 12
#: the same of a cutter whose teeth are not alike, of which each takes some times as long
UNEVEN = (4, 2)


@dataclass(eq=False)
class StabilityWatch:
    """A watch that computes :data:`STABILITY_COLUMNS` and stores the results of all different cuts.

    Parameters
    ----------
    dynamics : modes by tool
    material : force coefficients
    workpiece : modes of the workpiece in the state of each step; None: none are known
    first_margin : by step so far, the margin with the modes that the workpiece has before its first cut
    known : by tool, the columns of its different cuts by their key, in the order of ``cuts``
    cut_of, numbers_of : by tool, steps and the numbers of their cuts; and these numbers by the key of the cut
    """

    dynamics: Dynamics
    material: Material
    workpiece: FollowedModes | None = None
    first_margin: dict[int, float] = field(default_factory=dict)
    known: dict[int, dict[bytes, tuple[float, ...]]] = field(default_factory=dict)
    cuts: dict[int, list[DynamicCuts]] = field(default_factory=dict)
    leaning: set[int] = field(default_factory=set)
    cut_of: dict[int, list[tuple[NDArray[np.int64], NDArray[np.int64]]]] = field(default_factory=dict)
    numbers_of: dict[int, dict[bytes, int]] = field(default_factory=dict)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns."""
        return STABILITY_COLUMNS if self.dynamics.spread is None else (*STABILITY_COLUMNS, PROBABILITY)

    def __call__(self, cuts: Cuts) -> dict[str, Floats]:
        """Return the columns of some steps of one cutter."""
        out = np.zeros((len(cuts), len(self.columns)))
        frame, modes = cuts.plain.frames, self.dynamics.modes.get(cuts.tool)
        upright = bool((frame[:, 2, 2] >= UPRIGHT).all())
        if not upright:
            self.leaning.add(cuts.tool)
        if (modes is not None or self.follows) and upright and len(cuts):
            groups = group_steps(cuts.plain, cuts.spindle, any(self.material.exponents) or runs_out(cuts.cutter))
            key = groups.key
            if self.follows:  # each step has modes of its own
                key = tuple(own + step.tobytes() for own, step in zip(key, np.asarray(cuts.step), strict=True))
            table = self.known.setdefault(cuts.tool, {})
            new = {own: k for k, own in reversed(list(enumerate(key))) if own not in table}
            if new:
                at = np.array(sorted(new.values()))
                whole = dynamic_cuts(
                    groups.engagement, cuts.cutter, self.material, modes, cuts.spindle, groups.T, groups.n,
                    self.dynamics.process, directions=self._directions(cuts.cutter, modes),
                )  # fmt: skip
                some, steps = whole.chosen(at), np.asarray(cuts.step)[at]
                if self.follows and self.workpiece is not None:
                    first = self._with_modes(some, *self.workpiece.at_first(steps), frame[at])
                    some = self._with_modes(some, *self.workpiece.at(steps), frame[at])
                    self.first_margin.update(zip(steps.tolist(), stability_margins(first).margin.tolist(), strict=True))
                self.cuts.setdefault(cuts.tool, []).append(some)
                for k, values in zip(at.tolist(), self._values(some, whole, at, groups.engagement), strict=True):
                    table[key[k]] = values
            numbers = self.numbers_of.setdefault(cuts.tool, {})
            for own in list(table)[len(numbers) :] if len(numbers) < len(table) else ():
                numbers[own] = len(numbers)
            self.cut_of.setdefault(cuts.tool, []).append((np.array(cuts.step), np.array([numbers[x] for x in key])))
            out = np.array([table[own] for own in key])
            number = np.array([0, *self.numbers(cuts.tool)])
            out[:, 2] = number[out[:, 2].astype(np.int64) + 1]
        return dict(zip(self.columns, out.T.copy(), strict=True))

    def uneven(self, tool: int) -> bool:
        """Return whether the teeth of a tool differ."""
        return any(c.uneven for c in self.cuts.get(tool, []))

    def slow_tool(self) -> int | None:
        """Return the first tool with a cut whose surface location error is not resolved; None: there is none."""
        slow = (tool for tool, some in sorted(self.cuts.items()) if not all(harmonics_reach(c).all() for c in some))
        return next(slow, None)

    def spatial(self, tool: int) -> bool:
        """Return whether cutter and workpiece also move along the axis."""
        return any(c.U.shape[1] == 3 for c in self.cuts.get(tool, []))

    def _directions(self, cutter: Cutter, modes: Modes | None) -> int:
        """Return 3 if a mode moves along the axis, or workpiece modes meet a cutter with a corner radius; else 2."""
        axial = modes is not None and modes.axial
        return 3 if axial or (self.follows and cutter.corner_radius > 0.0) else 2

    @property
    def follows(self) -> bool:
        """Whether modes of the workpiece are followed through the removal."""
        return self.workpiece is not None and self.dynamics.workpiece_damping is not None

    def numbers(self, tool: int) -> tuple[int, ...]:
        """Return the number of each mode of the cuts of a tool."""
        stated, first = self.dynamics.number.get(tool, ()), self.dynamics.first_followed
        count = self.workpiece.frequency.shape[1] if self.follows and self.workpiece is not None else 0
        return (*stated, *range(first, first + count))

    def name_of(self, number: int) -> str | None:
        """Return the name of a mode."""
        first = self.dynamics.first_followed
        return f"workpiece mode {number - first + 1}" if number >= first else self.dynamics.name.get(number)

    def _with_modes(self, some: DynamicCuts, hertz: Floats, shapes: Floats, frame: Floats) -> DynamicCuts:
        """Return cuts with the modes of the workpiece of each step."""
        U = np.einsum("cai,cik->cak", frame[:, : some.U.shape[1]], shapes)
        damping = np.full(hertz.shape[1], self.dynamics.workpiece_damping)
        return some.with_modes(damping, math.tau * hertz, U)

    def _values(
        self, some: DynamicCuts, whole: DynamicCuts, at: NDArray[np.int64], engagement: Any
    ) -> Iterator[tuple[float, ...]]:
        """Return the columns of new cuts."""
        found = stability_margins(some)
        error = np.zeros(len(some))
        if not any(self.material.exponents) and not some.several:
            size = np.diff(whole.start)[at]
            row = np.concatenate([np.arange(whole.start[k], whole.start[k] + n) for k, n in zip(at, size, strict=True)])
            rows = np.ascontiguousarray(force_rows(engagement, self.material)[row])
            error = np.where(found.margin >= 1.0, 1e3 * wall_errors(some, rows)[0], 0.0)
        columns = [found.margin, found.frequency, found.mode.astype(np.float64), error]
        if self.dynamics.spread is not None:
            columns.append(stable_probability(some, self.dynamics.spread, relative_covariance(self.material)))
        return zip(*(x.tolist() for x in columns), strict=True)

    def to_bytes(self) -> bytes:
        """Return the results so far as bytes for the state of a run."""
        return known_cuts_bytes(self.known, self.cuts, self.leaning, len(self.columns), self.first_margin)

    def restore(self, path: Path) -> None:
        """Load the results of an earlier run."""
        self.known, self.cuts, self.leaning, self.first_margin = read_known_cuts(path, self.material.exponents)

    def clear(self) -> None:
        """Delete all stored results."""
        self.known, self.cuts, self.leaning, self.first_margin = {}, {}, set(), {}
        self.cut_of, self.numbers_of = {}, {}

    def cuts_of(self, tool: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the cutting steps of a tool, rising, and the number of the cut of each."""
        some = self.cut_of.get(tool, [])
        steps, numbers = (np.concatenate([x[k] for x in some] or [np.zeros(0, dtype=np.int64)]) for k in range(2))
        order = np.argsort(steps, kind="stable")
        return steps[order], numbers[order]

    def parts(self, tool: int) -> DynamicCuts | None:
        """Return the cuts of a tool with which new speeds are searched; None if the tool has no cut."""
        some = self.cuts.get(tool, [])
        if not some:
            return None
        whole = join_dynamic_cuts(some)
        margin = np.array([x[0] for x in self.known[tool].values()])
        near, large = (NEAREST, LARGEST) if not whole.uneven else UNEVEN
        first = np.argsort(margin, kind="stable")[:near]
        most = np.argsort(-engaged_edge(whole), kind="stable")[:large]
        return whole.chosen(np.unique(np.concatenate([first, most])))


def runs_out(cutter: Cutter) -> bool:
    """Return whether teeth differ by runout."""
    return cutter.flutes > 1 and cutter.runout[0] != 0.0


def engaged_edge(cuts: DynamicCuts) -> Floats:
    """Return the length of the edge in cut times its immersion for each cut, (n,) [mm rad]."""
    step = np.repeat(np.arange(len(cuts)), np.diff(cuts.start))
    return np.asarray(
        np.bincount(step, (cuts.rows[:, 1] - cuts.rows[:, 0]) * cuts.rows[:, 4], len(cuts)), dtype=np.float64
    )


def relative_covariance(material: Material) -> Floats:
    """Return the relative covariance (2, 2) of tangential and radial cutting coefficients; 0 if it is not known."""
    size = np.abs(np.array(material.coefficients[:2]))
    if not material.has_band or not (size > 0.0).all():
        return np.zeros((2, 2))
    return np.asarray(material.variances[:2, :2] / np.outer(size, size))
