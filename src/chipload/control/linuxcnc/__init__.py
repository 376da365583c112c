"""LinuxCNC: the path and the position on it, the pins of the controller, a spindle to test against."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.control.linuxcnc.hal_client import ControlledMachine, HalPins, PinValues
    from chipload.control.linuxcnc.panel import panel_hal, panel_xml
    from chipload.control.linuxcnc.path import ToolPath, locate, read_path, tool_path, write_path
    from chipload.control.linuxcnc.simulated_spindle import (
        Load,
        SpindleState,
        advance,
        at_speed,
        estimate_state,
        read_current,
    )

__all__ = [
    "ControlledMachine",
    "HalPins",
    "Load",
    "PinValues",
    "SpindleState",
    "ToolPath",
    "advance",
    "at_speed",
    "estimate_state",
    "locate",
    "panel_hal",
    "panel_xml",
    "read_current",
    "read_path",
    "tool_path",
    "write_path",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "hal_client": "ControlledMachine HalPins PinValues",
        "panel": "panel_hal panel_xml",
        "path": "ToolPath locate read_path tool_path write_path",
        "simulated_spindle": "Load SpindleState advance at_speed estimate_state read_current",
    },
)
