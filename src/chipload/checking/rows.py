"""History of a program: a row for each step of its simulation, or for each motion of a program that was only read."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.outcome import ProgramResult, SimulationResult
from chipload.checking.stability import filled_margins, filled_probability
from chipload.checking.stability_watch import PROBABILITY
from chipload.program.read import times_of
from chipload.result.limits import Columns
from chipload.result.motions import motion_columns
from chipload.simulation.checkpoint import in_rows
from chipload.simulation.removal import Removal

Floats = NDArray[np.float64]

#: rows of history.parquet that are held in memory together
HISTORY_ROWS = 65_536


def step_rows(simulation: SimulationResult, removal: Removal | None = None) -> Iterator[dict[str, NDArray[Any]]]:
    """Yield a row for each step in blocks of about ten thousand; ``removal`` None: that of the simulation."""
    own = removal or simulation.removal
    names = np.array([label or "program" for label in own.labels], dtype=object)
    at = 0
    for columns in in_rows(own.columns, HISTORY_ROWS):
        count = len(columns["label"])
        if removal is None and simulation.left is not None:
            columns["gouge_mm"] = np.maximum(-simulation.left.deepest[at : at + count], 0.0)
        if "stability_margin" in columns:
            columns["stability_margin"] = filled_margins(columns)
        if PROBABILITY in columns:
            columns[PROBABILITY] = filled_probability(columns)
        columns["cutting_s"] = columns.pop("seconds")
        yield {"pass": names[columns.pop("label")], **columns}
        at += count


def motion_rows(read: ProgramResult) -> Columns:
    """Return columns by name with a row for each motion of the tip or chord of an arc."""
    return motion_columns(read.reading.program, times_of(read.reading, read.machine))
