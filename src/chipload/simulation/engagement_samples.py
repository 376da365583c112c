"""Engagement samples: tooth engagement and loads over a revolution of some steps of a run, for display.

Notation: frame T, n, A, immersion phi, chip thickness h = along sin(phi) + across cos(phi) + offset and angle kappa as
in :mod:`chipload.engagement.tooth_engagement`; rho distance from the axis, z height over the tip.

A run has more steps than a page can show: every step whose number is a multiple of the stride is kept, and the stride
is doubled whenever too many are. What is kept depends on the program alone, not on where a run was stopped.
"""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.arrays import read_arrays
from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_over_turn, in_work
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.errors import InputError
from chipload.simulation.loads import Cuts

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: steps that are kept at most, and ranges of immersion of all of them
STEPS, RANGES = 400, 60_000
#: rotations at which force and torque are kept: of a tooth period, or of a revolution where teeth differ
ROTATIONS = 120
#: columns of ``ranges``
COLUMNS = (
    "phi_from", "phi_to", "along", "offset", "across", "rho_from", "z_from", "rho_to", "z_to", "sin_kappa",
    "cos_kappa", "tooth",
)  # fmt: skip
ARRAYS = ("row", "tool", "flutes", "periods", "frame", "start", "ranges", "turn")


@dataclass(frozen=True, eq=False)
class EngagementSamples:
    """Samples of cutting steps, by rising row.

    Parameters
    ----------
    stride : rows between neighbouring samples of one cut
    row : (n,) int, row of the history
    tool, flutes : (n,) int, tool number and number of teeth
    periods : (n,) int, how often the load repeats in a revolution: as many times as there are teeth, if they are alike
    frame : (n, 3, 3) rows T, n, A
    start : (n + 1,) int; the ranges of sample i are the rows start[i] .. start[i + 1] - 1
    ranges : (b, 12) :data:`COLUMNS` [rad, mm]; tooth -1: every tooth
    turn : (n, m, 4) force on the cutter x, y, z in the workpiece frame [N] and torque [N m] at m even rotations of
        a period, from 0
    """

    stride: int
    row: Ints
    tool: Ints
    flutes: Ints
    periods: Ints
    frame: Floats
    start: Ints
    ranges: Floats
    turn: Floats

    def __post_init__(self) -> None:
        if self.row.ndim != 1 or self.start.ndim != 1 or self.start[:1].any():
            raise InputError("engagement samples: rows and starts must be lists, and the first start 0")
        n = len(self.row)
        shapes = {
            "tool": (n,), "flutes": (n,), "periods": (n,), "frame": (n, 3, 3), "start": (n + 1,),
            "ranges": (int(self.start[-1]) if len(self.start) else -1, len(COLUMNS)),
            "turn": (n, self.turn.shape[1] if self.turn.ndim == 3 else -1, 4),
        }  # fmt: skip
        for name, shape in shapes.items():
            value = getattr(self, name)
            if value.shape != shape or not np.isfinite(value).all():
                raise InputError(f"engagement samples: {name} of shape {value.shape}: need {shape} finite numbers")
        if self.stride < 1 or (np.diff(self.row) <= 0).any() or (np.diff(self.start) < 0).any():
            raise InputError("engagement samples: rows must rise, and the stride be at least 1")

    def __len__(self) -> int:
        return len(self.row)

    def every(self, share: int) -> EngagementSamples:
        """The samples whose row is a multiple of ``share`` strides."""
        stride = self.stride * share
        return self.chosen(np.flatnonzero(self.row % stride == 0), stride)

    def chosen(self, k: Ints, stride: int) -> EngagementSamples:
        """Return some of the samples."""
        ranges, start = _rows_of(self.start, k)
        return EngagementSamples(
            stride, self.row[k], self.tool[k], self.flutes[k], self.periods[k], self.frame[k], start,
            self.ranges[ranges], self.turn[k],
        )  # fmt: skip

    def at_most(self, steps: int) -> EngagementSamples:
        """Return at most ``steps`` samples."""
        out = self
        while len(out) > steps:
            out = out.every(2)
        return out

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        """Return the arrays for a file, in single precision."""
        kept = {name: getattr(self, name) for name in ARRAYS}
        single = {k: v.astype(np.float32 if v.dtype.kind == "f" else np.int32) for k, v in kept.items()}
        return {**single, "stride": np.array(self.stride, dtype=np.int32)}


def samples_from(arrays: Mapping[str, NDArray[np.generic]]) -> EngagementSamples:
    """The samples of :meth:`EngagementSamples.arrays`.

    Raises
    ------
    InputError
        One of the arrays is missing, or they do not fit one another.
    """
    try:
        values = {name: np.asarray(arrays[name]) for name in ARRAYS}
        stride = int(np.asarray(arrays["stride"]).item())
    except (KeyError, ValueError) as err:
        raise InputError(f"engagement samples: {err}: is missing: run the job again") from None
    row, tool, flutes, periods, start = (
        values[name].astype(np.int64) for name in ("row", "tool", "flutes", "periods", "start")
    )
    frame, ranges, turn = (values[name].astype(np.float64) for name in ("frame", "ranges", "turn"))
    return EngagementSamples(stride, row, tool, flutes, periods, frame, start, ranges, turn)


