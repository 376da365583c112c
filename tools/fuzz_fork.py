"""Extreme jobs in children of one process that has imported and compiled everything: see tools/fuzz.py.

A child is forked for each case, so that nothing is imported or loaded again, and what a case does to its process is
gone with it. The child has a limit of processor time and of memory; how it ends is said through a pipe. Each case is
one line of a record, so that a campaign that was stopped goes on after the cases that it has.
"""

from __future__ import annotations

import importlib
import json
import os
import re
import resource
import selectors
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from fuzz_jobs import RUN_S, Nonsense, carry_out, case, folder_of

#: [s] of the processor, times as long by the clock, and [bytes], that a case may take
SLOW, MOST_WAIT, MEMORY = 20, 20.0, 4 << 30
ENDS = ("read", "findings", "refused", "long", "fault", "hang", "memory", "nonsense")


def imported() -> None:
    """Import every capability."""
    warnings.simplefilter("ignore")
    for part in ("contour", "feeds", "fit", "impeller", "program", "thinwall", "torque"):
        for module in ("job", "run", "result", "figures"):
            importlib.import_module(f"chipload.jobs.{part}.{module}")


def warm(name: str, place: Path) -> None:
    """Run a small job once, to load what is compiled."""
    from chipload.errors import InputError
    from chipload.jobs import load_job, run_job

    folder, sets = folder_of(name, True, place)
    begin = time.process_time()
    try:
        said = run_job(load_job(folder / "job.toml", sets)).result.message
    except InputError as err:
        said = f"refused: {err}"
    print(f"{name}: {time.process_time() - begin:.2f} s: {said}", file=sys.stderr, flush=True)


def said_of(number: int, run: bool, place: Path) -> tuple[str, str]:
    """How a case ends in this process, and what was said."""
    return said_of_work(lambda: carry_out(number, run, place))


def said_of_work(work: Callable[[], str]) -> tuple[str, str]:
    """How some work ends, and what was said."""
    from chipload.errors import InputError

    try:
        return work(), ""
    except InputError as err:
        said = str(err)
        return ("fault" if not said or "Traceback" in said else "refused"), said
    except MemoryError:
        return "memory", ""
    except Nonsense as err:
        return "nonsense", str(err)
    except BaseException as err:
        where = traceback.extract_tb(err.__traceback__)[-1]
        return "fault", f"{type(err).__name__}: {str(err)[:120]} ({Path(where.filename).name}:{where.lineno})"


def forked(work: Callable[[], tuple[str, str]]) -> tuple[str, str, float]:
    """How some work ends in a child, what was said, and how long the processor worked for it [s]."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.close(read)
            soft = int(re.search(r"VmSize:\s+(\d+)", Path("/proc/self/status").read_text())[1]) * 1024  # type: ignore[index]
            resource.setrlimit(resource.RLIMIT_AS, (soft + MEMORY, soft + MEMORY))
            spent = int(time.process_time())
            resource.setrlimit(resource.RLIMIT_CPU, (spent + SLOW, spent + SLOW + 2))
            sink = os.open(os.devnull, os.O_WRONLY)
            os.dup2(sink, 1)
            os.dup2(sink, 2)
            end, said = work()
            os.write(write, json.dumps([end, said[:300]]).encode())
        finally:
            os._exit(0)
    os.close(write)
    with selectors.DefaultSelector() as ready:
        ready.register(read, selectors.EVENT_READ)
        late = not ready.select(SLOW * MOST_WAIT)
    if late:
        os.kill(child, signal.SIGKILL)
    with os.fdopen(read, "rb") as pipe:
        text = pipe.read()
    _, status, used = os.wait4(child, 0)
    spent = used.ru_utime + used.ru_stime
    if used.ru_maxrss * 1024 > MEMORY:
        return "memory", f"{used.ru_maxrss >> 10} MiB", spent
    if text:
        end, said = json.loads(text)
        return end, said, spent
    if late or os.waitstatus_to_exitcode(status) in (-signal.SIGXCPU, -signal.SIGKILL):
        return "hang", f"more than {SLOW} s", spent
    return "fault", f"the process ended with {os.waitstatus_to_exitcode(status)}", spent


def campaign(run: bool, first: int, cases: int, budget: float, record: Path | None) -> tuple[Counter[str], list[str]]:
    """Carry out cases that the record does not have; count how all of them end.

    Parameters
    ----------
    run : run what is accepted, of the small jobs; else load and check the jobs of the examples
    first, cases : numbers of the cases
    budget : [s] of the clock
    record : a line of JSON each case: number, end, words, seconds; None: nothing is kept
    """
    known: dict[int, list[object]] = {}
    if record is not None and record.exists():
        text = record.read_text("utf-8")
        if text and not text.endswith("\n"):
            # ended within a line
            record.write_text(text[: text.rfind("\n") + 1], "utf-8")
        rows = [json.loads(line) for line in record.read_text("utf-8").splitlines() if line.endswith("]")]
        known = {row[0]: row for row in rows}
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        place = Path(folder)
        imported()
        ready = set[str]()
        until = time.monotonic() + budget
        for number in range(first, first + cases):
            if time.monotonic() > until:
                break
            if number in known:
                continue
            name = case(number, run)[0]
            if run and name not in ready:
                warm(name, place)
                ready.add(name)
            end, said, spent = forked(lambda n=number: said_of(n, run, place))  # type: ignore[misc]
            known[number] = [number, end, said, round(spent, 3)]
            if record is not None:
                with record.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(known[number]) + "\n")
            if end in ("fault", "hang", "memory", "nonsense"):
                print(f"case {number} {case(number, run)}: {end}: {said}", file=sys.stderr, flush=True)
    return table(known, run)


def table(known: dict[int, list[object]], run: bool) -> tuple[Counter[str], list[str]]:
    """Print the table of cases by job, and return the sums and what is wrong."""
    found: dict[str, Counter[str]] = {}
    bad = []
    for number, end, said, _ in known.values():
        name = case(int(str(number)), run)[0]
        found.setdefault(name, Counter()).update(("cases", str(end)))
        if end in ("fault", "hang", "memory", "nonsense"):
            bad.append(f"case {number} {case(int(str(number)), run)}: {end}: {said}")
    print(f"| job | cases | {' | '.join(ENDS)} |\n|---|---:|{'---:|' * len(ENDS)}")
    total = Counter[str]()
    for name in sorted(found):
        print(f"| {name} | {found[name]['cases']} | {' | '.join(str(found[name][e]) for e in ENDS)} |")
        total += found[name]
    print(f"| all | {total['cases']} | {' | '.join(str(total[e]) for e in ENDS)} |")
    spent = sum(float(str(row[3])) for row in known.values())
    print(f"{spent:.0f} s of the processor; a run is long after {RUN_S:g} s")
    return total, bad
