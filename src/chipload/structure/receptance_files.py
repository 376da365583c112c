"""Files of measured receptances: columns of numbers, and the universal file (dataset 58).

Columns are frequency [Hz], real and imaginary part and, where there is a fourth, coherence; lines without numbers are
skipped. The file states the unit as ``m/N``, ``mm/N`` or ``um/N``, or the caller states it. A velocity or an
acceleration becomes a displacement by 1 / (i w) once or twice.

Reference: [UFF58], the universal file datasets 58.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.files import read_regular
from chipload.structure.hexa import Array
from chipload.structure.receptance import Receptance

Complex = NDArray[np.complex128]

#: unit -> its size in mm/N, and the number of integrations over time
UNITS = {
    "m/N": (1000.0, 0), "mm/N": (1.0, 0), "um/N": (1e-3, 0), "m/s/N": (1000.0, 1), "m/s2/N": (1000.0, 2),
}  # fmt: skip
LARGEST_FILE = 200_000_000
#: greatest plausible number
LARGEST = 1e30
#: directions of dataset 58
_DIRECTIONS = {1: "x", 2: "y", 3: "z"}
#: kinds of its ordinate: displacement, velocity, acceleration
_ORDINATES = {8: "m/N", 11: "m/s/N", 12: "m/s2/N"}
_UNIT = re.compile(r"(?<![A-Za-z])(m/s2/N|m/s/N|[mu\u00b5\u03bc]?m/N)(?![A-Za-z])")


@dataclass(frozen=True, eq=False)
class MeasuredReceptance:
    """A receptance of a file; ``coherence`` (n,) None: not measured; ``direction`` x, y, z; empty: not stated."""

    receptance: Receptance
    coherence: Array | None
    direction: str


def read_receptance(path: Path, unit: str | None = None) -> MeasuredReceptance:
    """The receptance of a file.

    Parameters
    ----------
    unit : a key of :data:`UNITS`; None: that of the file

    Raises
    ------
    InputError
        The file cannot be read, holds no receptance, or states no unit.
    """
    if unit is not None and unit not in UNITS:
        raise InputError(f"--unit {unit}: must be one of {', '.join(UNITS)}")
    text = read_regular(path, path.name, LARGEST_FILE).decode("utf-8", "replace")
    if path.suffix.lower() in (".uff", ".unv"):
        return _universal(path.name, text, unit)
    rows, head = [], ""
    for line in text.splitlines():
        numbers = re.split(r"[,;\s]+", line.strip())
        values = []
        for number in numbers:
            try:
                values.append(float(number))
            except ValueError:
                break
        if len(values) >= 3:
            rows.append(values[:4])
        head += line[:200] + "\n" if len(rows) < 2 else ""
    if len(rows) < 20:
        raise InputError(f"{path.name}: {len(rows)} rows of frequency, real and imaginary part: must be at least 20")
    width = min(map(len, rows))
    table = np.array([row[:width] for row in rows])
    if not (np.abs(table[:, :3]) < LARGEST).all():
        raise InputError(f"{path.name}: a number is not finite, or beyond {LARGEST:g}")
    found = _UNIT.search(head)
    own = unit or (found[1].replace("\u00b5", "u").replace("\u03bc", "u") if found else None)
    if own is None:
        raise InputError(f"{path.name}: states no unit: give --unit, one of {', '.join(UNITS)}")
    measured = _displacement(path.name, table[:, 0], table[:, 1] + 1j * table[:, 2], own)
    coherence = _coherence(path.name, table[:, 3], measured) if width > 3 else None
    return MeasuredReceptance(measured, coherence, "")


def _coherence(name: str, values: Array, measured: Receptance) -> Array:
    """Coherence at the frequencies of the receptance, which may lack the first."""
    if not ((values >= 0.0) & (values <= 1.0 + 1e-6)).all():
        raise InputError(f"{name}: a coherence is not from 0 to 1")
    return values[len(values) - len(measured.frequency) :]


def _displacement(name: str, f: Array, H: Complex, unit: str) -> Receptance:
    """In mm/N; at 0 Hz a motion that is integrated is not known."""
    factor, times = UNITS[unit]
    keep = f > 0.0 if times else f >= 0.0
    f, H = f[keep], H[keep] * factor
    try:
        return Receptance(f, np.asarray(H / (2j * np.pi * f) ** times if times else H, dtype=np.complex128))
    except InputError as err:
        raise InputError(f"{name}: {err}") from None


def _universal(name: str, text: str, unit: str | None) -> MeasuredReceptance:
    """The first frequency response of a universal file, with the coherence of the same length."""
    lines = text.splitlines()
    marks = [k for k, line in enumerate(lines) if line.strip() == "-1"]
    response: tuple[Array, Complex, str, str] | None = None
    coherence: Array | None = None
    for a, b in zip(marks[0::2], marks[1::2], strict=False):
        block = lines[a + 1 : b]
        if not block or block[0].strip() not in ("58", "58b"):
            continue
        if block[0].strip() != "58":
            raise InputError(f"{name}: a binary dataset 58: export it as text")
        try:
            kind, direction, ordinate, f, values = _dataset(block)
        except (ValueError, IndexError):
            raise InputError(f"{name}: line {a + 2}: dataset 58 cannot be read") from None
        if kind == 4 and response is None:
            own = unit or _ORDINATES.get(ordinate)
            if own is None:
                raise InputError(
                    f"{name}: line {a + 2}: states no kind of motion: give --unit, one of {', '.join(UNITS)}"
                )
            response = (f, values, own, direction)
        elif kind == 6:
            coherence = values.real
    if response is None:
        raise InputError(f"{name}: holds no frequency response (dataset 58, function 4)")
    f, values, own, direction = response
    measured = _displacement(name, f, values, own)
    if coherence is not None and len(coherence) != len(f):
        coherence = None
    if coherence is not None:
        coherence = _coherence(name, coherence, measured)
    return MeasuredReceptance(measured, coherence, direction)


def _dataset(block: list[str]) -> tuple[int, str, int, Array, Complex]:
    """Function, direction of the response, kind of ordinate, frequencies and values of a dataset 58."""
    kinds, sizes = block[6].split(), block[7].split()
    kind, direction = int(kinds[0]), _DIRECTIONS.get(abs(int(block[6][51:55] or 0)), "")
    data, count, even = int(sizes[0]), int(sizes[1]), int(sizes[2]) == 1
    first, step = float(sizes[3].replace("D", "E")), float(sizes[4].replace("D", "E"))
    ordinate = int(block[9].split()[0])
    width = 20 if data in (4, 6) else 13
    numbers = []
    for line in block[12:]:
        if " " in line.strip():
            numbers += [float(x.replace("D", "E")) for x in line.split()]
        else:
            numbers += [float(line[k : k + width].replace("D", "E")) for k in range(0, len(line.rstrip()), width)]
    parts = (2 if data in (5, 6) else 1) + (0 if even else 1)
    if not 0 < count * parts <= len(numbers):
        raise ValueError
    table = np.array(numbers[: count * parts]).reshape(count, parts)
    if not ((np.abs(table) < LARGEST).all() and abs(first) < LARGEST and abs(step) < LARGEST):
        raise ValueError
    f = np.asarray(first + step * np.arange(count) if even else table[:, 0], dtype=np.float64)
    table = table if even else table[:, 1:]
    values = table[:, 0] + (1j * table[:, 1] if data in (5, 6) else 0j)
    return kind, direction, ordinate, f, np.asarray(values, dtype=np.complex128)
