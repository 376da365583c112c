"""The outcome of contours and pockets: the strategies of each operation, and their simulation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from chipload.checking.default_checks import DefaultChecks
from chipload.cutter.cutter import Cutter
from chipload.errors import Finding
from chipload.jobs.contour.text_simulation import SimulatedText
from chipload.machine.machine import Machine
from chipload.planning.result import OperationResult
from chipload.result import Provenance, Verdict

#: relative error of planned loads: the rotations at which a peak is sampled, as in simulation.accuracy
PLANNED_ERRORS = dict.fromkeys(
    ("force_n", "force_xy_n", "torque_nm", "torque_mean_nm", "power_w", "chip_max_mm", "form_error_um"), 0.01
)


@dataclass(frozen=True)
class PlanVerification:
    """Result of the independent simulation of one strategy.

    Parameters
    ----------
    verdict : ``holds``: it agrees with the planner's history, and finds no gouge
    text : one sentence
    numbers : JSON values
    """

    verdict: Verdict
    text: str
    numbers: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Operation:
    """One operation with the data that the report shows.

    Parameters
    ----------
    result : of the planner
    settings : the keys of the job, as stated
    cutter : the tool
    top, depth : z of the stock's top, depth of cut [mm]
    verifications : by strategy
    simulations : by strategy, the text of its program as it was read back and simulated; its history is that of this
    limits : of the job, by name
    checks : checks in addition to the limits; None: nothing
    inserted : name and text of the program that the finish path came from, with the semi-finish passes; else ""
    """

    result: OperationResult
    settings: Mapping[str, Any]
    cutter: Cutter
    top: float
    depth: float
    verifications: Mapping[str, PlanVerification]
    simulations: Mapping[str, SimulatedText] = field(default_factory=dict)
    limits: Mapping[str, float] = field(default_factory=dict)
    checks: DefaultChecks | None = None
    inserted: tuple[str, str] = ("", "")


@dataclass(frozen=True, eq=False)
class ContourResult:
    """Result of a whole run.

    Parameters
    ----------
    title : name of the job
    operations : in their order
    machine : that the programs are written for
    unchecked : limits that the job does not state
    findings : of the job and of its readers
    provenance : where the numbers come from
    """

    title: str
    operations: tuple[Operation, ...]
    machine: Machine
    unchecked: tuple[str, ...]
    findings: tuple[Finding, ...]
    provenance: Provenance
