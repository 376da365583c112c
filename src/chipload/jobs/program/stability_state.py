"""What the stability of a run was asked so far, as a file of its state.

Notation: a program is cut by t tools with n different cuts in all, of b rows; cut i has the key ``keys[ends[i - 1]:
ends[i]]`` and the values ``values[i]``. Cuts of one tool follow one another, in the order in which they were met.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from chipload.errors import InputError
from chipload.stability.cuts import DynamicCuts
from chipload.stability.modes import Modes
from chipload.stock.shapes import read_shapes, shape_bytes

KIND = "chipload different cuts of a simulation 1"
#: arrays of the file with their numbers of dimensions
ARRAYS = {
    "tools": 1, "counts": 1, "pitch": 1, "leaning": 1, "keys": 1, "key_ends": 1, "values": 2, "sizes": 1, "rows": 2,
    "period": 1, "U": 1,
}  # fmt: skip

Known = dict[int, dict[bytes, tuple[float, ...]]]


def joined(some: list[DynamicCuts]) -> DynamicCuts:
    """Cuts of one tool, one behind the other."""
    sizes = np.concatenate([np.diff(c.start) for c in some])
    start = np.concatenate([[0], np.cumsum(sizes)])
    rows, period, U = (np.concatenate([getattr(c, name) for c in some]) for name in ("rows", "period", "U"))
    return DynamicCuts(start, rows, some[0].exponents, period, some[0].pitch, some[0].modes, U)


def asked_bytes(known: Known, cuts: Mapping[int, list[DynamicCuts]], leaning: set[int], columns: int) -> bytes:
    """The file of the different cuts of every tool.

    Parameters
    ----------
    known : values by key, by tool, in the order of ``cuts``
    cuts : of every tool
    leaning : tools whose axis is not upright
    columns : number of values of a cut
    """
    whole = {tool: joined(some) for tool, some in cuts.items()}
    keys = [key for tool in whole for key in known[tool]]
    values = [row for tool in whole for row in known[tool].values()]
    none = np.zeros(0)
    arrays = {
        "tools": np.array(list(whole), dtype=np.int64),
        "counts": np.array([len(c) for c in whole.values()], dtype=np.int64),
        "pitch": np.array([c.pitch for c in whole.values()]),
        "leaning": np.array(sorted(leaning), dtype=np.int64),
        "keys": np.frombuffer(b"".join(keys), dtype=np.uint8),
        "key_ends": np.cumsum([len(key) for key in keys], dtype=np.int64),
        "values": np.array(values).reshape(len(keys), columns),
        "sizes": np.concatenate([np.diff(c.start) for c in whole.values()]) if whole else none.astype(np.int64),
        "rows": np.concatenate([c.rows for c in whole.values()]) if whole else none.reshape(0, 11),
        "period": np.concatenate([c.period for c in whole.values()]) if whole else none,
        "U": np.concatenate([c.U.ravel() for c in whole.values()]) if whole else none,
    }
    return shape_bytes(KIND, arrays, np.empty(0, dtype=object))


def read_asked(
    path: Path, modes: Mapping[int, Modes], exponents: ArrayLike
) -> tuple[Known, dict[int, list[DynamicCuts]], set[int]]:
    """What :func:`asked_bytes` wrote: values by key, cuts and leaning tools.

    Parameters
    ----------
    modes : of every tool
    exponents : of the size effect of the material

    Raises
    ------
    InputError
        The file is damaged, or of another job.
    """
    a, _ = read_shapes(path, KIND, ARRAYS)
    keys, ends, sizes = a["keys"].tobytes(), [0, *a["key_ends"].tolist()], a["sizes"]
    count, tools = len(a["key_ends"]), a["tools"].tolist()
    whole = (
        len(tools) == len(a["counts"]) == len(a["pitch"])
        and count == a["counts"].sum() == len(a["values"]) == len(sizes) == len(a["period"])
        and sizes.sum() == len(a["rows"])
        and ends[-1] == len(keys)
        and all(tool in modes for tool in tools)
    )
    if not whole:
        raise InputError(f"{path}: damaged: remove its folder")
    known: Known = {}
    cuts: dict[int, list[DynamicCuts]] = {}
    first, row, at = 0, 0, 0
    for tool, n, pitch in zip(tools, a["counts"].tolist(), a["pitch"].tolist(), strict=True):
        own = slice(first, first + n)
        start = np.concatenate([[0], np.cumsum(sizes[own])])
        rows, number = a["rows"][row : row + int(start[-1])], 2 * n * len(modes[tool])
        U = a["U"][at : at + number].reshape(n, 2, len(modes[tool]))
        some = DynamicCuts(
            start, rows, np.asarray(exponents, dtype=np.float64), a["period"][own], pitch, modes[tool], U
        )
        values = [tuple(v) for v in a["values"][own].tolist()]
        known[tool] = dict(zip([keys[ends[k] : ends[k + 1]] for k in range(first, first + n)], values, strict=True))
        cuts[tool] = [some]
        first, row, at = first + n, row + int(start[-1]), at + number
    return known, cuts, {int(tool) for tool in a["leaning"].tolist()}
