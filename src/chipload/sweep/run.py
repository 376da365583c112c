"""The run of a sweep: all cases of a job, and the combination that holds in the least time."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chipload.errors import InputError
from chipload.files import hash_of, is_file, read_regular
from chipload.number_text import number_text
from chipload.progress import Progress, silent
from chipload.result import Verdict
from chipload.sweep.case_run import REFUSED, Record, case_key, case_record, kept_record
from chipload.sweep.cases import Case, Samples, cases_of
from chipload.sweep.sampled import sample_files
from chipload.tables import LARGEST_FILE, parse_toml
from chipload.workers import Workers

#: share of the samples in which a combination must hold
CONFIDENCE = 0.95
#: folder of the cases in the folder of a sweep
CASES = "cases"
#: a longer text is no name of a file
LONGEST_NAME = 1000


@dataclass(frozen=True)
class Combination:
    """One combination of values, over all samples of the material.

    Parameters
    ----------
    number : from 1
    values : key path and value
    records : of its cases
    """

    number: int
    values: tuple[tuple[str, str], ...]
    records: tuple[Record, ...]

    @property
    def refused(self) -> bool:
        """Whether chipload refuses the job with these values."""
        return any(record["state"] == REFUSED for record in self.records)

    @property
    def holding(self) -> int:
        """Cases whose verdict is `holds`."""
        return sum(record["state"] == Verdict.HOLDS for record in self.records)

    @property
    def probability(self) -> float:
        """Share of the cases that hold; without samples 0 or 1."""
        return self.holding / len(self.records)

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson interval of the probability at 95 %; without samples the value itself."""
        if len(self.records) == 1:
            return self.probability, self.probability
        from scipy.stats import binomtest

        found = binomtest(self.holding, len(self.records)).proportion_ci(0.95, method="wilson")
        return float(found.low), float(found.high)

    @property
    def time_s(self) -> float | None:
        """Longest time of its programs [s]; None: no case has one."""
        times = [record["time_s"] for record in self.records if record["time_s"] is not None]
        return max(times) if times else None

    @property
    def use_of_limits(self) -> float | None:
        """Greatest share of a limit that a case uses; None: not known."""
        shares = [record["use_of_limits"] for record in self.records if record["use_of_limits"] is not None]
        return max(shares) if shares else None


@dataclass(frozen=True, eq=False)
class SweepResult:
    """Result of a sweep.

    Parameters
    ----------
    cases : in their order
    records : of the cases
    confidence : share of the samples in which a combination must hold
    """

    cases: tuple[Case, ...]
    records: tuple[Record, ...]
    confidence: float = CONFIDENCE

    @property
    def combinations(self) -> tuple[Combination, ...]:
        """The combinations with the records of their cases."""
        pairs = zip(self.cases, self.records, strict=True)
        out = []
        for number, group in itertools.groupby(pairs, key=lambda pair: pair[0].combination):
            members = list(group)
            out.append(Combination(number, members[0][0].values, tuple(record for _, record in members)))
        return tuple(out)

    @property
    def best(self) -> Combination | None:
        """The combination that holds in the least time, of equal ones that which uses its limits least."""
        holding = [c for c in self.combinations if not c.refused and c.probability >= self.confidence]
        return min(holding, key=lambda c: (c.time_s or 0.0, c.use_of_limits or 0.0, c.number), default=None)

    @property
    def message(self) -> str:
        """The result in one line."""
        all_of_them, best = self.combinations, self.best
        refused = sum(c.refused for c in all_of_them)
        head = f"{len(self.cases)} cases, {len(all_of_them)} combinations, {refused} refused"
        if best is None:
            return f"{head}; none holds" + (f" in {self.confidence:.0%} of its samples" if self._is_sampled else "")
        values = ", ".join(f"{key}={value}" for key, value in best.values) or "the job as stated"
        time = "" if best.time_s is None else f" in {number_text(best.time_s)} s"
        low, high = best.interval
        chance = f" with a probability of {best.probability:.3g} ({low:.3g} to {high:.3g})" if self._is_sampled else ""
        return f"{head}; best: {values}: holds{time}{chance}"

    @property
    def _is_sampled(self) -> bool:
        return any(case.sample for case in self.cases)


def run_sweep(
    job: str | Path, over: Sequence[str], out: str | Path, *, samples: Samples | None = None, workers: int = 1,
    dask: str | None = None, confidence: float = CONFIDENCE, progress: Progress = silent,
) -> SweepResult:  # fmt: skip
    """Run every case of a sweep; cases that an earlier run finished in the same folder are not run again.

    Parameters
    ----------
    job : the job file
    over : texts ``key.path=a,b,c``, see :func:`chipload.sweep.cases_of`
    out : folder of the sweep: ``cases/`` has a record, a summary and a history for each case
    samples : of material and modes, for each combination
    workers : processes
    dask : address of a Dask scheduler whose workers see the same files; then ``workers`` has no meaning
    confidence : share of the samples in which a combination must hold

    Raises
    ------
    InputError
        The job, a key or a number cannot be used; the cluster does not answer.
    WorkerDied
        A case ends its worker again and again; what is finished stays.

    Notes
    -----
    Work O(cases); the records do not depend on the number or the kind of the workers.
    """
    where = Workers(workers, dask)
    if not 0.0 < confidence <= 1.0:
        raise InputError(f"--confidence = {confidence:g}: must be above 0 and at most 1")
    job, out, samples = Path(job).absolute(), Path(out).absolute(), samples or Samples()
    text = read_regular(job, str(job), LARGEST_FILE, "not a job")
    cases = cases_of(over, samples.count)
    files = sample_files(job, cases, samples, out)
    (out / CASES).mkdir(parents=True, exist_ok=True)
    inputs = _inputs(
        job.parent, [parse_toml(job.name, text), *(value.strip("\"'") for c in cases for _, value in c.values)]
    )
    records: dict[int, Record] = {}
    tasks, waiting = [], []
    for k, case in enumerate(cases):
        chosen = files[case.combination][case.sample - 1] if case.sample else None
        overrides = (*case.overrides, *(chosen.overrides if chosen else ()))
        folder = out / CASES / case.name
        hashed = inputs | (dict(chosen.hashes) if chosen else {})
        key = case_key(text, hashed, (*case.overrides, str(case.sample)))
        if (kept := kept_record(folder, key)) is not None:
            records[k] = kept
        else:
            tasks.append((str(job), overrides, str(folder), key))
            waiting.append(k)
    progress(len(records) / len(cases), f"{len(records)} of {len(cases)} cases")
    for number, record in where.completed(case_record, tasks):
        records[waiting[number]] = record
        progress(len(records) / len(cases), f"{len(records)} of {len(cases)} cases")
    return SweepResult(cases, tuple(records[k] for k in range(len(cases))), confidence)


def _inputs(folder: Path, raw: Any) -> dict[str, str]:
    """Hashes of the files that the values of a job name, by name."""
    if isinstance(raw, dict):
        raw = list(raw.values())
    if isinstance(raw, list):
        return {name: hashed for value in raw for name, hashed in _inputs(folder, value).items()}
    if not isinstance(raw, str) or len(raw) > LONGEST_NAME or not is_file(folder / raw):
        return {}
    return {raw: hash_of(folder / raw)}
