"""The folders that a client may touch, and the paths in them.

A path is followed to what it really is (links resolved) before anything is opened; what then lies outside the folders
is refused. A relative path begins in a folder of the server, the first that has it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

from chipload.errors import InputError
from chipload.files import read_regular
from chipload.tables import LARGEST_FILE, parse_toml

#: endings of texts that name a machine or a material by its file
FILES = (".toml", ".ini")


@dataclass(frozen=True)
class NamedFolders:
    """The folders of the server.

    Parameters
    ----------
    roots : real paths, at least one
    """

    roots: tuple[Path, ...]

    @classmethod
    def of(cls, folders: Sequence[Path]) -> NamedFolders:
        """Return the real paths of folders.

        Raises
        ------
        InputError
            None is named, or one is not there.
        """
        if not folders:
            raise InputError("mcp: no folder is named: name each folder that may be touched")
        roots = []
        for folder in folders:
            if not folder.is_dir():
                raise InputError(f"{folder}: is not a folder: name each folder that may be touched")
            roots.append(folder.resolve())
        return cls(tuple(roots))

    def contains(self, path: Path) -> bool:
        """Return whether the real path of ``path``, or of the part of it that exists, lies in a folder."""
        try:
            real = path.resolve()
        except (OSError, RuntimeError, ValueError):
            return False
        return any(real.is_relative_to(root) for root in self.roots)

    def existing(self, name: str) -> Path:
        """Return the real path of a file or folder that is there.

        Raises
        ------
        InputError
            It lies outside the folders, or is not there.
        """
        for path in self._places(name):
            if path.exists() and self.contains(path):
                return path.resolve()
        if any(path.exists() and not self.contains(path) for path in self._places(name)):
            raise self._refusal(name)
        raise InputError(f"{name!r}: is not in the folders of this server: list_files shows what is")

    def new(self, name: str) -> Path:
        """Return the path of a file or folder that will be written; a relative one lies in the first folder.

        Raises
        ------
        InputError
            It lies outside the folders, or is one of them.
        """
        path = next(self._places(name))
        if not self.contains(path):
            raise self._refusal(name)
        if path.resolve() in self.roots:
            raise InputError(f"{name!r}: is a folder of this server itself: name a folder in it")
        return path.resolve()

    def source(self, name: str) -> str:
        """Return a shipped name as it is, and the real path of what ends as a file.

        Raises
        ------
        InputError
            The file lies outside the folders, or is not there.
        """
        is_file = PurePath(name).suffix.lower() in FILES or "/" in name or "\\" in name
        return str(self.existing(name)) if is_file else name

    def require_job(self, job: Path, overrides: Sequence[str] = ()) -> None:
        """Refuse a job that names a file outside the folders.

        Parameters
        ----------
        overrides : ``key.path=value`` texts, whose values are examined as well

        Raises
        ------
        InputError
            A text of the job leads outside the folders as a path; the message names the key.
        """
        raw = parse_toml(job.name, read_regular(job, job.name, LARGEST_FILE))
        texts = [*_texts(raw), *((key, value.strip(" '\"")) for key, _, value in (o.partition("=") for o in overrides))]
        for key, text in texts:
            if "\n" in text or "\0" in text:
                continue
            path = PurePath(text)
            leads = path.is_absolute() or ".." in path.parts or "\\" in text or (job.parent / text).is_symlink()
            there = leads or _exists(job.parent / text)
            if there and not self.contains(job.parent / text):
                raise InputError(f"{job.name}: {key} = {text!r}: lies outside the folders of this server")

    def _places(self, name: str) -> Iterator[Path]:
        """Yield where a path may be.

        Raises
        ------
        InputError
            The text cannot be the path of a file in a folder.
        """
        path = Path(name)
        if not name.strip() or "\0" in name or ".." in path.parts or "\\" in name:
            raise self._refusal(name)
        if path.is_absolute():
            if not self.contains(path):
                raise self._refusal(name)
            yield path
        else:
            yield from (root / path for root in self.roots)

    def _refusal(self, name: str) -> InputError:
        names = ", ".join(str(root) for root in self.roots)
        return InputError(f"{name!r}: lies outside the folders of this server: {names}")


def _exists(path: Path) -> bool:
    """Return whether a file is there; False for a text that no path can be."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def _texts(value: Any, key: str = "") -> Iterator[tuple[str, str]]:
    """Yield every text of a table with its key."""
    if isinstance(value, str):
        yield key, value
    elif isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _texts(inner, f"{key}.{name}" if key else str(name))
    elif isinstance(value, list):
        for k, inner in enumerate(value):
            yield from _texts(inner, f"{key}.{k}")
