"""``chipload watch-folder``: each program gets the verdict that `simulate` gives it, once, also after a kill."""

from __future__ import annotations

import os
import subprocess
import sys
import time

import pytest

from chipload.errors import InputError
from chipload.result import Verdict, load_result
from chipload.sweep.watched_folder import (
    LATE,
    FolderSettings,
    list_programs,
    recorded_hash,
    result_folder,
    verdict_file,
    watch_folder,
)
from command import call

PART = """G21 G90 G54 G94
(T1 D10 ENDMILL)
T1 M6
S8000 M3
G0 X-10. Y-3. Z20.
Z-2.
G1 X20. F900
G0 Z20.
M30
"""
NONSENSE = "nonsense ###\n"


def unfinished(*_: float) -> None:
    raise AssertionError("a watch that ends at once does not wait")


@pytest.fixture(scope="module")
def posted(tmp_path_factory):
    """A folder with a good program, a bad one and what is no program, and the watch that saw it once."""
    folder = tmp_path_factory.mktemp("posts")
    (folder / "lathe side").mkdir()
    (folder / "lathe side" / "part 1.nc").write_text(PART)
    (folder / "bad.tap").write_text(NONSENSE)
    (folder / ".hidden.nc").write_text(PART)
    (folder / "photo.png").write_bytes(b"no program")
    return folder, list(watch_folder(folder, FolderSettings(), once=True, settle_s=0.0, wait=unfinished))


def test_each_program_has_its_verdict_and_report_beside_it(posted, tmp_path) -> None:
    folder, checked = posted
    assert [(one.program.name, one.code) for one in checked] == [("bad.tap", 2), ("part 1.nc", 3)]
    part = folder / "lathe side" / "part 1.nc"
    assert (result_folder(part) / "report.html").is_file()
    loaded = load_result(result_folder(part))
    assert loaded.verdict is Verdict.UNPROVEN
    first = checked[1].line
    assert first == loaded.first_lines[0]
    assert first in verdict_file(part).read_text()
    assert "no motion" in verdict_file(folder / "bad.tap").read_text()
    assert not result_folder(folder / "bad.tap").exists()


def test_our_own_files_are_no_programs(posted) -> None:
    folder, _ = posted
    assert [path.name for path in list_programs(folder)] == ["bad.tap", "part 1.nc"]
    (folder / "link.nc").symlink_to(folder / "bad.tap")
    assert [path.name for path in list_programs(folder)] == ["bad.tap", "part 1.nc"]


def test_a_program_is_simulated_again_only_if_it_or_the_settings_change(posted) -> None:
    folder, _ = posted
    once = {"once": True, "settle_s": 0.0, "wait": unfinished}
    assert list(watch_folder(folder, FolderSettings(), **once)) == []
    part = folder / "lathe side" / "part 1.nc"
    part.write_text(NONSENSE)
    assert [(one.program, one.code) for one in watch_folder(folder, FolderSettings(), **once)] == [(part, 2)]
    # the report of the program that was there before would be read as that of this one
    assert not result_folder(part).exists()
    bad = folder / "bad.tap"
    bad.write_text(NONSENSE * 2)
    assert [one.program for one in watch_folder(folder, FolderSettings(), **once)] == [bad]
    other = FolderSettings(machine="vmc-fanuc")
    assert recorded_hash(bad) not in (None, other.hash(bad))


def test_a_program_that_is_being_posted_is_waited_for(tmp_path) -> None:
    """Its size changes twice while the watch waits; it is read once, whole."""
    (tmp_path / "a.nc").write_text(NONSENSE)
    sizes = []

    def post(seconds: float) -> None:
        if len(sizes) < 2:
            with (tmp_path / "a.nc").open("a") as file:
                file.write(NONSENSE)
        sizes.append((tmp_path / "a.nc").stat().st_size)
        assert not verdict_file(tmp_path / "a.nc").exists()
        time.sleep(seconds)

    (seen,) = watch_folder(tmp_path, FolderSettings(), once=True, settle_s=0.3, wait=post)
    assert len(sizes) >= 3
    assert sizes[-1] == 3 * len(NONSENSE)
    assert recorded_hash(seen.program) == FolderSettings().hash(seen.program)


def test_a_program_that_takes_too_long_is_given_up(tmp_path) -> None:
    (tmp_path / "a.nc").write_text(PART)
    (seen,) = watch_folder(tmp_path, FolderSettings(limit_s=0.05), once=True, settle_s=0.0)
    assert (seen.code, seen.line) == (LATE, "unproven: not finished in 0.05 s: raise --limit-s")


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_killed_watch_goes_on_where_it_was(tmp_path) -> None:
    """Killed while it simulates its second program: the first keeps its verdict, the second gets one."""
    first, second = tmp_path / "a.nc", tmp_path / "b.nc"
    first.write_text(NONSENSE)
    second.write_text(NONSENSE)
    words = [sys.executable, "-m", "chipload", "watch-folder", str(tmp_path), "--settle-s", "0"]
    watch = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"})
    assert watch.stdout is not None
    assert watch.stdout.readline().startswith("a.nc: chipload: a.nc: no motion")
    watch.kill()
    watch.communicate()
    assert not verdict_file(second).exists()
    seen = list(watch_folder(tmp_path, FolderSettings(), once=True, settle_s=0.0))
    assert [(one.program, one.code) for one in seen] == [(second, 2)]


def test_wrong_input_is_named(tmp_path) -> None:
    code, _, errors = call("watch-folder", tmp_path / "none", "--once")
    assert (code, errors) == (
        2,
        f"chipload: {tmp_path / 'none'}: no such folder: name the folder that programs are posted to\n",
    )
    with pytest.raises(InputError, match="--limit-s = 0: must be above 0"):
        FolderSettings(limit_s=0.0)
    (tmp_path / "job.toml").write_text("")
    with pytest.raises(InputError, match=r"--machine: state it in the job job\.toml"):
        FolderSettings(job=tmp_path / "job.toml", machine="vmc")
    (tmp_path / "a.nc").write_text(PART)
    with pytest.raises(InputError, match=r"gone\.toml"):
        list(watch_folder(tmp_path, FolderSettings(job=tmp_path / "gone.toml"), once=True, settle_s=0.0))
