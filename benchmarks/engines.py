"""The engine of moves: moves a second, error against a converged setting, and against the layers.

    python benchmarks/engines.py [--moves 20000] [--million] [--check]

Programs: finishing by a ball nose over a wave (``benchmarks/simulation.py``), roughing by a flat mill in levels of
2 mm, rows 3 mm apart, moves of 1 mm. Times are processor seconds of the calling process without compiling, the median
of three; "geometry" is the contact alone, "loads" with forces, torque, power and their bands of every move, "their
error" with energy balance and resolution error of the run. Errors are those of a move's volume and loads against slices
eight times as many, percentiles over the moves that cut more than a fifth of the median.
``--million`` adds 10^6 moves of the finishing program with the peak memory; ``--check`` exits 1 where a goal is missed
by more than 20 %.
"""

from __future__ import annotations

import argparse
import math
import resource
import statistics
import sys
import time

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.engagement.moves.stock import MoveStock
from chipload.program.program import LINE, RAPID, Program
from chipload.simulation.chips import remove
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock
from simulation import BALL, finishing

Floats = NDArray[np.float64]
FLAT = Cutter(10.0, 3, math.radians(30.0), 25.0, 40.0, 6e5)
ALLOY = material_named("al7075-t6")
#: goals: moves a second with loads, p99 of the greatest force [%], seconds of 10^6 moves, memory [MB]
GOALS = {"finishing": (20_000.0, 3.0), "roughing": (40_000.0, 2.0)}
MILLION_S, MILLION_MB = 120.0, 1000.0


def roughing(moves: int) -> Program:
    """Levels of 2 mm in rows there and back over a block of 120 x 60 mm."""
    rows, along = 21, 134
    k = np.arange(moves + 1)
    at, row, level = k % along, k // along % rows, k // (along * rows)
    x = -7.0 + np.where((k // along) % 2 == 0, at, along - 1 - at)
    y = np.where(level % 2 == 0, 3.0 * row, 3.0 * (rows - 1 - row))
    z = -2.0 * (level + 1.0)
    n = len(k)
    motion = np.full(n, LINE)
    motion[0] = RAPID
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    return Program(
        motion=motion, p_work=np.column_stack([x, y, z]), axis=up, centre=np.zeros((n, 3)), normal=up,
        turns=np.zeros(n, dtype=int), feed=np.where(motion == RAPID, 0.0, 20.0), spindle=np.full(n, 1000.0),
        tool=np.ones(n, dtype=int), line=k + 1, label=np.zeros(n, dtype=int), labels=("rough",),
    )  # fmt: skip


def case(name: str, moves: int) -> tuple[Program, Cutter, tuple[float, ...], tuple[float, ...]]:
    """Program, cutter and corners of the block."""
    if name == "finishing":
        program = finishing(moves)
        return program, BALL, (-6.0, -6.0, -8.0), (106.0, float(program.p_work[:, 1].max()) + 6.0, 0.0)
    deep = 2.0 * (moves // (134 * 21) + 1) + 1.0
    return roughing(moves), FLAT, (0.0, 0.0, -deep), (120.0, 60.0, 0.0)


def simulated(
    name: str, moves: int, pieces: int, flank: float, accuracy: bool = False
) -> tuple[float, dict[str, NDArray[np.generic]]]:
    """Processor seconds and columns."""
    program, cutter, low, high = case(name, moves)
    stock = LayeredStock.block(low, high, 2.0, 32.0)
    fine = Resolution(step_mm=3.0, tolerance=1e-3, corner_pieces=pieces, flank_mm=flank)
    begun = time.process_time()
    removal = remove(program, stock, {1: cutter}, ALLOY, fine, engine="moves", accuracy=accuracy)
    return time.process_time() - begun, dict(removal.columns)


def geometry(name: str, moves: int) -> float:
    """Processor seconds of the contact alone."""
    program, cutter, low, high = case(name, moves)
    stock = MoveStock(np.array(low), np.array(high), {1: cutter})
    p = np.asarray(program.p_work)
    begun = time.process_time()
    for at in range(0, moves, 512):
        a, b = p[at : min(at + 512, moves)], p[at + 1 : min(at + 512, moves) + 1]
        stock.take(a, b, np.ones(len(a), dtype=np.int64), corner_pieces=12, flank_mm={1: 0.5 * cutter.radius})
    return time.process_time() - begun


def errors(some: Floats, known: Floats) -> str:
    """p50, p95, p99 [%] of the moves that count."""
    big = known > 0.2 * np.median(known[known > 0.0])
    off = 100.0 * np.abs(some[big] / known[big] - 1.0)
    return " / ".join(f"{p:.2f}" for p in np.percentile(off, [50, 95, 99]))


def p99(some: Floats, known: Floats) -> float:
    big = known > 0.2 * np.median(known[known > 0.0])
    return float(np.percentile(100.0 * np.abs(some[big] / known[big] - 1.0), 99))


def million() -> list[str]:
    begun = time.process_time()
    seconds, _ = simulated("finishing", 1_000_000, 24, 2.0)
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(f"finishing, 1000000 moves: {seconds:.1f} s, peak {used:.0f} MB (all {time.process_time() - begun:.1f} s)")
    late = [f"10^6 moves take {seconds:.0f} s"] if seconds > 1.2 * MILLION_S else []
    return late + ([f"10^6 moves take {used:.0f} MB"] if used > 1.2 * MILLION_MB else [])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moves", type=int, default=20_000)
    parser.add_argument("--few", type=int, default=4000, help="moves of the converged setting")
    parser.add_argument("--million", action="store_true")
    parser.add_argument("--check", action="store_true")
    args = parser.parse_args()
    missed = []
    for name, (rate, worst) in GOALS.items():
        _, cutter, _, _ = case(name, 10)
        simulated(name, 300, 24, 0.5 * cutter.radius)
        each = statistics.median(simulated(name, args.moves, 24, 0.5 * cutter.radius)[0] for _ in range(3))
        alone = statistics.median(geometry(name, args.moves) for _ in range(3))
        stated = statistics.median(
            simulated(name, args.moves, 24, 0.5 * cutter.radius, accuracy=True)[0] for _ in range(3)
        )
        some = simulated(name, args.few, 24, 0.5 * cutter.radius)[1]
        known = simulated(name, args.few, 192, cutter.radius / 16.0)[1]
        print(
            f"{name}, {args.moves} moves: {args.moves / stated:.0f} moves/s with loads and their error, "
            f"{args.moves / each:.0f} with loads, {args.moves / alone:.0f} geometry"
        )
        for column in ("chip_volume_mm3", "force_n", "torque_nm", "torque_mean_nm", "chip_max_mm"):
            print(f"  {column}: p50 / p95 / p99 {errors(some[column], known[column])} %")
        total = some["chip_volume_mm3"].sum() / known["chip_volume_mm3"].sum() - 1.0
        print(f"  sum of the chips against the converged: {100.0 * total:+.3f} %")
        if args.moves / each < 0.8 * rate:
            missed.append(f"{name}: {args.moves / each:.0f} moves/s, goal {rate:.0f}")
        if p99(some["force_n"], known["force_n"]) > 1.2 * worst:
            missed.append(f"{name}: p99 of the force above {worst:g} %")
    if args.million:
        missed += million()
    for line in missed:
        print(f"missed: {line}")
    if args.check and missed:
        sys.exit(1)


if __name__ == "__main__":
    main()
