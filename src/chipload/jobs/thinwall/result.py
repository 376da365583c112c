"""Result of a thin-wall job: a track for each variant, limits, findings, maps over the wall."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.default_checks import default_limits, range_findings, unchecked_checks, with_budget
from chipload.errors import Finding, Severity
from chipload.jobs.thinwall.chatter import FIRST_STATE, chatter_limits, chatter_numbers
from chipload.jobs.thinwall.outcome import OVER, USED, Finish, ThinWallResult, Variant, remedy_text
from chipload.jobs.thinwall.part_shape import PartShape
from chipload.number_text import number_text
from chipload.program.time import time_high
from chipload.report.programs import ENDINGS, program_name
from chipload.result import (
    CoveredRows,
    LimitCheck,
    Result,
    SurfaceMap,
    Track,
    TrackKind,
    Verdict,
    check_limit,
    error_of,
    in_memory,
    state_of,
)
from chipload.simulation.accuracy import energy_balance
from chipload.simulation.deflection_jumps import jump_findings

Floats = NDArray[np.float64]
Place = tuple[float, float, float] | None

#: contact points over their allowable force that are listed, the worst first
LISTED = 100
#: columns of the plan that the history does not keep
DROPPED = ("u", "v", "side", "operation", "label", "compliance_error", FIRST_STATE)
#: in place of a specific energy [MPa]: some step of a wall always has engaged edge
ENGAGED = 1.0
#: limits that are proportional to the compliance of the wall
OF_COMPLIANCE = ("deflection_workpiece_um", "deflection_um", "force_over_allowable")
#: loads to which a limit is proportional, where it is not a load itself
GOES_WITH = {
    "deflection_workpiece_um": ("force_normal_n",),
    "force_over_allowable": ("force_normal_n",),
    "form_error_um": ("force_normal_n",),
    "stress_mpa": ("force_normal_n",),
    "deflection_um": ("force_normal_n", "force_n"),
    "deflection_cutter_um": ("force_n",),
}


def result_of(walled: ThinWallResult) -> Result:
    """The result of a thin wall; the variant in use first."""
    tracks = [_track(walled, one) for one in walled.variants.values()]
    tracks.sort(key=lambda track: not track.in_use)
    variable = walled.variants[USED]
    return Result(
        capability="thinwall",
        title=walled.title,
        tracks=tuple(tracks),
        operations=(_operation(walled, variable),),
        findings=walled.findings,
        unchecked=(
            *unchecked_checks(walled.checks),
            *(f"limit {name}: not stated" for name in walled.unchecked),
            *_unchecked_bodies(walled),
            *(() if "dynamics" in walled.settings else ("chatter: not calculated",)),
            _not_calculated(walled),
        ),
        provenance=walled.provenance,
        maps=tuple(_maps(walled)),
        note=_note(walled),
    )


def _not_calculated(walled: ThinWallResult) -> str:
    """Effects of the deflection that no variant accounts for."""
    shape = walled.geometry.shape
    if isinstance(shape, PartShape) and shape.floors:
        return "smaller depth of cut on a bent floor: not calculated"
    return "bending by tangential forces, smaller depth of cut on a bent wall: not calculated"


def _unchecked_bodies(walled: ThinWallResult) -> tuple[str, ...]:
    """Bodies that are not checked for collisions."""
    cutters = walled.planning.cutters
    alone = not isinstance(walled.geometry.shape, PartShape) and not walled.settings.get("neighbours")
    return (
        *(f"holder of tool {number}: not stated" for number, cutter in cutters.items() if not cutter.holder),
        *(["neighbours: none is stated"] if alone else []),
        "clamps and machine: no collision check",
    )


def limits_of(walled: ThinWallResult, one: Variant) -> tuple[LimitCheck, ...]:
    """Limit checks of a variant: those of the job, the force at each contact point, the yield stress, the gouge, and
    the default checks.
    """
    c, out = one.columns, []
    for name, limit in walled.limits.items():
        if name == "form_error_um":
            out.append(with_budget(_form_error(walled, one, limit), walled.checks, c))
        else:
            check = check_limit(name, limit, c, track=one.name, error=limit_error(walled, one, name))
            out.append(with_budget(check, walled.checks, c))
    over, cuts = "force_over_allowable", c["force_normal_n"] > 0.0
    pressing = CoveredRows(cuts, "cuts that press on the wall", "where the wall is bent")
    force = check_limit(over, 1.0 + OVER, c, track=one.name, rows=pressing, error=limit_error(walled, one, over))
    strength = float(walled.settings["yield_mpa"])
    stress = _limit_check("stress_mpa", strength, one.stress, one, limit_error(walled, one, "stress_mpa"))
    out += [with_budget(check, walled.checks, c) for check in (force, stress)]
    gouge, tolerance = max(one.shape.gouge, -one.shape.nearest, 0.0), float(walled.settings["gouge_tolerance_mm"])
    # the written text rounds its places: what is less than its last digit is no gouge
    gouge = gouge if gouge >= 10.0**-walled.planning.machine.decimals else 0.0
    place = (float(one.shape.at[0]), float(one.shape.at[1]), float(one.shape.at[2]))
    state, why = state_of(gouge, tolerance + one.shift, 0.0)[0], ""
    if one.shift > 0.0 and state is Verdict.HOLDS:
        state, why = (
            Verdict.UNPROVEN,
            "the path is shifted against the form error: the gouge is known to within the greatest shift only",
        )
    out.append(
        LimitCheck(
            "gouge_mm", tolerance + one.shift, gouge, state, one.name, place=place, resolution_error=0.0, reason=why
        )
    )
    out += chatter_limits(walled.settings.get("dynamics"), c, one.name, limit_error(walled, one, "force_n"))
    return (*out, *default_limits(walled.checks, walled.planning.machine, c, one.name, one.load_error))


def limit_error(walled: ThinWallResult, one: Variant, name: str) -> float:
    """Relative error of the value that a limit bounds: of the loads by layers and steps, and of the mesh."""
    loads = max(error_of(load, one.load_error) for load in GOES_WITH.get(name, (name,)))
    return (1.0 + loads) * (1.0 + mesh_error_of(walled, name, one.columns)) - 1.0


def mesh_error_of(walled: ThinWallResult, name: str, columns: Mapping[str, NDArray[Any]]) -> float:
    """Relative increase of the greatest value of a column by the error of the mesh; 0: it does not depend on the
    compliance.

    Thresholds that experiments gave have none of it.
    """
    if name not in OF_COMPLIANCE or (name == "force_over_allowable" and walled.planning.threshold_source != "modelled"):
        return 0.0
    values = np.abs(columns[name])
    return _growth(values, columns["compliance_error"])


def _growth(values: Floats, error: Floats) -> float:
    """Growth of the greatest value, if each value grows by its own relative error."""
    greatest = float(values.max(initial=0.0))
    return float((values * (1.0 + error)).max()) / greatest - 1.0 if greatest > 0.0 else 0.0


def findings_of(walled: ThinWallResult, one: Variant) -> tuple[Finding, ...]:
    """Findings of a variant in addition to its limit checks."""
    out = list(one.beyond)
    if one.plan.infeasible:
        worst = min(one.plan.infeasible, key=lambda h: h.force_allowable_n)
        text = (
            f"{len(one.plan.infeasible)} places do not allow even the smallest depth of cut: allowable force "
            f"{number_text(worst.force_allowable_n)} N, needed {number_text(worst.force_n)} N: {remedy_text(worst)}"
        )
        out.append(Finding("thinwall-infeasible", 0, text, Severity.EXCEEDS, worst.at))
    missed = sum(int((~f.made).sum()) for f in one.finish)
    if missed:
        text = f"{missed} points of the finished surface are not reached by any step"
        out.append(Finding("thinwall-not-finished", 0, text, Severity.EXCEEDS))
    rapids = int((one.columns["rapid"] & (one.columns["chip_areas"] > 0)).sum())
    if rapids:
        out.append(Finding("rapid-cuts", 0, f"{rapids} rapids go through material", Severity.EXCEEDS))
    for c in one.shape.collisions:
        text = f"{c.what} goes {c.depth_mm:.3g} mm into {c.into}"
        out.append(Finding("collision", c.line, text, Severity.EXCEEDS, c.at, c.step))
    return (*out, *_jumps(walled, one.columns), *range_findings(walled.checks, one.columns))


def _jumps(walled: ThinWallResult, columns: Mapping[str, NDArray[Any]]) -> tuple[Finding, ...]:
    """Steps that bend the wall more or less per newton than their neighbours explain."""
    step = np.flatnonzero((columns["force_normal_n"] > 0.0) & (columns["deflection_workpiece_um"] > 0.0))
    place = np.column_stack([columns[f"contact_{x}_mm"][step] for x in "xyz"])
    gives = columns["deflection_workpiece_um"][step] / columns["force_normal_n"][step]
    reach = max(cutter.diameter for cutter in walled.checks.cutters.values())
    return jump_findings(columns, step, place, gives, reach, "force_normal_n")


def verdict_of(walled: ThinWallResult, one: Variant) -> Verdict:
    """Return the verdict of a variant, that of its track."""
    states = [Verdict.of_finding(f) for f in findings_of(walled, one)] + [c.state for c in limits_of(walled, one)]
    return Verdict.worst(states)


def failures_of(walled: ThinWallResult, one: Variant) -> tuple[str, ...]:
    """Reasons why a variant does not hold, the worst first."""
    found = [(Verdict.of_finding(f), f.text) for f in findings_of(walled, one)]
    found += [(c.state, c.text) for c in limits_of(walled, one)]
    return tuple(text for state in (Verdict.EXCEEDS, Verdict.UNPROVEN) for s, text in found if s is state)


def _track(walled: ThinWallResult, one: Variant) -> Track:
    stem, columns = program_name(0, one.name), dict(one.columns)
    columns["cutting_s"] = columns.pop("seconds")
    return Track(
        name=one.name,
        kind=TrackKind.VARIANT,
        in_use=one.name == USED,
        time_s=one.seconds,
        time_high_s=time_high(one.program, walled.planning.machine, one.seconds),
        limits=limits_of(walled, one),
        findings=findings_of(walled, one),
        programs=(f"{stem}.{ENDINGS[walled.planning.machine.dialect]}", f"{stem}.apt"),
        energy_balance=energy_balance(one.columns, ENGAGED),
        blocks=in_memory({name: values for name, values in columns.items() if name not in DROPPED}),
    )


def _limit_check(name: str, limit: float, worst: float, one: Variant, error: float, place: Place = None) -> LimitCheck:
    """The check of one value of a variant with its relative error; inf: it is not known."""
    state, why = state_of(worst, limit, error)
    known = error if np.isfinite(error) else 0.0
    return LimitCheck(name, limit, worst, state, one.name, place=place, resolution_error=known, reason=why)


def _form_error(walled: ThinWallResult, one: Variant, limit: float) -> LimitCheck:
    """The form error of the finished sides, where it is greatest."""
    worst, place = 0.0, None
    for f in one.finish:
        size = np.where(f.made, np.abs(f.error), -1.0)
        k = np.unravel_index(int(np.argmax(size)), size.shape)
        if 1000.0 * size[k] > worst:
            worst = 1000.0 * float(size[k])
            place = (float(f.points[k][0]), float(f.points[k][1]), float(f.points[k][2]))
    if not one.finish:
        return LimitCheck("form_error_um", limit, None, Verdict.UNPROVEN, one.name, reason="no side is finished")
    sizes = [(np.where(f.made, np.abs(f.error), 0.0).ravel(), f.unsure.ravel()) for f in one.finish]
    mesh = _growth(*(np.concatenate(x) for x in zip(*sizes, strict=True)))
    error = (1.0 + limit_error(walled, one, "form_error_um")) * (1.0 + mesh) - 1.0
    return _limit_check("form_error_um", limit, worst, one, error, place)


def _operation(walled: ThinWallResult, v: Variant) -> dict[str, Any]:
    c = walled.variants["constant"]
    return {
        "kind": "thinwall",
        "in_use": USED,
        "wall": walled.geometry.shape.name,
        **_part_numbers(walled),
        "threshold_source": walled.planning.threshold_source,
        "threshold": walled.planning.threshold_text,
        "reserve": walled.planning.last.reserve,
        "step_over_mm": walled.planning.last.step_over,
        "feed_per_tooth_mm": walled.planning.last.feed_per_tooth,
        "operations": [_cut_by(walled, v, number) for number in range(len(walled.planning.operations))],
        "time_constant_over_variable": c.seconds / v.seconds,
        "variants": {name: _variant(one, walled.settings.get("dynamics")) for name, one in walled.variants.items()},
        "infeasible": [
            {
                "side": h.side,
                "place": list(h.at),
                "force_allowable_n": h.force_allowable_n,
                "force_n": h.force_n,
                "feed_per_tooth_mm": h.feed_per_tooth_mm,
                "diameter_mm": h.diameter_mm,
                "helps": remedy_text(h),
            }
            for h in v.plan.infeasible
        ],
        "settings": dict(walled.settings),
    }


def _cut_by(walled: ThinWallResult, one: Variant, number: int) -> dict[str, Any]:
    """What an operation does in a variant."""
    own, c = walled.planning.operations[number], one.columns
    rows = c["operation"] == number
    depth = [m.depth for m in one.plan.maps if m.operation == number]
    return {
        "cutter": own.cutter.number,
        "rows": own.rows,
        "leave_mm": own.leave,
        "step_over_mm": own.step_over,
        "feed_per_tooth_mm": own.feed_per_tooth,
        "passes": len(depth),
        "depth_mm_max": max(float(d.max()) for d in depth),
        "chip_volume_mm3": float(c["chip_volume_mm3"][rows].sum()),
        "force_normal_n_max": float(c["force_normal_n"][rows].max(initial=0.0)),
        "deflection_workpiece_um_max": float(c["deflection_workpiece_um"][rows].max(initial=0.0)),
    }


def _part_numbers(walled: ThinWallResult) -> dict[str, Any]:
    """Of a part: its walls, and its cells."""
    shape = walled.geometry.shape
    if not isinstance(shape, PartShape):
        return {}
    sides = [
        {"wall": s.wall, "face": int(s.name), "allowance_mm": s.allowance, "length_mm": s.size()[0],
         "height_mm": s.size()[1]}
        for s in shape.each
    ]  # fmt: skip
    return {"sides": sides, "thinnest_wall_mm": shape.thickness, "part": dict(walled.settings["part"])}


def _variant(one: Variant, dynamics: Mapping[str, Any] | None) -> dict[str, Any]:
    c = one.columns
    cuts = c["force_normal_n"] > 0.0
    known = cuts & (c["force_normal_planned_n"] > 0.0)
    ratio = c["force_normal_n"][known] / c["force_normal_planned_n"][known]
    return {
        "passes": len(one.plan.maps),
        "time_min": one.seconds / 60.0,
        "deflection_workpiece_um_max": 1000.0 * one.deflection,
        "form_error_um_max": 1000.0 * one.error,
        "form_error_um_rms": 1000.0 * one.error_rms,
        "force_normal_n_max": one.force,
        "order": one.plan.order,
        "passes_in_the_other_order": one.plan.passes_otherwise,
        "planned": {
            "deflection_workpiece_um_allowed": 1000.0 * one.plan.limit if np.isfinite(one.plan.limit) else None,
            "deflection_workpiece_um_max": None if one.plan.deflection is None else 1000.0 * one.plan.deflection,
            "force_normal_n_max": one.plan.force,
        },
        "depth_mm": {
            "min": min(float(m.depth[m.depth > 0.0].min()) for m in one.plan.maps if (m.depth > 0.0).any()),
            "max": max(float(m.depth.max()) for m in one.plan.maps),
        },
        "contact_points": int(cuts.sum()),
        "energy_balance": {str(tool): x for tool, x in energy_balance(c, ENGAGED).items()},
        "force_over_allowable_max": float(c["force_over_allowable"].max(initial=0.0)),
        "force_over_planned": {"median": float(np.median(ratio)), "max": float(ratio.max())} if len(ratio) else None,
        "over_threshold": len(one.over),
        "over_threshold_at": [
            {
                "pass": str(c["pass"][k]),
                "line": int(c["line"][k]),
                "place": [float(c[f"contact_{x}_mm"][k]) for x in "xyz"],
                "force_n": float(c["force_normal_n"][k]),
                "force_allowable_n": float(c["force_allowable_n"][k]),
            }
            for k in one.over[:LISTED]
        ],
        "deflection_cutter_um_max": float(c["deflection_cutter_um"].max(initial=0.0)),
        "torque_nm_max": float(c["torque_nm"].max(initial=0.0)),
        "power_w_max": float(c["power_w"].max(initial=0.0)),
        "chip_volume_mm3": float(c["chip_volume_mm3"].sum()),
        "stress_mpa_max": one.stress,
        "gouge_um": 1000.0 * one.shape.gouge,
        "left_um": 1000.0 * one.shape.left,
        "cutter_to_wall_um_min": 1000.0 * one.shape.nearest,
        "scallop_um_max": 1000.0 * max((float(f.rigid[f.made].max(initial=0.0)) for f in one.finish), default=0.0),
        "steps": len(c["line"]),
        "program": program_name(0, one.name),
        "moved_um_max": 1000.0 * one.shift,
        **chatter_numbers(one, dynamics),
    }


def _maps(walled: ThinWallResult) -> list[SurfaceMap]:
    """Form error of every variant's finished sides, and depth and allowable force of every pass of the one in use."""
    out = [
        _map(f"form error, {one.name}, side {f.side + 1}", "form_error_um", f, one.name)
        for one in walled.variants.values()
        for f in one.finish
    ]
    for k, m in enumerate(walled.variants[USED].plan.maps):
        for column, values in (("depth_mm", m.depth), ("force_allowable_n", m.threshold)):
            name = f"{column}, pass {k + 1}, side {m.side + 1}"
            points = np.asarray(m.points).reshape(-1, 3)
            out.append(SurfaceMap(name, column, points, np.asarray(values).ravel(), _faces(m.depth.shape), USED))
        if m.stable is not None:
            name, points = f"stable depth, pass {k + 1}, side {m.side + 1}", np.asarray(m.points).reshape(-1, 3)
            out.append(SurfaceMap(name, "depth_mm", points, m.stable.ravel(), _faces(m.depth.shape), USED))
    return out


def _map(name: str, column: str, f: Finish, track: str) -> SurfaceMap:
    values = np.where(f.made, 1000.0 * f.error, np.nan)
    return SurfaceMap(name, column, np.asarray(f.points).reshape(-1, 3), values.ravel(), _faces(values.shape), track)


def _faces(shape: tuple[int, ...]) -> NDArray[np.int64]:
    """(m, 3) triangles of a grid of points."""
    at = np.arange(shape[0] * shape[1]).reshape(shape[:2])
    a, b, c, d = (x.ravel() for x in (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]))
    return np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def _note(walled: ThinWallResult) -> str:
    """Variable against constant depth."""
    v, c = walled.variants[USED], walled.variants["constant"]
    minutes = (
        f"{number_text(v.seconds / 60.0)} min with variable depth, {number_text(c.seconds / 60.0)} min with "
        "constant depth"
    )
    if v.deflection > c.deflection * (1.0 + 1e-9):
        minutes += (
            f", which bends the wall by {number_text(1e3 * c.deflection)} µm instead of "
            f"{number_text(1e3 * v.deflection)} µm"
        )
    bad = failures_of(walled, c)
    return f"{minutes}, which does not hold: {bad[0]}." if bad else f"{minutes} within the same limits."
