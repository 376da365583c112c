"""Surface maps for the 3D view: values on a surface, the limit as isolines, the deformed surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.result import COLUMNS, Result, SurfaceMap, Track

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: maps of a track that are shown, points of one
MAPS, POINTS = 12, 200_000


@dataclass(frozen=True, eq=False)
class ShownMap:
    """A surface map in the view.

    Parameters
    ----------
    name, column : of the map, and what it shows
    points, faces, values : (n, 3) [mm], (m, 3), (n,); nan: not known
    low, high : ends of the scale
    limit : that the isolines stand for; None: none is stated
    lines : (k, 2, 3) [mm] isolines, a piece for each triangle that they cross
    moved, lines_moved : (n, 3), (k, 2, 3) [mm] how the points and the lines are displaced; None: nothing bends
    tolerance : least and greatest value of a deviation that is allowed, None: that side is not limited; None: neither
    """

    name: str
    column: str
    points: Floats
    faces: Ints
    values: Floats
    low: float
    high: float
    limit: float | None
    lines: Floats
    moved: Floats | None = None
    lines_moved: Floats | None = None
    tolerance: tuple[float | None, float | None] | None = None

    @property
    def label(self) -> str:
        """Of its column."""
        return COLUMNS[self.column].label

    @property
    def unit(self) -> str:
        """Of its column."""
        return COLUMNS[self.column].unit


def isolines(faces: Ints, values: Floats, level: float, columns: Floats) -> Floats:
    """(k, 2, c) ends of the pieces of the line on which values, linear in each triangle, have a level; ``columns``
    (n, c) of the points are interpolated. Triangles with an unknown value have none.

    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    >>> isolines(np.array([[0, 1, 2], [1, 3, 2]]), square[:, 0], 0.25, square).round(3).tolist()
    [[[0.25, 0.75], [0.25, 0.0]], [[0.25, 0.75], [0.25, 1.0]]]
    """
    v = values[faces] - level
    known = np.asarray(np.isfinite(v).all(axis=1))
    above = np.asarray(known[:, None] & (v > 0.0))
    crossed = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1) & known)
    f, v, above = faces[crossed], v[crossed], above[crossed]
    # the corner that is alone on its side, and the two others behind it
    alone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    rows = np.arange(len(f))
    ends = []
    for step in (1, 2):
        other = (alone + step) % 3
        a, b = v[rows, alone], v[rows, other]
        share = (a / (a - b))[:, None]
        p, q = columns[f[rows, alone]], columns[f[rows, other]]
        ends.append(p + share * (q - p))
    return np.stack(ends, axis=1)


def shown_maps(result: Result, track: Track, bounds: Mapping[str, float]) -> tuple[ShownMap, ...]:
    """The maps of a track and of its whole result that have faces; ``bounds`` are its limits by column."""
    own = [one for one in result.maps if one.track in ("", track.name)]
    usable = [one for one in own if len(one.faces) and len(one.points) <= POINTS and np.isfinite(one.values).any()]
    return tuple(_show_map(one, bounds) for one in usable[:MAPS])


def _show_map(one: SurfaceMap, bounds: Mapping[str, float]) -> ShownMap:
    values = np.asarray(one.values, dtype=np.float64)
    limit = bounds.get(one.column)
    finite = values[np.isfinite(values)]
    moved = None if one.displacement is None else np.asarray(one.displacement, dtype=np.float64)
    both = np.asarray(one.points) if moved is None else np.hstack([one.points, moved])
    found = [isolines(one.faces, values, level, both) for level in _levels(one.column, bounds)]
    lines = np.concatenate(found) if found else np.zeros((0, 2, both.shape[1]))
    return ShownMap(
        one.name, one.column, np.asarray(one.points, dtype=np.float64), one.faces, values,
        float(finite.min()), float(finite.max()), limit, lines[..., :3], moved,
        None if moved is None else lines[..., 3:], tolerance_of(one.column, bounds),
    )  # fmt: skip


def _levels(column: str, bounds: Mapping[str, float]) -> Sequence[float]:
    """Values on which a limit lies: both signs of a column whose size is bounded; below 0 the excess is gouge."""
    out = [bounds[column]] if column in bounds else []
    if out and COLUMNS[column].signed:
        out.append(-out[0])
    if column == "excess_mm" and "gouge_mm" in bounds:
        out.append(-bounds["gouge_mm"])
    return out


def tolerance_of(column: str, bounds: Mapping[str, float]) -> tuple[float | None, float | None] | None:
    """Least and greatest allowed value of a column that is a deviation from the part; None: it is none, or not limited.

    >>> tolerance_of("excess_mm", {"gouge_mm": 0.02, "excess_mm": 0.1}), tolerance_of("excess_mm", {"gouge_mm": 0.02})
    ((-0.02, 0.1), (-0.02, None))
    >>> tolerance_of("deflection_um", {"deflection_um": 30.0}) is None
    True
    """
    upper = bounds.get(column)
    if column == "excess_mm":
        lower = -bounds["gouge_mm"] if "gouge_mm" in bounds else None
    elif COLUMNS[column].signed:
        lower = None if upper is None else -upper
    else:
        return None
    return None if lower is None and upper is None else (lower, upper)
