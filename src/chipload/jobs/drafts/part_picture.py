"""The picture of what is found in a part that is milled from above: pockets by depth, thin walls, corners (SVG)."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np
import shapely

from chipload.geometry.part_walls import Wall
from chipload.geometry.pocketed_part import Pocket
from chipload.lazy import trimesh
from chipload.number_text import number_text

#: width of the picture and of its margin, height of a line of text [px]
WIDE, MARGIN, LINE = 900.0, 24.0, 20.0
#: colour of material, of walls, of the shallowest and of the deepest pocket
MATERIAL, WALL_COLOUR, SHALLOW, DEEP = "#c9ced6", "#d1495b", (214, 230, 245), (46, 110, 170)


def part_picture(mesh: trimesh.Trimesh, pockets: Sequence[Pocket], walls: Sequence[Wall]) -> str:
    """SVG of a part seen from above: pockets are the darker the deeper they are, thin walls are red."""
    (x0, y0, _), (x1, y1, _) = mesh.bounds.tolist()
    scale = (WIDE - 2.0 * MARGIN) / max(x1 - x0, y1 - y0)
    width, high = scale * (x1 - x0) + 2.0 * MARGIN, scale * (y1 - y0) + 2.0 * MARGIN

    def px(x: float, y: float) -> tuple[float, float]:
        return MARGIN + scale * (x - x0), high - MARGIN - scale * (y - y0)

    a, b = px(x0, y1), px(x1, y0)
    out = [
        f'<rect x="{a[0]:.1f}" y="{a[1]:.1f}" width="{b[0] - a[0]:.1f}" height="{b[1] - a[1]:.1f}" fill="{MATERIAL}" '
        'stroke="#333"/>'
    ]
    deepest = max((p.depth_mm for p in pockets), default=1.0)
    for pocket in sorted(pockets, key=lambda p: p.depth_mm):
        share = pocket.depth_mm / deepest
        colour = "#" + "".join(f"{round(s + share * (d - s)):02x}" for s, d in zip(SHALLOW, DEEP, strict=True))
        rings = [pocket.outline.exterior, *pocket.outline.interiors]
        path = " ".join(_path([px(x, y) for x, y in shapely.get_coordinates(ring.simplify(0.01))]) for ring in rings)
        out.append(f'<path d="{path}" fill="{colour}" fill-rule="evenodd" stroke="#333" stroke-width="0.8"/>')
        at = px(*shapely.get_coordinates(pocket.outline.representative_point())[0].tolist())
        corner = (
            "open side" if pocket.open else f"R {number_text(pocket.corner_mm, 2)}" if pocket.corner_mm else "sharp"
        )
        for k, text in enumerate(
            (f"z = {pocket.floor_mm:g}", f"{pocket.depth_mm:g} deep, {corner}", f"floor {pocket.floor_thickness_mm:g}")
        ):
            out.append(_text(at[0], at[1] + (k - 1) * LINE, text))
    for wall in walls:
        p, q = px(*wall.start), px(*wall.end)
        stroke = max(scale * wall.thickness_mm, 2.0)
        out.append(
            f'<line x1="{p[0]:.1f}" y1="{p[1]:.1f}" x2="{q[0]:.1f}" y2="{q[1]:.1f}" stroke="{WALL_COLOUR}" '
            f'stroke-width="{stroke:.1f}"/>'
        )
        middle = 0.5 * (np.array(p) + q)
        side = np.array([q[1] - p[1], p[0] - q[0]]) / max(float(np.hypot(q[0] - p[0], q[1] - p[1])), 1e-9)
        centre = np.array([0.5 * width, 0.5 * high])
        side = side if float(side @ (centre - middle)) > 0.0 else -side
        at = middle + (0.5 * stroke + 0.8 * LINE) * side
        turned = abs(q[1] - p[1]) > abs(q[0] - p[0])
        label = f"{number_text(wall.thickness_mm, 3)} x {number_text(wall.height_mm, 3)}"
        out.append(_text(float(at[0]), float(at[1]), label, turned))
    foot = high + LINE
    out.append(_text(0.5 * width, high + 4.0, "seen from above, mm; thin walls: thickness x height"))
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {foot:.0f}" font-family="sans-serif">'
    return "\n".join([head, f'<rect width="{width:.0f}" height="{foot:.0f}" fill="white"/>', *out, "</svg>\n"])


def _path(points: Sequence[tuple[float, float]]) -> str:
    return "M" + " L".join(f"{x:.1f},{y:.1f}" for x, y in points) + " Z"


def _text(x: float, y: float, text: str, turned: bool = False) -> str:
    turn = f' transform="rotate(-90 {x:.1f} {y:.1f})"' if turned else ""
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="13" text-anchor="middle"{turn}>{escape(text)}</text>'
