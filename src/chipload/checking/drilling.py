"""Loads of a simulated program where a drill goes down its axis: thrust and torque of the chisel edge.

The simulation cuts with the lips up to the axis. Where a tool with a point goes down its axis, its thrust and what its
chisel edge adds to torque and power are put in, see :mod:`chipload.cutting.drilling`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.rubbing import spindle_speed
from chipload.cutter.cutter import Cutter
from chipload.cutting.drilling import drill_loads, has_lips, lip_angle
from chipload.cutting.material import Material
from chipload.simulation.holes import AXIAL, AXIAL_DEG, AXIS, down_axis
from chipload.simulation.loads import TORQUE_RISE, Cuts
from chipload.simulation.ramp import ramp_angle
from chipload.simulation.removal import Removal
from chipload.units import rpm_from_rad_s

Floats = NDArray[np.float64]
Columns = Mapping[str, NDArray[Any]]

THRUST = "thrust_n"
#: torques that the chisel edge adds to, and what has the relative size of the mean torque
TORQUES, WITH_MEAN = ("torque_nm", "torque_mean_nm"), ("torque_sd_nm", "torque_mean_sd_nm", "power_w", "power_sd_w")
#: components of the force of which the one along the axis is the thrust
FORCES = tuple(tuple(f"force_{x}_{kind}_n" for x in "xyz") for kind in ("mean", "max", "min"))


def with_drilling(removal: Removal, cutters: Mapping[int, Cutter], material: Material) -> Removal:
    """Return a removal with the column ``thrust_n`` and the loads of drills.

    Parameters
    ----------
    removal : with the column ``ramp_deg``
    cutters : by tool
    """
    columns = removal.columns
    thrust = np.zeros(len(columns["line"]))
    out: dict[str, NDArray[Any]] = {}
    down = down_axis(columns) & (np.asarray(columns["torque_mean_nm"]) > 0.0) if len(thrust) else thrust > 0.0
    for number, cutter in cutters.items():
        rows = np.flatnonzero(down & (np.asarray(columns["tool"]) == number) & has_lips(cutter))
        if len(rows):
            _put_in(columns, out, thrust, rows.astype(np.int64), cutter, material)
    return replace(removal, columns={**columns, **out, THRUST: thrust})


def _put_in(
    columns: Columns, out: dict[str, NDArray[Any]], thrust: Floats, rows: NDArray[np.int64], cutter: Cutter,
    material: Material,
) -> None:  # fmt: skip
    """Put the loads of one drill into copies of the columns."""
    feed = np.asarray(columns["feed_mm_min"])[rows] / (rpm_from_rad_s(1.0) * spindle_speed(columns)[rows])
    # the thrust is that of the revolution with the greatest torque of the step
    over = 1.0 + np.asarray(columns[TORQUE_RISE])[rows] if TORQUE_RISE in columns else np.ones(len(rows))
    lips = np.asarray(columns["torque_mean_nm"])[rows] * over * 1e3
    under = np.asarray(columns["ramp_deg"])[rows] >= AXIAL_DEG
    loads = drill_loads(cutter, material, feed, lips, under)
    thrust[rows] = loads.thrust
    grows = 1.0 + loads.chisel_torque / lips
    factors = dict.fromkeys(WITH_MEAN, grows)
    factors |= {name: 1.0 + 1e-3 * loads.chisel_torque / np.asarray(columns[name])[rows] for name in TORQUES}
    # nearly all of the stress of a drill is that of its torque
    factors["cutter_stress_mpa"] = factors["torque_nm"]
    for name, factor in factors.items():
        if name in columns:
            out.setdefault(name, np.array(columns[name], dtype=np.float64))[rows] *= factor
    axis = np.column_stack([np.asarray(columns[name])[rows] for name in AXIS])
    old = np.column_stack([np.asarray(columns[name])[rows] for name in FORCES[0]])
    along = (old * axis).sum(axis=1) * over
    for names, share in zip(FORCES, (1.0 / over, 1.0, 1.0), strict=True):
        for name, part in zip(names, axis.T, strict=True):
            out.setdefault(name, np.array(columns[name], dtype=np.float64))[rows] += (
                share * (loads.thrust - along) * part
            )
    size = np.asarray(columns["force_n"])[rows]
    whole = np.hypot(np.sqrt(np.clip(size**2 - along**2, 0.0, None)), loads.thrust)
    out.setdefault("force_n", np.array(columns["force_n"], dtype=np.float64))[rows] = whole
    if "force_sd_n" in columns:
        sd = np.asarray(columns["torque_mean_sd_nm"])[rows] * over * 1e3 / lips * whole
        out.setdefault("force_sd_n", np.array(columns["force_sd_n"], dtype=np.float64))[rows] = sd


def with_drill_loads(loads: Mapping[str, Floats], cuts: Cuts, material: Material) -> dict[str, Floats]:
    """Return greatest loads (c,) of cuts with those of a drill where it goes down its axis.

    Parameters
    ----------
    loads : as of :func:`chipload.simulation.loads.greatest_loads`
    """
    cutter, axis = cuts.cutter, cuts.plain.frames[:, 2]
    d = cuts.ends[:, 3:6] - cuts.ends[:, 0:3]
    down = -(d * axis).sum(axis=1) >= AXIAL * np.linalg.norm(d, axis=1)
    rows = np.flatnonzero(down & (loads["torque_mean_nm"] > 0.0) & has_lips(cutter))
    out = dict(loads)
    if not len(rows):
        return out
    feed = cuts.plain.chip_max()[rows] * cutter.flutes / math.cos(lip_angle(cutter))
    own = drill_loads(cutter, material, feed, 1e3 * loads["torque_mean_nm"][rows], ramp_angle(cuts)[rows] >= AXIAL_DEG)
    more = 1e-3 * own.chisel_torque
    turns = np.abs(cuts.spindle[rows])
    for name, values in (("torque_nm", more), ("torque_mean_nm", more), ("power_w", more * turns)):
        out[name] = np.array(loads[name])
        out[name][rows] += values
    out["force_n"] = np.array(loads["force_n"])
    out["force_n"][rows] = own.thrust
    out["force_axial_n"] = np.array(loads["force_axial_n"])
    out["force_axial_n"][rows] = own.thrust
    return out


def is_drilling(columns: Columns, row: int | None) -> bool:
    """Return whether a drill goes down its axis in a row; of a row that is not known, whether one does anywhere."""
    if THRUST not in columns:
        return False
    values = np.asarray(columns[THRUST], dtype=np.float64)
    return bool(values.max(initial=0.0) > 0.0 if row is None else values[row] > 0.0)
