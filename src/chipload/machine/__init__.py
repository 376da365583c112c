"""Machines: axes, limits, kinematics, and speed along a path."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.machine.axis import Axis
    from chipload.machine.feed import corner_speed, limited_speed, move_time
    from chipload.machine.ini import read_ini
    from chipload.machine.kinematics import forward, inverse, with_tip
    from chipload.machine.limits import limit_findings
    from chipload.machine.machine import Machine, machine_named, machine_names, read_machine
    from chipload.machine.trajectory import TrajectoryPlanner

__all__ = [
    "Axis",
    "Machine",
    "TrajectoryPlanner",
    "corner_speed",
    "forward",
    "inverse",
    "limit_findings",
    "limited_speed",
    "machine_named",
    "machine_names",
    "move_time",
    "read_ini",
    "read_machine",
    "with_tip",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "machine": "Machine machine_named machine_names read_machine",
        "axis": "Axis",
        "ini": "read_ini",
        "kinematics": "forward inverse with_tip",
        "limits": "limit_findings",
        "trajectory": "TrajectoryPlanner",
        "feed": "limited_speed corner_speed move_time",
    },
)
