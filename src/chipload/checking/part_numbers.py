"""Gouge, excess and collisions as numbers of an operation in summary.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.limits import greatest_difference
from chipload.simulation.surface import Collision, Difference


def worst(left: Difference, columns: Mapping[str, NDArray[Any]], name: str) -> dict[str, Any]:
    """Return deepest gouge or highest excess as ``{max, line, place, t_s}``; line 0 and no place if there is none."""
    value, step, place = greatest_difference(left, name)
    if place is None:
        return {"max": 0.0, "line": 0, "place": None, "t_s": None}
    return {"max": value, "line": int(columns["line"][step]), "place": list(place), "t_s": float(columns["t_s"][step])}


def numbers(left: Difference | None, columns: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Return the keys of an operation in summary.json; without a part gouge and excess are not known."""
    if left is None:
        nothing = {"max": None, "line": 0, "place": None, "t_s": None}
        return dict.fromkeys(("gouge_mm", "excess_mm"), nothing)
    known = np.isfinite(left.distance)[left.over]
    return {
        "gouge_mm": worst(left, columns, "gouge_mm"),
        "excess_mm": worst(left, columns, "excess_mm"),
        "part_points": len(left.points),
        "part_under_stock": len(known),
        "part_reached_share": float(known.mean()) if len(known) else 1.0,
        "excess_range_mm": left.search_range,
    }


def collision_rows(collisions: tuple[Collision, ...], columns: Mapping[str, NDArray[Any]]) -> list[dict[str, Any]]:
    """Return ``collisions`` of an operation in summary.json."""
    t, tool = columns["t_s"], columns["tool"]
    return [
        {
            "what": c.what, "into": c.into, "depth_mm": c.depth_mm, "line": c.line, "place": list(c.at),
            "t_s": float(t[c.step]), "tool": int(tool[c.step]),
        }
        for c in collisions
    ]  # fmt: skip
