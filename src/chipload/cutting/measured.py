"""Reading of files of measured forces, with a DynoWare header or with a line of column names only.

Notation: F force [N], t time [s].

A file is UTF-8 or latin-1 text: lines ``key,value`` (DynoWare's header, may be missing), a line of column names, a line
of units where the names do not hold them (``fx_n``, ``Fx [N]``), then numbers with a decimal point. Time says where a
sample is missing; without a time column the header's sampling rate holds, and the first sample is at 0.
"""

from __future__ import annotations

import csv
import math
import re
from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, InputError
from chipload.files import open_regular
from chipload.number_text import number_text

Floats = NDArray[np.float64]

#: newtons, seconds in one unit of a column
FORCE_UNITS = {"n": 1.0, "kn": 1000.0, "mn": 0.001, "lbf": 4.4482216152605}
TIME_UNITS = {"s": 1.0, "ms": 0.001, "us": 1e-6}
#: most samples that are kept, lines of a header, characters of a line
SAMPLES, HEADER, LINE = 5_000_000, 200, 10_000
#: of a force file, and of what is read of it at once [bytes]
LARGEST_FILE, BLOCK = 1 << 34, 1 << 20
_ENDS = re.compile(rb"\r\n|\r|\n")
#: part of a sampling interval that a time stamp may be off
JITTER = 0.2
#: equal extreme samples in a row that are called clipped
CLIPPED = 4
#: drift over the window that is called so, in parts of the greatest force
DRIFT = 0.05
_RATE = ("sampling rate", "sample rate", "sampling frequency")


@dataclass(frozen=True, eq=False)
class Measured:
    """Forces of one file.

    Parameters
    ----------
    names : of the force columns, as in the file
    force : (n, c) float [N], equally spaced in time
    rate : [Hz]
    start : time of the first sample kept [s]
    header : key and value of every line before the names
    """

    names: tuple[str, ...]
    force: Floats
    rate: float
    start: float
    header: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        force = np.array(self.force, dtype=np.float64)
        force.setflags(write=False)
        object.__setattr__(self, "force", force)

    def column(self, name: str) -> Floats:
        """Return the forces (n,) [N] of a column.

        Raises
        ------
        InputError
            There is no such column.
        """
        for k, known in enumerate(self.names):
            if known.lower() == name.lower():
                return np.asarray(self.force[:, k])
        raise InputError(f"channel {name}: not in the file: it has {', '.join(self.names)}")


# -- files ------------------------------------------------------------------------------------------------------
def read_forces(path: str | Path, window: tuple[float, float] | None = None) -> tuple[Measured, tuple[Finding, ...]]:
    """Read a file of measured forces.

    Parameters
    ----------
    path : the file
    window : (from, to) [s] in the file's own time; what lies outside is not kept. None: all

    Returns
    -------
    value : the forces, equally spaced; findings: ``force-window``, ``force-clipped``, ``force-drift``

    Raises
    ------
    InputError
        The file cannot be read, names no columns or units, contains a value that is not a number, misses samples within
        the window, or is too large; the message states the line and the remedy.
    """
    label = f"forces {Path(path).name}"
    lines = _lines(Path(path), label)
    header, names, units, at, first = _head(lines, label)
    time, columns = _columns(names, units, at, label)
    stated = _rate(header, label)
    if time is None and stated is None:
        raise InputError(
            f"{label}: line {at}: no time column and no sampling rate: add a column time_s or a line Sampling rate [Hz]"
        )
    kept = array("d")
    stamps = array("d")
    count = -1
    low, high = window if window is not None else (-math.inf, math.inf)
    for number, row in _rows(first, lines):
        if len(row) != len(names):
            raise InputError(f"{label}: line {number}: {len(row)} values: must be {len(names)}, one a column")
        count += 1
        try:
            values = [float(x) for x in row]
        except ValueError:
            raise InputError(
                f"{label}: line {number}: {','.join(row)[:60]!r}: must be numbers with a decimal point"
            ) from None
        if not all(map(math.isfinite, values)):
            raise InputError(f"{label}: line {number}: a value is not finite: leave the sample out of the window")
        now = values[time[0]] * time[1] if time is not None else count / (stated or 1.0)
        if not low - 1e-12 <= now <= high + 1e-12:
            continue
        if len(stamps) >= SAMPLES:
            raise InputError(f"{label}: line {number}: more than {SAMPLES} samples: state a window_s")
        stamps.append(now)
        kept.extend(values[k] * scale for k, scale in columns)
    t = np.frombuffer(stamps, dtype=np.float64)
    force = np.frombuffer(kept, dtype=np.float64).reshape(-1, len(columns))
    if len(t) < 3:
        raise InputError(
            f"{label}: {len(t)} samples in the window {low:g} to {high:g} s: needs 3 or more: widen window_s"
        )
    rate = stated if time is None and stated is not None else _sampling_rate(t, stated, label)
    measured = Measured(tuple(names[k] for k, _ in columns), force, rate, float(t[0]), header)
    return measured, tuple(_findings(measured, window, float(t[-1])))


