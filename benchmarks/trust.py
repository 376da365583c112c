"""What passed without a word and should not have: each case again, in one process; a table of before and now.

    python benchmarks/trust.py [NUMBER ...]

"Before" is what version 0.1.0 answered. A case whose answer is not the wanted one is marked and makes the exit code 1.
Cases that need a machine, a second process or minutes of the processor are tests and campaigns: docs/design/trust.md.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from chipload.api.simulation import simulate
from chipload.checking.settings import Limits
from chipload.checking.workpiece import Stock
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material, material_named, material_names
from chipload.errors import InputError, Severity
from chipload.examples import copy_example
from chipload.jobs import check_job, job_of, load_job, run_job
from chipload.machine.machine import machine_named
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.program.read import read_program
from chipload.program.setup import Setup

BALL_10 = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0)
BALL_12 = Cutter(12.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=6.0)
NO_EDGE = Material("no edge", 1000.0, 300.0, 100.0, 0.0, 0.0, 0.0, source="made up")
SLOT = "G21 G90 G17 G94\nT1 M6\nS3000 M3\nG0 X-10 Y0 Z5\nG0 Z-2\n{}G1 X30 F600\nG0 Z5\nM2\n"
MILL = {
    "number": 1, "diameter_mm": 10.0, "flutes": 2, "helix_deg": 30.0, "flute_length_mm": 20.0, "overhang_mm": 30.0,
    "modulus_gpa": 580.0,
}  # fmt: skip


def refused(act: Callable[[], object]) -> str:
    """The message of a refusal; what came out where there was none."""
    try:
        return f"accepted: {act()}"
    except InputError as err:
        return f"refused: {err}"


def example(name: str, *sets: str) -> str:
    """Verdict and message of an example with some keys changed."""
    with tempfile.TemporaryDirectory() as place:
        copy_example(name, Path(place) / name)
        result = run_job(load_job(Path(place) / name / "job.toml", sets)).result
    return f"exit {result.verdict.exit_code}: {result.message}"


def program_job(text: str, **tables: object) -> str:
    """Verdict and message of a small program through a block."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for name, content in {"a.ngc": text, "t.tbl": "T1 P1 D6 ;mill\n"}.items():
            (folder / name).write_text(content)
        values = {
            "program": {"file": "a.ngc"},
            "machine": {"name": "vmc"},
            "stock": {"low_mm": [0, -15, -5], "high_mm": [50, 15, 0]},
            "material": {"name": "al7075-t6"},
            "cutter": [MILL],
            "operation": [{"kind": "simulate", "step_mm": 2.0}],
            "limits": {"force_n": 2000.0},
        }
        values |= tables
        result = run_job(job_of(values, folder)).result
    return f"exit {result.verdict.exit_code}: {result.message}"


def slot(cutter: Cutter, depth: float, step: float, apart: float = 0.0) -> float:
    """Work of the torque over Ktc times the volume that the stock lost, less 1, in a straight slot."""
    x = [-cutter.diameter, 10.0, *(10.0 + apart * np.arange(1, 50) if apart else [20.0])]
    points = [[v, 0.0, -depth] for v in x]
    path = Program.join([rapid(points[0], 300.0, 1, "a"), *(plunge(p, 20.0, 300.0, 1, "a") for p in points[1:])])
    block = Stock.block((0.0, -16.0, -12.0), (30.0, 16.0, 0.0))
    return simulate(path, block, cutter, NO_EDGE, "vmc", Limits(force_n=1e6), step_mm=step).energy_balance[1]


def thin_cutter() -> tuple[str, bool]:
    text = example("feeds", "cutter.0.diameter_mm=4")
    return text, text.startswith("exit 3") or "stress" in text


