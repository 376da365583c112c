"""What the path of a hand-picked cutter depends on: diameter, table angle, direction of the steps, pallet angle.

    python benchmarks/wu2019.py [--out docs]

On both sides of the blade by formula with the source's dimensions, 10 x 10 contact points each, scallop 0.25 mm: the
path of D 14 r 1.5 and of D 20 r 2 at every table angle, with steps along the blade and up it, at the pallet angle with
the widest step-over of those that are valid, and at the one with the narrowest. Writes `wu2019_paths.svg` and prints
the tables of `docs/papers.md`.

Reference: [Wu2019]: D 20 r 2 for D 14 r 1.5, path 677.23 for 1,196.33 mm.
"""

import argparse
import math
from pathlib import Path

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.planning.impeller.closed_form import axis_at
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.ranges.ranges import valid_ranges
from chipload.planning.impeller.step_over import step_over
from chipload.planning.impeller.surfaces import ContactSampling, surface_of

TABLES = np.arange(20.0, 91.0, 5.0)
CUTTERS = {"D 14 r 1.5": CatalogueCutter(14.0, 1.5), "D 20 r 2": CatalogueCutter(20.0, 2.0)}
SIDES, STEPS = ("plus", "minus"), ("along", "up")
SCALLOP, STEP_B = 0.25, math.radians(5.0)
#: share of a side that a cutter must reach at a table angle
WHOLE = 0.94


def surfaces():
    """Both sides of the blade, 10 x 10 contact points each, check points of one channel."""
    how = ContactSampling((0.03, 0.97), (0.30, 0.98), (10, 10), 2.5, 2.0, 0)
    return {side: surface_of(impeller_of(ImpellerShape()), "blade", side, how) for side in SIDES}


def valid_angles(ranges):
    """Pallet angles of ranges (k, 2) [rad], no more than 5 deg apart, inside them."""
    parts = [lo + (hi - lo) * (np.arange(n) + 0.5) / n for lo, hi in ranges for n in [math.ceil((hi - lo) / STEP_B)]]
    return np.concatenate(parts) if parts else np.zeros(0)


def widths(surface, point, cutter, table, pallets, steps):
    """Step-overs [mm] of a contact point at pallet angles; ``steps`` along the blade (paths up it) or up it."""
    scene, grid = surface.scene, surface.scene.contact.reshape(*surface.shape, 3)
    axis = 1 if steps == "along" else 0
    along = np.gradient(grid, (surface.u, surface.v)[axis], axis=axis).reshape(-1, 3)[point]
    T = axis_at(table, pallets)
    N = np.tile(scene.normal[point], (len(pallets), 1))
    ok = (N * T).sum(axis=1) < 1.0 - 1e-9
    out = np.zeros(len(pallets))
    K = np.tile(scene.curvature[point], (len(pallets), 1, 1))
    D = np.tile(along, (len(pallets), 1))
    out[ok] = step_over(N[ok], T[ok], D[ok], K[ok], cutter.rho, cutter.corner_radius, SCALLOP)
    return out


def paths(sides=None, tables=TABLES):
    """By cutter, side, steps and table angle: share of the area that is reached, path [mm] at best and at worst."""
    out = {}
    for side, surface in (surfaces() if sides is None else sides).items():
        for name, cutter in CUTTERS.items():
            for table in tables:
                found = valid_ranges(surface.scene, cutter, math.radians(table), workers=2).ranges
                rows = {steps: [] for steps in STEPS}
                for k, ranges in enumerate(found):
                    B = valid_angles(ranges)
                    for steps in STEPS:
                        w = widths(surface, k, cutter, math.radians(table), B, steps) if len(B) else np.zeros(0)
                        w = w[w > 0.0]
                        rows[steps].append((w.max(), w.min()) if len(w) else (math.nan, math.nan))
                for steps in STEPS:
                    w = np.array(rows[steps])
                    reached = np.isfinite(w[:, 0])
                    area = surface.area[reached]
                    best, worst = ((area / w[reached, j]).sum() for j in (0, 1))
                    share = float(area.sum() / surface.area.sum())
                    out[name, side, steps, float(table)] = (share, float(best), float(worst))
    return out


def scaled(found, j):
    """Path [mm] at best (1) or at worst (2) as if all of the side were reached; where less than WHOLE is: left out."""
    return {key: row[j] / row[0] for key, row in found.items() if row[0] >= WHOLE}


def extremes(found, side, cutter):
    """Shortest path at the best pallet angles, longest at the worst: (path, table, steps) each."""
    best, worst = ({k: v for k, v in scaled(found, j).items() if k[:2] == (cutter, side)} for j in (1, 2))
    a, b = min(best, key=best.get), max(worst, key=worst.get)
    return (best[a], a[3], a[2]), (worst[b], b[3], b[2])


