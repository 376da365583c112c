"""Paths of a pocket by several planners side by side, as one SVG: cuts, links, lifts, and the numbers of each.

`benchmarks/pockets.py --pictures FOLDER` writes one a drawing.
"""

import numpy as np

#: width of a panel [px], and the space around it; names of the planners as they are shown
PANEL, EDGE = 440, 14
NAMES = {"pocket": "passes", "trochoidal": "trochoidal", "adaptive": "FreeCAD Adaptive"}
#: kinds of rows, see `pockets.py`, with colour, width [px] and dashes
LAYERS = (
    (1, "cut", "#1565c0", 0.6, ""),
    (2, "link", "#e69f00", 0.45, ""),
    (3, "lift", "#c62828", 0.6, "4 3"),
    (0, "bore", "#111111", 1.2, ""),
)


def picture(title, region, radius, panels):
    """SVG of ``panels`` (name, rows (n, 8), numbers) of one region, cutter of ``radius`` [mm]."""
    xmin, ymin, xmax, ymax = region.bounds
    scale = PANEL / max(xmax - xmin, 0.6 * (ymax - ymin))
    high = scale * (ymax - ymin)

    def px(points):
        return np.column_stack([(points[:, 0] - xmin) * scale, (ymax - points[:, 1]) * scale])

    width, height = len(panels) * (PANEL + EDGE) + EDGE, high + 78.0
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" font-family="sans-serif">',
        f'<rect width="{width:.0f}" height="{height:.0f}" fill="#fff"/>',
    ]
    outline = " ".join(_path(px(np.asarray(c.flatten(0.3 / scale))), closed=True) for c in region.contours)
    for k, (who, rows, found) in enumerate(panels):
        out.append(f'<g transform="translate({EDGE + k * (PANEL + EDGE):.0f} {EDGE + 22:.0f})">')
        out.append(f'<text x="0" y="-10" font-size="14">{title}, R {radius:g} mm: {NAMES[who]}</text>')
        out.append(f'<path d="{outline}" fill="#eceff1" stroke="#455a64" fill-rule="evenodd"/>')
        for kind, _, colour, line, dash in LAYERS:
            runs = _runs(rows, kind, 0.3 / scale)
            d = " ".join(_path(px(run)) for run in runs)
            if d:
                how = f' stroke-dasharray="{dash}"' if dash else ""
                out.append(f'<path d="{d}" fill="none" stroke="{colour}" stroke-width="{line}"{how}/>')
        words = (
            f"{found['time_s']:.0f} s at one force, at most {found['engagement_max_deg']:.1f} deg",
            f"cuts {1e-3 * found['cut_mm']:.2f} m, links {1e-3 * found['link_mm']:.2f} m, {found['lifts']} lifts, "
            f"{100.0 * found['reached']:.2f} % cleared, {1e-3 * found['gcode_bytes']:.0f} kB",
        )
        out += [f'<text x="0" y="{high + 16 * (j + 1):.0f}" font-size="12">{w}</text>' for j, w in enumerate(words)]
        out.append("</g>")
    return "\n".join([*out, "</svg>", ""])


def _runs(rows, kind, chord):
    """Points (m, 2) of each run of rows of a kind, arcs in chords [mm]."""
    at = np.flatnonzero(rows[:, 7] == kind)
    if not len(at):
        return []
    return [_points(rows[part], chord) for part in np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)]


def _points(rows, chord):
    out = [rows[:1, 0:2]]
    for x0, y0, x1, y1, cx, cy, sweep in rows[:, 0:7]:
        rho = np.hypot(x0 - cx, y0 - cy)
        n = 1 if sweep == 0.0 else max(1, int(np.ceil(abs(sweep) / np.sqrt(8.0 * min(chord / rho, 0.5)))))
        if n == 1:
            out.append([[x1, y1]])
            continue
        a = np.arctan2(y0 - cy, x0 - cx) + sweep * np.arange(1, n + 1) / n
        out.append(np.column_stack([cx + rho * np.cos(a), cy + rho * np.sin(a)]))
    return np.vstack(out)


def _path(points, closed=False):
    """Path data of points [px], those left out that lie within 0.6 px of the last one kept."""
    kept = [points[0]]
    for p in points[1:-1]:
        if np.hypot(*(p - kept[-1])) > 0.6:
            kept.append(p)
    kept.append(points[-1])
    words = [f"{x:.1f} {y:.1f}" for x, y in kept]
    return "M" + "L".join(words) + ("Z" if closed else "")
