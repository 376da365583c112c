"""Processor time and memory of the distortion of a frame: 120 x 60 x 30 mm, two pockets, walls and rib 1.5 mm, floor 2.

    python benchmarks/frame.py [CELL_MM ...]      8 and 12, if none are stated
    python benchmarks/frame.py --state [CELL_MM]  the finished frame, clamped and factored, in cells of 3 mm
    python benchmarks/frame.py --proof FILE       the jobs that `chipload init` drafts of a STEP file, run one by one
    python benchmarks/frame.py --levels MM [MM]   the example `frame` with levels of its walls of these depths
    python benchmarks/frame.py --plan [SET ...]   the levels that the example plans, with these values in its job

Measured for each size of cells: a plan with a release before finishing, its flatness and distortion. Then the whole
search of a job: the part at three heights in a plate of 40 mm, either side first, either way up, with and without a
release before its faces are finished. The stress is the M of stretched plate, 20 MPa.

The proof runs the commands of a user: `chipload init`, then `chipload run --accept` of each job; of each the exit code,
the processor and wall time and the greatest memory, and the first sentence of its verdict.

The plan states levels by what is left of the part, their planned form errors, the constant depth that keeps the same
limit, and its processor time; nothing is simulated.

The levels compare depths of the second operation of the example: time of its program, and the form error that its
simulation in the elastic part states at 95 %. The greatest depth that holds is the one to use.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
import tempfile
from importlib.resources import files
from pathlib import Path
from time import monotonic, process_time

import numpy as np
import shapely
import trimesh

from chipload.jobs import job_of, load_job, run_job
from chipload.jobs.contour.job import ContourJob
from chipload.jobs.contour.run import read_inputs
from chipload.jobs.contour.wall_states import levels_text, planned_levels
from chipload.jobs.distortion.plans import Clamping, MillingPlan
from chipload.jobs.distortion.release import plate_release
from chipload.jobs.distortion.shapes import SideCut
from chipload.jobs.distortion.surface import part_surface
from chipload.report.folder import write_finished
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.clamp import Clamp
from chipload.structure.cells.moments import StockRegion
from chipload.structure.cells.thickness import cells_over
from chipload.structure.cells.workpiece import Elastic, cell_workpiece, line_compliances
from chipload.structure.stress_profile import m_shape, odd_shape

SIZE, WALL, FLOOR = (120.0, 60.0, 30.0), 1.5, 2.0
#: depth of the pockets of the example [mm]
WALLS = 8.0


def box(low: tuple[float, ...], high: tuple[float, ...]) -> trimesh.Trimesh:
    """A box between two corners [mm]."""
    out = trimesh.creation.box(np.subtract(high, low))
    out.apply_translation(np.add(low, high) / 2.0)
    return out


def frame() -> trimesh.Trimesh:
    """The part, with sharp corners."""
    middle, top = SIZE[0] / 2.0, SIZE[2] + 1.0
    left = box((WALL, WALL, FLOOR), (middle - WALL / 2.0, SIZE[1] - WALL, top))
    right = box((middle + WALL / 2.0, WALL, FLOOR), (SIZE[0] - WALL, SIZE[1] - WALL, top))
    return trimesh.boolean.difference([box((0, 0, 0), SIZE), left, right], engine="manifold")


def print_plan(part: trimesh.Trimesh, cell: float) -> None:
    """One plan in cells of one size: roughed to 1 mm, released, finished."""
    began = process_time()
    profiles = m_shape(SIZE[2], 20.0, 0.6), odd_shape(SIZE[2], 5.0, 0.6)
    low, high = part.bounds
    release = plate_release(part, low, high, [1.0], profiles, Elastic(71_700.0, 0.33), cell)
    cuts = SideCut("z+", 1.0), SideCut("z+", 0.0)
    plan = MillingPlan(0.0, False, tuple(map(Clamping, cuts)))
    done = release.outcome(plan, part_surface(part, 8.0), 0.5)
    flat, moved = 1e3 * done.flatness.value, 1e3 * done.distortion.value
    print(
        f"cells of {cell:g} mm: {done.unknowns} unknowns at most, {process_time() - began:.1f} s; flatness {flat:.2f} "
        f"um, distortion {moved:.2f} um",
        flush=True,
    )


def print_search(part: trimesh.Trimesh) -> None:
    """The search of a job."""
    with tempfile.TemporaryDirectory() as folder:
        part.export(Path(folder) / "frame.stl")
        stress = {"shape": "m", "amplitude_mpa": 20.0, "across_share": 0.6, "rolling": "x", "source": "example"}
        values = {
            "residual_stress": stress,
            "part": {"file": "frame.stl", "units": "mm"},
            "stock": {"low_mm": [0.0, 0.0, -2.5], "high_mm": [*SIZE[:2], 37.5]},
            "workpiece": {"modulus_gpa": 71.7, "poisson": 0.33},
            "setup": [{"side": "z+"}, {"side": "z-"}],
            "choices": {"offset_mm": [2.5, 5.0, 7.5], "stock_mm": [1.0]},
            "limits": {"flatness_um": 20.0},
        }
        loaded = job_of(values, folder)
        began = process_time()
        done = run_job(loaded).outcome
    print(f"search: {len(done.others)} plans, {process_time() - began:.1f} s")
    for name, one in (("stated", done.stated), ("used", done.used)):
        value, low, high = (1e3 * x for x in (one.flatness.value, one.flatness.low, one.flatness.high))
        print(f"{name}: {one.plan.name}: flatness {value:.2f} um, {low:.2f} to {high:.2f}")
    print(f"of the cells: {100.0 * done.cell_error:.2f} %")


def print_state(part: trimesh.Trimesh, cell: float) -> None:
    """The finished frame on its underside in cells that a job takes: time of a state, its factors, 63 contact lines."""
    block = LayeredStock.block((0.0, 0.0, 0.0), SIZE, cell, 60.0)
    last = LayeredStock.of_mesh(part, cell, 60.0)
    held = Clamp("clamp", StockRegion(shapely.box(-1.0, -1.0, 121.0, 61.0), 0.0, 1e-3), np.ones(3, dtype=np.bool_))
    grid = cells_over(block, last, cell)[0]
    x = np.linspace(5.0, SIZE[0] - 5.0, 63)
    lines = np.stack([np.column_stack([x, 0.0 * x + WALL, 0.0 * x + z]) for z in (SIZE[2] - 4.0, SIZE[2])], axis=1)
    for again in (False, True):  # the first reads compiled loops
        began = process_time()
        work = cell_workpiece(last, grid, Elastic(71_700.0, 0.33), [held])
        made = process_time()
        found = line_compliances(work, lines)
        if again:
            print(
                f"state in cells of {grid.widest:.3g} mm: {3 * len(work.modes)} unknowns, {made - began:.2f} s, "
                f"factors {8e-6 * work.factors.entries:.0f} MB; 63 contact lines {process_time() - made:.2f} s, "
                f"at most {1e3 * float(found[:, 1, 1, 1].max()):.3f} um/N"
            )


def print_command(name: str, words: list[str]) -> float:
    """A command of chipload: its exit code, times, memory and verdict; return its processor time [s]."""
    began = monotonic()
    with tempfile.TemporaryFile("w+") as said:
        process = subprocess.Popen([sys.executable, "-m", "chipload", *words], stdout=said, stderr=subprocess.DEVNULL)
        _, status, used = os.wait4(process.pid, 0)
        said.seek(0)
        verdict = next((line.split(": ")[0] for line in said if line.startswith(("Holds", "Exceeds", "Unproven"))), "-")
    busy = used.ru_utime + used.ru_stime
    code = os.waitstatus_to_exitcode(status)
    print(
        f"{name}: exit {code}, {busy:.0f} s of processor time, {monotonic() - began:.0f} s, "
        f"{used.ru_maxrss / 1024.0:.0f} MiB, {verdict}",
        flush=True,
    )
    return busy


def print_proof(file: Path) -> None:
    """The whole proof of a part by the jobs that a draft has."""
    with tempfile.TemporaryDirectory() as folder:
        whole = print_command("init", ["init", str(file), folder])
        for job in sorted(Path(folder).glob("*.toml")):
            out = Path(folder) / "result" / job.stem
            whole += print_command(job.stem, ["run", str(job), "--accept", "--out", str(out)])
    print(f"whole: {whole:.0f} s of processor time")


def print_levels(depths: list[float]) -> None:
    """The example with levels of some depths [mm]: time of the walls, form error at 95 %, verdict."""
    job = Path(str(files("chipload") / "examples" / "frame"))
    with tempfile.TemporaryDirectory() as folder:
        programs = [Path(folder) / "pockets" / name for name in ("0-pocket.ngc", "1-pocket.ngc")]
        roughed = Path(folder) / "roughing"
        for depth in depths:
            # what exceeds is measured too: the engagement of a deep level is that of a shallow one
            levels = [depth] * int(WALLS // depth) + ([WALLS % depth] if WALLS % depth else [])
            planned = run_job(load_job(job / "job.toml", [f"operation.1.levels_mm={levels}"]))
            write_finished(planned.result, planned.presentation, programs[0].parent)
            if not roughed.exists():
                done = run_job(load_job(job / "roughing.toml", [f"program.file={programs[0]}"]))
                write_finished(done.result, done.presentation, roughed)
            sets = [f"program.file={programs[1]}", f"stock.file={roughed / 'stock.npz'}"]
            done = run_job(load_job(job / "walls.toml", sets))
            found = next(limit for limit in done.result.limits if limit.name == "form_error_um")
            worst, at_95 = found.worst or 0.0, found.value_at_confidence or 0.0
            print(
                f"levels of {depth:g} mm: {done.result.tracks[0].time_s:.1f} s, form error {worst:.1f} um, "
                f"{at_95:.1f} at 95 %, {found.state.value}",
                flush=True,
            )
            shutil.rmtree(programs[0].parent)


def print_level_plan(sets: list[str]) -> None:
    """The planned levels of the second operation of the example, with values in its job replaced."""
    job = load_job(Path(str(files("chipload") / "examples" / "frame")) / "job.toml", sets).job
    assert isinstance(job, ContourJob)
    inputs, began = read_inputs(job), process_time()
    found = planned_levels(job, job.operations[1], inputs.contours, inputs.top, inputs.material)
    print(f"{levels_text(found, job.limits['form_error_um'])}; {process_time() - began:.1f} s")


def main() -> None:
    """Print all measurements."""
    if sys.argv[1:2] == ["--plan"]:
        print_level_plan(sys.argv[2:])
        return
    if sys.argv[1:2] == ["--levels"]:
        print_levels([float(a) for a in sys.argv[2:]])
        return
    if sys.argv[1:2] == ["--proof"]:
        print_proof(Path(sys.argv[2]).resolve())
        return
    if sys.argv[1:2] == ["--state"]:
        print_state(frame(), float(sys.argv[2]) if len(sys.argv) > 2 else 3.0)
        return
    part = frame()
    for cell in [float(a) for a in sys.argv[1:]] or [8.0, 12.0]:
        print_plan(part, cell)
    print_search(part)
    print(f"memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0:.0f} MiB")


if __name__ == "__main__":
    main()
