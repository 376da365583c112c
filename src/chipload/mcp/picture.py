"""A picture of the loads of a track over time, with their limits, as PNG."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from chipload.errors import InputError
from chipload.number_text import number_text
from chipload.result.columns import COLUMNS

#: size of a row of the picture, its margins, and most rows [pixels]
WIDE, HIGH, LEFT, RIGHT, UPPER, LOWER, MOST = 960, 200, 84, 16, 28, 24, 5
INK, GRID, LINE, LIMIT = (40, 44, 52), (224, 227, 232), (52, 87, 166), (179, 38, 30)


def columns_picture(time_s: NDArray[Any], columns: Mapping[str, NDArray[Any]], limits: Mapping[str, float]) -> bytes:
    """Return a PNG with a row for each column over time, and a red line at its limit.

    Parameters
    ----------
    time_s : (n,) float, rising
    columns : (n,) float each, by the name of the column; at most five are drawn
    limits : by the name of the column

    Raises
    ------
    InputError
        There is no column, or nothing of them is known.
    """
    known = {name: np.asarray(v, dtype=np.float64) for name, v in columns.items() if np.isfinite(v).any()}
    if not known or not len(time_s):
        raise InputError("picture: nothing of the columns is known: name others")
    rows = list(known.items())[:MOST]
    image = Image.new("RGB", (WIDE, HIGH * len(rows) + LOWER), "white")
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(14)
    first, last = float(time_s[0]), float(time_s[-1])
    span = last - first or 1.0
    x = LEFT + (np.asarray(time_s, dtype=np.float64) - first) / span * (WIDE - LEFT - RIGHT)
    for k, (name, values) in enumerate(rows):
        limit = limits.get(name)
        ends = [0.0, float(np.nanmin(values)), float(np.nanmax(values)), *([limit] if limit is not None else [])]
        low, high = min(ends), max(ends)
        high = high if high > low else low + 1.0
        top, bottom = k * HIGH + UPPER, (k + 1) * HIGH - 8

        def height(v: Any, low: float = low, high: float = high, top: int = top, bottom: int = bottom) -> Any:
            return bottom - (v - low) / (high - low) * (bottom - top)

        for tick in (low, 0.5 * (low + high), high):
            draw.line([(LEFT, height(tick)), (WIDE - RIGHT, height(tick))], fill=GRID)
            draw.text((LEFT - 6, height(tick)), number_text(tick), fill=INK, font=font, anchor="rm")
        draw.text((LEFT, k * HIGH + 6), COLUMNS[name].title if name in COLUMNS else name, fill=INK, font=font)
        for part in _unbroken(x, height(values)):
            draw.line(part, fill=LINE, width=2)
        if limit is not None:
            draw.line([(LEFT, height(limit)), (WIDE - RIGHT, height(limit))], fill=LIMIT, width=2)
            draw.text((WIDE - RIGHT, k * HIGH + 6), f"limit {limit:g}", fill=LIMIT, font=font, anchor="ra")
    for t, anchor in ((first, "ls"), (last, "rs")):
        at = LEFT + (t - first) / span * (WIDE - LEFT - RIGHT)
        draw.text((at, image.height - 6), f"{number_text(t)} s", fill=INK, font=font, anchor=anchor)
    out = io.BytesIO()
    image.save(out, "PNG", optimize=True)
    return out.getvalue()


def _unbroken(x: NDArray[np.float64], y: NDArray[np.float64]) -> list[list[tuple[float, float]]]:
    """Return the parts of a line between values that are not known, each of two points or more."""
    parts: list[list[tuple[float, float]]] = [[]]
    for a, b in zip(x.tolist(), y.tolist(), strict=True):
        if math.isfinite(b):
            parts[-1].append((a, b))
        elif parts[-1]:
            parts.append([])
    return [part for part in parts if len(part) > 1]
