"""Damage inputs of every reader of chipload and count how they end: `python tools/fuzz.py --budget 600`.

Case k of a reader is a seed with one to four damages, all chosen by k and the reader's name: a case can be made again
with `--reader NAME --case K --keep FILE`. Each case is read in a child process. It ends as **read** (without a word),
**findings** (read, and something was noticed), **refused** (``InputError``), **fault** (another exception, numbers that
are not finite, or the death of the process), **hang** (over 60 s of the processor or 1200 s of the clock) or **memory**
(over 4 GiB). Faults, hangs and memory must be 0, and the exit code is 1 where they are not.

`--jobs` sets every numeric value of the job of every example to 0, -1, 1e-9, 1e9, nan, inf and a text, loads the job
and checks it as `chipload check` does; `--jobs --run` does the same to every example made small, and to some small
jobs more, and runs them (``fuzz_jobs``), each case in a child that is forked from one process (``fuzz_fork``). A run
that goes on as it should for some seconds of the processor ends as **long**, a result that cannot be true as
**nonsense**. With `--record FILE` a campaign that was stopped goes on:

    python tools/fuzz.py --jobs --run --cases 10000 --budget 3600 --record runs.jsonl
"""

from __future__ import annotations

import argparse
import json
import os
import re
import selectors
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
import zlib
from collections import Counter
from pathlib import Path

import numpy as np
from fuzz_fork import campaign as job_campaign
from fuzz_jobs import carry_out, case
from fuzz_readers import READERS, Nonsense

#: [s] and [bytes] that a case may take
SLOW, MEMORY = 60.0, 4 << 30
#: times as long by the clock, for a process that waits or sleeps
MOST_WAIT = 20.0
KINDS = ("cases", "read", "findings", "refused", "long", "fault", "hang", "memory")
#: what is put in the place of a number
NUMBERS = [
    b"0",
    b"-1",
    b"1e-9",
    b"1e9",
    b"nan",
    b"inf",
    b"1e400",
    b"-0",
    b"9" * 400,
    b"0." + b"0" * 60 + b"1",
    b"2147483648",
]
#: what is put anywhere
TOKENS = [b"\0", b"\r", b"\n\n", b"\x1b[2J", b"\xff\xfe", b"[" * 3000, b"(" * 200, b"'", b'"', b"#", b"%", b"=", b",",
          b";", "é\u202e".encode(), b" " * 5000, b"-", b"/*", b"$"]  # fmt: skip


# -- damage -----------------------------------------------------------------------------------------------------
def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """A seed with one to four damages."""
    for _ in range(int(rng.integers(1, 5))):
        data = DAMAGES[int(rng.integers(len(DAMAGES)))](data, rng)
    return data


def _place(data: bytes, rng: np.random.Generator) -> int:
    return int(rng.integers(len(data) + 1))


def _flip(data: bytes, rng: np.random.Generator) -> bytes:
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 9))):
        if out:
            out[int(rng.integers(len(out)))] ^= 1 << int(rng.integers(8))
    return bytes(out)


def _letter(data: bytes, rng: np.random.Generator) -> bytes:
    out = bytearray(data)
    if out:
        out[int(rng.integers(len(out)))] = int(rng.integers(32, 127))
    return bytes(out)


def _cut(data: bytes, rng: np.random.Generator) -> bytes:
    a = _place(data, rng)
    return data[:a] + data[min(a + int(rng.integers(1, 200)), len(data)) :]


def _truncate(data: bytes, rng: np.random.Generator) -> bytes:
    return data[: _place(data, rng)]


def _again(data: bytes, rng: np.random.Generator) -> bytes:
    a, b, at = _place(data, rng), int(rng.integers(1, 300)), _place(data, rng)
    return data[:at] + data[a : a + b] + data[at:]


def _token(data: bytes, rng: np.random.Generator) -> bytes:
    at = _place(data, rng)
    return data[:at] + TOKENS[int(rng.integers(len(TOKENS)))] + data[at:]


