"""A small budget of tools/fuzz.py: no damaged input ends in a fault, a hang or 4 GiB, and how cases are told apart."""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from chipload.errors import InputError
from chipload.result import LimitCheck, Result, Track, TrackKind, Verdict, in_memory
from chipload.result.result import Provenance

TOOL = Path(__file__).parents[2] / "tools" / "fuzz.py"
sys.path.insert(0, str(TOOL.parent))

import fuzz  # noqa: E402
import fuzz_fork  # noqa: E402
import fuzz_jobs  # noqa: E402
import fuzz_readers  # noqa: E402


def ran(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, str(TOOL), *words], capture_output=True, text=True, timeout=900, check=False)


def test_few_cases_of_every_reader() -> None:
    done = ran("--cases", "6", "--budget", "800")
    assert done.returncode == 0, done.stdout + done.stderr
    rows = re.findall(r"^\| ([\w-]+) \| (\d+) \|", done.stdout, re.MULTILINE)
    assert [name for name, _ in rows] == [*fuzz_readers.READERS, "all"]
    assert len(rows) == 34
    assert all(int(count) > 0 for _, count in rows)


@pytest.mark.parametrize("name", ["summary", "parquet"])
def test_what_is_damaged_is_read_where_it_is_not_damaged(name: str, tmp_path: Path) -> None:
    reader = fuzz_readers.READERS[name]
    for k, seed in enumerate(reader.seeds()):
        path = tmp_path / f"{k}{reader.suffix}"
        path.write_bytes(seed)
        assert reader.read(path) == 0


def test_a_history_without_times_is_refused(tmp_path: Path) -> None:
    reader = fuzz_readers.READERS["parquet"]
    table = pq.read_table(io.BytesIO(reader.seeds()[0]))
    pq.write_table(table.drop_columns(["t_s"]), tmp_path / "a.parquet")
    with pytest.raises(InputError, match=r"no t_s: nothing to show of its motion: open a-result/report\.html$"):
        reader.read(tmp_path / "a.parquet")


def test_a_history_with_names_in_no_encoding_is_refused(tmp_path: Path) -> None:
    reader = fuzz_readers.READERS["parquet"]
    (tmp_path / "a.parquet").write_bytes(fuzz.case_of("parquet", 25898, reader.seeds()))
    with pytest.raises(InputError, match="cannot be read"):
        reader.read(tmp_path / "a.parquet")


def test_a_case_is_the_same_each_time(tmp_path: Path) -> None:
    for name in ("a.stl", "b.stl"):
        ran("--reader", "stl", "--case", "7", "--keep", str(tmp_path / name))
    assert (tmp_path / "a.stl").read_bytes() == (tmp_path / "b.stl").read_bytes()


@pytest.mark.parametrize(("body", "end"), [
    ("raise ValueError('x')", "fault"), ("import os; os.abort()", "fault"), ("raise MemoryError", "memory"),
    ("import numpy as np; np.ones(1 << 30)", "memory"), ("finite([float('nan')])", "fault"),
    ("from chipload.errors import InputError; raise InputError('x')", "refused"),
])  # fmt: skip
def test_each_end_is_distinguished(tmp_path: Path, body: str, end: str) -> None:
    """The tool itself, with a reader that ends in a known way."""
    for name in ("fuzz.py", "fuzz_fork.py", "fuzz_jobs.py", "fuzz_small.py", "plate.step"):
        (tmp_path / name).write_bytes(TOOL.with_name(name).read_bytes())
    text = TOOL.with_name("fuzz_readers.py").read_text("utf-8")
    text = text.replace("def _meridian(path: Path) -> int:\n", f"def _meridian(path: Path) -> int:\n    {body}\n")
    (tmp_path / "fuzz_readers.py").write_text(text, "utf-8")
    words = [sys.executable, str(tmp_path / "fuzz.py"), "--reader", "meridian", "--cases", "1"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=300, check=False)
    head, row = (re.findall(r"[^|\s]+", line) for line in done.stdout.splitlines()[0:3:2])
    assert dict(zip(head, row, strict=True))[end] == "1"
    assert done.returncode == (0 if end == "refused" else 1)


def _dies() -> tuple[str, str]:
    os._exit(3)


def _takes_much() -> tuple[str, str]:
    return fuzz_fork.said_of_work(lambda: str(np.ones(1 << 30).sum()))


def _is_wrong() -> tuple[str, str]:
    return fuzz_fork.said_of_work(lambda: str(1 // 0))


@pytest.mark.parametrize(("work", "end", "said"), [
    (lambda: ("read", ""), "read", ""), (_dies, "fault", "the process ended with 3"), (_takes_much, "memory", ""),
    (_is_wrong, "fault", "ZeroDivisionError"),
])  # fmt: skip
def test_each_end_of_a_forked_case(work: Callable[[], tuple[str, str]], end: str, said: str) -> None:
    found, words, spent = fuzz_fork.forked(work)
    assert (found, words[: len(said)]) == (end, said)
    assert spent >= 0.0


def test_a_campaign_goes_on_after_its_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record = tmp_path / "runs.jsonl"
    record.write_text('[0, "refused", "known", 0.1]\n[1, "fa', "utf-8")
    monkeypatch.setattr(fuzz_fork, "imported", lambda: None)
    monkeypatch.setattr(fuzz_fork, "carry_out", lambda number, run, place: "read")
    total, bad = fuzz_fork.campaign(False, 0, 3, 60.0, record)
    assert (total["cases"], total["refused"], total["read"], bad) == (3, 1, 2, [])
    lines = record.read_text("utf-8").splitlines()
    assert [json.loads(line)[0] for line in lines if line.endswith("]")] == [0, 1, 2]


def result_with(**track: object) -> Result:
    """A result of one limit that holds."""
    force = LimitCheck("force_n", 500.0, 480.0, Verdict.HOLDS, "program", resolution_error=0.0)
    one = Track("program", TrackKind.PROGRAM, True, 3.0, (force,), blocks=in_memory({"force_n": np.array([480.0])}))
    return Result("program", "x", (replace(one, **track),), (), (), (), Provenance({}, (), "", {}, {}))  # type: ignore[arg-type]


@pytest.mark.parametrize(("track", "said"), [
    ({"blocks": in_memory({"force_n": np.array([np.nan])})}, "not finite"),
    ({"blocks": in_memory({"force_n": np.array([-3.0, 480.0])})}, "is -3"),
    ({"limits": (LimitCheck("force_n", 400.0, 480.0, Verdict.HOLDS, resolution_error=0.0),)}, "of 400.0 holds"),
])  # fmt: skip
def test_nonsense_is_seen(track: dict[str, object], said: str) -> None:
    fuzz_jobs.judge(result_with())
    with pytest.raises(fuzz_jobs.Nonsense, match=said):
        fuzz_jobs.judge(result_with(**track))


def test_a_work_that_is_not_that_of_the_volume_must_not_hold() -> None:
    made = result_with(energy_balance={1: 0.3})
    assert made.verdict is Verdict.UNPROVEN
    fuzz_jobs.judge(made)
    made = result_with(energy_balance={1: 0.3})
    for track in made.tracks:  # as if it were not noticed
        object.__setattr__(track, "findings", ())
    with pytest.raises(fuzz_jobs.Nonsense, match=r"energy balance 0\.3"):
        fuzz_jobs.judge(made)
