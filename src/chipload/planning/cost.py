"""What a pass costs: time, force, torque and wall error at every step, as columns of a history.

Notation: v [mm/s] speed of the cutter's centre, f_z = 2 pi v / (N omega) [mm] feed per tooth at spindle speed omega
[rad/s] and N teeth; phi immersion as in :mod:`chipload.engagement.contact`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_along
from chipload.cutting.material import Material
from chipload.cutting.wall import Milling, wall_error_along
from chipload.engagement.contact import PIECES, Engagement
from chipload.planning.result import Columns, LimitCheck, worst
from chipload.units import mm_min_from_mm_s

Floats = NDArray[np.float64]

#: limits a job may state: the column each one is held against, and whether only where the wall is made
LIMITS: Mapping[str, tuple[str, bool]] = {
    "engagement_deg": ("engagement_deg", True),
    "error_um": ("error_um", True),
    "force_xy_n": ("force_xy_n", False),
    "torque_nm": ("torque_nm", False),
}


@dataclass(frozen=True)
class Cut:
    """What stays the same over an operation: cutter, material, depth of cut [mm], spindle speed [rad/s], sense."""

    cutter: Cutter
    material: Material
    axial_depth: float
    spindle_speed: float
    milling: Milling

    def feed_per_tooth(self, speed: Floats) -> Floats:
        """f_z = 2 pi v / (N omega) [mm] at the speed v [mm/s] of the centre."""
        return math.tau * speed / (self.cutter.flutes * self.spindle_speed)


def cost(
    cut: Cut, zone: NDArray[Any], s: Floats, t: Floats, centre: Floats, heading: Floats, z: float, met: Engagement,
    speed: Floats, makes_wall: NDArray[np.bool_],
) -> Columns:  # fmt: skip
    """History columns of the steps of one pass, forces from the one force model.

    Parameters
    ----------
    zone : (n,) str, the history's `pass`
    s, t : (n,) length [mm] and time [s] along the pass
    centre, heading : (n, 2) [mm], unit feed
    z : height of the tip [mm]
    met : the exact engagement
    speed : (n,) [mm/s]
    makes_wall : (n,) bool, where the wall error is asked for; 0 elsewhere
    """
    f_z = cut.feed_per_tooth(speed)
    count = np.clip(met.count, 0, PIECES)
    phi_in, phi_out = met.phi[:, :, 0], met.phi[:, :, 1]
    load = forces_along(
        phi_in,
        phi_out,
        f_z,
        heading,
        cut.cutter,
        cut.material,
        cut.axial_depth,
        spindle_speed=cut.spindle_speed,
        count=count,
    )
    error = np.zeros(len(s))
    signed = np.zeros(len(s))
    if makes_wall.any():
        wall = wall_error_along(
            phi_in[makes_wall],
            phi_out[makes_wall],
            f_z[makes_wall],
            cut.cutter,
            cut.material,
            cut.axial_depth,
            milling=cut.milling,
            count=count[makes_wall],
        )
        error[makes_wall], signed[makes_wall] = wall["error_um"], wall["error_signed_um"]
    return {
        "pass": zone,
        "s_mm": s,
        "t_s": t,
        "x_mm": centre[:, 0],
        "y_mm": centre[:, 1],
        "z_mm": np.full(len(s), z),
        "engagement_deg": np.degrees(met.angle),
        "arcs": met.count.astype(np.int64),
        "feed_mm_min": mm_min_from_mm_s(1.0) * speed,
        **load,
        "error_um": error,
        "error_signed_um": signed,
    }


def stacked(parts: Iterable[Columns]) -> Columns:
    """One history from those of passes that follow one another; lengths and times go on."""
    rows = list(parts)
    out: dict[str, NDArray[Any]] = {name: np.concatenate([r[name] for r in rows]) for name in rows[0]}
    for name in ("s_mm", "t_s"):
        start = np.cumsum([0.0] + [float(r[name][-1]) for r in rows[:-1]])
        out[name] = np.concatenate([r[name] + a for r, a in zip(rows, start, strict=True)])
    return out


def check_limits(limits: Mapping[str, float], history: Columns, wall_pass: NDArray[np.bool_]) -> tuple[LimitCheck, ...]:
    """Every stated limit against its worst row: engagement and wall error on the wall, the others anywhere."""
    out = []
    for name, limit in limits.items():
        column, on_wall = LIMITS[name]
        where = wall_pass if on_wall else np.ones(len(history[column]), dtype=bool)
        value, at = worst(history, column, where)
        out.append(LimitCheck(name, limit, value, at))
    return tuple(out)
