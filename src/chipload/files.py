"""A file appears whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from chipload.errors import InputError


def write_whole(path: str | Path, data: bytes) -> None:
    """Write beside the target and rename; what was there stays until the new file is whole.

    Raises
    ------
    InputError
        The folder is missing or cannot be written, or the disk is full; nothing is left behind.
    """
    target = Path(path)
    fresh: str | None = None
    try:
        handle, fresh = tempfile.mkstemp(prefix=".chipload-", dir=target.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        mask = os.umask(0o022)
        os.umask(mask)
        Path(fresh).chmod(0o666 & ~mask)
        Path(fresh).replace(target)
        fresh = None
    except OSError as err:
        raise InputError(f"{target}: cannot be written: {err.strerror}: name another place") from None
    finally:
        if fresh is not None:
            Path(fresh).unlink(missing_ok=True)
