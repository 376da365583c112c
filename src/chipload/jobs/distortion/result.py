"""The result of a distortion job: tracks of the plan in use and of the stated one, a map, numbers of all plans."""

from __future__ import annotations

from typing import Any

import numpy as np

from chipload.jobs.distortion.outcome import Banded, DistortionResult, PlanOutcome
from chipload.jobs.distortion.plans import MillingPlan
from chipload.number_text import number_text
from chipload.result import LimitCheck, Result, SurfaceMap, Track, TrackKind, state_of

#: micrometres in a millimetre
UM = 1e3


def result_of(done: DistortionResult) -> Result:
    """Return the result of a distortion job."""
    same = done.used.plan == done.stated.plan
    tracks = [_track(done, done.used, True, "stated plan" if same else "chosen plan")]
    if not same:
        tracks.append(_track(done, done.stated, False, "stated plan"))
    return Result(
        capability="distortion",
        title=done.title,
        tracks=tuple(tracks),
        operations=({"kind": "distortion", **numbers(done)},),
        findings=done.findings,
        unchecked=tuple(f"limit {name}: not stated" for name in done.job.unchecked),
        provenance=done.provenance,
        maps=(shape_map(done),),
        note=note(done),
    )


def note(done: DistortionResult) -> str:
    """The plan in use in a sentence, and what it is flatter than."""
    flat, stated = done.used.flatness, done.stated.flatness
    text = f"Flatness {number_text(UM * flat.value, 3)} µm, {_band(flat)}, with the {done.used.plan.name}."
    if done.used.plan != done.stated.plan:
        text += f" As stated: {number_text(UM * stated.value, 3)} µm."
    return text


def _band(value: Banded) -> str:
    return f"{number_text(UM * value.low, 3)} to {number_text(UM * value.high, 3)} µm from plate to plate"


def _track(done: DistortionResult, one: PlanOutcome, in_use: bool, name: str) -> Track:
    values = {"flatness_um": one.flatness, "distortion_um": one.distortion}
    limits = tuple(_check(done, name, key, limit, values[key]) for key, limit in done.job.limits.items())
    plan: dict[str, float | str] = {
        "plan": one.plan.name,
        "offset_mm": one.plan.offset,
        "upside_down": "yes" if one.plan.flipped else "no",
    }
    return Track(name, TrackKind.VARIANT, in_use, None, limits, parameters=plan)


def _check(done: DistortionResult, track: str, name: str, limit: float, value: Banded) -> LimitCheck:
    worst = UM * value.value
    error = value.error + done.cell_error
    state, why = state_of(worst, limit, error)
    reason = f"{_band(value)}: {why}" if why else ""
    return LimitCheck(name, limit, worst, state, track, resolution_error=float(min(error, 1e6)), reason=reason)


def shape_map(done: DistortionResult) -> SurfaceMap:
    """Deviation of the surface, with its displacement over the best place of the part."""
    surface, moved = done.surface, done.used.moved
    faces = np.arange(len(surface.points)).reshape(-1, 3)
    rest = surface.relative_motion(moved)
    return SurfaceMap(
        "part after release", "distortion_um", surface.points, UM * surface.deviations(moved), faces, displacement=rest
    )


def numbers(done: DistortionResult) -> dict[str, Any]:
    """Return the numbers of the job as JSON values."""
    return {
        "plate_mm": done.job.profile.thickness,
        "stress_mpa": done.job.profile.greatest,
        "balanced_share": done.job.unbalance,
        "thinnest_mm": done.wall,
        "cell_mm": done.cell,
        "cell_error": done.cell_error,
        "unknowns": done.used.unknowns,
        "plans": [
            {**_plan(plan), "flatness_um": _um(flat), "distortion_um": _um(dist)} for plan, flat, dist in done.others
        ],
        "faces": {name: _um(value) for name, value in done.used.faces.items()},
        "clamp_force_n": done.used.clamp_force.tolist(),
    }


def _plan(plan: MillingPlan) -> dict[str, Any]:
    setups = [{"side": s.cut.side, "stock_mm": s.cut.stock} for s in plan.setups]
    return {"offset_mm": plan.offset, "upside_down": plan.flipped, "setups": setups}


def _um(value: Banded) -> dict[str, float]:
    return {"value": UM * value.value, "low": UM * value.low, "high": UM * value.high}