def same_angle(found, side):
    """Least and greatest of D 20 over D 14 at one table angle, one direction of steps, both at their best or worst."""
    ratios = []
    for j in (1, 2):
        path = scaled(found, j)
        ratios += [v / path["D 14 r 1.5", *k[1:]] for k, v in path.items()
                   if k[0] == "D 20 r 2" and k[1] == side and ("D 14 r 1.5", *k[1:]) in path]  # fmt: skip
    return min(ratios), max(ratios)


def picture(found):
    """The path against the table angle as SVG: a frame a side; solid at the best pallet angle, dashed at the worst."""
    colours = {"D 14 r 1.5": "#c9821a", "D 20 r 2": "#3457a6"}
    best, worst = scaled(found, 1), scaled(found, 2)
    top = 1.05 * max(worst.values())
    font = 'font-family="sans-serif" font-size="12"'
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" width="920" height="400" {font}>']
    parts.append('<rect width="920" height="400" fill="#ffffff"/>')
    for k, side in enumerate(SIDES):
        x0, y0, wide, tall = 60 + 450 * k, 340, 380, 290
        parts.append(f'<text x="{x0}" y="24" font-size="14">blade {side}: path [mm] over table angle [deg]</text>')
        parts.append(f'<path d="M{x0} {y0 - tall}V{y0}H{x0 + wide}" fill="none" stroke="#1f2933"/>')
        for table in range(20, 91, 10):
            x = x0 + wide * (table - 20) / 70
            parts.append(f'<text x="{x:.1f}" y="{y0 + 18}" text-anchor="middle">{table}</text>')
        for value in np.arange(0.0, top, 200.0):
            y = y0 - tall * value / top
            parts.append(f'<text x="{x0 - 6}" y="{y + 4:.1f}" text-anchor="end">{value:.0f}</text>')
            parts.append(f'<path d="M{x0} {y:.1f}H{x0 + wide}" stroke="#e3e7ec"/>')
        for name in CUTTERS:
            for steps in STEPS:
                for path, dash in ((best, "none"), (worst, "4 3")):
                    points = [(x0 + wide * (t - 20.0) / 70.0, y0 - tall * path[name, side, steps, t] / top)
                              for t in TABLES.tolist() if (name, side, steps, t) in path]  # fmt: skip
                    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
                    width = 2.4 if steps == "along" else 1.0
                    parts.append(f'<polyline points="{line}" fill="none" stroke="{colours[name]}" '
                                 f'stroke-width="{width}" stroke-dasharray="{dash}"/>')  # fmt: skip
    words = "D 14 r 1.5 amber, D 20 r 2 blue; thick: steps along the blade, thin: up it; "
    words += "solid: best pallet angle, dashed: worst"
    parts.append(f'<text x="60" y="388">{words}</text></svg>')
    return "\n".join(parts) + "\n"


def tables(found):
    """The tables of docs/papers.md."""
    lines = ["| side | cutter | shortest [mm] | at | longest [mm] | at |", "|---|---|---:|---|---:|---|"]
    for side in SIDES:
        for name in CUTTERS:
            (a, t0, s0), (b, t1, s1) = extremes(found, side, name)
            lines.append(f"| {side} | {name} | {a:.0f} | {t0:g} deg, steps {s0} | {b:.0f} | {t1:g} deg, steps {s1} |")
    lines += ["", "| path | " + " | ".join(SIDES) + " |", "|---|---:|---:|"]
    spans = [same_angle(found, side) for side in SIDES]
    shares = [f"{100.0 * (a - 1.0):+.0f} to {100.0 * (b - 1.0):+.0f} %" for a, b in spans]
    lines.append(
        "| D 20 for D 14, same table angle, same steps, same choice of the pallet | " + " | ".join(shares) + " |"
    )
    ends = {(side, name): extremes(found, side, name) for side in SIDES for name in CUTTERS}
    for text, short, long in (
        ("D 14 at its shortest for D 14 at its longest", "D 14 r 1.5", "D 14 r 1.5"),
        ("D 20 at its shortest for D 14 at its longest", "D 20 r 2", "D 14 r 1.5"),
    ):
        values = [ends[side, short][0][0] / ends[side, long][1][0] for side in SIDES]
        lines.append(f"| {text} | " + " | ".join(f"{100.0 * (x - 1.0):+.0f} %" for x in values) + " |")
    for name in CUTTERS:
        at = [[sum(scaled(found, j)[name, side, steps, 45.0] for side in SIDES) for steps in STEPS] for j in (1, 2)]
        lines.append(f"| both sides at 45 deg, {name} | {min(at[0]):.0f} mm at best | {max(at[1]):.0f} mm at worst |")
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "docs")
    given = parser.parse_args()
    result = paths()
    (given.out / "wu2019_paths.svg").write_text(picture(result))
    print(tables(result))
    for where, (share, best, worst) in result.items():
        print(*where, f"{share:.3f} {best:.0f} {worst:.0f}")
