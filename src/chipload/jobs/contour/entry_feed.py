"""Feed of the entries of a pocket at which the limits of its loads hold.

An entry cuts a full slot and with its whole bottom, the passes cut with a small part of the rim: at the feed of the
passes the entry may exceed a limit that they hold. Notation: a load at a share x of the programmed feed is close to
e + c x, e the part of the edge. e and c follow from two simulations, x from them, and a further simulation proves it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from chipload.number_text import number_text
from chipload.planning.result import Event, StrategyResult
from chipload.result import LimitCheck, Verdict
from chipload.units import mm_min_from_mm_s

#: limits that a lower feed of the entry may keep
LOADS = ("force_xy_n", "torque_nm", "spindle_torque_nm", "spindle_power_w", "cutter_stress_mpa")
#: share of the feed that is tried first, least share, and what of the share that just holds is taken
TRIED, LEAST, TAKEN = 0.5, 0.1, 0.95
ENTRY = "entry"


def entry_rows(strategy: StrategyResult) -> StrategyResult:
    """A simulated strategy with the rows of its entries alone."""
    own = strategy.history["pass"] == ENTRY
    history = {name: values[own] for name, values in strategy.history.items()}
    return replace(strategy, history=history, wall_rows=np.zeros(int(own.sum()), dtype=np.bool_))


def with_entry_feed(strategy: StrategyResult, share: float) -> StrategyResult:
    """A strategy whose entries have a share of their feed."""
    program = strategy.program
    entry = np.array([label == ENTRY for label in program.labels])[program.label]
    feed = np.where(entry, share * program.feed, program.feed)
    most = mm_min_from_mm_s(1.0) * float(program.feed[entry].max())
    k = int(np.flatnonzero(entry)[0])
    x, y = (float(v) for v in program.p_work[k, :2])
    text = (
        f"the feed of entries is lowered from {most:.4g} to {number_text(share * most)} mm/min so that the "
        "limits hold there"
    )
    return replace(
        strategy,
        program=replace(program, feed=feed),
        events=(*strategy.events, Event("pocket-entry-feed", x, y, text)),
    )


def entry_share(at_full: Sequence[LimitCheck], checks_at: Callable[[float], Sequence[LimitCheck]]) -> float:
    """Share of the feed of the entries at which every limit that they exceed holds; 1: none does, or no share helps.

    Parameters
    ----------
    at_full : checks of the rows of the entries alone, at the programmed feed
    checks_at : gives them at a share
    """
    exceeded = {c.name: c for c in at_full if c.name in LOADS and c.state is not Verdict.HOLDS and c.worst is not None}
    if not exceeded:
        return 1.0
    below = {c.name: c for c in checks_at(TRIED) if c.worst is not None}
    share = 1.0
    for name, full in exceeded.items():
        half, most = below[name].worst if name in below else None, full.worst
        if half is None or most is None:
            return 1.0
        slope = (most - half) / (1.0 - TRIED)
        # thinner chips rise by more: the greater of the two errors
        edge, limit = most - slope, full.limit / max(full.factor, below[name].factor)
        if slope <= 0.0 or limit <= edge:
            return 1.0
        share = min(share, TAKEN * (limit - edge) / slope)
    return share if LEAST <= share < 1.0 else 1.0
