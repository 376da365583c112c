"""The result folder, which is written completely or not at all.

Everything is written into a new folder next to the target and then renamed. A result of ours that is already there is
replaced at that moment; anything else that is there is left alone and refused.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import IO

from chipload.errors import InputError, OutputError
from chipload.files import HashingWriter, cannot_write, exchange_names, fresh_folder, read_regular, sweep
from chipload.memory import return_free_memory
from chipload.progress import Progress, part_of, silent
from chipload.report.bodies import SceneBody
from chipload.report.engagement import ENGAGEMENT, engagement_bytes
from chipload.report.page import page_bytes
from chipload.report.presentation import Content, Presentation
from chipload.report.removal import REMOVAL, removal_bytes, removal_meshes
from chipload.report.view_section import drawn_bodies, view_section
from chipload.result import Result
from chipload.result.history import maps_bytes, write_history
from chipload.result.load import HISTORY, MAPS, SUMMARY
from chipload.result.summary import summary_bytes
from chipload.simulation.checkpoint import require_ours

#: [bytes]
LARGEST_SUMMARY = 100_000_000
#: files and who makes them
Maker = tuple[str, Callable[[], Content]]
Makers = Sequence[Maker]
#: share of the progress of a folder before the pictures
FIRST = 0.3
#: files that every result has
NAMES = (SUMMARY, HISTORY, MAPS, REMOVAL, ENGAGEMENT, "scene.glb", "report.html")
#: endings of programs and of further files
SUFFIXES = (".ngc", ".nc", ".apt", ".npz", ".parquet", ".csv", ".toml")


def check_target(out: str | Path, ours: Callable[[Path], bool] | None = None, what: str = "result") -> Path:
    """Return the absolute target folder if a result may be written there; called before the work begins.

    Parameters
    ----------
    ours : whether a folder that holds something is an older ``what`` that may be replaced; None: a result of a run

    Raises
    ------
    InputError
        It is a file or a folder with something else in it.
    OutputError
        It lies where nothing can be written.
    """
    target = Path(out).absolute()
    try:
        if target.is_symlink() or (target.exists() and not target.is_dir()):
            raise InputError(f"--out {out}: is not a folder: name a folder that is new, empty or holds an older result")
        if target.exists() and any(target.iterdir()) and not (ours or _is_result)(target):
            raise InputError(
                f"--out {out}: holds files that are not a {what} of chipload: name a folder that is new, empty or "
                f"holds an older {what}"
            )
        above = next(p for p in target.parents if p.exists())
        sweep(above)
        with fresh_folder(above):
            pass
    except OSError as err:
        raise cannot_write(f"--out {out}", err) from None
    return target


def checkpoint_folder(out: str | Path) -> Path:
    """Return the checkpoint folder of a run, next to the folder of its result.

    Raises
    ------
    InputError
        Something else is there.
    """
    target = Path(out).absolute()
    folder = target.with_name(f"{target.name}.unfinished")
    require_ours(folder)
    return folder


def write_finished(
    result: Result,
    presentation: Presentation,
    out: str | Path,
    progress: Progress = silent,
    verdict: Callable[[], None] | None = None,
) -> Path:
    """Write the result of a run as :func:`write_result`; if the folder was filled meanwhile, the run's work is kept.

    Raises
    ------
    OutputError
        The folder holds something else by now, or as :func:`write_result`.
    """
    try:
        return write_result(result, presentation, out, progress, verdict)
    except InputError as err:
        raise OutputError(f"{err}; the same command continues") from None


def write_result(
    result: Result,
    presentation: Presentation,
    out: str | Path,
    progress: Progress = silent,
    verdict: Callable[[], None] | None = None,
) -> Path:
    """Write the folder of a result and return it: history, summary, maps, programs, then scene, report and stock.

    Parameters
    ----------
    verdict : called when all that the verdict says is on the disk, before the pictures are made

    Raises
    ------
    InputError
        The folder cannot be written or the disk is full; nothing is left behind, an older result stays.
    """
    rows: dict[str, int] = {}
    digest = sha256()

    def history(file: IO[bytes]) -> None:
        rows.update(write_history(result, HashingWriter(file, digest)))

    makers: list[Maker] = [
        (HISTORY, lambda: history),
        (SUMMARY, lambda: summary_bytes(result, rows, digest.hexdigest())),
    ]
    if result.maps:
        makers.append((MAPS, lambda: maps_bytes(result)))

    def pictures() -> Makers:
        """Scene, report and what the page shows of the stock, which nothing of the verdict needs."""
        blanks, samples, bodies = presentation.blanks(), presentation.samples(), list[SceneBody]()
        stocks = cache(lambda: removal_meshes(result, blanks))

        def scene() -> bytes:
            # the page needs some bodies of it, and a scene may be large: only they are kept
            shown, glb = stocks(), presentation.scene()
            bodies.extend(drawn_bodies(result, glb, shown))
            return glb

        def view() -> list[str]:
            return view_section(result, tuple(bodies), stocks(), blanks, samples)

        makers: list[Maker] = [
            ("scene.glb", scene),
            ("report.html", lambda: page_bytes(result, presentation, view())),
        ]
        if blanks:
            makers.append((REMOVAL, lambda: removal_bytes(result, stocks(), blanks)))
        if samples:
            makers.append((ENGAGEMENT, lambda: engagement_bytes(result, samples)))
        return makers

    return write_files(
        makers, out, lambda: presentation.files(result), last=pictures, before_last=verdict, progress=progress
    )  # fmt: skip


def write_files(
    makers: Makers,
    out: str | Path,
    more: Callable[[], Mapping[str, Content]] | None = None,
    *,
    last: Callable[[], Makers] | None = None,
    before_last: Callable[[], None] | None = None,
    ours: Callable[[Path], bool] | None = None,
    what: str = "result",
    progress: Progress = silent,
) -> Path:
    """Write a folder of files, completely or not at all, and return it.

    Parameters
    ----------
    makers : names and who makes their content
    more : further files, made after them
    last : names and makers of files made after all others, asked for then; ``before_last`` is called before them
    ours, what : as in :func:`check_target`

    Raises
    ------
    InputError, OutputError
        As :func:`check_target` and :func:`write_result`.
    """
    target = check_target(out, ours, what)
    made = [p for p in target.parents if not p.exists()]
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with fresh_folder(target.parent) as fresh:
            share = 1.0 if last is None else FIRST
            _write_all(fresh, makers, part_of(progress, 0.0, share))
            for name, data in (more() if more is not None else {}).items():
                _write(fresh / name, data)
            if before_last is not None:
                before_last()
            if last is not None:
                _write_all(fresh, last(), part_of(progress, share, 1.0))
            fresh.chmod(0o777 & ~_umask())
            _swap(fresh, target)
        progress(1.0, "written")
    except OSError as err:
        raise cannot_write(f"--out {out}", err) from None
    finally:
        if not target.exists():
            for folder in made:
                with contextlib.suppress(OSError):
                    folder.rmdir()
    return target


def _is_result(folder: Path) -> bool:
    """Return whether a folder contains a result of chipload and no other files."""
    try:
        holds = json.loads(read_regular(folder / SUMMARY, SUMMARY, LARGEST_SUMMARY))
        return (
            isinstance(holds, dict)
            and ("schema_version" in holds or "holds" in holds)
            and all(p.name in NAMES or p.suffix in SUFFIXES or p.stem == "0-feeds" for p in folder.iterdir())
        )
    except (OSError, ValueError, RecursionError, InputError):
        return False


def _write_all(folder: Path, makers: Makers, progress: Progress) -> None:
    """Make files one after the other and write them."""
    for k, (name, make) in enumerate(makers):
        progress(k / len(makers), name)
        _write(folder / name, make())
        return_free_memory()


def _write(path: Path, data: Content) -> None:
    with path.open("wb") as file:
        if isinstance(data, bytes):
            file.write(data)
        else:
            data(file)
        file.flush()
        os.fsync(file.fileno())


def _swap(fresh: Path, target: Path) -> None:
    """Put ``fresh`` in the place of ``target`` at one moment; what was there is then where ``fresh`` was."""
    if not target.exists():
        fresh.rename(target)
    elif not exchange_names(fresh, target):
        with fresh_folder(target.parent) as old:
            target.rename(old)
            try:
                fresh.rename(target)
            except BaseException:
                old.rename(target)
                raise


def _umask() -> int:
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
