"""What the path of a hand-picked cutter depends on: diameter, table angle, direction of the steps, pallet angle.

    python benchmarks/wu2019.py [--out docs]

On both sides of the blade by formula with the source's dimensions, 10 x 10 contact points each, scallop 0.25 mm: the
path of D 14 r 1.5 and of D 20 r 2 at every table angle, with steps along the blade and up it, at the pallet angle with
the widest step-over of those that are valid, and at the one with the narrowest. Then the largest cutter for all of a
side, the larger ones of two patches, and diameter, corner radius and pallet angles of single contact points at 35, 45
and 55 deg. Writes `wu2019_paths.svg` and prints the tables of `docs/papers.md`.

Reference: [Wu2019]: D 20 r 2 for D 14 r 1.5, path 677.23 for 1,196.33 mm.
"""

import argparse
import math
from pathlib import Path

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter, catalogue_named
from chipload.planning.impeller.answer import largest_cutters
from chipload.planning.impeller.closed_form import axis_at
from chipload.planning.impeller.pallet_ranges import valid_ranges
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.step_over import step_over
from chipload.planning.impeller.surfaces import ContactSampling, surface_of

TABLES = np.arange(20.0, 91.0, 5.0)
CUTTERS = {"D 14 r 1.5": CatalogueCutter(14.0, 1.5), "D 20 r 2": CatalogueCutter(20.0, 2.0)}
SIDES, STEPS = ("plus", "minus"), ("along", "up")
SCALLOP, STEP_B = 0.25, math.radians(5.0)
#: share of a side that a cutter must reach at a table angle
WHOLE = 0.94
#: diameters and corner radius [mm] of the source's catalogue; its scallops on the narrow patch and on the wide one
SIZES, CORNER, NARROW, WIDE = np.arange(10.0, 81.0, 2.0), 2.0, 0.1, 0.06
#: table angles [deg] of the source's tables of contact points; the grid line of u that is shown
SHOWN, LINE = (35.0, 45.0, 55.0), 5


def surfaces():
    """Both sides of the blade, 10 x 10 contact points each, check points of one channel."""
    how = ContactSampling((0.03, 0.97), (0.30, 0.98), (10, 10), 2.5, 2.0, 0)
    return {side: surface_of(impeller_of(ImpellerShape()), "blade", side, how) for side in SIDES}


def valid_angles(ranges):
    """Pallet angles of ranges (k, 2) [rad], no more than 5 deg apart, inside them."""
    parts = [lo + (hi - lo) * (np.arange(n) + 0.5) / n for lo, hi in ranges for n in [math.ceil((hi - lo) / STEP_B)]]
    return np.concatenate(parts) if parts else np.zeros(0)


def widths(surface, point, cutter, table, pallets, steps, scallop=SCALLOP):
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
    out[ok] = step_over(N[ok], T[ok], D[ok], K[ok], cutter.rho, cutter.corner_radius, scallop)
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


def reach(surface, cutter):
    """By table angle which of the contact points (a, b) a cutter reaches."""
    out = {}
    for table in TABLES.tolist():
        found = valid_ranges(surface.scene, cutter, math.radians(table), workers=2).ranges
        out[table] = np.array([len(rows) > 0 for rows in found]).reshape(surface.shape)
    return out


def largest(surface):
    """The largest cutter for all of a side, its table angle, and how many points the next size misses at its best."""
    sizes = [(d, reach(surface, CatalogueCutter(d, CORNER))) for d in SIZES.tolist()]
    whole = [(d, table) for d, found in sizes for table, at in found.items() if at.all()]
    diameter = max(whole)[0]
    table = min(t for d, t in whole if d == diameter)
    missed = min(int((~at).sum()) for d, found in sizes if d == diameter + 2.0 for at in found.values())
    return diameter, table, missed


