"""Simulated passes of a thin wall in the checkpoint of a run: a resumed run does not simulate a plan again.

A plan depends on the job and on the plans before it; its key is that of its passes. What it leaves and the error of its
loads are calculated after the simulation, where they are needed, and are kept as parts of their own: where only these
are missing, the plan is simulated again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.jobs.kept_parts import KeptRecords
from chipload.jobs.thinwall.job import ThinWallJob
from chipload.jobs.thinwall.outcome import Finish, Shape, Surfaces
from chipload.jobs.thinwall.proof import Proof
from chipload.planning.thinwall.passes import Plan
from chipload.result import Provenance
from chipload.result.provenance import sources, versions
from chipload.simulation.checkpoint import Checkpoint, digest
from chipload.simulation.surface import Collision

#: what a part may be made of besides arrays and plain values
RECORDS = (Collision, Finish, Shape, Surfaces)


def kept_of(job: ThinWallJob, checkpoint: Checkpoint | None, provenance: Provenance) -> KeptRecords:
    """Parts of a job that its checkpoint keeps."""
    key = digest(job.table.model_dump_json(), provenance.inputs, versions(), sources())
    return KeptRecords(checkpoint, key, RECORDS)


def kept_proof(keep: KeptRecords, plan: Plan, prove: Callable[[], Proof]) -> Proof:
    """Simulation result of a plan, from the checkpoint or by ``prove``."""
    passes = tuple((p.operation, p.side, p.low, p.high, p.threshold.speed, p.correction) for p in plan.passes)
    key, made = (plan.name, passes), list[Proof]()

    def simulated() -> Proof:
        if not made:
            made.append(prove())
        return made[0]

    def tree() -> tuple[Any, ...]:
        proof = simulated()
        columns = {name: _plain(values) for name, values in proof.columns.items()}
        return columns, proof.thresholds

    columns, thresholds = keep(("proof", *key), tree)
    return Proof(
        {name: values.astype(object) if values.dtype.kind == "U" else values for name, values in columns.items()},
        thresholds,
        lambda: keep(("surfaces", *key), lambda: simulated().find_surfaces()),
        lambda: keep(("error of the loads", *key), lambda: dict(simulated().find_load_error())),
        made[0].removal if made else None,
    )


def _plain(values: NDArray[Any]) -> NDArray[Any]:
    """A column as it is kept: texts of fixed length."""
    return values.astype(np.str_) if values.dtype == object else np.asarray(values)
