"""Numbers of an impeller in summary.json: surfaces, partitions, programs, roughing, excess."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.jobs.impeller.five_axis_outcome import flank_numbers, points_numbers
from chipload.jobs.impeller.machine_check import verdict_of
from chipload.jobs.impeller.names import flank_names, points_names, program_name
from chipload.jobs.impeller.outcome import Checked, ImpellerResult, Searched, unreached_text
from chipload.planning.impeller.compare import Partition
from chipload.planning.impeller.patch import Patch
from chipload.planning.impeller.surfaces import BODIES
from chipload.units import mm_min_from_mm_s


def operation_numbers(milled: ImpellerResult) -> dict[str, Any]:
    """Numbers of all surfaces together, then of each."""
    rows = [surface(op) for op in milled.surfaces]
    used, picked = milled.used, milled.picked
    return {
        "kind": "impeller",
        "blades": milled.impeller.blades,
        "splitters": milled.impeller.blades if milled.impeller.splitter is not None else 0,
        "outer_diameter_mm": milled.stated.outer_diameter,
        "catalogue": milled.catalogue.name,
        **_one(milled.surfaces[0], milled.one),
        **{key: sum(row[key] for row in rows) for key in ("cc_points", "check_points", "unreachable", "search_s")},
        "certified": all(row["certified"] for row in rows),
        "certified_within_mm": milled.tolerance,
        **(checked_of(milled, used) if used is not None else {}),
        "hand_picked": None if picked is None else _picked_numbers(milled, picked),
        "ways": [checked_of(milled, partition) for partition in milled.partitions],
        "scallop": {"mean_share": None if milled.used_checked is None else milled.used_checked.scallop},
        "programs": None
        if milled.programs is None
        else [_program(program_name(milled, k), p) for k, p in enumerate(milled.programs, 1)],
        "roughing": None if milled.roughs is None else _roughing_numbers(milled),
        "flank": None if milled.flanks is None else _flanks(milled),
        "point_milling": None if milled.points is None else _points(milled),
        "finished": None if milled.covered is None else _finished_numbers(milled),
        "surfaces": rows,
        "settings": {k: list(v) if isinstance(v, tuple) else v for k, v in milled.stated.settings.items()},
    }


def partition_of(milled: ImpellerResult, partition: Partition) -> dict[str, Any]:
    """Numbers of a partition of all surfaces; path and time are of all channels."""
    d = partition.divided
    head = {"name": partition.name, "reached_share": partition.share}
    if d is None:
        return head | {"patches": None, "path_mm": None, "time_min": None}
    return head | {
        "cutters": [_size(partition.catalogue.cutters[k]) for k in d.cutters],
        "path_mm": d.path,
        "time_min": d.total / 60.0,
        "milling_min": d.milling / 60.0,
        "cutter_changes": d.cutter_changes,
        "table_changes": d.table_changes,
        "least_time_min": d.bound / 60.0,
        "least_time_any_shape_min": d.bound_any_shape / 60.0,
        "above_bound": d.above_bound,
        "patches": [_patch(milled, partition, p) for p in d.patches],
    }


def checked_of(milled: ImpellerResult, partition: Partition) -> dict[str, Any]:
    """Numbers of a partition with checked programs; path and times are of all channels, without roughing.

    Without programs they are those that the contact points predict, and there is no verdict.
    """
    out = partition_of(milled, partition)
    checked = next((w for w in milled.checked or () if w.partition is partition), None)
    head = {"in_use": partition is milled.used, "predicted_min": out["time_min"], "cutting_min": None, "link_min": None}
    if checked is None:
        return {**out, **head, "changes_min": None, "scallop_mean_share": None, "verdict": None, "fails": []}
    return {
        **out,
        **head,
        "cutters": [_size(c) for c in checked.cutters],
        "path_mm": checked.path,
        "predicted_min": checked.predicted / 60.0,
        "cutting_min": checked.cutting / 60.0,
        "link_min": checked.links / 60.0,
        "changes_min": checked.changes / 60.0,
        "time_min": checked.seconds / 60.0,
        "scallop_mean_share": checked.scallop,
        "verdict": verdict_of(checked.fails, checked.doubts).value,
        "fails": [*checked.fails, *checked.doubts],
    }


def _patch(milled: ImpellerResult, partition: Partition, patch: Patch) -> dict[str, Any]:
    return {
        "surface": milled.searched(patch).surface.name,
        **_size(partition.catalogue.cutters[patch.cutter]),
        "table_deg": _degrees(patch.table),
        "across": patch.order,
        "from": patch.low,
        "to": patch.high,
        "part": list(patch.part),
        "cc_points": len(patch.at),
        "area_share": patch.area / milled.area,
        "path_mm": patch.path,
        "time_min": patch.time / 60.0,
    }


def _program(name: str, p: Checked) -> dict[str, Any]:
    """A program of one channel with its check."""
    return {
        **_size(p.setting.cutter),
        "table_deg": _degrees(p.setting.table),
        "program": name,
        "rows": len(p.setting.program),
        "path_mm": p.setting.length,
        "time_min": p.seconds / 60.0,
        "loads": _loads(p),
        "removal": None if p.removal is None else p.removal.numbers(),
        "missed_mm": p.missed,
        "refused_lines": len(p.setting.linked.refused),
        "direct_links": p.setting.linked.direct,
        "retracts": p.setting.linked.retracts,
        "gouge_mm": p.gouge.found,
        "gouge_bound_mm": p.gouge.bound if math.isfinite(p.gouge.bound) else None,
        "rest_passes": [
            {
                "surface": f"{BODIES[r.body]} {r.side}",
                "u": list(r.box[0]),
                "v": list(r.box[1]),
                "passes": len(r.tracks),
                "path_mm": float(sum(t.length for t in r.tracks)),
            }
            for r in p.setting.rests
        ],
        "missed": [
            {
                "surface": f"{BODIES[m.patch.body]} {m.patch.side}",
                "line": x.line,
                "from": list(x.first),
                "to": list(x.last),
                "length_mm": x.length,
                "reason": x.reason,
            }
            for m in p.setting.millings
            for x in m.tracks.missed
        ],
        "patches": [
            {
                "surface": f"{BODIES[m.patch.body]} {m.patch.side}",
                "lines": m.tracks.lines,
                "path_mm": m.tracks.length,
                "scallop_greatest_mm": s.greatest,
                "scallop_mean_mm": s.mean,
                "scallop_mean_share": s.mean / s.limit,
                "scallops": s.count,
                "covered_share": s.covered,
            }
            for m, s in zip(p.setting.millings, p.scallops, strict=True)
        ],
    }


def _flanks(milled: ImpellerResult) -> list[dict[str, Any]]:
    names = {id(p): name for name, p in flank_names(milled)}
    return [flank_numbers(p, names.get(id(p), ""), milled.impeller.blades) for p in milled.flanks or ()]


def _points(milled: ImpellerResult) -> list[dict[str, Any]]:
    names = {id(p): name for name, p in points_names(milled)}
    return [points_numbers(p, names.get(id(p), ""), milled.impeller.blades) for p in milled.points or ()]


def _loads(p: Checked) -> dict[str, float] | None:
    """Feeds of the passes and what they load the cutter with; None: the job has no `forces`."""
    loads = p.setting.loads
    if loads is None or not len(loads.feed):
        return None
    return {
        "feed_least_mm_min": mm_min_from_mm_s(float(loads.feed.min())),
        "feed_mean_mm_min": mm_min_from_mm_s(float(loads.feed.mean())),
        "feed_greatest_mm_min": mm_min_from_mm_s(float(loads.feed.max())),
        "force_n": float(loads.force.max()),
        "deflection_cutter_um": 1000.0 * float(loads.deflection.max()),
        "cutter_stress_mpa": float(loads.stress.max()),
        "places": len(loads.feed),
    }


def _roughing_numbers(milled: ImpellerResult) -> dict[str, Any]:
    """All roughing programs; of one channel, or of one on either side of a splitter."""
    rows = [r.values() for r in milled.roughs or ()]
    time = sum(row["time_min"] for row in rows)
    return {
        "path_mm": sum(row["path_mm"] for row in rows),
        "time_min": time,
        "time_all_channels_min": time * milled.impeller.blades,
        "programs": rows,
    }


def _finished_numbers(milled: ImpellerResult) -> dict[str, Any]:
    """Material that all programs together leave."""
    programs, covered = milled.programs or (), milled.covered or ()
    scallops = [x for p in programs for x in p.scallops]
    count = sum(x.count for x in scallops)
    mean = sum(x.mean * x.count for x in scallops) / count if count else None
    return {
        "path_mm": float(sum(p.setting.length for p in programs)),
        "time_min": sum(p.seconds for p in programs) / 60.0,
        "gouge_mm": max((p.gouge.found for p in programs), default=0.0),
        "scallop_mean_mm": mean,
        "scallop_mean_share": None if mean is None else mean / scallops[0].limit,
        "surfaces": [
            {
                "surface": x.name,
                "points": len(x.left.rest),
                "spacing_mm": x.spacing,
                "within_share": x.share,
                "greatest_mm": x.greatest[0],
                "place": x.left.wall.points[x.greatest[1]].tolist(),
                "unreached_mm2": x.unreached,
            }
            for x in covered
        ],
    }


def _picked_numbers(milled: ImpellerResult, partition: Partition) -> dict[str, Any]:
    first = partition.divided.patches[0].table if partition.divided is not None and partition.divided.patches else None
    tables = {p.table for p in partition.divided.patches} if partition.divided is not None else set()
    return {
        **_size(partition.catalogue.cutters[0]),
        "table_deg": _degrees(first) if first is not None and len(tables) == 1 else None,
        "tables_deg": sorted(_degrees(t) for t in tables),
        "cc_points": sum(len(op.place) for op in milled.surfaces),
        "check_points": sum(len(op.surface.scene.check) for op in milled.surfaces),
        "unreachable": partition.unreachable,
        "search_s": partition.search_s,
        "certified": partition.certified,
        **partition_of(milled, partition),
    }


def _size(cutter: CatalogueCutter) -> dict[str, float]:
    return {"diameter_mm": cutter.diameter, "corner_radius_mm": cutter.corner_radius}


def _one(op: Searched, one: tuple[CatalogueCutter, int] | None) -> dict[str, Any]:
    """A cutter and its table angle."""
    return {
        "diameter_mm": one[0].diameter if one else None,
        "corner_radius_mm": one[0].corner_radius if one else None,
        "table_deg": _degrees(op.table.angle[one[1]]) if one else None,
        "index_deg": _degrees(op.table.position[one[1]]) if one else None,
    }


def surface(op: Searched) -> dict[str, Any]:
    """Numbers of one surface."""
    answer, area = op.answer, op.surface.area
    return {
        "surface": op.surface.name,
        **_one(op, (op.one.cutter, op.one.table) if op.one else None),
        "cc_points": len(op.place),
        "check_points": len(op.surface.scene.check),
        "unreachable": len(answer.unreachable),
        "certified": bool(answer.certified.all()),
        "search_s": op.search_s,
        "area_mm2": float(area.sum()),
        "pointwise": [
            {
                "diameter_mm": c.diameter,
                "corner_radius_mm": c.corner_radius,
                "cc_points": int((answer.cutter == k).sum()),
                "area_share": float(area[answer.cutter == k].sum() / area.sum()),
            }
            for k, c in enumerate(answer.catalogue.cutters)
            if (answer.cutter == k).any()
        ],
        "limits": [
            {
                "corner_radius_mm": x.corner_radius,
                "table_deg": _degrees(op.table.angle[x.table]),
                "none_above_mm": None if x.capped else x.most,
                "capped": x.capped,
                "catalogue_mm": x.size,
                "cc_point": x.point,
                "certified": x.certified,
            }
            for x in op.limiting
        ],
        "unreachable_points": [
            {
                "cc_point": u.point,
                "place": op.place[u.point].tolist(),
                "reason": u.reason,
                "fits_mm": u.fits if u.fits > 0.0 else None,
                "fits_corner_radius_mm": u.fits_corner if u.fits > 0.0 else None,
                "text": unreached_text(op, u),
            }
            for u in answer.unreachable
        ],
        "where": {k: list(op.settings[k]) for k in ("along", "up", "points")},
    }


def _degrees(angle: float) -> float:
    return round(float(np.degrees(angle)), 9)
