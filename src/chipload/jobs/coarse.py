"""A first result in a fraction of the time: a job with coarser steps, layers and tolerances.

The geometry, limits and checks stay; only the resolution of the calculation changes, by overrides that the result lists
as those of ``--set``. Of a thin wall the first plan that holds is taken; plans that are not cut, with the least error
and compensated, are left out. What such a run finds is not proven: its result has an UNPROVEN finding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from chipload.errors import Finding, InputError, Severity
from chipload.jobs import FinishedJob, LoadedJob

#: of jobs that simulate a program: dotted key of the job -> factor, and the greatest value; cells of the
#: workpiece stay: wider ones than the job states may not resolve its thinnest wall, which is refused
SIMULATION: Mapping[str, tuple[float, float]] = {
    "operation.step_mm": (8.0, 100.0),
    "operation.tolerance_mm": (20.0, 0.1),
    "stock.layer_mm": (4.0, 1e3),
    "stock.chord_mm": (5.0, 1.0),
    "part.spacing_mm": (3.0, 1e3),
    "fixture.spacing_mm": (3.0, 1e3),
    "machine_table.spacing_mm": (3.0, 1e3),
    "workpiece.states": (0.25, 200.0),
}
#: the same by capability
FACTORS: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "program": SIMULATION,
    "feeds": SIMULATION,
    "contour": {"operation.step_mm": (10.0, 10.0)},
    # steps stay: longer ones miss what the teeth of a thin pass cut; films stay far below the least depth of cut
    "thinwall": {
        "operation.layer_mm": (1.5, 1.0),
        "operation.chord_mm": (5.0, 0.1),
        "operation.tolerance_mm": (2.5, 0.01),
        "operation.corner_slices": (0.25, 400),
    },
    "torque": {
        "operation.step_mm": (4.0, 10.0),
        "operation.layer_mm": (2.0, 10.0),
        "operation.tolerance_mm": (10.0, 0.1),
    },
    "impeller": {
        "operation.check_mm": (3.0, 1e3),
        "operation.rough.check_mm": (3.0, 1e3),
        "operation.rough.grid_mm": (3.0, 1e3),
        "operation.paths.check_mm": (3.0, 1e3),
    },
}
#: longest step of a simulation, in smallest diameters: a longer one is calculated at as many instants, and where its
#: engagement changes at 25 times as many all along
LONGEST_STEP = 1.0
#: layers of a stock that states none, in smallest diameters; slices of corner radii that a program job does not state
LAYER, SLICES = 0.2, 8
#: greatest distance of short blocks from the row that stands for them, in smallest diameters
JOINED = 0.02
#: cells of the stock that is shown are so many times as wide
WIDER = 4.0


def coarser(loaded: LoadedJob) -> tuple[str, ...]:
    """The overrides ``key.path=value`` that make a job coarse.

    Raises
    ------
    InputError
        Its capability has no resolution to change, or only pockets are cleared.
    """
    factors = FACTORS.get(loaded.capability.name)
    if factors is None:
        raise InputError(f"--coarse: a {loaded.capability.name} job has no steps that could be coarser: leave it out")
    table = loaded.job.table
    if loaded.capability.name == "contour" and all(op.kind == "pocket" for op in table.operation):
        raise InputError("--coarse: longer steps take more passes to clear a pocket, and leave more: leave it out")
    out = []
    for key, (factor, most) in factors.items():
        first, *rest = key.split(".")
        entries = getattr(table, first, None)
        for number, entry in enumerate(entries) if isinstance(entries, tuple) else ((None, entries),):
            path = [first, *([] if number is None else [str(number)]), *rest]
            value = _number_of_key(entry, rest)
            if value is not None:
                scaled = value * factor
                if factors is SIMULATION and key == "operation.step_mm" and loaded.job.cutters:
                    scaled = min(scaled, LONGEST_STEP * _smallest(loaded))
                # a tolerance that is above what is coarse stays
                new = max(min(scaled, most), value) if factor > 1.0 else max(scaled, 1)
                out.append(f"{'.'.join(path)}={format_value(int(new) if isinstance(value, int) else new)}")
    if factors is SIMULATION:
        out += _of_program(loaded)
    for k, op in enumerate(table.operation) if loaded.capability.name == "thinwall" else ():
        out += [f"operation.{k}.refine=false"] if op is table.operation[-1] and op.refine else []
        # comparisons, of which none is cut
        out += [f"operation.{k}.least_error=false"] if op.least_error else []
        out += [f"operation.{k}.compensate_um=0.0"] if op.compensate_um else []
    return tuple(out)


def format_value(value: float | int) -> str:
    """A number as ``--set`` takes it, to four digits.

    >>> format_value(0.024691), format_value(12)
    ('0.02469', '12')
    """
    return str(value) if isinstance(value, int) else f"{value:.4g}"


def _number_of_key(entry: Any, keys: Sequence[str]) -> float | int | None:
    """A number in a table and its tables; None: not stated."""
    for key in keys:
        entry = getattr(entry, key, None)
    return entry if isinstance(entry, (int, float)) and not isinstance(entry, bool) else None


def _smallest(loaded: LoadedJob) -> float:
    """The smallest diameter of the cutters of a job [mm]."""
    return float(min(cutter.resolved_diameter for cutter in loaded.job.cutters.values()))


def _may_join(job: Any) -> bool:
    """Whether short blocks may be simulated as one: nothing is compared with the path itself."""
    table = job.table
    compared = (getattr(table, key, None) for key in ("part", "workpiece"))
    return bool(job.cutters) and all(x is None for x in compared) and all(op.speeds is None for op in table.operation)


def _of_program(loaded: LoadedJob) -> list[str]:
    """What a simulation chooses by itself where it is not stated."""
    job = loaded.job
    out = []
    stock = job.table.stock
    saved = stock is not None and stock.file is not None and stock.file.lower().endswith(".npz")
    if stock is not None and stock.layer_mm is None and not saved and job.cutters:
        out.append(f"stock.layer_mm={format_value(LAYER * _smallest(loaded))}")
    for k, op in enumerate(job.table.operation):
        if op.corner_slices is None:
            out.append(f"operation.{k}.corner_slices={SLICES}")
        if loaded.capability.name == "program" and _may_join(job):
            join_mm = max(op.join_mm or 0.0, min(JOINED * _smallest(loaded), 1.0))
            out.append(f"operation.{k}.join_mm={format_value(join_mm)}")
        # nothing in a coarse run is proven; new feeds keep a reserve of the error
        if op.resolution_error and loaded.capability.name == "program":
            out.append(f"operation.{k}.resolution_error=false")
    return out


def mark_coarse(done: FinishedJob) -> FinishedJob:
    """The result of a coarse run: nothing in it is proven, and its stock is shown with wider cells."""
    text = "--coarse gives a first result with larger steps and thicker layers; run the job without it for a proof"
    finding = Finding("job-coarse", 0, text, Severity.UNPROVEN)
    result = replace(done.result, findings=(finding, *done.result.findings))
    blanks = done.presentation.blanks
    shown = replace(done.presentation, blanks=lambda: {k: replace(blank, wider=WIDER) for k, blank in blanks().items()})
    return replace(done, result=result, presentation=shown)
