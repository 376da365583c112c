"""The place of the machine on the path, and the planned and true torque there.

Notation: p_k points of the path [mm], s_k their distance along it; p position of the machine; of the pieces within a
window about the last s the one nearest to p is taken,

    t = clip((p - p_k) . (p_k+1 - p_k) / |p_k+1 - p_k|^2, 0, 1),   s = s_k + t |p_k+1 - p_k|.

The window keeps one round of a path from being taken for the next one, where both lie close to each other.
"""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass, replace
from pathlib import Path as File

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.control.plant import TorqueProfile
from chipload.errors import InputError
from chipload.files import read_regular
from chipload.units import mm_min_from_mm_s, mm_s_from_mm_min

Floats = NDArray[np.float64]

#: of a file that is read [bytes]
MOST_BYTES = 1 << 28
COLUMNS = ("x_mm", "y_mm", "z_mm", "feed_mm_min", "edge_nm", "cut_nm")
TRUE_COLUMNS = ("true_edge_nm", "true_cut_nm")
RELIEF = "relief"


@dataclass(frozen=True, eq=False)
class ToolPath:
    """A path with its torque.

    Parameters
    ----------
    points : (n, 3) float [mm], in the coordinates of the machine's pins
    model : rows at the points
    truth : rows at the points; the model itself where nothing else is known
    relief : (n,) float, above 0, torque that is allowed at the points over what is held; the controller
        is given the torque over it

    Raises
    ------
    InputError
        The points and the rows do not belong together.
    """

    points: Floats
    model: TorqueProfile
    truth: TorqueProfile
    relief: Floats

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=np.float64)
        if points.shape != (len(self.model.s), 3) or not np.isfinite(points).all():
            raise InputError(f"path.points: must be {len(self.model.s)} rows of 3 numbers, one for each row of torque")
        if len(self.truth.s) != len(self.model.s):
            raise InputError(f"path.truth: {len(self.truth.s)} rows: must have the {len(self.model.s)} of the model")
        relief = np.array(self.relief, dtype=np.float64)
        if relief.shape != (len(points),) or not ((relief > 0.0) & np.isfinite(relief)).all():
            raise InputError(f"path.relief: must be {len(points)} numbers above 0, one for each point")
        for name, column in (("points", points), ("relief", relief)):
            column.setflags(write=False)
            object.__setattr__(self, name, column)

    @property
    def over_relief(self) -> TorqueProfile:
        """The model for the controller: torque over the relief."""
        return replace(self.model, edge=self.model.edge / self.relief, cut=self.model.cut / self.relief)


def tool_path(
    points: ArrayLike,
    feed: ArrayLike,
    model: ArrayLike,
    truth: ArrayLike | None = None,
    relief: ArrayLike | None = None,
) -> ToolPath:
    """Return a path from points (n, 3) [mm], feed (n,) [mm/s], torque (n, 2), edge and cut [N mm], and relief (n,)."""
    p = np.asarray(points, dtype=np.float64)
    if p.ndim != 2 or p.shape[1] != 3:
        raise InputError("path.points: must be rows of x, y, z")
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
    believed = np.asarray(model, dtype=np.float64)
    real = believed if truth is None else np.asarray(truth, dtype=np.float64)
    f = np.asarray(feed, dtype=np.float64)
    share = np.ones(len(p)) if relief is None else np.asarray(relief, dtype=np.float64)
    return ToolPath(p, TorqueProfile(s, f, *believed.T), TorqueProfile(s, f, *real.T), share)


def read_path(file: str | File) -> ToolPath:
    """Read a path from a CSV with the columns ``COLUMNS`` and, for a plant, ``TRUE_COLUMNS``; default ``RELIEF`` 1.

    Raises
    ------
    InputError
        The file cannot be read, a column is missing, a value is no number, or two points are the same.
    """
    label = f"path {file}"
    try:
        text = read_regular(file, label, MOST_BYTES).decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{label}: not a text in UTF-8") from None
    try:
        rows = list(csv.reader(io.StringIO(text, newline="")))
    except csv.Error as err:
        raise InputError(f"{label}: not a CSV file: {err}") from None
    head = [x.strip() for x in rows[0]] if rows else []
    for name in COLUMNS:
        if name not in head:
            raise InputError(f"{label}: column {name} is missing: it has {', '.join(head) or 'none'}")
    true = all(x in head for x in TRUE_COLUMNS)
    names = COLUMNS + (TRUE_COLUMNS if true else ()) + ((RELIEF,) if RELIEF in head else ())
    places = [head.index(x) for x in names]
    values = np.empty((len(rows) - 1, len(names)))
    for k, row in enumerate(rows[1:]):
        for j, place in enumerate(places):
            try:
                values[k, j] = float(row[place])
            except (ValueError, IndexError):
                raise InputError(f"{label}: line {k + 2}: {names[j]}: must be a number") from None
    feed = values[:, 3] * mm_s_from_mm_min(1.0)
    torque = 1e3 * values[:, 4:8]
    relief = values[:, -1] if RELIEF in head else None
    return tool_path(values[:, :3], feed, torque[:, :2], torque[:, 2:] if true else None, relief)


def write_path(path: ToolPath) -> str:
    """Return the CSV of a path with its true torque."""
    lines = [",".join((*COLUMNS, *TRUE_COLUMNS, RELIEF))]
    torque = [x * 1e-3 for x in (path.model.edge, path.model.cut, path.truth.edge, path.truth.cut)]
    rows = np.column_stack([path.points, path.model.feed * mm_min_from_mm_s(1.0), *torque, path.relief])
    lines += [",".join(f"{x:.9g}" for x in row) for row in rows]
    return "\n".join(lines) + "\n"


def locate(path: ToolPath, position: ArrayLike, s: float, window: float) -> tuple[float, float]:
    """Return the place along the path nearest to a position.

    Parameters
    ----------
    path : the path
    position : (3,) float [mm]
    s : last place [mm]
    window : so far from it the place is searched, backwards and forwards [mm]

    Returns
    -------
    s [mm] and the distance of the position from the path [mm].

    Examples
    --------
    >>> straight = tool_path([[0, 0, 0], [10, 0, 0]], [1, 1], [[0, 0], [0, 0]])
    >>> locate(straight, [3, 4, 0], 0.0, 10.0)
    (3.0, 4.0)
    """
    at = path.model.s
    first = max(int(np.searchsorted(at, s - window, "right")) - 1, 0)
    last = min(int(np.searchsorted(at, s + window, "left")), len(at) - 1)
    a = path.points[first:last]
    along = path.points[first + 1 : last + 1] - a
    p = np.asarray(position, dtype=np.float64)
    squared = np.einsum("ij,ij->i", along, along)
    t = np.clip(np.einsum("ij,ij->i", p - a, along) / squared, 0.0, 1.0)
    away = np.linalg.norm(p - a - t[:, None] * along, axis=1)
    k = int(np.argmin(away))
    return float(at[first + k] + t[k] * math.sqrt(squared[k])), float(away[k])
