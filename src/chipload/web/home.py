"""The results of a folder, grouped by the job that they come from, the newest first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path, PurePosixPath

from chipload.errors import InputError
from chipload.files import hash_of
from chipload.result import LimitCheck, Verdict, read_summary
from chipload.result.first_lines import critical_check
from chipload.result.load import SUMMARY
from chipload.result.summary import Summary, limit_from
from chipload.web.folder_access import FolderEntry, resolve_name


@dataclass(frozen=True)
class HomeResult:
    """A result in the list.

    Parameters
    ----------
    name : of its folder in the opened one
    title, message : of its summary
    verdict, critical : and the limit with the least margin; None: it has none
    changed_ns : when it was written [ns since 1970]
    """

    name: str
    title: str
    message: str
    verdict: Verdict
    critical: LimitCheck | None
    changed_ns: int

    @property
    def date(self) -> str:
        """When it was written, in the time of this computer."""
        return f"{datetime.fromtimestamp(self.changed_ns / 1e9):%Y-%m-%d %H:%M}"


@dataclass(frozen=True)
class HomeGroup:
    """A job and its results, the newest first.

    Parameters
    ----------
    title : the name of the job in the opened folder, else the title of its results
    job : its name in the opened folder; None: it is not there
    """

    title: str
    job: str | None
    results: tuple[HomeResult, ...]


def home_groups(root: Path, entries: Sequence[FolderEntry]) -> list[HomeGroup]:
    """Group the results of a folder by their jobs, that of the newest result first; jobs without a result follow."""
    jobs = [e.name for e in entries if e.kind == "job"]
    grouped: dict[tuple[str, str], list[HomeResult]] = {}
    for entry in entries:
        if entry.kind != "result":
            continue
        try:
            path = resolve_name(root, entry.name)
            summary = read_summary(path)
            found = _result(entry.name, summary, (path / SUMMARY).stat().st_mtime_ns)
        except (InputError, OSError):
            continue  # it went away since the folder was read
        job = _job_of(root, entry.name, summary.provenance.inputs.get("job", ""), jobs)
        parent = PurePosixPath(entry.name).parent.as_posix()
        grouped.setdefault(("", job) if job else (parent, found.title), []).append(found)
    groups = []
    for (parent, title), results in grouped.items():
        results.sort(key=lambda one: (-one.changed_ns, one.name))
        groups.append(HomeGroup(title or "result", None if parent else title, tuple(results)))
    groups.sort(key=lambda group: (-group.results[0].changed_ns, group.title))
    without = [job for job in jobs if ("", job) not in grouped]
    return [*groups, *(HomeGroup(job, job, ()) for job in without)]


# -- parts ------------------------------------------------------------------------------------------------------
def _result(name: str, summary: Summary, changed_ns: int) -> HomeResult:
    try:
        critical = critical_check(limit_from(one) for one in summary.limits)
    except ValueError:
        critical = None
    return HomeResult(name, summary.job, summary.message, summary.verdict, critical, changed_ns)


def _job_of(root: Path, result: str, stated: str, jobs: Sequence[str]) -> str:
    """The job of a result: of the name that it states, next to its folder, else with the stated hash; empty: none."""
    file, _, digest = stated.rpartition(" sha256 ")
    named = [job for job in jobs if PurePosixPath(job).name == file]
    parent = PurePosixPath(result).parent
    siblings = [job for job in named if PurePosixPath(job).parent == parent]
    if siblings:
        return siblings[0]
    for job in named:
        try:
            if hash_of(resolve_name(root, job)) == digest:
                return job
        except InputError:
            continue
    return ""