def _lines(path: Path, label: str) -> Iterator[tuple[int, str]]:
    """Yield numbered lines without line ends; as latin-1 if the text is not UTF-8."""
    with open_regular(path, label, LARGEST_FILE, "cut it into parts") as file:
        for number, raw in enumerate(_raw_lines(file), 1):
            if len(raw) > LINE:
                raise InputError(f"{label}: line {number}: longer than {LINE} characters: not a force file")
            try:
                text = raw.decode("utf-8-sig" if number == 1 else "utf-8")
            except UnicodeDecodeError:
                text = raw.decode("latin-1")
            if "\x00" in text:
                raise InputError(f"{label}: line {number}: is not text: export the forces as CSV")
            yield number, text


def _raw_lines(file: IO[bytes]) -> Iterator[bytes]:
    """Yield lines without their ends (LF, CR LF or CR); of a line that is too long the first ``LINE + 1`` bytes."""
    rest = b""
    while block := file.read(BLOCK):
        rest += block
        # a CR at the end may belong to an LF that comes
        whole = rest.removesuffix(b"\r")
        parts = _ENDS.split(whole)
        rest = parts.pop() + rest[len(whole) :]
        yield from parts
        if len(rest) > LINE:
            yield rest[: LINE + 1]
            return
    yield from _ENDS.split(rest) if rest else ()


def _split(text: str) -> list[str]:
    mark = next((m for m in (",", ";", "\t") if m in text), ",")
    try:
        return [x.strip() for x in next(csv.reader([text], delimiter=mark), [])]
    except csv.Error as err:
        raise InputError(f"forces: {text[:40]!r}: not a line of a CSV file: {err}") from None


def _rows(first: tuple[int, list[str]] | None, lines: Iterator[tuple[int, str]]) -> Iterator[tuple[int, list[str]]]:
    if first is not None:
        yield first
    for number, text in lines:
        if text.strip():
            yield number, _split(text)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _head(
    lines: Iterator[tuple[int, str]], label: str
) -> tuple[dict[str, str], list[str], list[str] | None, int, tuple[int, list[str]] | None]:
    """Return header, names, units (None: in the names), line of the names, and the first line of numbers."""
    before: list[tuple[int, list[str]]] = []
    for number, text in lines:
        if not text.strip():
            continue
        row = _split(text)
        if all(_is_number(x) for x in row):
            break
        before.append((number, row))
        if len(before) > HEADER:
            raise InputError(f"{label}: line {number}: no numbers in {HEADER} lines: not a force file")
    else:
        raise InputError(f"{label}: holds no numbers: must be names, units and samples")
    if not before:
        raise InputError(f"{label}: line {number}: numbers without names: add a line as time_s,fx_n,fy_n,fz_n")
    units = None
    if len(before) > 1 and len(before[-1][1]) == len(row) == len(before[-2][1]):
        known = {*FORCE_UNITS, *TIME_UNITS}
        if all(x.strip("[]() ").lower() in known for x in before[-1][1]):
            units = [x.strip("[]() ").lower() for x in before.pop()[1]]
    at, names = before.pop()
    if len(names) != len(row):
        raise InputError(f"{label}: line {at}: {len(names)} names for {len(row)} columns: must be one each")
    header = {r[0].rstrip(": "): ",".join(r[1:]).strip() for _, r in before if r[0]}
    return header, names, units, at, (number, row)


