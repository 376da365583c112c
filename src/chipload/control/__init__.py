"""Torque control while a program runs: spindle model, controllers, plant and the HAL component."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.control.fuzzy import FuzzyTable
    from chipload.control.hal import HalJob
    from chipload.control.hal_file import load_hal
    from chipload.control.linuxcnc.path import ToolPath, tool_path, write_path
    from chipload.control.override import Override
    from chipload.control.plant import Loop, TorqueProfile
    from chipload.control.spindle_model import Spindle

__all__ = [
    "FuzzyTable",
    "HalJob",
    "Loop",
    "Override",
    "Spindle",
    "ToolPath",
    "TorqueProfile",
    "load_hal",
    "tool_path",
    "write_path",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "plant": "Loop TorqueProfile",
        "spindle_model": "Spindle",
        "override": "Override",
        "fuzzy": "FuzzyTable",
        "hal": "HalJob",
        "hal_file": "load_hal",
        "linuxcnc.path": "ToolPath tool_path write_path",
    },
)
