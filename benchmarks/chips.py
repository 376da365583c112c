"""Covered areas a second against other methods, cost against size, and 10,000 five-axis points with forces.

    python benchmarks/chips.py [--points 10000] [--out FOLDER]

Notation: a covered area is what one move covers of one layer. Its relative error is held against the boundary at a
tolerance of 1e-6 mm. Every method gets the coarsest resolution of its ladder whose mean error over all moves is at
most 1e-4; where it has two resolutions, the fastest pair of a grid that reaches it. The axis leans by up to 25 degrees.
Short moves are 1 to 6 mm long and turn by up to 6 degrees, long ones 10 to 30 mm and by 10 to 30 degrees.

* dense union: polygons of the section (ellipses of a flank, circles of a ball, in closed form) at even instants,
  joined by shapely;
* dexels: rays along x in the layer's plane, which is the best that dexels do for one area.

Times are processor seconds of all threads of this process, so that other work on the computer matters less; the 10,000
points are also timed by the clock. ``--out`` writes ``chips.html`` with the figure of the costs.
"""

from __future__ import annotations

import argparse
import cProfile
import io
import itertools
import math
import pstats
import time
from pathlib import Path

import numpy as np
import shapely

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import slices
from chipload.cutting.material import material_named
from chipload.engagement.chips.covered import covered_areas
from chipload.engagement.chips.move import Move
from chipload.program.program import LINE, RAPID, Program
from chipload.simulation.chips import remove
from chipload.simulation.removal import Resolution
from chipload.stock.dexel import TriDexel
from chipload.stock.layers import LayeredStock

FLAT = Cutter(10.0, 4, 0.5, 60.0, 80.0, 6e5)
BALL = Cutter(10.0, 2, 0.5, 25.0, 40.0, 6e5, corner_radius=5.0)
ERROR = 1e-4
TIMES = 3
#: resolutions that are tried
INSTANTS, SIDES = (8, 12, 16, 24, 32, 48, 64, 96, 128, 192), (64, 128, 192, 256, 320, 384)
PITCHES, MISSES = (0.1, 0.07, 0.05, 0.035, 0.025, 0.015), (3e-2, 1e-2, 3e-3, 1e-3, 3e-4)


def clock(work, times: int = TIMES) -> float:
    """Least processor time [s] of some runs."""
    best = math.inf
    for _ in range(times):
        begun = time.process_time()
        work()
        best = min(best, time.process_time() - begun)
    return best


def some_moves(n: int, kind: str = "short") -> list[tuple[Cutter, Move, float]]:
    """Moves with a layer that meets only the flank of a flat end mill, or only the ball."""
    rng = np.random.default_rng(2017)
    out = []
    lengths, turns = ((1.0, 6.0), (0.5, 6.0)) if kind == "short" else ((10.0, 30.0), (10.0, 30.0))
    for k in range(n):
        lean, way = rng.uniform(0.05, 0.43), rng.uniform(0.0, math.tau)
        a = np.array([math.sin(lean) * math.cos(way), math.sin(lean) * math.sin(way), math.cos(lean)])
        toward = np.cross(a, np.append(rng.normal(size=2), 0.0))
        turn = math.radians(rng.uniform(*turns))
        b = math.cos(turn) * a + math.sin(turn) * toward / np.linalg.norm(toward)
        p = np.zeros(3)
        q = rng.uniform(*lengths) * np.array([math.cos(k), math.sin(k), rng.uniform(-0.03, 0.03)])
        if k % 2:
            out.append((FLAT, Move.slerp(p, a, q, b), float(rng.uniform(9.0, 30.0))))
        else:
            out.append((BALL, Move.slerp(p - 5.0 * a, a, q - 5.0 * b, b), float(rng.uniform(-3.5, -2.6))))
    return out


def dense(cutter: Cutter, move: Move, height: float, instants: int, sides: int) -> float:
    """Area of the union of sections in closed form."""
    p, axis = move.at(np.linspace(0.0, 1.0, instants))
    theta = np.arange(sides) * (math.tau / sides)
    c = np.stack([np.cos(theta), np.sin(theta)], axis=1)
    if cutter is BALL:
        low = p + 5.0 * axis
        rho = np.sqrt(25.0 - (height - low[:, 2]) ** 2)
        points = low[:, None, :2] + rho[:, None, None] * c
    else:
        a, z = axis[:, :2], axis[:, 2]
        centre = p[:, :2] + a * ((height - p[:, 2]) / z)[:, None]
        along = (c @ a[:, :, None])[..., 0] / (z * (1.0 + z))[:, None]
        points = centre[:, None] + cutter.radius * (c + along[..., None] * a[:, None])
    return float(shapely.union_all(shapely.polygons(points)).area)


