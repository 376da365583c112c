"""The numbers of a torque job in summary.json: limit, controllers, wall."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from chipload.jobs.torque.outcome import ClampedWorkpiece, ControllerCase, ShellWall, TorqueResult


def operation_numbers(outcome: TorqueResult) -> dict[str, Any]:
    """The operation in summary.json."""
    answer: dict[str, Any] = {
        "kind": "torque",
        "program": {"file": outcome.job.program_name, "motions": len(outcome.job.written.program)},
        "torque_limit_nm": 1e-3 * outcome.allowable.torque,
        "torque_limit": {
            "source": outcome.source,
            "force_n": outcome.allowable.limit.force,
            "s_mm": float(outcome.allowable.path.model.s[outcome.allowable.limit.step + 1]),
            "place": outcome.allowable.path.points[outcome.allowable.limit.step + 1].tolist(),
            "held_nm": 0.0 if outcome.control.controller is None else 1e-3 * outcome.control.controller.torque_ref,
            "true_wall_nm": 1e-3 * outcome.allowable.true_torque,
            "one_tooth_formula_nm": None if outcome.allowable.one_tooth is None else 1e-3 * outcome.allowable.one_tooth,
            "relief_max": float(outcome.allowable.path.relief.max()),
        },
        "torque_planned_nm_max": 1e-3 * float(outcome.allowable.path.model.torque(1.0).max()),
        "torque_true_nm_max": 1e-3 * float(outcome.allowable.path.truth.torque(1.0).max()),
        "path_mm": float(outcome.allowable.path.model.s[-1]),
        **(_shell(outcome.wall) if isinstance(outcome.wall, ShellWall) else {"workpiece": _workpiece(outcome.wall)}),
        "surprises": list(outcome.job.surprises),
    }
    if outcome.control.cases:
        plain, late = outcome.control.cases
        answer |= {
            "controllers": _controllers(outcome, plain),
            "compared": outcome.compared(plain),
            "with_latency": {
                "latency_ms": 1e3 * late.loop.latency,
                "override_step": late.quantum,
                "controllers": _controllers(outcome, late),
                "compared": outcome.compared(late),
                "lost": {
                    name: {
                        "time_s": outcome.time_of(late.runs[name]) - outcome.time_of(run),
                        "torque_nm": 1e-3 * (late.runs[name].outcome.load_max - run.outcome.load_max),
                        "form_error_um": 1e3 * float(late.runs[name].error.max() - run.error.max()),
                    }
                    for name, run in plain.runs.items()
                },
            },
        }
    answer["ideal_time_s"] = outcome.control.ideal_time if outcome.control.ideal_time < math.inf else None
    if outcome.control.estimate is not None:
        e = outcome.control.estimate
        answer["estimate"] = {
            "noise_nm": 1e-3 * e.noise,
            "noise_seen_nm": 1e-3 * e.seen,
            "behind_nm_max": 1e-3 * e.behind,
            "lag_s": e.lag,
            "bandwidth_hz": e.bandwidth if e.bandwidth < math.inf else None,
            "range_nm": [1e-3 * x for x in e.range],
            "resolution_nm": 1e-3 * e.resolution,
            "torque_constant_error_share": e.constant_error,
            "light_nm": 1e-3 * e.light,
            "light_share": e.light_share,
            "tooth_passing_hz": e.aliased[0],
            "tooth_passing_seen_hz": e.aliased[1],
        }
    answer["spindle_deviation"] = asdict(outcome.control.deviation)
    if isinstance(outcome.wall, ShellWall):
        answer |= _wall_models(outcome.wall)
    answer["energy_balance"] = {
        name: {str(tool): value for tool, value in each.items()} for name, each in outcome.energy_balance.items()
    }
    answer["settings"] = dict(outcome.job.settings)
    return answer


def _shell(wall: ShellWall) -> dict[str, Any]:
    """The thickness of a thin wall, and what the program leaves on it."""
    low, high = wall.surface or (None, None)
    return {
        "surface_off_um": None if low is None or high is None else {"min": 1e3 * low, "max": 1e3 * high},
        "wall": {"planned_mm": wall.shell.thickness, "limit_made_for_mm": wall.thinnest, "real_mm": wall.real},
    }


def _workpiece(wall: ClampedWorkpiece) -> dict[str, Any]:
    """The compliance of a workpiece, its error for which the limit makes allowance, and its stress per force."""
    return {
        **wall.planned.numbers,
        "compliance_error_percent": 100.0 * wall.planned.error,
        "stress_mpa_n": wall.strained[0],
    }


def _wall_models(wall: ShellWall) -> dict[str, Any]:
    """The same wall by hexahedra, and against a beam."""
    whole = float(wall.oval.share.sum())
    return {
        "second_opinion": {
            "elements": {"half_round": wall.solid.counts[0], "along": wall.solid.counts[1],
                         "through": wall.solid.counts[2], "nodes_each": 20},
            "nodes": wall.solid.nodes,
            "places": [
                {"s_mm": p.s, "shell_um_n": 1e3 * p.shell, "hexahedra_um_n": 1e3 * p.solid} for p in wall.solid.places
            ],
            "apart_percent_max": 100.0 * wall.solid.greatest_difference,
        },
        "ovalisation": {
            "s_mm": wall.oval_s,
            "whole_um_n": 1e3 * whole,
            "beam_um_n": None if wall.oval.beam is None else 1e3 * wall.oval.beam,
            "shell_over_beam": None if wall.oval.beam is None else whole / wall.oval.beam,
            "first_harmonic_share": float(wall.oval.share[1] / whole),
        },
    }  # fmt: skip


def _controllers(outcome: TorqueResult, case: ControllerCase) -> dict[str, Any]:
    return {name: outcome.numbers_of(run) for name, run in case.runs.items()}
