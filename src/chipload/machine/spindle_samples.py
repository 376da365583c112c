"""Samples of a spindle that arrive one value at a time, made into the rows of a log."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence

from chipload.errors import InputError

#: a time [s], a number that orders samples of the same time, the column, and its value; None: it is not known
Sample = tuple[float, int, str, float | None]
#: columns of a load, by which rows are written: the first that is there
LOADS = ("current_a", "power_w", "torque_nm")


def log_text(samples: Iterable[Sample], columns: Sequence[str], source: str) -> tuple[str, int]:
    r"""Return the log (CSV) of samples and how many rows are left out.

    A row is written where the load is reported, current before power before torque; the other columns have their last
    value. A row in which a column is not known, or whose time does not rise, is left out.

    Parameters
    ----------
    samples : in any order
    columns : names of the columns in their order, of which those that are never known are left out
    source : where the samples come from, for messages

    Raises
    ------
    InputError
        There is no load, or the columns are never known together.

    Examples
    --------
    >>> log_text([(5.0, 0, "speed_rpm", 3e3), (5.5, 1, "power_w", 210.0)], ["speed_rpm", "power_w"], "agent")
    ('time_s,speed_rpm,power_w\n0.500000,3000,210\n', 0)
    """
    found = sorted(samples, key=lambda one: one[:3])
    known = [c for c in columns if any(s[2] == c and s[3] is not None for s in found)]
    load = next((c for c in LOADS if c in known), None)
    if load is None:
        raise InputError(f"{source}: no sample of a load: current, power or torque of the spindle is needed")
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(["time_s", *known])
    last: dict[str, float | None] = {}
    first, omitted, written = found[0][0], 0, -math.inf
    for at, _, column, value in found:
        last[column] = value
        if column != load:
            continue
        values = [last.get(c) for c in known]
        if any(v is None for v in values) or at <= written:
            omitted += 1
            continue
        written = at
        rows.writerow([f"{at - first:.6f}", *(f"{v:.9g}" for v in values if v is not None)])
    if written == -math.inf:
        raise InputError(f"{source}: at no time are {', '.join(known)} known together")
    return out.getvalue(), omitted