def rays(cutter: Cutter, move: Move, height: float, box: tuple[float, ...], pitch: float, error: float) -> float:
    """Area by dexels along x in the plane of the layer."""
    x0, y0, x1, y1 = box
    thin = 0.5 * pitch
    stock = TriDexel.block((x0, y0, height - thin), (x1, y1, height + thin), pitch, "x")
    (p, q), (a, b) = move.at([0.0, 1.0])
    before = stock.volume()
    stock.remove_move(p, a, q, b, cutter.apt, error_mm=error)
    return (before - stock.volume()) / (2.0 * thin)


def rates(kind: str) -> None:
    """Areas a second by each method, all at the same error."""
    moves = some_moves(60, kind)
    fine = [covered_areas(m, c, [h], 1e-6)[0] for c, m, h in moves]
    exact = np.array([a.area for a in fine])
    boxes = [tuple(np.add(a.polygon.bounds, (-0.01, -0.01, 0.01, 0.01))) for a in fine]
    print(f"{len(moves)} {kind} moves, {sum(a.simple for a in fine)} of one loop; mean |error| at most {ERROR:g}")

    def error(found: list[float]) -> float:
        return float(np.abs(np.array(found) / exact - 1.0).mean())

    def boundary(tolerance: float) -> list[float]:
        return [covered_areas(m, c, [h], tolerance)[0].area for c, m, h in moves]

    def polygons(tolerance: float) -> list[float]:
        return [covered_areas(m, c, [h], tolerance)[0].polygon.area for c, m, h in moves]

    def union(n: int, sides: int) -> list[float]:
        return [dense(c, m, h, n, sides) for c, m, h in moves]

    def dexels(pitch: float, miss: float) -> list[float]:
        return [rays(c, m, h, box, pitch, miss) for (c, m, h), box in zip(moves, boxes, strict=True)]

    ladders = {
        "boundary, area in curves": (boundary, [(t,) for t in (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)]),
        "boundary, polygon": (polygons, [(t,) for t in (0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002)]),
        "dense union": (union, list(itertools.product(INSTANTS, SIDES))),
        "dexels": (dexels, list(itertools.product(PITCHES, MISSES))),
    }
    found = {}
    for name, (method, ladder) in ladders.items():
        method(*ladder[0])
        best = (math.inf, (), 0.0)
        for setting in ladder:
            begun = time.process_time()
            miss = error(method(*setting))
            spent = time.process_time() - begun
            if miss <= ERROR and spent < best[0]:
                best = (spent, setting, miss)
        if not best[1]:
            print(f"  {name:26s} none of its resolutions reaches {ERROR:g}")
            continue
        seconds = clock(lambda m=method, s=best[1]: m(*s))
        found[name] = len(moves) / seconds
        print(f"  {name:26s} {found[name]:9.0f} areas/s   error {best[2]:.2e}   at {best[1]}")
    for mine, other in itertools.product(list(ladders)[:2], list(ladders)[2:]):
        if mine in found and other in found:
            print(f"  {mine} / {other}: {found[mine] / found[other]:.1f}")


def line(x: np.ndarray, y: np.ndarray) -> str:
    """The straight line a + b x through the points and how much of their scatter it holds."""
    b, a = np.polyfit(x, y, 1)
    rest = ((y - a - b * x) ** 2).sum() / ((y - y.mean()) ** 2).sum()
    return f"{a:.3g} s + {1e3 * b:.3g} ms each, R2 = {1.0 - rest:.4f}"


