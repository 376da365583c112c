"""The reader of STL files, binary or text, which checks length and format before it returns triangles.

Format: a binary file has a header of 80 bytes, the number n of triangles (uint32, little-endian) and 50 bytes per
triangle: normal and three corners in float32, and two more bytes. A text file has ``solid``; for each triangle ``facet
normal``, ``outer loop``, three ``vertex`` with three numbers, ``endloop``, ``endfacet``; and ``endsolid``. Normals are
ignored: the order of the corners defines them.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.files import read_regular

Floats = NDArray[np.float64]

#: largest file that is read [bytes]
LARGEST_FILE = 200_000_000
_HEAD, _EACH = 84, 50
_VERTEX = re.compile(rb"\bvertex[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)[ \t]*\r?[\n\r]", re.IGNORECASE)
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])


def read_stl(path: Path, key: str) -> Floats:
    """Corners (n, 3, 3) of the triangles, in the unit of the file.

    Parameters
    ----------
    key : job key that names the file, for messages

    Raises
    ------
    InputError
        The file cannot be read, is too large, truncated or damaged, has no triangle, or a number is not finite.
    """
    label = f"{key} = {path.name}"
    data = read_regular(path, label, LARGEST_FILE, "export it in fewer triangles")
    count = int.from_bytes(data[80:_HEAD], "little") if len(data) >= _HEAD else -1
    if count >= 0 and len(data) == _HEAD + _EACH * count:
        corners = np.frombuffer(data, dtype=_TRIANGLE, count=count, offset=_HEAD)["corners"].astype(np.float64)
    elif data[:512].lstrip().lower().startswith(b"solid") and b"\0" not in data:
        corners = _text(data, label)
    elif count < 0:
        raise InputError(f"{label}: {len(data)} bytes: not an STL file: export it again")
    else:
        raise InputError(
            f"{label}: not an STL file, or damaged: its header states {count} triangles, which are "
            f"{_HEAD + _EACH * count} bytes, but the file has {len(data)}: export it again"
        )
    if len(corners) == 0:
        raise InputError(f"{label}: the file has no triangles: export it again")
    if not np.isfinite(corners).all():
        raise InputError(f"{label}: damaged: a number is not finite: export it again")
    return corners


def _text(data: bytes, label: str) -> Floats:
    lower = data.lower()
    words = {word: len(re.findall(rb"\b" + word + rb"\b", lower)) for word in (b"endfacet", b"endloop", b"vertex")}
    facets = words[b"endfacet"]
    found = _VERTEX.findall(data)
    if words[b"endloop"] != facets or words[b"vertex"] != 3 * facets or len(found) != 3 * facets:
        raise InputError(
            f"{label}: damaged: {len(found)} vertices of three numbers, {words[b'endloop']} endloop and {facets} "
            "endfacet: each facet must have one loop of three vertices: export it again"
        )
    if not re.search(rb"\bendsolid\b", lower):
        raise InputError(f"{label}: truncated: no endsolid: export it again")
    try:
        return np.array([[float(x) for x in row] for row in found], dtype=np.float64).reshape(-1, 3, 3)
    except ValueError as err:
        raise InputError(f"{label}: damaged: {' '.join(str(err).split())[:80]}: export it again") from None
