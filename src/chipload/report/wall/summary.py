"""summary.json and history.parquet of a thin wall, and its programs; equal runs give equal bytes."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from chipload.program.apt.writer import write_apt
from chipload.program.gcode.writer import write_commands
from chipload.report.programs import ENDINGS
from chipload.report.summary import program_name
from chipload.report.wall.outcome import OVER, USED, Variant, Walled, fails, helps, verdict

#: contact points over their threshold that are listed, the worst first
LISTED = 100


def summary(walled: Walled) -> dict[str, Any]:
    """The content of summary.json as plain values."""
    holds, says = verdict(walled)
    v, c = walled.variants["variable"], walled.variants["constant"]
    return {
        "holds": holds,
        "says": says,
        "job": walled.title,
        "operations": [
            {
                "kind": "thinwall",
                "use": USED,
                "holds": holds,
                "wall": walled.wall.name,
                "threshold_source": walled.threshold_source,
                "threshold": walled.threshold_text,
                "reserve": walled.reserve,
                "step_over_mm": walled.step_over,
                "feed_per_tooth_mm": walled.feed_per_tooth,
                "time_constant_over_variable": c.seconds / v.seconds,
                "variants": {name: _variant(walled, one) for name, one in walled.variants.items()},
                "infeasible": [
                    {
                        "side": h.side,
                        "at_mm": list(h.at),
                        "threshold_n": h.threshold_n,
                        "force_n": h.force_n,
                        "feed_per_tooth_mm": h.feed_per_tooth_mm,
                        "diameter_mm": h.diameter_mm,
                        "helps": helps(h),
                    }
                    for h in v.infeasible
                ],
                "limits": dict(walled.limits),
                "settings": dict(walled.settings),
            }
        ],
        "unchecked": list(walled.unchecked),
        "findings": list(walled.findings),
        "provenance": dict(walled.provenance),
    }


def _variant(walled: Walled, one: Variant) -> dict[str, Any]:
    c = one.columns
    cuts = c["force_normal_n"] > 0.0
    known = cuts & (c["planned_force_n"] > 0.0)
    ratio = c["force_normal_n"][known] / c["planned_force_n"][known]
    bad = fails(walled, one.name)
    return {
        "passes": len(one.maps),
        "time_min": one.seconds / 60.0,
        "deflection_um_max": 1000.0 * one.deflection,
        "error_um_max": 1000.0 * one.error,
        "force_normal_n_max": one.force,
        "holds": not bad,
        "released": one.name == USED and not bad,
        "fails": list(bad),
        "order": one.order,
        "passes_in_the_other_order": one.passes_otherwise,
        "planned": {
            "deflection_um_allowed": 1000.0 * one.held if np.isfinite(one.held) else None,
            "deflection_um_max": None if one.planned_deflection is None else 1000.0 * one.planned_deflection,
            "force_normal_n_max": one.planned_force,
        },
        "depth_mm": {
            "min": min(float(m.depth[m.depth > 0.0].min()) for m in one.maps if (m.depth > 0.0).any()),
            "max": max(float(m.depth.max()) for m in one.maps),
        },
        "contact_points": int(cuts.sum()),
        "force_over_threshold_max": float(c["force_over_threshold"].max(initial=0.0)),
        "force_over_planned": {"median": float(np.median(ratio)), "max": float(ratio.max())} if len(ratio) else None,
        "over_threshold": len(one.over),
        "over_threshold_at": [
            {
                "pass": str(c["pass"][k]),
                "line": int(c["line"][k]),
                "at_mm": [float(c[f"contact_{x}_mm"][k]) for x in "xyz"],
                "force_n": float(c["force_normal_n"][k]),
                "threshold_n": float(c["threshold_n"][k]),
            }
            for k in one.over[:LISTED]
        ],
        "cutter_deflection_um_max": 1000.0 * float(c["cutter_mm"].max(initial=0.0)),
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
    }


def summary_bytes(walled: Walled) -> bytes:
    """summary.json."""
    return (json.dumps(summary(walled), indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def history_bytes(walled: Walled) -> bytes:
    """history.parquet: a row a step, the variants one after another."""
    tables = []
    for name, one in walled.variants.items():
        columns = dict(one.columns)
        n = len(columns["line"])
        first = {
            "operation": pa.array(np.zeros(n, dtype=np.int32)),
            "strategy": pa.array([name] * n),
            "pass": pa.array(columns.pop("pass").tolist()),
        }
        tables.append(pa.table(first | {k: pa.array(np.ascontiguousarray(v)) for k, v in columns.items()}))
    sink = io.BytesIO()
    pq.write_table(pa.concat_tables(tables).combine_chunks(), sink, compression="zstd")
    return sink.getvalue()


def program_files(walled: Walled) -> dict[str, bytes]:
    """The program of each variant for the machine and as CL data; verified only the one in use, where it holds."""
    out: dict[str, bytes] = {}
    c = walled.cutter
    for k, (name, one) in enumerate(walled.variants.items()):
        bad = fails(walled, name)
        released = name == USED and not bad
        title = f"{walled.title}, operation 0, thinwall, {name}"
        said = [] if name == USED else [f"not released: the job uses {USED}"]
        said += [f"does not hold: {bad[0]}"] if bad else []
        said += [
            f"T{c.number}: D {c.diameter:g} mm, corner {c.corner_radius:g} mm, {c.flutes} flutes, overhang "
            f"{c.overhang:g} mm",
            f"Z 0 is the clamp, X along the wall, its sides towards Y+ and Y-; machine {walled.machine.name}",
            f"G43 H{c.number} must be the overhang of {c.overhang:g} mm: the rotary axes turn about it",
        ]
        text = write_commands(
            one.commands, walled.machine, title=title, verified=released, comments=said, number=100 + k
        )
        stem = program_name(0, name)
        out[f"{stem}.{ENDINGS[walled.machine.dialect]}"] = text.encode("ascii")
        out[f"{stem}.apt"] = write_apt(one.program, {c.number: c}, title=title, verified=released).encode("ascii")
    return out


__all__ = ["OVER", "history_bytes", "program_files", "summary", "summary_bytes", "verdict"]
