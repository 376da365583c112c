"""Fuzzy tables: the output for an error and its change.

Notation: e error, d its change, both over their span, so within [-1, 1] (what lies outside counts as the end); sets are
triangles over centres c_0 < c_1 < ..., each from its left neighbour to its right one; a, b memberships.

Mamdani: rule (i, j) fires with min(a_i(e), b_j(d)); each output set is cut off at the greatest firing of its rules;
the answer is the centroid of the greatest of the cut sets. Between two centres only two sets differ from 0, so area
and moment have a closed form there. Product and sum: sum over the rules of a_i(e) b_j(d) times the centre of its
output set.

With equally spaced sets and rules i + j that are not cut off, product and sum give e + d exactly; with the rule
clip(i + j) they give clip(e + d) but for the cells in which the cut begins, where they are lower in magnitude by at
most 1/12.

Reference: [Mamdani1975].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import LateModule
from chipload.tables import nearest, read_table

_fuzzy = LateModule("chipload.control._fuzzy")

Floats = NDArray[np.float64]

_CENTRES = ("error", "change", "output")
_KEYS = ("name", *_CENTRES, "ends", "rules")
_ENDS = ("half", "whole")


@dataclass(frozen=True, eq=False)
class FuzzyTable:
    """A fuzzy table: sets of error, change and output, and rules.

    Parameters
    ----------
    error, change, output : (p,), (q,), (r,) float, centres of the sets, increasing
    rules : (p, q) int, index of the output set
    whole_ends : the outermost output sets are whole triangles; False: cut off at their centres
    name : in messages

    Raises
    ------
    InputError
        Centres do not increase, an index is out of range, or a rule answers a greater error or change with less.
    """

    error: Floats
    change: Floats
    output: Floats
    rules: NDArray[np.int64]
    whole_ends: bool = False
    name: str = "table"

    def __post_init__(self) -> None:
        label = f"fuzzy {self.name}"
        for key in _CENTRES:
            centres = np.array(getattr(self, key), dtype=np.float64)
            if centres.ndim != 1 or not 2 <= len(centres) <= 99 or not np.isfinite(centres).all():
                raise InputError(f"{label}: {key}: must be a list of 2 to 99 numbers, the centres of the sets")
            for k in np.flatnonzero(np.diff(centres) <= 0.0):
                raise InputError(
                    f"{label}: {key}[{k + 1}] = {centres[k + 1]:g}: must be above {centres[k]:g} before it"
                )
            centres.setflags(write=False)
            object.__setattr__(self, key, centres)
        rules = np.array(self.rules, dtype=np.int64)
        shape = (len(self.error), len(self.change))
        if rules.shape != shape:
            raise InputError(f"{label}: rules: must be {shape[0]} rows (error) of {shape[1]} values (change)")
        for i, j in np.argwhere((rules < 0) | (rules >= len(self.output))):
            raise InputError(
                f"{label}: rules[{i}][{j}] = {rules[i, j]}: must be from 0 to {len(self.output) - 1}, an output set"
            )
        for axis, what in ((0, "error"), (1, "change")):
            for i, j in np.argwhere(np.diff(rules, axis=axis) < 0):
                at = (i + 1, j) if axis == 0 else (i, j + 1)
                raise InputError(
                    f"{label}: rules[{at[0]}][{at[1]}] = {rules[at]}: must be at least {rules[i, j]} before it: a "
                    f"greater {what} must not lower the feed"
                )
        rules.setflags(write=False)
        object.__setattr__(self, "rules", rules)


def read_fuzzy(path: str | Path) -> FuzzyTable:
    """Read a table from TOML: ``name``, ``error``, ``change``, ``output``, ``rules``, ``ends`` (`half`, `whole`).

    Centres are numbers or texts of fractions (`"2/3"`).

    Raises
    ------
    InputError
        The file cannot be read, or a value is missing, unknown or refused by :class:`FuzzyTable`.
    """
    label, table = read_table("fuzzy", path)
    for key in table:
        if key not in _KEYS:
            raise InputError(f"{label}: unknown key {key}: the nearest known one is {nearest(key, list(_KEYS))}")
    for key in _KEYS:
        if key not in table:
            raise InputError(f"{label}: {key} is missing: must be given")
    if table["ends"] not in _ENDS:
        raise InputError(f"{label}: ends = {table['ends']!r}: must be one of {', '.join(_ENDS)}")
    if not isinstance(table["name"], str):
        raise InputError(f"{label}: name = {table['name']!r}: must be a text")
    centres = [np.array([_number(label, key, x) for x in _list(label, key, table[key])]) for key in _CENTRES]
    rules = [_list(label, "rules", row) for row in _list(label, "rules", table["rules"])]
    for row in rules:
        for value in row:
            if isinstance(value, bool) or not isinstance(value, int):
                raise InputError(f"{label}: rules: {value!r}: must be a whole number, an output set counted from 0")
    if len({len(row) for row in rules}) > 1:
        raise InputError(f"{label}: rules: must be rows of equal length")
    return FuzzyTable(centres[0], centres[1], centres[2], np.array(rules), table["ends"] == "whole", table["name"])


def standard() -> FuzzyTable:
    """Return the shipped table: 7 x 7 sets, rule clip(i + j).

    >>> standard().rules[3].tolist()
    [0, 1, 2, 3, 4, 5, 6]
    """
    return read_fuzzy(str(resources.files("chipload.control") / "standard.toml"))


def write_fuzzy(table: FuzzyTable) -> str:
    """Return the TOML text of a table, from which :func:`read_fuzzy` reads the same table.

    >>> write_fuzzy(additive(3)).splitlines()[-2]
    '    [2, 3, 4],'
    """
    if any(ord(c) < 32 or c in '"\\' for c in table.name):
        raise InputError(f"fuzzy: name = {table.name!r}: must be without quotes, backslashes and control characters")
    lines = [f'name = "{table.name}"']
    lines += [f"{key} = [{', '.join(repr(float(x)) for x in getattr(table, key))}]" for key in _CENTRES]
    lines += [f'ends = "{_ENDS[int(table.whole_ends)]}"', "rules = ["]
    lines += [f"    {row}," for row in table.rules.tolist()]
    return "\n".join([*lines, "]"]) + "\n"


def additive(sets: int = 7) -> FuzzyTable:
    """Equally spaced sets and rules i + j that are not cut off; product and sum of it, clipped to +-1, is clip(e + d).

    >>> additive(3).rules.tolist(), additive(3).output.tolist()
    ([[0, 1, 2], [1, 2, 3], [2, 3, 4]], [-2.0, -1.0, 0.0, 1.0, 2.0])
    """
    if sets < 3 or sets % 2 == 0:
        raise InputError(f"fuzzy additive: sets = {sets}: must be odd and at least 3")
    centres = np.linspace(-1.0, 1.0, sets)
    index = np.arange(sets)
    return FuzzyTable(
        centres, centres, np.linspace(-2.0, 2.0, 2 * sets - 1), index[:, None] + index, False, f"additive {sets}"
    )


def mamdani(table: FuzzyTable, error: ArrayLike, change: ArrayLike) -> Floats:
    """Return the Mamdani output: minimum, maximum and centroid.

    Parameters
    ----------
    table : sets and rules
    error, change : float, shapes that broadcast

    Returns
    -------
    float of the broadcast shape, within the output sets.

    Raises
    ------
    InputError
        An input is not a number.

    Examples
    --------
    >>> float(mamdani(standard(), 0.0, 0.0))
    0.0
    """
    e, d = _inputs(error, change)
    out = np.empty(e.size)
    strength = np.empty(len(table.output))
    for k, (x, y) in enumerate(zip(e.ravel(), d.ravel(), strict=True)):
        out[k] = _fuzzy.mamdani(table.error, table.change, table.output, table.rules, table.whole_ends, x, y, strength)
    return out.reshape(e.shape)


def product_sum(table: FuzzyTable, error: ArrayLike, change: ArrayLike) -> Floats:
    """Return the output of product and sum: output centres interpolated over the rules; shapes as :func:`mamdani`."""
    e, d = _inputs(error, change)
    out = np.empty(e.size)
    for k, (x, y) in enumerate(zip(e.ravel(), d.ravel(), strict=True)):
        out[k] = _fuzzy.product_sum(table.error, table.change, table.output, table.rules, x, y)
    return out.reshape(e.shape)


def surface(table: FuzzyTable, points: int = 61) -> tuple[Floats, Floats, Floats]:
    """Error (points,), change (points,), Mamdani's answer (points, points), row: error, over the whole of the sets."""
    e = np.linspace(table.error[0], table.error[-1], points)
    d = np.linspace(table.change[0], table.change[-1], points)
    return e, d, mamdani(table, e[:, None], d[None, :])


def _inputs(error: ArrayLike, change: ArrayLike) -> tuple[Floats, Floats]:
    e, d = np.broadcast_arrays(np.asarray(error, dtype=np.float64), np.asarray(change, dtype=np.float64))
    for name, x in (("error", e), ("change", d)):
        if np.isnan(x).any():
            raise InputError(f"fuzzy: {name} = nan: must be a number; a lost sensor is not an error of 0")
    return e, d


def _list(label: str, key: str, value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise InputError(f"{label}: {key} = {value!r}: must be a list")
    return value


def _number(label: str, key: str, value: Any) -> float:
    try:
        if isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value):
            return float(value)
        if isinstance(value, str) and len(value) <= 20:
            return float(Fraction(value))
    except (ValueError, ArithmeticError):
        pass
    raise InputError(f"{label}: {key}: {value!r}: must be a number or a fraction")