def _number(data: bytes, rng: np.random.Generator) -> bytes:
    found = list(re.finditer(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?", data[:200_000]))
    if not found:
        return data
    hit = found[int(rng.integers(len(found)))]
    return data[: hit.start()] + NUMBERS[int(rng.integers(len(NUMBERS)))] + data[hit.end() :]


def _lines(data: bytes, rng: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    a, b = (int(rng.integers(len(lines))) for _ in range(2))
    lines[a], lines[b] = lines[b], lines[a]
    if rng.random() < 0.3:
        del lines[a]
    return b"\n".join(lines)


def _ends(data: bytes, rng: np.random.Generator) -> bytes:
    return data.replace(b"\n", (b"\r", b"\r\n", b"\n\r")[int(rng.integers(3))])


DAMAGES = (_flip, _letter, _letter, _cut, _truncate, _again, _token, _number, _number, _number, _lines, _ends)


def case_of(reader: str, number: int, seeds: list[bytes]) -> bytes:
    """The damaged file of a case."""
    rng = np.random.default_rng([number, zlib.crc32(reader.encode())])
    return damaged(seeds[int(rng.integers(len(seeds)))], rng)


# -- in the child -----------------------------------------------------------------------------------------------
def serve(reader: str) -> None:
    """Read cases by number from stdin; say how each ends, a line each."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    warnings.simplefilter("ignore")
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    from chipload.errors import InputError

    place = Path(tempfile.mkdtemp(prefix="fuzz-"))
    seeds = READERS[reader].seeds()
    try:
        for line in sys.stdin:
            number, said = int(line), ""
            try:
                path = place / f"case{READERS[reader].suffix}"
                path.write_bytes(case_of(reader, number, seeds))
                end = "findings" if READERS[reader].read(path) else "read"
            except InputError as err:
                end, said = "refused", str(err)
                if not said or "Traceback" in said:
                    end = "fault"
            except MemoryError:
                end = "memory"
            except Nonsense as err:
                end, said = "fault", f"nonsense: {err}"
            except Exception as err:
                where = traceback.extract_tb(err.__traceback__)[-1]
                end = "fault"
                said = f"{type(err).__name__}: {str(err)[:120]} ({Path(where.filename).name}:{where.lineno})"
            out.write(json.dumps([number, end, said[:300]]) + "\n")
            out.flush()
    finally:
        shutil.rmtree(place, ignore_errors=True)


# -- in the parent ----------------------------------------------------------------------------------------------
class Child:
    """A process that reads cases; a new one where it ends."""

    def __init__(self, reader: str) -> None:
        self.reader = reader
        self.process: subprocess.Popen[bytes] | None = None

    def case(self, number: int, patience: float = SLOW) -> tuple[str, str]:
        """How a case ends, and what was said."""
        fresh = self.process is None
        if self.process is None:
            words = [sys.executable, __file__, "--serve", self.reader]
            self.process = subprocess.Popen(
                words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
            )
        pipe_in, pipe_out = self.process.stdin, self.process.stdout
        assert pipe_in is not None
        assert pipe_out is not None
        try:
            pipe_in.write(f"{number}\n".encode())
            pipe_in.flush()
            with selectors.DefaultSelector() as ready:
                ready.register(pipe_out, selectors.EVENT_READ)
                # a child that starts first imports; where it waits for the processor, its own time counts
                allowed = self._spent() + patience + (60.0 if fresh else 0.0)
                until = time.monotonic() + MOST_WAIT * patience
                while not ready.select(patience):
                    if self._spent() > allowed or time.monotonic() > until:
                        self.close()
                        return "hang", f"more than {patience:g} s"
            line = pipe_out.readline()
        except OSError:
            line = b""
        if not line:
            code = self.process.wait()
            self.process = None
            return "fault", f"the process ended with {code}"
        _, end, said = json.loads(line)
        if self._peak() > MEMORY:
            self.close()
            return "memory", said
        return end, said

    def _spent(self) -> float:
        """Seconds of the processor of the process and its children; elsewhere than on Linux, of the clock."""
        assert self.process is not None
        try:
            fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return time.monotonic()
        return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")

    def _peak(self) -> int:
        """Most memory that the process had [bytes], as Linux says it; elsewhere its own limit has to do."""
        assert self.process is not None
        try:
            text = Path(f"/proc/{self.process.pid}/status").read_text()
        except OSError:
            return 0
        return 1024 * int(re.search(r"VmHWM:\s+(\d+)", text)[1])  # type: ignore[index]

    def close(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()
            for pipe in (self.process.stdin, self.process.stdout):
                assert pipe is not None
                pipe.close()
            self.process = None


def campaign(reader: str, first: int, cases: int, until: float) -> tuple[Counter[str], list[str]]:
    """Count how cases of a reader end."""
    child, found, bad = Child(reader), Counter[str](), list[str]()
    number = first
    try:
        while number < first + cases and time.monotonic() < until:
            end, said = child.case(number)
            found["cases"] += 1
            found[end] += 1
            if end in ("fault", "hang", "memory"):
                bad.append(f"{reader} case {number}: {end}: {said}")
                print(bad[-1], file=sys.stderr, flush=True)
            number += 1
    finally:
        child.close()
    return found, bad


def main() -> int:
    """Run the campaign and print its table."""
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument(
        "--budget", type=float, default=600.0, metavar="SECONDS", help="in all; split evenly among readers"
    )
    ask.add_argument("--cases", type=int, default=1_000_000, help="most cases of a reader")
    ask.add_argument("--first", type=int, default=0, metavar="K", help="number of the first case")
    ask.add_argument("--reader", action="append", choices=[*READERS], help="only this one; repeatable")
    ask.add_argument("--jobs", action="store_true", help="extreme jobs instead of damaged files")
    ask.add_argument("--run", action="store_true", help="with --jobs: small jobs, which are run too")
    ask.add_argument("--record", type=Path, metavar="FILE", help="with --jobs: keep each case there and go on")
    ask.add_argument("--case", type=int, help="only this case, in this process, with its traceback")
    ask.add_argument("--keep", type=Path, metavar="FILE", help="with --case: write the damaged file there")
    ask.add_argument("--serve", help=argparse.SUPPRESS)
    given = ask.parse_args()
    if given.serve:
        serve(given.serve)
        return 0
    if given.jobs:
        if given.case is not None:
            return _one_job(given.case, given.run)
        _, bad = job_campaign(given.run, given.first, given.cases, given.budget, given.record)
        print("\n".join(bad))
        return 1 if bad else 0
    names = given.reader or list(READERS)
    if given.case is not None:
        return _one(names[0], given.case, given.keep)
    print(f"| reader | {' | '.join(KINDS)} |\n|---|{'---:|' * len(KINDS)}", flush=True)
    total, bad = Counter[str](), list[str]()
    begin = time.monotonic()
    for k, name in enumerate(names):
        share = (begin + given.budget - time.monotonic()) / (len(names) - k)
        found, worse = campaign(name, given.first, given.cases, time.monotonic() + share)
        print(f"| {name} | {' | '.join(str(found[kind]) for kind in KINDS)} |", flush=True)
        total += found
        bad += worse
    print(f"| all | {' | '.join(str(total[kind]) for kind in KINDS)} |")
    for text in bad:
        print(text)
    return 1 if bad else 0


def _one_job(number: int, run: bool) -> int:
    print(case(number, run))
    with tempfile.TemporaryDirectory() as place:
        print(carry_out(number, run, Path(place)))
    return 0


def _one(reader: str, number: int, keep: Path | None) -> int:
    seeds = READERS[reader].seeds()
    with tempfile.TemporaryDirectory() as place:
        path = keep or Path(place) / f"case{READERS[reader].suffix}"
        path.write_bytes(case_of(reader, number, seeds))
        print(READERS[reader].read(path))
    return 0


if __name__ == "__main__":
    sys.exit(main())
