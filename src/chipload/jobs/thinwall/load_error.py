"""Error of the loads on a thin wall against a finer simulation: layers, slices, steps and rotations.

Every pass that has the greatest load of some column is checked as in :mod:`chipload.simulation.accuracy`: a few of its
steps are calculated again in a finer stock. With e_p the error of a pass relative to its own worst value w_p, and w the
worst of all passes, the error of the whole is the greatest e_p w_p / w.

The deflection of the wall is proportional to the force along its normal, that of the cutter to the whole force. A floor
moves under the axial force and under the lateral one: the greater of the two errors counts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.program.program import Program
from chipload.simulation.accuracy import AXIAL, COMPARABLE, COMPARED, axial_force
from chipload.simulation.chips import resolution_error_of, setting_of
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock


@dataclass(frozen=True, eq=False)
class SimulatedPass:
    """A pass: its path, the stock before it, the columns of its removal, its cutter and the resolution; whether it cuts
    a floor.
    """

    program: Program
    before: LayeredStock
    columns: Mapping[str, NDArray[Any]]
    cutter: Cutter
    resolution: Resolution
    floor: bool = False

    @property
    def compared(self) -> Mapping[str, NDArray[Any]]:
        """Columns whose error is estimated: on a floor the force along the axis instead of that along the normal of a
        surface next to the cutter.
        """
        names = COMPARED if self.floor else COMPARABLE
        axial = {AXIAL: axial_force(self.columns)} if self.floor else {}
        return {name: self.columns[name] for name in names} | axial


def load_error(passes: Sequence[SimulatedPass], material: Material) -> dict[str, float]:
    """Relative error of the worst value of each column of loads over all passes.

    Parameters
    ----------
    passes : in the order of cutting

    Returns
    -------
    mapping of column to at least 0; inf where it is not known, as where a pass takes only films, for which no loads are
    computed
    """
    if any(p.columns["chip_volume_mm3"].any() and not p.columns["chip_areas"].any() for p in passes):
        return dict.fromkeys(COMPARABLE, math.inf)
    compared = [p.compared for p in passes]
    names = tuple(compared[0])
    worst = {name: np.array([float(c[name].max(initial=0.0)) for c in compared]) for name in names}
    out = dict.fromkeys(names, 0.0)
    for k in sorted({int(values.argmax()) for values in worst.values()}):
        p = passes[k]
        setting = setting_of({p.cutter.number: p.cutter}, material, p.resolution, "slerp", None, 1)
        found = resolution_error_of(p.program, p.before, {**p.columns, **compared[k]}, setting, names)[0]
        for name in names:
            whole = float(worst[name].max())
            share = float(worst[name][k]) / whole if whole > 0.0 else 1.0
            out[name] = max(out[name], found[name] * share)
    if AXIAL in out:  # a floor moves under the lateral force as well
        out["force_normal_n"] = max(out["force_n"], out.pop(AXIAL))
    return out
