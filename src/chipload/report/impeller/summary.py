"""summary.json, history.parquet and proof.npz of an impeller: the verdict first, then each surface in numbers."""

from __future__ import annotations

import io
import json
import zipfile
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from chipload.cutter.catalogue import CatalogueCutter
from chipload.planning.sectional.compare import Compared
from chipload.planning.sectional.patch import Patch
from chipload.planning.sectional.surfaces import BODIES
from chipload.report.impeller.outcome import Checked, Milled, Searched, fails, failures, said, verdict


def summary_bytes(milled: Milled) -> bytes:
    """summary.json; of its numbers ``search_s`` alone is a time of this computer."""
    holds, says = verdict(milled)
    values = {
        "holds": holds,
        "says": says,
        "job": milled.title,
        "impeller": {
            "blades": milled.impeller.blades,
            "splitters": milled.impeller.blades if milled.impeller.splitter is not None else 0,
            "outer_diameter_mm": milled.outer_diameter,
        },
        "machine": milled.machine.name,
        "catalogue": milled.catalogue.name,
        "operations": [operation(milled)],
        "provenance": dict(milled.provenance),
    }
    return (json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def operation(milled: Milled) -> dict[str, Any]:
    """All surfaces together, then each."""
    rows = [surface(op) for op in milled.surfaces]
    used, picked = milled.used, milled.picked
    return {
        "kind": "sectional",
        "holds": not fails(milled),
        "fails": list(fails(milled)),
        **_one(milled.surfaces[0], milled.one),
        **{key: sum(row[key] for row in rows) for key in ("cc_points", "check_points", "unreachable", "search_s")},
        "certified": all(row["certified"] for row in rows),
        **(way_of(milled, used) if used is not None else {}),
        "hand_picked": None if picked is None else _picked(milled, picked),
        "ways": [way_of(milled, way) for way in milled.ways],
        "programs": None if milled.programs is None else [_program(p) for p in milled.programs],
        "roughing": None if milled.roughs is None else _roughing(milled),
        "finished": None if milled.covered is None else _finished(milled),
        "surfaces": rows,
        "settings": {k: list(v) if isinstance(v, tuple) else v for k, v in milled.settings.items()},
    }


def way_of(milled: Milled, way: Compared) -> dict[str, Any]:
    """A way to mill all surfaces; path and time are of all channels."""
    d = way.divided
    head = {"way": way.name, "reached_share": way.share}
    if d is None:
        return head | {"patches": None, "path_mm": None, "time_min": None}
    return head | {
        "cutters": [_size(way.catalogue.cutters[k]) for k in d.cutters],
        "path_mm": d.path,
        "time_min": d.total / 60.0,
        "milling_min": d.milling / 60.0,
        "cutter_changes": d.cutter_changes,
        "table_changes": d.table_changes,
        "least_time_min": d.bound / 60.0,
        "least_time_any_shape_min": d.bound_any_shape / 60.0,
        "gap": d.gap,
        "patches": [_patch(milled, way, p) for p in d.patches],
    }


def _patch(milled: Milled, way: Compared, patch: Patch) -> dict[str, Any]:
    return {
        "surface": milled.searched(patch).surface.name,
        **_size(way.catalogue.cutters[patch.cutter]),
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


def _program(p: Checked) -> dict[str, Any]:
    """A program of one channel with its check."""
    return {
        **_size(p.setting.cutter),
        "table_deg": _degrees(p.setting.table),
        "verified": p.verified,
        "holds": not p.fails,
        "fails": list(p.fails),
        "rows": len(p.setting.program),
        "path_mm": p.setting.length,
        "time_min": p.seconds / 60.0,
        "missed_mm": p.missed,
        "refused_lines": len(p.setting.linked.refused),
        "direct_links": p.setting.linked.direct,
        "retracts": p.setting.linked.retracts,
        "gouge_mm": p.gouge,
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
                "scallop_mean_share": s.mean / s.asked,
                "crests": s.crests,
                "covered_share": s.covered,
            }
            for m, s in zip(p.setting.millings, p.scallops, strict=True)
        ],
    }


def _roughing(milled: Milled) -> dict[str, Any]:
    """All roughing programs; of one channel, or of one on either side of a splitter."""
    rows = [r.values() for r in milled.roughs or ()]
    time = sum(row["time_min"] for row in rows)
    return {
        "holds": all(row["verified"] for row in rows),
        "path_mm": sum(row["path_mm"] for row in rows),
        "time_min": time,
        "time_all_channels_min": time * milled.impeller.blades,
        "programs": rows,
    }