def wavy(points: int) -> Program:
    """Rows of a ball nose over a wavy surface, lead and lean changing along the way."""
    per_row = 200
    n = max(points // per_row, 1)
    x = np.linspace(5.0, 105.0, per_row)
    rows = []
    for j in range(n):
        row = np.column_stack([x if j % 2 == 0 else x[::-1], np.full(per_row, 5.0 + j)])
        rows.append(row)
    xy = np.concatenate(rows)
    z = -2.5 + 0.8 * np.sin(xy[:, 0] / 9.0) * np.cos(xy[:, 1] / 8.0)
    dx = 0.8 / 9.0 * np.cos(xy[:, 0] / 9.0) * np.cos(xy[:, 1] / 8.0)
    dy = -0.8 / 8.0 * np.sin(xy[:, 0] / 9.0) * np.sin(xy[:, 1] / 8.0)
    normal = np.column_stack([-dx, -dy, np.ones(len(xy))])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    ahead = np.repeat(np.where(np.arange(n) % 2 == 0, 1.0, -1.0), per_row)
    lead = np.radians(12.0 + 5.0 * np.sin(xy[:, 0] / 15.0)) * ahead
    lean = np.radians(8.0 * np.sin(xy[:, 0] / 20.0 + xy[:, 1] / 10.0))
    axis = normal + np.column_stack([np.tan(lead), np.tan(lean), 0.0 * lead])
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    p = np.column_stack([xy, z]) + 5.0 * (normal - axis)
    m = len(p)
    return Program(
        motion=np.array([RAPID] + [LINE] * (m - 1)), p_work=p, axis=axis, centre=np.zeros((m, 3)),
        normal=np.tile([0.0, 0.0, 1.0], (m, 1)), turns=np.zeros(m, dtype=int), feed=np.array([0.0] + [20.0] * (m - 1)),
        spindle=np.full(m, 800.0), tool=np.ones(m, dtype=int), line=np.arange(m), label=np.zeros(m, dtype=int),
        labels=("finish",),
    )  # fmt: skip


def finishing(points: int, layer: float = 0.3, corner: int = 16, at: list | None = None) -> tuple[float, float, object]:
    """Clock and processor seconds of a program through a block, and what came out."""
    program = wavy(points)
    high = 10.0 + max(points // 200, 1)
    stock = LayeredStock.block((0.0, 0.0, -8.0), (110.0, high, 0.0), layer, 20.0)
    resolution = Resolution(1.0, 5e-3, corner, 2.0, math.radians(3.0))
    wall, own = time.perf_counter(), time.process_time()

    def note(share: float, _: str) -> None:
        if at is not None:
            at.append((share, time.process_time() - own))

    removal = remove(program, stock, {1: BALL}, material_named("al7075-t6"), resolution, progress=note)
    return time.perf_counter() - wall, time.process_time() - own, removal


def costs(at: list[tuple[float, float]], steps: int) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Processor seconds against layers, cutter samples and moves."""
    out = {}
    many = [m for m in some_moves(40) if m[0] is FLAT]
    counts = np.array([1, 2, 4, 8, 16, 32, 64, 128])
    spent = [
        clock(lambda n=n: [covered_areas(m, c, np.linspace(9.0, 30.0, n), 1e-2) for c, m, _ in many]) for n in counts
    ]
    out["layers (areas of 20 moves)"] = counts, np.array(spent)
    pieces = np.array([16, 32, 64, 128, 256, 512])
    out["slices of the cutter (400 points, with forces)"] = (
        np.array([len(slices(BALL, corner_slices=int(k), flank_mm=2.0)) for k in pieces]),
        np.array([min(finishing(400, 0.3, int(k))[1] for _ in range(2)) for k in pieces]),
    )
    thick = np.array([1.2, 0.6, 0.3, 0.15, 0.075])
    out["layers of the stock (400 points, with forces)"] = (
        8.0 / thick,
        np.array([min(finishing(400, float(dz))[1] for _ in range(2)) for dz in thick]),
    )
    share, seconds = np.array([row for row in at if row[0] > 0.0]).T
    out["moves (with forces)"] = share * steps, seconds
    return out


def figure(cost: dict[str, tuple[np.ndarray, np.ndarray]]):
    import plotly.graph_objects as go

    fig = go.Figure()
    for name, (x, y) in cost.items():
        fig.add_trace(go.Scatter(x=x, y=y, mode="lines+markers", name=f"{name}: {line(x, y)}"))
    fig.update_xaxes(type="log", title="number")
    fig.update_yaxes(type="log", title="processor time [s]")
    fig.update_layout(title="Cost of chips")
    return fig


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=10_000)
    parser.add_argument("--out", type=Path, help="folder for chips.html")
    args = parser.parse_args()
    finishing(400)
    rates("short")
    rates("long")
    at: list[tuple[float, float]] = []
    wall, own, removal = finishing(args.points, at=at)
    c = removal.columns
    n = len(c["x_mm"])
    print(f"{args.points} five-axis points, {n} steps, {c['chip_layers'].mean():.1f} layers cut a step, with forces:")
    print(f"  {wall:.1f} s by the clock, {own:.1f} s of processors, {1e3 * own / n:.2f} ms a step")
    print(f"  removed {c['chip_volume_mm3'].sum():.1f} mm3; greatest force {c['force_n'].max():.1f} N")
    print("cost:")
    cost = costs(at, n)
    for name, (x, y) in cost.items():
        rows = "  ".join(f"{a:.0f}: {b:.3g}" for a, b in zip(x, y, strict=True))
        print(f"  {name}: {line(x, y)}\n    {rows}")
    profile = cProfile.Profile()
    profile.enable()
    finishing(1000)
    profile.disable()
    text = io.StringIO()
    pstats.Stats(profile, stream=text).sort_stats("tottime").print_stats(14)
    print("profile of 1000 points, own time in the thread that removes; at a lock it waits for the one that covers:")
    for row in text.getvalue().splitlines():
        parts = row.split(None, 5)
        if len(parts) == 6 and parts[1].replace(".", "").isdigit():
            print(f"  {parts[1]:>8} s  {parts[0]:>8} calls  {'/'.join(parts[5].split('/')[-2:])}")
    if args.out is not None:
        args.out.mkdir(parents=True, exist_ok=True)
        figure(cost).write_html(args.out / "chips.html", include_plotlyjs=True)


if __name__ == "__main__":
    main()
