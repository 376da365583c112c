"""Kill runs of chipload at random moments and compare what comes out: `python tools/kills.py --kills 100`.

A small job of each capability is run once undisturbed. Each case then starts the same command into a new place, ends it
by SIGKILL, SIGTERM or SIGHUP after a random share of the time that it took, and gives the command again until it ends
by itself. Counted are cases whose result has other bytes than the undisturbed one, cases that left anything beside it,
and runs that went on from what was kept. At the end of each job two runs write one place at once. A run is a child of
this process, so that nothing is imported again.
"""

from __future__ import annotations

import argparse
import importlib
import os
import re
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

import numpy as np
from fuzz_jobs import folder_of

HOW = (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGHUP)
#: codes of a run that ended with a result
DONE = (0, 3)
#: small jobs of fuzz_jobs, and the examples made small that are of other capabilities
JOBS = (
    "small program", "small moves", "small feeds", "small dynamics", "small workpiece", "small contour",
    "small pocket", "small average", "small instantaneous", "plate", "tube", "impeller",
)  # fmt: skip
#: of these the steps are made short, so that a run is ended between two checkpoints
SHORT_STEPS = ("small program", "small moves")


def jobs(place: Path) -> dict[str, list[str]]:
    """The command of each job without its result folder."""
    out = {}
    for name in JOBS:
        folder, sets = folder_of(name, True, place)
        if name in SHORT_STEPS:
            sets = (*sets, "operation.0.step_mm=0.25")
        words = [word for text in sets for word in ("--set", text)]
        out[name] = ["run", str(folder / "job.toml"), *words, "--keep-s", "0", "--out"]
    over = ("--over", "cutter.0.diameter_mm=8,10", "--over", "operation.0.feed_mm_min=600,900")
    out["sweep"] = ["sweep", str(place / "small-contour" / "job.toml"), *over, "--out"]
    return out


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of a result, less the time that a search took: the one number that is not of the input."""
    files = {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}
    summary = files.get("summary.json", b"")
    if b'"search_s"' in summary:
        # the page shows it too
        files.pop("report.html", None)
        files["summary.json"] = re.sub(rb'"search_s": ?[-+.e0-9]+', b'"search_s": 0', summary)
    return files


class Run:
    """A run in a child of this process, which has imported everything; its messages go to a file."""

    def __init__(self, words: list[str], messages: Path) -> None:
        self.messages = messages
        self.id = os.fork()
        if self.id == 0:
            code = 1
            try:
                sink, out = os.open(os.devnull, os.O_WRONLY), os.open(messages, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
                os.dup2(sink, 1)
                os.dup2(out, 2)
                sys.stdout, sys.stderr = os.fdopen(1, "w", closefd=False), os.fdopen(2, "w", closefd=False)
                sys.argv = ["chipload", *words]
                main_of_chipload()
            except SystemExit as err:
                code = err.code if isinstance(err.code, int) else 1
            except BaseException:
                traceback.print_exc()
            finally:
                sys.stderr.flush()
                os._exit(code)

    def ended(self, how: signal.Signals | None = None) -> tuple[int, str, bool]:
        """Its exit code and messages after a signal, and whether it had ended before that."""
        before = False
        if how is not None:
            number, status = os.waitpid(self.id, os.WNOHANG)
            before = number != 0
            if not before:
                os.kill(self.id, how)
        if how is None or not before:
            status = os.waitpid(self.id, 0)[1]
        return os.waitstatus_to_exitcode(status), self.messages.read_text(), before


def main_of_chipload() -> None:
    """The command line, imported before children are made."""
    from chipload.cli import main as command

    command()


def case(
    words: list[str], place: Path, seconds: float, known: dict[str, bytes], rng: np.random.Generator
) -> Counter[str]:
    """One run that is ended once to three times on its way."""
    found = Counter[str](cases=1)
    out, messages = place / "result", place.with_name("messages")
    for _ in range(int(rng.integers(1, 4))):
        run = Run([*words, str(out)], messages)
        time.sleep(seconds * float(rng.uniform(0.02, 1.0)))
        how = HOW[int(rng.integers(len(HOW)))]
        code, said, before = run.ended(how)
        found[how.name] += not before
        found["went on"] += "continues after step" in said
        if code == 1 or "Traceback" in said:
            found["faults"] += 1
            print(f"{' '.join(words[:2])}: {how.name}: code {code}: {said[-500:]}", file=sys.stderr, flush=True)
    code, said, _ = Run([*words, str(out)], messages).ended()
    found["went on"] += "continues after step" in said
    found["faults"] += code not in DONE
    found["other bytes"] += not out.is_dir() or contents(out) != known
    found["left"] += [p.name for p in place.iterdir()] != ["result"]
    return found


def two_at_once(words: list[str], place: Path, known: dict[str, bytes]) -> Counter[str]:
    """Two runs into one place at once: one may be refused, and a whole result is there."""
    out = place / "result"
    both = [Run([*words, str(out)], place.with_name(f"messages-{k}")) for k in range(2)]
    codes = {run.ended()[0] for run in both}
    return Counter(
        {
            "other bytes": int(not out.is_dir() or contents(out) != known),
            "faults": int(not codes <= {*DONE, 2} or codes == {2}),
        }
    )


def main() -> int:
    """Run the campaign and print its table."""
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--kills", type=int, default=100)
    ask.add_argument("--seed", type=int, default=1)
    ask.add_argument("--only", nargs="*", help="jobs by name")
    given = ask.parse_args()
    rng = np.random.default_rng(given.seed)
    for part in ("contour", "program", "fit", "thinwall", "torque", "impeller"):
        for module in ("run", "result", "figures"):
            importlib.import_module(f"chipload.jobs.{part}.{module}")
    importlib.import_module("chipload.sweep.run")
    importlib.import_module("chipload.report.folder")
    importlib.import_module("chipload.cli")
    total = Counter[str]()
    with tempfile.TemporaryDirectory(prefix="kills-") as folder:
        place = Path(folder)
        commands = {n: w for n, w in jobs(place).items() if not given.only or n in given.only}
        print("| job | cases | SIGKILL | SIGTERM | SIGHUP | went on | other bytes | left | faults |", flush=True)
        print("|---|---:|---:|---:|---:|---:|---:|---:|---:|", flush=True)
        share = -(-given.kills // len(commands))
        for name, words in commands.items():
            undisturbed = place / f"{name} of kills" / "whole"
            undisturbed.parent.mkdir()
            for _ in range(2):
                # the first one compiles what is not there yet
                begin = time.monotonic()
                code, said, _ = Run([*words, str(undisturbed)], place / "messages").ended()
                if code not in DONE:
                    raise SystemExit(f"{name}: {said}")
            whole = (time.monotonic() - begin, contents(undisturbed))
            found = Counter[str]()
            for k in range(share):
                own = undisturbed.parent / f"case-{k}"
                own.mkdir()
                found += case(words, own, *whole, rng)
                shutil.rmtree(own)
            own = undisturbed.parent / "two"
            own.mkdir()
            found += two_at_once(words, own, whole[1])
            cells = ("cases", "SIGKILL", "SIGTERM", "SIGHUP", "went on", "other bytes", "left", "faults")
            print(f"| {name} | {' | '.join(str(found[c]) for c in cells)} |", flush=True)
            total += found
    print(f"| all | {' | '.join(str(total[c]) for c in cells)} |")
    return 1 if total["other bytes"] or total["left"] or total["faults"] else 0


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    sys.exit(main())
