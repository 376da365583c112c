"""Points of a surface that lie between two passes.

Notation: a track runs along p, lines follow each other across q; at a place p it lies at q(p).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from chipload.planning.impeller.scene import Floats


class LinePlaces(Protocol):
    """A part of a line: its places (n, 2), u and v, and its number."""

    @property
    def at(self) -> Floats:
        """Places (u, v)."""

    @property
    def line(self) -> int:
        """Number of the line."""


def between_lines(tracks: Sequence[LinePlaces], along: str, at: Floats) -> NDArray[np.bool_]:
    """Whether points (n, 2), u and v, lie between two neighbouring lines that are both milled there.

    Parameters
    ----------
    along : `u` or `v`, which the tracks run along
    """
    p, q = at.T if along == "u" else at.T[::-1]
    lines = sorted({t.line for t in tracks})
    out = np.zeros(len(at), dtype=np.bool_)
    before, last = np.full(len(at), np.nan), -2
    for number in lines:
        here = np.full(len(at), np.nan)
        for track in (t for t in tracks if t.line == number):
            x, y = track.at.T if along == "u" else track.at.T[::-1]
            order = np.argsort(x)
            on = (p >= x[order[0]]) & (p <= x[order[-1]])
            here[on] = np.interp(p[on], x[order], y[order])
        if number == last + 1:
            out |= (q >= np.minimum(before, here)) & (q <= np.maximum(before, here))
        before, last = here, number
    return out
