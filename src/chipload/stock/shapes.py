"""Arrays and plane geometries in one ``.npz`` file that executes nothing when it is read.

Notation: geometries are well-known binary (WKB, little-endian), one after the other in ``wkb`` as bytes; geometry i is
``wkb[ends[i - 1]:ends[i]]``. ``kind`` names the kind of the file. Coordinates are stored bit for bit.
"""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.arrays import LARGEST, UNREADABLE, array_of
from chipload.errors import InputError
from chipload.files import is_file, open_regular


def shape_bytes(kind: str, arrays: dict[str, NDArray[Any]], shapes: NDArray[np.object_]) -> bytes:
    """Return the bytes of a file of named arrays and (n,) geometries; equal values give equal bytes."""
    binary = shapely.to_wkb(shapes, byte_order=1)
    out = io.BytesIO()
    np.savez_compressed(
        out,
        allow_pickle=False,
        kind=np.frombuffer(kind.encode(), dtype=np.uint8),
        wkb=np.frombuffer(b"".join(binary), dtype=np.uint8),
        ends=np.cumsum([len(b) for b in binary], dtype=np.int64),
        **arrays,
    )
    return out.getvalue()


def read_shapes(
    path: str | Path, kind: str, names: dict[str, int]
) -> tuple[dict[str, NDArray[Any]], NDArray[np.object_]]:
    """Read a file of :func:`shape_bytes`: the arrays ``names`` with their numbers of dimensions, and the geometries.

    Raises
    ------
    InputError
        The file is missing, damaged, of another kind, or holds other than numbers, polygons and multipolygons.
    """
    file = Path(path)
    if not is_file(file):
        raise InputError(f"stock.file = {file}: no such file")
    damaged = InputError(f"stock.file = {file.name}: damaged: save the stock again")
    try:
        with (
            open_regular(file, f"stock.file = {file.name}", LARGEST, "take larger layers or tiles") as stream,
            zipfile.ZipFile(stream) as archive,
        ):
            size = sum(archive.getinfo(f"{key}.npy").file_size for key in (*names, "kind", "wkb", "ends"))
            if size > LARGEST:
                raise InputError(
                    f"stock.file = {file.name}: holds {size} bytes unpacked: must be at most {LARGEST}: take larger "
                    "layers or tiles"
                )
            stored_kind = array_of(archive, "kind")
            if stored_kind.dtype != np.uint8 or stored_kind.tobytes() != kind.encode():
                raise InputError(f"stock.file = {file.name}: not a file of the kind '{kind}'")
            arrays = {key: array_of(archive, key) for key in names}
            wkb, ends = array_of(archive, "wkb"), array_of(archive, "ends")
    except UNREADABLE:
        raise damaged from None
    numbers = all(arrays[key].ndim == n and arrays[key].dtype.kind in "biuf" for key, n in names.items())
    if not (numbers and wkb.dtype == np.uint8 and ends.dtype == np.int64 and wkb.ndim == ends.ndim == 1):
        raise damaged
    starts = np.concatenate([[0], ends[:-1]]) if len(ends) else ends
    if (ends < starts).any() or (starts < 0).any() or (int(ends[-1]) if len(ends) else 0) != len(wkb):
        raise damaged
    whole = wkb.tobytes()
    # equal geometries become one object, as before saving
    index: dict[bytes, int] = {}
    same = [index.setdefault(whole[a:b], len(index)) for a, b in zip(starts.tolist(), ends.tolist(), strict=True)]
    binary = np.empty(len(index), dtype=object)
    binary[:] = list(index)
    try:
        shapes: NDArray[np.object_] = shapely.from_wkb(binary)[np.array(same, dtype=np.int64)]
    except shapely.errors.ShapelyError:
        raise damaged from None
    if not (np.isin(shapely.get_type_id(shapes), (3, 6)).all() and np.isfinite(shapely.get_coordinates(shapes)).all()):
        raise damaged
    return arrays, shapes
