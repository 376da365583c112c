"""The moves of cutters that cut a stock before, kept beside its layers: with its initial body they are the stock.

Notation: a move is a straight motion of the tip from p0 by u [mm], while the axis turns evenly from a0 to a1.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import astuple, dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from chipload.cutter.cutter import Cutter

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
#: values of the fields of a cutter by name
CutterFields = Mapping[str, Any]

#: fields of a cutter that say nothing about the volume that it sweeps
UNSWEPT = frozenset({"strength", "holder", "name", "body"})
#: arrays of saved moves and their numbers of dimensions
SAVED_MOVES = {"moves": 2, "move_cutter": 1, "cutters": 1}


@dataclass(frozen=True, eq=False)
class EarlierMoves:
    """Moves that cut a stock, in their order.

    Parameters
    ----------
    rows : (n, 6) float p0, u [mm] where every axis is upright; else (n, 12) float p0, u, a0, a1
    cutter : (n,) int, of ``cutters``
    cutters : fields of each cutter, of :func:`cutter_fields`
    """

    rows: Floats
    cutter: Ints
    cutters: tuple[CutterFields, ...]

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def upright(self) -> bool:
        """Whether the axis of every move is upright."""
        return bool(self.rows.shape[1] == 6)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the arrays of :data:`SAVED_MOVES`."""
        text = json.dumps(self.cutters, sort_keys=True).encode()
        return {"moves": self.rows, "move_cutter": self.cutter, "cutters": np.frombuffer(text, dtype=np.uint8)}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> EarlierMoves | None:
        """Return the moves of :meth:`arrays`; None: there are none.

        Raises
        ------
        ValueError
            The arrays do not fit each other.
        """
        rows = np.ascontiguousarray(arrays["moves"], dtype=np.float64)
        cutter = arrays["move_cutter"].astype(np.int64)
        try:
            cutters = tuple(json.loads(arrays["cutters"].astype(np.uint8).tobytes() or b"[]"))
        except (TypeError, RecursionError) as err:
            raise ValueError("cutters") from err
        if len(rows) == 0:
            return None
        if (
            rows.shape[1] not in (6, 12)
            or not np.isfinite(rows).all()
            or cutter.shape != (len(rows),)
            or not 0 <= cutter.min() <= cutter.max() < len(cutters)
            or not all(isinstance(c, dict) for c in cutters)
        ):
            raise ValueError("moves")
        return cls(rows, cutter, cutters)


def no_moves() -> dict[str, NDArray[Any]]:
    """Return the arrays of :data:`SAVED_MOVES` of a stock without moves."""
    return {"moves": np.zeros((0, 6)), "move_cutter": np.zeros(0, np.int64), "cutters": np.zeros(0, np.uint8)}


def cutter_fields(cutter: Cutter) -> CutterFields:
    """Return the fields of a cutter on which the volume that it sweeps depends."""
    values = {f.name: getattr(cutter, f.name) for f in fields(cutter) if f.name not in UNSWEPT}
    return values | {"shape": [astuple(segment) for segment in cutter.shape]}