def _finished(milled: Milled) -> dict[str, Any]:
    """What all programs leave together."""
    programs, covered = milled.programs or (), milled.covered or ()
    scallops = [x for p in programs for x in p.scallops]
    crests = sum(x.crests for x in scallops)
    mean = sum(x.mean * x.crests for x in scallops) / crests if crests else None
    return {
        "path_mm": float(sum(p.setting.length for p in programs)),
        "time_min": sum(p.seconds for p in programs) / 60.0,
        "gouge_mm": max((p.gouge for p in programs), default=0.0),
        "scallop_mean_mm": mean,
        "scallop_mean_share": None if mean is None else mean / scallops[0].asked,
        "surfaces": [
            {
                "surface": x.name,
                "holds": not x.fails,
                "points": len(x.left.rest),
                "spacing_mm": x.spacing,
                "within_share": x.share,
                "greatest_mm": x.greatest[0],
                "at_mm": x.left.wall.points[x.greatest[1]].tolist(),
                "unreached_mm2": x.unreached,
            }
            for x in covered
        ],
    }


def _picked(milled: Milled, way: Compared) -> dict[str, Any]:
    first = way.divided.patches[0].table if way.divided is not None and way.divided.patches else None
    tables = {p.table for p in way.divided.patches} if way.divided is not None else set()
    return {
        **_size(way.catalogue.cutters[0]),
        "table_deg": _degrees(first) if first is not None and len(tables) == 1 else None,
        "tables_deg": sorted(_degrees(t) for t in tables),
        "cc_points": sum(len(op.place) for op in milled.surfaces),
        "check_points": sum(len(op.surface.scene.check) for op in milled.surfaces),
        "unreachable": way.unreachable,
        "search_s": way.search_s,
        "certified": way.certified,
        **way_of(milled, way),
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
    """One surface."""
    answer, area = op.answer, op.surface.area
    return {
        "surface": op.surface.name,
        "holds": not failures(op),
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
                "at_mm": op.place[u.point].tolist(),
                "reason": u.reason,
                "fits_mm": u.fits if u.fits > 0.0 else None,
                "fits_corner_radius_mm": u.fits_corner if u.fits > 0.0 else None,
                "says": said(op, u),
            }
            for u in answer.unreachable
        ],
        "where": {k: list(op.settings[k]) for k in ("along", "up", "points")},
    }


def history_bytes(milled: Milled) -> bytes:
    """history.parquet: a row a contact point."""
    tables = []
    for op in milled.surfaces:
        s, answer = op.surface.scene, op.answer
        n, (a, b) = len(s.contact), op.surface.shape
        corner = np.array([c.corner_radius for c in answer.catalogue.cutters] + [np.nan])
        reached = answer.cutter >= 0
        reasons = np.full(n, "", dtype=object)
        for missed in answer.unreachable:
            reasons[missed.point] = missed.reason
        data: dict[str, Any] = {
            "operation": np.zeros(n, dtype=np.int32),
            "surface": [op.surface.name] * n,
            "cc_point": np.arange(n),
            "u": np.repeat(op.surface.u, b),
            "v": np.tile(op.surface.v, a),
            **{f"{x}_mm": s.contact[:, i] for i, x in enumerate("xyz")},
            **{f"normal_{x}": s.normal[:, i] for i, x in enumerate("xyz")},
            "area_mm2": op.surface.area,
            "diameter_mm": answer.diameter,
            "corner_radius_mm": corner[answer.cutter],
            "table_deg": np.where(reached, np.degrees(answer.tables[answer.table]).round(9), np.nan),
            "pallet_deg": [np.degrees(r).ravel().tolist() for r in answer.ranges],
            "certified": answer.certified,
            "unreachable": reasons.tolist(),
        }
        tables.append(pa.table({key: pa.array(v) for key, v in data.items()}))
    sink = io.BytesIO()
    pq.write_table(pa.concat_tables(tables), sink, compression="zstd")
    return sink.getvalue()


def proof_bytes(milled: Milled) -> bytes:
    """proof.npz: for each surface k, as `k/...`, what was searched and every bound with what proves it.

    ``contact``, ``normal`` (c, 3), ``curvature`` (c, 3, 3), ``check`` (m, 3), ``check_surface`` (m,), ``near``,
    ``tables`` (t,) [rad]; of each family f as `k/f/...` ``corner_radius``, ``rho``, ``bound``, ``pallet`` (c, t),
    ``certified``, ``blockers`` (c, t, j), -1 none, -2 the curvature at the contact.
    """
    arrays: dict[str, Any] = {}
    for k, op in enumerate(milled.surfaces):
        s = op.surface.scene
        for name in ("contact", "normal", "curvature", "check", "check_surface", "near"):
            arrays[f"{k}/{name}"] = np.asarray(getattr(s, name))
        arrays[f"{k}/tables"] = op.answer.tables
        for f, found in enumerate(op.answer.families):
            for name in ("corner_radius", "rho", "bound", "pallet", "certified", "blockers"):
                arrays[f"{k}/{f}/{name}"] = np.asarray(getattr(found, name))
    # as numpy's savez, but with no time of day in the archive
    sink = io.BytesIO()
    with zipfile.ZipFile(sink, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, value in arrays.items():
            part = io.BytesIO()
            np.save(part, value, allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy", (1980, 1, 1, 0, 0, 0)), part.getvalue())
    return sink.getvalue()


def _degrees(angle: float) -> float:
    return round(float(np.degrees(angle)), 9)
