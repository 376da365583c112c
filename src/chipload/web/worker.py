"""Run one job for the page: `python -m chipload.web.worker JOB OUT [--draft] [KEY=VALUE]...`.

With `--draft` guesses of a draft are taken as they are, as by `chipload run --accept`, and a coarse run comes first,
as by `--coarse`, whose first line is written before the whole run begins.

:mod:`chipload.web.runs` states what it writes.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time
from collections.abc import Sequence
from typing import Any, NoReturn

from chipload.errors import Cancelled, InputError, OutputError
from chipload.files import cannot_write, is_full
from chipload.progress import Progress, part_of
from chipload.web.runs import DRAFT

#: seconds between two lines of progress
BREATH = 0.1
#: set when the run is to stop: an interrupt within foreign code may be lost
ASKED = threading.Event()
#: share of the progress that the coarse run is
FIRST = 0.15


def work(job: str, out: str, *words: str) -> dict[str, Any]:
    """Run the job, with overrides, and write its result; the exit code of `chipload run`, and its message."""
    kept_text, draft = "", DRAFT in words
    overrides = tuple(word for word in words if word != DRAFT)
    try:
        from chipload.jobs import load_job, resume_note, run_job
        from chipload.report.folder import check_target, checkpoint_folder, write_finished
        from chipload.simulation.checkpoint import Checkpoint

        report = Teller()
        report(0.0, "reading")
        read = load_job(job, overrides)
        report(0.0, resume_note(read) or "reading")
        check_target(out)
        begin = 0.0
        if draft:
            begin = FIRST
            _write({"first": first_line(job, overrides, part_of(report, 0.0, FIRST))})
        report_run = part_of(report, begin, 1.0)
        with Checkpoint(checkpoint_folder(out)) as kept:
            try:
                done = run_job(read, part_of(report_run, 0.0, 0.85), kept, accept=draft)
                write_finished(done.result, done.presentation, out, part_of(report_run, 0.85, 1.0))
            finally:
                kept_text = kept.what_is_kept()
            kept.discard()
        return {"code": done.result.verdict.exit_code, "message": done.result.message}
    except InputError as err:
        return {"code": 2, "message": str(err)}
    except OutputError as err:
        return {"code": 4, "message": str(err)}
    except OSError as err:
        known = is_full(err)
        return {"code": 4 if known else 1, "message": str(cannot_write("the disk", err)) if known else _fault(err)}
    except (KeyboardInterrupt, Cancelled):
        why = f"{kept_text}: the next run continues from there" if kept_text else "nothing was written"
        return {"code": 130, "message": f"stopped: {why}"}
    except Exception as err:
        return {"code": 1, "message": _fault(err)}


def first_line(job: str, overrides: Sequence[str], report: Progress) -> str:
    """What exceeds in a coarse run of a draft, else its critical limit; empty: it cannot be coarser."""
    from chipload.jobs import load_job, run_job
    from chipload.jobs.coarse import coarser, mark_coarse
    from chipload.result import Verdict

    try:
        coarse = load_job(job, (*overrides, *coarser(load_job(job, overrides))))
    except InputError:
        return ""
    result = mark_coarse(run_job(coarse, report, accept=True)).result
    critical = result.critical
    if result.verdict is Verdict.EXCEEDS or critical is None:
        return result.first_lines[0]
    parts = (critical.value_text, critical.margin_text, critical.where)
    return f"{result.verdict.value.capitalize()}: {', '.join(filter(None, parts))}"


def _fault(err: Exception) -> str:
    return f"an error in chipload: {type(err).__name__}: {err}"


class Teller:
    """Writes where the work is, not too often."""

    def __init__(self) -> None:
        self.last, self.what = 0.0, ""

    def __call__(self, done: float, what: str) -> None:
        """Take a share and what is done."""
        if ASKED.is_set():
            raise Cancelled("stopped")
        now = time.monotonic()
        if now - self.last >= BREATH or what != self.what:
            self.last, self.what = now, what
            _write({"done": done, "what": what})


def _write(value: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(value) + "\n")
    sys.stdout.flush()


def _stop(_number: int, _frame: object) -> NoReturn:
    ASKED.set()
    raise KeyboardInterrupt


def _watch() -> None:
    """End with the page: its end of our input closes when it goes.

    Read from the descriptor: a thread that waits within ``sys.stdin`` holds its lock when the interpreter ends, which
    then aborts.
    """
    while os.read(0, 4096):
        pass
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    for name in ("SIGTERM", "SIGBREAK"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), _stop)
    threading.Thread(target=_watch, daemon=True).start()
    _write(work(*sys.argv[1:]))
