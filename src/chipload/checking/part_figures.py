"""Figures of the part (gouge in red, finished in grey, excess in blue) and of collisions.

Notation: distance [mm] of the part's points from the tool, below 0 gouge, above 0 excess; a distance of more than
``look`` is not known and is drawn pale.
"""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from chipload.checking import part_numbers
from chipload.lazy import trimesh
from chipload.number_text import number_text, place_text
from chipload.report.scene import legend
from chipload.report.sheet import table
from chipload.simulation.surface import Collision, Difference

Floats = NDArray[np.float64]

#: colours from the deepest gouge over finished to the highest excess, and of what is not known
GOUGE, DONE, EXCESS, UNKNOWN = (178, 24, 43), (236, 236, 232), (33, 102, 172), (250, 246, 225)
#: collisions that the report shows
LISTED = 200


def colours(left: Difference, span: float) -> NDArray[np.uint8]:
    """Return the colour (p, 4) of each point; a distance of ``span`` [mm] has the full colour."""
    known = np.isfinite(left.distance) & (left.over | (left.distance < 0.0))
    share = np.clip(np.where(known, left.distance, 0.0) / span, -1.0, 1.0)
    ends = np.array([GOUGE, DONE, EXCESS], dtype=np.float64)
    rgb = np.stack([np.interp(share, [-1.0, 0.0, 1.0], ends[:, i]) for i in range(3)], axis=1)
    rgb[left.over & ~np.isfinite(left.distance)] = UNKNOWN
    return np.column_stack([rgb, np.full(len(rgb), 255.0)]).round().astype(np.uint8)


def span_of(left: Difference, columns: Mapping[str, NDArray[Any]]) -> float:
    """Return the distance [mm] that is drawn in full colour."""
    found = (part_numbers.worst(left, columns, kind)["max"] for kind in ("gouge_mm", "excess_mm"))
    return float(max(*found, 1e-6))


def coloured_mesh(left: Difference, span: float) -> trimesh.Trimesh:
    """Return the coloured mesh of the part for a scene."""
    mesh = trimesh.Trimesh(left.points, left.faces, process=False)
    mesh.visual.vertex_colors = colours(left, span)
    mesh.metadata["legend"] = legend(
        "gouge (below 0) and excess [mm]",
        [(-span, GOUGE), (0.0, DONE), (span, EXCESS)],
        [("beyond the search range", UNKNOWN)],
    )
    return mesh


def section(
    left: Difference | None,
    collisions: tuple[Collision, ...],
    columns: Mapping[str, NDArray[Any]],
    compared_with: tuple[str, ...],
    figures: dict[str, go.Figure],
) -> list[str]:
    """Return the report section on the surface of the part and on collisions."""
    body: list[str] = []
    if left is not None:
        what = part_numbers.numbers(left, columns)
        gouge, excess, span = what["gouge_mm"], what["excess_mm"], span_of(left, columns)
        rows = [
            [name, number_text(v["max"]), str(v["line"] or ""), place_text(v["place"] or [])]
            for name, v in (("deepest gouge [mm]", gouge), ("highest excess [mm]", excess))
        ]
        body += [
            "<h2>Gouge and excess on the part</h2>",
            table(["", "mm", "line", "at x, y, z [mm]"], rows, numbers=(1, 2)),
            f"<p>Of {what['part_under_stock']} points of the part that had stock over them "
            f"{number_text(100.0 * what['part_reached_share'], 3)} % lie within {left.search_range:g} mm "
            "of the tool path; over "
            "the others there is more.</p>",
            '<p class="note">On the part in the view above, red is cut too deep, blue stands over the part, in full '
            f"colour by {span:.3g} mm; pale: beyond the search range.</p>",
        ]
    if compared_with:
        body += [
            "<h2>Collisions</h2>",
            f"<p>Shank and holder were compared with {escape(', '.join(compared_with))}: "
            f"{len(collisions) or 'no'} line{'s' if len(collisions) != 1 else ''} with a collision.</p>",
        ]
    if collisions:
        t = columns["t_s"]
        rows = [
            [
                str(c.line), c.what, c.into, f"{c.depth_mm:.3g}", number_text(float(t[c.step])),
                place_text(c.at),
            ]
            for c in collisions[:LISTED]
        ]  # fmt: skip
        body += [
            table(["line", "what", "into", "depth [mm]", "time [s]", "tip at x, y, z [mm]"], rows, numbers=(0, 3, 4))
        ]
    return body
