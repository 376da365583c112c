"""Files of VTK (XML, binary inline): lines, triangles and quads with values, for ParaView and others.

Reference: VTK file formats, https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html: an array is base64 of
its length in bytes (UInt64) and its little-endian values.
"""

from __future__ import annotations

import base64
import struct
from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError

#: cell type by the number of corners
_CELLS = {3: 5, 4: 9}
_TYPES = {"f8": "Float64", "i8": "Int64", "u1": "UInt8"}


def polyline(points: ArrayLike, values: Mapping[str, NDArray[Any]]) -> bytes:
    """A `.vtp` file of one line through points (n, 3) [mm], with values (n,) by name.

    Raises
    ------
    InputError
        There is no point, or a column of values has another length.
    """
    p = _points(points)
    line = np.arange(len(p), dtype=np.int64)
    body = [
        f'<Piece NumberOfPoints="{len(p)}" NumberOfVerts="0" NumberOfLines="1" NumberOfStrips="0" NumberOfPolys="0">',
        *_values(values, len(p)),
        "<Points>",
        _array("points", p),
        "</Points>",
        "<Lines>",
        _array("connectivity", line),
        _array("offsets", np.array([len(p)], dtype=np.int64)),
        "</Lines>",
        "</Piece>",
    ]
    return _file("PolyData", body)


def faces_file(
    points: ArrayLike,
    faces: ArrayLike,
    values: Mapping[str, NDArray[Any]] | None = None,
    of_faces: Mapping[str, NDArray[Any]] | None = None,
) -> bytes:
    """A `.vtu` file of triangles or quads.

    Parameters
    ----------
    points : (n, 3) [mm]
    faces : (m, 3) or (m, 4) numbers of points
    values : (n,) or (n, 3) by name, of the points
    of_faces : (m,) by name

    Raises
    ------
    InputError
        As :func:`polyline`, or a face names a point that is not there.
    """
    p, f = _points(points), np.asarray(faces, dtype=np.int64)
    if len(f) and not (int(f.min()) >= 0 and int(f.max()) < len(p)):
        raise InputError(f"export: a face names a point outside 0 to {len(p) - 1}")
    corners = f.shape[1]
    body = [
        f'<Piece NumberOfPoints="{len(p)}" NumberOfCells="{len(f)}">',
        *_values(values or {}, len(p)),
        *_values(of_faces or {}, len(f), "CellData"),
        "<Points>",
        _array("points", p),
        "</Points>",
        "<Cells>",
        _array("connectivity", f.ravel()),
        _array("offsets", corners * np.arange(1, len(f) + 1, dtype=np.int64)),
        _array("types", np.full(len(f), _CELLS[corners], dtype=np.uint8)),
        "</Cells>",
        "</Piece>",
    ]
    return _file("UnstructuredGrid", body)


def _points(points: ArrayLike) -> NDArray[np.float64]:
    p = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    if len(p) == 0:
        raise InputError("export: no points: there is nothing to write")
    return p


def _values(values: Mapping[str, NDArray[Any]], count: int, of: str = "PointData") -> list[str]:
    out = [f"<{of}>"]
    for name, column in values.items():
        if len(column) != count:
            raise InputError(f"export: {name}: {len(column)} values: must be {count}, one a point or face")
        kind = np.int64 if column.dtype.kind in "iub" else np.float64
        out.append(_array(name, np.asarray(column, dtype=kind)))
    return [*out, f"</{of}>"]


def _array(name: str, values: NDArray[Any]) -> str:
    data = np.ascontiguousarray(values)
    data = data.astype(data.dtype.newbyteorder("<"))
    kind = _TYPES[data.dtype.str[1:]]
    parts = f' NumberOfComponents="{data.shape[1]}"' if data.ndim == 2 else ""
    text = base64.b64encode(struct.pack("<Q", data.nbytes) + data.tobytes()).decode()
    return f'<DataArray type="{kind}" Name="{escape(name)}"{parts} format="binary">{text}</DataArray>'


def _file(kind: str, body: list[str]) -> bytes:
    head = f'<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64">'
    lines = ['<?xml version="1.0"?>', head, f"<{kind}>", *body, f"</{kind}>", "</VTKFile>", ""]
    return "\n".join(lines).encode()
