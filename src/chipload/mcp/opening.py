"""A second line behind :mod:`chipload.mcp.folders`: the process of the server opens no other file.

A file that a job names may name further files. An audit hook of Python sees each file before it is opened, created,
renamed or removed, and refuses those outside the folders, of Python and of its libraries. It cannot be taken off again
and does not see files that a library opens by itself in C; these are the files that a job names, which are examined
before.
"""

from __future__ import annotations

import os
import sys
import sysconfig
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import chipload
from chipload.mcp.folders import NamedFolders

#: events that change files, and how many of their first arguments are paths
CHANGES = {
    "os.remove": 1, "os.rename": 2, "os.rmdir": 1, "os.mkdir": 1, "os.link": 2, "os.symlink": 2, "os.truncate": 1,
    "os.chmod": 1, "os.chown": 1, "shutil.rmtree": 1, "shutil.move": 2, "shutil.copyfile": 2,
}  # fmt: skip
#: what libraries read of the system
SYSTEM = ("/usr", "/lib", "/lib64", "/proc", "/sys", "/dev", "/etc/localtime", "/etc/mime.types", "/etc/ld.so.cache")
#: flags of a file that is opened to be written
WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


class OpenedFiles:
    """Decides which files the process of the server may open.

    Parameters
    ----------
    folders : of the server
    caches : further folders that may be written: compiled functions, temporary files
    """

    def __init__(self, folders: NamedFolders, caches: Sequence[Path]) -> None:
        installed = [sys.prefix, sys.base_prefix, *sysconfig.get_paths().values(), *filter(None, sys.path)]
        self.written = (*(str(root) for root in folders.roots), *(str(path.resolve()) for path in caches))
        own = Path(chipload.__file__).parent
        self.read = (*self.written, str(own.resolve()), *(os.path.realpath(path) for path in installed), *SYSTEM)

    def allows(self, path: Any, writes: bool) -> bool:
        """Return whether a file may be opened; a number is a file that is open already."""
        if isinstance(path, int) or path is None:
            return True
        real = os.path.realpath(os.fsdecode(path))
        if real == os.devnull:
            return True
        return any(real == root or real.startswith(root.rstrip(os.sep) + os.sep) for root in self._roots(writes))

    def _roots(self, writes: bool) -> tuple[str, ...]:
        return self.written if writes else self.read

    def hook(self, event: str, args: tuple[Any, ...]) -> None:
        """Refuse an event on a file that may not be touched.

        Raises
        ------
        PermissionError
            It may not be touched.
        """
        if event == "open":
            mode, flags = args[1], args[2]
            writes = bool(flags & WRITES) if isinstance(flags, int) else any(c in (mode or "") for c in "wxa+")
            paths = args[:1]
        elif event in CHANGES:
            writes, paths = True, args[: CHANGES[event]]
        else:
            return
        for path in paths:
            if not self.allows(path, writes):
                raise PermissionError(f"{os.fsdecode(path)}: lies outside the folders of this server")


def close_other_folders(folders: NamedFolders) -> None:
    """Let this process open files in the folders, and those of Python, alone, as long as it runs.

    Temporary files have a folder of their own.
    """
    temporary = Path(tempfile.mkdtemp(prefix="chipload-mcp-"))
    tempfile.tempdir = str(temporary)
    caches = [temporary, Path(chipload.__file__).parent]
    if "NUMBA_CACHE_DIR" in os.environ:
        caches.append(Path(os.environ["NUMBA_CACHE_DIR"]))
    sys.addaudithook(OpenedFiles(folders, caches).hook)
