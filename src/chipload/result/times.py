"""The time of a program by what the machine does: in the cut, in air, rapids, dwell, and what remains."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from chipload.number_text import number_text
from chipload.result.coverage import CUTTING, Columns, durations

#: why the time of a program is an interval
JERK_NOTE = "An interval: the jerk of the machine is not known (jerk_mm_s3 in its file settles it)."


@dataclass(frozen=True)
class Times:
    """The time of a program [s]; the parts add up to the whole.

    Parameters
    ----------
    cut : motions at a feed that remove material
    air : motions at a feed that remove nothing, or of which it is not known
    rapid : rapids
    dwell : standing in a dwell
    other : what no row of the history has: tool change, start-up, the approach to the first point
    """

    cut: float
    air: float
    rapid: float
    dwell: float
    other: float

    @property
    def whole(self) -> float:
        """The time of the program."""
        return self.cut + self.air + self.rapid + self.dwell + self.other


def time_text(low: float | None, high: float | None, form: str = "", unit: float = 1.0) -> str:
    """A time of a program in units of ``unit`` [s], as an interval where it is one; empty: it was not run.

    ``form``: of its digits; empty: as :func:`number_text`.

    >>> time_text(90.0, None), time_text(90.0, 99.0, ".2f", 60.0), time_text(90.0, 90.0001), time_text(None, None)
    ('90', '1.50 to 1.65', '90', '')
    """
    if low is None:
        return ""
    ends = [format(t / unit, form) if form else number_text(t / unit) for t in (low, low if high is None else high)]
    return ends[0] if ends[0] == ends[1] else " to ".join(ends)


def times_of(blocks: Iterable[Columns], time_s: float | None) -> Times | None:
    """Return the time of a track by what the machine does; None: it has no history with times.

    Parameters
    ----------
    blocks : of its history
    time_s : of the program on the machine; None: that of the history

    Examples
    --------
    >>> rows = {"duration_s": np.array([1.0, 2.0, 5.0]), "rapid": np.array([True, False, False]),
    ...         "wait_s": np.array([0.0, 0.0, 4.0]), "force_n": np.array([0.0, 90.0, 0.0])}
    >>> times_of([rows], 8.5)
    Times(cut=2.0, air=1.0, rapid=1.0, dwell=4.0, other=0.5)
    """
    sums, seen = dict.fromkeys(("cut", "air", "rapid", "dwell"), 0.0), False
    last = 0.0
    for block in blocks:
        if "duration_s" not in block and "t_s" not in block:
            return None
        seen = True
        seconds = durations(block)
        if "duration_s" not in block and len(seconds):
            seconds[0] -= last
            last = float(np.asarray(block["t_s"])[-1])
        n = len(seconds)
        motion = np.asarray(block["motion"]).astype(str) if "motion" in block else np.full(n, "")
        rapid = np.asarray(block["rapid"], dtype=np.bool_) if "rapid" in block else motion == "rapid"
        wait = np.asarray(block["wait_s"], dtype=np.float64) if "wait_s" in block else np.zeros(n)
        wait = np.where(motion == "dwell", seconds, wait)
        name = next((name for name in CUTTING if name in block), None)
        cut = np.zeros(n, dtype=np.bool_) if name is None else np.asarray(block[name]) > 0
        moving = seconds - wait
        for key, rows in (("rapid", rapid), ("cut", cut & ~rapid), ("air", ~cut & ~rapid)):
            sums[key] += float(moving[rows].sum())
        sums["dwell"] += float(wait.sum())
    if not seen:
        return None
    known = sum(sums.values())
    other = 0.0 if time_s is None else time_s - known
    # a difference of rounding is none
    return Times(**sums, other=0.0 if abs(other) <= 1e-9 * max(known, 1.0) else other)
