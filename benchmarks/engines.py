"""The moves: steps a second, error against a converged setting, beside another simulator.

    python benchmarks/engines.py [--moves 20000] [--job 1000000] [--real 1500] [--planned FOLDER] [--others] [--fresh]
                                 [--check] [--write]

Programs: finishing by a ball nose over a wave (``benchmarks/simulation.py``), roughing by a flat mill in levels of
2 mm, rows 3 mm apart, moves of 1 mm, and those of ``benchmarks/engine_programs.py``: bear and cameo of CAMotics, the
boat of LinuxCNC, the contour, the pocket and a roughing of the impeller of the examples. Times are processor seconds
of the calling process without compiling, the median of three; "geometry" is the contact alone, "loads" with forces,
torque, power and their bands of every move, "their error" with energy balance and resolution error of the run. Errors
are those of a move's volume and loads against slices eight times as many, percentiles over the moves that cut more
than a fifth of the median; of the programs of others, what layers differ by from moves, step by step.
``--job`` adds the finishing program as a job of the command line: reading, stress, deflection, report and all; goals
are those of 10^6 moves by their number. ``--real`` takes so many rows of each other program, 0 leaves them out.
``--others`` adds pockets beside Adaptive and the feeds example, ``--fresh`` a clone up to its
first verdict (``benchmarks/engine_goals.py``). The table has goal, value and share of the goal, and says which goals
are missed and which were not measured; ``--check`` exits 1 where one is missed by more than 20 %, ``--write`` puts the
tables into docs/design/engines.md.
"""

from __future__ import annotations

import argparse
import itertools
import math
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from engine_goals import goals
from engine_programs import Case, head, made, of_examples, of_others
from numpy.typing import NDArray
from simulators import freecad

from chipload.cutting.material import material_named
from chipload.engagement.moves.stock import MoveStock
from chipload.simulation.chips import remove
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]
ALLOY = material_named("al7075-t6")
#: goals: moves a second with loads, p99 of the greatest force [%], seconds of 10^6 moves, memory [MB]
GOALS = {"finishing": (20_000.0, 3.0), "roughing": (40_000.0, 2.0)}
MILLION_S, MILLION_MB = 120.0, 1000.0
#: steps a second of the boat in five axes; moves over PathSim
BOAT, PEER = 3000.0, 5.0
#: energy balance: sum of the chips against the converged one [%]
VOLUME = 0.2
#: slices of a corner of a job that states none
SLICES = 24
#: what is compared, and between which lines of the design note the tables stand
COLUMNS = ("chip_volume_mm3", "force_n", "torque_nm", "torque_mean_nm", "chip_max_mm")
NOTE = Path(__file__).parents[1] / "docs" / "design" / "engines.md"
BEGIN, END = "<!-- benchmarks/engines.py --write -->", "<!-- end -->"


def simulated(
    name: str, moves: int, pieces: int, flank: float, accuracy: bool = False
) -> tuple[float, dict[str, NDArray[np.generic]]]:
    """Processor seconds and columns."""
    case = made(name, moves)
    stock = LayeredStock.block(case.low, case.high, 2.0, 32.0)
    fine = Resolution(step_mm=3.0, tolerance=1e-3, corner_slices=pieces, flank_mm=flank)
    begun = time.process_time()
    removal = remove(case.program, stock, case.cutters, ALLOY, fine, accuracy=accuracy)
    return time.process_time() - begun, dict(removal.columns)


