"""The outcome of a torque job: the limit of wall or workpiece, and each controller with and without latency.

Torques are compared with the allowable torque at their place: `torque_nm_max` is the torque over its relief, so it
compares with the one limit, that of the place with the least allowable torque; `torque_raw_nm_max` is the torque
itself. The verdict is that of the fuzzy controller with the model of the cut, with the latency of the job; the other
controllers are for comparison.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from chipload.checking.default_checks import DefaultChecks
from chipload.checking.outcome import StockCheck
from chipload.checking.settings import CheckSettings
from chipload.checking.workpiece_compliance import WorkpieceCompliance
from chipload.control import plant
from chipload.control.fuzzy import FuzzyTable
from chipload.control.linuxcnc.path import ToolPath
from chipload.control.override import Override
from chipload.control.plant import Loop
from chipload.control.spindle_model import Spindle, SpindleDeviation
from chipload.control.wall import PathLimit
from chipload.errors import Finding
from chipload.jobs.torque.step_checks import StepChecks
from chipload.jobs.torque.written_program import WrittenProgram
from chipload.machine.machine import Machine
from chipload.report.presentation import Blank
from chipload.result import Provenance
from chipload.stock.layers import LayeredStock
from chipload.structure.shell import Ovalisation, Shell

Floats = NDArray[np.float64]

#: the controller that the verdict is about
HELD = "fuzzy_feedforward"
#: the controller that the others are compared with
PLAIN = "constant"
#: the feed schedule of the model, open loop: derated until it respects the limit in truth, and with the torque held
MODEL, MODEL_FULL = "model", "model_not_derated"


@dataclass(frozen=True, eq=False)
class ControllerRun:
    """One controller along the path.

    Parameters
    ----------
    config, modelled : the controller, and whether it has the model
    outcome : of the loop
    error : (k,) float [mm], of wall and cutter where they make the finished surface, a row of the outcome
    stress : (k,) float [MPa], greatest equivalent one of the wall
    deflection : (k,) float [mm], of wall and cutter anywhere
    ratio : (k,) float, feed per tooth over the programmed one
    workpiece : (k,) float [mm], deflection of the workpiece alone; None: the wall is a shell
    """

    config: Override
    modelled: bool
    outcome: plant.Outcome
    error: Floats
    stress: Floats
    deflection: Floats
    ratio: Floats
    workpiece: Floats | None = None

    def numbers(self) -> dict[str, Any]:
        """Numbers in summary.json, besides the time of the whole program."""
        return {
            "torque_nm_max": 1e-3 * self.outcome.load_max,
            "torque_raw_nm_max": 1e-3 * self.outcome.torque_max,
            "torque_over_limit_s": self.outcome.time_over,
            "form_error_um_max": 1e3 * float(self.error.max()),
            "stress_mpa_max": float(self.stress.max()),
            "override_min": float(self.outcome.override[1:].min(initial=1.0)),
            "override_max": float(self.outcome.override.max()),
            "ended": self.outcome.ended,
        }


@dataclass(frozen=True, eq=False)
class ControllerCase:
    """All controllers in one loop: its latency [s] and the step of the override that the machine takes."""

    loop: Loop
    quantum: float
    runs: Mapping[str, ControllerRun]


@dataclass(frozen=True)
class ComplianceComparison:
    """Compliance of one place by the shell and by hexahedra [mm/N]."""

    s: float
    shell: float
    solid: float


@dataclass(frozen=True, eq=False)
class SolidComparison:
    """Check of the shell by a solid: compared places, numbers of elements (half round, along, through) and of nodes."""

    places: tuple[ComplianceComparison, ...]
    counts: tuple[int, int, int]
    nodes: int

    @property
    def greatest_difference(self) -> float:
        """Greatest relative difference."""
        return max(abs(x.solid / x.shell - 1.0) for x in self.places)


@dataclass(frozen=True)
class SpindleEstimate:
    """Accuracy of the torque that is estimated from the spindle.

    Parameters
    ----------
    noise : standard deviation of the estimate from its sensor, in closed form [N mm]
    seen : the same, in the run of the verdict [N mm]
    behind : greatest error while the torque changes, from the lags alone [N mm]
    lag : of sensor and filter [s]
    bandwidth : at which both leave half of the power [Hz]
    range : (least, greatest) torque that it holds for [N mm]
    resolution : torque that it cannot distinguish from zero [N mm]: noise, quantisation, idle map
    constant_error : share by which the torque constant may be wrong
    light : below it the controller trusts nothing [N mm]
    light_share : share of the time in cut below it
    aliased : (tooth passing frequency, the one that the period of the controller shows it at) [Hz]
    """

    noise: float
    seen: float
    behind: float
    lag: float
    bandwidth: float
    range: tuple[float, float]
    resolution: float
    constant_error: float
    light: float
    light_share: float
    aliased: tuple[float, float]


@dataclass(frozen=True, eq=False)
class TorqueInputs:
    """Values of the job and its program for the result.

    Parameters
    ----------
    title, program_name : of the job and its program
    limits : stated limits by name
    unchecked : names of those that are not stated
    settings : the keys of the job but cutters and surprises
    written : the program, as its text was read and simulated
    surprises : a text each
    surprise_angles : of those that have one, its angle round the wall [deg] and its kind
    checks, check_settings : checks in addition to the stated limits, and their switches
    """

    title: str
    program_name: str
    written: WrittenProgram
    machine: Machine
    limits: Mapping[str, float]
    unchecked: tuple[str, ...]
    settings: Mapping[str, Any]
    surprises: tuple[str, ...]
    surprise_angles: tuple[tuple[float, str], ...]
    checks: DefaultChecks
    check_settings: CheckSettings
    provenance: Provenance


@dataclass(frozen=True, eq=False)
class ShellWall:
    """The wall of a tube or cone.

    Parameters
    ----------
    shell : as planned, at its finished thickness
    thinnest, real : the wall that the limit is made for, and the one that the surprises leave [mm]
    strength : [MPa]
    tolerance : by which it may be thinner [mm]
    oval : harmonics under a force at ``oval_s`` [mm] along the wall, its free end
    solid : second opinion
    surface : least and greatest distance of what is left from the finished surface [mm]; None: no whole layer was cut
    stock : as it is after the program
    """

    shell: Shell
    thinnest: float
    real: float
    strength: float
    tolerance: float
    oval: Ovalisation
    oval_s: float
    solid: SolidComparison
    surface: tuple[float, float] | None
    stock: LayeredStock


@dataclass(frozen=True, eq=False)
class ClampedWorkpiece:
    """The workpiece that limits the torque.

    Parameters
    ----------
    planned, real : its compliance through the removal of the stock as planned, and as it really is
    strained : greatest stress per force, as planned and real [MPa/N]
    strength : yield stress [MPa]
    stock : as it is after the program
    """

    planned: WorkpieceCompliance
    real: WorkpieceCompliance
    strained: tuple[float, float]
    strength: float
    stock: LayeredStock


@dataclass(frozen=True, eq=False)
class AllowableTorque:
    """The limit of torque along the path.

    Parameters
    ----------
    limit : of torque, from the wall alone
    torque : the limit that is kept [N mm], the least of that and the stated one; 0: not attainable
    true_torque : allowable torque of the real wall [N mm]
    one_tooth : the limit by the closed formula of one tooth [N mm], to compare; None: of a workpiece there is none
    remedy : what would make a torque allowable, where none is
    path : with what is planned and what is true
    """

    limit: PathLimit
    torque: float
    true_torque: float
    one_tooth: float | None
    remedy: str
    path: ToolPath


@dataclass(frozen=True, eq=False)
class ControlComparison:
    """Runs of the controllers, and the references of their comparison.

    Parameters
    ----------
    cases : the loop without latency, and as stated; none where no torque is allowable
    controller : of the verdict; None: likewise
    identified_from : what the spindle was identified from
    deviation : of the real spindle from what is believed
    estimate : of the torque, in the case of the verdict; None: likewise
    ideal_time : of the whole program, with the feed at the limit at every instant [s]; inf where no torque is allowable
    """

    cases: tuple[ControllerCase, ...]
    controller: Override | None
    table: FuzzyTable
    spindle: Spindle
    identified_from: Literal["current", "power"]
    deviation: SpindleDeviation
    estimate: SpindleEstimate | None
    ideal_time: float


@dataclass(frozen=True, eq=False)
class TorqueResult:
    """Result of a torque job.

    Parameters
    ----------
    wall : the thin wall, or the workpiece, that limits the torque
    step_checks : the steps for the checks in addition to the stated limits
    blank : the stock as it really is before the program, with the cutters
    stock_check : of the real stock as it is at each moment
    findings : of the simulations of the plan and of the truth, and on the real stock
    resolution_error : relative error of loads by column of the simulation of the truth
    energy_balance : work over the specific energy of the volume removed, less 1, by tool number: as planned, and real
    """

    job: TorqueInputs
    wall: ShellWall | ClampedWorkpiece
    allowable: AllowableTorque
    control: ControlComparison
    step_checks: StepChecks
    blank: Blank
    stock_check: StockCheck
    findings: tuple[Finding, ...]
    resolution_error: Mapping[str, float]
    energy_balance: Mapping[str, Mapping[int, float]]

    @property
    def attainable(self) -> bool:
        """Whether any torque is allowable."""
        return self.allowable.torque > 0.0

    @property
    def source(self) -> str:
        """Source of the limit: `deflection`, `strength`, `workpiece deflection` or `stated`."""
        return "stated" if self.allowable.torque < self.allowable.limit.torque else self.allowable.limit.by

    def time_of(self, run: ControllerRun) -> float:
        """Time of the whole program with a controller [s], with the rapids before and behind its feeds."""
        written = self.job.written
        return written.approach + run.outcome.time + (written.retract if run.outcome.finished else 0.0)

    def numbers_of(self, run: ControllerRun) -> dict[str, Any]:
        """Numbers of a controller in summary.json."""
        return {"time_s": self.time_of(run), **run.numbers()}

    def compared(self, case: ControllerCase) -> dict[str, float]:
        """How much shorter than the constant feed and than the model alone, the share of what is possible, and by how
        much the error differs from the constant feed's, all in percent.
        """
        controlled, plain, model = case.runs[HELD], case.runs[PLAIN], case.runs[MODEL]
        least = float(plain.error.max())
        took, longest = self.time_of(controlled), self.time_of(plain)
        saved, possible = longest - took, longest - self.control.ideal_time
        return {
            "shorter_percent": 100.0 * (1.0 - took / longest),
            "shorter_than_model_percent": 100.0 * (1.0 - took / self.time_of(model)),
            "of_possible_percent": 100.0 * saved / possible if possible > 0.0 else 0.0,
            "form_error_change_percent": 100.0 * (float(controlled.error.max()) / least - 1.0) if least > 0.0 else 0.0,
        }
