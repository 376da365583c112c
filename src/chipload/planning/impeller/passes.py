"""Passes: tracks that are milled without a lift, because the cutter stays on the surface from one to the next.

Notation: S contact point, N normal, T axis, p tip of the cutter. Between the end of one track and the nearer end of the
next the contact moves straight in u and v of their surface, and the pallet turns evenly. The link is refined like a
track (``refinement.py``): points are added until every row stays on the surface and touches nothing. Where that is not
possible the cutter lifts.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from chipload.planning.impeller.refinement import Refinement
from chipload.planning.impeller.scene import Floats, Ints
from chipload.planning.impeller.track import ToolTrack

#: from the number of a track what joins its end to the beginning of the next; None: there is nothing
Joint = Callable[[int, ToolTrack, ToolTrack], ToolTrack | None]
#: the pallet turns by no more than this while the cutter stays down [rad]
_TURN = math.radians(30.0)


@dataclass(frozen=True, eq=False)
class Pass:
    """A pass: tracks that follow one another without a lift.

    Parameters
    ----------
    numbers : of the tracks, in their order
    tip, axis, normal : (n, 3) [mm], unit, unit
    of : (n,) number of the track of each point
    labels : (n,) 1 where the row to a point is a link that stays down, 0 where it mills
    label : of what it mills
    """

    numbers: tuple[int, ...]
    tip: Floats
    axis: Floats
    normal: Floats
    of: Ints
    labels: Ints
    label: str

    def back(self) -> Pass:
        """The same pass from its end to its beginning."""
        kinds = np.concatenate([[0], self.labels[:0:-1]])
        return Pass(
            self.numbers[::-1], self.tip[::-1], self.axis[::-1], self.normal[::-1], self.of[::-1], kinds, self.label
        )

    def runs(self) -> list[tuple[int, int, str]]:
        """Rows after the first: from, to, label; each of one track and one kind."""
        change = np.flatnonzero((np.diff(self.of[1:]) != 0) | (np.diff(self.labels[1:]) != 0)) + 2
        edges = [1, *change.tolist(), len(self.tip)]
        return [(a, b, "link" if self.labels[a] else self.label) for a, b in itertools.pairwise(edges) if b > a]


def single(number: int, track: ToolTrack, label: str) -> Pass:
    """A pass of one track."""
    n = len(track.tip)
    zero = np.zeros(n, dtype=np.int64)
    return Pass((number,), track.tip, track.axis, track.normal, zero + number, zero, label)


def join_tracks(tracks: Sequence[ToolTrack], joint: Joint, longest: float, label: str) -> tuple[list[Pass], int]:
    """Tracks that follow one another, joined where their contacts end and begin within ``longest`` [mm].

    Returns
    -------
    Passes in the order of their first tracks, and how many links stay down.
    """
    out: list[Pass] = []
    stayed = 0
    last: ToolTrack | None = None  # of the last pass, as it is milled there
    for number, given in enumerate(tracks):
        if last is not None:
            ends = [float(np.linalg.norm(given.contact[k] - last.contact[-1])) for k in (0, -1)]
            track = given if ends[0] <= ends[1] else given.back()
            between = joint(number, last, track) if min(ends) <= longest else None
            if between is None and len(out[-1].numbers) == 1 and not stayed_at(out[-1]):
                # the first track of a pass may be milled either way
                turned = last.back()
                other = [float(np.linalg.norm(given.contact[k] - turned.contact[-1])) for k in (0, -1)]
                if min(other) <= longest:
                    track = given if other[0] <= other[1] else given.back()
                    between = joint(number, turned, track)
                    if between is not None:
                        out[-1] = single(out[-1].numbers[0], turned, label)
            if between is not None:
                out[-1] = _grow_pass(out[-1], between, number, track)
                stayed += 1
                last = track
                continue
        last = given
        out.append(single(number, given, label))
    return out, stayed


def stayed_at(one: Pass) -> bool:
    """Whether a pass has a link that stays on the surface."""
    return bool(one.labels.any())


def surface_joint(refinements: Sequence[Refinement | None]) -> Joint:
    """Function that joins tracks of one surface; ``refinements`` of each track, the same object for one surface."""

    def joint(number: int, before: ToolTrack, after: ToolTrack) -> ToolTrack | None:
        refinement = refinements[number]
        if refinement is None or refinements[number - 1] is not refinement:
            return None
        turn = float(after.pallet[0] - before.pallet[-1])
        turn -= math.tau * round(turn / math.tau)
        if abs(turn) > _TURN:
            return None
        at = np.stack([before.at[-1], after.at[0]])
        if np.array_equal(at[0], at[1]) and turn == 0.0:
            return None
        between = refinement.track(at, np.array([before.pallet[-1], before.pallet[-1] + turn]), after.line)
        parts, bad = refinement.refined(between)
        return parts[0] if len(parts) == 1 and not len(bad) else None

    return joint


def _grow_pass(one: Pass, between: ToolTrack, number: int, track: ToolTrack) -> Pass:
    """A pass that continues through a link to a further track."""
    # the way begins where the pass ends and ends where the track begins
    inner = slice(1, len(between.tip) - 1)
    link = len(between.tip) - 2
    tip, axis, normal = (
        np.concatenate([getattr(one, key), getattr(between, key)[inner], getattr(track, key)])
        for key in ("tip", "axis", "normal")
    )
    of = np.concatenate([one.of, np.full(link + len(track.tip), number)])
    kinds = np.concatenate(
        [one.labels, np.ones(link + 1, dtype=np.int64), np.zeros(len(track.tip) - 1, dtype=np.int64)]
    )
    return Pass((*one.numbers, number), tip, axis, normal, of, kinds, one.label)
