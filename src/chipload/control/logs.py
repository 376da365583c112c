"""Reading of logs of a cut: columns of a CSV or Parquet file, by name and unit.

Notation: t time [s], w spindle speed [rad/s], I spindle current [A], T torque [N mm], f feed [mm/s].

The table of columns (TOML, or a dict of the same form) names for each quantity its column and unit, and the time of a
row where the log has no column of time:

    sample_s = 0.1
    [speed]
    column = "S1_ActualVelocity"
    unit = "rev/s"

Quantities are ``time``, ``speed``, ``current``, ``power``, ``torque``, ``feed``, ``line`` (of the program),
``override`` (feed over programmed feed) and ``label`` (a text, without a unit; its key ``cutting`` lists how the texts
of rows in the cut begin). Currents that were written in steps of a converter have the unit ``count``; what is made of
them is in counts too. Without a table the columns are known by their names, as `time_s`, `speed_rpm`, `current_a`,
`power_w`, `torque_nm`: what `chipload hal --out` writes is read so. A log without a head, as LinuxCNC's `halsampler`
writes it, has ``head = false``; its columns are numbered from 1, and are separated by spaces. A Parquet file is known
by its first bytes; its times of day become seconds after the first.
"""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, InputError
from chipload.files import read_regular
from chipload.lazy import pa, pa_csv, pq
from chipload.tables import nearest, read_table

Floats = NDArray[np.float64]

