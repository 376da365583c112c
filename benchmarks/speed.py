"""What jobs cost over their kernel, with goals: `python benchmarks/speed.py [--quick] [--check]`.

Processor seconds, so that other work on the computer counts little; memory is the most that a process had.

- `check` of an example, in a process of its own, its files compiled to byte code before;
- jobs of a flat roughing, of a ball finishing and of a five-axis program by the command line (reading, simulation,
  checks, report) over their kernel, contact and loads of the same moves at the same resolution, and the shares of
  reading, contact, loads, outlines, checks and files in the same job within this process; the processor seconds until
  the verdict is shown;
- how much faster the kernel is on 2 and 4 threads with a core each: its processor time over that of its busiest thread
  and of the main thread, which works for all (``--threads`` alone, with ``--moves``);
- the time of the height map that checks of the stock follow (``--heights`` alone);
- `check` and `run` of examples that are named (``--examples plate tube`` alone; twice, so that nothing is compiled);
- the exponent of time over the number of moves, and time and memory of a further move in a job.

``--quick``: 1,000 and 5,000 moves, about a minute of processor time; start and report are then most of a job, and only
the goals of `check` and of memory are compared. Else 10,000 and 100,000 moves, and ``--moves`` states others.
``--check``: exit 1 where a goal is missed by more than 20 %.
"""

from __future__ import annotations

import argparse
import cProfile
import math
import os
import pstats
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import ClassVar, NamedTuple
from unittest.mock import patch

import numpy as np
from engine_programs import made
from engines import ALLOY

from chipload import examples
from chipload.checking.preparation import resolution_of
from chipload.checking.settings import SimulationSettings
from chipload.jobs import load_job, run_job
from chipload.program.apt.writer import write_apt
from chipload.program.release import Release
from chipload.simulation import strips
from chipload.simulation.chips import remove
from chipload.simulation.heights.height_map import follow_heights, pitch_of
from chipload.simulation.steps import StepBlocks
from chipload.stock.layers import LayeredStock

#: goals: check [s], a job over its kernel, memory of the longest job [MB]; by how much a goal may be missed
CHECK_S, OVER_KERNEL, MEMORY_MB, MISSED = 0.4, 2.0, 400.0, 1.2
NAMES = ("roughing", "finishing", "five axes")
#: goals of the contact and the loads of a move [us]; longest step of the jobs [mm]
KERNEL_US, STEP_MM = {"finishing": 20.0, "five axes": 300.0}, 1.0
TOLERANCE_MM = 1e-3
QUICK, WHOLE = (1_000, 5_000), (10_000, 100_000)
#: moves below which start and report are most of a job, so that no goal of time is stated
SHORT = 50_000
WORDS = ("G21 G90 G17 G94", "T1 M6", "S9549 M3")
JOB = """[program]
file = "{file}"
[machine]
name = "{machine}"
[stock]
low_mm = {low}
high_mm = {high}
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = {diameter}
corner_radius_mm = {corner}
flutes = {flutes}
helix_deg = 30.0
flute_length_mm = 25.0
overhang_mm = 40.0
modulus_gpa = 600.0
[[operation]]
kind = "simulate"
step_mm = {step}
[limits]
force_n = 1500.0
"""
#: runs chipload and writes its greatest memory [kB]: what ``wait4`` gives includes that of the process that started it
TOLD = """
import atexit, sys
from pathlib import Path
told = Path(sys.argv[1])
atexit.register(lambda: told.write_text(Path("/proc/self/status").read_text().split("VmHWM:")[1].split()[0]))
sys.argv = ["chipload", *sys.argv[2:]]
from chipload.cli import main
main()
"""
#: parts of a job: a name, and the functions whose whole time is theirs
PARTS = {
    "reading": ("read_for",),
    # a thread of its own finds it; the generator waits for it
    "contact": ("with_contact",),
    "loads": ("remove_by_moves",),
    "errors of loads": ("with_accuracy",),
    "outlines": ("finish",),
    "checks of the stock": ("check_stock", "_collision_check", "check_leaning_stock"),
    "report": ("result_of", "presentation_of"),
    "files": ("write_result",),
}


class Row(NamedTuple):
    """A line of the table; without a goal it is nan."""

    work: str
    goal: float
    found: float
    unit: str

    def missed(self) -> bool:
        """Whether the goal is missed by more than 20 %."""
        return self.found > MISSED * self.goal


class Spent(NamedTuple):
    """Processor seconds and greatest memory [MB] of a command, and its processor seconds when it showed a line."""

    seconds: float
    memory: float
    shown: float


