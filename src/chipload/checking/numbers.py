"""The numbers of a program in summary.json: of its text and of its simulation.

Notation: means are over the time in which material is cut at a feed; greatest and least values are over all rotations
of the spindle in all steps. Forces are on the cutter, in the workpiece frame.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking import part_numbers
from chipload.checking.outcome import ProgramResult, SimulationResult
from chipload.checking.stability import stability_numbers
from chipload.cutting.strength import allowed_stress
from chipload.program.motions import lengths
from chipload.program.program import DWELL, RAPID
from chipload.units import mm_min_from_mm_s

Floats = NDArray[np.float64]


def program_numbers(read: ProgramResult) -> dict[str, Any]:
    """Return the numbers of the program text."""
    program = read.reading.program
    length, rapid = lengths(program), program.motion == RAPID
    cuts = ~rapid & (program.motion != DWELL)
    low, high = program.p_work.min(axis=0), program.p_work.max(axis=0)
    feeds = mm_min_from_mm_s(1.0) * program.feed[cuts & (length > 0.0)]
    return {
        "file": read.name,
        "motions": len(read.reading.commands),
        "path_mm": float(length.sum()),
        "cutting_mm": float(length[cuts].sum()),
        "rapid_mm": float(length[rapid].sum()),
        "time_s": float(read.seconds.sum()),
        "box_mm": {"low": low.tolist(), "high": high.tolist()},
        "feed_mm_min": {"min": float(feeds.min()), "max": float(feeds.max())} if len(feeds) else None,
        "tools": sorted({int(t) for t in program.tool}),
        "tilted": bool((np.abs(program.axis - (0.0, 0.0, 1.0)).max(axis=1) > 1e-9).any()),
    }


def operation_numbers(simulation: SimulationResult, time_s: float) -> dict[str, Any]:
    """Return the operation in summary.json; ``time_s`` is its time on the machine, with rapids and accelerations."""
    removal = simulation.removal
    c = removal.columns
    cuts = (c["chip_volume_mm3"] > 0.0) & ~c["rapid"]
    seconds = np.where(cuts, c["seconds"], 0.0)
    whole = float(seconds.sum())

    def mean(name: str) -> float:
        return float((c[name] * seconds).sum() / whole) if whole > 0.0 else 0.0

    force: dict[str, dict[str, float | None]] = {
        x: {
            "mean": mean(f"force_{x}_mean_n"),
            "max": float(c[f"force_{x}_max_n"].max(initial=0.0)),
            "min": float(c[f"force_{x}_min_n"].min(initial=0.0)),
        }
        for x in "xyz"
    }
    band = removal.mean_band
    for x, sd in zip("xyz", band[:3] if band is not None else (None,) * 3, strict=True):
        force[x]["mean_sd"] = sd
    normal = float(c["force_normal_n"].max(initial=0.0))
    torque = {"mean": mean("torque_mean_nm"), "max": float(c["torque_nm"].max(initial=0.0))}
    return {
        "kind": "simulate",
        "steps": len(c["line"]),
        "chip_areas_max": int(c["chip_areas"].max(initial=0)),
        "chip_volume_mm3": float(c["chip_volume_mm3"].sum()),
        "films_mm3": float(c["chip_volume_mm3"][c["chip_areas"] == 0].sum()),
        "stock_before_mm3": removal.volume_before,
        "removed_mm3": removal.volume_before - removal.volume_after,
        "time_s": time_s,
        **_times(c, cuts, time_s),
        "force_n": {**force, "max": float(c["force_n"].max(initial=0.0)), "normal_max": normal},
        "torque_nm": torque | {"mean_sd": band[3] if band is not None else None},
        "power_w": {"mean": mean("power_w"), "max": float(c["power_w"].max(initial=0.0))},
        "chip_max_mm": {"max": float(c["chip_max_mm"].max(initial=0.0))},
        "deflection_um": deflection(simulation),
        **workpiece(simulation),
        "form_error_um": form_error(simulation),
        **part_numbers.numbers(simulation.left, c),
        "collisions": part_numbers.collision_rows(simulation.collisions.found, c),
        "compared_with": list(simulation.collisions.compared_with),
        "no_holder": list(simulation.collisions.no_holder),
        "energy_balance": {str(tool): value for tool, value in removal.energy_balance.items()},
        "resolution_error": {k: v if math.isfinite(v) else None for k, v in removal.resolution_error.items()},
        "checks_off": list(simulation.checks.off),
        "band_error": dict(removal.band_error),
        "cutter_stress_mpa": {
            "max": float(c["cutter_stress_mpa"].max(initial=0.0)),
            "allowed": _allowed_stresses(simulation),
        },
        "settings": dict(simulation.settings),
        **({} if simulation.stability is None else {"stability": stability_numbers(simulation.stability, c)}),
    }


def _times(c: Mapping[str, NDArray[Any]], cuts: NDArray[np.bool_], time_s: float) -> dict[str, float]:
    """Return the time on the machine in the cut, in air, in rapids and dwells, and what remains: they add up."""
    moving, wait = c["duration_s"] - c["wait_s"], float(c["wait_s"].sum())
    cut, air = float(moving[cuts].sum()), float(moving[~cuts & ~c["rapid"]].sum())
    rapid = float(moving[c["rapid"]].sum())
    other = time_s - cut - air - rapid - wait
    return {
        "cutting_s": cut, "air_cut_s": air, "rapid_s": rapid, "dwell_s": wait,
        "other_s": 0.0 if abs(other) <= 1e-9 * max(time_s, 1.0) else other,
    }  # fmt: skip


def _allowed_stresses(simulation: SimulationResult) -> dict[str, dict[str, Any]]:
    """Return the allowed stress of each cutter, and the source of its strength."""
    return {
        str(n): {
            "mpa": allowed_stress(c),
            "tool_material": c.strength.material_at(c.modulus).value,
            "safety_factor": c.strength.safety_factor,
            "stress_concentration": c.strength.concentration,
            "source": c.strength.source(c.modulus),
        }
        for n, c in sorted(simulation.checks.cutters.items())
    }


def deflection(simulation: SimulationResult) -> dict[str, Any]:
    """Return the deflection of tool and work for summary.json; what is not stated counts as rigid."""
    c = simulation.removal.columns
    k = int(np.argmax(c["deflection_um"]))
    return {
        "max": float(c["deflection_um"][k]),
        "cutter_max": float(c["deflection_cutter_um"].max()),
        "workpiece_max": float(c["deflection_workpiece_um"].max()) if "deflection_workpiece_um" in c else None,
        "line": int(c["line"][k]),
        "place": [float(c[f"{x}_mm"][k]) for x in "xyz"],
        "not_stated": list(simulation.rigid),
    }


def workpiece(simulation: SimulationResult) -> dict[str, Any]:
    """Return the deflection of the workpiece at the cut for summary.json; empty if no [workpiece] is stated."""
    if simulation.workpiece is None:
        return {}
    c = simulation.removal.columns
    k = int(np.argmax(c["deflection_workpiece_um"]))
    place = [float(c[f"{x}_mm"][k]) for x in "xyz"]
    worst = {"max": float(c["deflection_workpiece_um"][k]), "line": int(c["line"][k]), "place": place}
    strained = simulation.workpiece.strained
    stress = {} if strained is None else {"stress_mpa_max": strained.worst(c["force_n"])[1]}
    return {"deflection_workpiece_um": worst, **stress, **simulation.workpiece.numbers}


def form_error(simulation: SimulationResult) -> dict[str, Any]:
    """Return the form error by deflection (below 0: removed) for summary.json; None without finished points."""
    c = simulation.removal.columns
    points = int(c["form_points"].sum()) if "form_points" in c else 0
    if not points:
        return {"max": None, "greatest": None, "least": None, "line": 0, "place": None, "points": 0}
    error = c["form_error_um"]
    k = int(np.argmax(np.abs(error)))
    ends = {"max": abs(float(error[k])), "greatest": float(error.max()), "least": float(error.min())}
    return {**ends, "line": int(c["line"][k]), "place": [float(c[f"{x}_mm"][k]) for x in "xyz"], "points": points}