def engagement_samples(
    engagement: ToothEngagement, cutter: Cutter, material: Material, row: Ints, tool: int, stride: int = 1
) -> EngagementSamples:
    """The samples of all steps of an engagement, whose rows in the history are ``row`` (n,).

    Examples
    --------
    A straight tooth cuts a slot straight ahead along x: at a quarter turn Fy = (Ktc f_z + Kte) depth = 220 N.

    >>> from chipload.engagement.tooth_engagement import engagement_of_arcs
    >>> from dataclasses import replace
    >>> mill = Cutter(10.0, 1, 0.0, 20.0, 30.0, 6e5)
    >>> plain = Material("plain", 1000.0, 300.0, 0.0, 10.0, 5.0, 0.0, source="made up for this example")
    >>> slot = replace(engagement_of_arcs([0.0], [math.pi], 0.1, mill, 2.0), frame=np.eye(3)[None])
    >>> found = engagement_samples(slot, mill, plain, np.array([7]), 1)
    >>> found.turn[0, ROTATIONS // 4].round(6).tolist(), found.ranges[0, 5:9].tolist()
    ([-70.0, 220.0, 0.0, 1.1], [5.0, 0.0, 5.0, 2.0])
    """
    periods = cutter.flutes if cutter.teeth_alike else 1
    theta = np.arange(ROTATIONS) * (math.tau / (periods * ROTATIONS))
    force, torque = forces_over_turn(engagement, cutter, material, theta)
    frame, n = engagement.frames, len(engagement)
    turn = np.concatenate([in_work(force, frame), torque[..., None] / 1000.0], axis=2)
    table, rows = engagement.slices[engagement.slice], engagement.rows
    s_from, rho, z, sine, cosine = table[:, :5].T
    half, low = 0.5 * (rows[:, 3] - rows[:, 2]), z + (rows[:, 2] - s_from) * sine
    profile = [rho - half * cosine, low, rho + half * cosine, low + 2.0 * half * sine, sine, cosine]
    ranges = np.column_stack([rows[:, [0, 1, 4, 5, 6]], *profile, engagement.tooth])
    ones = np.ones(n, dtype=np.int64)
    return EngagementSamples(
        stride, np.asarray(row, dtype=np.int64), tool * ones, cutter.flutes * ones, periods * ones, np.asarray(frame),
        np.asarray(engagement.start), ranges, turn,
    )  # fmt: skip


@dataclass(eq=False)
class EngagementRecorder:
    """A watch that stores samples and adds no column.

    Parameters
    ----------
    material : whose coefficients count
    steps, ranges : that are kept at most
    """

    material: Material
    steps: int = STEPS
    ranges: int = RANGES
    stride: int = 1
    parts: list[EngagementSamples] = field(default_factory=list)

    def __call__(self, cuts: Cuts) -> dict[str, Floats]:
        """Store samples of some of the steps of one cutter."""
        # films that are thinner than the tolerance engage no edge
        step, ranges = np.asarray(cuts.step), np.diff(cuts.engagement.start)
        chosen = np.flatnonzero((step % self.stride == 0) & (ranges > 0))
        # those that would not be kept are not calculated
        while (
            sum(map(len, self.parts)) + len(chosen) > self.steps
            or sum(len(p.ranges) for p in self.parts) + int(ranges[chosen].sum()) > self.ranges
        ):
            self.stride *= 2
            thinner = [p.every(self.stride // p.stride) for p in self.parts]
            self.parts = [p for p in thinner if len(p)]
            chosen = chosen[step[chosen] % self.stride == 0]
        if len(chosen):
            some = _engagement_at(cuts.engagement, chosen)
            self.parts.append(
                engagement_samples(some, cuts.cutter, self.material, step[chosen], cuts.tool, self.stride)
            )
        return {}

    def samples(self) -> EngagementSamples | None:
        """Return the samples; None if no step cuts."""
        return _join_samples([p.every(self.stride // p.stride) for p in self.parts]) if self.parts else None

    def to_bytes(self) -> bytes:
        """Return the samples so far for the state of a run, bit for bit."""
        sink, own = io.BytesIO(), self.samples()
        arrays = {} if own is None else {name: getattr(own, name) for name in ARRAYS}
        np.savez(sink, stride=np.array(self.stride), **arrays)
        return sink.getvalue()

    def restore(self, path: Path) -> None:
        """Load the samples of an earlier run."""
        arrays = read_arrays(path, "remove its folder")
        if "stride" not in arrays:
            raise InputError(f"{path}: damaged: remove its folder")
        self.stride = int(arrays["stride"])
        self.parts = [samples_from(arrays)] if "row" in arrays else []

    def clear(self) -> None:
        """Delete all samples."""
        self.stride, self.parts = 1, []


def _rows_of(start: Ints, k: Ints) -> tuple[Ints, Ints]:
    """Rows of some steps, and where those of each begin among them."""
    size = np.diff(start)[k]
    begin = np.concatenate([[0], np.cumsum(size)])
    return np.arange(begin[-1]) + np.repeat(start[:-1][k] - begin[:-1], size), begin


def _engagement_at(engagement: ToothEngagement, k: Ints) -> ToothEngagement:
    """The tooth engagement of some steps."""
    rows, start = _rows_of(engagement.start, k)
    return ToothEngagement(
        start, engagement.rows[rows], engagement.tooth[rows], engagement.slice[rows], engagement.slices,
        engagement.frames[k],
    )  # fmt: skip


def _join_samples(parts: Sequence[EngagementSamples]) -> EngagementSamples:
    """Samples of blocks and cutters in the order of their rows."""
    start = np.concatenate([[0], np.cumsum(np.concatenate([np.diff(p.start) for p in parts]))])
    names = ("row", "tool", "flutes", "periods")
    row, tool, flutes, periods = (np.concatenate([getattr(p, name) for p in parts]) for name in names)
    frame, ranges, turn = (np.concatenate([getattr(p, name) for p in parts]) for name in ("frame", "ranges", "turn"))
    k = np.argsort(row, kind="stable")
    rows, start = _rows_of(start, k)
    return EngagementSamples(
        parts[0].stride, row[k], tool[k], flutes[k], periods[k], frame[k], start, ranges[rows], turn[k]
    )
