"""Files: one that is read is a regular file of limited size; one that is written appears whole or not at all.

Notation: a file or folder that is being written has a temporary name, which begins with :data:`FRESH`, in the same
folder, and is locked while its writer runs. An unlocked one was left by a killed writer: :func:`sweep` removes it.
"""

from __future__ import annotations

import codecs
import contextlib
import ctypes
import difflib
import errno
import hashlib
import io
import os
import re
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from chipload.errors import InputError, OutputError
from chipload.processes import lock_file

if TYPE_CHECKING:
    from hashlib import _Hash as Hash

#: beginning of the temporary name of a file or folder that is being written
FRESH = ".chipload-"
_OURS = re.compile(r"\.chipload-[a-z0-9_]{8}")
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_KINDS = (
    (stat.S_ISDIR, "a folder"), (stat.S_ISFIFO, "a pipe"), (stat.S_ISCHR, "a device"), (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)  # fmt: skip


def is_file(path: str | Path) -> bool:
    """Whether a path leads to a regular file; False for a name that no file can have.

    >>> is_file("a" * 5000), is_file("a" + chr(0))
    (False, False)
    """
    try:
        return stat.S_ISREG(os.stat(path).st_mode)
    except (OSError, ValueError):
        return False


def require_utf8(path: Path) -> None:
    """Refuse a file whose name, or that of its folder, is not text in UTF-8: a result could not name it.

    >>> require_utf8(Path("part-7/job.toml"))

    Raises
    ------
    InputError
        With the name that is meant.
    """
    for name in (path.name, path.absolute().parent.name):
        try:
            name.encode("utf-8")
        except UnicodeEncodeError:
            raise InputError(f"{name!a}: this name is not UTF-8, and a result cannot state it: rename it") from None


def near_name(path: str | Path) -> str:
    """The name of the file of the same folder and ending that is most similar to a missing one; empty: none is."""
    missing = Path(path)
    try:
        names = [entry.name for entry in os.scandir(missing.absolute().parent) if entry.is_file()]
    except (OSError, ValueError):
        return ""
    stems = {Path(name).stem: name for name in names if Path(name).suffix.lower() == missing.suffix.lower()}
    return next((stems[stem] for stem in difflib.get_close_matches(missing.stem, stems, 1)), "")


@contextmanager
def open_regular(path: str | Path, label: str, most: int, remedy: str = "split it") -> Iterator[IO[bytes]]:
    """A regular file of at most ``most`` bytes, opened for reading; it never waits for a pipe or a device.

    Parameters
    ----------
    label : name of the file in messages
    most : greatest size [bytes]; a file that grows while it is read is the reader's to limit
    remedy : what to do with a larger one

    Raises
    ------
    InputError
        The file cannot be opened or read, is not a regular one, or is larger.
    """
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with os.fdopen(handle, "rb") as file:
            found = os.fstat(handle)
            if not stat.S_ISREG(found.st_mode):
                kind = next((name for test, name in _KINDS if test(found.st_mode)), "no file")
                raise InputError(f"{label}: cannot be read: is {kind}: name a regular file")
            if found.st_size > most:
                raise InputError(f"{label}: {found.st_size} bytes: must be at most {most} bytes: {remedy}")
            yield file
    except OSError as err:
        near = near_name(path) if err.errno == errno.ENOENT else ""
        meant = f": did you mean {near}?" if near else ""
        raise InputError(f"{label}: cannot be read: {err.strerror or err}{meant}") from None
    except ValueError as err:
        if "null" not in str(err):
            raise
        raise InputError(f"{label}: cannot be read: no file has a name with a zero byte in it") from None


def read_regular(path: str | Path, label: str, most: int, remedy: str = "split it") -> bytes:
    """The bytes of a regular file of at most ``most`` bytes; the parameters are those of :func:`open_regular`.

    Raises
    ------
    InputError
        As :func:`open_regular`.
    """
    with open_regular(path, label, most, remedy) as file:
        data = file.read(most + 1)
        if len(data) > most:
            raise InputError(f"{label}: more than {most} bytes: must be at most {most} bytes: {remedy}")
        return data


def is_utf16(data: bytes) -> bool:
    """Whether a text begins with a byte order mark of UTF-16."""
    return data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))


