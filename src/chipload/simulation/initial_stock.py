"""The stock in which a program is simulated by moves: its initial body, and the moves that cut it before.

Where the moves before are not known, as of a stock that was turned for another setup, the layers are the body.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutter.profile import ProfileSegment
from chipload.engagement.bricks.stock import BrickStock
from chipload.engagement.moves.stock import MoveStock
from chipload.errors import InputError
from chipload.stock.earlier_moves import EarlierMoves, cutter_fields
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
StockOfMoves: TypeAlias = MoveStock | BrickStock


def initial_stock(stock: LayeredStock, cutters: Mapping[int, Cutter], *, upright: bool) -> StockOfMoves:
    """Return a stock as its body and its earlier moves.

    Parameters
    ----------
    cutters : of the program by tool number; those of earlier moves get the numbers from -1 downwards
    upright : the axis is upright in the whole program
    """
    low = np.array([stock.xs[0], stock.ys[0], stock.bounds[0]])
    high = np.array([stock.xs[-1], stock.ys[-1], stock.bounds[-1]])
    earlier, body = stock.earlier, stock.part
    if earlier is None and (stock.cut.any() or (body is None and not _is_block(stock))):
        body = stock.exposed_body()
    table = dict(cutters)
    if earlier is not None:
        upright = upright and earlier.upright
        table |= {-1 - k: c for k, c in enumerate(cutters_of_moves(earlier))}
    made: StockOfMoves = (MoveStock if upright else BrickStock)(low, high, table, body)
    if earlier is not None:
        make_earlier(made, earlier, low, high)
    return made


def make_earlier(stock: StockOfMoves, earlier: EarlierMoves, low: Floats, high: Floats) -> None:
    """Make those earlier moves that come into a box between the corners ``low`` and ``high`` (3,) [mm]."""
    near = _near(earlier.rows, earlier.cutter, cutters_of_moves(earlier), low, high)
    rows, cutter = earlier.rows[near], earlier.cutter[near]
    up = np.tile([0.0, 0.0, 1.0], (len(rows), 1))
    a0, a1 = (up, up) if earlier.upright else (rows[:, 6:9], rows[:, 9:12])
    skip_moves(stock, rows[:, :3], rows[:, :3] + rows[:, 3:6], a0, a1, -1 - cutter)


def skip_moves(stock: StockOfMoves, p0: Floats, p1: Floats, a0: Floats, a1: Floats, tool: Ints) -> None:
    """Make moves without calculating their engagement."""
    if isinstance(stock, BrickStock):
        stock.skip(p0, p1, a0, a1, tool)
    else:
        stock.skip(p0, p1, tool)


def moves_of(stock: StockOfMoves) -> EarlierMoves | None:
    """Return the moves that were made in a stock; None: none comes to its body."""
    rows, of = stock.moves[: stock.count], stock.of[: stock.count]
    axes = np.zeros((len(rows), 0))
    if isinstance(stock, BrickStock):
        a0, across, turn = rows[:, 6:9], rows[:, 9:12], rows[:, 12:13]
        axes = np.hstack([a0, a0 * np.cos(turn) + across * np.sin(turn)])
    rows = np.hstack([rows[:, :6], axes])
    # each row of teeth makes a move of its own
    cutters = [stock.table[n].one_row for n in stock.tools]
    near = _near(rows, of, cutters, stock.low, stock.high)
    if not near.any():
        return None
    used, cutter = np.unique(of[near], return_inverse=True)
    fields = tuple(cutter_fields(cutters[k]) for k in used.tolist())
    return EarlierMoves(rows[near], cutter.ravel().astype(np.int64), fields)


def _near(rows: Floats, cutter: Ints, cutters: Sequence[Cutter], low: Floats, high: Floats) -> NDArray[np.bool_]:
    """Return a mask of the moves that come into a box; an upright cutter is open above."""
    wide = np.array([max(c.radius, float(c.radius_at(c.flute_length))) for c in cutters])
    upright = rows.shape[1] == 6
    below = wide if upright else wide + np.array([c.flute_length for c in cutters])
    above = np.column_stack([below, below, np.full(len(below), math.inf) if upright else below])
    ends = np.stack([rows[:, :3], rows[:, :3] + rows[:, 3:6]])
    near = ends.min(axis=0) - below[cutter, None] < high
    return np.asarray((near & (ends.max(axis=0) + above[cutter] > low)).all(axis=1))


def cutters_of_moves(earlier: EarlierMoves) -> list[Cutter]:
    """Return the cutters of the moves that cut a stock before.

    Raises
    ------
    InputError
        The file of the stock is damaged: its cutters are none.
    """
    out = []
    for values in earlier.cutters:
        fields: dict[str, Any] = {name: tuple(v) if isinstance(v, list) else v for name, v in values.items()}
        rows: Any = fields.pop("shape", ())
        try:
            ends: Any = [[tuple(v) if isinstance(v, list) else v for v in row] for row in rows]
            cutter = Cutter(**fields, shape=tuple(ProfileSegment(*row) for row in ends))
            # what the moves need of it
            sizes = (cutter.radius, cutter.flute_length, *cutter.radius_at([0.0, cutter.flute_length]))
        except (TypeError, ValueError, AttributeError, LookupError, ArithmeticError) as err:
            raise InputError(f"stock: a cutter that cut it before cannot be read ({err}): run the job again") from None
        if not all(math.isfinite(x) for x in sizes):
            raise InputError("stock: a cutter that cut it before has no finite size: run the job again")
        out.append(cutter)
    return out


def _is_block(stock: LayeredStock) -> bool:
    """Return whether the layers fill their box."""
    x, y, z = stock.xs, stock.ys, stock.bounds
    whole = (x[-1] - x[0]) * (y[-1] - y[0]) * (z[-1] - z[0])
    return bool(abs(stock.volume() - whole) <= 1e-9 * whole)
