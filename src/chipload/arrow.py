"""Arrow arrays of NumPy columns, without pandas, which the conversion of Arrow imports where it is installed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.lazy import pa


def arrow_array(values: NDArray[Any]) -> pa.Array:
    """Return a column (n,) of numbers, truth values, texts or bytes as an Arrow array; texts by a dictionary, in the
    order in which they come.

    Numbers share the memory of ``values``.

    >>> arrow_array(np.array([True, False, True])).to_pylist()
    [True, False, True]
    >>> arrow_array(np.array(["cut", "link", "cut"], dtype=object)).dictionary.to_pylist()
    ['cut', 'link']
    >>> arrow_array(np.array([b"a", b"", b"bc"], dtype=object)).to_pylist()
    [b'a', b'', b'bc']
    """
    if values.dtype.kind == "O" and len(values) and isinstance(values[0], bytes):
        ends = np.cumsum([0, *map(len, values)], dtype=np.int64)
        parts = [None, pa.py_buffer(ends), pa.py_buffer(b"".join(values))]
        return pa.Array.from_buffers(pa.large_binary(), len(values), parts)
    if values.dtype.kind in "OU":
        number = dict[str, int]()
        rows = np.array([number.setdefault(str(text), len(number)) for text in values.tolist()], dtype=np.int32)
        words = [text.encode() for text in number]
        limits = np.cumsum([0, *map(len, words)], dtype=np.int32)
        buffers = [None, pa.py_buffer(limits), pa.py_buffer(b"".join(words))]
        return pa.DictionaryArray.from_arrays(
            arrow_array(rows), pa.Array.from_buffers(pa.string(), len(words), buffers)
        )
    if values.dtype.kind == "b":
        bits = np.packbits(values, bitorder="little")
        return pa.Array.from_buffers(pa.bool_(), len(values), [None, pa.py_buffer(bits)])
    own = np.ascontiguousarray(values)
    return pa.Array.from_buffers(pa.from_numpy_dtype(own.dtype), len(own), [None, pa.py_buffer(own)])
