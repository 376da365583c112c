"""The outcome of a distortion job: each plan with its flatness, the one in use with the displacement of its surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding
from chipload.jobs.distortion.job import DistortionJob
from chipload.jobs.distortion.plans import MillingPlan
from chipload.jobs.distortion.surface import PartSurface
from chipload.lazy import trimesh
from chipload.result import Provenance

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Banded:
    """A quantity [mm] by the stated stress, and the least and greatest by its spread from plate to plate."""

    value: float
    low: float
    high: float

    @property
    def error(self) -> float:
        """Half-width of the band over the value; inf where the value is 0 and the band is not."""
        more = max(self.high - self.value, self.value - self.low)
        return 0.0 if more == 0.0 else more / self.value if self.value > 0.0 else np.inf


@dataclass(frozen=True, eq=False)
class PlanOutcome:
    """A plan after the release of its part.

    Parameters
    ----------
    plan : that was computed
    flatness : of the underside
    distortion : greatest deviation of a face from where it was milled, over the best place of the part
    faces : flatness of each flat face by its name
    moved : (3 m, 3) float [mm] displacement of the corners of the surface from where they were made
    made : (m,) int, the setup that made each triangle, from 1; 0: face of the plate
    clamp_force : (k,) float [N], what each setup presses the part flat with; 0: it takes it as it lies
    unknowns : of the largest state
    """

    plan: MillingPlan
    flatness: Banded
    distortion: Banded
    faces: Mapping[str, Banded]
    moved: Floats
    made: NDArray[np.int64]
    clamp_force: Floats
    unknowns: int


@dataclass(frozen=True, eq=False)
class DistortionResult:
    """Result of a distortion job.

    Parameters
    ----------
    title : of the job
    mesh, surface : the part
    stated : the plan that the job states
    used : the plan in use: the flattest where the job may choose, else the stated one
    others : numbers of all plans, the flattest first: plan, flatness, distortion
    cell_error : relative error of the flatness by the cells
    cell : [mm] longest side of a cell
    wall : [mm] thickness of the thinnest wall or floor
    """

    job: DistortionJob
    title: str
    mesh: trimesh.Trimesh
    surface: PartSurface
    stated: PlanOutcome
    used: PlanOutcome
    others: tuple[tuple[MillingPlan, Banded, Banded], ...]
    cell_error: float
    cell: float
    wall: float
    findings: tuple[Finding, ...]
    provenance: Provenance