def decode_text(data: bytes) -> str:
    """The text of a file that others wrote: UTF-16 where a byte order mark says so, else UTF-8, else Latin-1.

    Examples
    --------
    >>> [decode_text("Ø10".encode(kind)) for kind in ("utf-8", "utf-8-sig", "utf-16", "latin-1")]
    ['Ø10', 'Ø10', 'Ø10', 'Ø10']
    """
    if is_utf16(data):
        return data.decode("utf-16", "replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def hash_of(path: str | Path) -> str:
    """SHA-256 of a regular file, in hexadecimal digits.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    out = hashlib.sha256()
    with open_regular(path, str(path), sys.maxsize) as file:
        while block := file.read(1 << 20):
            out.update(block)
    return out.hexdigest()


class HashingWriter(io.RawIOBase):
    """A binary file whose bytes go into a hash as they are written; it is not closed with this."""

    def __init__(self, file: IO[bytes], digest: Hash) -> None:
        self._file, self._digest = file, digest

    def writable(self) -> bool:
        """Whether bytes can be written: always."""
        return True

    def tell(self) -> int:
        """Number of bytes so far."""
        return self._file.tell()

    def write(self, data: Any) -> int:
        """Write bytes and return their number."""
        self._digest.update(data)
        return self._file.write(data)


def is_full(err: OSError) -> bool:
    """Whether an error means that no space is left."""
    return err.errno in _FULL


def cannot_write(target: str | Path, err: OSError) -> OutputError:
    """The error for a ``target`` that cannot be written.

    >>> str(cannot_write("a.nc", OSError(errno.ENOSPC, "No space left on device")))
    'a.nc: cannot be written: No space left on device: free space; the same command continues'
    """
    remedy = "free space; the same command continues" if is_full(err) else "name another place"
    return OutputError(f"{target}: cannot be written: {err.strerror or err}: {remedy}")


def write_whole(path: str | Path, data: bytes) -> None:
    """Write a temporary file in the same folder and rename it; the old file remains until the new one is complete.

    Raises
    ------
    OutputError
        The folder is missing or cannot be written, or the disk is full; nothing is left behind.
    """
    target = Path(path)
    fresh: str | None = None
    try:
        handle, fresh = tempfile.mkstemp(prefix=FRESH, dir=target.parent)
        with os.fdopen(handle, "wb") as file:
            _lock(handle)
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        mask = os.umask(0o022)
        os.umask(mask)
        Path(fresh).chmod(0o666 & ~mask)
        Path(fresh).replace(target)
        fresh = None
    except OSError as err:
        raise cannot_write(target, err) from None
    finally:
        if fresh is not None:
            Path(fresh).unlink(missing_ok=True)


@contextmanager
def fresh_folder(above: Path) -> Iterator[Path]:
    """A new hidden folder in ``above``, locked by this process and removed at the end of the context.

    Raises
    ------
    OSError
        It cannot be made.
    """
    while True:
        folder = Path(tempfile.mkdtemp(prefix=FRESH, dir=above))
        handle = _lock_of(folder)
        if handle != _GONE:
            break
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if handle is not None:
            os.close(handle)


def sweep(above: Path) -> None:
    """Remove what killed writers left in a folder: entries with our prefix, of this user, locked by no process."""
    if sys.platform == "win32":
        return
    with contextlib.suppress(OSError):
        for entry in list(os.scandir(above)):
            with contextlib.suppress(OSError):
                if not _OURS.fullmatch(entry.name) or entry.stat(follow_symlinks=False).st_uid != os.geteuid():
                    continue
                handle = os.open(entry.path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW)
                try:
                    lock_file(handle)
                    if entry.is_dir(follow_symlinks=False):
                        shutil.rmtree(entry.path, ignore_errors=True)
                    elif entry.is_file(follow_symlinks=False):
                        os.unlink(entry.path)
                finally:
                    os.close(handle)


def exchange_names(a: Path, b: Path) -> bool:
    """Exchange the names of two folders atomically; False where the system cannot."""
    if not sys.platform.startswith("linux"):
        return False
    change = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    here, swap = -100, 2  # AT_FDCWD, RENAME_EXCHANGE
    return change is not None and change(here, os.fsencode(a), here, os.fsencode(b), swap) == 0


_GONE = -1


def _lock_of(folder: Path) -> int | None:
    """A handle that locks the folder; None: this file system has no locks; ``_GONE``: a sweep came first."""
    if sys.platform == "win32":
        return None
    try:
        handle = os.open(folder, os.O_RDONLY | os.O_NOFOLLOW)
    except FileNotFoundError:
        return _GONE
    try:
        lock_file(handle)
        if os.stat(folder).st_ino == os.fstat(handle).st_ino:
            return handle
    except (BlockingIOError, FileNotFoundError):
        pass
    except OSError as err:
        if err.errno in (errno.ENOLCK, errno.ENOTSUP, errno.EBADF):
            os.close(handle)
            return None
    os.close(handle)
    return _GONE


def _lock(handle: int) -> None:
    """Mark a file as being written, where the file system has locks."""
    if sys.platform != "win32":
        with contextlib.suppress(OSError):
            lock_file(handle)
