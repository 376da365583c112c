"""The engine of moves: moves a second, error against a converged setting, and against the layers.

    python benchmarks/engines.py [--moves 20000] [--job 1000000] [--check]

Programs: finishing by a ball nose over a wave (``benchmarks/simulation.py``), roughing by a flat mill in levels of
2 mm, rows 3 mm apart, moves of 1 mm. Times are processor seconds of the calling process without compiling, the median
of three; "geometry" is the contact alone, "loads" with forces, torque, power and their bands of every move, "their
error" with energy balance and resolution error of the run. Errors are those of a move's volume and loads against slices
eight times as many, percentiles over the moves that cut more than a fifth of the median.
``--job`` adds the finishing program as a job of the command line: reading, stress, deflection, report and all; goals
are those of 10^6 moves by their number. The table has goal, value and share of the goal; ``--check`` exits 1 where one
is missed by more than 20 %.
"""

from __future__ import annotations

import argparse
import math
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

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
#: energy balance: sum of the chips against the converged one [%]
VOLUME = 0.2
#: slices of a corner of a job that states none
SLICES = 24


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
        stock.take(a, b, np.ones(len(a), dtype=np.int64), corner_pieces=SLICES // 2, flank_mm={1: 0.5 * cutter.radius})
    return time.process_time() - begun


#: a finishing program as NC text, and the job that runs it
WORDS = ("G21 G90 G17 G94", "T1 M6", "S9549 M3", "G0 X0 Y0 Z20", "G0 Z5", "G1 Z-1.5 F400", "F1200")
JOB = """[program]
file = "wave.ngc"
[machine]
name = "vmc"
[stock]
low_mm = [-6.0, -6.0, -8.0]
high_mm = [106.0, {high:.3f}, 0.0]
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = 8.0
corner_radius_mm = 4.0
flutes = 2
helix_deg = 30.0
flute_length_mm = 20.0
overhang_mm = 35.0
modulus_gpa = 600.0
[[operation]]
kind = "simulate"
step_mm = 1.0
engine = "moves"
[limits]
force_n = 1500.0
"""


def command_line(moves: int) -> tuple[float, float]:
    """Processor seconds and peak memory [MB] of ``chipload run`` of a finishing program: reading, checks, report."""
    program = finishing(moves)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        rows = [f"X{x:.3f} Y{y:.3f} Z{z:.4f}" for x, y, z in program.p_work[1:].tolist()]
        (place / "wave.ngc").write_text("\n".join([*WORDS, *rows, "G0 Z20", "M30", ""]))
        (place / "job.toml").write_text(JOB.format(high=float(program.p_work[:, 1].max()) + 6.0))
        words = ["-m", "chipload", "run", str(place / "job.toml"), "--out", str(place / "result")]
        subprocess.run([sys.executable, *words], check=True, capture_output=True)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0


def p_of(some: Floats, known: Floats) -> list[float]:
    """p50, p95, p99 [%] of the moves that count."""
    big = known > 0.2 * np.median(known[known > 0.0])
    return [float(p) for p in np.percentile(100.0 * np.abs(some[big] / known[big] - 1.0), [50, 95, 99])]


def row(work: str, goal: float, found: float, unit: str, least: bool) -> tuple[str, bool]:
    """A row of the table, and whether the goal is missed by more than 20 %; ``least``: the goal is the least value."""
    share = found / goal if least else goal / found
    return f"| {work} | {goal:,.4g} {unit} | {found:,.4g} {unit} | {share:.2f} |", share < (0.8 if least else 1.0 / 1.2)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moves", type=int, default=20_000)
    parser.add_argument("--few", type=int, default=4000, help="moves of the converged setting")
    parser.add_argument("--job", type=int, default=0, help="moves of a job by the command line, as 1000000")
    parser.add_argument("--check", action="store_true")
    args = parser.parse_args()
    table, errors = [], []
    for name, (rate, worst) in GOALS.items():
        _, cutter, _, _ = case(name, 10)
        flank = 0.5 * cutter.radius
        simulated(name, 300, SLICES, flank)
        each = statistics.median(simulated(name, args.moves, SLICES, flank)[0] for _ in range(3))
        alone = statistics.median(geometry(name, args.moves) for _ in range(3))
        stated = statistics.median(simulated(name, args.moves, SLICES, flank, accuracy=True)[0] for _ in range(3))
        some = simulated(name, args.few, SLICES, flank)[1]
        known = simulated(name, args.few, 8 * SLICES, cutter.radius / 16.0)[1]
        force = max(p_of(some["force_n"], known["force_n"])[2], 1e-3)
        table.append(row(f"{name}, {args.moves} moves with loads", rate, args.moves / each, "/s", True))
        table.append(row(f"{name}, p99 of the peak force", worst, force, "%", False))
        print(f"{name}: geometry {args.moves / alone:.0f}/s, with the error of the run {args.moves / stated:.0f}/s")
        for column in ("chip_volume_mm3", "force_n", "torque_nm", "torque_mean_nm", "chip_max_mm"):
            p = " | ".join(f"{v:.2f}" for v in p_of(some[column], known[column]))
            errors.append(f"| {name} | {column} | {p} |")
        total = abs(some["chip_volume_mm3"].sum() / known["chip_volume_mm3"].sum() - 1.0)
        table.append(row(f"{name}, sum of the chips", VOLUME, max(100.0 * total, 1e-4), "%", False))
    if args.job:
        seconds, used = command_line(args.job)
        share = args.job / 1e6
        table.append(row(f"job of {args.job} moves by the command line", MILLION_S * share, seconds, "s", False))
        table.append(row("its memory", MILLION_MB, used, "MB", False))
    print("\n| work | goal | measured | share of the goal |\n|---|---|---|---|")
    print("\n".join(line for line, _ in table))
    print("\n| program | column | p50 [%] | p95 [%] | p99 [%] |\n|---|---|---|---|---|")
    print("\n".join(errors))
    if args.check and any(missed for _, missed in table):
        sys.exit(1)


if __name__ == "__main__":
    main()
