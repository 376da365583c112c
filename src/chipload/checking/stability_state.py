"""The stored results of stability calculations of a run, for its checkpoint.

Notation: a program is cut by t tools with n different cuts in all, of b rows; cut i has the key ``keys[ends[i - 1]:
ends[i]]`` and the values ``values[i]``. Cuts of one tool follow one another, in the order in which they were met.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.stability.cuts import DynamicCuts, join_dynamic_cuts
from chipload.stock.shapes import read_shapes, shape_bytes

KIND = "chipload different cuts of a simulation 3"
#: arrays of the file with their numbers of dimensions
ARRAYS = {
    "tools": 1, "counts": 1, "pitch": 1, "leaning": 1, "keys": 1, "key_ends": 1, "values": 2, "sizes": 1, "rows": 2,
    "damped": 2, "period": 1, "damping": 1, "modes": 1, "omega": 1, "U": 1, "first_steps": 1, "first_margins": 1,
    "teeth": 1, "pitches": 1, "directions": 1, "delay": 1,
}  # fmt: skip

#: columns of rows with three directions, the most
WIDTH = 13

Known = dict[int, dict[bytes, tuple[float, ...]]]


def _widen_rows(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rows (b, :data:`WIDTH`), with columns of 0 added to narrower ones."""
    return np.pad(rows, ((0, 0), (0, WIDTH - rows.shape[1])))


def known_cuts_bytes(
    known: Known,
    cuts: Mapping[int, list[DynamicCuts]],
    leaning: set[int],
    columns: int,
    first_margin: Mapping[int, float],
) -> bytes:
    """Return the file of the different cuts of every tool.

    Parameters
    ----------
    known : values by key, by tool, in the order of ``cuts``
    cuts : of every tool
    leaning : tools whose axis is not upright
    columns : number of values of a cut
    first_margin : by step, with the modes that the workpiece has before its first cut
    """
    whole = {tool: join_dynamic_cuts(some) for tool, some in cuts.items()}
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
        "rows": np.concatenate([_widen_rows(c.rows) for c in whole.values()]) if whole else none.reshape(0, WIDTH),
        "directions": np.array([c.U.shape[1] for c in whole.values()], dtype=np.int64),
        "delay": np.concatenate([c.delay if len(c.delay) else np.zeros(len(c.rows)) for c in whole.values()])
        if whole
        else none,
        "damped": np.concatenate([c.damped for c in whole.values()]) if whole else none.reshape(0, 11),
        "period": np.concatenate([c.period for c in whole.values()]) if whole else none,
        "damping": np.concatenate([c.damping for c in whole.values()]) if whole else none,
        "modes": np.array([len(c.damping) for c in whole.values()], dtype=np.int64),
        "omega": np.concatenate([c.omega.ravel() for c in whole.values()]) if whole else none,
        "U": np.concatenate([c.U.ravel() for c in whole.values()]) if whole else none,
        "teeth": np.array([len(c.pitches) for c in whole.values()], dtype=np.int64),
        "pitches": np.array([x for c in whole.values() for x in c.pitches], dtype=np.float64),
        "first_steps": np.array(list(first_margin), dtype=np.int64),
        "first_margins": np.array(list(first_margin.values()), dtype=np.float64),
    }
    return shape_bytes(KIND, arrays, np.empty(0, dtype=object))


def read_known_cuts(
    path: Path, exponents: ArrayLike
) -> tuple[Known, dict[int, list[DynamicCuts]], set[int], dict[int, float]]:
    """Read a file of :func:`known_cuts_bytes`: values by key, cuts, leaning tools, and margins with the first modes.

    Parameters
    ----------
    exponents : of the size effect of the material

    Raises
    ------
    InputError
        The file is damaged.
    """
    a, _ = read_shapes(path, KIND, ARRAYS)
    keys, ends, sizes = a["keys"].tobytes(), [0, *a["key_ends"].tolist()], a["sizes"]
    count, tools, numbers = len(a["key_ends"]), a["tools"].tolist(), a["modes"]
    whole = (
        len(tools) == len(a["counts"]) == len(a["pitch"]) == len(numbers)
        and count == a["counts"].sum() == len(a["values"]) == len(sizes) == len(a["period"])
        and sizes.sum() == len(a["rows"])
        and len(a["damped"]) in (0, len(a["rows"]))
        and ends[-1] == len(keys)
        and numbers.sum() == len(a["damping"])
        and len(a["directions"]) == len(tools)
        and np.isin(a["directions"], (2, 3)).all()
        and len(a["omega"]) == int((a["counts"] * numbers).sum())
        and len(a["U"]) == int((a["counts"] * numbers * a["directions"]).sum())
        and a["rows"].shape[1] == WIDTH
        and len(a["delay"]) == len(a["rows"])
        and len(a["first_steps"]) == len(a["first_margins"])
        and len(a["teeth"]) == len(tools)
        and a["teeth"].sum() == len(a["pitches"])
    )
    if not whole:
        raise InputError(f"{path}: damaged: remove its folder")
    known: Known = {}
    cuts: dict[int, list[DynamicCuts]] = {}
    first, row, at, mode, tooth, shape = 0, 0, 0, 0, 0, 0
    each = zip(*(a[x].tolist() for x in ("tools", "counts", "modes", "pitch", "teeth", "directions")), strict=True)
    for tool, n, m, pitch, teeth, d in each:
        own = slice(first, first + n)
        start = np.concatenate([[0], np.cumsum(sizes[own])])
        omega, U = a["omega"][at : at + n * m].reshape(n, m), a["U"][shape : shape + n * d * m].reshape(n, d, m)
        stop = row + int(start[-1])
        delay, rows = a["delay"][row:stop], np.ascontiguousarray(a["rows"][row:stop, : WIDTH if d == 3 else WIDTH - 2])
        some = DynamicCuts(
            start, rows, np.asarray(exponents, dtype=np.float64), a["period"][own],
            pitch, a["damping"][mode : mode + m], omega, U, a["damped"][row:stop],
            tuple(a["pitches"][tooth : tooth + teeth].tolist()), delay if delay.any() else np.zeros(0),
        )  # fmt: skip
        values = [tuple(v) for v in a["values"][own].tolist()]
        known[tool] = dict(zip([keys[ends[k] : ends[k + 1]] for k in range(first, first + n)], values, strict=True))
        cuts[tool] = [some]
        first, row, at, mode, tooth, shape = first + n, stop, at + n * m, mode + m, tooth + teeth, shape + n * d * m
    margins = dict(zip(a["first_steps"].tolist(), a["first_margins"].tolist(), strict=True))
    return known, cuts, {int(tool) for tool in a["leaning"].tolist()}, margins
