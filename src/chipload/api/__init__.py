"""The functions of chipload in Python: what the command line does, from values.

Tables and keys are those of the job file, with the units in their names; ``docs/jobs.md`` lists them. Every function
that plans or simulates builds the job that a TOML file of the same keys gives, and gives back its result and what is
written into a result folder. Libraries are imported when a function is called.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.api.jobs import check_job, load_result, run_job, write_result
    from chipload.api.loads import fit_coefficients, hold_torque, optimise_feeds
    from chipload.api.planning import plan_contour, plan_impeller, plan_pocket, plan_thin_wall
    from chipload.api.reading import read_machine, read_material, read_program

__all__ = [
    "check_job",
    "fit_coefficients",
    "hold_torque",
    "load_result",
    "optimise_feeds",
    "plan_contour",
    "plan_impeller",
    "plan_pocket",
    "plan_thin_wall",
    "read_machine",
    "read_material",
    "read_program",
    "run_job",
    "write_result",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "jobs": "check_job load_result run_job write_result",
        "loads": "fit_coefficients hold_torque optimise_feeds",
        "planning": "plan_contour plan_impeller plan_pocket plan_thin_wall",
        "reading": "read_machine read_material read_program",
    },
)