def ball_noses() -> tuple[str, bool]:
    found = {
        "D 12 ball, 1.874 deep, 0.5 mm steps": slot(BALL_12, 1.874, 0.5),
        "D 10 ball, 1 deep, points 0.2 mm apart": slot(BALL_10, 1.0, 0.5, 0.2),
        "0.1 mm": slot(BALL_10, 1.0, 0.5, 0.1),
        "0.02 mm": slot(BALL_10, 1.0, 0.5, 0.02),
        "0.3 deep": slot(BALL_10, 0.3, 0.5),
    }
    text = ", ".join(f"{name}: {100.0 * value:+.2f} %" for name, value in found.items())
    return f"energy balance {text}", max(map(abs, found.values())) < 0.02


def compensation() -> tuple[str, bool]:
    text = SLOT.format("G1 X-5 F300\nG41 D1\n")
    mill = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5)
    unknown, known = read(text), read(text, cutters={1: mill})
    other = refused(lambda: program_job(SLOT.format(""), program={"file": "a.ngc", "tools": "t.tbl"}))
    right = any("compensated by 0" in f for f in unknown) and len(known) == 1 and other.startswith("refused")
    return (
        f"without a diameter: {unknown[1:]}; with the [[cutter]] by 5 mm: {known[1:]}; D 6 beside 10 mm: {other}",
        right,
    )


def spindle() -> tuple[str, bool]:
    sets = ("spindle.torque_constant_nm_a=1.5", "spindle.noise_a=0.2", "spindle.idle_a=[8, 0.01]",
            "spindle.most_current_a=60")  # fmt: skip
    text = refused(lambda: example("tube", *sets))
    return text, text.startswith("refused")


def passes() -> tuple[str, bool]:
    texts = [example("contour", f"operation.0.passes={n}", "operation.0.step_mm=0.2",
                     'operation.0.strategies=["backward"]') for n in (2, 3)]  # fmt: skip
    return " / ".join(texts), all(t.startswith("exit 0") for t in texts)


def spreads() -> tuple[str, bool]:
    every = [material_named(name) for name in material_names()]
    without = [m.name for m in every if not m.has_band]
    return f"{len(every)} materials, without a spread: {', '.join(without) or 'none'}", not without


def checks() -> tuple[str, bool]:
    out = []
    for name, sets in (("contour", ['operation.0.kind="pocket"']), ("feeds", ["cutter.0.number=9"])):
        with tempfile.TemporaryDirectory() as place:
            copy_example(name, Path(place) / name)
            path = Path(place) / name / "job.toml"
            acts = [lambda act=act, path=path, sets=sets: act(load_job(path, sets)) for act in (check_job, run_job)]
            out += [refused(act) for act in acts]
    return " / ".join(out[::2]), out[0] == out[1] and out[2] == out[3] and all(t.startswith("refused") for t in out)


def read(text: str, ending: str = ".ngc", **setup: object) -> list[str]:
    """Findings of a text that leave a result unproven."""
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / f"a{ending}"
        path.write_text(text)
        machine = machine_named("vmc")
        done = read_program(path, machine, dialect=None, tools=None, feed=10.0, setup=Setup(**setup))  # type: ignore[arg-type]
    return [f"{len(done.program)} rows", *(str(f) for f in done.findings if f.severity >= Severity.UNPROVEN)]


def messages() -> tuple[str, bool]:
    offset = read("G21 G90\nG54 G0 X1\nG55 X2\nM2\n")
    q = read("BEGIN PGM A MM\n1 FN 18: SYSREAD Q1 = ID1 NR1\n2 L X+Q1 FMAX\n3 L X+3 FMAX\n4 M30\nEND PGM A MM\n", ".h")
    text = " / ".join((*offset, *q))
    return text, "work_offsets" in text and "parameters" in text


