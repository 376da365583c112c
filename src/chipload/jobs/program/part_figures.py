"""What is left on the part, drawn: gouge in red, finished in grey, excess in blue; and what ran into what.

Notation: distance [mm] of the part's points from the tool, below 0 gouge, above 0 excess; what is more than ``look`` is
not known and drawn pale.
"""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np
import plotly.graph_objects as go
import trimesh
from numpy.typing import NDArray

from chipload.jobs.program import part_numbers
from chipload.report.figures import FONT
from chipload.report.sheet import figure, table
from chipload.simulation.surface import Collision, Difference

Floats = NDArray[np.float64]

#: colours from the deepest gouge over finished to the highest excess, and of what is not known
GOUGE, DONE, EXCESS, UNKNOWN = (178, 24, 43), (236, 236, 232), (33, 102, 172), (250, 246, 225)
#: triangles and collisions that the page shows
MOST_FACES, LISTED = 60_000, 200


def colours(left: Difference, span: float) -> NDArray[np.uint8]:
    """(p, 4) colour of each point; ``span`` [mm] of distance is the full colour."""
    known = np.isfinite(left.distance) & (left.over | (left.distance < 0.0))
    share = np.clip(np.where(known, left.distance, 0.0) / span, -1.0, 1.0)
    ends = np.array([GOUGE, DONE, EXCESS], dtype=np.float64)
    rgb = np.stack([np.interp(share, [-1.0, 0.0, 1.0], ends[:, i]) for i in range(3)], axis=1)
    rgb[left.over & ~np.isfinite(left.distance)] = UNKNOWN
    return np.column_stack([rgb, np.full(len(rgb), 255.0)]).round().astype(np.uint8)


def span_of(left: Difference, columns: Mapping[str, NDArray[Any]]) -> float:
    """[mm] of distance that is drawn in full colour."""
    found = (part_numbers.worst(left, columns, kind)["max"] for kind in ("gouge_mm", "excess_mm"))
    return float(max(*found, 1e-6))


def coloured_mesh(left: Difference, span: float) -> trimesh.Trimesh:
    """The part for a scene."""
    mesh = trimesh.Trimesh(left.points, left.faces, process=False)
    mesh.visual.vertex_colors = colours(left, span)
    return mesh


def part_figure(left: Difference, span: float) -> go.Figure:
    """The part in space, coloured by what is left on it; of many triangles those that show most."""
    faces = left.faces
    if len(faces) > MOST_FACES:
        known = np.where(np.isfinite(left.distance), np.abs(left.distance), -1.0)
        keep = np.argsort(-known[faces].max(axis=1), kind="stable")[:MOST_FACES]
        faces = faces[np.sort(keep)]
    used, back = np.unique(faces, return_inverse=True)
    p, corner = left.points[used].astype(np.float32), back.reshape(-1, 3)
    rgb = [f"rgb({r},{g},{b})" for r, g, b, _ in colours(left, span)[used].tolist()]
    said = np.where(np.isfinite(left.distance[used]), left.distance[used], np.nan)
    out = go.Figure(
        go.Mesh3d(
            x=p[:, 0], y=p[:, 1], z=p[:, 2], i=corner[:, 0], j=corner[:, 1], k=corner[:, 2], vertexcolor=rgb,
            customdata=said.astype(np.float32), flatshading=True, lighting={"ambient": 0.75, "diffuse": 0.4},
            hovertemplate="%{customdata:.4f} mm<br>x %{x:.3f} y %{y:.3f} z %{z:.3f}<extra></extra>",
        )
    )  # fmt: skip
    out.update_layout(
        template="none", font=FONT, height=560, margin={"l": 0, "r": 0, "t": 0, "b": 0},
        scene={"aspectmode": "data", "xaxis_title": "x [mm]", "yaxis_title": "y [mm]", "zaxis_title": "z [mm]"},
    )  # fmt: skip
    return out


def section(
    left: Difference | None,
    collisions: tuple[Collision, ...],
    columns: Mapping[str, NDArray[Any]],
    compared_with: tuple[str, ...],
    figures: dict[str, go.Figure],
) -> list[str]:
    """The part of the page on the surface and on collisions."""
    body: list[str] = []
    if left is not None:
        what = part_numbers.numbers(left, columns)
        gouge, excess, span = what["gouge_mm"], what["excess_mm"], span_of(left, columns)
        rows = [
            [name, f"{v['max']:.4g}", str(v["line"] or ""), ", ".join(f"{x:.4g}" for x in v["place"] or [])]
            for name, v in (("deepest gouge [mm]", gouge), ("highest excess [mm]", excess))
        ]
        body += [
            "<h2>What is left on the part</h2>",
            table(["", "mm", "line", "at x, y, z [mm]"], rows, numbers=(1, 2)),
            f"<p>Of {what['part_under_stock']} points of the part that had stock over them "
            f"{100.0 * what['part_reached_share']:.3g} % lie within {left.look:g} mm of the tool's way; over the "
            "others there is more.</p>",
            f'<p class="note">Red is cut too deep, blue stands over the part, in full colour by {span:.3g} mm; pale: '
            "more than was looked for.</p>",
            figure("part", part_figure(left, span), figures),
        ]
    if compared_with:
        body += [
            "<h2>Collisions</h2>",
            f"<p>Shank and holder were held against {escape(', '.join(compared_with))}: "
            f"{len(collisions) or 'no'} line{'s' if len(collisions) != 1 else ''} with a collision.</p>",
        ]
    if collisions:
        t = columns["t_s"]
        rows = [
            [
                str(c.line), c.what, c.into, f"{c.depth_mm:.3g}", f"{float(t[c.step]):.4g}",
                ", ".join(f"{x:.4g}" for x in c.at),
            ]
            for c in collisions[:LISTED]
        ]  # fmt: skip
        body += [
            table(["line", "what", "into", "depth [mm]", "time [s]", "tip at x, y, z [mm]"], rows, numbers=(0, 3, 4))
        ]
    return body
