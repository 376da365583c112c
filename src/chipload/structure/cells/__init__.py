"""A workpiece in equal cells over its layered stock: finite cells, which need no mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.structure.cells.clamp import Clamp, clamp_stiffness
    from chipload.structure.cells.followed import FollowedModes, ModesOfStates
    from chipload.structure.cells.grid import CellGrid, grid_over
    from chipload.structure.cells.moments import StockRegion
    from chipload.structure.cells.nearest import StockSections
    from chipload.structure.cells.states import RemovalState, StepCompliances, StepLines, step_compliances
    from chipload.structure.cells.stress import greatest_stress
    from chipload.structure.cells.workpiece import CellWorkpiece, Elastic, cell_workpiece

__all__ = [
    "CellGrid",
    "CellWorkpiece",
    "Clamp",
    "Elastic",
    "FollowedModes",
    "ModesOfStates",
    "RemovalState",
    "StepCompliances",
    "StepLines",
    "StockRegion",
    "StockSections",
    "cell_workpiece",
    "clamp_stiffness",
    "greatest_stress",
    "grid_over",
    "step_compliances",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "clamp": "Clamp clamp_stiffness",
        "followed": "FollowedModes ModesOfStates",
        "grid": "CellGrid grid_over",
        "moments": "StockRegion",
        "nearest": "StockSections",
        "states": "RemovalState StepCompliances StepLines step_compliances",
        "stress": "greatest_stress",
        "workpiece": "CellWorkpiece Elastic cell_workpiece",
    },
)
