"""A cell that learns from its own spindle, on a real LinuxCNC without a screen: five programs, then two faults.

The material cuts 20 % harder than the textbook states, and the edge wears: Kte grows by a third in 100 s of cutting.
The synthetic spindle takes line, position and velocity of the running controller, and answers with a power: idle load,
the torque of the simulated program with the true coefficients and the edge as worn as it is, an efficiency that is not
the stated one, a lag, noise. It shares the engagement of the simulation with the prediction, so that what is measured
is the loop, not the model of the chip.

Each program is planned with what is known: new feeds for a limit of the torque. LinuxCNC runs it while `watch` follows
the power with the feed hold armed; its log is learned, and the material plans the next one. Then a program runs twice
at each of two feeds, a slow one and one whose cuts are short: with a line that lacks its stock, and with a tool that
breaks in a cut. The alarm has to hold the feed.

    python benchmarks/linuxcnc_cell.py [--programs 5] [--folder DIR]

It needs LinuxCNC (apt-get install linuxcnc-uspace), with no HAL running.
"""

from __future__ import annotations

import argparse
import math
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chipload import examples, jobs
from chipload.api.mechanics.learning import torque_of_result
from chipload.control.learning import SignalKind, learn_from_logs, power_signal
from chipload.control.linuxcnc.hal_client import HalPins
from chipload.control.load_watch import LoadWatch
from chipload.control.log_stream import log_text
from chipload.control.logs import read_log
from chipload.control.machine_watch import SOURCES, FeedHold, machine_samples
from chipload.cutting.material import Material, material_named, material_text, read_material
from chipload.files import hash_of

EXAMPLE = Path(examples.__file__).parent / "tube" / "linuxcnc"
sys.path.insert(0, str(EXAMPLE))

#: what the machine is: coefficients over the textbook ones, growth of Kte a second of cutting, efficiency, idle [W]
HARDER, WEAR, EFFICIENCY, IDLE_W = 1.2, 1.0 / 300.0, 0.86, 260.0
#: lag of the power [s], its noise [W]
LAG_S, NOISE_W = 0.1, 10.0
#: what is stated of the spindle
STATED, STATED_ERROR = 0.85, 0.02
TEXTBOOK = "al7075-t6"
LIMIT_NM = 3.0
#: of the programs with a fault [mm/min]: cuts of 6 and of 1.5 s
FAULT_FEEDS = (600, 2400)
JOB = """
[program]
file = "{program}"
control = "linuxcnc"
tools = "tube.tbl"
[machine]
file = "tube.ini"
[stock]
low_mm = [0.0, 0.0, -30.0]
high_mm = [60.0, 50.0, 0.0]
[material]
file = "{material}"
[[cutter]]
number = 1
diameter_mm = 10.0
flutes = 4
helix_deg = 30.0
flute_length_mm = 22.0
overhang_mm = 35.0
modulus_gpa = 580.0
runout_mm = 0.0025
[[operation]]
kind = "simulate"
step_mm = 4.0
{feeds}
[limits]
torque_nm = {limit}
chip_max_mm = 0.15
[checks]
gouge = false
shank_in_stock = false
"""
HEAD = (
    "program", "verdict", "torque at 95 %, of limit", "true torque, of limit", "time at programmed, at new feeds s",
    "cut before s", "after its log: Ktc, Kte over the true ones, +- two standard deviations", "alarms",
)  # fmt: skip
FEEDS = """[operation.feeds]
slowest_percent = 20.0
fastest_percent = 300.0
tooth_feed_least_mm = 0.005
air_mm_min = 4000.0
"""


def program_text(rng: np.random.Generator) -> str:
    """Return five passes along the edge of a block, of random width and depth, after 2 s of air for the idle load."""
    lines = ["G21 G90 G17 G40 G80 G94 G54 G64 P0.01", "M52 P1", "T1 M6", "S8000 M3", "G43 H1", "G0 X-20. Y-10. Z5."]
    lines += ["G4 P0.5", "G1 X-10. F300."]
    y = 0.0
    for _ in range(5):
        width, depth = rng.uniform(1.0, 8.0), rng.uniform(2.0, 6.0)
        y += width
        lines += [f"G0 X-10. Y{y - 5.0:.3f}", f"G0 Z{-depth:.3f}", "G1 X70. F1200.", "G0 Z5."]
    return "\n".join([*lines, "M5", "M2", ""])


