"""Settings of a simulation, limits of its loads and switches of its default checks.

These classes are the one table of defaults and ranges: the tables of the job file take theirs from here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

from chipload.cutting.rigid import OF_DEPTH, OF_FEED
from chipload.ranges import choice_field, number_field, require_ranges


@dataclass(frozen=True)
class SimulationSettings:
    """Resolution and method of a simulation.

    Parameters
    ----------
    step_mm : longest step of the tip
    tolerance_mm : greatest deviation of chords from the edges of chips
    interpolation : how the tool axis turns on a row: ``slerp`` at constant rate, ``lerp`` along a straight line
    chip_diagram : show the chip with most pieces on a layer of the stock, and the diagram of its boundary
    corner_slices : slices of a corner radius, of equal angle; None: by the inclination of the axis
    flank_mm : length of a slice of the flank; None: half the radius, or a tenth of it if the axis leans
    resolution_error : estimate the error of the loads; without it limits on loads are unproven
    stock_points_mm : greatest distance of the columns or points of the stock that are compared with shank and holder;
        None: from the cutters and the size of the stock
    join_mm : short straight cuts are simulated as one that is at most as far from them, which leaves the result
        unproven; None: each by itself
    """

    step_mm: float = number_field(above=0.0, most=100.0)
    tolerance_mm: float = number_field(0.001, least=1e-6, most=0.1)
    interpolation: Literal["slerp", "lerp"] = choice_field("slerp", "slerp", "lerp")
    chip_diagram: bool = False
    corner_slices: int | None = number_field(None, least=1, most=200, whole=True)
    flank_mm: float | None = number_field(None, above=0.0)
    resolution_error: bool = True
    stock_points_mm: float | None = number_field(None, above=0.0)
    join_mm: float | None = number_field(None, above=0.0, most=1.0)

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        require_ranges(self)

    @property
    def stated(self) -> Mapping[str, Any]:
        """The settings that are not None."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of the loads of a program and of the part that it leaves; None: not checked.

    Parameters
    ----------
    force_n, torque_nm : greatest force and torque on the cutter
    force_axial_n : greatest force on the cutter along its axis, towards either end; the axis is upright
    thrust_n : greatest thrust of a drill along its axis
    power_w : greatest mean power over a revolution
    chip_max_mm : greatest undeformed chip thickness
    deflection_um : greatest displacement between tool and workpiece
    deflection_workpiece_um : greatest deflection of the workpiece
    form_error_um : greatest thickness left on, or removed from, the part by deflection
    gouge_mm, excess_mm : deepest cut into the part, and greatest thickness left on it where the tool came near it
    stability_margin, stable_probability : least stability margin and probability of stability
    sle_um : greatest thickness left on, or removed from, a wall by forced vibration

    Examples
    --------
    >>> Limits(force_n=800.0).stated
    {'force_n': 800.0}
    """

    force_n: float | None = number_field(None, text="greatest force on the cutter", above=0.0)
    torque_nm: float | None = number_field(None, text="greatest torque on the cutter", above=0.0)
    force_axial_n: float | None = number_field(
        None, text="greatest force on the cutter along its axis, towards either end; the axis is upright", above=0.0
    )
    thrust_n: float | None = number_field(None, text="greatest thrust of a drill along its axis", above=0.0)
    power_w: float | None = number_field(None, text="greatest mean power over a revolution", above=0.0)
    chip_max_mm: float | None = number_field(None, text="greatest undeformed chip thickness", above=0.0)
    deflection_um: float | None = number_field(
        None, text="greatest displacement between tool and workpiece, see [stiffness]", above=0.0
    )
    deflection_workpiece_um: float | None = number_field(None, text="greatest deflection of the [workpiece]", above=0.0)
    form_error_um: float | None = number_field(
        None, text="greatest thickness left on, or removed from, the [part] by deflection", above=0.0
    )
    gouge_mm: float | None = number_field(None, text="deepest cut into the [part]", above=0.0)
    excess_mm: float | None = number_field(
        None, text="greatest thickness left on the [part] where the tool came near it", above=0.0
    )
    stability_margin: float | None = number_field(
        None, text="least stability margin, see [dynamics]; default 1 with [dynamics]", above=0.0, most=3.0
    )
    stable_probability: float | None = number_field(
        None, text="least probability of stability; needs deviations in [dynamics]", above=0.0, below=1.0
    )
    sle_um: float | None = number_field(
        None, text="greatest thickness left on, or removed from, a wall by forced vibration", above=0.0
    )

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        require_ranges(self, "limits.")

    @property
    def stated(self) -> dict[str, float]:
        """The limits that are stated, by name."""
        return {name: value for name, value in asdict(self).items() if value is not None}

    @property
    def unstated(self) -> tuple[str, ...]:
        """Names of the limits that are not stated; they are not checked."""
        return tuple(name for name, value in asdict(self).items() if value is None)


@dataclass(frozen=True, kw_only=True)
class CheckSettings:
    """Switches of the default checks: a check that is False is not made, and the result lists it as switched off.

    Parameters
    ----------
    confidence : one-sided, at which limits of loads are held: with resolution, runout that is not known, coefficients,
        bending, thin chips and turns; 0.5: at nominal values, so that the spread of coefficients and runout is not
        counted
    cutter_strength : stress of the cutter against its strength
    flute_length : the cutter does not cut above its flutes
    chip_space : the chip space, where ``gullet_mm2`` of a cutter is stated
    chip_range : chip thickness and cutting speed are within the range of the coefficients
    spindle : torque and power of the spindle
    rigid_model : the deflection is within the range of the rigid force model
    deflection_of_feed, deflection_of_depth : greatest ratio of the deflection to feed per tooth and radial depth of cut
    plunge : the cutters can plunge and ramp into material as the program does
    gouge : the deepest cut into the part against 0.1 mm, the least medium deviation of ISO 2768-1, where no limit is
        stated
    shank_in_stock : shank, neck and holder against the stock as it is at each moment
    loose_stock : no piece is cut on that the program has cut free of the stock
    slender_walls : no wall is left more slender than ``wall_slenderness``, where no workpiece states how it deflects
    wall_slenderness : height over thickness up to which a wall counts as rigid; 5 of aluminium 2 mm thick, clamped at
        its foot: 0.33 um/N at its edge (:mod:`chipload.simulation.heights.slender_walls`)
    stress_wall_mm : thickness of walls below which the result says that distortion by residual stress is not checked
    """

    confidence: float = number_field(0.95, least=0.5, below=1.0)
    cutter_strength: bool = True
    flute_length: bool = True
    chip_space: bool = True
    chip_range: bool = True
    spindle: bool = True
    rigid_model: bool = True
    deflection_of_feed: float = number_field(OF_FEED, above=0.0)
    deflection_of_depth: float = number_field(OF_DEPTH, above=0.0)
    plunge: bool = True
    gouge: bool = True
    shank_in_stock: bool = True
    loose_stock: bool = True
    slender_walls: bool = True
    wall_slenderness: float = number_field(5.0, least=1.0)
    stress_wall_mm: float = number_field(2.0, least=0.0)

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        require_ranges(self, "checks.")

    @property
    def off(self) -> tuple[str, ...]:
        """Names of the checks that are switched off."""
        return tuple(name for name, value in asdict(self).items() if value is False)
