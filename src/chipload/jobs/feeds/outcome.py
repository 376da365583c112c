"""The outcome of new feeds, and the program with them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chipload.checking.outcome import ChangedText, Floats, ProgramResult, SimulationResult


@dataclass(frozen=True, eq=False)
class FeedResult(ChangedText):
    """New feeds of a program; see :class:`ChangedText`.

    Parameters
    ----------
    line : (m,) int, lines of the new text that move at a feed
    factor : (m,) float, the new feed of each over the programmed one
    by : (m,) what holds each: a limit by its name or ``fastest``, ``machine``, ``air``, ``slowest``, ``programmed``
    rubs : lines that cut below the least feed per tooth, and their feeds per tooth [mm]
    tooth_feed_least : [mm]; None: not stated
    segments : lines of the new text of each divided line, by the line of the old text
    not_divided : number of lines that would be faster in segments but keep one feed, by the reason
    """

    line: NDArray[np.int64]
    factor: Floats
    by: tuple[str, ...]
    rubs: tuple[tuple[int, float], ...]
    tooth_feed_least: float | None
    segments: Mapping[int, range]
    not_divided: Mapping[str, int]


@dataclass(frozen=True, eq=False)
class FeedsProgram(ProgramResult):
    """A simulated program with new feeds; ``feeds`` describes the change."""

    simulated: SimulationResult = field(kw_only=True)
    feeds: FeedResult = field(kw_only=True)
