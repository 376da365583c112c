"""What a summary says of limits and failures, and the row of the history that each belongs to.

Any kind of result is read alike: entries of ``limits`` and ``fails``, of an operation or of its strategies, ``broken``
lines of a program. A place is found in the history by the line or by the point (x, y[, z]) that is stated with it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.report.held import LIMITS
from chipload.report.outcome import WORDS
from chipload.web.result import Result, Text, Track, released

#: endings of names, and the unit they say
UNITS = (
    *(("_mm_min", "mm/min"), ("_mm3", "mm\u00b3"), ("_rpm", "rpm"), ("_deg", "deg"), ("_nm", "N m"), ("_um", "um")),
    *(("_mm", "mm"), ("_n", "N"), ("_w", "W"), ("_s", "s")),
)
#: rows as near to a place as the nearest, within this [mm]
SAME_MM = 1e-6
#: failures that are listed
LISTED = 300


@dataclass(frozen=True)
class Held:
    """A limit of a track: ``state`` is `holds`, `does not hold` or `unproven`; ``row`` None: not in the history."""

    name: str
    unit: str
    limit: float
    worst: float | None
    state: str
    where: str
    row: int | None


@dataclass(frozen=True)
class Failing:
    """Something that does not hold or was noticed: ``grave`` things decide the verdict."""

    text: str
    row: int | None
    grave: bool


def named(column: str) -> tuple[str, str]:
    """Words and unit of a column or a limit.

    >>> named("force_xy_n"), named("torque_nm"), named("feed_mm_min"), named("tool")
    (('force', 'N'), ('torque', 'N m'), ('feed', 'mm/min'), ('tool', ''))
    >>> named("force_x_mean_n"), named("s_mm"), named("t_s")
    (('force x mean', 'N'), ('path', 'mm'), ('time', 's'))
    """
    fixed = {"s_mm": ("path", "mm"), "t_s": ("time", "s"), **WORDS}
    if column in fixed:
        return fixed[column]
    for ending, unit in UNITS:
        if column.endswith(ending) and len(column) > len(ending):
            return column.removesuffix(ending).replace("_", " "), unit
    return column.replace("_", " "), ""


@dataclass(frozen=True, eq=False)
class Bound:
    """A stated limit of a column: ``free`` passes are not held to it, ``above`` (n,) rows exceed it."""

    limit: float
    free: tuple[str, ...]
    above: NDArray[np.bool_]


def bound_of(result: Result, track: Track, column: str) -> Bound | None:
    """The stated limit of a column.

    A limit need not hold everywhere: a pass with values beyond what the summary calls the worst was not held to it.
    """
    entry = next((e for e in _limits(result, track) if _column(str(e.get("name", ""))) == column), {})
    limit, worst = _number(entry.get("limit")), _number(entry.get("worst"))
    if limit is None or column not in result.columns:
        return None
    values = result.column(track, column)
    if isinstance(values, Text):
        return None
    above = np.nan_to_num(values) > limit
    free: list[str] = []
    passes = result.column(track, "pass") if "pass" in result.columns else None
    if worst is not None and isinstance(passes, Text):
        beyond = np.nan_to_num(values) > worst * (1.0 + 1e-9)
        codes = np.unique(passes.codes[beyond & (passes.codes >= 0)]).tolist()
        free = [passes.words[k] for k in codes]
        above &= ~np.isin(passes.codes, codes)
    return Bound(limit, tuple(free), above)


def limits(result: Result, track: Track) -> list[Held]:
    """The limits of a track, those that do not hold first."""
    out = []
    for entry in _limits(result, track):
        limit = _number(entry.get("limit"))
        if limit is None:
            continue
        name = str(entry.get("name", ""))
        word, unit = named(name)
        holds = entry.get("holds")
        state = "holds" if holds is True else "does not hold" if holds is False else "unproven"
        worst = _number(entry.get("worst"))
        line = entry.get("line")
        at = _point(entry.get("at_mm"))
        row = _row(result, track, at, line, _column(name), worst)
        said = f"line {line}" if isinstance(line, int) and line > 0 else ""
        if at is not None:
            said += (" \u00b7 " if said else "") + ", ".join(f"{x:.2f}" for x in at)
        out.append(Held(word, unit, limit, worst, state, said, row))
    return sorted(out, key=lambda h: h.state == "holds")


def failures(result: Result, track: Track) -> list[Failing]:
    """What does not hold beside the limits of the table, then events and what readers noticed."""
    summary, found = result.summary, _strategy(result, track)
    shown = tuple(h.name for h in limits(result, track) if h.state != "holds")
    texts = [str(t) for t in _list(found.get("fails"))]
    out = [_of_text(result, track, t, True) for t in texts if not (" exceeds " in t and t.startswith(tuple(shown)))]
    use = released(summary, track.operation)
    if use is not None and use != track.strategy:
        out.append(Failing(f"{track.strategy} is not released: the job uses {use}", None, False))
    out += [_of_line(result, track, entry, True) for entry in _dicts(summary.get("broken"))]
    for entry in _dicts(found.get("events")):
        at = _point([entry.get("x_mm"), entry.get("y_mm")])
        row = _row(result, track, at, None, None, None)
        out.append(Failing(str(entry.get("text", entry.get("code", ""))), row, entry.get("failure") is True))
    out += [_of_line(result, track, entry, False) for entry in _dicts(summary.get("findings"))]
    out += [Failing(str(t), None, False) for t in _list(summary.get("findings")) if isinstance(t, str)]
    proof = found.get("verification")
    if isinstance(proof, dict):
        out.append(Failing(f"simulation: {proof.get('says', '')}", None, proof.get("status") == "failed"))
    unchecked = [*_list(summary.get("unchecked")), *_list(_operation(result, track).get("unchecked"))]
    if unchecked:
        out.append(Failing(f"not checked, no limit stated: {', '.join(map(str, unchecked))}", None, False))
    seen: dict[str, Failing] = {}
    for item in sorted(out, key=lambda f: not f.grave):
        seen.setdefault(item.text, item)
    return list(seen.values())[:LISTED]


# -- parts ------------------------------------------------------------------------------------------------------
def _operation(result: Result, track: Track) -> dict[str, Any]:
    some = _list(result.summary.get("operations"))
    if track.operation < len(some) and isinstance(some[track.operation], dict):
        return dict(some[track.operation])
    return {}


def _strategy(result: Result, track: Track) -> dict[str, Any]:
    """The part of the summary that a track belongs to: its strategy, or the whole operation."""
    operation = _operation(result, track)
    strategies = operation.get("strategies")
    own = strategies.get(track.strategy) if isinstance(strategies, dict) else None
    return own if isinstance(own, dict) else operation


def _limits(result: Result, track: Track) -> Iterator[dict[str, Any]]:
    own = _dicts(_strategy(result, track).get("limits"))
    yield from own or _dicts(result.summary.get("limits"))


def _column(name: str) -> str:
    return LIMITS[name][0] if name in LIMITS else name


def _of_line(result: Result, track: Track, entry: dict[str, Any], grave: bool) -> Failing:
    line = entry.get("line")
    text = str(entry.get("text", entry.get("code", "")))
    said = f"line {line}: {text}" if isinstance(line, int) and line > 0 else text
    return Failing(said, _row(result, track, None, line, None, None), grave)


def _of_text(result: Result, track: Track, text: str, grave: bool) -> Failing:
    """The place that a sentence itself states: `... in line 12`, `... at (1.000, 2.000)`."""
    line = re.search(r"\bline (\d{1,9})\b", text)
    point = re.search(r"\(([-+\d.e]+(?:, [-+\d.e]+){1,2})\)", text)
    at = None
    if point is not None:
        try:
            at = _point([float(x) for x in point[1].split(", ")])
        except ValueError:
            at = None
    return Failing(text, _row(result, track, at, int(line[1]) if line else None, None, None), grave)


def _row(
    result: Result, track: Track, at: tuple[float, ...] | None, line: Any, column: str | None, worst: float | None
) -> int | None:
    """The row of a line and a place; of several as near, the one whose value is the worst."""
    near = np.arange(len(track))
    if isinstance(line, int) and line > 0 and track.line is not None:
        own = np.flatnonzero(track.line == line)
        if len(own):
            near = own
        elif at is None:
            later = np.flatnonzero(track.line > line)
            return int(later[0]) if len(later) else None
    elif at is None:
        return None
    if at is not None:
        d = np.linalg.norm(track.place[near][:, : len(at)] - np.array(at), axis=1)
        near = near[d <= d.min() + SAME_MM]
    if worst is not None and column is not None and column in result.columns:
        values = result.column(track, column)
        if not isinstance(values, Text):
            off = np.abs(np.abs(np.nan_to_num(values[near], nan=math.inf)) - abs(worst))
            return int(near[int(np.argmin(off))])
    return int(near[0]) if len(near) else None


def _point(value: Any) -> tuple[float, ...] | None:
    numbers = [_number(x) for x in _list(value)]
    found = [x for x in numbers if x is not None]
    return tuple(found) if len(found) == len(numbers) and len(found) in (2, 3) else None


def _number(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        return None
    return float(value)


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def _dicts(value: Any) -> list[dict[str, Any]]:
    return [x for x in _list(value) if isinstance(x, dict)]