def words() -> tuple[str, bool]:
    texts = {
        "G33.1": read("G21 G90 S100 M3\nG0 Z2\nG33.1 Z-5 K1\nM2\n"),
        "stray %": read("G21 G90\nG0 X1\n%\nG0 X2\nM2\n"),
        ".gc": read("G21 G90\nG0 X1\nM2\n", ".gc"),
        "CIRCLE": read("UNITS/MM\nLOADTL/1\nSPINDL/1000,RPM,CLW\nFEDRAT/100,MMPM\nGOTO/10,0,0\n"
                       "CIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0\nFINI\n", ".cls"),
        "INCR": read("UNITS/MM\nLOADTL/1\nSPINDL/1000,RPM,CLW\nFEDRAT/100,MMPM\nGOTO/0,0,5\n"
                     "CYCLE/DRILL,DEPTH,5,INCR,1,CLEAR,2\nGOTO/0,0,0\nCYCLE/OFF\nFINI\n", ".cls"),
        "Sinumerik IF": read("R1=0\nAGAIN:\nR1=R1+1\nG0 X=R1\nIF R1<3 GOTOB AGAIN\nM30\n", ".mpf"),
        "RND": read("BEGIN PGM A MM\nL X+0 Y+0 Z+0 FMAX\nL X+9 F100\nRND R2\nL Y+9\nM30\nEND PGM A MM\n", ".h"),
    }  # fmt: skip
    return "; ".join(f"{name}: {', '.join(found)}" for name, found in texts.items()), all(texts.values())


def misplaced() -> tuple[str, bool]:
    text = program_job(SLOT.format("G1 X-30 F300\nX-60\nX-10\n").replace("Z-2", "Z-4"),
                       stock={"low_mm": [26, -15, -5], "high_mm": [50, 15, 20]}, limits={"force_n": 100.0})  # fmt: skip
    return text, "misplaced" in text or "stock" in text


def sizes() -> tuple[str, bool]:
    out = {
        "400 nines": refused(lambda: read("; a\nG21 G" + "9" * 400 + "\nM30\n", ".mpf")),
        "stock_points_mm": refused(lambda: program_job(SLOT.format(""), operation=[{"kind": "simulate", "step_mm": 2.0,
                                                        "stock_points_mm": 1e-9}])),
        "diameter": refused(lambda: program_job(SLOT.format(""), cutter=[{**MILL, "diameter_mm": 1e-9}])),
        "flutes": refused(lambda: program_job(SLOT.format(""), cutter=[{**MILL, "flutes": 10**9}])),
        "step_mm": refused(lambda: program_job(SLOT.format(""), operation=[{"kind": "simulate", "step_mm": 1e-9}])),
        "overhang": refused(lambda: program_job(SLOT.format(""), cutter=[{**MILL, "overhang_mm": 1e9}])),
    }  # fmt: skip
    return "; ".join(f"{name}: {text[:90]}" for name, text in out.items()), all(
        t.startswith("refused") for t in out.values()
    )


CASES: dict[int, tuple[str, Callable[[], tuple[str, bool]]]] = {
    1: ("every stated limit holds, exit 0: the cutter bends by 1.15 mm at 4.7 GPa", thin_cutter),
    2: ("torque -11 %; -18, -25, -36 %; +53 %", ball_noses),
    3: ("exit 0, compensated by 0 / exit 0 with D 6 beside 10 mm", compensation),
    4: ("exit 0, -419 % shorter", spindle),
    5: ("28.4 deg, its own verification fails", passes),
    10: ("no material states a spread", spreads),
    14: ("check says right, run refuses", checks),
    15: ("asks for what cannot be given", messages),
    16: ("one word refuses the whole program", words),
    17: ("a limit exceeded, without its cause", misplaced),
    22: ("exit 1, or memory without bound", sizes),
}


def main() -> int:
    """Print the table."""
    asked = [int(text) for text in sys.argv[1:]] or list(CASES)
    print("| point | before | now | |\n|---:|---|---|---|", flush=True)
    good = True
    for number in asked:
        before, act = CASES[number]
        text, right = act()
        good &= right
        short = " ".join(text.split()).replace("|", "/")
        print(f"| {number} | {before} | {short[:700]} | {'' if right else 'WRONG'} |", flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
