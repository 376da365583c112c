"""Data of a removal: the resolution, settings and running sums of a simulation, and its result."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon

from chipload.cutter.cutter import Cutter
from chipload.cutting.load_parts import LoadParts
from chipload.cutting.material import Material
from chipload.engagement.chips.move import Move
from chipload.errors import Finding
from chipload.simulation.engagement_samples import EngagementSamples
from chipload.simulation.loads import Cuts, part_of_cuts
from chipload.simulation.moves import MoveRun

Floats = NDArray[np.float64]
Columns = Mapping[str, NDArray[Any]]

#: more columns of steps that cut
Watch = Callable[[Cuts], Mapping[str, Floats]]
#: takes the columns of a block of steps
Seen = Callable[[Columns], None]

#: columns that have a band, and the column of its standard deviation; linear in the force are those of ``force_sd_n``
BANDED = {
    "force_n": "force_sd_n",
    "torque_nm": "torque_sd_nm",
    "torque_mean_nm": "torque_mean_sd_nm",
    "power_w": "power_sd_w",
    "deflection_um": "force_sd_n",
    "deflection_workpiece_um": "force_sd_n",
    "form_error_um": "force_sd_n",
    "cutter_stress_mpa": "force_sd_n",
}


def unseen(columns: Columns) -> None:
    """Take the columns of a block and do nothing: the default of every ``seen=`` argument."""


@dataclass(frozen=True)
class Resolution:
    """Resolution of a simulation.

    Parameters
    ----------
    step_mm : longest step of the tip [mm]
    tolerance : how far chords leave the edges of chips [mm]
    corner_slices : slices of a corner radius
    flank_mm : length of a slice along the flank [mm]
    rotation : angle between two rotations at which the force is calculated [rad]
    grading : of the slices of a corner, see :func:`chipload.cutter.slices.slices`
    bottom_slices : slices of the bottom line
    estimated : whether some steps are computed again for the resolution error of the loads
    """

    step_mm: float
    tolerance: float
    corner_slices: int
    flank_mm: float
    rotation: float = math.radians(1.0)
    grading: float = 1.0
    bottom_slices: int = 4
    estimated: bool = True


@dataclass(frozen=True, eq=False)
class ChipAreas:
    """The chip of one step on one layer: the one with most pieces, of those the one whose pieces are most alike.

    Parameters
    ----------
    step : its number
    move, cutter : of the step
    height : of the layer's section [mm]
    before : (multi)polygon, the section before the step, around the cutter
    chips : the pieces
    """

    step: int
    move: Move
    cutter: Cutter
    height: float
    before: Any
    chips: tuple[Polygon, ...]


@dataclass(frozen=True, eq=False)
class Removal:
    """The removal of a program: its columns, volumes, accuracy and findings.

    Parameters
    ----------
    columns : (n,) each, one row for each step, see :func:`remove`
    volume_before, volume_after : of the stock [mm^3]
    mean_band : (4,) standard deviation of the mean force x, y, z [N] and torque [N m] over the time in cut, from that
        of the coefficients; None: the material does not state their uncertainty
    piece : the chip with most pieces that are most alike (:mod:`chipload.simulation.chip_areas`); None: not asked for
    findings : rapids that cut, feeds that cut with the spindle at rest
    labels : of the program, `label` of the columns counts in them
    cuts : tooth engagement, one for each cutter that cuts; empty unless requested
    energy_balance : work over the specific energy of the volume removed, less 1, by tool number; empty where nothing
        was cut or it was not asked for
    resolution_error : relative error of the worst value of a column, by its name; empty unless it was asked for; both
        as :mod:`chipload.simulation.accuracy` says
    load_parts : other parts of the error of the worst load of a tool, by tool and column; empty like it
    samples : tooth engagement of some steps, to be shown; None: none was asked for, or nothing cut
    """

    columns: Columns
    volume_before: float
    volume_after: float
    mean_band: tuple[float, ...] | None
    piece: ChipAreas | None
    findings: tuple[Finding, ...]
    labels: tuple[str, ...]
    cuts: tuple[Cuts, ...] = ()
    energy_balance: Mapping[int, float] = field(default_factory=dict)
    resolution_error: Mapping[str, float] = field(default_factory=dict)
    load_parts: Mapping[tuple[int, str], LoadParts] = field(default_factory=dict)
    samples: EngagementSamples | None = None

    @property
    def band_error(self) -> dict[str, float]:
        """Standard deviation over the value, by column, at the greatest value of the column: what the spread of the
        coefficients makes of it. Empty where the material does not state their uncertainty.

        Deflection and stress are linear in the force of one rotation: theirs is that of the force.
        """
        out: dict[str, float] = {}
        for name, band in BANDED.items():
            if band in self.columns and name in self.columns:
                k = int(np.argmax(np.abs(self.columns[name])))
                base = self.columns["force_n" if band == "force_sd_n" else name]
                if base[k] > 0.0:
                    out[name] = float(self.columns[band][k] / base[k])
        return out


def removal_between(whole: Removal, first: int, end: int) -> Removal:
    """Return the columns and tooth engagement of the steps from ``first`` to before ``end`` of a removal, numbered from
    0; its volumes, accuracy and findings are those of the whole.
    """
    cuts = tuple(
        part_of_cuts(each, a, b)
        for each in whole.cuts
        for a, b in [np.searchsorted(each.step, [first, end]).tolist()]
        if b > a
    )
    cuts = tuple(replace(each, step=each.step - first) for each in cuts)
    return replace(whole, columns={name: values[first:end] for name, values in whole.columns.items()}, cuts=cuts)


@dataclass(frozen=True, eq=False)
class RunSettings:
    """What a run keeps to, step after step: see :func:`chipload.simulation.chips.remove`; ``moves`` the run of the
    program, None before it is made; ``workers`` threads; ``loads`` False: the loads are 0; ``other``: a further
    material, whose loads of the same contact are calculated too; ``uncounted``: see :class:`MoveRun`.
    """

    cutters: Mapping[int, Cutter]
    material: Material
    resolution: Resolution
    watch: Watch | None
    workers: int
    moves: MoveRun | None = None
    loads: bool = True
    other: Material | None = None
    uncounted: int = -1

    @property
    def run(self) -> MoveRun:
        """The run of the program."""
        if self.moves is None:
            raise ValueError("the settings hold no run yet: see chipload.simulation.chips.with_moves")
        return self.moves

    @property
    def asks_shank(self) -> bool:
        """Whether the run asks for the shank in material."""
        return self.moves is not None and self.moves.shank is not None


@dataclass(frozen=True, eq=False)
class RunningSums:
    """Running sums after some steps, which continue in the next.

    Parameters
    ----------
    before : volume of the stock before the first step [mm^3]
    steps : how many they are
    s_mm, t_s, cut_s : their length [mm], their time and the time in cut [s]
    basis : (4, 6) integral over the time in cut of the factors of the coefficients
    rapids : lines with rapids that cut, and with feeds that cut with the spindle at rest
    shank : the run asks for the shank in material
    """

    before: float
    steps: int = 0
    s_mm: float = 0.0
    t_s: float = 0.0
    cut_s: float = 0.0
    basis: Floats = field(default_factory=lambda: np.zeros((4, 6)))
    rapids: tuple[int, ...] = ()
    shank: bool = False
