"""What a run of a job hands to the report, and the verdict over it.

The verdict stands on the strategy that each operation releases: its limits, its failures and its proof. Other
strategies are shown beside it and do not change the verdict.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from chipload.cutter.cutter import Cutter
from chipload.machine.machine import Machine
from chipload.planning.result import LimitCheck, OperationResult

#: what the independent check says of a program that it agrees with; else `failed` or `unproven`
PROVED = "proved"


@dataclass(frozen=True)
class Proof:
    """What the independent check says of one strategy: `proved`, `failed` or `unproven`, one sentence, JSON values."""

    status: str
    says: str
    numbers: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Operation:
    """One operation with what is needed to show it.

    Parameters
    ----------
    result : of the planner
    settings : the keys of the job, as stated
    cutter : the tool
    top, depth : z of the stock's top, depth of cut [mm]
    proofs : by strategy
    beyond : by strategy, what its program asks of the machine that it does not give
    """

    result: OperationResult
    settings: Mapping[str, Any]
    cutter: Cutter
    top: float
    depth: float
    proofs: Mapping[str, Proof]
    beyond: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Outcome:
    """A whole run.

    Parameters
    ----------
    title : name of the job
    operations : in their order
    machine : that the programs are written for
    unchecked : limits that the job does not state
    findings : of the job and of its readers
    provenance : JSON values: hashes of the inputs, versions, sources of coefficients
    """

    title: str
    operations: tuple[Operation, ...]
    machine: Machine
    unchecked: tuple[str, ...]
    findings: tuple[str, ...]
    provenance: Mapping[str, Any]


@dataclass(frozen=True)
class Failure:
    """Something that does not hold: what, where (x, y) [mm] or None."""

    text: str
    at: tuple[float, float] | None

    def __str__(self) -> str:
        """The text with its place.

        >>> str(Failure("engagement_deg 18.7 exceeds 13", (20.0, 3.0)))
        'engagement_deg 18.7 exceeds 13 at (20.000, 3.000)'
        """
        return self.text if self.at is None else f"{self.text} at ({self.at[0]:.3f}, {self.at[1]:.3f})"


#: how the sentence of a verdict begins that is none
REFUSED = "Does not hold: "
#: a limit in words, and its unit
WORDS: Mapping[str, tuple[str, str]] = {
    "engagement_deg": ("engagement", "deg"),
    "force_xy_n": ("force", "N"),
    "torque_nm": ("torque", "N m"),
    "error_um": ("wall error", "um"),
}


def exceeds(check: LimitCheck) -> str:
    """`engagement 18.74 deg exceeds 13 deg`."""
    word, unit = WORDS.get(check.name, (check.name, ""))
    return f"{word} {check.worst:.4g} {unit} exceeds {check.limit:g} {unit}"


def _held(check: LimitCheck) -> str:
    word, unit = WORDS.get(check.name, (check.name, ""))
    return f"{word} {check.worst:.4g} of {check.limit:g} {unit}"


def failures(operation: Operation, strategy: str) -> tuple[Failure, ...]:
    """What does not hold in one strategy: limits, failed events, the machine, the proof."""
    result = operation.result.strategies[strategy]
    out = [Failure(exceeds(c), c.at) for c in result.limits if not c.holds]
    out += [Failure(e.text, (e.x, e.y)) for e in result.events if e.failure]
    out += [Failure(text, None) for text in operation.beyond.get(strategy, ())]
    proof = operation.proofs.get(strategy)
    if proof is None:
        out.append(Failure("the program was not checked by the simulation", None))
    elif proof.status != PROVED:
        out.append(Failure(f"simulation: {proof.says}", None))
    return tuple(out)


def released(operation: Operation, strategy: str) -> bool:
    """Whether a program may be called verified: the one in use, and nothing fails."""
    return strategy == operation.result.use and not failures(operation, strategy)


def verdict(outcome: Outcome) -> tuple[bool, str]:
    """Whether everything holds, and one sentence that says it."""
    bad = [(k, op, f) for k, op in enumerate(outcome.operations) for f in failures(op, op.result.use)]
    if bad:
        k, op, first = bad[0]
        more = f"; and {len(bad) - 1} more" if len(bad) > 1 else ""
        return False, f"{REFUSED}operation {k} ({_named(op)}): {first}{more}."
    held = [
        f"{_named(op)}: {', '.join(_held(c) for c in used.limits)}"
        for op in outcome.operations
        for used in [op.result.strategies[op.result.use]]
    ]
    return True, f"Every stated limit holds and the simulation agrees ({'; '.join(held)})."


def _named(operation: Operation) -> str:
    kind, use = operation.result.kind, operation.result.use
    return kind if kind == use else f"{kind}, {use}"