@dataclass(eq=False)
class Cell:
    """What is true of the cell, and changes: time for which the edge has cut [s]."""

    cut_s: float = 0.0


class Spindle:
    """The power of the spindle on the pin `sensor.power`, to be used in a ``with`` while LinuxCNC runs.

    Parameters
    ----------
    columns : history of the program
    material : with which it was simulated
    cell : whose edge wears
    missing : line that lacks its stock
    breaks_s : the tool breaks after so long in the cut of this run [s]
    """

    def __init__(self, predicted, columns, material: Material, cell: Cell, missing: int, breaks_s: float) -> None:
        book = material_named(TEXTBOOK)
        self.cell, self.missing, self.breaks_s = cell, missing, breaks_s
        self.cutting = HARDER * book.Ktc / material.Ktc * predicted.cutting
        self.edge = HARDER * book.Kte / material.Kte * predicted.edge
        self.speed, self.line = predicted.speed, predicted.line
        ends = np.column_stack([columns[f"{axis}_mm"] for axis in "xyz"])
        self.begin, self.along = np.vstack([ends[:1], ends[:-1]]), np.diff(ends, axis=0, prepend=ends[:1])
        self.feed = np.asarray(columns["feed_mm_min"]) / 60.0
        #: (time, true torque [N mm]) of every step, and when the fault began
        self.torque: list[tuple[float, float]] = []
        self.fault_at: float | None = None
        self._cut = self._power = 0.0
        self._process = subprocess.Popen(
            ["/usr/bin/python3", "-I", str(EXAMPLE / "sensor.py")], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            text=True, bufsize=1,
        )  # fmt: skip
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._follow, daemon=True)
        self._power = IDLE_W
        self._exchange(IDLE_W)

    def __enter__(self) -> Spindle:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.set()
        self._thread.join(5.0)
        self._process.stdin.close()
        self._process.wait(5.0)

    def _exchange(self, power: float) -> list[float]:
        self._process.stdin.write(f"0.0 0.0 {power!r}\n")
        return [float(x) for x in self._process.stdout.readline().split()]

    def _follow(self) -> None:
        rng, last = np.random.default_rng(5), None
        while not self._ends.is_set():
            row = self._exchange(self._power + float(rng.normal(0.0, NOISE_W)))
            if len(row) != 6:
                return
            now, velocity, line = row[0], row[4], int(row[5])
            seconds = 0.0 if last is None else now - last
            last = now
            torque, speed = self._torque(np.array(row[1:4]), velocity, line, seconds, now)
            self.torque.append((now, torque))
            wanted = IDLE_W + 1e-3 * torque * speed / EFFICIENCY
            self._power += (wanted - self._power) * (1.0 - math.exp(-seconds / LAG_S))
            time.sleep(0.005)

    def _torque(self, place: np.ndarray, velocity: float, line: int, seconds: float, now: float) -> tuple[float, float]:
        """Return the true torque [N mm] and the speed [rad/s]: of the step of this line that is nearest."""
        rows = np.flatnonzero(self.line == line)
        if not len(rows) or velocity <= 0.0:
            return 0.0, 0.0
        a, d = self.begin[rows], self.along[rows]
        share = np.clip(((place - a) * d).sum(axis=1) / np.maximum((d * d).sum(axis=1), 1e-12), 0.0, 1.0)
        k = int(rows[np.argmin(np.linalg.norm(place - a - share[:, None] * d, axis=1))])
        if self.cutting[k] + self.edge[k] <= 0.0:
            return 0.0, float(self.speed[k])
        if line == self.missing or self._cut > self.breaks_s:
            self.fault_at = self.fault_at or now
            return 0.0, float(self.speed[k])
        self._cut += seconds
        self.cell.cut_s += seconds
        worn = 1.0 + WEAR * self.cell.cut_s
        return float(self.cutting[k] * velocity / self.feed[k] + worn * self.edge[k]), float(self.speed[k])