def two_patches(surface, diameter, larger):
    """The longest run of strips of u for a larger cutter at one table angle, the rest for the largest of all.

    Returns
    -------
    (strips, table angle, path [mm]) of the larger cutter at the scallop WIDE, then (strips, table angle, path) of the
    other one at NARROW; paths at the widest step-over of valid pallet angles.
    """
    wide = CatalogueCutter(larger, CORNER)
    best = (0, 0, 0.0)
    for table, at in reach(surface, wide).items():
        edge = np.flatnonzero(np.diff(np.concatenate([[0], at.all(axis=1).astype(int), [0]])))
        best = max([best, *((int(b - a), -int(a), table) for a, b in zip(edge[::2], edge[1::2], strict=True))])
    count, first, table = best[0], -best[1], best[2]
    strips = np.zeros(surface.shape[0], dtype=bool)
    strips[first : first + count] = True
    narrow = CatalogueCutter(diameter, CORNER)
    angle = max(t for t, at in reach(surface, narrow).items() if at.all())
    rows = ((wide, table, strips, WIDE), (narrow, angle, ~strips, NARROW))
    return tuple((np.flatnonzero(own), t, path(surface, own, cutter, t, h)) for cutter, t, own, h in rows)


def path(surface, strips, cutter, table, scallop):
    """Path [mm] on strips of u at the widest step-over of valid pallet angles, steps along the blade."""
    points = np.flatnonzero(np.repeat(strips, surface.shape[1]))
    found = valid_ranges(surface.scene, cutter, math.radians(table), points=points, workers=2).ranges
    total = 0.0
    for k, ranges in zip(points.tolist(), found, strict=True):
        w = widths(surface, k, cutter, math.radians(table), valid_angles(ranges), "along", scallop)
        total += surface.area[k] / w.max()
    return float(total)


def contact_points(surface):
    """Largest cutter and its widest range of B [deg] of the contact points of one grid line, by table angle."""
    points = LINE + surface.shape[1] * np.arange(surface.shape[0])
    out = {}
    for table in SHOWN:
        answer = largest_cutters(surface.scene, catalogue_named("wu2019"), math.radians(table), 0.0, workers=2)
        rows = []
        for k in points.tolist():
            cutter = answer.catalogue.cutters[answer.cutter[k]] if answer.cutter[k] >= 0 else None
            spans = np.degrees(answer.ranges[k])
            span = spans[(spans[:, 1] - spans[:, 0]).argmax()] if len(spans) else None
            rows.append((cutter, span))
        out[table] = rows
    return out


def patch_tables(sides):
    """The tables of cutters, patches and contact points of docs/papers.md."""
    lines = ["| | source | " + " | ".join(f"{side} side here" for side in sides) + " |", "|---|---|---|---|"]
    found = {side: largest(surface) for side, surface in sides.items()}
    rows = {
        "largest for all of it": ["D 20 at 45 deg", *(f"D {d:g} at {t:g} deg" for d, t, _ in found.values())],
        "one size more, at its best table angle": [
            "D 22 gouges",
            *(f"D {d + 2:g} gouges at {n} of 100 points" for d, _, n in found.values()),
        ],
    }
    parts = [two_patches(surface, found[side][0], found[side][0] + 4.0) for side, surface in sides.items()]
    for k, (name, cusp, source) in enumerate((("wide", WIDE, "D 22"), ("narrow", NARROW, "D 20"))):
        cells = []
        for (side, surface), both in zip(sides.items(), parts, strict=True):
            strips, table, length = both[k]
            d = found[side][0] + (4.0 if k == 0 else 0.0)
            if len(strips):
                u = surface.u[strips]
                cells.append(f"D {d:g} at {table:g} deg, u {u.min():.2f} to {u.max():.2f}, {length:.0f} mm")
            else:
                cells.append("none")
        rows[f"{name} patch, cusp {cusp:g} mm"] = [source, *cells]
    lines += [f"| {name} | " + " | ".join(cells) + " |" for name, cells in rows.items()]
    surface = sides["plus"]
    points = contact_points(surface)
    lines += ["", "| u | " + " | ".join(f"{t:g} deg: D, r [mm]; B [deg]" for t in SHOWN) + " |", "|---:|---|---|---|"]
    for k, u in enumerate(surface.u.tolist()):
        cells = []
        for table in SHOWN:
            cutter, span = points[table][k]
            cells.append(
                "not reached" if cutter is None
                else f"{cutter.diameter:g}, {cutter.corner_radius:g}; {span[0]:.1f} to {span[1]:.1f}"
            )  # fmt: skip
        lines.append(f"| {u:.2f} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


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
    blade = surfaces()
    result = paths(blade)
    (given.out / "wu2019_paths.svg").write_text(picture(result))
    print(tables(result))
    print(patch_tables(blade))
    for where, (share, best, worst) in result.items():
        print(*where, f"{share:.3f} {best:.0f} {worst:.0f}")
