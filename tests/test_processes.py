"""The calls of one system and their counterparts; those of Windows with a stand-in for its modules."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import types
from pathlib import Path

import pytest

from chipload import processes
from chipload.files import exchange_names, fresh_folder, sweep, write_whole

#: it starts another process, and prints the number of that
PARENT = (
    "import subprocess, sys, time\n"
    "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(60)'])\n"
    "print(child.pid, flush=True)\n"
    "time.sleep(60)\n"
)


def ended(pid: int) -> bool:
    """Whether a process has ended; one that nobody has waited for counts as ended."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z"
    except OSError:
        return True


@pytest.fixture
def windows(monkeypatch):
    """Windows, as far as the module sees it; what was called."""
    calls: list[tuple] = []
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0x200, raising=False)
    monkeypatch.setattr(signal, "CTRL_BREAK_EVENT", 1, raising=False)
    monkeypatch.setattr(os, "kill", lambda pid, number: calls.append(("kill", pid, number)))
    monkeypatch.setattr(subprocess, "run", lambda words, **_: calls.append(tuple(words)))
    msvcrt = types.SimpleNamespace(LK_NBLCK=2, locking=lambda *a: calls.append(("lock", *a)))
    monkeypatch.setattr(processes, "msvcrt", msvcrt, raising=False)
    return calls


def test_a_group_is_stopped_with_what_it_started():
    process = subprocess.Popen(
        [sys.executable, "-c", PARENT], stdout=subprocess.PIPE, text=True, **processes.own_group()
    )
    child = int(process.stdout.readline())
    assert not ended(child)
    processes.stop_group(process.pid)
    assert process.wait(10.0) == -signal.SIGTERM
    for _ in range(200):
        if ended(child):
            break
        signal.sigtimedwait([], 0.02)
    assert ended(child)
    process.stdout.close()
    processes.stop_group(process.pid, kill=True)  # it has ended: nothing


def test_a_file_is_locked_once(tmp_path):
    with (tmp_path / "lock").open("w") as one, (tmp_path / "lock").open("w") as two:
        processes.lock_file(one.fileno())
        with pytest.raises(BlockingIOError):
            processes.lock_file(two.fileno())


def test_the_counterparts_of_windows(windows):
    assert processes.own_group() == {"creationflags": 0x200}
    processes.stop_group(7)
    processes.stop_group(7, kill=True)
    processes.lock_file(3)
    assert windows == [("kill", 7, 1), ("taskkill", "/F", "/T", "/PID", "7"), ("lock", 3, 2, 1)]
    assert processes.cores() == (os.cpu_count() or 1)


def test_files_are_written_whole_without_the_calls_of_linux(windows, tmp_path):
    """No exchange of names and no sweep: the old file stands until the new one is complete."""
    write_whole(tmp_path / "a.txt", b"one\n")
    write_whole(tmp_path / "a.txt", b"two\n")
    assert (tmp_path / "a.txt").read_bytes() == b"two\n"
    assert exchange_names(tmp_path / "a", tmp_path / "b") is False
    sweep(tmp_path)
    with fresh_folder(tmp_path) as folder:
        assert folder.is_dir()
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_a_result_is_replaced_where_names_cannot_be_exchanged(windows, tmp_path):
    from chipload.report.folder import _swap

    for name in ("fresh", "target"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "what").write_text(name)
    _swap(tmp_path / "fresh", tmp_path / "target")
    assert (tmp_path / "target" / "what").read_text() == "fresh"
    assert [path.name for path in tmp_path.iterdir()] == ["target"]