def run_on_machine(folder: Path, program: Path, done, material: Material, cell: Cell, missing=0, breaks_s=math.inf):
    """Run a program on LinuxCNC under the watch; return the log, the alarms, the spindle and the machine's rows."""
    from run import LinuxCNC, rows_of

    predicted, columns = torque_of_result(done.result, program.name), done.result.in_use[0].columns
    alarms, samples, hold = [], [], FeedHold(["all"])
    watch = LoadWatch(predicted, power_signal(STATED, STATED_ERROR), material)

    def take(alarm) -> None:
        alarms.append((time.monotonic(), alarm, hold.take(alarm)))

    with LinuxCNC(program, "stop", 240.0) as cnc:
        spindle = Spindle(predicted, columns, material, cell, missing, breaks_s)
        with spindle, HalPins("chipload", sources={"current-in": "sensor.power", **SOURCES}) as pins:
            stopped = None
            for sample in machine_samples(pins, SignalKind.POWER, hold, notice=take):
                if sample is not None:
                    samples.append(sample)
                    for alarm in watch.add(sample.time, sample.value, sample.line, sample.override):
                        take(alarm)
                hold.is_finished = watch.finished
                stopped = time.monotonic() if stopped is None and hold.is_stopped else stopped
                if cnc.ended() or (stopped is not None and time.monotonic() > stopped + 2.0):
                    break
            rows = rows_of(cnc.folder / "machine.csv")
            shutil.copyfile(cnc.folder / "machine.csv", folder / f"{program.stem}-machine.csv")
        cnc.close()
        shutil.rmtree(cnc.folder)
    return samples, alarms, spindle, rows


def planned(folder: Path, name: str, program: str, material: str, feeds: bool):
    """Run a job; return it."""
    text = JOB.format(program=program, material=material, feeds=FEEDS if feeds else "", limit=LIMIT_NM)
    (folder / f"{name}.toml").write_text(text)
    return jobs.run_job(jobs.load_job(folder / f"{name}.toml"))


def torque_check(done):
    """Return the check of the torque of a run."""
    return next(c for c in done.result.limits if c.name == "torque_nm")


def true_share(folder: Path, name: str, program: str, cell: Cell) -> float:
    """Return the greatest torque of a program with the true coefficients, and the edge as it is, over its limit."""
    book = material_named(TEXTBOOK)
    names = ("Ktc", "Krc", "Kac", "Kre", "Kae")
    own = {key: HARDER * getattr(book, key) for key in names} | {"Kte": HARDER * book.Kte * (1.0 + WEAR * cell.cut_s)}
    keys = {
        "Ktc": "ktc_mpa",
        "Krc": "krc_mpa",
        "Kac": "kac_mpa",
        "Kte": "kte_n_mm",
        "Kre": "kre_n_mm",
        "Kae": "kae_n_mm",
    }
    lines = "".join(f"{keys[key]} = {value}\n" for key, value in own.items())
    (folder / "true.toml").write_text(f'name = "true"\nsource = "drawn"\nspread = 0.01\n{lines}')
    return torque_check(planned(folder, name, program, "true.toml", False)).worst / LIMIT_NM


def faults_at(folder: Path, feed: int, known: str, cell: Cell) -> bool:
    """Run the program at a feed [mm/min] with a line that lacks its stock, and with a tool that breaks; print when the
    feed is held, and return whether it is not.
    """
    bad, program = False, folder / f"faults{feed}.ngc"
    program.write_text(program_text(np.random.default_rng(10)).replace("F1200", f"F{feed}"))
    done = planned(folder, program.stem, program.name, known, False)
    cuts = torque_of_result(done.result, program.name)
    load = np.where(cuts.cutting > 0.0, cuts.cutting + cuts.edge, 0.0)
    seconds = np.diff(cuts.time, prepend=0.0)
    spent = {int(n): float(seconds[(cuts.line == n) & (load > 0.0)].sum()) for n in np.unique(cuts.line[load > 0.0])}
    longest = max(spent, key=spent.get)
    # in a cut that others follow
    breaks = sorted(n for n in spent if spent[n] > 0.5 * spent[longest])[-2]
    first = sum(v for n, v in spent.items() if n < breaks)
    material = read_material(folder / known)
    for name, fault in (
        ("missing block", {"missing": longest}),
        ("broken tool", {"breaks_s": first + 0.4 * spent[breaks]}),
    ):
        samples, alarms, spindle, rows = run_on_machine(folder, program, done, material, cell, **fault)
        (folder / f"{program.stem}-{name.replace(' ', '-')}.csv").write_text(log_text(samples, SignalKind.POWER))
        at = f"F{feed}, {name}, cuts of {spent[longest]:.1f} s"
        held = next((t for t, _, holds in alarms if holds), None)
        if held is None or spindle.fault_at is None or held < spindle.fault_at:
            print(f"{at}: no hold after the fault; {[str(a) for _, a, _ in alarms]}")
            bad = True
            continue
        stands = rows[(rows[:, 0] > held) & (rows[:, 4] == 0.0)]
        later = float(stands[0, 0] - held) if len(stands) else math.nan
        speed = float(np.interp(held, rows[:, 0], rows[:, 4]))
        bad |= not later < 0.5 or len(rows) == 0 or rows[-1, 4] != 0.0
        print(f"{at}: {alarms[0][1]}")
        print(f"  held {held - spindle.fault_at:.2f} s after the fault, at {60.0 * speed:.0f} mm/min; the machine "
              f"stands {later:.2f} s after the alarm, and {rows[-1, 0] - held:.1f} s after it too")  # fmt: skip
    return bad