def command(words: Sequence[str], byte_code: str, codes: Sequence[int] = (0, 3)) -> Spent:
    """What a command of chipload takes, in a process of its own.

    Parameters
    ----------
    byte_code : folder of the compiled files, which an earlier command has written
    """
    kept = {**os.environ, "PYTHONPYCACHEPREFIX": byte_code}
    kept.pop("PYTHONDONTWRITEBYTECODE", None)
    told = Path(byte_code) / "memory"
    child = subprocess.Popen(
        [sys.executable, "-c", TOLD, str(told), *words], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=kept
    )
    assert child.stdout is not None
    child.stdout.readline()
    # user and system time so far, when the first line of the verdict is shown
    ticks = Path(f"/proc/{child.pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    child.stdout.read()
    _, status, used = os.wait4(child.pid, 0)
    if os.waitstatus_to_exitcode(status) not in codes:
        raise RuntimeError(f"chipload {' '.join(words)}: exit code {os.waitstatus_to_exitcode(status)}")
    shown = sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")
    return Spent(used.ru_utime + used.ru_stime, float(told.read_text()) / 1024.0, shown)


def write_job(name: str, moves: int, folder: Path) -> Path:
    """The job of a program of so many moves, with its text."""
    case = made(name, moves)
    p = case.program.p_work
    begin = (f"G0 X{p[0, 0]:.3f} Y{p[0, 1]:.3f} Z20", "G0 Z5", f"G1 Z{p[0, 2]:.4f} F400", "F1200")
    rows = [f"X{x:.3f} Y{y:.3f} Z{z:.4f}" for x, y, z in p[1:].tolist()]
    (folder / "moves.ngc").write_text("\n".join([*WORDS, *begin, *rows, "G0 Z20", "M30", ""]))
    c, (low, high) = case.cutters[1], ([*map(float, corner)] for corner in (case.low, case.high))
    file, machine = "moves.ngc", "vmc"
    if name == "five axes":
        file, machine = "moves.apt", "xyzac-trunnion"
        (folder / file).write_text(write_apt(case.program, case.cutters, title=name, release=Release("a benchmark")))
    text = JOB.format(
        step=STEP_MM,
        file=file,
        machine=machine,
        low=low,
        high=high,
        diameter=c.diameter,
        corner=c.corner_radius,
        flutes=c.flutes,
    )
    (folder / "job.toml").write_text(text)
    return folder / "job.toml"


def kernel(name: str, moves: int, workers: int = 1) -> float:
    """Processor seconds of contact and loads of a program at the resolution of a job, without checks, errors and
    outlines.
    """
    case = made(name, moves)
    fine = resolution_of(SimulationSettings(STEP_MM), case.cutters, case.program)
    stock = LayeredStock.block(case.low, case.high, 4.0 * case.layer_mm, 40.0)
    begun = time.process_time()
    remove(
        case.program, stock, case.cutters, ALLOY, fine, accuracy=False, outlines=False,
        workers=workers,
    )  # fmt: skip
    return time.process_time() - begun


def height_map(name: str, moves: int) -> float:
    """Processor seconds of the stock as a height map under the moves of an upright program."""
    case = made(name, moves)
    stock = LayeredStock.block(case.low, case.high, 4.0 * case.layer_mm, 40.0)
    pitch = pitch_of(np.array(case.low), np.array(case.high), case.cutters)
    steps = StepBlocks(case.program, STEP_MM, TOLERANCE_MM)
    begun = time.process_time()
    follow_heights(steps, case.cutters, stock, pitch, TOLERANCE_MM)
    return time.process_time() - begun


class TimedThread(ThreadPoolExecutor):
    """A thread of a simulation that states its processor seconds in ``times`` when it ends."""

    times: ClassVar[list[float]] = []

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End it."""
        if not self._shutdown:
            self.times.append(self.submit(time.thread_time).result())
        super().shutdown(wait, cancel_futures=cancel_futures)


def thread_rows(name: str, moves: int) -> list[Row]:
    """How much faster the kernel of a program is on several threads with a core each; the bytes are the same."""
    kernel(name, 300)
    alone, table = kernel(name, moves), list[Row]()
    for workers in (2, 4):
        TimedThread.times.clear()
        with patch.object(strips, "ThreadPoolExecutor", TimedThread), patch.object(strips, "FEWEST", 1):
            begun = time.thread_time()
            kernel(name, moves, workers)
            main = time.thread_time() - begun
        work = f"{name}, {moves} moves, {len(TimedThread.times)} threads"
        longest = max(TimedThread.times)
        table += [
            Row(f"{work}: kernel over its busiest thread", math.nan, alone / longest, "times"),
            Row(f"{work}: over the busiest and the main thread", math.nan, alone / (longest + main), "times"),
            Row(f"{work}: main thread", math.nan, main / alone, "of the kernel"),
        ]
    return table


def shares(job: Path) -> dict[str, float]:
    """Share of each part in the processor time of a job within this process."""
    profile = cProfile.Profile(timer=time.process_time)

    def run() -> None:
        run_job(load_job(job)).save(job.parent / "shares")

    begun = time.process_time()
    profile.runcall(run)
    whole = time.process_time() - begun
    took = dict[str, float]()
    for (_, _, function), (_, _, _, cumulative, _) in pstats.Stats(profile).stats.items():
        for part, functions in PARTS.items():
            if function in functions:
                took[part] = took.get(part, 0.0) + cumulative
    return {part: seconds / whole for part, seconds in took.items()} | {"all [s]": whole}


def measured(names: Sequence[str], moves: Sequence[int], byte_code: str) -> list[Row]:
    """Every row of the table; the shares are printed as they are found."""
    check = ["check", str(Path(examples.__file__).parent / "feeds" / "job.toml")]
    command(check, byte_code)
    seconds, memory, _ = command(check, byte_code)
    table = [Row("check of the example feeds", CHECK_S, seconds, "s"), Row("its memory", math.nan, memory, "MB")]
    for name in names:
        kernel(name, 300)
        times, held = list[float](), list[float]()
        for n in moves:
            with tempfile.TemporaryDirectory() as folder:
                job = write_job(name, n, Path(folder))
                if n == moves[0]:
                    # compiles what is not compiled yet
                    found = shares(job)
                    print(f"{name}, {n} moves:", ", ".join(f"{k} {v:.2f}" for k, v in found.items()), flush=True)
                run = ["run", str(job), "--out", str(Path(folder) / "result")]
                if name == names[0] and n == moves[0]:
                    # writes the byte code
                    command(run, byte_code)
                seconds, memory, shown = command(run, byte_code)
            own = kernel(name, n)
            times.append(seconds)
            held.append(memory)
            work, goal = f"{name}, {n} moves", OVER_KERNEL if n >= SHORT else math.nan
            table += [
                Row(f"{work}: job", math.nan, seconds, "s"),
                Row(f"{work}: of it until the verdict", math.nan, shown, "s"),
                Row(f"{work}: kernel a move", KERNEL_US.get(name, math.nan), 1e6 * own / n, "us"),
                Row(f"{work}: job over kernel", goal, seconds / own, "times"),
                Row(f"{work}: memory", MEMORY_MB, memory, "MB"),
            ]
        if len(moves) < 2:
            continue
        grows = math.log(times[-1] / times[0]) / math.log(moves[-1] / moves[0])
        table.append(Row(f"{name}: exponent of the time of a job", math.nan, grows, ""))
        added = 1e6 * (times[-1] - times[0]) / (moves[-1] - moves[0])
        table.append(Row(f"{name}: time of a further move in a job", math.nan, added, "us"))
        added = 1e6 * (held[-1] - held[0]) / (moves[-1] - moves[0])
        table.append(Row(f"{name}: memory of a further move in a job", math.nan, added, "bytes"))
    return table


def example_rows(names: Sequence[str], byte_code: str) -> list[Row]:
    """Processor seconds of `check` and `run` of examples, each in a process of its own."""
    table = list[Row]()
    for name in names:
        job = str(Path(examples.__file__).parent / name / "job.toml")
        for word, more in (("check", []), ("run", ["--out", str(Path(byte_code) / name), "--fresh"])):
            # what is not compiled yet is compiled by the first
            seconds = [command([word, job, *more], byte_code).seconds for _ in range(2)]
            table.append(Row(f"{word} of the example {name}", math.nan, seconds[1], "s"))
    return table


def print_table(table: Sequence[Row]) -> None:
    """Print the rows, and how busy the computer is."""
    print("| work | goal | measured | |\n|---|---|---|---|")
    for row in table:
        goal = "" if math.isnan(row.goal) else f"{row.goal:.4g} {row.unit}"
        print(f"| {row.work} | {goal} | {row.found:.4g} {row.unit} | {'missed' if row.missed() else ''} |")
    print(f"load {os.getloadavg()[0]:.0f} on {os.cpu_count()} cores")


def main() -> None:
    """Print the table."""
    ask = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    ask.add_argument("--quick", action="store_true", help="few moves")
    ask.add_argument("--check", action="store_true", help="exit 1 where a goal is missed by more than 20 %%")
    ask.add_argument("--moves", type=int, nargs="+", default=None, help="lengths of the programs, ascending")
    ask.add_argument("--names", nargs="+", choices=NAMES, default=NAMES, help="programs")
    ask.add_argument("--threads", action="store_true", help="only the kernel on 2 and 4 threads")
    ask.add_argument("--heights", action="store_true", help="only the height map of upright programs")
    ask.add_argument("--examples", nargs="+", default=(), help="only check and run of these examples")
    given = ask.parse_args()
    if given.examples:
        with tempfile.TemporaryDirectory() as byte_code:
            print_table(example_rows(given.examples, byte_code))
        return
    if given.heights:
        table = list[Row]()
        for name in (name for name in given.names if name != "five axes"):
            height_map(name, 300)
            n = min(given.moves or (4_000,))
            table.append(Row(f"{name}, {n} moves: height map", math.nan, 1e6 * height_map(name, n) / n, "us a move"))
        print_table(table)
        return
    if given.threads:
        table = [row for n in given.moves or (20_000,) for name in given.names for row in thread_rows(name, n)]
        print_table(table)
        return
    with tempfile.TemporaryDirectory() as byte_code:
        table = measured(given.names, given.moves or (QUICK if given.quick else WHOLE), byte_code)
    print_table(table)
    if given.check and any(row.missed() for row in table):
        sys.exit(1)


if __name__ == "__main__":
    main()
