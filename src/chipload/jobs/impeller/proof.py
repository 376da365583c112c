"""The files contact_points.parquet and proof.npz: the largest cutter at each contact point, and the proof of that
bound.
"""

from __future__ import annotations

import io
import zipfile
from typing import Any

import numpy as np

from chipload.jobs.impeller.outcome import ImpellerResult
from chipload.lazy import pa, pq


def contact_points_bytes(milled: ImpellerResult) -> bytes:
    """The file contact_points.parquet: one row for each contact point."""
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


def proof_bytes(milled: ImpellerResult) -> bytes:
    """The file proof.npz: for each surface k, as `k/...`, the searched catalogue and every bound with its proof.

    ``contact``, ``normal`` (c, 3), ``curvature`` (c, 3, 3), ``check`` (m, 3), ``check_surface`` (m,), ``near``,
    ``tables`` (t,) [rad]; of each family f as `k/f/...` ``corner_radius``, ``rho``, ``bound``, ``pallet`` (c, t),
    ``certified``, ``blockers`` (c, t, j), -1 none, -2 the curvature at the contact. ``covering`` (5,) [mm]: tolerance
    between the check points, least corner radius, reach, bend and depth of the nodes (``covering/``); without it
    nothing is certified between the check points.
    """
    arrays: dict[str, Any] = {}
    for k, op in enumerate(milled.surfaces):
        s = op.surface.scene
        for name in ("contact", "normal", "curvature", "check", "check_surface", "near"):
            arrays[f"{k}/{name}"] = np.asarray(getattr(s, name))
        arrays[f"{k}/tables"] = op.answer.tables
        if s.covering is not None:
            w = s.covering
            arrays[f"{k}/covering"] = np.array([w.tolerance, w.corner, w.reach, w.bend, w.sunk])
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
