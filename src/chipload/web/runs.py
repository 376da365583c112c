"""A job in a separate process: reports progress, can be stopped, and ends with the page.

Notation: the process writes a JSON value a line: ``{"done": 0..1, "what": text}`` while it works and at its end
``{"code": exit code of `chipload run`, "message": text}``; of a draft before that ``{"first": text}``, what a coarse
run found. It stops when its input closes, so that no run outlives the page.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from chipload.processes import own_group, stop_group

#: word of the worker for a draft
DRAFT = "--draft"
#: seconds that a run has to stop by itself
PATIENCE = 8.0
#: characters that are kept of the output of a failed run
KEPT = 2000

State = Literal["running", "stopping", "done", "stopped", "failed"]


class JobRun:
    """One run: its ``state``, the share ``done``, ``what`` it does; at its end its ``code`` and its ``message``.

    Parameters
    ----------
    job, out : names in the opened folder
    overrides : values in the place of those of the job, as `--set` takes them
    compared : name of the result that it is compared with; None: none
    draft : run with the guesses of a draft, after a coarse run whose verdict is ``first`` as soon as it is known
    """

    def __init__(
        self, job: str, out: str, overrides: Sequence[str] = (), compared: str | None = None, draft: bool = False
    ) -> None:
        self.draft, self.first = draft, ""
        self.job, self.out, self.overrides, self.compared = job, out, tuple(overrides), compared
        self.state: State = "running"
        self.done, self.what = 0.0, "starting"
        self.code: int | None = None
        self.message = ""
        self._process: asyncio.subprocess.Process | None = None

    @property
    def ended(self) -> bool:
        """Whether it has ended."""
        return self.state in ("done", "stopped", "failed")

    async def work(self, job: Path, out: Path) -> None:
        """Start the process and follow it to its end."""
        words = [sys.executable, "-m", "chipload.web.worker", str(job), str(out), *self.overrides]
        words += [DRAFT] if self.draft else []
        pipe = asyncio.subprocess.PIPE
        try:
            process = await asyncio.create_subprocess_exec(*words, stdin=pipe, stdout=pipe, stderr=pipe, **own_group())
        except OSError as err:
            self.state, self.code, self.message = "failed", 1, f"no process could be started: {err.strerror}"
            return
        self._process = process
        # it may be stopped while its process is started
        stop = asyncio.create_task(_end(process)) if self.state == "stopping" else None
        output, warned = process.stdout, process.stderr
        if output is None or warned is None:
            self.state, self.code, self.message = "failed", 1, "the process has no input or output"
            return
        faults = asyncio.create_task(_tail(warned))
        async for line in output:
            self._take(line)
        code = await process.wait()
        fault = await faults
        if stop is not None:
            await stop
        stopped = self.state == "stopping"
        if self.code is None:
            self.code = code
            self.message = (
                "stopped: nothing was written" if stopped else f"the run ended without a message: {fault or code}"
            )
        finished = self.code in (0, 3)  # it may have been done before the stop came
        self.state = "done" if finished else "stopped" if stopped or self.code == 130 else "failed"

    async def stop(self) -> None:
        """Ask it to stop, and end it where it does not."""
        if self.ended:
            return
        self.state = "stopping"
        if self._process is not None:
            await _end(self._process)

    def _take(self, line: bytes) -> None:
        with contextlib.suppress(ValueError, TypeError, AttributeError):
            values = json.loads(line)
            if "first" in values:
                self.first = str(values["first"])
            elif "code" in values:
                self.code, self.message = int(values["code"]), str(values["message"])
            else:
                self.done, self.what = float(values["done"]), str(values["what"])


async def _end(process: asyncio.subprocess.Process) -> None:
    """Ask a process to stop, and kill it where it does not."""
    if process.returncode is not None:
        return
    stop_group(process.pid)
    try:
        await asyncio.wait_for(process.wait(), PATIENCE)
    except TimeoutError:
        stop_group(process.pid, kill=True)


async def _tail(stream: asyncio.StreamReader) -> str:
    kept = b""
    while chunk := await stream.read(4096):
        kept = (kept + chunk)[-KEPT:]
    lines = kept.decode("utf-8", "replace").strip().splitlines()
    return lines[-1] if lines else ""


class Runs:
    """The runs of this page: one at a time, seen in every window."""

    def __init__(self) -> None:
        self.now: JobRun | None = None

    async def stop(self) -> None:
        """Stop what runs."""
        if self.now is not None:
            await self.now.stop()
