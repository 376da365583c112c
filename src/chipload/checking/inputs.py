"""The inputs of the check of a program, as plain values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import get_args

from chipload.checking.clamped import Workpiece
from chipload.checking.dynamics import Vibration
from chipload.checking.settings import CheckSettings, Limits, SimulationSettings
from chipload.checking.stiffness import MachineStiffness
from chipload.checking.workpiece import FinishedPart, Fixture, Stock, Surroundings
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.errors import InputError, InputErrors
from chipload.machine.machine import Machine


@dataclass(frozen=True)
class Elasticity:
    """What bends or vibrates: holder and spindle, clamped workpiece, modes; None: not stated.

    Parameters
    ----------
    stiffness : of holder, spindle and workpiece
    workpiece : elastic, in its clamps
    vibration : modes of cutter and workpiece
    """

    stiffness: MachineStiffness | None = None
    workpiece: Workpiece | None = None
    vibration: Vibration | None = None


def contradictions(limits: Limits, elasticity: Elasticity, part: bool) -> Iterator[str]:
    """Yield a message for each limit whose inputs are not stated, and for each value that another one replaces.

    Parameters
    ----------
    part : whether the finished part is stated
    """
    for key in ("form_error_um", "gouge_mm", "excess_mm"):
        if not part and getattr(limits, key) is not None:
            yield f"limits.{key}: needs the finished part: state [part] or leave it out"
    vibration, workpiece = elasticity.vibration, elasticity.workpiece
    if vibration is None:
        for key in ("stability_margin", "stable_probability", "sle_um"):
            if getattr(limits, key) is not None:
                yield f"limits.{key}: needs modes of vibration: state [dynamics] or leave it out"
    elif limits.stable_probability is not None and vibration.frequency_percent is None:
        yield (
            "limits.stable_probability: needs deviations of the modes: state frequency_percent, damping_percent and "
            "stiffness_percent"
        )
    stiff = elasticity.stiffness is not None and elasticity.stiffness.work_n_um is not None
    if workpiece is None:
        if limits.deflection_workpiece_um is not None and not stiff:
            yield "limits.deflection_workpiece_um: needs the workpiece and its clamps: state [workpiece]"
        return
    if stiff:
        yield "stiffness.work_n_um: leave it out: [workpiece] states its compliance"
    if workpiece.damping_ratio is not None and workpiece.density_kg_m3 is None:
        yield "workpiece.damping_ratio: needs density_kg_m3, without which the workpiece has no modes"
    if workpiece.density_kg_m3 is not None and vibration is not None:
        for k, mode in enumerate(vibration.modes):
            if mode.of == "workpiece":
                yield f"dynamics.mode.{k}: of the workpiece: leave it out: workpiece.density_kg_m3 gives its modes"


@dataclass(frozen=True, eq=False)
class CheckInputs:
    """Everything that the simulation and check of a program needs besides the program.

    Parameters
    ----------
    cutters : by tool number
    material : force coefficients
    machine : whose spindle supplies torque and power
    stock : before the program
    settings : of the simulation
    limits : of loads and part
    checks : switches of the default checks
    surroundings : part and fixtures
    elasticity : what bends or vibrates
    speeds_rpm : least and greatest spindle speed that is searched for quiet speeds; None: that of the machine
    loads : whether the teeth and the material are those of the job; False: they stand for ones that are not stated, and
        only the removal and what it depends on is calculated
    outlines : whether the outlines of the stock that is left are made; False: of it only the volume is known, and it is
        not searched for loose pieces and slender walls
    """

    cutters: Mapping[int, Cutter]
    material: Material
    machine: Machine
    stock: Stock
    settings: SimulationSettings
    limits: Limits = field(default_factory=Limits)
    checks: CheckSettings = field(default_factory=CheckSettings)
    surroundings: Surroundings = field(default_factory=Surroundings)
    elasticity: Elasticity = field(default_factory=Elasticity)
    speeds_rpm: tuple[float | None, float | None] = (None, None)
    loads: bool = True
    outlines: bool = True

    def __post_init__(self) -> None:
        """Refuse values of another kind, and values that contradict one another."""
        for name, value, kind in (
            ("limits", self.limits, Limits),
            ("checks", self.checks, CheckSettings),
            ("settings", self.settings, SimulationSettings),
            ("stiffness", self.elasticity.stiffness, MachineStiffness | None),
            ("workpiece", self.elasticity.workpiece, Workpiece | None),
            ("dynamics", self.elasticity.vibration, Vibration | None),
            ("part", self.surroundings.part, FinishedPart | None),
            *((f"fixture {k}", fixture, Fixture) for k, fixture in enumerate(self.surroundings.fixtures)),
        ):
            if not isinstance(value, kind):
                own = kind if isinstance(kind, type) else get_args(kind)[0]
                raise InputError(f"{name}: {type(value).__name__}: must be a {own.__name__}")
        texts = list(contradictions(self.limits, self.elasticity, self.surroundings.part is not None))
        if not self.outlines and (self.checks.loose_stock or self.checks.slender_walls):
            texts.append("outlines: without them checks.loose_stock and checks.slender_walls must be off")
        if texts:
            raise InputErrors(*texts) if len(texts) > 1 else InputError(texts[0])
