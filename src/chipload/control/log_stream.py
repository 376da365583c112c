"""Samples of a spindle while it runs: rows of a CSV file that another program appends to, answers of an agent.

A file that is replaced or cut off is read again from its begin; a row that is not complete waits for its end.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from chipload.control.learning import SignalKind
from chipload.control.logs import KNOWN, PARQUET, UNITS, LogLayout, log_columns, read_log
from chipload.errors import InputError
from chipload.machine.mtconnect_stream import AgentSource, follow_agent

#: seconds between two looks at a file
POLL_S = 0.2
#: longest row [bytes]
LONGEST = 1 << 16


@dataclass(frozen=True)
class LoadSample:
    """A sample of a spindle.

    Parameters
    ----------
    time : [s]
    value : of the signal, in the units inside
    line : of the program
    override : of the feed
    """

    time: float
    value: float
    line: int
    override: float = 1.0


def log_text(samples: Iterable[LoadSample], kind: SignalKind) -> str:
    """Return samples as a CSV that :func:`chipload.control.logs.read_log` reads.

    >>> print(log_text([LoadSample(0.02, 3e5, 7)], SignalKind.POWER), end="")
    time_s,power_w,line,override
    0.0200,300.000,7,1.0000
    """
    column = next(name for name, (quantity, _) in KNOWN.items() if quantity == kind.value)
    factor = UNITS[kind.value][KNOWN[column][1]]
    rows = (f"{s.time:.4f},{s.value / factor:.3f},{s.line},{s.override:.4f}\n" for s in samples)
    return "".join([f"time_s,{column},line,override\n", *rows])


def follow_file(
    path: Path,
    kind: SignalKind,
    columns: dict[str, Any] | str | Path | None = None,
    *,
    once: bool = False,
    wait: Callable[[float], None] = time.sleep,
) -> Iterator[LoadSample | None]:
    """Yield the samples of a CSV file, as it grows, or of a Parquet file; None where there is none now.

    Parameters
    ----------
    kind : of the signal
    columns : as :func:`chipload.control.logs.read_log`
    once : end at the end of the file
    wait : sleeps for so many seconds

    Raises
    ------
    InputError
        There is no such file, it has no column of the time, the signal or the line, or it is a Parquet file that is
        waited for.
    """
    if not path.is_file():
        raise InputError(f"log {path}: no such file: start the program that writes it first")
    with path.open("rb") as file:
        is_parquet = file.read(len(PARQUET)) == PARQUET
    if is_parquet:
        if not once:
            raise InputError(f"log {path}: a Parquet file does not grow: state --once, or write CSV")
        yield from _samples_of(path, kind, columns)
        return
    while True:
        with path.open("rb") as file:
            yield from _rows(path, file, kind, columns, once, wait)
        if once:
            return


def _samples_of(path: Path, kind: SignalKind, columns: dict[str, Any] | str | Path | None) -> Iterator[LoadSample]:
    """Yield the samples of a log that is complete."""
    log, _ = read_log(path, columns)
    values = {SignalKind.POWER: log.power, SignalKind.CURRENT: log.current, SignalKind.TORQUE: log.torque}[kind]
    if values is None or log.line is None:
        missing = kind.value if values is None else "line"
        raise InputError(f"log {path}: no column of {missing}, which is needed: log it, or name it with --columns")
    override = [1.0] * len(log.time) if log.override is None else log.override
    for at, value, line, share in zip(log.time, values, log.line, override, strict=True):
        yield LoadSample(float(at), float(value), int(line), float(share))


def agent_samples(
    source: AgentSource,
    kind: SignalKind,
    *,
    notice: Callable[[str], None],
) -> Iterator[LoadSample | None]:
    """Yield the samples of a signal of an MTConnect agent, each with the last line and override; None: none is new.

    Parameters
    ----------
    notice : as :func:`chipload.machine.mtconnect_stream.follow_agent`

    Raises
    ------
    InputError
        As :func:`chipload.machine.mtconnect_stream.follow_agent`; the current values have no line or no signal.
    """
    column = next(name for name, (quantity, _) in KNOWN.items() if quantity == kind.value)
    factor = UNITS[kind.value][KNOWN[column][1]]
    last: dict[str, float | None] = {}
    for k, found in enumerate(follow_agent(source, notice=notice)):
        for at, _, name, value in found:
            last[name] = value
            if k > 0 and name == column and value is not None:
                override = last.get("override_percent")
                share = 1.0 if override is None else 0.01 * override
                yield LoadSample(at, factor * value, int(last.get("line") or 0), share)
        if k == 0 and not {column, "line"} <= last.keys():
            missing = ", ".join(sorted({column, "line"} - last.keys()))
            raise InputError(f"MTConnect {source.address}: no {missing} of a spindle and its path: add it to the agent")
        yield None


def _rows(
    path: Path,
    file: IO[bytes],
    kind: SignalKind,
    columns: dict[str, Any] | str | Path | None,
    once: bool,
    wait: Callable[[float], None],
) -> Iterator[LoadSample | None]:
    """Yield the samples of an open file until it is replaced, cut off, or ends (``once``)."""
    layout: LogLayout | None = None
    own, rest, number = os.fstat(file.fileno()).st_ino, b"", 0
    while True:
        data = file.read(1 << 20)
        if not data:
            if once:
                # a last row without an end of line
                data = b"\n" if rest else b""
                if not data:
                    return
            else:
                yield None
                wait(POLL_S)
                if _is_replaced(path, own, file.tell()):
                    return
                continue
        *lines, rest = (rest + data).split(b"\n")
        if len(rest) > LONGEST:
            raise InputError(f"log {path}: a row is longer than {LONGEST} bytes: not a CSV file")
        for line in lines:
            text = line.decode("utf-8-sig", "replace").strip()
            if not text:
                continue
            if layout is None:
                layout = log_columns(f"log {path}", text, columns, (kind.value, "line"))
                if layout.head:
                    continue
            sample = _sample(text.split("," if layout.head else None), layout, kind, number)
            number += 1
            if sample is not None:
                yield sample


def _is_replaced(path: Path, own: int, read: int) -> bool:
    """Whether a path is another file than the open one, or that was cut off; a file that is away may return."""
    try:
        now = path.stat()
    except OSError:
        return False
    return now.st_ino != own or now.st_size < read


def _sample(cells: list[str], layout: LogLayout, kind: SignalKind, number: int) -> LoadSample | None:
    """Return the sample of the cells of a row; None: a number is missing."""
    found = {}
    for quantity, (place, factor) in layout.places.items():
        try:
            value = float(cells[place])
        except (ValueError, IndexError):
            return None
        if not math.isfinite(value):
            return None
        found[quantity] = factor * value
    at = found["time"] if layout.sample_s is None else number * layout.sample_s
    return LoadSample(at, found[kind.value], int(found["line"]), found.get("override", 1.0))