def _columns(
    names: list[str], units: list[str] | None, at: int, label: str
) -> tuple[tuple[int, float] | None, list[tuple[int, float]]]:
    """Return column and scale of the time and of each force."""
    time, forces = None, []
    for k, name in enumerate(names):
        unit = units[k] if units is not None else _unit(name)
        if name.lower().startswith("time") or name.lower() in ("t", "t_s"):
            if unit not in TIME_UNITS:
                raise InputError(
                    f"{label}: line {at}: {name}: its unit must be one of {', '.join(TIME_UNITS)}: name it time_s"
                )
            time = (k, TIME_UNITS[unit])
        elif unit in FORCE_UNITS:
            forces.append((k, FORCE_UNITS[unit]))
        elif name.lower().startswith("f"):
            raise InputError(
                f"{label}: line {at}: {name}: has no unit: name it {name.lower()}_n or add a line of units (N, kN, lbf)"
            )
    if not forces:
        raise InputError(
            f"{label}: line {at}: no column of forces among {', '.join(names)}: name them fx_n, fy_n, fz_n"
        )
    return time, forces


def _unit(name: str) -> str:
    """Return the unit in a name: ``fx_n``, ``Fx [N]`` and ``Fx (N)`` all hold n."""
    bracket = re.search(r"[\[(]\s*(\w+)\s*[\])]\s*$", name)
    return (bracket[1] if bracket else name.rsplit("_", 1)[-1]).lower()


def _rate(header: Mapping[str, str], label: str) -> float | None:
    """Return the sampling rate [Hz] of the header."""
    for key, value in header.items():
        if key.lower().startswith(_RATE):
            unit = 1000.0 if "khz" in key.lower() else 1.0
            if "hz" not in key.lower() or not _is_number(value) or not 0.0 < float(value) < math.inf:
                raise InputError(f"{label}: {key} = {value}: must be above 0, with its unit: Sampling rate [Hz]")
            return float(value) * unit
    return None


def _sampling_rate(t: Floats, stated: float | None, label: str) -> float:
    """Return the sampling rate of the time stamps; refuse gaps, and a header with another rate."""
    step = float(np.median(np.diff(t)))
    if not step > 0.0:
        raise InputError(f"{label}: time does not rise at {t[0]:g} s: must be equally spaced")
    off = np.abs(np.diff(t) - step) > JITTER * step
    if off.any():
        k = int(np.flatnonzero(off)[0])
        raise InputError(
            f"{label}: samples are missing ({int(off.sum())} gaps): between {t[k]:.6g} and {t[k + 1]:.6g} s lie "
            f"{(t[k + 1] - t[k]) / step:.3g} sampling intervals: must be 1: choose a window_s without gaps"
        )
    rate = (len(t) - 1) / float(t[-1] - t[0])
    if stated is not None and abs(rate - stated) > 0.01 * stated:
        raise InputError(f"{label}: time stamps are {rate:.6g} Hz apart, the header states {stated:g} Hz: correct one")
    # time stamps are rounded, a stated rate is not
    return stated if stated is not None else rate


def _findings(measured: Measured, window: tuple[float, float] | None, end: float) -> Iterator[Finding]:
    """Yield findings: a window that the file does not fill, clipped samples, channels that drift."""
    step = 1.0 / measured.rate
    if window is not None and (measured.start - window[0] > step or window[1] - end > step):
        text = f"the window {window[0]:g} to {window[1]:g} s is filled from {measured.start:g} to {end:g} s alone"
        yield Finding("force-window", 0, text)
    half = len(measured.force) // 2
    # a bell: whole and broken turns alike leave its mean
    bell = np.sin(math.pi * (np.arange(half) + 0.5) / half) ** 2
    bell /= bell.sum()
    for name, f in zip(measured.names, measured.force.T, strict=True):
        for extreme in (f.max(), f.min()):
            same = np.concatenate([[0], (f == extreme).astype(int), [0]])
            runs = np.flatnonzero(np.diff(same) < 0) - np.flatnonzero(np.diff(same) > 0)
            if f.max() > f.min() and (runs >= CLIPPED).any():
                text = f"{name} stays at {extreme:g} N for {int(runs.max())} samples: clipped by the amplifier?"
                yield Finding("force-clipped", 0, text)
        slope = 2.0 * float(bell @ f[-half:] - bell @ f[:half])
        largest = float(np.abs(f).max())
        if abs(slope) > DRIFT * largest:
            yield Finding(
                "force-drift",
                0,
                f"{name} drifts by {number_text(slope, 3)} N over the window, of {number_text(largest)} N at most",
            )
