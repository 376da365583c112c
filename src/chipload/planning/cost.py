"""What a pass costs: time, force, torque and wall error at every step, as columns of a history.

Notation: v [mm/s] speed of the cutter's centre, f_z = 2 pi v / (N omega) [mm] feed per tooth at spindle speed omega
[rad/s] and N teeth; phi immersion as in :mod:`chipload.engagement.contact`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_along
from chipload.cutting.material import Material
from chipload.cutting.rigid import OF_DEPTH, OF_FEED, deflection_share
from chipload.cutting.strength import cutter_stress
from chipload.cutting.wall_error import Milling, wall_error_along
from chipload.engagement.contact import PIECES, Engagement
from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.planning.result import Columns
from chipload.structure.spindle import chain_compliance, tool_bars
from chipload.units import mm_min_from_mm_s

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class CutConditions:
    """What stays the same over an operation.

    Parameters
    ----------
    cutter, material : of the operation
    axial_depth : [mm]
    spindle_speed : [rad/s]
    milling : ``down`` or ``up``
    of_feed, of_depth : deflection over feed per tooth and over radial depth up to which the rigid model holds
    """

    cutter: Cutter
    material: Material
    axial_depth: float
    spindle_speed: float
    milling: Milling
    of_feed: float = OF_FEED
    of_depth: float = OF_DEPTH

    def feed_per_tooth(self, speed: Floats) -> Floats:
        """f_z = 2 pi v / (N omega) [mm] at the speed v [mm/s] of the centre."""
        return math.tau * speed / (self.cutter.flutes * self.spindle_speed)


def cost(
    cut: CutConditions, zone: NDArray[Any], s: Floats, t: Floats, centre: Floats, heading: Floats, z: float, met:
    Engagement,
    speed: Floats, makes_wall: NDArray[np.bool_],
) -> Columns:  # fmt: skip
    """History columns of the steps of one pass, forces from the one force model.

    Parameters
    ----------
    zone : (n,) str, the history's `pass`
    s, t : (n,) length [mm] and time [s] along the pass
    centre, heading : (n, 2) [mm], unit feed
    z : height of the tip [mm]
    met : the exact engagement, phi in the sense of the spindle
    speed : (n,) [mm/s]
    makes_wall : (n,) bool, where the wall error is needed; 0 elsewhere
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
        spindle="ccw" if cut.cutter.left_hand else "cw",
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
        error[makes_wall], signed[makes_wall] = wall["form_error_um"], wall["form_error_signed_um"]
    return {
        "pass": zone,
        "s_mm": s,
        "t_s": t,
        "x_mm": centre[:, 0],
        "y_mm": centre[:, 1],
        "z_mm": np.full(len(s), z),
        "engagement_deg": np.degrees(met.angle),
        "arcs": met.count.astype(np.int64),
        "arc_from_rad": phi_in[:, 0],
        "arc_to_rad": phi_out[:, 0],
        "heading_x": heading[:, 0],
        "heading_y": heading[:, 1],
        "feed_mm_min": mm_min_from_mm_s(1.0) * speed,
        **load,
        **_bending_columns(cut, phi_in, phi_out, f_z, count, load["force_xy_n"]),
        "form_error_um": error,
        "form_error_signed_um": signed,
    }


def _bending_columns(
    cut: CutConditions, phi_in: Floats, phi_out: Floats, f_z: Floats, count: NDArray[np.int64], force: Floats
) -> Columns:
    """Stress of the cutter, its deflection as if the whole force acted at the tip (an upper bound), and that over the
    greatest with which the rigid model holds.
    """
    plain = engagement_of_arcs(phi_in, phi_out, f_z, cut.cutter, cut.axial_depth, count=count)
    # where the machine slows down or speeds up in a step, no chip is thicker than at the feed of its neighbours
    around = np.concatenate([f_z[:1], f_z, f_z[-1:]])
    fed = np.maximum(f_z, np.maximum(around[:-2], around[2:]))
    chips = engagement_of_arcs(phi_in, phi_out, fed, cut.cutter, cut.axial_depth, count=count)
    tip = float(chain_compliance(tool_bars(cut.cutter), 0.0, 0.0))
    deflection = 1000.0 * tip * force
    return {
        "cutter_stress_mpa": cutter_stress(chips_of_teeth(plain, cut.cutter), cut.cutter, cut.material),
        "deflection_cutter_um": deflection,
        "deflection_share": deflection_share(chips, deflection, cut.of_feed, cut.of_depth),
    }


def stack_histories(parts: Iterable[Columns]) -> Columns:
    """One history from those of passes that follow one another; lengths and times continue."""
    rows = list(parts)
    out: dict[str, NDArray[Any]] = {name: np.concatenate([r[name] for r in rows]) for name in rows[0]}
    for name in ("s_mm", "t_s"):
        start = np.cumsum([0.0] + [float(r[name][-1]) for r in rows[:-1]])
        out[name] = np.concatenate([r[name] + a for r, a in zip(rows, start, strict=True)])
    return out
