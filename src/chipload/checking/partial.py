"""The limits of a program while it is simulated: their worst values in the steps that are done."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from chipload.number_text import number_text, worst_text
from chipload.progress import Progress
from chipload.result.columns import COLUMNS
from chipload.simulation.removal import Columns


class PartialLimits:
    """Worst values so far of the limits that are columns of a simulation, and their lines.

    They are nominal values: errors, checks by the part, stability and collisions come with the whole verdict.

    Parameters
    ----------
    limits : by column

    Examples
    --------
    >>> partial = PartialLimits({"force_n": 550.0, "torque_nm": 2.8})
    >>> partial.take({"force_n": np.array([120.0, 412.4]), "torque_nm": np.array([1.0, 2.0]), "line": np.array([7, 9])})
    >>> partial.text()
    'so far force 412 of 550 N in line 9, torque 2 of 2.8 N m in line 9'
    """

    def __init__(self, limits: Mapping[str, float]) -> None:
        self.limits = dict(limits)
        self.worst: dict[str, tuple[float, int]] = {}

    def take(self, columns: Columns) -> None:
        """Take more steps: their columns, of equal lengths."""
        for name in self.limits:
            if name not in columns or COLUMNS[name].least:
                continue
            values = np.abs(np.asarray(columns[name], dtype=np.float64))
            if not len(values) or np.isnan(values).all():
                continue
            row = int(np.nanargmax(values))
            if name not in self.worst or values[row] > self.worst[name][0]:
                self.worst[name] = float(values[row]), int(columns["line"][row]) if "line" in columns else 0

    def text(self, most: int = 3) -> str:
        """The limits nearest to their value, at most ``most``; empty: no step is known."""
        shares = sorted(self.worst, key=lambda name: -self.worst[name][0] / self.limits[name])
        texts = []
        for name in shares[:most]:
            (value, line), column, limit = self.worst[name], COLUMNS[name], self.limits[name]
            beyond = ", beyond the limit" if value > limit else ""
            where = f" in line {line}" if line else ""
            unit = f" {column.unit}" if column.unit else ""
            texts.append(f"{column.label} {worst_text(value, limit)} of {number_text(limit, 6)}{unit}{where}{beyond}")
        return f"so far {', '.join(texts)}" if texts else ""

    def with_text(self, progress: Progress) -> Progress:
        """A progress that also states the worst values so far."""
        return lambda done, what: progress(done, " \u00b7 ".join(filter(None, (what, self.text()))))
