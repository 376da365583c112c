"""A patch: the part of one side of the channel that one cutter mills at one table angle.

Notation: u along a side from the leading edge, v from hub to shroud; alpha table angle, B pallet angle. The strips of a
side follow each other across one of u and v; the paths of a patch run along the other one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from chipload.planning.impeller.scene import Floats

#: where the lines of a patch begin
Begin = Literal["low", "high", "any"]


@dataclass(frozen=True, eq=False)
class Patch:
    """Contiguous strips of one side, milled with one cutter at one table angle.

    Parameters
    ----------
    body : 0 blade, 1 splitter, -1 hub floor
    side : `plus`, `minus` or `floor`
    order : `u` or `v`, the parameter across which strips follow each other; the paths run along the other one
    low, high : its range of that parameter, within 0..1
    cutter : index in the catalogue
    table : alpha [rad]
    at : (k, 2) u and v of its contact points
    ranges : for each contact point (m, 2) valid pallet angles [rad]; m = 0: unreachable with every cutter
    path : predicted from the step-over at its contact points, of one such side [mm]
    time : predicted, of one such side, with links where programs have shown their time [s]
    area : that is milled [mm2]
    part : range of the other parameter; not 0..1 where no cutter at one table angle mills a whole strip
    begin : border at which its lines begin, ``low`` or ``high``; `any`: they may also begin in the middle
    """

    body: int
    side: str
    order: str
    low: float
    high: float
    cutter: int
    table: float
    at: Floats
    ranges: tuple[Floats, ...]
    path: float
    time: float
    area: float
    part: tuple[float, float] = (0.0, 1.0)
    begin: Begin = "any"
