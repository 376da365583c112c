"""What a written program of an impeller removes of the stock that the programs before it leave."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding
from chipload.result import LimitCheck, Verdict
from chipload.result.limits import Columns


@dataclass(frozen=True, eq=False)
class ProgramRemoval:
    """What a program removes of the stock that the programs before it leave.

    Parameters
    ----------
    columns : (n,) each, a row a step; none: it could not be simulated
    step : (m,) int, row of the history at which each row of the program as it was read ends
    limits, findings : of the simulation
    energy_balance : as of a track
    loads : whether teeth and material are stated
    stock : volume [mm^3] before all programs, and less what those take whose removal is calculated together; not what
        roughing takes in a channel before them
    contact : (n, 2, 3) float [mm], ends of the contact line of each row, nan where nothing is cut; None: not kept
    """

    columns: Columns = field(default_factory=dict)
    step: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    limits: tuple[LimitCheck, ...] = ()
    findings: tuple[Finding, ...] = ()
    energy_balance: Mapping[int, float] = field(default_factory=dict)
    loads: bool = False
    stock: tuple[float, float] = (0.0, 0.0)
    contact: NDArray[np.float64] | None = None

    @property
    def verdict(self) -> Verdict:
        """The worst of its limits and findings."""
        return Verdict.worst([*(c.state for c in self.limits), *(Verdict.of_finding(f) for f in self.findings)])

    def numbers(self) -> dict[str, Any]:
        """Numbers for summary.json."""
        c = self.columns
        if not c:
            return {"steps": 0}
        volume, rapid = np.asarray(c["chip_volume_mm3"]), np.asarray(c["rapid"])
        loads = (
            ("force_n", "torque_nm", "power_w", "chip_max_mm", "deflection_cutter_um", "deflection_workpiece_um")
            if self.loads
            else ()
        )
        return {
            "steps": len(volume),
            "removed_mm3": float(volume.sum()),
            "rapids_take_mm3": float(volume[rapid].sum()),
            "cutting_s": float(np.asarray(c["duration_s"])[(volume > 0.0) & ~rapid].sum()),
            "stock_before_mm3": self.stock[0],
            "stock_after_mm3": self.stock[1],
            **{name: float(np.max(c[name], initial=0.0)) for name in loads if name in c},
        }
