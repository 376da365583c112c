"""summary.json, history.parquet and scene.glb of a result on a thin tube or cone."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import trimesh

from chipload.control.override import STATUS
from chipload.report.scene import engagement_colours
from chipload.report.shell.outcome import HELD, Case, ShellOutcome, verdict
from chipload.units import mm_min_from_mm_s, rpm_from_rad_s

#: rows of a path that the scene shows at most
SCENE_ROWS = 4000


def operation(outcome: ShellOutcome) -> dict[str, Any]:
    """The operation in summary.json."""
    low, high = outcome.surface or (None, None)
    answer: dict[str, Any] = {
        "kind": "shell",
        "holds": not outcome.fails,
        "fails": list(outcome.fails),
        "torque_limit_nm": 1e-3 * outcome.torque,
        "torque_limit": {
            "source": outcome.source,
            "force_n": outcome.limit.force,
            "s_mm": float(outcome.path.model.s[outcome.limit.step + 1]),
            "at_mm": outcome.path.points[outcome.limit.step + 1].tolist(),
            "held_nm": 0.0 if outcome.controller is None else 1e-3 * outcome.controller.torque_ref,
            "true_wall_nm": 1e-3 * outcome.true_torque,
            "one_tooth_formula_nm": 1e-3 * outcome.one_tooth,
            "relief_max": float(outcome.path.relief.max()),
        },
        "torque_planned_nm_max": 1e-3 * float(outcome.path.model.torque(1.0).max()),
        "torque_true_nm_max": 1e-3 * float(outcome.path.truth.torque(1.0).max()),
        "path_mm": float(outcome.path.model.s[-1]),
        "surface_off_um": None if low is None or high is None else {"min": 1e3 * low, "max": 1e3 * high},
        "wall": {
            "planned_mm": outcome.wall.thickness,
            "limit_made_for_mm": outcome.thinnest,
            "real_mm": outcome.real,
        },
        "surprises": list(outcome.surprises),
    }
    if outcome.cases:
        plain, late = outcome.cases
        answer |= {
            "controllers": _controllers(plain),
            "compared": outcome.compared(plain),
            "with_latency": {
                "latency_ms": 1e3 * late.loop.latency,
                "override_step": late.quantum,
                "controllers": _controllers(late),
                "compared": outcome.compared(late),
                "lost": {
                    name: {
                        "time_s": late.runs[name].outcome.time - run.outcome.time,
                        "torque_nm": 1e-3 * (late.runs[name].outcome.load_max - run.outcome.load_max),
                        "wall_error_um": 1e3 * float(late.runs[name].error.max() - run.error.max()),
                    }
                    for name, run in plain.runs.items()
                },
            },
        }
    if outcome.estimator is not None:
        e = outcome.estimator
        answer["estimator"] = {
            "noise_nm": 1e-3 * e.noise,
            "noise_seen_nm": 1e-3 * e.seen,
            "behind_nm_max": 1e-3 * e.behind,
            "lag_s": e.lag,
            "light_nm": 1e-3 * e.light,
            "light_share": e.light_share,
        }
    answer["second_opinion"] = {
        "elements": {"half_round": outcome.solid.counts[0], "along": outcome.solid.counts[1],
                     "through": outcome.solid.counts[2], "nodes_each": 20},
        "nodes": outcome.solid.nodes,
        "places": [
            {"s_mm": p.s, "shell_um_n": 1e3 * p.shell, "hexahedra_um_n": 1e3 * p.solid} for p in outcome.solid.places
        ],
        "apart_percent_max": 100.0 * outcome.solid.apart,
    }  # fmt: skip
    whole = float(outcome.oval.share.sum())
    answer["ovalisation"] = {
        "s_mm": outcome.oval_s,
        "whole_um_n": 1e3 * whole,
        "beam_um_n": None if outcome.oval.beam is None else 1e3 * outcome.oval.beam,
        "shell_over_beam": None if outcome.oval.beam is None else whole / outcome.oval.beam,
        "first_harmonic_share": float(outcome.oval.share[1] / whole),
    }
    answer["limits"] = dict(outcome.limits)
    answer["unchecked"] = list(outcome.unchecked)
    answer["settings"] = dict(outcome.settings)
    return answer


def _controllers(case: Case) -> dict[str, Any]:
    return {name: run.numbers() for name, run in case.runs.items()}


def summary_bytes(outcome: ShellOutcome) -> bytes:
    """summary.json."""
    holds, says = verdict(outcome)
    values = {
        "holds": holds,
        "says": says,
        "job": outcome.title,
        "program": {"file": outcome.program_name, "motions": len(outcome.program)},
        "operations": [operation(outcome)],
        "machine": outcome.machine.name,
        "findings": [{"code": f.code, "line": f.line, "text": f.text} for f in outcome.findings],
        "provenance": dict(outcome.provenance),
    }
    return (json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def history_bytes(outcome: ShellOutcome) -> bytes:
    """history.parquet: a row a step of the controller, all controllers and both loops one after another."""
    tables = []
    path, limit = outcome.path, outcome.torque
    for case in outcome.cases:
        for name, run in case.runs.items():
            o = run.outcome
            n = len(o.t)
            columns = {
                "operation": pa.array(np.zeros(n, dtype=np.int32)),
                "strategy": pa.array([name] * n),
                "latency_ms": np.full(n, 1e3 * case.loop.latency),
                "t_s": o.t,
                "s_mm": o.s,
                **{f"{x}_mm": np.interp(o.s, path.model.s, path.points[:, k]) for k, x in enumerate("xyz")},
                "feed_mm_min": mm_min_from_mm_s(1.0) * o.feed,
                "override": o.override,
                "status": pa.array([STATUS[k] for k in o.status]),
                "torque_nm": 1e-3 * o.torque,
                "torque_measured_nm": 1e-3 * o.measured,
                "torque_borne_nm": 1e-3 * limit * np.interp(o.s, path.model.s, path.relief),
                "wall_error_um": 1e3 * run.error,
                "stress_mpa": run.stress,
                "spindle_rpm": rpm_from_rad_s(1.0) * o.speed,
            }
            tables.append(pa.table(columns))
    sink = io.BytesIO()
    whole = pa.concat_tables(tables) if tables else pa.table({k: np.asarray(v) for k, v in outcome.steps.items()})
    pq.write_table(whole, sink, compression="zstd")
    return sink.getvalue()


def scene_bytes(outcome: ShellOutcome) -> bytes:
    """scene.glb: what is left of the stock, and the path coloured by the torque over what is borne."""
    scene = trimesh.Scene()
    stock = outcome.stock.mesh()
    stock.visual.face_colors = (168, 122, 58, 255)
    scene.add_geometry(stock, node_name="stock", geom_name="stock")
    path = outcome.path
    rows = np.unique(np.linspace(0, len(path.points) - 1, min(len(path.points), SCENE_ROWS)).astype(np.int64))
    share = np.zeros(len(rows))
    if outcome.cases:
        o = outcome.cases[-1].runs[HELD].outcome
        borne = outcome.torque * path.relief[rows]
        share = np.interp(path.model.s[rows], o.s, o.torque) / borne
    colours = engagement_colours(share, max(1.0, float(share.max(initial=0.0))))
    entities = [trimesh.path.entities.Line(np.array([k, k + 1]), color=colours[k + 1]) for k in range(len(rows) - 1)]
    line = trimesh.path.Path3D(entities=entities, vertices=path.points[rows], process=False)
    scene.add_geometry(line, node_name="path", geom_name="path")
    glb: bytes = scene.export(file_type="glb", extension_webp=False)
    return glb