def geometry(name: str, moves: int) -> float:
    """Processor seconds of the contact alone."""
    case = made(name, moves)
    stock, cutter = MoveStock(np.array(case.low), np.array(case.high), case.cutters), case.cutters[1]
    p = np.asarray(case.program.p_work)
    begun = time.process_time()
    for at in range(0, moves, 512):
        a, b = p[at : min(at + 512, moves)], p[at + 1 : min(at + 512, moves) + 1]
        stock.take(a, b, np.ones(len(a), dtype=np.int64), corner_slices=SLICES // 2, flank_mm={1: 0.5 * cutter.radius})
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
[limits]
force_n = 1500.0
"""


def command_line(moves: int) -> tuple[float, float]:
    """Processor seconds and peak memory [MB] of ``chipload run`` of a finishing program: reading, checks, report."""
    program = made("finishing", moves).program
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        rows = [f"X{x:.3f} Y{y:.3f} Z{z:.4f}" for x, y, z in program.p_work[1:].tolist()]
        (place / "wave.ngc").write_text("\n".join([*WORDS, *rows, "G0 Z20", "M30", ""]))
        (place / "job.toml").write_text(JOB.format(high=float(program.p_work[:, 1].max()) + 6.0))
        words = ["-m", "chipload", "run", str(place / "job.toml"), "--out", str(place / "result")]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)  # examples may have been planned
        done = subprocess.run([sys.executable, *words], capture_output=True, text=True)
        if done.returncode not in (0, 3):  # long programs leave the travel of the machine: exceeds
            raise RuntimeError(done.stderr)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime - before.ru_utime - before.ru_stime, used.ru_maxrss / 1024.0


def rate_of(case: Case) -> float:
    """Steps a second."""
    smallest = min(c.radius for c in case.cutters.values())
    fine = Resolution(case.step_mm, 0.01, SLICES // 2, 0.5 * smallest)
    stock = LayeredStock.block(case.low, case.high, case.layer_mm, 4.0 * smallest)
    remove(head(case.program, 12), stock.copied(), case.cutters, ALLOY, fine, accuracy=False)
    begun = time.process_time()
    removal = remove(case.program, stock, case.cutters, ALLOY, fine, accuracy=False)
    return len(removal.columns["line"]) / (time.process_time() - begun)


def beside_pathsim(moves: int) -> tuple[float, float] | None:
    """Processor seconds of the finishing program by moves with loads, over those of FreeCAD's PathSim, geometry alone,
    with a pitch of 0.2 mm; and of ours. None: there is no FreeCAD.
    """
    case = made("finishing", moves)
    peer = freecad(case.program.p_work, np.array(case.low), np.array(case.high), case.cutters[1], 0.2)
    if peer is None:
        return None
    own = simulated("finishing", moves, SLICES, 2.0)[0]
    return own / peer[0], own


def p_of(some: Floats, known: Floats) -> list[float]:
    """p50, p95, p99 [%] of the moves that count."""
    cuts = known > 0.0
    big = known > 0.2 * float(np.median(known[cuts])) if cuts.any() else cuts
    if not big.any():
        return [math.nan] * 3
    return [float(p) for p in np.percentile(100.0 * np.abs(some[big] / known[big] - 1.0), [50, 95, 99])]


def row(work: str, goal: float, found: float, unit: str, least: bool) -> tuple[str, bool]:
    """A row of the table, and whether the goal is missed by more than 20 %; ``least``: the goal is the least value;
    where ``found`` is nan it was not measured.
    """
    if math.isnan(found):
        return f"| {work} | {goal:,.4g} {unit} | not measured | | |", False
    share = found / goal if least else goal / found
    missed = "" if share >= 1.0 else "missed"
    cells = f"| {work} | {goal:,.4g} {unit} | {found:,.4g} {unit} | {share:.2f} | {missed} |"
    return cells, share < (0.8 if least else 1.0 / 1.2)


def tabled(title: str, head: str, rows: list[str]) -> str:
    """A table under its title."""
    lines = [head, "|" + "---|" * (head.count("|") - 1), *rows]
    return "\n".join([title, "", *lines] if title else lines)


def written(text: str) -> None:
    """Put the tables into the design note."""
    note = NOTE.read_text()
    before, _, rest = note.partition(BEGIN)
    NOTE.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{rest.partition(END)[2]}")


def of_programs(cases: Iterable[Case], table: list[tuple[str, bool]]) -> list[str]:
    """Rows of the rates; goals go to ``table``."""
    rates = []
    for case in cases:
        found = rate_of(case)
        if case.name == "boat, five axes":
            table.append(row(case.name, BOAT, found, "/s", True))
        rates.append(f"| {case.name} | {case.kind} | {len(case.program)} | {found:,.0f} |")
    return rates


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--moves", type=int, default=20_000)
    parser.add_argument("--few", type=int, default=4000, help="moves of the converged setting")
    parser.add_argument("--job", type=int, default=0, help="moves of a job by the command line, as 1000000")
    parser.add_argument("--real", type=int, default=1500, help="rows of each program of others; 0: none")
    parser.add_argument("--planned", type=Path, help="folder of the planned examples; none: they are left out")
    parser.add_argument("--others", action="store_true", help="pockets beside Adaptive, the feeds example")
    parser.add_argument("--fresh", action="store_true", help="a clone up to its first verdict")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--write", action="store_true", help="put the tables into docs/design/engines.md")
    args = parser.parse_args()
    table, errors, alone = list[tuple[str, bool]](), list[str](), list[str]()
    for name, (rate, worst) in GOALS.items():
        flank = 0.5 * made(name, 10).cutters[1].radius
        simulated(name, 300, SLICES, flank)
        each = statistics.median(simulated(name, args.moves, SLICES, flank)[0] for _ in range(3))
        contact = statistics.median(geometry(name, args.moves) for _ in range(3))
        stated = statistics.median(simulated(name, args.moves, SLICES, flank, accuracy=True)[0] for _ in range(3))
        some = simulated(name, args.few, SLICES, flank)[1]
        known = simulated(name, args.few, 8 * SLICES, flank / 8.0)[1]
        force = max(p_of(some["force_n"], known["force_n"])[2], 1e-3)
        table.append(row(f"{name}, {args.moves} moves with loads", rate, args.moves / each, "/s", True))
        table.append(row(f"{name}, p99 of the peak force", worst, force, "%", False))
        alone.append(
            f"| {name} | {args.moves / contact:,.0f} | {args.moves / each:,.0f} | {args.moves / stated:,.0f} |"
        )
        for column in COLUMNS:
            p = " | ".join(f"{v:.2f}" for v in p_of(some[column], known[column]))
            errors.append(f"| {name} | {column} | {p} |")
        total = abs(some["chip_volume_mm3"].sum() / known["chip_volume_mm3"].sum() - 1.0)
        table.append(row(f"{name}, sum of the chips", VOLUME, max(100.0 * total, 1e-4), "%", False))
    cases: list[Iterable[Case]] = [of_others(args.real)] if args.real else []
    cases += [of_examples(args.planned, args.real)] if args.real and args.planned else []
    rates = of_programs(itertools.chain(*cases), table)
    peer = beside_pathsim(args.moves) if args.real else None
    if peer is not None:
        table.append(row("finishing with loads over PathSim without", PEER, peer[0], "times", False))
    seconds, used = command_line(args.job) if args.job else (math.nan, math.nan)
    moves = args.job or 1_000_000
    table.append(row(f"job of {moves} moves by the command line", MILLION_S * moves / 1e6, seconds, "s", False))
    table.append(row("its memory", MILLION_MB, used, "MB", False))
    table += [row(*goal) for goal in goals(args.others, args.fresh)]
    p = "p50 [%] | p95 [%] | p99 [%] |"
    parts = [
        tabled("", "| work | goal | measured | share of the goal | |", [line for line, _ in table]),
        tabled("Moves a second:", "| program | contact | with loads | with their error |", alone),
        tabled("Error of a move against slices eight times as many:", f"| program | column | {p}", errors),
        tabled("Steps a second of other programs:", "| program | cutter | rows | steps a second |", rates),
    ]
    text = "\n\n".join(parts[: 4 if rates else 3])
    print(text)
    if args.write:
        written(text)
    if args.check and any(missed for _, missed in table):
        sys.exit(1)


if __name__ == "__main__":
    main()
