"""Colours, fonts and sizes that all figures share."""

from __future__ import annotations

LIMIT, WALL, STOCK, INK, GRID = "#b3261e", "#7b8794", "#a8793a", "#1f2933", "#e6e8eb"
#: dark where little is engaged, bright where most is
SCALE = [[0.0, "#30245c"], [0.25, "#35608d"], [0.5, "#22a884"], [0.75, "#9bd93c"], [1.0, "#fbb61a"]]
#: shades that the lines of a plan view come in
SHADES = 16
FONT = {"family": "system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif", "size": 12, "color": INK}
#: points of one line, of one plan view and of one path in space
LINE_POINTS, PLAN_POINTS, SPACE_POINTS = 6000, 12_000, 8000
