"""Plots of columns of a history, one below the other, against time or path."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from chipload.errors import InputError
from chipload.result.columns import COLUMNS, column_of
from chipload.result.style import FONT, GRID, INK, LIMIT, LINE_POINTS
from chipload.result.thinning import thin_rows
from chipload.tables import nearest

#: the columns that are drawn where none is named
USUAL = ("force_n", "torque_nm", "power_w", "chip_max_mm", "deflection_um")
#: axes that columns are drawn against, and their titles
AGAINST = {"t_s": "time [s]", "s_mm": "path [mm]"}
#: columns whose size is held, whatever their sign
SIGNED = tuple(name for name, column in COLUMNS.items() if column.signed)
#: colour of rows that a limit does not cover
FAINT = "#b5bcc6"
#: height of a row [px]
ROW = 190


def columns_figure(
    columns: Mapping[str, NDArray[Any]],
    limits: Mapping[str, float],
    names: Sequence[str] = USUAL,
    covered: Mapping[str, NDArray[np.bool_]] = MappingProxyType({}),
    x: Literal["t_s", "s_mm"] = "t_s",
) -> go.Figure:
    """Plot each column in a row of its own; limits are dashed lines, and values that exceed them are marked.

    Parameters
    ----------
    columns : (n,) each, those of a history; ``t_s`` or ``s_mm`` must be there
    limits : by name
    covered : (n,) rows that a limit covers, by the name of the limit; the others are drawn faint; none: all

    Raises
    ------
    InputError
        A column is not known or holds no numbers, or the history has no such x.
    """
    against = [name for name in AGAINST if name in columns]
    if x not in against:
        raise InputError(f"plot: x = {x!r}: must be one of {', '.join(against) or 'none: the history has no time'}")
    drawable = sorted(k for k, v in columns.items() if v.dtype.kind in "fiub")
    for name in names:
        if name not in drawable:
            raise InputError(f"plot: column {name!r}: not known: the nearest is {nearest(name, drawable)}")
    if not names:
        raise InputError("plot: no column is named: name at least one, such as force_n")
    bound = {column_of(k).name: v for k, v in limits.items() if not k.startswith("spindle")}
    own_rows = {column_of(k).name: v for k, v in covered.items() if not k.startswith("spindle")}
    across = np.asarray(columns[x])
    lines = np.asarray(columns.get("line", np.zeros(len(across), dtype=np.int64)))
    out = make_subplots(rows=len(names), cols=1, shared_xaxes=True, vertical_spacing=0.24 / (2 + 2 * len(names)))
    for row, name in enumerate(names, start=1):
        y = np.asarray(columns[name], dtype=np.float64)
        keep = thin_rows(y, LINE_POINTS)
        text = f"{name}: %{{y:.4g}}, line %{{customdata}}<extra></extra>"
        given = {"x": across[keep], "y": y[keep], "customdata": lines[keep], "hovertemplate": text}
        counts = own_rows.get(name, np.ones(len(y), dtype=np.bool_))
        for own, colour, mask in ((name, INK, counts), (f"{name} elsewhere", FAINT, ~counts)):
            if mask.any():
                drawn = {**given, "y": np.where(mask[keep], y[keep], np.nan)}
                line = {"color": colour, "width": 1.3}
                out.add_trace(go.Scatter(**drawn, mode="lines", name=own, line=line), row=row, col=1)
        if name in bound:
            for end in (bound[name], *((-bound[name],) if name in SIGNED else ())):
                out.add_hline(y=end, line={"color": LIMIT, "width": 1.2, "dash": "dash"}, row=row, col=1)
            size = np.abs(y[keep]) if name in SIGNED else y[keep]
            over = keep[(size < bound[name] if COLUMNS[name].least else size > bound[name]) & counts[keep]]
            if len(over):
                given = {"x": across[over], "y": y[over], "customdata": lines[over], "hovertemplate": text}
                mark = {"color": LIMIT, "size": 5}
                out.add_trace(go.Scatter(**given, mode="markers", name=f"{name} exceeds", marker=mark), row=row, col=1)
        known = y[np.isfinite(y)]
        top = max(float(known.max(initial=0.0)), bound.get(name, 0.0))
        low = min(float(known.min(initial=0.0)), -bound.get(name, 0.0) if name in SIGNED else 0.0)
        room = 0.06 * (top - low) or 1.0
        out.update_yaxes(title_text=name, range=[low - room, top + room], row=row, col=1)
    out.update_xaxes(gridcolor=GRID, zeroline=False)
    out.update_yaxes(gridcolor=GRID, zerolinecolor=GRID)
    out.update_xaxes(title_text=AGAINST[x], row=len(names), col=1)
    margin = {"l": 84, "r": 16, "t": 20, "b": 46}
    out.update_layout(template="none", height=70 + ROW * len(names), font=FONT, showlegend=False, margin=margin)
    return out
