"""Error of the loads on a thin wall against a finer simulation: slices, steps and rotations.

It is the resolution error of the removal of the whole program, as in :mod:`chipload.simulation.accuracy`: the steps
with the greatest loads, and some others, are calculated again.

The deflection of the wall is proportional to the force along its normal, that of the cutter to the whole force. A floor
moves under the axial force and under the lateral one: the greater of the two errors counts.
"""

from __future__ import annotations

from collections.abc import Mapping

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.program.program import Program
from chipload.simulation.accuracy import AXIAL, COMPARABLE, COMPARED, axial_force
from chipload.simulation.chips import resolution_error_of, with_moves
from chipload.simulation.removal import Removal, Resolution, RunSettings
from chipload.stock.layers import LayeredStock


def load_error(
    program: Program,
    before: LayeredStock,
    removal: Removal,
    cutters: Mapping[int, Cutter],
    material: Material,
    resolution: Resolution,
    *,
    floors: bool = False,
) -> dict[str, float]:
    """Relative error of the worst value of each column of loads of a removal.

    Parameters
    ----------
    before : the stock before the whole program
    floors : floors are cut, so that the force along the axis is compared too, and that along the normal of a surface
        next to the cutter is not

    Returns
    -------
    mapping of column to at least 0; inf where it is not known
    """
    names = (*COMPARED, AXIAL) if floors else COMPARABLE
    columns = {**removal.columns, AXIAL: axial_force(removal.columns)}
    setting = RunSettings(cutters, material, resolution, None, 1)
    setting = with_moves(setting, program, before)
    found = resolution_error_of(program, before, columns, setting, names)[0]
    out = {name: found[name] for name in names}
    if floors:  # a floor moves under the lateral force as well
        out["force_normal_n"] = max(out["force_n"], out.pop(AXIAL))
    return out
