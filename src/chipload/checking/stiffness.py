"""The stiffness of cutter, holder, spindle and workpiece of a job, as far as it is stated.

Notation: a stiffness that is not stated counts as infinite and is named in the result; every deflection is then a lower
bound.

Reference: [Altintas2012] ch. 2; [Schmitz2009] ch. 9 for the joints.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace

import numpy as np

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.ranges import number_field, require_ranges
from chipload.simulation.chip_space import flute_fill
from chipload.simulation.deflection import tip_deflections
from chipload.simulation.loads import Cuts, Floats
from chipload.simulation.removal import Removal
from chipload.structure.cells.states import StepCompliances
from chipload.structure.spindle import RIGID, Bar, cutter_bars, springs, tool_bars, tube

#: N/mm in 1 N/um, N mm/rad in 1 N m/rad, MPa in 1 GPa
PER = 1000.0
#: moduli of holders that are believed [GPa]
MODULI = (50.0, 1000.0)


@dataclass(frozen=True, kw_only=True)
class MachineStiffness:
    """Stiffness of holder, spindle and workpiece; inf is rigid.

    What is not stated counts as rigid, and deflections are then unproven.

    Parameters
    ----------
    holder_gpa : Young's modulus of the holders
    grip_n_um, grip_nm_rad : stiffness of the cutter in its holder, across the axis and against tilting
    spindle_n_um, spindle_nm_rad : stiffness of the spindle nose, across the axis and against tilting
    work_n_um : stiffness of the workpiece where it is cut, the same in every direction
    """

    holder_gpa: float | None = number_field(None, above=0.0, infinite=True)
    grip_n_um: float | None = number_field(None, above=0.0, infinite=True)
    grip_nm_rad: float | None = number_field(None, above=0.0, infinite=True)
    spindle_n_um: float | None = number_field(None, above=0.0, infinite=True)
    spindle_nm_rad: float | None = number_field(None, above=0.0, infinite=True)
    work_n_um: float | None = number_field(None, above=0.0, infinite=True)

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        require_ranges(self, "stiffness.")


@dataclass(frozen=True)
class Stiffness:
    """Compliant components of a job: cutter, holder and spindle as bars, and the workpiece.

    Parameters
    ----------
    bars : by tool number, from the tip to the spindle
    work : compliance of the work [mm/N], the same everywhere, or that of a workpiece in the state of each step; None:
        not stated
    room : whether a cutter states its chip space
    unknown : keys that are not stated; their components count as rigid
    """

    bars: Mapping[int, tuple[Bar, ...]]
    work: float | StepCompliances | None
    room: bool
    unknown: tuple[str, ...]


def stiffness_of(
    stated: MachineStiffness | None, cutters: Mapping[int, Cutter], workpiece: StepCompliances | None = None
) -> Stiffness:
    """Return bars and joints of every cutter, and the compliance of the work.

    Raises
    ------
    InputError
        The modulus of the holders is none of a metal.

    Examples
    --------
    >>> mill = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
    >>> stiffness_of(MachineStiffness(spindle_n_um=50.0), {1: mill}).unknown[:2]
    ('stiffness.grip_n_um', 'stiffness.grip_nm_rad')
    """
    stated = stated or MachineStiffness()
    modulus = stated.holder_gpa
    if modulus is not None and math.isfinite(modulus) and not MODULI[0] <= modulus <= MODULI[1]:
        raise InputError(
            f"stiffness.holder_gpa = {modulus:g}: must be from {MODULI[0]:g} to {MODULI[1]:g}, or inf for rigid holders"
        )
    chains = {n: c for n, c in cutters.items() if c.tip_stiffness is None}
    keys = [k for k in asdict(stated) if k != "holder_gpa"] if chains else ["work_n_um"]
    missing = [f"stiffness.{k}" for k in keys if getattr(stated, k) is None]
    if workpiece is not None:
        missing = [name for name in missing if name != "stiffness.work_n_um"]
    # a spindle that does not tilt feels no lever: the length of a rigid holder does not matter then
    matters = modulus is None or math.isfinite(modulus) or math.isfinite(stated.spindle_nm_rad or 1.0)
    bare = sorted(n for n, c in chains.items() if not c.holder) if matters else []
    if modulus is None and len(bare) < len(chains):
        missing.append("stiffness.holder_gpa")
    missing += [f"holder_mm of cutter {n}" for n in bare]
    grip = springs(PER * (stated.grip_n_um or math.inf), PER * (stated.grip_nm_rad or math.inf))
    nose = springs(PER * (stated.spindle_n_um or math.inf), PER * (stated.spindle_nm_rad or math.inf))
    bars = {n: tool_bars(c) for n, c in cutters.items() if n not in chains}
    for number, cutter in chains.items():
        holder = [_part(length, diameter, modulus) for length, diameter in cutter.holder]
        bars[number] = (*cutter_bars(cutter, grip), *holder, Bar(0.0, 0.0, nose))
    work = workpiece if workpiece is not None or stated.work_n_um is None else 1.0 / (PER * stated.work_n_um)
    return Stiffness(bars, work, any(c.gullet is not None for c in cutters.values()), tuple(missing))


def _part(length: float, diameter: float, modulus: float | None) -> Bar:
    """Return a part of a holder as a solid bar [mm, GPa]."""
    if modulus is None or math.isinf(modulus):
        return Bar(length, 0.0, RIGID)
    return tube(length, diameter, PER * modulus)


def deflection_watch(stiffness: Stiffness, material: Material) -> Callable[[Cuts], dict[str, Floats]]:
    """Return a watch with the columns of deflection of tool and work, and of flute fill if the chip space is stated."""

    def columns(cuts: Cuts) -> dict[str, Floats]:
        work = stiffness.work.at(cuts.step) if isinstance(stiffness.work, StepCompliances) else stiffness.work
        found = tip_deflections(cuts, material, bars=stiffness.bars[cuts.tool], work=work)
        return found if cuts.cutter.gullet is None else found | {"flute_fill": flute_fill(cuts)}

    return columns


def watched_columns(stiffness: Stiffness, *, formed: bool = False) -> tuple[str, ...]:
    """Return the names of the watched columns; with ``formed`` also those of the form error."""
    work = () if stiffness.work is None else ("deflection_workpiece_um",)
    room = ("flute_fill",) if stiffness.room else ()
    return (
        "deflection_cutter_um",
        *work,
        "deflection_um",
        *room,
        *(("form_error_um", "form_points") if formed else ()),
    )


def with_columns(removal: Removal, names: tuple[str, ...]) -> Removal:
    """Return a removal that has these columns even if no step cuts."""
    still = {name: np.zeros(len(removal.columns["line"])) for name in names if name not in removal.columns}
    return replace(removal, columns={**removal.columns, **still}) if still else removal
