"""Access to files: results and jobs inside the opened folder, and nothing outside it.

A **name** is a path relative to the opened folder, with `/`. It is followed to what it really is (links resolved)
before anything is opened; what then lies outside the folder is refused.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePosixPath

from chipload.errors import ChiploadError, InputError
from chipload.files import read_regular
from chipload.jobs import CAPABILITIES
from chipload.result import Verdict, read_summary
from chipload.result.load import LARGEST_SUMMARY, SUMMARY
from chipload.tables import parse_toml

#: folders within folders, and entries, that are searched
DEEPEST, ENTRIES = 8, 20_000
#: largest job [bytes]
LARGEST_JOB = 1_000_000


@dataclass(frozen=True)
class OpenedFolder:
    """The opened folder and the name of what is shown first: a result, a job, or nothing."""

    root: Path
    first: str | None


@dataclass(frozen=True)
class FolderEntry:
    """A result or a job in the opened folder, or (``unread``) a result that this version does not read; ``word`` is the
    verdict of a result, or why it is not read.
    """

    name: str
    kind: str
    word: str


def open_path(path: str | Path) -> OpenedFolder:
    """The folder of a result or of a job, or a folder that holds them. A result is opened with the folder that it lies
    in where its job is there too: its program is shown, and the job can be changed and run again.

    Raises
    ------
    InputError
        It is not there, or is no job and no result.
    """
    given = Path(path)
    try:
        real = given.resolve(strict=True)
    except (OSError, ValueError, RuntimeError) as err:
        err = err if isinstance(err, OSError) else OSError(0, str(err))
        raise InputError(f"{path}: cannot be opened: {err.strerror}: name a result folder, a job or a folder") from None
    if real.is_dir():
        return _with_its_job(real) if is_result(real) else OpenedFolder(real, None)
    if not is_job(real):
        raise InputError(f"{path}: is not a job: name a job file (TOML), a result folder or a folder that holds them")
    return OpenedFolder(real.parent, real.name)


def _with_its_job(result: Path) -> OpenedFolder:
    """A result, in the folder that it lies in where the job that it was made from is found there, else alone."""
    alone, above = OpenedFolder(result, "."), result.parent
    try:
        job = read_summary(result).provenance.inputs.get("job")
        found = job is not None and above != above.parent and find_by_hash(above, job) is not None
    except (ChiploadError, OSError):
        return alone
    return OpenedFolder(above, result.name) if found else alone


def resolve_name(root: Path, name: str) -> Path:
    """The real path of a name.

    Raises
    ------
    InputError
        It is not in the folder, or not there.
    """
    part = PurePosixPath(name)
    if part.is_absolute() or ".." in part.parts or "\\" in name or "\0" in name:
        raise InputError(f"{name!r}: is not a name in the opened folder")
    try:
        real = (root / part).resolve(strict=True)
    except (OSError, RuntimeError):
        raise InputError(f"{name!r}: is not in the opened folder") from None
    if not real.is_relative_to(root):
        raise InputError(f"{name!r}: is not in the opened folder")
    return real


def is_result(folder: Path) -> bool:
    """Whether a folder holds a summary of ours."""
    return verdict_of(folder) is not None


def verdict_of(folder: Path) -> Verdict | None:
    """The verdict of a result folder; None: it is none."""
    if not (folder / SUMMARY).is_file():
        return None
    try:
        return read_summary(folder).verdict
    except InputError:
        return None


def is_job(file: Path) -> bool:
    """Whether a TOML file has a table that makes it a job."""
    try:
        if file.suffix.lower() != ".toml":
            return False
        raw = parse_toml(file.name, read_regular(file, file.name, LARGEST_JOB))
    except InputError:
        return False
    return any(isinstance(raw.get(key), (dict, list)) for key in (c.key for c in CAPABILITIES))


def target_in(root: Path, out: str) -> Path:
    """The folder of a result that a person names, in the opened folder.

    Raises
    ------
    InputError
        It is not in the opened folder, or the folder itself.
    """
    part = PurePosixPath(out.strip())
    if not out.strip() or part.is_absolute() or ".." in part.parts or "\\" in out or "\0" in out:
        raise InputError(f"{out}: must be the name of a folder in the opened one")
    target = root / part
    try:
        above = next(p for p in (target, *target.parents) if p.exists())
    except OSError as err:
        raise InputError(f"{out[:40]}: cannot be written: {err.strerror}: name another folder") from None
    if not above.resolve().is_relative_to(root) or target == root:
        raise InputError(f"{out}: must be the name of a folder in the opened one")
    return target


def list_folder(root: Path) -> tuple[list[FolderEntry], bool]:
    """Results and jobs in the folder, by name, and whether no more than :data:`ENTRIES` files were there to look at."""
    out: list[FolderEntry] = []
    files = list(_walk(root, ENTRIES + 1))
    for path in files[:ENTRIES]:
        name = path.relative_to(root).as_posix()
        try:
            real = resolve_name(root, name)
        except InputError:
            continue
        if real.name == SUMMARY and path.name == SUMMARY:
            entry = _result_entry(root, path.parent)
            out += [] if entry is None else [entry]
        elif is_job(real):
            out.append(FolderEntry(name, "job", ""))
    return sorted(out, key=lambda f: (f.kind, f.name)), len(files) <= ENTRIES


def _result_entry(root: Path, folder: Path) -> FolderEntry | None:
    """The entry of a folder with a summary; None: the summary is not of chipload."""
    name = folder.relative_to(root).as_posix()
    try:
        return FolderEntry(name, "result", read_summary(folder).verdict.value)
    except InputError as err:
        why = str(err).replace(f"{folder / SUMMARY}: ", "")
    try:
        holds = json.loads(read_regular(folder / SUMMARY, SUMMARY, LARGEST_SUMMARY))
    except (InputError, ValueError, RecursionError):
        return None
    ours = isinstance(holds, dict) and ("schema_version" in holds or "holds" in holds)
    return FolderEntry(name, "unread", why) if ours else None


def find_by_hash(root: Path, wanted: str) -> Path | None:
    """The file in the folder from which a result states that it was made: ``wanted`` is `name sha256 hash`."""
    parts = wanted.rsplit(" sha256 ", 1)
    if len(parts) != 2:
        return None
    for path in _walk(root):
        if path.name == parts[0] and path.resolve().is_relative_to(root) and path.is_file():
            stat = path.stat()
            if _hash(path, stat.st_mtime_ns, stat.st_size) == parts[1]:
                return path
    return None


@lru_cache(maxsize=256)
def _hash(path: Path, _changed: int, _size: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _walk(root: Path, most: int = ENTRIES) -> Iterator[Path]:
    """At most so many files of the folder, links to folders not followed, hidden ones left out."""
    seen = 0
    for where, folders, files in os.walk(root):
        here = Path(where)
        deep = len(here.relative_to(root).parts) >= DEEPEST
        folders[:] = [] if deep else sorted(f for f in folders if not f.startswith("."))
        for name in sorted(files):
            if name.startswith("."):
                continue
            seen += 1
            if seen > most:
                return
            yield here / name
