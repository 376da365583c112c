"""The reader of files that have all sections of a blade: tables of pyturbo-aero, and blade3d files of T-Blade3.

Format: a line of names, ``span_index,ss_x,ss_y,ss_z,ps_x,ps_y,ps_z`` or ``span_index,ss_x,ss_r,ss_th,ps_x,ps_r,ps_th``,
then, for each section from hub to shroud, one line for each place from leading to trailing edge, with the points of the
suction side (ss) and of the pressure side (ps). x is along the axis; th [rad] is measured from z towards y. The file
states no unit.

T-Blade3 writes a line with two whole numbers, the points of a section and the sections, then a line x y z for each
point, once round each profile from hub to tip; x is along the axis.
"""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError

Floats = NDArray[np.float64]

#: names of the columns after the first, in lower case
_XYZ, _XRTH = ["ss_x", "ss_y", "ss_z", "ps_x", "ps_y", "ps_z"], ["ss_x", "ss_r", "ss_th", "ps_x", "ps_r", "ps_th"]
#: least distance of points of a meridian as a share of its length; nearer points differ by rounding only
_APART = 0.01


def sections_of_table(text: str, path: Path) -> tuple[Floats, ...] | None:
    """Closed sections (n, 3) in the unit of the file, z along the axis; None if the text is not such a table.

    Raises
    ------
    InputError
        A line is not seven finite numbers, or sections are out of order.
    """
    rings = _rings(text, path)
    if rings is not None:
        return rings
    parts = _parts(text, path)
    if parts is None:
        return None
    # from the leading edge along one side and back along the other, with both ends once
    return tuple(np.concatenate([ss, ps[-2:0:-1]]) for ss, ps in parts)


def meridian_of_table(text: str, path: Path, last: bool) -> Floats | None:
    """(n, 2) r and z of the surface of revolution through the first section, or with ``last`` through the last one.

    None if the text is not such a table. Raises as :func:`sections_of_table`.
    """
    rings = _rings(text, path)
    parts = _parts(text, path) if rings is None else [(ring, ring) for ring in rings]
    if parts is None:
        return None
    side = parts[-1 if last else 0][0]
    p = np.stack([np.hypot(side[:, 0], side[:, 1]), side[:, 2]], axis=-1)
    # of a closed section, from one end to the other
    far = p[np.linalg.norm(p - p[0], axis=1).argmax()]
    first = p[np.linalg.norm(p - far, axis=1).argmax()] if rings is not None else p[0]
    chord = (far - first) if rings is not None else (p[-1] - p[0])
    chord = chord / np.linalg.norm(chord)
    p = p[np.argsort((p - p[0]) @ chord, kind="stable")]
    least = _APART * float(np.linalg.norm(np.diff(p, axis=0), axis=1).sum())
    out = [p[0]]
    for point in p[1:-1]:
        if min(np.linalg.norm(point - out[-1]), np.linalg.norm(point - p[-1])) >= least:
            out.append(point)
    return np.array([*out, p[-1]])


def is_blade3d(text: str) -> bool:
    """Whether a text begins as a blade3d file of T-Blade3: with two whole numbers, then three numbers a line."""
    lines = [line.split() for line in text[:400].splitlines()[:2]]
    return len(lines) == 2 and len(lines[0]) == 2 and all(w.isdigit() for w in lines[0]) and len(lines[1]) == 3


def _rings(text: str, path: Path) -> tuple[Floats, ...] | None:
    """Closed sections (n, 3) of a blade3d file, z along the axis; None for another file."""
    if not is_blade3d(text):
        return None
    lines = [(k, words) for k, words in enumerate(map(str.split, text.splitlines()), 1) if words]
    count, rows = (int(w) for w in lines[0][1])
    if len(lines) - 1 != count * rows:
        raise InputError(
            f"{path}: {len(lines) - 1} points: must be {count * rows}: line 1 states {count} points of {rows} sections"
        )
    p = np.array([_row(words, path, k, 3) for k, words in lines[1:]]).reshape(rows, count, 3)[..., [1, 2, 0]]
    closed = np.linalg.norm(p[:, 0] - p[:, -1], axis=1).max() <= 1e-9 * float(np.abs(p).max())
    return tuple(section[:-1] if closed else section for section in p)


def _parts(text: str, path: Path) -> list[tuple[Floats, Floats]] | None:
    """Suction and pressure side (n, 3) of each section."""
    lines = [(k, line.replace(",", " ").split()) for k, line in enumerate(text.splitlines(), 1)]
    lines = [(k, words) for k, words in lines if words]
    names = [w.lower() for w in lines[0][1]] if lines else []
    if names[:1] != ["span_index"]:
        return None
    if names[1:] not in (_XYZ, _XRTH):
        raise InputError(
            f"{path}: columns {' '.join(names[1:])} after span_index: must be {' '.join(_XYZ)} or {' '.join(_XRTH)}"
        )
    rows = np.array([_row(words, path, k) for k, words in lines[1:]]).reshape(-1, 7)
    change = np.flatnonzero(np.diff(rows[:, 0])) + 1
    spans = [rows[a:b] for a, b in itertools.pairwise([0, *change.tolist(), len(rows)])]
    numbers = [float(s[0, 0]) for s in spans if len(s)]
    if not numbers or numbers != sorted(set(numbers)):
        raise InputError(f"{path}: span_index: must ascend from hub to shroud, each section in one piece")
    return [(_points(s[:, 1:4], names), _points(s[:, 4:], names)) for s in spans]


def _row(words: list[str], path: Path, line: int, count: int = 7) -> list[float]:
    try:
        row = [float(w) for w in words]
    except ValueError:
        raise InputError(f"{path} line {line}: not numbers: {' '.join(words)[:40]!r}") from None
    if len(row) != count or not all(map(math.isfinite, row)):
        number = "three" if count == 3 else "seven"
        raise InputError(f"{path} line {line}: must be {number} finite numbers: {' '.join(words)[:40]!r}")
    return row


def _points(p: Floats, names: list[str]) -> Floats:
    """Points (n, 3) in the frame of the part, whose z is along x of the file."""
    if names[1:] == _XYZ:
        return np.stack([p[:, 1], p[:, 2], p[:, 0]], axis=-1)
    return np.stack([p[:, 1] * np.sin(p[:, 2]), p[:, 1] * np.cos(p[:, 2]), p[:, 0]], axis=-1)
