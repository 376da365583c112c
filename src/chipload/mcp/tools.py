"""What a client of the server can call: functions from texts and numbers to answers, without the protocol."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from chipload.errors import InputError
from chipload.jobs import LoadedJob, check_job, load_job, run_job
from chipload.jobs.coarse import coarser, mark_coarse
from chipload.jobs.drafts.draft import write_draft
from chipload.jobs.drafts.make import draft_of
from chipload.jobs.shipped import LISTINGS
from chipload.mcp.answers import limit_explanation, listing_answer, result_answer
from chipload.mcp.folders import NamedFolders
from chipload.mcp.picture import columns_picture
from chipload.progress import Progress, silent
from chipload.report.folder import check_target, write_finished
from chipload.result.load import load_result
from chipload.result.plot import USUAL
from chipload.result.result import Result

#: endings of files that are listed: programs, bodies, drawings, tables
SHOWN = (".ngc", ".nc", ".h", ".mpf", ".apt", ".cls", ".tap", ".stl", ".step", ".stp", ".dxf", ".toml", ".tbl", ".json",
         ".csv", ".ini", ".fcstd")  # fmt: skip
#: most files of a list
MOST_FILES = 500


class ClientTools:
    """The functions of the server on the files of its folders.

    Parameters
    ----------
    folders : that may be touched
    """

    def __init__(self, folders: NamedFolders) -> None:
        self.folders = folders

    def list_files(self) -> dict[str, Any]:
        """Return jobs, results and other files of the folders, at most 500, hidden ones left out."""
        found: list[dict[str, str]] = []
        for root in self.folders.roots:
            for path in sorted(root.rglob("*")):
                name = path.relative_to(root)
                if any(part.startswith(".") for part in name.parts) or not self.folders.contains(path):
                    continue
                if path.name == "summary.json":
                    found.append({"path": str(path.parent), "kind": "result"})
                elif path.suffix.lower() in SHOWN and path.is_file():
                    found.append({"path": str(path), "kind": "job" if path.name == "job.toml" else "file"})
        return {
            "folders": [str(root) for root in self.folders.roots],
            "files": found[:MOST_FILES],
            "left_out": max(len(found) - MOST_FILES, 0),
        }

    def listing(self, name: str) -> dict[str, Any]:
        """Return what comes with chipload: ``machines``, ``materials``, ``cutters`` or ``examples``."""
        return {name: listing_answer(LISTINGS[name]())}

    def draft(self, file: str, folder: str, machine: str | None = None, tools: str | None = None) -> dict[str, Any]:
        """Write a job for a program, drawing or model; what the file does not state is a guess to confirm."""
        target = self.folders.new(folder)
        if (target / "job.toml").exists():
            raise InputError(f"{folder}: has a job already: name another folder")
        made = draft_of(
            self.folders.existing(file), target,
            machine=None if machine is None else self.folders.source(machine),
            tools=None if tools is None else self.folders.existing(tools),
        )  # fmt: skip
        job = write_draft(made, target)
        return {"job": str(job), "title": made.title, "found": list(made.notes), "guesses": list(made.guesses)}

    def check(self, job: str, overrides: Sequence[str] = ()) -> dict[str, Any]:
        """Return what a job names and whether it can run; nothing is simulated."""
        lines, runs = check_job(self._load_job(job, overrides))
        return {"runs": runs, "reason": "every file and value can be used" if runs else lines[-1], "lines": lines}

    def simulate(
        self,
        job: str,
        result: str,
        overrides: Sequence[str] = (),
        *,
        coarse: bool = False,
        progress: Progress = silent,
    ) -> tuple[dict[str, Any], bytes | None]:
        """Run a job, write its result folder, and return its verdict and a picture of its loads."""
        loaded, target = self._load_job(job, overrides), self.folders.new(result)
        if coarse:
            loaded = self._load_job(job, (*overrides, *coarser(loaded)))
        check_target(target)
        done = run_job(loaded, lambda part, what: progress(0.8 * part, what), accept=True)
        done = mark_coarse(done) if coarse else done
        written = write_finished(
            done.result, done.presentation, target, lambda part, what: progress(0.8 + 0.2 * part, what)
        )
        return result_answer(done.result, written), self._loads(done.result)

    def feeds(
        self,
        job: str,
        result: str,
        slowest_percent: float = 30.0,
        fastest_percent: float = 200.0,
        overrides: Sequence[str] = (),
        *,
        progress: Progress = silent,
    ) -> tuple[dict[str, Any], bytes | None]:
        """Give the lines of a program the fastest feeds that the limits of its job allow, simulated again."""
        feeds = [
            f"operation.0.feeds.slowest_percent={float(slowest_percent)}",
            f"operation.0.feeds.fastest_percent={float(fastest_percent)}",
        ]
        return self.simulate(job, result, (*overrides, *feeds), progress=progress)

    def read_result(self, result: str) -> dict[str, Any]:
        """Return the verdict of a result folder, its reason, limits, findings and programs."""
        folder = self.folders.existing(result)
        return result_answer(load_result(folder), folder)

    def explain_limit(self, name: str, result: str | None = None) -> dict[str, Any]:
        """Return what a limit means, and where and why a result holds or exceeds it."""
        return limit_explanation(name, None if result is None else load_result(self.folders.existing(result)))

    def picture(self, result: str, columns: Sequence[str] = (), track: str = "") -> bytes:
        """Return the columns of a track over time with their limits, as PNG."""
        drawn = self._draw_result(load_result(self.folders.existing(result)), columns, track)
        if drawn is None:
            raise InputError(f"{result}: its result has no history to draw")
        return drawn

    def _load_job(self, job: str, overrides: Sequence[str]) -> LoadedJob:
        """Return a job of the folders that names no file outside of them."""
        path = self.folders.existing(job)
        self.folders.require_job(path, overrides)
        return load_job(path, tuple(overrides))

    def _loads(self, result: Result) -> bytes | None:
        """Return the picture of a result; None: it has no history, or nothing of it is drawn."""
        try:
            return self._draw_result(result, (), "")
        except InputError:
            return None

    def _draw_result(self, result: Result, columns: Sequence[str], track: str) -> bytes | None:
        names = [one.name for one in result.tracks]
        if track and track not in names:
            raise InputError(f"track {track!r}: is not in the result, which has {', '.join(names) or 'none'}")
        if not names:
            return None
        chosen = result.track(track or names[0])
        history = chosen.columns
        if not history or "t_s" not in history:
            return None
        bound = [check.column.name for check in chosen.limits]
        wanted = list(columns) or [name for name in dict.fromkeys((*bound, *USUAL)) if name in history]
        if missing := [name for name in wanted if name not in history]:
            raise InputError(f"column {missing[0]}: is not in the history, which has {', '.join(history)}")
        limits = {check.column.name: check.limit for check in chosen.limits}
        return columns_picture(history["t_s"], {name: history[name] for name in wanted}, limits)
