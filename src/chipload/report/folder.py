"""A result folder appears whole or not at all.

Everything is written into a new folder beside the target and then renamed. A result of ours that is already there is
replaced at that moment; anything else that is there is left alone and refused.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import IO, Any, NamedTuple

from chipload.errors import InputError
from chipload.progress import Progress, silent
from chipload.report import reading
from chipload.report.history import history_bytes
from chipload.report.impeller.outcome import Milled
from chipload.report.impeller.outcome import verdict as milled_verdict
from chipload.report.impeller.page import page_bytes as milled_page
from chipload.report.impeller.programs import program_files as milled_files
from chipload.report.impeller.scene import scene_bytes as milled_scene
from chipload.report.impeller.summary import history_bytes as milled_history
from chipload.report.impeller.summary import summary_bytes as milled_summary
from chipload.report.outcome import Outcome
from chipload.report.outcome import verdict as planned_verdict
from chipload.report.page import page_bytes
from chipload.report.programs import program_files
from chipload.report.reading import Read
from chipload.report.scene import scene_bytes
from chipload.report.shell import files as shell_files
from chipload.report.shell import outcome as shell_outcome
from chipload.report.shell import page as shell_page
from chipload.report.shell import summary as shell_summary
from chipload.report.shell.outcome import ShellOutcome
from chipload.report.summary import summary_bytes
from chipload.report.wall import page as wall_page
from chipload.report.wall import scene as wall_scene
from chipload.report.wall import summary as wall_summary
from chipload.report.wall.outcome import Walled
from chipload.simulation.unfinished import require_ours

SUMMARY = "summary.json"
#: an outcome of any kind
Shown = Outcome | Read | Milled | ShellOutcome | Walled
#: what a file holds, or what writes it bit by bit
Content = bytes | Callable[[IO[bytes]], None]
#: files and who makes them
Makers = list[tuple[str, Callable[[], Content]]]
#: files that every result has
NAMES = (SUMMARY, "history.parquet", "scene.glb", "report.html")
#: files that some have
MORE = (shell_files.PATH, shell_files.TABLE, shell_files.HAL)


class Kind(NamedTuple):
    """How an outcome is shown: the files of :data:`NAMES`, its programs and other files, and its verdict."""

    files: tuple[Callable[[Any], Content], ...]
    programs: Callable[[Any], dict[str, bytes]]
    verdict: Callable[[Any], tuple[bool, str]]


#: kinds of outcomes
KINDS: dict[type, Kind] = {
    Outcome: Kind((summary_bytes, history_bytes, scene_bytes, page_bytes), program_files, planned_verdict),
    Read: Kind(
        (reading.summary_bytes, reading.history_writer, reading.scene_bytes, reading.page_bytes),
        reading.program_files,
        reading.verdict,
    ),
    Milled: Kind((milled_summary, milled_history, milled_scene, milled_page), milled_files, milled_verdict),
    ShellOutcome: Kind(
        (shell_summary.summary_bytes, shell_summary.history_bytes, shell_summary.scene_bytes, shell_page.page_bytes),
        shell_files.program_files,
        shell_outcome.verdict,
    ),
    Walled: Kind(
        (wall_summary.summary_bytes, wall_summary.history_bytes, wall_scene.scene_bytes, wall_page.page_bytes),
        wall_summary.program_files,
        wall_summary.verdict,
    ),
}


def verdict(outcome: Shown) -> tuple[bool, str]:
    """Whether everything holds, and one sentence that says it."""
    return KINDS[type(outcome)].verdict(outcome)


def check_target(out: str | Path, ours: Callable[[Path], bool] | None = None, what: str = "result") -> Path:
    """The absolute target folder, if a result may be put there; asked before the work begins.

    Parameters
    ----------
    ours : whether a folder that holds something is an older ``what`` that may be replaced; None: a result of a run

    Raises
    ------
    InputError
        It is a file, a folder with something else in it, or lies where nothing can be written.
    """
    target = Path(out).absolute()
    if target.is_symlink() or (target.exists() and not target.is_dir()):
        raise InputError(f"--out {out}: is not a folder: name a folder that is new, empty or holds an older result")
    try:
        if target.exists() and any(target.iterdir()) and not (ours or _ours)(target):
            raise InputError(
                f"--out {out}: holds files that are no {what} of chipload: name a folder that is new, empty or "
                f"holds an older {what}"
            )
        above = next(p for p in target.parents if p.exists())
        with tempfile.TemporaryDirectory(prefix=".chipload-", dir=above):
            pass
    except OSError as err:
        raise InputError(f"--out {out}: cannot be written: {err.strerror}: name another folder") from None
    return target


def unfinished_folder(out: str | Path) -> Path:
    """Where a run keeps what it has finished until its result is written: beside it.

    Raises
    ------
    InputError
        Something else is there.
    """
    target = Path(out).absolute()
    folder = target.with_name(f"{target.name}.unfinished")
    require_ours(folder)
    return folder


def write_result(outcome: Shown, out: str | Path, progress: Progress = silent) -> Path:
    """Write the whole result folder and return it.

    Raises
    ------
    InputError
        The folder cannot be written or the disk is full; nothing is left behind, an older result stays.
    """
    made = KINDS[type(outcome)]
    makers: Makers = [(name, partial(make, outcome)) for name, make in zip(NAMES, made.files, strict=True)]
    return write_files(makers, out, partial(made.programs, outcome), progress=progress)


def write_files(
    makers: Makers,
    out: str | Path,
    more: Callable[[], dict[str, bytes]] | None = None,
    *,
    ours: Callable[[Path], bool] | None = None,
    what: str = "result",
    progress: Progress = silent,
) -> Path:
    """Write a folder of files, whole or not at all, and return it.

    Parameters
    ----------
    makers : names and who makes their content
    more : further files, made last
    ours, what : as in :func:`check_target`

    Raises
    ------
    InputError
        As :func:`write_result`.
    """
    target = check_target(out, ours, what)
    made = [p for p in target.parents if not p.exists()]
    fresh: Path | None = None
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        fresh = Path(tempfile.mkdtemp(prefix=".chipload-", dir=target.parent))
        for k, (name, make) in enumerate(makers):
            progress(k / (len(makers) + 1), name)
            _write(fresh / name, make())
        progress(len(makers) / (len(makers) + 1), "programs")
        for name, data in (more() if more is not None else {}).items():
            _write(fresh / name, data)
        fresh.chmod(0o777 & ~_umask())
        _swap(fresh, target)
        progress(1.0, "written")
    except OSError as err:
        raise InputError(f"--out {out}: cannot be written: {err.strerror}: nothing was left there") from None
    finally:
        if fresh is not None:
            shutil.rmtree(fresh, ignore_errors=True)
        if not target.exists():
            for folder in made:
                with contextlib.suppress(OSError):
                    folder.rmdir()
    return target


def _ours(folder: Path) -> bool:
    """Whether a folder holds a result of chipload and nothing that it would not write."""
    try:
        holds = json.loads((folder / SUMMARY).read_bytes())
        return (
            isinstance(holds, dict)
            and "holds" in holds
            and all(
                p.name in NAMES + MORE or p.suffix in (".ngc", ".nc", ".apt", ".npz") or p.stem == reading.FEEDS
                for p in folder.iterdir()
            )
        )
    except (OSError, ValueError):
        return False


def _write(path: Path, data: Content) -> None:
    with path.open("wb") as file:
        if isinstance(data, bytes):
            file.write(data)
        else:
            data(file)
        file.flush()
        os.fsync(file.fileno())


def _swap(fresh: Path, target: Path) -> None:
    """Put ``fresh`` in the place of ``target``; what was there goes only when the new one stands."""
    if not target.exists():
        fresh.rename(target)
        return
    old = Path(tempfile.mkdtemp(prefix=".chipload-", dir=target.parent))
    target.rename(old)
    try:
        fresh.rename(target)
    except BaseException:
        old.rename(target)
        raise
    shutil.rmtree(old, ignore_errors=True)


def _umask() -> int:
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
