"""Steps from line to line over a surface: without jumps along a line, no line askew; which parts of it are milled.

Notation: a line lies at q(p) at the stations p; w [mm] the step across to the next line at each station.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.lazy import scipy
from chipload.planning.impeller.scene import Floats

#: tangent of the angle by which a line may run askew to the parameter lines; least share of a step that it keeps there
_SKEW, _HELD = 0.6, 0.4
#: by how much a step may grow along the line [mm/mm]
_GROWTH = 0.2

Flags = NDArray[np.bool_]


def even_steps(w: Floats, size: Floats, over: float = 1.0) -> Floats:
    """Steps (n,) without jumps along the line, nowhere above those given; where one is nan, that of the nearest.

    ``size`` (n - 1,) [mm] from station to station; ``over`` how many of these steps are smoothed. At least one step is
    known.

    >>> even_steps(np.array([2.0, 2.0, 1.0, np.nan]), np.ones(3)).round(2).tolist()
    [1.33, 1.2, 1.0, 1.0]
    """
    known = np.flatnonzero(np.isfinite(w))
    near = known[np.abs(known[None] - np.arange(len(w))[:, None]).argmin(axis=1)]
    far = np.concatenate([[0.0], np.cumsum(_GROWTH * size)])
    limited = (w[near][None] + np.abs(far[:, None] - far[None])).min(axis=1)
    out: Floats = np.minimum(scipy.ndimage.gaussian_filter1d(limited, over, mode="nearest"), limited)
    return out


def straighten_line(q: Floats, before: Floats, across: Floats, size: Floats, over: float = 1.0) -> Floats:
    """Places (n,) of the line after ``before``, held back where it would run askew to the parameter lines.

    ``across`` (n,) [mm] across the line for a growth of q by 1, ``size`` (n - 1,) [mm] from station to station,
    ``over`` how many of these places are smoothed.
    """
    ahead = np.maximum(np.abs(across), 1e-12)
    far = np.concatenate([[0.0], np.cumsum(_SKEW * size / np.minimum(ahead[1:], ahead[:-1]))])
    soft = np.minimum(scipy.ndimage.gaussian_filter1d(q, over, mode="nearest"), q)
    limited = (soft[None] + np.abs(far[:, None] - far[None])).min(axis=1)
    out: Floats = np.maximum(limited, before + _HELD * (q - before))
    return out


def runs(flags: Flags) -> list[tuple[int, int]]:
    """(first, after the last) of each run of True."""
    edge = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int64), [0]])))
    return [(int(a), int(b)) for a, b in zip(edge[::2], edge[1::2], strict=True)]
