"""Goals of speed that other benchmarks measure, for the table of ``benchmarks/engines.py``.

Pockets beside FreeCAD's Adaptive (``benchmarks/pockets.py``) and the feeds example in processor seconds, each the
median of three; a clone up to its first verdict (``benchmarks/first_verdict.py``) by the clock, on a computer that does
nothing else.
"""

from __future__ import annotations

import math
import os
import shutil
import statistics
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from first_verdict import VERDICT, events
from pockets import POCKETS, adaptive_path, planned_path

from chipload import examples
from chipload.geometry.contour import Region
from chipload.geometry.dxf import read_dxf
from chipload.jobs import load_job, run_job

#: planning of a pocket over that of Adaptive; both runs of the feeds example [s]; clone [s]
ADAPTIVE, FEEDS_S, FRESH_S = 1.0, 2.0, 90.0
#: runs of which the median counts; longest run of FreeCAD [s]; its tolerance, and lines of the wave, as by default
RUNS, LONGEST_S, TOLERANCE = 3, 120.0, 0.1
#: drawings that Adaptive does not clear, or no cutter
LEFT_OUT = ("text",)


class Goal(NamedTuple):
    """What is measured, the goal, the value (nan: not measured), its unit, whether the goal is the least value."""

    work: str
    goal: float
    found: float
    unit: str
    least: bool


def beside_adaptive(names: list[str]) -> float:
    """Median over some drawings of the processor time of the pocket planner over that of Adaptive; nan: no FreeCAD, or
    no drawings.
    """
    program = shutil.which("freecadcmd") or shutil.which("FreeCADCmd")
    data = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2] / "shared" / "data"))
    ratios = []
    for name in names if program is not None else ():
        file = data / "cad" / "dxf_hsm_nibbler" / f"{name}.dxf"
        if not file.is_file():
            continue
        drawing = read_dxf(file, units_if_unstated="mm")
        region = Region.of([c for c in drawing.contours if c.closed])
        theirs = [adaptive_path(region, POCKETS[name], program, TOLERANCE, LONGEST_S) for _ in range(RUNS)]
        known = [found[1] for found in theirs if found is not None]
        if known:
            own = [planned_path(region, POCKETS[name])[1] for _ in range(RUNS)]
            ratios.append(statistics.median(own) / statistics.median(known))
    return statistics.median(ratios) if ratios else math.nan


def feeds_example() -> float:
    """Processor seconds of a run of the feeds example, which simulates its program twice, once it is compiled."""
    with tempfile.TemporaryDirectory() as folder:
        job = examples.copy_example("feeds", Path(folder) / "feeds") / "job.toml"
        run_job(load_job(job))
        times = []
        for _ in range(RUNS):
            begun = time.process_time()
            run_job(load_job(job))
            times.append(time.process_time() - begun)
    return statistics.median(times)


def goals(measured: bool, fresh: bool) -> list[Goal]:
    """The rows; those that are not asked for have no value.

    Parameters
    ----------
    measured : pockets and feeds
    fresh : a clone, which downloads packages
    """
    pockets = [name for name in POCKETS if name not in LEFT_OUT]
    adaptive = beside_adaptive(pockets) if measured else math.nan
    feeds = feeds_example() if measured else math.nan
    first = next((s for name, s in events() if VERDICT.match(name)), math.inf) if fresh else math.nan
    return [
        Goal("planning a pocket over Adaptive, median of the drawings", ADAPTIVE, adaptive, "times", False),
        Goal("feeds example, both simulations and report values", FEEDS_S, feeds, "s", False),
        Goal("clone to first verdict, by the clock", FRESH_S, first, "s", False),
    ]
