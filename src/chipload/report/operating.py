"""The operating points of a track in the stability charts of its tools: spindle speed and margin of each row."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.result import Result, Track
from chipload.units import rpm_from_rad_s

Floats = NDArray[np.float64]

#: columns of a history that are needed
COLUMNS = ("stability_margin", "power_w", "torque_mean_nm")


@dataclass(frozen=True, eq=False)
class OperatingPoints:
    """Spindle speed and stability margin along a track, and the margins of its tools over speed.

    Parameters
    ----------
    wanted : least margin that is wanted
    charts : by tool number, speeds [1/min] and the least margin of the cuts of the tool at each
    rpm, margin : (n,) of each row; 0 where nothing is cut, or the margin is not known
    """

    wanted: float
    charts: Mapping[int, tuple[list[float], list[float]]]
    rpm: Floats
    margin: Floats


def operating_points(result: Result, track: Track, columns: Mapping[str, NDArray[Any]]) -> OperatingPoints | None:
    """The points of a track; None: its result has no chart, or its history lacks :data:`COLUMNS`.

    The spindle turns at power over mean torque.

    >>> power, torque = np.array([0.0, 314.159265]), np.array([0.0, 1.0])
    >>> np.round(_speed(power, torque), 3).tolist()
    [0.0, 3000.0]
    """
    operation = result.operations[track.operation] if track.operation < len(result.operations) else {}
    stability: Any = operation.get("stability")
    chart = stability.get("chart") if isinstance(stability, Mapping) else None
    if not chart or not set(COLUMNS) <= set(columns):
        return None
    margin, power, torque = (np.nan_to_num(np.asarray(columns[name], dtype=np.float64)) for name in COLUMNS)
    rpm = _speed(power, torque)
    charts = {int(c["tool"]): ([float(v) for v in c["speed_rpm"]], [float(v) for v in c["margin"]]) for c in chart}
    return OperatingPoints(float(stability["margin_wanted"]), charts, rpm, np.where(rpm > 0.0, margin, 0.0))


def _speed(power: Floats, torque: Floats) -> Floats:
    """(n,) spindle speed [1/min]; 0 where there is no torque."""
    cuts = (torque > 0.0) & (power > 0.0)
    return np.asarray(np.where(cuts, power / np.where(cuts, torque, 1.0) * rpm_from_rad_s(1.0), 0.0))
