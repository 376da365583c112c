"""Draw the animation of README.md: two strategies of the example contour side by side, as an animated SVG file; see
tools/figures.py.

Above: the cutter along the finish pass and the angle over which it is engaged. Below: the engagement angle along the
path and its limit. All numbers are those of the history. Time is that of the machine, slowed down.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import chipload

OUT = Path(__file__).parent.parent / "docs" / "contour.svg"
#: seconds of a loop and its pictures
LOOP, FRAMES = 6.0, 72
#: pixels: width of a panel, scale of the plan view in 1/mm, its corner, left and lower edge of the graph, its size
PANEL, SCALE, PLAN, GRAPH, GRAPH_SIZE = 420, 8.2, (80, 284), (60, 470), (330, 130)
#: wall corner, cutter [mm], greatest angle of the graph [deg]
CORNER, RADIUS, TOP = 8.0, 5.0, 20.0
INK, GREY, WALL, CUT, BAD, GOOD = "#1f2933", "#7b8794", "#c9ced6", "#dfe7f2", "#b3261e", "#0b6b4f"
TITLES = {"plain": "parallel passes", "backward": "reshaped semi-finish pass"}

Floats = NDArray[np.float64]


def plan(x: float, y: float) -> str:
    """A point of the plan view in pixels."""
    return f"{PLAN[0] + SCALE * x:.1f},{PLAN[1] - SCALE * y:.1f}"


def wedge(x: float, y: float, tangent: Floats, angle: float) -> str:
    """The engaged sector of the cutter, from the wall towards the feed; the wall is on the right of the path."""
    wall = np.array([tangent[1], -tangent[0]])
    turn = np.linspace(0.0, angle, 8)
    rim = [RADIUS * (np.cos(t) * wall + np.sin(t) * tangent) for t in turn]
    return "M" + plan(x, y) + "".join("L" + plan(x + r[0], y + r[1]) for r in rim) + "Z"


def graph(share: float, degrees: float) -> tuple[float, float]:
    """A point of the graph in pixels."""
    return GRAPH[0] + GRAPH_SIZE[0] * share, GRAPH[1] - GRAPH_SIZE[1] * degrees / TOP


def animated(name: str, values: list[str], mode: str = "linear") -> str:
    """An animation of an attribute over the loop."""
    return (
        f'<animate attributeName="{name}" dur="{LOOP:g}s" repeatCount="indefinite" calcMode="{mode}" '
        f'values="{";".join(values)}"/>'
    )


def panel(track: chipload.Track, limit: float) -> str:
    """One strategy: title, plan view, graph."""
    columns = track.columns
    rows = columns["pass"] == "finish"
    t, x, y, angle = (np.asarray(columns[n][rows], dtype=np.float64) for n in ("t_s", "x_mm", "y_mm", "engagement_deg"))
    s = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    at = np.linspace(t[0], t[-1], FRAMES)
    xs, ys, angles, shares = (np.interp(at, t, v) for v in (x, y, angle, s / s[-1]))
    along = np.column_stack([np.interp(at, t, np.gradient(v, s)) for v in (x, y)])
    along /= np.linalg.norm(along, axis=1)[:, None]
    worst, colour = float(angle.max()), BAD if angle.max() > limit else GOOD
    sectors = [wedge(*place) for place in zip(xs, ys, along, np.radians(angles), strict=True)]
    dots = [graph(*place) for place in zip(shares, angles, strict=True)]
    line = " ".join("{:.1f},{:.1f}".format(*graph(*p)) for p in zip(s / s[-1], angle, strict=True))
    bound = graph(0.0, limit)[1]
    arc = SCALE * CORNER
    return "\n".join(
        [
            f'<text x="60" y="30" class="title">{TITLES[track.name]}</text>',
            f'<path fill="{WALL}" d="M{plan(-3, 30)}L{plan(0, 30)}L{plan(0, CORNER)}A{arc:g} {arc:g} 0 0 0 '
            f'{plan(CORNER, 0)}L{plan(34, 0)}L{plan(34, -3)}L{plan(-3, -3)}Z"/>',
            f'<polyline points="{" ".join(plan(*p) for p in zip(x, y, strict=True))}" fill="none" stroke="{GREY}" '
            'stroke-dasharray="4 4"/>',
            f'<circle r="{SCALE * RADIUS:g}" fill="{CUT}" stroke="{INK}" cx="{plan(xs[0], ys[0]).split(",")[0]}" '
            f'cy="{plan(xs[0], ys[0]).split(",")[1]}">'
            + animated("cx", [plan(*p).split(",")[0] for p in zip(xs, ys, strict=True)])
            + animated("cy", [plan(*p).split(",")[1] for p in zip(xs, ys, strict=True)])
            + "</circle>",
            f'<path fill="{colour}" d="{sectors[0]}">{animated("d", sectors)}</path>',
            f'<text x="{GRAPH[0]}" y="{GRAPH[1] - GRAPH_SIZE[1] - 10}">engagement angle [deg]: '
            f"at most {worst:.1f}</text>",
            *(
                f'<text x="{GRAPH[0] - 8}" y="{graph(0, v)[1] + 4:.1f}" class="end">{v}</text>'
                f'<line x1="{GRAPH[0]}" x2="{GRAPH[0] + GRAPH_SIZE[0]}" y1="{graph(0, v)[1]:.1f}" '
                f'y2="{graph(0, v)[1]:.1f}" stroke="#e6e8eb"/>'
                for v in (0, 5, 10, 15, 20)
            ),
            f'<line x1="{GRAPH[0]}" x2="{GRAPH[0] + GRAPH_SIZE[0]}" y1="{bound:.1f}" y2="{bound:.1f}" stroke="{BAD}" '
            'stroke-dasharray="6 4"/>',
            f'<text x="{GRAPH[0] + GRAPH_SIZE[0]}" y="{bound - 5:.1f}" class="end" fill="{BAD}">limit {limit:g}</text>',
            f'<polyline points="{line}" fill="none" stroke="{INK}" stroke-width="1.6"/>',
            f'<circle r="5" fill="{colour}" cx="{dots[0][0]:.1f}" cy="{dots[0][1]:.1f}">'
            + animated("cx", [f"{a:.1f}" for a, _ in dots])
            + animated("cy", [f"{b:.1f}" for _, b in dots])
            + "</circle>",
            f'<text x="{GRAPH[0]}" y="{GRAPH[1] + 20}">along the finish pass</text>',
        ]
    )


def drawing(result: chipload.Result) -> str:
    """The SVG file."""
    (limit,) = {check.limit for check in result.limits if check.name == "engagement_deg"}
    panels = [
        f'<g transform="translate({k * PANEL} 0)">\n{panel(result.track(name), limit)}\n</g>'
        for k, name in enumerate(TITLES)
    ]
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {2 * PANEL} 500" '
            f'font-family="system-ui, sans-serif" font-size="13" fill="{INK}">',
            "<style>.title{font-size:17px;font-weight:600}.end{text-anchor:end}</style>",
            f'<rect width="{2 * PANEL}" height="500" fill="white"/>',
            *panels,
            "</svg>\n",
        ]
    )


def write(folder: Path) -> None:
    """Write the file from a result folder of the example contour."""
    OUT.write_text(drawing(chipload.load_result(folder)), encoding="utf-8")
