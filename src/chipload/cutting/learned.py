"""What a learned material was before, the logs that changed it, and what the knowledge is worth: ``[learned]``."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from chipload.errors import InputError
from chipload.number_text import number_text
from chipload.tables import nearest


@dataclass(frozen=True)
class LogEvidence:
    """A log that coefficients were learned from.

    Parameters
    ----------
    name : of its file
    sha256 : of its bytes
    rows : (first, last) of its rows that lie within the program, from 1
    blocks, left_out : means over equal times that were used, and that contradict the program
    """

    name: str
    sha256: str
    rows: tuple[int, int]
    blocks: int
    left_out: int


@dataclass(frozen=True)
class KnowledgeWorth:
    """What a job gave with the material before and after, from a run with each.

    Parameters
    ----------
    job : name of its file
    sha256 : of its bytes
    verdicts : (before, after)
    limit : the load limit that was nearest to its bound before; empty: none is stated
    of_limit : (before, after) its value at the confidence of the job over the limit; 0 without one
    seconds : (before, after) time of the programs in use [s]
    saving : (before, after) less time than the programmed feeds take, relative; None: the job finds no feeds
    """

    job: str
    sha256: str
    verdicts: tuple[str, str]
    limit: str
    of_limit: tuple[float, float]
    seconds: tuple[float, float]
    saving: tuple[float, float] | None = None

    @property
    def text(self) -> str:
        """The worth as a sentence.

        >>> own = KnowledgeWorth("a.toml", "", ("unproven", "holds"), "", (0.0, 0.0), (50.0, 40.0), (0.18, 0.27))
        >>> own.text.split("; ")[1:]
        ['time 50 s before, 40 s now', 'the saving of time rises from 18 (not proven) to 27 %']
        """
        old, new = self.verdicts
        out = [
            f"{self.job}: verdict {old} before, {new} now" if old != new else f"{self.job}: verdict {new}, as before"
        ]
        if self.limit:
            shares = [f"{number_text(100.0 * x)} %" for x in self.of_limit]
            out.append(f"{self.limit} at confidence {shares[0]} of its limit before, {shares[1]} now")
        out.append(f"time {number_text(self.seconds[0])} s before, {number_text(self.seconds[1])} s now")
        if self.saving is not None:
            a, b = (number_text(100.0 * x, 3) for x in self.saving)
            first = "" if old == "holds" else " (not proven)"
            last = "" if new == "holds" else ", which is not proven"
            moves = (
                "rises" if self.saving[1] > self.saving[0] else "falls" if self.saving[1] < self.saving[0] else "stays"
            )
            out.append(f"the saving of time {moves} from {a}{first} to {b} %{last}")
        return "; ".join(out)


@dataclass(frozen=True)
class GainKnowledge:
    """What logs tell of the gain of the spindle's signal; coefficients learned with it are off where it is.

    Parameters
    ----------
    signal : ``power``, ``current`` or ``torque``
    stated, stated_deviation : gain, as the signal is defined, and its relative standard deviation before the first log
    ratio, deviation : gain over the stated one after the logs, and the standard deviation of that
    with_ktc, with_kte : its covariance with Ktc and Kte over the learned ones
    """

    signal: str
    stated: float
    stated_deviation: float
    ratio: float
    deviation: float
    with_ktc: float
    with_kte: float


@dataclass(frozen=True)
class LearnedRecord:
    """How a material was learned.

    Parameters
    ----------
    prior : name of the material before
    ktc, kte : (coefficient before [MPa, N/mm], its relative standard deviation)
    logs : in the order in which they ran
    worth : of the knowledge, one a job that was run with both materials
    gain : of the signal of the logs; None: a record of an earlier version
    """

    prior: str
    ktc: tuple[float, float]
    kte: tuple[float, float]
    logs: tuple[LogEvidence, ...]
    worth: tuple[KnowledgeWorth, ...] = ()
    gain: GainKnowledge | None = None

    @property
    def logs_text(self) -> str:
        """The logs with the rows and blocks that were used, and the begin of their hashes."""
        return ", ".join(
            f"{log.name} (rows {log.rows[0]} to {log.rows[1]}, {log.blocks} blocks, {log.left_out} left out, sha256 "
            f"{log.sha256[:16]})"
            for log in self.logs
        )


#: keys of ``[learned]`` in a file: (coefficient, its deviation)
_BEFORE = {"ktc": ("prior_ktc_mpa", "prior_ktc_deviation"), "kte": ("prior_kte_n_mm", "prior_kte_deviation")}


def learned_text(record: LearnedRecord) -> str:
    """Return the TOML text of a record."""
    head: dict[str, Any] = {"prior": record.prior}
    for name, keys in _BEFORE.items():
        head |= dict(zip(keys, getattr(record, name), strict=True))
    out = ["\n[learned]\n", *_lines(head)]
    if record.gain is not None:
        out += ["\n[learned.gain]\n", *_lines({f.name: getattr(record.gain, f.name) for f in fields(GainKnowledge)})]
    for title, rows in (("log", record.logs), ("worth", record.worth)):
        for row in rows:
            values = {f.name: getattr(row, f.name) for f in fields(row)}
            out += [f"\n[[learned.{title}]]\n", *_lines({k: v for k, v in values.items() if v is not None})]
    return "".join(out)


def _lines(values: Mapping[str, Any]) -> list[str]:
    return [f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in values.items()]


def learned_of(label: str, table: Any) -> LearnedRecord:
    """Return the record of the table ``[learned]`` of a material's file.

    Raises
    ------
    InputError
        A key is unknown, missing, or not of its kind.
    """
    label = f"{label}: learned"
    known = ("prior", *(key for keys in _BEFORE.values() for key in keys), "log", "worth", "gain")
    _check_keys(label, table, known, optional=("worth", "gain"))
    pairs = {name: (_number(label, table, a), _number(label, table, b)) for name, (a, b) in _BEFORE.items()}
    return LearnedRecord(
        _text(label, table, "prior"), pairs["ktc"], pairs["kte"],
        tuple(_log_of(f"{label}.log.{k}", row) for k, row in enumerate(_rows(label, table, "log"))),
        tuple(_worth_of(f"{label}.worth.{k}", row) for k, row in enumerate(_rows(label, table, "worth"))),
        _gain_of(f"{label}.gain", table["gain"]) if "gain" in table else None,
    )  # fmt: skip


def _gain_of(label: str, row: Any) -> GainKnowledge:
    _check_keys(label, row, tuple(f.name for f in fields(GainKnowledge)))
    numbers = {key: _number(label, row, key) for key in ("stated", "stated_deviation", "ratio", "deviation")}
    with_ktc, with_kte = (_pair(label, {"pair": [row[key], 0.0]}, "pair")[0] for key in ("with_ktc", "with_kte"))
    return GainKnowledge(_text(label, row, "signal"), **numbers, with_ktc=with_ktc, with_kte=with_kte)


def _log_of(label: str, row: Any) -> LogEvidence:
    _check_keys(label, row, tuple(f.name for f in fields(LogEvidence)))
    first, last = _pair(label, row, "rows")
    return LogEvidence(
        _text(label, row, "name"), _text(label, row, "sha256"), (int(first), int(last)),
        int(_number(label, row, "blocks")), int(_number(label, row, "left_out")),
    )  # fmt: skip


def _worth_of(label: str, row: Any) -> KnowledgeWorth:
    _check_keys(label, row, tuple(f.name for f in fields(KnowledgeWorth)), optional=("saving",))
    verdicts = row["verdicts"]
    if not (isinstance(verdicts, list) and len(verdicts) == 2 and all(isinstance(v, str) for v in verdicts)):
        raise InputError(f"{label}: verdicts = {verdicts!r}: must be two texts")
    return KnowledgeWorth(
        _text(label, row, "job"), _text(label, row, "sha256"), (verdicts[0], verdicts[1]), _text(label, row, "limit"),
        _pair(label, row, "of_limit"), _pair(label, row, "seconds"),
        _pair(label, row, "saving") if "saving" in row else None,
    )  # fmt: skip


def _check_keys(label: str, table: Any, known: tuple[str, ...], optional: tuple[str, ...] = ()) -> None:
    if not isinstance(table, dict):
        raise InputError(f"{label}: must be a table")
    for key in table:
        if key not in known:
            raise InputError(f"{label}: unknown key {key}: the nearest known one is {nearest(key, list(known))}")
    for key in known:
        if key not in table and key not in optional:
            raise InputError(f"{label}: {key} is missing: chipload learn writes it")


def _rows(label: str, table: Any, key: str) -> list[Any]:
    rows = table.get(key, [])
    if not isinstance(rows, list):
        raise InputError(f"{label}: {key}: must be a list of tables")
    return rows


def _text(label: str, table: Any, key: str) -> str:
    if not isinstance(table[key], str):
        raise InputError(f"{label}: {key} = {table[key]!r}: must be a text")
    return str(table[key])


def _number(label: str, table: Any, key: str) -> float:
    value = table[key]
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0.0 <= value < math.inf:
        raise InputError(f"{label}: {key} = {value!r}: must be a number of at least 0")
    return float(value)


def _pair(label: str, table: Any, key: str) -> tuple[float, float]:
    values = table[key]
    numbers = isinstance(values, list) and all(
        isinstance(v, (int, float)) and not isinstance(v, bool) and math.isfinite(v) for v in values
    )
    if not numbers or len(values) != 2:
        raise InputError(f"{label}: {key} = {values!r}: must be two numbers")
    return float(values[0]), float(values[1])
