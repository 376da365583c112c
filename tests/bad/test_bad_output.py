"""Result folders that cannot be written: one clear line, nothing half-written, an older result stays."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from chipload.errors import ChiploadError, InputError, OutputError
from chipload.jobs.contour.figures import presentation_of
from chipload.jobs.contour.outcome import ContourResult
from chipload.jobs.contour.result import result_of
from chipload.report import folder
from chipload.report.folder import check_target, write_result

Maker = Callable[..., ContourResult]


def told(caught: pytest.ExceptionInfo[ChiploadError]) -> str:
    return str(caught.value)


def written(made: ContourResult, out: Path) -> Path:
    """The folder of a result."""
    return write_result(result_of(made), presentation_of(made), out)


def test_a_foreign_folder_is_refused_and_left_alone(outcome: Maker, tmp_path: Path) -> None:
    out = tmp_path / "mine"
    out.mkdir()
    (out / "thesis.txt").write_text("years of work")
    with pytest.raises(InputError) as caught:
        written(outcome(), out)
    assert told(caught) == (
        f"--out {out}: holds files that are not a result of chipload: name a folder that is new, empty or holds an "
        "older result"
    )
    assert [p.name for p in out.iterdir()] == ["thesis.txt"]
    assert [p.name for p in tmp_path.iterdir()] == ["mine"]


def test_a_result_with_something_added_is_not_ours_to_remove(outcome: Maker, tmp_path: Path) -> None:
    out = written(outcome(), tmp_path / "result")
    (out / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="holds files that are not a result of chipload"):
        written(outcome(), out)
    assert (out / "notes.txt").exists()


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    out = tmp_path / "file"
    out.write_text("")
    with pytest.raises(InputError) as caught:
        check_target(out)
    assert told(caught) == f"--out {out}: is not a folder: name a folder that is new, empty or holds an older result"


def test_nothing_is_written_below_a_file(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError) as caught:
        check_target(tmp_path / "file" / "result")
    assert (
        told(caught) == f"--out {tmp_path / 'file' / 'result'}: cannot be written: Not a directory: name another place"
    )


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_rights_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="cannot be written: Permission denied: name another place"):
        check_target(tmp_path / "result")


def test_a_read_only_place_is_refused() -> None:
    with pytest.raises(OutputError, match=r"--out /proc/result: cannot be written: .*: name another place"):
        check_target("/proc/result")


def test_asking_makes_no_folder(tmp_path: Path) -> None:
    assert check_target(tmp_path / "a" / "b" / "result") == tmp_path / "a" / "b" / "result"
    assert list(tmp_path.iterdir()) == []


def test_an_older_result_is_replaced_when_the_new_one_is_whole(outcome: Maker, tmp_path: Path) -> None:
    out = written(outcome("plain"), tmp_path / "result")
    before = (out / "summary.json").read_bytes()
    written(outcome("backward"), out)
    assert (out / "summary.json").read_bytes() != before
    assert [p.name for p in tmp_path.iterdir()] == ["result"]


@pytest.mark.parametrize("fault", [OSError(28, "No space left on device"), KeyboardInterrupt(), ValueError("ours")])
def test_a_fault_in_the_middle_leaves_the_older_result(
    outcome: Maker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: BaseException
) -> None:
    out = written(outcome("plain"), tmp_path / "result")
    before = {p.name: p.read_bytes() for p in out.iterdir()}

    def fail(*_: object) -> bytes:
        raise fault

    monkeypatch.setattr(folder, "page_bytes", fail)
    expected = OutputError if isinstance(fault, OSError) else type(fault)
    said = f"--out {out}: cannot be written: No space left on device: free space; the same command continues"
    with pytest.raises(expected, match=re.escape(said) if isinstance(fault, OSError) else None):
        written(outcome("backward"), out)
    assert {p.name: p.read_bytes() for p in out.iterdir()} == before
    assert [p.name for p in tmp_path.iterdir()] == ["result"]


@pytest.mark.parametrize("fault", [OSError(5, "Input/output error"), KeyboardInterrupt()])
def test_a_fault_in_the_exchange_puts_the_older_result_back(
    outcome: Maker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: BaseException
) -> None:
    out = written(outcome("plain"), tmp_path / "result")
    before = (out / "summary.json").read_bytes()
    rename = Path.rename

    def once(self: Path, target: Path) -> Path:
        if target == out and self.joinpath("report.html").exists() and (self / "summary.json").read_bytes() != before:
            raise fault
        return rename(self, target)

    monkeypatch.setattr(folder, "exchange_names", lambda a, b: False)
    monkeypatch.setattr(Path, "rename", once)
    with pytest.raises((OutputError, KeyboardInterrupt)):
        written(outcome("backward"), out)
    assert (out / "summary.json").read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["result"]


def test_a_full_disk_leaves_nothing(tmp_path: Path) -> None:
    """No file may grow beyond 200 kB here: the report, which is larger, cannot be written."""
    code = (
        "import resource, signal, sys\n"
        "from importlib.util import module_from_spec, spec_from_file_location\n"
        "sys.path.insert(0, sys.argv[1].removesuffix('conftest.py'))\n"
        "spec = spec_from_file_location('made', sys.argv[1])\n"
        "made = module_from_spec(spec)\n"
        "spec.loader.exec_module(made)\n"
        "from chipload.errors import OutputError\n"
        "from chipload.jobs.contour.figures import presentation_of\n"
        "from chipload.jobs.contour.result import result_of\n"
        "from chipload.report.folder import write_result\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))\n"
        "try:\n"
        "    outcome = made.made_outcome()\n"
        "    write_result(result_of(outcome), presentation_of(outcome), sys.argv[2])\n"
        "except OutputError as err:\n"
        "    print(err)\n"
    )
    conftest = Path(__file__).parents[1] / "conftest.py"
    out = tmp_path / "deep" / "result"
    done = subprocess.run(
        [sys.executable, "-c", code, str(conftest), str(out)], capture_output=True, text=True, timeout=120, check=True
    )
    assert done.stdout == f"--out {out}: cannot be written: File too large: free space; the same command continues\n"
    assert list(tmp_path.iterdir()) == []
