"""Reading of arrays of numbers from ``.npz`` files that may be damaged, or made by somebody else.

NumPy's own reader opens each array by the magic number and the header that the file states, and fails with exceptions
of several libraries. Here an array is read only if its header is of the plain form that chipload writes, it holds
numbers, and as many bytes follow as the header states.
"""

from __future__ import annotations

import io
import math
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.files import open_regular

#: greatest size of a file, and of its content unpacked [bytes]
LARGEST = 1 << 30
#: exceptions of the readers for a damaged archive, array or header
UNREADABLE = (
    *(ValueError, TypeError, KeyError, AttributeError, EOFError, OSError, RuntimeError, SyntaxError),
    *(ArithmeticError, MemoryError, struct.error, tokenize.TokenError, zipfile.BadZipFile, zlib.error),
)


def array_of(archive: zipfile.ZipFile, name: str) -> NDArray[Any]:
    """Return an array of numbers of an open archive.

    Raises
    ------
    ValueError
        Its header is of another version, it holds other things than numbers, or its size differs from the header. The
        readers of the archive raise others of :data:`UNREADABLE`.
    """
    data = archive.read(f"{name}.npy")
    stream = io.BytesIO(data)
    if np.lib.format.read_magic(stream) != (1, 0):
        raise ValueError(f"{name}: not an array of version 1.0")
    shape, column_major, dtype = np.lib.format.read_array_header_1_0(stream)
    if dtype.kind not in "biuf" or min(shape, default=0) < 0:
        raise ValueError(f"{name}: not an array of numbers")
    count = math.prod(shape)
    if count * dtype.itemsize != len(data) - stream.tell():
        raise ValueError(f"{name}: its size is not that of its header")
    out = np.frombuffer(data, dtype=dtype, count=count, offset=stream.tell())
    return out.reshape(shape, order="F" if column_major else "C").copy()


def read_arrays(
    path: Path, remedy: str = "run the job again", wanted: Callable[[str], object] = lambda name: True
) -> dict[str, NDArray[Any]]:
    """Return the arrays of a ``.npz`` file by name, those that are ``wanted``.

    Raises
    ------
    InputError
        The file is missing, larger than :data:`LARGEST` (also unpacked) or damaged, or an array holds other
        things than numbers.
    """
    label = path.name
    try:
        with open_regular(path, label, LARGEST, remedy) as stream, zipfile.ZipFile(stream) as archive:
            stored = [i for i in archive.infolist() if i.filename.endswith(".npy") and wanted(i.filename[:-4])]
            size = sum(i.file_size for i in stored)
            if size > LARGEST:
                raise InputError(f"{label}: holds {size} bytes unpacked: must be at most {LARGEST}: {remedy}")
            out = {i.filename[:-4]: array_of(archive, i.filename[:-4]) for i in stored}
    except UNREADABLE as err:
        raise InputError(f"{label}: damaged: {str(err)[:100] or type(err).__name__}: {remedy}") from None
    return out
