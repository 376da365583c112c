"""What a learned material is worth to a job: the job run with the material before, and run with the material after."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from chipload.cutting.learned import KnowledgeWorth
from chipload.files import hash_of
from chipload.result import LimitCheck, Result


def worth_of_knowledge(job: Path, before: Result, after: Result) -> KnowledgeWorth:
    """Return the worth of what was learned between two runs of a job.

    Parameters
    ----------
    job : its file
    before, after : of the job with the material before and after
    """
    nearest = deciding_load(before.limits)
    name, shares = "", (0.0, 0.0)
    if nearest is not None:
        name = nearest.name
        now = [x for c in after.limits if c.name == name and (x := share_of_limit(c)) is not None]
        shares = (share_of_limit(nearest) or 0.0, max(now, default=0.0))
    saving = (_relative_saving(before), _relative_saving(after))
    return KnowledgeWorth(
        job.name, hash_of(job), (str(before.verdict), str(after.verdict)), name, shares,
        (_seconds(before), _seconds(after)),
        (saving[0], saving[1]) if saving[0] is not None and saving[1] is not None else None,
    )  # fmt: skip


def deciding_load(limits: Iterable[LimitCheck]) -> LimitCheck | None:
    """Return the limit of a load that is nearest to its bound, or furthest beyond it; None: no load has a budget."""
    shares = [(x, check) for check in limits if (x := share_of_limit(check)) is not None]
    return max(shares, key=lambda each: each[0])[1] if shares else None


def share_of_limit(check: LimitCheck) -> float | None:
    """What a load may be at the confidence of its limit over the limit; None: it is no load."""
    if check.value_at_confidence is None or not check.limit or check.column.least:
        return None
    return check.value_at_confidence / abs(check.limit)


def _seconds(result: Result) -> float:
    return float(sum(track.time_s or 0.0 for track in result.in_use))


def _relative_saving(result: Result) -> float | None:
    """Time that new feeds save of the time at the programmed feeds, relative; None: the job finds none."""
    old = [n["feeds"]["time_before_s"] for n in result.operations if "feeds" in n]
    new = [n["feeds"]["time_after_s"] for n in result.operations if "feeds" in n]
    return 1.0 - sum(new) / sum(old) if old and sum(old) > 0.0 else None