#: of a file that is read [bytes]
MOST_BYTES = 1 << 28
#: first bytes of a Parquet file
PARQUET = b"PAR1"
#: quantity -> unit -> factor to the unit inside
UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3},
    "speed": {"rad/s": 1.0, "rpm": math.tau / 60.0, "rev/s": math.tau},
    "current": {"A": 1.0, "mA": 1e-3, "count": 1.0},
    "power": {"W": 1e3, "kW": 1e6},
    "torque": {"N mm": 1.0, "N m": 1e3},
    "feed": {"mm/s": 1.0, "mm/min": 1.0 / 60.0},
    "line": {"": 1.0},
    "override": {"": 1.0, "%": 1e-2},
}
#: a number from here on is none of a measurement
GREATEST = 1e30
#: quantities that tell the load
LOADS = frozenset({"current", "power", "torque"})
_QUANTITIES = (*UNITS, "label")
#: columns that are known by their names: name -> quantity, unit
KNOWN = {
    "time_s": ("time", "s"), "t_s": ("time", "s"), "time_ms": ("time", "ms"), "speed_rpm": ("speed", "rpm"),
    "speed_rad_s": ("speed", "rad/s"), "speed_rev_s": ("speed", "rev/s"), "spindle_rpm": ("speed", "rpm"),
    "current_a": ("current", "A"), "power_w": ("power", "W"), "power_kw": ("power", "kW"),
    "torque_nm": ("torque", "N m"), "torque_mean_nm": ("torque", "N m"), "torque_nmm": ("torque", "N mm"),
    "feed_mm_min": ("feed", "mm/min"), "feed_mm_s": ("feed", "mm/s"), "label": ("label", ""),
    "line": ("line", ""), "override": ("override", ""), "override_percent": ("override", "%"),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class SpindleLog:
    """Columns of a log; a column that it lacks is None.

    Parameters
    ----------
    time : (n,) float [s], rising
    current : (n,) float [A] (or counts)
    power : (n,) float [N mm/s]
    speed : (n,) float [rad/s]
    torque : (n,) float [N mm]
    feed : (n,) float [mm/s]
    line : (n,) float, line of the program
    override : (n,) float, feed over programmed feed
    label : (n,) text
    cutting : (n,) bool, by the label
    """

    time: Floats
    current: Floats | None = None
    power: Floats | None = None
    speed: Floats | None = None
    torque: Floats | None = None
    feed: Floats | None = None
    line: Floats | None = None
    override: Floats | None = None
    label: NDArray[np.str_] | None = None
    cutting: NDArray[np.bool_] | None = None


@dataclass(frozen=True)
class _Columns:
    """Quantity -> (column, unit), time of a row, how labels of the cut begin, and whether there is a head."""

    wanted: dict[str, tuple[str, str]]
    sample: float | None
    cutting: tuple[str, ...]
    head: bool


def read_log(path: str | Path, columns: dict[str, Any] | str | Path | None = None) -> tuple[SpindleLog, list[Finding]]:
    """Read a log from a CSV or Parquet file.

    Parameters
    ----------
    path : CSV with a head of names, separated by commas, or Parquet
    columns : the table of columns, or the path of its TOML file; None: the columns are known by their names

    Returns
    -------
    The log and findings: rows that are left out because a number is missing (``log-row``), or because the time does not
    rise (``log-time``), each kind once, with the first line and how many.

    Raises
    ------
    InputError
        A file cannot be read or is too large, a column is not there, a unit is not known, no row is left.
    """
    label = f"log {path}"
    stated = _check_columns(columns) if columns is not None else None
    data = read_regular(path, label, MOST_BYTES, "cut it into parts")
    text = _parquet_as_csv(label, data, stated) if data[:4] == PARQUET else data.decode("utf-8-sig", "replace")
    try:
        names, rows = _table(text, stated is None or stated.head)
        layout = stated or _by_name(label, names)
        places = {}
        for quantity, (name, _) in layout.wanted.items():
            if name not in names:
                near = f": the nearest is {nearest(name, names)}" if names else ": the file is empty"
                raise InputError(f"{label}: no column {name} for {quantity}{near}")
            places[quantity] = names.index(name)
        kept, bad, number = _complete_rows(rows, places)
    except csv.Error as err:
        raise InputError(f"{label}: not a CSV file: {err}") from None
    wanted, sample = layout.wanted, layout.sample
    findings = []
    if bad:
        findings.append(
            Finding("log-row", bad[0], f"{len(bad)} rows are left out: a number is missing or above {GREATEST:g}")
        )
    if not kept:
        raise InputError(f"{label}: no row with all of {', '.join(n for n, _ in wanted.values())}")
    made: dict[str, Any] = {"time": np.array(number, dtype=np.float64) * (sample or 0.0)}
    for k, quantity in enumerate(places):
        values = [row[k] for row in kept]
        if quantity == "label":
            made["label"] = np.array(values, dtype=np.str_)
            if layout.cutting:
                made["cutting"] = np.array([str(x).startswith(layout.cutting) for x in values])
        else:
            made[quantity] = np.array(values, dtype=np.float64) * UNITS[quantity][wanted[quantity][1]]
    rising = np.concatenate([[True], made["time"][1:] > np.maximum.accumulate(made["time"])[:-1]])
    if not rising.all():
        first = int(np.flatnonzero(~rising)[0])
        findings.append(
            Finding("log-time", number[first] + 2, f"{int((~rising).sum())} rows are left out: time does not rise")
        )
        made = {key: column[rising] for key, column in made.items()}
    return SpindleLog(**made), findings


def columns_text(path: str | Path) -> str:
    """Return the columns that a table of columns (TOML) states, in words.

    Raises
    ------
    InputError
        As :func:`read_log` of the table.
    """
    stated = _check_columns(path)
    each = [f"{quantity} {name}{f' [{unit}]' if unit else ''}" for quantity, (name, unit) in stated.wanted.items()]
    return ", ".join([*each, *([f"a row each {stated.sample:g} s"] if stated.sample is not None else [])])


@dataclass(frozen=True)
class LogLayout:
    """Where the quantities of a log stand in a row.

    Parameters
    ----------
    places : quantity -> (place of its column, factor to the unit inside)
    sample_s : time of a row where the log has no column of time [s]; None: it has one
    head : whether the first row names the columns; rows without it are separated by spaces
    """

    places: dict[str, tuple[int, float]]
    sample_s: float | None
    head: bool


def log_columns(
    label: str, first: str, columns: dict[str, Any] | str | Path | None, needed: tuple[str, ...]
) -> LogLayout:
    """Return the layout of a log by its first row.

    Parameters
    ----------
    label : of the log, for messages
    columns : as in :func:`read_log`
    needed : quantities that it must have

    Raises
    ------
    InputError
        A column is not there.
    """
    stated = _check_columns(columns) if columns is not None else None
    names, _ = _table(first, stated is None or stated.head)
    layout = stated or _by_name(label, names)
    for quantity in needed:
        if quantity not in layout.wanted:
            raise InputError(f"{label}: no column of {quantity}, which is needed: log it, or name it with --columns")
    places = {}
    for quantity, (name, unit) in layout.wanted.items():
        if name not in names:
            raise InputError(f"{label}: no column {name} for {quantity}: the nearest is {nearest(name, names)}")
        if quantity in UNITS:
            places[quantity] = (names.index(name), UNITS[quantity][unit])
    return LogLayout(places, layout.sample, layout.head)


def _table(text: str, head: bool) -> tuple[list[str], Any]:
    """Return column names and rows; without a head the names are numbers and the separators spaces."""
    if head:
        rows = csv.reader(io.StringIO(text, newline=""))
        return [name.strip() for name in next(rows, [])], rows
    lines = [line.split() for line in text.splitlines()]
    return [str(k + 1) for k in range(max(map(len, lines), default=0))], iter(lines)


def _parquet_as_csv(label: str, data: bytes, stated: _Columns | None) -> str:
    """Return the columns of a Parquet file that can be used, as the text of a CSV file; O(rows)."""
    if stated is not None and not stated.head:
        raise InputError(f"{label}: head = false: a Parquet file names its columns: leave it out")
    used = KNOWN if stated is None else {name: (quantity, u) for quantity, (name, u) in stated.wanted.items()}
    try:
        with pq.ParquetFile(pa.BufferReader(data)) as file:
            names = [name for name in file.schema_arrow.names if name in used]
            if file.metadata.num_rows * max(len(names), 1) * 8 > MOST_BYTES:
                raise InputError(
                    f"{label}: {file.metadata.num_rows} rows of {len(names)} columns: more than {MOST_BYTES} bytes: "
                    "cut it into parts"
                )
            table = file.read(names) if names else pa.table({name: [] for name in file.schema_arrow.names})
        for place, name in enumerate(names):
            column = table[name]
            if pa.types.is_timestamp(column.type):
                if used[name] != ("time", "s"):
                    raise InputError(f"{label}: column {name} holds times of day: it can only be time, in s")
                table = table.set_column(place, name, pa.array(_seconds_after_first(column), from_pandas=True))
        out = pa.BufferOutputStream()
        pa_csv.write_csv(table, out)
    except (OSError, pa.ArrowException, UnicodeDecodeError) as err:
        raise InputError(f"{label}: not a Parquet file of numbers and texts: {err}") from None
    return bytes(out.getvalue()).decode("utf-8", "replace")


def _seconds_after_first(column: pa.ChunkedArray) -> Floats:
    """Return times of day (n,) as seconds after the earliest; NaN where one is missing."""
    times = column.combine_chunks().to_numpy(zero_copy_only=False).astype("datetime64[ns]")
    missing = np.isnat(times)
    if missing.all():
        return np.full(len(times), np.nan)
    seconds = (times - times[~missing].min()) / np.timedelta64(1, "s")
    return np.where(missing, np.nan, seconds)


def _by_name(label: str, names: list[str]) -> _Columns:
    """Return the columns that are known by their names."""
    wanted: dict[str, tuple[str, str]] = {}
    for name in names:
        quantity, unit = KNOWN.get(name, ("", ""))
        if quantity and quantity not in wanted:
            wanted[quantity] = (name, unit)
    if "time" not in wanted or not LOADS & set(wanted):
        if not any(names):
            raise InputError(f"{label}: the file is empty: log the program")
        if len(names) == 1 and ";" in names[0]:
            raise InputError(
                f"{label}: its columns are separated by semicolons: export it with commas, and a point in its numbers"
            )
        raise InputError(
            f"{label}: no column of time and of current, power or torque by a known name, as time_s and current_a: "
            "state --columns, a TOML file that names them"
        )
    return _Columns(wanted, None, (), True)


def _complete_rows(rows: Any, places: dict[str, int]) -> tuple[list[list[float | str]], list[int], list[int]]:
    """Return the values of complete rows, the lines of the others, and the number of each complete row."""
    kept: list[list[float | str]] = []
    bad, number = [], []
    for k, row in enumerate(rows):
        if not row:
            continue
        values: list[float | str] = []
        for quantity, place in places.items():
            text = row[place].strip() if place < len(row) else ""
            if quantity == "label":
                values.append(text)
                continue
            try:
                value = float(text)
            except ValueError:
                break
            if not abs(value) < GREATEST:
                break
            values.append(value)
        if len(values) == len(places):
            kept.append(values)
            number.append(k)
        else:
            bad.append(k + 2)
    return kept, bad, number


def _check_columns(columns: dict[str, Any] | str | Path) -> _Columns:
    """Return the table of columns after a check."""
    label, table = ("log columns", columns) if isinstance(columns, dict) else read_table("log columns", columns)
    out: dict[str, tuple[str, str]] = {}
    sample, cutting, head = None, (), True
    for key, value in table.items():
        if key == "sample_s":
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0.0 < value < math.inf:
                raise InputError(f"{label}: sample_s = {value!r}: must be a number above 0")
            sample = float(value)
            continue
        if key == "head":
            if not isinstance(value, bool):
                raise InputError(f"{label}: head = {value!r}: must be true or false")
            head = value
            continue
        if key not in _QUANTITIES:
            raise InputError(
                f"{label}: unknown quantity {key}: the nearest known one is {nearest(key, [*_QUANTITIES])}"
            )
        column = value.get("column") if isinstance(value, dict) else None
        if not (isinstance(column, str) or (isinstance(column, int) and not isinstance(column, bool))):
            raise InputError(f"{label}: {key}: must be a table with column and unit")
        unit = value.get("unit", "")
        if key != "label" and unit not in UNITS[key]:
            raise InputError(f"{label}: {key}.unit = {unit!r}: must be one of {', '.join(UNITS[key])}")
        if key == "label":
            texts = value.get("cutting", [])
            if not (isinstance(texts, list) and all(isinstance(x, str) and x for x in texts)):
                raise InputError(f"{label}: label.cutting = {texts!r}: must be a list of texts")
            cutting = tuple(texts)
        out[key] = (str(column), unit)
    if not LOADS & set(out):
        raise InputError(
            f"{label}: current is missing: the column of the spindle current must be named, or power or torque"
        )
    if ("time" in out) == (sample is not None):
        raise InputError(f"{label}: must give either time or sample_s")
    return _Columns(out, sample, cutting, head)