def main() -> int:
    """Print the table; return 1 where a fault is missed, an alarm is false, or a proven limit was exceeded."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--programs", type=int, default=5, help="0: only the faults, with the textbook")
    parser.add_argument("--folder", type=Path, help="folder for jobs, programs, logs and materials")
    given = parser.parse_args()
    if shutil.which("linuxcnc") is None:
        print("linuxcnc is not installed: apt-get install linuxcnc-uspace")
        return 2
    folder = given.folder or Path(tempfile.mkdtemp(prefix="cell-"))
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("tube.ini", "tube.hal", "tube.tbl"):
        shutil.copyfile(EXAMPLE / name, folder / name)
    (folder / "known0.toml").write_text(material_text(material_named(TEXTBOOK)))
    signal = power_signal(STATED, STATED_ERROR)
    book, cell, bad = material_named(TEXTBOOK), Cell(), False
    print(" | ".join(HEAD))
    for k in range(given.programs):
        (folder / f"part{k}.ngc").write_text(program_text(np.random.default_rng(10 + k)))
        material = read_material(folder / f"known{k}.toml")
        done = planned(folder, f"plan{k}", f"part{k}.ngc", f"known{k}.toml", True)
        files = done.presentation.files(done.result)
        program = folder / f"run{k}.ngc"
        text = next(v for name, v in files.items() if name.endswith("feeds.ngc"))
        program.write_bytes(text if isinstance(text, bytes) else text.encode("ascii"))
        check, worn = torque_check(done), cell.cut_s
        real = true_share(folder, f"true{k}", program.name, cell)
        saved = done.result.operations[0]["feeds"]
        samples, alarms, _, _ = run_on_machine(folder, program, done, material, cell)
        log = folder / f"log{k}.csv"
        log.write_text(log_text(samples, SignalKind.POWER))
        found, _ = learn_from_logs(
            {log.name: read_log(log)[0]}, torque_of_result(done.result, program.name), signal, material,
            name=f"known{k + 1}", hashes={log.name: hash_of(log)}, worn=True,
        )  # fmt: skip
        (folder / f"known{k + 1}.toml").write_text(material_text(found.material))
        own = found.material
        sd = np.sqrt(np.diagonal(own.variances))[[0, 3]]
        true = HARDER * np.array([book.Ktc, book.Kte * (1.0 + WEAR * cell.cut_s)])
        ratio = np.array([own.Ktc, own.Kte]) / true
        texts = [f"{r:.3f} +- {2.0 * s / t:.3f}" for r, s, t in zip(ratio, sd, true, strict=True)]
        print(f"{k + 1} | {done.result.verdict} | {check.value_at_confidence / LIMIT_NM:.3f} | {real:.3f} | "
              f"{saved['time_before_s']:.1f}, {saved['time_after_s']:.1f} | {worn:.1f} | {', '.join(texts)} | "
              f"{len(alarms)}", flush=True)  # fmt: skip
        bad |= bool(alarms) or (real > 1.0 and str(done.result.verdict) == "holds")
        for _, alarm, _ in alarms:
            print(f"  {alarm}")
    for feed in FAULT_FEEDS:
        bad |= faults_at(folder, feed, f"known{given.programs}.toml", cell)
    print(f"folder: {folder}")
    return int(bad)


if __name__ == "__main__":
    sys.exit(main())
